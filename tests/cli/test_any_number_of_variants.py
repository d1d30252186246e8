"""No number, refusal or warning of a variant depends on how many others there are."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cli.cases.analysis import Request
from cli.cases.axes import grids
from cli.cases.cases import Cases
from cli.cases.inputs import Grid, Varied
from cli.cases.loop import Loop
from cli.mechanism.cycle import Forces
from cli.mechanism.poses import Poses
from cli.show.commands import ShowOptions
from tests.cli.rows import axis
from tests.cli.rows import rows as as_rows
from virtualwork import Mechanism
from virtualwork.describe.dimensions import dimensions

FOUR_BAR = """
name = "four-bar"
gravity = [0, -9.81]
ground = { A = [0, 0], D = [0.1, 0] }
input = { link = "crank" }
guess = { at = "40 deg", coupler = "20 deg", rocker = "57 deg" }
[links]
crank = { points = { A = [0, 0], B = [0.04, 0] }, mass = 0.5 }
coupler = { points = { B = [0, 0], C = [0.12, 0], H = [0.05, 0.03] }, mass = 0.25, inertia = 0.001 }
rocker = { points = { D = [0, 0], C = [0.08, 0] } }
"""
SLIDER = """
name = "slider-crank with a torsion spring"
ground = { A = [0, 0] }
input = { link = "crank", speed = 3 }
guess = { at = "40 deg", rod = "-10 deg" }
sliders = [{ link = "piston", point = "C", on = "ground", angle = "0 deg" }]
torsion_springs = [{ links = ["ground", "crank"], stiffness = 2 }]
[links]
crank = { points = { A = [0, 0], B = [0.04, 0] } }
rod = { points = { B = [0, 0], C = [0.12, 0] } }
piston = { points = { C = [0, 0] }, mass = 2 }
"""
YOKE = """
name = "yoke"
ground = { O = [0, 0] }
input = { link = "crank", speed = 3 }
slots = [{ link = "crank", point = "P", on = "yoke", through = "S", angle = "80 deg" }]
sliders = [{ link = "yoke", point = "S", on = "ground", angle = "0 deg" }]
[links]
crank = { points = { O = [0, 0], P = [0.04, 0] } }
yoke = { points = { S = [0, 0] }, mass = 2 }
"""
OWN = {
    FOUR_BAR: {
        "links.crank.B.x": 0.04, "ground.D.x": 0.1, "links.coupler.C.x": 0.12, "links.coupler.mass": 0.25,
        "input.speed": 10.0,
    },
    SLIDER: {"links.crank.B.x": 0.04, "links.rod.C.x": 0.12, "links.piston.mass": 2.0},
    YOKE: {"links.crank.P.x": 0.04, "slots.1.angle": 80.0, "links.yoke.mass": 2.0, "input.speed": 3.0},
}  # fmt: skip


class PosesOneByOne(Poses):
    """Every variant described alone."""

    def together(self, row, json):
        return None


class ForcesOneByOne(Forces):
    """Every variant described alone."""

    def together(self, row, json):
        return None


def many(text, rows, at=range(0, 360, 60), one_by_one=False, **request):
    """The variants of some rows, at some angles of the crank; None: at that of the file."""
    m = Mechanism.from_toml_text(text)
    every = dimensions(m)
    names = [Varied(every[path]) for path in OWN[text]]
    varied = Grid((axis(names, rows),))
    _, moved = grids(m, None if at is None else [f"{angle}deg" for angle in at], None, None, {}, [])
    kinds = (Forces, ForcesOneByOne) if request.get("forces") else (Poses, PosesOneByOne)
    cases = Cases(Request("m.toml", **request), m, {}, varied, moved)
    study = kinds[one_by_one](cases, ShowOptions())
    if not one_by_one:
        assert study.together(as_rows(names, list(OWN[text].values())), json=True) is not None
    return Loop(study)


def drawn(text, rng, count):
    """Rows about the file's own, and among them such as a description refuses or of which there is something to say."""
    own = np.array(list(OWN[text].values()))
    rows = own * (1 + 0.2 * rng.normal(size=(count, len(own))))
    for column, odd in enumerate(own):
        # zero, the other sign, far too long; and a row that is the file's own
        for value in (0.0, -odd, 6 * odd, odd):
            i = int(rng.integers(count))
            rows[i] = own
            rows[i, column] = value
    return rows


def cells(table):
    return {c.header: list(c.values) for c in table.columns if c.header != "variant"}


