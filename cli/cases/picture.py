"""Pictures of a mechanism: drawn in its poses, the requested quantities against the input, one pose with its tables."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from cli.cases.analysis import Analysis
from cli.cases.poses import cells_of, keys_of, solved
from cli.show.picture import blank
from cli.show.result import Section, Sheet
from dalembert.angles import read_degrees
from dalembert.results.columns import Column, Table
from dalembert.units import UNITS, from_si, written
from virtualwork.formulas.kinematics import Angle
from virtualwork.picture.over_input import curves_of, forces
from virtualwork.picture.paper import on_paper
from virtualwork.picture.plot_quantities import PlotQuantity as Drawn
from virtualwork.picture.plot_quantities import pace, unwrapped
from virtualwork.quantities import Component, links, points

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from virtualwork import Mechanism


SHOWN = {
    "m": "m", "m_s": "m/s", "m_s2": "m/s²", "m_s3": "m/s³", "deg": "deg", "rad_s": "rad/s", "rad_s2": "rad/s²",
    "rad_s3": "rad/s³", "N": "N", "N_m": "N·m",
}  # fmt: skip


def is_by_quantity(analysis: Analysis) -> bool:
    """Whether --only names single quantities, such as H.x: then the picture has their curves over several poses."""
    only = analysis.request.only or ()
    full = {name for each in (*analysis.places, *analysis.forces) for name in each.names}
    return bool(only) and analysis.inputs.n > 1 and all(word in full for word in only)


def drawn(analysis: Analysis) -> Figure:
    """The mechanism to scale: the first pose in full, others as ghosts, the paths of its points."""
    figure = blank()
    only = None if analysis.request.only is None else analysis.points
    on_paper(analysis.motions[0].poses, only, figure)
    return figure


def forces_drawn(analysis: Analysis) -> Figure:
    """The effort and the requested joint forces against the input, and what shakes the ground."""
    figure = blank()
    forces(analysis.motions[0].dynamics, analysis.shown_pairs, figure)
    return figure


def curves(analysis: Analysis) -> Figure:
    """The requested quantities against the input, of the first assembly."""
    figure, motion = blank(), analysis.motions[0]
    every = [each for each in (*analysis.places, *analysis.forces) if each.key]
    values = solved(motion, keys_of(every))
    curves_of(motion.poses, [_curve(analysis, each, values[each.key]) for each in every], figure)
    return figure


def _curve(analysis: Analysis, each: Component, value: NDArray[np.generic]) -> Drawn:
    """A quantity as it is drawn, with how large one of its kind is."""
    m, poses = analysis.mechanism, analysis.motions[0].poses
    numbers = unwrapped(value.real) if each.link else each.of(value)
    name = each.names[0]
    unit = next(
        text
        for suffix, text in sorted(SHOWN.items(), key=lambda u: -len(u[0]))
        if each.header.endswith(f"_{suffix}")
    )
    if each in analysis.forces:
        return Drawn(name, unit, numbers, float(np.abs(numbers[np.isfinite(numbers)]).max(initial=0.0)))
    size = 1.0 if isinstance(each.key, Angle) else m.size
    return Drawn(name, unit, numbers, 180.0 if each.link else size * pace(poses) ** each.order)


def posed(
    title: str, m: Mechanism, inputs: tuple[float, ...], bare: Mapping[str, str], first: Section
) -> Sheet:
    """Return the sheet of a mechanism at its inputs, rad or m, its lengths in the file's unit; `first` stands above."""
    motion = m.motion(np.array([inputs]) if len(inputs) > 1 else inputs[0])
    length = bare.get("length", "m")
    length = length if length in UNITS["length"] else "m"

    def clean(values: list[float | None], scale: float) -> list[float | None]:
        """Without what rounding leaves of zero."""
        return [0.0 if v is not None and abs(v) < 1e-12 * scale else v for v in values]

    def lengths(values: list[float | None]) -> list[float | None]:
        return [None if v is None else from_si(v, "length", length) for v in clean(values, m.size)]

    driven = {
        str(e.link): np.array([read_degrees(v)])
        for e, v in zip(m.inputs, inputs, strict=True)
        if e.on == "ground" and not e.is_slide
    }
    wanted = [*points(m, list(m.points), 0), *links(list(m.links), 0)]
    shown = cells_of(wanted, solved(motion, keys_of(wanted)), 1, driven)
    x, y, angles = (
        [values[0] for each, values in shown.items() if each.path[-1] == name]
        for name in ("x_m", "y_m", "angle_deg")
    )
    table = Table(
        [
            Column("point", "", list(m.points)),
            Column(
                "of", "", [", ".join(name for name, body in m.bodies.items() if p in body) for p in m.points]
            ),
            Column("x", length, lengths(x)),
            Column("y", length, lengths(y)),
        ],
        ("point",),
    )
    bodies = Table(
        [
            Column("link", "", list(m.links)),
            Column("angle", "deg", clean(angles, 360.0)),
            Column("mass", "kg", [m.rigid[name].mass for name in m.links]),
            Column("inertia", "kg_m2", [m.rigid[name].inertia for name in m.links]),
        ],
        ("link",),
    )

    def figure() -> Figure:
        from cli.show.picture import blank

        drawn = blank()
        motion.plot(figure=drawn)
        return drawn

    there = bool(motion.assembled.all())
    stands = at_inputs(m, inputs, length)
    pose = Section("Pose", [stands, table, bodies] if there else [f"{stands}: it cannot be assembled there"])
    return Sheet(title, [first, Section("Mechanism", [counted(m)]), pose], figure if there else None)


def counted(m: Mechanism) -> str:
    """Say what a mechanism is made of.

    >>> from cli.examples import EXAMPLES
    >>> from virtualwork import Mechanism
    >>> counted(Mechanism.from_toml(EXAMPLES / "klann" / "klann.toml"))
    '5 links, 7 pins, driven by crank'
    """
    kinds = {
        "link": m.links,
        "pin": m.pins,
        "slot": [g for g in m.guides if g.turned is None],
        "slider": [g for g in m.guides if g.turned is not None],
        "gear mesh": m.gears,
        "belt": m.belts,
        "rack": m.racks,
        "force": m.forces,
        "torque": m.torques,
        "spring": m.springs,
        "torsion spring": m.torsion_springs,
        "motor": m.motors,
        "place of friction": m.friction,
    }
    many = {"gear mesh": "gear meshes", "place of friction": "places of friction"}
    lines = [
        f"{len(of)} {what if len(of) == 1 else many.get(what, what + 's')}"
        for what, of in kinds.items()
        if of
    ]
    return f"{', '.join(lines)}, driven by {' and '.join(e.name for e in m.inputs)}"


def at_inputs(m: Mechanism, inputs: tuple[float, ...], length: str) -> str:
    """Say where the inputs stand: `crank at 60°`."""
    return ", ".join(
        f"{e.name} at {from_si(v, 'length', length):.6g} {written(length)}"
        if e.is_slide
        else f"{e.name} at {read_degrees(v):.6g}°"
        for e, v in zip(m.inputs, inputs, strict=True)
    )
