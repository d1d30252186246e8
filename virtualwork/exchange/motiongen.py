"""MotionGen: JSON with joints, links, slots, cylinders, actuators; a capture, or the program's own `.motiongen`."""

from __future__ import annotations

from typing import Any

from dalembert.documents.values import damaged, exact, objects
from dalembert.errors import DataError
from virtualwork.describe.parts import Guide
from virtualwork.exchange.drawn import GROUND, Drawing, Drive
from virtualwork.exchange.places import Exact, direction, place

LENGTHS = ("mm", "cm", "m", "in", "ft")
# what is read of a document, and what only describes it
KEYS = {"mechanism", "units", "joints", "links", "slots", "cylinders", "actuators", "notes", "source", "meta"}


def read(file: str, data: Any) -> list[Drawing]:
    """Read every mechanism of a document."""
    entries = data.get("mechanisms", [data]) if isinstance(data, dict) else data
    if not isinstance(entries, list):
        raise damaged(file, "mechanisms", type(entries).__name__, "a list of mechanisms")
    return [_Reader(file, entry).drawing() for entry in entries]


def listed(entry: dict[str, Any], *keys: str) -> list[Any]:
    """Return the list under the first of some keys that is there."""
    value: Any = next((entry[k] for k in keys if entry.get(k) is not None), [])
    return value if isinstance(value, list) else [value]


