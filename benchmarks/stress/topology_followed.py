"""Mechanisms of any topology followed from the pose they are drawn in, by all constraints at once, and judged by it."""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.stress.topologies import REGULAR, Topology, constraints, evaluate, regularity
from virtualwork.describe import MechanismError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Reals = NDArray[np.float64]

# how far from the guess poses are compared, rad or m, and the steps to them
OFF = (0.02, 0.3, 1.0)
STEP, FINEST = 0.1, 1e-3
# a pose less regular than this, or with a link this far out, m, is followed no further
END, FAR = 1e-4, 100.0


def newton(t: Topology, x: Reals, inputs: tuple[float, ...]) -> Reals | None:
    """All constraints at once by Newton-Raphson from x; None where it does not converge or J turns singular."""
    for _ in range(12):
        value, jacobian = evaluate(t, x, inputs)
        try:
            step = np.linalg.solve(jacobian, value)
        except np.linalg.LinAlgError:
            return None
        x = x - step
        if not np.isfinite(step).all() or np.abs(step).max() > 0.5:
            return None
        if np.abs(step).max() < 1e-13:
            return x
    return x if np.abs(step).max() < 1e-9 else None


@dataclass(frozen=True)
class Way:
    """Poses along the inputs: x, y, θ of every link by distance from the guess; how far it goes, and what ends it.

    `end` is "" where nothing ends it, "limit" where it can go no further, "singular" where branches may cross, "far"
    where a link runs away or turns too fast to be followed.
    """

    poses: dict[float, Reals]
    reached: float
    end: str


def follow(
    t: Topology, towards: tuple[float, ...], off: tuple[float, ...] = OFF, finest: float = FINEST
) -> Way:
    """The poses at some distances from the guess, in small steps on all constraints at once.

    Parameters
    ----------
    towards : tuple of float
        What the inputs change by in a unit of distance.
    off : tuple of float
        The distances, rising.
    finest : float
        The shortest step.

    Returns
    -------
    Way
        Up to the first singular pose: beyond it a branch is not the only one.
    """
    found: dict[float, Reals] = {}
    at, way = np.array(t.inputs), np.array(towards)
    x, gone, step = t.unknowns(), 0.0, STEP

    def inputs(gone: float) -> tuple[float, ...]:
        return tuple(float(v) for v in at + gone * way)

    side, first = np.linalg.slogdet(evaluate(t, x, t.inputs)[1])
    size = first
    for distance in off:
        while gone < distance:
            if step < finest:
                return Way(found, gone, "limit" if size - first < math.log(0.1) else "far")
            to = min(distance, gone + step)
            # a constraint is linear in the inputs: this is its change, without an error
            value, jacobian = evaluate(t, x, inputs(gone))
            moved = constraints(t, x, inputs(to)) - value
            guess = x - np.linalg.solve(jacobian, moved)
            new = newton(t, guess, inputs(to))
            change = np.inf if new is None else np.abs(new - x).max()
            if new is None or change > 0.3 or np.abs(new - guess).max() > max(0.1 * change, 1e-9):
                step /= 2
                continue
            jacobian = evaluate(t, new, inputs(to))[1]
            s = np.linalg.svd(jacobian, compute_uv=False)
            sign, size = np.linalg.slogdet(jacobian)
            if s[-1] < END * s[0] or sign != side or np.abs(new).max() > FAR:
                return Way(found, to, "far" if np.abs(new).max() > FAR else "singular")
            x, gone, step = new, to, min(STEP, 2 * step)
        found[distance] = x
    return Way(found, gone, "")


def verdict(t: Topology) -> str:
    """What the program makes of a mechanism at the very pose that its guess gives, and further along its inputs.

    Returns
    -------
    str
        "put together" where every link stands within rounding of where it was drawn, and where the inputs then bring it
        in small steps; "refused" where the constraints do not determine the pose and the program says so; everything
        else is a fault and says what is wrong.
    """
    regular = regularity(t)
    at = np.array([t.inputs]) if len(t.inputs) > 1 else np.array(t.inputs)
    try:
        motion = t.mechanism.motion(at)
        closed = bool(motion.assembled[0])
        away = _away(t, motion, 0, t.unknowns()) if closed else math.nan
        if closed and away < _rounding(regular):
            return _further(t) if regular > END else "put together"
    except MechanismError as error:
        return "refused" if regular <= REGULAR else f"refused though regular: {error}"
    except Exception as error:
        return f"internal error: {error!r}"
    if not closed:
        return "refused" if regular <= REGULAR else "not assembled at its own guess"
    return f"{away:.2g} away from its guess"


def _rounding(regular: float) -> float:
    """How far apart two solutions of one pose may be."""
    return 1e-10 / max(regular, 1e-5)


def _further(t: Topology) -> str:
    """What the program makes of the poses at both sides of the guess."""
    way = (1.0,) if len(t.inputs) == 1 else (0.8, 0.6)
    poses = [
        (side * off, x)
        for side in (1.0, -1.0)
        for off, x in follow(t, tuple(side * w for w in way)).poses.items()
    ]
    if not poses:
        return "put together"
    at = np.array(t.inputs) + np.multiply.outer([off for off, _ in poses], way)
    motion = t.mechanism.motion(at if len(way) > 1 else at[:, 0])
    for i, (off, x) in enumerate(poses):
        if not motion.assembled[i]:
            return f"not assembled {off:+g} from its guess"
        away = _away(t, motion, i, x)
        if away > _rounding(END):
            return f"{away:.2g} away, {off:+g} from its guess"
    return "put together"


def _away(t: Topology, motion: Any, i: int, x: Reals) -> float:
    """How far pose i is from x: chords of the unit circle, and m of every point."""
    away = 0.0
    for k, (body, link) in enumerate(t.mechanism.links.items()):
        turn = cmath.exp(1j * x[3 * k + 2])
        away = max(away, abs(cmath.exp(1j * motion.link(body).angle[i]) - turn))
        for z in link.points.values():
            there = complex(x[3 * k], x[3 * k + 1]) + z * turn
            away = max(away, abs(motion.at(body, z).complex(0)[i] - there))
    return away
