"""What friction holds joints at rest with, where statics determines it.

A joint that sticks bears any friction up to μ r |R|: which one, the formula of sliding does not tell. Of the forces at rest it
is an unknown, and every joint that sticks takes a motion away: C a = s + S φ = 0 are as many equations, of rank the motions that
the joints hold (`sliding.Values`). Where S has full rank they determine φ, and with it all joint forces.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from virtualwork.formulas.numbers import Reals
from virtualwork.intime.equations import Lost
from virtualwork.intime.friction import NEARLY, Rubbing
from virtualwork.intime.watch import Floats

# by how much more than its largest, relative, friction may be for what rounds where it breaks away
BEYOND = 1e-6


def rests(equations: Rubbing, v: Reals) -> NDArray[np.bool_]:
    """Whether friction holds a joint in states with these speeds (n, k) of a path, or all joints begin to move, (n,)."""
    if not any(equations.arms):
        return np.zeros(len(v), dtype=bool)
    return np.asarray((v == 0.0).all(axis=1) | (equations.k > 1 and not all(equations.mode)))


def holding(equations: Rubbing, t: Reals, q: Reals, v: Reals) -> Reals:
    """The friction of every joint, (c, n), in the states at which friction holds one; NaN in others, and where it is not determined."""
    result = np.full((len(equations.arms), len(t)), np.nan)
    for i in np.flatnonzero(rests(equations, v)):
        try:
            result[:, i] = _held(equations, float(t[i]), q[i].tolist(), v[i].tolist())
        except Lost:
            continue
    return result


def of_variants(holding: Mapping[int, Callable[[Reals], Reals]], times: Reals) -> Reals | None:
    """The friction of each contact (c, v, n) at the times (v, n) of variants, some of which rub; None where none does."""
    result = None
    for i, of in holding.items():
        there = np.isfinite(times[i])
        held = of(times[i, there])
        if result is None:
            result = np.full((len(held), *times.shape), np.nan)
        result[:, i, there] = held
    return result


def _held(equations: Rubbing, t: float, q: Floats, v: Floats) -> Floats:
    """The friction of every joint at one state.

    Raises
    ------
    Lost
        Where statics does not determine it.
    """
    values, stuck = equations.values(t, q, v), equations.stuck
    slips = np.array([[values.slips[n][m] for m in stuck] for n in stuck]).reshape(len(stuck), len(stuck))
    own = np.diag(slips)
    if not (own > 0).all():
        raise Lost
    # of rates of pins and guides alike
    unit = np.sqrt(own)
    if len(stuck) and np.linalg.svd(slips / unit / unit[:, None], compute_uv=False)[-1] <= NEARLY:
        raise Lost
    phi = equations.friction(values)
    if any(abs(phi[n]) > (1 + BEYOND) * equations.arms[n] * values.force(n, phi) for n in stuck):
        raise Lost
    return phi
