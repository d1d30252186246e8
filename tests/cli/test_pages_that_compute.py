"""Pages that compute, in a real browser from a file without a network: dragged, typed, undone, handed back."""

from __future__ import annotations

import csv
import json
import math
import shlex
import time
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.cli.pages import FOUR_BAR, Opened
from tests.conftest import Dalembert
from tests.test_pages_of_redundant_statics import THREE_CRANKS
from virtualwork import Mechanism
from virtualwork.describe.dimensions import changed

EXAMPLES = Path(str(files("cli.examples")))


class Computing(Opened):
    """A page as a script sees it."""

    def get(self, name: str) -> float:
        found = self("return dalembert.get(arguments[0])", name)
        return math.nan if found is None else float(found)

    def put(self, **changed: float) -> bool:
        names = {name.replace("__", "."): x for name, x in changed.items()}
        return bool(self("return dalembert.set(arguments[0])", names))

    def type(self, name: str, text: str) -> None:
        self(
            "const f = [...document.querySelectorAll('input[data-name]')].find((i) => i.dataset.name === arguments[0]);"
            "f.value = arguments[1]; f.dispatchEvent(new Event('input', {bubbles: true}))",
            name,
            text,
        )

    def button(self, text: str) -> None:
        self(
            "[...document.querySelectorAll('button')].find((b) => b.textContent === arguments[0]).click()",
            text,
        )

    @property
    def alert(self) -> str:
        return str(self("return document.querySelector('[role=alert]').textContent"))


@pytest.fixture
def klann(dalembert: Dalembert, tmp_path: Path, browser: Any) -> Computing:
    sweep = ("--over", "0deg:360deg:1deg", "--page", "k.html", "-o", "k.csv")
    done = dalembert("mechanism", EXAMPLES / "klann" / "klann.toml", *sweep)
    assert done.returncode == 0, done.stderr
    return Computing(browser, tmp_path / "k.html")


def foot(**change: float) -> np.ndarray[Any, Any]:
    m = Mechanism.from_toml(str(EXAMPLES / "klann" / "klann.toml"))
    numbers = {name.replace("__", "."): x for name, x in change.items()}
    return changed(m, numbers).motion(np.radians(np.arange(361.0))).point("H").position[:, 0]


def test_it_computes_what_the_program_computes(klann: Computing, tmp_path: Path) -> None:
    with (tmp_path / "k.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert klann("return dalembert.curve('H.x')") == pytest.approx(
        [float(row["H_x_m"]) for row in rows], abs=1e-12
    )
    assert klann("return dalembert.names")[0] == "input"
    assert klann.put(links__crank__B__x=0.121)
    assert klann("return dalembert.curve('H.x')") == pytest.approx(
        list(foot(links__crank__B__x=0.121)), abs=1e-12
    )
    assert klann.put(input=1.25)
    assert klann.get("input") == 1.25
    assert klann.get("links.crank.B.x") == 0.121
    assert klann.faults() == []


def test_a_crank_alone_and_its_mirror_image(dalembert: Dalembert, tmp_path: Path, browser: Any) -> None:
    """P of a crank of 60 mm lies at 60 mm·(cos, sin), and with −60 mm opposite; at a speed of 2 rad/s it has 120 mm/s."""
    (tmp_path / "m.toml").write_text(
        '[ground]\nO = [0, 0]\n[links.crank]\npoints = { O = [0, 0], P = [0.06, 0] }\n[input]\nlink = "crank"\nspeed = 2\n'
    )
    assert dalembert("mechanism", "m.toml", "--at", "90deg", "--page", "m.html").returncode == 0
    page = Computing(browser, tmp_path / "m.html")
    for length in (0.06, -0.06):
        assert page.put(links__crank__P__x=length)
        found = [page.get(name) for name in ("P.x", "P.y", "P.vx", "P.vy")]
        assert found == pytest.approx([0, length, -2 * length, 0], abs=1e-16)
    assert len(page("return dalembert.curve('P.x')")) == 361


