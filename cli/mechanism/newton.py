"""The poses of `dalembert mechanism`, and the iterates of Newton and Raphson beside them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cli.cases.poses import records
from cli.cases.study import Further, PoseStudy
from dalembert.results.text import table_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cli.cases.analysis import Analysis
    from cli.show.commands import ShowOptions
    from dalembert.results.way import Topic

Document = dict[str, Any]
# radians between the solution from the guess and that of the groups: beyond it they are two assemblies
SAME = 1e-6


@dataclass(frozen=True)
class Poses(PoseStudy):
    """Poses and their rates.

    Attributes
    ----------
    newton : bool
        Whether all loops are solved at once, too.
    """

    newton: bool = False

    @property
    def beside_each(self) -> bool:
        """Whether something stands beside the poses of each variant."""
        return self.newton

    def in_blocks(self, show: ShowOptions) -> bool:
        """Whether the table alone is written: a block of poses at a time."""
        return not self.newton and super().in_blocks(show)

    def further(self, analysis: Analysis) -> Further:
        """The iterates."""
        if not self.newton:
            return Further()
        document = iterates(analysis)
        return Further({"newton": records(document["iterates"])}, newton_text(document), document)

    def way(self, analysis: Analysis) -> list[Topic]:
        """Loops, closed forms, Newton's iterates, parts of motion."""
        from cli.mechanism.way import way

        return way(analysis, newton=self.newton)

    def figure(self, analysis: Analysis) -> Figure:
        """The mechanism to scale: the first pose in full, others as ghosts, the paths of its points; or curves."""
        from cli.cases.picture import curves, drawn, is_by_quantity

        return curves(analysis) if is_by_quantity(analysis) else drawn(analysis)


def iterates(analysis: Analysis) -> Document:
    """Newton-Raphson from the guess at every pose; the iterates of the first, the largest difference of all."""
    from virtualwork.study.newton_table import all_at_once

    assembly = analysis.assemblies[0]
    done = [all_at_once(assembly, tuple(row)) for row in analysis.inputs.values.tolist()]
    first = done[0]
    names = [
        *(f"{n}_deg" for n in first.unknowns[: first.angles]),
        *(f"{n}_m" for n in first.unknowns[first.angles :]),
    ]
    rows = []
    for it in first.iterates:
        values = [*np.degrees(it.unknowns[: first.angles]).tolist(), *it.unknowns[first.angles :].tolist()]
        rows.append({"k": it.k, **dict(zip(names, values, strict=True)), "residual_m": it.residual})
    away = [i for i, d in enumerate(done) if not d.closed or not d.difference < SAME]
    for i in away[:3]:
        why = "did not converge" if not done[i].closed else "found another assembly"
        analysis.warnings.append(f"newton from the guess {why} at step {analysis.inputs.steps[i]}")
    if len(away) > 3:
        analysis.warnings.append(
            f"newton from the guess missed the assembly at {len(away)} of {len(done)} poses"
        )
    differences = [d.difference for d in done if math.isfinite(d.difference)]
    return {
        "iterates": rows,
        "newton_difference_rad": max(differences) if differences else None,
        "jacobian": {"unknowns": list(first.unknowns), "at": "the guess", "rows": first.jacobian.tolist()},
    }


def newton_text(document: Document) -> str:
    """The table of iterates, the Jacobian at the guess, and the difference to the closed form."""
    rows: Sequence[Document] = document["iterates"]
    table = table_text({key: [row[key] for row in rows] for key in rows[0]})
    jacobian = document["jacobian"]
    shown = table_text(
        {name: [row[j] for row in jacobian["rows"]] for j, name in enumerate(jacobian["unknowns"])}
    )
    difference = document["newton_difference_rad"]
    return (
        f"Newton-Raphson, all loops at once, from the guess:\n{table}\nJacobian at the guess (x and y of each loop):\n"
        f"{shown}\nlargest difference to the assembly solved group by group: "
        + ("nothing to compare" if difference is None else f"{difference:.3g} rad")
    )
