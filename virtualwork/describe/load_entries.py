"""The loads of a TOML description: gravity, forces, torques, springs, motors, friction."""

from __future__ import annotations

import itertools
import math
import re
from typing import Any

from virtualwork.describe import DescriptionError, hint
from virtualwork.describe.entries import (
    FORCE,
    FRICTION,
    MOTOR,
    SPRING,
    TORQUE,
    TORSION_SPRING,
    Entries,
    need,
    proper,
)
from virtualwork.describe.parts import Force, Friction, Motor, Spring, Torque, TorsionSpring
from virtualwork.describe.units import LARGEST, wrong

# the columns that a table of torque may be over
AXES = {
    "t_s": ("time", 1.0),
    "time_s": ("time", 1.0),
    "angle_rad": ("angle", 1.0),
    "angle_deg": ("angle", math.pi / 180),
    "speed_rad_s": ("speed", 1.0),
    "speed_rpm": ("speed", math.pi / 30),
}


class LoadEntries(Entries):
    """The tables of loads; `[[springs]] 2` is the second."""

    def loads(self) -> dict[str, Any]:
        """Every load, under the name that `Description` gives it."""
        return {
            "forces": self.every("forces", self.force),
            "torques": self.every("torques", self.torque),
            "springs": self.every("springs", self.spring),
            "torsion_springs": self.every("torsion_springs", self.torsion),
            "motors": self.every("motors", self.motor),
            "friction": self.every("friction", self.joint_friction),
        }

    def force(self, entry: dict[str, Any], i: int) -> Force:
        """A force, constant or over the input by a table."""
        where = f"[[forces]] {i}"
        proper(entry, FORCE, where)
        if "table" not in entry:
            need(entry, ("force",), where)
        link = self.body(entry["link"], f"{where} link", ground=False)
        point = self.place(link, entry["point"], f"{where} point") if "point" in entry else None
        frame = entry.get("frame", "ground")
        if frame not in ("ground", "link"):
            raise wrong(f"{where} frame", frame, "'ground' or 'link'")
        if "table" in entry:
            if "force" in entry:
                raise DescriptionError(f"{where}: found force and table, expected one of them")
            return Force(link, point, 0j, frame, *self.force_table(entry["table"], where))
        return Force(link, point, self.pair(entry["force"], "force", f"{where} force"), frame)

    def force_table(self, name: Any, where: str) -> tuple[tuple[tuple[float, complex], ...], bool]:
        """A force over the input: a CSV of angle_deg (angle_rad, position_m, position_mm), fx_N and fy_N."""
        inputs = list(self.rows("input"))
        if len(inputs) != 1:
            raise wrong(f"{where} table", name, "a mechanism with one input, for the force is given over it")
        slide = "slider" in inputs[0][1]
        kinds = (
            {"position_m": 1.0, "position_mm": 1e-3}
            if slide
            else {"angle_rad": 1.0, "angle_deg": math.pi / 180}
        )
        rows = self.csv(name, f"{where} table")
        column = next((c for c in kinds if rows and c in rows[0]), None)
        if column is None or not {"fx_N", "fy_N"} & set(rows[0]):
            raise wrong(f"{where} table", name, f"columns {' or '.join(kinds)}, fx_N and fy_N")
        try:
            found = [
                (
                    float(r[column]) * kinds[column],
                    complex(float(r.get("fx_N") or 0), float(r.get("fy_N") or 0)),
                )
                for r in rows
            ]
        except (TypeError, ValueError):
            raise wrong(f"{where} table", name, "numbers in every row") from None
        if not all(math.hypot(abs(at), abs(force)) <= LARGEST for at, force in found):
            raise wrong(f"{where} table", name, "finite numbers in every row")
        if len(found) < 2 or any(not b[0] > a[0] for a, b in itertools.pairwise(found)):
            raise wrong(f"{where} table", name, f"at least two rows with rising {column}")
        turns = (found[-1][0] - found[0][0]) / (2 * math.pi)
        return tuple(found), not slide and abs(turns - round(turns)) < 1e-9 and round(turns) > 0

    def torque(self, entry: dict[str, Any], i: int) -> Torque:
        """A torque, constant or by a table."""
        where = f"[[torques]] {i}"
        proper(entry, TORQUE, where)
        link, value = self.body(entry["link"], f"{where} link", ground=False), entry["torque"]
        if isinstance(value, str) and re.match(r"\s*[-+]?(\d|\.\d)", value) is None:
            return Torque(link, 0.0, *self.torque_table(value, f"{where} torque"))
        return Torque(link, self.number(value, "torque", f"{where} torque"))

    def torque_table(self, name: str, where: str) -> tuple[tuple[tuple[float, float], ...], Any, bool]:
        """A torque over the time, or over the angle or speed of its link: a CSV with torque_N_m."""
        rows = self.csv(name, where)
        column = next((c for c in AXES if rows and c in rows[0]), None)
        if column is None or "torque_N_m" not in rows[0]:
            raise wrong(where, name, f"columns torque_N_m and one of {', '.join(AXES)}")
        axis, factor = AXES[column]
        try:
            found = [(float(r[column]) * factor, float(r["torque_N_m"])) for r in rows]
        except (TypeError, ValueError):
            raise wrong(where, name, "numbers in every row") from None
        if not all(math.hypot(at, torque) <= LARGEST for at, torque in found):
            raise wrong(where, name, "finite numbers in every row")
        if len(found) < 2 or any(not b[0] > a[0] for a, b in itertools.pairwise(found)):
            raise wrong(where, name, f"at least two rows with rising {column}")
        turns = (found[-1][0] - found[0][0]) / (2 * math.pi)
        return tuple(found), axis, axis == "angle" and abs(turns - round(turns)) < 1e-9 and round(turns) > 0

    def spring(self, entry: dict[str, Any], i: int) -> Spring:
        """A spring and damper."""
        where = f"[[springs]] {i}"
        proper(entry, SPRING, where)
        ends = entry["between"]
        if not isinstance(ends, list) or len(ends) != 2:
            raise wrong(f"{where} between", ends, 'two points such as ["crank.B", "ground.D"]')
        found = []
        for end in ends:
            link, point = self.point_of(end, f"{where} between")
            found.append((link, self.place(link, point, f"{where} between")))
        return Spring(
            (found[0], found[1]),
            self.optional(entry, SPRING, "stiffness", where),
            self.optional(entry, SPRING, "free_length", where),
            self.optional(entry, SPRING, "damping", where),
        )

    def torsion(self, entry: dict[str, Any], i: int) -> TorsionSpring:
        """A torsion spring and damper."""
        where = f"[[torsion_springs]] {i}"
        proper(entry, TORSION_SPRING, where)
        links = entry["links"]
        if not isinstance(links, list) or len(links) != 2:
            raise wrong(f"{where} links", links, "two links")
        return TorsionSpring(
            (self.body(links[0], f"{where} links"), self.body(links[1], f"{where} links")),
            self.optional(entry, TORSION_SPRING, "stiffness", where),
            self.optional(entry, TORSION_SPRING, "free_angle", where),
            self.optional(entry, TORSION_SPRING, "damping", where),
        )

    def motor(self, entry: dict[str, Any], i: int) -> Motor:
        """A motor that a link carries."""
        where = f"[[motors]] {i}"
        proper(entry, MOTOR, where)
        return Motor(
            self.body(entry["carrier"], f"{where} carrier"),
            self.body(entry["drives"], f"{where} drives", ground=False),
            self.optional(entry, MOTOR, "mass", where),
            self.pair(entry.get("center", [0, 0]), "length", f"{where} center"),
        )

    def joint_friction(self, entry: dict[str, Any], i: int) -> Friction:
        """Friction in a joint."""
        where = f"[[friction]] {i}"
        proper(entry, FRICTION, where)
        joint = str(entry["joint"])
        names = {p for body in self.bodies.values() for p in body}
        if joint not in names:
            raise DescriptionError(f"{where} joint: unknown point '{joint}'{hint(joint, names)}")
        return Friction(
            joint,
            self.number(entry["coefficient"], "number", f"{where} coefficient"),
            self.optional(entry, FRICTION, "radius", where),
        )
