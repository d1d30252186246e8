"""The study of poses, with their rates or their forces: what `dalembert mechanism` and `dalembert forces` share."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property, partial
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from cli.cases import poses, remarks
from cli.cases.analysis import Analysis
from cli.cases.case import Case, Study, like
from cli.cases.cases import Cases, naming
from cli.show.result import Result, Section, Sheet
from cli.show.terminal import progress
from dalembert.dataclass import dataclass, field, replace
from dalembert.errors import DataError
from dalembert.results.columns import Table
from dalembert.results.columns import document as result_document
from dalembert.results.text import heading
from dalembert.units import UNITS, from_si, written
from virtualwork import MechanismError
from virtualwork.formulas.positions import BLOCK

if TYPE_CHECKING:
    from types import SimpleNamespace

    from numpy.typing import NDArray

    from cli.cases.case import Together
    from cli.cases.cases import Rows
    from cli.cases.inputs import Varied
    from cli.read.root_search import Found
    from dalembert.results.columns import Document
    from virtualwork import Mechanism
    from virtualwork.quantities import Component

METHOD = (
    "Assur groups one after the other, two-link groups in closed form (Chace), larger ones by Newton-Raphson; rates by the "
    "derivatives of the loop equations along the input; effort by virtual work and by Newton and Euler, joint forces by "
    "d'Alembert's principle (R. Ibrahim, Mecanismos, PMR/EPUSP; J. A. Riul, Dinâmica das Máquinas; R. Nicoletti, SEM 104). "
    "Angles are counter-clockwise, reactions are what the link `from` exerts on the link `on`."
)


@dataclass
class PoseCase(Case):
    """The poses of one mechanism.

    Attributes
    ----------
    gaps : list of (int, int)
        For each assembly the number of poses that cannot be assembled, and the first of them; filled by `tables`.
    troubles : dict
        Forces that have no value -> the first inputs where, and the number of poses.
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
                at_guess = block.at(replace(block.inputs.part(0, 1), values=np.array([a.mechanism.at])))
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
            if a.request.forces and a.forces:
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
        """Return the warnings of limits, branches, and forces that have no value."""
        a, request = self.analysis, self.study.cases.request
        gaps = self.gaps or [(int((~mask).sum()), int(np.argmax(~mask))) for mask in self.masks]
        lines = [*a.warnings, *remarks.limits(a, gaps)]
        if not request.forces or not a.forces:
            return lines
        if self.gaps:
            troubles = [remarks.listed(a, what, *at) for what, at in self.troubles.items()]
            return [*lines, *troubles, *self.statements]
        return [*lines, *remarks.of_forces(a)]

    def result(self) -> Result:
        """Return the result of this mechanism alone, in every form."""
        a = self.analysis
        _ = self.extra  # before the warnings
        result = super().result()
        tables = result.tables
        result.expected = (*self.further().values(), lambda: poses.by_link(a))
        result.afterword = self.afterword
        result.sheets = lambda: [Sheet("", _sections(tables), self.figure)]
        result.failed = lambda: not self.assembled()
        return result


def _sections(tables: Mapping[str, Callable[[], Table]]) -> list[Section]:
    """Return the sections of a report: every table; one without columns is of the JSON document alone."""
    made = {name: table() for name, table in tables.items()}
    return [Section(heading(name), [table]) for name, table in made.items() if table.columns]


@dataclass(frozen=True)
class PoseStudy(Study):
    """Solve the poses of every case."""

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
        from cli.cases.together import Family
        from virtualwork.family.part import Solver

        cases = self.cases
        if cases.request.branch is not None or self.show.digits or (json and self.extra_in_json):
            return None
        # a rate that only the variants have makes for more columns
        request = cases.request._replace(order=cases.analysis(row).order)
        family = Family(replace(cases.nominal, request=request), Solver(cases.part(row[None])[0]), json)
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

    def page(self, cases: Sequence[tuple[str, Case]], units: str | None) -> bytes:
        """Return the page on which every mechanism moves."""
        from cli.cases.picture import page

        analyses = [(name, case.analysis) for name, case in cases if isinstance(case, PoseCase)]
        return page(analyses, units, self.cases.bare)


# --- --find NAME --so-that QUANTITY=VALUE -----------------------------------------------------------------------------
def with_root(cases: Cases, options: SimpleNamespace) -> tuple[Cases, Found | None]:
    """Return the cases with the number that --find seeks, and that number: the nearest to the file's own.

    Raises
    ------
    typer.BadParameter
        A name or a value means nothing.
    DataError
        No number in reach gives the value.
    """
    if options.find is None and options.so_that is None:
        return cases, None
    from cli.cases.axes import dimension_named
    from cli.cases.inputs import of_one, with_numbers
    from cli.read import root_search
    from cli.read.options import bad

    if cases.varied is not None or cases.poses > 1:
        raise bad("--find", "expected one pose of one mechanism, such as --at 60deg")
    m, bare = cases.mechanism, cases.bare
    with naming(cases.request.file):
        pair = root_search.pair(options.find, options.so_that)
        assert pair is not None
        name, wanted = pair
        dimension = dimension_named(m, name, name, "--find")
        word, text = root_search.quantity_and_value(wanted, "B.vx=3m_s")
        request = cases.request._replace(only=[word], order=None)

        def analysis(mechanism: Mechanism) -> Analysis:
            return Analysis(request, mechanism, of_one(mechanism, cases.moved))

        nominal = analysis(m)
        nominal.check_names()
        components = [each for each in nominal.tabled if word in each.names]
        if len(components) != 1:
            names = ", ".join(dict.fromkeys(n for each in nominal.tabled for n in each.names[:1]))
            raise bad("--so-that", f"'{word}': expected one number: {names}")
        (component,) = components
        target, unit = _target(component, text, bare)

        def value(x: float) -> float | None:
            try:
                return poses.number_at(analysis(with_numbers(m, [dimension.of], [x])), component)
            except (MechanismError, DataError):
                return None

        own = float(m.value(dimension.label).real)
        start = 0.0 if own != own else math.degrees(own) if dimension.unit == "deg" else own
        sought = root_search.Sought(dimension.of.header, dimension.unit, start)
        root = root_search.search(
            name, sought, root_search.Goal(word, unit, target, bool(component.link)), value
        )
        solved = with_numbers(m, [dimension.of], [root])
    text = f"{name} = {_in_unit_of_file(dimension, root, bare)} gives {word} = {root_search.amount(target, unit)}"
    return replace(cases, mechanism=solved), root_search.Found(sought.header, root, text)


def _in_unit_of_file(dimension: Varied, shown: float, bare: Mapping[str, str]) -> str:
    """Return a number in the file's own unit."""
    unit = bare.get("length", dimension.unit) if dimension.kind == "length" else dimension.unit
    if dimension.kind == "length" and unit in UNITS["length"]:
        return f"{float(from_si(shown, 'length', unit)):.10g} {written(unit)}"
    if dimension.unit == "deg":
        return f"{shown:.10g}°"
    return f"{shown:.10g} {written(dimension.unit)}".rstrip()


def _target(component: Component, text: str, bare: Mapping[str, str]) -> tuple[float, str]:
    """Return the value that --so-that names, in the unit that the quantity is shown in, and that unit."""
    from cli.cases.axes import place_or_angle
    from cli.read.root_search import value_in

    unit = poses.column(component.header, []).unit
    kind = {"deg": "angle", "m": "length"}.get(unit)
    return (value_in(unit, text) if kind is None else place_or_angle(text, kind, "--so-that", bare)), unit
