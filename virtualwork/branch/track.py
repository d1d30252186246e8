"""Along the input: change points, limits, and the branch between them.

A closed form's Jacobian is ± the root of its radicand. Where the radicand touches zero without crossing it, two
branches meet (a change point: the parallelogram at 0° and 180°, the folded kite); turning steadily through it, the
Jacobian changes its sign. Where the radicand crosses zero the input can go no further (a limit). Both are found
once, by sampling a turn of the input, and then to full precision. A pose's branch follows from the number of change
points between the guess and it: nothing is marched in angle.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from virtualwork.branch.choice import Choice
from virtualwork.describe import MechanismError
from virtualwork.formulas.closed_forms import Case
from virtualwork.formulas.numbers import EPS, Number, Reals
from virtualwork.formulas.positions import NONE, Samples, State, follow, run, whole
from virtualwork.plan.steps import Group, Step, turns

if TYPE_CHECKING:
    # a mechanism that passes no change point, and whose groups all have a closed form, loads neither
    from virtualwork.branch.change_point import ChangePoint
    from virtualwork.branch.continuation import Continuation

# places nearer than this share of a turn are one
SAME = 1e-6
# of one turn, or of one mechanism's size of slide
SAMPLES = 720
# a radicand below this may touch zero between two samples
DIP = 0.05


class Track:
    """What happens to an assembly along its one input."""

    def __init__(self, assembly: Choice) -> None:
        self.assembly = assembly
        m = assembly.mechanism
        self.plan = assembly.plan
        self.active = len(m.inputs) == 1
        self.start = m.at[0]
        self.low = self.high = self.start
        self.slides = m.inputs[0].is_slide
        self.length = m.size if self.slides else 2 * np.pi
        self.flips: dict[str, Reals] = {}
        self.changes: dict[str, list[ChangePoint]] = {}
        self.brackets: list[tuple[str, float, float]] = []
        self.continuations: dict[str, Continuation] = {}
        # of bodies of which a gear of fractional ratio needs the angle itself
        self._samples: dict[str, Samples] = {}
        # one turn says it all where every turn of a body is a whole number of turns of the input
        factors = [k for t in turns(self.plan.steps) for _, k in (*t.angle.inputs, *t.angle.bases)]
        self.whole = not self.slides and all(float(k).is_integer() for k in factors)
        self.repeats = self.whole and all(g.kind != "Newton" for g in self.plan.groups)
        # no change point anywhere, however far the input turns: without a loop there is none
        self.settled = not self.plan.groups
        # groups that are singular in every pose
        self.folded: set[str] = set()
        # where one turn begins and what it has, where all others have the same
        self.one_turn: tuple[float, dict[str, list[ChangePoint]]] | None = None
        if not self.active:
            self._look_around()

    # --- what poses ask ---------------------------------------------------------------------------------------
    def run(self, steps: Iterable[Step], st: State) -> None:
        """Work out positions, step by step, each group on its branch."""
        run(steps, st, self.close, self.assembly.plain)

    def close(self, group: Group, st: State) -> None:
        """Close the loops of one group."""
        if group.kind == "Newton":
            self._close_newton(group, st)
            return
        case, size = self.assembly.case(group), self.assembly.mechanism.size
        if group.name in self.flips and group.name not in self.folded:
            from virtualwork.branch.change_point import mend

            case.solve(st, self.sign(group.name, st.inputs[0]), size)
            mend(self.changes.get(group.name, ()), group, st)
        else:
            case.solve(st, self.assembly.signs[group.name], size, group.name in self.folded)
        bodies = self.assembly.geared.intersection(group.members)
        if bodies and not self.active:
            from virtualwork.branch.lines import wind_along_lines

            wind_along_lines(self, group, st, bodies)
            return
        for body in bodies:
            found = whole(self._samples.get(body, NONE), st.inputs[0], np.angle(st.turn[body]))
            st.angle[body] = found if np.ndim(st.inputs[0]) else float(found)

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
                f"the input is asked {abs(high - low) / self.length:.3g} turns away from the guess; give `at` nearer"
            )
        with np.errstate(all="ignore"):
            while self.high < high:
                self._turn(self.high)
                self.high += self.length
                if first and self._seen_all():
                    return
                first = False
            while self.low > low:
                self.low -= self.length
                self._turn(self.low)
                if first and self._seen_all():
                    return
                first = False
            self._look_back(low, high)

    def _look_back(self, low: float, high: float) -> None:
        """Beyond an end of a group without a closed form it may stand as a turn before: then its other end matters too."""
        for way in list(self.continuations.values()) if self.whole else ():
            while (
                way.stopped[1]
                and not way.stopped[-1]
                and way.end(1) < high
                and self.low > way.end(1) - self.length
            ):
                self.low -= self.length
                self._turn(self.low)
            while (
                way.stopped[-1]
                and not way.stopped[1]
                and way.end(-1) > low
                and self.high < way.end(-1) + self.length
            ):
                self._turn(self.high)
                self.high += self.length

    def _seen_all(self) -> bool:
        """Whether the one turn looked through says it all, or that it repeats."""
        self.settled = self.repeats and not any(len(f) for f in self.flips.values())
        if self.repeats and not self.assembly.geared:
            # the first point of the turn may be found at its end again
            seam = self.low + (1 - SAME) * self.length
            turn = {name: [c for c in points if c.input < seam] for name, points in self.changes.items()}
            # every group is back on its branch
            if not any(len(points) % 2 for points in turn.values()):
                self.one_turn = self.low, turn
        return self.settled

    def _turn(self, a: float) -> None:
        """Look through the turn that begins at a, or take over what a turn before it had."""
        if self.one_turn is None:
            self._scan(a, a + self.length)
            return
        begin, turn = self.one_turn
        for name, points in turn.items():
            for change in points:
                where = change.input + self.length * round((a - begin) / self.length)
                if np.abs(self.flips[name] - where).min() > SAME * self.length:
                    self.flips[name] = np.sort(np.append(self.flips[name], where))
                    self.changes[name].append(replace(change, input=where))

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

        return mend_rates(self.changes.get(group.name, ()), q, k, x)

    def bridge_rates(self, group: Group, q: Number, k: int, x: list[Number], singular: Any) -> list[Number]:
        """Derivatives of a Newton group at poses where its Jacobian is singular though the branch goes on."""
        if self.active and group.name in self.continuations:
            self.continuations[group.name].bridge_rates(q, k, x, singular)
        return x

    def _fold(self, name: str) -> None:
        """Note a group that is singular in every pose."""
        self.folded.add(name)
        self.assembly.plain.pop(name, None)

    def _look_around(self) -> None:
        """With several inputs: which closed forms are singular at all poses around the guess."""
        at = self.assembly.mechanism.at
        golden = np.sqrt(np.arange(2.0, 2 + len(at)))
        off = (np.multiply.outer(np.arange(1.0, 25), golden) % 1.0 - 0.5) * 0.1 * self.length
        st = State([a + off[:, j] for j, a in enumerate(at)], many=True)
        with np.errstate(all="ignore"):
            for s in self.plan.steps:
                if isinstance(s, Group) and s.kind == "Newton":
                    return
                self.assembly.run_untracked([s], st)
                if isinstance(s, Group) and s.kind != "PRP":
                    case, size = self.assembly.case(s), self.assembly.mechanism.size
                    if vanishes(st.margin[s.name], rounding(case, size)):
                        self._fold(s.name)
                        case.solve(st, 1, size, folded=True)

    def warnings(self) -> tuple[str, ...]:
        """The assembly's warnings, and the groups that are singular in every pose in what was covered."""
        found = []
        for g in self.plan.groups:
            if g.name in self.folded:
                guides = self.assembly.mechanism.guides
                what = ", ".join([*g.members, *(f"the slide at {guides[s].point}" for s in g.slides)])
                found.append(
                    f"singular in every pose: the speed of {what} is not determined: the assemblies of {g.name} meet "
                    "all along. Places are those where they meet; rates and forces that hang on them are left out"
                )
        meeting = tuple(f"[guess] at: {name} " for name in self.folded)
        return (*found, *(w for w in self.assembly.warnings if not (meeting and w.startswith(meeting))))

    # --- looking ahead ------------------------------------------------------------------------------------------
    def margin(self, group: Group, q: Reals) -> Reals:
        """The group's radicand at inputs q, on the branch known so far."""
        st = State([q], many=True)
        with np.errstate(all="ignore"):
            self.run(self.assembly.needed(self.plan.writes(group)), st)
        return np.broadcast_to(st.margin[group.name], q.shape).astype(float)

    def _scan(self, a: float, b: float) -> None:
        step = (b - a) / SAMPLES
        q: Reals = a + step * (np.arange(-3, SAMPLES + 3, dtype=float) + 0.5)
        st = State([q], many=True)
        waiting: list[Step] = []
        for s in self.plan.steps:
            if not isinstance(s, Group):
                waiting.append(s)
                continue
            run(waiting, st)
            waiting = []
            if s.kind != "Newton":
                self.close(s, st)
                if s.kind == "PRP":
                    continue
                m = np.broadcast_to(st.margin[s.name], q.shape)
                if self._look(s, q, m, a, b):
                    self.close(s, st)
                for body in self.assembly.geared.intersection(s.members):
                    known = self._samples.get(body, NONE)
                    samples = follow(partial(self._angle, body), q, self.start, self.length, known)
                    self._samples[body] = samples
                    st.angle[body] = whole(samples, q, np.angle(st.turn[body]))
            else:
                self._continued(s).extend(a, b)
                if self._continued(s).singular():
                    self._fold(s.name)
                self.close(s, st)

    def _angle(self, body: str, q: Reals) -> Reals:
        """A body's angle at inputs q, but for whole turns."""
        st = State([q], many=True)
        self.run(self.assembly.needed((f"angle:{body}",)), st)
        return np.broadcast_to(np.angle(st.turn[body]), q.shape)

    def _look(self, group: Group, q: Reals, m: Reals, a: float, b: float) -> bool:
        """Find where the radicand crosses or touches zero; say whether a change point was found."""
        noise = rounding(self.assembly.case(group), self.assembly.mechanism.size)
        if vanishes(m, noise):
            self._fold(group.name)
            return True
        if np.mean(np.abs(m) < 1e-14) > 0.9:
            # stretched all along: zeros of rounding are no change points
            return False
        inside = (q >= a) & (q < b)
        crossing = np.flatnonzero((m[:-1] >= 0) != (m[1:] >= 0))
        for i in crossing:
            if np.isfinite(m[i]) and np.isfinite(m[i + 1]) and inside[i] | inside[i + 1]:
                self.brackets.append((group.name, float(q[i]), float(q[i + 1])))
        dips = 1 + np.flatnonzero((m[1:-1] <= m[:-2]) & (m[1:-1] < m[2:]) & (np.abs(m[1:-1]) < DIP))
        if not len(dips):
            return False
        from virtualwork.branch.change_point import lowest, through

        fresh: list[float] = []
        for i in dips:
            found = lowest(partial(self.margin, group), float(q[i - 1]), float(q[i + 1]), noise)
            if found is None:
                continue
            where, depth, left = found
            # the gap is narrower than the samples
            if depth < -left and m[i] > 0:
                self.brackets += [(group.name, float(q[i - 1]), where), (group.name, where, float(q[i + 1]))]
            # a change point at the seam of two chunks belongs to both
            edge = 1e-9 * self.length
            if abs(depth) <= left and a - edge <= where < b + edge:
                known = self.flips.setdefault(group.name, np.empty(0))
                self.assembly.plain.pop(group.name, None)
                if not len(known) or np.abs(known - where).min() > SAME * self.length:
                    self.brackets = [
                        x for x in self.brackets if not (x[0] == group.name and x[1] <= where <= x[2])
                    ]
                    # a guess at the change point itself means the branch beyond it
                    here = min(where, self.start) if abs(where - self.start) < 1e-9 * self.length else where
                    self.flips[group.name] = np.sort(np.append(known, here))
                    fresh.append(where)
        # the branch through each one can be told only once all of them are known
        for where in fresh:
            self.changes.setdefault(group.name, []).append(through(self, group, where))
        return bool(fresh)

    @property
    def has_limits(self) -> bool:
        """Was any limit met in what was covered?"""
        return bool(self.brackets) or any(way.ends for way in self.continuations.values())

    @property
    def crossings(self) -> list[float]:
        """Inputs at which two branches cross, in what was covered: of closed forms, and met on the way of the others."""
        found = [float(q) for flips in self.flips.values() for q in flips]
        return found + [float(q) for way in self.continuations.values() for q in way.crossings]

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


def rounding(case: Case, size: float) -> float:
    """The rounding of a group's radicand, by its shortest arm and the mechanism's size."""
    shortest = min((abs(a) for a in case.arms if a), default=size)
    return 256 * EPS * (1 + (size / shortest) ** 2 if shortest else 1)


def vanishes(margin: Number, noise: float) -> bool:
    """Whether a radicand is zero to rounding wherever there is one."""
    m = np.abs(np.atleast_1d(margin))
    m = m[np.isfinite(m)]
    return len(m) > 4 and bool((m <= noise).all())
