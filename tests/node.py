"""JavaScript run by node, as a page's script is by a browser."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

NODE = shutil.which("node") or shutil.which("nodejs")
needs_node = pytest.mark.skipif(
    NODE is None, reason="node is missing: it runs the pages' scripts (Debian: nodejs)"
)


def run_script(script: str, folder: Path, given: Any = None) -> Any:
    """Run a script, which finds what is given as `given` and calls `answer(value)` once; return that value.

    Numbers travel as JSON, NaN and infinities as text.
    """
    assert NODE is not None
    (folder / "given.json").write_text(
        json.dumps(given, allow_nan=True).replace("NaN", '"NaN"').replace("Infinity", '"Infinity"')
    )
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
