"""Motion of an assembly over its inputs: each quantity is solved when first asked for, and never twice.

Poses run in blocks small enough to stay in cache; a block keeps what it has solved. With one input, derivatives are
taken once with respect to the input (the velocity coefficients K = dx/dq, L = d²x/dq², M = d³x/dq³), so that
ẋ = K·q̇,  ẍ = K·q̈ + L·q̇²,  x⃛ = K·q⃛ + 3L·q̇·q̈ + M·q̇³.  With several inputs they are taken along the inputs' rates.

What virtual work stands on (the plane as complex numbers, arrays over the n poses)
----------------------------------------------------------------------------------
- `motion.at(link, z).complex(k)`: any point of a link (z in its axes), k = 0 position ... 3 jerk; `motion.link(...)`
  `.omega`, `.alpha`; `motion.angle(link)`.
- Virtual displacements: `motion.at(link, z).coefficient(j)` is dP/dq_j, `motion.link(name).coefficient(j)` dθ/dq_j,
  `motion.slide_coefficient(guide, j)` ds/dq_j. Second order (one input): `point_coefficient(..., order=2)`,
  `angle_coefficient(..., order=2)`. A force F at P does the virtual work Re(conj(F)·dP/dq_j).
- Reactions: `motion.assembly.plan.groups` are the Assur groups in their order of solution. Each `Group` has `links`,
  its unknown `angles` and `slides`, and its `closures`; a `Closure` is a loop cut at `joint` on link `body` (guide:
  `guide`), whose `terms` say which links the loop runs through. `motion.columns(group)[loop][unknown]` is the complex
  column of the Jacobian for that loop and unknown (angles first, then slides): the force λ_l at cut l enters the
  equation of unknown u with Re(conj(λ_l)·column), so the multipliers solve the transposed system, groups in reverse
  order. `plan.anchors[body] = (node, terms)` says from which point each body hangs in the tree.
- `motion.assembled` masks poses; a singular pose shows in `assembly.track.limits()` and `.flips` (change points).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from copy import copy
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from virtualwork.assur import Group, Step, Term
from virtualwork.describe.errors import DescriptionError
from virtualwork.describe.parts import GROUND, Point, as_point
from virtualwork.formulas.closed_forms import Number
from virtualwork.newton import inverse_norm, stack
from virtualwork.state import BLOCK, SWEEP, Jets, State, columns

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from virtualwork.assembly import Assembly
    from virtualwork.bounds.motion import Rounding
    from virtualwork.formulas.dynamics import Dynamics

    Reals = NDArray[np.float64]
    Complexes = NDArray[np.complex128]


class PointMotion:
    """Motion of one point of a link.

    Attributes
    ----------
    position, velocity, acceleration, jerk : array (n, 2)
        m, m/s, m/s², m/s³, in ground axes; NaN where the pose cannot be assembled.
    """

    def __init__(self, motion: Motion, body: str, z: complex, node: str | None = None) -> None:
        self._motion, self._body, self._z, self._node = motion, body, z, node

    @property
    def position(self) -> Reals:
        """(n, 2) m."""
        return _pairs(self.complex(0))

    @property
    def velocity(self) -> Reals:
        """(n, 2) m/s (000 eq. 1.4.1)."""
        return _pairs(self.complex(1))

    @property
    def acceleration(self) -> Reals:
        """(n, 2) m/s² (000 eq. 1.5.1)."""
        return _pairs(self.complex(2))

    @property
    def jerk(self) -> Reals:
        """(n, 2) m/s³ (000 eq. 1.5.3)."""
        return _pairs(self.complex(3))

    def complex(self, order: int) -> Complexes:
        """The order-th time derivative as x + iy, (n,)."""
        return self._motion.point_derivative(self._body, self._z, order, self._node)

    def error_estimate(self, order: int = 0) -> Reals:
        """Return a bound (n,) of the rounding error of the position (order 0), velocity (1), acceleration (2) or jerk.

        It is the length of the error, in the unit of the quantity; the dimensions and the input are taken as exact.
        Infinite where no digit is known, within rounding of a limit of the input. See `virtualwork.bounds.motion`.

        Examples
        --------
        A crank of length 1 at 60°: y = √3/2.

        >>> from virtualwork import Input, Link, Mechanism
        >>> crank = Mechanism({"O": 0j}, {"crank": Link({"O": 0j, "P": 1})}, inputs=Input(link="crank"))
        >>> point = crank.motion(np.pi / 3).point("P")
        >>> bool(abs(point.position[0, 1] - np.sqrt(0.75)) <= point.error_estimate()[0] < 1e-15)
        True
        """
        return self._motion.rounding.point(self._body, self._z, self._node, order)

    def coefficient(self, j: int = 0) -> Complexes:
        """The velocity coefficient dP/dq_j as x + iy, (n,): the point's virtual displacement for a unit of input j."""
        return self._motion.point_coefficient(self._body, self._z, j, self._node)


