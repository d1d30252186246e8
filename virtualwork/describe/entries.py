"""The tables of a mechanism's TOML file: their keys, each said once, and how they are walked.

The reader refuses other keys, the schema tells an editor; every complaint names the table and the key.
"""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from virtualwork.describe import DescriptionError, hint, known
from virtualwork.describe.units import EXPECTED, LARGEST, Units, wrong

if TYPE_CHECKING:
    # numpy comes with it, and the schema needs none
    from virtualwork.describe.parts import Link

Load = Callable[[Path], bytes]
N = TypeVar("N", float, complex)
P = TypeVar("P")


@dataclass(frozen=True)
class Key:
    """A key: what it holds, what it means, whether it must be there, and what holds where it is not.

    `kind` is a quantity of `units.EXPECTED`, `pair of` one, or a form that `schema` knows (text, two texts, ...).
    """

    kind: str
    told: str
    needed: bool = False
    default: Any = None


Keys = Mapping[str, Key]

UNITS: Keys = {
    "length": Key("text", "the unit of bare lengths", default="m"),
    "angle": Key("text", "the unit of bare angles", default="rad"),
}

LINK: Keys = {
    "points": Key("points", "named points in the link's own axes; links that share a name are pinned there"),
    "mass": Key("mass", "the mass, kg", default=0),
    "center": Key("pair of length", "the centre of mass in the link's own axes", default=[0, 0]),
    "inertia": Key("inertia", "the moment of inertia about the centre of mass, kg m2", default=0),
}

POINT: Keys = {
    "from": Key("text", "another point of this link", needed=True),
    "length": Key("length", "the distance from there", needed=True),
    "angle": Key("angle", "its direction against the link's x-axis", needed=True),
}

SLOT: Keys = {
    "point": Key("text", "the point that is guided", needed=True),
    "link": Key("text", "the link of the point; where it is left out, the only one that has it"),
    "on": Key("text", "the link that carries the line", default="ground"),
    "through": Key("point", "a point of the line: a name on that link or [x, y]", default=[0, 0]),
    "angle": Key("angle", "the direction of the line against the carrier's x-axis", default=0),
}

SLIDER: Keys = {
    **SLOT,
    "turned": Key("angle", "the link's x-axis against the line", default=0),
}

GEAR: Keys = {
    "links": Key("two texts", "the two toothed links", needed=True),
    "ratio": Key("number", "speed of the second over that of the first, against the arm", needed=True),
    "arm": Key("text", "the link that carries both", default="ground"),
}

INPUT: Keys = {
    "link": Key("text", "the link that is driven by its angle"),
    "on": Key("text", "the link against which the angle is measured", default="ground"),
    "slider": Key("text", "the point of the slot or slider that is driven by its position"),
    "angle": Key("angle", "the angle of the link in the file's own pose"),
    "position": Key("length", "the position of the slider in the file's own pose"),
    "speed": Key("speed", "the speed: rad/s of a link, m/s of a slider"),
    "acceleration": Key("acceleration", "the acceleration: rad/s2 of a link, m/s2 of a slider"),
    "jerk": Key("jerk", "the jerk: rad/s3 of a link, m/s3 of a slider"),
    "law": Key("text", "a table beside the file: time_s and the angle or position"),
}

FORCE: Keys = {
    "link": Key("text", "the link it acts on", needed=True),
    "point": Key("point", "a point of the link by name or [x, y] in its axes; else its centre of mass"),
    "force": Key("pair of force", "its two components, N"),
    "frame": Key("frame", "the axes of the components", default="ground"),
    "table": Key("text", "a table beside the file in place of force: the input, fx_N and fy_N"),
}

TORQUE: Keys = {
    "link": Key("text", "the link it acts on", needed=True),
    "torque": Key(
        "torque or table",
        "counter-clockwise, N m; or a table beside the file: torque_N_m over t_s, angle_deg or speed_rad_s of the link",
        needed=True,
    ),
}

SPRING: Keys = {
    "between": Key("two texts", "its ends: two points such as crank.B and ground.D", needed=True),
    "stiffness": Key("stiffness", "N/m", default=0),
    "free_length": Key("length", "the length without force", default=0),
    "damping": Key("damping", "of a damper beside the spring, N s/m", default=0),
}

TORSION_SPRING: Keys = {
    "links": Key("two texts", "the two links; its angle is the second's less the first's", needed=True),
    "stiffness": Key("torsion stiffness", "N m/rad", default=0),
    "free_angle": Key("angle", "the angle without torque", default=0),
    "damping": Key("torsion damping", "of a damper beside the spring, N m s/rad", default=0),
}

