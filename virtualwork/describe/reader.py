"""Reading a mechanism from its TOML description."""

from __future__ import annotations

import csv
import itertools
import math
import tomllib
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from virtualwork.describe.checks import hint
from virtualwork.describe.description import Description
from virtualwork.describe.errors import DescriptionError, MechanismError
from virtualwork.describe.loads import Force, Friction, Motor, Spring, Torque, TorsionSpring
from virtualwork.describe.parts import GROUND, Gear, Guess, Guide, Input, Link
from virtualwork.describe.tables import rows
from virtualwork.describe.units import EXPECTED, parse, scaled, unit

D = TypeVar("D", bound=Description)
Load = Callable[[Path], bytes]

LARGEST = 1e60  # SI: no quantity of a machine is larger, and no product of five of them overflows
TABLES = {
    "name", "units", "ground", "links", "input", "guess", "slots", "sliders", "gears", "gravity", "forces",
    "torques", "springs", "torsion_springs", "motors", "friction", "source", "note",
}  # fmt: skip


def read(path: Path, make: Callable[..., D], load: Load = Path.read_bytes) -> D:
    """Read a mechanism from a TOML file; `make` takes its parts, `load` reads it and the tables beside it.

    Raises
    ------
    DescriptionError
        Names the file, the table and the key, what was found and what was expected.
    OSError
        Where the file cannot be read.
    """
    return read_text(load(path).decode("utf-8-sig"), make, str(path), path.parent, load)


def read_text(
    text: str,
    make: Callable[..., D],
    file: str = "<text>",
    folder: Path | None = None,
    load: Load = Path.read_bytes,
) -> D:
    """Read a mechanism from TOML text; `folder` is where its input tables lie, which `load` reads."""
    try:
        data = tomllib.loads(text)
    except RecursionError:
        raise DescriptionError(f"{file}: no valid TOML: nested too deeply") from None
    except ValueError as error:  # a TOMLDecodeError, or a number of thousands of digits
        raise DescriptionError(f"{file}: no valid TOML: {error}") from None
    try:
        return make(**_Reader(data, folder or Path(), load).parts())
    except MechanismError as error:
        raise type(error)(f"{file}: {error}") from None


