"""After how many turns of the input a branch comes back to itself."""

from __future__ import annotations

from fractions import Fraction
from math import lcm
from typing import Protocol

import numpy as np

from virtualwork.branch.change_point import ChangePoint
from virtualwork.branch.choice import Along
from virtualwork.formulas.numbers import Complexes, Reals
from virtualwork.formulas.positions import State
from virtualwork.plan.steps import Plan, turns

# places nearer than this share of a turn are one
SAME = 1e-6
# turns of the input within which a branch is looked for to come back to itself
TURNS = 32
# poses of a turn that are compared for it
COMPARED = 60


class Covered(Along, Protocol):
    """The way of the one input, which is looked through as far as it is asked for."""

    plan: Plan
    active: bool
    slides: bool
    settled: bool
    one_turn: tuple[float, dict[str, list[ChangePoint]]] | None

    def cover(self, low: float, high: float) -> None:
        """Look for change points and limits over the inputs from low to high."""


def repetition(track: Covered) -> int | None:
    """How many turns of the input bring every group back to where it stood; see `Track.repetition`."""
    if not track.active or track.slides:
        return None
    track.cover(track.start, track.start + track.length)
    if track.settled or track.one_turn is not None or not track.plan.groups:
        return 1
    steps = track.assembly.needed([key for g in track.plan.groups for key in track.plan.writes(g)])
    factors = [k for t in turns(steps) for _, k in t.angle.inputs]
    ratios = [Fraction(k).limit_denominator(TURNS) for k in factors]
    if any(abs(float(r) - k) > 1e-12 * abs(k) for r, k in zip(ratios, factors, strict=True)):
        return None
    whole = lcm(*(r.denominator for r in ratios))
    q = track.start + track.length * (np.arange(COMPARED) + 0.5) / COMPARED
    here = _stands(track, q)
    for n in range(whole, TURNS + 1, whole):
        track.cover(track.start - n * track.length, track.start + track.length)
        # beyond a limit there is nothing to compare: what is not assembled contradicts nothing
        if not (np.abs(_stands(track, q - n * track.length) - here) > SAME).any():
            return n
    return None


def _stands(track: Covered, q: Reals) -> Complexes:
    """Rotations and slides (over the size) of all groups at inputs q; NaN where not assembled."""
    st = State([q], many=True)
    with np.errstate(all="ignore"):
        track.run(track.assembly.needed([key for g in track.plan.groups for key in track.plan.writes(g)]), st)
    rows = [st.turn[b] for g in track.plan.groups for b in g.members]
    rows += [st.slide[s] / track.assembly.mechanism.size for g in track.plan.groups for s in g.slides]
    return np.array([np.broadcast_to(row, q.shape) for row in rows])
