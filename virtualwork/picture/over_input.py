"""Curves over the input: any quantities, and forces."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dalembert.drawing.amounts import prefixed, quiet
from dalembert.drawing.curves import Curve, Ends, panel, shortened, spread
from dalembert.drawing.sheet import plain, sheet, zero_alone
from dalembert.units import parted, written
from virtualwork.describe import DescriptionError
from virtualwork.describe.description import Description
from virtualwork.formulas.dynamics import Dynamics
from virtualwork.formulas.kinematics import Angle
from virtualwork.formulas.lanes import Lanes
from virtualwork.formulas.numbers import Reals
from virtualwork.formulas.poses import Poses
from virtualwork.formulas.quantity import Quantity
from virtualwork.plan.steps import Joint
from virtualwork.quantities import Component, named

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import FigureBase

Panels = NDArray[np.object_]
Row = tuple[Joint, str, str]
"""A joint, the body that its force acts on, and what it comes from."""


class PlotQuantity(NamedTuple):
    """A quantity over the poses: its name, its unit, its values (n,), and how large one of its kind is."""

    name: str
    unit: str
    values: Reals
    scale: float


def curves(
    poses: Lanes, names: Sequence[str], forces: Callable[[], Dynamics], figure: FigureBase | None = None
) -> Panels:
    """Draw quantities of these names against the input, a panel for each unit; return their axes.

    Raises
    ------
    DescriptionError
        No quantity has such a name; the message lists the names.
    """
    wanted = [_quantity(poses.mechanism, name) for name in names]
    keys = list(dict.fromkeys(key for each in wanted for key in (each.key, each.less) if key))
    values = dict(zip(keys, poses.values(keys, forces), strict=True))
    return curves_of(poses, [plot_quantity(poses, each, values) for each in wanted], figure)


def _quantity(m: Description, name: str) -> Component:
    each = named(m, name)[0]
    if name not in each.names:
        raise DescriptionError(f"'{name}': expected a quantity, such as {each.names[0]}")
    return each


def plot_quantity(poses: Poses, each: Component, values: Mapping[Quantity, Any]) -> PlotQuantity:
    """Return a quantity as a picture draws it, from the values of its keys: an angle goes on through whole turns."""
    m = poses.mechanism
    z = values[each.key] - (values[each.less] if each.less else 0.0) if each.key else np.zeros(poses.n)
    turns = each.link or each.polar == "angle"
    numbers = _unwrapped(np.radians(each.of(z)) if each.polar else z.real) if turns else each.of(z)
    unit = (
        "deg"
        if turns or each.in_degrees
        else written(parted(each.header, further=("m_s3", "rad_s3"))[1] or "")
    )
    if each.key.is_force:
        scale = float(np.abs(numbers[np.isfinite(numbers)]).max(initial=0.0))
    elif unit == "deg":
        scale = 180.0
    else:
        scale = (1.0 if isinstance(each.key, Angle) else m.size) * _pace(poses) ** each.order
    return PlotQuantity(each.names[0], unit, numbers, scale)


def _pace(poses: Poses) -> float:
    """Return how fast the inputs go, 1/s: the largest of ω, √α and ∛jerk, a slide in the mechanism's sizes."""
    m = poses.mechanism
    result = 0.0
    for j, entry in enumerate(m.inputs):
        for order in (1, 2, 3):
            rate = np.abs(poses.rate(j, order)).max(initial=0.0) / (m.size if entry.is_slide else 1.0)
            result = max(result, float(rate) ** (1 / order))
    return result


def _unwrapped(angle: Reals) -> Reals:
    """Return angles (n,), rad, as degrees without jumps, across gaps too."""
    out = np.degrees(angle)
    good = np.isfinite(angle)
    out[good] = np.degrees(np.unwrap(angle[good]))
    return out


def curves_of(poses: Poses, quantities: Sequence[PlotQuantity], figure: FigureBase | None = None) -> Panels:
    """Draw quantities against the input, a panel for each unit; return their axes."""
    units = list(dict.fromkeys(q.unit for q in quantities))
    figure = sheet(7.6, 1.0 + 2.3 * len(units), figure)
    rows: Panels = figure.subplots(len(units), 1, sharex=True, squeeze=False)[:, 0]
    x, label = _input(poses)
    ends = []
    for axes, unit in zip(rows, units, strict=True):
        mine = [q for q in quantities if q.unit == unit]
        scale = max(q.scale for q in mine)
        ends.append(panel(axes, x, [Curve(q.name, q.values) for q in mine], "", unit, scale))
    _name_input(rows[-1], x, label)
    if poses.mechanism.name:
        figure.suptitle(poses.mechanism.name, fontsize=10)
    spread(ends)
    return rows


