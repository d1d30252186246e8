"""A mechanism in one pose, for the report of what was taken over or written: its links, its points, its picture."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from cli.cases.quantities import cells_of, keys_of, links, points, solved
from cli.show.result import Section, Sheet
from dalembert.angles import read_degrees
from dalembert.results.columns import Column, Table
from dalembert.units import UNITS, from_si, written

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from virtualwork import Mechanism


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

    >>> from cli.examples.command import EXAMPLES
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
    said = [
        f"{len(of)} {what if len(of) == 1 else many.get(what, what + 's')}"
        for what, of in kinds.items()
        if of
    ]
    return f"{', '.join(said)}, driven by {' and '.join(e.name for e in m.inputs)}"


def at_inputs(m: Mechanism, inputs: tuple[float, ...], length: str) -> str:
    """Say where the inputs stand: `crank at 60°`."""
    return ", ".join(
        f"{e.name} at {from_si(v, 'length', length):.6g} {written(length)}"
        if e.is_slide
        else f"{e.name} at {read_degrees(v):.6g}°"
        for e, v in zip(m.inputs, inputs, strict=True)
    )
