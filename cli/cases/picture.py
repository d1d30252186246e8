"""Pictures and pages of a mechanism: its poses, requested quantities against the input, a page that moves, a report's sheet."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from cli.cases.analysis import Analysis
from cli.cases.poses import cells_of, column, keys_of, solved, table
from dalembert.angles import read_degrees
from dalembert.drawing.sheet import blank
from dalembert.results.chosen_units import shown
from dalembert.results.columns import Column, Table
from dalembert.results.result import Section, Sheet
from dalembert.units import UNITS, from_si, written
from virtualwork import MechanismError, quantities
from virtualwork.quantities import Component, links, points

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from dalembert.page import Shown
    from dalembert.results.bars import Bars
    from virtualwork import Mechanism
    from virtualwork.animation import JointForce, Series


def is_by_quantity(analysis: Analysis) -> bool:
    """Whether --only names single quantities, such as H.x: then the picture has their curves over several poses."""
    only = analysis.request.only or ()
    full = {name for each in (*analysis.places, *analysis.forces) for name in each.names}
    return bool(only) and analysis.inputs.n > 1 and all(word in full for word in only)


def drawn(analysis: Analysis) -> Figure:
    """Draw the mechanism to scale: the first pose in full, others as ghosts, the paths of its points."""
    from virtualwork.picture.paper import on_paper

    figure = blank()
    only = None if analysis.request.only is None else analysis.points
    on_paper(analysis.motions[0].poses, only, figure)
    return figure


def forces_drawn(analysis: Analysis) -> Figure:
    """Draw the effort, the requested joint forces and the shaking force against the input."""
    from virtualwork.picture.over_input import forces

    figure = blank()
    forces(analysis.motions[0].dynamics, analysis.shown_pairs, figure)
    return figure


def curves(analysis: Analysis) -> Figure:
    """Draw the requested quantities of the first assembly against the input."""
    from virtualwork.picture.over_input import curves_of, plot_quantity

    figure, motion = blank(), analysis.motions[0]
    components = [each for each in (*analysis.places, *analysis.forces) if each.key]
    values = solved(motion, keys_of(components))
    curves_of(motion.poses, [plot_quantity(motion.poses, each, values) for each in components], figure)
    return figure


# --- the page that moves ----------------------------------------------------------------------------------------------
SWEEP = 361
"""Poses of a turn, where one pose was requested."""


def page(
    analyses: Sequence[tuple[str, Analysis]], units: Mapping[str, str] | None, bare: Mapping[str, str]
) -> bytes:
    """Return the page of all points and links: it computes where the formulas can be written into it, else it replays.

    Parameters
    ----------
    analyses : sequence of (variant, analysis)
        The first is drawn in full, the others as ghosts.
    units : str, optional
        As --units has them.
    bare : mapping of kind to unit
        What the file's bare numbers mean.
    """
    from virtualwork.animation import moving_page

    reason = ""
    if analyses:
        made = _computing(analyses, units, bare)
        if not isinstance(made, str):
            return made
        reason = f"This page replays what was computed: {made}." if made else ""
    series = [one for name, analysis in analyses for one in _series(name, analysis, units)]
    if not series:
        raise MechanismError("--page: no variant can be assembled, and there is nothing to draw")
    return moving_page(series[0].mechanism.name, series, note=reason).html.encode()


def _computing(
    analyses: Sequence[tuple[str, Analysis]], units: Mapping[str, str] | None, bare: Mapping[str, str]
) -> bytes | str:
    """Return the page that computes, or the reason why there is none."""
    from virtualwork.animation import JointForce
    from virtualwork.computing_page import ORDERS, computing_page
    from virtualwork.motion import Motion

    variant, first = analyses[0]
    try:
        motion, assembly = first.motions[0], first.assemblies[0]
    except MechanismError:
        # the series that replay name what is wrong, or leave the variant out
        return ""
    others = [one for name, analysis in analyses for one in _series(name, analysis, units, computed=first)]
    m = first.mechanism
    start = motion.inputs[0]
    if motion.n == 1 and len(m.inputs) == 1 and not m.inputs[0].is_slide:
        # one pose, and the whole turn from it in degrees, which fields and options show short
        turn = np.radians(read_degrees(float(start[0])) + np.linspace(0.0, 360.0, SWEEP))
        turn[0] = start[0]
        motion = Motion(
            assembly,
            turn,
            first.inputs.whole.speed,
            first.inputs.whole.acceleration,
        )
    pairs = first.pairs if first.request.forces else []
    order = max(ORDERS, first.order)
    named = quantities.places(m, order)
    listed = [each for each in named if each.order <= first.order]
    if first.request.forces:
        forces = quantities.forces(m, pairs)
        named += forces
        listed += [each for each in forces if each.key and not each.reverse]
    wanted: list[tuple[Component | int, str]] = list(enumerate(first.input_columns))
    wanted += [(each, each.header) for each in listed]
    headers = shown(Table([column(header, []) for _, header in wanted]), units)
    arrows = [JointForce.of(*row) for row in pairs]
    made = computing_page(
        motion.poses,
        {header: (what, headers[header]) for what, header in wanted},
        named,
        arrows,
        bare,
        others,
        start,
        order,
        _name(variant, first, 0),
    )
    return made if isinstance(made, str) else made.html.encode()


def _name(variant: str, analysis: Analysis, i: int) -> str:
    """Return the name of a series: its variant and its branch, where there are several."""
    names = [
        f"variant {variant}" if variant else "",
        f"branch {analysis.assemblies[i].number}" if analysis.several else "",
    ]
    return ", ".join(filter(None, names))


def _series(
    variant: str, analysis: Analysis, units: Mapping[str, str] | None, computed: Analysis | None = None
) -> Iterator[Series]:
    """Yield every assembly but the one that the page computes; none of a variant that cannot be assembled, which a warning names."""
    from virtualwork.animation import JointForce, Series

    try:
        motions = analysis.motions
    except MechanismError:
        if not variant:
            raise
        return
    forces = analysis.request.forces
    for i, motion in enumerate(motions):
        if analysis is computed and i == 0:
            continue
        listed: dict[str, Shown] = {}
        arrows: list[JointForce] = []
        # every point and link, whatever --only names: all of it is drawn
        for with_forces in (False, True)[: 1 + forces]:
            whole = analysis.of_assembly(i).requesting(only=None, forces=with_forces)
            listed |= shown(table(whole), units)
            arrows = [JointForce.of(*row) for row in (whole.pairs if with_forces else ())]
        yield Series(
            motion.poses, motion.drawing, listed, analysis.input_columns, arrows, _name(variant, analysis, i)
        )


# --- the sheet of a report --------------------------------------------------------------------------------------------
def posed(
    title: str, m: Mechanism, inputs: tuple[float, ...], bare: Mapping[str, str], first: Section
) -> Sheet:
    """Return the sheet of a mechanism at its inputs, rad or m, its lengths in the file's unit; `first` stands above."""
    motion = m.motion(np.array([inputs]) if len(inputs) > 1 else inputs[0])
    length = bare.get("length", "m")
    length = length if length in UNITS["length"] else "m"

    def clean(values: list[float | None], scale: float) -> list[float | None]:
        """Return the values with zero in place of its rounding."""
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
    nodes = Table(
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
        drawn = blank()
        motion.plot(figure=drawn)
        return drawn

    assembled = bool(motion.assembled.all())
    place = at_inputs(m, inputs, length)
    parts: list[str | Table | Bars] = (
        [place, nodes, bodies] if assembled else [f"{place}: it cannot be assembled there"]
    )
    sections = [first, Section("Mechanism", [counted(m)]), Section("Pose", parts)]
    return Sheet(title, sections, figure if assembled else None)


def counted(m: Mechanism) -> str:
    """Count the parts of a mechanism.

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
        f"{len(parts)} {kind if len(parts) == 1 else many.get(kind, kind + 's')}"
        for kind, parts in kinds.items()
        if parts
    ]
    return f"{', '.join(lines)}, driven by {' and '.join(e.name for e in m.inputs)}"


def at_inputs(m: Mechanism, inputs: tuple[float, ...], length: str) -> str:
    """Return the inputs for a sentence: `crank at 60°`."""
    return ", ".join(
        f"{e.name} at {from_si(v, 'length', length):.6g} {written(length)}"
        if e.is_slide
        else f"{e.name} at {read_degrees(v):.6g}°"
        for e, v in zip(m.inputs, inputs, strict=True)
    )
