"""The friction of joints and the forces it changes, over arrays: one is exchanged for the other until the two fit.

A contact that bears the force R = P + Qφ resists its slide with φ = −a·|R|, with a = μ r of a pin, μ of a guide, by the sense of
its rate (Norton, Design of Machinery, §11.9 names the model; the exchange starts without friction). Where it does not settle so,
the friction is followed from none on (`locking`). What was found is put right by Newton's method on the forces themselves, for in
P + Qφ the two may cancel.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from virtualwork.formulas.locking import balanced
from virtualwork.formulas.numbers import Complexes, Reals, solve
from virtualwork.formulas.positions import BLOCK

# exchanges at most; each gains a factor of some μ r / l
LIMIT = 200
# relative change from which on Newton's method goes on
NEAR = 1e-8
# steps of it at most; what may be left of a friction, relative; where more than that is left the method does not converge
STEPS, CLOSE, FAR = 4, 8e-14, 1e-9


def settled(bears: Callable[[Reals], Complexes], arms: Reals) -> tuple[Reals, int]:
    """The friction of each contact (c, n), NaN where the joints lock; and how often it was exchanged for the forces.

    Parameters
    ----------
    bears : function of friction (c, n) to the forces (c, n) that the contacts bear, complex
        Linear in each pose's own.
    arms : array (c, n)
        The largest friction over the force, with the sign of the rate; 0 where nothing slides.

    Examples
    --------
    A force 3 + φ that its own friction unloads, and one that locks:

    >>> friction, _ = settled(lambda phi: np.array([[3.0, 3.0]]) + np.array([[1.0, -1.0]]) * phi, np.array([[0.5, 1.5]]))
    >>> friction.tolist()
    [[-1.0, nan]]
    """
    c, n = arms.shape
    if not c:
        return np.zeros((c, n)), 0
    with np.errstate(all="ignore"):
        phi = np.zeros((c, n))
        free = bears(phi)
        per: Complexes = np.empty((c, c, n), complex)
        for k in range(c):
            unit = np.zeros((c, n))
            unit[k] = 1.0
            per[k] = bears(unit) - free
        count = 0
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
        found = balanced(arms[:, i], free[:, i], per[:, :, i].T)
        phi[:, i] = np.nan if found is None else found
    phi[:, ~there] = np.nan
    return phi + _step(phi, free + np.einsum("kn,kmn->mn", phi, per), per, arms), count


def _step(phi: Reals, force: Complexes, per: Complexes, arms: Reals) -> Reals:
    """A step of Newton's method, (c, n), towards φ = −arms·|force|; zero where there is none."""
    size = np.abs(force)
    turned = np.divide(force.conj(), size, out=np.zeros_like(force), where=size > 0)
    slopes = np.eye(len(arms))[:, :, None] + arms[:, None] * (turned[:, None] * per.transpose(1, 0, 2)).real
    step = solve(np.moveaxis(slopes, 2, 0), -(phi + arms * size).T).T
    return np.where(np.isfinite(step), step, 0.0)
