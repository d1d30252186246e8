"""Where in a motion in time a cam would have to pull its follower: from there on the answer holds for a groove alone."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from virtualwork.describe.cams import CamDrive
from virtualwork.formulas.numbers import Reals

if TYPE_CHECKING:
    from virtualwork.intime.travel import Travel

# parts of a step at whose ends the contact force is looked at; as often the first that pulls is divided again
PARTS, TIMES = 8, 16
# of the largest contact force: less is rounding
ROUNDING = 1e-12


def contacts_lost(way: Travel, drives: Sequence[CamDrive]) -> list[str]:
    """What to know of every cam that would have to pull its follower."""
    times = [pulled_from(way, number) for number in range(len(drives))]
    return [
        f"contact lost at {since:.9g} s: {drive.label} would have to pull its follower; what follows holds for a groove"
        for drive, since in zip(drives, times, strict=True)
        if since is not None
    ]


def pulled_from(way: Travel, cam: int) -> float | None:
    """The first time at which a cam, from 0, would have to pull its follower, s; None where it always presses."""

    def contact(times: Reals) -> Reals:
        return np.asarray(way.motion(times).dynamics.contact(cam), dtype=float)

    nodes = way.nodes
    shares = np.linspace(0.0, 1.0, PARTS + 1)
    t = np.unique(np.concatenate([nodes[:1], *(nodes[:-1] + share * np.diff(nodes) for share in shares)]))
    force = contact(t)
    least = -ROUNDING * float(np.nanmax(np.abs(force), initial=0.0))
    since = None
    for _ in range(TIMES):
        pulls = np.flatnonzero(force < least)
        if not len(pulls):
            return since
        first = int(pulls[0])
        since = float(t[first])
        if first == 0:
            return since
        t = t[first - 1] + shares * (t[first] - t[first - 1])
        force = contact(t)
    return since
