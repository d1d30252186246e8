"""How finely an input is sampled: by what moves, never by the size of the file.

A fast gear, a quick return or short arms far from the other points move a loop far in a small step of the input. Samples
are inserted until the loop moves only a small share of its arms from one sample to the next; the radicand between two of
them is then a polynomial to rounding, and its lowest point is where the slope of that polynomial is zero.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from fractions import Fraction
from math import gcd, lcm

import numpy as np
from numpy.typing import NDArray

from virtualwork.describe.parts import GROUND
from virtualwork.formulas.closed_forms import Case
from virtualwork.formulas.numbers import EPS, Complexes, Number, Reals
from virtualwork.formulas.positions import State

# rad: what a body that a gear drives may turn between two samples
FINE = 0.05
# of the shorter arm of a loop: what its open vector may move between two samples
NEAR_ARM = 0.1
# rad: what a body of a loop may turn between two samples, where other loops follow from it
TURNED = 0.2
# halvings of a step
DEEPEST = 24
# poses worked out together
MOST = 1 << 16
# gears whose ratios have no larger common multiple repeat together
COMMON = 10000
# a last coefficient below this share of the largest is none: what is divided by it would overflow
NONE = 1e-100
# of where nothing is special: a radicand below this share may touch zero between two samples
DIP = 0.05
# of a fit: the number of its nodes and its degree
NODES, DEGREE = 14, 11


def common_rate(rates: Iterable[float]) -> float | None:
    """The fastest rate of which all the others are whole multiples; None where there is none.

    Examples
    --------
    >>> common_rate([3000.0]), common_rate([1.0, -17.0]), common_rate([0.5, 2 / 3]), common_rate([1.0, 2**0.5])
    (3000.0, 1.0, 0.16666666666666666, None)
    """
    sizes = [abs(k) for k in rates if k]
    if not sizes:
        return 1.0
    first = sizes[0]
    if all(k == first for k in sizes):
        return first
    ratios = [Fraction(k / first).limit_denominator(COMMON) for k in sizes]
    if any(abs(float(r) - k / first) > 4 * EPS * k / first for r, k in zip(ratios, sizes, strict=True)):
        return None
    return first * gcd(*(r.numerator for r in ratios)) / lcm(*(r.denominator for r in ratios))


def parts(a: float, b: float, step: float) -> Iterator[tuple[float, float, int]]:
    """From a to b in steps of one size, at most as long as one, a part at a time: its ends, and how many steps it has.

    Examples
    --------
    >>> list(parts(0.0, 1.0, 0.3))
    [(0.0, 1.0, 4)]
    """
    count = max(1, int(np.ceil((b - a) / step)))
    for first in range(0, count, MOST):
        last = min(first + MOST, count)
        yield a + (b - a) * (first / count), a + (b - a) * (last / count), last - first


def refined(
    q: Reals, uneven: Callable[[Complexes], NDArray[np.bool_]], look: Callable[[Reals], Complexes]
) -> Reals:
    """Samples with more of them inserted wherever what is looked at moves too far between two.

    Parameters
    ----------
    q : array (n,)
    uneven : function of rows (m, n) to a mask (n − 1,)
    look : function of inputs (n,) to rows (m, n)

    Examples
    --------
    >>> q = refined(np.linspace(-1, 1, 5), lambda z: np.abs(np.diff(z[0])) > 0.2, lambda q: np.arctan(100 * q)[None])
    >>> bool(np.abs(np.diff(np.arctan(100 * q))).max() <= 0.2), len(q) < 64
    (True, True)
    """
    rows = look(q)
    least = (q[-1] - q[0]) / (len(q) - 1) / 2**DEEPEST
    while True:
        divide = np.flatnonzero(uneven(rows) & (np.diff(q) > least))
        if not len(divide) or len(q) > 2 * MOST:
            return q
        middle = (q[divide] + q[divide + 1]) / 2
        q = np.insert(q, divide + 1, middle)
        rows = np.insert(rows, divide + 1, look(middle), axis=1)


def loop_rows(case: Case, st: State, driving: Sequence[str]) -> Complexes:
    """What `moves_far` looks at: the open vector of a loop, what closes it, and the bodies that other angles follow."""
    w, (v, u) = case.offset(st), case.vectors(st)
    shape = np.shape(st.inputs[0])
    return np.array(
        [np.broadcast_to(x, shape) for x in (w, v, u, *(st.turn[b] for b in driving))], dtype=complex
    )


def hardly_moves(case: Case, st: State) -> bool:
    """Whether a loop of constant arms moves so little between any two samples that nothing else has to be looked at."""
    if case.group.kind == "RPR" or any(case.bent) or any(body != GROUND for _, body in case.rails):
        return False
    w = case.offset(st)
    # of what is not there neither is less than the other
    return bool(np.abs(np.diff(np.atleast_1d(w))).max(initial=0.0) <= NEAR_ARM * min(map(abs, case.arms)))


def turns_far(ratios: Reals, rows: Complexes) -> NDArray[np.bool_]:
    """Between which samples a body turns too far, or what turns so many times as fast; `rows` are their e^{iθ}."""
    turned = np.abs(np.angle(rows[:, 1:] * rows[:, :-1].conj()))
    return np.asarray((turned * ratios[:, None] > TURNED).any(axis=0))


def moves_far(kind: str, ratios: Reals, rows: Complexes) -> NDArray[np.bool_]:
    """Between which samples a loop moves too far to show what its radicand does.

    Parameters
    ----------
    kind : str
    ratios : array (n,)
        How many times as fast as its body of the last rows another one turns.
    rows : array (3 + n, samples)
    """
    w, v, u = rows[:3]
    with np.errstate(invalid="ignore"):
        far = turns_far(ratios, rows[3:])
        if kind == "RRR":
            r1, r2 = np.abs(v), np.abs(u)
            distance, least = np.abs(w), np.minimum(r1, r2)
            move = np.abs(np.diff(w)) + np.abs(np.diff(r1)) + np.abs(np.diff(r2))
            high, low = r1 + r2, np.abs(r1 - r2)
        elif kind == "RRP":
            distance = np.abs((u.conj() * w).imag)
            high = least = np.abs(v)
            low, move = np.full(len(w), -np.inf), np.abs(np.diff(distance)) + np.abs(np.diff(high))
        else:
            return np.asarray(far | (np.isfinite(w[1:]) != np.isfinite(w[:-1])))
        close = np.minimum(distance[1:] - high[1:], distance[:-1] - high[:-1]) < 2 * move
        close &= np.maximum(distance[1:] - low[1:], distance[:-1] - low[:-1]) > -2 * move
        far |= close & (move > NEAR_ARM * np.minimum(least[1:], least[:-1]))
    return np.asarray(far | (np.isfinite(distance[1:]) != np.isfinite(distance[:-1])))


def _longest(z: Complexes) -> float:
    """The longest of some vectors, of those that there are."""
    return float(np.fmax.reduce(np.abs(np.atleast_1d(z)), initial=0.0))


def depths(case: Case, st: State, size: float) -> tuple[float, float]:
    """The size of a group's radicand where nothing is special, and its rounding, over the poses of a state.

    Both depend on what the loop itself holds: on its points and arms, and of a slide that turns on how far it reaches.
    """
    w, (v, u) = case.offset(st), case.vectors(st)
    kind = case.group.kind
    far = max(_longest(x) for x in (st.point[case.closure.start], st.point[case.closure.end], w, v))
    if kind == "RPR":
        shortest = max(_longest(w), _longest((np.conj(u) * v).imag))
    else:
        shortest = min(_longest(x) for x in ((v, u) if kind == "RRR" else (v,)))
    level = (shortest / size) ** 2 if kind == "RPR" else 1.0
    if not (shortest > 0 and np.isfinite(far)):
        return 1.0, 256 * EPS
    return level, 256 * EPS * (1 + far / shortest) * level


def vanishes(margin: Number, noise: float) -> bool:
    """Whether a radicand is zero to rounding wherever there is one."""
    m = np.abs(np.atleast_1d(margin))
    m = m[np.isfinite(m)]
    return len(m) > 4 and bool((m <= noise).all())


# --- the lowest point of a radicand ---------------------------------------------------------------------------------
def chebyshev_nodes(n: int) -> Reals:
    """The n Chebyshev points of the first kind in (−1, 1)."""
    return np.cos(np.pi * (np.arange(n) + 0.5) / n)


def real_roots(series: np.polynomial.Chebyshev, within: float) -> Reals:
    """The real roots of a series within ±`within`; none of a series that is zero or not finite.

    Examples
    --------
    >>> from numpy.polynomial import Chebyshev
    >>> nodes = chebyshev_nodes(8)
    >>> real_roots(Chebyshev.fit(nodes, 1e-300 * (nodes - 0.25), 6, domain=[-1, 1]), 1.0).round(12)
    array([0.25])
    >>> real_roots(Chebyshev([np.nan, 1.0]), 1.0)
    array([], dtype=float64)
    """
    largest = float(np.abs(series.coef).max(initial=0.0))
    if not (np.isfinite(largest) and largest > 0):
        return np.empty(0)
    # by a power of two, which rounds nothing
    scaled = type(series)(np.ldexp(series.coef, -int(np.frexp(largest)[1]))).trim(NONE)
    roots = scaled.roots()
    return np.asarray(np.real(roots[(np.abs(np.imag(roots)) < 1e-6) & (np.abs(np.real(roots)) <= within)]))


def _fitted(
    margin: Callable[[Reals], Reals], centre: float, half: float
) -> tuple[np.polynomial.Chebyshev | None, float]:
    """A radicand as a polynomial around a place, and how far that may be from it; None where it is not assembled."""
    nodes = chebyshev_nodes(NODES)
    m = margin(centre + half * nodes)
    if not np.isfinite(m).all():
        return None, np.inf
    fit = np.polynomial.Chebyshev.fit(nodes, m, DEGREE, domain=[-1, 1])
    return fit, float(np.abs(fit.coef[-2:]).max() + np.abs(fit(nodes) - m).max())


def _least(fit: np.polynomial.Chebyshev) -> float | None:
    """Where a fit's slope is zero next to its least size; None where it is nowhere zero."""
    real = real_roots(fit.deriv(), 1.2)
    return float(real[np.argmin(np.abs(fit(real)))]) if len(real) else None


