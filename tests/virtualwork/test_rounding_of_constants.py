"""Estimates of rounding errors where numbers of the description are 1 and -1: what is formed of these is no float."""

from __future__ import annotations

from fractions import Fraction

import pytest

from benchmarks.stress.groups import compare
from dalembert.arithmetic.engines.doubled import run
from dalembert.arithmetic.recorded import Recorder
from virtualwork import Guess, Input, Link, Mechanism
from virtualwork.digits.exact import Unrounded


@pytest.mark.parametrize("turned", [1.0, -1.0])
@pytest.mark.parametrize(
    ("coupler", "rocker", "ground"),
    [(-1 + 1j, 1 + 1j, 1 - 1j), (1 + 1j, -1 + 1j, 1 + 0j), (1 + 0j, 1j, 1 + 1j)],
)
def test_estimates_of_links_a_unit_along_and_a_unit_across(
    coupler: complex, rocker: complex, ground: complex, turned: float
) -> None:
    """Roots and angles of such constants, √2 and 45°, are no floats: the second run had them in 16 digits."""

    def mirrored(z: complex) -> complex:
        return complex(z.real, turned * z.imag)

    m = Mechanism(
        ground={"A": 0j, "D": mirrored(ground)},
        links={
            "crank": Link({"A": 0j, "B": mirrored(1 + 1j)}),
            "coupler": Link({"B": 0j, "C": mirrored(coupler)}),
            "rocker": Link({"D": 0j, "C": mirrored(rocker)}),
        },
        inputs=Input("crank"),
        guess=Guess(0.4 * turned, {"coupler": 0.3 * turned, "rocker": 0.8 * turned}),
    )
    motion = m.motion(m.at[0], 1.3, 0.7)
    assert motion.assembled.all()
    for error, estimate in compare(motion):
        assert error <= estimate


def test_systems_of_constants_and_numbers_have_32_digits() -> None:
    """A column of ones: its reflection has a √3. Vandermonde's determinant with thirds, by Cramer's rule in fractions."""
    recorder = Recorder()
    x = [recorder.input(name) for name in "abc"]
    system = [[1.0, node, node * node] for node in x]
    solution = Unrounded(recorder).system(system, [1.0, 0.0, 0.0])
    nodes = [Fraction(3, 8), Fraction(5, 4), Fraction(-7, 16)]
    found = run(
        recorder.tape(dict(zip("uvw", solution, strict=True))),
        {name: float(node) for name, node in zip("abc", nodes, strict=True)},
    )
    # the polynomial that is 1 at the first node and 0 at the others
    scale = 1 / ((nodes[0] - nodes[1]) * (nodes[0] - nodes[2]))
    truth = [scale * nodes[1] * nodes[2], -scale * (nodes[1] + nodes[2]), scale]
    for value, exact in zip(found.values(), truth, strict=True):
        assert abs(Fraction(float(value.high)) + Fraction(float(value.low)) - exact) < Fraction(1, 10**29)
