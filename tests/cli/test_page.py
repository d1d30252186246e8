"""`--html` in a real browser: it moves, the slider sets the pose, what it shows is what the CSV has."""

from __future__ import annotations

import csv
import re
import time
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import numpy as np
import pytest

from virtualwork import Mechanism

Run = Callable[..., "CompletedProcess[str]"]
Row = dict[str, str]

EVIL = "<script>window.broken=1</script>"
WORSE = "</script><img src=x onerror=window.broken=1>"
FOUR_BAR = f"""
name = "a {EVIL} & four-bar"
[units]
length = "mm"
angle = "deg"
[ground]
A = [0, 0]
D = [100, 0]
[links.crank]
points = {{ A = [0, 0], B = [40, 0] }}
mass = 0.5
center = [20, 0]
[links."{EVIL}"]
points = {{ B = [0, 0], C = [120, 0], "{WORSE}" = [60, 50] }}
mass = 1.2
center = [60, 10]
inertia = 0.001
[links.rocker]
points = {{ D = [0, 0], C = [80, 0] }}
mass = 0.9
center = [40, 0]
[input]
link = "crank"
angle = 40
speed = "300 rpm"
acceleration = 0
[guess]
at = 40
"{EVIL}" = 20
rocker = 60
"""
POINTS = ("A", "D", "B", "C", WORSE)


class Opened:
    """A page in the browser, asked as a reader would."""

    def __init__(self, browser: Any, path: Path) -> None:
        self.browser = browser
        browser.get_log("browser")  # what an earlier page said
        browser.get(path.as_uri())

    def __call__(self, script: str, *arguments: object) -> Any:
        return self.browser.execute_script(script, *arguments)

    def set(self, i: int) -> None:
        """Move the slider to a pose."""
        self(
            "const s = document.getElementById('slider'); s.value = arguments[0]; s.dispatchEvent(new Event('input'))",
            i,
        )

    def press(self, key: str) -> None:
        self(
            "document.body.dispatchEvent(new KeyboardEvent('keydown', {key: arguments[0], bubbles: true}))",
            key,
        )

    def text(self, element: str) -> str:
        return str(self("return document.getElementById(arguments[0]).textContent", element))

    def pose(self) -> int:
        """The number of the pose shown, counted from 0."""
        return int(self("return Number(document.getElementById('slider').value)"))

    def table(self, caption: str) -> dict[str, list[str]]:
        """Return a table's cells by the names of its rows."""
        return dict(
            self(
                "const t = [...document.querySelectorAll('table')].find((t) => t.caption.textContent === arguments[0]);"
                "return [...t.tBodies[0].rows].map((r) => [r.cells[0].textContent,"
                " [...r.cells].slice(1).map((c) => c.textContent)])",
                caption,
            )
        )

    def paths(self, selector: str) -> list[np.ndarray[Any, Any]]:
        """Return the corners, in pixels, of paths."""
        found = self(
            "return [...document.querySelectorAll(arguments[0])].map((p) => p.getAttribute('d'))", selector
        )
        return [np.array(re.findall(r"(-?[\d.]+) (-?[\d.]+)", d), dtype=float) for d in found if d]

    def names_in_one_place(self) -> list[str]:
        """Return the names in the drawing that lie over one another."""
        return list(
            self(
                "const t = [...document.querySelectorAll('#view text.point, #view text.body, #view text.centre')]"
                ".map((e) => [e.textContent, e.getBoundingClientRect()]);"
                "return t.flatMap(([a, p], i) => t.slice(0, i).filter(([, q]) =>"
                " Math.min(p.right, q.right) - Math.max(p.left, q.left) > 2 &&"
                " Math.min(p.bottom, q.bottom) - Math.max(p.top, q.top) > 3).map(([b]) => `${a} over ${b}`))"
            )
        )

    def faults(self) -> list[str]:
        """Return what the console says, and whatever was fetched."""
        said = [entry["message"] for entry in self.browser.get_log("browser")]
        return said + list(self("return performance.getEntriesByType('resource').map((e) => e.name)"))


