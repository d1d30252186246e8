"""Groups that are singular in every pose: where their loops close, by deflation.

Two assemblies that meet all along, as a bar with its pins in two parallel slots exactly its own length apart: the loops
hold the place and not, to first order, its rate. J has a null vector v at every pose, and Newton's method alone leaves
half of the digits. The place is a double root; nᵀJ·v = 0 with the left null vector n belongs to its equations, and with
it the root is simple again (deflation: T. Ojika, S. Watanabe, T. Mitsui, J. Math. Anal. Appl. 96 (1983) 463).
"""

from __future__ import annotations

import numpy as np

from virtualwork.formulas.linear import SINGULAR, singular_values, stack, stack_rows
from virtualwork.formulas.newton import gaps, write_unknowns
from virtualwork.formulas.numbers import Reals
from virtualwork.formulas.positions import State, columns, ratio
from virtualwork.plan.steps import Group

# of Gauss-Newton to a double root, from half of the digits
ROUNDS = 4


def bent(group: Group, st: State, v: Reals) -> Reals:
    """The derivative of J·v along each unknown, (n, 2·loops, unknowns), for directions v (n, unknowns)."""
    angles = len(group.angles)
    rows = []
    for closure in group.closures:
        row = [np.zeros(len(v), complex) for _ in range(v.shape[1])]
        for t in closure.terms:
            r = [ratio(group, t.body, a) for a in group.angles]
            own = angles + group.slides.index(t.slide) if t.slide in group.slides else None
            turned = sum(f * v[:, j] for j, f in enumerate(r))
            moved = 0.0 if own is None else v[:, own]
            length = 1.0 if t.slide is None else st.slide[t.slide]
            e = t.z * st.turn[t.body]
            for j, f in enumerate(r):
                if f:
                    row[j] = row[j] + f * (1j * moved - turned * length) * e
            if own is not None:
                row[own] = row[own] + 1j * turned * e
        rows.append(row)
    return stack(rows, len(v))


def settle(group: Group, st: State, x: Reals, size: float) -> Reals:
    """The double root next to x, (n, unknowns), by Gauss-Newton on the loops and on nᵀJ·v = 0."""
    n, u = x.shape
    scale = np.array([1.0] * len(group.angles) + [size] * len(group.slides))
    out = x.copy()
    for _ in range(ROUNDS):
        write_unknowns(group, st, out)
        gap = stack_rows(gaps(group, st), n) / size
        jacobian = stack(columns(group, st), n) * scale / size
        good = np.isfinite(jacobian).all(axis=(1, 2)) & np.isfinite(gap).all(axis=1)
        left, s, right = np.linalg.svd(np.where(good[:, None, None], jacobian, 0.0))
        loose = int(np.median((s[good] < SINGULAR * s[good][:, :1]).sum(axis=1))) if good.any() else 0
        rows, rest = [jacobian], [gap]
        for b in range(u - loose, u):
            v = right[:, b]
            turning = bent(group, st, v * scale) * scale / size
            pull = jacobian @ v[..., None]
            for a in range(u - loose, u):
                rows.append(left[:, None, :, a] @ turning)
                rest.append((left[:, None, :, a] @ pull)[..., 0])
        system, right_side = np.concatenate(rows, axis=1), np.concatenate(rest, axis=1)
        step = np.zeros((n, u))
        step[good] = -(np.linalg.pinv(system[good]) @ right_side[good][..., None])[..., 0]
        out = out + step * scale
    write_unknowns(group, st, out)
    return out


def singular(group: Group, st: State, n: int) -> bool:
    """Whether J is singular at all of the state's poses that are assembled."""
    s = singular_values(columns(group, st), len(group.angles), n)
    s = s[np.isfinite(s).all(axis=1)]
    return len(s) > 4 and bool((s[:, -1] < SINGULAR * s[:, 0]).all())
