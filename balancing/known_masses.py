"""Rotors whose masses are known, on tapes: what a page needs to compute their corrections anew.

Corrections are linear in the unbalances, and what an unbalance of 1 asks of every plane is linear in its place: both numbers
come from `correct`; the tapes hold the vectors of the entries, their sums, sizes and angles.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from balancing.correction import correct
from balancing.tapes import Number, Outputs, parts, size_and_angle, vector
from dalembert.arithmetic.recorded import RECORDED, Recorder
from dalembert.arithmetic.tape import Tape

Real = NDArray[np.float64]


def shares(planes: Real) -> tuple[Real, Real, float]:
    """What an unbalance of 1 at z adds in every plane, first + slope·(z − about): (first, slope, about).

    >>> first, slope, about = shares(np.array([0.0, 0.09]))
    >>> (first + slope * (0.03 - about)).round(12)
    array([-0.66666667, -0.33333333])
    """
    about = float(planes[0])
    if len(planes) == 1:
        return -np.ones(1), np.zeros(1), about
    span = float(np.ptp(planes))
    first, last = (correct([1.0], [z], planes).unbalance.real for z in (about, about + span))
    return first, (last - first) / span, about


def known_masses(
    planes: Real,
    radius: Real,
    about: float,
    gravity: float | None,
    bearings: Real | None = None,
    remove: bool = False,
    fixed: Real | None = None,
) -> dict[str, Tape]:
    """The tapes of a rotor whose masses are known.

    `mass` adds one entry (`amount`, kg, N or kg·m; `radius`; `angle`; `z`) to the sums and gives its share of every plane;
    `result` has the corrections, the rotor's state before and after, and what the tolerance is held against; `given` the state
    after corrections as they are given out (`mass P`, `radius P`, `angle P`), rounded for one.

    Parameters
    ----------
    planes, radius : array (p,)
        m; a radius of NaN follows from the mass that is fixed.
    about : float
        The place of the couple, m.
    gravity : float, optional
        Where the amounts are weights.
    bearings : array (2,), optional
        The planes of the tolerance.
    remove : bool
        Whether corrections are material to remove.
    fixed : array (p,), optional
        The mass that stands in a plane, kg; NaN where it is free.
    """
    recorder = Recorder()
    amount, arm, angle, z = (recorder.input(name) for name in ("amount", "radius", "angle", "z"))
    u = amount * arm * RECORDED.turn(angle)
    if gravity is not None:
        u = u / gravity
    outputs: Outputs = {}
    sums = {"static": u, "couple": u * (z - about)}
    places = {"plane": planes} | ({} if bearings is None else {"bearing": bearings})
    for what, at in places.items():
        first, slope, start = shares(np.asarray(at, dtype=float))
        for p in range(len(at)):
            share = u * (float(first[p]) + float(slope[p]) * (z - start))
            sums[f"{what} {p}"] = share
            if what == "plane":
                outputs |= parts(f"share {p}", -share)
    for name, share in sums.items():
        outputs |= parts(f"sum {name}", vector(recorder, f"sum {name}") + share)
    mass = recorder.tape(outputs)

    recorder = Recorder()
    results: Outputs = {}
    made = [vector(recorder, f"sum plane {p}") for p in range(len(planes))]
    static, couple = (vector(recorder, f"sum {name}") for name in ("static", "couple"))
    for p, w in enumerate(made):
        results |= size_and_angle(f"plane {p}", -w if remove else w)
        own = np.nan if fixed is None else float(fixed[p])
        results[f"mass {p}"] = abs(w) / float(radius[p]) if np.isnan(own) else own
        results[f"radius {p}"] = abs(w) / own if np.isnan(radius[p]) else float(radius[p])
        results |= parts(f"made {p}", w)
    results |= size_and_angle("static", static) | size_and_angle("couple", couple)
    results |= _left(static, couple, made, planes - about)
    if bearings is not None:
        for p in range(len(bearings)):
            results[f"before {p}"] = abs(vector(recorder, f"sum bearing {p}"))
    result = recorder.tape(results)

    recorder = Recorder()
    outputs = {}
    put = []
    for p in range(len(planes)):
        size = recorder.input(f"mass {p}") * recorder.input(f"radius {p}")
        w = size * RECORDED.turn(recorder.input(f"angle {p}"))
        put.append(-w if remove else w)
        outputs |= {f"plane {p} size": abs(w)} | parts(f"made {p}", put[p])
    static, couple = (vector(recorder, f"sum {name}") for name in ("static", "couple"))
    given = recorder.tape(outputs | _left(static, couple, put, planes - about))
    return {"mass": mass, "result": result, "given": given}


def _left(static: Number, couple: Number, made: list[Number], arms: Real) -> Outputs:
    """What corrections leave of the unbalance and of its couple."""
    levers = [w * float(arm) for w, arm in zip(made, arms, strict=True)]
    return {"left static": abs(sum(made, static)), "left couple": abs(sum(levers, couple))}
