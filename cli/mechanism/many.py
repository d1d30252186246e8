"""Many variants of one mechanism as one result: every row begins with the variant, and says whether it is assembled.

They are solved in parts of fixed size, here or by processes: those that the formulas take together at once, the others, and
what is more than rows of poses or forces, one by one.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cli.mechanism.asked import Asked, Said
from cli.mechanism.families import Families
from cli.mechanism.parted import Solved, solved
from cli.mechanism.solve import Analysis
from cli.mechanism.variants import Variants
from cli.show.columns import Column, Result, Table, Written
from dalembert.arithmetic.engines import as_part

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cli.show.columns import Cell, Document, Form, Part

# variants from which on it pays to write the formulas down; rows of a part solved together, and variants and rows of one
# solved one by one, of a table and of documents, where a row takes some kilobytes; variants of a part that are described
# alone only to say why poses are not assembled
FEW, TOGETHER, ONE_BY_ONE, EXPLAINED = 32, (1 << 16, 1 << 12), (64, (1 << 14, 1 << 12)), 50


def one(asked: Asked, row: NDArray[np.float64], name: str, json: bool, said: Said) -> Any:
    """A variant's document, or its table with which poses are assembled; None where it cannot be put together."""
    from virtualwork import MechanismError

    try:
        analysis = asked.variant(row)
        result = asked.result(analysis)
        if json:
            found: Any = result.document()
        else:
            table = next(iter(result.tables.values()))()
            found = table, _rows_assembled(table, analysis)
        said.any_assembled |= not result.failed()
        remarks = result.warnings
    except MechanismError as error:
        found, remarks = None, [str(error)]
    for remark in dict.fromkeys(remarks):
        said.add(remark, [name])
    return found


def documents(
    asked: Asked, home: NDArray[np.float64] | None, form: Form, first: int, shown: NDArray[np.float64]
) -> Solved:
    """The documents of some variants, which are called from `first` on; `home`: one that can be put together."""
    said = Said()
    found = [one(asked, row, str(first + i), True, said) for i, row in enumerate(shown)]
    return Solved(form(_named(asked, home, first, shown, found), first - 1), said)


def documents_together(
    asked: Asked, home: NDArray[np.float64] | None, form: Form, first: int, shown: NDArray[np.float64]
) -> Solved:
    """The same, of variants that are solved at once."""
    said = Said()
    listed, assembled, alone = _families(asked, shown, True).of(asked.part(shown))
    v, n = assembled.shape
    found: list[Any] = [{"poses": listed[i * n : (i + 1) * n]} for i in range(v)]
    for i, document in _alone(asked, first, shown, assembled, alone, True, said):
        found[i] = document
    said.any_assembled |= bool(assembled[~alone].any())
    return Solved(form(_named(asked, home, first, shown, found), first - 1), said)


def _named(
    asked: Asked,
    home: NDArray[np.float64] | None,
    first: int,
    shown: NDArray[np.float64],
    found: list[Any],
) -> list[Document]:
    """The documents with the variants' names and numbers; None is one that cannot be put together."""
    blank: list[Any] = []
    if home is not None and any(d is None for d in found):
        blank = _blank(one(asked, home, "", True, Said())["poses"])
    return [
        {"variant": str(first + i), "set": asked.set(row)}
        | ({"poses": blank} if d is None else {k: v for k, v in d.items() if k != "name"})
        for i, (row, d) in enumerate(zip(shown, found, strict=True))
    ]


def _alone(
    asked: Asked,
    first: int,
    shown: NDArray[np.float64],
    assembled: NDArray[np.bool_],
    alone: NDArray[np.bool_],
    json: bool,
    said: Said,
) -> Iterator[tuple[int, Any]]:
    """Of variants solved together those that are left, as `one` gives them; of others it is said why poses are missing."""
    told = 0
    for i in np.flatnonzero(alone | ~assembled.all(axis=1)).tolist():
        if not alone[i]:
            # its rows are there: only why poses are not is still to be said
            if told >= EXPLAINED:
                said.further += 1
                continue
            told += 1
        found = one(asked, shown[i], str(first + i), json and bool(alone[i]), said)
        if alone[i]:
            yield i, found


