"""Newton-Raphson on loop closure, for the groups with no closed form and for all loops at once (003).

x_{k+1} = x_k − Φ⁻¹ f(x_k), on every pose of a block together; a step that would not reduce the gap is halved.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from virtualwork.describe.errors import AssemblyError
from virtualwork.formulas.closed_forms import Number
from virtualwork.state import State, columns, loop

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from virtualwork.assembly import Assembly
    from virtualwork.assur import Group, Plan

    Reals = NDArray[np.float64]

EPS = float(np.finfo(float).eps)


def stack(cols: list[list[Number]], n: int) -> Reals:
    """The real Jacobian (n, 2·loops, unknowns) from complex columns."""
    loops, unknowns = len(cols), len(cols[0])
    out = np.empty((n, 2 * loops, unknowns))
    for i, row in enumerate(cols):
        for j, c in enumerate(row):
            out[:, 2 * i, j] = np.real(c)
            out[:, 2 * i + 1, j] = np.imag(c)
    return out


def stack_rows(rows: list[Number], n: int) -> Reals:
    """The real loop gaps (n, 2·loops) from complex ones."""
    out = np.empty((n, 2 * len(rows)))
    for i, w in enumerate(rows):
        out[:, 2 * i] = np.real(w)
        out[:, 2 * i + 1] = np.imag(w)
    return out


def solve(jacobian: Reals, right: Reals) -> Reals:
    """Solve Φ·x = right for each pose; with redundant loops by QR. A singular pose gives NaN, never a least norm."""
    rows, unknowns = jacobian.shape[-2:]
    if rows != unknowns:
        q, r = np.linalg.qr(jacobian)
        right = np.einsum("nij,ni->nj", q, right)
        jacobian = r
    good = np.isfinite(jacobian).all(axis=(1, 2)) & np.isfinite(right).all(axis=1)
    out = np.full((len(right), unknowns), np.nan)
    try:
        out[good] = np.linalg.solve(jacobian[good], right[good][..., None])[..., 0]
    except np.linalg.LinAlgError:
        for i in np.flatnonzero(good):
            try:
                out[i] = np.linalg.solve(jacobian[i], right[i])
            except np.linalg.LinAlgError:
                continue
    return out


def inverse_norm(jacobian: Reals) -> Reals:
    """‖J⁻¹‖∞ of each pose (of the pseudo-inverse, with redundant loops); inf where singular, NaN where unknown."""
    out = np.full(len(jacobian), np.nan)
    good = np.isfinite(jacobian).all(axis=(1, 2))
    some = jacobian[good]
    if some.shape[-2] != some.shape[-1]:
        inverse = np.linalg.pinv(some)
    else:
        try:
            inverse = np.linalg.inv(some)
        except np.linalg.LinAlgError:
            inverse = np.full_like(some, np.inf)
            for i, j in enumerate(some):
                try:
                    inverse[i] = np.linalg.inv(j)
                except np.linalg.LinAlgError:
                    continue
    out[good] = np.abs(inverse).sum(axis=2).max(axis=1, initial=0.0)
    return out


def singular_poses(cols: list[list[Number]], angles: int, n: int) -> NDArray[np.bool_]:
    """Which poses have a Jacobian whose smallest singular value is below 1e-6 of its largest."""
    jacobian = stack(cols, n)
    size = np.abs(jacobian[:, :, :angles]).max(initial=0.0)
    if angles and size > 0:
        jacobian[:, :, :angles] /= size
    good = np.isfinite(jacobian).all(axis=(1, 2))
    out = np.zeros(n, dtype=bool)
    s = np.linalg.svd(jacobian[good], compute_uv=False)
    out[good] = s[:, -1] < 1e-6 * s[:, 0]
    return out


def solve_columns(cols: list[list[Number]], right: list[Number]) -> list[Number]:
    """Solve Σ column·x + right = 0 for the unknowns' derivatives."""
    shape = np.broadcast_shapes(*(np.shape(c) for row in cols for c in row), *(np.shape(w) for w in right))
    n = int(np.prod(shape))
    x = solve(stack(cols, n), -stack_rows(right, n))
    return [x[:, j] if shape else float(x[0, j]) for j in range(x.shape[1])]


def write_unknowns(group: Group, st: State, x: Reals) -> None:
    """Put angles and slides into the state, with the bodies tied to them."""
    for j, body in enumerate(group.angles):
        st.angle[body] = x[:, j] if st.many else float(x[0, j])
        st.turn[body] = st.exp(st.angle[body])
    for j, g in enumerate(group.slides, len(group.angles)):
        st.slide[g] = x[:, j] if st.many else float(x[0, j])
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


@dataclass(frozen=True)
class Iterate:
    """One row of the Newton-Raphson table: the unknowns and the gap they leave."""

    k: int
    unknowns: Reals
    residual: float


