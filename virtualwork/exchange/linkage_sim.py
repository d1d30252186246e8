"""linkage_sim: JSON in SI; bodies with points in their own axes, and no pose."""

from __future__ import annotations

import cmath
import math
from typing import Any

from dalembert.documents.values import damaged, exact, objects
from dalembert.errors import DataError
from virtualwork.describe.parts import Guide
from virtualwork.exchange.drawn import GROUND, SAME, Body, Drawing, Drive, Load, pins_of, together
from virtualwork.exchange.places import Exact, apart, coordinates, place

# type -> the table here, the keys of its bodies and of its points on them, and of its numbers
LOADS: dict[str, tuple[str, tuple[tuple[str, str | None], ...], tuple[str, ...]]] = {
    "LinearSpring": ("springs", (("body_a", "point_a"), ("body_b", "point_b")), ("stiffness", "free_length")),
    "LinearDamper": ("springs", (("body_a", "point_a"), ("body_b", "point_b")), ("damping",)),
    "TorsionSpring": ("torsion_springs", (("body_i", None), ("body_j", None)), ("stiffness", "free_angle")),
    "RotaryDamper": ("torsion_springs", (("body_i", None), ("body_j", None)), ("damping",)),
    "ExternalForce": ("forces", (("body_id", "local_point"),), ()),
    "ExternalTorque": ("torques", (("body_id", None),), ("torque",)),
}
# keys that are read, or that say nothing of a mechanism
READ = {
    "document": "bodies joints drivers linear_drivers forces load_cases sweep_config mounting_angle "
    "schema_version name note notes meta source description",
    "body": "attachment_points coupler_points mount_points point_masses mass cg_local izz_cg Izz_cg name note color render",
}


def read(file: str, data: Any) -> list[Drawing]:
    """Read every mechanism of a document."""
    return [_Reader(file, entry).drawing() for entry in (data if isinstance(data, list) else [data])]


