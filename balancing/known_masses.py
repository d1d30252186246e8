"""Rotors with known masses, on tapes: what a page needs to compute their corrections anew.

Corrections are linear in the unbalances, and the correction in every plane for an unbalance of 1 is linear in its place: both numbers
come from `correct`; the tapes hold the vectors of the entries, their sums, sizes and angles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from balancing.correction import correct
from balancing.modal import modal_corrections
from balancing.tapes import Number, Outputs, parts, size_and_angle, vector
from dalembert.arithmetic.recorded import RECORDED, Recorder
from dalembert.arithmetic.tape import Tape

Real = NDArray[np.float64]


def shares(planes: Real) -> tuple[Real, Real, float]:
    """Return the share in every plane of an unbalance of 1 at z, first + slope·(z − about): (first, slope, about).

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


@dataclass(frozen=True, eq=False)
class Modal:
    """Conditions that the corrections meet in place of force and couple: modes whose shapes are cubics along the shaft.

    The tape takes the cubic of a mode k where a mass stands as `shape K 0` to `shape K 3`, in powers of z less `station`.
    """

    at_planes: Real
    """(q, p); see `modal_corrections`."""
    shaft: tuple[float, float] | None = None
    """Middle and length of the shaft, m, where force and couple are the first two conditions."""

    @property
    def first(self) -> int:
        """The number of the first mode among the conditions."""
        return 0 if self.shaft is None else 2

    def conditions(self, recorder: Recorder, z: Number) -> list[Number]:
        """Return the contribution of an unbalance of 1 at z to each condition."""
        s = z - recorder.input("station")
        rigid = [] if self.shaft is None else [1.0, (z - self.shaft[0]) * (1.0 / self.shaft[1])]
        for k in range(len(self.at_planes) - self.first):
            c = [recorder.input(f"shape {k} {power}") for power in range(4)]
            rigid.append(((c[3] * s + c[2]) * s + c[1]) * s + c[0])
        return rigid

    @property
    def solution(self) -> Real:
        """The correction in every plane for a condition of 1, (q, p)."""
        q = len(self.at_planes)
        return modal_corrections(np.ones((q, 1)), np.eye(q)[:, :, None], self.at_planes).unbalance.real

    def left(self, sums: list[Number], made: list[Number]) -> Outputs:
        """Return the residual of each mode after the corrections, and the size of its terms."""
        outputs: Outputs = {}
        for k, row in enumerate(self.at_planes[self.first :].tolist()):
            outputs[f"left mode {k}"] = abs(sum((w * f for w, f in zip(made, row, strict=True)), sums[k]))
            outputs[f"terms mode {k}"] = sum((abs(w) * abs(f) for w, f in zip(made, row, strict=True)), 0.0)
        return outputs


def known_masses(
    planes: Real,
    radius: Real,
    about: float,
    gravity: float | None,
    bearings: Real | None = None,
    remove: bool = False,
    fixed: Real | None = None,
    modal: Modal | None = None,
) -> dict[str, Tape]:
    """The tapes of a rotor with known masses.

    `mass` adds one entry (`amount`, kg, N or kg·m; `radius`; `angle`; `z`) to the sums and gives its share of every plane;
    `result` has the corrections, the rotor's state before and after, and the unbalances that the tolerance limits; `made` the state
    after the corrections as they are made (`mass P`, `radius P`, `angle P`), rounded for example.

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
    modal : Modal, optional
        The modes that the corrections leave without excitation.
    """
    recorder = Recorder()
    amount, arm, angle, z = (recorder.input(name) for name in ("amount", "radius", "angle", "z"))
    u = amount * arm * RECORDED.turn(angle)
    if gravity is not None:
        u = u / gravity
    outputs: Outputs = {}
    sums = {"static": u, "couple": u * (z - about)}
    places = {"plane": planes} | ({} if bearings is None else {"bearing": bearings})
    factors = {what: _factors(np.asarray(at, dtype=float), z) for what, at in places.items()}
    if modal is not None:
        conditions = modal.conditions(recorder, z)
        factors["plane"] = [
            sum((float(x) * phi for x, phi in zip(column, conditions, strict=True)), 0.0)
            for column in modal.solution.T
        ]
        sums |= {f"mode {k}": u * phi for k, phi in enumerate(conditions[modal.first :])}
    for what, each in factors.items():
        sums |= {f"{what} {p}": u * factor for p, factor in enumerate(each)}
    for p in range(len(planes)):
        outputs |= parts(f"share {p}", -sums[f"plane {p}"])
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
    if modal is not None:
        modes = _modes(recorder, modal)
        for k, total in enumerate(modes):
            results |= size_and_angle(f"mode {k}", total)
        results |= modal.left(modes, made)
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
    outputs |= _left(static, couple, put, planes - about)
    if modal is not None:
        outputs |= modal.left(_modes(recorder, modal), put)
    return {"mass": mass, "result": result, "made": recorder.tape(outputs)}


def _factors(planes: Real, z: Number) -> list[Number]:
    """Return the correction in every plane for an unbalance of 1 at z: force and couple vanish."""
    first, slope, about = shares(planes)
    return [float(a) + float(b) * (z - about) for a, b in zip(first, slope, strict=True)]


def _modes(recorder: Recorder, modal: Modal) -> list[Number]:
    """The sums of the modes."""
    return [vector(recorder, f"sum mode {k}") for k in range(len(modal.at_planes) - modal.first)]


def _left(static: Number, couple: Number, made: list[Number], arms: Real) -> Outputs:
    """Return the residual unbalance and couple after the corrections, and the sizes of their terms."""
    outputs: Outputs = {}
    levers = [w * float(arm) for w, arm in zip(made, arms, strict=True)]
    for name, terms, total in (("static", made, static), ("couple", levers, couple)):
        outputs[f"left {name}"] = abs(sum(terms, total))
        outputs[f"terms {name}"] = sum(map(abs, terms), 0.0)
    return outputs