def test_a_crank_of_length_zero_is_refused_among_41_as_among_21():
    for count in (21, 41):
        rows = [[r, *list(OWN[FOUR_BAR].values())[1:]] for r in np.linspace(-0.05, 0.05, count)]
        loop = many(FOUR_BAR, rows, None)
        table = cells(loop.table)
        middle = count // 2
        assert table["assembled"] == [i != middle for i in range(count)]
        assert table["H_x_m"][middle] is None
        assert table["H_vy_m_s"][middle] is None
        (line,) = loop.remarks.lines()
        assert line.startswith(f"variant {middle + 1}: [links.crank] points: A and B are both joints at the")


def test_a_speed_that_begins_at_zero_is_that_of_each():
    rows = [[*list(OWN[FOUR_BAR].values())[:4], w] for w in np.linspace(0.0, 10.0, 41)]
    table = cells(many(FOUR_BAR, rows, None).table)
    for name in ("H_vx_m_s", "coupler_omega_rad_s"):
        np.testing.assert_allclose(table[name], np.linspace(0.0, 1.0, 41) * table[name][-1], rtol=1e-14)
        assert table[name][-1]


@pytest.mark.parametrize(
    ("text", "wanted"), [(FOUR_BAR, {"forces": True}), (YOKE, {}), (SLIDER, {"forces": True})]
)
def test_some_of_many_are_the_same_to_the_last_digit(text, wanted):
    rng = np.random.default_rng(1)
    rows = drawn(text, rng, 40)
    whole = many(text, rows, **wanted)
    expected, poses = cells(whole.table), len(whole.table.columns[0].values) // 40
    remarks = dict(whole.remarks.kept)
    for count in rng.permutation([1, 2, 31, 32, 33]):
        first = int(rng.integers(40 - count + 1))
        part = many(text, rows[first : first + count], **wanted)
        table = part.table
        here = slice(first * poses, (first + count) * poses)
        if any(expected["assembled"][here]):
            assert cells(table) == {key: values[here] for key, values in expected.items()}
        for i in range(count):
            its = dict(part.remarks.kept).get(str(i + 1))
            assert its == remarks.get(str(first + i + 1)), first + i


def agree(found, expected, at=()):
    """One by one in numbers to rounding, in everything else exactly."""
    if isinstance(expected, dict):
        assert list(found) == list(expected), at
        for key in expected:
            agree(found[key], expected[key], (*at, key))
    elif isinstance(expected, list):
        assert len(found) == len(expected), at
        for i, pair in enumerate(zip(found, expected, strict=True)):
            agree(*pair, (*at, i))
    elif isinstance(expected, float) and isinstance(found, float):
        apart = math.remainder(found - expected, 360) if "_deg" in str(at) else found - expected
        assert abs(apart) <= 1e-8 * max(abs(expected), 1.0), (at, found, expected)
    else:
        assert found == expected, at


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        (FOUR_BAR, {"forces": True}),
        (YOKE, {"forces": True}),
        (SLIDER, {"forces": True}),
        (FOUR_BAR, {}),
        (FOUR_BAR, {"only": ["H", "rocker"]}),
        (FOUR_BAR, {"only": ["rocker"], "order": 0, "forces": True}),
    ],
)
def test_numbers_refusals_and_warnings_are_those_described_alone(text, wanted):
    rows = drawn(text, np.random.default_rng(2), 14)
    if text == FOUR_BAR:
        # a parallelogram, which goes through change points; one that no crank turns; one far out of reach
        rows[:3, :3] = (0.08, 0.12, 0.12), (0.1, 0.1, 0.12), (0.04, 0.5, 0.12)
    together, alone = (
        many(text, rows, range(0, 721, 120), one_by_one, **wanted) for one_by_one in (False, True)
    )
    agree(cells(together.table), cells(alone.table))
    assert together.remarks == alone.remarks
    agree(together.documents, alone.documents)
    assert together.remarks == alone.remarks


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("text", [FOUR_BAR, YOKE, SLIDER])
@pytest.mark.parametrize("wanted", [{}, {"forces": True}, {"only": ["crank"]}])
def test_a_thousand_in_any_order_are_those_described_alone(seed, text, wanted):
    rng = np.random.default_rng(seed)
    rows = drawn(text, rng, 1000)
    together = many(text, rows, **wanted)
    expected = cells(together.table)
    poses = len(expected["assembled"]) // 1000
    order = rng.permutation(1000)
    for count in rng.permutation([1, 2, 31, 32, 33, 1000]):
        places = order[:count]
        found = cells(many(text, rows[places], **wanted).table)
        picked = (places[:, None] * poses + np.arange(poses)).ravel()
        if any(found["assembled"]):
            assert found == {key: [values[i] for i in picked] for key, values in expected.items()}
    places = order[:100]
    together, alone = (
        many(text, rows[places], one_by_one=one_by_one, **wanted) for one_by_one in (False, True)
    )
    agree(cells(together.table), cells(alone.table))
    assert together.remarks == alone.remarks
    agree(together.documents, alone.documents)
    assert together.remarks == alone.remarks
