"""What a command prints, read again."""

from __future__ import annotations

import csv
import io
import json
import subprocess
from typing import Any


def document(done: subprocess.CompletedProcess[str]) -> Any:
    """Return the JSON of a command that ended well."""
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def rows(text: str) -> list[dict[str, str]]:
    """Return the rows of a CSV."""
    return list(csv.DictReader(io.StringIO(text)))


def table(done: subprocess.CompletedProcess[str]) -> list[dict[str, str]]:
    """Return the rows that a command printed which ended well."""
    assert done.returncode == 0, done.stderr
    return rows(done.stdout)
