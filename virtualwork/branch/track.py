"""Along the input: change points, limits, and the branch between them.

A closed form's Jacobian is ± the root of its radicand. Where the radicand touches zero without crossing it, two
branches meet (a change point: the parallelogram at 0° and 180°, the folded kite); turning steadily through it, the
Jacobian changes its sign. Where the radicand crosses zero the input can go no further (a limit). Both are found
once, by sampling a turn of the input as finely as what moves asks for (`sampling`), and then to full precision. A
pose's branch follows from the number of change points between the guess and it: nothing is marched in angle.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from dalembert.arithmetic.guard import alone
from virtualwork.branch.choice import Choice
from virtualwork.branch.noted import NOWHERE, SAME, Bracket, Noted, Seen, divides
from virtualwork.branch.pace import Pace
from virtualwork.branch.sampling import (
    DIP,
    FINE,
    depths,
    hardly_moves,
    loop_rows,
    moves_far,
    parts,
    refined,
    touched,
    turns_far,
    vanishes,
)
from virtualwork.describe import MechanismError
from virtualwork.formulas.numbers import Complexes, Number, Reals
from virtualwork.formulas.positions import NONE, Samples, State, follow, run, whole
from virtualwork.plan.steps import Group, Step, turns

if TYPE_CHECKING:
    # a mechanism that passes no change point, and whose groups all have a closed form, loads neither
    from virtualwork.branch.continuation import Continuation

# of one turn, or of one mechanism's size of slide
SAMPLES = 720
# what it is below this share of where nothing is special is zero but for rounding
STRETCHED = 1e-14
# states by their inputs, each with the steps that were run there
Looked = dict[bytes, tuple[State, set[int]]]


class Track:
    """What happens to an assembly along its one input."""

    def __init__(self, assembly: Choice) -> None:
        self.assembly, self.lock = assembly, assembly.lock
        m = assembly.mechanism
        self.plan = assembly.plan
        self.active = len(m.inputs) == 1
        self.start = m.at[0]
        self.low = self.high = self.start
        self.slides = m.inputs[0].is_slide
        self.pace = Pace(assembly)
        self.length = self.pace.length
        self.noted = Noted(self, self.pace)
        self.flips, self.changes, self.brackets = self.noted.flips, self.noted.changes, self.noted.brackets
        self.continuations: dict[str, Continuation] = {}
        # of bodies of which a gear of fractional ratio needs the angle itself
        self._samples: dict[str, Samples] = {}
        # one turn says it all where every turn of a body is a whole number of turns of the input
        angles = [t.angle for t in turns(self.plan.steps)]
        factors = [k for angle in angles for _, k in (*angle.inputs, *angle.turning)]
        runs = any(t.slides and t.angle.runs for t in turns(self.plan.steps))
        self.whole = not (self.slides or runs) and all(float(k).is_integer() for k in factors)
        self.repeats = self.whole and all(g.kind != "Newton" for g in self.plan.groups)
        # no body turns with one of a loop, or with a slide's line, any faster than the input
        follows = not all(angle.by_inputs for angle in angles) or any(
            g.kind == "RPR" for g in self.plan.groups
        )
        self.even = not follows and all(abs(k) <= 1 for k in factors)
        # no change point anywhere, however far the input turns: without a loop there is none
        self.settled = not self.plan.groups
        # groups that are singular in every pose
        self.folded: set[str] = set()
        if not self.active:
            for name in assembly.singular_around(self.length):
                self._fold(name)

    # --- what poses ask ---------------------------------------------------------------------------------------
    def run(self, steps: Iterable[Step], st: State) -> None:
        """Work out positions, step by step, each group on its branch."""
        run(steps, st, self.close, self.assembly.plain)

    def pose(self, steps: Iterable[Step], inputs: Sequence[float], singular: bool = False) -> State:
        """What steps make of one pose, as Python numbers; as arrays (1,) at a singular place, where Python divides by zero."""
        st = State([np.array([q]) for q in inputs]) if singular else State(list(inputs))
        try:
            with np.errstate(all="ignore"):
                self.run(steps, st)
        except (ZeroDivisionError, OverflowError):
            return self.pose(steps, inputs, singular=True)
        return st

    def close(self, group: Group, st: State) -> None:
        """Close the loops of one group."""
        if group.kind == "Newton":
            self._close_newton(group, st)
            return
        case, size = self.assembly.case(group), self.assembly.mechanism.size
        if group.name in self.flips and group.name not in self.folded:
            from virtualwork.branch.change_point import mend

            case.solve(st, self.sign(group.name, st.inputs[0]), size)
            if group.name in self.changes:
                mend(self.changes[group.name], group, st)
        else:
            case.solve(st, None if group.name in self.folded else self.assembly.signs[group.name], size)
        bodies = self.assembly.geared.intersection(group.members)
        if bodies and not self.active:
            from virtualwork.branch.lines import wind_along_lines

            wind_along_lines(self, group, st, bodies)
            return
        for body in bodies:
            turns = whole(self._samples.get(body, NONE), st.inputs[0], np.angle(st.turn[body]))
            st.angle[body] = turns if np.ndim(st.inputs[0]) else float(turns)

    @alone
    def cover(self, low: float, high: float) -> None:
        """Look for change points and limits over the inputs from low to high."""
        if self.settled or not self.active:
            return
        if not (np.isfinite(low) and np.isfinite(high)):
            return
        low, high = min(low, self.start), max(high, self.start)
        first = self.low == self.high
        if first and low == high:
            high = low + 1e-3 * self.length
        if max(self.high - low, high - self.low) > 20000 * self.length:
            raise MechanismError(
                f"the input is {abs(high - low) / self.length:.3g} turns away from the guess: give an `at` nearer to it"
            )
        with np.errstate(all="ignore"):
            while self.high < high:
                self._go_on(1, high - self.high)
                if first and self._seen_all():
                    return
                first = False
            while self.low > low:
                self._go_on(-1, self.low - low)
                if first and self._seen_all():
                    return
                first = False
            self._look_back(low, high)

    def _go_on(self, side: int, way: float = 0.0) -> None:
        """Look through one turn more, or copy all the turns of a way where every group repeats itself."""
        loops = [g for g in self.plan.groups if g.kind != "PRP"]
        repeats = all(g.name in self.noted.seen for g in loops)
        more = self.length * (max(1, int(np.ceil(way / self.length))) if repeats else 1)
        a = self.high if side > 0 else self.low - more
        self.low, self.high = min(self.low, a), max(self.high, a + more)
        if not repeats:
            self._scan(a, a + more)
        else:
            for group in loops:
                self.noted.take_over(group, a, a + more)

    def _look_back(self, low: float, high: float) -> None:
        """Beyond an end of a group without a closed form it may stand as a turn before: then its other end matters too."""
        for way in list(self.continuations.values()) if self.whole else ():
            while (
                way.stopped[1]
                and not way.stopped[-1]
                and way.end(1) < high
                and self.low > way.end(1) - self.length
            ):
                self._go_on(-1)
            while (
                way.stopped[-1]
                and not way.stopped[1]
                and way.end(-1) > low
                and self.high < way.end(-1) + self.length
            ):
                self._go_on(1)

    def _seen_all(self) -> bool:
        """Whether the one turn looked through says it all, or that it repeats."""
        self.settled = self.repeats and not any(len(f) for f in self.flips.values())
        return self.settled

    @property
    def comes_back(self) -> bool:
        """Whether a turn brings every group back to where it stood, as far as was looked through."""
        return all(
            g.kind == "PRP"
            or (g.name in self.noted.seen and divides(self.noted.seen[g.name].period, self.length))
            for g in self.plan.groups
        )

    def sign(self, group: str, q: Number) -> Number:
        """The sign of a closed form's Jacobian at inputs q."""
        base = self.assembly.signs[group]
        flips = self.flips.get(group)
        if flips is None or not len(flips):
            return base
        passed = np.searchsorted(flips, q, "right") - np.searchsorted(flips, self.start, "right")
        return base * (1 - 2 * (passed & 1))

    def mend_rates(self, group: Group, q: Number, k: int, x: list[Number]) -> list[Number]:
        """The k-th derivatives of a group's unknowns with those close to a change point replaced by the series through it."""
        from virtualwork.branch.change_point import mend_rates

        return mend_rates(self.changes[group.name], q, k, x) if group.name in self.changes else x

    def bridge_rates(self, group: Group, q: Number, k: int, x: list[Number], singular: Any) -> list[Number]:
        """Derivatives of a Newton group at poses where its Jacobian is singular though the branch goes on."""
        if self.active and group.name in self.continuations:
            self.continuations[group.name].bridge_rates(q, k, x, singular)
        return x

    def _fold(self, name: str) -> None:
        """Note a group that is singular in every pose."""
        self.folded.add(name)
        self.assembly.plain.pop(name, None)

    def warnings(self) -> tuple[str, ...]:
        """The assembly's warnings, and the groups that are singular in every pose in what was covered."""
        result = []
        for g in self.plan.groups:
            if g.name in self.folded:
                guides = self.assembly.mechanism.guides
                what = ", ".join([*g.members, *(f"the slide at {guides[s].point}" for s in g.slides)])
                result.append(
                    f"singular in every pose: the two assemblies of {g.name} coincide, so the speed of {what} is not "
                    "determined; rates and forces that depend on it are left out"
                )
        meeting = tuple(f"[guess] at: {name} " for name in self.folded)
        return (*result, *(w for w in self.assembly.warnings if not (meeting and w.startswith(meeting))))

    def samples(self, low: float, high: float, count: int) -> Reals:
        """Inputs from low to high, at least so many steps, between which no body turns far."""
        if low == high:
            return np.array([low])
        loops = [g for g in self.plan.groups if g.members]
        ratios = {body: 1.0 for g in loops for body in g.members}
        tied = [t for t in turns(self.plan.steps) if isinstance(t.body, str)]
        for t in tied:
            if any(isinstance(x, int) for x, _ in t.angle.bases):
                ratios.setdefault(str(t.body), 1.0)
        for body, r in (base for t in tied for base in t.angle.turning):
            ratios[body] = max(abs(r), ratios.get(body, 1.0))
        fast = max((abs(k) for t in tied for _, k in t.angle.inputs), default=0.0)
        step = (high - low) / count
        step = min(step, FINE / max(fast, FINE / step))
        uneven = partial(turns_far, np.array([*ratios.values()], dtype=float))

        def look(q: Reals) -> Complexes:
            st = State([q])
            self.run(self.plan.steps, st)
            rows = [np.broadcast_to(st.turn[body], q.shape) for body in ratios]
            return np.array(rows, dtype=complex).reshape(len(rows), len(q))

        self.cover(low, high)
        with np.errstate(all="ignore"):
            some = [
                refined(np.linspace(a, b, n + 1), uneven, look) if ratios else np.linspace(a, b, n + 1)
                for a, b, n in parts(low, high, step)
            ]
        return np.unique(np.concatenate(some))

    # --- looking ahead ------------------------------------------------------------------------------------------
    def margin(self, group: Group, q: Reals) -> Reals:
        """The group's radicand at inputs q, on the branch known so far."""
        st = State([q])
        with np.errstate(all="ignore"):
            self.run(self.assembly.needed(self.plan.writes(group)), st)
        return np.broadcast_to(st.margin[group.name], q.shape).astype(float)

    def margin_at(self, group: Group, q: float) -> float:
        """The group's radicand at one input."""
        st = self.pose(self.assembly.needed(self.plan.writes(group)), (q,))
        return float(np.ravel(st.margin[group.name])[0])

    def _scan(self, a: float, b: float) -> None:
        """Look through the inputs from a to b, group by group in their order."""
        step = (b - a) / SAMPLES
        q: Reals = a + step * (np.arange(-3, SAMPLES + 3, dtype=float) + 0.5)
        st = State([q])
        waiting: list[Step] = []
        looked: Looked = {}
        for s in self.plan.steps:
            if not isinstance(s, Group) or s.name in self.noted.seen:
                waiting.append(s)
                if isinstance(s, Group):
                    self.noted.take_over(s, a, b)
                continue
            self.run(waiting, st)
            waiting = []
            if s.kind == "Newton":
                self._continued(s).extend(a, b)
                if self._continued(s).singular():
                    self._fold(s.name)
                self.close(s, st)
                continue
            self.close(s, st)
            if s.kind == "PRP":
                continue
            grid = self._look_through(s, q, st, a, b, looked)
            if s.name in self.flips or s.name in self.folded:
                self.close(s, st)
            for body in self.assembly.geared.intersection(s.members):
                held = self._samples.get(body, NONE)
                samples = follow(partial(self._angle, body), grid, self.start, self.length, held)
                self._samples[body] = samples
                st.angle[body] = whole(samples, q, np.angle(st.turn[body]))

    def _look_through(self, group: Group, q: Reals, st: State, a: float, b: float, looked: Looked) -> Reals:
        """Note a group's change points and limits from a to b, at the samples that are there or at finer ones.

        Returns the samples that are fine enough.
        """
        case = self.assembly.case(group)
        fast, driving = (1.0, {}) if self.even else (self.pace.fastest(group), self.pace.driving(group))
        uneven = partial(moves_far, group.kind, np.array([*driving.values()], dtype=float))
        winds = bool(self.assembly.geared.intersection(group.members))
        if self.even and self.repeats and not self.flips and not winds:
            # nothing that it depends on has a longer period than the input
            period = self.length
        else:
            rate = None if winds else self.pace.rate(group, self.noted.seen)
            period = np.inf if rate is None else 2 * np.pi / rate
        coarse = (b - a) / SAMPLES
        plain = not fast or (self.slides and self.even)
        step = coarse if plain else min(coarse, FINE / fast)
        if step == coarse and (
            (not driving and hardly_moves(case, st)) or not uneven(loop_rows(case, st, [*driving])).any()
        ):
            flips, brackets = self._look(group, q, st, a, b)
            changes = self.noted.note(group, flips, brackets, 1.0)
            if len(flips) % 2 == 0 and divides(period, self.length):
                self.noted.seen[group.name] = Seen(self.length, changes, tuple(brackets))
            return q
        before = self.assembly.before(group)

        def look(q: Reals) -> Complexes:
            return loop_rows(case, self._standing(before, q, looked), [*driving])

        def along(end: float) -> tuple[Reals, list[Bracket]]:
            flips, brackets = NOWHERE, list[Bracket]()
            for low, high, count in parts(a, end, step):
                grid = low + (high - low) / count * (np.arange(-3.0, count + 3) + 0.5)
                grid = refined(grid, uneven, look)
                there = self._standing(before, grid, looked)
                self.close(group, there)
                more, crossed = self._look(group, grid, there, low, high)
                flips, brackets = np.append(flips, more), [*brackets, *crossed]
                grids.append(grid)
            return flips, brackets

        share, grids = step / coarse, list[Reals]()
        repeats = period <= self.length * (1 + SAME)
        if repeats:
            flips, brackets = along(a + period)
            flips = self.noted.apart(group, flips, period)
            if len(flips) % 2:
                # on the other branch next time
                flips, brackets = (
                    np.append(flips, flips + period),
                    [*brackets, *[x.carried(period) for x in brackets]],
                )
                period *= 2
                repeats = period <= self.length * (1 + SAME)
        if repeats:
            changes = self.noted.note(group, flips, [], share)
            self.noted.seen[group.name] = Seen(period, changes, tuple(brackets))
            self.noted.take_over(group, a, b)
        else:
            flips, brackets = along(b)
            self.noted.note(group, self.noted.apart(group, flips), brackets, share)
        return np.unique(np.concatenate(grids))

    def _standing(self, steps: Iterable[Step], q: Reals, looked: Looked) -> State:
        """Return the state after some steps at inputs q, going on from where an earlier group left it there.

        Near an end of the input all groups behind it are looked at in the same places.
        """
        fresh: tuple[State, set[int]] = State([q]), set()
        # grids of fast loops are long, and each group's own
        st, done = looked.setdefault(q.tobytes(), fresh) if len(q) <= 2 * SAMPLES else fresh
        new = [step for step in steps if id(step) not in done]
        self.run(new, st)
        done.update(map(id, new))
        return st

    def _angle(self, body: str, q: Reals) -> Reals:
        """A body's angle at inputs q, but for whole turns."""
        st = State([q])
        self.run(self.assembly.needed((f"angle:{body}",)), st)
        return np.broadcast_to(np.angle(st.turn[body]), q.shape)

    def _look(self, group: Group, q: Reals, st: State, a: float, b: float) -> tuple[Reals, list[Bracket]]:
        """Find from a to b where the radicand touches zero, and where it crosses it."""
        m = np.broadcast_to(st.margin[group.name], q.shape)
        if group.kind != "RPR" and m.min() > DIP:
            return NOWHERE, []
        level, noise = depths(self.assembly.case(group), st, self.assembly.mechanism.size)
        if vanishes(m, noise):
            self._fold(group.name)
            return NOWHERE, []
        if np.mean(np.abs(m) < STRETCHED * level) > 0.9:
            # stretched all along: zeros of rounding are no change points
            return NOWHERE, []
        edge = 1e-9 * self.pace.one_turn(group)
        flips, crossed = touched(partial(self.margin, group), q, m, (level, noise), (a, b, edge))
        return flips, [Bracket(group.name, *ends) for ends in crossed]

    @property
    def has_limits(self) -> bool:
        """Was any limit met in what was covered?"""
        return bool(self.brackets) or any(way.ends for way in self.continuations.values())

    @property
    def crossings(self) -> list[float]:
        """Inputs at which two branches cross, in what was covered: of closed forms, and met on the way of the others."""
        result = [float(q) for flips in self.flips.values() for q in flips]
        return result + [float(q) for way in self.continuations.values() for q in way.crossings]

    # --- groups with no closed form ------------------------------------------------------------------------------
    def _continued(self, group: Group) -> Continuation:
        if group.name not in self.continuations:
            from virtualwork.branch.continuation import Continuation

            self.continuations[group.name] = Continuation(self, group)
        return self.continuations[group.name]

    def _close_newton(self, group: Group, st: State) -> None:
        """Close a Newton group at the state's poses, from its continued branch."""
        if self.active:
            self._continued(group).close(st)
        else:
            from virtualwork.branch.lines import along_lines

            along_lines(self, group, st)
