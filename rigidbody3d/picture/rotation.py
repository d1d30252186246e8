"""A rotation in time: ω over time, the polhode where two ellipsoids meet, the trace of a body axis on the sphere of space."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.drawing.curves import Curve, panel, spread
from dalembert.drawing.sheet import sheet
from rigidbody3d.attitude import rotate
from rigidbody3d.inertia import principal
from rigidbody3d.solids import traced_axis

if TYPE_CHECKING:
    from matplotlib.figure import FigureBase
    from mpl_toolkits.mplot3d import Axes3D

Array = NDArray[np.float64]
ROOM = 1.35
"""The ellipsoids are drawn to this multiple of the reach of the polhode."""


def rotation(
    time: Array,
    omega: Array,
    attitude: Array,
    inertia: ArrayLike,
    *,
    free: bool,
    top: bool = False,
    name: str = "",
    figure: FigureBase | None = None,
) -> NDArray[np.object_]:
    """Draw a rotation.

    Parameters
    ----------
    time, omega, attitude
        (n,) s; (n, 3) rad/s in body axes; (n, 4) from body to space.
    inertia
        Principal moments (3,) or the tensor (3, 3), kg·m².
    free
        Whether no torque acts: then the ellipsoids of energy and momentum are drawn too.
    top
        Whether body z is the axis of a top.
    name
        Of the body.
    figure
        See `dalembert.drawing.sheet`.

    Returns
    -------
    array (3,) of axes
        ω over time, ω in body axes, the trace on the sphere.
    """
    figure = sheet(11, 8.0, figure)
    upper, lower = figure.subfigures(2, 1, height_ratios=(1, 1.9), squeeze=False)[:, 0]
    axes = upper.subplots()
    curves = [Curve(f"ω{letter}", part) for letter, part in zip("xyz", omega.T, strict=True)]
    ends = panel(axes, time, curves, "ω in body axes", "rad/s", float(np.abs(omega).max(initial=0.0)))
    axes.set_xlabel("time, s")
    if len(time) > 1:
        axes.set_xlim(time[0], time[-1])
    if name:
        upper.suptitle(name, fontsize=11)
    left: Axes3D = lower.add_subplot(1, 2, 1, projection="3d")
    right: Axes3D = lower.add_subplot(1, 2, 2, projection="3d")
    if free:
        _ellipsoids(left, inertia, omega)
    left.set_title(f"{'polhode' if free else 'angular velocity'} in body axes, rad/s", fontsize=10)
    _curve(left, omega)
    _trace(right, inertia, omega, attitude, top=top)
    spread([ends])
    return np.array([axes, left, right], dtype=object)


def _sphere(scale: Array, axes: Array) -> Array:
    """A grid (3, n, m) of an ellipsoid with half axes `scale` along the rows of `axes`."""
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, 73), np.linspace(0, np.pi, 37))
    unit = np.stack([np.cos(u) * np.sin(v), np.sin(u) * np.sin(v), np.cos(v)])
    return np.asarray(np.einsum("ki,knm->inm", axes, scale[:, None, None] * unit))


def _ellipsoids(axes: Axes3D, inertia: ArrayLike, omega: Array) -> None:
    """Energy: Σ I ω² = 2T; momentum: Σ I² ω² = H²."""
    from matplotlib.lines import Line2D

    moments, directions = principal(inertia)
    spin = directions @ omega[0]
    energy, momentum = (moments * spin**2).sum(), np.linalg.norm(moments * spin)
    if not ((moments > 0).all() and energy > 0):
        return
    reach = ROOM * np.abs(omega).max()
    for scale, color, style in (
        (np.sqrt(energy / moments), "0.6", "-"),
        (momentum / moments, "tab:blue", ":"),
    ):
        grid = _sphere(scale, directions)
        grid = np.where((np.abs(grid) <= reach).all(axis=0), grid, np.nan)
        # line by line: a wireframe joins what was cut
        for line in (*grid.swapaxes(0, 1)[::4], *grid.transpose(2, 0, 1)[:-1:6]):
            axes.plot(*line, color=color, lw=0.6, ls=style)
    handles = [
        Line2D([], [], color="0.6", label="energy ellipsoid"),
        Line2D([], [], color="tab:blue", ls=":", label="momentum ellipsoid"),
        Line2D([], [], color="tab:red", lw=2, label="polhode (dot: start)"),
    ]
    axes.legend(handles=handles, fontsize=8, loc="upper left", frameon=False)


def _curve(axes: Axes3D, omega: Array) -> None:
    axes.plot(*omega.T, color="tab:red", lw=2)
    axes.scatter(*omega[0], color="tab:red", s=18)
    for name in "xyz":
        getattr(axes, f"set_{name}label")(f"ω{name}", labelpad=2)
        axes.locator_params(axis=name, nbins=4)
        getattr(axes, f"{name}axis").get_major_formatter().set_useOffset(False)
    _settle(axes)


def _trace(axes: Axes3D, inertia: ArrayLike, omega: Array, attitude: Array, *, top: bool) -> None:
    """The path on the unit sphere of space of the body's axis: of a body of revolution its own, else the most moved one."""
    axis, label = traced_axis(inertia, omega[0], top)
    path = rotate(attitude, axis)
    axes.plot_wireframe(*_sphere(np.ones(3), np.eye(3)), color="0.85", lw=0.4, rstride=4, cstride=6)
    axes.plot(*path.T, color="black", lw=1.3)
    axes.scatter(*path[0], color="black", s=18)
    axes.set_title(f"trace of {label} on the unit sphere of space (dot: start)", fontsize=10)
    for letter in "xyz":
        getattr(axes, f"set_{letter}label")(letter, labelpad=-4)
        getattr(axes, f"set_{letter}ticks")([-1, 0, 1])
    _settle(axes)


def _settle(axes: Axes3D) -> None:
    axes.tick_params(labelsize=7, pad=-1)
    axes.set_aspect("equal")
    # room for the names of the axes, which the layout of the sheet does not see
    axes.set_box_aspect(np.ptp(np.reshape(axes.get_w_lims(), (3, 2)), axis=1), zoom=0.86)