@pytest.fixture
def four_bar(dalembert: Run, tmp_path: Path, browser: Any) -> tuple[Opened, list[Row], list[Row]]:
    """Return the page, its poses and its forces as CSV."""
    (tmp_path / "m.toml").write_text(FOUR_BAR)
    sweep = ("m.toml", "--sweep", "0:360:1")
    done = dalembert("mechanism", *sweep, "--forces", "--html", "m.html")
    assert done.returncode == 0, done.stderr
    poses = dalembert("mechanism", *sweep, "--only", ",".join((*POINTS, "crank", "rocker", EVIL)))
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
        assert {name: cells[:2] for name, cells in points.items()} == {
            name: [row[f"{name}_x_m"], row[f"{name}_y_m"]] for name in POINTS
        }
        for name, (angle, omega, alpha) in opened.table("Links").items():
            assert angle == row[f"{name}_angle_deg"]
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
def test_a_pose_that_cannot_be_assembled_is_named(dalembert: Run, tmp_path: Path, browser: Any) -> None:
    text = FOUR_BAR.replace("B = [40, 0]", "B = [70, 0]")
    (tmp_path / "m.toml").write_text(text)
    done = dalembert("mechanism", "m.toml", "--sweep", "0:180:1", "--html", "m.html")
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


@pytest.mark.slow
def test_a_six_bar_takes_less_than_300_kB(dalembert: Run, tmp_path: Path) -> None:
    """The Klann leg with masses, velocities, accelerations and all joint forces."""
    text = (files("cli.examples") / "klann" / "klann.toml").read_text()
    heavy = text.replace("points = {", "mass = 0.7\ncenter = [80, 5]\ninertia = 0.01\npoints = {") + "\n"
    (tmp_path / "m.toml").write_text("gravity = [0, -9.81]\n" + heavy)
    options = ("--sweep", "0deg:360deg:1deg", "--order", "acceleration", "--forces")
    done = dalembert("mechanism", "m.toml", *options, "--html", "m.html")
    assert done.returncode == 0, done.stderr
    page = (tmp_path / "m.html").read_text()
    assert page.count('"f4":') > 40  # columns that vary
    assert len(page.encode()) <= 300_000


