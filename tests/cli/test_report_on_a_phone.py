"""Reports on a phone: no page is wider than the screen, wide tables scroll by themselves."""

from __future__ import annotations

import base64
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cli.examples import EXAMPLES
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
    "field": ("field", "f.csv", "--blades", "12", "--max-residual", "0.7mm_s", "--zone-class", "2-rigid"),
}
RUNS = """run,date,sensor,amplitude_mm_s,phase_deg,trial_plane,trial_mass_g,trial_angle_deg
initial,2025-03-11,drive end of the fan,5.2,116,,,
trial,2025-03-11,drive end of the fan,3.9,75,A,40,20
1,14.03.2025,drive end of the fan,0.61,200,A,88,327
"""


def report(dalembert: Dalembert, tmp_path: Path, call: str) -> Path:
    (tmp_path / "m.toml").write_text(FOUR_BAR)
    (tmp_path / "r.csv").write_text(ROTOR)
    (tmp_path / "f.csv").write_text(RUNS)
    done = dalembert(
        *CALLS[call], "--report", "report.html", "--about", "title=A title of some length for a phone"
    )
    assert done.returncode == 0, done.stderr
    return tmp_path / "report.html"


@pytest.mark.slow
def test_every_table_scrolls_by_itself(dalembert: Dalembert, tmp_path: Path) -> None:
    text = report(dalembert, tmp_path, "forces").read_text()
    assert text.count("<table>") == text.count('<div class="wide"><table>') > 0
    assert ".wide, figure { overflow-x: auto }" in text


@pytest.mark.slow
@pytest.mark.parametrize("call", CALLS)
def test_it_is_as_wide_as_the_screen(dalembert: Dalembert, tmp_path: Path, browser: Any, call: str) -> None:
    opened = Opened(browser, report(dalembert, tmp_path, call))
    try:
        for width in (320, 360, 390, 768):
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
            # so can a picture, whose words would be too small to read
            assert opened(
                "return [...document.querySelectorAll('figure svg')].every(s => s.getBoundingClientRect().width >= "
                "Math.min(530, s.parentElement.clientWidth * 2))"
            )
    finally:
        opened.browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


@pytest.mark.slow
def test_a_customer_s_report_is_two_pages_of_a4(dalembert: Dalembert, tmp_path: Path, browser: Any) -> None:
    """An initial run and a trial run; the verdict, bars, what to add and the dials are on the first page."""
    runs = "".join(line for line in RUNS.splitlines(keepends=True) if not line.startswith("1,"))
    (tmp_path / "f.csv").write_text(runs)
    options = ("--reading-error", "2%,2deg", "--report", "report.html")
    done = dalembert(*CALLS["field"], *options)
    assert done.returncode == 0, done.stderr
    opened = Opened(browser, tmp_path / "report.html")
    paper = {"paperWidth": 8.27, "paperHeight": 11.69, "preferCSSPageSize": False}
    printed = opened.browser.execute_cdp_cmd("Page.printToPDF", paper)
    assert b"/Count 2" in base64.b64decode(printed["data"])


def test_a_line_is_printed_with_what_it_is_about(dalembert: Dalembert, tmp_path: Path, browser: Any) -> None:
    """The title of a polygon, or the line above a table, stood at the foot of a sheet, and the drawing or table on the next."""
    rotor = (
        "balance",
        EXAMPLES / "rotor-batch" / "rotors.csv",
        "--plane",
        "A:0mm:60mm",
        "--plane",
        "B:90mm:60mm",
    )
    assert dalembert(*rotor, "--page", "page.html", "--report", "report.html").returncode == 0
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    try:
        styles = "return [...document.querySelectorAll(arguments[0])].map((e) => getComputedStyle(e)[arguments[1]])"
        page = Opened(browser, tmp_path / "page.html")
        assert page(styles, "figure", "breakInside") == ["avoid"] * 6
        report = Opened(browser, tmp_path / "report.html")
        above = report(styles, "p", "breakAfter")
        # of all lines those alone that stand above a table
        assert above.count("avoid") == report("return document.querySelectorAll('p + .wide').length") > 0
        assert "auto" in above
    finally:
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": ""})


@pytest.mark.slow
def test_the_report_of_a_long_log_is_two_pages_of_a4(
    dalembert: Dalembert, tmp_path: Path, browser: Any
) -> None:
    """Forty runs at three sensors, one of them read wrong: the readings that fit worst stand there, the others are counted."""
    rng = np.random.default_rng(5)
    effect, bare = np.array([[2.0 + 1j, 0.5], [0.3j, 1.5], [1.0, 1j]]), np.array([40.0, 30j, 25 + 20j])
    lines = ["run,sensor,amplitude_um,phase_deg,trial_plane,trial_mass_g,trial_angle_deg"]
    for run in range(40):
        masses = rng.normal(size=2) * 5 + 1j * rng.normal(size=2) * 5 if run else np.zeros(2)
        read = bare + effect @ masses + (rng.normal(size=3) + 1j * rng.normal(size=3)) * 0.5
        read[0] += 12 * (run == 17)
        on = [(p, abs(w), np.degrees(np.angle(w))) for p, w in zip("AB", masses, strict=True) if w]
        trial = ",".join(";".join(str(each[k]) for each in on) for k in range(3))
        lines += [
            f"{run},{s},{abs(v)},{np.degrees(np.angle(v)) % 360},{trial}" for s, v in enumerate(read, 1)
        ]
    (tmp_path / "long.csv").write_text("\n".join(lines))
    done = dalembert("field", "long.csv", "--report", "report.html")
    assert done.returncode == 0, done.stderr
    opened = Opened(browser, tmp_path / "report.html")
    paper = {"paperWidth": 8.27, "paperHeight": 11.69, "preferCSSPageSize": False}
    printed = opened.browser.execute_cdp_cmd("Page.printToPDF", paper)
    assert b"/Count 2" in base64.b64decode(printed["data"])
    page = (tmp_path / "report.html").read_text()
    assert "112 further readings lie nearer to the fit than these" in page
    assert re.search(r"<td class=\"n\">17</td><td class=\"n\">1</td>.*yes", page)


def test_a_customer_s_report(dalembert: Dalembert, tmp_path: Path) -> None:
    """The verdict first, people's digits, bars held against the limit, the log's own date, warnings last."""
    page = report(dalembert, tmp_path, "field").read_text()
    assert "<dd>2025-03-14</dd>" in page
    titles = re.findall(r"<h3>(.*?)</h3>", page)
    assert titles[:3] == ["Verdict", "Vibration", "What to add now"]
    assert titles[-1] in ("Given", "Warnings")
    assert "Nothing to add: the vibration is within the limit." in page
    assert page.count('<span class="track">') == 3
    assert '<i class="after"' in page
    assert "Leave 88 g at 327° in A on the rotor" in page
    amount = re.search(r"<td>A</td><td>([\d.]+) ± ([\d.]+)</td>", page)
    assert amount is not None
    assert len(amount[2].replace(".", "").strip("0")) <= 2
