"""Closed forms of the two-unknown groups: the planar vector equation, on one pose or on a block of poses.

M. A. Chace, J. Eng. Ind. 85 (1963) 289, distinguishes four cases of  W + ... = 0  with two unknowns: two angles,
an angle and a length (two kinds), two lengths. Each is a pure function of complex numbers and returns its unknowns
and the radicand under its root: negative, there is no assembly; zero, the Jacobian is singular. The root itself is
the Jacobian (up to a constant factor), so that it costs nothing.

`kind` says what the numbers are, Python's or arrays; there is one source for both.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from dalembert.arithmetic.recorded import RECORDED
from dalembert.arithmetic.varied import rotation
from dalembert.dataclass import dataclass
from virtualwork.formulas.numbers import ONE, Kind, Number, cross
from virtualwork.formulas.positions import State, tied
from virtualwork.plan.steps import Angle, Group, Term

# in the order of `_spans`: what a closed form that has no root says, with its links or its guide as {0} and {1}
WORDS = {
    "RRR": (
        "{0} and {1} together reach {available}, {needed} needed: {by} short",
        "{0} and {1} come no nearer than {available}, {needed} needed: {by} too long",
    ),
    "RRP": ("{0} reaches {available}, {needed} needed: {by} short",),
    "RPR": ("the line of the guide at {0} passes at {available}, at most {needed} allowed: {by} too far",),
}


@dataclass(frozen=True)
class Gap:
    """By how much a loop does not close: the length that it needs and the available one, m.

    `what` has the places {needed}, {available} and {by}, the difference, for lengths as they are to be shown, and {0} … for `names`.
    """

    needed: float
    available: float
    what: str
    names: tuple[str, ...] = ()

    def text(self, show: Callable[[float], str]) -> str:
        """The sentence, with lengths as `show` writes them."""
        by = show(abs(self.needed - self.available))
        return self.what.format(*self.names, needed=show(self.needed), available=show(self.available), by=by)


def _spans(kind: str, w: Number, v: Number, u: Number) -> list[tuple[Number, Number, Number]]:
    """The lengths that a closed form needs and those that there are, and by how much they miss: negative where it closes.

    From its W, its (first) arm V, and its second arm or its rail U. Two guides always cut, unless they are parallel.
    """
    if kind == "RRR":
        d, far, near = abs(w), abs(v) + abs(u), abs(abs(v) - abs(u))
        return [(d, far, d - far), (d, near, near - d)]
    if kind == "RRP":
        y, r = abs(cross(u, w)) / abs(u), abs(v)
        return [(y, r, y - r)]
    if kind == "RPR":
        d, q = abs(w), abs(cross(u, v)) / abs(u)
        return [(d, q, q - d)]
    return []


def gap_of(kind: str, names: tuple[str, ...], w: complex, v: complex, u: complex) -> Gap | None:
    """Why a closed form has no root, from W, V and U as `_spans` has them; None where it has.

    >>> gap_of("RRR", ("coupler", "rocker"), 1264 + 0j, 700 + 0j, 500 + 0j).text("{:g} mm".format)
    'coupler and rocker together reach 1200 mm, 1264 mm needed: 64 mm short'
    """
    for (needed, available, by), what in zip(_spans(kind, w, v, u), WORDS.get(kind, ()), strict=True):
        if by > 0:
            return Gap(needed, available, what, names)
    if kind == "PRP" and abs(cross(u, v)) <= 1e-12 * abs(u) * abs(v):
        offset = abs(cross(u, w)) / abs(u)
        return Gap(offset, 0.0, "its two guides are parallel, {by} apart, and do not meet")
    return None


def missing(kind: str, w: Number, v: Number, u: Number) -> Number:
    """By how much a closed form does not close, m, of recorded numbers: what `gap_of` says; negative where it does.

    >>> from dalembert.arithmetic.recorded import Recorder
    >>> recorder = Recorder()
    >>> short = missing("RRR", RECORDED.join(recorder.input("w"), 0.0), 700 + 0j, 500 + 0j)
    >>> from dalembert.arithmetic.engines import run
    >>> run(recorder.tape({"short": short}), {"w": 1264.0})["short"]
    64.0
    """
    worst: Number = -1.0
    for i, (*_, by) in enumerate(_spans(kind, w, v, u)):
        worst = RECORDED.select(worst - by, worst, by) if i else by
    return worst


def _root(radicand: Number, sign: Number, kind: Kind) -> Number:
    """The root of a radicand with its sign; zero, without its noise, where two assemblies meet in every pose (no sign)."""
    return 0.0 * radicand if sign is None else sign * kind.sqrt(radicand)


def two_angles(
    w: Number, v1: Number, v2: Number, sign: Number, kind: Kind = ONE
) -> tuple[Number, Number, Number]:
    """Solve W + V1·e^{iφ1} + V2·e^{iφ2} = 0 for the two rotations (RRR: two circles cut).

    With d² = |W|², r = |V|: the apex is −(a + ih)W, a = (d² + r1² − r2²)/2d² and
    h = ±√[((r1 + r2)² − d²)(d² − (r1 − r2)²)]/2d². Half that root is r1·r2·sin(φ2 − φ1), the Jacobian.

    Parameters
    ----------
    w, v1, v2 : complex
    sign : ±1, or None
        +1: V2·e^{iφ2} is counter-clockwise from V1·e^{iφ1} (their vector product is positive).

    Returns
    -------
    e1, e2 : complex
        e^{iφ1}, e^{iφ2}.
    margin : float
        sin²(φ2 − φ1): the square of the sine of the transmission angle, negative where nothing closes.

    Examples
    --------
    >>> e1, e2, margin = two_angles(-5 + 0j, 3 + 0j, 4 + 0j, 1)
    >>> abs(-5 + 3 * e1 + 4 * e2) < 1e-15, round(margin, 15)
    (True, 1.0)
    """
    d2 = (w.conjugate() * w).real
    r1, r2 = abs(v1), abs(v2)
    outer, inner = r1 + r2, r1 - r2
    radicand = (outer * outer - d2) * (d2 - inner * inner)
    half = 0.5 / d2
    # the apex lies at a − ih from the start: seen from V1, the turn to V2 has the requested sign
    t = kind.join((d2 + outer * inner) * half, _root(radicand, sign, kind) * -half)
    arm = t * w
    return arm * (-1 / v1), (arm - w) * (1 / v2), radicand * (0.25 / (r1 * r2) / (r1 * r2))


def angle_and_slide(
    w: Number, v: Number, u: Number, sign: Number, kind: Kind = ONE
) -> tuple[Number, Number, Number]:
    """Solve W + V·e^{iφ} + s·U = 0 for the rotation and the slide (RRP: a circle and a line, |U| = 1).

    In axes along U, V·e^{iφ} is x + iy with y = −Im(W·Ū), x = ±√(r² − y²), and s = −Re(W·Ū) − x.
    sign is that of x = V·e^{iφ}·U (Ibrahim §1.11: the two solution sets of the crank, rod and piston).

    Returns
    -------
    e, s : the rotation e^{iφ}, the slide
    margin : (r² − y²)/r², the squared cosine of the rod's angle to the line

    Examples
    --------
    >>> e, s, _ = angle_and_slide(3j, 5 + 0j, 1 + 0j, -1)
    >>> e, s
    ((-0.8-0.6j), 4.0)
    """
    seen = w * u.conjugate()
    r, y = abs(v), -seen.imag
    radicand = (r - y) * (r + y)
    x = _root(radicand, sign, kind)
    return kind.join(x, y) * u / v, -seen.real - x, radicand / (r * r)


def turning_slide(
    w: Number, v: Number, u: Number, sign: Number, length: float, kind: Kind = ONE
) -> tuple[Number, Number, Number]:
    """Solve W + (V + s·U)·e^{iφ} = 0 for the rotation and the slide that turns with it (RPR, |U| = 1).

    With V·Ū = p + iq: |p + s + iq| = |W|, so p + s = ±√(|W|² − q²); sign is that of p + s.

    Returns
    -------
    e, s : the rotation e^{iφ}, the slide
    margin : (p + s)²/length², with `length` the mechanism's size

    Examples
    --------
    >>> e, s, _ = turning_slide(-5 + 0j, 3j, 1 + 0j, 1, 1.0)
    >>> e, s
    ((0.8-0.6j), 4.0)
    """
    seen = v * u.conjugate()
    p, q = seen.real, seen.imag
    radicand = (w.conjugate() * w).real - q * q
    x = _root(radicand, sign, kind)
    return -w / (kind.join(x, q) * u), x - p, radicand / (length * length)


def two_slides(w: Number, u1: Number, u2: Number) -> tuple[Number, Number, Number]:
    """Solve W + s1·U1 + s2·U2 = 0 for the two slides (PRP: two lines cut).

    Returns
    -------
    s1, s2 : the slides
    margin : (U1 × U2)², zero where the guides are parallel

    Examples
    --------
    >>> two_slides(-3 - 4j, 1 + 0j, 1j)
    (3.0, 4.0, 1.0)
    """
    s1, s2, det = two_columns(w, u1, u2)
    return s1, s2, det * det


def two_columns(w: Number, c1: Number, c2: Number) -> tuple[Number, Number, Number]:
    """Solve W + x1·C1 + x2·C2 = 0 for real x1, x2 (Cramer in the plane), with the determinant C1 × C2.

    >>> two_columns(-3 - 4j, 1 + 0j, 1j)
    (3.0, 4.0, 1.0)
    """
    det = cross(c1, c2)
    inverse = -1 / det
    return cross(w, c2) * inverse, cross(c1, w) * inverse, det


class Case:
    """What a closed-form group needs, worked out once: its known terms, arms and rails.

    An arm is the vector that turns with an unknown angle; it is a constant unless an input stretches or bends it.
    `constant` makes a number of the mechanism one of those that the group is solved with.
    """

    def __init__(self, group: Group, constant: Callable[[Number], Number] | None = None) -> None:
        closure = group.closures[0]
        tie = {str(t.body): t.angle for t in group.ties}
        owner = {b: b for b in group.angles} | {
            b: next(str(base) for base, _ in a.bases if base in group.angles) for b, a in tie.items()
        }
        members = set(owner)
        self.closure, self.group = closure, group
        self.known = tuple(
            t
            for t in closure.terms
            if t.body not in members and (t.slide is None or t.slide not in group.slides)
        )
        self.arms: list[Number] = []
        self.bent: list[list[tuple[Term, Angle]]] = []
        self.tie = tie
        for angle in group.angles:
            fixed, bent = 0j, []
            for t in closure.terms:
                if owner.get(t.body) == angle and t.slide not in group.slides:
                    relative = tie.get(t.body, Angle())
                    if t.slide is None and not relative.inputs:
                        fixed += t.z * rotation(relative.const)
                    else:
                        bent.append((t, relative))
            self.arms.append(fixed if constant is None else constant(fixed))
            self.bent.append(bent)
        self.rails: list[tuple[complex, str]] = []
        for g in group.slides:
            rail = [t for t in closure.terms if t.slide == g]
            t = rail[0]
            relative = tie.get(t.body, Angle())
            plain = group.kind == "RPR" and not relative.inputs
            self.rails.append((t.z * rotation(relative.const) if plain else t.z, t.body))

    def arm(self, i: int, st: State) -> Number:
        """The arm of unknown angle i."""
        value: Number = self.arms[i]
        for t, relative in self.bent[i]:
            v = t.z
            if relative.inputs or relative.const:
                v = v * st.kind.exp(st.affine(relative))
            if t.slide is not None:
                v = v * st.slide[t.slide]
            value = value + v
        return value

    def rail(self, st: State) -> Number:
        """The direction of a slide that turns with the unknown angle, relative to it."""
        z, body = self.rails[0]
        relative = self.tie.get(body, Angle())
        return z * st.kind.exp(st.affine(relative)) if relative.inputs else z

    def offset(self, st: State) -> Number:
        """W: the known part of the loop."""
        w = st.point[self.closure.start] - st.point[self.closure.end]
        return w + st.sum(self.known) if self.known else w

    def vectors(self, st: State) -> tuple[Number, Number]:
        """What turns with each unknown angle, V, and what each unknown slide runs along, U."""
        if self.group.kind == "RRR":
            return self.arm(0, st), self.arm(1, st)
        if self.group.kind == "RPR":
            return self.arm(0, st), self.rail(st)
        rails = [z * st.turn[body] for z, body in self.rails]
        return (self.arm(0, st), rails[0]) if self.group.kind == "RRP" else (rails[0], rails[1])

    def gap(self, st: State) -> Gap | None:
        """By how much the group does not close at one pose; None where it does."""
        w, (v, u) = self.offset(st), self.vectors(st)
        return gap_of(self.group.kind, self.group.angles, complex(w), complex(v), complex(u))

    def solve(self, st: State, sign: Number, size: float) -> None:
        """Write the group's rotations and slides into the state; without a sign its two assemblies meet in every pose."""
        group, kind = self.group, st.kind
        w = self.offset(st)
        if st.many and isinstance(w, complex):
            # between points that stand: as in any array, what is divided by zero is infinite
            w = np.complex128(w)
        v, u = self.vectors(st)
        if group.kind == "RRR":
            *roots, margin = two_angles(w, v, u, sign, kind)
        elif group.kind == "RRP":
            *roots, margin = angle_and_slide(w, v, u, sign, kind)
        elif group.kind == "RPR":
            *roots, margin = turning_slide(w, v, u, sign, size, kind)
        else:
            *roots, margin = two_slides(w, v, u)
        for i, value in enumerate(roots, -len(group.angles)):
            if i < 0:
                st.turn[group.angles[i]] = value
            else:
                st.slide[group.slides[i]] = value
        st.margin[group.name] = margin
        if sign is None:
            st.folded.add(group.name)
        for tie in group.ties:
            tied(tie, st)
