"""A pose that cannot be assembled says by how much it does not close, and at which input it would."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from virtualwork import AssemblyError, Guess, Guide, Input, Link, Mechanism


def test_two_links_too_short():
    """Crank 764 on a ground of 500: stretched out 1264 mm are needed, coupler and rocker have 1200."""
    m = Mechanism(
        {"A": (0, 0), "D": (0.5, 0)},
        {
            "crank": Link({"A": (0, 0), "B": (0.764, 0)}),
            "coupler": Link({"B": (0, 0), "C": (0.7, 0)}),
            "rocker": Link({"D": (0, 0), "C": (0.5, 0)}),
        },
        inputs=Input("crank"),
        guess=Guess(1.0, {"coupler": -1.0, "rocker": 1.5}),
    )
    found = m.assembly.reach.shortfall((math.pi,))
    assert (found.gap.needed, found.gap.available) == pytest.approx((1.264, 1.2), abs=1e-15)
    assert "reach 1200 mm, 1264 mm needed: 64 mm short" in found.text(lambda v: f"{v * 1e3:.6g} mm")
    # d² = 764² + 500² − 2·764·500·cos θ = 1200²
    edge = math.acos((0.764**2 + 0.25 - 1.44) / (0.764))
    assert found.nearest == pytest.approx(edge, abs=1e-12)
    assert m.assembly.reach.shortfall((edge - 1e-9,)) is None
    # folded: 700 − 500 = 200 mm apart at least
    near = Mechanism(
        m.ground,
        {**m.links, "crank": Link({"A": (0, 0), "B": (0.45, 0)})},
        inputs=m.inputs,
        guess=m.guess,
    )
    found = near.assembly.reach.shortfall((0.0,))
    assert (found.gap.needed, found.gap.available) == pytest.approx((0.05, 0.2), abs=1e-15)
    assert "come no nearer than 0.2 m, 0.05 m needed: 0.15 m too long" in found.text()


def test_links_with_braces_in_their_names():
    """Braces are places of numbers in the sentence; in the name of a link they are what they are."""
    m = Mechanism(
        {"A": (0, 0), "D": (9, 0)},
        {
            "crank": Link({"A": (0, 0), "B": (1, 0)}),
            "cou{pler}": Link({"B": (0, 0), "C": (3, 0)}),
            "{0}": Link({"D": (0, 0), "C": (2, 0)}),
        },
        inputs=Input("crank"),
        guess=Guess(0.0, {"cou{pler}": 0.3, "{0}": 1.2}),
    )
    text = m.assembly.reach.shortfall((0.0,)).text(lambda v: f"{v:g} m")
    assert "cou{pler} and {0} together reach 5 m, 8 m needed: 3 m short" in text


def test_a_rod_too_short_for_its_line():
    m = Mechanism(
        {"O": (0, 0)},
        {"crank": Link({"O": (0, 0), "A": (0.0502, 0)}), "rod": Link({"A": (0, 0), "B": (0.05, 0)})},
        [Guide("B", "rod")],
        inputs=Input("crank"),
        guess=Guess(0.0, {"rod": 0.1}),
    )
    found = m.assembly.reach.shortfall((math.pi / 2,))
    assert found.text(lambda v: f"{v * 1e3:.4g} mm") == "rod reaches 50 mm, 50.2 mm needed: 0.2 mm short"
    assert found.nearest == pytest.approx(math.asin(0.05 / 0.0502), abs=1e-12)
    assert m.assembly.reach.shortfall((0.3,)) is None


def test_a_slot_that_runs_past_its_pin():
    """The bar's slot stands 20 mm off its pin A; the pin P comes as near as 10 mm to A."""
    m = Mechanism(
        {"O": (0, 0), "P": (0.06, 0)},
        {"crank": Link({"O": (0, 0), "A": (0.05, 0)}), "bar": Link({"A": (0, 0), "E": (0.2, 0)})},
        [Guide("P", "ground", "bar", 0.02j)],
        inputs=Input("crank"),
        guess=Guess(2.0, {"bar": 0.0}),
    )
    found = m.assembly.reach.shortfall((0.0,))
    assert (found.gap.needed, found.gap.available) == pytest.approx((0.01, 0.02), abs=1e-15)
    assert "0.01 m too far" in found.text()
    edge = math.acos((0.05**2 + 0.06**2 - 0.02**2) / (2 * 0.05 * 0.06))
    assert found.nearest == pytest.approx(edge, abs=1e-10)


