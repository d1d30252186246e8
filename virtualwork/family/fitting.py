"""Dimensions of which points, links and slides come nearest to a target: dimensional synthesis by least squares.

Starts of a low-discrepancy sequence (Sobol's, scrambled by a seed) are computed together, as variants; the best are
refined with exact derivatives. Where the timing is free, the inputs begin at the poses of a coarse sweep that come
nearest to the rows of the target in their order, and follow the dimensions.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Generic, NamedTuple

import numpy as np

from dalembert.arithmetic.parts import in_parts
from virtualwork.describe import DescriptionError, MechanismError
from virtualwork.describe.description import Description
from virtualwork.describe.dimensions import Dimension, by_path, changed, named, number_of
from virtualwork.family.design import Design
from virtualwork.family.fitted import FINE, D, Fit
from virtualwork.family.keep import HELD, JUDGED, Bound, Bounds, Held, Kept
from virtualwork.family.part import ASSEMBLED
from virtualwork.family.search import COARSE, Descent, along, in_turn, shares
from virtualwork.family.target import Aim, Reached, Target
from virtualwork.formulas.numbers import Reals

if TYPE_CHECKING:
    from concurrent.futures import Executor


# of the starts, the first by distance are put in order; the first of those are refined in rounds, so many by so many
# steps, the best of each round further in the next; so many where the target is nearly met: a search may creep in a valley
# next to what meets it, which another one finds
ORDERED, ROUNDS = 64, ((48, 48, 15), (8, 24, 100), (1, 1, 300))
# of the mechanism's size, or rad: a fit as near as this is not looked for again; and is nearly one
MET, NEARLY = 1e-12, 1e-4
# descents with other multipliers, at first and later; so often further poses are held, in which a bound was not met
FIRST_SETTLED, SETTLED, FURTHER = 4, 25, 8
# of the bounds: solutions that differ less than this in every dimension are one
SAME = 1e-3


def fit(
    m: D,
    targets: Sequence[Target],
    free: Mapping[str, tuple[float, float]],
    starts: int = 256,
    seed: int = 0,
    best: int = 1,
    executor: Executor | None = None,
    keep: Sequence[Bound] = (),
) -> Fit[D]:
    """Find the dimensions that come nearest to targets; see `Mechanism.fit`."""
    if starts < 1 or best < 1:
        raise ValueError(f"starts and best: found {starts} and {best}, expected 1 or more")
    return _Problem(m, targets, free, keep).solved(starts, seed, best, executor)


class _Refined(NamedTuple):
    """A start refined: shares of the way from the lower to the upper bounds, the inputs of each target.

    With half the sum of squares, the largest residual, what it cost, and what became of the bounds.
    """

    x: Reals
    inputs: tuple[Reals, ...]
    cost: float
    largest: float
    evaluations: int
    kept: tuple[Kept, ...] = ()

    @property
    def keeps(self) -> bool:
        """Whether every bound is met."""
        return all(each.met for each in self.kept)


class _Problem(Generic[D]):
    """The unknowns of a fit: shares of the way from a lower to an upper bound, and the free inputs."""

    def __init__(
        self,
        m: D,
        targets: Sequence[Target],
        free: Mapping[str, tuple[float, float]],
        keep: Sequence[Bound] = (),
    ) -> None:
        self.m, self.targets, self.free, self.keep = m, targets, free, keep
        if len(m.inputs) != 1:
            raise DescriptionError(f"found {len(m.inputs)} inputs, expected one for a fit")
        self.aims = [Aim.read(m, target) for target in targets]
        if not self.aims:
            raise ValueError("target: expected one or more")
        forces = any(key.is_force for aim in self.aims for key in aim.keys)
        forces = forces or any(bound.name.startswith("effort.") for bound in keep)
        ranges = _free(m, free, forces)
        self.dimensions = tuple(ranges)
        self.low, self.high = np.array(list(ranges.values()), dtype=float).T
        self.designs = [Design(m, self.dimensions, aim.keys) for aim in self.aims]
        self.bounds = Bounds(m, self.dimensions, keep) if keep else None

    @property
    def evaluations(self) -> int:
        """Mechanisms computed over a target so far."""
        kept = 0 if self.bounds is None else self.bounds.evaluations
        return kept + sum(design.evaluations for design in self.designs)

    @property
    def sweep(self) -> tuple[float, float]:
        """Over which bounds are kept: from the first to the last input of the targets; a whole turn where one is free."""
        inputs = [aim.inputs for aim in self.aims if aim.inputs is not None]
        if len(inputs) < len(self.aims):
            at, m = self.m.at[0], self.m
            return (at - 2 * m.size, at + 2 * m.size) if m.inputs[0].is_slide else (at, at + 2 * np.pi)
        every = np.concatenate(inputs)
        return float(every.min()), float(every.max())

    def judged(self, x: Reals) -> tuple[Kept, ...]:
        """Return the state of the bounds at some shares."""
        if self.bounds is None:
            return ()
        return self.bounds.judged(self.values(x), np.linspace(*self.sweep, JUDGED))

    def own(self) -> _Problem[D]:
        """Return the problem with designs of its own, for another thread."""
        return _Problem(self.m, self.targets, self.free, self.keep)

    def values(self, x: Reals) -> Reals:
        """The dimensions (d,) of shares."""
        # the product may pass the bound by a rounding
        return np.asarray(np.clip(self.low + x * (self.high - self.low), self.low, self.high))

    def residuals(self, x: Reals, inputs: Sequence[Reals]) -> Reals:
        """Return the weighted distance of every row of every target: in sizes of the mechanism, or rad."""
        values = self.values(x)
        parts = zip(self.aims, self.designs, inputs, strict=True)
        return np.concatenate([aim.counted(design(values, q)).ravel() for aim, design, q in parts])

    def hold(self, x: Reals | None) -> bool:
        """Hold every loop on the branch that it has at some shares; None: let it go."""
        values = None if x is None else self.values(x)
        held = [design.hold(values) for design in self.designs]
        if self.bounds is not None:
            self.bounds.hold(values)
        return all(held)

    # --- starts -----------------------------------------------------------------------------------------------------
    def begun(self, starts: Reals) -> list[tuple[Reals, tuple[Reals, ...]]]:
        """The shares and inputs to refine, the most promising first, of shares (count, d)."""
        values = self.low + starts * (self.high - self.low)
        at, m = self.m.at[0], self.m
        turning = not m.inputs[0].is_slide
        span = 2 * np.pi if turning else 4 * m.size
        q = at + span * np.arange(COARSE) / COARSE - (0.0 if turning else span / 2)
        cost = np.zeros(len(starts))
        swept: list[Reals | None] = []
        for aim, design in zip(self.aims, self.designs, strict=True):
            if aim.inputs is not None:
                swept.append(None)
                cost += aim.cost(design.table(values, aim.inputs[None])).sum(axis=1)
            else:
                table = design.table(values, q[None])
                swept.append(table)
                away = (aim.from_each(table[:, i]) for i in range(len(values)))
                cost += [each.min(axis=0).sum() for each in away]
        order = np.argsort(cost, kind="stable")
        if all(table is None for table in swept):
            inputs = tuple(aim.inputs for aim in self.aims if aim.inputs is not None)
            return [(starts[i], inputs) for i in order[: ROUNDS[0][0]]]
        result: list[tuple[float, tuple[Reals, tuple[Reals, ...]]]] = []
        for i in order[:ORDERED]:
            ways = [
                [(0.0, aim.inputs)] * 2
                if table is None or aim.inputs is not None
                else along(aim.from_each(table[:, i]), q, turning)
                for aim, table in zip(self.aims, swept, strict=True)
            ]
            # the better way round of each target, then the other
            for each in zip(*ways, strict=True):
                result.append((sum(c for c, _ in each), (starts[i], tuple(way for _, way in each))))
        result.sort(key=lambda each: each[0])
        # what cannot be assembled near every row leads nowhere, while anything else does
        hopeless = min(aim.lost.min() for aim in self.aims)
        return [x for c, x in result if c < hopeless or result[0][0] >= hopeless]

    # --- solution ---------------------------------------------------------------------------------------------------
    def solved(self, starts: int, seed: int, best: int, executor: Executor | None) -> Fit[D]:
        """Refine the best starts; stop when as many as requested meet the target."""
        own = np.array([float(number_of(self.m, d)) for d in self.dimensions])
        begun = self.begun(shares((own - self.low) / (self.high - self.low), starts, seed))
        evaluations = self.evaluations
        met: list[_Refined] = []
        wanted = 2 * best if best > 1 else 1
        for count, most, steps in ROUNDS:
            solutions: list[_Refined] = []
            # each part has what it needs for itself, on threads too
            work = ((self.own() if executor else self, *start, steps) for start in begun[: max(most, wanted)])
            with closing(in_parts(_refined, work, executor, max(count, wanted))) as refined:
                for each in refined:
                    evaluations += each.evaluations
                    solutions.append(each)
                    if each.largest < MET and each.keeps:
                        met = self._distinct([*met, each])
                    enough = len(solutions) >= max(count, wanted)
                    if len(met) >= best or (enough and min(f.largest for f in solutions) > NEARLY):
                        break
            solutions = self._distinct([*met, *solutions])
            if len(met) >= best:
                break
            begun = [(each.x, each.inputs) for each in solutions]
        if not any(each.keeps for each in solutions):
            raise MechanismError(self._unmet(solutions, starts))
        solutions = [each for each in solutions if each.keeps]
        fits = [self._fit(each, starts, evaluations) for each in solutions[:best]]
        there = [each for each in fits if each is not None]
        if not there:
            raise MechanismError(
                f"fit: of {starts} starts within the bounds none can be assembled at all target points"
            )
        return replace(there[0], others=tuple(there[1:]))

    def _unmet(self, refined: Sequence[_Refined], starts: int) -> str:
        """Which bounds no start keeps, and how far the nearest comes."""
        nearest = min(refined, key=lambda each: sum(not kept.met for kept in each.kept))
        lines = []
        for each in nearest.kept:
            if not each.met:
                turns = each.bound.name == "transmission" or each.bound.name.startswith("links.")
                number, reached = (
                    f"{np.degrees(v) if turns else v:.6g}{' deg' if turns else ''}"
                    for v in (each.bound.value, each.extreme)
                )
                lines.append(
                    f"{each.bound.name} {'>=' if each.bound.most is None else '<='} {number} (it comes to {reached})"
                )
        return f"fit: no start of {starts} within the bounds keeps {' and '.join(lines)}"

    def _distinct(self, refined: Sequence[_Refined]) -> list[_Refined]:
        """The best of each place in the space of dimensions, the best first."""
        kept: list[_Refined] = []
        for each in sorted(refined, key=lambda e: (not e.keeps, e.cost)):
            if all(np.abs(each.x - other.x).max() > SAME for other in kept):
                kept.append(each)
        return kept

    def refined(self, x: Reals, inputs: Sequence[Reals], steps: int) -> _Refined:
        """One start, by a trust region within the bounds.

        Every loop stays on its first branch, for on the way the guess may not decide; the result counts
        as its own guess has it.
        """
        before = self.evaluations
        away = np.concatenate([aim.away.ravel() for aim in self.aims])
        begins = (np.abs(self.residuals(x, inputs)) < away).all()
        held = self.hold(x)
        end, at = self._descended(x, inputs, steps)
        if held:
            there = self.residuals(end, at)
            self.hold(None)
            # on the way to the poses there is a change point, or the guess means another assembly there
            if begins and np.abs(self.residuals(end, at) - there).max() > SAME:
                end, at = self._descended(x, inputs, steps)
        off = self.residuals(end, at)
        largest = float(np.abs(off).max())
        cost, kept = float(off @ off) / 2, self.judged(end)
        return _Refined(end, tuple(at), cost, largest, self.evaluations - before, kept)

    def _descended(self, x: Reals, inputs: Sequence[Reals], steps: int) -> tuple[Reals, Sequence[Reals]]:
        width = self.high - self.low
        if self.bounds is None:
            way = Descent(self.aims, self.designs, self.values, width, inputs)
            x = self._down(way, x, steps)
            return x, way.at(x).inputs
        held = Held(self.bounds, np.linspace(*self.sweep, HELD), width)
        way = Descent(self.aims, self.designs, self.values, width, inputs, held)
        for _ in range(FURTHER if steps > ROUNDS[0][2] else 1):
            for _ in range(SETTLED if steps > ROUNDS[0][2] else FIRST_SETTLED):
                way.forget()
                x = self._down(way, x, steps)
                if held.settle(self.values(x)):
                    break
            way.forget()
            kept = self.judged(x)
            if all(each.met for each in kept):
                break
            held.hold_too(kept)
        return x, way.at(x).inputs

    @staticmethod
    def _down(way: Descent, x: Reals, steps: int) -> Reals:
        """One descent."""
        from scipy.optimize import least_squares

        bounds = (0.0, 1.0)
        # dogbox steps along the bounds; trf, which keeps off them, creeps in the long valleys of this problem
        result = least_squares(
            way.residuals,
            np.clip(x, *bounds),
            way.jacobian,
            bounds,
            method="dogbox",
            ftol=1e-15,
            xtol=1e-15,
            gtol=1e-15,
            max_nfev=steps,
        )
        return np.asarray(result.x)

    def _fit(self, refined: _Refined, starts: int, evaluations: int) -> Fit[D] | None:
        """A solution as it is handed out; None where it cannot be assembled at every row."""
        values = self.values(refined.x)
        reached: list[Reached] = []
        inputs: list[Reals] = []
        for aim, design, q in zip(self.aims, self.designs, refined.inputs, strict=True):
            table = design(values, q)
            if aim.inputs is None and not self.m.inputs[0].is_slide:
                # the same poses within a turn, where a turn brings them back
                within = in_turn(q, self.m.at[0])
                same = design(values, within)
                if np.abs(aim.apart(same) - aim.apart(table)).max() < MET:
                    q, table = within, same
            if not np.isfinite(table).all():
                return None
            reached += aim.reached(table, q)
            inputs.append(q)
        mechanism = changed(self.m, by_path(self.dimensions, values.tolist()))
        remarks = tuple(self._remarks(values, inputs))
        fit = Fit(mechanism, self.m, self.dimensions, values, tuple(reached), starts, evaluations, remarks)
        return replace(fit, kept=refined.kept)

    def _remarks(self, values: Reals, inputs: Sequence[Reals]) -> list[str]:
        """The warnings about a solution."""
        lines = []
        for d, number, low, high in zip(self.dimensions, values, self.low, self.high, strict=True):
            if min(number - low, high - number) < 1e-6 * (high - low):
                lines.append(f"fit: {d.path} ends at its bound")
        for aim, q in zip(self.aims, inputs, strict=True):
            if aim.inputs is None and len(aim.keys) == 1:
                lines.append(
                    "fit: with free inputs one number a row is met by every mechanism that reaches it: expected an input "
                    "for each row"
                )
            order = np.diff(q) * np.sign(q[-1] - q[0])
            if aim.inputs is None and (order < 0).any():
                k = int(np.argmin(order))
                lines.append(
                    f"fit: order defect: the input meets target point {k + 2} before target point {k + 1}"
                )
        every = np.concatenate(inputs)
        whole = np.linspace(every.min(), every.max(), FINE)
        (there,) = self.designs[0].solved(values[None], whole[None], [ASSEMBLED])
        gaps = whole[~np.isfinite(there[0])]
        if len(gaps):
            low, high = (self._shown(float(each)) for each in (gaps[0], gaps[-1]))
            lines.append(
                f"fit: branch defect: between the target points it cannot be assembled from {low} to {high} "
                f"({len(gaps)} of {FINE} poses): the mechanism cannot move through the target"
            )
        if not self.designs[0].exact:
            lines.append(
                "fit: derivatives are computed from differences, because the phase of a gear depends on links that are placed first"
            )
        return lines

    def _shown(self, q: float) -> str:
        return f"{q:.6g} m" if self.m.inputs[0].is_slide else f"{np.degrees(q):.6g} deg"


def _refined(problem: _Problem[Any], x: Reals, inputs: Sequence[Reals], steps: int) -> _Refined:
    return problem.refined(x, inputs, steps)


def _free(
    m: Description, free: Mapping[str, tuple[float, float]], forces: bool
) -> dict[Dimension, tuple[float, float]]:
    result: dict[Dimension, tuple[float, float]] = {}
    for path, (low, high) in free.items():
        (dimension, *both) = named(m, path)
        if both:
            raise DescriptionError(f"'{path}' names two numbers: expected {dimension.path} or {both[0].path}")
        of, last = dimension.where[0], dimension.where[-1]
        weight = of == "links" and (last in ("mass", "inertia") or dimension.where[2] == "center")
        if of == "inputs":
            raise DescriptionError(f"{dimension.path}: the input is not free: expected a dimension or a load")
        if not forces and (
            of not in ("ground", "links", "guides", "gears", "belts", "racks", "cams") or weight
        ):
            raise DescriptionError(f"{dimension.path} moves no point: expected a dimension of the geometry")
        if not (np.isfinite(low) and np.isfinite(high) and low < high):
            raise DescriptionError(f"{dimension.path}: found bounds {low:g} to {high:g}, expected low < high")
        result[dimension] = (float(low), float(high))
    if not result:
        raise DescriptionError("no dimension is free: expected one or more")
    return result
