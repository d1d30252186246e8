"""Every many-digit oracle, once: what the program's answers are measured and tested against.

`answers/` holds stored ones, made by `python -m benchmarks.truth.make_answers` without dalembert.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any


def reference(name: str) -> Any:
    """Return stored answers of extended precision."""
    return json.loads(
        Path(__file__).with_name("answers").joinpath(f"{name}.json").read_text(encoding="utf-8")
    )