def test_two_guides_that_become_parallel():
    m = Mechanism(
        {"O": (0, 0)},
        {"crank": Link({"O": (0, 0), "A": (0.05, 0)}), "block": Link({"B": (0, 0)})},
        [Guide("B", "block", "ground", 0.03j, 0.0, 0.0), Guide("B", "block", "crank", "A", 0.0)],
        inputs=Input("crank"),
        guess=Guess(1.0),
    )
    assert m.assembly.reach.shortfall((1.0,)) is None
    assert "parallel, 0.03 m apart, and do not meet" in m.assembly.reach.shortfall((0.0,)).text()


def test_a_group_without_a_closed_form_says_what_is_left():
    """A bar with its pins in two slots 80 mm apart, longer by nothing: 73 mm leave 7 mm."""
    m = Mechanism(
        {"O": (0, 0)},
        {
            "crank": Link({"O": (0, 0), "A": (0.03, 0)}),
            "rod": Link({"A": (0, 0), "C": (0.05, 0)}),
            "bar": Link({"P": (0, 0), "Q": (0.2, 0), "C": (0.1, 0.02)}),
        },
        [Guide("P", "bar", "ground", -0.06j, 0.0), Guide("Q", "bar", "ground", 0.05j, 0.3)],
        inputs=Input("crank"),
        guess=Guess(-1.2, {"rod": -0.5, "bar": 0.5}),
    )
    q = np.linspace(-math.pi, math.pi, 73)
    there = m.motion(q).assembled
    assert 0 < there.sum() < len(q)
    found = m.assembly.reach.shortfall((q[np.flatnonzero(~there)[0]],))
    assert 0 < found.gap.needed < 0.2
    assert "its loops have a gap of" in found.text()
    assert m.assembly.reach.shortfall((q[np.flatnonzero(there)[0]],)) is None


def test_the_guess_says_it_too():
    m = Mechanism(
        {"O": (0, 0)},
        {"crank": Link({"O": (0, 0), "A": (0.06, 0)}), "rod": Link({"A": (0, 0), "B": (0.05, 0)})},
        [Guide("B", "rod")],
        inputs=Input("crank"),
        guess=Guess(math.pi / 2, {"rod": -1.0}),
    )
    assert any("rod reaches 0.05 m, 0.06 m needed: 0.01 m short" in w for w in m.assembly.warnings)


def test_the_command_says_it_in_millimetres(dalembert, tmp_path):
    file = tmp_path / "rod.toml"
    file.write_text(
        """
        units = { length = "mm", angle = "deg" }
        ground = { O = [0, 0] }
        input = { link = "crank" }
        guess = { at = 0, rod = 5 }
        links.crank.points = { O = [0, 0], A = [50.2, 0] }
        links.rod.points = { A = [0, 0], B = [50, 0] }
        slots = [{ point = "B", link = "rod" }]
        """
    )
    run = dalembert("mechanism", str(file), "--at", "0deg", "--at", "90deg", "--json")
    (text,) = [w for w in json.loads(run.stdout)["warnings"] if "cannot be assembled" in w]
    assert "at 90 deg: rod reaches 50 mm, 50.2 mm needed: 0.2 mm short" in text
    assert f"it would close at {math.degrees(math.asin(50 / 50.2)):.10g} deg" in text


def test_a_guess_where_a_larger_group_does_not_close_says_what_is_left():
    """The slots stand 300 mm apart and the bar between them is 200 mm long: 100 mm are left."""
    with pytest.raises(AssemblyError, match=r"its loops keep a gap of 0\.\d+ m"):
        _ = Mechanism(
            {"O": (0, 0)},
            {
                "crank": Link({"O": (0, 0), "A": (0.03, 0)}),
                "rod": Link({"A": (0, 0), "C": (0.15, 0)}),
                "bar": Link({"P": (0, 0), "Q": (0.2, 0), "C": (0.1, 0.02)}),
            },
            [Guide("P", "bar", "ground", -0.1j, 0.0), Guide("Q", "bar", "ground", 0.2j, 0.0)],
            inputs=Input("crank"),
            guess=Guess(1.0, {"rod": 0.0, "bar": 1.5}),
        ).assembly
