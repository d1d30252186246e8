"""The page of a mechanism that moves: the columns of the CSV, every requested assembly as a series."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from cli.cases import poses
from cli.cases.analysis import Analysis
from cli.cases.case import Case
from cli.cases.study import PoseCase
from cli.show.picture import shown
from dalembert.page import Shown
from virtualwork import MechanismError
from virtualwork.animation import JointForce, Series, moving_page


def of_poses(cases: Sequence[tuple[str, Case]], units: str | None) -> bytes:
    """The page of all points and links.

    Parameters
    ----------
    cases : sequence of (variant, case)
        The first is drawn in full, the others as ghosts.
    units : str, optional
        As --units has them.
    """
    analyses = [(name, case.analysis) for name, case in cases if isinstance(case, PoseCase)]
    series = [one for name, analysis in analyses for one in _series(name, analysis, units)]
    if not series:
        raise MechanismError("--page: no variant can be assembled, and there is nothing to draw")
    return moving_page(series[0].mechanism.name, series).html.encode()


def _series(variant: str, analysis: Analysis, units: str | None) -> Iterator[Series]:
    """Every assembly; none of a variant that cannot be assembled, which the poses' own remarks name."""
    try:
        every = list(zip(analysis.assemblies, analysis.motions, strict=True))
    except MechanismError:
        if not variant:
            raise
        return
    forces = analysis.request.forces
    for assembly, motion in every:
        listed: dict[str, Shown] = {}
        arrows: list[JointForce] = []
        # every point and link, whatever --only names: all of it is drawn
        for of_forces in (False, True)[: 1 + forces]:
            request = analysis.request._replace(only=None, forces=of_forces)
            one = replace(analysis, request=request)
            one.assemblies, one.motions = (assembly,), (motion,)
            listed |= shown(poses.table(one), units)
            arrows = [JointForce.of(*row) for row in (one.pairs if of_forces else ())]
        names = [
            f"variant {variant}" if variant else "",
            f"branch {assembly.number}" if analysis.several else "",
        ]
        name = ", ".join(filter(None, names))
        yield Series(motion.poses, motion.drawing, listed, analysis.input_columns, arrows, name)
