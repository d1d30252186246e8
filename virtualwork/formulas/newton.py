"""Newton-Raphson on loop closure, for the groups with no closed form and for all loops at once; zeros in brackets.

x_{k+1} = x_k − Φ⁻¹ f(x_k), on every pose of a block together; a step that would not reduce the gap is halved. Gaps f, their
Jacobian Φ and each step come from tapes (`group_loops`).

Groups that are singular in every pose have double roots (`settle`): two assemblies meet all along, as of a bar with its
pins in two parallel slots exactly its own length apart; the loops hold the place and not, to first order, its rate. J has
a null vector v at every pose, and Newton's method alone leaves half of the digits. nᵀJ·v = 0 with the left null vector n
belongs to the equations of the place, and with it the root is simple again (deflation: T. Ojika, S. Watanabe, T. Mitsui,
J. Math. Anal. Appl. 96 (1983) 463).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.exact import EPS
from virtualwork.formulas.group_loops import Loops
from virtualwork.formulas.numbers import SINGULAR, Number, Reals, singular_values
from virtualwork.formulas.positions import State

# of Gauss-Newton to a double root, from half of the digits
ROUNDS = 4
# of a bracket, at most
HALVINGS = 80
# of the mechanism's size, or of a slide that runs beyond it: a loop with a smaller gap is closed
CLOSED = 1e-12
# rad: eight roundings of an angle this large are as much
MANY = CLOSED / (8 * EPS)


def newton(
    loops: Loops, st: State, start: Reals, size: Number, limit: int = 60
) -> tuple[Reals, NDArray[np.bool_]]:
    """Close the loops of a group from a start, over all poses at once.

    Parameters
    ----------
    loops : Loops
    st : State
        What the group depends on.
    start : array (n, unknowns)
        Angles in rad, then slides in m.
    size : float, or array (n,)
        The mechanism's size, m; a loop is closed when its gap is at rounding of it, or of a slide beyond it.
    limit : int
        The most steps.

    Returns
    -------
    x : array (n, unknowns)
    closed : array (n,) of bool
    """
    x, gap = loops.search(st, start, size, limit)
    far = np.maximum(np.abs(x[:, len(loops.group.angles) :]).max(axis=1, initial=0.0), size)
    for tie in loops.group.ties:
        # a body that gears turn by many turns: its angle rounds by more than its loops
        turned = sum(abs(f) * np.abs(x[:, j]) for j, f in loops.group.shares.get(tie.body, {}).items())
        far = np.maximum(far, turned * (size / MANY))
    return x, np.asarray((gap <= CLOSED * far) & loops.stands(st))


def bracketed(
    at: Callable[[Reals], tuple[Reals, Reals | None]], low: Reals, high: Reals, below: Reals | float, x: Reals
) -> Reals:
    """Zeros of one number in brackets, all at once, from x on: Newton's step where it stays inside, else the middle.

    `at` gives values and slopes, or no slopes; `below` is the sign at the lower end.

    >>> ends = np.array([0.0, 3.0]), np.array([3.0, 5.0])
    >>> bracketed(lambda x: (np.cos(x), -np.sin(x)), *ends, np.array([1.0, -1.0]), sum(ends) / 2) / np.pi
    array([0.5, 1.5])
    """
    a, b, width = low, high, high - low
    with np.errstate(divide="ignore", invalid="ignore"):
        for _ in range(HALVINGS):
            value, slope = at(x)
            left = np.sign(value) == below
            a, b = np.where(left, x, a), np.where(left, b, x)
            step = (a + b) / 2
            if slope is not None:
                newton = x - value / slope
                step = np.where((newton > a) & (newton < b), newton, step)
                step = np.where(value == 0, x, step)
            near = (np.abs(step - x) <= 2 * EPS * np.maximum(np.abs(x), width)).all()
            x = step
            if near:
                break
    return np.asarray(x)


def settle(loops: Loops, st: State, x: Reals, size: float) -> Reals:
    """The double root next to x, (n, unknowns), by Gauss-Newton on the loops and on nᵀJ·v = 0."""
    n, u = x.shape
    scale = np.array([1.0] * len(loops.group.angles) + [size] * len(loops.group.slides))
    out, at = x.copy(), loops.over(st)
    for _ in range(ROUNDS):
        gap, jacobian = at(out)
        gap, jacobian = gap / size, jacobian * scale / size
        good = np.isfinite(jacobian).all(axis=(1, 2)) & np.isfinite(gap).all(axis=1)
        left, s, right = np.linalg.svd(np.where(good[:, None, None], jacobian, 0.0))
        loose = int(np.median((s[good] < SINGULAR * s[good][:, :1]).sum(axis=1))) if good.any() else 0
        rows, rest = [jacobian], [gap]
        for b in range(u - loose, u):
            v = right[:, b]
            turning = loops.bent(st, out, v * scale) * scale / size
            pull = jacobian @ v[..., None]
            for a in range(u - loose, u):
                rows.append(left[:, None, :, a] @ turning)
                rest.append((left[:, None, :, a] @ pull)[..., 0])
        system, right_side = np.concatenate(rows, axis=1), np.concatenate(rest, axis=1)
        step = np.zeros((n, u))
        step[good] = -(np.linalg.pinv(system[good]) @ right_side[good][..., None])[..., 0]
        out = out + step * scale
    return out


def singular(jacobian: Reals) -> bool:
    """Whether J, (n, rows, unknowns), is singular at all poses that are assembled."""
    s = singular_values(jacobian)
    s = s[np.isfinite(s).all(axis=1)]
    return len(s) > 4 and bool((s[:, -1] < SINGULAR * s[:, 0]).all())
