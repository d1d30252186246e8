"""Tables of many variants: the same columns for all, one below the other; and what there is to remark on them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

from dalembert.dataclass import dataclass, field, replace
from dalembert.results.columns import Column, Table

if TYPE_CHECKING:
    from dalembert.results.columns import Cell

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


def length(table: Table) -> int:
    """How many rows a table has."""
    return len(table.columns[0].values) if table.columns else 1


def like(pattern: Table, table: Table) -> Table:
    """A table with the columns of the first."""
    columns = {c.header: c for c in table.columns}
    empty: list[Cell] = [None] * length(table)
    return Table(
        [columns.get(c.header) or Column(c.name, c.unit, empty) for c in pattern.columns], pattern.keys
    )


def emptied(pattern: Table) -> Table:
    """The rows of a variant that cannot be assembled: what names them stays."""
    return Table(
        [
            c if c.header in pattern.keys else Column(c.name, c.unit, [None] * len(c.values))
            for c in pattern.columns
        ],
        pattern.keys,
    )


def without_bounds(table: Table) -> Table:
    """A table without the bounds of its errors."""
    return replace(table, columns=[replace(c, error=None) for c in table.columns])


def joined(tables: Sequence[Table]) -> Table:
    """Tables of the same columns, one below the other."""
    if len(tables) == 1:
        return tables[0]

    def bounds(parts: Sequence[Column]) -> Iterator[float]:
        for part in parts:
            # a variant that is not assembled has no numbers, and no bounds of them
            yield from [0.0] * len(part.values) if part.error is None else part.error()

    def column(*parts: Column) -> Column:
        error = None if all(part.error is None for part in parts) else lambda: list(bounds(parts))
        return replace(parts[0], values=[value for part in parts for value in part.values], error=error)

    return replace(tables[0], columns=list(map(column, *(table.columns for table in tables))))


def blank(part: Any, key: str = "") -> Any:
    """Poses that are not assembled, in the form of others: what names them stays."""
    if isinstance(part, dict):
        return {key: blank(value, key) for key, value in part.items()}
    if isinstance(part, list):
        return [] if key == "marks" else [blank(each, key) for each in part]
    if isinstance(part, bool):
        return False
    return part if isinstance(part, str) or key in ("input_deg", "input_m", "branch") else None
