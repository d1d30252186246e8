"""Pictures of forces over a sweep: effort, joint forces, the hodograph of the shaking force."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cli.mechanism.forces import rows_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cli.mechanism.solve import Analysis

STYLES = ("-", "--", "-.", ":")
GREYS = ("0.0", "0.35", "0.55")


def draw(analysis: Analysis) -> Figure:
    """Draw the effort and the sizes of the joint forces against the input, and the shaking force as a hodograph."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator

    m, motion = analysis.mechanism, analysis.motions[0]
    d = motion.dynamics
    slide = m.inputs[0].is_slide
    x = analysis.inputs.shown[:, 0]
    label = f"position of {m.inputs[0].name}, m" if slide else f"angle of {m.inputs[0].name}, deg"
    shakes = d.scene.moves  # at rest the ground carries a constant load, which is no picture
    figure = Figure(figsize=(11 if shakes else 7, 6.4), layout="constrained")
    halves: Any = figure.subfigures(1, 2, width_ratios=(1.45, 1)) if shakes else (figure, None)
    left, right = halves
    top, bottom = left.subplots(2, 1, sharex=True)
    for j, entry in enumerate(m.inputs):
        unit = "N" if entry.is_slide else "N·m"
        style = {"color": GREYS[j % 3], "ls": STYLES[j % 4], "lw": 1.6}
        top.plot(x, d.effort[:, j], label=f"{entry.name}, {unit}" if len(m.inputs) > 1 else None, **style)
    top.axhline(0, color="0.6", lw=0.8)
    if len(m.inputs) == 1:
        mean = float(np.trapezoid(d.effort[:, 0], x) / (x[-1] - x[0]))
        if np.isfinite(mean):
            top.axhline(mean, color="0.4", lw=1.0, ls=":", label=f"mean {mean:.4g}")
    if top.get_legend_handles_labels()[0]:
        top.legend(fontsize=8, frameon=False)
    top.set_ylabel("force at the input, N" if slide else "torque at the input, N·m")
    top.grid(color="0.9")
    for i, (joint, on, of) in enumerate(rows_of(analysis, motion)):
        size = np.abs(d.joint_force(joint, on))
        if np.isfinite(size).any():
            bottom.plot(
                x,
                size,
                color=GREYS[i // 4 % 3],
                ls=STYLES[i % 4],
                lw=1.3,
                label=f"{joint.name}: {of} on {on}",
            )
    bottom.set_ylabel("joint force, N")
    bottom.set_xlabel(label)
    bottom.set_ylim(bottom=0)
    bottom.grid(color="0.9")
    if bottom.lines:  # statics may leave every joint force open
        bottom.legend(fontsize=8, frameon=False, ncols=2)
    if not slide and x.max() - x.min() >= 180:
        bottom.set_xticks(
            np.arange(np.ceil(x.min() / 60) * 60, x.max() + 1, 60 if x.max() - x.min() <= 360 else 120)
        )
    if not shakes:
        return figure
    shaking, moment = d.shaking
    if np.nanmax(np.abs(moment)) <= 1e-12 * np.nanmax(np.abs(shaking)) * m.size:
        moment = np.zeros_like(moment)
    hodograph, curve = right.subplots(2, 1, height_ratios=(1.6, 1))
    hodograph.plot(shaking[:, 0], shaking[:, 1], color="0.0", lw=1.4)
    hodograph.plot(*shaking[0], marker="o", color="0.0", ms=5)
    hodograph.plot(0, 0, marker="+", color="0.3", ms=9)
    hodograph.set_aspect("equal", adjustable="datalim")
    hodograph.xaxis.set_major_locator(MaxNLocator(4))
    hodograph.set_xlabel("shaking force, x, N (dot: first pose)")
    hodograph.set_ylabel("y, N")
    hodograph.grid(color="0.9")
    curve.plot(x, moment, color="0.0", lw=1.4)
    curve.set_ylabel("shaking moment\nabout the origin, N·m")
    curve.set_xlabel(label)
    curve.grid(color="0.9")
    return figure