def rows(asked: Asked, pattern: Table, form: Form, first: int, shown: NDArray[np.float64]) -> Solved:
    """The rows of some variants, with the columns of a pattern."""
    said = Said()
    parts: list[tuple[Table, list[bool] | bool]] = []
    for i, row in enumerate(shown):
        found = one(asked, row, str(first + i), False, said)
        parts.append((empty(pattern), False) if found is None else (like(pattern, found[0]), found[1]))
    tables = [
        _with_variant(asked, str(first + i), row, *part)
        for i, (row, part) in enumerate(zip(shown, parts, strict=True))
    ]
    table = joined(tables)
    if not asked.digits:
        table = replace(table, columns=[replace(c, error=None) for c in table.columns])
    return Solved(form(table, first - 1), said)


def rows_together(asked: Asked, pattern: Table, form: Form, first: int, shown: NDArray[np.float64]) -> Solved:
    """The same, of variants that are solved at once."""
    table, assembled, alone = _families(asked, shown, False).of(asked.part(shown))
    said = Said()
    v, n = assembled.shape
    columns: list[list[Any]] = [list(c.values) for c in like(pattern, table).columns]
    whole = assembled.ravel().tolist()
    for i, found in _alone(asked, first, shown, assembled, alone, False, said):
        here = slice(i * n, (i + 1) * n)
        its, there = (empty(pattern), False) if found is None else found
        for values, column in zip(columns, like(pattern, its).columns, strict=True):
            values[here] = list(column.values)
        whole[here] = there if isinstance(there, list) else [there] * n
    said.any_assembled |= any(whole)
    names = [str(first + i) for i in range(v) for _ in range(n)]
    given = [Column(d.path, d.unit, np.repeat(c, n)) for d, c in zip(asked.dimensions, shown.T, strict=True)]
    made = [replace(c, values=values, error=None) for c, values in zip(pattern.columns, columns, strict=True)]
    front = [Column("variant", "", names), *given, Column("assembled", "", whole)]
    return Solved(form(Table([*front, *made], _keys(asked, pattern)), first - 1), said)


@dataclass
class Many:
    """The variants, solved when they are asked for.

    Attributes
    ----------
    workers : int
        How many processes.
    """

    asked: Asked
    variants: Variants
    workers: int = 1
    said: Said = field(default_factory=Said)

    def _solved(self, function: Any, each: int) -> Iterator[Any]:
        """What a function gives of all parts, in their order, each of so many variants."""
        self.said = Said()
        return solved(function, self.variants, each, self.workers, self.said)

    def analyses(self) -> list[tuple[str, Analysis]]:
        """What is asked of each variant whose parts can be put together."""
        from virtualwork import MechanismError

        found = []
        for i in range(self.variants.count):
            try:
                found.append((str(i + 1), self.asked.variant(self.variants.part(i, i + 1)[0])))
            except MechanismError as error:
                self.said.add(str(error), [str(i + 1)])
        return found

    # --- in parts ---------------------------------------------------------------------------------------------
    def _first(self, json: bool) -> tuple[NDArray[np.float64], Any] | None:
        """The first variant that can be put together, its numbers and what `one` gives of it."""
        for i in range(self.variants.count):
            (row,) = self.variants.part(i, i + 1)
            found = one(self.asked, row, "", json, Said())
            if found is not None:
                return row, found
        return None

    def blocks(self, form: Form, json: bool = False) -> Iterator[Written]:
        """What is written of the table, or of the documents, part by part."""
        count, whole = self.variants.count, self._first(json)
        poses = 1 if self.asked.inputs is None else self.asked.inputs.n
        together = (
            whole is not None
            and count >= FEW
            and self.asked.families(self.variants.part(0, 1), json) is not None
        )
        if json:
            work = partial(
                documents_together if together else documents, self.asked, whole and whole[0], form
            )
        else:
            # the columns that all tables have
            table: Table = Table([]) if whole is None else whole[1][0]
            table = replace(table, columns=[replace(c, error=None) for c in table.columns])
            work = partial(rows_together if together else rows, self.asked, table, form)
        size = TOGETHER[json] // poses if together else min(ONE_BY_ONE[0], ONE_BY_ONE[1][json] // poses)
        yield from self._solved(partial(as_part, count * poses, work), max(1, size))

    @cached_property
    def table(self) -> Table:
        """All of them, one below the other."""
        # bounds of rounding errors are worked out when they are asked for, and cannot be sent
        here = replace(self, workers=1) if self.asked.digits else self
        tables = [written.data for written in here.blocks(as_it_is)]
        self.said = here.said
        return joined([table for table in tables if isinstance(table, Table)])

    # --- as JSON ----------------------------------------------------------------------------------------------
    @cached_property
    def documents(self) -> list[dict[str, Any]]:
        """What the JSON document says of each variant."""
        parts = (written.data for written in self.blocks(as_it_is, json=True))
        return [document for part in parts if isinstance(part, list) for document in part]

    # --- in every form ------------------------------------------------------------------------------------------
    def result(self, streams: bool, json: bool, table: bool) -> Result:
        """The result: as one table or document alone, written part by part, or the forms asked for, at once."""
        if streams:
            return Result(
                document=lambda: {"name": self.asked.mechanism.name},
                blocks=partial(self.blocks, json=json),
                blocks_name="variants",
                shared=self.workers > 1,
                late_warnings=lambda: self.said.lines(),
                failed=lambda: not self.said.any_assembled,
            )
        # what there is to say of them stands in the document too
        _ = (json and self.documents), (table and self.table)
        return Result(
            document=lambda: {"name": self.asked.mechanism.name, "variants": self.documents},
            tables={"variants": lambda: self.table},
            notes=lambda: self.asked.mechanism.name,
            warnings=self.said.lines(),
            failed=lambda: not self.said.any_assembled,
        )


