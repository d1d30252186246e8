"""Errors in a user's data, each in one line."""

from __future__ import annotations

LONGEST = 1200  # characters of a message


class DataError(Exception):
    """Bad data: shown as one line, status 1."""


def needs(what: str, package: str, extra: str) -> DataError:
    """Return the error of a missing package, with the extra that installs it."""
    return DataError(f"{what} needs {package}: install dalembert with its extra, dalembert[{extra}]")


def cell_error(file: str, row: int, line: int, column: str, value: str, expected: str) -> DataError:
    """Name file, row, column, the value found and what was expected.

    `row` counts the data rows from 1; `line` is the file's own line, header and blank lines included.
    """
    return DataError(
        f"{file}: row {row} (line {line}), column {column}: found {quote(value)}, expected {expected}"
    )


def quote(value: str) -> str:
    """Show a value from a file on one line, whatever it holds."""
    text = ascii(value) if not value.isprintable() else f"'{value}'"
    return text if len(text) <= 60 else text[:57] + "...'"


def toml_text(value: object) -> str:
    """Write a value of a TOML file as TOML has it, texts in single quotes.

    >>> toml_text([True, {"x": 1.5}, "a"])
    "[true, {x = 1.5}, 'a']"
    """
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list):
        return f"[{', '.join(map(toml_text, value))}]"
    if isinstance(value, dict):
        return f"{{{', '.join(f'{key} = {toml_text(each)}' for key, each in value.items())}}}"
    # dates and times of a day
    return value.isoformat() if hasattr(value, "isoformat") else repr(value)


def one_line(message: str) -> str:
    """Return a message as one line that a terminal can show, for any names and values from a file."""
    line = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in " ".join(message.split()))
    # what was found stands at the front, what was expected at the end
    return line if len(line) <= LONGEST else f"{line[: LONGEST * 2 // 3]} ... {line[-LONGEST // 3 :]}"