MOTOR: Keys = {
    "carrier": Key("text", "the link that carries it", needed=True),
    "drives": Key("text", "the link that it drives", needed=True),
    "mass": Key("mass", "its mass, which joins the carrier, kg", default=0),
    "center": Key("pair of length", "its centre in the carrier's axes", default=[0, 0]),
}

FRICTION: Keys = {
    "joint": Key("text", "the point of the pin or guide", needed=True),
    "coefficient": Key("number", "the coefficient of friction", needed=True),
    "radius": Key("length", "the radius of the pin; 0 in a guide", default=0),
}

# the tables of loads, with the keys of an entry
LOADS: Mapping[str, Keys] = {
    "forces": FORCE,
    "torques": TORQUE,
    "springs": SPRING,
    "torsion_springs": TORSION_SPRING,
    "motors": MOTOR,
    "friction": FRICTION,
}

# the file's tables that may stand once or many times
ENTRIES: Mapping[str, Keys] = {
    "input": INPUT,
    "slots": SLOT,
    "sliders": SLIDER,
    "gears": GEAR,
    **LOADS,
}

# everything else that stands at the top of the file
FILE: Keys = {
    "name": Key("name", "what the mechanism is called", default=""),
    "source": Key("anything", "where it is from; not evaluated"),
    "note": Key("anything", "a remark; not evaluated"),
    "report": Key("texts", "the head of a report: title, machine, customer, date, author; not evaluated"),
    "gravity": Key("pair of slide acceleration", "its two components, m/s2", default=[0, 0]),
    "units": Key("units", "what bare lengths and angles mean"),
    "ground": Key("ground", "named fixed points [x, y]"),
    "links": Key("links", "the moving links by name", needed=True),
    "guess": Key("guess", "roughly how it stands: this chooses the assembly"),
    "tolerances": Key(
        "tolerances", 'limits of dimensions by their paths: "links.crank.B.x" = "0.05 mm" is ± that'
    ),
}

# keys of [guess] that name no link, point or input
GUESS: Keys = {"at": Key("inputs", "the input, or every input, for which the guess holds")}


def numbers(keys: Keys) -> dict[str, str]:
    """The keys that hold a quantity or a pair of them, with its kind."""
    return {name: key.kind for name, key in keys.items() if key.kind.removeprefix("pair of ") in EXPECTED}


