"""A result in another form: in chosen units, with the digits that hold, as a file or a JSON document."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from typing import TYPE_CHECKING

from dalembert.dataclass import replace

if TYPE_CHECKING:
    from dalembert.results.columns import Table
    from dalembert.results.result import Result


def first_of(result: Result) -> Callable[[], Table]:
    """Return the first table, which a CSV file holds."""
    return next(iter(result.tables.values()))


def with_first(result: Result, table: Callable[[], Table]) -> Result:
    """Return the result with another first table."""
    return replace(result, tables={**result.tables, next(iter(result.tables)): table})


def in_chosen_units(result: Result, units: Mapping[str, str] | None) -> Result:
    """Return the result with its tables in chosen units.

    Parameters
    ----------
    result : Result
    units : mapping of dimension to unit, optional
        Such as {"length": "mm"}; the units of the result where None.

    Examples
    --------
    >>> from dalembert.results.columns import Table, number
    >>> from dalembert.results.result import Result
    >>> result = Result(tables={"arm": lambda: Table([number("arm", "length", [0.5])])})
    >>> first_of(in_chosen_units(result, {"length": "mm"}))().cells
    {'arm_mm': array([500.])}
    """
    if units is None:
        return result
    from dalembert.results.chosen_units import in_units

    def of(table: Callable[[], Table]) -> Callable[[], Table]:
        return lambda: in_units(table(), units)

    screen = result.screen
    return replace(
        result,
        tables={name: of(table) for name, table in result.tables.items()},
        screen=None if screen is None else lambda: [in_units(table, units) for table in screen()],
        expected=[of(table) for table in result.expected],
    )


def formed(result: Result, form: str) -> bytes | Iterable[bytes]:
    """Return a file of a result: `form` is its suffix, .csv, .json, .xlsx, .parquet, .toml, or another one that `handed_on` knows.

    Examples
    --------
    >>> from dalembert.results.columns import Table, number
    >>> from dalembert.results.result import Result
    >>> formed(Result(tables={"arm": lambda: Table([number("arm", "length", [0.5])])}), ".csv")
    b'arm_m\\n0.5\\n'
    """
    if form == ".json":
        return (part.encode() for part in json_document(result))
    if form == ".toml":
        assert result.toml is not None
        return result.toml()
    if form in (".csv", ".parquet"):
        return one_table(form, first_of(result))
    # a table without columns is of the JSON document alone
    every = ((name.strip("-"), table()) for name, table in result.tables.items())
    formed = {name: table for name, table in every if table.columns}
    if form == ".xlsx":
        from dalembert.results.files import workbook

        return workbook({name: [table] for name, table in formed.items()})
    from dalembert.results.files import handed_on

    return handed_on(form, formed, result.warnings)


def one_table(form: str, table: Callable[[], Table]) -> bytes | Iterable[bytes]:
    """Return a file of a single table."""
    if form == ".parquet":
        from dalembert.results.files import parquet

        return parquet([table()])
    from dalembert.results.text import csv_text

    return csv_text(table().cells).encode()


def unknown_digits(count: int) -> list[str]:
    """Return the warning of numbers of which no digit is known; none where there are none."""
    if not count:
        return []
    return [f"--digits: of {count} numbers no digit holds; their cells are empty"]


def json_document(result: Result) -> Iterator[str]:
    """Yield the JSON document with the warnings."""
    from dalembert.results.text import json_parts

    return json_parts({**result.documented(), "warnings": result.warnings})


def with_digits_that_hold(result: Result) -> Result:
    """Cut the first table and that of the terminal."""
    from dalembert.results.digits import digits_that_hold

    table, unknown = digits_that_hold(first_of(result)())
    screen = None
    if result.screen is not None:
        cut = cache(lambda of=result.screen: [digits_that_hold(table) for table in of()])

        def screen() -> list[Table]:
            return [table for table, _ in cut()]

        if not any(column.error for column in table.columns):
            unknown = sum(count for _, count in cut())
    return replace(
        with_first(result, lambda: table),
        warnings=[*result.warnings, *unknown_digits(unknown)],
        screen=screen,
    )


def with_further_cut(result: Result) -> Result:
    """Cut the tables below the first, for files that are not JSON, which keeps every digit."""
    from dalembert.results.digits import digits_that_hold

    first, *others = result.tables.items()
    cut = {name: lambda of=of: digits_that_hold(of())[0] for name, of in others}
    return replace(result, tables={**dict([first]), **cut})