class _Reader:
    """Reads one mechanism; errors name the place."""

    def __init__(self, file: str, data: Any) -> None:
        self.file = file
        if not isinstance(data, dict) or not all(isinstance(data.get(k), dict) for k in ("bodies", "joints")):
            raise DataError(f"{file}: expected an object with `bodies` and `joints`, each by name")
        self.data = data
        self.d = Drawing(name=str(data.get("name", "")), angle="rad")
        # bodies that are fixed to others: name -> (body, turn, shift)
        self.fixed: dict[str, tuple[str, float, complex]] = {}

    def get(self, where: str, entry: Any, key: str) -> Any:
        """Return a value that must be there."""
        if not isinstance(entry, dict) or key not in entry:
            raise DataError(f"{self.file}: {where}: '{key}' is missing")
        return entry[key]

    def named(self, entry: dict[str, Any], key: str, where: str = "") -> dict[str, Any]:
        """Return an object of named entries; empty where there is none."""
        value = {} if entry.get(key) is None else entry[key]
        if not isinstance(value, dict):
            raise damaged(self.file, f"{where}{key}", value, "an object by names")
        return value

    def pair(self, where: str, value: Any) -> Exact:
        """Return two coordinates."""
        try:
            x, y = value
            return place(x, y)
        except (TypeError, ValueError):
            raise damaged(self.file, where, value, "two finite numbers") from None

    def real(self, where: str, value: Any) -> float:
        """Return a finite number."""
        try:
            return float(exact(value))
        except ValueError:
            raise damaged(self.file, where, value, "a finite number") from None

    def drawing(self) -> Drawing:
        d, data = self.d, self.data
        self.points: dict[str, dict[str, Exact]] = {}
        for name, e in data["bodies"].items():
            self._body(name, e)
        if GROUND not in data["bodies"]:
            raise DataError(f"{self.file}: bodies: expected one called ground")
        joints = data["joints"]
        for name, e in joints.items():
            self.get(f"joint {name}", e, "type")
        for name, e in joints.items():
            if e.get("type") == "fixed":
                self._fix(name, e)
        revolutes = {k: self._ends(k, e) for k, e in joints.items() if e.get("type") == "revolute"}
        self._pin(revolutes)
        extent = d.size()
        d.posed = all(
            apart(self.points[i][p], self.points[j][q]) <= SAME * extent for i, p, j, q in revolutes.values()
        ) and not any(
            e.get("type") == "prismatic" and e.get("delta_theta_0", 0.0) != 0 for e in joints.values()
        )
        d.own_axes = not d.posed
        for name, e in joints.items():
            if e.get("type") == "prismatic":
                self._prism(name, e)
            elif e.get("type") not in ("revolute", "fixed", "revolute_driver"):
                d.leave(f"joint {name}", f"a joint of type {e.get('type')} has no equivalent")
        self._drives(joints)
        self._traced()
        for e in objects(self.file, "forces", data.get("forces")):
            self._force(e)
        if d.bodies[GROUND].mass > 0:
            d.bodies[GROUND] = Body(d.bodies[GROUND].points)
        for key in ("load_cases", "sweep_config"):
            if data.get(key):
                d.leave(key, "drivers are the inputs; a range is an option of the command")
        for key in sorted(data.keys() - set(READ["document"].split())):
            d.leave(key, "it is not read")
        if data.get("mounting_angle"):
            d.leave("mounting_angle", "it turns gravity: turn `gravity` in the file instead")
        return d

    def _body(self, name: str, e: Any) -> None:
        where = f"body {name}"
        held = self.get(where, e, "attachment_points")
        if not isinstance(held, dict):
            raise damaged(self.file, where, held, "attachment_points by name")
        for key in sorted(e.keys() - set(READ["body"].split())):
            self.d.leave(f"{where}, {key}", "it is not read")
        self.points[name] = {p: self.pair(f"{where}, point {p}", z) for p, z in held.items()}
        mass = self.real(f"{where}, mass", e.get("mass", 0.0))
        inertia = self.real(f"{where}, izz_cg", e.get("izz_cg", e.get("Izz_cg", 0.0)))
        center = self.pair(f"{where}, cg_local", e.get("cg_local", (0.0, 0.0)))
        if mass < 0 or inertia < 0:
            raise damaged(self.file, where, f"{mass:g}, {inertia:g}", "a mass and an inertia of zero or more")
        loose = [(mass, center, inertia)]
        for extra in objects(self.file, f"{where}, point_masses", e.get("point_masses")):
            m = self.real(f"{where}, point_masses", self.get(where, extra, "mass"))
            loose.append((m, self.pair(f"{where}, point_masses", self.get(where, extra, "local_pos")), 0.0))
        body = self.d.body(name)
        body.mass, body.center, body.inertia = together(loose)

    def _ends(self, name: str, e: dict[str, Any]) -> tuple[str, str, str, str]:
        """Return (body, point, body, point) of a joint; where a body is fixed to another, that one's."""
        result = []
        for side in "ij":
            where = f"joint {name}"
            body = str(self.get(where, e, f"body_{side}"))
            point = str(self.get(where, e, f"point_{side}"))
            if body not in self.data["bodies"]:
                raise damaged(self.file, where, body, "one of the bodies")
            if point not in self.data["bodies"][body]["attachment_points"]:
                raise damaged(self.file, where, point, f"an attachment point of {body}")
            held, turn, shift = self.whole(body)
            if held != body:
                z = self._carried(self.points[body][point], turn, shift)
                point = f"{body}.{point}"
                self.points[held].setdefault(point, z)
            result += [held, point]
        return result[0], result[1], result[2], result[3]

    def whole(self, body: str) -> tuple[str, float, complex]:
        """Return the body that one is fixed to, the turn of its axes there and where their origin stands."""
        turn, shift = 0.0, 0j
        while body in self.fixed:
            body, more, by = self.fixed[body]
            shift = by + shift * complex(math.cos(more), math.sin(more))
            turn += more
        return body, turn, shift

    def named_body(self, where: str, e: dict[str, Any], key: str) -> tuple[str, float, complex]:
        """Return the body that an entry names, the turn of its axes and their origin; the body must be there."""
        result = self.whole(str(self.get(where, e, key)))
        if result[0] not in self.d.bodies:
            raise damaged(self.file, where, result[0], "one of the bodies")
        return result

    def held(self, where: str, e: dict[str, Any], key: str, point: str) -> tuple[str, Exact]:
        """Return the body that an entry names, and the place of its point there."""
        name, turn, shift = self.named_body(where, e, key)
        return name, self._carried(self.pair(where, self.get(where, e, point)), turn, shift)

    @staticmethod
    def _carried(z: complex, turn: float, shift: complex) -> Exact:
        if turn == 0 and shift == 0:
            return Exact(*coordinates(z))
        w = z * complex(math.cos(turn), math.sin(turn)) + shift
        return place(w.real, w.imag)

    def _fix(self, name: str, e: dict[str, Any]) -> None:
        """Make body j a part of body i: their points coincide, its angle is delta_theta_0 more."""
        i, p, j, q = self._ends(name, e)
        turn = self.real(f"joint {name}", e.get("delta_theta_0", 0.0))
        if i == j:
            return
        if j == GROUND:
            i, p, j, q, turn = j, q, i, p, -turn
        z, w = self.points[i][p], self.points[j][q]
        shift = z - w * complex(math.cos(turn), math.sin(turn))
        if turn == 0 and z == w:
            shift = 0j
        self.fixed[j] = (i, turn, shift)
        a, b = self.d.body(i), self.d.bodies.pop(j)
        a.mass, a.center, a.inertia = together(
            [(a.mass, a.center, a.inertia), (b.mass, self._carried(b.center, turn, shift), b.inertia)]
        )
        for point in self.points[j]:
            self.points[i][f"{j}.{point}"] = self._carried(self.points[j][point], turn, shift)

    def _pin(self, revolutes: dict[str, tuple[str, str, str, str]]) -> None:
        """Points that revolutes join are one pin, and so are those at the same place of one body."""
        joints: list[tuple[str, dict[str, complex]]] = [
            (p if p == q else name, {i: self.points[i][p], j: self.points[j][q]})
            for name, (i, p, j, q) in revolutes.items()
        ]
        for pin, ends in pins_of(joints, 0.0, lambda _, earlier: earlier):
            for body, z in sorted(ends.items()):
                self.d.body(body).points[pin] = z

    def _prism(self, name: str, e: dict[str, Any]) -> None:
        d, where = self.d, f"joint {name}"
        i, p, j, q = self._ends(name, e)
        axis = self.pair(where, self.get(where, e, "axis_local_i"))
        if axis == 0:
            raise damaged(self.file, where, axis, "a direction")
        turn_i, turn_j = (self.whole(str(e[f"body_{side}"]))[1] for side in "ij")
        angle = cmath.phase(axis) + turn_i
        delta = self.real(where, e.get("delta_theta_0", 0.0)) + turn_i - turn_j
        point = d.point_at(j, self.points[j][q], name)
        d.add(Guide(point, j, i, self.points[i][p], angle, delta - angle))

    def _drives(self, joints: dict[str, dict[str, Any]]) -> None:
        d = self.d
        rows = [(f"driver {k}", e, False) for k, e in self.named(self.data, "drivers").items()]
        rows += [(f"joint {k}", e, True) for k, e in joints.items() if e.get("type") == "revolute_driver"]
        for where, e, marker in rows:
            i, j = (self.named_body(where, e, f"body_{side}") for side in "ij")
            offset = i[1] - j[1]
            link, on, sign = (j[0], i[0], 1.0) if j[0] != GROUND else (i[0], j[0], -1.0)
            if any({x.link, x.on} == {link, on} for x in d.drives):
                continue
            if e.get("type") == "constant_speed":
                at = self.real(where, e.get("theta_0", 0.0)) + offset
                if d.posed and at != 0:
                    d.notes.append(f"{where}: theta_0 is left out: the drawn pose is at angle 0")
                    at = 0.0
                d.drives.append(
                    Drive(link, on, at=sign * at, speed=sign * self.real(where, e.get("omega", 0.0)))
                )
            else:
                why = "the file does not store it" if marker else "expressions are not evaluated"
                d.leave(f"law of motion of {where}", why)
                d.drives.append(Drive(link, on, at=0.0 if d.posed else sign * offset))
        for e in objects(self.file, "linear_drivers", self.data.get("linear_drivers")):
            self._linear(e)

    def _linear(self, e: dict[str, Any]) -> None:
        """Add the driven distance of two points as a cylinder."""
        d = self.d
        where = f"linear driver {e.get('id', '')}".strip()
        ends = []
        for k in "ab":
            body, z = self.held(where, e, f"body_{k}", f"point_{k}")
            ends.append((d.point_at(body, z, f"{where} {k}"), z))
        (p, a), (q, b) = ends
        speed = f"{self.real(where, e.get('velocity', 0.0))!r} m/s"
        names = f"{where} barrel", f"{where} rod"
        if d.posed:
            d.drives.append(Drive(slider=d.cylinder(names, (p, q), (a, b)), speed=speed))
            return
        # both along their own x-axes, the slide is the length
        d.body(names[0]).points[p] = place(0, 0)
        d.body(names[1]).points[q] = place(0, 0)
        slider = d.add(Guide(q, names[1], names[0], place(0, 0), 0.0, 0.0))
        at = self.real(where, e.get("length_0", 0.0))
        d.drives.append(Drive(slider=slider, at=at, speed=speed))

    def _traced(self) -> None:
        """Keep the points of interest: coupler and mount points, and attachment points that no joint uses."""
        for name, e in self.data["bodies"].items():
            body, turn, shift = self.whole(name)
            for key in ("attachment_points", "coupler_points", "mount_points"):
                for point, value in self.named(e, key, f"body {name}, ").items():
                    z = self._carried(self.pair(f"body {name}, {point}", value), turn, shift)
                    held = self.d.bodies[body].points
                    if body != GROUND and z not in held.values():
                        held[self.d.fresh(point)] = z

    def _force(self, e: dict[str, Any]) -> None:
        d, kind = self.d, str(e.get("type", ""))
        where = f"force {kind}"
        constant = self.named(e, "modulation", f"{where}, ").get("modulation_type", "Constant") == "Constant"
        if kind == "Gravity":
            g = self.pair(where, self.get(where, e, "g_vector"))
            d.gravity = g.real, g.imag
            return
        if kind not in LOADS or (kind.startswith("External") and not constant):
            d.leave(f"force of type {kind or '?'}", "it has no equivalent")
            return
        table, ends, keys = LOADS[kind]
        values: dict[str, object] = {k: self.real(f"{where}, {k}", e.get(k, 0.0)) for k in keys}
        held: list[tuple[str, complex | None]] = [
            (self.named_body(where, e, key)[0], None) if point is None else self.held(where, e, key, point)
            for key, point in ends
        ]
        if kind == "TorsionSpring":
            i, j = (self.whole(e[key])[1] for key, _ in ends)
            values["free_angle"] = self.real(where, e.get("free_angle", 0.0)) + i - j
        if kind == "ExternalForce":
            force = self.pair(where, self.get(where, e, "force"))
            values["force"] = [force.real, force.imag]
        d.loads.append(Load(table, held, values))
