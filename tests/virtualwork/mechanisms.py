"""Mechanisms that several tests ask."""

from __future__ import annotations

from typing import Any

import numpy as np

from virtualwork import Guess, Guide, Input, Link, Mechanism
from virtualwork.study.counterweights import pivot

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


def berkof_lowen(mechanism: Mechanism, crank: str, coupler: str, rocker: str) -> dict[str, complex]:
    """Return the counterweights on crank and rocker that balance a four-bar's shaking force completely.

    R. S. Berkof and G. G. Lowen (J. Eng. Ind. 91, 1969, 21): the common centre of mass rests where, by the loop
    closure, the coupler's mass is shared between its two pins, m₃ (1 − z₃/l₃) at the crank's and m₃ z₃/l₃ at the
    rocker's (complex shares, z₃ in the coupler's axes along its pins), and each turning link is balanced with its share.
    Mass times radius, complex kg·m, in the link's axes from its pivot.
    """
    links = mechanism.links

    def shared(a: str, b: str) -> str:
        common = [p for p in links[a].points if p in links[b].points]
        assert len(common) == 1
        return common[0]

    b, c = shared(crank, coupler), shared(coupler, rocker)
    body = links[coupler]
    share = (body.center - body.points[b]) / (body.points[c] - body.points[b])
    result = {}
    for link, point, part in ((crank, b, 1 - share), (rocker, c, share)):
        base = pivot(mechanism, link)
        own = links[link].mass * (links[link].center - base)
        result[link] = -(own + body.mass * part * (links[link].points[point] - base))
    return result
