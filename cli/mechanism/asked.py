"""What is asked of many variants, so that another process knows it too; what there is to say of them; their tables."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

from numpy.typing import NDArray

from cli.mechanism.options import Options
from cli.mechanism.variants import Variants, in_si, with_numbers
from cli.show.columns import Column, Table
from virtualwork import Mechanism
from virtualwork.describe.dimensions import Dimension

if TYPE_CHECKING:
    import numpy as np

    from cli.show.columns import Cell, Document, Values

    Rows = NDArray[np.float64]

# of these kinds of remark each is printed, and of each the first so many variants are named
REMARKS, NAMED = 10, 5


@dataclass
class Said:
    """What there is to say of variants: each remark once, with the variants that it is about.

    Attributes
    ----------
    remarks : dict
        Remark -> the first variants, and how many there are.
    further : int
        Variants with a remark of their own that is not kept.
    any_assembled : bool
        Whether of any variant there is a number.
    """

    remarks: dict[str, tuple[list[str], int]] = field(default_factory=dict)
    further: int = 0
    any_assembled: bool = False

    def add(self, remark: str, names: list[str], count: int = 1) -> None:
        """Add a remark about some variants."""
        if remark not in self.remarks and len(self.remarks) >= REMARKS:
            self.further += count
            return
        before, number = self.remarks.get(remark, ([], 0))
        self.remarks[remark] = [*before, *names][:NAMED], number + count

    def join(self, other: Said) -> None:
        """Add what is said of later variants."""
        for remark, (names, count) in other.remarks.items():
            self.add(remark, names, count)
        self.further += other.further
        self.any_assembled |= other.any_assembled

    def lines(self) -> list[str]:
        """As it is printed."""
        lines = []
        for remark, (names, count) in self.remarks.items():
            more = f" and {count - NAMED} more" if count > NAMED else ""
            lines.append(f"variant{'s' * (count > 1)} {', '.join(names)}{more}: {remark}")
        if self.further:
            lines.append(f"{self.further} further variants have remarks of their own")
        return lines


class Home(NamedTuple):
    """What all parts of the work have in common.

    Attributes
    ----------
    each : int
        How many variants a part has.
    pattern : Table, optional
        With the columns that all tables have.
    row : array (d,), optional
        The numbers of a variant that can be put together.
    together : bool
        Whether variants are solved at once.
    lanes : int
        How large the whole is, which the choice of an engine hangs on; 0 where each variant is work of its own.
    """

    each: int
    pattern: Table = Table([])
    row: Rows | None = None
    together: bool = False
    lanes: int = 0


@dataclass(frozen=True)
class Question:
    """What is asked of every variant: all that another process needs to know.

    Attributes
    ----------
    mechanism : Mechanism
        What they are variants of.
    dimensions : tuple of Dimension
        What is varied.
    bare : mapping
        The file's units of bare numbers.
    digits : bool
        Whether bounds of the errors are asked for.
    """

    asked: Options
    mechanism: Mechanism
    dimensions: tuple[Dimension, ...]
    bare: Mapping[str, str]
    digits: bool

    method = ""

    def home(self, variants: Variants, json: bool) -> Home:
        """What all parts have in common, of documents or of a table."""
        raise NotImplementedError

    def table(self, home: Home, first: int, shown: Rows, said: Said) -> Table:
        """The rows of some variants, which are called from `first` on."""
        raise NotImplementedError

    def documents(self, home: Home, first: int, shown: Rows, said: Said) -> list[Document]:
        """What JSON says of some variants."""
        raise NotImplementedError

    def drawn(self, row: Rows) -> Any:
        """A variant alone, for a page.

        Raises
        ------
        MechanismError
        """
        raise NotImplementedError

    def variant(self, row: Rows) -> Mechanism:
        """The mechanism with a variant's numbers.

        Raises
        ------
        MechanismError
        """
        return with_numbers(self.mechanism, self.dimensions, row.tolist())

    def numbers(self, shown: Rows) -> dict[str, list[float]]:
        """The numbers of variants by path, SI."""
        return {
            d.path: [in_si(d, x) for x in column]
            for d, column in zip(self.dimensions, shown.T.tolist(), strict=True)
        }

    def named(self, first: int, shown: Rows, documents: Sequence[Document]) -> list[Document]:
        """Documents with the variants' names and numbers."""
        headers = [d.header for d in self.dimensions]
        return [
            {"variant": str(first + i), "set": dict(zip(headers, row, strict=True)), **document}
            for i, (row, document) in enumerate(zip(shown.tolist(), documents, strict=True))
        ]

    def given(self, names: list[str], numbers: Sequence[Values]) -> list[Column]:
        """The first columns of a table: the variant and its numbers."""
        varied = zip(self.dimensions, numbers, strict=True)
        return [Column("variant", "", names), *(Column(d.path, d.unit, values) for d, values in varied)]

    def below(self, first: int, shown: Rows, tables: Sequence[Table]) -> Table:
        """The tables of variants one below the other, each row with its variant's name and numbers."""
        named = []
        for i, (row, table) in enumerate(zip(shown.tolist(), tables, strict=True)):
            n = length(table)
            given = self.given([str(first + i)] * n, [[value] * n for value in row])
            named.append(Table([*given, *table.columns]))
        return joined(named)


# --- tables of the same columns ---------------------------------------------------------------------------------------
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
    """The rows of a variant that cannot be put together: what names them stays."""
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

    def bounds(parts: Sequence[Column]) -> Iterator[float]:
        for part in parts:
            # a variant that is not assembled has no numbers, and no bounds of them
            yield from [0.0] * len(part.values) if part.error is None else part.error()

    def column(*parts: Column) -> Column:
        error = None if all(part.error is None for part in parts) else lambda: list(bounds(parts))
        return replace(parts[0], values=[value for part in parts for value in part.values], error=error)

    return replace(tables[0], columns=list(map(column, *(table.columns for table in tables))))
