"""What the formulas run on: Python numbers of one pose, arrays over many poses, recorded ones; and linear systems of them.

A formula needs +, −, ·, /, `abs`, `.real`, `.imag` and `.conjugate()` of its numbers. What Python has no operator for,
roots, e^{iθ}, a complex number of two real ones, a `Kind` gives; a state carries its kind (`kinds`).
"""

from __future__ import annotations

import cmath
import math
from bisect import bisect
from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.recorded import RECORDED, bare
from dalembert.arithmetic.systems import solved

# complex or float, or an array of them; None is a zero that costs nothing
Number = Any
Reals = NDArray[np.float64]
Complexes = NDArray[np.complex128]
EPS = float(np.finfo(float).eps)
# sine of the angle between two columns below which the joint forces have no digit left that counts
PARALLEL = 1e-11
# of the mechanism's size: two points nearer than this have no direction from one to the other
TOGETHER = 64 * EPS
# a link that turns so many times as fast as the input: at a dead point to rounding, no number is left
FAST = 1e13
# a singular value below this share of the largest is that of a null vector
SINGULAR = 1e-6


def cross(a: Number, b: Number) -> Number:
    """The plane's vector product a_x·b_y − a_y·b_x.

    >>> cross(1 + 0j, 1j)
    1.0
    """
    return (a.conjugate() * b).imag


def dot(a: Number, b: Number) -> Number:
    """The scalar product a_x·b_x + a_y·b_y."""
    return (a.conjugate() * b).real


def plus(a: Number, b: Number) -> Number:
    """a + b, where None is zero."""
    return b if a is None else a if b is None else a + b


def minus(a: Number, b: Number) -> Number:
    """a − b, where None is zero."""
    return a if b is None else -b if a is None else a - b


def times(a: Number, b: Number) -> Number:
    """a·b, where None is zero; a factor of exactly 1 leaves the other as it is."""
    if a is None or b is None:
        return None
    if isinstance(a, (int, float)) and a == 1:
        return b
    return a if isinstance(b, (int, float)) and b == 1 else a * b


def leave_out(values: NDArray[Any], which: NDArray[np.bool_]) -> None:
    """Give no number where `which` is true: a complex one is NaN in both its parts, which NaN alone is not.

    >>> z = np.array([1 + 2j, 3j])
    >>> leave_out(z, np.array([False, True]))
    >>> xy(z)
    array([[ 1.,  2.],
           [nan, nan]])
    """
    values[which] = complex(np.nan, np.nan) if values.dtype.kind == "c" else np.nan


def real_array(name: str, value: ArrayLike, once: bool = False) -> Reals:
    """Read real numbers as an array of its own; ValueError names what holds something else. What is masked is NaN.

    A motion is solved on the first request: what the caller does to his array in between does not change it. What is
    solved at `once` may read the caller's own.

    >>> real_array("angle", "abc")
    Traceback (most recent call last):
    ValueError: angle: expected real numbers, found 'abc'
    """
    try:
        if hasattr(value, "dtype"):
            if value.dtype.kind in "cmM":
                # numpy takes the real part of complex numbers, and nanoseconds of times
                raise TypeError
            # those that mask values have them loaded; `numpy.ma` takes its time
            masked: Any = value
            if isinstance(getattr(masked, "mask", None), (np.ndarray, np.bool_)):
                value = np.ma.filled(masked.astype(float), np.nan)
        return np.asarray(value, dtype=float) if once else np.array(value, dtype=float)
    except (TypeError, ValueError):
        text = " ".join(repr(value).split())
        text = text if len(text) <= 60 else f"{text[:60]} …"
        raise ValueError(f"{name}: expected real numbers, found {text}") from None


def xy(z: Complexes) -> Reals:
    """x + iy (..., n) as rows (x, y), (..., n, 2), without a copy.

    >>> xy(np.array([1 + 2j]))
    array([[1., 2.]])
    """
    return z[..., None].view(float)


# --- linear systems of loops: from complex columns to real solutions, over all poses together ------------------------


