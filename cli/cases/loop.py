"""The one loop over cases: a mechanism or its variants, at one input or many, in parts of a fixed number of rows.

A part is some variants at all their inputs, or one variant at a block of them. No number, no refusal and no warning
depends on the number of cases, nor on the option that made them. Parts are computed here, or by worker processes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import closing, suppress
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cli.cases.case import AtOnce, Case, Study, emptied, joined, length, like, unassembled, without_errors
from cli.cases.cases import naming
from cli.cases.remarks import Remarks
from cli.read.options import bad, processes
from cli.read.root_search import with_found
from dalembert.dataclass import dataclass, field, replace
from dalembert.errors import DataError
from dalembert.results.columns import Column, Table
from dalembert.results.result import Result, Written
from dalembert.terminal import progress
from virtualwork import MechanismError

if TYPE_CHECKING:
    from types import SimpleNamespace
    from uuid import UUID

    from numpy.typing import NDArray

    from cli.cases.case import Together
    from cli.cases.cases import Rows
    from dalembert.results.columns import Document
    from dalembert.results.result import Form, Part
    from dalembert.results.way import Topic

    Mask = NDArray[np.bool_]


def result(study: Study, options: SimpleNamespace) -> Result:
    """Return the result of a study of all its cases, in the requested forms."""
    values = vars(options)
    page = values.get("page")
    with naming(study.cases.request.file):
        study = study.resolved()
        cases, show = study.cases, study.show
        cases.nominal.check_names()
        loop = Loop(study, values.get("workers") or 1)
        warnings = [*cases.warnings, *study.warnings()]
        if page is not None:
            from cli.read.options import refuse_long

            refuse_long(study.frames * cases.count)
        if cases.varied is not None:
            if show.plot is not None:
                raise bad(
                    "--plot",
                    "expected one mechanism: --set NAME=VALUE makes one, --page draws several variants",
                )
            result = _of_variants(loop, warnings)
        elif study.in_blocks:
            result = Result(
                blocks=loop.blocks,
                beside=study.files(),
                warnings=warnings,
                late_warnings=loop.remarks.lines,
                failed=loop.remarks.failed,
            )
        else:
            study.check_size(1)
            result = study.case(cases.nominal).result()
            result.warnings = [*warnings, *result.warnings]
    if page is not None:
        result.beside = {**result.beside, page: lambda: study.page(loop.by_name(), show.chosen_units)}
    if cases.found is not None:
        result = with_found(result, cases.found)
    if show.steps:
        result.way = lambda: _way(loop)
    result.about = {"title": cases.mechanism.name or "Mechanism", **cases.about}
    result.within = partial(naming, cases.request.file)
    return result


def _of_variants(loop: Loop, warnings: list[str]) -> Result:
    """Return the result of all variants: one table or document, written part by part, or all requested forms at once."""
    show, name = loop.study.show, loop.study.cases.mechanism.name
    if show.streams or show.streams_json:
        return Result(
            document=lambda: {"name": name},
            blocks=partial(loop.blocks, json=show.streams_json),
            blocks_name="variants",
            warnings=warnings,
            late_warnings=loop.remarks.lines,
            failed=loop.remarks.failed,
        )
    loop.study.check_size(loop.study.cases.count)
    # the document has the warnings too: all is computed before them
    _ = (show.as_json and loop.documents), (show.needs_table and loop.table)
    return Result(
        document=lambda: {"name": name, "variants": loop.documents},
        tables={"variants": lambda: loop.table},
        notes=lambda: name,
        method=loop.study.method,
        warnings=[*warnings, *loop.remarks.lines()],
        failed=loop.remarks.failed,
    )


def _way(loop: Loop) -> list[Topic]:
    """Return the worked solution of every mechanism; a topic names its variant."""
    topics = []
    for name, case in loop.by_name():
        for topic in case.way():
            if name:
                title = f"Variant {name}: {topic.heading}"
                topic = replace(topic, head={"variant": name, **topic.head}, title=title)
            topics.append(topic)
    return topics


class Plan(NamedTuple):
    """What all parts have in common.

    Attributes
    ----------
    size : int
        The number of variants of a part.
    pattern : Table
        A table with the columns that all tables have.
    row : array (d,), optional
        The numbers of a variant that can be assembled.
    together : bool
        Whether variants are solved at once.
    lanes : int
        The number of poses of all variants, which decides the choice of an engine.
    """

    size: int
    pattern: Table = Table([])
    row: Rows | None = None
    together: bool = False
    lanes: int = 0


@dataclass
class Loop:
    """All cases of a study, computed when they are needed.

    Attributes
    ----------
    workers : int
        The number of processes.
    """

    study: Study
    workers: int = 1
    remarks: Remarks = field(default_factory=Remarks)

    def blocks(self, form: Form, json: bool = False) -> Iterator[Written]:
        """Yield what is written of the table, or of the documents, part by part, in their order."""
        self.remarks.clear()
        if self.study.cases.varied is None:
            yield from self._alone(form)
            return
        from dalembert.arithmetic.engines import as_part
        from dalembert.arithmetic.parts import LostPart, in_parts

        cases, plan = self.study.cases, self.plan(json)
        count, size = cases.count, plan.size
        work: Any = partial(_solved, self.study, plan, form, json)
        if plan.lanes:
            work = partial(as_part, plan.lanes, work)
        starts = range(0, count, size)
        tasks = ((low + 1, cases.rows(low, low + size)) for low in starts)
        workers = min(self.workers, len(starts))
        with processes(workers) as pool:
            try:
                with closing(in_parts(work, tasks, pool, 2 * workers)) as parts:
                    for written, remarks in progress(parts, count, "variants", size):
                        self.remarks.join(remarks)
                        yield written
            except LostPart as lost:
                first, last = (lost.number - 1) * size + 1, min(lost.number * size, count)
                raise DataError(
                    f"variants {first} to {last}: the process that solved them died twice"
                ) from None

    def _alone(self, form: Form) -> Iterator[Written]:
        """Yield the rows of the mechanism itself, a block of poses at a time."""
        case = self.study.case(self.study.cases.nominal)
        for i, table in enumerate(case.tables()):
            yield form(table, i)
        self.remarks.add("", case.warnings(), case.assembled())

    def plan(self, json: bool) -> Plan:
        """Find the first variant that can be assembled, and how many are solved at once."""
        study, cases = self.study, self.study.cases
        lanes = cases.count * cases.poses
        for i in range(cases.count):
            with suppress(MechanismError):
                row = cases.rows(i, i + 1)[0]
                pattern = without_errors(study.case(cases.analysis(row)).pattern())
                break
        else:
            return Plan(study.size(json, together=False), lanes=lanes)
        # however few they are: refusals and warnings do not depend on the number of variants
        together = _together(study, row, json) is not None
        return Plan(study.size(json, together), pattern, row, together, lanes)

    @cached_property
    def table(self) -> Table:
        """All tables, one below the other."""
        # errors of numbers are computed when they are needed, and cannot be sent
        loop = replace(self, workers=1) if self.study.show.digits else self
        tables = [written.data for written in loop.blocks(unchanged)]
        return joined([table for table in tables if isinstance(table, Table)])

    @cached_property
    def documents(self) -> list[Document]:
        """The JSON document of each variant."""
        parts = (written.data for written in self.blocks(unchanged, json=True))
        return [document for part in parts if isinstance(part, list) for document in part]

    def by_name(self) -> list[tuple[str, Case]]:
        """Return each variant that can be assembled, by its name; the mechanism itself has none."""
        cases = self.study.cases
        if cases.varied is None:
            return [("", self.study.case(cases.nominal))]
        result = []
        for i in range(cases.count):
            with suppress(MechanismError):
                analysis = cases.analysis(cases.rows(i, i + 1)[0])
                result.append((str(i + 1), self.study.case(analysis)))
        return result


class WrittenPart(NamedTuple):
    """What is written of a part, and its remarks."""

    written: Written
    remarks: Remarks


def _solved(study: Study, plan: Plan, form: Form, json: bool, first: int, rows: Rows) -> WrittenPart:
    """Solve a part: some variants, named from `first` on."""
    part = Variants(study, plan, first, rows)
    return WrittenPart(form(part.documents() if json else part.table(), first - 1), part.remarks)


def unchanged(part: Part, number: int) -> Written:
    """Return a part as a table, or as documents."""
    return Written(part, 0)


_kept: dict[tuple[UUID, bool], Together | None] = {}


def _together(study: Study, row: Rows, json: bool) -> Together | None:
    """Return the function that solves the variants of a study at once: a process records its formulas once."""
    name = study.key, json
    if name not in _kept:
        _kept.clear()
        _kept[name] = study.together(row, json)
    return _kept[name]


@dataclass
class Variants:
    """Some variants, named from `first` on."""

    study: Study
    plan: Plan
    first: int
    rows: Rows
    remarks: Remarks = field(default_factory=Remarks)

    def one(self, i: int, json: bool, case: Case | None = None, warnings: Sequence[str] = ()) -> Any:
        """Return a variant's document, or its table and which rows are assembled; None where it cannot be assembled."""
        answer: Any = None
        assembled: list[bool] | bool = False
        try:
            case = self.study.case(self.study.cases.analysis(self.rows[i])) if case is None else case
            if json:
                answer = case.document()
                assembled = case.assembled()
            else:
                table = joined(list(case.tables()))
                assembled = case.assembled(length(table))
                answer = table, assembled
            warnings = [*warnings, *case.warnings()]
        except MechanismError as error:
            answer, warnings = None, [*warnings, str(error)]
        self.remarks.add(str(self.first + i), warnings, assembled)
        return answer

    def each(self, json: bool) -> Iterator[Any]:
        """Yield the answer of `one` for all of them."""
        for i, (case, warnings) in enumerate(self.study.each(self.rows)):
            if case is None:
                self.remarks.add(str(self.first + i), warnings, False)
                yield None
            else:
                yield self.one(i, json, case, warnings)

    # --- as JSON --------------------------------------------------------------------------------------------------
    def documents(self) -> list[Document]:
        """Return the JSON document of each; the poses of one that cannot be assembled are not assembled."""
        cases, listed = self.study.cases, list[Any]()
        if self.plan.together:
            poses, assembled, alone = self.at_once(True)
            v, n = assembled.shape
            listed = [{"poses": poses[i * n : (i + 1) * n]} for i in range(v)]
            for i, document in self.left(assembled, alone, True):
                listed[i] = document
            self.remarks.any_assembled |= bool(assembled[~alone].any())
        else:
            listed = list(self.each(True))
        if any(document is None for document in listed):
            empty: Document = dict(self.study.blank)
            if self.plan.row is not None and not self.study.one_blank_row:
                other = Variants(self.study, self.plan, 0, self.plan.row[None]).one(0, True)
                # that variant too may lack what was requested: a loop for --newton
                empty = {key: unassembled(value) for key, value in (other or empty).items()}
            listed = [empty if document is None else document for document in listed]
        headers = [d.header for d in cases.dimensions]
        return [
            {"variant": str(self.first + i), "set": dict(zip(headers, row, strict=True)), **document}
            for i, (row, document) in enumerate(
                zip(cases.numbers(self.rows)["shown"].tolist(), listed, strict=True)
            )
        ]

    # --- as a table -----------------------------------------------------------------------------------------------
    def table(self) -> Table:
        """Return the rows of all of them, with a column that says whether the pose is assembled."""
        pattern = self.plan.pattern
        if self.plan.together:
            below, lengths, whole = self._table_at_once()
        else:
            parts = [self._rows(answer) for answer in self.each(False)]
            lengths = np.array([length(table) for table, _ in parts])
            whole = [row for _, rows in parts for row in rows]
            below = joined([table for table, _ in parts])
        names = [str(self.first + i) for i, n in enumerate(lengths.tolist()) for _ in range(n)]
        dimensions = self.study.cases.dimensions
        numbers = np.repeat(self.study.cases.numbers(self.rows)["shown"], lengths, axis=0).T
        lead = [
            Column("variant", "", names),
            *(Column(d.path, d.unit, x) for d, x in zip(dimensions, numbers, strict=True)),
            Column("assembled", "", whole),
        ]
        keys = ("variant", *(d.header for d in dimensions), *pattern.keys)
        table = Table([*lead, *below.columns], keys)
        return table if self.study.show.digits else without_errors(table)

    def _rows(self, answer: Any) -> tuple[Table, list[Any]]:
        """Return the rows of an answer of `one`, and of each whether its pose is assembled."""
        pattern = self.plan.pattern
        if not pattern.columns or (answer is None and self.study.one_blank_row):
            columns = pattern.columns or [Column("step", "", [None])]
            pattern = Table([Column(c.name, c.unit, [None]) for c in columns], pattern.keys)
        table, whole = (emptied(pattern), False) if answer is None else (like(pattern, answer[0]), answer[1])
        return table, whole if isinstance(whole, list) else [whole] * length(table)

    def _table_at_once(self) -> tuple[Table, NDArray[np.intp], list[Any]]:
        """Return the rows of variants that are solved at once, the number of each one's rows, and which are assembled."""
        pattern = self.plan.pattern
        table, assembled, alone = self.at_once(False)
        v, n = assembled.shape
        columns: list[list[Any]] = [list(c.values) for c in like(pattern, table).columns]
        whole = assembled.ravel().tolist()
        for i, answer in self.left(assembled, alone, False):
            place = slice(i * n, (i + 1) * n)
            rows, whole[place] = self._rows(answer)
            for values, column in zip(columns, rows.columns, strict=True):
                values[place] = list(column.values)
        self.remarks.any_assembled |= any(whole)
        made = [replace(c, values=values) for c, values in zip(pattern.columns, columns, strict=True)]
        return Table(made, pattern.keys), np.full(v, n), whole

    # --- at once --------------------------------------------------------------------------------------------------
    def at_once(self, json: bool) -> AtOnce:
        """Solve all of them at once."""
        assert self.plan.row is not None
        together = _together(self.study, self.plan.row, json)
        assert together is not None
        return together(*self.study.cases.part(self.rows))

    def left(self, assembled: Mask, alone: Mask, json: bool) -> Iterator[tuple[int, Any]]:
        """Yield the answers of `one` for variants that were left alone; for others only note why poses are missing."""
        for i in np.flatnonzero(alone | ~assembled.all(axis=1)).tolist():
            if not alone[i] and self.remarks.full:
                # its rows are there: only the reason is missing
                self.remarks.further += 1
                continue
            answer = self.one(i, json and bool(alone[i]))
            if alone[i]:
                yield i, answer
