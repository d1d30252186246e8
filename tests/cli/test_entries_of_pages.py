"""What stands in the fields of pages, what can be typed there, and words of pictures that keep apart."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest

from tests.cli.test_pages_that_compute import EXAMPLES, Computing
from tests.conftest import Dalembert

CRANK = (
    '[units]\nlength = "in"\n[ground]\nO = [0, 0]\n[links.crank]\npoints = { O = [0, 0], P = [138.3, 0] }\n'
    '[input]\nlink = "crank"\n'
)


def shown(page: Computing, name: str) -> str:
    return str(
        page(
            "return [...document.querySelectorAll('input[data-name]')].find((i) => i.dataset.name === arguments[0]).value",
            name,
        )
    )


def test_a_number_stands_in_its_field_as_in_the_file(
    dalembert: Dalembert, tmp_path: Path, browser: Any
) -> None:
    """138.3 in are 3.51282 m with one rounding, in the program and in the page; a third of an inch comes back to its bits."""
    (tmp_path / "m.toml").write_text(CRANK)
    done = dalembert("mechanism", "m.toml", "--at", "0deg", "--page", "m.html", "--json")
    x = json.loads(done.stdout)["poses"][0]["points"]["P"]["x_m"]
    page = Computing(browser, tmp_path / "m.html")
    assert page.get("links.crank.P.x") == x == 3.51282
    assert shown(page, "links.crank.P.x") == "138.3"
    page.type("links.crank.P.x", "-476.5565657 in")
    assert page.get("links.crank.P.x") == -12.10453676878
    assert page.put(links__crank__P__x=0.0254 / 3)
    page.type("links.crank.P.x", shown(page, "links.crank.P.x"))
    assert page.get("links.crank.P.x") == 0.0254 / 3
    assert page.faults() == []


def test_a_file_with_units_in_full(dalembert: Dalembert, tmp_path: Path, browser: Any) -> None:
    """4 inches are 0.1016 m, also typed as a bare number, and a quarter of a turn is 0.25 rev."""
    text = CRANK.replace('"in"', '"inches"\nangle = "rev"').replace("138.3", "3") + "angle = 0.25\n"
    (tmp_path / "m.toml").write_text(text)
    assert dalembert("mechanism", "m.toml", "--page", "m.html").returncode == 0
    page = Computing(browser, tmp_path / "m.html")
    assert [shown(page, name) for name in ("links.crank.P.x", "input")] == ["3", "0.25"]
    page.type("links.crank.P.x", "4")
    assert page.get("links.crank.P.x") == 0.1016
    assert page.get("P.y") == pytest.approx(0.1016, rel=1e-15)


def test_every_pose_of_a_turn_has_short_degrees(dalembert: Dalembert, tmp_path: Path, browser: Any) -> None:
    """From 10° on by whole degrees: no 117.99999999999999."""
    (tmp_path / "m.toml").write_text(CRANK)
    assert dalembert("mechanism", "m.toml", "--at", "10deg", "--page", "m.html").returncode == 0
    page = Computing(browser, tmp_path / "m.html")
    for pose in (0, 108, 198, 360):
        page.set(pose)
        assert page("return dalembert.options()") == f"--at {10 + pose}deg"
        assert page.get("input") == math.radians(10 + pose)


def test_degrees_of_a_table_stand_as_in_the_file(dalembert: Dalembert, tmp_path: Path, browser: Any) -> None:
    rows = "name,unbalance_g_mm,angle_deg\nA,60,28.64789\nB,0.3,120.321137\n"
    (tmp_path / "r.csv").write_text(rows)
    assert dalembert("balance", "r.csv", "--plane", "P:20mm", "--page", "r.html").returncode == 0
    page = Computing(browser, tmp_path / "r.html")
    assert [shown(page, name) for name in ("A.angle", "B.angle", "B.unbalance")] == [
        "28.64789",
        "120.321137",
        "0.3",
    ]
    assert page("return dalembert.csv()") == rows


@pytest.mark.parametrize("text", ["1e400", "-1e400", "", "abc", "1e70"])
def test_what_is_no_number_is_marked_and_named(
    text: str, dalembert: Dalembert, tmp_path: Path, browser: Any
) -> None:
    (tmp_path / "m.toml").write_text(CRANK)
    assert dalembert("mechanism", "m.toml", "--at", "0deg", "--page", "m.html").returncode == 0
    page = Computing(browser, tmp_path / "m.html")
    for name in ("links.crank.P.x", "input", "links.crank.mass"):
        page.type(name, text)
        assert page.alert.startswith(f"{name}: ")
        assert "expected a number" in page.alert
        assert math.isnan(page.get(name))
        assert math.isnan(page.get("P.x"))
        marked = "return [...document.querySelectorAll('[aria-invalid=true]')].map((i) => i.dataset.name)"
        assert page(marked) == [name]
        page.button("undo")
        assert page.alert == ""
        assert page(marked) == []
    assert page.faults() == []


def test_a_pose_beside_the_cases_has_the_rates_of_the_file(
    dalembert: Dalembert, tmp_path: Path, browser: Any
) -> None:
    """P turns with 2 rad/s in the file, at any other pace in the table; a speed of zero is a number, none at all is not."""
    (tmp_path / "m.toml").write_text(CRANK.replace("138.3", "10") + "speed = 2\n")
    (tmp_path / "c.csv").write_text("t_s,crank_deg\n0,0\n1,10\n2,40\n3,90\n")
    assert dalembert("mechanism", "m.toml", "--cases", "c.csv", "--page", "m.html").returncode == 0
    page = Computing(browser, tmp_path / "m.html")
    assert page.get("crank.omega") != 2
    assert page.put(input=0.0)
    assert [page.get(name) for name in ("crank.omega", "crank.alpha", "P.vy")] == pytest.approx([2, 0, 0.508])
    assert page.put(input__speed=0.0)
    assert [page.get(name) for name in ("crank.omega", "P.vx", "P.ay")] == [0, 0, 0]
    (tmp_path / "m.toml").write_text(CRANK)
    assert dalembert("mechanism", "m.toml", "--at", "0deg", "--page", "m.html").returncode == 0
    assert math.isnan(Computing(browser, tmp_path / "m.html").get("crank.omega"))


def test_names_of_a_polygon_lie_beside_its_arrows(dalembert: Dalembert, tmp_path: Path, browser: Any) -> None:
    """Riul's rotor: the sides of both triangles are close to each other; no name lies on any of them."""
    planes = ("--plane", "A:0mm:20mm", "--plane", "B:90mm:20mm", "--page", "r.html")
    assert dalembert("balance", EXAMPLES / "riul-rotor" / "rotor.csv", *planes).returncode == 0
    page = Computing(browser, tmp_path / "r.html")
    crossed = page(
        "const over = []; let count = 0; for (const svg of document.querySelectorAll('svg.polygon')) {"
        "const lines = [...svg.querySelectorAll('path')].filter((p) => p.getAttribute('d'));"
        "const on = lines.flatMap((p) => Array.from({length: 200}, (_, k) => p.getPointAtLength((k / 199) * p.getTotalLength())));"
        "for (const text of svg.querySelectorAll('text')) { count++; const b = text.getBBox();"
        "if (on.some(({x, y}) => x > b.x && x < b.x + b.width && y > b.y + 2 && y < b.y + b.height - 2)) over.push(text.textContent); } }"
        "return [count, over]"
    )
    assert crossed == [6, []]


