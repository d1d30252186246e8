"""The positions of rest of a mechanism: as a table, as JSON, drawn; the worked solution."""

from __future__ import annotations

import math
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np

from cli.cases.analysis import Analysis
from cli.cases.case import Case, Study
from cli.cases.inputs import Driven, Inputs
from cli.cases.ledger import Entry, entries_of, ledger
from cli.cases.poses import bounds_of, column, degrees_off
from dalembert.angles import in_turn
from dalembert.dataclass import dataclass
from dalembert.results.columns import Column, Table, names, number
from dalembert.results.way import Topic, figures

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.figure import Figure

    from virtualwork.study.equilibrium import Equilibria as Found
    from virtualwork.study.equilibrium import Equilibrium


@dataclass
class Rest(Case):
    """The positions in which one mechanism rests.

    Attributes
    ----------
    ranged : set of int
        The inputs of which a range is searched, by their number.
    """

    study: Equilibria
    analysis: Analysis
    ranged: set[int]

    @cached_property
    def equilibria(self) -> Found:
        """The positions."""
        spans = None
        if self.ranged:
            values = self.analysis.inputs.whole.values
            spans = np.stack([values.min(axis=0), values.max(axis=0)], axis=1)
            # the others are searched in their whole range
            spans[[j for j in range(len(spans)) if j not in self.ranged]] = np.nan
        return self.analysis.mechanism.equilibria(spans)

    @cached_property
    def shown(self) -> list[list[float]]:
        """Each input at the positions: m, or deg within the turns after which the loads repeat; deg as counted where they never do."""
        columns = []
        for j, (entry, turns) in enumerate(
            zip(self.analysis.mechanism.inputs, self.equilibria.turns, strict=True)
        ):
            values = [e.inputs[j] for e in self.equilibria.found]
            if not entry.is_slide:
                values = [math.degrees(x) for x in values]
            if turns:
                values = [in_turn(x, turns) for x in values]
            columns.append(values)
        return columns

    def table(self) -> Table:
        """Return a row for each position."""
        m, positions = self.analysis.mechanism, self.equilibria.found
        one = len(m.inputs) == 1
        columns = []
        for j, (entry, header) in enumerate(zip(m.inputs, self.analysis.input_columns, strict=True)):
            place = self.analysis.input_names[entry.name]
            columns.append(column(header, self.shown[j], partial(self._errors, j)))
            columns[-1].place = place if one else f"inputs.{entry.name}.{place}"
        columns.append(names("stable", [e.stable for e in positions]))
        energy = np.array([e.potential for e in positions], dtype=float)
        columns.append(number("potential", "energy", energy, error=partial(self._estimates, "potential", 0)))
        for i in range(len(m.inputs)):
            periods = [e.periods[i] if i < len(e.periods) else None for e in positions]
            name = "period" if i == 0 else f"period_{i + 1}"
            error = partial(self._estimates, "periods", i)
            columns.append(number(name, "time", np.array(periods, dtype=float), error=error))
        return Table(columns, place="equilibria[]")

    def _errors(self, j: int) -> list[float]:
        """How far an input lies from where it rests, as it is shown."""
        positions, entry = self.equilibria.found, self.analysis.mechanism.inputs[j]
        off = np.array([e.error_estimate()[j] for e in positions])
        if not entry.is_slide:
            at = np.array([e.inputs[j] for e in positions])
            off = np.degrees(off) + degrees_off(at, np.array(self.shown[j]))
        return bounds_of(off)

    def _estimates(self, of: str, i: int) -> list[float]:
        """The estimates of the errors of a quantity of every position, by its number; NaN where a position has none."""
        estimates = [e.error_estimate(of) for e in self.equilibria.found]
        return [each[i] if i < len(each) else math.nan for each in estimates]

    def warnings(self) -> list[str]:
        """Return the warnings: what the table does not show."""
        equilibria, lines = self.equilibria, list(self.analysis.warnings)
        if not equilibria.loaded:
            lines.append("nothing acts at rest: every position is one of equilibrium")
        elif equilibria.region:
            lines.append("positions of rest fill a part of the range: they are not isolated, and not listed")
        elif equilibria.everywhere:
            lines.append(
                "the loads balance in every position: equilibrium everywhere, neither stable nor unstable"
            )
        elif not equilibria.found:
            lines.append("no equilibrium: the loads balance at no position of the range")
        m = self.analysis.mechanism
        for j, (entry, turns) in enumerate(zip(m.inputs, equilibria.turns, strict=True)):
            if not (turns or entry.is_slide or j in self.ranged or np.isfinite(m.assembly.reach.range).all()):
                low, high = (f"{math.degrees(end):.10g}" for end in equilibria.ranges[j])
                lines.append(
                    f"the loads do not repeat after whole turns of {entry.name}: searched from {low} to {high} deg; "
                    "--over sets another range"
                )
        if any(e.stable and e.period is None for e in equilibria.found):
            lines.append("no period of oscillation: nothing that moves there has a mass or an inertia")
        if any(e.stable is None for e in equilibria.found):
            lines.append(
                "stable null: the second variation of the potential vanishes there and does not decide"
            )
        return lines

    def way(self) -> list[Topic]:
        """Return the virtual work of every load at each position."""
        return way(self.analysis, self.equilibria.found, self.shown)

    def figure(self) -> Figure:
        """Draw the mechanism in its positions of rest; in its own pose where there is none."""
        from cli.cases.picture import drawn

        a = self.analysis
        q = np.array([e.inputs for e in self.equilibria.found]).reshape(-1, len(a.mechanism.inputs))
        if not len(q):
            return drawn(a.at(a.inputs.part(0, 1)))
        steps = [str(i) for i in range(1, len(q) + 1)]
        return drawn(a.at(Inputs(q, np.degrees(q), steps=steps)))


