"""A result as columns: name, unit, values, bounds of their rounding errors. Text, CSV, JSON and pictures all walk these."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from math import isfinite
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from pathlib import Path
    from typing import TypeAlias

    import numpy as np
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    Cell = str | float | None
    Values = Sequence[Cell] | NDArray[np.float64]
    Bounds = Sequence[float] | NDArray[np.float64]
    Json = None | str | float | Sequence["Json"] | Mapping[str, "Json"]
    Document = dict[str, Json]
    # of a table, or of a list of the JSON document; and what is written of it
    Part: TypeAlias = "Table | list[Document]"
    Form = Callable[[Part, int], "Written"]


def finite(value: float) -> float | None:
    """Return a number as JSON can have it: None for what is not finite."""
    return float(value) if isfinite(value) else None


@dataclass(eq=False, repr=False)
class Column:
    """A quantity of a table: strings are names, None and NaN are empty cells."""

    name: str
    unit: str
    """What its header ends in, such as `N_m`; empty for names and plain numbers."""
    values: Values
    error: Callable[[], Bounds] | None = None
    """Bounds of the rounding errors of computed numbers, in the same unit; inf where no digit is known."""

    @property
    def header(self) -> str:
        """The header: `torque_N_m`."""
        return f"{self.name}_{self.unit}" if self.unit else self.name


@dataclass(eq=False, repr=False)
class Table:
    """Columns of one length."""

    columns: Sequence[Column]
    keys: Sequence[str] = ()
    """The headers of the columns that name a row."""

    @property
    def cells(self) -> dict[str, Values]:
        """Header -> values."""
        return {column.header: column.values for column in self.columns}


class Written(NamedTuple):
    """What is written of a part: its bytes, or the part as it is shown, or nothing where it has a file."""

    data: bytes | Part
    unknown: int
    """Of how many of its numbers --digits knows no digit."""


@dataclass(eq=False, repr=False)
class Section:
    """A part of a report below a heading of its own: paragraphs and tables."""

    title: str
    parts: Sequence[str | Table]


@dataclass(eq=False, repr=False)
class Sheet:
    """What begins a page of a report."""

    title: str
    sections: Sequence[Section]
    figure: Callable[[], Figure] | None = None


@dataclass(eq=False, repr=False)
class Result:
    """What a command has found, in every form it can be shown in; each is formed when it is asked for."""

    document: Callable[[], Document] = dict
    """The JSON document, without its warnings."""
    tables: Mapping[str, Callable[[], Table]] = field(default_factory=dict)
    """Name -> table; the first is the CSV."""
    companions: Sequence[str] = ()
    """Which further tables go beside a file that holds one table, as FILE-name.csv."""
    screen: Callable[[], Table] | None = None
    """The terminal's table, where another layout reads better than that of the CSV."""
    expected: Sequence[Callable[[], Table]] = ()
    """Further tables whose columns a file of expected values may have."""
    notes: Callable[[], str] = lambda: ""
    """What the terminal shows above the table."""
    afterword: Callable[[], str] = lambda: ""
    """What the terminal shows below the table."""
    figure: Callable[[], Figure] | None = None
    method: str = ""
    """How it was found, and after whom: for the report."""
    sheets: Callable[[], Iterable[Sheet]] | None = None
    """What the report shows, where that is more than the notes, the tables, the afterword and the picture."""
    shows_input: bool = False
    """Whether the sheets show what the tables that were read hold."""
    about: Mapping[str, str] = field(default_factory=dict)
    """What the file itself says for the head of the report."""
    beside: Mapping[Path, Callable[[], bytes | Iterable[bytes]]] = field(default_factory=dict)
    """Files that options of the command itself ask for."""
    warnings: list[str] = field(default_factory=list)
    failed: Callable[[], bool] = lambda: False
    """Whether nothing that was asked for could be found: status 1, once all is shown."""
    blocks: Callable[[Form], Iterator[Written]] | None = None
    """The table or the JSON's list in parts, where it is too long to be held: nothing else is written then.

    Whoever works a part out, perhaps another process, makes what is written of it too.
    """
    shared: bool = False
    """Whether the parts are worked out by several processes."""
    blocks_name: str = "poses"
    """What the table in parts is called, or the list in JSON, which stands behind what else is in the document."""
    within: Callable[[], AbstractContextManager[None]] = nullcontext
    """What the forms are made within: it turns errors of a library into those that a user is told."""
    toml: Callable[[], bytes] | None = None
    """The mechanism's file that was found, for -o FILE.toml."""
    late_warnings: Callable[[], list[str]] = list
    """What there is to say once all parts are written."""