def newton(
    group: Group,
    st: State,
    plan: Plan,
    start: Reals,
    size: float,
    limit: int = 60,
    table: list[Iterate] | None = None,
    damped: bool = True,
) -> tuple[Reals, NDArray[np.bool_]]:
    """Close the loops of a group from a start, over all poses at once.

    Parameters
    ----------
    start : array (n, unknowns)
        Angles in rad, then slides in m.
    size : float
        The mechanism's size, m; a loop is closed when its gap is at rounding of it.
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
    if table is not None:
        table.append(Iterate(1, x[0].copy(), float(norm[0])))
    done = ~np.isfinite(norm)
    scale = np.array([1.0] * len(group.angles) + [size] * len(group.slides))
    for k in range(2, limit + 2):
        if done.all():
            break
        jacobian = stack(columns(group, st, plan), n)
        dx = solve(jacobian, -f)
        dx[done | ~np.isfinite(dx).all(axis=1)] = 0.0
        big = np.abs(dx / scale).max(axis=1, initial=0.0)  # a group may have no unknown of its own
        if damped:  # no angle turns by more than some 60° in a step
            dx *= np.minimum(1.0, 1.0 / np.maximum(big, 1e-300))[:, None]
        factor = np.ones(n)
        for _ in range(12 if damped else 1):
            trial = x + factor[:, None] * dx
            write_unknowns(group, st, trial)
            g = stack_rows(gaps(group, st), n)
            after = np.sqrt((g * g).sum(axis=1))
            worse = ~(after <= norm * (1 + 1e-12)) & ~done & (norm > 64 * EPS * size)
            if not worse.any() or not damped:
                break
            factor[worse] *= 0.5
        x, f, norm = trial, g, after
        if table is not None:
            table.append(Iterate(k, x[0].copy(), float(norm[0])))
        # of dependent constraints rounding leaves a gap that no step makes less: it is closed, and stays as it is
        done = done | (worse & (norm <= 1e-12 * size))
        small = (norm <= 64 * EPS * size) & (big <= 1e-7)
        done = done | small | ~np.isfinite(norm)
    write_unknowns(group, st, x)
    closed = np.isfinite(norm) & (norm <= 1e-12 * size)
    return x, closed


@dataclass(frozen=True)
class AllAtOnce:
    """Newton-Raphson on all loops of a mechanism together, as 003 does it.

    Attributes
    ----------
    unknowns : tuple of str
        The links whose angle is unknown, then the points whose slide is.
    iterates : tuple of Iterate
        x1 is the guess; angles in rad as the iteration leaves them (not wrapped), slides in m.
    jacobian : array
        Φ at the guess: two rows (x, y) for each loop, one column for each unknown, m/rad or 1.
    closed : bool
        Did it converge?
    difference : float
        Largest difference of an angle to the assembly solved group by group, rad.
    """

    unknowns: tuple[str, ...]
    angles: int
    iterates: tuple[Iterate, ...]
    jacobian: Reals
    closed: bool
    difference: float


def all_at_once(assembly: Assembly, inputs: tuple[float, ...], limit: int = 50) -> AllAtOnce:
    """Solve all loops of a mechanism at once by Newton-Raphson from its guess, undamped, with the table of iterates.

    x_{k+1} = x_k − Φ(x_k)⁻¹·f(x_k) (003).

    Raises
    ------
    AssemblyError
        Where the guess does not give every unknown angle.
    """
    from virtualwork.assembly import guessed_unknowns, known_by_guess
    from virtualwork.assur import Turn

    m = assembly.mechanism
    merged, group = assembly.merged
    if group is None:
        raise AssemblyError("newton: the mechanism has no loop to close")
    st = State([np.array([q]) for q in inputs], many=True)
    for step in merged.steps:
        if step is group:
            break
        if isinstance(step, Turn):
            assembly.turn(step, st)
        else:
            assembly.run([step], st)
    angles, points = known_by_guess(m)
    for body in group.angles:
        if body not in angles:
            raise AssemblyError(
                f"[guess]: newton starts from the guess, and the angle of '{body}' is missing there"
            )
    start = guessed_unknowns(group, st, angles, points, m, merged)
    assert start is not None
    write_unknowns(group, st, start)
    jacobian = stack(columns(group, st, merged), 1)[0]
    table: list[Iterate] = []
    with np.errstate(all="ignore"):
        x, closed = newton(group, st, merged, start, m.size, limit, table, damped=False)
        exact = assembly.state(inputs)
        # numpy's maximum keeps a NaN: where one link is not assembled there is nothing to compare with
        away = [
            np.abs(np.angle(np.exp(1j * x[0, j]) / np.ravel(exact.turn[body])[0]))
            for j, body in enumerate(group.angles)
        ]
        difference = float(np.max(away, initial=0.0))
    names = (*group.angles, *(m.guides[g].point for g in group.slides))
    return AllAtOnce(names, len(group.angles), tuple(table), jacobian, bool(closed[0]), difference)
