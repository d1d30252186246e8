"""The dates of a log's rows."""

from __future__ import annotations

import re
from datetime import datetime

import numpy as np
from numpy.typing import NDArray

from dalembert.tables.table import Table

Real = NDArray[np.float64]

_ISO = re.compile(
    r"(\d{4})[-/](\d{1,2})(?:[-/](\d{1,2}))?(?:[T ]+(\d{1,2}):(\d{2})(?::(\d{2})(?:\.\d+)?)?Z?)?"
)
_POINTS = re.compile(r"(\d{1,2})\.(\d{1,2})\.(\d{4})(?:,?\s+(\d{1,2}):(\d{2})(?::(\d{2}))?)?")
DATE = "a date such as 2019-03-14, 2019-03-14 08:30 or 14.03.2019"
YEAR = 365.25


def years(table: Table) -> Real | None:
    """Return the date of each row in years, from any origin; NaN where there is none, None without a column of dates."""
    written = table.texts.get("date")
    if written is None or not any(written):
        return None
    return np.array([_year(table, i, text) if text else np.nan for i, text in enumerate(written)])


def _year(table: Table, row: int, text: str) -> float:
    iso, points = _ISO.fullmatch(text), _POINTS.fullmatch(text)
    found = iso or points
    if found is None:
        raise table.error(row, "date", text, DATE)
    first, month, last, *clock = found.groups()
    year, day = (first, last or "1") if iso else (last, first)
    try:
        hour, minute, second = (int(part or 0) for part in clock)
        at = datetime(int(year), int(month), int(day), hour, minute, second)
    except ValueError:
        raise table.error(row, "date", text, DATE) from None
    # in days first, so that no digit is lost
    return (at - datetime(2000, 1, 1)).total_seconds() / 86400 / YEAR


def latest(table: Table) -> str | None:
    """Return the last date of a table, as 2019-03-14; None where none can be read."""
    found = [_ISO.fullmatch(text) or _POINTS.fullmatch(text) for text in table.texts.get("date", ()) if text]
    days = []
    for match in filter(None, found):
        first, month, last = match.groups()[:3]
        year, day = (first, last or "01") if match.re is _ISO else (last, first)
        days.append(f"{year}-{int(month):02}-{int(day):02}")
    return max(days, default=None)
