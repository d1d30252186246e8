"""The next run: which masses, at which angles, reduce the uncertainty most."""

from __future__ import annotations

from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from balancing.dependence import adjoint, design
from balancing.log_balance import LogBalance
from balancing.reading_errors import response
from dalembert.arithmetic.records import record

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


@record
class NextRun(NamedTuple):
    """Masses for the next run, and the uncertainty of the corrections before and after it."""

    masses: Complex
    """(p,), kg."""
    before: float
    """Standard deviation of a component of a correction, r.m.s. over components and planes, kg."""
    after: float


def suggest_run(balance: LogBalance, max_mass: ArrayLike) -> NextRun:
    """Find the masses within limits whose run reduces the uncertainty of one machine's corrections most.

    Parameters
    ----------
    balance
        The balance after the runs so far.
    max_mass
        The largest mass in each plane, scalar or (p,), kg.

    Returns
    -------
    NextRun
        `.masses` (p,) complex, kg, and the root mean square uncertainty of the corrections before and after, kg.

    Raises
    ------
    ValueError
        A limit that is not positive and finite.

    Notes
    -----
    A-optimal: the trace of the corrections' covariance becomes least (Atkinson, Donev and Tobias, Optimum Experimental
    Designs, 2007, section 10.1), every channel read once more with the mean scatter of its readings. With Γ the covariance
    of a channel's θ and d = (1, w) it becomes Γ - Γdᴴ dΓ/(v + dΓdᴴ). The best point of a grid is followed by a search in
    ever shorter steps of sizes and angles.

    Examples
    --------
    Two runs lie at 0 and 1 kg; a correction of -2.5 kg is best confirmed by a run near it.

    >>> from balancing import joint_fit, least_squares
    >>> fit = joint_fit([[5], [7.1], [4.9]], [[0], [1], [0]])
    >>> found = LogBalance(fit, least_squares(fit.influence, fit.initial).corrections, fit.scatter())
    >>> bool(abs(suggest_run(found, 3.0).masses[0] + 3.0) < 1e-6)
    True
    """
    planes = balance.corrections.shape[-1]
    limit = np.broadcast_to(np.asarray(max_mass, dtype=float), (planes,))
    if not ((limit > 0) & (limit < np.inf)).all():
        raise ValueError("max_mass must be positive and finite")
    spread = _Spread(balance)
    best = _grid(planes) * limit
    w = best[int(np.argmin(spread.after(best)))]
    least = float(spread.after(w[None])[0])
    step = 0.5
    while step > 1e-9:
        around = np.concatenate([_around(w, limit, p, step) for p in range(planes)])
        variances = spread.after(around)
        k = int(np.argmin(variances))
        if variances[k] < least * (1 - 1e-15):
            w, least = around[k], float(variances[k])
        else:
            step /= 2
    return NextRun(w, spread.deviation(spread.before), spread.deviation(least))


def _grid(planes: int) -> Complex:
    """Return masses to begin with, as shares of their limits, (k, p)."""
    angles = np.exp(2j * np.pi * np.arange(12) / 12)
    one = np.concatenate([[0.0], 0.5 * angles, angles])
    if planes <= 2:
        return np.array(list(product(one, repeat=planes)))
    rng = np.random.default_rng(0)
    return np.asarray(rng.choice(one, (4000, planes)))


def _around(w: Complex, limit: Real, plane: int, step: float) -> Complex:
    """Return masses with that of one plane turned, or made larger or smaller, by a step, (6, p)."""
    mine, most = w[plane], limit[plane]
    size, unit = abs(mine), mine / abs(mine) if mine else 1.0
    sizes = (min(size + step * most, most), max(size - step * most, 0.0))
    turns = (np.exp(1j * np.pi * step), np.exp(-1j * np.pi * step))
    tried = [unit * s for s in sizes] + [mine * t for t in turns] + [1j * step * most, -1j * step * most]
    out = np.repeat(w[None], len(tried), axis=0)
    out[:, plane] = [t if abs(t) <= most else t * (most / abs(t)) for t in tried]
    return out


class _Spread:
    """The trace of the corrections' covariance, now and after one more run."""

    def __init__(self, balance: LogBalance) -> None:
        fit, errors = balance.fit, balance.errors
        weights = np.ones(fit.initial.shape) if balance.weights is None else balance.weights
        left = fit.fitted(balance.corrections[None])[0]
        linear, antilinear = response(fit.influence, balance.corrections, left, weights)
        self.linear, self.antilinear = np.moveaxis(linear, 1, 0), np.moveaxis(antilinear, 1, 0)  # (s, p, n)
        along, across = np.square(errors.along.T), np.square(errors.across.T)
        gain, unit = fit.gain, errors.unit.T  # (s, n, r), (s, r)
        self.covariance = (gain * (along + across)[:, None]) @ adjoint(gain)
        self.relation = (gain * (np.square(unit) * (along - across))[:, None]) @ np.swapaxes(gain, 1, 2)
        if fit.foreknown is not None:
            sources = fit.foreknown.sources
            self.covariance = self.covariance + sources @ adjoint(sources)
        read = fit.present.T
        self.own = np.where(read, along + across, 0.0).sum(axis=1) / read.sum(axis=1)
        self.before = float(self._trace(self.covariance, self.relation))

    def _trace(self, covariance: Complex, relation: Complex) -> Real:
        """E|dw|² over all planes, of (..., s, n, n) E δδᴴ and E δδᵀ."""
        pairs = (
            (self.linear, covariance, self.linear, 1.0),
            (self.antilinear, covariance.conj(), self.antilinear, 1.0),
            (self.linear, relation, self.antilinear, 2.0),
        )
        terms = [k * np.einsum("spn,...snm,spm->...", a, c, b.conj()).real for a, c, b, k in pairs]
        return np.asarray(sum(terms))

    def after(self, masses: Complex) -> Real:
        """Return the trace after a run with each of these masses, (k, p) -> (k,)."""
        rows = design(masses)
        cross = np.einsum("snm,km->ksn", self.covariance, rows.conj())
        of_reading = np.einsum("kn,ksn->ks", rows, cross).real + self.own
        gain = cross / np.where(of_reading > 0, of_reading, 1.0)[..., None]
        covariance = self.covariance - gain[..., :, None] * cross.conj()[..., None, :]
        keep = np.eye(rows.shape[1]) - gain[..., :, None] * rows[:, None, None, :]
        relation = keep @ self.relation @ np.swapaxes(keep, -1, -2)
        return self._trace(covariance, relation)

    def deviation(self, trace: float) -> float:
        """Return the r.m.s. standard deviation of a component."""
        return float(np.sqrt(max(trace, 0.0) / (2 * self.linear.shape[1])))
