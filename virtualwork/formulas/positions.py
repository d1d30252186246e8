"""Positions: the list of steps, run on the poses of one state.

Each step makes something known: a rotation e^{iθ}, a slide, a point P = P_base + Σ z·s·e^{iθ}, or all unknowns of an
Assur group. The steps do not know what kind of numbers they run on.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from dalembert.arithmetic.recorded import RECORDED, bare
from virtualwork.describe.laws import Lift
from virtualwork.describe.parts import GROUND
from virtualwork.formulas.lifts import Located, lift, located
from virtualwork.formulas.numbers import MANY, ONE, Kind, Number, Reals
from virtualwork.plan.steps import Angle, Closure, Group, Path, Place, Step, Term, Turn

# poses worked out together: their temporaries stay in the cache
BLOCK = 8192
EMPTY: Mapping[str, Any] = MappingProxyType({})
# rad: what turns farther than this between two samples is looked at in between
FAR = 1.0
# of the whole way, or of a turn of the input: samples this near are not divided again
SHORTEST = 1e-9
# rad: an angle so little above −π is half a turn but for its rounding
HALF_TURN = 1e-9
# nodes and angles, (n,) each; NaN where there is no angle
Samples = tuple[Reals, Reals]
NONE: Samples = np.empty(0), np.empty(0)


class State:
    """Positions of one block of poses: rotations e^{iθ} of the bodies, points, slides.

    Attributes
    ----------
    inputs : list of float or array (n,)
    many : bool
        Whether they are arrays.
    turn : dict of body to e^{iθ}
    angle : dict of body to θ (unwrapped), where a step needed the angle itself
    point : dict of node to x + iy
    slide : dict of guide to its slide, m
    margin : dict of group name to the radicand of its closed form, relative
    kind : Kind
        The operations of its numbers.
    """

    def __init__(self, inputs: list[Number], kind: Kind | None = None) -> None:
        self.inputs = inputs
        self.many = any(isinstance(q, np.ndarray) for q in inputs)
        self.kind: Kind = kind or (MANY if self.many else ONE)
        self.turn: dict[str, Number] = {GROUND: 1.0}
        self.angle: dict[str, Number] = {GROUND: 0.0}
        self.point: dict[str | None, Number] = {None: 0j}
        self.slide: dict[int, Number] = {}
        self.margin: dict[str, Number] = {}
        # groups that are singular in every pose
        self.folded: set[str] = set()
        # where the cams stand in their laws
        self.lifts: dict[Lift, Located] = {}
        # e^{i·input}
        self.spins: dict[int, Number] = {}

    def copy(self) -> State:
        """Another state of the same poses, to go on from here."""
        other = State(list(self.inputs), self.kind)
        for name in ("turn", "angle", "point", "slide", "margin", "lifts"):
            setattr(other, name, dict(getattr(self, name)))
        other.folded = set(self.folded)
        return other

    def spin(self, j: int) -> Number:
        """e^{i·input j}, formed once."""
        if j not in self.spins:
            self.spins[j] = self.kind.exp(self.inputs[j])
        return self.spins[j]

    def sum(self, terms: tuple[Term, ...]) -> Number:
        """Σ z·s·e^{iθ}."""
        total: Number = None
        for t in terms:
            v = t.z if t.body == GROUND else t.z * self.turn[t.body]
            if t.slide is not None:
                v = v * self.slide[t.slide]
            total = v if total is None else total + v
        return 0j if total is None else total

    def at(self, path: Path) -> Number:
        """Where a point lies."""
        base, terms = path
        return self.point[base] + self.sum(terms) if terms else self.point[base]

    def origins(self, anchors: Mapping[str, Path]) -> dict[str, Number]:
        """Where the origins of bodies lie, of those that are placed so far."""
        return {
            body: self.at((base, terms))
            for body, (base, terms) in anchors.items()
            if body in self.turn
            and base in self.point
            and all(t.body in self.turn and (t.slide is None or t.slide in self.slide) for t in terms)
        }

    def whole(self, angle: Angle) -> Number:
        """An angle with its whole turns, or a slide, tied to others; None where the angle of one of them is not known."""
        value = self.affine(angle)
        for base, r in angle.bases:
            known = self.slide if isinstance(base, int) else self.angle
            if base not in known:
                return None
            value = value + r * known[base]  # type: ignore[index]
        return self.lifted(angle, value)

    def lifted(self, angle: Angle, value: Number = 0.0) -> Number:
        """A number and the lifts of cams in an angle or a slide."""
        for of, r in angle.cams:
            value = value + r * lift(self.lifts[of], 0)
        return value

    def locate(self, angle: Angle) -> None:
        """Find where the cams of an angle or a slide stand in their laws."""
        for of, _ in angle.cams:
            e = self.turn[of.cam]
            on = None if of.on == GROUND else self.turn[of.on].conjugate()
            self.lifts[of] = located(self.kind, of, e if on is None else e * on)

    def affine(self, angle: Angle) -> Number:
        """const + Σ k·input, the part of an angle that needs no other angle."""
        value: Number = angle.const or None
        for j, k in angle.inputs:
            turned = self.inputs[j] if k == 1.0 else k * self.inputs[j]
            value = turned if value is None else value + turned
        return 0.0 if value is None else value

    def rotate(self, angle: Angle) -> Number:
        """e^{iθ} of an angle tied to others; whole-number ratios are powers, no angle is formed."""
        value: Number = None
        if len(angle.inputs) == 1 and angle.inputs[0][1] == 1.0:
            value = self.spin(angle.inputs[0][0])
            if angle.const:
                value = value * self.kind.exp(angle.const)
        elif angle.inputs or angle.const:
            value = self.kind.exp(self.affine(angle))
        for base, r in angle.bases:
            if isinstance(base, int):
                factor = self.kind.exp(r * self.slide[base])
                value = factor if value is None else value * factor
                continue
            e = self.turn[base]
            if r == 1.0:
                factor = e
            elif r == -1.0:
                factor = e.conjugate()
            elif r.is_integer():
                factor = self.kind.exp(r * self.kind.angle(e))
            else:
                factor = self.kind.exp(r * self.angle[base])
            value = factor if value is None else value * factor
        if angle.cams:
            factor = self.kind.exp(self.lifted(angle))
            value = factor if value is None else value * factor
        return 1.0 + 0j if value is None else value


def run(
    steps: Iterable[Step],
    st: State,
    close: Callable[[Group, State], None] | None = None,
    plain: Mapping[str, Callable[[State], None]] = EMPTY,
) -> None:
    """Work out positions, step by step.

    `close` closes the loops of a group on its branch; what `plain` has for a group does so wherever the input goes.
    """
    for step in steps:
        if isinstance(step, Place):
            v = st.sum(step.terms)
            st.point[step.node] = v if step.base is None else st.point[step.base] + v
        elif isinstance(step, Group):
            if step.name in plain:
                plain[step.name](st)
            elif close is not None:
                close(step, st)
        elif isinstance(step, Turn):
            turn(step, st)
        else:
            st.slide[step.guide] = st.inputs[step.input]


def turn(step: Turn, st: State) -> None:
    """A body's rotation, and its angle where a gear's ratio will need it; or a slide."""
    st.locate(step.angle)
    if isinstance(step.body, int):
        st.slide[step.body] = st.whole(step.angle)
        return
    st.turn[step.body] = st.rotate(step.angle)
    angle = st.whole(step.angle)
    if angle is not None:
        st.angle[step.body] = angle


def tied(tie: Turn, st: State) -> None:
    """A rotation or a slide that follows from others; its angle stays as it was."""
    st.locate(tie.angle)
    if isinstance(tie.body, int):
        st.slide[tie.body] = st.whole(tie.angle)
    else:
        st.turn[tie.body] = st.rotate(tie.angle)


def loop(closure: Closure, st: State) -> Number:
    """How far a loop is from closing: P[start] + Σ terms − P[end]."""
    w = st.point[closure.start] - st.point[closure.end]
    return w + st.sum(closure.terms) if closure.terms else w


def columns(group: Group, st: State) -> list[list[Number]]:
    """The Jacobian of a group: for each loop, its complex column for each unknown (angles, then slides).

    A loop's derivative is Σ column·(unknown's derivative); the real and imaginary parts are its two equations.
    """
    count = len(group.angles) + len(group.slides)
    rows = []
    for closure in group.closures:
        row: dict[int, Number] = {}
        for t in closure.terms:
            for j, r in group.shares.get(t.body, {}).items():
                v = (1j * r * t.z) * st.turn[t.body]
                v = v if t.slide is None else v * st.slide[t.slide]
                row[j] = row[j] + v if j in row else v
            for j, r in group.shares.get(t.slide, {}).items() if t.slide is not None else ():
                v = t.z * st.turn[t.body] if r == 1.0 else (r * t.z) * st.turn[t.body]
                row[j] = row[j] + v if j in row else v
        rows.append([row.get(j, 0j) for j in range(count)])
    return rows


# --- angles with their whole turns, counted along the one input from the guess outwards --------------------------------


def principal(angle: Number) -> Number:
    """An angle in (−π, π]: what stands at half a turn but for its rounding is at +π.

    >>> float(principal(-math.pi + 1e-15) - math.pi) < 2e-15
    True
    """
    return angle - 2 * math.pi * np.ceil((angle - math.pi - HALF_TURN) / (2 * math.pi))


def principal_of(turn: Number) -> Number:
    """The `principal` angle of a recorded rotation."""
    angle = RECORDED.angle(bare(turn))
    return RECORDED.select(angle + (math.pi - HALF_TURN), angle, angle + 2 * math.pi)


def follow(
    angle: Callable[[Reals], Reals], q: Reals, start: float, turn: float, known: Samples = NONE
) -> Samples:
    """Count the whole turns of an angle from the start, where it is `principal`, over inputs q.

    Parameters
    ----------
    angle : function of inputs (n,) to an angle (n,) modulo a turn; NaN where there is none
    q : array
    start : float
    turn : float
        A turn of the input, or the mechanism's size of a slide.
    known : pair of arrays, optional
        What was counted before.

    Returns
    -------
    nodes, angles : array (m,)
        More than requested where the angle turns far between two of them, and towards the end of a branch.

    Examples
    --------
    >>> nodes, angles = follow(lambda q: np.angle(1 + 1.001 * np.exp(1j * q)), np.linspace(0, 13, 300), 0.0, 6.28)
    >>> round(float(angles[-1]), 2), len(nodes) > 300
    (12.78, True)
    """

    def more(samples: Samples, q: Reals) -> Samples:
        nodes, first = np.unique(np.append(samples[0], q), return_index=True)
        return nodes, np.append(samples[1], angle(q))[first]

    nodes, angles = more(known, np.append(start, q))
    for _ in range(64):
        there = np.isfinite(angles)
        turned = np.abs(np.exp(1j * angles[1:]) - np.exp(1j * angles[:-1]))
        # the end of a branch lies between a sample that is there and one that is not
        divide = ((turned > FAR) | (there[1:] != there[:-1])) & (np.diff(nodes) > SHORTEST * turn)
        if not divide.any():
            break
        nodes, angles = more((nodes, angles), ((nodes[1:] + nodes[:-1]) / 2)[divide])
    good = np.isfinite(angles)
    angles[good] = np.unwrap(angles[good])
    here = np.searchsorted(nodes, start)
    if good[here]:
        angles += principal(angles[here]) - angles[here]
    elif good.any():
        # a guess that is not assembled stands between two samples
        near = np.interp(start, nodes[good], angles[good])
        angles += principal(near) - near
    return nodes, angles


def unwound(angle: Number, near: Number) -> Number:
    """An angle with the whole turns that bring it nearest to another."""
    return angle + 2 * np.pi * np.round((near - angle) / (2 * np.pi))


def whole(samples: Samples, q: Number, angle: Number) -> Number:
    """An angle at inputs q, known modulo a turn, with its whole turns by what was counted."""
    nodes, counted = samples
    good = np.isfinite(counted)
    if not good.any():
        return angle
    return unwound(angle, np.interp(np.asarray(q, dtype=float), nodes[good], counted[good]))
