"""A quantity of a result is one column: its name, dimension, numbers, unit, rounding errors and place in JSON.

Tables are made of columns; the JSON document is made of tables (`document`). Nothing else says what a result holds.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import pairwise
from math import isfinite
from typing import TYPE_CHECKING, Any

from dalembert.dataclass import dataclass, field
from dalembert.units import LISTED, RESULTS, UNITS, from_si, to_si

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    from dalembert.arithmetic.doubled import Doubled

    Cell = str | float | None
    Values = Sequence[Cell] | NDArray[np.float64]
    Bounds = Sequence[float] | NDArray[np.float64]
    Json = None | str | float | Sequence["Json"] | Mapping[str, "Json"]
    Document = dict[str, Json]
    # the keys one after the other, joined by dots; a tuple where a key has dots itself
    Place = str | tuple[str, ...] | None


ABSENT: Any = object()
"""A stored cell that has no place in its row of the JSON document."""


def document_unit(dimension: str) -> str:
    """Return the unit that JSON has: SI, degrees of an angle; none for a plain number."""
    return RESULTS.get(dimension) or LISTED[dimension][0]


def finite(value: float) -> float | None:
    """Return a number as JSON can have it: None for what is not finite."""
    return float(value) if isfinite(value) else None


def listed(values: Any) -> Any:
    """Return numbers as JSON has them: arrays as lists, a complex number as its two parts; None for what is not finite.

    >>> listed(complex(-0.0, 2)), listed([1.0, float("inf")])
    ([0.0, 2.0], [1.0, None])
    """
    if hasattr(values, "tolist"):
        values = values.tolist()
    if isinstance(values, complex):
        values = (values.real, values.imag)
    # the sum has no −0
    return [listed(each) for each in values] if isinstance(values, (list, tuple)) else finite(values + 0.0)


@dataclass(eq=False, repr=False)
class Column:
    """A quantity of a table: texts are names, None and NaN are empty cells."""

    name: str
    unit: str
    """The suffix of its header, such as `N_m`; empty for names and plain numbers."""
    values: Values
    error: Callable[[], Bounds] | None = None
    """The rounding errors of computed numbers, in the same unit; inf where no digit holds."""
    place: Place = None
    """Its path in a row of the JSON document, with its unit: `initial.static_unbalance_kg_m`; None: not in JSON."""
    stored: Any = None
    """The numbers as JSON has them, where these are not the values shown."""

    @property
    def header(self) -> str:
        """The header: `torque_N_m`."""
        return f"{self.name}_{self.unit}" if self.unit else self.name

    @property
    def keys(self) -> Sequence[str]:
        """The keys of its place, one after the other."""
        return self.place.split(".") if isinstance(self.place, str) else self.place or ()

    @property
    def documented(self) -> list[Any]:
        """The cells as JSON has them."""
        values: Any = self.values if self.stored is None else self.stored
        cells = values.tolist() if hasattr(values, "tolist") else list(values)
        return [None if isinstance(v, float) and not isfinite(v) else v for v in cells]


def names(name: str, values: Iterable[Json], place: Place = "") -> Column:
    """A column of names, verdicts or plain values; `place`: its key in JSON, if that is not the name."""
    cells: list[Any] = list(values)
    return Column(name, "", cells, place=name if place == "" else place)


def number(
    name: str,
    dimension: str,
    si: ArrayLike,
    unit: str = "",
    error: Callable[[], ArrayLike] | None = None,
    place: Place = "",
    exact: Callable[[], Doubled] | None = None,
) -> Column:
    """A quantity, shown in a unit.

    Parameters
    ----------
    name
        Without its unit.
    dimension
        A key of `units.DIMENSIONS` or `units.RESULTS`.
    si
        The numbers in the unit that JSON has: SI, degrees of an angle.
    unit
        The unit shown; by default that of JSON.
    error
        Their rounding errors, in the same unit as `si`.
    place
        Where it stands in a row of the JSON document, without its unit; by default under its name, None: not in JSON.
    exact
        The numbers in 32 digits: the error of a shown number is its difference from them.

    Examples
    --------
    >>> column = number("radius", "length", [0.02], "mm")
    >>> column.header, column.values.tolist(), column.place, column.documented
    ('radius_mm', [20.0], 'radius_m', [0.02])
    """
    import numpy as np

    own = document_unit(dimension)
    unit = unit or own
    key: Place = None
    if isinstance(place, tuple):
        key = (*place[:-1], f"{place[-1]}_{own}".rstrip("_"))
    elif place is not None:
        key = f"{place or name}_{own}".rstrip("_")
    array = np.asarray(si, dtype=float)

    def shown(values: ArrayLike) -> NDArray[np.float64]:
        values = np.asarray(values, dtype=float)
        if unit == own:
            return values
        return from_si(to_si(values, dimension, own), dimension, unit)

    errors = None if error is None else lambda: shown(error())
    if exact is not None:
        errors = apart(shown(array), dimension, unit, exact)
    return Column(name, unit, shown(array), errors, key, array)


def apart(
    values: NDArray[np.float64], dimension: str, unit: str, exact: Callable[[], Doubled]
) -> Callable[[], NDArray[np.float64]]:
    """Return the differences of numbers in a unit from those in 32 digits, which are in the unit of JSON; computed on request."""

    def errors() -> NDArray[np.float64]:
        import numpy as np

        from dalembert.arithmetic.doubled_operations import off

        second = exact()
        if unit != document_unit(dimension):
            numerator, denominator = UNITS[dimension][unit]
            second = second * float(denominator) / float(numerator)
        return np.broadcast_to(off(values, second, 360.0 if unit == "deg" else 0.0), values.shape)

    return errors


def computed(
    subject: Any, name: str, dimension: str, of: Callable[[Any], Any], unit: str = "", place: Place = ""
) -> Column:
    """A quantity that is computed twice: `of` a subject, and of its `second`, the same in 32 digits."""
    import numpy as np

    def exact() -> Doubled:
        again: Any = np.atleast_1d(of(subject.second))
        return again.doubled  # type: ignore[no-any-return]

    return number(name, dimension, np.atleast_1d(of(subject)), unit, place=place, exact=exact)


def vector(
    name: str,
    dimension: str,
    si: NDArray[np.float64],
    axes: str,
    error: Callable[[], NDArray[np.float64]] | None = None,
    place: str = "",
) -> list[Column]:
    """A vector in the unit of JSON, (n, k): a column for each axis, a list in JSON.

    Examples
    --------
    >>> import numpy as np
    >>> [(c.header, c.place) for c in vector("omega", "speed", np.zeros((1, 2)), "xy")]
    [('omega_x_rad_s', 'omega_rad_s.0'), ('omega_y_rad_s', 'omega_rad_s.1')]
    """
    own = document_unit(dimension)
    key = f"{place or name}_{own}".rstrip("_")

    def errors(i: int) -> Callable[[], Bounds] | None:
        if error is None:
            return None

        def of_axis() -> Bounds:
            # one for the whole vector, or one for each of its axes
            bounds = error()
            return bounds if bounds.ndim < 2 else bounds[:, i]

        return of_axis

    return [Column(f"{name}_{axis}", own, si[:, i], errors(i), f"{key}.{i}") for i, axis in enumerate(axes)]


def read_number(name: str, dimension: str, values: ArrayLike, unit: str) -> Column:
    """A quantity that is a number of the unit shown, such as a mass rounded to a step; JSON has it in SI."""
    import numpy as np

    own, array = document_unit(dimension), np.asarray(values, dtype=float)
    key = f"{name}_{own}".rstrip("_")
    stored = array if unit == own else from_si(to_si(array, dimension, unit), dimension, own)
    return Column(name, unit, array, None, key, stored)


@dataclass(eq=False, repr=False)
class Table:
    """Columns of one length."""

    columns: Sequence[Column]
    keys: Sequence[str] = ()
    """The headers of the columns that name a row."""
    place: str | None = None
    """The path of its rows in JSON: `rotors[].corrections[]`; empty: at the top, one row; None: not in JSON."""
    above: str = ""
    """A sentence above it, on the terminal and in a report."""
    below: str = ""
    """A sentence below it."""
    documented: Sequence[Column] = ()
    """Further columns, of the JSON document alone."""
    by_column: bool = False
    """Whether JSON has a list of the numbers of each column, in place of a row for each."""

    @property
    def cells(self) -> dict[str, Values]:
        """Header -> values."""
        return {column.header: column.values for column in self.columns}

    @property
    def length(self) -> int:
        """The number of rows."""
        return next((len(column.values) for column in (*self.columns, *self.documented)), 0)


def stacked(tables: Sequence[Table], name: str, of: Sequence[str], place: str) -> Table:
    """Stack tables with the same columns; a column in front names the table of each row.

    Examples
    --------
    >>> rows = [Table([number("mass", "mass", [m])], place="") for m in (1.0, 2.0)]
    >>> document([stacked(rows, "body", ["A", "B"], "bodies[]")])
    {'bodies': [{'body': 'A', 'mass_kg': 1.0}, {'body': 'B', 'mass_kg': 2.0}]}
    """
    first = tables[0]

    def joined(same: Sequence[Column]) -> Column:
        errors = [column.error for column in same if column.error is not None]

        def error() -> Bounds:
            return [float(bound) for each in errors for bound in each()]

        head = same[0]
        values = [value for column in same for value in column.values]
        stored = [value for column in same for value in column.documented]
        return Column(
            head.name, head.unit, values, error if len(errors) == len(same) else None, head.place, stored
        )

    def below(of: Callable[[Table], Sequence[Column]]) -> list[Column]:
        return [*map(joined, zip(*map(of, tables), strict=True))]

    front = names(name, [word for word, table in zip(of, tables, strict=True) for _ in range(table.length)])
    columns, documented = below(lambda table: table.columns), below(lambda table: table.documented)
    # what no table shows stays in the document alone
    (columns or documented).insert(0, front)
    at = first.place if first.place is None else f"{place}.{first.place}".rstrip(".")
    sentence = "\n".join(dict.fromkeys(table.above for table in tables if table.above))
    return Table(columns, (name, *first.keys), at, sentence, first.below, documented)


@dataclass(eq=False, repr=False)
class _Lists:
    """The elements of the lists of a document that further tables may belong to."""

    document: Document
    # list -> the names of the columns that distinguish its elements, and the elements by them
    keys: dict[str, tuple[str, ...]] = field(default_factory=dict)
    elements: dict[str, dict[tuple[Cell, ...], Document]] = field(default_factory=dict)

    def parent(self, place: str) -> str:
        """Return the list that a place lies in, the longest that has been filled; empty for the document itself."""
        return max((of for of in self.keys if place.startswith(f"{of}.")), key=len, default="")

    def add(self, table: Table) -> None:
        """Add the rows of a table at their path."""
        assert table.place is not None
        parent = self.parent(table.place)
        way = table.place[len(parent) :].lstrip(".").split(".") if table.place else []
        shared = self.keys.get(parent, ())
        every = [(column, column.documented) for column in (*table.columns, *table.documented)]
        columns = {column.name: values for column, values in every}
        # two columns of a name may differ in their unit
        cells = [(c.keys, values) for c, values in every if c.place and c.name not in shared]
        if table.by_column:
            whole = _walk(self.document, way)
            for path, values in cells:
                _put(whole, path, values)
            return
        homes = list(self.elements[parent].values()) if parent else [self.document]
        if way and way[-1].endswith("[]"):
            for home in homes:
                here = _walk(home, way[:-1])
                if here is not None:
                    here.setdefault(way[-1][:-2], [])
            names_of = [of.rpartition("_")[0] if of not in columns else of for of in table.keys]
            self.keys[table.place] = tuple(name for name in names_of if name in columns)
            self.elements[table.place] = {}
        of_parent = list(zip(*(columns[name] for name in shared), strict=True)) if shared else []
        indexed = bool(cells) and all(len(path) == 1 and path[0].isdecimal() for path, _ in cells)
        for i in range(table.length):
            home = self.elements[parent][of_parent[i]] if parent else self.document
            here = _walk(home, way[:-1])
            if way and way[-1].endswith("[]"):
                row: Any = [] if indexed else {}
                here[way[-1][:-2]].append(row)
                key = tuple(columns[name][i] for name in self.keys[table.place])
                self.elements[table.place][key] = row
            else:
                row = _walk(here, way[-1:])
            for path, values in cells:
                if values[i] is not ABSENT:
                    _put(row, path, values[i])


def _walk(home: Any, way: Iterable[str]) -> Any:
    """Return the value at the end of the path; None if there is null on it."""
    for name in way:
        if home is None:
            return None
        home = home.setdefault(name, {})
    return home


def _put(row: Any, path: Sequence[str], value: Json) -> None:
    """Set a value at a path; a number in the path is the index of a list, which is filled in order."""
    for name, following in pairwise(path):
        empty: Any = [] if following.isdecimal() else {}
        if isinstance(row, list):
            if int(name) == len(row):
                row.append(empty)
            row = row[int(name)]
        else:
            row = row.setdefault(name, empty)
    if isinstance(row, list):
        row.append(value)
    else:
        row[path[-1]] = value


def document(tables: Iterable[Table]) -> Document:
    """Return the JSON document of tables: the rows of each stand in the list, or the object, that its place names.

    A table whose place lies within the list of an earlier one (`rotors[].corrections[]` in `rotors[]`) has that table's key
    columns: they say which element a row belongs to, and are not repeated in it.

    Examples
    --------
    >>> rotors = Table([names("rotor", ["1"]), number("static", "unbalance", [0.2], "g_mm")], ["rotor"], "rotors[]")
    >>> planes = Table([names("rotor", ["1"]), names("plane", ["A"])], ["rotor", "plane"], "rotors[].corrections[]")
    >>> document([rotors, planes])
    {'rotors': [{'rotor': '1', 'static_kg_m': 0.2, 'corrections': [{'plane': 'A'}]}]}
    """
    lists = _Lists({})
    placed = [(table.place, table) for table in tables if table.place is not None]
    for _, table in sorted(placed, key=lambda each: each[0].count("[]")):
        lists.add(table)
    return lists.document
