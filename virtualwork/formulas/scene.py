"""The loads of a mechanism over the poses of a motion: blocks of poses, solved as far as the loads ask.

A block forms each load and each row (`sums`) when it is first asked for, and never twice.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cached_property
from typing import TYPE_CHECKING
from weakref import proxy

import numpy as np

from virtualwork.describe.description import Description
from virtualwork.describe.loads import TorsionSpring
from virtualwork.describe.parts import GROUND
from virtualwork.formulas.closed_forms import Number
from virtualwork.formulas.loads import (
    Acting,
    InertiaForce,
    InertiaTorque,
    Load,
    Path,
    Rigid,
    Rub,
    SpringEnd,
    TorsionEnd,
    path_reads,
    plus,
    times,
)
from virtualwork.plan.steps import Place
from virtualwork.state import BLOCK

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from virtualwork.formulas.load_paths import Bearing
    from virtualwork.formulas.quantities import Row
    from virtualwork.motion import Motion
    from virtualwork.plan.steps import Plan
    from virtualwork.state import Jets, State

    Reals = NDArray[np.float64]


class Block:
    """A block of poses as the loads see it: positions, velocity coefficients, velocities, accelerations.

    A derivative that is identically zero is None.
    """

    def __init__(
        self, scene: Scene, i: int, rows: slice, st: State, along: Jets | None, by: list[Jets]
    ) -> None:
        self.scene: Scene = proxy(scene)  # which holds its blocks
        self.rows, self.st, self.along, self.by = rows, st, along, by
        self.one = len(by) == 1
        self.rates = scene.rates(rows, st.many) if self.one else (None, None)
        self.friction: dict[int, Number] = {}
        self._kept: dict[int, Number] = {}
        self.rows_formed: dict[Row, tuple[float, Number]] = {}

    def row(self, row: Row) -> tuple[float, Number]:
        """A row's factor and array, formed once."""
        found = self.rows_formed.get(row)
        if found is None:
            found = self.rows_formed[row] = row.form(self)
        return found

    def second(self, derivative: Callable[[Jets, int], Number]) -> tuple[float, Number]:
        """ẍ = K q̈ + L q̇² of what has the derivatives K, L over the input: a factor and an array."""
        if not self.one:
            return 1.0, None if self.along is None else derivative(self.along, 2)
        speed, rate = self.rates
        normal = None if speed is None else derivative(self.by[0], 2)
        tangential = None if rate is None else derivative(self.by[0], 1)
        if tangential is None and isinstance(speed, float):
            return speed * speed, normal  # one number for all poses: the array stays as it is
        return 1.0, plus(times(normal, times(speed, speed)), times(tangential, rate))

    def forget(self, *, lasting: bool = False) -> None:
        """Drop the arrays, or all but those that others will ask for."""
        self._kept.clear()
        kept = {row: found for row, found in self.rows_formed.items() if lasting and row.lasting}
        self.rows_formed = kept

    def position(self, path: Path) -> Number:
        """P, complex."""
        base, terms = path
        return self.st.point[base] + self.st.sum(terms) if terms else self.st.point[base]

    def coefficient(self, path: Path, j: int) -> Number:
        """∂P/∂q_j, complex."""
        return self.by[j].vector(*path, 1)

    def turning(self, body: str, j: int) -> Number:
        """∂θ/∂q_j."""
        return None if body == GROUND else self.by[j].angle[body][0]

    def velocity(self, path: Path) -> Number:
        """Ṗ, complex."""
        if self.one:
            return times(self.by[0].vector(*path, 1), self.rates[0])
        return None if self.along is None else self.along.vector(*path, 1)

    def acceleration(self, path: Path, factor: float = 1.0) -> Number:
        """P̈ = K q̈ + L q̇², complex, times a factor."""
        own, value = self.second(lambda jets, k: jets.vector(*path, k))
        return times(value, own * factor)

    def omega(self, body: str) -> Number:
        """ω."""
        if body == GROUND:
            return None
        if self.one:
            return times(self.by[0].angle[body][0], self.rates[0])
        return None if self.along is None else self.along.angle[body][0]

    def alpha(self, body: str, factor: float = 1.0) -> Number:
        """α, times a factor."""
        if body == GROUND:
            return None
        own, value = self.second(lambda jets, k: jets.angle[body][k - 1])
        return times(value, own * factor)

    def slide_rate(self, guide: int) -> Number:
        """ṡ of a guide."""
        if self.one:
            return times(self.by[0].slide[guide][0], self.rates[0])
        return None if self.along is None else self.along.slide[guide][0]

    def keep(self, load: Load) -> Number:
        """A load's value, formed once; friction anew at each iterate."""
        if isinstance(load, Rub):
            return load.value(self)
        if id(load) not in self._kept:
            self._kept[id(load)] = load.value(self)
        return self._kept[id(load)]


