"""Long sweeps as CSV: a block of poses at a time, so that the disk alone limits how many there are."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from cli.mechanism.columns import column
from cli.show.columns import Table
from cli.show.progress import progress
from virtualwork.formulas.positions import BLOCK, EvenSweep
from virtualwork.motion import Motion

if TYPE_CHECKING:
    from cli.mechanism.solve import Analysis
    from cli.show.columns import Cell


@dataclass
class Stream:
    """A analysis's poses in blocks, every assembly after the other, and what is said of them at the end.

    Attributes
    ----------
    missing : list of (int, int)
        Of each assembly how many poses cannot be assembled, and the first.
    troubles : dict
        What the forces cannot say -> the first inputs where, and at how many poses.
    """

    analysis: Analysis
    form: Callable[[Analysis], Table]
    forces: bool = False
    missing: list[tuple[int, int]] = field(default_factory=list)
    troubles: dict[str, tuple[list[float], int]] = field(default_factory=dict)
    said: dict[str, None] = field(default_factory=dict)

    def blocks(self) -> Iterator[Analysis]:
        """A analysis for each block of poses, with the digits of the sweep solved whole."""
        analysis, q = self.analysis, self.analysis.inputs
        starts = range(0, q.n, BLOCK)
        sweep = EvenSweep(0.0, 0.0, q.n, even=False)
        if len(analysis.mechanism.inputs) == 1:
            first, last = (float(q.part(i, i + 1).values[0, 0]) for i in (0, q.n - 1))
            sweep = EvenSweep(first, last, q.n)
            looked = starts if q.listed else sorted({0, *starts[-2:]})
            sweep.even = all(sweep.off(q.part(i, i + BLOCK).values[:, 0]) is not None for i in looked)
        for assembly in analysis.assemblies:
            if len(analysis.mechanism.inputs) == 1:
                assembly.track.cover(*q.span)
            self.missing.append((0, 0))
            for i in starts:
                block = replace(analysis, inputs=q.part(i, i + BLOCK), warnings=[], block_of=analysis)
                block.assemblies = (assembly,)
                given = block.inputs
                motion = Motion(assembly, given.values, given.speed, given.acceleration, block_of=sweep)
                motion.input_error = float(np.finfo(float).eps) * np.abs(motion.inputs)
                block.motions = (motion,)
                yield block
                gap = ~block.assembled(motion)
                count, at = self.missing[-1]
                self.missing[-1] = count + int(gap.sum()), at if count else i + int(np.argmax(gap))
                if self.forces:
                    self._note(block)

    def _note(self, block: Analysis) -> None:
        from cli.mechanism.remarks import statements, troubles

        for what, places in troubles(block):
            listed, count = self.troubles.get(what, ([], 0))
            self.troubles[what] = [*listed, *places[: 5 - len(listed)]], count + len(places)
        self.said |= dict.fromkeys(statements(block))

    def tables(self) -> Iterator[Table]:
        """The table block by block; all have the columns of the first block and of the guess's own pose."""
        names: list[str] = []
        count = -(-self.analysis.inputs.n // BLOCK) * len(self.analysis.assemblies)
        for block in progress(self.blocks(), count, f"blocks of {BLOCK} poses"):
            table = self.form(block)
            if not names:
                here, home = (
                    [c.header for c in found.columns] for found in (table, self.form(self._home(block)))
                )
                names = max(here, home, key=len)
            columns = {c.header: c for c in table.columns}
            empty: list[Cell] = [None] * len(table.columns[0].values)
            yield replace(table, columns=[columns.get(name) or column(name, empty) for name in names])

    def _home(self, block: Analysis) -> Analysis:
        """The block's first pose, with the inputs where the guess has them: there the mechanism is assembled."""
        first = block.inputs.part(0, 1)
        home = replace(block, inputs=replace(first, values=np.array([self.analysis.mechanism.at])))
        home.assemblies = block.assemblies
        return home

    def warnings(self) -> list[str]:
        """What there is to say once all blocks are done."""
        from cli.mechanism import remarks

        found = self.analysis.warnings + remarks.limits(self.analysis, self.missing)
        if self.forces:
            found += [remarks.listed(self.analysis, what, *at) for what, at in self.troubles.items()]
        return [*found, *self.said]

    @property
    def any_assembled(self) -> bool:
        """Whether some pose could be assembled."""
        return any(count < self.analysis.inputs.n for count, _ in self.missing)