@pytest.mark.slow
def test_variants_are_ghosts_over_the_first(dalembert: Run, tmp_path: Path, browser: Any) -> None:
    """Cranks of 40, 35 and 30 mm; with 500 mm it cannot be put together."""
    (tmp_path / "m.toml").write_text(FOUR_BAR)
    (tmp_path / "v.csv").write_text("links.crank.B.x_mm\n40\n35\n30\n500\n")
    done = dalembert(
        "mechanism", "m.toml", "--sweep", "0:90:1", "--variants", "v.csv", "--html", "m.html", "-o", "m.csv"
    )
    assert done.returncode == 0, done.stderr
    opened = Opened(browser, tmp_path / "m.html")
    opened.set(40)
    (full,) = opened.paths("#view g:not(.ghost) > g > .link.b0")
    ghosts = opened.paths("#view .ghost .link.b0")
    lengths = [float(np.hypot(*(p[1] - p[0]))) for p in (full, *ghosts)]
    assert [40 * length / lengths[0] for length in lengths] == pytest.approx([40, 35, 30], rel=1e-3)
    assert opened.text("legend").startswith("in full: variant 1; faint: variant 2; variant 3")
    # the plot shows them too
    assert len(opened.paths(".plot:first-child .curve.ghost")) == len(ghosts)
    assert opened.faults() == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("example", "file", "options"),
    [
        ("engine", "engine", ("--forces", "--sweep", "90deg:810deg:6deg", "--units", "mm,rad")),
        ("planetary-gear", "planetary", ("--sweep", "0deg:2160deg:60deg")),
        ("quick-return", "quick-return", ("--sweep", "0deg:360deg:5deg", "--order", "position")),
        ("five-bar", "five-bar", ("--inputs", "five-bar/inputs.csv")),
        ("desk-lamp", "lamp", ()),
        # heights that rounding alone changes have an axis too
        ("scissors-lift", "lift", ("--sweep", "0.3m:0.5m:0.004m")),
        ("peaucellier", "peaucellier", ("--sweep", "-40deg:40deg:5deg")),
        ("parallelogram", "parallelogram", ("--sweep", "0deg:360deg:5deg", "--branch", "all")),
    ],
)
def test_examples_open_without_a_fault(
    example: str, file: str, options: tuple[str, ...], dalembert: Run, tmp_path: Path, browser: Any
) -> None:
    folder = Path(str(files("cli.examples")))
    options = tuple(str(folder / word) if word.endswith(".csv") else word for word in options)
    done = dalembert("mechanism", folder / example / f"{file}.toml", *options, "--html", "m.html")
    assert done.returncode == 0, done.stderr
    opened = Opened(browser, tmp_path / "m.html")
    for key in ["v", "a", "f", "i", "p", "End"]:
        opened.press(key)
    assert opened.faults() == []
    assert "NaN" not in opened("return document.querySelector('#view svg').outerHTML")
    poses = int(opened("return document.getElementById('slider').max"))
    for pose in range(0, poses + 1, max(1, poses // 9)):
        opened.set(pose)
        assert opened.names_in_one_place() == []
    opened.press("End")
    motion = Mechanism.from_toml(str(folder / example / f"{file}.toml")).motion
    last = opened.table("Points")
    if "mm,rad" in options:
        # the crank of 45 mm at 810°: straight up, in the unit that was asked for
        assert list(map(float, last["A"][:2])) == pytest.approx([0, 45], abs=1e-9)
    if example == "quick-return":
        # without speeds the centres are still known, from velocities for a unit of the input
        assert opened.table("Instant centres")["ground / link4"] == ["∞", "∞"]
        opened.set(20)
        centre = list(map(float, opened.table("Instant centres")["ground / link4"]))
        point = motion(np.radians(100)).point("E")
        # E moves along the vertical slot: the centre lies on its height
        assert centre[1] == pytest.approx(point.position[0, 1], rel=1e-5)


@pytest.mark.slow
def test_spin(dalembert: Run, tmp_path: Path, browser: Any) -> None:
    (tmp_path / "body.toml").write_text(
        f"name = '{EVIL}'\ninertia = [1, 2, 3]\nomega = [0.01, 1, 0.01]\nattitude = [0.8, 0.6, 0, 0]\n"
    )
    done = dalembert("spin", "body.toml", "--time", "0:20:0.1", "--html", "body.html")
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader(done.stdout.splitlines()))
    opened = Opened(browser, tmp_path / "body.html")
    faces = opened.paths("#view .face")
    for i in (0, 99, 200):
        opened.set(i)
        shown = opened.table("Angular velocity, body axes") | opened.table(
            "Attitude [w, x, y, z], body to space"
        )
        assert {name: cell for name, (cell,) in shown.items()} == {
            name: value for name, value in rows[i].items() if name.startswith(("omega", "attitude"))
        }
    assert not np.allclose(faces[0], opened.paths("#view .face")[0], atol=2)
    # H is constant in space: its arrow does not move
    arrows = []
    for i in (0, 150):
        opened.set(i)
        arrows.append(opened.paths("#view .force")[0])
    assert arrows[0] == pytest.approx(arrows[1], abs=0.05)
    assert opened("return window.broken ?? null") is None
    assert opened.text("pose").startswith("t_s 15 ")
    assert opened.faults() == []


@pytest.mark.slow
def test_a_notebook_shows_the_same_page_in_a_frame(tmp_path: Path, browser: Any) -> None:
    motion = Mechanism.from_toml_text(FOUR_BAR).motion(np.linspace(0, 2 * np.pi, 37), speed=10.0)
    (tmp_path / "cell.html").write_text(
        f"<!doctype html><title>x</title>{motion.animate(forces=True)._repr_html_()}"
    )
    opened = Opened(browser, tmp_path / "cell.html")
    frame = browser.find_element("tag name", "iframe")
    browser.switch_to.frame(frame)
    try:
        opened.set(20)
        expected = [repr(float(x)) for x in motion.point("C").position[20]]
        assert opened.table("Points")["C"][:2] == expected
        assert len(opened.table("Joint forces")) == 4
    finally:
        browser.switch_to.default_content()
    assert opened.faults() == []


def test_a_page_of_too_few_states_says_so(dalembert: Run, tmp_path: Path) -> None:
    """1 rad/s over steps of 2 s is 115° from pose to pose; π/12 rad a step take 0.3 s."""
    (tmp_path / "body.toml").write_text("inertia = [1, 2, 3]\nomega = [0, 1, 0]\n")
    for step, said in (
        (
            2,
            "warning: --html: the body turns up to 115 deg from one pose to the next: steps of 0.3 s show it turn\n",
        ),
        (0.25, ""),
    ):
        done = dalembert("spin", "body.toml", "--time", f"0:20:{step}", "--html", "b.html")
        assert done.returncode == 0
        assert done.stderr == said


LET_GO = """
name = "let go"
gravity = [0, -9.81]
[units]
length = "mm"
angle = "deg"
[ground]
A = [0, 0]
D = [400, 0]
[links.crank]
points = { A = [0, 0], B = [100, 0] }
mass = 1
center = [50, 0]
inertia = 0.001
[links.coupler]
points = { B = [0, 0], C = [350, 0] }
mass = 2
center = [175, 0]
inertia = 0.02
[links.rocker]
points = { D = [0, 0], C = [250, 0] }
mass = 1.5
center = [125, 0]
inertia = 0.008
[input]
link = "rocker"
angle = 99
speed = 5
[guess]
at = 99
coupler = 27
crank = 60
"""


@pytest.mark.slow
def test_a_motion_under_forces_moves_by_its_own_time(dalembert: Run, tmp_path: Path, browser: Any) -> None:
    """The rocker drives the crank through dead points, where the run goes on in another coordinate."""
    (tmp_path / "m.toml").write_text(LET_GO)
    names = ("A", "D", "B", "C", "crank", "coupler", "rocker")
    call = ("m.toml", "--time", "0.5:2.5:0.01", "--forces", "--only")
    done = dalembert("mechanism", *call, "B", "--html", "m.html")
    assert done.returncode == 0, done.stderr
    every = dalembert("mechanism", *call, ",".join(names))
    rows = list(csv.DictReader(every.stdout.splitlines()))
    assert len(rows) == 201
    turned = [float(row["crank_angle_deg"]) for row in rows]
    assert turned[-1] - turned[0] > 720
    opened = Opened(browser, tmp_path / "m.html")
    listed = set(
        opened("return [...document.querySelector('.plot select').options].map((o) => o.textContent)")
    )
    assert listed == set(rows[0])
    for i in (0, 60, 137, 200):
        opened.set(i)
        row = rows[i]
        assert {name: cells[:2] for name, cells in opened.table("Points").items()} == {
            name: [row[f"{name}_x_m"], row[f"{name}_y_m"]] for name in "ADBC"
        }
        links = opened.table("Links")
        assert set(links) == {"crank", "coupler", "rocker"}
        for name, (angle, omega, alpha) in links.items():
            assert angle == row[f"{name}_angle_deg"]
            assert float(omega) == pytest.approx(float(row[f"{name}_omega_rad_s"]), rel=1e-5)
            assert float(alpha) == pytest.approx(float(row[f"{name}_alpha_rad_s2"]), rel=1e-5)
        forces = opened.table("Joint forces")
        assert len(forces) == 4
        for name, cells in forces.items():
            joint, of, on = re.fullmatch(r"(.*): (.*) on (.*)", name).groups()  # type: ignore[union-attr]
            expected = [float(row[f"{joint}_{of}_on_{on}_f{axis}_N"]) for axis in "xy"]
            assert list(map(float, cells)) == pytest.approx(expected, rel=1e-5)
        # drawn where the table says: the crank's two ends, 100 mm apart at its angle
        crank, _, rocker = opened.paths("#view .link")
        assert np.hypot(*np.diff(rocker, axis=0)[0]) / np.hypot(*np.diff(crank, axis=0)[0]) == pytest.approx(
            2.5, rel=0.01
        )
        drawn = np.degrees(np.arctan2(crank[0, 1] - crank[1, 1], crank[1, 0] - crank[0, 0]))
        assert (drawn - turned[i] + 180) % 360 - 180 == pytest.approx(0, abs=0.5)
    # frames by hand, 120 ms apart: as many seconds of the motion go by, at the speed chosen, and after 2 s it begins anew
    opened.set(0)
    opened("window.requestAnimationFrame = (f) => (window.due = f); document.getElementById('play').click()")
    opened("due(1000)")
    speed = {"1/2": 0.5}[opened("return document.getElementById('speed').selectedOptions[0].textContent")]
    for frame in range(1, 41):
        opened("due(arguments[0])", 1000 + 120 * frame)
        told = float(re.match(r"t_s ([\d.]+),", opened.text("pose"))[1])  # type: ignore[index]
        assert told == pytest.approx(0.5 + 0.12 * frame * speed % 2, abs=0.0051)
    assert opened.faults() == []


def test_bad_use_is_refused(dalembert: Run, tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text(FOUR_BAR)
    (tmp_path / "body.toml").write_text("inertia = [1, 2, 3]\nomega = [0, 1, 0]\n")
    for arguments, said in (
        (("mechanism", "m.toml", "--html", "m.pdf"), "'m.pdf' has no known suffix: expected .html"),
        (
            ("mechanism", "m.toml", "--sweep", "0:360:0.01", "--html", "m.html"),
            "36001 poses: expected at most 20000",
        ),
        (
            ("spin", "body.toml", "--time", "0:30000:1", "--html", "b.html"),
            "30001 poses: expected at most 20000",
        ),
        (
            ("mechanism", "m.toml", "--time", "0:30:0.001", "--html", "m.html"),
            "30001 poses: expected at most 20000",
        ),
    ):
        done = dalembert(*arguments)
        assert done.returncode == 2
        assert said in " ".join(done.stderr.split())
        assert not list(tmp_path.glob("*.html"))