def test_what_is_typed_takes_a_unit_and_a_wrong_entry_leaves_no_answer(klann: Computing) -> None:
    before = klann.get("H.x")
    klann.type("links.crank.B.x", "125 mm")
    assert klann.get("links.crank.B.x") == 0.125
    klann.type("links.crank.B.x", "5 inches")
    assert klann.get("links.crank.B.x") == 0.127
    klann.type("links.crank.B.x", "121")
    assert klann.get("links.crank.B.x") == 0.121
    standing = klann.get("H.x")
    for text in ("", "abc", "12 kg", "1.2.3"):
        klann.type("links.crank.B.x", text)
        assert "links.crank.B.x" in klann.alert
        assert math.isnan(klann.get("H.x"))
        assert set(klann.table("Points")["H"][:2]) == {"–"}
        assert all(x is None for x in klann("return dalembert.curve('H.y')"))
    klann.type("links.crank.B.x", "12,1 cm")
    assert klann.alert == ""
    assert klann.get("H.x") == standing
    klann.button("reset")
    assert klann.get("H.x") == before
    klann.button("undo")
    assert klann.get("H.x") == standing
    # nothing is taken away with a wrong entry, nor stays from before it; undo takes the wrong entry back alone
    outbox = "const box = document.getElementById('outbox'); return box.hidden ? '' : box.value"
    klann.button("copy TOML")
    assert "0.121" in klann(outbox)
    klann.press("i")
    klann.type("links.crank.B.x", "much")
    klann.button("copy TOML")
    klann.button("copy --set options")
    assert [klann(outbox), klann("return dalembert.options()"), klann("return dalembert.toml()")] == [""] * 3
    assert klann.text("limits") == ""
    assert {cell for row in klann.table("Instant centres").values() for cell in row} == {"–"}
    klann.button("undo")
    assert klann.alert == ""
    assert klann.get("links.crank.B.x") == 0.121
    assert klann.get("H.x") == standing
    assert klann.faults() == []


def test_real_keys(klann: Computing) -> None:
    """A number typed key by key is one change; the space key ticks the box that has the focus, and does not play."""
    from selenium.webdriver.common.keys import Keys

    klann("document.querySelectorAll('details').forEach((d) => (d.open = true))")
    field = klann.browser.find_element("css selector", 'input[data-name="links.crank.B.x"]')
    for text in ("125 mm", "13 cm"):
        field.send_keys(Keys.CONTROL + "a")
        field.send_keys(text + Keys.TAB)
    assert klann.get("links.crank.B.x") == 0.13
    for length in (0.125, 0.12):
        klann.button("undo")
        assert klann.get("links.crank.B.x") == length
    assert klann("return document.getElementById('tools').firstChild.disabled")
    klann.put(links__crank__B__x=0.13)
    klann.browser.find_element("css selector", "#slider").send_keys(Keys.CONTROL + "z")
    assert klann.get("links.crank.B.x") == 0.12
    box = klann.browser.find_element("css selector", "input[type=checkbox]")
    ticked = box.is_selected()
    box.send_keys(Keys.SPACE)
    assert box.is_selected() != ticked
    assert klann("return document.getElementById('play').getAttribute('aria-label')") == "play"
    assert klann.faults() == []


def test_a_handle_is_dragged_and_moved_by_keys(klann: Computing) -> None:
    from selenium.webdriver.common.action_chains import ActionChains

    klann.set(40)
    handle = klann.browser.find_element("css selector", '[data-name="links.crank.B"]')
    assert handle.value_of_css_property("touch-action") == "none"
    klann("arguments[0].focus()", handle)
    klann(
        "arguments[0].dispatchEvent(new KeyboardEvent('keydown', {key: 'ArrowUp', bubbles: true, cancelable: true}))",
        handle,
    )
    assert klann.get("links.crank.B.y") != 0
    assert klann.pose() == 40
    klann.button("undo")
    assert klann.get("links.crank.B.x") == 0.12
    grip = handle.find_element("css selector", ".knob")
    ActionChains(klann.browser).move_to_element(grip).click_and_hold().move_by_offset(
        6, -4
    ).release().perform()
    time.sleep(0.2)
    x, y = klann.get("links.crank.B.x"), klann.get("links.crank.B.y")
    assert abs(x - 0.12) + abs(y) > 0.002
    expected = foot(links__crank__B__x=x, links__crank__B__y=y)
    found = np.array(klann("return dalembert.curve('H.x')"), dtype=float)
    assert found == pytest.approx(expected, abs=1e-12, nan_ok=True)
    klann.button("undo")
    assert (klann.get("links.crank.B.x"), klann.get("links.crank.B.y")) == (0.12, 0)


