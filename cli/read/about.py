"""The head of a report: what the table `[report]` of a TOML file says of it."""

from __future__ import annotations

from collections.abc import Mapping

from dalembert.errors import DataError
from dalembert.hints import nearest

HEAD = ("title", "machine", "customer", "date", "author")


def about(file: str, document: Mapping[str, object]) -> dict[str, str]:
    """Read the table `[report]`: texts, a date may be TOML's own.

    Raises
    ------
    DataError
        No table, an unknown key, or a value that is no text.
    """
    result = document.get("report", {})
    if not isinstance(result, dict):
        raise DataError(f"{file}: [report]: expected a table with some of {', '.join(HEAD)}")
    for key, value in result.items():
        if key not in HEAD:
            raise DataError(
                f"{file}: [report]: unknown key '{key}': expected {', '.join(HEAD)}{nearest(key, HEAD)}"
            )
        if isinstance(value, (dict, list)):
            raise DataError(f"{file}: [report] {key}: expected text")
    return {key: str(value) for key, value in result.items()}
