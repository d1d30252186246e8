"""Many variants of one mechanism as one result: every row begins with the variant, and says whether it is assembled."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

from cli.mechanism.variants import Variants
from cli.show.columns import Column, Result, Table
from cli.show.progress import progress

if TYPE_CHECKING:
    from cli.mechanism.solve import Analysis
    from cli.show.columns import Cell
    from virtualwork import Mechanism

# of these kinds of remark each is printed, and of each the first so many variants are named
REMARKS, NAMED = 10, 5


@dataclass
class Many:
    """The variants, each solved when its turn comes.

    Attributes
    ----------
    analysis_of : callable
        What is asked, of one mechanism.
    result_of : callable
        An analysis as a result.
    """

    mechanism: Mechanism
    variants: Variants
    analysis_of: Callable[[Mechanism], Analysis]
    result_of: Callable[[Analysis], Result]
    remarks: dict[str, dict[str, None]] = field(default_factory=dict)
    any_assembled: bool = False

    def _each(self) -> Iterator[tuple[str, tuple[float, ...], Analysis | str]]:
        """Name, values, and the analysis, or why there is none."""
        from virtualwork import MechanismError

        rows = enumerate(self.variants.rows(), 1)
        for number, row in progress(rows, self.variants.count, "variants"):
            try:
                found: Analysis | str = self.analysis_of(self.variants.of(self.mechanism, row))
            except MechanismError as error:
                found = str(error)
            yield str(number), row, found

    def analyses(self) -> list[tuple[str, Analysis]]:
        """What is asked of each variant whose parts can be put together."""
        return [(name, found) for name, _, found in self._each() if not isinstance(found, str)]

    def _formed(self, name: str, analysis: Analysis | str, form: Callable[[Result], Any]) -> Any:
        """A form of a variant's result; None where its parts cannot be put together, which is remembered."""
        from virtualwork import MechanismError

        try:
            if isinstance(analysis, str):
                raise MechanismError(analysis)
            result = self.result_of(analysis)
            found = form(result)
            self.any_assembled |= not result.failed()
            said = result.warnings
        except MechanismError as error:
            found, said = None, [str(error)]
        for remark in said:
            self.remarks.setdefault(remark, {})[name] = None
        return found

    # --- as tables --------------------------------------------------------------------------------------------
    def tables(self) -> Iterator[Table]:
        """The table of each variant; all have the columns of the first that has any."""
        waiting: list[tuple[str, tuple[float, ...]]] = []
        pattern: Table | None = None
        for name, row, analysis in self._each():
            table = self._formed(name, analysis, lambda result: next(iter(result.tables.values()))())
            pattern = pattern or table
            if table is None:
                waiting.append((name, row))
            if pattern is not None:
                yield from (self._with_variant(*each, _empty(pattern), False) for each in waiting)
                waiting = []
            if pattern is not None and table is not None:
                assembled = self._rows_assembled(table, analysis)
                yield self._with_variant(name, row, _like(pattern, table), assembled)
        if waiting:
            nothing = Table([])
            yield from (self._with_variant(*each, nothing, False) for each in waiting)

    def _rows_assembled(self, table: Table, analysis: Analysis | str) -> list[bool] | bool:
        """Of each row whether its pose is assembled."""
        assert not isinstance(analysis, str)
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
        self, name: str, row: tuple[float, ...], table: Table, assembled: list[bool] | bool
    ) -> Table:
        length = len(table.columns[0].values) if table.columns else 1
        given = [
            Column(d.path, d.unit, [value] * length)
            for d, value in zip(self.variants.dimensions, row, strict=True)
        ]
        whole: list[Any] = assembled if isinstance(assembled, list) else [assembled] * length
        front = [Column("variant", "", [name] * length), *given, Column("assembled", "", whole)]
        return Table([*front, *table.columns], keys=("variant", *(c.header for c in given), *table.keys))

    @cached_property
    def table(self) -> Table:
        """All of them, one below the other."""
        first, *others = self.tables()
        columns = [
            Column(c.name, c.unit, [v for part in (first, *others) for v in part.columns[i].values])
            for i, c in enumerate(first.columns)
        ]
        return Table(columns, first.keys)

    # --- as JSON ----------------------------------------------------------------------------------------------
    @cached_property
    def documents(self) -> list[dict[str, Any]]:
        """What the JSON document says of each variant."""
        found, pattern = [], None
        for name, row, analysis in self._each():
            document = self._formed(name, analysis, lambda result: result.document())
            if document is not None:
                pattern = pattern or document["poses"]
            found.append((name, row, document))
        return [
            {"variant": name, "set": self._set(row)}
            | ({"poses": _blank(pattern or [])} if d is None else {k: v for k, v in d.items() if k != "name"})
            for name, row, d in found
        ]

    def _set(self, row: tuple[float, ...]) -> dict[str, float]:
        return {d.header: value for d, value in zip(self.variants.dimensions, row, strict=True)}

    # --- in every form ------------------------------------------------------------------------------------------
    def result(self, streams: bool, json: bool, table: bool) -> Result:
        """The result: as one table alone, written part by part, or the forms asked for, at once."""
        if streams:
            return Result(
                document=dict,
                tables={},
                blocks=self.tables,
                blocks_name="variants",
                late_warnings=self.said,
                failed=lambda: not self.any_assembled,
            )
        # what there is to say of them stands in the document too
        _ = (json and self.documents), (table and self.table)
        return Result(
            document=lambda: {"name": self.mechanism.name, "variants": self.documents},
            tables={"variants": lambda: self.table},
            notes=lambda: self.mechanism.name,
            warnings=self.said(),
            failed=lambda: not self.any_assembled,
        )

    def said(self) -> list[str]:
        """What there is to say of the variants: each remark once, with the variants that it is about."""
        lines = []
        for remark, named in list(self.remarks.items())[:REMARKS]:
            names = list(named)
            more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
            several = "s" if len(names) > 1 else ""
            lines.append(f"variant{several} {', '.join(names[:NAMED])}{more}: {remark}")
        left = {name for names in list(self.remarks.values())[REMARKS:] for name in names}
        return [*lines, f"{len(left)} further variants have remarks of their own"] if left else lines


def _like(pattern: Table, table: Table) -> Table:
    """A table with the columns of the first."""
    columns = {c.header: c for c in table.columns}
    empty: list[Cell] = [None] * len(table.columns[0].values)
    return Table(
        [columns.get(c.header) or Column(c.name, c.unit, empty) for c in pattern.columns], pattern.keys
    )


def _empty(pattern: Table) -> Table:
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