class LinkMotion:
    """Motion of one link.

    Attributes
    ----------
    angle : array (n,)
        rad, of the link's own x-axis, in (−π, π].
    omega, alpha, jerk : array (n,)
        rad/s, rad/s², rad/s³.
    """

    def __init__(self, motion: Motion, body: str) -> None:
        self._motion, self._body = motion, body

    @property
    def angle(self) -> Reals:
        """(n,) rad."""
        return self._motion.angle(self._body)

    @property
    def omega(self) -> Reals:
        """(n,) rad/s (000 eq. 1.4.2)."""
        return self._motion.angle_derivative(self._body, 1)

    @property
    def alpha(self) -> Reals:
        """(n,) rad/s² (000 eq. 1.5.2)."""
        return self._motion.angle_derivative(self._body, 2)

    @property
    def jerk(self) -> Reals:
        """(n,) rad/s³ (000 eq. 1.5.3)."""
        return self._motion.angle_derivative(self._body, 3)

    def error_estimate(self, order: int = 0) -> Reals:
        """Return a bound (n,) of the rounding error of the angle (order 0, rad), ω (1), α (2) or the angular jerk (3).

        The dimensions and the input are taken as exact. See `virtualwork.bounds.motion`.
        """
        return self._motion.rounding.angle(self._body, order)

    def coefficient(self, j: int = 0) -> Reals:
        """The velocity coefficient dθ/dq_j, (n,): the link's virtual rotation for a unit of input j."""
        return self._motion.angle_coefficient(self._body, j)


class SlideMotion:
    """Motion along one guide: `position`, `speed`, `acceleration`, `jerk`, each (n,), m from the guide's `through`."""

    def __init__(self, motion: Motion, guide: int) -> None:
        self._motion, self._guide = motion, guide

    @property
    def position(self) -> Reals:
        """(n,) m."""
        return self._motion.slide_derivative(self._guide, 0)

    @property
    def speed(self) -> Reals:
        """(n,) m/s."""
        return self._motion.slide_derivative(self._guide, 1)

    @property
    def acceleration(self) -> Reals:
        """(n,) m/s²."""
        return self._motion.slide_derivative(self._guide, 2)

    @property
    def jerk(self) -> Reals:
        """(n,) m/s³."""
        return self._motion.slide_derivative(self._guide, 3)

    def error_estimate(self, order: int = 0) -> Reals:
        """Return a bound (n,) of the rounding error of the slide (order 0, m), its speed (1), acceleration (2) or jerk (3).

        The dimensions and the input are taken as exact. See `virtualwork.bounds.motion`.
        """
        return self._motion.rounding.slide(self._guide, order)


