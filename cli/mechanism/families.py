"""The poses of many variants at once, from the formulas with the dimensions as inputs: each as if described alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np

from cli.mechanism import columns, poses
from cli.mechanism.forces import with_forces
from cli.mechanism.read import Inputs
from cli.mechanism.solve import Analysis
from cli.mechanism.tolerance import shown
from virtualwork.family.family import FamilyMotion
from virtualwork.family.part import ASSEMBLED, Part, Solver
from virtualwork.formulas.asked import Key
from virtualwork.formulas.numbers import condition

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from virtualwork.describe.description import Description
    from virtualwork.motion import Motion
    from virtualwork.plan.steps import Joint

# a radicand below which a pose may be a limit: such a variant is described alone, for the marks of its poses
MARKED = 1e-4


class Solved(NamedTuple):
    """The variants of a part.

    Attributes
    ----------
    found : Table or list of documents
        One variant after the other, a row or a document for each pose; of no meaning where a variant is left alone.
    assembled : array (v, n)
    alone : array (v,)
        Which variants are to be described alone.
    """

    found: Any
    assembled: NDArray[np.bool_]
    alone: NDArray[np.bool_]


class Flat(FamilyMotion):
    """Variants × poses as the poses of one motion, one variant after the other: what columns ask of a `Motion`."""

    def __init__(self, solver: Solver, known: dict[Key, Any]) -> None:
        super().__init__(solver.part)
        self._flat, self._solver = known, solver

    def values(self, keys: Sequence[Key]) -> list[Any]:
        """Quantities by their keys, each (v n,)."""
        return [self._flat[key] for key in keys]

    @property
    def mechanism(self) -> Description:
        """What the variants are of."""
        return self.part.mechanism

    @property
    def n(self) -> int:
        """How many poses, of all variants together."""
        v, n = self.part.shape
        return v * n

    @property
    def condition(self) -> NDArray[np.float64]:
        """(v n,): see `Motion.condition`."""
        assert self._solver.written is not None
        loops = self._solver.written.recording.loops
        if loops is None:
            return np.where(self.assembled, 1.0, np.nan)
        found = [self.values(row) for row in of_loops(self._solver)]
        return condition(found, len(loops.angles), self.values([SIZE])[0], self.n)

    @property
    def dynamics(self) -> FlatForces:
        """The forces."""
        assert self._solver.written is not None
        return FlatForces(self, self._solver.written.recording.forces[0])


SIZE: Key = ("size",)


def of_loops(solver: Solver) -> list[list[Key]]:
    """The entries of the Jacobian of all loops."""
    assert solver.written is not None
    loops = solver.written.recording.loops
    if loops is None:
        return []
    unknowns = range(len(loops.angles) + len(loops.slides))
    return [[("column", i, j) for j in unknowns] for i in range(len(loops.closures))]


@dataclass(frozen=True)
class FlatForces:
    """The forces of a `Flat`, as columns ask a motion for them; `reactions` knows the order of the joints."""

    motion: Flat
    reactions: Any

    def solve(self, joints: object) -> None:
        """Nothing: what is asked for has been worked out."""

    def _of(self, *keys: Key) -> Any:
        return np.stack(self.motion.values(keys), axis=1)

    @property
    def effort(self) -> Any:
        """By virtual work, (v n, k)."""
        return self._of(*(("effort", j) for j in range(len(self.motion.part.mechanism.inputs))))

    @property
    def newton_euler(self) -> Any:
        """By the joint forces, (v n, k)."""
        return self._of(*(("newton-euler", j) for j in range(len(self.motion.part.mechanism.inputs))))

    def joint_force(self, joint: Joint, body: str) -> Any:
        """Complex, (v n,)."""
        return self.motion.values([("force", joint.key, body)])[0]

    def joint_moment(self, joint: Joint, body: str) -> Any:
        """(v n,): only guides have one, as nothing rubs."""
        if joint.guide is None:
            return np.zeros(self.motion.n)
        return self.motion.values([("moment", joint.key, body)])[0]

    @property
    def shaking(self) -> tuple[Any, Any]:
        """(v n, 2) and (v n,)."""
        force, moment = self.motion.values([("shaking",), ("shaking moment",)])
        return np.stack([force.real, force.imag], axis=1), moment


@dataclass(frozen=True)
class Families:
    """What is asked of an analysis, of many variants at once.

    Attributes
    ----------
    analysis : Analysis
        Of the mechanism that they are variants of.
    forces : bool
    solver : Solver
        Of some variants: its formulas are those of all.
    json : bool
        Whether the poses' documents are asked for, and no table.
    """

    analysis: Analysis
    forces: bool
    solver: Solver
    json: bool

    @cached_property
    def keys(self) -> list[Key]:
        """The quantities that the table or the documents are of."""
        self.analysis.motions = (cast("Motion", Flat(self.solver, {})),)
        asked = [number.key for number in shown(self.analysis, self.forces)]
        if self.json:
            asked += [number.key for number in shown(self.analysis, False)]
            assert self.solver.written is not None
            asked += [("margin", group.name) for group in self.solver.written.closed]
            if self.analysis.only is None:
                asked += [SIZE, *(key for row in of_loops(self.solver) for key in row)]
        elif self.forces and self.analysis.only is not None:
            # whether they are assembled is asked of the names alone
            places = replace(self.analysis, order=0)
            asked += [number.key for number in shown(places, False)]
        return list(dict.fromkeys(asked))

    @property
    def pays(self) -> bool:
        """Whether the formulas take all that is asked."""
        if self.solver.written is None:
            return False
        if self.forces and not self.solver.takes([("effort", 0), ("newton-euler", 0)]):
            return False
        return self.solver.takes(self.keys)

    def of(self, part: Part) -> Solved:
        """Some variants."""
        solver = Solver(part, self.solver)
        v, n = part.shape
        (there, *values), alone = solver.lanes([ASSEMBLED, *self.keys])
        assembled = np.isfinite(there)
        for d, numbers in zip(part.dimensions, part.values.T, strict=True):
            # of a link without mass there may be something to say
            if self.forces and d.kind in ("mass", "inertia"):
                alone |= numbers == 0
        for key, found in zip(self.keys, values, strict=True):
            if self.json and key[0] == "margin":
                alone |= (np.abs(found) < MARKED).any(axis=1)
        if self.forces:
            for found in values:
                alone |= (assembled & ~np.isfinite(found)).any(axis=1)
        flat = {
            key: found.ravel() for key, found in zip((ASSEMBLED, *self.keys), (there, *values), strict=True)
        }
        motion = Flat(solver, flat)
        analysis = replace(self.analysis, inputs=self._inputs(part), warnings=[])
        analysis.assemblies = self.analysis.assemblies
        analysis.motions = (cast("Motion", motion),)
        whole = analysis.assembled(analysis.motions[0]).reshape(v, n)
        if self.json:
            listed = poses.document(analysis, _unmarked)
            return Solved(with_forces(listed, analysis) if self.forces else listed, whole, alone)
        table = columns.forces(analysis) if self.forces else columns.poses(analysis)
        return Solved(table, whole, alone)

    def _inputs(self, part: Part) -> Inputs:
        """The inputs of all variants, one after the other."""
        v, n = part.shape
        own = self.analysis.inputs
        values = np.broadcast_to(part.inputs, (v, n, part.inputs.shape[2])).reshape(v * n, -1)
        if len(part.inputs) == 1:
            return Inputs(values, np.tile(own.shown, (v, 1)), steps=list(own.steps) * v)
        slides = [e.is_slide for e in part.mechanism.inputs]
        return Inputs(values, np.where(slides, values, np.degrees(values)), steps=list(own.steps) * v)


def _unmarked(analysis: Analysis, motion: Motion) -> list[list[str]]:
    """No marks: variants that may have one are described alone."""
    return [[] for _ in range(motion.n)]