_known: dict[tuple[str, bool], Families] = {}


def _families(asked: Asked, shown: NDArray[np.float64], json: bool) -> Families:
    """The formulas of a question, which a process writes down once."""
    name = asked.name, json
    if name not in _known:
        found = asked.families(shown[:1], json)
        assert found is not None
        _known.clear()
        _known[name] = found
    return _known[name]


def as_it_is(part: Part, number: int) -> Written:
    """The form of a part that stays a table, or documents."""
    return Written(part, 0)


def joined(tables: list[Table]) -> Table:
    """Tables of the same columns, one below the other."""

    def column(i: int) -> Column:
        parts = [table.columns[i] for table in tables]
        errors = [part.error for part in parts]
        values = [value for part in parts for value in part.values]
        known = [error for error in errors if error is not None]
        # a variant that is not assembled has no numbers, and no bounds of them
        empty = [[0.0] * len(part.values) for part in parts]
        return replace(
            parts[0],
            values=values,
            error=(
                lambda: [
                    bound
                    for error, none in zip(errors, empty, strict=True)
                    for bound in (none if error is None else error())
                ]
            )
            if known
            else None,
        )

    return replace(tables[0], columns=[column(i) for i in range(len(tables[0].columns))])


def _rows_assembled(table: Table, analysis: Analysis) -> list[bool] | bool:
    """Of each row whether its pose is assembled."""
    length = len(table.columns[0].values)
    whole = [analysis.assembled(motion).tolist() for motion in analysis.motions]
    poses = [pose for each in zip(*whole, strict=True) for pose in each]
    if analysis.several and not any(c.header == "link" for c in table.columns):
        poses = [pose for each in whole for pose in each]
    if poses and length % len(poses) == 0:
        # of a pose one row for each link
        return [pose for pose in poses for _ in range(length // len(poses))]
    return any(poses)


def _with_variant(
    asked: Asked, name: str, row: NDArray[np.float64], table: Table, assembled: list[bool] | bool
) -> Table:
    length = len(table.columns[0].values) if table.columns else 1
    given = [
        Column(d.path, d.unit, [value] * length)
        for d, value in zip(asked.dimensions, row.tolist(), strict=True)
    ]
    whole: list[Any] = assembled if isinstance(assembled, list) else [assembled] * length
    front = [Column("variant", "", [name] * length), *given, Column("assembled", "", whole)]
    return Table([*front, *table.columns], _keys(asked, table))


def _keys(asked: Asked, table: Table) -> tuple[str, ...]:
    return ("variant", *(d.header for d in asked.dimensions), *table.keys)


def like(pattern: Table, table: Table) -> Table:
    """A table with the columns of the first."""
    columns = {c.header: c for c in table.columns}
    empty: list[Cell] = [None] * len(table.columns[0].values)
    return Table(
        [columns.get(c.header) or Column(c.name, c.unit, empty) for c in pattern.columns], pattern.keys
    )


def empty(pattern: Table) -> Table:
    """The rows of a variant that cannot be put together."""
    return Table(
        [
            c if c.header in pattern.keys else Column(c.name, c.unit, [None] * len(c.values))
            for c in pattern.columns
        ],
        pattern.keys,
    )


def _blank(part: Any, key: str = "") -> Any:
    """Poses that are not assembled, in the form of others: what they are asked at stays."""
    if isinstance(part, dict):
        return {key: _blank(value, key) for key, value in part.items()}
    if isinstance(part, list):
        return [] if key == "marks" else [_blank(each, key) for each in part]
    if isinstance(part, bool):
        return False
    return part if isinstance(part, str) or key in ("input_deg", "input_m", "branch") else None
