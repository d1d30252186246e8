"""The study of poses, with their rates or their forces: what `dalembert mechanism` and `dalembert forces` share.

Many variants are solved together; their tables and documents are those of variants that are solved one by one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from cli.cases import poses, remarks
from cli.cases.analysis import Analysis
from cli.cases.case import AtOnce, Case, Study, like
from cli.cases.cases import with_root
from cli.cases.inputs import Inputs
from dalembert.dataclass import dataclass, field, replace
from dalembert.results.columns import Table
from dalembert.results.columns import document as result_document
from dalembert.results.result import Result, Section, Sheet
from dalembert.results.text import heading
from dalembert.terminal import progress
from virtualwork.formulas.forces import Effort, NewtonEuler
from virtualwork.formulas.loops import Column, Margin, Size
from virtualwork.formulas.numbers import condition
from virtualwork.formulas.positions import BLOCK
from virtualwork.formulas.quantity import Quantity

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cli.cases.case import Together
    from cli.cases.cases import Rows
    from dalembert.results.columns import Document
    from virtualwork.family.part import Part, Solver

IN_A_ROW = 8
"""Quantities that a terminal shows of a single pose in one row."""
METHOD = (
    "Assur groups one after the other, two-link groups in closed form (Chace), larger ones by Newton-Raphson; rates by the "
    "derivatives of the loop equations along the input; effort by virtual work and by Newton and Euler, joint forces by "
    "d'Alembert's principle (R. Ibrahim, Mecanismos, PMR/EPUSP; J. A. Riul, Dinâmica das Máquinas; R. Nicoletti, SEM 104). "
    "Angles are counter-clockwise, reactions are what the link “from” exerts on the link “on”."
)


@dataclass
class PoseCase(Case):
    """The poses of one mechanism.

    Attributes
    ----------
    gaps : list of (int, int)
        For each assembly the number of poses that cannot be assembled, and the first of them; filled by `tables`.
    troubles : dict
        Rates and forces that have no value -> the first inputs where, and the number of poses.
    statements : dict
        Warnings of the forces that hold for all poses.
    whole : list of array
        Which poses of a variant are assembled, block by block.
    """

    study: PoseStudy
    analysis: Analysis
    gaps: list[tuple[int, int]] = field(default_factory=list)
    troubles: dict[str, tuple[list[float], int]] = field(default_factory=dict)
    statements: dict[str, None] = field(default_factory=dict)
    whole: list[NDArray[np.bool_]] = field(default_factory=list)

    # --- its tables -----------------------------------------------------------------------------------------------
    def table(self) -> Table:
        """Return a row for each pose, one assembly after the other."""
        return poses.table(self.analysis)

    def tables(self, form: Callable[[Analysis], Table] = poses.table) -> Iterator[Table]:
        """Yield those rows, block by block where the poses fill more than one block."""
        a = self.analysis
        if a.inputs.n <= BLOCK:
            yield form(a)
            return
        pattern: Table | None = None
        for block in self._blocks():
            table = form(block)
            if pattern is None:
                # the columns of the block, or of the guess's own pose: of that which is assembled
                at_guess = block.at(
                    replace(block.inputs.part(0, 1), values=np.array([a.mechanism.at]), rest=None)
                )
                pattern = max(table, form(at_guess), key=lambda each: len(each.columns))
            yield like(pattern, table)

    def pattern(self) -> Table:
        """Return a table with the columns of all variants: the first block of poses."""
        return next(self.tables())

    def _blocks(self) -> Iterator[Analysis]:
        """Yield an analysis of each block of poses, and note its gaps and troubles."""
        a, q = self.analysis, self.analysis.inputs
        starts = range(0, q.n, BLOCK)
        self.gaps.clear()
        self.whole.clear()
        work = ((assembly, i) for assembly in a.assemblies for i in starts)
        for assembly, i in progress(work, len(starts) * len(a.assemblies), f"blocks of {BLOCK} poses"):
            if not i:
                self.gaps.append((0, 0))
                if len(a.mechanism.inputs) == 1:
                    assembly.track.cover(*q.span)
            block = a.block(assembly, i, i + BLOCK)
            yield block
            gap = ~block.assembled(block.motions[0])
            count, first = self.gaps[-1]
            self.gaps[-1] = count + int(gap.sum()), first if count else i + int(np.argmax(gap))
            if self.study.cases.names:
                # each row of a variant says whether its pose is assembled
                self.whole.append(~gap)
            for what, places in remarks.troubles(block):
                listed, number = self.troubles.get(what, ([], 0))
                self.troubles[what] = [*listed, *places[: 5 - len(listed)]], number + len(places)
            self.statements |= dict.fromkeys(remarks.statements(block))

    @cached_property
    def extra(self) -> dict[str, Table]:
        """The tables that stand below the poses; those with a place in JSON stand in the document."""
        return {}

    def further(self) -> Mapping[str, Callable[[], Table]]:
        """Return the tables that stand below the poses."""
        return {name: partial(self.extra.__getitem__, name) for name in self.extra}

    def afterword(self) -> str:
        """Return what the terminal shows below the tables."""
        return ""

    def document(self) -> Document:
        """Return the poses, and the tables below them."""
        return {"poses": poses.documents(self.analysis), **result_document(self.extra.values())}

    @cached_property
    def masks(self) -> list[NDArray[np.bool_]]:
        """Which poses of each assembly are assembled, where they fill one block."""
        return [self.analysis.assembled(motion) for motion in self.analysis.motions]

    def assembled(self, rows: int = 0) -> list[bool] | bool:
        """Return whether the pose of each row is assembled; where the rows are no poses, whether any is."""
        masks = self.whole if self.gaps else self.masks
        if rows and rows == sum(map(len, masks)):
            return [assembled for mask in masks for assembled in mask.tolist()]
        if self.gaps:
            return any(count < self.analysis.inputs.n for count, _ in self.gaps)
        return any(mask.any() for mask in masks)

    def warnings(self) -> list[str]:
        """Return the warnings of limits, branches, rates and forces that have no value."""
        a = self.analysis
        gaps = self.gaps or [(int((~mask).sum()), int(np.argmax(~mask))) for mask in self.masks]
        lines = [*a.warnings, *remarks.limits(a, gaps)]
        if self.gaps:
            troubles = [remarks.at_places(a, what, *at) for what, at in self.troubles.items()]
            return [*lines, *troubles, *self.statements]
        return [*lines, *remarks.of_poses(a)]

    def result(self) -> Result:
        """Return the result of this mechanism alone, in every form."""
        a = self.analysis
        _ = self.extra  # before the warnings
        result = super().result()
        tables = result.tables
        result.expected = (*self.further().values(), lambda: poses.by_link(a))
        result.afterword = self.afterword
        if a.inputs.n == 1 and len(a.assemblies) == 1 and len(a.tabled) > IN_A_ROW:
            result.screen = lambda: poses.by_owner(a, tables[self.study.title]())
        result.sheets = lambda: [Sheet("", _sections(result), self.figure)]
        return result


def _sections(result: Result) -> list[Section]:
    """Return the sections of a report: every table; one without columns is of the JSON document alone."""
    (first, whole), *others = result.tables.items()
    made = {first: [whole()] if result.screen is None else result.screen()}
    made |= {name: [table()] for name, table in others}
    return [Section(heading(name), tables) for name, tables in made.items() if tables[0].columns]


@dataclass(frozen=True)
class PoseStudy(Study):
    """Solve the poses of every case.

    Attributes
    ----------
    find, so_that : str, optional
        The dimension to find, and the value that a quantity has then.
    """

    find: str | None = None
    so_that: str | None = None

    kind: ClassVar[type[PoseCase]]
    title = "poses"
    method = METHOD
    one_blank_row = False

    @property
    def poses_alone(self) -> bool:
        """Whether a file of tables has the poses and nothing else."""
        return True

    @property
    def extra_in_json(self) -> bool:
        """Whether the JSON document of each variant has more than its poses."""
        return False

    def resolved(self) -> PoseStudy:
        """Return the study with the number that --find seeks."""
        if self.find is None and self.so_that is None:
            return self
        return replace(self, cases=with_root(self.cases, self.find, self.so_that))

    def case(self, analysis: Analysis) -> PoseCase:
        """Return the poses of one mechanism."""
        return self.kind(self, analysis)

    def warnings(self) -> list[str]:
        """Return the warnings of rates without a speed, and forces without a mass or a load."""
        request = self.cases.request
        if not (request.order or request.only or request.forces):
            return []
        return remarks.without_meaning(self.cases.nominal, self.cases.names)

    def together(self, row: Rows, json: bool) -> Together | None:
        """Return the function that solves many variants at once; None where the formulas do not take all."""
        from virtualwork.family.part import Solver

        cases = self.cases
        if cases.request.branch is not None or self.show.digits or (json and self.extra_in_json):
            return None
        # a rate that only the variants have makes for more columns
        request = cases.request._replace(order=cases.analysis(row).order)
        family = PoseFamily(replace(cases.nominal, request=request), Solver(cases.part(row[None])[0]), json)
        return family.solved if family.is_possible else None

    @property
    def in_blocks(self) -> bool:
        """Whether the table alone is written, block by block."""
        show = self.show
        return self.poses_alone and show.streams and (show.holds_one or self.cases.nominal.is_long)

    def check_size(self, times: int) -> None:
        """Refuse more poses than the memory holds."""
        show = self.show
        self.cases.nominal.check_size(json=show.as_json, table=show.needs_table, times=times)

    def page(self, cases: Sequence[tuple[str, Case]], units: Mapping[str, str] | None) -> bytes:
        """Return the page on which every mechanism moves."""
        from cli.cases.picture import page

        analyses = [(name, case.analysis) for name, case in cases if isinstance(case, PoseCase)]
        return page(analyses, units, self.cases.bare)


# --- many variants together: their dimensions enter the recorded formulas as inputs ------------------------------------
# a radicand below which a pose may be a limit: such a variant is solved alone, for the marks of its poses
MARKED = 1e-4


SIZE: Quantity = Size()


@dataclass(frozen=True)
class PoseFamily:
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
        keys = poses.keys_of(poses.in_json(a) if self.json else a.tabled)
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

    def solved(self, part: Part, shown: Rows) -> AtOnce:
        """Solve some variants; `shown`: their inputs as they are shown, (v or 1, n, k)."""
        # loaded where there are variants
        from virtualwork.family.part import ASSEMBLED, Solver

        solver = Solver(part, self.solver)
        v, n = part.shape
        (closed, *values), alone = solver.lanes([ASSEMBLED, *self.keys])
        assembled = np.isfinite(closed)
        # they have a warning
        alone |= solver.open_at_guess
        forces = bool(self.analysis.forces)
        if forces:
            alone |= self._without_mass(part)
        for key, lanes in zip(self.keys, values, strict=True):
            if self.json and isinstance(key, Margin):
                alone |= (np.abs(lanes) < MARKED).any(axis=1)
            alone |= (assembled & ~np.isfinite(lanes)).any(axis=1)
        flat = {key: lanes.ravel() for key, lanes in zip(self.keys, values, strict=True)}
        analysis = self.analysis.at(self._inputs(part, shown))
        whole = assembled.ravel()
        if not analysis.whole:
            whole = np.logical_and.reduce([np.isfinite(flat[key]) for key in analysis.named], initial=True)
        whole = np.broadcast_to(whole, v * n)
        if not self.json:
            return AtOnce(poses.table(analysis, [flat]), whole.reshape(v, n), alone)
        conditions = self._condition(flat, assembled.ravel()) if analysis.request.only is None else None
        # no marks: variants that may have one are solved alone
        marks: list[list[str]] = [[]] * (v * n)
        branch = analysis.assemblies[0].number
        listed = poses.poses_of(analysis, branch, flat, whole, conditions, marks)
        return AtOnce(list(listed), whole.reshape(v, n), alone)

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
            stays = remarks.pinned(m, name, link.center) and not any(
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