class Motion:
    """Position, velocity, acceleration and jerk over given inputs, on demand.

    `Mechanism.motion` makes one. See there for the parameters.

    Attributes
    ----------
    inputs : array (n, k)
    input_error : float or array (n, k)
        Bound of the inputs' own errors, for the estimates of rounding errors: 0 where they are exact as given.
    solved : list of (step, order)
        What has been worked out so far; order 0 is position.
    """

    def __init__(
        self,
        assembly: Assembly,
        angle: ArrayLike | None = None,
        speed: ArrayLike | None = None,
        acceleration: ArrayLike | None = None,
        jerk: ArrayLike | None = None,
    ) -> None:
        self.assembly = assembly
        self.mechanism = m = assembly.mechanism
        k = len(m.inputs)
        if angle is None:
            given = [e.value for e in m.inputs]
            angle = [a if v is None else v for v, a in zip(given, m.at, strict=True)]
            angle = angle if k == 1 else [angle]
        q = np.asarray(angle, dtype=float)
        if k == 1:
            q = q.reshape(-1, 1)
        elif q.ndim == 1 and q.shape == (k,):
            q = q.reshape(1, k)
        elif q.ndim != 2 or q.shape[1] != k:
            raise ValueError(f"angle: expected shape (n, {k}) for {k} inputs, found {q.shape}")
        self.inputs = q
        self.n = len(q)
        self._rates = [
            self._given(value, [getattr(e, name) for e in m.inputs])
            for name, value in (("speed", speed), ("acceleration", acceleration), ("jerk", jerk))
        ]
        self.input_error: ArrayLike = 0.0
        self.solved: list[tuple[Step, int]] = []
        self._done: set[tuple[int, int, int]] = set()
        self._blocks: list[State] | None = None
        self._jets: dict[int, list[Jets]] = {}

    def _given(self, value: ArrayLike | None, own: list[float | None]) -> list[Number]:
        """One rate of the inputs, a scalar or (n,) array for each input."""
        k = len(own)
        if value is None:
            return [v or 0.0 for v in own]
        v = np.asarray(value, dtype=float)
        if v.ndim == 0:
            return [float(v)] * k
        if k == 1:
            v = v.reshape(-1)
            return [float(v[0])] if len(v) == 1 else [v]
        v = np.broadcast_to(v, (self.n, k)) if v.ndim == 1 else v
        return [v[:, j] for j in range(k)]

    # --- what a user asks -------------------------------------------------------------------------------------
    def point(self, name: str) -> PointMotion:
        """Motion of a named point.

        Raises
        ------
        DescriptionError
            Where no body has a point of that name.
        """
        for body, points in self.mechanism.bodies.items():
            if name in points:
                return PointMotion(self, body, points[name], name)
        raise DescriptionError(f"no point is named '{name}'")

    def at(self, link: str, point: Point | str) -> PointMotion:
        """Motion of any point of a link: a name, or coordinates in the link's own axes."""
        if isinstance(point, str):
            return PointMotion(self, link, self.mechanism.bodies[link][point], point)
        return PointMotion(self, link, as_point(point))

    def link(self, name: str) -> LinkMotion:
        """Motion of a link.

        Raises
        ------
        DescriptionError
            Where there is no link of that name.
        """
        if name not in self.mechanism.links:
            raise DescriptionError(f"no link is named '{name}'")
        return LinkMotion(self, name)

    def slide(self, name: str) -> SlideMotion:
        """Motion along the guide in which the named point runs."""
        for i, guide in enumerate(self.mechanism.guides):
            if guide.point == name:
                return SlideMotion(self, i)
        raise DescriptionError(f"no slot or slider runs at a point named '{name}'")

    @cached_property
    def assembled(self) -> NDArray[np.bool_]:
        """(n,) bool: which poses can be assembled."""
        targets = [key for g in self.assembly.plan.groups for key in self.assembly.plan.writes(g)]
        self._solve(targets, 0)
        whole = np.ones(self.n, dtype=bool)
        for rows, st in self._rows():
            for g in self.assembly.plan.groups:
                for value in (*(st.turn[body] for body in g.angles), *(st.slide[s] for s in g.slides)):
                    # the sum of squares is finite where all of them are; else each is looked at
                    if not np.isfinite(np.vdot(value, value)):
                        whole[rows] &= np.isfinite(value)
        return np.asarray(whole & np.isfinite(self.inputs).all(axis=1))

    # --- forces -----------------------------------------------------------------------------------------------
    @cached_property
    def dynamics(self) -> Dynamics:
        """All forces of this motion, each formed when first asked for."""
        from virtualwork.formulas.dynamics import Dynamics

        self._states()
        # the forces hold this motion's solution and not the motion, which holds them: in a ring of references the
        # arrays of every motion would wait for the garbage collector
        return Dynamics(copy(self))

    @property
    def effort(self) -> Reals:
        """The effort at the input by virtual work, (n,) N·m (N at a slide); (n, k) for k inputs.

        Static where speed and acceleration are zero (Riul, unit II, eq. 3), else with inertia loads (eq. 5).
        """
        found = self.dynamics.effort
        return found[:, 0] if len(self.mechanism.inputs) == 1 else found

    def reaction(self, joint: str, on: str) -> Reals:
        """The force of all others on a link at a joint, (n, 2) N (000 §2.2).

        Parameters
        ----------
        joint : str
            The name of a pin, or of the point of a slot or slider.
        on : str
            A link that the joint holds.
        """
        return self.dynamics.reaction(joint, on)

    @property
    def condition(self) -> Reals:
        """(n,): ‖J⁻¹‖∞ of the constraint Jacobian of all loops, lengths divided by the mechanism's size.

        A relative error ε in the lengths or the input moves the pose by some ε·condition.
        """
        merged, group = self.assembly.merged
        if group is None:
            return np.where(self.assembled, 1.0, np.nan)
        plan = self.assembly.plan
        self._solve([key for s in plan.steps for key in plan.writes(s)], 0)
        size = self.mechanism.size
        whole = np.empty(self.n)
        for rows, st in self._rows():
            length = rows.stop - rows.start
            with np.errstate(all="ignore"):
                jacobian = stack(columns(group, st, merged), length)
                jacobian[:, :, : len(group.angles)] /= size
                whole[rows] = inverse_norm(jacobian)
        return whole

    @cached_property
    def rounding(self) -> Rounding:
        """Bounds of the rounding errors of this motion, each formed when first asked for."""
        from virtualwork.bounds.motion import Rounding

        return Rounding(self)

    # --- solving ----------------------------------------------------------------------------------------------
    def _states(self) -> list[State]:
        """The blocks of poses."""
        if self._blocks is None:
            m = self.assembly.mechanism
            k = len(m.inputs)
            if k == 1 and self.n:
                q = self.inputs[:, 0]
                self.assembly.track.cover(float(q.min()), float(q.max()))
            if self.n == 1:
                self._blocks = [State([float(v) for v in self.inputs[0]], many=False)]
            else:
                self._blocks = [
                    State([self.inputs[i : i + BLOCK, j] for j in range(k)], many=True)
                    for i in range(0, self.n, BLOCK)
                ]
                if k == 1 and self.n > SWEEP:
                    _uniform(self.inputs[:, 0], self._blocks)
        return self._blocks

    def _rows(self) -> Iterable[tuple[slice, State]]:
        for i, st in enumerate(self._states()):
            yield slice(i * BLOCK, min((i + 1) * BLOCK, self.n)), st

    def _solve(
        self,
        targets: Iterable[str],
        order: int,
        which: int = -1,
        then: Callable[[int], None] | None = None,
    ) -> list[Jets]:
        """Work out the targets' derivatives up to an order; `which`: along the motion (−1), or for input j alone.

        `then` is called with each block's number while the block is still in cache, and what it forms is forgotten.
        """
        steps = self.assembly.needed(targets)
        missing: list[tuple[int, list[Step]]] = []
        for k in range(order + 1):
            key = which if k else -2
            new = [s for s in steps if (id(s), k, key) not in self._done]
            if new:
                missing.append((k, new))
                self._done.update((id(s), k, key) for s in new)
                self.solved += [(s, k) for s in new]
        if not missing and then is None:
            return self._jets.get(which, [])
        states = self._states()
        if order and which not in self._jets:
            self._jets[which] = [self._jet(st, i, which) for i, st in enumerate(states)]
        many = len(states) > 1
        with np.errstate(all="ignore"):
            for i, st in enumerate(states):
                try:
                    self._advance(i, which, missing)
                except (ZeroDivisionError, OverflowError):  # one pose on Python numbers at a singular place
                    states[i] = State([np.array([q]) for q in st.inputs], many=True)
                    self._jets.update(
                        {w: [self._jet(s, b, w) for b, s in enumerate(states)] for w in self._jets}
                    )
                    for step, k in self.solved:
                        for w in list(self._jets) if k else [-2]:
                            if (id(step), k, w) in self._done:
                                self._advance(i, w, [(k, [step])])
                if then is not None:
                    then(i)
                if many and order:
                    self._jets[which][i].slim()
        return self._jets.get(which, [])

    def _advance(self, i: int, which: int, missing: list[tuple[int, list[Step]]]) -> None:
        assert self._blocks is not None
        for k, steps in missing:
            if k == 0:
                self.assembly.run(steps, self._blocks[i])
            else:
                jets = self._jets[which][i]
                for s in steps:
                    jets.step(s, k)

    def _jet(self, st: State, block: int, which: int) -> Jets:
        k = len(self.mechanism.inputs)
        track = self.assembly.track
        if k == 1:
            return Jets(self.assembly.plan, st, [[1.0]], track)
        if which >= 0:
            return Jets(self.assembly.plan, st, [[1.0] if j == which else [] for j in range(k)], None)
        rows = slice(block * BLOCK, (block + 1) * BLOCK)
        rates = []
        for j in range(k):
            series: list[Number] = []
            for rate in self._rates:
                v = rate[j]
                if isinstance(v, float):
                    series.append(v or None)
                else:
                    series.append(v[rows] if st.many else float(v[0]))
            rates.append(series)
        return Jets(self.assembly.plan, st, rates, None)

    def _join(self, parts: list[Number], kind: type) -> Any:
        """The blocks' values as one array (n,)."""
        if len(parts) == 1:
            value: Any = np.asarray(parts[0], dtype=kind)
            return value.copy() if value.shape == (self.n,) else np.full(self.n, value)
        states = self._states()
        return np.concatenate(
            [
                np.broadcast_to(np.asarray(p, dtype=kind), np.shape(st.inputs[0]))
                for p, st in zip(parts, states, strict=True)
            ]
        )

    def _of_rates(self, order: int, get: Any, kind: type) -> Any:
        """Chain rule from derivatives with respect to the one input to derivatives in time."""
        one = len(self.mechanism.inputs) == 1
        if not one:
            return self._join([_none(get(i, order), st) for i, st in enumerate(self._states())], kind)
        v, a, j = (rate[0] for rate in self._rates)
        parts = []
        for rows, st, i in ((r, s, i) for i, (r, s) in enumerate(self._rows())):
            q1, q2, q3 = (
                x if isinstance(x, float) else (x[rows] if st.many else float(x[0])) for x in (v, a, j)
            )
            total: Number = None
            if order == 1:
                total = _weigh(get(i, 1), q1)
            elif order == 2:
                total = _plus(_weigh(get(i, 2), q1 * q1), _weigh(get(i, 1), q2))
            else:
                total = _plus(_weigh(get(i, 3), q1 * q1 * q1), _weigh(get(i, 2), 3 * q1 * q2))
                total = _plus(total, _weigh(get(i, 1), q3))
            parts.append(_none(total, st))
        return self._join(parts, kind)

    # --- quantities -------------------------------------------------------------------------------------------
    def angle(self, body: str) -> Reals:
        """A link's angle, (n,) rad."""
        self._solve((f"angle:{body}",), 0)
        return np.asarray(self._join([np.angle(st.turn[body]) for st in self._states()], float))

    def angle_derivative(self, body: str, order: int) -> Reals:
        """A link's ω, α or angular jerk, (n,)."""
        if body == GROUND:
            return np.zeros(self.n)
        jets = self._solve((f"angle:{body}",), order)
        return np.asarray(self._of_rates(order, lambda i, k: jets[i].angle[body][k - 1], float))

    def angle_coefficient(self, body: str, j: int = 0, order: int = 1) -> Reals:
        """dθ/dq_j, (n,); order 2: d²θ/dq_j²."""
        if body == GROUND:
            return np.zeros(self.n)
        which = -1 if len(self.mechanism.inputs) == 1 else j
        jets = self._solve((f"angle:{body}",), order, which)
        return np.asarray(
            self._join(
                [_none(jets[i].angle[body][order - 1], st) for i, st in enumerate(self._states())], float
            )
        )

    def _reads(
        self, body: str, z: complex, node: str | None
    ) -> tuple[tuple[str, ...], str | None, tuple[Term, ...]]:
        if node is not None:
            return (f"point:{node}",), node, ()
        base, terms = self.assembly.plan.anchors[body]
        whole = (*terms, Term(z, body))
        keys = {f"angle:{t.body}" for t in whole if t.body != GROUND}
        keys |= {f"slide:{t.slide}" for t in whole if t.slide is not None}
        if base is not None:
            keys.add(f"point:{base}")
        return tuple(sorted(keys)), base, whole

    def point_derivative(self, body: str, z: complex, order: int, node: str | None = None) -> Complexes:
        """Position (order 0) or a time derivative of any point of a body, x + iy, (n,)."""
        keys, base, terms = self._reads(body, z, node)
        jets = self._solve(keys, order)
        if order == 0:
            parts = [st.point[base] + st.sum(terms) if terms else st.point[base] for st in self._states()]
            return np.asarray(self._join(parts, complex))
        return np.asarray(self._of_rates(order, lambda i, k: jets[i].vector(base, terms, k), complex))

    def point_coefficient(
        self, body: str, z: complex, j: int = 0, node: str | None = None, order: int = 1
    ) -> Complexes:
        """dP/dq_j of any point of a body, x + iy, (n,); order 2: d²P/dq_j²."""
        keys, base, terms = self._reads(body, z, node)
        which = -1 if len(self.mechanism.inputs) == 1 else j
        jets = self._solve(keys, order, which)
        return np.asarray(
            self._join(
                [_none(jets[i].vector(base, terms, order), st) for i, st in enumerate(self._states())],
                complex,
            )
        )

    def slide_derivative(self, guide: int, order: int) -> Reals:
        """A slide or its time derivative, (n,)."""
        jets = self._solve((f"slide:{guide}",), order)
        if order == 0:
            return np.asarray(self._join([st.slide[guide] for st in self._states()], float))
        return np.asarray(self._of_rates(order, lambda i, k: jets[i].slide[guide][k - 1], float))

    def slide_coefficient(self, guide: int, j: int = 0) -> Reals:
        """ds/dq_j, (n,)."""
        which = -1 if len(self.mechanism.inputs) == 1 else j
        jets = self._solve((f"slide:{guide}",), 1, which)
        return np.asarray(
            self._join([_none(jets[i].slide[guide][0], st) for i, st in enumerate(self._states())], float)
        )

    def columns(self, group: Group) -> list[list[Complexes]]:
        """The Jacobian of one Assur group: for each of its loops, the column of each of its unknowns, (n,) complex."""
        plan = self.assembly.plan
        self._solve([*plan.writes(group), *plan.reads(group)], 1)
        jets = self._jets[-1]
        blocks = [d.columns(group) for d in jets]
        return [
            [self._join([b[i][j] for b in blocks], complex) for j in range(len(blocks[0][i]))]
            for i in range(len(group.closures))
        ]