class _Reader:
    """Walks the tables; every complaint names the table and the key."""

    def __init__(self, data: dict[str, Any], folder: Path, load: Load) -> None:
        self.data, self.folder, self.load = data, folder, load
        _known(data, TABLES, "the file", "table")
        units = data.get("units", {})
        _known(units, {"length", "angle"}, "[units]", "key")
        self.bare = {"length": ("m", 1.0), "angle": ("rad", 1.0)}
        for kind in ("length", "angle"):
            if kind in units:
                found = unit(str(units[kind]))
                if found is None or found[1] != EXPECTED[kind][1]:
                    raise _wrong(f"[units] {kind}", units[kind], f"a unit of {kind} such as 'mm' or 'deg'")
                self.bare[kind] = (str(units[kind]), found[0])

    def number(self, value: Any, kind: str, where: str) -> float:
        """One quantity: a bare number in the file's unit (length, angle) or SI, or a string with its unit."""
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            factor = self.bare[kind][1] if kind in self.bare else 1.0
            # a whole number of TOML has no bound
            result: float | None = scaled(repr(value), factor) if abs(value) <= LARGEST else math.inf
        elif isinstance(value, str):
            result = parse(value, kind)
            if result is None:
                try:
                    return self.number(float(value), kind, where)
                except ValueError:
                    pass
        else:
            result = None
        if result is None or not abs(result) <= LARGEST:
            raise _wrong(where, value, EXPECTED[kind][0])
        return result

    def pair(self, value: Any, kind: str, where: str) -> complex:
        if not isinstance(value, list) or len(value) != 2:
            raise _wrong(where, value, "two numbers [x, y]")
        return complex(*(self.number(v, kind, where) for v in value))

    def parts(self) -> dict[str, Any]:
        """Every part of the mechanism, under the name that `Description` gives it."""
        ground = {
            name: self.pair(v, "length", f"[ground] {name}") for name, v in self.table("ground").items()
        }
        self.links = {name: self.link(name, entry) for name, entry in self.table("links").items()}
        self.bodies: dict[str, Mapping[str, complex]] = {GROUND: ground} | {
            n: k.points for n, k in self.links.items()
        }
        guides = [self.guide(e, i, "slots") for i, e in self.rows("slots")]
        guides += [self.guide(e, i, "sliders") for i, e in self.rows("sliders")]
        inputs = self.inputs()
        return {
            "ground": ground,
            "links": self.links,
            "guides": guides,
            "gears": [self.gear(e, i) for i, e in self.rows("gears")],
            "inputs": inputs,
            "guess": self.guess(inputs),
            "name": self.name(),
            "gravity": self.gravity(),
            "forces": [self.force(e, i) for i, e in self.rows("forces")],
            "torques": [self.torque(e, i) for i, e in self.rows("torques")],
            "springs": [self.spring(e, i) for i, e in self.rows("springs")],
            "torsion_springs": [self.torsion(e, i) for i, e in self.rows("torsion_springs")],
            "motors": [self.motor(e, i) for i, e in self.rows("motors")],
            "friction": [self.rub(e, i) for i, e in self.rows("friction")],
        }

    def name(self) -> str:
        found = self.data.get("name", "")
        if not isinstance(found, (str, int, float)):
            raise _wrong("name", found, "text")
        return str(found)

    # --- tables ---------------------------------------------------------------------------------------------
    def table(self, name: str) -> dict[str, Any]:
        value = self.data.get(name, {})
        if not isinstance(value, dict):
            raise _wrong(f"[{name}]", value, "a table")
        return value

    def rows(self, name: str) -> Iterable[tuple[int, dict[str, Any]]]:
        value = self.data.get(name, [])
        if isinstance(value, dict):
            value = [value]
        if not isinstance(value, list) or not all(isinstance(e, dict) for e in value):
            raise _wrong(f"[[{name}]]", value, "an array of tables")
        return enumerate(value, 1)

    def link(self, name: str, entry: Any) -> Link:
        where = f"[links.{name}]"
        if not isinstance(entry, dict):
            raise _wrong(where, entry, "a table with points")
        _known(entry, {"points", "mass", "center", "inertia"}, where, "key")
        points: dict[str, complex] = {}
        given = entry.get("points", {})
        if not isinstance(given, dict):
            raise _wrong(f"{where} points", given, "a table { A = [0, 0], B = [120, 0] }")
        for p, v in given.items():
            if isinstance(v, dict) and not isinstance(v.get("from"), str):
                raise DescriptionError(
                    f"{where} points.{p} from: expected the name of another point of this link"
                )
        waiting = dict(given)
        while waiting:
            ready = [p for p, v in waiting.items() if not isinstance(v, dict) or v.get("from") in points]
            if not ready:
                p, v = next(iter(waiting.items()))
                start = v.get("from")
                if start not in waiting:
                    raise DescriptionError(
                        f"{where} points.{p} from: unknown point '{start}'{hint(str(start), given)}"
                    )
                raise DescriptionError(f"{where} points.{p} from: '{start}' hangs on '{p}' itself")
            for p in ready:
                v, at = waiting.pop(p), f"{where} points.{p}"
                if isinstance(v, dict):
                    _known(v, {"from", "length", "angle"}, at, "key")
                    _need(v, ("length", "angle"), at)
                    angle = self.number(v["angle"], "angle", f"{at} angle")
                    length = self.number(v["length"], "length", f"{at} length")
                    points[p] = points[v["from"]] + length * complex(math.cos(angle), math.sin(angle))
                else:
                    points[p] = self.pair(v, "length", at)
        ordered = {p: points[p] for p in given}
        mass = self.number(entry.get("mass", 0.0), "mass", f"{where} mass")
        inertia = self.number(entry.get("inertia", 0.0), "inertia", f"{where} inertia")
        center = self.pair(entry.get("center", [0, 0]), "length", f"{where} center")
        if mass < 0:
            raise _wrong(f"{where} mass", entry["mass"], "a mass of zero or more")
        if inertia < 0:
            raise _wrong(f"{where} inertia", entry["inertia"], "a moment of inertia of zero or more")
        return Link(ordered, mass, center, inertia)

    def guide(self, entry: dict[str, Any], i: int, table: str) -> Guide:
        where = f"[[{table}]] {i}"
        _known(
            entry,
            {"point", "link", "on", "through", "angle"} | ({"turned"} if table == "sliders" else set()),
            where,
            "key",
        )
        _need(entry, ("point",), where)
        point = str(entry["point"])
        link = entry.get("link")
        if link is None:
            holders = [n for n, b in self.links.items() if point in b.points and n != entry.get("on")]
            if not holders and point in self.bodies[GROUND]:
                holders = [GROUND]
            if len(holders) != 1:
                raise DescriptionError(
                    f"{where} link: missing; expected the link whose point {point} is guided"
                )
            link = holders[0]
        on = str(entry.get("on", GROUND))
        through = entry.get("through", [0, 0])
        if not isinstance(through, str):
            through = self.pair(through, "length", f"{where} through")
        elif on in self.bodies and through not in self.bodies[on]:
            raise DescriptionError(
                f"{where} through: unknown point '{through}' of {on}{hint(through, self.bodies[on])}"
            )
        angle = self.number(entry.get("angle", 0.0), "angle", f"{where} angle")
        turned = None
        if table == "sliders":
            turned = self.number(entry.get("turned", 0.0), "angle", f"{where} turned")
        return Guide(point, str(link), on, through, angle, turned)

    def gear(self, entry: dict[str, Any], i: int) -> Gear:
        where = f"[[gears]] {i}"
        _known(entry, {"links", "ratio", "arm"}, where, "key")
        _need(entry, ("links", "ratio"), where)
        links = entry["links"]
        if not isinstance(links, list) or len(links) != 2:
            raise _wrong(f"{where} links", links, "two links")
        return Gear(
            (str(links[0]), str(links[1])),
            self.number(entry["ratio"], "number", f"{where} ratio"),
            str(entry.get("arm", GROUND)),
        )

    def inputs(self) -> list[Input]:
        found = []
        rows = list(self.rows("input"))
        if not rows:
            raise DescriptionError("[input]: missing; nothing drives the mechanism")
        for i, entry in rows:
            where = "[input]" if len(rows) == 1 else f"[[input]] {i}"
            keys = {"link", "on", "slider", "angle", "position", "speed", "acceleration", "jerk", "law"}
            _known(entry, keys, where, "key")
            slide = "slider" in entry
            wrong = {"link", "on", "angle"} & set(entry) if slide else {"position"} & set(entry)
            if wrong or not (slide or "link" in entry):
                raise DescriptionError(
                    f"{where}: found {', '.join(sorted(entry)) or 'nothing'}, expected a link with angle, "
                    "or a slider with position"
                )
            value = entry.get("position" if slide else "angle")
            prefix = "slide " if slide else ""
            rates = {
                key: None if key not in entry else self.number(entry[key], prefix + key, f"{where} {key}")
                for key in ("speed", "acceleration", "jerk")
            }
            found.append(
                Input(
                    link=None if slide else str(entry["link"]),
                    on=str(entry.get("on", GROUND)),
                    slider=str(entry["slider"]) if slide else None,
                    value=None
                    if value is None
                    else self.number(value, "length" if slide else "angle", where),
                    history=self.history(entry["law"], where, slide) if "law" in entry else None,
                    **rates,
                )
            )
        return found

    def history(self, law: Any, where: str, slide: bool) -> tuple[tuple[float, float], ...]:
        """A law of motion: a CSV of time_s and angle_deg (angle_rad, position_m, position_mm)."""
        kinds = (
            {"position_m": 1.0, "position_mm": 1e-3}
            if slide
            else {"angle_rad": 1.0, "angle_deg": math.pi / 180}
        )
        rows = self.csv(law, f"{where} law")
        column = next((c for c in kinds if rows and c in rows[0]), None)
        if column is None or "time_s" not in rows[0]:
            raise _wrong(f"{where} law", law, f"columns time_s and {' or '.join(kinds)}")
        try:
            found = tuple((float(r["time_s"]), float(r[column]) * kinds[column]) for r in rows)
        except (TypeError, ValueError):
            raise _wrong(f"{where} law", law, "numbers in every row") from None
        if not all(math.hypot(*pair) <= LARGEST for pair in found):
            raise _wrong(f"{where} law", law, "finite numbers in every row")
        return found

    def csv(self, name: Any, where: str) -> list[dict[str, str]]:
        """The rows of a CSV file beside this one."""
        try:
            return rows(self.load(self.folder / str(name)))
        except (OSError, ValueError, csv.Error):
            raise _wrong(where, name, "a CSV file that can be read") from None

    def guess(self, inputs: list[Input]) -> Guess:
        table = self.table("guess")
        kinds = ["length" if e.is_slide else "angle" for e in inputs]
        at: list[float] | None = None
        if "at" in table:
            value = table["at"]
            if isinstance(value, dict):
                _known(value, {e.name for e in inputs}, "[guess] at", "input")
                value = [value.get(e.name, e.value) for e in inputs]
                if None in value:
                    raise _wrong("[guess] at", table["at"], "a value for every input")
            values = value if isinstance(value, list) else [value]
            if len(values) != len(inputs):
                raise _wrong("[guess] at", table["at"], f"{len(inputs)} value(s), one for each input")
            at = [
                v
                if isinstance(v, float)
                and v == e.value
                and isinstance(table["at"], dict)
                and e.name not in table["at"]
                else self.number(v, kind, "[guess] at")
                for v, kind, e in zip(values, kinds, inputs, strict=True)
            ]
        angles: dict[str, float] = {}
        points: dict[str, complex] = {}
        names = {p for body in self.bodies.values() for p in body}
        slides = {e.name for e in inputs if e.is_slide}
        for key, value in table.items():
            where = f"[guess] {key}"
            if key == "at":
                continue
            if key in slides and not isinstance(value, list):
                continue
            if isinstance(value, list):
                if key not in names:
                    raise DescriptionError(f"{where}: unknown point '{key}'{hint(str(key), names)}")
                points[key] = self.pair(value, "length", where)
            elif key in self.links:
                angles[key] = self.number(value, "angle", where)
            else:
                raise DescriptionError(f"{where}: unknown link '{key}'{hint(key, self.links)}")
        return Guess(at, angles, points)

    # --- loads ----------------------------------------------------------------------------------------------
    def gravity(self) -> complex:
        value = self.data.get("gravity", [0, 0])
        if isinstance(value, list) and len(value) == 2:
            return complex(*(self.number(v, "slide acceleration", "gravity") for v in value))
        raise _wrong("gravity", value, "two accelerations [x, y]")

    def place(self, link: str, value: Any, where: str) -> complex:
        """A point of a link: its name, or [x, y] in the link's axes."""
        if isinstance(value, str):
            if value not in self.bodies[link]:
                raise DescriptionError(
                    f"{where}: unknown point '{value}' of {link}{hint(str(value), self.bodies[link])}"
                )
            return self.bodies[link][value]
        return self.pair(value, "length", where)

    def body(self, name: Any, where: str, ground: bool = True) -> str:
        names = self.bodies if ground else self.links
        if not isinstance(name, str) or name not in names:
            raise DescriptionError(f"{where}: unknown link '{name}'{hint(name, names)}")
        return name

    def force(self, entry: dict[str, Any], i: int) -> Force:
        where = f"[[forces]] {i}"
        _known(entry, {"link", "point", "force", "frame", "table"}, where, "key")
        _need(entry, ("link",) if "table" in entry else ("link", "force"), where)
        link = self.body(entry["link"], f"{where} link", ground=False)
        point = (
            self.place(link, entry["point"], f"{where} point")
            if "point" in entry
            else self.links[link].center
        )
        frame = entry.get("frame", "ground")
        if frame not in ("ground", "link"):
            raise _wrong(f"{where} frame", frame, "'ground' or 'link'")
        if "table" in entry:
            if "force" in entry:
                raise DescriptionError(f"{where}: found force and table, expected one of them")
            return Force(link, point, 0j, frame, *self.force_table(entry["table"], where))
        return Force(link, point, self.pair(entry["force"], "force", f"{where} force"), frame)

    def force_table(self, name: Any, where: str) -> tuple[tuple[tuple[float, complex], ...], bool]:
        """A force over the input: a CSV of angle_deg (angle_rad, position_m, position_mm), fx_N and fy_N."""
        inputs = list(self.rows("input"))
        if len(inputs) != 1:
            raise _wrong(f"{where} table", name, "a mechanism with one input, for the force is given over it")
        slide = "slider" in inputs[0][1]
        kinds = (
            {"position_m": 1.0, "position_mm": 1e-3}
            if slide
            else {"angle_rad": 1.0, "angle_deg": math.pi / 180}
        )
        rows = self.csv(name, f"{where} table")
        column = next((c for c in kinds if rows and c in rows[0]), None)
        if column is None or not {"fx_N", "fy_N"} & set(rows[0]):
            raise _wrong(f"{where} table", name, f"columns {' or '.join(kinds)}, fx_N and fy_N")
        try:
            found = [
                (
                    float(r[column]) * kinds[column],
                    complex(float(r.get("fx_N") or 0), float(r.get("fy_N") or 0)),
                )
                for r in rows
            ]
        except (TypeError, ValueError):
            raise _wrong(f"{where} table", name, "numbers in every row") from None
        if not all(math.hypot(abs(at), abs(force)) <= LARGEST for at, force in found):
            raise _wrong(f"{where} table", name, "finite numbers in every row")
        if len(found) < 2 or any(not b[0] > a[0] for a, b in itertools.pairwise(found)):
            raise _wrong(f"{where} table", name, f"at least two rows with rising {column}")
        turns = (found[-1][0] - found[0][0]) / (2 * math.pi)
        return tuple(found), not slide and abs(turns - round(turns)) < 1e-9 and round(turns) > 0

    def torque(self, entry: dict[str, Any], i: int) -> Torque:
        where = f"[[torques]] {i}"
        _known(entry, {"link", "torque"}, where, "key")
        _need(entry, ("link", "torque"), where)
        return Torque(
            self.body(entry["link"], f"{where} link", ground=False),
            self.number(entry["torque"], "torque", f"{where} torque"),
        )

    def spring(self, entry: dict[str, Any], i: int) -> Spring:
        where = f"[[springs]] {i}"
        _known(entry, {"between", "stiffness", "free_length", "damping"}, where, "key")
        _need(entry, ("between",), where)
        ends = entry["between"]
        if not isinstance(ends, list) or len(ends) != 2:
            raise _wrong(f"{where} between", ends, 'two points such as ["crank.B", "ground.D"]')
        found = []
        for end in ends:
            link, point = self.point_of(end, f"{where} between")
            found.append((link, self.place(link, point, f"{where} between")))
        return Spring(
            (found[0], found[1]),
            self.number(entry.get("stiffness", 0.0), "stiffness", f"{where} stiffness"),
            self.number(entry.get("free_length", 0.0), "length", f"{where} free_length"),
            self.number(entry.get("damping", 0.0), "damping", f"{where} damping"),
        )

    def point_of(self, name: Any, where: str) -> tuple[str, str]:
        """`crank.B`, or the plain name of a point that one body alone has: the body and the point."""
        link, dot, point = str(name).rpartition(".")
        if dot:
            return self.body(link, where), point
        owners = [body for body, points in self.bodies.items() if name in points]
        if len(owners) != 1:
            known = {p for points in self.bodies.values() for p in points}
            expected = " or ".join(f'"{body}.{name}"' for body in owners)
            raise _wrong(
                where, name, expected or f'a link and its point such as "crank.B"{hint(str(name), known)}'
            )
        return owners[0], str(name)

    def torsion(self, entry: dict[str, Any], i: int) -> TorsionSpring:
        where = f"[[torsion_springs]] {i}"
        _known(entry, {"links", "stiffness", "free_angle", "damping"}, where, "key")
        _need(entry, ("links",), where)
        links = entry["links"]
        if not isinstance(links, list) or len(links) != 2:
            raise _wrong(f"{where} links", links, "two links")
        return TorsionSpring(
            (self.body(links[0], f"{where} links"), self.body(links[1], f"{where} links")),
            self.number(entry.get("stiffness", 0.0), "torsion stiffness", f"{where} stiffness"),
            self.number(entry.get("free_angle", 0.0), "angle", f"{where} free_angle"),
            self.number(entry.get("damping", 0.0), "torsion damping", f"{where} damping"),
        )

    def motor(self, entry: dict[str, Any], i: int) -> Motor:
        where = f"[[motors]] {i}"
        _known(entry, {"carrier", "drives", "mass", "center"}, where, "key")
        _need(entry, ("carrier", "drives"), where)
        return Motor(
            self.body(entry["carrier"], f"{where} carrier"),
            self.body(entry["drives"], f"{where} drives", ground=False),
            self.number(entry.get("mass", 0.0), "mass", f"{where} mass"),
            self.pair(entry.get("center", [0, 0]), "length", f"{where} center"),
        )

    def rub(self, entry: dict[str, Any], i: int) -> Friction:
        where = f"[[friction]] {i}"
        _known(entry, {"joint", "coefficient", "radius"}, where, "key")
        _need(entry, ("joint", "coefficient"), where)
        joint = str(entry["joint"])
        names = {p for body in self.bodies.values() for p in body}
        if joint not in names:
            raise DescriptionError(f"{where} joint: unknown point '{joint}'{hint(joint, names)}")
        return Friction(
            joint,
            self.number(entry["coefficient"], "number", f"{where} coefficient"),
            self.number(entry.get("radius", 0.0), "length", f"{where} radius"),
        )


def _known(entry: Mapping[str, Any], names: set[str], where: str, what: str) -> None:
    if not isinstance(entry, Mapping):
        raise _wrong(where, entry, "a table")
    for key in entry:
        if key not in names:
            raise DescriptionError(f"{where}: unknown {what} '{key}'{hint(str(key), names)}")


def _need(entry: Mapping[str, Any], keys: tuple[str, ...], where: str) -> None:
    for key in keys:
        if key not in entry:
            raise DescriptionError(f"{where}: '{key}' is missing")


def _wrong(where: str, found: Any, expected: str) -> DescriptionError:
    return DescriptionError(f"{where}: found {found!r}, expected {expected}")
