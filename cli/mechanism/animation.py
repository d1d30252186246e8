"""The page of a mechanism that moves: the columns of the CSV, every assembly asked for as a series."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from cli.mechanism import columns
from cli.mechanism.forces import rows_of
from cli.mechanism.solve import Analysis
from cli.show.page import shown
from virtualwork.animation import JointForce, Series, moving_page

if TYPE_CHECKING:
    from dalembert.page import Page


def page(analysis: Analysis, forces: bool, units: str | None) -> Page:
    """Return the page of all points and links; `units` as --units has them."""
    return moving_page(analysis.mechanism.name, list(_series(analysis, forces, units)))


def _series(analysis: Analysis, forces: bool, units: str | None) -> Iterator[Series]:
    for assembly, motion in zip(analysis.assemblies, analysis.motions, strict=True):
        # every point and link, whatever --only names: all of it is drawn
        one = replace(analysis, only=None)
        one.assemblies, one.motions = (assembly,), (motion,)
        listed = shown(columns.poses(one), units)
        if forces:
            listed |= shown(columns.forces(one), units)
        arrows = [
            JointForce(joint.name, f"{joint.name}: {of} on {on}", f"{joint.name}_{of}_on_{on}_fx_N")
            for joint, on, of in (rows_of(one, motion) if forces else ())
        ]
        name = f"branch {assembly.number}" if analysis.several else ""
        yield Series(motion.poses, motion.drawing, listed, one.input_columns, arrows, name)
