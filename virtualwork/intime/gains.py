"""Friction takes energy and gives none: every path is checked, and is cut before a joint whose friction drives it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from virtualwork.formulas.numbers import Reals
from virtualwork.intime.friction import TOGETHER, Rubbing
from virtualwork.intime.marching import Nodes
from virtualwork.intime.path import Path

# of a joint's rates at the ends of a step: how exactly that in its middle is known
ROUGHLY = 0.1


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
        rows = wrong(TOGETHER * fastest + _rounded(equations, nodes, path.noise_of_speeds))
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
