"""Reports on a phone: no page is wider than the screen, wide tables scroll by themselves."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.cli.pages import Opened
from tests.conftest import Dalembert
from tests.four_bars import body, four_bar

FOUR_BAR = four_bar(*[body(1, (20, 0))] * 3, head="gravity = [0, -9.81]", rates="speed = 3")
ROTOR = "rotor,name,mass_g,radius_mm,angle_deg,z_mm\nfan of the main blower,W1,20,50,10,0\nfan of the main blower,W2,30,60,120,40\n"
CALLS = {
    "poses": ("mechanism", "m.toml", "--over", "0deg:360deg:30deg"),
    "forces": ("forces", "m.toml", "--over", "0deg:360deg:60deg"),
    "rotor": (
        *("balance", "r.csv", "--plane", "A:0mm:20mm", "--plane", "B:50mm:20mm"),
        *("--grade", "G2.5", "--speed", "3000rpm", "--rotor-mass", "12kg"),
    ),
    "export": ("export", "m.toml", "-o", "m.urdf"),
}


def report(dalembert: Dalembert, tmp_path: Path, call: str) -> Path:
    (tmp_path / "m.toml").write_text(FOUR_BAR)
    (tmp_path / "r.csv").write_text(ROTOR)
    done = dalembert(
        *CALLS[call], "--report", "report.html", "--about", "title=A title of some length for a phone"
    )
    assert done.returncode == 0, done.stderr
    return tmp_path / "report.html"


def test_every_table_scrolls_by_itself(dalembert: Dalembert, tmp_path: Path) -> None:
    text = report(dalembert, tmp_path, "forces").read_text()
    assert text.count("<table>") == text.count('<div class="wide"><table>') > 0
    assert ".wide { overflow-x: auto }" in text


@pytest.mark.slow
@pytest.mark.parametrize("call", CALLS)
def test_it_is_as_wide_as_the_screen(dalembert: Dalembert, tmp_path: Path, browser: Any, call: str) -> None:
    opened = Opened(browser, report(dalembert, tmp_path, call))
    try:
        for width in (320, 390, 768):
            opened.browser.execute_cdp_cmd(
                "Emulation.setDeviceMetricsOverride",
                {"width": width, "height": 900, "deviceScaleFactor": 2, "mobile": width < 700},
            )
            assert opened("return document.documentElement.scrollWidth") <= width
            # what is cut off can be scrolled to
            assert opened(
                "return [...document.querySelectorAll('table')].every(t => "
                "t.parentElement.scrollWidth >= t.getBoundingClientRect().width - 1)"
            )
    finally:
        opened.browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