class _Reader:
    """Reads one mechanism: a body for each link; errors name the place."""

    def __init__(self, file: str, data: Any) -> None:
        if isinstance(data, dict) and isinstance(data.get("mechanism"), dict):
            data = data | data["mechanism"]
        if not isinstance(data, dict) or not isinstance(data.get("joints"), list | dict):
            raise DataError(f"{file}: joints: expected a list of joints with id, x, y")
        self.file, self.data = file, data
        units = data.get("units") or {}
        unit = str(units.get("length", "m") if isinstance(units, dict) else units)
        self.d = Drawing(name=str(data.get("name", "")), length=unit if unit in LENGTHS else "m")
        if unit not in LENGTHS or not units:
            self.d.notes.append(f"unknown unit of length '{unit}': numbers are taken as metres")

    def entries(self, key: str) -> list[dict[str, Any]]:
        """Return the objects of a list, or of an object by their ids."""
        return objects(self.file, key, self.data.get(key))

    def joint_ids(self, where: str, ids: list[Any]) -> list[str]:
        """Return ids of joints, each of which must be in the file."""
        for id_ in ids:
            if str(id_) not in self.at:
                raise damaged(self.file, where, id_, f"a joint: one of {', '.join(self.at)[:200]}")
        return [str(id_) for id_ in ids]

    def drawing(self) -> Drawing:
        d = self.d
        self.at: dict[str, Exact] = {}
        self.welded: set[str] = set()
        for k, e in enumerate(self.entries("joints"), 1):
            here = e.get("position") if isinstance(e.get("position"), dict) else e
            try:
                self.at[str(e["id"])] = place(here["x"], here["y"])  # type: ignore[index]
            except (KeyError, ValueError):
                raise damaged(self.file, f"joint {k}", e, "an id, x and y") from None
            if e.get("isWelded"):
                self.welded.add(str(e["id"]))
        self.slot_of: dict[str, str] = {}
        moving = 0
        for k, e in enumerate(self.entries("links"), 1):
            ids = self.joint_ids(f"link {k}", listed(e, "joints", "jointIds"))
            if e.get("isGround"):
                name = GROUND
            else:
                moving += 1
                name = str(e.get("name") or f"L{moving}")
                name = name if name not in d.bodies else f"{name} {k}"
            for id_ in ids:
                d.body(name).points[id_] = self.at[id_]
            for slot in listed(e, "slots", "slotIds"):
                self.slot_of[str(slot)] = name
        for id_ in sorted(self.welded):
            d.weld(d.holders(id_))
        self.riders: dict[str, tuple[str, str, str]] = {}
        for k, e in enumerate(self.entries("slots"), 1):
            self._slot(k, e)
            self._limits(f"slot {k}", e)
        self.pistons: dict[frozenset[str], str] = {}
        for k, e in enumerate(self.entries("cylinders"), 1):
            self._cylinder(f"cylinder {k}", self.joint_ids(f"cylinder {k}", listed(e, "joints", "jointIds")))
            self._limits(f"cylinder {k}", e)
        for k, e in enumerate(self.entries("actuators"), 1):
            self._actuator(k, e)
        for key, value in self.data.items():
            if key not in KEYS and isinstance(value, list | dict) and value:
                d.leave(key, "it has no equivalent")
        return d

    def _slot(self, k: int, e: dict[str, Any]) -> None:
        d, where = self.d, f"slot {k}"
        ends = self.joint_ids(where, listed(e, "ends", "endIds", "joints", "jointIds"))
        if len(ends) != 2 or self.at[ends[0]] == self.at[ends[1]]:
            raise damaged(self.file, where, ends, "two ends at different places")
        on = self.slot_of.get(str(e.get("id")))
        if on is None:
            d.leave(where, "it is on no link")
            return
        a, b = (self.at[id_] for id_ in ends)
        angle = direction(a, b)
        for rider in self.joint_ids(where, listed(e, "riders", "riderIds")):
            held = [n for n in d.holders(rider) if n != on]
            if not held:
                d.leave(f"rider {rider} of {where}", "no other link has it")
                continue
            if rider in d.body(on).points:
                # the carrier lists its riders among its joints: they are not pinned to it
                del d.bodies[on].points[rider]
            z = self.at[rider]
            d.moved((a, b), z, where, rider)
            self.riders[rider] = (d.add(Guide(rider, held[-1], on, z, angle)), ends[0], ends[1])

    def _cylinder(self, where: str, ends: list[str]) -> str:
        if len(ends) != 2 or self.at[ends[0]] == self.at[ends[1]]:
            raise damaged(self.file, where, ends, "two joints at different places")
        d, (a, b) = self.d, ends
        names = f"{where} barrel", f"{where} rod"
        slider = d.cylinder(names, (a, b), (self.at[a], self.at[b]))
        self.pistons[frozenset(ends)] = slider
        for end, name in zip(ends, names, strict=True):
            if end in self.welded:
                held = [n for n in d.holders(end) if n not in names]
                d.welds.append((name, held[0] if held and GROUND not in held else GROUND))
        return slider

    def _limits(self, where: str, e: dict[str, Any]) -> None:
        """Name the limits of a stroke or a turn; a whole turn is none."""
        held = {key: e[key] for key in ("stroke", "min", "max") if e.get(key) is not None}
        low, high = held.get("min"), held.get("max")
        numbers = isinstance(low, int | float) and isinstance(high, int | float)
        if numbers and e.get("type") == "rotary" and high - low >= 360:  # type: ignore[operator]
            del held["min"], held["max"]
        if held:
            values = ", ".join(f"{key} {value}" for key, value in held.items())
            self.d.leave(f"{values} of {where}", "an input has no limits")

    def _actuator(self, k: int, e: dict[str, Any]) -> None:
        d, where = self.d, f"actuator {k}"
        self._limits(where, e)
        at, start = self.joint_ids(where, [e.get("at"), e.get("from")])
        velocity = e.get("velocity")
        try:
            speed = None if velocity is None else float(exact(velocity))
        except ValueError:
            raise damaged(self.file, where, velocity, "a velocity") from None
        if e.get("type") == "linear" or e.get("to") is None:
            slider, sense = self.pistons.get(frozenset((at, start))), 1.0
            if slider is None and at in self.riders and start in self.riders[at][1:]:
                slider = self.riders[at][0]
                sense = 1.0 if start == self.riders[at][1] else -1.0
            if slider is None:
                slider = self._cylinder(f"{where} cylinder", [start, at])
            d.drives.append(
                Drive(slider=slider, speed=None if speed is None else f"{sense * speed!r} {d.length}/s")
            )
            return
        (to,) = self.joint_ids(where, [e["to"]])
        turning = d.holders(at)
        links = [n for n in turning if to in d.bodies[n].points]
        frames = [n for n in turning if start in d.bodies[n].points and n not in links[:1]]
        if not links:
            raise damaged(self.file, where, f"{at}, {to}", "two joints of the driven link")
        on = GROUND if GROUND in turning or not frames else frames[0]
        rpm = None if speed is None else f"{speed!r} rpm"
        if links[0] == GROUND and frames:
            # the motor's other side is the one that moves
            links, on, rpm = frames, GROUND, None if speed is None else f"{-speed!r} rpm"
        d.drives.append(Drive(links[0], on, speed=rpm))
