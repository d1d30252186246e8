"""What a page that moves holds, and the picture that a notebook shows, without a browser."""

from __future__ import annotations

import base64
import json
import re
from dataclasses import replace
from html import unescape
from importlib.resources import files
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from dalembert.page import MOST, Page, Shown, packed
from tests.svg_names import svg_faults, svg_names
from virtualwork import Gear, Guess, Guide, Input, Link, Mechanism
from virtualwork.animation import Series, moving_page

SVG = "{http://www.w3.org/2000/svg}"


def four_bar(name: str = "", coupler: str = "coupler", scale: float = 1.0) -> Mechanism:
    links = {
        "crank": Link({"A": 0j, "B": 0.04 * scale}),
        coupler: Link({"B": 0j, "C": 0.12 * scale, "P": (0.06 + 0.05j) * scale}, mass=1, center=0.05 * scale),
        "rocker": Link({"D": 0j, "C": 0.08 * scale}),
    }
    guess = Guess(at=0.7, angles={coupler: 0.3, "rocker": 1.0})
    return Mechanism({"A": 0j, "D": 0.1 * scale}, links, inputs=Input(link="crank"), guess=guess, name=name)


def data(page: Page) -> dict[str, Any]:
    """Return what the page's script reads."""
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', page.html, re.S)
    assert found
    return json.loads(found[1])


def unpacked(column: dict[str, Any], n: int) -> Any:
    if "all" in column:
        return np.full(n, column["all"])
    (kind,) = {"f4", "f8"} & set(column)
    return np.frombuffer(base64.b64decode(column[kind]), dtype=f"<{kind}")


def test_a_page_holds_every_digit_of_places_and_seven_of_rates() -> None:
    motion = four_bar().motion(np.linspace(0, 6, 200), speed=3.0)
    held = data(motion.animate())
    (series,) = held["series"]
    columns = {c["header"]: unpacked(c, series["n"]) for c in series["columns"]}
    assert (columns["P_x_m"] == motion.point("P").position[:, 0]).all()
    assert (columns["coupler_angle_rad"] == motion.link("coupler").angle).all()
    np.testing.assert_allclose(columns["P_vy_m_s"], motion.point("P").velocity[:, 1], rtol=1e-7)
    assert set(motion.to_frame().columns) - {"assembled"} <= set(columns)


@pytest.mark.parametrize("scale", [1e-60, 1e45])
def test_rates_beyond_single_precision_keep_eight_bytes(scale: float) -> None:
    motion = four_bar(scale=scale).motion(np.linspace(0, 6, 20), speed=3.0)
    (series,) = data(motion.animate())["series"]
    (column,) = (c for c in series["columns"] if c["header"] == "P_vx_m_s")
    assert (unpacked(column, 20) == motion.point("P").velocity[:, 0]).all()


def test_a_gap_is_nan() -> None:
    assert np.isnan(unpacked(packed([1.0, np.nan, 2.0], exact=False), 3)).tolist() == [False, True, False]
    assert np.isnan(unpacked(packed([np.nan, np.nan]), 2)).all()


def test_names_cannot_end_the_script() -> None:
    page = four_bar("</title><script>x</script>", "</script><script>x").motion([0.1, 0.2]).animate()
    # the page's own: its data, its script
    assert page.html.count("<script") == page.html.count("</script>") == 2
    assert "</title><script>" not in page.html
    assert data(page)["series"][0]["bodies"][2]["name"] == "</script><script>x"


def test_a_frame_of_a_notebook_and_a_file_hold_the_same_page(tmp_path: Path) -> None:
    page = four_bar().motion([0.1, 0.2]).animate()
    page.save(tmp_path / "m.html")
    assert (tmp_path / "m.html").read_text(encoding="utf-8") == page.html
    frame = re.fullmatch(
        r'<iframe srcdoc="([^"]*)" sandbox="allow-scripts" .*</iframe>', page._repr_html_(), re.S
    )
    assert frame
    assert unescape(frame[1]) == page.html
    assert repr(page).startswith("Page(")