def stack(cols: list[list[Number]], n: int) -> Reals:
    """The real Jacobian (n, 2·loops, unknowns) from complex columns."""
    loops, unknowns = len(cols), len(cols[0])
    out = np.zeros((n, 2 * loops, unknowns))
    for i, row in enumerate(cols):
        for j, c in enumerate(row):
            # of many loops each holds few of the unknowns
            if type(c) is complex and c == 0:
                continue
            out[:, 2 * i, j] = np.real(c)
            out[:, 2 * i + 1, j] = np.imag(c)
    return out


def stack_rows(rows: list[Number], n: int) -> Reals:
    """The real loop gaps (n, 2·loops) from complex ones."""
    return stack([[w] for w in rows], n)[:, :, 0]


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


def condition(cols: list[list[Number]], angles: int, size: Number, n: int) -> Reals:
    """‖J⁻¹‖∞ of each pose from complex columns, those of so many angles divided by the mechanism's size."""
    with np.errstate(all="ignore"):
        jacobian = stack(cols, n)
        jacobian[:, :, :angles] /= np.reshape(size, (-1, 1, 1))
        return inverse_norm(jacobian)


def equilibrated(jacobian: Reals) -> tuple[Reals, Reals]:
    """Each pose's Jacobian (n, rows, unknowns) with columns of length 1, and the lengths that they had, (n, unknowns).

    So no pose and no unknown hides another: a link a million times shorter than the others, a slide that runs far out.
    It is within √unknowns of the least condition that any scale of the unknowns gives (A. van der Sluis, Numer. Math. 14,
    1969). A column that vanishes but for rounding of its pose stays so.

    >>> scaled, lengths = equilibrated(np.array([[[3e9, 0.0], [4e9, 1e-9]]]))
    >>> scaled[0].tolist(), lengths.tolist()
    ([[0.6, 0.0], [0.8, 1.0]], [[5000000000.0, 1e-09]])
    """
    lengths = np.linalg.norm(jacobian, axis=1)
    nothing = ~(lengths > 0)
    lengths = np.where(nothing, 1.0, lengths)
    return jacobian / lengths[:, None, :], lengths


def singular_values(jacobian: Reals) -> Reals:
    """The singular values of each pose's Jacobian (`equilibrated`); NaN where it is not assembled."""
    good = np.isfinite(jacobian).all(axis=(1, 2))
    out = np.full((len(jacobian), min(jacobian.shape[1:])), np.nan)
    out[good] = np.linalg.svd(equilibrated(jacobian[good])[0], compute_uv=False)
    return out


def singular_poses(cols: list[list[Number]], n: int) -> NDArray[np.bool_]:
    """Which poses have a Jacobian whose smallest singular value is below 1e-6 of its largest."""
    s = singular_values(stack(cols, n))
    return np.asarray(s[:, -1] < SINGULAR * s[:, 0])


def determined(jacobian: Reals, right: Reals) -> Reals:
    """Solve Φ·x = right where Φ is singular in every pose: what a null vector of it moves is not determined, and NaN."""
    good = np.isfinite(jacobian).all(axis=(1, 2)) & np.isfinite(right).all(axis=1)
    out = np.full((len(right), jacobian.shape[2]), np.nan)
    if good.any():
        jacobian, lengths = equilibrated(jacobian[good])
        _, s, null = np.linalg.svd(jacobian)
        loose = (s < SINGULAR * s[:, :1]).astype(float)
        free = np.einsum("nk,nkj->nj", loose, np.abs(null[:, : s.shape[1]])) > SINGULAR
        least = (np.linalg.pinv(jacobian, rcond=SINGULAR) @ right[good][..., None])[..., 0]
        out[good] = np.where(free, np.nan, least / lengths)
    return out


def solve_columns(
    cols: list[list[Number]], right: list[Number], solver: Callable[[Reals, Reals], Reals] = solve
) -> list[Number]:
    """Solve Σ column·x + right = 0 for the unknowns' derivatives."""
    shape = np.broadcast_shapes(*(np.shape(c) for row in cols for c in row), *(np.shape(w) for w in right))
    n = int(np.prod(shape))
    x = solver(stack(cols, n), -stack_rows(right, n))
    return [x[:, j] if shape else float(x[0, j]) for j in range(x.shape[1])]


