"""The loads of a mechanism over poses: blocks of them, solved as far as the loads ask."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.guard import guarded
from virtualwork.describe.parts import Rigid
from virtualwork.formulas.block import Block, Setting
from virtualwork.formulas.load_case import LoadCase
from virtualwork.formulas.load_paths import LoadPaths
from virtualwork.formulas.loads import FrictionLoad, Load
from virtualwork.formulas.poses import Poses
from virtualwork.formulas.positions import BLOCK
from virtualwork.formulas.rates import Rates


@guarded
class Scene:
    """The loads of a mechanism over its poses.

    Attributes
    ----------
    poses : Poses
    case : LoadCase
        What acts, the same for all motions of an assembly.
    moves : bool
        Whether anything moves at all.
    formed : set of str
        The names of the joint forces formed so far.
    """

    def __init__(self, poses: Poses, *, at_rest: bool = False) -> None:
        self.poses, self.lock = poses, poses.lock
        self.mechanism, self.plan = poses.mechanism, poses.plan
        self.setting = Setting(poses, at_rest)
        self.moves, self.formed = self.setting.moves, self.setting.formed
        prepared = poses.branch.prepared
        with self.lock:
            if self.moves not in prepared:
                prepared[self.moves] = LoadCase(self.mechanism, self.plan, self.moves)
        self.case: LoadCase = prepared[self.moves]
        self._blocks: dict[tuple[str, ...], list[Block]] = {}

    @cached_property
    def paths(self) -> LoadPaths:
        """How the loads bear on what moves, and how joint forces follow; made once for an assembly."""
        load_paths = self.poses.branch.load_paths
        if self.moves not in load_paths:
            load_paths[self.moves] = LoadPaths(self.case)
        result: LoadPaths = load_paths[self.moves]
        return result

    @property
    def loads(self) -> list[Load]:
        """Every load that is not zero throughout, friction apart."""
        return self.case.loads

    @property
    def friction(self) -> list[FrictionLoad]:
        """The friction loads."""
        return self.case.friction

    @property
    def rigid(self) -> Mapping[str, Rigid]:
        """Mass properties of every link."""
        return self.mechanism.rigid

    # --- solving ----------------------------------------------------------------------------------------------
    def blocks(self, keys: Iterable[str] = ()) -> list[Block]:
        """The blocks of poses, with everything solved that the loads and `keys` depend on."""
        targets, order = self.case.targets(keys)
        if targets in self._blocks:
            return self._blocks[targets]
        k = len(self.mechanism.inputs)
        if k == 1:
            return self._made(targets, [self.poses.solve(targets, order)], None)
        by = [self.poses.solve(targets, 1, j) for j in range(k)]
        return self._made(targets, by, self.poses.solve(targets, order) if self.moves else None)

    def _made(
        self, targets: tuple[str, ...], by: list[list[Rates]], along: list[Rates] | None
    ) -> list[Block]:
        result = [
            Block(self.setting, rows, st, None if along is None else along[i], [rates[i] for rates in by])
            for i, (rows, st) in enumerate(self.poses.rows())
        ]
        for old in self._blocks.values():
            for block, before in zip(result, old, strict=True):
                block.kept, block.friction = before.kept, before.friction
        self._blocks = {targets: result}
        return result

    def each(self, keys: Iterable[str], form: Callable[[Block], None]) -> None:
        """Form something over every block; of a single input while the block is still in cache from its solution."""
        targets, order = self.case.targets(keys)
        if len(self.mechanism.inputs) > 1 or targets in self._blocks or self.poses.n <= BLOCK:
            for block in self.blocks(keys):
                form(block)
            return

        def then(i: int) -> None:
            if targets not in self._blocks:
                self._made(targets, [self.poses.along_input], None)
            form(self._blocks[targets][i])

        self.poses.solve(targets, order, then=then)

    @cached_property
    def lost(self) -> NDArray[np.bool_] | None:
        """(n,): the poses that are not assembled; None where all are."""
        there = self.poses.assembled
        return None if there.all() else ~there
