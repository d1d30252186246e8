"""The one loop over cases: a mechanism or its variants, at one input or many, in parts of a fixed number of rows.

A part is some variants at all their inputs, or one variant at a block of them. No number, no refusal and no warning
depends on how many cases there are, nor on which option made them; parts are worked out here, or by processes.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing, suppress
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cli.cases.case import (
    Case,
    Study,
    blank,
    emptied,
    joined,
    length,
    like,
    without_bounds,
)
from cli.cases.inputs import Grid
from cli.read.options import processes
from cli.show.result import Written
from cli.show.terminal import progress
from dalembert.dataclass import dataclass, field, replace
from dalembert.errors import DataError
from dalembert.results.columns import Column, Table
from virtualwork import MechanismError

if TYPE_CHECKING:
    from uuid import UUID

    from numpy.typing import NDArray

    from cli.cases.together import Solved as TogetherSolved
    from cli.cases.together import Together
    from cli.show.result import Form, Part
    from dalembert.results.columns import Document

    Rows = NDArray[np.float64]
    Mask = NDArray[np.bool_]


# variants whose remarks are kept, the first ones, whoever works them out; so many kinds of remark are printed, and of
# each the first so many variants are named
EXPLAINED, KINDS, NAMED = 50, 10, 5


@dataclass
class Remarks:
    """What to remark on variants: each remark once, with the variants that it is about.

    Attributes
    ----------
    kept : list of (variant, its remarks)
        Of the first variants that have any; a name that is empty is that of the mechanism itself.
    further : int
        Variants after these that have remarks too.
    any_assembled : bool
        Whether there is a number of any variant.
    """

    kept: list[tuple[str, tuple[str, ...]]] = field(default_factory=list)
    further: int = 0
    any_assembled: bool = False

    @property
    def full(self) -> bool:
        """Whether no further remark is kept."""
        return len(self.kept) >= EXPLAINED

    def add(self, name: str, remarks: Iterable[str]) -> None:
        """Add the remarks on a variant, which may be none."""
        its = tuple(dict.fromkeys(remarks))
        if its and self.full:
            self.further += 1
        elif its:
            self.kept.append((name, its))

    def join(self, other: Remarks) -> None:
        """Add the remarks on later variants."""
        for name, remarks in other.kept:
            self.add(name, remarks)
        self.further += other.further
        self.any_assembled |= other.any_assembled

    def lines(self) -> list[str]:
        """As they are printed."""
        about: dict[str, list[str]] = {}
        for name, remarks in self.kept:
            for remark in remarks:
                about.setdefault(remark, []).append(name)
        if any(names == [""] for names in about.values()):
            return list(about)
        lines = []
        for remark, names in list(about.items())[:KINDS]:
            more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
            lines.append(f"variant{'s' * (len(names) > 1)} {', '.join(names[:NAMED])}{more}: {remark}")
        printed = set(list(about)[:KINDS])
        further = self.further + sum(printed.isdisjoint(remarks) for _, remarks in self.kept)
        if further:
            lines.append(f"{further} further variant{'s have' if further > 1 else ' has'} remarks too")
        return lines


class Plan(NamedTuple):
    """What all parts of the work have in common.

    Attributes
    ----------
    each : int
        How many variants a part has.
    pattern : Table
        With the columns that all tables have.
    row : array (d,), optional
        The numbers of a variant that can be assembled.
    together : bool
        Whether variants are solved at once.
    lanes : int
        How large the whole is, which the choice of an engine depends on.
    """

    each: int
    pattern: Table = Table([])
    row: Rows | None = None
    together: bool = False
    lanes: int = 0


@dataclass
class Loop:
    """The cases of a call, worked out when they are needed.

    Attributes
    ----------
    varied : Grid, optional
        The variants; None where there is the mechanism alone.
    workers : int
        How many processes.
    """

    study: Study
    varied: Grid | None = None
    workers: int = 1
    remarks: Remarks = field(default_factory=Remarks)

    @property
    def count(self) -> int:
        """How many mechanisms there are."""
        return 1 if self.varied is None else self.varied.n

    def warnings(self) -> list[str]:
        """What to remark on, once all is worked out."""
        return self.remarks.lines()

    def failed(self) -> bool:
        """Whether nothing could be assembled."""
        return not self.remarks.any_assembled

    def rows(self, low: int, high: int) -> Rows:
        """The numbers of the variants from low to high, as they are shown."""
        assert self.varied is not None
        return self.varied.part(low, high).shown

    def blocks(self, form: Form, json: bool = False) -> Iterator[Written]:
        """What is written of the table, or of the documents, part by part, in their order."""
        self.remarks = Remarks()
        if self.varied is None:
            yield from self._alone(form)
            return
        from dalembert.arithmetic.engines import as_part
        from dalembert.arithmetic.parts import LostPart, in_parts

        count, plan = self.count, self.plan(json)
        work: Any = partial(_solved, self.study, plan, form, json)
        if plan.lanes:
            work = partial(as_part, plan.lanes, work)
        each = plan.each
        starts = range(0, count, each)
        some = ((a + 1, self.rows(a, a + each)) for a in starts)
        workers = min(self.workers, len(starts))
        with processes(workers) as pool:
            try:
                with closing(in_parts(work, some, pool, 2 * workers)) as parts:
                    for written, its in progress(parts, count, "variants", each):
                        self.remarks.join(its)
                        yield written
            except LostPart as lost:
                first, last = (lost.number - 1) * each + 1, min(lost.number * each, count)
                raise DataError(
                    f"variants {first} to {last}: the process that solved them died, and died again when it was done once more"
                ) from None

    def _alone(self, form: Form) -> Iterator[Written]:
        """The rows of the mechanism itself, a block of poses at a time."""
        case = self.study.case()
        for i, table in enumerate(case.tables()):
            yield form(table, i)
        there = case.assembled(Table([]))
        self.remarks.any_assembled = there if isinstance(there, bool) else any(there)
        self.remarks.add("", case.warnings())

    def plan(self, json: bool) -> Plan:
        """The first variant that can be assembled, and whether and how many are solved at once."""
        study = self.study
        lanes = self.count * (1 if study.moved is None else study.moved.n)
        for i in range(self.count):
            with suppress(MechanismError):
                row = self.rows(i, i + 1)[0]
                pattern = without_bounds(study.case(row).pattern())
                break
        else:
            return Plan(study.size(json, together=False), lanes=lanes)
        # however few they are: what is refused, and what is remarked, does not depend on how many others there are
        together = study.together(row, json) is not None
        return Plan(study.size(json, together), pattern, row, together, lanes)

    @cached_property
    def table(self) -> Table:
        """All of them, one below the other."""
        # bounds of errors are worked out when they are needed, and cannot be sent
        here = replace(self, workers=1) if self.study.digits else self
        tables = [written.data for written in here.blocks(as_it_is)]
        self.remarks = here.remarks
        return joined([table for table in tables if isinstance(table, Table)])

    @cached_property
    def documents(self) -> list[Document]:
        """What the JSON document has of each variant."""
        parts = (written.data for written in self.blocks(as_it_is, json=True))
        return [document for part in parts if isinstance(part, list) for document in part]

    def every_case(self) -> list[tuple[str, Case]]:
        """Each variant that can be assembled, by its name."""
        if self.varied is None:
            return [("", self.study.case())]
        result = []
        for i in range(self.count):
            with suppress(MechanismError):
                result.append((str(i + 1), self.study.case(self.rows(i, i + 1)[0])))
        return result


class Solved(NamedTuple):
    """What a part gives: what is written of it, and the remarks."""

    written: Written
    remarks: Remarks


def _solved(study: Study, plan: Plan, form: Form, json: bool, first: int, shown: Rows) -> Solved:
    """Work out a part: some variants, which are called from `first` on."""
    part = Variants(study, plan, first, shown)
    return Solved(form(part.documents() if json else part.table(), first - 1), part.remarks)


def as_it_is(part: Part, number: int) -> Written:
    """The form of a part that stays a table, or documents."""
    return Written(part, 0)


_written: dict[tuple[UUID, bool], Together] = {}
"""The formulas of a study, which a process writes down once."""


@dataclass
class Variants:
    """Some variants, which are called from `first` on."""

    study: Study
    plan: Plan
    first: int
    shown: Rows
    remarks: Remarks = field(default_factory=Remarks)

    def one(self, i: int, json: bool, case: Case | None = None, lines: Sequence[str] = ()) -> Any:
        """A variant's document, or its table with which rows are assembled; None where it cannot be assembled."""
        answer: Any = None
        try:
            case = self.study.case(self.shown[i]) if case is None else case
            if json:
                document = case.document()
                answer, there = document, case.assembled(Table([]))
            else:
                table = joined(list(case.tables()))
                there = case.assembled(table)
                answer = table, there
            self.remarks.any_assembled |= there if isinstance(there, bool) else any(there)
            lines = [*lines, *case.warnings()]
        except MechanismError as error:
            answer, lines = None, [*lines, str(error)]
        self.remarks.add(str(self.first + i), lines)
        return answer

    def each(self, json: bool) -> Iterator[Any]:
        """What `one` gives of all of them, one by one."""
        for i, (case, lines) in enumerate(self.study.cases(self.shown)):
            if case is None:
                self.remarks.add(str(self.first + i), lines)
                yield None
            else:
                yield self.one(i, json, case, lines)

    # --- as JSON --------------------------------------------------------------------------------------------------
    def documents(self) -> list[Document]:
        """What JSON has of each; poses of one that cannot be assembled are not assembled."""
        listed: list[Any]
        if self.plan.together:
            poses, assembled, alone = self._together(True)
            v, n = assembled.shape
            listed = [{"poses": poses[i * n : (i + 1) * n]} for i in range(v)]
            for i, document in self._left(assembled, alone, True):
                listed[i] = document
            self.remarks.any_assembled |= bool(assembled[~alone].any())
        else:
            listed = list(self.each(True))
        if any(document is None for document in listed):
            empty: Document = dict(self.study.blank)
            if self.plan.row is not None and not self.study.one_blank_row:
                like_it = Variants(self.study, self.plan, 0, self.plan.row[None]).one(0, True)
                empty = {key: blank(value) for key, value in like_it.items()}
            listed = [empty if document is None else document for document in listed]
        headers = [d.header for d in self.study.dimensions]
        return [
            {"variant": str(self.first + i), "set": dict(zip(headers, row, strict=True)), **document}
            for i, (row, document) in enumerate(
                zip(self.study.numbers(self.shown).tolist(), listed, strict=True)
            )
        ]

    # --- as a table -----------------------------------------------------------------------------------------------
    def table(self) -> Table:
        """The rows of all of them, which tell whether the pose is assembled."""
        pattern = self.plan.pattern
        if self.plan.together:
            return self._table_together()
        tables, rows = [], []
        for answer in self.each(False):
            of, there = self._rows(answer)
            tables.append(of)
            rows.append(there)
        lengths = np.array([length(of) for of in tables])
        below = joined(tables)
        lead = self._lead(lengths, [each for there in rows for each in there])
        table = Table([*lead, *below.columns], self._keys(pattern))
        return table if self.study.digits else without_bounds(table)

    def _rows(self, answer: Any) -> tuple[Table, list[Any]]:
        """The rows of what `one` gives, and of each whether its pose is assembled."""
        pattern = self.plan.pattern
        if not pattern.columns or (answer is None and self.study.one_blank_row):
            columns = pattern.columns or [Column("step", "", [None])]
            pattern = Table([Column(c.name, c.unit, [None]) for c in columns], pattern.keys)
        table, there = (emptied(pattern), False) if answer is None else (like(pattern, answer[0]), answer[1])
        return table, there if isinstance(there, list) else [there] * length(table)

    def _together(self, json: bool) -> TogetherSolved:
        """All of them at once."""
        name = self.study.key, json
        if name not in _written:
            assert self.plan.row is not None
            made = self.study.together(self.plan.row, json)
            assert made is not None
            _written.clear()
            _written[name] = made
        return _written[name].of(*self.study.part(self.shown))

    def _table_together(self) -> Table:
        pattern = self.plan.pattern
        table, assembled, alone = self._together(False)
        v, n = assembled.shape
        columns: list[list[Any]] = [list(c.values) for c in like(pattern, table).columns]
        whole = assembled.ravel().tolist()
        for i, answer in self._left(assembled, alone, False):
            here = slice(i * n, (i + 1) * n)
            its, whole[here] = self._rows(answer)
            for values, column in zip(columns, its.columns, strict=True):
                values[here] = list(column.values)
        self.remarks.any_assembled |= any(whole)
        made = [replace(c, values=values) for c, values in zip(pattern.columns, columns, strict=True)]
        return Table([*self._lead(np.full(v, n), whole), *made], self._keys(pattern))

    def _lead(self, lengths: NDArray[np.intp], assembled: list[Any]) -> list[Column]:
        """The first columns: the variant, its numbers, whether the pose is assembled."""
        every = [str(self.first + i) for i in range(len(self.shown))]
        names = [name for name, n in zip(every, lengths.tolist(), strict=True) for _ in range(n)]
        columns = np.repeat(self.study.numbers(self.shown), lengths, axis=0).T
        lead = [Column("variant", "", names)]
        lead += [Column(d.path, d.unit, x) for d, x in zip(self.study.dimensions, columns, strict=True)]
        return [*lead, Column("assembled", "", assembled)]

    def _keys(self, table: Table) -> tuple[str, ...]:
        return ("variant", *(d.header for d in self.study.dimensions), *table.keys)

    def _left(self, assembled: Mask, alone: Mask, json: bool) -> Iterator[tuple[int, Any]]:
        """Of variants solved together those that are left, as `one` gives them; of others only why poses are missing."""
        for i in np.flatnonzero(alone | ~assembled.all(axis=1)).tolist():
            if not alone[i] and self.remarks.full:
                # its rows are there: only the reason is missing
                self.remarks.further += 1
                continue
            answer = self.one(i, json and bool(alone[i]))
            if alone[i]:
                yield i, answer