def lowest(
    margin: Callable[[Reals], Reals], a: float, b: float, rounding: float
) -> tuple[float, float, float] | None:
    """The lowest point of a radicand near a sampled dip: where, how low, and the rounding in that depth.

    The radicand is smooth: it is fitted at Chebyshev points, and its slope's root is free of cancellation. A fit whose
    last coefficients are above rounding is none: it is narrowed until they are below it.

    Examples
    --------
    >>> where, depth, left = lowest(lambda q: (q - 0.3) ** 2 / (1e-3 + q * q), 0.2, 0.5, 1e-15)
    >>> abs(where - 0.3) < 1e-9, abs(depth) <= left < 1e-13
    (True, True)
    """
    centre, half = (a + b) / 2, (b - a) / 2
    input_rounding = 4 * EPS * max(abs(a), abs(b))

    def shaken(fit: np.polynomial.Chebyshev, half: float) -> float:
        """What the input's own rounding makes of a steep radicand."""
        return input_rounding / half * float(np.abs(fit.coef[1:]).sum())

    while half > 16 * input_rounding:
        fit, left = _fitted(margin, centre, half)
        best = _least(fit) if fit is not None else 0.0
        if best is None:
            return None
        centre += half * best
        if fit is not None and left <= (noise := rounding + shaken(fit, half)):
            depth = float(fit(best))
            # a wider fit that holds as well tells the place with more digits
            wide, more = _fitted(margin, centre, 4 * half)
            if wide is not None and more <= rounding + shaken(wide, 4 * half):
                centre += 4 * half * (_least(wide) or 0.0)
            return centre, depth, noise + left
        half /= 4
    return None


