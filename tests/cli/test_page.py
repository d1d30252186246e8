"""`--html` in a real browser: it moves, the slider sets the pose, what it shows is what the CSV has."""

from __future__ import annotations

import csv
import re
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.cli.pages import EVIL, FOUR_BAR, POINTS, WORSE, Opened
from tests.conftest import Dalembert

Row = dict[str, str]


def assert_digits_hold(shown: str, exact: str) -> None:
    """The page computes by itself, and shows the digits that a second computation confirms: at least 12 of them."""
    digits = len(shown.split("e")[0].replace("-", "").replace(".", "").lstrip("0"))
    assert digits >= 12 or float(shown) == float(exact)
    assert float(shown) == pytest.approx(float(exact), rel=10.0 ** (1 - digits), abs=1e-14)


@pytest.fixture
def four_bar(dalembert: Dalembert, tmp_path: Path, browser: Any) -> tuple[Opened, list[Row], list[Row]]:
    """Return the page, its poses with the digits that hold and its forces as CSV."""
    (tmp_path / "m.toml").write_text(FOUR_BAR)
    sweep = ("m.toml", "--over", "0:360:1")
    done = dalembert("forces", *sweep, "--page", "m.html")
    assert done.returncode == 0, done.stderr
    poses = dalembert("mechanism", *sweep, "--only", ",".join((*POINTS, "crank", "rocker", EVIL)), "--digits")
    assert poses.returncode == 0, poses.stderr
    rows = [list(csv.DictReader(out.splitlines())) for out in (poses.stdout, done.stdout)]
    return Opened(browser, tmp_path / "m.html"), rows[0], rows[1]


def test_it_moves(four_bar: tuple[Opened, list[Row], list[Row]]) -> None:
    opened = four_bar[0]
    assert opened.pose() == 0
    links = opened.paths("#view .link")
    opened("document.getElementById('play').click()")
    until = time.monotonic() + 10
    while opened.pose() < 20 and time.monotonic() < until:
        time.sleep(0.05)
    opened("document.getElementById('play').click()")
    stopped = opened.pose()
    assert stopped >= 20
    assert f"(pose {stopped + 1} of 361)" in opened.text("pose")
    moved = [np.abs(a - b).max() for a, b in zip(links, opened.paths("#view .link"), strict=True)]
    assert min(moved) > 3
    time.sleep(0.3)
    assert opened.pose() == stopped
    assert opened.faults() == []


def test_the_slider_sets_the_pose_and_the_numbers_are_those_of_the_csv(
    four_bar: tuple[Opened, list[Row], list[Row]],
) -> None:
    opened, poses, forces = four_bar
    for i in (0, 1, 137, 360):
        opened.set(i)
        row = poses[i]
        points = opened.table("Points")
        for name in POINTS:
            for shown, axis in zip(points[name], "xy", strict=False):
                assert_digits_hold(shown, row[f"{name}_{axis}_m"])
        for name, (angle, omega, alpha) in opened.table("Links").items():
            assert_digits_hold(angle, row[f"{name}_angle_deg"])
            assert float(omega) == pytest.approx(float(row[f"{name}_omega_rad_s"]), rel=1e-5)
            assert float(alpha) == pytest.approx(float(row[f"{name}_alpha_rad_s2"]), rel=1e-5, abs=1e-6)
        for name, cells in opened.table("Joint forces").items():
            joint, of, on = re.fullmatch(r"(.*): (.*) on (.*)", name).groups()  # type: ignore[union-attr]
            lead = f"{joint}_{of}_on_{on}_f"
            expected = [float(forces[i][f"{lead}{axis}_N"]) for axis in "xy"]
            assert list(map(float, cells)) == pytest.approx(expected, rel=1e-5)
        assert opened.text("pose").startswith(f"input_deg {float(row['input_deg']):g} ")
    assert opened.faults() == []


def test_names_stay_text(four_bar: tuple[Opened, list[Row], list[Row]]) -> None:
    opened = four_bar[0]
    for key in "aip":
        opened.press(key)
    assert opened("return window.broken ?? null") is None
    assert opened("return document.querySelectorAll('img').length") == 0
    assert opened("return document.scripts.length") == 2
    assert opened("return document.querySelector('h1').textContent") == f"a {EVIL} & four-bar"
    assert opened("return document.title") == f"a {EVIL} & four-bar"
    labels = opened("return [...document.querySelectorAll('#view text')].map((t) => t.textContent)")
    assert {EVIL, WORSE, "crank", "A"} <= set(labels)
    assert opened.faults() == []