class Entries:
    """What is read of every table: entries, quantities, names of links and points."""

    def __init__(self, data: dict[str, Any], folder: Path, load: Load) -> None:
        self.data, self.folder, self.load = data, folder, load
        units = data.get("units", {})
        known_keys(units, UNITS, "[units]", "key")
        self.units = Units(units)
        self.number, self.pair = self.units.number, self.units.pair
        self.links: dict[str, Link] = {}
        self.bodies: dict[str, Mapping[str, complex]] = {}

    def quantities(self, entry: Mapping[str, Any], keys: Keys, where: str) -> dict[str, Any]:
        """The numbers and pairs of an entry that are given, by their keys."""
        found: dict[str, Any] = {}
        for name, kind in numbers(keys).items():
            if name in entry:
                one = kind.removeprefix("pair of ")
                read = self.number if one == kind else self.pair
                found[name] = read(entry[name], one, f"{where} {name}")
        return found

    def two(self, entry: Mapping[str, Any], key: str, where: str, what: str) -> tuple[Any, Any]:
        """A list of two."""
        found = entry[key]
        if not isinstance(found, list) or len(found) != 2:
            raise wrong(f"{where} {key}", found, what)
        return found[0], found[1]

    def table(self, name: str) -> dict[str, Any]:
        """A table of the file; empty where it is not there."""
        value = self.data.get(name, {})
        if not isinstance(value, dict):
            raise wrong(f"[{name}]", value, "a table")
        return value

    def rows(self, name: str) -> list[dict[str, Any]]:
        """An array of tables."""
        value = self.data.get(name, [])
        if isinstance(value, dict):
            value = [value]
        if not isinstance(value, list) or not all(isinstance(e, dict) for e in value):
            raise wrong(f"[[{name}]]", value, "an array of tables")
        return value

    def every(self, name: str, read: Callable[[dict[str, Any], str], P]) -> list[P]:
        """Every entry of an array of tables, read; `[[springs]] 2` is the second."""
        found = []
        for i, entry in enumerate(self.rows(name), 1):
            where = f"[[{name}]] {i}"
            proper(entry, ENTRIES[name], where)
            found.append(read(entry, where))
        return found

    def curve(
        self,
        name: Any,
        where: str,
        over: Collection[str],
        values: Collection[str],
        told: str,
        pair: Callable[[dict[str, str], str], tuple[float, N]],
    ) -> tuple[list[tuple[float, N]], str]:
        """The rows of a CSV file beside this one, each as `pair` reads it, and the column that they are over.

        Parameters
        ----------
        over, values : collection of str
            Columns of which one must be there.
        told : str
            How a complaint calls them.
        pair : function of a row and the column that it is over
        """
        try:
            rows = table_rows(self.load(self.folder / str(name)))
        except (OSError, ValueError, csv.Error):
            raise wrong(where, name, "a CSV file that can be read") from None
        column = next((c for c in over if rows and c in rows[0]), None)
        if column is None or rows[0].keys().isdisjoint(values):
            raise wrong(where, name, f"columns {told}")
        try:
            found = [pair(row, column) for row in rows]
        except (TypeError, ValueError):
            raise wrong(where, name, "numbers in every row") from None
        if not all(math.hypot(at, abs(value)) <= LARGEST for at, value in found):
            raise wrong(where, name, "finite numbers in every row")
        return found, column

    def body(self, name: Any, where: str, ground: bool = True) -> str:
        """The name of a link, or of the ground."""
        known(name, self.bodies if ground else self.links, where, "link")
        return str(name)

    def place(self, link: str, value: Any, where: str) -> complex | str:
        """A point of a link: its name, or [x, y] in the link's axes."""
        if not isinstance(value, str):
            return self.pair(value, "length", where)
        points = self.bodies[link]
        if value not in points:
            raise DescriptionError(f"{where}: unknown point '{value}' of {link}{hint(value, points)}")
        return value

    def point_of(self, name: Any, where: str) -> tuple[str, complex | str]:
        """`crank.B`, or the plain name of a point that one body alone has: the body and the point."""
        link, dot, point = str(name).rpartition(".")
        if dot:
            return self.body(link, where), self.place(link, point, where)
        owners = [body for body, points in self.bodies.items() if str(name) in points]
        if len(owners) != 1:
            names = {p for points in self.bodies.values() for p in points}
            expected = " or ".join(f'"{body}.{name}"' for body in owners)
            raise wrong(
                where, name, expected or f'a link and its point such as "crank.B"{hint(str(name), names)}'
            )
        return owners[0], str(name)


def known_keys(entry: Mapping[str, Any], names: Collection[str], where: str, what: str) -> None:
    """Refuse keys that are none of the names."""
    if not isinstance(entry, Mapping):
        raise wrong(where, entry, "a table")
    for key in entry:
        if key not in names:
            known(key, names, where, what)


def proper(entry: Mapping[str, Any], keys: Keys, where: str) -> None:
    """Refuse unknown keys, and an entry in which one is missing that must be there."""
    known_keys(entry, keys, where, "key")
    for name, key in keys.items():
        if key.needed and name not in entry:
            raise DescriptionError(f"{where}: '{name}' is missing")


def table_rows(data: bytes) -> list[dict[str, str]]:
    """Return the rows of a table: commas, semicolons or tabs between the cells; UTF-8, UTF-16 or Latin-1.

    Where the cells are not told apart by commas, a comma is a decimal one, and then no cell has a decimal point.

    Raises
    ------
    ValueError, csv.Error
        No such table.

    Examples
    --------
    >>> table_rows(b"angle_deg;fx_N\\n0;-1,5\\n90;2\\n")
    [{'angle_deg': '0', 'fx_N': '-1.5'}, {'angle_deg': '90', 'fx_N': '2'}]
    """
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        text = data.decode("utf-16")
    else:
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = data.decode("cp1252")
    header = re.search(r"\S.*", text)
    mark = max(",;\t", key=lambda m: (header.group().count(m) if header else 0, m == ","))
    found = list(csv.DictReader(io.StringIO(text, newline=""), delimiter=mark, skipinitialspace=True))
    cells = (cell for row in found for cell in row.values() if isinstance(cell, str))
    if mark == "," or not any("," in cell for cell in cells):
        return found
    # 2.500 beside 1,5 may be 2500: it is made no number, and refused
    return [
        {key: _decimal(cell) if isinstance(cell, str) else cell for key, cell in row.items()} for row in found
    ]


def _decimal(cell: str) -> str:
    return cell.replace(".", "'").replace(",", ".")
