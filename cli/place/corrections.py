"""The corrections that a file holds: what `dalembert field` or `balance` wrote as CSV, JSON or a workbook."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

from cli.errors import DataError, quote
from cli.place.read import Vector, read_vector
from cli.read import options
from cli.read.files import SUFFIXES, read_bytes, remember, split_sheet


class Correction(NamedTuple):
    """A correction to be placed by itself: of a rotor's plane in a file, or of vectors that are added up."""

    rotor: str
    plane: str
    vectors: list[Vector]

    @property
    def name(self) -> str:
        """What it is called where there are several."""
        return f"rotor {self.rotor}, plane {self.plane}"


def read_corrections(given: list[str], rotor: str | None, plane: str | None) -> list[Correction]:
    """Read MASS@ANGLE ..., or one file, of which --rotor and --plane choose."""
    file = given[0]
    if not _is_file(file):
        options.refuse("chooses among the corrections of a file: expected a file", rotor=rotor, plane=plane)
        return [Correction("1", "1", [read_vector(spec) for spec in given])]
    if len(given) > 1:
        raise options.bad("MASS@ANGLE", f"'{given[1]}': beside a file expected nothing")
    found = _of_json(file) if file.lower().endswith(".json") else _of_table(file)
    for what, wanted, field in (("rotor", rotor, 0), ("plane", plane, 1)):
        if wanted is None:
            continue
        names = dict.fromkeys(str(each[field]) for each in found)
        found = [each for each in found if each[field] == wanted]
        if not found:
            raise DataError(f"{file}: no {what} {quote(wanted)}: expected one of {', '.join(names)}")
    return found


def _is_file(text: str) -> bool:
    """Whether a word is a file and no MASS@ANGLE."""
    path, _ = split_sheet(text)
    known = Path(path).suffix.lower() in (".csv", ".txt", ".json", *SUFFIXES)
    return text == "-" or known or ("@" not in text and Path(path).is_file())


def _of_table(path: str) -> list[Correction]:
    from cli.read.tables import read

    # what else such a table holds is known, and not needed here
    beside = {"mass_uncertainty": "mass", "angle_uncertainty": "angle", "z": "length", "radius": "length"}
    table = read(
        path,
        numbers={"mass": "mass", "angle": "angle", "unbalance": "unbalance", "weight": "force", **beside},
        texts=["rotor", "plane"],
        blank=list(beside),
    )
    if "mass" not in table.numbers and "unbalance" in table.numbers:
        raise DataError(
            f"{table.file}: corrections as unbalances: expected masses, as trial masses in the runs give them"
        )
    mass, angle = table.require("mass", "mass"), table.require("angle", "angle")
    table.reject(mass.values < 0, "mass", "a mass that is not negative")
    names = [table.texts.get(name) or ["1"] * table.rows for name in ("rotor", "plane")]
    found = [
        Correction(rotor, plane, [Vector(m, mass.unit, a, angle.unit)])
        for rotor, plane, m, a in zip(*names, mass.values.tolist(), angle.values.tolist(), strict=True)
    ]
    if not found:
        raise DataError(f"{table.file}: no row: expected a row for each correction")
    return found


def _of_json(path: str) -> list[Correction]:
    import json

    remember(path)
    file, data = read_bytes(path)
    try:
        document = json.loads(data)
    except (ValueError, RecursionError) as error:
        raise DataError(f"{file}: no valid JSON: {error}") from None
    try:
        found = [
            Correction(str(rotor["rotor"]), str(one["plane"]), [_vector(one)])
            for rotor in document["rotors"]
            for one in rotor["corrections"]
        ]
    except (KeyError, TypeError, ValueError):
        found = []
    if not found:
        raise DataError(
            f"{file}: no corrections with plane, mass_kg and angle_deg below rotors: expected the JSON of dalembert field"
        )
    return found


def _vector(one: dict[str, Any]) -> Vector:
    mass, angle = float(one["mass_kg"]), float(one["angle_deg"])
    if not (0 <= mass <= 1e60 and abs(angle) <= 1e60):
        raise ValueError
    return Vector(mass, "kg", angle, "deg")
