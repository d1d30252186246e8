"""The page of every worked example as a reader on a phone has it: 360 px, a finger, dark and light, the policy of its script."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Any

import pytest

from cli.examples import describe, names
from tests.cli.pages import Opened
from tests.conftest import Dalembert

WITH_PAGES = {"balance", "field", "mechanism", "forces", "simulate", "spin"}
# these are balanced without phases
WITHOUT = {"fan-four-run", "two-planes-four-run"}
PAGES = [
    name
    for name in names()
    if shlex.split(describe(name)["command"])[1] in WITH_PAGES and name not in WITHOUT
]
# what can be pressed or typed into, and is too small for a finger or has no name; words that are hard to read
LOOK = """
const shown = (e) => { const r = e.getBoundingClientRect(); return r.width > 0 && r.height > 0; };
const called = (e) => `${e.tagName} ${e.dataset.name ?? e.getAttribute("aria-label") ?? e.textContent}`;
const controls = [...document.querySelectorAll("button, input, select, summary, textarea, a[href], .grip")].filter(shown);
const area = (e) => (e.type === "checkbox" ? e.closest("label") : e).getBoundingClientRect();
const named = (e) => e.getAttribute("aria-label") || e.textContent.trim() || [...(e.labels ?? [])].some((l) => l.textContent.trim()) || e.matches(".grip");
const numbers = (text) => text.match(/[\\d.]+/g).map(Number);
const light = (c) => c.slice(0, 3).map((x) => x / 255).map((x) => (x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4)).reduce((sum, x, k) => sum + [0.2126, 0.7152, 0.0722][k] * x, 0);
const behind = (e) => { for (; e; e = e.parentElement) { const c = numbers(getComputedStyle(e).backgroundColor); if ((c[3] ?? 1) > 0.9) return c; } return [255, 255, 255]; };
const words = [...document.querySelectorAll("body *")].filter((e) => shown(e) && !e.disabled && [...e.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim()));
const contrast = (e) => {
  const style = getComputedStyle(e);
  const [a, b] = [light(numbers(e.closest("svg") ? style.fill : style.color)), light(behind(e))];
  return (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
};
return {
  wide: document.documentElement.scrollWidth,
  small: controls.filter((e) => Math.min(area(e).width, area(e).height) < (e.matches(".grip") ? 31.5 : 39.5)).map(called),
  nameless: controls.filter((e) => !named(e)).map(called),
  faint: words.filter((e) => contrast(e) < 4.5).map(called),
};
"""


@pytest.mark.slow
@pytest.mark.parametrize("name", PAGES)
def test_a_worked_example(name: str, dalembert: Dalembert, tmp_path: Path, browser: Any) -> None:
    assert dalembert("examples", name).returncode == 0
    done = dalembert(*shlex.split(describe(name)["command"])[1:], "--page", "page.html")
    assert done.returncode == 0, done.stderr
    page = Opened(browser, tmp_path / "page.html")
    phone = {"width": 360, "height": 740, "deviceScaleFactor": 2, "mobile": True}
    try:
        for scheme in ("light", "dark"):
            browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", phone)
            features = [{"name": "prefers-color-scheme", "value": scheme}]
            browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": features})
            browser.refresh()
            assert page("return document.documentElement.scrollWidth") <= 360
            page("document.querySelectorAll('details').forEach((d) => (d.open = true))")
            page("document.querySelectorAll('#toggles button[aria-pressed=false]').forEach((b) => b.click())")
            assert page(LOOK) == {"wide": 360, "small": [], "nameless": [], "faint": []}
        assert page("return document.querySelector('meta[http-equiv]').content").startswith(
            "default-src 'none'"
        )
        assert page.faults() == []
        # the policy holds: a script that is put in later does not run
        page(
            "const s = document.createElement('script'); s.textContent = 'window.broken = 1'; document.body.append(s)"
        )
        assert page("return window.broken ?? null") is None
        assert "Content Security Policy" in page.faults()[0]
    finally:
        browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})
