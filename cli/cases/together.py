"""Many variants solved together: their dimensions enter the recorded formulas as inputs.

Tables and documents are those of variants that are solved one by one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cli.cases import poses
from cli.cases.analysis import Analysis
from cli.cases.inputs import Inputs
from cli.cases.poses import keys_of
from cli.cases.remarks import pinned
from virtualwork.family.part import ASSEMBLED, Part, Solver
from virtualwork.formulas.forces import Effort, NewtonEuler
from virtualwork.formulas.loops import Column, Margin, Size
from virtualwork.formulas.numbers import condition
from virtualwork.formulas.quantity import Quantity

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Rows = NDArray[np.float64]

# a radicand below which a pose may be a limit: such a variant is solved alone, for the marks of its poses
MARKED = 1e-4


class Solved(NamedTuple):
    """The variants of a part.

    Attributes
    ----------
    answer : Table or list of documents
        One variant after the other, a row or a document for each pose; without meaning where a variant is left alone.
    assembled : array (v, n)
    alone : array (v,)
        The variants that have to be solved one by one.
    """

    answer: Any
    assembled: NDArray[np.bool_]
    alone: NDArray[np.bool_]


SIZE: Quantity = Size()


@dataclass(frozen=True)
class Family:
    """A family of variants, and the quantities that are requested of it.

    Attributes
    ----------
    analysis : Analysis
        The analysis of the mechanism itself.
    solver : Solver
        The solver of some variants: its formulas are those of all.
    json : bool
        Whether documents are formed, and no table.
    """

    analysis: Analysis
    solver: Solver
    json: bool

    @property
    def loops(self) -> list[list[Quantity]]:
        """The entries of the Jacobian of all loops."""
        written = self.solver.written
        if written is None or written.recording.loops is None:
            return []
        loops = written.recording.loops
        unknowns = range(len(loops.angles) + len(loops.slides))
        return [[Column(i, j) for j in unknowns] for i in range(len(loops.closures))]

    @cached_property
    def keys(self) -> list[Quantity]:
        """The quantities of the table or the documents."""
        a = self.analysis
        keys = keys_of(poses.in_json(a) if self.json else a.tabled)
        if self.json:
            assert self.solver.written is not None
            keys += [Margin(group.name) for group in self.solver.written.closed]
            keys += [] if a.request.only is not None else [SIZE, *(key for row in self.loops for key in row)]
        # with --only the requested names alone decide whether a pose is assembled
        keys += [] if a.whole else a.named
        return list(dict.fromkeys(keys))

    @property
    def is_possible(self) -> bool:
        """Whether the formulas take all that is requested."""
        if self.solver.written is None:
            return False
        if self.analysis.forces and not self.solver.takes([Effort(0), NewtonEuler(0)]):
            return False
        return self.solver.takes(self.keys)

    def solved(self, part: Part, shown: Rows) -> Solved:
        """Solve some variants; `shown`: their inputs as they are shown, (v or 1, n, k)."""
        solver = Solver(part, self.solver)
        v, n = part.shape
        (there, *values), alone = solver.lanes([ASSEMBLED, *self.keys])
        assembled = np.isfinite(there)
        # they have a warning
        alone |= solver.open_at_guess
        forces = bool(self.analysis.forces)
        if forces:
            alone |= self._without_mass(part)
        for key, lanes in zip(self.keys, values, strict=True):
            if self.json and isinstance(key, Margin):
                alone |= (np.abs(lanes) < MARKED).any(axis=1)
            if forces:
                alone |= (assembled & ~np.isfinite(lanes)).any(axis=1)
        flat = {key: lanes.ravel() for key, lanes in zip(self.keys, values, strict=True)}
        analysis = self.analysis.at(self._inputs(part, shown))
        whole = assembled.ravel()
        if not analysis.whole:
            whole = np.logical_and.reduce([np.isfinite(flat[key]) for key in analysis.named], initial=True)
        whole = np.broadcast_to(whole, v * n)
        if not self.json:
            return Solved(poses.table(analysis, [flat]), whole.reshape(v, n), alone)
        conditions = self._condition(flat, assembled.ravel()) if analysis.request.only is None else None
        # no marks: variants that may have one are solved alone
        marks: list[list[str]] = [[]] * (v * n)
        branch = analysis.assemblies[0].number
        listed = poses.poses_of(analysis, branch, flat, whole, conditions, marks)
        return Solved(list(listed), whole.reshape(v, n), alone)

    def _condition(self, lanes: Mapping[Quantity, Any], assembled: NDArray[np.bool_]) -> NDArray[np.float64]:
        """Return the condition of each pose, (v n,); see `Motion.condition`."""
        assert self.solver.written is not None
        loops = self.solver.written.recording.loops
        if loops is None:
            return np.where(assembled, 1.0, np.nan)
        entries = [[lanes[key] for key in row] for row in self.loops]
        return condition(entries, len(loops.angles), lanes[SIZE], len(assembled))

    def _without_mass(self, part: Part) -> NDArray[np.bool_]:
        """Return which variants have a link with an inertia and no mass whose centre may move, (v,)."""
        m, varied = part.mechanism, {d.where: i for i, d in enumerate(part.dimensions)}
        bodies = np.zeros(part.shape[0], dtype=bool)
        for name, link in m.links.items():
            mass, inertia = (
                part.values[:, varied[where]] if where in varied else np.full(len(bodies), number)
                for where, number in (
                    (("links", name, "mass"), link.mass),
                    (("links", name, "inertia"), link.inertia),
                )
            )
            stays = pinned(m, name, link.center) and not any(
                where[:2] == ("links", name) and where[2] not in ("mass", "inertia") for where in varied
            )
            if not stays:
                bodies |= (mass == 0) & (inertia != 0)
        return bodies

    def _inputs(self, part: Part, shown: Rows) -> Inputs:
        """Return the inputs of all variants, one after the other."""
        v, n = part.shape
        si, cells = (np.broadcast_to(x, (v, n, x.shape[2])).reshape(v * n, -1) for x in (part.inputs, shown))
        return Inputs(si, cells, steps=list(self.analysis.inputs.whole.steps) * v)
