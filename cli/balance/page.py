"""The page of a balancing: the masses as a table to edit, the formulas as tapes that compute what follows."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from balancing.known_masses import Modal, known_masses
from balancing.modal import shape_pieces
from cli.balance.rotors import DIMENSIONS, Balancing
from dalembert.arithmetic.engines.javascript import engine, written
from dalembert.errors import DataError
from dalembert.page import Page
from dalembert.page import sheet as sheet_page
from dalembert.page.typed import spelled, units
from dalembert.units import from_si, to_si

MOST = 50
"""Rotors of a page."""


def sheet(b: Balancing) -> Page:
    """The page of a table of rotors."""
    rotors, request = b.rotors, b.request
    if len(rotors.names) > MOST:
        raise DataError(f"--page: {len(rotors.names)} rotors: expected at most {MOST}")
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
        made = known_masses(
            planes,
            b.planes.radius[at],
            about,
            request.gravity if rotors.weights else None,
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
            # a mass and a radius that are both given leave something
            "given": bool(steps or (~np.isnan(b.given_mass[here]) & ~b.sought[here]).any()),
        }
        if limit is not None:
            verdicts = b.verdicts(r)
            document["tolerance"] = {
                "names": [v.plane for v in verdicts],
                "permissible": [float(v.permissible) for v in verdicts],
            }
        documents.append(document)
        mine: list[str] = []
        for i in np.flatnonzero(rotors.rotor == r).tolist():
            name = named[i] if named else ""
            name = name if name and name not in mine else str(len(mine) + 1)
            mine.append(name)
            for column in columns:
                key = f"{rotor}/{name}.{column}" if several else f"{name}.{column}"
                values[key] = float(read[column].si[i])
        rows.append(mine)
    couple = f"{rotors.unbalance_unit}_{b.length_unit}".replace(
        f"{b.length_unit}_{b.length_unit}", f"{b.length_unit}2"
    )
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
        "units": units(DIMENSIONS[name] for name in columns),
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
            "couple": _shown("inertia", couple),
        },
    }
    return sheet_page("Balancing of known masses", "balance", script, whole)


def _steps(b: Balancing) -> dict[str, list[float]]:
    """To what corrections are rounded, (one in SI, the step in such units) of mass and of angle."""
    steps, unit = dict[str, list[float]](), b.rotors.mass_unit
    if b.request.mass_step is not None:
        step, of_step = b.request.mass_step
        own = step if of_step == unit else float(from_si(to_si(step, "mass", of_step), "mass", unit))
        steps["mass"] = [float(to_si(1.0, "mass", unit)), own]
    if b.request.angle_step is not None:
        step, of_step = b.request.angle_step
        steps["angle"] = [math.pi / 180, step if of_step == "deg" else math.degrees(step)]
    return steps


def _shown(kind: str, unit: str) -> dict[str, Any]:
    return {"unit": spelled(unit), "si": float(to_si(1.0, kind, unit))}
