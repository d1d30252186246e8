"""The friction of joints and the forces it changes, over arrays: one is exchanged for the other until the two fit.

A contact that bears the force R = P + Qφ resists its slide with φ = −a·|R|, with a = μ r of a pin, μ of a guide, by the sense of
its rate (Norton, Design of Machinery, §11.9 names the model; the exchange starts without friction). The result is corrected by
Newton's method on the forces themselves, for in P + Qφ the two may cancel.

The exchange settles where the joints gain less than 1 on the way round; a mechanism that is stiff against its input gains more
though it moves. Then the coefficients grow from none, and Newton's method follows the friction (a homotopy: E. L. Allgower,
K. Georg, Introduction to Numerical Continuation Methods, SIAM, 2003, ch. 2). Where the determinant comes to zero on the
way, two solutions meet and end: beyond it no force balances its own friction, and the joints lock.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.recorded import RECORDED, Real, Recorder, bare
from dalembert.arithmetic.tape import Operation, Tape, performed, reached
from virtualwork.formulas.forces import Bearing, SlippingRate
from virtualwork.formulas.numbers import EPS, Complexes, Number, Reals, solve
from virtualwork.formulas.positions import BLOCK
from virtualwork.formulas.quantity import Quantity
from virtualwork.formulas.recording import Recording

# exchanges at most; each gains a factor of some μ r / l
LIMIT = 200
# relative change from which on Newton's method goes on
NEAR = 1e-8
# steps of it at most; what may be left of a friction, relative; where more than that is left the method does not converge
STEPS, CLOSE, FAR = 4, 8e-14, 1e-9
# shares of the coefficients by which they grow, first and at least; steps of Newton's method at each
FIRST, LEAST, NEWTONS = 0.25, 1e-4, 12


def written(recording: Recording, more: Sequence[Quantity] = ()) -> Tape:
    """The tape that the friction of all contacts is solved from, and more quantities.

    `rate 0` and `arm 0` of the first contact, and the force that it bears: `bears 0 x` without friction, `bears 0 x 1` with a unit
    of the second contact's alone. The forces are not there where statics is redundant: what enters depends on the friction.
    """
    recorder, contacts = recording.recorder, recording.forces.case.contacts
    each = range(len(contacts))
    outputs = recording.outputs(more)
    for n, (joint, _, _, coefficient, radius) in enumerate(contacts):
        outputs[f"rate {n}"] = recording.value(SlippingRate(n))
        outputs[f"arm {n}"] = bare(coefficient) * (bare(radius) if joint.guide is None else 1.0)
    if not recording.forces.redundant:
        forces: dict[str, Number] = {}
        for n in each:
            value = recording.value(Bearing(n))
            forces |= {f"bears {n} x": value.real, f"bears {n} y": value.imag}
        numbers = dict(recorder.numbers(forces))
        units = (None, *each)
        enter = [{f"friction {n}": float(n == unit) for n in each} for unit in units]
        for unit, values in zip(units, again(recorder, list(numbers.values()), enter), strict=True):
            last = "" if unit is None else f" {unit}"
            outputs |= {name + last: value for name, value in zip(numbers, values, strict=True)}
    return recorder.tape(outputs)


def again(
    recorder: Recorder, outputs: Sequence[int], inputs: Sequence[Mapping[str, Number]]
) -> list[list[Number]]:
    """The values of operations where some inputs, each time the same, have other values; nothing else is done again.

    >>> recorder = Recorder()
    >>> x, y = recorder.input("x"), recorder.input("y")
    >>> z = x * x + x * y
    >>> [[at_one], [at_zero]] = again(recorder, [z.number], [{"y": 1.0}, {"y": 0.0}])
    >>> recorder.tape({"z": z, "at y = 1": at_one, "at y = 0": at_zero}).cost
    4
    """
    known = [recorder.node("input", name) for name in inputs[0]]
    below: dict[int, Operation] = {}
    for number in reached(recorder.operations, outputs, known):
        operation = recorder.operations[number]
        if number in known or (
            operation[0] not in ("const", "input") and not below.keys().isdisjoint(operation[1:])
        ):
            below[number] = operation
    result = []
    for enters in inputs:
        values: dict[int, Number] = {}
        for number, (kind, *of) in below.items():
            if kind == "input":
                values[number] = enters[of[0]]
            else:
                arguments = [values[a] if a in values else Real(recorder, a) for a in of]
                values[number] = performed(kind, arguments, RECORDED)
        result.append([values[number] if number in values else Real(recorder, number) for number in outputs])
    return result


def read(
    rows: Mapping[str, Any], c: int, n: int, bears: Callable[[Reals], Complexes]
) -> tuple[Reals, Complexes, Complexes]:
    """What `settled` begins with, from a run of the tape: of c contacts in n lanes."""
    arms = np.empty((c, n))
    for k in range(c):
        arms[k] = rows[f"arm {k}"] * np.sign(rows[f"rate {k}"])

    def forces(unit: int | None) -> Complexes:
        if "bears 0 x" not in rows:
            friction = np.zeros((c, n))
            friction[() if unit is None else unit] = float(unit is not None)
            return bears(friction)
        last = "" if unit is None else f" {unit}"
        result: Complexes = np.empty((c, n), complex)
        for k in range(c):
            result[k].real, result[k].imag = rows[f"bears {k} x{last}"], rows[f"bears {k} y{last}"]
        return result

    with np.errstate(all="ignore"):
        free = forces(None)
        per: Complexes = np.empty((c, c, n), complex)
        for k in range(c):
            per[k] = forces(k) - free
    return arms, free, per


def settled(
    arms: Reals, free: Complexes, per: Complexes, bears: Callable[[Reals], Complexes]
) -> tuple[Reals, int]:
    """The friction of each contact (c, n), NaN where the joints lock; and how often it was exchanged for the forces.

    Parameters
    ----------
    arms : array (c, n)
        The largest friction over the force, with the sign of the rate; 0 where nothing slides.
    free : array (c, n)
        The forces P that the contacts bear without friction, complex.
    per : array (c, c, n)
        What a unit of each contact's friction adds to all.
    bears : function of friction (c, n) to the forces (c, n)
        Linear in each pose's own.

    Examples
    --------
    A force 3 + φ that its own friction unloads, and one 3 − φ that it loads so much that it locks:

    >>> p, q = np.full((1, 2), 3 + 0j), np.array([[[1 + 0j, -1]]])
    >>> friction, _ = settled(np.array([[0.5, 1.5]]), p, q, lambda phi: p + q[0] * phi)
    >>> friction.tolist()
    [[-1.0, nan]]
    """
    phi, n, count = np.zeros(arms.shape), arms.shape[1], 0
    with np.errstate(all="ignore"):
        for i in range(0, n, BLOCK):
            rows = slice(i, i + BLOCK)
            phi[:, rows], exchanges = _exchanged(arms[:, rows], free[:, rows], per[:, :, rows])
            count = max(count, exchanges)
        for k in range(STEPS + 1):
            force = bears(phi)
            rest = np.abs(phi + arms * np.abs(force)) / np.where(phi == 0, 1.0, np.abs(phi))
            if k == STEPS or not (rest > CLOSE).any():
                break
            phi = phi + _step(phi, force, per, arms)
        phi[:, (rest > FAR).any(axis=0)] = np.nan
    return phi, count


def _exchanged(arms: Reals, free: Complexes, per: Complexes) -> tuple[Reals, int]:
    """The friction (c, n) of the forces P + Qφ, NaN where the joints lock; and how often one was exchanged for the other."""
    phi, count = np.zeros(arms.shape), 0
    there = np.asarray(np.isfinite(free).all(axis=0) & np.isfinite(arms).all(axis=0))
    close: NDArray[np.bool_] = ~there
    while count < LIMIT and not close.all():
        count += 1
        after = -arms * np.abs(free + np.einsum("kn,kmn->mn", phi, per))
        changed = ~(np.abs(after - phi) <= NEAR * np.abs(after)).all(axis=0)
        close = np.asarray(~(changed & there))
        phi = after
    for i in np.flatnonzero(~close).tolist():
        followed = balanced(arms[:, i], free[:, i], per[:, :, i].T)
        phi[:, i] = np.nan if followed is None else followed
    phi[:, ~there] = np.nan
    return phi + _step(phi, free + np.einsum("kn,kmn->mn", phi, per), per, arms), count


def _step(phi: Reals, force: Complexes, per: Complexes, arms: Reals) -> Reals:
    """A step of Newton's method, (c, n), towards φ = −arms·|force|; zero where there is none."""
    size = np.abs(force)
    turned = np.divide(force.conj(), size, out=np.zeros_like(force), where=size > 0)
    slopes = np.eye(len(arms))[:, :, None] + arms[:, None] * (turned[:, None] * per.transpose(1, 0, 2)).real
    step = solve(np.moveaxis(slopes, 2, 0), -(phi + arms * size).T).T
    # what does not rub, or not slide, has no friction, whatever rounding leaves
    return np.where(np.isfinite(step) & (arms != 0), step, 0.0)