def test_where_it_cannot_be_assembled_it_says_what_is_missing(klann: Computing) -> None:
    path = klann.paths("#view g > .link")[0]
    assert not klann.put(ground__D__x=1.5)
    assert "mm missing" in klann.alert
    assert math.isnan(klann.get("H.x"))
    assert klann("return document.querySelector('#view .gone') !== null")
    # the last good drawing stays
    assert klann.paths("#view .gone > .link")[0] == pytest.approx(path)
    assert klann.put(ground__D__x=0.35)
    assert not klann("return document.querySelector('#view .gone') !== null")
    # numbers that make no mechanism, and names that are none
    assert not klann.put(links__crank__B__x=0.0)
    assert klann.alert
    assert klann.put(links__crank__B__x=0.12)
    assert not klann.put(nothing=1.0)
    assert "nothing" in klann.alert
    assert klann.faults() == []


def test_options_and_file_give_the_same_mechanism(
    klann: Computing, dalembert: Dalembert, tmp_path: Path
) -> None:
    klann.put(links__crank__B__x=0.1234567, links__leg__H__angle=-0.6, input=2.2)
    values = [klann.get(name) for name in ("H.x", "H.y")]
    (tmp_path / "again.toml").write_text(klann("return dalembert.toml()"))
    options = shlex.split(klann("return dalembert.options()"))
    for file, words in ((EXAMPLES / "klann" / "klann.toml", options), ("again.toml", options[-2:])):
        done = dalembert("mechanism", file, *words, "--only", "H", "--json")
        assert done.returncode == 0, done.stderr
        point = json.loads(done.stdout)["poses"][0]["points"]["H"]
        assert [point["x_m"], point["y_m"]] == pytest.approx(values, abs=1e-13)


def test_limits_are_those_of_inspect(dalembert: Dalembert, tmp_path: Path, browser: Any) -> None:
    (tmp_path / "m.toml").write_text(FOUR_BAR.replace("B = [40, 0]", "B = [70, 0]"))
    assert dalembert("mechanism", "m.toml", "--over", "0:360:1", "--page", "m.html").returncode == 0
    page = Computing(browser, tmp_path / "m.html")
    done = dalembert("inspect", "m.toml", "--json")
    limits = json.loads(done.stdout)["check"]["input_limits_deg"]
    expected = sorted(map(math.radians, limits))
    assert len(expected) == 2
    found = sorted(q % (2 * math.pi) for q in page("return dalembert.limits()"))
    assert found == pytest.approx(expected, abs=1e-9)


def test_limits_of_a_slide_are_those_around_it(dalembert: Dalembert, tmp_path: Path, browser: Any) -> None:
    """The shoe of a scissors lift slides from one stretched end to the other: 1.2 m both ways."""
    file = EXAMPLES / "scissors-lift" / "lift.toml"
    assert dalembert("mechanism", file, "--over", "0.4m:1.1m:0.1m", "--page", "m.html").returncode == 0
    page = Computing(browser, tmp_path / "m.html")
    assert page("return dalembert.limits()") == pytest.approx([-1.2, 1.2], abs=1e-12)
    time.sleep(0.3)
    assert page.text("limits") == "Limits of the input: -1.2 m, 1.2 m"
    # without a limit it does not turn
    file = EXAMPLES / "sledge" / "sledge.toml"
    assert dalembert("mechanism", file, "--page", "m.html").returncode == 0
    page = Computing(browser, tmp_path / "m.html")
    assert page("return dalembert.limits()") == []


def test_a_path_is_drawn_finer_than_a_few_poses(dalembert: Dalembert, tmp_path: Path, browser: Any) -> None:
    """P of a crank of 60 mm runs over a half circle, also after the crank was made shorter; three poses are its sweep."""
    (tmp_path / "m.toml").write_text(
        '[ground]\nO = [0, 0]\n[links.crank]\npoints = { O = [0, 0], P = [0.06, 0] }\n[input]\nlink = "crank"\n'
    )
    assert dalembert("mechanism", "m.toml", "--over", "0deg:180deg:90deg", "--page", "m.html").returncode == 0
    page = Computing(browser, tmp_path / "m.html")
    assert len(page("return dalembert.curve('P.x')")) == 3
    for share in (1, 0.5):
        assert page.put(links__crank__P__x=0.06 * share)
        path = page.paths("#view .trace:not(.ghost)")[0]
        assert len(path) >= 90
        middle = (path[0] + path[-1]) / 2
        radii = np.hypot(*(path - middle).T)
        assert radii == pytest.approx(np.full(len(path), radii[0]), rel=1e-3)
        length = np.hypot(*np.diff(page.paths("#view g:not(.ghost) > g > .link")[0], axis=0)[0])
        assert radii[0] == pytest.approx(length, rel=1e-3)
    assert page.faults() == []