def touched(
    margin: Callable[[Reals], Reals],
    q: Reals,
    m: Reals,
    depth: tuple[float, float],
    span: tuple[float, float, float],
) -> tuple[Reals, list[tuple[float, float]]]:
    """Where a radicand that is sampled touches zero, and between which inputs it crosses it.

    Parameters
    ----------
    margin : function of inputs (n,) to the radicand
    q, m : array (n,)
        Samples that are fine enough, and the radicand there.
    depth : pair of float
        The size of the radicand where nothing is special, and its rounding.
    span : triple of float
        From where to where, and how far beyond an end what touches belongs to both sides of it.

    Examples
    --------
    >>> q = np.linspace(-2, 2, 41)
    >>> flips, crossed = touched(f := lambda q: np.cos(q) ** 2 * (q + 1.02), q, f(q), (1.0, 1e-14), (-2.0, 2.0, 0.0))
    >>> flips.round(9), [(round(a, 9), round(b, 9)) for a, b in crossed]
    (array([1.57079633]), [(-1.1, -1.0)])
    """
    (level, noise), (a, b, edge) = depth, span
    finite = m[np.isfinite(m)]
    if not len(finite) or np.ptp(finite) <= noise:
        # pins that turn about one place: the radicand is constant, and its dips are rounding
        return np.empty(0), []
    inside = (q >= a) & (q < b)
    changes = ((m[:-1] >= 0) != (m[1:] >= 0)) & np.isfinite(m[:-1] + m[1:]) & (inside[:-1] | inside[1:])
    at = np.flatnonzero(changes)
    crossed = list(zip(q[at].tolist(), q[at + 1].tolist(), strict=True))
    flips: list[float] = []
    for side in (1, -1):
        # a dip from above, and from below what is assembled for less than a step
        d = side * m
        low = (d[1:-1] <= d[:-2]) & (d[1:-1] < d[2:]) & (np.abs(m[1:-1]) < DIP * level)
        for i in 1 + np.flatnonzero(low if side > 0 else low & (d[1:-1] > 0)):
            least = lowest(margin, float(q[i - 1]), float(q[i + 1]), noise)
            if least is None:
                continue
            where, depth_there, left = least
            # the gap is narrower than the samples
            if side * depth_there < -left and d[i] > 0:
                crossed += [(min(end, where), max(end, where)) for end in (float(q[i - 1]), float(q[i + 1]))]
            # a change point at the seam of two chunks belongs to both
            if side > 0 and abs(depth_there) <= left and a - edge <= where < b + edge:
                flips.append(where)
                crossed = [ends for ends in crossed if not ends[0] <= where <= ends[1]]
    return np.array(flips), crossed
