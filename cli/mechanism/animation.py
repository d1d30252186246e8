"""The page of a mechanism that moves: the columns of the CSV, every assembly asked for as a series."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from cli.mechanism import columns
from cli.mechanism.quantities import pairs
from cli.mechanism.solve import Analysis
from cli.show.page import shown
from virtualwork import MechanismError
from virtualwork.animation import JointForce, Series, moving_page

if TYPE_CHECKING:
    from cli.mechanism.in_time import InTime
    from dalembert.page import Page


def page(analyses: Sequence[tuple[str, Analysis]], forces: bool, units: str | None) -> Page:
    """Return the page of all points and links.

    Parameters
    ----------
    analyses : sequence of (variant, analysis)
        The first is drawn in full, the others as ghosts.
    units : str, optional
        As --units has them.
    """
    series = [one for name, analysis in analyses for one in _series(name, analysis, forces, units)]
    if not series:
        raise MechanismError("--html: no variant can be put together, and there is nothing to draw")
    return moving_page(series[0].mechanism.name, series)


def page_in_time(found: Sequence[tuple[str, InTime]], units: str | None) -> Page:
    """Return the page of motions under forces: all points and links over time, whatever --only names.

    Parameters
    ----------
    found : sequence of (variant, motion)
        That which goes on for longest is drawn in full, the others as ghosts.
    """
    if not found:
        raise MechanismError("--html: no variant can be let go, and there is nothing to draw")
    series = [_in_time(name, one, units) for name, one in found]
    series.sort(key=lambda one: -one.poses.n)
    return moving_page(series[0].mechanism.name, series, time="t_s")


def _in_time(variant: str, found: InTime, units: str | None) -> Series:
    home = found.analysis
    every = replace(home, only=[*home.mechanism.links, *replace(home, only=None).points])
    every.assemblies = home.assemblies
    whole = replace(found, analysis=every)
    whole.run = found.run
    arrows = pairs(every) if found.forces else ()
    columns = shown(whole.table(), units)
    name = f"variant {variant}" if variant else ""
    return found.run.series(
        columns, ["t_s", *home.input_columns], [JointForce.of(*row) for row in arrows], name
    )


def _series(variant: str, analysis: Analysis, forces: bool, units: str | None) -> Iterator[Series]:
    """Every assembly asked for; none of a variant that cannot be put together, which the poses' own remarks name."""
    try:
        found = list(zip(analysis.assemblies, analysis.motions, strict=True))
    except MechanismError:
        if not variant:
            raise
        return
    for assembly, motion in found:
        # every point and link, whatever --only names: all of it is drawn
        one = replace(analysis, only=None)
        one.assemblies, one.motions = (assembly,), (motion,)
        listed = shown(columns.table(one, forces=False), units)
        if forces:
            listed |= shown(columns.table(one, forces=True), units)
        arrows = [JointForce.of(*row) for row in (pairs(one) if forces else ())]
        names = [
            f"variant {variant}" if variant else "",
            f"branch {assembly.number}" if analysis.several else "",
        ]
        name = ", ".join(filter(None, names))
        yield Series(motion.poses, motion.drawing, listed, one.input_columns, arrows, name)