def test_keys(four_bar: tuple[Opened, list[Row], list[Row]]) -> None:
    opened = four_bar[0]
    for key, pose in (
        ("ArrowRight", 1),
        ("ArrowRight", 2),
        ("ArrowLeft", 1),
        ("End", 360),
        ("ArrowRight", 360),
        ("Home", 0),
    ):
        opened.press(key)
        assert opened.pose() == pose
    for key, pose in (("ArrowRight", 10), ("ArrowRight", 20), ("ArrowLeft", 10)):
        opened.press(key, shift=True)
        assert opened.pose() == pose
    speed = opened("return document.getElementById('speed').selectedOptions[0].textContent")
    opened.press("+")
    assert float(
        opened("return document.getElementById('speed').selectedOptions[0].textContent")
    ) == 2 * float(speed)
    opened.press(" ")
    assert opened("return document.getElementById('play').getAttribute('aria-label')") == "pause"
    opened.press(" ")
    before = opened("return document.documentElement.dataset.theme")
    opened.press("d")
    assert {before, opened("return document.documentElement.dataset.theme")} == {"dark", "light"}


@pytest.mark.slow
def test_it_is_drawn_to_scale(four_bar: tuple[Opened, list[Row], list[Row]]) -> None:
    """Crank 40, rocker 80 and the coupler's sides keep their lengths in every pose, all in one scale."""
    opened = four_bar[0]
    for i in (10, 200):
        opened.set(i)
        crank, coupler, rocker = opened.paths("#view .link")
        scale = np.hypot(*np.diff(crank, axis=0)[0]) / 40
        assert np.hypot(*np.diff(rocker, axis=0)[0]) / 80 == pytest.approx(scale, rel=1e-3)
        sides = np.hypot(*np.diff(coupler, axis=0, append=coupler[:1]).T)
        assert sorted(sides / scale) == pytest.approx(
            sorted([120, np.hypot(60, 50), np.hypot(60, 50)]), rel=1e-3
        )
        # counter-clockwise is counter-clockwise on the screen, whose y points down
        turned = np.degrees(np.arctan2(crank[0, 1] - crank[1, 1], crank[1, 0] - crank[0, 0])) % 360
        assert turned == pytest.approx(i, abs=0.1)


@pytest.mark.slow
def test_arrows_point_as_the_forces_and_velocities_do(four_bar: tuple[Opened, list[Row], list[Row]]) -> None:
    opened, poses, forces = four_bar
    opened.set(77)
    opened.press("v")

    def directions(kind: str) -> list[complex]:
        return [complex(p[1, 0] - p[0, 0], p[0, 1] - p[1, 1]) for p in opened.paths(f"#view .{kind}")]

    row = poses[77]
    expected = [complex(float(row[f"{p}_vx_m_s"]), float(row[f"{p}_vy_m_s"])) for p in POINTS[2:]]
    ratios = np.array(directions("velocity")) / expected
    assert ratios == pytest.approx([ratios[0].real] * 3, rel=0.02)
    leads = [key[:-5] for key in forces[77] if key.endswith("_fx_N") and "shaking" not in key]
    expected = [
        complex(float(forces[77][f"{lead}_fx_N"]), float(forces[77][f"{lead}_fy_N"])) for lead in leads
    ]
    drawn = directions("force")
    # arrows too short to be seen are left out
    long = [f for f in expected if abs(f) > 0.05 * max(map(abs, expected))]
    assert len(drawn) >= len(long) >= 3
    ratios = np.array([d / f for d, f in zip(drawn, expected, strict=True)])
    assert ratios == pytest.approx([ratios[0].real] * len(ratios), rel=0.1)


@pytest.mark.slow
def test_instant_centres_are_where_the_lines_meet(four_bar: tuple[Opened, list[Row], list[Row]]) -> None:
    """Aronhold and Kennedy: coupler on ground where crank and rocker meet, crank on rocker where coupler and ground do."""
    opened, poses, _ = four_bar
    opened.press("i")
    for i in (30, 150, 290):
        opened.set(i)
        A, D, B, C = (np.array([float(poses[i][f"{p}_{axis}_m"]) for axis in "xy"]) for p in "ADBC")
        found = {name: list(map(float, cells)) for name, cells in opened.table("Instant centres").items()}

        def meet(p: Any, q: Any, r: Any, s: Any) -> Any:
            return p + np.linalg.solve(np.column_stack([q - p, r - s]), r - p)[0] * (q - p)

        assert found == {
            f"ground / {EVIL}": pytest.approx(meet(A, B, D, C), rel=1e-4),
            "crank / rocker": pytest.approx(meet(A, D, B, C), rel=1e-4, abs=1e-7),
        }


@pytest.mark.slow
def test_the_velocity_polygon_holds_an_image_of_the_coupler(
    four_bar: tuple[Opened, list[Row], list[Row]],
) -> None:
    """The image of a link is the link turned by 90°, its sides in the link's own ratio."""
    opened = four_bar[0]
    opened.press("p")
    opened.set(50)
    image = next(p for p in opened.paths("#extra .image") if len(p) == 3)
    link = opened.paths("#view .link")[1]
    # both with y up; the link's outline begins elsewhere, so its corners are taken in the order of the points
    sides = [np.hypot(*(a - b)) for a, b in zip(image, np.roll(image, 1, axis=0), strict=True)]
    mine = [np.hypot(*(a - b)) for a, b in zip(link, np.roll(link, 1, axis=0), strict=True)]
    assert max(sides) / min(sides) == pytest.approx(max(mine) / min(mine), rel=0.01)
    assert opened.faults() == []