def solve_transposed(cols: list[list[Number]], loads: list[Number]) -> list[Number]:
    """Solve Σ_c λ_c·∂C_c/∂x + Q_x = 0 for the complex λ of the loops; None is no load."""
    filled = [0.0 if load is None else load for load in loads]
    shape = np.broadcast_shapes(*(np.shape(c) for row in cols for c in row), *(np.shape(q) for q in filled))
    n = int(np.prod(shape))
    jacobian = np.swapaxes(stack(cols, n), -1, -2)
    right = np.zeros((n, len(loads)))
    for i, load in enumerate(filled):
        right[:, i] = -load
    good = np.asarray(np.isfinite(jacobian).all(axis=(1, 2)) & np.isfinite(right).all(axis=1))
    out = np.full((n, jacobian.shape[-1]), np.nan)
    if jacobian.shape[-1] == jacobian.shape[-2]:
        good &= np.linalg.cond(np.where(good[:, None, None], jacobian, np.eye(len(loads)))) < 1 / PARALLEL
        out[good] = np.linalg.solve(jacobian[good], right[good][..., None])[..., 0]
    result = out[:, 0::2] + 1j * out[:, 1::2]
    return [result[:, c] if shape else complex(result[0, c]) for c in range(result.shape[1])]


# --- kinds of numbers ------------------------------------------------------------------------------------------------


class Kind(Protocol):
    """The operations of one kind of number."""

    def sqrt(self, x: Number) -> Number:
        """The root; NaN of a negative number."""

    def exp(self, angle: Number) -> Number:
        """e^{i·angle}."""

    def join(self, re: Number, im: Number) -> Number:
        """re + i·im."""

    def angle(self, z: Number) -> Number:
        """The angle of a complex number, in (−π, π]."""

    def select(self, test: Number, positive: Number, otherwise: Number) -> Number:
        """The second where the first is positive, else the third."""

    def among(self, x: Number, knots: Sequence[Number], values: Sequence[Number]) -> Number:
        """Of values between rising knots the one in whose interval x lies; the last where x is beyond."""

    def solve(self, cols: list[list[Number]], right: list[Number]) -> list[Number]:
        """Solve Σ column·x + right = 0, complex, for the real unknowns x of a group."""


class ForceKind(Kind, Protocol):
    """The operations that forces need too: of one pose, or of recorded numbers."""

    def regular(self, inverse: Number, c1: Number, c2: Number) -> Number:
        """1/(c1 × c2); NaN where two columns are parallel to rounding, for the joint forces have no value there."""

    def inverse(self, length: Number, least: float) -> Number:
        """1/length; NaN of one that is not above the least, which has no direction."""

    def transposed(self, cols: list[list[Number]], loads: list[Number]) -> list[Number]:
        """Solve Σ_c λ_c·column_c + load = 0 for the complex λ of a group's loops; NaN where they have no value."""


class One:
    """Python numbers: a single pose."""

    def sqrt(self, x: float) -> float:
        return math.sqrt(x) if x >= 0 else math.nan

    def exp(self, angle: float) -> complex:
        return complex(math.cos(angle), math.sin(angle))

    def regular(self, inverse: float, c1: complex, c2: complex) -> float:
        return inverse if abs(inverse) * (abs(c1) * abs(c2)) < 1 / PARALLEL else math.nan

    def inverse(self, length: float, least: float) -> float:
        return 1 / length if length > least else math.nan

    def select(self, test: float, positive: Number, otherwise: Number) -> Number:
        return positive if test > 0 else otherwise

    def among(self, x: float, knots: Sequence[float], values: Sequence[Number]) -> Number:
        return values[min(max(bisect(knots, x) - 1, 0), len(values) - 1)]

    def system(self, rows: list[list[float]], right: list[float]) -> list[float]:
        """Solve rows·x = right; NaN where the rows are parallel to rounding."""
        matrix = np.array(rows)
        # the volume of the rows over the product of their lengths (Hadamard): a slide's row has a unit of its own
        lengths = float(np.sqrt((matrix * matrix).sum(axis=1)).prod())
        if not abs(np.linalg.det(matrix)) > 1e-14 * lengths:
            return [math.nan] * len(right)
        return np.linalg.solve(matrix, right).tolist()  # type: ignore[no-any-return]

    join, angle = complex, staticmethod(cmath.phase)
    solve, transposed = staticmethod(solve_columns), staticmethod(solve_transposed)


