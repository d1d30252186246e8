"""Friction takes energy and gives none: every path is asked for it, and is cut before a joint whose friction drives it."""

from __future__ import annotations

import numpy as np

from virtualwork.intime.friction import TOGETHER, Rubbing
from virtualwork.intime.marching import Nodes

# of a joint's rates at the ends of a step: how exactly that in its middle is known
ROUGHLY = 0.1


def gains(equations: Rubbing, nodes: Nodes, fastest: float) -> tuple[float, tuple[int, str] | None]:
    """The first node by which a joint slides against its mode, so that friction drives it, and the joint; None where none does.

    A joint at rest may have a rate of what rounding makes of the largest so far: `fastest`, which comes back with
    that of these nodes.
    """
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
    wrong = sense * at < -TOGETHER * fastest
    wrong[:, 1:] |= sense * between < -TOGETHER * fastest - rough
    if not wrong.any():
        return fastest, None
    node = int(np.argmax(wrong.any(axis=0)))
    return fastest, (node, equations.names[int(np.argmax(wrong[:, node]))])
