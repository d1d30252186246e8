"""Pages that compute, without a browser: the part of their script that knows no screen, run by node."""

from __future__ import annotations

import html
import json
import re
from pathlib import Path
from typing import Any

from tests.node import run_script


def script_and_data(page: str) -> tuple[str, dict[str, Any]]:
    """The script of a page, and what it reads."""
    data = re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.DOTALL)
    script = re.search(r"<script>(.*?)</script>", page[page.index("</main>") :], re.DOTALL)
    assert data is not None
    assert script is not None
    return html.unescape(script[1]) if "&lt;" in script[1] else script[1], json.loads(data[1])


def machines(
    pages: list[str],
    folder: Path,
    tries: list[list[dict[str, float]]],
    names: list[list[str]],
    curves: bool = False,
    drawn: bool = False,
) -> Any:
    """What pages answer: of each page and each try the names at the free pose; with `curves` over the sweep.

    With `drawn` the shapes of the drawing instead.

    Parameters
    ----------
    tries : of each page what is set, one after the other; `input` or an input's name is the free pose
    names : of each page what is asked for
    """
    bodies, models, drawings = [], [], []
    shared = ""
    for page in pages:
        script, data = script_and_data(page)
        before, after = script.split("// What every page shares", 1)
        engine, tapes = re.split(r"(?=const tapes = )", before, maxsplit=1)
        tape, rest = re.split(r"(?<=\n};\n)", tapes, maxsplit=1)
        unpack = re.search(r"^function unpack.*?^}", after, re.DOTALL | re.MULTILINE)
        assert unpack is not None
        shared = engine.replace('"use strict";', "") + unpack[0] + rest
        bodies.append(tape.replace("const tapes = ", "").rstrip().rstrip(";"))
        models.append(data["model"])
        drawings.append(data["series"][0])
    every = ",\n".join(bodies)
    script = f"""{shared}
const every = [{every}];
answer(every.map((tapes, p) => {{
  const {{ model, tries, names }} = given[p];
  const machine = new Machine(model, tapes);
  return tries.map((change) => {{
    const numbers = {{ ...machine.own }};
    const free = model.first.slice();
    for (const [name, x] of Object.entries(change)) {{
      const j = name === "input" ? 0 : model.inputs.findIndex((input) => input.name === name);
      if (j >= 0) free[j] = x;
      else numbers[name] = x;
    }}
    const state = machine.solve(numbers, free);
    const curve = (name) => Array.from({{ length: model.n }}, (_, l) => machine.quantity(state, model.quantities[name])(l));
    if ({"true" if drawn else "false"}) {{
      const series = structuredClone(given[p].series);
      redraw(machine, state, series);
      return series.shapes;
    }}
    return names.map((name) => ({"curve(name)" if curves else "machine.quantity(state, model.quantities[name])(model.n)"}));
  }});
}}));"""
    given = [
        {"model": model, "tries": each, "names": wanted, "series": series if drawn else None}
        for model, each, wanted, series in zip(models, tries, names, drawings, strict=True)
    ]
    return run_script(script, folder, given)
