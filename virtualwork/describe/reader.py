"""Reading a mechanism from its TOML description."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeVar

from virtualwork.describe import DescriptionError, MechanismError, known
from virtualwork.describe.description import Description
from virtualwork.describe.entries import (
    ENTRIES,
    FILE,
    FORCE,
    FRICTION,
    GEAR,
    GUESS,
    INPUT,
    LINK,
    MOTOR,
    POINT,
    SLIDER,
    SPRING,
    TORSION_SPRING,
    Entries,
    Load,
    known_keys,
    proper,
)
from virtualwork.describe.parts import (
    GROUND,
    Force,
    Friction,
    Gear,
    Guess,
    Guide,
    Input,
    Link,
    Motor,
    Polar,
    Spring,
    Torque,
    TorsionSpring,
)
from virtualwork.describe.units import wrong

D = TypeVar("D", bound=Description)

TABLES = {*FILE, *ENTRIES}
# columns of a table over the input, with what makes them SI
TURNS = {"angle_rad": 1.0, "angle_deg": math.pi / 180}
TRAVELS = {"position_m": 1.0, "position_mm": 1e-3}
# the columns that a table of torque may be over
AXES = {
    "t_s": ("time", 1.0),
    "time_s": ("time", 1.0),
    "angle_rad": ("angle", 1.0),
    "angle_deg": ("angle", math.pi / 180),
    "speed_rad_s": ("speed", 1.0),
    "speed_rpm": ("speed", math.pi / 30),
}


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
    except ValueError as error:
        # a TOMLDecodeError, or a number of thousands of digits
        raise DescriptionError(f"{file}: no valid TOML: {error}") from None
    try:
        reader = _Reader(data, folder or Path(), load)
        parts = reader.parts()
        made = make(**parts)
        tolerances = reader.tolerances(made)
        return make(**parts, tolerances=tolerances) if tolerances else made
    except MechanismError as error:
        raise type(error)(f"{file}: {error}") from None


class _Reader(Entries):
    """Every table of the file."""

    def parts(self) -> dict[str, Any]:
        """Every part of the mechanism, under the name that `Description` gives it."""
        known_keys(self.data, TABLES, "the file", "table")
        ground = {
            name: self.pair(v, "length", f"[ground] {name}") for name, v in self.table("ground").items()
        }
        self.links = {name: self.link(name, entry) for name, entry in self.table("links").items()}
        self.bodies = {GROUND: ground} | {n: k.points for n, k in self.links.items()}
        guides = [*self.every("slots", self.slot), *self.every("sliders", self.slider)]
        inputs = self.inputs()
        return {
            "ground": ground,
            "links": self.links,
            "guides": guides,
            "gears": self.every("gears", self.gear),
            "inputs": inputs,
            "guess": self.guess(inputs),
            "name": self.name(),
            "gravity": self.gravity(),
            **self.loads(),
        }

    def loads(self) -> dict[str, Any]:
        """Every load, under the name that `Description` gives it."""
        kinds: dict[str, Callable[[dict[str, Any], str], Any]] = {
            "forces": self.force,
            "torques": self.torque,
            "springs": self.spring,
            "torsion_springs": self.torsion,
            "motors": self.motor,
            "friction": self.friction,
        }
        return {name: self.every(name, read) for name, read in kinds.items() if name in self.data}

    def gravity(self) -> complex:
        """Its two components."""
        value = self.data.get("gravity", [0, 0])
        if isinstance(value, list) and len(value) == 2:
            return self.pair(value, "slide acceleration", "gravity")
        raise wrong("gravity", value, "two accelerations [x, y]")

    def tolerances(self, m: Description) -> dict[str, float]:
        """The limits ± of dimensions, by their paths; quoted, or with the words of the path as tables."""
        found: dict[str, float] = {}
        if "tolerances" not in self.data:
            return found
        # most files have none
        from virtualwork.describe.dimensions import dimensions, named

        known = dimensions(m)

        def walk(table: Mapping[str, Any], before: str) -> None:
            for key, given in table.items():
                path = f"{before}{key}"
                if isinstance(given, dict):
                    walk(given, f"{path}.")
                    continue
                where = f"[tolerances] {path}"
                try:
                    kind = named(m, path, known)[0].kind
                except DescriptionError as error:
                    raise DescriptionError(f"[tolerances]: {error}") from None
                found[path] = self.number(given, kind, where)
                if found[path] < 0:
                    raise wrong(where, given, "a limit of zero or more")

        walk(self.table("tolerances"), "")
        return found

    def name(self) -> str:
        found = self.data.get("name", "")
        if not isinstance(found, (str, int, float)):
            raise wrong("name", found, "text")
        return str(found)

    # --- what moves -----------------------------------------------------------------------------------------------
    def link(self, name: str, entry: Any) -> Link:
        where = f"[links.{name}]"
        if not isinstance(entry, dict):
            raise wrong(where, entry, "a table with points")
        known_keys(entry, LINK, where, "key")
        points: dict[str, complex | Polar] = {}
        given = entry.get("points", {})
        if not isinstance(given, dict):
            raise wrong(f"{where} points", given, "a table { A = [0, 0], B = [120, 0] }")
        for p, v in given.items():
            at = f"{where} points.{p}"
            if not isinstance(v, dict):
                points[p] = self.pair(v, "length", at)
                continue
            if not isinstance(v.get("from"), str):
                raise DescriptionError(f"{at} from: expected the name of another point of this link")
            proper(v, POINT, at)
            points[p] = Polar(v["from"], **self.quantities(v, POINT, at))
        found = self.quantities(entry, {key: LINK[key] for key in ("mass", "inertia", "center")}, where)
        for key, what in (("mass", "a mass"), ("inertia", "a moment of inertia")):
            if found.get(key, 0.0) < 0:
                raise wrong(f"{where} {key}", entry[key], f"{what} of zero or more")
        try:
            return Link(points, **found)
        except DescriptionError as error:
            raise DescriptionError(f"{where} {error}") from None

    def slot(self, entry: dict[str, Any], where: str, turned: float | None = None) -> Guide:
        """A slot, or with an angle a slider."""
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
        # an unknown carrier is refused with all other names
        if on in self.bodies or not isinstance(through, str):
            through = self.place(on, through, f"{where} through")
        angles = {"turned": turned} | self.quantities(entry, SLIDER, where)
        return Guide(point, str(link), on, through, **angles)

    def slider(self, entry: dict[str, Any], where: str) -> Guide:
        return self.slot(entry, where, 0.0)

    def gear(self, entry: dict[str, Any], where: str) -> Gear:
        a, b = self.two(entry, "links", where, "two links")
        return Gear(
            (str(a), str(b)), arm=str(entry.get("arm", GROUND)), **self.quantities(entry, GEAR, where)
        )

    def inputs(self) -> list[Input]:
        found = []
        rows = self.rows("input")
        if not rows:
            raise DescriptionError("[input]: missing; nothing drives the mechanism")
        for i, entry in enumerate(rows, 1):
            where = "[input]" if len(rows) == 1 else f"[[input]] {i}"
            known_keys(entry, INPUT, where, "key")
            slide = "slider" in entry
            out_of_place = {"link", "on", "angle"} & set(entry) if slide else {"position"} & set(entry)
            if out_of_place or not (slide or "link" in entry):
                raise DescriptionError(
                    f"{where}: found {', '.join(sorted(entry)) or 'nothing'}, expected a link with angle, "
                    "or a slider with position"
                )
            given: dict[str, Any] = {
                key: self.number(entry[key], f"slide {key}" if slide else key, f"{where} {key}")
                for key in ("speed", "acceleration", "jerk")
                if key in entry
            }
            value, kind = ("position", "length") if slide else ("angle", "angle")
            if value in entry:
                given["value"] = self.number(entry[value], kind, where)
            if "law" in entry:
                given["history"] = self.history(entry["law"], f"{where} law", slide)
            driven = "slider" if slide else "link"
            given[driven] = str(entry[driven])
            found.append(Input(on=str(entry.get("on", GROUND)), **given))
        return found

    def history(self, law: Any, where: str, slide: bool) -> tuple[tuple[float, float], ...]:
        """A law of motion: a CSV of time_s and angle_deg (angle_rad, position_m, position_mm)."""
        over = TRAVELS if slide else TURNS
        found, _ = self.curve(
            law,
            where,
            over,
            ("time_s",),
            f"time_s and {' or '.join(over)}",
            lambda row, column: (float(row["time_s"]), float(row[column]) * over[column]),
        )
        return tuple(found)

    def guess(self, inputs: list[Input]) -> Guess:
        table = self.table("guess")
        at = self.guessed_inputs(table["at"], inputs) if "at" in table else None
        angles: dict[str, float] = {}
        points: dict[str, complex] = {}
        names = {p for body in self.bodies.values() for p in body}
        slides = {e.name for e in inputs if e.is_slide}
        for key, value in table.items():
            where = f"[guess] {key}"
            if key in GUESS:
                continue
            if isinstance(value, list):
                known(key, names, where, "point")
                points[key] = self.pair(value, "length", where)
            elif key not in slides:
                known(key, self.links, where, "link")
                angles[key] = self.number(value, "angle", where)
        return Guess(at, angles, points)

    def guessed_inputs(self, given: Any, inputs: list[Input]) -> list[float]:
        """The input, or every input, for which the guess holds; of those not named the description's own value."""
        where = "[guess] at"
        kinds = ["length" if e.is_slide else "angle" for e in inputs]
        if isinstance(given, dict):
            known_keys(given, {e.name for e in inputs}, where, "input")
            own = {e.name: e.value for e in inputs if e.value is not None}
            if any(e.name not in given and e.name not in own for e in inputs):
                raise wrong(where, given, "a value for every input")
            return [
                self.number(given[e.name], kind, where) if e.name in given else own[e.name]
                for kind, e in zip(kinds, inputs, strict=True)
            ]
        values = given if isinstance(given, list) else [given]
        if len(values) != len(inputs):
            raise wrong(where, given, f"{len(inputs)} value(s), one for each input")
        return [self.number(value, kind, where) for value, kind in zip(values, kinds, strict=True)]

    # --- loads ----------------------------------------------------------------------------------------------------
    def force(self, entry: dict[str, Any], where: str) -> Force:
        """A force, constant or over the input by a table."""
        if "table" not in entry and "force" not in entry:
            raise DescriptionError(f"{where}: 'force' is missing")
        link = self.body(entry["link"], f"{where} link", ground=False)
        point = self.place(link, entry["point"], f"{where} point") if "point" in entry else None
        frame = entry.get("frame", "ground")
        if frame not in ("ground", "link"):
            raise wrong(f"{where} frame", frame, "'ground' or 'link'")
        if "table" not in entry:
            return Force(link, point, frame=frame, **self.quantities(entry, FORCE, where))
        if "force" in entry:
            raise DescriptionError(f"{where}: found force and table, expected one of them")
        return Force(link, point, 0j, frame, *self.force_table(entry["table"], f"{where} table"))

    def force_table(self, name: Any, where: str) -> tuple[tuple[tuple[float, complex], ...], bool]:
        """A force over the input: a CSV of angle_deg (angle_rad, position_m, position_mm), fx_N and fy_N."""
        inputs = self.rows("input")
        if len(inputs) != 1:
            raise wrong(where, name, "a mechanism with one input, for the force is given over it")
        over = TRAVELS if "slider" in inputs[0] else TURNS
        found, column = self.curve(
            name,
            where,
            over,
            ("fx_N", "fy_N"),
            f"{' or '.join(over)}, fx_N and fy_N",
            lambda row, column: (
                float(row[column]) * over[column],
                complex(float(row.get("fx_N") or 0), float(row.get("fy_N") or 0)),
            ),
        )
        rises([at for at, _ in found], name, where, column)
        return tuple(found), over is TURNS and is_cycle(found[0][0], found[-1][0])

    def torque(self, entry: dict[str, Any], where: str) -> Torque:
        """A torque, constant or by a table."""
        link, value = self.body(entry["link"], f"{where} link", ground=False), entry["torque"]
        if isinstance(value, str) and re.match(r"\s*[-+]?(\d|\.\d)", value) is None:
            return Torque(link, 0.0, *self.torque_table(value, f"{where} torque"))
        return Torque(link, self.number(value, "torque", f"{where} torque"))

    def torque_table(self, name: str, where: str) -> tuple[tuple[tuple[float, float], ...], Any, bool]:
        """A torque over the time, or over the angle or speed of its link: a CSV with torque_N_m."""
        found, column = self.curve(
            name,
            where,
            AXES,
            ("torque_N_m",),
            f"torque_N_m and one of {', '.join(AXES)}",
            lambda row, column: (float(row[column]) * AXES[column][1], float(row["torque_N_m"])),
        )
        rises([at for at, _ in found], name, where, column)
        axis = AXES[column][0]
        return tuple(found), axis, axis == "angle" and is_cycle(found[0][0], found[-1][0])

    def spring(self, entry: dict[str, Any], where: str) -> Spring:
        ends = self.two(entry, "between", where, 'two points such as ["crank.B", "ground.D"]')
        a, b = (self.point_of(end, f"{where} between") for end in ends)
        return Spring((a, b), **self.quantities(entry, SPRING, where))

    def torsion(self, entry: dict[str, Any], where: str) -> TorsionSpring:
        a, b = self.two(entry, "links", where, "two links")
        links = self.body(a, f"{where} links"), self.body(b, f"{where} links")
        return TorsionSpring(links, **self.quantities(entry, TORSION_SPRING, where))

    def motor(self, entry: dict[str, Any], where: str) -> Motor:
        return Motor(
            self.body(entry["carrier"], f"{where} carrier"),
            self.body(entry["drives"], f"{where} drives", ground=False),
            **self.quantities(entry, MOTOR, where),
        )

    def friction(self, entry: dict[str, Any], where: str) -> Friction:
        joint = str(entry["joint"])
        known(joint, {p for body in self.bodies.values() for p in body}, f"{where} joint", "point")
        return Friction(joint, **self.quantities(entry, FRICTION, where))


def rises(at: Sequence[float], name: Any, where: str, column: str) -> None:
    """Refuse a table whose first column does not rise."""
    if len(at) < 2 or any(not b > a for a, b in pairwise(at)):
        raise wrong(where, name, f"at least two rows with rising {column}")


def is_cycle(first: float, last: float) -> bool:
    """Whether a span of angles is one of whole turns."""
    turns = (last - first) / (2 * math.pi)
    return abs(turns - round(turns)) < 1e-9 and round(turns) > 0
