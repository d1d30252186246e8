"""The poses of `dalembert mechanism`, and the iterates of Newton and Raphson."""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from cli.cases.study import PoseCase, PoseStudy
from dalembert.angles import read_degrees
from dalembert.dataclass import dataclass
from dalembert.results.columns import Column, Table, names, number
from dalembert.results.way import Topic

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cli.cases.analysis import Analysis

# radians between the solution from the guess and that of the groups: beyond it they are two assemblies
SAME = 1e-6


@dataclass
class Solved(PoseCase):
    """The poses of one mechanism, and Newton's iterates."""

    study: Poses

    @cached_property
    def extra(self) -> dict[str, Table]:
        """Newton-Raphson iterates, which --newton shows."""
        return iterates(self.analysis) if self.study.newton else {}

    def way(self) -> list[Topic]:
        """Return the loops, the closed forms, Newton's iterates and the parts of the motion."""
        from cli.mechanism.way import way

        return way(self.analysis, newton=self.study.newton)

    def figure(self) -> Figure:
        """Draw the mechanism to scale, with ghosts and paths; or the curves of single quantities."""
        from cli.cases.picture import curves, drawn, is_by_quantity

        return curves(self.analysis) if is_by_quantity(self.analysis) else drawn(self.analysis)


@dataclass(frozen=True)
class Poses(PoseStudy):
    """Solve the poses of every case, with their rates.

    Attributes
    ----------
    newton : bool
        Whether all loops are solved at once in addition.
    """

    newton: bool = False

    kind = Solved

    @property
    def poses_alone(self) -> bool:
        """Whether a file of tables has the poses and nothing else."""
        return not self.newton

    @property
    def extra_in_json(self) -> bool:
        """Whether the JSON document of each variant has more than its poses."""
        return self.newton


def iterates(analysis: Analysis) -> dict[str, Table]:
    """Solve every pose by Newton-Raphson from the guess; return the iterates of the first and the largest difference."""
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
        values = [each.unknowns[i] for each in first.iterates]
        turns = i < first.angles
        # the first is the guess, as the file has it
        shown = [read_degrees(value) for value in values] if turns else values
        columns.append(number(unknown, "angle" if turns else "length", shown))
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
