"""The picture of a balancing, dials and closed polygons; its page, which computes."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import count
from typing import TYPE_CHECKING, Any

import numpy as np

from balancing import correct, modal_corrections
from balancing.picture import MOST, KnownMasses, known_masses
from cli.balance.rotors import DIMENSIONS, Balancing
from dalembert.decimals import decimal_to_si
from dalembert.drawing.sheet import blank
from dalembert.errors import DataError
from dalembert.page import sheet as sheet_page
from dalembert.page import spelled
from dalembert.units import UNITS, from_si, to_si

if TYPE_CHECKING:
    from matplotlib.figure import Figure, FigureBase

    from dalembert.page import Page


def draw(balancing: Balancing, *, polygons: bool = False) -> Figure:
    """Draw the first rotors, one below the other, with their planes in a row; with --steps the closed polygons too."""
    figure = blank()
    if polygons:
        _polygons_below(balancing, figure)
    else:
        _dials(balancing, figure)
    return figure


def _dials(balancing: Balancing, figure: FigureBase) -> None:
    unit = balancing.rotors.unbalance_unit.replace("_", "·")
    known_masses(list(_rotors(balancing)), unit, remove=balancing.request.remove, figure=figure)


def _rotors(balancing: Balancing) -> Iterator[KnownMasses]:
    rotors, planes = balancing.rotors, balancing.planes
    for r, name in enumerate(rotors.names[:MOST]):
        mine = balancing.masses_of(r)
        rows = balancing.rows_of(r)
        here = balancing.plane_of_row[rows]
        at = rotors.z[mine, None] if rotors.z is not None else np.zeros((len(mine), 1))
        plane_z = planes.z[here] if planes.z is not None else np.zeros(len(here))
        # each mass alone, carried to the planes as they will balance it
        if balancing.modal:
            carried = _shares(balancing, r)
        else:
            carried = -correct(rotors.moment[mine, None], at, plane_z).unbalance
        yield KnownMasses(
            name if len(rotors.names) > 1 else "",
            balancing.mass_names(r),
            [planes.name[p] for p in here],
            from_si(carried, "unbalance", rotors.unbalance_unit),
            from_si(balancing.made[rows], "unbalance", rotors.unbalance_unit),
        )


def _shares(b: Balancing, rotor: int) -> Any:
    """Return what each unbalance alone asks of the planes, with its sign turned, (m, p)."""
    fix, i = b.modal_of(rotor)
    moment = np.diag(b.rotors.moment[b.masses_of(rotor)])
    return -modal_corrections(moment, b.conditions_at_masses(rotor), fix.at_planes[i]).unbalance


def _polygons_below(b: Balancing, figure: Figure) -> None:
    """Draw the dials, and below them the closed polygons of each rotor that has a dial."""
    rotors = range(min(len(b.rotors.names), MOST))
    planes = max(len(range(b.rows_of(r).start, b.rows_of(r).stop)) for r in rotors)
    above, each = 4.5 * len(rotors) + 0.8, 4.8
    figure.set_size_inches(max(4.3 * planes, 9.6), above + each * len(rotors))
    figure.set_layout_engine("constrained")
    heights = [above, *[each] * len(rotors)]
    top, *parts = figure.subfigures(1 + len(rotors), 1, height_ratios=heights, squeeze=False)[:, 0]
    _dials(b, top)
    for r, part in zip(rotors, parts, strict=True):
        polygons(b, r, part)


def polygons(b: Balancing, rotor: int, figure: FigureBase) -> None:
    """Draw the closed polygon of forces, with several planes that of moments about the first; of modes one for each condition."""
    from balancing.polygons import Polygon, closed

    mine, rows = b.masses_of(rotor), b.rows_of(rotor)
    here, named = b.plane_of_row[rows], b.mass_names(rotor)
    planes = [b.planes.name[p] for p in here]
    moments, made = b.rotors.moment[mine], b.ideal[rows]

    def polygon(
        title: str, first: int = 0, masses: Any = 1.0, at: Any = 1.0, moment: bool = False
    ) -> Polygon:
        unit, dimension = (b.couple_unit, "inertia") if moment else (b.rotors.unbalance_unit, "unbalance")
        last = from_si((made * at)[first:], dimension, unit)
        return Polygon(title, named, from_si(moments * masses, dimension, unit), planes[first:], last, unit)

    if b.request.modes is not None:
        fix, i = b.modal_of(rotor)
        each = zip(b.request.modes.conditions, b.conditions_at_masses(rotor), fix.at_planes[i], strict=True)
        every = [polygon(f"{name}: U·φ", 0, masses, at) for name, masses, at in each]
    else:
        every = [polygon("forces")]
        if b.rotors.z is not None and b.planes.z is not None and len(planes) > 1:
            z = b.planes.z[here]
            arms = b.rotors.z[mine] - z[0], z - z[0]
            every.append(polygon(f"moments about plane {planes[0]}", 1, *arms, moment=True))
    closed(every, f"rotor {b.rotors.names[rotor]}: " if len(b.rotors.names) > 1 else "", figure)


OF_PAGE = 50
"""Rotors of a page."""


def sheet(b: Balancing) -> Page:
    """The page of a table of rotors."""
    # loaded where a page is written
    from balancing.known_masses import Modal
    from balancing.known_masses import known_masses as tapes_of
    from balancing.modal import shape_pieces
    from dalembert.arithmetic.engines.javascript import engine, written

    rotors, request = b.rotors, b.request
    if len(rotors.names) > OF_PAGE:
        raise DataError(f"--page: {len(rotors.names)} rotors: expected at most {OF_PAGE}")
    read = rotors.table.numbers
    columns = [name for name in DIMENSIONS if name in read]
    amount = columns[0]
    tapes: dict[str, int] = {}
    outputs: list[dict[str, list[str]]] = []
    documents, rows, values = [], [], dict[str, float]()
    named = rotors.table.texts.get("name")
    several = len(rotors.names) > 1
    steps, shapes = _steps(b), request.modes
    for r, rotor in enumerate(rotors.names):
        here = b.rows_of(r)
        at = b.plane_of_row[here]
        planes = np.zeros(len(at)) if b.planes.z is None else b.planes.z[at]
        limit = request.tolerance
        bearings = None if limit is None or limit.bearings is None else np.array(limit.bearings)
        about = float(b.about[r]) if b.has_couple else 0.0
        made = tapes_of(
            planes,
            b.planes.radius[at],
            about,
            request.gravity if rotors.weight_unit else None,
            bearings,
            request.remove,
            b.given_mass[here],
            None if shapes is None else Modal(shapes.at(planes, "a plane"), shapes.shaft),
        )
        text = f"{{ {', '.join(f'{name}: {written(tape)}' for name, tape in made.items())} }}"
        if text not in tapes:
            tapes[text] = len(tapes)
            outputs.append({name: list(tape.names) for name, tape in made.items()})
        document: dict[str, Any] = {
            "name": rotor,
            "planes": [b.planes.name[p] for p in at],
            "tapes": tapes[text],
            # with both mass and radius fixed there is a residual
            "made": bool(steps or (~np.isnan(b.given_mass[here]) & ~b.sought[here]).any()),
            "fixed": (~np.isnan(b.given_mass[here])).tolist(),
        }
        if limit is not None:
            verdicts = b.verdicts(r)
            document["tolerance"] = {
                "names": [v.plane for v in verdicts],
                "permissible": [float(v.permissible) for v in verdicts],
            }
        documents.append(document)
        masses = b.masses_of(r).tolist()
        mine = _different([named[i] if named else "" for i in masses])
        for i, name in zip(masses, mine, strict=True):
            for column in columns:
                key = f"{rotor}/{name}.{column}" if several else f"{name}.{column}"
                # as the page reads what is typed
                number = read[column]
                factor = UNITS[number.dimension][number.unit]
                values[key] = decimal_to_si(repr(float(number.values[i])), factor)
        rows.append(mine)
    listed = ",\n".join(tapes)
    script = f"{engine()}\nconst tapes = [\n{listed}\n];\n"
    whole = {
        "rotors": documents,
        "rows": rows,
        "first": rows,
        "values": values,
        "outputs": outputs,
        "amount": amount,
        "columns": [
            {
                "name": name,
                "kind": DIMENSIONS[name],
                "unit": spelled(read[name].unit),
                "header": f"{name}_{read[name].unit}",
            }
            for name in columns
        ],
        "couple": b.has_couple,
        "placed": b.planes.z is not None,
        "remove": request.remove,
        "steps": steps,
        "sought": bool(b.sought.any()),
        "modes": None
        if shapes is None
        else {
            "names": shapes.names,
            "stations": shapes.z.tolist(),
            "pieces": shape_pieces(shapes.z, shapes.shapes).tolist(),
        },
        "shown": {
            "mass": _shown("mass", rotors.mass_unit),
            "radius": _shown("length", rotors.radius_unit or b.planes.radius_unit),
            "unbalance": _shown("unbalance", rotors.unbalance_unit),
            "couple": _shown("inertia", b.couple_unit),
        },
    }
    return sheet_page("Balancing of known masses", "balance", script, whole)


def _different(names: list[str]) -> list[str]:
    """Names that differ: a row without a name, or with that of a row before it, has its number or the next free one."""
    different: list[str] = []
    for k, name in enumerate(names, 1):
        free = (str(n) for n in count(k) if str(n) not in different and str(n) not in names)
        different.append(name if name and name not in different else next(free))
    return different


def _steps(b: Balancing) -> dict[str, list[float]]:
    """To what corrections are rounded, (one in SI, the step in such units) of mass and of angle."""
    steps, unit = dict[str, list[float]](), b.rotors.mass_unit
    if b.request.mass_step is not None:
        steps["mass"] = [float(to_si(1.0, "mass", unit)), float(b.mass_step)]
    if b.request.angle_step is not None:
        steps["angle"] = [math.pi / 180, b.request.angle_step]
    return steps


def _shown(kind: str, unit: str) -> dict[str, Any]:
    return {"unit": spelled(unit), "si": float(to_si(1.0, kind, unit))}