def test_what_it_cannot_compute_it_replays_and_says_so(
    dalembert: Dalembert, tmp_path: Path, browser: Any
) -> None:
    """Three parallel cranks, and friction in one of them: a redundant statics of what rubs."""
    (tmp_path / "m.toml").write_text(
        THREE_CRANKS + "[[friction]]\njoint = 'A'\ncoefficient = 0.1\nradius = 0.01\n"
    )
    sweep = ("--over", "60deg:90deg:5deg", "--set", "input.speed=2", "--set", "input.acceleration=0")
    done = dalembert("forces", "m.toml", *sweep, "--page", "m.html")
    assert done.returncode == 0, done.stderr
    page = Opened(browser, tmp_path / "m.html")
    assert "friction" in page.text("note")
    assert page.faults() == []


@pytest.mark.slow
def test_a_parallelogram_goes_through_its_change_points(
    dalembert: Dalembert, tmp_path: Path, browser: Any
) -> None:
    """Rates too, in the very pose where both assemblies meet."""
    sweep = ("--over", "0deg:360deg:5deg", "--set", "input.speed=3", "--set", "input.acceleration=1")
    file = EXAMPLES / "parallelogram" / "parallelogram.toml"
    done = dalembert("mechanism", file, *sweep, "--page", "m.html", "--json")
    assert done.returncode == 0, done.stderr
    page = Computing(browser, tmp_path / "m.html")
    poses = json.loads(done.stdout)["poses"]
    for key, name in (("angle_deg", "angle"), ("omega_rad_s", "omega"), ("alpha_rad_s2", "alpha")):
        expected = np.array([pose["links"]["rocker"][key] for pose in poses])
        found = np.array(page("return dalembert.curve(arguments[0])", f"rocker.{name}"), dtype=float)
        if name == "angle":
            apart = np.abs(np.exp(1j * found) - np.exp(1j * np.radians(expected)))
        else:
            apart = np.abs(found - expected)
        assert apart.max() < 1e-9


def touch(page: Computing, kind: str, at: list[tuple[float, float]]) -> None:
    """A finger, as the browser gets it from the screen."""
    points = [{"x": x, "y": y} for x, y in at]
    page.browser.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})


@pytest.mark.slow
@pytest.mark.parametrize("dark", [False, True])
def test_it_fits_a_phone_and_can_be_touched(klann: Computing, dark: bool) -> None:
    size = {"width": 360, "height": 740, "deviceScaleFactor": 2, "mobile": True}
    klann.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    scheme = [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]
    klann.browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": scheme})
    try:
        klann.browser.refresh()
        assert klann("return document.documentElement.scrollWidth") <= 360
        klann("document.querySelectorAll('details').forEach((d) => (d.open = true))")
        assert klann("return document.documentElement.scrollWidth") <= 360
        small = klann(
            "return [...document.querySelectorAll('button, input[type=text], select, .grip')].map((e) => e.getBoundingClientRect())"
            ".filter((r) => r.height && Math.min(r.width, r.height) < 31.5).length"
        )
        assert small == 0
        assert klann("return document.documentElement.dataset.theme") == ("dark" if dark else "light")
        assert klann(
            "return [...document.querySelectorAll('input')].every((i) => i.getAttribute('aria-label'))"
        )
        # a finger moves a handle, up and down too, and the page stays where it is; beside it the page scrolls
        klann.browser.refresh()
        scrolled, length = [], []
        for start in ('[data-name="links.crank.B"] .knob', "#view svg"):
            corner = "const r = document.querySelector(arguments[0]).getBoundingClientRect();"
            inside = "[r.x + r.width / 2, r.y + r.height / 2]" if "knob" in start else "[r.x + 9, r.y + 150]"
            x, y = klann(f"{corner} return {inside}", start)
            touch(klann, "touchStart", [(x, y)])
            for k in range(1, 9):
                touch(klann, "touchMove", [(x + k, y - 5 * k)])
                time.sleep(0.02)
            touch(klann, "touchEnd", [])
            time.sleep(0.3)
            scrolled.append(klann("return scrollY"))
            length.append(abs(klann.get("links.crank.B.x") + 1j * klann.get("links.crank.B.y")))
        assert scrolled[0] == 0
        assert scrolled[1] > 10
        assert length[0] == length[1] > 0.15
    finally:
        klann.browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
        klann.browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})
    assert klann.faults() == []
