"""Newton-Raphson on loop closure, for the groups with no closed form and for all loops at once.

x_{k+1} = x_k − Φ⁻¹ f(x_k), on every pose of a block together; a step that would not reduce the gap is halved.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.records import record
from virtualwork.formulas.linear import solve, stack, stack_rows
from virtualwork.formulas.numbers import EPS, Number, Reals
from virtualwork.formulas.positions import State, columns, loop
from virtualwork.plan.steps import Group


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
        angle = st.affine(tie.angle)
        for base, r in tie.angle.bases:
            if base not in st.angle:
                break
            angle = angle + r * st.angle[base]
        else:
            st.angle[tie.body] = angle
        st.turn[tie.body] = st.rotate(tie.angle)


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
