"""The page of a rotation in time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cli.show.page import shown
from cli.spin.columns import states
from cli.spin.solve import Rotation
from rigidbody3d.animation import turning_page

if TYPE_CHECKING:
    from dalembert.page import Page


def page(found: Rotation, units: str | None) -> Page:
    """Return the page; `units` as --units has them."""
    given = found.given
    columns = shown(states(found), units)
    return turning_page(given.name, given.inertia, given.omega, columns, given.mgl is not None)