def test_too_many_poses_are_refused() -> None:
    motion = four_bar().motion(np.linspace(0, 6, MOST + 1))
    with pytest.raises(ValueError, match=f"{MOST + 1} poses: expected at most {MOST}"):
        motion.animate()


def test_few_poses_have_fine_paths() -> None:
    """Every path runs through 181 poses a turn at least; B's lies on its circle."""
    (series,) = data(four_bar().motion(np.linspace(0, 2 * np.pi, 13)).animate())["series"]
    path = {p["name"]: p["path"] for p in series["points"] if "path" in p}["B"]
    x, y = (unpacked(part, series["fine"]) for part in path)
    assert len(x) >= 181
    np.testing.assert_allclose(np.hypot(x, y), 0.04, rtol=1e-6)
    (series,) = data(four_bar().motion(np.linspace(0, 2 * np.pi, 361)).animate())["series"]
    assert not any("path" in p for p in series["points"])


def test_a_page_over_time_plays_by_its_own_clock() -> None:
    motion = four_bar().motion(np.linspace(0, 6, 50) ** 2 / 6, speed=1.0)
    time = np.linspace(2.0, 5.0, 50)
    shown = {"t_s": Shown(time, "t_s"), "crank_rad": Shown(motion.inputs[:, 0], "crank_rad")}
    series = Series(motion.poses, motion.drawing, shown, ["t_s", "crank_rad"])
    held = data(moving_page("run", [series, series], time="t_s"))
    columns = held["series"][0]["columns"]
    assert (unpacked(columns[held["clock"]], 50) == time).all()
    assert held["x"] == held["clock"]
    assert held["wraps"] is True
    assert len(held["series"]) == 2


def test_a_run_in_time_is_animated_through_dead_points() -> None:
    """The rocker lets the crank go round; every column is that of the run's own motion."""
    links = {
        "crank": Link({"A": 0j, "B": 0.1}, mass=1, center=0.05),
        "coupler": Link({"B": 0j, "C": 0.35}, mass=2, center=0.175, inertia=0.02),
        "rocker": Link({"D": 0j, "C": 0.25}, mass=1.5, center=0.125, inertia=0.008),
    }
    at = np.radians(98.95026226818)
    mechanism = Mechanism(
        {"A": 0j, "D": 0.4},
        links,
        inputs=Input(link="rocker", value=at),
        guess=Guess(at, {"crank": 1.05, "coupler": 0.47}),
    )
    run = mechanism.simulate(np.linspace(0, 1, 51), speed=5.0)
    assert len(run.fine.legs) > 1
    held = data(run.animate(forces=True))
    (series,) = held["series"]
    columns = {c["header"]: unpacked(c, 51) for c in series["columns"] if c["header"]}
    assert (unpacked(series["columns"][held["clock"]], 51) == run.t).all()
    assert (columns["rocker_rad"] == run.angle[:, 0]).all()
    assert np.ptp(np.unwrap(columns["crank_angle_rad"])) > 2 * np.pi
    for name in "BC":
        assert (columns[f"{name}_x_m"] == run.motion.point(name).position[:, 0]).all()
    # a link keeps its length in the columns
    B, C = (columns[f"{name}_x_m"] + 1j * columns[f"{name}_y_m"] for name in "BC")
    np.testing.assert_allclose(np.abs(C - B), 0.35, rtol=1e-14)
    force = run.motion.reaction("A", on="crank")
    np.testing.assert_allclose(columns["A_ground_on_crank_fy_N"], force[:, 1], rtol=1e-6)
    assert len(series["forces"]) == 4
    # no path over the rocker's range, which has two poses at each angle
    assert not any("path" in p for p in series["points"])


