"""JavaScript run by node, as a page's script is by a browser."""

from __future__ import annotations

import json
import math
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

NODE = shutil.which("node") or shutil.which("nodejs")
needs_node = pytest.mark.skipif(
    NODE is None, reason="node is missing: it runs the pages' scripts (Debian: nodejs)"
)


def _as_text(value: Any) -> Any:
    """Numbers that JSON has not, as text; texts (base64, which may hold "NaN") stay."""
    if isinstance(value, dict):
        return {key: _as_text(part) for key, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [_as_text(part) for part in value]
    return json.dumps(value) if isinstance(value, float) and not math.isfinite(value) else value


def run_script(script: str, folder: Path, given: Any = None) -> Any:
    """Run a script, which finds what is given as `given` and calls `answer(value)` once; return that value.

    Numbers travel as JSON, NaN and infinities as text.
    """
    assert NODE is not None
    (folder / "given.json").write_text(json.dumps(_as_text(given), allow_nan=False))
    (folder / "script.js").write_text(
        '"use strict";\nconst given = JSON.parse(require("fs").readFileSync("given.json"));\n'
        "const answer = (x) => require('fs').writeFileSync('answer.json', JSON.stringify(x, (_, v) =>"
        " ArrayBuffer.isView(v) ? [...v] : typeof v === 'number' && !Number.isFinite(v) ? String(v) : Object.is(v, -0) ? '-0.0' : v));\n"
        + script
    )
    done = subprocess.run(
        [NODE, "script.js"], cwd=folder, capture_output=True, text=True, check=False, timeout=120
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return json.loads((folder / "answer.json").read_text())
