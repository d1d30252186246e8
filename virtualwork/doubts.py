"""What is doubtful of poses, in one sentence each: the guess, loops without a speed, poses that cannot be assembled."""

from __future__ import annotations

from math import isfinite

import numpy as np

from virtualwork.branch.assembly import Assembly
from virtualwork.formulas.poses import Poses


def warnings_of(assembly: Assembly, poses: Poses, called: str = "poses") -> tuple[str, ...]:
    """Return the warnings of an assembly, and of those of its poses that cannot be assembled."""
    bad = np.flatnonzero(~poses.assembled)
    lines = assembly.track.warnings()
    if not len(bad):
        return lines
    first = tuple(poses.inputs[bad[0]].tolist())
    at = ", ".join(f"{x:.6g}" for x in first)
    why = f"{len(bad)} of {poses.n} {called} cannot be assembled, the first at {at}: {reason_at(assembly, first)}"
    return (*lines, why)


def reason_at(assembly: Assembly, inputs: tuple[float, ...]) -> str | None:
    """Return why an assembly has no pose at some inputs, in m and rad, and where it would close; None if it has one."""
    if not all(map(isfinite, inputs)):
        return "the input is no number"
    short = assembly.reach.shortfall(inputs)
    if short is None:
        return None
    unit = "m" if assembly.mechanism.inputs[0].is_slide else "rad"
    closing = "" if short.nearest is None else f"; it would close at {short.nearest:.6g} {unit}"
    return f"{short.text()}{closing}"
