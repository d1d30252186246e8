"""Running the list of steps: positions, and derivatives of any order along given inputs.

One pose runs on Python numbers, many on arrays; the steps do not know the difference. Derivatives follow Leibniz's
rule on e^{iθ}:  (e^{iθ})⁽ᵏ⁾ = i Σ_j C(k−1, j) θ⁽ʲ⁺¹⁾ (e^{iθ})⁽ᵏ⁻¹⁻ʲ⁾. The part of a loop's k-th derivative that holds
no unknown of order k is its right-hand side; the columns of the Jacobian are the same for every order. This is
the velocity (000 §1.4), acceleration (§1.5, with the Coriolis term 2ω·ṡ of §1.10) and jerk in one formula.
"""

from __future__ import annotations

from math import comb, cos, sin
from typing import TYPE_CHECKING, Any

import numpy as np

from virtualwork.assur import Angle, Closure, Group, Place, Plan, Slide, Step, Term, Turn
from virtualwork.describe.parts import GROUND
from virtualwork.formulas.closed_forms import (
    MANY,
    ONE,
    Number,
    angle_and_slide,
    cross,
    turning_slide,
    two_angles,
    two_slides,
)

if TYPE_CHECKING:
    from virtualwork.track import Track

BLOCK = 8192  # poses worked out together: their temporaries stay in the cache
SWEEP = 256  # from so many poses on, e^{iθ} of a uniform sweep is formed by angle addition


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
    """

    def __init__(self, inputs: list[Number], many: bool) -> None:
        self.inputs = inputs
        self.xp = MANY if many else ONE
        self.many = many
        self.turn: dict[str, Number] = {GROUND: 1.0}
        self.angle: dict[str, Number] = {GROUND: 0.0}
        self.point: dict[str | None, Number] = {None: 0j}
        self.slide: dict[int, Number] = {}
        self.margin: dict[str, Number] = {}
        self.spins: dict[int, Number] = {}  # e^{i·input}, where a sweep knows it already

    def spin(self, j: int) -> Number:
        """e^{i·input j}, formed once."""
        if j not in self.spins:
            self.spins[j] = self.exp(self.inputs[j])
        return self.spins[j]

    def exp(self, angle: Number) -> Number:
        """e^{i·angle}."""
        if self.many and np.ndim(angle):
            z = np.empty(np.shape(angle), complex)
            np.cos(angle, out=z.real)
            np.sin(angle, out=z.imag)
            return z
        return complex(cos(angle), sin(angle))

    def sum(self, terms: tuple[Term, ...]) -> Number:
        """Σ z·s·e^{iθ}."""
        total: Number = None
        for t in terms:
            v = t.z if t.body == GROUND else t.z * self.turn[t.body]
            if t.slide is not None:
                v = v * self.slide[t.slide]
            total = v if total is None else total + v
        return 0j if total is None else total

    def affine(self, angle: Angle) -> Number:
        """const + Σ k·input, the part of an angle that needs no other angle."""
        value: Number = angle.const or None
        for j, k in angle.inputs:
            value = _add(value, self.inputs[j] if k == 1.0 else k * self.inputs[j])
        return 0.0 if value is None else value

    def rotate(self, angle: Angle) -> Number:
        """e^{iθ} of an angle tied to others; whole-number ratios are powers, no angle is formed."""
        value: Number = None
        if len(angle.inputs) == 1 and angle.inputs[0][1] == 1.0:
            value = self.spin(angle.inputs[0][0])
            if angle.const:
                value = value * self.exp(angle.const)
        elif angle.inputs or angle.const:
            value = self.exp(self.affine(angle))
        for base, r in angle.bases:
            e = self.turn[base]
            if r == 1.0:
                factor = e
            elif r == -1.0:
                factor = e.conjugate()
            elif r.is_integer():
                factor = self.exp(r * np.angle(e))
            else:
                factor = self.exp(r * self.angle[base])
            value = factor if value is None else value * factor
        return 1.0 + 0j if value is None else value


def place(step: Place, st: State) -> None:
    """Work out one point."""
    v = st.sum(step.terms)
    st.point[step.node] = v if step.base is None else st.point[step.base] + v


def loop(closure: Closure, st: State, skip: tuple[str, ...] = (), slides: tuple[int, ...] = ()) -> Number:
    """The known part W of a loop: P[start] − P[end] and the terms that hold no unknown."""
    w = st.point[closure.start] - st.point[closure.end]
    known = tuple(t for t in closure.terms if t.body not in skip and t.slide not in slides)
    return w + st.sum(known) if known else w


class Case:
    """What a closed-form group needs, worked out once: its known terms, arms and rails.

    An arm is the vector that turns with an unknown angle; it is a constant unless an input stretches or bends it.
    """

    def __init__(self, group: Group, directions: dict[int, complex]) -> None:
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
        self.arms: list[complex | None] = []
        self.bent: list[list[tuple[Term, Angle]]] = []
        self.tie = tie
        for angle in group.angles:
            fixed, bent = 0j, []
            for t in closure.terms:
                if owner.get(t.body) == angle and t.slide not in group.slides:
                    relative = tie.get(t.body, Angle())
                    if t.slide is None and not relative.inputs:
                        fixed += t.z * complex(np.exp(1j * relative.const))
                    else:
                        bent.append((t, relative))
            self.arms.append(fixed)
            self.bent.append(bent)
        self.rails: list[tuple[complex, str]] = []
        for g in group.slides:
            rail = [t for t in closure.terms if t.slide == g]
            t = rail[0]
            relative = tie.get(t.body, Angle())
            turned = t.z * complex(np.exp(1j * relative.const)) if group.kind == "RPR" else t.z
            self.rails.append((turned, t.body))

    def arm(self, i: int, st: State) -> Number:
        """The arm of unknown angle i."""
        value: Number = self.arms[i]
        for t, relative in self.bent[i]:
            v = t.z
            if relative.inputs or relative.const:
                v = v * st.exp(st.affine(relative))
            if t.slide is not None:
                v = v * st.slide[t.slide]
            value = value + v
        return value

    def solve(self, st: State, sign: Number, size: float) -> None:
        """Write the group's rotations and slides into the state."""
        group = self.group
        w = st.point[self.closure.start] - st.point[self.closure.end]
        if self.known:
            w = w + st.sum(self.known)
        if st.many and isinstance(w, complex):
            w = np.complex128(
                w
            )  # between points that stand: as in any array, what is divided by zero is infinite
        if group.kind == "RRR":
            a, b = group.angles
            st.turn[a], st.turn[b], margin = two_angles(w, self.arm(0, st), self.arm(1, st), sign, st.xp)
        elif group.kind == "RRP":
            (a,), (g,) = group.angles, group.slides
            z, body = self.rails[0]
            st.turn[a], st.slide[g], margin = angle_and_slide(
                w, self.arm(0, st), z * st.turn[body], sign, st.xp
            )
        elif group.kind == "RPR":
            (a,), (g,) = group.angles, group.slides
            st.turn[a], st.slide[g], margin = turning_slide(
                w, self.arm(0, st), self.rails[0][0], sign, size, st.xp
            )
        else:
            g, h = group.slides
            u, v = (z * st.turn[body] for z, body in self.rails)
            st.slide[g], st.slide[h], margin = two_slides(w, u, v)
        st.margin[group.name] = margin
        for tie in group.ties:
            st.turn[tie.body] = st.rotate(tie.angle)


