"""Poses, with their rates or their forces: what `dalembert mechanism` and `dalembert forces` do with every case."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np

from cli.cases import poses, remarks
from cli.cases.analysis import Analysis
from cli.cases.case import Case, Study, like
from cli.show.result import Result, Section, Sheet
from cli.show.terminal import progress
from dalembert.dataclass import dataclass, field, replace
from dalembert.results.columns import Table
from dalembert.results.columns import document as result_document
from dalembert.results.text import heading
from virtualwork.formulas.positions import BLOCK
from virtualwork.motion import Motion

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from cli.cases.case import Rows
    from cli.cases.together import Together
    from cli.show.commands import ShowOptions
    from dalembert.results.columns import Document
    from dalembert.results.way import Topic

METHOD = (
    "Assur groups one after the other, two-link groups in closed form (Chace), larger ones by Newton-Raphson; rates by the "
    "derivatives of the loop equations along the input; effort by virtual work and by Newton and Euler, joint forces by "
    "d'Alembert's principle (R. Ibrahim, Mecanismos, PMR/EPUSP; J. A. Riul, Dinâmica das Máquinas; R. Nicoletti, SEM 104). "
    "Angles are counter-clockwise, reactions are what the link `from` exerts on the link `on`."
)


@dataclass(frozen=True)
class Further:
    """What a command shows in addition to the poses of one mechanism.

    Attributes
    ----------
    tables : dict of name to table
        Those with a place in JSON stand in the document and on the terminal, below the poses.
    words : str
        What the terminal shows below them.
    """

    tables: Mapping[str, Table] = field(default_factory=dict)
    words: str = ""

    @property
    def document(self) -> Document:
        """Beside `poses` in JSON."""
        return result_document(self.tables.values())


@dataclass
class PoseCase(Case):
    """The poses of one mechanism.

    Attributes
    ----------
    missing : list of (int, int)
        How many poses of each assembly cannot be assembled, and the first; filled by `tables`.
    troubles : dict
        What the forces cannot tell -> the first inputs where, and at how many poses.
    """

    study: PoseStudy
    analysis: Analysis
    missing: list[tuple[int, int]] = field(default_factory=list)
    troubles: dict[str, tuple[list[float], int]] = field(default_factory=dict)
    statements: dict[str, None] = field(default_factory=dict)
    there: list[NDArray[np.bool_]] = field(default_factory=list)

    def tables(self, form: Callable[[Analysis], Table] = poses.table) -> Iterator[Table]:
        """The rows of all poses, every assembly after the other; more than a block of them block by block."""
        a = self.analysis
        if not a.is_long:
            yield form(a)
            return
        pattern: Table | None = None
        for block in self._in_blocks():
            table = form(block)
            if pattern is None:
                # of the block and of the guess's own pose the one that is assembled
                pattern = max(table, form(self._at_guess(block)), key=lambda each: len(each.columns))
            yield like(pattern, table)

    def pattern(self) -> Table:
        """The columns of all variants, from the first block of poses."""
        return next(self.tables())

    def _in_blocks(self) -> Iterator[Analysis]:
        """An analysis for each block of poses, with the digits of the sweep solved whole."""
        a, q = self.analysis, self.analysis.inputs
        starts = range(0, q.n, BLOCK)
        self.missing.clear()
        self.there.clear()
        work = ((assembly, i) for assembly in a.assemblies for i in starts)
        for assembly, i in progress(work, len(starts) * len(a.assemblies), f"blocks of {BLOCK} poses"):
            if not i:
                self.missing.append((0, 0))
                if len(a.mechanism.inputs) == 1:
                    assembly.track.cover(*q.span)
            block = replace(a, inputs=q.part(i, i + BLOCK), warnings=[], block_of=a)
            block.assemblies = (assembly,)
            its = block.inputs.whole
            motion = Motion(assembly, its.values, its.speed, its.acceleration, block_of=q.n)
            motion.poses.input_rest = its.rest
            motion.poses.time = its.time
            block.motions = (motion,)
            yield block
            gap = ~block.assembled(motion)
            count, at = self.missing[-1]
            self.missing[-1] = count + int(gap.sum()), at if count else i + int(np.argmax(gap))
            if self.study.names:
                # the rows of a variant tell it one by one
                self.there.append(~gap)
            if a.forces:
                for what, places in remarks.troubles(block):
                    listed, number = self.troubles.get(what, ([], 0))
                    self.troubles[what] = [*listed, *places[: 5 - len(listed)]], number + len(places)
                self.statements |= dict.fromkeys(remarks.statements(block))

    def _at_guess(self, block: Analysis) -> Analysis:
        """The block's first pose, with the inputs where the guess has them: there the mechanism is assembled."""
        first = block.inputs.part(0, 1)
        first_pose = replace(block, inputs=replace(first, values=np.array([self.analysis.mechanism.at])))
        first_pose.assemblies = block.assemblies
        return first_pose

    @cached_property
    def further(self) -> Further:
        """What is shown in addition to the poses."""
        return self.study.further(self.analysis)

    def document(self) -> Document:
        """The poses, and what is shown in addition."""
        return {"poses": poses.documents(self.analysis), **self.further.document}

    def way(self) -> list[Topic]:
        """The worked solution."""
        return self.study.way(self.analysis)

    def warnings(self) -> list[str]:
        """Limits, branches, forces that have no value."""
        a = self.analysis
        lines = [*a.warnings, *remarks.limits(a, self.missing or None)]
        if a.forces and self.missing:
            lines += [remarks.listed(a, what, *at) for what, at in self.troubles.items()]
            lines += self.statements
        elif a.forces:
            lines += remarks.of_forces(a)
        return lines

    def assembled(self, table: Table) -> list[bool] | bool:
        """Of each row of a table whether its pose is assembled, or whether any is."""
        a, rows = self.analysis, len(table.columns[0].values) if table.columns else 0
        if self.missing:
            there = np.concatenate(self.there) if self.there else np.array([], bool)
            return (
                there.tolist()
                if rows and rows == len(there)
                else any(n < a.inputs.n for n, _ in self.missing)
            )
        listed = [pose for motion in a.motions for pose in a.assembled(motion).tolist()]
        return listed if rows == len(listed) else any(listed)


