"""Where joints with friction come to rest, and what friction holds them with there, where statics determines it.

Friction takes energy and gives none: every path is checked, and is cut before a joint whose friction drives it (`gains`).

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
from virtualwork.intime.friction import NEARLY, TOGETHER, Rubbing
from virtualwork.intime.marching import Nodes
from virtualwork.intime.path import Path
from virtualwork.intime.watch import Floats

# by how much more than its largest, relative, friction may be for what rounds where it breaks away
BEYOND = 1e-6
# of a joint's rates at the ends of a step: how exactly that in its middle is known
ROUGHLY = 0.1


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


def gains(path: Path, fastest: float) -> tuple[float, tuple[int, str] | None]:
    """The first node by which a joint slides against its mode, so that friction drives it, and the joint; None where none does.

    A joint at rest may have a rate of what rounding makes of the largest so far: `fastest`, which comes back with
    that of these nodes; or of what rounding of the accelerations makes of it within a step.
    """
    equations, nodes = path.equations, path.nodes
    assert isinstance(equations, Rubbing)
    if equations.locked or len(nodes.t) < 2:
        return fastest, None
    t, q, v, a = nodes.t, nodes.q, nodes.v, nodes.rates[:, : equations.k]
    h = np.diff(t)[:, None]
    middle = (
        0.5 * (t[1:] + t[:-1]),
        0.5 * (q[1:] + q[:-1]) - 0.125 * h * np.diff(v, axis=0),
        0.5 * (v[1:] + v[:-1]) - 0.125 * h * np.diff(a, axis=0),
    )
    at, between = equations.slid_at(t, q, v), equations.slid_at(*middle)
    fastest = max(fastest, float(np.abs(at).max()))
    # in the middle of a step the rates are those of Hermite's polynomial, roughly
    rough = ROUGHLY * np.maximum(np.abs(at[:, 1:]), np.abs(at[:, :-1]))
    sense = np.array(equations.mode)[:, None]

    def wrong(still: Reals) -> NDArray[np.bool_]:
        """Which joints slide against their mode at each node, or in the step before it, by more than so much."""
        rows = sense * at < -still
        rows[:, 1:] |= sense * between < -still[:, 1:] - rough
        return np.asarray(rows)

    rows = wrong(np.full_like(at, TOGETHER * fastest))
    if rows.any():
        rows = wrong(TOGETHER * fastest + _rounded(equations, nodes, path.noise_of_speeds(nodes.t)))
    if not rows.any():
        return fastest, None
    node = int(np.argmax(rows.any(axis=0)))
    return fastest, (node, equations.names[int(np.argmax(rows[:, node]))])


def _rounded(equations: Rubbing, nodes: Nodes, speeds: Reals) -> Reals:
    """What rounding makes of each joint's rate within the step before each node, (joints, n), from that of the speeds."""
    units = np.eye(equations.k)
    rates = [equations.slid_at(nodes.t, nodes.q, np.tile(unit, (len(nodes.t), 1))) for unit in units]
    each = np.concatenate([np.zeros((1, equations.k)), speeds])
    return np.asarray(sum(np.abs(rate) * each[:, j] for j, rate in enumerate(rates)))