def balanced(arms: Reals, p: Complexes, q: Complexes) -> Reals | None:
    """The friction φ of joints, φ = −arms·|p + q·φ|; None where they lock.

    Parameters
    ----------
    arms : array (c,)
        The largest friction over the force of each joint, with the sign of its rate.
    p : array (c,)
        The forces without friction; of guides the normal one, a real number.
    q : array (c, c)
        What each friction adds to them.

    Examples
    --------
    A force 1 + 3φ that its own friction unloads, which putting it in again and again makes ever larger:

    >>> balanced(np.array([1.0]), np.array([1 + 0j]), np.array([[3 + 0j]])).tolist()
    [-0.25]

    One that it loads by as much locks:

    >>> balanced(np.array([-1.0]), np.array([1 + 0j]), np.array([[3 + 0j]])) is None
    True
    """
    phi, share, step = np.zeros(len(arms)), 0.0, FIRST
    while share < 1.0:
        ahead = min(1.0, share + step)
        followed = _followed(phi, ahead * arms, p, q)
        if followed is None:
            step = 0.5 * step
            if step < LEAST:
                return None
            continue
        phi, share, step = followed, ahead, 2.0 * step
    return phi


def _followed(phi: Reals, arms: Reals, p: Complexes, q: Complexes) -> Reals | None:
    """Newton's method from the friction at smaller coefficients; None where it does not stay on the way."""
    last = np.inf
    for _ in range(NEWTONS):
        force = p + q @ phi
        size = np.abs(force)
        if not np.isfinite(size).all() or not size.all():
            return None
        jacobian = np.eye(len(arms)) + (arms / size)[:, None] * (force.conj()[:, None] * q).real
        if not np.linalg.det(jacobian) > 0:
            return None
        step = np.linalg.solve(jacobian, phi + arms * size)
        phi = phi - step
        # relative to each joint's largest friction
        change = float(np.max(np.abs(step) / (np.abs(arms) * size + np.abs(phi) + np.finfo(float).tiny)))
        if change <= 8 * EPS or (change < 1e-9 and change >= 0.5 * last):
            return phi
        last = change
    return None
