"""What stands in the head of a report: `[report]` of a file, and its keys."""

from __future__ import annotations

from collections.abc import Mapping

from dalembert.errors import DataError, toml_text
from dalembert.hints import nearest

HEAD = ("title", "machine", "customer", "date", "author")


def about(file: str, document: Mapping[str, object]) -> dict[str, str]:
    """Read the table `[report]`: texts; a date may be TOML's own, or a bare year.

    Raises
    ------
    DataError
        No table, an unknown key, or a value that is no text.
    """
    from datetime import date

    result = document.get("report", {})
    if not isinstance(result, dict):
        raise DataError(
            f"{file}: [report]: found {toml_text(result)}, expected a table with some of {', '.join(HEAD)}"
        )
    for key, value in result.items():
        if key not in HEAD:
            raise DataError(
                f"{file}: [report]: unknown key '{key}': expected {', '.join(HEAD)}{nearest(key, HEAD)}"
            )
        kinds = (str, date, int) if key == "date" else (str,)
        if isinstance(value, bool) or not isinstance(value, kinds):
            expected = "text in quotes, or a date" if key == "date" else "text in quotes"
            raise DataError(f"{file}: [report] {key}: found {toml_text(value)}, expected {expected}")
    return {key: str(value) for key, value in result.items()}
