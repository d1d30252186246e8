"""Mechanisms, motions and results compare, copy and pickle, and tell themselves in one line."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import numpy as np
import pytest

import virtualwork as vw
from tests.virtualwork.mechanisms import four_bar
from virtualwork import Force, Mechanism, Spring


def press(**more: Any) -> Mechanism:
    """A crank-rocker with masses, a force and a spring."""
    return four_bar(
        name="press",
        gravity=-9.81j,
        forces=[Force("rocker", 0.05 + 0j, 10 + 0j)],
        springs=[Spring((("rocker", 0.05 + 0j), ("ground", 0.2 + 0.1j)), 50.0, 0.02)],
        **more,
    )


M = press()
SWEEP = M.motion(np.linspace(0.0, 2 * np.pi, 37), 3.0, 1.0)
RESULTS = {
    "link": M.links["crank"],
    "guess": M.guess,
    "mechanism": M,
    "assembly": M.assembly,
    "motion": SWEEP,
    "one pose": M.motion(0.5),
    "cycle": SWEEP.cycle,
    "equilibria": M.equilibria(),
    "check": M.check,
    "newton": M.newton(),
}


@pytest.mark.parametrize("name", RESULTS)
def test_a_copy_and_a_pickle_are_equal(name: str) -> None:
    found = RESULTS[name]
    for again in (copy.copy(found), copy.deepcopy(found), pickle.loads(pickle.dumps(found))):
        assert type(again) is type(found)
        assert again == found
    assert found != object()


@pytest.mark.parametrize("name", RESULTS)
def test_it_tells_itself_in_one_line(name: str) -> None:
    text = repr(RESULTS[name])
    assert "\n" not in text
    assert len(text) < 400
    assert " object at 0x" not in text


def test_what_differs_is_not_equal() -> None:
    other = press(friction=[vw.Friction("B", 0.1, 0.002)])
    assert other != M
    assert other.assembly != M.assembly
    assert M.motion(0.5) != M.motion(0.6)
    assert M.motion(0.5, 1.0) != M.motion(0.5, 2.0)


def test_a_motion_from_a_pickle_goes_on_working() -> None:
    again = pickle.loads(pickle.dumps(SWEEP))
    assert (again.effort == SWEEP.effort).all()
    assert (again.point("C").acceleration == SWEEP.point("C").acceleration).all()


def test_a_motion_as_a_table() -> None:
    table = SWEEP.to_frame()
    assert len(table) == 37
    assert (table["crank_rad"] == SWEEP.inputs[:, 0]).all()
    assert (table["C_ay_m_s2"] == SWEEP.point("C").acceleration[:, 1]).all()
    assert (table["rocker_omega_rad_s"] == SWEEP.link("rocker").omega).all()
    assert "<table" in SWEEP._repr_html_()


def test_an_unknown_part_is_refused() -> None:
    with pytest.raises(TypeError, match="loads"):
        press(loads=[])
