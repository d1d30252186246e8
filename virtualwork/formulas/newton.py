"""Newton-Raphson on loop closure, for the groups with no closed form and for all loops at once.

x_{k+1} = x_k − Φ⁻¹ f(x_k), on every pose of a block together; a step that would not reduce the gap is halved.

Groups that are singular in every pose have double roots (`settle`): two assemblies meet all along, as of a bar with its
pins in two parallel slots exactly its own length apart; the loops hold the place and not, to first order, its rate. J has
a null vector v at every pose, and Newton's method alone leaves half of the digits. nᵀJ·v = 0 with the left null vector n
belongs to the equations of the place, and with it the root is simple again (deflation: T. Ojika, S. Watanabe, T. Mitsui,
J. Math. Anal. Appl. 96 (1983) 463).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.records import record
from dalembert.dataclass import dataclass
from virtualwork.formulas.numbers import (
    EPS,
    SINGULAR,
    Number,
    Reals,
    singular_values,
    solve,
    stack,
    stack_rows,
)
from virtualwork.formulas.positions import State, columns, loop, turn
from virtualwork.plan.steps import Group

# of Gauss-Newton to a double root, from half of the digits
ROUNDS = 4


def write_unknowns(group: Group, st: State, x: Reals) -> None:
    """The same of an array (n, unknowns)."""
    put_unknowns(group, st, [x[:, j] if st.many else float(x[0, j]) for j in range(x.shape[1])])


def unknowns(group: Group, st: State) -> list[Number]:
    """A group's unknowns in a state: angles, and then slides."""
    # a closed form leaves the rotation alone
    angles = [st.angle[b] if b in st.angle else st.kind.angle(st.turn[b]) for b in group.angles]
    return angles + [st.slide[s] for s in group.slides]


def put_unknowns(group: Group, st: State, x: Sequence[Number]) -> None:
    """Put a group's unknowns, angles and then slides, into the state, with the bodies tied to them."""
    for body, angle in zip(group.angles, x, strict=False):
        st.angle[body] = angle
        st.turn[body] = st.kind.exp(angle)
    for g, slide in zip(group.slides, x[len(group.angles) :], strict=True):
        st.slide[g] = slide
    for tie in group.ties:
        turn(tie, st)


def gaps(group: Group, st: State) -> list[Number]:
    """How far each loop is from closing."""
    return [loop(closure, st) for closure in group.closures]


@record
@dataclass(frozen=True, eq=False, repr=False)
class Iterate:
    """One row of the Newton-Raphson table: the unknowns and the gap they leave."""

    k: int
    unknowns: Reals
    residual: float


def newton(
    group: Group,
    st: State,
    start: Reals,
    size: float,
    limit: int = 60,
    table: list[Iterate] | None = None,
    damped: bool = True,
) -> tuple[Reals, NDArray[np.bool_]]:
    """Close the loops of a group from a start, over all poses at once; the state holds what was found.

    Parameters
    ----------
    start : array (n, unknowns)
        Angles in rad, then slides in m.
    size : float
        The mechanism's size, m; a loop is closed when its gap is at rounding of it, or of a slide beyond it.
    table : list, optional
        Receives the iterates of the first pose, from the first guess on.

    Returns
    -------
    x : array (n, unknowns)
    closed : array (n,) of bool
    """
    n = len(start)
    x = np.array(start, dtype=float)
    write_unknowns(group, st, x)
    f = stack_rows(gaps(group, st), n)
    norm = np.sqrt((f * f).sum(axis=1))

    def reach() -> Reals:
        """What a loop's rounding is relative to: the mechanism's size, or a slide that runs beyond it."""
        return np.asarray(np.abs(x[:, len(group.angles) :]).max(axis=1, initial=size))

    far = reach()
    if table is not None:
        table.append(Iterate(1, x[0].copy(), float(norm[0])))
    done = ~np.isfinite(norm)
    slides = np.arange(x.shape[1]) >= len(group.angles)
    for k in range(2, limit + 2):
        if done.all():
            break
        jacobian = stack(columns(group, st), n)
        dx = solve(jacobian, -f)
        dx[done | ~np.isfinite(dx).all(axis=1)] = 0.0
        # a group may have no unknown of its own
        big = np.abs(dx / np.where(slides, far[:, None], 1.0)).max(axis=1, initial=0.0)
        # no angle turns by more than some 60° in a step
        if damped:
            dx *= np.minimum(1.0, 1.0 / np.maximum(big, 1e-300))[:, None]
        factor = np.ones(n)
        for _ in range(12 if damped else 1):
            trial = x + factor[:, None] * dx
            write_unknowns(group, st, trial)
            g = stack_rows(gaps(group, st), n)
            after = np.sqrt((g * g).sum(axis=1))
            worse = ~(after <= norm * (1 + 1e-12)) & ~done & (norm > 64 * EPS * far)
            if not worse.any() or not damped:
                break
            factor[worse] *= 0.5
        x, f, norm = trial, g, after
        far = reach()
        if table is not None:
            table.append(Iterate(k, x[0].copy(), float(norm[0])))
        # of dependent constraints rounding leaves a gap that no step makes less: it is closed, and stays as it is
        # and a pose that no part of the step brings nearer to closing will not close
        done = done | worse if damped else done
        small = (norm <= 64 * EPS * far) & (big <= 1e-7)
        done = done | small | ~np.isfinite(norm)
    closed = np.isfinite(norm) & (norm <= 1e-12 * far)
    return x, closed


def bent(group: Group, st: State, v: Reals) -> Reals:
    """The derivative of J·v along each unknown, (n, 2·loops, unknowns), for directions v (n, unknowns)."""
    rows = []
    for closure in group.closures:
        row = [np.zeros(len(v), complex) for _ in range(v.shape[1])]
        for t in closure.terms:
            turns = group.shares.get(t.body, {})
            slides = group.shares.get(t.slide, {}) if t.slide is not None else {}
            turned = sum((f * v[:, j] for j, f in turns.items()), 0.0)
            moved = sum((f * v[:, j] for j, f in slides.items()), 0.0)
            length = 1.0 if t.slide is None else st.slide[t.slide]
            e = t.z * st.turn[t.body]
            for j, f in turns.items():
                row[j] = row[j] + f * (1j * moved - turned * length) * e
            for j, f in slides.items():
                row[j] = row[j] + f * 1j * turned * e
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
    s = singular_values(columns(group, st), n)
    s = s[np.isfinite(s).all(axis=1)]
    return len(s) > 4 and bool((s[:, -1] < SINGULAR * s[:, 0]).all())
