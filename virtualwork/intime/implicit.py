"""Radau's implicit method of order 9, for q̈ = a(t, q, q̇) with stiff springs and dampers.

The accelerations are a polynomial of degree 4 over a step, equal to a(t, q, q̇) at five nodes, the last of which is the
step's end (E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 2nd ed., Springer 1996, §IV.5): q̇ and q are
its integrals, with the matrices A and A². The method is stable however stiff a damper is. The nodes' accelerations
are found by Newton's method with one Jacobian for a step.

How large the error is, the polynomial's own Legendre coefficients tell: they fall off evenly where the step resolves
the motion, and the end of a step is as much better than its inside as the fourth is smaller than the first.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np

from virtualwork.formulas.numbers import EPS, Reals
from virtualwork.intime.equations import Equations, Lost
from virtualwork.intime.watch import Floats, Step

STAGES = 5
# iterations of Newton's method; a change of the speeds, relative, at which it has converged
LIMIT, CLOSE = 40, 4 * EPS
# of the length of a spring, or of a speed, in the accelerations
ROUNDINGS = 8.0
# how far from a state accelerations are looked at for their slopes: a share of what errors of the inputs are relative to,
# and of the inputs themselves; of the speeds within a step; how many times what rounding of the inputs comes to
BESIDE, FAR, FAST, ABOVE = 2.0**-26, 2.0**-40, 2.0**-23, 2.0**16
Many = Callable[[Reals, Reals, Reals], Reals]


class Nodes(NamedTuple):
    """The nodes c, the integrals A of their Lagrange polynomials, and the Legendre coefficients of values at them."""

    c: Reals
    a: Reals
    legendre: Reals


@cache
def nodes() -> Nodes:
    """Of Radau's method of the right, worked out from Legendre's polynomials on [0, 1].

    Examples
    --------
    >>> c, a, _ = nodes()
    >>> bool(abs(c[-1] - 1) < 1e-15), bool(np.abs(a[-1] @ c**8 - 1 / 9) < 1e-15)
    (True, True)
    """
    legendre = np.polynomial.legendre
    # the roots of P_s − P_{s−1}, all real (numpy 2.5 has them as complex numbers): the right end is one of them
    c = 0.5 * (1 + np.sort(legendre.legroots([0.0] * (STAGES - 1) + [-1.0, 1.0]).real))
    c[-1] = 1.0
    x, w = legendre.leggauss(STAGES)
    x, w = 0.5 * (1 + x), 0.5 * w

    def lagrange(j: int, at: Reals) -> Reals:
        others = [i for i in range(STAGES) if i != j]
        return np.asarray(np.prod([(at - c[i]) / (c[j] - c[i]) for i in others], axis=0))

    a = np.array([[end * (w @ lagrange(j, end * x)) for j in range(STAGES)] for end in c])
    return Nodes(c, a, np.asarray(np.linalg.inv(legendre.legvander(2 * c - 1, STAGES - 1)), dtype=float))


class Radau:
    """The method: its steps, and how large the error of one is."""

    name = "implicit Runge-Kutta method of order 9 (Radau), for stiff springs and dampers"
    order = 9
    stable = np.inf

    @property
    def stages(self) -> tuple[Reals, Reals]:
        """Where the stages stand in a step, and their weights."""
        return nodes().c, nodes().a[-1]

    def step(self, f: Equations, t: float, q: Floats, v: Floats, rates: Floats, h: float) -> Step:
        """One step of length h from a state whose rates are known."""

        def one_by_one(t: Reals, q: Reals, v: Reals) -> Reals:
            return np.array([f(*state) for state in zip(t.tolist(), q.tolist(), v.tolist(), strict=True)])

        state = np.array([t]), np.array([q]), np.array([v]), np.array([rates]), np.array([h])
        values, k = _stages(one_by_one, np.array(f.scale), *state)[0], len(q)
        if not np.isfinite(values).all():
            raise Lost
        _, a, legendre = nodes()
        dv = h * (a[-1] @ values[:, :k])
        dq = h * np.array(v) + h * h * ((a @ a)[-1] @ values[:, :k])
        size = np.abs(legendre @ values[:, :k])
        largest = np.maximum(size.max(axis=0), 1e-300)
        error = h * size[-1] * (size[-1] / largest)
        errors = [*(h * error).tolist(), *error.tolist()]
        work = h * float(a[-1] @ values[:, k])
        return Step(dq.tolist(), dv.tolist(), work, values[-1].tolist(), (errors,), 0.0)

    def size(self, done: Step, scale: Floats) -> float:
        """A step's error over the one allowed in each of (q, q̇)."""
        (errors,) = done.errors
        return max(abs(e) / s for e, s in zip(errors, scale, strict=True))

    def steps(
        self, f: Equations, t: Reals, q: Reals, v: Reals, rates: Reals, h: Reals
    ) -> tuple[Reals, Reals, Reals]:
        """Changes of q and q̇ (n, k) and the work (n,) over a step from each of n states, each of its own length."""
        result = _stages(f.many, np.array(f.scale), t, q, v, rates, h)
        k = q.shape[1]
        _, a, _ = nodes()
        length = h[:, None]
        dv = length * np.einsum("s,nsk->nk", a[-1], result[..., :k])
        dq = length * v + length**2 * np.einsum("s,nsk->nk", (a @ a)[-1], result[..., :k])
        return dq, dv, h * (result[..., k] @ a[-1])