def test_few_times_have_fine_paths() -> None:
    """A pendulum's bob stays on its circle between the times."""
    bob = Link({"O": 0j, "P": 1}, mass=1, center=1)
    pendulum = Mechanism({"O": 0j}, {"bob": bob}, inputs=Input(link="bob"), gravity=-9.81j)
    run = pendulum.simulate([0, 0.3, 0.6], angle=0.0)
    (series,) = data(run.animate())["series"]
    path = {p["name"]: p["path"] for p in series["points"] if "path" in p}["P"]
    x, y = (unpacked(part, series["fine"]) for part in path)
    assert len(x) >= 181 * np.ptp(run.angle) / (2 * np.pi) > 40
    np.testing.assert_allclose(np.hypot(x, y), 1, rtol=1e-6)


def test_a_notebook_draws_a_mechanism() -> None:
    """The pins stand as far apart as the links are long, y upwards; a name stays text."""
    mechanism = four_bar("a < b & <script>", "<i>coupler</i>")
    root = ElementTree.fromstring(str(mechanism._repr_html_()))
    assert root.findtext(f"{SVG}title") == "a < b & <script>"
    texts = {str(t.text): t for t in root.iter(f"{SVG}text")}
    assert {"A", "B", "C", "D", "P", "<i>coupler</i>"} <= set(texts)
    pins = [c for c in root.iter(f"{SVG}circle") if c.get("fill") == "white"]
    places = [complex(float(c.get("cx", "")), -float(c.get("cy", ""))) for c in pins]
    motion = mechanism.motion()
    expected = [complex(*motion.point(p).position[0]) for p in "ADBC"]
    moved = np.array(places) - places[0]
    scale = abs(moved[1]) / 0.1
    np.testing.assert_allclose(moved / scale, np.array(expected) - expected[0], atol=0.05 / scale)


@pytest.mark.parametrize("at", [0.6, 2.0, 4.0])
def test_names_in_a_notebook_stand_beside_the_lines(at: float) -> None:
    """The name of the Klann leg's coupler stood upon the coupler, in its colour."""
    klann = Mechanism.from_toml(str(files("cli.examples") / "klann" / "klann.toml"))
    (crank,) = klann.inputs
    picture = str(replace(klann, inputs=replace(crank, value=at))._repr_html_())
    assert len(svg_names(picture)) == 13
    assert svg_faults(picture) == []


def test_a_mechanism_without_a_pose_shows_its_repr() -> None:
    apart = Mechanism(
        {"A": 0j, "D": 1.0},
        {
            "crank": Link({"A": 0j, "B": 0.04}),
            "rod": Link({"B": 0j, "C": 0.1}),
            "arm": Link({"D": 0j, "C": 0.1}),
        },
        inputs=Input(link="crank", value=0.2),
    )
    assert apart._repr_html_() is None
    floating = Mechanism(
        {"A": 0j}, {"crank": Link({"A": 0j}), "loose": Link({"X": 0j})}, inputs=Input(link="crank")
    )
    assert floating._repr_html_() is None


def test_springs_gears_and_guides_are_drawn_too() -> None:
    links = {
        "arm": Link({"O": 0j, "P": 0.06}),
        "planet": Link({"P": 0j}),
        "block": Link({"B": 0j}),
    }
    both = Mechanism(
        {"O": 0j},
        links,
        guides=[Guide("B", "block", "ground", 0.1 + 0j, np.pi / 2, turned=0.0)],
        gears=[Gear(("planet", "ground"), 0.4, "arm")],
        inputs=[Input(link="arm", value=0.4), Input(slider="B", value=0.05)],
    )
    root = ElementTree.fromstring(str(both._repr_html_()))
    radii = sorted(float(c.get("r", "")) for c in root.iter(f"{SVG}circle"))
    # the ring of 100 mm about the planet of 40
    assert radii[-1] / radii[-2] == pytest.approx(2.5, rel=1e-3)
    assert len(data(both.motion([[0.4, 0.05]]).animate())["series"][0]["shapes"]) > 6