@pytest.mark.slow
def test_a_plot_shows_any_column_and_seeks(four_bar: tuple[Opened, list[Row], list[Row]]) -> None:
    opened, poses, forces = four_bar
    listed = set(
        opened("return [...document.querySelector('.plot select').options].map((o) => o.textContent)")
    )
    assert listed == {key for row in (poses[0], forces[0]) for key in row} - {"step"}
    opened.set(123)
    for column, row in (("C_ay_m_s2", poses[123]), ("input_torque_N_m", forces[123])):
        shown = opened(
            "const s = document.querySelector('.plot select');"
            "s.value = [...s.options].find((o) => o.textContent === arguments[0]).value;"
            "s.dispatchEvent(new Event('change'));"
            "return document.querySelector('.plot output').textContent",
            column,
        )
        assert float(shown) == pytest.approx(float(row[column]), rel=1e-5)
    # a click on the curve's middle
    opened(
        "const s = document.querySelector('.plot svg'), r = s.getBoundingClientRect();"
        "s.setPointerCapture = () => {};"
        "const x = (58 + r.width - 18) / 2;"
        "s.dispatchEvent(new PointerEvent('pointerdown', {clientX: r.left + x, clientY: r.top + 50, pointerId: 1}))"
    )
    assert opened.pose() == pytest.approx(180, abs=1)


@pytest.mark.slow
def test_what_stands_in_no_pose_is_not_drawn(dalembert: Dalembert, tmp_path: Path, browser: Any) -> None:
    """Pins and handles lay in the upper left corner, and plots had a scale from 0 to 1; a pose that stands brings them."""
    (tmp_path / "m.toml").write_text(FOUR_BAR.replace("B = [40, 0]", "B = [400, 0]"))
    assert dalembert("mechanism", "m.toml", "--over", "0:90:45", "--page", "m.html").returncode == 1
    opened = Opened(browser, tmp_path / "m.html")
    drawn = "return [...document.querySelectorAll('#view circle')].filter((c) => c.getClientRects().length && c.getBoundingClientRect().width).length"
    assert opened(drawn) == 0
    assert (
        opened("return document.querySelector('.plot svg').querySelectorAll('text[text-anchor=end]').length")
        == 1
    )
    assert opened("return dalembert.set({'links.crank.B.x': 0.04})")
    assert opened(drawn) > 10
    assert opened.faults() == []


@pytest.mark.slow
def test_few_poses_and_a_pose_between_two_gaps_have_dots(
    dalembert: Dalembert, tmp_path: Path, browser: Any
) -> None:
    (tmp_path / "m.toml").write_text(FOUR_BAR)
    dots = []
    for at in ("0:180:45", "0:180:1"):
        assert dalembert("mechanism", "m.toml", "--over", at, "--page", "m.html").returncode == 0
        opened = Opened(browser, tmp_path / "m.html")
        dots.append(
            opened("return document.querySelector('.plot svg').querySelectorAll('circle.spot').length")
        )
        assert opened.faults() == []
    assert dots == [5, 0]
    # at 0° it cannot be assembled, at 180° it can: of 51 poses 25, each between two gaps
    (tmp_path / "m.toml").write_text(FOUR_BAR.replace("B = [40, 0]", "B = [70, 0]"))
    done = dalembert("mechanism", "m.toml", "--over", "0:9000:180", "--page", "m.html")
    assert done.returncode == 0, done.stderr
    opened = Opened(browser, tmp_path / "m.html")
    assert opened("return document.querySelector('.plot svg').querySelectorAll('circle.spot').length") == 25


@pytest.mark.slow
def test_it_fits_a_phone(four_bar: tuple[Opened, list[Row], list[Row]]) -> None:
    opened = four_bar[0]
    for width in (360, 768, 1200):
        opened.browser.execute_cdp_cmd(
            "Emulation.setDeviceMetricsOverride",
            {"width": width, "height": 740, "deviceScaleFactor": 2, "mobile": width < 700},
        )
        time.sleep(0.2)
        try:
            assert opened("return document.documentElement.scrollWidth") <= width
            assert opened("return document.querySelector('#view svg').getBoundingClientRect().width") <= width
        finally:
            opened.browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


@pytest.mark.slow
def test_a_pose_that_cannot_be_assembled_is_named(dalembert: Dalembert, tmp_path: Path, browser: Any) -> None:
    text = FOUR_BAR.replace("B = [40, 0]", "B = [70, 0]")
    (tmp_path / "m.toml").write_text(text)
    done = dalembert("mechanism", "m.toml", "--over", "0:180:1", "--page", "m.html")
    assert done.returncode == 0
    opened = Opened(browser, tmp_path / "m.html")
    shown = [
        (opened.set(i), opened("return getComputedStyle(document.querySelector('.missing')).display"))[1]
        for i in (180, 0)
    ]
    # at 0° crank and ground leave 30 mm, and coupler and rocker need 40
    assert shown == ["none", "block"]
    assert opened.table("Points")["C"][:2] == ["–", "–"]
    assert opened.faults() == []
