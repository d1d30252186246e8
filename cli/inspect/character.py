"""The character of a mechanism: as a table, as JSON, and the order of its solution."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

from cli.cases.analysis import Analysis
from cli.cases.case import TableCase, TableStudy
from cli.cases.poses import listed
from cli.cases.study import METHOD
from dalembert.results.columns import Table
from virtualwork.plan.steps import Group, Place, Slide, Turn

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cli.cases.case import Rows
    from dalembert.results.columns import Cell
    from dalembert.results.way import Topic
    from virtualwork.formulas.asked import Key

Document = dict[str, Any]


@dataclass
class Character(TableCase):
    """What kind of mechanism one is."""

    analysis: Analysis
    name: str = field(init=False)

    def __post_init__(self) -> None:
        self.name = self.analysis.mechanism.name

    @cached_property
    def check(self) -> Document:
        """As JSON has it."""
        return check_document(self.analysis)

    def document(self) -> Document:
        """What the JSON document has of it."""
        return {"check": self.check}

    def table(self) -> Table:
        """A row for each statement, named as in JSON."""
        return of_check(self.check)

    def warnings(self) -> list[str]:
        """What is remarkable about its branches."""
        return [*self.analysis.warnings, *self.analysis.mechanism.assembly.track.warnings()]

    def words(self) -> str:
        """The order of solution."""
        return order_text(self.analysis)

    def way(self) -> list[Topic]:
        """Mobility, loops, four-bars."""
        from cli.inspect.way import way

        return way(self.analysis.mechanism, self.check)

    def figure(self) -> Figure:
        """The mechanism in its own pose."""
        from cli.cases.picture import drawn

        return drawn(self.analysis)


@dataclass(frozen=True)
class Inspection(TableStudy):
    """Inspect every case."""

    title = "check"
    method = METHOD

    def case(self, row: Rows | None = None) -> Character:
        """A variant, or the mechanism itself."""
        m = self.mechanism if row is None else self.variant(row)
        _ = m.assembly
        return Character(Analysis(self.request, m, self.inputs(m, row).part(0, 1)))


def check_document(analysis: Analysis) -> Document:
    """The character of a mechanism."""
    from virtualwork.study.check import Check

    check = Check(analysis.mechanism.assembly)
    unit = analysis.unit

    def shown(values: Sequence[float] | None) -> list[float | None] | None:
        if values is None:
            return None
        return [None if not math.isfinite(v) else (v if unit == "m" else math.degrees(v)) for v in values]

    return {
        "mobility": check.mobility,
        "mobility_by_rank": check.mobility_by_rank,
        "redundant": list(check.redundant),
        "groups": list(check.groups),
        "four_bars": [
            {
                "links": list(f.links),
                "grashof": f.grashof,
                "transmission_deg": [math.degrees(v) if math.isfinite(v) else None for v in f.transmission],
            }
            for f in check.four_bars
        ],
        f"input_limits_{unit}": shown(check.printed_limits),
        f"dead_points_{unit}": shown(check.dead_points),
        f"change_points_{unit}": shown(check.change_points),
        **({"singular": list(check.singular)} if check.singular else {}),
    }


def of_check(document: Document) -> Table:
    """A row for each statement, named as in JSON."""
    rows: list[tuple[str, str, Cell]] = [
        ("mobility", "", document["mobility"]),
        ("mobility_by_rank", "", document["mobility_by_rank"]),
        *(("redundant", name, True) for name in document["redundant"]),
        *(("group", " + ".join(g["links"]), f"{g['kind']}, {g['method']}") for g in document["groups"]),
        *(("singular", name, True) for name in document.get("singular", ())),
    ]
    for f in document["four_bars"]:
        links = ", ".join(f["links"])
        rows.append(("grashof", links, f["grashof"]))
        for word, value in zip(("least", "largest"), f["transmission_deg"], strict=True):
            rows.append((f"{word}_transmission_deg", links, value))
    for key in document:
        if key.startswith(("input_limits", "dead_points", "change_points")):
            values = ["none"] if not document[key] else ["open" if v is None else v for v in document[key]]
            rows += [(key, str(i) if len(values) > 1 else "", v) for i, v in enumerate(values, 1)]
    return listed(("quantity", "of", "value"), rows)


def order_text(analysis: Analysis) -> str:
    """The order of solution, and how many operations a pose costs."""
    m, plan = analysis.mechanism, analysis.assemblies[0].plan
    lines = ["order of solution:"]
    for i, step in enumerate(plan.steps, 1):
        if isinstance(step, Turn):
            text = f"angle of {step.body}: {_angle_text(analysis, step)}"
        elif isinstance(step, Slide):
            text = f"slide at {m.guides[step.guide].point}: the input"
        elif isinstance(step, Place):
            text = f"point {step.node}"
        else:
            assert isinstance(step, Group)
            how = "Newton-Raphson" if step.kind == "Newton" else f"{step.kind}, closed form"
            text = f"group {step.name}: {how}"
        lines.append(f"{i:4d}  {text}")
    return "\n".join([*lines, _operations(analysis), *_forces_text(analysis)])


def _operations(analysis: Analysis) -> str:
    """What all points and links of a pose cost, with rates where the input has any."""
    motion = analysis.motions[0]
    m = motion.mechanism
    moves = any(not isinstance(rate, float) or rate for rates in motion.poses.rates for rate in rates)
    keys: list[Key] = []
    counts = []
    for order, what in enumerate(("", " with velocities", " with accelerations")[: 3 if moves else 1]):
        keys += [("point", body, 0j, p, order) for body in m.links for p in m.bodies[body]]
        keys += [("angle", body, order) for body in m.links]
        counts.append(f"{motion.lanes.operations(keys)}{what}")
    return f"operations a pose of all points and links: {', '.join(counts)}"


def _angle_text(analysis: Analysis, step: Turn) -> str:
    inputs = analysis.mechanism.inputs
    parts = [
        f"{k:g}·input {inputs[j].name}" if k != 1 else f"input {inputs[j].name}" for j, k in step.angle.inputs
    ]
    guides = analysis.mechanism.guides
    for base, r in step.angle.bases:
        name = f"slide {guides[base].point}" if isinstance(base, int) else base
        parts.append(f"{r:g}·{name}" if r != 1 else name)
    if step.angle.const:
        parts.append(f"{math.degrees(step.angle.const):g} deg")
    return " + ".join(parts) or "fixed"


def _forces_text(analysis: Analysis) -> list[str]:
    """Which loads do work at each input, which do none, which are absent; how many operations the forces cost."""
    from virtualwork.formulas.effort import ledger

    motion = analysis.motions[0]
    if not motion.assembled.all():
        return []
    lines = ["forces:"]
    keys: list[Key] = [("force", joint.key, joint.bodies[-1]) for joint in motion.dynamics.reactions.joints]
    keys += [("effort", j) for j in range(len(analysis.mechanism.inputs))]
    if motion.lanes.takes(keys):
        lines.append(f"  operations a pose: {motion.lanes.operations(keys)}")
    for j, entry in enumerate(analysis.mechanism.inputs):
        works, workless, absent = ledger(motion.dynamics.scene, j)
        lines.append(f"  virtual work at input {entry.name}: {', '.join(works) or 'no load does any'}")
        if workless:
            lines.append(f"  do no work: {', '.join(workless)}")
        if j == 0 and absent:
            lines += [f"  absent: {line}" for line in absent]
    lines.append("  joint forces, action and reaction, do no work together: none enters the effort")
    return lines