class Scene:
    """The loads of a mechanism over a motion."""

    def __init__(self, motion: Motion, *, at_rest: bool = False) -> None:
        self.motion = motion
        self.mechanism: Description = motion.mechanism
        self.plan: Plan = motion.assembly.plan
        self.at_rest = at_rest
        self.formed: set[str] = set()
        self._blocks: dict[tuple[str, ...], list[Block]] = {}
        self._followed: dict[TorsionSpring, tuple[Reals, Reals]] = {}

    @cached_property
    def acting(self) -> Acting:
        """What acts, the same for all motions of an assembly."""
        known = self.motion.assembly.acting
        if self.moves not in known:
            known[self.moves] = Acting(self.mechanism, self.plan, self.moves)
        return known[self.moves]

    @property
    def bearing(self) -> Bearing:
        """How the loads bear on what moves, and how joint forces follow."""
        return self.acting.bearing

    @cached_property
    def drive(self) -> Reals:
        """The effort at each input by virtual work, (n, k), as motors that other links carry need it."""
        from virtualwork.formulas.effort import effort

        return effort(self)

    @property
    def loads(self) -> list[Load]:
        """Every load that is not zero throughout, friction apart."""
        return self.acting.loads

    @property
    def rubs(self) -> list[Rub]:
        """The friction loads."""
        return self.acting.rubs

    @property
    def rigid(self) -> dict[str, Rigid]:
        """Mass properties of every link."""
        return self.acting.rigid

    def path(self, body: str, z: complex) -> Path:
        """Where a point of a body lies."""
        return self.acting.path(body, z)

    @cached_property
    def moves(self) -> bool:
        """Whether anything moves at all: a speed or an acceleration that is not zero."""
        return not self.at_rest and any(np.any(rate) for rates in self.motion._rates[:2] for rate in rates)

    def rates(self, rows: slice, many: bool) -> tuple[Number, Number]:
        """q̇ and q̈ of the one input over a block, None where zero."""
        found: list[Number] = []
        for rate in (self.motion._rates[0][0], self.motion._rates[1][0]):
            if self.at_rest or (isinstance(rate, float) and rate == 0.0):
                found.append(None)
            else:
                found.append(rate if isinstance(rate, float) else rate[rows] if many else float(rate[0]))
        return found[0], found[1]

    def wound(self, block: Block, spring: TorsionSpring) -> Number:
        """θ_second − θ_first − free angle: within half a turn at the guess, and from there on followed continuously.

        Where the inputs alone fix both angles they are taken as they are, whole turns included. With several inputs
        the angle lies within half a turn of free.
        """
        st, (a, b) = block.st, spring.links
        known = [self.plan.angles[body] for body in (a, b)]
        if all(not angle.bases and angle.phase is None for angle in known):
            return (st.affine(known[1]) - spring.free_angle) - st.affine(known[0])
        relative = st.turn[b] * np.conj(st.turn[a]) * complex(np.exp(-1j * spring.free_angle))
        within = np.angle(relative)
        if len(st.inputs) == 1:
            q, unwrapped = self._unwound(spring)
            rough = np.interp(np.asarray(st.inputs[0], dtype=float), q, unwrapped)
            within = within + 2 * np.pi * np.round((rough - within) / (2 * np.pi))
        return within if block.st.many else float(within)

    def _unwound(self, spring: TorsionSpring) -> tuple[Reals, Reals]:
        """The relative angle of a torsion spring followed from the guess, roughly: only its whole turns are used."""
        if spring not in self._followed:
            inputs, at = self.motion.inputs[:, 0], self.mechanism.at[0]
            low, high = min(float(np.nanmin(inputs)), at), max(float(np.nanmax(inputs)), at)
            slide = self.mechanism.inputs[0].is_slide
            step = self.mechanism.size / 720 if slide else 2 * np.pi / 720
            q = np.linspace(low, high, min(20000, 2 + int((high - low) / step)))
            along = type(self.motion)(self.motion.assembly, q)
            a, b = (along.angle(body) if body != GROUND else np.zeros(len(q)) for body in spring.links)
            relative = np.angle(np.exp(1j * (b - a - spring.free_angle)))
            there = np.isfinite(relative)
            path = np.unwrap(relative[there])
            if len(path):
                start = int(np.argmin(np.abs(q[there] - at)))
                path = path + (relative[there][start] - path[start])
                q = q[there]
            self._followed[spring] = (q, path) if len(path) else (q, np.zeros(len(q)))
        return self._followed[spring]

    # --- solving ----------------------------------------------------------------------------------------------
    def reads(self, loads: Iterable[Load]) -> set[str]:
        """What the loads' points and bodies hang on."""
        keys: set[str] = set()
        for load in loads:
            keys.add(f"angle:{load.body}")
            for path in (load.path, load.other if isinstance(load, SpringEnd) else None):
                if path is not None:
                    keys |= path_reads(path)
            if isinstance(load, TorsionEnd) and load.spring is not None:
                keys |= {f"angle:{body}" for body in load.spring.links}
        return {key for key in keys if key != f"angle:{GROUND}"}

    def _targets(self, keys: Iterable[str]) -> tuple[tuple[str, ...], int]:
        targets = tuple(sorted(self.reads([*self.loads, *self.rubs]) | set(keys)))
        if not targets:  # nothing acts: any one thing that moves will do
            targets = self.plan.writes(next(step for step in self.plan.steps if not isinstance(step, Place)))
        inertial = self.moves and any(isinstance(load, InertiaForce | InertiaTorque) for load in self.loads)
        return targets, 2 if inertial else 1

    def blocks(self, keys: Iterable[str] = ()) -> list[Block]:
        """The blocks of poses, with everything solved that the loads and `keys` hang on."""
        motion = self.motion
        targets, order = self._targets(keys)
        if targets in self._blocks:
            return self._blocks[targets]
        k = len(self.mechanism.inputs)
        along = None
        if k == 1:
            by = [motion._solve(targets, order)]
        else:
            by = [motion._solve(targets, 1, j) for j in range(k)]
            along = motion._solve(targets, order) if self.moves else None
        return self._kept_blocks(targets, by, along)

    def _kept_blocks(
        self, targets: tuple[str, ...], by: list[list[Jets]], along: list[Jets] | None
    ) -> list[Block]:
        found = [
            Block(self, i, rows, st, None if along is None else along[i], [jets[i] for jets in by])
            for i, (rows, st) in enumerate(self.motion._rows())
        ]
        for old in self._blocks.values():
            for block, before in zip(found, old, strict=True):
                block._kept, block.rows_formed = before._kept, before.rows_formed
                block.friction = before.friction
        self._blocks = {targets: found}
        return found

    def each(self, keys: Iterable[str], form: Callable[[Block], None]) -> None:
        """Form something over every block; of a single input while the block is still in cache from its solution."""
        targets, order = self._targets(keys)
        if len(self.mechanism.inputs) > 1 or targets in self._blocks or self.motion.n <= BLOCK:
            for block in self.blocks(keys):
                form(block)
            return

        def then(i: int) -> None:
            if targets not in self._blocks:
                self._kept_blocks(targets, [self.motion._jets[-1]], None)
            form(self._blocks[targets][i])

        self.motion._solve(targets, order, then=then)

    @cached_property
    def lost(self) -> NDArray[np.bool_] | None:
        """(n,): the poses that are not assembled; None where all are."""
        there = self.motion.assembled
        return None if there.all() else ~there
