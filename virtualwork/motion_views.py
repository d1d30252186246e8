"""A motion as pictures and pages."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from virtualwork.describe import DescriptionError, require
from virtualwork.formulas.lanes import Lanes

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import FigureBase

    from dalembert.page import Page
    from virtualwork.branch.assembly import Assembly
    from virtualwork.drawing import Drawing
    from virtualwork.forces import Forces


# poses at each end of a motion that a notebook shows
ENDS = 10


class MotionViews:
    """The views of a motion: its drawing, pictures on paper, pages that replay and pages that compute."""

    assembly: Assembly

    @property
    def poses(self) -> Lanes:
        """Its poses."""
        raise NotImplementedError

    @property
    def dynamics(self) -> Forces:
        """The forces of the motion."""
        raise NotImplementedError

    @cached_property
    def drawing(self) -> Drawing:
        """The shapes of the mechanism, its guides as long as they are used; `at(shape.body, z)` moves a shape."""
        from virtualwork.picture.paper import shapes_of

        return shapes_of(self._shown())

    def _shown(self) -> Lanes:
        """Return the poses.

        Raises
        ------
        ValueError
            There are none, so that there is no picture and no page.
        """
        if not self.poses.n:
            raise ValueError("a motion of no poses has no picture and no page: expected one input or more")
        return self.poses

    def plot(self, points: Sequence[str] | None = None, figure: FigureBase | None = None) -> Axes:
        """Draw the mechanism to scale and the paths of points (default: of all that are no joint); return the axes.

        Without a figure it is a new one of pyplot's; without matplotlib (the extra `plot`) an ImportError. A name that is no
        point's is a DescriptionError.
        """
        from virtualwork.picture.paper import on_paper

        every = self.poses.mechanism.points
        points = [points] if isinstance(points, str) else points
        for name in points or ():
            require(name, every, "plot", "point")
        return on_paper(self._shown(), points, figure)

    def plot_curves(self, *names: str, figure: FigureBase | None = None) -> NDArray[np.object_]:
        """Draw `H.x`, `coupler.omega`, `crank.torque` … against the input, a panel for each unit; return their axes."""
        from virtualwork.picture.over_input import curves

        if not names:
            raise DescriptionError("plot_curves: expected the names of quantities, such as 'crank.torque'")
        return curves(self._shown(), names, lambda: self.dynamics, figure)

    def animate(self, forces: bool = False) -> Page:
        """Return a page that replays these poses: the mechanism with play, slider, curves and values.

        A notebook shows it; `.save("motion.html")` writes it to a file that any browser opens.

        Parameters
        ----------
        forces : bool
            Draw the joint forces too.

        Raises
        ------
        ValueError
            More poses than a page can hold.

        Examples
        --------
        >>> from virtualwork import Input, Link, Mechanism
        >>> crank = Mechanism({"O": 0j}, {"crank": Link({"O": 0j, "P": 2})}, inputs=Input(link="crank"))
        >>> "P_vx_m_s" in crank.motion(np.linspace(0, 6, 37), speed=3.0).animate().html
        True
        """
        from virtualwork.animation import of_motion

        return of_motion(self.poses, self.drawing, self.dynamics if forces else None)

    def page(self, forces: bool = False) -> Page:
        """Return a page that computes: dimensions can be dragged and typed, and poses, paths, curves and limits follow.

        The mechanism's formulas stand in the page, which needs no network. What it cannot compute it replays, and says so:
        loops that are singular in every pose, redundant statics with friction, motions in time.

        Parameters
        ----------
        forces : bool
            Effort, joint forces and shaking force too.

        Raises
        ------
        ValueError
            More poses than a page can hold.

        Examples
        --------
        >>> from virtualwork import Input, Link, Mechanism
        >>> crank = Mechanism({"O": 0j}, {"crank": Link({"O": 0j, "P": 2})}, inputs=Input(link="crank"))
        >>> "links.crank.P.x" in crank.motion(np.linspace(0, 6, 37), speed=3.0).page().html
        True
        """
        from virtualwork.computing_page import page_of

        return page_of(self.poses, self.drawing, self.dynamics if forces else None)

    def _repr_html_(self) -> str:
        from html import escape

        from pandas import DataFrame

        from virtualwork.doubts import warnings_of
        from virtualwork.motion_table import columns

        # of many poses those alone are solved that are shown, and one more, which is shown as dots
        shown = np.arange(self.poses.n)
        if self.poses.n > 2 * ENDS:
            shown = np.concatenate([shown[: ENDS + 1], shown[-ENDS:]])
        which = np.zeros(self.poses.n, dtype=bool)
        which[shown] = True
        some = self.poses.some(which)
        frame = DataFrame(columns(some), index=shown)
        called = "poses" if some.n == self.poses.n else "poses shown"
        notes = "".join(f"<p>{escape(text)}</p>" for text in warnings_of(self.assembly, some, called))
        return f"{frame.to_html(max_rows=2 * ENDS)}{notes}"
