"""Mechanisms that several tests ask."""

from __future__ import annotations

from typing import Any

import numpy as np

from virtualwork import Guess, Guide, Input, Link, Mechanism

SWEEP = np.linspace(0, 2 * np.pi, 361)


def four_bar(**given: Any) -> Mechanism:
    """A crank-rocker with masses off the lines of its pins."""
    return Mechanism(
        ground={"A": 0j, "D": 0.1},
        links={
            "crank": Link({"A": 0j, "B": 0.04}, 1.0, 0.01 + 0.003j, 1e-3),
            "coupler": Link({"B": 0j, "C": 0.12}, 2.0, 0.04 + 0.01j, 2e-3),
            "rocker": Link({"D": 0j, "C": 0.08}, 1.5, 0.03 - 0.01j, 1e-3),
        },
        inputs=Input(link="crank"),
        guess=Guess(at=(0.7,), angles={"coupler": 0.3, "rocker": 1.0}),
        **given,
    )


def slider_crank(r: float = 0.1, length: float = 0.3, **given: Any) -> Mechanism:
    """An in-line slider-crank without mass; the piston is the link `piston`."""
    return Mechanism(
        ground={"O": 0j},
        links={
            "crank": Link({"O": 0j, "A": r}),
            "rod": Link({"A": 0j, "B": length}),
            "piston": Link({"B": 0j}, **given.pop("piston", {})),
        },
        guides=[Guide("B", "piston", turned=0.0)],
        inputs=Input(link="crank"),
        guess=Guess(at=(1.0,), angles={"rod": -0.3}),
        **given,
    )