def _stages(f: Many, scale: Reals, t: Reals, q: Reals, v: Reals, rates: Reals, h: Reals) -> Reals:
    """The rates at the nodes of steps from n states, (n, s, k + 1); NaN where Newton's method does not converge.

    `scale`: what errors of the inputs are relative to, (k,). The acceleration of a spring near its free length has no digit
    beyond what rounding of its length leaves: there a change that this rounding brings about has converged.
    """
    c, a, _ = nodes()
    n, k = q.shape
    twice, step = a @ a, h[:, None, None]
    by_q, by_v = _slopes(f, scale, t, q, v, rates, h)
    whole = (
        np.eye(STAGES * k)
        - step * np.einsum("ij,nab->niajb", a, by_v).reshape(n, STAGES * k, STAGES * k)
        - step**2 * np.einsum("ij,nab->niajb", twice, by_q).reshape(n, STAGES * k, STAGES * k)
    )
    result = np.full((n, STAGES, k + 1), np.nan)
    left = np.isfinite(whole).all(axis=(1, 2))
    inverse = np.linalg.inv(np.where(left[:, None, None], whole, np.eye(STAGES * k)))
    spread = np.abs(inverse)
    values = np.repeat(rates[:, None, :k], STAGES, axis=1)
    times = (t[:, None] + h[:, None] * c).ravel()
    before, last = np.full((2, n), np.inf)
    for _ in range(LIMIT):
        speeds = v[:, None] + step * np.einsum("ij,njk->nik", a, values)
        places = (
            q[:, None] + step * c[:, None] * v[:, None] + step**2 * np.einsum("ij,njk->nik", twice, values)
        )
        there = f(times, places.reshape(-1, k), speeds.reshape(-1, k)).reshape(n, STAGES, k + 1)
        rest = (there[..., :k] - values).reshape(n, -1, 1)
        change = (inverse @ rest).reshape(n, STAGES, k)
        values = values + change
        fastest = np.abs(speeds).max(axis=1)
        size = fastest + np.abs(step[:, 0] * values.max(axis=1)) + 1e-300
        farthest = np.maximum(np.abs(places).max(axis=1), scale)
        rounded = np.einsum("nab,nb->na", np.abs(by_q), farthest) + np.einsum(
            "nab,nb->na", np.abs(by_v), fastest
        )
        noise = spread @ np.tile(ROUNDINGS * EPS * rounded, STAGES)[..., None]
        rounds = (np.abs(change) <= noise.reshape(n, STAGES, k)).all(axis=(1, 2))
        moved = np.abs(step * change).max(axis=1)
        much = (moved / size).max(axis=1)
        # what it is a share of may shrink faster than it does
        largest = (moved / scale).max(axis=1)
        done = left & (rounds | (much <= CLOSE) | ((largest >= last) & (much < 1e-10)))
        result[done] = np.concatenate([values, there[..., k:]], axis=2)[done]
        left = left & ~done & (much < np.inf) & ~((largest > 2 * last) & (before < 1.0))
        if not left.any():
            break
        before, last = much, largest
        # a step that is done, or lost, goes no further
        values = np.where(left[:, None, None], values, rates[:, None, :k])
    return result


def _slopes(
    f: Many, scale: Reals, t: Reals, q: Reals, v: Reals, rates: Reals, h: Reals
) -> tuple[Reals, Reals]:
    """∂a/∂q and ∂a/∂q̇, (n, k, k), by differences: Newton's method for steps h needs them roughly.

    What rounds in an input rounds in the slopes of its speed too: the speed moves by more than this, as far as a step feels it.
    """
    k = q.shape[1]

    def slopes(x: Reals, sizes: Reals, at: Callable[[Reals], Reals]) -> Reals:
        columns = []
        for j in range(k):
            moved = x.copy()
            moved[:, j] += sizes[:, j]
            columns.append((at(moved) - rates)[:, :k] / (moved[:, j] - x[:, j])[:, None])
        return np.stack(columns, axis=2)

    by_q = slopes(q, BESIDE * scale + FAR * np.abs(q), lambda x: f(t, x, v))
    length = np.abs(h)
    steep = (np.abs(by_q) @ scale / scale).max(axis=1)
    rounded = ABOVE * EPS * length * steep / (1 + length**2 * steep)
    fastest = ((np.abs(v) + length[:, None] * np.abs(rates[:, :k])) / scale).max(axis=1)
    by_v = slopes(v, np.outer(FAST * fastest + rounded + 1e-300, scale), lambda x: f(t, q, x))
    return by_q, by_v
