"""The worked solution of `dalembert equilibrium`: at each position the virtual work of every load, which adds up to nothing."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cli.cases.ledger import Entry, entries_of, ledger
from dalembert.results.columns import Column
from dalembert.results.way import Topic, figures

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cli.cases.analysis import Analysis
    from virtualwork.study.equilibrium import Equilibrium


def way(a: Analysis, found: Sequence[Equilibrium]) -> list[Topic]:
    """The topics: the condition, and the ledger at every position found."""
    m = a.mechanism
    text = [
        "At rest no virtual displacement of an input does work: Q_j = Σ F·∂P/∂q_j + Σ T·∂θ/∂q_j = 0 (Riul, unit II, eq. 3);",
        "stable where the potential is least there: its second variation is positive (Lagrange and Dirichlet).",
    ]
    topics = [Topic("condition", text, "Condition of equilibrium", {"positions": len(found)})]
    if not found:
        return topics
    motion = m.motion(np.array([e.inputs for e in found]), *([[0.0] * len(m.inputs)] * 2))
    every = [entries_of(motion, j) for j in range(len(m.inputs))]
    instants: list[tuple[list[Column], list[Entry]]] = []
    for i, e in enumerate(found):
        head = []
        for entry, value in zip(m.inputs, e.inputs, strict=True):
            key = a.input_names[entry.name]
            shown = value if entry.is_slide else float(np.degrees(value)) % 360.0
            one = len(m.inputs) == 1
            place = key if one else f"inputs.{entry.name}.{key}"
            name = "input" if one else f"{entry.name}_input"
            head.append(Column(name, key.removeprefix("input_"), [shown], place=place))
        loads = [load for each in every for load in each[i] if load.kind not in ("unknown", "joint force")]
        instants.append((head, loads))
    sums = [
        f"  {', '.join(f'{column.name} {figures(column.values[0])}' for column in head)}: ΣF·V + ΣT·ω = "  # type: ignore[arg-type]
        f"{' + '.join(f'({figures(load.power)})' for load in loads if load.power) or '0'}"
        for head, loads in instants
    ]
    return [*topics, ledger("poses[]", instants, ["For a unit speed of the input:", *sums])]
