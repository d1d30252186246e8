"""The poses of many variants at once, from the formulas with the dimensions as inputs: each as if described alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cli.mechanism import columns, quantities
from cli.mechanism.quantities import keys_of
from cli.mechanism.read import Inputs
from cli.mechanism.solve import Analysis
from virtualwork.family.part import ASSEMBLED, Part, Solver
from virtualwork.formulas.asked import Key
from virtualwork.formulas.numbers import condition

if TYPE_CHECKING:
    from numpy.typing import NDArray

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


SIZE: Key = ("size",)


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

    @property
    def loops(self) -> list[list[Key]]:
        """The entries of the Jacobian of all loops."""
        written = self.solver.written
        if written is None or written.recording.loops is None:
            return []
        loops = written.recording.loops
        unknowns = range(len(loops.angles) + len(loops.slides))
        return [[("column", i, j) for j in unknowns] for i in range(len(loops.closures))]

    @cached_property
    def keys(self) -> list[Key]:
        """The quantities that the table or the documents are of."""
        places, names = quantities.places(self.analysis), self.analysis.only is not None
        forces = quantities.forces(self.analysis) if self.forces else []
        asked = keys_of([*forces, *places] if self.json or not self.forces else forces)
        if self.json:
            assert self.solver.written is not None
            asked += [("margin", group.name) for group in self.solver.written.closed]
            asked += [] if names else [SIZE, *(key for row in self.loops for key in row)]
        elif self.forces and names:
            # whether they are assembled is asked of the names alone
            asked += keys_of(quantities.places(replace(self.analysis, order=0)))
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
                alone |= (assembled & ~np.isfinite(found)).any(axis=1)
        flat = {key: found.ravel() for key, found in zip(self.keys, values, strict=True)}
        analysis = replace(self.analysis, inputs=self._inputs(part), warnings=[])
        analysis.assemblies = self.analysis.assemblies
        whole = assembled.ravel()
        if analysis.only is not None:
            whole = np.logical_and.reduce([np.isfinite(flat[key]) for key in analysis.named], initial=True)
        whole = np.broadcast_to(whole, v * n)
        if not self.json:
            table = columns.table(analysis, self.forces, [flat])
            return Solved(table, whole.reshape(v, n), alone)
        conditions = self._condition(flat, assembled.ravel()) if analysis.only is None else None
        # no marks: variants that may have one are described alone
        marks: list[list[str]] = [[]] * (v * n)
        branch = analysis.assemblies[0].number
        listed = columns.poses_of(analysis, branch, flat, whole, conditions, marks, self.forces)
        return Solved(list(listed), whole.reshape(v, n), alone)

    def _condition(self, found: Mapping[Key, Any], assembled: NDArray[np.bool_]) -> NDArray[np.float64]:
        """(v n,): see `Motion.condition`."""
        assert self.solver.written is not None
        loops = self.solver.written.recording.loops
        if loops is None:
            return np.where(assembled, 1.0, np.nan)
        entries = [[found[key] for key in row] for row in self.loops]
        return condition(entries, len(loops.angles), found[SIZE], len(assembled))

    def _inputs(self, part: Part) -> Inputs:
        """The inputs of all variants, one after the other."""
        v, n = part.shape
        own = self.analysis.inputs
        values = np.broadcast_to(part.inputs, (v, n, part.inputs.shape[2])).reshape(v * n, -1)
        if len(part.inputs) == 1:
            return Inputs(values, np.tile(own.shown, (v, 1)), steps=list(own.steps) * v)
        slides = [e.is_slide for e in part.mechanism.inputs]
        return Inputs(values, np.where(slides, values, np.degrees(values)), steps=list(own.steps) * v)
