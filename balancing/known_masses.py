"""Rotors whose masses are known, on tapes: what a page needs to compute their corrections anew.

Corrections are linear in the unbalances, and what an unbalance of 1 asks of every plane is linear in its place: both numbers
come from `correct`; the tapes hold the vectors of the entries, their sums, sizes and angles.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from balancing.correction import correct
from balancing.tapes import Outputs, parts, size_and_angle, vector
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
) -> dict[str, Tape]:
    """The tapes of a rotor whose masses are known.

    `mass` adds one entry (`amount`, kg, N or kg·m; `radius`; `angle`; `z`) to the sums and gives its share of every plane;
    `result` has the corrections, the rotor's state before and after, and what the tolerance is held against.

    Parameters
    ----------
    planes, radius : array (p,)
        m.
    about : float
        The place of the couple, m.
    gravity : float, optional
        Where the amounts are weights.
    bearings : array (2,), optional
        The planes of the tolerance.
    remove : bool
        Whether corrections are material to remove.
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
    found: Outputs = {}
    made = [vector(recorder, f"sum plane {p}") for p in range(len(planes))]
    static, couple = (vector(recorder, f"sum {name}") for name in ("static", "couple"))
    for p, w in enumerate(made):
        found |= size_and_angle(f"plane {p}", -w if remove else w)
        found[f"mass {p}"] = abs(w) / float(radius[p])
        found |= parts(f"made {p}", w)
    found |= size_and_angle("static", static) | size_and_angle("couple", couple)
    found |= {"left static": abs(sum(made, static))}
    levers = [w * float(at - about) for w, at in zip(made, planes, strict=True)]
    found |= {"left couple": abs(sum(levers, couple))}
    if bearings is not None:
        for p in range(len(bearings)):
            found[f"before {p}"] = abs(vector(recorder, f"sum bearing {p}"))
    return {"mass": mass, "result": recorder.tape(found)}