def forces(d: Dynamics, rows: Sequence[Row] | None = None, figure: FigureBase | None = None) -> Panels:
    """Draw the effort and the sizes of the joint forces against the input, and what shakes the ground.

    Parameters
    ----------
    d
        The forces of a motion.
    rows
        Which joint forces; None for all.
    figure
        See `dalembert.drawing.sheet`.

    Returns
    -------
    array of axes
        Effort, joint forces; where something moves also the hodograph of the shaking force, the shaking moment.
    """
    # at rest the ground carries a constant load, which is no picture
    m, shakes = d.poses.mechanism, d.moves
    x, label = _input(d.poses)
    shown = [
        (row, size)
        for row in (d.reactions.pairs if rows is None else rows)
        if np.isfinite(size := np.abs(d.joint_force(row[0], row[1]))).any()
    ]
    tall = max(2.9, 0.17 * len(shown) + 0.8)
    figure = sheet(12 if shakes else 7.6, 2.6 + 0.8 + tall, figure)
    halves: Any = figure.subfigures(1, 2, width_ratios=(1.6, 1)) if shakes else (figure, None)
    left, right = halves
    top, bottom = left.subplots(2, 1, sharex=True, height_ratios=(2.6, tall))
    shaking, moment = d.shaking if shakes else (np.zeros((1, 2)), np.zeros(1))
    everything = [size for _, size in shown] + [shaking.ravel(), moment / m.size]
    everything += [d.effort[:, j] / (1 if e.is_slide else m.size) for j, e in enumerate(m.inputs)]
    largest = max((float(np.abs(v[np.isfinite(v)]).max(initial=0.0)) for v in everything), default=0.0)
    ends = [_effort(top, d, x, largest), _joint_forces(bottom, x, shown, largest)]
    _name_input(bottom, x, label)
    # a force of zero is seen too
    bottom.set_ylim(bottom=-0.03 * bottom.get_ylim()[1])
    forces = [top, bottom]
    if shakes:
        hodograph, curve = right.subplots(2, 1, height_ratios=(2.6, tall))
        _hodograph(hodograph, shaking, largest)
        ends.append(
            panel(curve, x, [Curve("", moment)], "shaking moment about the origin", "N·m", largest * m.size)
        )
        _name_input(curve, x, label)
        forces += [hodograph, curve]
    spread(ends)
    return np.array(forces, dtype=object)


def _input(poses: Poses) -> tuple[Reals, str]:
    m = poses.mechanism
    if len(m.inputs) != 1:
        return np.arange(1.0, poses.n + 1), "step"
    entry = m.inputs[0]
    if entry.is_slide:
        factor, unit = prefixed(float(np.abs(poses.inputs).max(initial=0.0)), "m")
        return poses.inputs[:, 0] * factor, f"position of {shortened(entry.name, 31)}, {unit}"
    return np.degrees(poses.inputs[:, 0]), f"angle of {shortened(entry.name, 31)}, deg"


def _name_input(axes: Axes, x: Reals, label: str) -> None:
    from matplotlib.ticker import MaxNLocator, MultipleLocator

    axes.set_xlabel(label)
    if label == "step":
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    across = float(np.ptp(x)) if len(x) else 0.0
    if label.endswith("deg") and across >= 90:
        axes.xaxis.set_major_locator(
            MultipleLocator(next((s for s in (30, 60, 90, 180, 360) if across / s <= 8), 720))
        )


def _effort(axes: Axes, d: Dynamics, x: Reals, largest: float) -> Ends:
    m = d.poses.mechanism
    slides = [entry.is_slide for entry in m.inputs]
    unit = "N" if all(slides) else "N·m" if not any(slides) else "N, N·m"
    lines = [Curve(e.name if len(m.inputs) > 1 else "", d.effort[:, j]) for j, e in enumerate(m.inputs)]
    if len(m.inputs) == 1 and len(x) > 1:
        mean = float(np.trapezoid(d.effort[:, 0], x) / (x[-1] - x[0]))
        if np.isfinite(mean):
            lines.append(Curve("mean", np.full(len(x), mean), level=True))
    what = f"{'force' if slides[0] else 'torque'} at the input"
    ends = panel(axes, x, lines, what, unit, largest * (1.0 if any(slides) else m.size))
    axes.axhline(0, color="0.6", lw=0.8, zorder=1)
    return ends


def _joint_forces(axes: Axes, x: Reals, shown: Sequence[tuple[Row, Reals]], largest: float) -> Ends:
    names = [joint.name for (joint, _, _), _ in shown]
    lines = [
        Curve(joint.name if names.count(joint.name) == 1 else f"{joint.name} ({of} on {on})", size)
        for (joint, on, of), size in shown
    ]
    return panel(axes, x, lines, "joint force", "N", largest)


def _hodograph(axes: Axes, shaking: Reals, largest: float) -> None:
    from matplotlib.ticker import MaxNLocator

    clean = quiet(shaking, largest)
    size = float(np.abs(clean[np.isfinite(clean)]).max(initial=0.0))
    factor, unit = prefixed(size, "N")
    axes.plot(*(clean * factor).T, color="black", lw=1.4)
    first = clean[np.isfinite(clean).all(axis=1)][:1] * factor
    axes.plot(*first.T, marker="o", color="black", ms=5)
    axes.plot(0, 0, marker="+", color="0.3", ms=9)
    plain(axes)
    if size:
        axes.set_aspect("equal", adjustable="datalim")
        axes.xaxis.set_major_locator(MaxNLocator(4))
    else:
        zero_alone(axes, "xy")
    axes.set_xlabel(f"shaking force, x, {unit} (dot: first pose)")
    axes.set_ylabel(f"y, {unit}")
