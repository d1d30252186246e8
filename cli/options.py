"""Option values with a unit; a bad one is wrong usage, status 2."""

from __future__ import annotations

import typer

from cli.units import parse_number, parse_quantity, to_si


def bad(flag: str, message: object) -> typer.BadParameter:
    """Make the usage error of an option."""
    return typer.BadParameter(str(message), param_hint=flag)


def with_unit(
    flag: str, text: str | None, dimension: str, *, positive: bool = False
) -> tuple[float, str] | None:
    """Read a value and the unit it was given in; None stays None."""
    if text is None:
        return None
    try:
        value, unit = parse_quantity(text, dimension)
    except ValueError as error:
        raise bad(flag, error) from None
    if positive and not value > 0:
        raise bad(flag, f"'{text}': expected a positive value")
    return value, unit


def quantity(flag: str, text: str | None, dimension: str, *, positive: bool = False) -> float | None:
    """Read a value in SI; None stays None."""
    given = with_unit(flag, text, dimension, positive=positive)
    return None if given is None else float(to_si(given[0], dimension, given[1]))


def vector(flag: str, text: str) -> complex:
    """Read `X,Y` in SI as x + iy."""
    parts = text.split(",")
    try:
        if len(parts) != 2:
            raise ValueError
        return complex(parse_number(parts[0]), parse_number(parts[1]))
    except ValueError:
        raise bad(flag, f"'{text}': expected two numbers X,Y, such as 0,-9.81") from None
