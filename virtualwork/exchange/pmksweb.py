"""PMKS+ links.

Before 2022: `?j=` joints `&l=` links `&f=` forces `&s=` settings, a row each, with commas.
joint: id,x,y,links,R|P,ground,angle,[friction,]input     link: id,[R|P,]mass,inertia,xcom,ycom,joints,forces,…
force: id,link,x1,y1,x2,y2,global,outward,size             settings: rpm,clockwise,gravity,unit

Today: one string of parts separated by dots; numbers to the base 64, decimals in thousandths.
flags . decimals . integers . enums . joint . joint … . . link … . . force … . active object and checksum
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from itertools import takewhile
from urllib.parse import unquote

from dalembert.documents.values import damaged, finite
from dalembert.errors import DataError
from virtualwork.exchange.drawn import GROUND, Drawing, Drive, Load
from virtualwork.exchange.places import Exact, direction, place

# a link of before 2022
LISTED = re.compile(r"(^|[?&/])j=.*&l=", re.DOTALL)
DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_-"
STRING = re.compile(r"[\w-]*\.[\w,-]*\.[\w,-]+\.\w*\.[^\s?]*")
LENGTHS = ("in", "cm", "m")
FORCES = ("lbf", "N")


@dataclass
class Joint:
    """A joint; `angle` of its guide in rad."""

    name: str
    at: Exact
    angle: float
    prismatic: bool
    driven: bool
    grounded: bool
    welded: bool = False
    slot: list[str] = field(default_factory=list)
    """The link that carries its slot, and the two joints on whose line that lies."""
    pinned: bool = False
    """Whether it pins its links to each other in addition to what it slides."""


@dataclass
class Link:
    """A link with its joints; a `piston` keeps its direction in a guide."""

    name: str
    joints: list[str]
    piston: bool
    mass: float
    inertia: float
    center: Exact


@dataclass
class Force:
    """A force of this size at the first of two places (x, y, x, y) in the direction of the second."""

    name: str
    link: str
    ends: list[float]
    size: float
    local: bool


@dataclass
class Linkage:
    """What a link of either time says."""

    file: str
    d: Drawing = field(default_factory=Drawing)
    speed: float = 0.0
    force_unit: str = "N"
    joints: dict[str, Joint] = field(default_factory=dict)
    links: list[Link] = field(default_factory=list)
    forces: list[Force] = field(default_factory=list)

    def drawing(self) -> Drawing:
        """Return the drawing; errors name the part."""
        d = self.d
        self._bodies()
        for id_, j in self.joints.items():
            if j.grounded and not j.prismatic:
                d.bodies[GROUND].points[id_] = j.at
        self.sliders: dict[str, str] = {}
        self.held = {
            id_: [link.name for link in self.links if id_ in link.joints and link.name in d.bodies]
            for id_ in self.joints
        }
        for id_, j in self.joints.items():
            if j.welded:
                d.weld([*self.held[id_], GROUND] if j.grounded and not j.prismatic else self.held[id_])
            if j.prismatic:
                self._slide(id_, j)
        self._drive()
        for force in self.forces:
            self._force(force)
        return d

    def _bodies(self) -> None:
        real = [value for link in self.links if not link.piston for value in (link.mass, link.inertia)]
        unset = bool(real) and all(value == 1 for value in real)
        if unset:
            self.d.leave("masses and inertias", "every link has 1 and 1, the program's defaults")
        elif any(link.mass for link in self.links):
            self.d.notes.append(
                f"masses are read as kg, inertias as kg·{self.d.length}2: the link has no unit of them"
            )
        for link in self.links:
            body, what = self.d.body(link.name), f"link {link.name}"
            for id_ in link.joints:
                if id_ not in self.joints:
                    raise damaged(self.file, what, id_, f"one of the joints {', '.join(self.joints)}")
                if not self.joints[id_].prismatic or self.joints[id_].pinned:
                    body.points[id_] = self.joints[id_].at
            if link.mass < 0 or link.inertia < 0:
                values = f"{link.mass:g}, {link.inertia:g}"
                raise damaged(self.file, what, values, "a mass and an inertia of zero or more")
            if not unset and link.mass > 0:
                body.mass, body.inertia = link.mass, link.inertia * self.d.metres**2
                body.center = self.joints[link.joints[0]].at if link.piston and link.joints else link.center

    def _slide(self, id_: str, j: Joint) -> None:
        if j.slot and j.slot[0] in self.d.bodies and {*j.slot[1:]} <= self.joints.keys():
            on, a, b = j.slot
            angle = direction(self.joints[a].at, self.joints[b].at)
        elif j.grounded:
            on, angle = GROUND, math.degrees(j.angle)
        else:
            self.d.leave(f"slider {j.name}", "the link has no guide for it")
            return
        pistons = {link.name for link in self.links if link.piston}
        held = sorted((name for name in self.held[id_] if name != on), key=lambda name: name not in pistons)
        if held:
            # a link that a joint pins too turns on it, but for a piston
            prism = not j.pinned or held[0] in pistons
            self.sliders[id_] = self.d.guide(id_, held[0], on, j.at, angle, prism)

    def _drive(self) -> None:
        for id_, j in self.joints.items():
            if not j.driven:
                continue
            if self.d.drives:
                self.d.leave(f"input {j.name}", "another joint is the input")
            elif id_ in self.sliders:
                self.d.drives.append(Drive(slider=self.sliders[id_]))
                self.d.leave(f"speed {self.speed:g} rpm", f"the input {j.name} is a slide")
            elif self.held[id_] and not j.prismatic:
                first, *others = self.held[id_]
                link, on = (first, GROUND) if j.grounded or not others else (others[0], first)
                self.d.drives.append(Drive(link, on, speed=f"{self.speed!r} rpm"))
            else:
                self.d.leave(f"input {j.name}", "it drives no link")

    def _force(self, force: Force) -> None:
        d, what = self.d, f"force {force.name}"
        x1, y1, x2, y2 = force.ends
        span = math.hypot(x2 - x1, y2 - y1)
        if force.link not in d.bodies:
            d.leave(what, f"its link {force.link} is none of the mechanism's")
        elif span == 0:
            d.leave(what, "its two ends coincide: it has no direction")
        else:
            shares = [f"{force.size * way / span!r} {self.force_unit}" for way in (x2 - x1, y2 - y1)]
            values: dict[str, object] = {"force": shares} | ({"frame": "link"} if force.local else {})
            d.loads.append(Load("forces", [(force.link, place(x1, y1))], values))


def read(file: str, text: str) -> list[Drawing]:
    """Read every link or string, one a line; of a link of before 2022 the only one."""
    if LISTED.search(text):
        return [_listed(file, unquote(text.strip())).drawing()]
    lines = [unquote(line).strip() for line in text.splitlines()]
    queries = [(i, line.rpartition("?")[2]) for i, line in enumerate(lines, 1) if line]
    strings = [(i, s) for i, s in queries if STRING.fullmatch(s)]
    if not strings:
        expected = "parts separated by dots: flags.decimals.integers.enums.joints…"
        raise damaged(file, "line 1", text.strip()[:40], expected)
    return [
        _String(file if len(strings) == 1 else f"{file}: line {i}", s).linkage.drawing() for i, s in strings
    ]


# --- before 2022 --------------------------------------------------------------------------------------------------
def _listed(file: str, text: str) -> Linkage:
    """Read one link of before 2022; errors name the row."""
    parts = re.split(r"(?:^|[?&/])(j|l|f|pp|tp|s)=", text)
    rows = {
        key: [row.strip().rstrip(",").split(",") for row in part.splitlines() if row.strip()]
        for key, part in zip(parts[1::2], parts[2::2], strict=True)
    }
    if not rows.get("j") or not rows.get("l"):
        raise DataError(f"{file}: expected joints after j= and links after &l=; is the link cut off?")

    def yes(what: str, word: str) -> bool:
        if word.lower() not in ("t", "f", "true", "false"):
            raise damaged(file, what, word, "t or f")
        return word.lower().startswith("t")

    def at(what: str, x: str, y: str) -> Exact:
        return place(finite(file, what, x), finite(file, what, y))

    result = Linkage(file)
    d = result.d
    rpm, clockwise, gravity, length = (*next(iter(rows.get("s", [])), []), "", "", "", "")[:4]
    d.length = length if length in ("cm", "m", "in", "mm") else "m"
    if d.length != length:
        d.notes.append("the link has no unit of length: numbers are taken as metres")
    d.gravity = (0.0, -9.81) if gravity and yes("s=", gravity) else None
    speed = finite(file, "s=", rpm) if rpm else 0.0
    result.speed = -abs(speed) if clockwise and yes("s=", clockwise) else speed
    for row in rows["j"]:
        what = f"joint {row[0]}"
        if len(row) < 8 or row[4] not in ("R", "P"):
            raise damaged(file, what, ",".join(row), "id,x,y,links,R or P,ground,angle,input")
        slides, grounded = row[4] == "P", yes(what, row[5])
        angle = 0.0 if row[6] in ("", "Null", "null") else finite(file, what, row[6])
        if angle and slides:
            d.notes.append(f"{what}: the angle {angle:g} of its guide is read in rad")
        place_ = at(what, row[1], row[2])
        result.joints[row[0]] = Joint(
            row[0], place_, angle, slides, yes(what, row[-1]), grounded, pinned=True
        )
    for row in rows["l"]:
        kind, rest = (row[1], row[2:]) if row[1:2] in (["R"], ["P"]) else ("R", row[1:])
        what = f"link {row[0]}"
        if len(rest) < 5:
            raise damaged(file, what, ",".join(row), "id,mass,inertia,x,y,joints")
        mass, inertia = (finite(file, what, value) for value in rest[:2])
        ids = list(filter(None, rest[4].split("|")))
        result.links.append(Link(row[0], ids, kind == "P", mass, inertia, at(what, rest[2], rest[3])))
    for row in rows.get("f", []):
        what = f"force {row[0]}"
        if len(row) != 9:
            d.leave(what, "expected id,link,x1,y1,x2,y2,global,outward,size")
            continue
        *ends, size = (finite(file, what, row[k]) for k in (2, 3, 4, 5, 8))
        sign = 1.0 if yes(what, row[7]) else -1.0
        result.forces.append(Force(row[0], row[1], ends, sign * size, not yes(what, row[6])))
    return result


# --- today --------------------------------------------------------------------------------------------------------
def number(digits: str) -> int:
    """Return a whole number to the base 64; a leading 0 is the minus sign.

    >>> number("Fe"), number("0Pk"), number("0")
    (1000, -1646, 0)
    """
    if not digits or not set(digits) <= set(DIGITS) or len(digits) > 12:
        raise ValueError(f"found '{digits[:20]}', expected a number to the base 64")
    value = 0
    for c in digits:
        value = 64 * value + DIGITS.index(c)
    return -value if digits[0] == "0" else value


def flags(digits: str, count: int) -> list[bool]:
    """Return truth values: one digit for each six of them, the lowest bit first."""
    bits = [bool(DIGITS.index(c) >> k & 1) for c in digits if c in DIGITS for k in range(6)]
    return (bits + [False] * count)[:count]


class _String:
    """Reads one string; errors name the part."""

    def __init__(self, file: str, text: str) -> None:
        self.file, self.linkage = file, Linkage(file)
        parts = text.split(".")
        settings, rest = parts[:4], parts[4:]
        # the last part has the active object and the checksum, no list
        if len(rest) < 4 or rest.count("") < 2 or "," in rest[-1]:
            raise DataError(
                f"{file}: part {len(parts)}: the string ends there: expected joints, links, forces, each list "
                "closed by an empty part; is it cut off?"
            )
        if text[-1] != DIGITS[(len(text) - 1) % 62]:
            self.linkage.d.notes.append(
                "the checksum does not fit the string's length: look whether it is complete"
            )
        self._settings(settings)
        lists = iter(rest if rest.count("") > 2 else [*rest[:-1], ""])
        joints, links, forces = (list(takewhile(bool, lists)) for _ in range(3))
        if not joints:
            raise DataError(f"{file}: no joints in the string")
        for k, part in enumerate(joints, 1):
            self._joint(f"joint {k}", part)
        self._links(links)
        for k, part in enumerate(forces, 1):
            self._force(f"force {k}", part)

    def _decimal(self, what: str, digits: str) -> float:
        try:
            return number(digits) / 1000
        except ValueError as error:
            raise DataError(f"{self.file}: {what}: {error}") from None

    def _at(self, what: str, x: str, y: str) -> Exact:
        return place(self._decimal(what, x), self._decimal(what, y))

    def _tokens(self, what: str, part: str, least: int) -> list[str]:
        tokens = part.split(",")
        if len(tokens) < least or not tokens[0]:
            raise damaged(self.file, what, part, f"at least {least} values with commas between")
        return tokens

    def _settings(self, parts: list[str]) -> None:
        result = self.linkage
        enums = [DIGITS.find(c) for c in parts[3]]
        result.d.length = LENGTHS[enums[0]] if enums and 0 <= enums[0] < len(LENGTHS) else "m"
        result.force_unit = FORCES[enums[2]] if len(enums) > 2 and 0 <= enums[2] < len(FORCES) else "N"
        clockwise, gravity = flags(parts[0], 2)
        result.d.gravity = (0.0, -9.81) if gravity else None
        try:
            speed = number(parts[2].split(",")[0])
        except ValueError as error:
            raise DataError(f"{self.file}: part 3 (integers): {error}") from None
        result.speed = -abs(speed) if clockwise else speed

    def _joint(self, what: str, part: str) -> None:
        if re.match(r"[\w-]", part) is None:
            raise damaged(self.file, what, part, "a flag digit, then id,name,x,y,angle")
        prismatic, driven, grounded, welded = flags(part[0], 4)
        id_, name, x, y, angle, *more = self._tokens(what, part[1:], 5)
        # of newer strings
        slot = more[:3] if len(more) > 2 and more[0] else []
        place_, turned = self._at(what, x, y), self._decimal(what, angle)
        self.linkage.joints[id_] = Joint(
            name or id_, place_, turned, prismatic, driven, grounded, welded, slot
        )

    def _links(self, parts: list[str]) -> None:
        rows, inside = [], set()
        for k, part in enumerate(parts, 1):
            tokens = self._tokens(f"link {k}", part[2:], 8)
            outer, _, inner = ",".join(tokens[7:]).partition(",,")
            rows.append((f"link {k}", part[:2], tokens, [id_ for id_ in outer.split(",") if id_]))
            inside.update(inner.split(","))
        for what, kind, tokens, ids in rows:
            # one that is a part of another stands in that
            if kind[:1] == "N" and tokens[0] in inside:
                continue
            mass, inertia = (self._decimal(what, token) for token in tokens[2:4])
            center = self._at(what, *tokens[4:6])
            self.linkage.links.append(Link(tokens[0], ids, kind[1:] != "R", mass, inertia, center))

    def _force(self, what: str, part: str) -> None:
        local, outward = flags(part[:1], 2)
        tokens = self._tokens(what, part[1:], 8)
        *ends, size = (self._decimal(what, token) for token in tokens[3:8])
        sign = 1.0 if outward else -1.0
        self.linkage.forces.append(Force(tokens[2], tokens[1], ends, sign * size, local))
