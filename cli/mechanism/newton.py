"""The poses of `dalembert mechanism`, and the iterates of Newton and Raphson beside them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from cli.cases.study import Further, PoseStudy
from dalembert.dataclass import dataclass
from dalembert.results.columns import Column, Table, names, number

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cli.cases.analysis import Analysis
    from cli.show.commands import ShowOptions
    from dalembert.results.way import Topic

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
        """Whether each variant has more than its poses."""
        return self.newton

    def in_blocks(self, show: ShowOptions) -> bool:
        """Whether the table alone is written: a block of poses at a time."""
        return not self.newton and super().in_blocks(show)

    def further(self, analysis: Analysis) -> Further:
        """The iterates."""
        if not self.newton:
            return Further()
        return Further(iterates(analysis))

    def way(self, analysis: Analysis) -> list[Topic]:
        """Loops, closed forms, Newton's iterates, parts of motion."""
        from cli.mechanism.way import way

        return way(analysis, newton=self.newton)

    def figure(self, analysis: Analysis) -> Figure:
        """The mechanism to scale: the first pose in full, others as ghosts, the paths of its points; or curves."""
        from cli.cases.picture import curves, drawn, is_by_quantity

        return curves(analysis) if is_by_quantity(analysis) else drawn(analysis)


def iterates(analysis: Analysis) -> dict[str, Table]:
    """Newton-Raphson from the guess at every pose; the iterates of the first, the largest difference of all."""
    from virtualwork.study.newton_table import all_at_once

    assembly = analysis.assemblies[0]
    solutions = [all_at_once(assembly, tuple(row)) for row in analysis.inputs.whole.values.tolist()]
    first = solutions[0]
    away = [i for i, each in enumerate(solutions) if not each.closed or not each.difference < SAME]
    for i in away[:3]:
        why = "did not converge" if not solutions[i].closed else "found another assembly"
        analysis.warnings.append(f"newton from the guess {why} at step {analysis.inputs.whole.steps[i]}")
    if len(away) > 3:
        analysis.warnings.append(
            f"newton from the guess missed the assembly at {len(away)} of {len(solutions)} poses"
        )
    columns = [names("k", [each.k for each in first.iterates])]
    for i, unknown in enumerate(first.unknowns):
        values = np.array([each.unknowns[i] for each in first.iterates])
        turns = i < first.angles
        columns.append(
            number(unknown, "angle" if turns else "length", np.degrees(values) if turns else values)
        )
        columns[-1].place = (columns[-1].header,)
    columns.append(number("residual", "length", [each.residual for each in first.iterates]))
    rows = zip(first.unknowns, np.array(first.jacobian).T.tolist(), strict=True)
    jacobian = [Column(unknown, "", row, place=str(j)) for j, (unknown, row) in enumerate(rows)]
    about = [names("unknowns", [list(first.unknowns)]), names("at", ["the guess"])]
    difference = max(
        (each.difference for each in solutions if math.isfinite(each.difference)), default=math.nan
    )
    return {
        "newton": Table(
            columns, ("k",), "iterates[]", above="Newton-Raphson, all loops at once, from the guess"
        ),
        "jacobian": Table(jacobian, (), "jacobian.rows[]", above="at the guess, x and y of each loop"),
        "of the jacobian": Table([], place="jacobian", documented=about),
        "difference": Table(
            [Column("newton_difference", "rad", [difference], place="newton_difference_rad")],
            place="",
            above="largest, to the assembly solved group by group",
        ),
    }
