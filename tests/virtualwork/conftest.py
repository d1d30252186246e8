"""Random mechanisms for the tests of kinematics."""

from __future__ import annotations

import cmath

import pytest

from virtualwork import Guess, Guide, Input, Link, Mechanism


def build(kind, rng, scale=1.0):
    """A random mechanism that stands assembled at its guess; every link's frame lies anyhow in it."""
    a, b, c, d, e, f, g = (complex(*rng.uniform(-1, 1, 2)) * scale for _ in range(7))
    guess = {}

    def link(name, points):
        origin = next(iter(points.values()))
        theta = rng.uniform(-3, 3)
        guess[name] = theta
        off = complex(*rng.normal(size=2)) * 0.3 * scale
        return Link({p: (z - origin) / cmath.exp(1j * theta) + off for p, z in points.items()})

    four = {"crank": {"A": a, "B": b}, "coupler": {"B": b, "C": c}, "rocker": {"C": c, "D": d}}
    ground = {"A": a, "D": d}
    guides = []
    if kind == "four-bar":
        bodies = four
    elif kind == "slider-crank":
        bodies = {"crank": four["crank"], "coupler": four["coupler"]}
        angle = rng.uniform(-3, 3)
        guides = [Guide("C", "coupler", "ground", c - rng.normal() * scale * cmath.exp(1j * angle), angle)]
    elif kind == "inverted slider-crank":
        bodies = {"crank": four["crank"], "rocker": {"D": d, "E": e}}
    elif kind == "Watt":
        bodies = {
            "crank": {"A": a, "B": b}, "coupler": {"B": b, "C": c, "E": e}, "rocker": {"C": c, "D": d, "F": f},
            "fifth": {"E": e, "G": g}, "sixth": {"F": f, "G": g},
        }  # fmt: skip
    elif kind == "Stephenson":
        ground["G"] = g
        bodies = {
            "crank": {"A": a, "B": b}, "coupler": {"B": b, "C": c, "E": e}, "rocker": {"C": c, "D": d},
            "fifth": {"E": e, "F": f}, "sixth": {"F": f, "G": g},
        }  # fmt: skip
    else:  # a triad: the input drives the five-bar loop
        ground["G"] = g
        bodies = {
            "crank": {"G": g, "F": f}, "rod": {"F": f, "E": e}, "coupler": {"E": e, "B": b, "C": c},
            "left": {"B": b, "A": a}, "right": {"C": c, "D": d},
        }  # fmt: skip
    links = {name: link(name, points) for name, points in bodies.items()}
    if kind == "inverted slider-crank":
        local = (b - d) / cmath.exp(1j * guess["rocker"]) + links["rocker"].points["D"]
        angle = rng.uniform(-3, 3)
        guides = [Guide("B", "crank", "rocker", local - rng.normal() * scale * cmath.exp(1j * angle), angle)]
    return Mechanism(ground, links, guides, inputs=Input(link="crank"), guess=Guess(guess["crank"], guess))


@pytest.fixture
def random_mechanism():
    """A maker of random mechanisms: (kind, rng, scale)."""
    return build