class Many:
    """Arrays over poses; what is the same in all of them may be a Python number."""

    sqrt, angle = staticmethod(np.sqrt), staticmethod(np.angle)
    solve = staticmethod(solve_columns)

    def exp(self, angle: Number) -> Number:
        if not np.ndim(angle):
            return ONE.exp(angle)
        z = np.empty(np.shape(angle), complex)
        np.cos(angle, out=z.real)
        np.sin(angle, out=z.imag)
        return z

    def join(self, re: Number, im: Number) -> Number:
        z = np.empty(np.broadcast_shapes(np.shape(re), np.shape(im)), complex)
        z.real = re
        z.imag = im
        return z

    def select(self, test: Number, positive: Number, otherwise: Number) -> Number:
        return np.where(test > 0, positive, otherwise)

    def among(self, x: Number, knots: Sequence[float], values: Sequence[Number]) -> Number:
        if all(value == values[0] for value in values):
            return values[0]
        return np.array(values)[np.clip(np.searchsorted(knots, x, "right") - 1, 0, len(values) - 1)]


def real_part(z: Number) -> Number:
    """The real part of any number."""
    return bare(z).real


def imaginary_part(z: Number) -> Number:
    """The imaginary part."""
    return bare(z).imag


PARTS = real_part, imaginary_part


class Written:
    """Recorded numbers, and constants of the mechanism that vary: what is done with them is written down."""

    def sqrt(self, x: Number) -> Number:
        return RECORDED.sqrt(bare(x))

    def exp(self, angle: Number) -> Number:
        return RECORDED.turn(bare(angle))

    def join(self, re: Number, im: Number) -> Number:
        return RECORDED.join(bare(re), bare(im))

    def angle(self, z: Number) -> Number:
        return RECORDED.angle(bare(z))

    def regular(self, inverse: Number, c1: Number, c2: Number) -> Number:
        size = (c1.conjugate() * c1).real * (c2.conjugate() * c2).real * (inverse * inverse)
        return RECORDED.select(1 / PARALLEL**2 - bare(size), bare(inverse), math.nan)

    def inverse(self, length: Number, least: Number) -> Number:
        length = bare(length)
        return 1 / RECORDED.select(length - bare(least), length, math.nan)

    def select(self, test: Number, positive: Number, otherwise: Number) -> Number:
        return RECORDED.select(bare(test), bare(positive), bare(otherwise))

    def among(self, x: Number, knots: Sequence[Number], values: Sequence[Number]) -> Number:
        if all(value == values[0] for value in values):
            return bare(values[0])
        # halves of halves: a decision is a few deep
        middle = len(values) // 2
        return self.select(
            bare(x) - bare(knots[middle]),
            self.among(x, knots[middle:], values[middle:]),
            self.among(x, knots[:middle], values[:middle]),
        )

    def solve(self, cols: list[list[Number]], right: list[Number]) -> list[Number]:
        rows = [[part(c) for c in row] for row in cols for part in PARTS]
        return self.system(rows, [-part(w) for w in right for part in PARTS])

    def transposed(self, cols: list[list[Number]], loads: list[Number]) -> list[Number]:
        rows = [[part(row[j]) for row in cols for part in PARTS] for j in range(len(loads))]
        x = self.system(rows, [0.0 if load is None else -bare(load) for load in loads], PARALLEL)
        return [self.join(x[2 * c], x[2 * c + 1]) for c in range(len(cols))]

    def system(self, rows: list[list[Number]], right: list[Number], least: float = 0.0) -> list[Number]:
        return solved(rows, right, least=least)


ONE, MANY, WRITTEN = One(), Many(), Written()
