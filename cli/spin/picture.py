"""The picture of a rotation: ω(t), the polhode where two ellipsoids meet, the trace of the body's axis on the sphere."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cli.spin.read import Array
from cli.spin.solve import Rotation
from rigidbody3d import principal
from rigidbody3d.attitude import rotate

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d import Axes3D
LINES = (("tab:red", "-"), ("tab:blue", "--"), ("0.2", ":"))


def draw(found: Rotation) -> Figure:
    """Draw the rotation over the times asked for; from a single time, from zero to there."""
    from matplotlib.figure import Figure

    given = found.given
    time = _fine(found)
    states = found.at(time)
    free = given.torque is None and given.mgl is None
    figure = Figure(figsize=(11, 7.4), layout="constrained")
    upper, lower = figure.subfigures(2, 1, height_ratios=(1, 1.7), squeeze=False)[:, 0]
    axes = upper.subplots()
    for component, name, (color, style) in zip(states.omega.T, "xyz", LINES, strict=True):
        axes.plot(time, component, color=color, ls=style, lw=1.4, label=f"$\\omega_{name}$")
    axes.set_xlabel("time, s")
    axes.set_ylabel("$\\omega$ in body axes, rad/s")
    axes.set_xlim(time[0], time[-1])
    axes.grid(color="0.9")
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, fontsize=10)
    if given.name:
        upper.suptitle(given.name, fontsize=11)
    left = lower.add_subplot(1, 2, 1, projection="3d")
    if free:
        _polhode(left, found, states.omega)
    else:
        _curve(left, states.omega)
        left.set_title("angular velocity in body axes, rad/s", fontsize=10)
    right = lower.add_subplot(1, 2, 2, projection="3d")
    _trace(right, found, states.attitude)
    return figure


def _fine(found: Rotation) -> Array:
    ends = [min(0.0, float(found.time.min())), float(found.time.max())]
    if len(found.time) > 1:
        ends[0] = float(found.time.min())
    size = float(np.linalg.norm(found.given.omega))
    if ends[0] == ends[1]:
        ends[1] = ends[0] + (found.period or (2 * np.pi / size if size else 1.0))
    turns = (ends[1] - ends[0]) * size / (2 * np.pi)
    return np.linspace(ends[0], ends[1], int(np.clip(60 * turns, 600, 6000 if found.exact else 2000)))


def _sphere(scale: Array, axes: Array) -> Array:
    """A grid (3, n, m) of an ellipsoid with half axes `scale` along the rows of `axes`."""
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, 37), np.linspace(0, np.pi, 19))
    unit = np.stack([np.cos(u) * np.sin(v), np.sin(u) * np.sin(v), np.cos(v)])
    return np.asarray(np.einsum("ki,knm->inm", axes, scale[:, None, None] * unit))


def _polhode(axes: Axes3D, found: Rotation, omega: Array) -> None:
    """Energy: Σ I ω² = 2T; momentum: Σ I² ω² = H²."""
    moments, directions = principal(found.given.inertia)
    spin = directions @ found.given.omega
    energy, momentum = (moments * spin**2).sum(), np.linalg.norm(moments * spin)
    if (moments > 0).all() and energy > 0:
        from matplotlib.lines import Line2D

        reach = 1.25 * np.abs(omega).max()
        for scale, color, style in (
            (np.sqrt(energy / moments), "0.6", "-"),
            (momentum / moments, "tab:blue", ":"),
        ):
            if scale.max() < 8 * reach:
                axes.plot_wireframe(
                    *_sphere(scale, directions), color=color, lw=0.5, ls=style, rstride=2, cstride=3
                )
        handles = [
            Line2D([], [], color="0.6", label="energy"),
            Line2D([], [], color="tab:blue", ls=":", label="momentum"),
            Line2D([], [], color="tab:red", lw=2, label="polhode"),
        ]
        axes.legend(handles=handles, fontsize=8, loc="upper left", frameon=False)
    _curve(axes, omega)
    axes.set_title("polhode on the energy and momentum ellipsoids, rad/s", fontsize=10)


def _curve(axes: Axes3D, omega: Array) -> None:
    axes.plot(*omega.T, color="tab:red", lw=2)
    axes.scatter(*omega[0], color="tab:red", s=18)
    for name in "xyz":
        getattr(axes, f"set_{name}label")(f"$\\omega_{name}$", labelpad=-2)
        axes.locator_params(axis=name, nbins=4)
    axes.tick_params(labelsize=7, pad=-1)
    axes.set_aspect("equal")


def _trace(axes: Axes3D, found: Rotation, attitude: Array) -> None:
    """The path on the unit sphere of space of the body's axis: of a body of revolution its own, else the most moved one."""
    given = found.given
    moments, directions = principal(given.inertia)
    if given.mgl is not None:
        axis = np.array([0.0, 0.0, 1.0])
    elif moments[2] - moments[1] < moments[1] - moments[0]:
        axis = directions[0]
    else:
        axis = directions[2]
    if given.mgl is None and len(set(np.round(moments / moments[2], 9))) == 3:
        axis = directions[int(np.argmax(np.abs(directions @ given.omega)))]
    path = rotate(attitude, axis)
    axes.plot_wireframe(*_sphere(np.ones(3), np.eye(3)), color="0.85", lw=0.4, rstride=2, cstride=3)
    axes.plot(*path.T, color="black", lw=1.3)
    axes.scatter(*path[0], color="black", s=18)
    name = next((n for n, e in zip("xyz", np.eye(3), strict=True) if np.allclose(np.abs(axis), e)), None)
    label = f"body {name}" if name else "a principal axis"
    axes.set_title(f"trace of {label} on the unit sphere of space (dot: start)", fontsize=10)
    for letter in "xyz":
        getattr(axes, f"set_{letter}label")(letter, labelpad=-6)
        getattr(axes, f"set_{letter}ticks")([-1, 0, 1])
    axes.tick_params(labelsize=7, pad=-2)
    axes.set_aspect("equal")
