"""Reading a mechanism from its TOML description."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from virtualwork.describe import DescriptionError, MechanismError, hint
from virtualwork.describe.description import Description
from virtualwork.describe.entries import (
    ENTRIES,
    FILE,
    GEAR,
    GUESS,
    INPUT,
    LINK,
    LOADS,
    POINT,
    SLIDER,
    Entries,
    Load,
    known_keys,
    proper,
)
from virtualwork.describe.parts import GROUND, Gear, Guess, Guide, Input, Link, Polar
from virtualwork.describe.units import LARGEST, wrong

D = TypeVar("D", bound=Description)

TABLES = {*FILE, *ENTRIES}


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
    """All tables but those of loads."""

    def parts(self) -> dict[str, Any]:
        """Every part of the mechanism, under the name that `Description` gives it."""
        known_keys(self.data, TABLES, "the file", "table")
        ground = {
            name: self.pair(v, "length", f"[ground] {name}") for name, v in self.table("ground").items()
        }
        self.links = {name: self.link(name, entry) for name, entry in self.table("links").items()}
        self.bodies = {GROUND: ground} | {n: k.points for n, k in self.links.items()}
        guides = [self.guide(e, i, "slots") for i, e in self.rows("slots")]
        guides += [self.guide(e, i, "sliders") for i, e in self.rows("sliders")]
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

    def gravity(self) -> complex:
        """Its two components."""
        if "gravity" not in self.data:
            return 0j
        value = self.data["gravity"]
        if isinstance(value, list) and len(value) == 2:
            return complex(*(self.number(v, "slide acceleration", "gravity") for v in value))
        raise wrong("gravity", value, "two accelerations [x, y]")

    def loads(self) -> dict[str, Any]:
        """The loads of a file that has any."""
        if self.data.keys().isdisjoint(LOADS):
            return {}
        from virtualwork.describe.load_entries import LoadEntries

        entries = LoadEntries(self.data, self.folder, self.load)
        entries.links, entries.bodies = self.links, self.bodies
        return entries.loads()

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
            points[p] = Polar(
                v["from"],
                self.number(v["length"], "length", f"{at} length"),
                self.number(v["angle"], "angle", f"{at} angle"),
            )
        mass = self.optional(entry, LINK, "mass", where)
        inertia = self.optional(entry, LINK, "inertia", where)
        center = self.pair(entry["center"], "length", f"{where} center") if "center" in entry else 0j
        if mass < 0:
            raise wrong(f"{where} mass", entry["mass"], "a mass of zero or more")
        if inertia < 0:
            raise wrong(f"{where} inertia", entry["inertia"], "a moment of inertia of zero or more")
        try:
            return Link(points, mass, center, inertia)
        except DescriptionError as error:
            raise DescriptionError(f"{where} {error}") from None

    def guide(self, entry: dict[str, Any], i: int, table: str) -> Guide:
        where = f"[[{table}]] {i}"
        proper(entry, ENTRIES[table], where)
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
        angle = self.optional(entry, SLIDER, "angle", where)
        turned = None
        if table == "sliders":
            turned = self.optional(entry, SLIDER, "turned", where)
        return Guide(point, str(link), on, through, angle, turned)

    def gear(self, entry: dict[str, Any], i: int) -> Gear:
        where = f"[[gears]] {i}"
        proper(entry, GEAR, where)
        links = entry["links"]
        if not isinstance(links, list) or len(links) != 2:
            raise wrong(f"{where} links", links, "two links")
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
            known_keys(entry, INPUT, where, "key")
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
            raise wrong(f"{where} law", law, f"columns time_s and {' or '.join(kinds)}")
        try:
            found = tuple((float(r["time_s"]), float(r[column]) * kinds[column]) for r in rows)
        except (TypeError, ValueError):
            raise wrong(f"{where} law", law, "numbers in every row") from None
        if not all(math.hypot(*pair) <= LARGEST for pair in found):
            raise wrong(f"{where} law", law, "finite numbers in every row")
        return found

    def guess(self, inputs: list[Input]) -> Guess:
        table = self.table("guess")
        kinds = ["length" if e.is_slide else "angle" for e in inputs]
        at: list[float] | None = None
        if "at" in table:
            value = table["at"]
            if isinstance(value, dict):
                known_keys(value, {e.name for e in inputs}, "[guess] at", "input")
                value = [value.get(e.name, e.value) for e in inputs]
                if None in value:
                    raise wrong("[guess] at", table["at"], "a value for every input")
            values = value if isinstance(value, list) else [value]
            if len(values) != len(inputs):
                raise wrong("[guess] at", table["at"], f"{len(inputs)} value(s), one for each input")
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
            if key in GUESS:
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