def columns(group: Group, st: State, plan: Plan) -> list[list[Number]]:
    """The Jacobian of a group: for each loop, its complex column for each unknown (angles, then slides).

    A loop's derivative is Σ column·(unknown's derivative); the real and imaginary parts are its two equations.
    """
    rows = []
    for closure in group.closures:
        row: list[Number] = []
        for angle in group.angles:
            c: Number = None
            for t in closure.terms:
                r = ratio(plan, group, t.body, angle)
                if r:
                    v = (1j * r * t.z) * st.turn[t.body]
                    c = _add(c, v if t.slide is None else v * st.slide[t.slide])
            row.append(0j if c is None else c)
        for g in group.slides:
            c = None
            for t in closure.terms:
                if t.slide == g:
                    c = _add(c, t.z * st.turn[t.body])
            row.append(0j if c is None else c)
        rows.append(row)
    return rows


def ratio(plan: Plan, group: Group, body: str, angle: str) -> float:
    """∂θ_body/∂θ_angle inside a group."""
    if body == angle:
        return 1.0
    for tie in group.ties:
        if tie.body == body:
            return dict(tie.angle.bases).get(angle, 0.0)
    return 0.0


class Jets:
    """Derivatives of every order along given input derivatives, over the poses of one `State`.

    Attributes
    ----------
    rates : list over inputs of [first, second, third ... derivative]
    angle : dict of body to [θ′, θ″, ...]
    point : dict of node to [P′, P″, ...]
    slide : dict of guide to [s′, s″, ...]

    A derivative that is identically zero is None, and costs nothing.
    """

    def __init__(self, plan: Plan, st: State, rates: list[list[Number]], track: Track | None = None) -> None:
        self.plan, self.st, self.rates, self.track = plan, st, rates, track
        self.angle: dict[str, list[Number]] = {GROUND: []}
        self.point: dict[str | None, list[Number]] = {None: []}
        self.slide: dict[int, list[Number]] = {}
        self._turn: dict[tuple[str, int], Number] = {}
        self._normal: dict[str, Number] = {}
        self._columns: dict[str, list[list[Number]]] = {}
        self._inverse: dict[str, Number] = {}

    def rate(self, j: int, k: int) -> Number:
        """The k-th derivative of input j."""
        return self.rates[j][k - 1] if k <= len(self.rates[j]) else None

    def turn_partial(self, body: str, k: int, top: Number) -> Number:
        """(e^{iθ})⁽ᵏ⁾ with θ⁽ᵏ⁾ replaced by `top`."""
        theta = self.angle[body]
        if k == 2 and theta[0] is not None:
            # the commonest case, (iα − ω²)·e^{iθ}, in one step; the right side of a group asks for its second part first
            if body not in self._normal:
                self._normal[body] = -(theta[0] * theta[0]) * self.st.turn[body]
            normal = self._normal[body]
            return normal if top is None else normal + 1j * (top * self.st.turn[body])
        total: Number = None
        for j in range(k - 1):
            if theta[j] is not None:
                total = _add(total, _scale(comb(k - 1, j), _scale(theta[j], self.turn(body, k - 1 - j))))
        if top is not None:
            total = _add(total, _scale(top, self.st.turn[body]))
        return None if total is None else 1j * total

    def turn(self, body: str, k: int) -> Number:
        """(e^{iθ})⁽ᵏ⁾."""
        if k == 0:
            return self.st.turn[body]
        if body == GROUND:
            return None
        if (body, k) not in self._turn:
            self._turn[body, k] = self.turn_partial(body, k, self.angle[body][k - 1])
        return self._turn[body, k]

    def vector(self, base: str | None, terms: tuple[Term, ...], k: int) -> Number:
        """The k-th derivative of P[base] + Σ terms."""
        v: Number = None if base is None else self.point[base][k - 1]
        for t in terms:
            v = _add(v, self._term(t, k))
        return v

    def slim(self) -> None:
        """Forget what is cheaper to form again than to keep over a long sweep."""
        self._turn, self._normal, self._columns, self._inverse = {}, {}, {}, {}

    def step(self, step: Step, k: int) -> None:
        """Carry one step on to derivatives of order k; the lower orders are known."""
        if isinstance(step, Turn):
            _put(self.angle, step.body, k, self._tied(step.angle, k))
        elif isinstance(step, Slide):
            _put(self.slide, step.guide, k, self.rate(step.input, k))
        elif isinstance(step, Place):
            _put(self.point, step.node, k, self.vector(step.base, step.terms, k))
        else:
            self._group(step, k)

    def _tied(self, angle: Angle, k: int, without: tuple[str, ...] = ()) -> Number:
        value: Number = None
        for j, f in angle.inputs:
            value = _add(value, _scale(f, self.rate(j, k)))
        for base, r in angle.bases:
            if base not in without:
                value = _add(value, _scale(r, self.angle[base][k - 1]))
        return value

    def _term(
        self, t: Term, k: int, tops: dict[str, Number] | None = None, unknown: tuple[int, ...] = ()
    ) -> Number:
        """(z·s·e^{iθ})⁽ᵏ⁾; `tops` stand for (e^{iθ})⁽ᵏ⁾, and an unknown slide's k-th derivative is left out."""
        highest = tops[t.body] if tops and t.body in tops else self.turn(t.body, k)
        if t.slide is None:
            return _scale(t.z, highest)
        s = self.slide.get(t.slide, [])
        total = None if highest is None else self.st.slide[t.slide] * highest
        for j in range(1, k + 1):
            if j == k and t.slide in unknown:
                break
            if s[j - 1] is not None:
                e = self.turn(t.body, k - j)
                if e is not None:
                    total = _add(total, _scale(comb(k, j), s[j - 1] * e))
        return _scale(t.z, total)

    def right_side(self, group: Group, k: int) -> list[Number]:
        """The k-th derivative of each loop with the unknowns' own k-th derivatives left out."""
        tops: dict[str, Number] = {}
        for body in group.angles:
            self.angle.setdefault(body, [])
            tops[body] = self.turn_partial(body, k, None)
        for tie in group.ties:
            self.angle.setdefault(tie.body, [])
            tops[tie.body] = self.turn_partial(tie.body, k, self._tied(tie.angle, k, group.angles))
        rows = []
        for closure in group.closures:
            w: Number = None
            if closure.start is not None:
                w = self.point[closure.start][k - 1]
            if closure.end is not None:
                w = _add(w, _scale(-1, self.point[closure.end][k - 1]))
            for t in closure.terms:
                w = _add(w, self._term(t, k, tops, group.slides))
            rows.append(0j if w is None else w)
        return rows

    def columns(self, group: Group) -> list[list[Number]]:
        """The group's Jacobian, formed once for all orders."""
        if group.name not in self._columns:
            self._columns[group.name] = columns(group, self.st, self.plan)
        return self._columns[group.name]

    def inverse(self, group: Group) -> Number:
        """1/(c1 × c2) of a closed form's two columns, formed once for all orders and the joint forces."""
        if group.name not in self._inverse:
            c1, c2 = self.columns(group)[0]
            self._inverse[group.name] = 1 / cross(c1, c2)
        return self._inverse[group.name]

    def _group(self, group: Group, k: int) -> None:
        right = self.right_side(group, k)
        cols = self.columns(group)
        if group.kind != "Newton":
            (c1, c2), w = cols[0], right[0]
            inverse = self.inverse(group)
            x: list[Number] = [cross(c2, w) * inverse, cross(w, c1) * inverse]
        else:
            from virtualwork.newton import singular_poses, solve_columns

            x = solve_columns(cols, right)
            if self.track is not None:
                bad = singular_poses(cols, len(group.angles), np.size(self.st.inputs[0]))
                if bad.any():
                    x = self.track.bridge_rates(group, self.st.inputs[0], k, x, bad)
        if self.track is not None and self.track.changes:
            x = self.track.mend_rates(group, self.st.inputs[0], k, x)
        self.write(group, k, x)

    def write(self, group: Group, k: int, x: list[Number]) -> None:
        """Store the unknowns' k-th derivatives and those of the angles tied to them."""
        n = len(group.angles)
        for body in group.members:
            for j in [j for known, j in self._turn if known == body and j >= k]:
                del self._turn[body, j]
            if k == 1:
                self._normal.pop(body, None)
        for body, value in zip(group.angles, x[:n], strict=True):
            _put(self.angle, body, k, value)
        for g, value in zip(group.slides, x[n:], strict=True):
            _put(self.slide, g, k, value)
        for tie in group.ties:
            _put(self.angle, tie.body, k, self._tied(tie.angle, k))


def _add(a: Number, b: Number) -> Number:
    return b if a is None else a if b is None else a + b


def _scale(f: Number, a: Number) -> Number:
    if a is None:
        return None
    return a if isinstance(f, (int, float)) and f == 1 else f * a


def _put(store: dict[Any, list[Number]], key: Any, k: int, value: Number) -> None:
    series = store.setdefault(key, [])
    del series[k - 1 :]
    series.append(value)