@dataclass(frozen=True)
class PoseStudy(Study):
    """What is done with the poses of every case."""

    method = METHOD

    def further(self, analysis: Analysis) -> Further:
        """What is shown in addition to the poses of one mechanism."""
        return Further()

    def way(self, analysis: Analysis) -> list[Topic]:
        """The worked solution of one mechanism, for --steps."""
        return []

    def figure(self, analysis: Analysis) -> Figure:
        """The picture."""
        raise NotImplementedError

    def warnings(self) -> list[str]:
        """Rates without a speed, forces without a mass or a load."""
        return remarks.without_meaning(self.own, self.names)

    def case(self, row: Rows | None = None) -> PoseCase:
        """A variant, or the mechanism itself."""
        return PoseCase(self, self.analysis(row))

    def together(self, row: Rows, json: bool) -> Together | None:
        """How variants are solved at once."""
        from cli.cases.together import Together
        from virtualwork.family.part import Solver

        if self.request.branch is not None or self.digits or (json and self.beside_each):
            return None
        # a rate that only the variants have makes for more columns
        request = self.request._replace(order=self.analysis(row).order)
        made = Together(replace(self.own, request=request), Solver(self.part(row[None])[0]), json)
        return made if made.pays else None

    def page(self, cases: Sequence[tuple[str, Case]], units: str | None) -> bytes:
        """The page on which every mechanism moves."""
        from cli.cases.page import of_poses

        analyses = [(name, case.analysis) for name, case in cases if isinstance(case, PoseCase)]
        return of_poses(analyses, units, self.bare)

    def in_blocks(self, show: ShowOptions) -> bool:
        """Whether the table alone is written: a block of poses at a time."""
        return show.streams and (show.holds_one or self.own.is_long)

    def check_size(self, show: ShowOptions, times: int) -> None:
        """Refuse more poses than the memory holds."""
        self.own.check_size(json=show.as_json, table=show.needs_table, times=times)

    @property
    def beside_each(self) -> bool:
        """Whether each variant has more than its poses."""
        return False

    def result(self, case: Case) -> Result:
        """The poses of one mechanism, in every form."""
        assert isinstance(case, PoseCase)
        a, further = case.analysis, case.further
        beside: dict[str, Callable[[], Table]] = {
            name: partial(replace, table) for name, table in further.tables.items()
        }
        tables: dict[str, Callable[[], Table]] = {"poses": lambda: poses.table(a), **beside}
        return Result(
            document=lambda: {"name": a.mechanism.name, **case.document()},
            tables=tables,
            expected=(*beside.values(), lambda: poses.by_link(a)),
            notes=lambda: a.mechanism.name,
            afterword=lambda: further.words,
            figure=lambda: self.figure(a),
            method=self.method,
            sheets=lambda: [Sheet("", self.sections(a, tables), lambda: self.figure(a))],
            warnings=case.warnings(),
            failed=lambda: not any(a.assembled(motion).any() for motion in a.motions),
        )

    def sections(self, analysis: Analysis, tables: Mapping[str, Callable[[], Table]]) -> list[Section]:
        """What a report shows: every table."""
        made = {name: table() for name, table in tables.items()}
        # a table without columns is of the JSON document alone
        return [Section(heading(name), [table]) for name, table in made.items() if table.columns]