def _uniform(q: Reals, blocks: list[State]) -> None:
    """Give the blocks of a uniform sweep e^{iq} by angle addition: e^{i(q0 + jh)} = e^{iq0}·e^{ijh}.

    Each factor is rounded once and the product twice, whatever the length of the sweep; the sweep's own rounding,
    the difference between q and q0 + jh, is put back to first order, which is exact here.
    """
    n = len(q)
    h = (q[-1] - q[0]) / (n - 1)
    top = max(abs(q[0]), abs(q[-1]))
    size = min(n, BLOCK)
    ramp = h * np.arange(size)
    offs = []
    with np.errstate(invalid="ignore"):
        for i, st in enumerate(blocks):
            off = (st.inputs[0] - q[i * BLOCK]) - ramp[: len(st.inputs[0])]
            bound = 64 * np.finfo(float).eps * max(top, 1e-3)
            if not (off.max() <= bound and off.min() >= -bound):
                return
            offs.append(off)
    table = np.empty(size, complex)
    np.cos(ramp, out=table.real)
    np.sin(ramp, out=table.imag)
    for i, (st, off) in enumerate(zip(blocks, offs, strict=True)):
        length = len(off)
        e = table[:length] * complex(np.cos(q[i * BLOCK]), np.sin(q[i * BLOCK]))
        turn = np.empty(length, complex)
        turn.real = 1.0
        turn.imag = off
        e *= turn
        st.spins[0] = e


def _pairs(z: Complexes) -> Reals:
    """x + iy as rows (x, y), without a copy."""
    return np.ascontiguousarray(z).view(float).reshape(-1, 2)


def _weigh(value: Number, factor: Number) -> Number:
    if value is None or (isinstance(factor, float) and factor == 0.0):
        return None
    return value if isinstance(factor, float) and factor == 1.0 else value * factor


def _plus(a: Number, b: Number) -> Number:
    return b if a is None else a if b is None else a + b


def _none(value: Number, st: State) -> Number:
    return 0.0 if value is None else value
