"""The keys of a mechanism's TOML file, each said once: the reader refuses others, the schema tells an editor."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


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
