"""The page of a mechanism that moves, and computes itself anew; the columns of the CSV, every requested assembly as a series."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from cli.cases import poses
from cli.cases.analysis import Analysis
from cli.cases.poses import column
from cli.show.picture import shown
from dalembert.page import Shown
from dalembert.results.columns import Table
from virtualwork import MechanismError, quantities
from virtualwork.animation import JointForce, Series, moving_page
from virtualwork.computing_page import ORDERS, computing_page
from virtualwork.motion import Motion
from virtualwork.quantities import Component

SWEEP = 361
"""Poses of a turn, where one pose was requested."""


def of_poses(analyses: Sequence[tuple[str, Analysis]], units: str | None, bare: Mapping[str, str]) -> bytes:
    """The page of all points and links: it computes itself where the formulas can be written into it, else it replays.

    Parameters
    ----------
    analyses : sequence of (variant, analysis)
        The first is drawn in full, the others as ghosts.
    units : str, optional
        As --units has them.
    bare : mapping of kind to unit
        What the file's bare numbers mean.
    """
    reason = ""
    if analyses:
        made = _computing(analyses, units, bare)
        if not isinstance(made, str):
            return made
        reason = f"This page replays what was computed: {made}." if made else ""
    series = [one for name, analysis in analyses for one in _series(name, analysis, units)]
    if not series:
        raise MechanismError("--page: no variant can be assembled, and there is nothing to draw")
    return moving_page(series[0].mechanism.name, series, note=reason).html.encode()


def _computing(
    analyses: Sequence[tuple[str, Analysis]], units: str | None, bare: Mapping[str, str]
) -> bytes | str:
    """The page that computes, or why there is none."""
    variant, first = analyses[0]
    try:
        motion, assembly = first.motions[0], first.assemblies[0]
    except MechanismError:
        # the series that replay name what is wrong, or leave the variant out
        return ""
    others = [one for name, analysis in analyses for one in _series(name, analysis, units, computed=first)]
    m = first.mechanism
    start = motion.inputs[0]
    if motion.n == 1 and len(m.inputs) == 1 and not m.inputs[0].is_slide:
        # one pose, and the whole turn from it
        motion = Motion(
            assembly,
            start[0] + np.linspace(0.0, 2 * np.pi, SWEEP),
            first.inputs.whole.speed,
            first.inputs.whole.acceleration,
        )
    pairs = first.pairs if first.request.forces else []
    order = max(ORDERS, first.order)
    named = quantities.places(m, order)
    listed = [each for each in named if each.order <= first.order]
    if first.request.forces:
        forces = quantities.forces(m, pairs)
        named += forces
        listed += [each for each in forces if each.key and not each.reverse]
    wanted: list[tuple[Component | int, str]] = list(enumerate(first.input_columns))
    wanted += [(each, each.header) for each in listed]
    table = shown(Table([column(header, []) for _, header in wanted]), units)
    arrows = [JointForce.of(*row) for row in pairs]
    made = computing_page(
        motion.poses,
        {header: (what, table[header]) for what, header in wanted},
        named,
        arrows,
        bare,
        others,
        start,
        order,
        _name(variant, first, 0),
    )
    return made if isinstance(made, str) else made.html.encode()


def _name(variant: str, analysis: Analysis, i: int) -> str:
    """What a series is called: its variant and its branch, where there are several."""
    names = [
        f"variant {variant}" if variant else "",
        f"branch {analysis.assemblies[i].number}" if analysis.several else "",
    ]
    return ", ".join(filter(None, names))


def _series(
    variant: str, analysis: Analysis, units: str | None, computed: Analysis | None = None
) -> Iterator[Series]:
    """Every assembly but the one that the page computes; none of a variant that cannot be assembled, which the poses' own remarks name."""
    try:
        every = list(zip(analysis.assemblies, analysis.motions, strict=True))
    except MechanismError:
        if not variant:
            raise
        return
    forces = analysis.request.forces
    for i, (assembly, motion) in enumerate(every):
        if analysis is computed and i == 0:
            continue
        listed: dict[str, Shown] = {}
        arrows: list[JointForce] = []
        # every point and link, whatever --only names: all of it is drawn
        for of_forces in (False, True)[: 1 + forces]:
            request = analysis.request._replace(only=None, forces=of_forces)
            one = replace(analysis, request=request)
            one.assemblies, one.motions = (assembly,), (motion,)
            listed |= shown(poses.table(one), units)
            arrows = [JointForce.of(*row) for row in (one.pairs if of_forces else ())]
        yield Series(
            motion.poses, motion.drawing, listed, analysis.input_columns, arrows, _name(variant, analysis, i)
        )