@dataclass(frozen=True)
class Equilibria(Study):
    """Find the positions of rest of every case."""

    title = "equilibria"
    method = (
        "Positions where the generalized force of the loads vanishes; stable where the second variation of the potential "
        "is positive (Lagrange and Dirichlet). Periods are those of small oscillations without dampers and friction, from "
        "the generalized mass."
    )

    def case(self, analysis: Analysis) -> Rest:
        """Return the positions of rest of one mechanism."""
        moved = self.cases.moved
        names = () if moved is None or moved.axes[0].option == "[input] law" else moved.names
        rest = Rest(self, analysis, {name.j for name in names if isinstance(name, Driven) and not name.order})
        # one that cannot be assembled is an error here, and no case
        _ = rest.equilibria
        return rest


def way(a: Analysis, positions: Sequence[Equilibrium], shown: Sequence[Sequence[float]]) -> list[Topic]:
    """Return the topics: the condition, and the ledger at every position."""
    m = a.mechanism
    text = [
        "At rest no virtual displacement of an input does work: Q_j = Σ F·∂P/∂q_j + Σ T·∂θ/∂q_j = 0 (Riul, unit II, eq. 3);",
        "stable where the potential is least there: its second variation is positive (Lagrange and Dirichlet).",
    ]
    topics = [Topic("condition", text, "Condition of equilibrium", {"positions": len(positions)})]
    if not positions:
        return topics
    motion = m.motion(np.array([e.inputs for e in positions]), *([[0.0] * len(m.inputs)] * 2))
    every = [entries_of(motion, j) for j in range(len(m.inputs))]
    instants: list[tuple[list[Column], list[Entry]]] = []
    for i in range(len(positions)):
        head = []
        for entry, values in zip(m.inputs, shown, strict=True):
            key = a.input_names[entry.name]
            one = len(m.inputs) == 1
            place = key if one else f"inputs.{entry.name}.{key}"
            name = "input" if one else f"{entry.name}_input"
            head.append(Column(name, key.removeprefix("input_"), [values[i]], place=place))
        loads = [load for each in every for load in each[i] if load.kind not in ("unknown", "joint force")]
        instants.append((head, loads))
    sums = [
        f"  {', '.join(f'{column.name} {figures(column.values[0])}' for column in head)}: ΣF·V + ΣT·ω = "  # type: ignore[arg-type]
        f"{' + '.join(f'({figures(load.power)})' for load in loads if load.power) or '0'}"
        for head, loads in instants
    ]
    return [*topics, ledger("poses[]", instants, ["For a unit speed of the input:", *sums])]