def test_zero_of_exact_numbers_is_shown_as_zero(dalembert: Dalembert, tmp_path: Path, browser: Any) -> None:
    """A piston on a vertical guide over a level crank: the rod does not turn there, for 90° is a right angle and not a float's π/2."""
    at = ("--over", "0deg:90deg:30deg", "--page", "e.html")
    assert dalembert("forces", EXAMPLES / "engine" / "engine.toml", *at).returncode == 0
    page = Computing(browser, tmp_path / "e.html")
    assert page.table("Links")["rod"][1] == "0"
    assert page.table("Joint forces")["B: ground on piston"][1] == "0"
    page.press("i")
    assert page.table("Instant centres")["crank / piston"] == ["0.045", "0"]
    page.set(1)
    assert float(page.table("Links")["rod"][1]) == pytest.approx(page.get("rod.omega"), rel=1e-5)
    assert page.faults() == []


def test_rounding_beside_a_change_point_is_zero(dalembert: Dalembert, tmp_path: Path, browser: Any) -> None:
    """What is interpolated there showed six digits of its rounding, and the plot of a coupler that does not turn a scale of 1e-16."""
    sweep = ("--over", "0deg:720deg:45deg", "--page", "p.html")
    assert dalembert("mechanism", EXAMPLES / "parallelogram" / "parallelogram.toml", *sweep).returncode == 0
    page = Computing(browser, tmp_path / "p.html")
    for pose in (0, 8, 16):
        page.set(pose)
        assert page.table("Points")["C"][:2] == ["0.14", "0"]
        assert page.table("Links") == {
            "crank": ["0", "1", "0"],
            "coupler": ["0", "0", "0"],
            "rocker": ["0", "1", "0"],
        }
    ticks = (
        "const p = document.querySelector('.plot'); const s = p.querySelector('select');"
        "s.value = [...s.options].find((o) => o.textContent === arguments[0]).value; s.dispatchEvent(new Event('change'));"
        "return [p.querySelector('output').textContent, ...[...p.querySelectorAll('.tick')].slice(5, -1).map((t) => t.textContent)]"
    )
    assert page(ticks, "coupler_omega_rad_s") == ["0", "0"]
    assert page(ticks, "C_vy_m_s") == ["0.04", "-0.04", "-0.02", "0", "0.02", "0.04"]
    assert page.faults() == []


