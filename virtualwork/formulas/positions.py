"""Positions: the list of steps, run on the poses of one state.

Each step makes something known: a rotation e^{iθ}, a slide, a point P = P_base + Σ z·s·e^{iθ}, or all unknowns of an
Assur group. The steps do not know what kind of numbers they run on.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from dalembert.arithmetic.recorded import rotation
from virtualwork.describe.parts import GROUND
from virtualwork.formulas.closed_forms import (
    Gap,
    angle_and_slide,
    gap_of,
    turning_slide,
    two_angles,
    two_slides,
)
from virtualwork.formulas.kinds import MANY, ONE, Folded
from virtualwork.formulas.numbers import Kind, Number, plus
from virtualwork.plan.steps import Angle, Closure, Group, Path, Place, Step, Term, Turn

# poses worked out together: their temporaries stay in the cache
BLOCK = 8192
EMPTY: Mapping[str, Any] = MappingProxyType({})
# from so many poses on, e^{iθ} of a uniform sweep is formed by angle addition
SWEEP = 256


class State:
    """Positions of one block of poses: rotations e^{iθ} of the bodies, points, slides.

    Attributes
    ----------
    inputs : list of float or array (n,)
    turn : dict of body to e^{iθ}
    angle : dict of body to θ (unwrapped), where a step needed the angle itself
    point : dict of node to x + iy
    slide : dict of guide to its slide, m
    margin : dict of group name to the radicand of its closed form, relative
    kind : Kind
        The operations of its numbers.
    """

    def __init__(self, inputs: list[Number], many: bool = False, kind: Kind | None = None) -> None:
        self.inputs, self.many = inputs, many
        self.kind: Kind = kind or (MANY if many else ONE)
        self.turn: dict[str, Number] = {GROUND: 1.0}
        self.angle: dict[str, Number] = {GROUND: 0.0}
        self.point: dict[str | None, Number] = {None: 0j}
        self.slide: dict[int, Number] = {}
        self.margin: dict[str, Number] = {}
        # groups that are singular in every pose
        self.folded: set[str] = set()
        # e^{i·input}, where a sweep knows it already
        self.spins: dict[int, Number] = {}

    def copy(self, many: bool | None = None) -> State:
        """Another state of the same poses, to go on from here."""
        many = self.many if many is None else many
        inputs = [np.atleast_1d(np.asarray(q, dtype=float)) for q in self.inputs] if many else self.inputs
        other = State(list(inputs), many, None if many != self.many else self.kind)
        for name in ("turn", "angle", "point", "slide", "margin"):
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
        return 1.0 + 0j if value is None else value


def run(
    steps: Iterable[Step],
    st: State,
    close: Callable[[Group, State], None] | None = None,
    plain: Mapping[str, tuple[Case, int, float]] = EMPTY,
) -> None:
    """Work out positions, step by step.

    `close` closes the loops of a group on its branch; those of `plain`, (case, sign, size), keep one sign all along.
    """
    for step in steps:
        if isinstance(step, Place):
            v = st.sum(step.terms)
            st.point[step.node] = v if step.base is None else st.point[step.base] + v
        elif isinstance(step, Group):
            if step.name in plain:
                case, sign, size = plain[step.name]
                case.solve(st, sign, size)
            elif close is not None:
                close(step, st)
        elif isinstance(step, Turn):
            turn(step, st)
        else:
            st.slide[step.guide] = st.inputs[step.input]


def turn(step: Turn, st: State) -> None:
    """A body's rotation; its angle too, where a gear's ratio will need it."""
    st.turn[step.body] = st.rotate(step.angle)
    angle = st.affine(step.angle)
    for base, r in step.angle.bases:
        if base not in st.angle:
            return
        angle = angle + r * st.angle[base]
    st.angle[step.body] = angle


def loop(closure: Closure, st: State) -> Number:
    """How far a loop is from closing: P[start] + Σ terms − P[end]."""
    w = st.point[closure.start] - st.point[closure.end]
    return w + st.sum(closure.terms) if closure.terms else w


class Case:
    """What a closed-form group needs, worked out once: its known terms, arms and rails.

    An arm is the vector that turns with an unknown angle; it is a constant unless an input stretches or bends it.
    """

    def __init__(self, group: Group) -> None:
        closure = group.closures[0]
        tie = {t.body: t.angle for t in group.ties}
        owner = {b: b for b in group.angles} | {
            b: next(base for base, _ in a.bases if base in group.angles) for b, a in tie.items()
        }
        members = set(owner)
        self.closure, self.group = closure, group
        self.known = tuple(
            t
            for t in closure.terms
            if t.body not in members and (t.slide is None or t.slide not in group.slides)
        )
        self.arms: list[complex] = []
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
            self.arms.append(fixed)
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
        value: Number = st.kind.constant(self.arms[i])
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

    def gap(self, st: State) -> Gap | None:
        """By how much the group does not close at one pose; None where it does."""
        group = self.group
        if group.kind == "RRR":
            v, u = self.arm(0, st), self.arm(1, st)
        elif group.kind == "PRP":
            v, u = (z * st.turn[body] for z, body in self.rails)
        else:
            z, body = self.rails[0]
            v, u = self.arm(0, st), z * st.turn[body] if group.kind == "RRP" else self.rail(st)
        return gap_of(group.kind, group.angles, complex(self.offset(st)), complex(v), complex(u))

    def solve(self, st: State, sign: Number, size: float, folded: bool = False) -> None:
        """Write the group's rotations and slides into the state; `folded`: its two assemblies meet in every pose."""
        group = self.group
        kind: Kind = Folded(st.kind) if folded else st.kind
        w = self.offset(st)
        if st.many and isinstance(w, complex):
            # between points that stand: as in any array, what is divided by zero is infinite
            w = np.complex128(w)
        if group.kind == "RRR":
            a, b = group.angles
            st.turn[a], st.turn[b], margin = two_angles(w, self.arm(0, st), self.arm(1, st), sign, kind)
        elif group.kind == "RRP":
            (a,), (g,) = group.angles, group.slides
            z, body = self.rails[0]
            st.turn[a], st.slide[g], margin = angle_and_slide(
                w, self.arm(0, st), z * st.turn[body], sign, kind
            )
        elif group.kind == "RPR":
            (a,), (g,) = group.angles, group.slides
            st.turn[a], st.slide[g], margin = turning_slide(
                w, self.arm(0, st), self.rail(st), sign, size, kind
            )
        else:
            g, h = group.slides
            u, v = (z * st.turn[body] for z, body in self.rails)
            st.slide[g], st.slide[h], margin = two_slides(w, u, v)
        st.margin[group.name] = margin
        if folded:
            st.folded.add(group.name)
        for tie in group.ties:
            st.turn[tie.body] = st.rotate(tie.angle)


def columns(group: Group, st: State) -> list[list[Number]]:
    """The Jacobian of a group: for each loop, its complex column for each unknown (angles, then slides).

    A loop's derivative is Σ column·(unknown's derivative); the real and imaginary parts are its two equations.
    """
    rows = []
    for closure in group.closures:
        row: list[Number] = []
        for angle in group.angles:
            c: Number = None
            for t in closure.terms:
                r = ratio(group, t.body, angle)
                if r:
                    v = (1j * r * t.z) * st.turn[t.body]
                    c = plus(c, v if t.slide is None else v * st.slide[t.slide])
            row.append(0j if c is None else c)
        for g in group.slides:
            c = None
            for t in closure.terms:
                if t.slide == g:
                    c = plus(c, t.z * st.turn[t.body])
            row.append(0j if c is None else c)
        rows.append(row)
    return rows


def ratio(group: Group, body: str, angle: str) -> float:
    """∂θ_body/∂θ_angle inside a group."""
    if body == angle:
        return 1.0
    for tie in group.ties:
        if tie.body == body:
            return dict(tie.angle.bases).get(angle, 0.0)
    return 0.0
