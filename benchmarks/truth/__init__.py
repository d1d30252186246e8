"""Every many-digit oracle, once: what the program's answers are measured and tested against.

`answers/` holds stored ones, made by `python -m benchmarks.truth.make_answers` without dalembert.
"""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any


@cache
def reference(name: str) -> Any:
    """Return stored answers of extended precision; read once, as scenes that are described again and again ask for them."""
    return json.loads(
        Path(__file__).with_name("answers").joinpath(f"{name}.json").read_text(encoding="utf-8")
    )