def test_a_limit_of_two_loops_stands_once(dalembert: Dalembert, tmp_path: Path, browser: Any) -> None:
    sweep = ("--over", "-90deg:90deg:15deg", "--page", "p.html")
    assert dalembert("mechanism", EXAMPLES / "peaucellier" / "peaucellier.toml", *sweep).returncode == 0
    page = Computing(browser, tmp_path / "p.html")
    assert page.text("limits") == "Limits of the input: 120 deg, 240 deg"


def test_a_drawing_has_a_name_and_no_image_hides_handles(
    dalembert: Dalembert, tmp_path: Path, browser: Any
) -> None:
    """Screen readers leave out what is in an image."""
    (tmp_path / "m.toml").write_text(CRANK)
    assert dalembert("mechanism", "m.toml", "--page", "p.html").returncode == 0
    page = Computing(browser, tmp_path / "p.html")
    roles = "return [...document.querySelectorAll('#view svg, #extra svg')].map((e) => [e.getAttribute('role'), e.ariaLabel])"
    assert page(roles) == [["group", page("return document.title")]]
    page.press("p")
    assert page(roles)[1:] == [["img", "velocity polygon"]]
    assert page("return document.querySelectorAll('[role=img] [tabindex]').length") == 0


@pytest.mark.slow
def test_words_of_pictures_keep_apart(dalembert: Dalembert, tmp_path: Path, browser: Any) -> None:
    """On a phone and on a screen, with all that can be drawn: velocities of many points, free bodies, polygons of unbalances."""
    pump = ("--plane", "DE:0mm:120mm", "--plane", "NDE:300mm:120mm", "--page", "r.html")
    assert dalembert("balance", EXAMPLES / "pump-rotor-api" / "rotor.csv", *pump).returncode == 0
    for example in ("andrews/andrews", "stephenson-six-bar/stephenson"):
        name = example.split("/")[0]
        sweep = ("--over", "0deg:360deg:30deg", "--page", f"{name}.html")
        assert dalembert("forces", EXAMPLES / f"{example}.toml", *sweep).returncode == 0
    for width in (360, 1280):
        size = {"width": width, "height": 800, "deviceScaleFactor": 1, "mobile": False}
        browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        try:
            for file in ("r", "andrews", "stephenson-six-bar"):
                page = Computing(browser, tmp_path / f"{file}.html")
                assert page.names_in_one_place() == []
                if file == "r":
                    continue
                for key in "vaip":
                    page.press(key)
                for pose in range(0, 13, 3):
                    page.set(pose)
                    assert page.names_in_one_place() == []
        finally:
            browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


@pytest.mark.slow
@pytest.mark.parametrize("width", [360, 1280])
def test_arrows_end_in_the_picture(width: int, dalembert: Dalembert, tmp_path: Path, browser: Any) -> None:
    """The tip of the largest force of a press lay 145 pixels below the picture, that of Jansen's acceleration 71 beside it."""
    press = ("--over", "0deg:360deg:1deg", "--page", "press.html")
    assert dalembert("forces", EXAMPLES / "crank-press" / "press.toml", *press).returncode == 0
    leg = ("--over", "0deg:360deg:10deg", "--page", "leg.html")
    assert dalembert("mechanism", EXAMPLES / "jansen" / "jansen.toml", *leg).returncode == 0
    browser.execute_cdp_cmd(
        "Emulation.setDeviceMetricsOverride",
        {"width": width, "height": 740, "deviceScaleFactor": 1, "mobile": False},
    )
    try:
        for file, keys, poses, kinds in (
            ("press", "v", range(0, 361, 4), {"force", "velocity"}),
            ("leg", "va", range(37), {"acceleration", "velocity"}),
        ):
            page = Computing(browser, tmp_path / f"{file}.html")
            alone = page("return scale")
            for key in keys:
                page.press(key)
            tips, seen, size = page(
                "const tips = [], seen = new Set();"
                "for (const i of arguments[0]) { drawAll(i);"
                " for (const e of svg.querySelectorAll('path.velocity, path.acceleration, path.force')) {"
                "  const d = e.getAttribute('d'); if (!d) continue;"
                "  seen.add(e.getAttribute('class')); tips.push(d.match(/-?[\\d.]+/g).slice(2, 4).map(Number)); } }"
                "return [tips, [...seen], [width, height]]",
                list(poses),
            )
            assert set(seen) == kinds
            assert len(tips) > 50
            for x, y in tips:
                assert 0 < x < size[0]
                assert 0 < y < size[1]
            # without them the drawing is as large as before
            for key in keys:
                page.press(key)
            assert page("return scale") == alone
            assert page.faults() == []
    finally:
        browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
