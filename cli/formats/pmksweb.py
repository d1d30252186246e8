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
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import takewhile
from urllib.parse import unquote

from cli.formats.drawn import GROUND, Drawing, Drive, Exact, Load, Slide, damaged, direction, finite, place
from dalembert.errors import DataError

# a link of before 2022
LISTED = re.compile(r"(^|[?&/])j=.*&l=", re.DOTALL)


class _List:
    """Reads one link of before 2022; errors name the row."""

    def __init__(self, file: str, text: str) -> None:
        self.file, self.d = file, Drawing()
        parts = re.split(r"(?:^|[?&/])(j|l|f|pp|tp|s)=", text)
        self.rows = {
            key: [row.strip().rstrip(",").split(",") for row in part.splitlines() if row.strip()]
            for key, part in zip(parts[1::2], parts[2::2], strict=True)
        }
        if not self.rows.get("j") or not self.rows.get("l"):
            raise DataError(f"{file}: expected joints after j= and links after &l=; is the link cut off?")

    def _yes(self, what: str, word: str) -> bool:
        if word.lower() not in ("t", "f", "true", "false"):
            raise damaged(self.file, what, word, "t or f")
        return word.lower().startswith("t")

    def _at(self, what: str, x: str, y: str) -> Exact:
        return place(finite(self.file, what, x), finite(self.file, what, y))

    def drawing(self) -> Drawing:
        d, file = self.d, self.file
        rpm, clockwise, gravity, length = (*next(iter(self.rows.get("s", [])), []), "", "", "", "")[:4]
        d.length = length if length in ("cm", "m", "in", "mm") else "m"
        if d.length != length:
            d.notes.append("the link has no unit of length: numbers are taken as metres")
        d.gravity = (0.0, -9.81) if gravity and self._yes("s=", gravity) else None
        joints: dict[str, list[str]] = {}
        at: dict[str, Exact] = {}
        for row in self.rows["j"]:
            what = f"joint {row[0]}"
            if len(row) < 8 or row[4] not in ("R", "P"):
                raise damaged(file, what, ",".join(row), "id,x,y,links,R or P,ground,angle,input")
            joints[row[0]], at[row[0]] = row, self._at(what, row[1], row[2])
        self._links(joints, at)
        slides: dict[str, Slide] = {}
        for id_, row in joints.items():
            held = [name for name, body in d.bodies.items() if id_ in body.points and name != GROUND]
            if not self._yes(f"joint {id_}", row[5]):
                continue
            if row[4] == "R":
                d.bodies[GROUND].points[id_] = at[id_]
            elif held:
                angle = 0.0 if row[6] in ("", "Null", "null") else finite(file, f"joint {id_}", row[6])
                if angle:
                    d.notes.append(f"joint {id_}: the angle {angle:g} of its guide is read in rad")
                # a piston keeps its direction; a link that has the joint itself turns on it
                body = next((name for name in held if name in self.pistons), held[0])
                prism = body in self.pistons
                slides[id_] = d.guide(id_, body, GROUND, at[id_], math.degrees(angle), prism)
        self._drive(joints, slides, rpm, bool(clockwise) and self._yes("s=", clockwise))
        for row in self.rows.get("f", []):
            self._force(row)
        return d

    def _links(self, joints: dict[str, list[str]], at: dict[str, Exact]) -> None:
        rows = []
        self.pistons: set[str] = set()
        for row in self.rows["l"]:
            kind, rest = (row[1], row[2:]) if row[1:2] in (["R"], ["P"]) else ("R", row[1:])
            if kind == "P":
                self.pistons.add(row[0])
            if len(rest) < 5:
                raise damaged(self.file, f"link {row[0]}", ",".join(row), "id,mass,inertia,x,y,joints")
            rows.append((row[0], rest))
        real = [rest[:2] for name, rest in rows if name not in self.pistons]
        unset = _are_defaults(self.d, (finite(self.file, "mass", v) for pair in real for v in pair))
        for name, rest in rows:
            body, what = self.d.body(name), f"link {name}"
            for joint in filter(None, rest[4].split("|")):
                if joint not in joints:
                    raise damaged(self.file, what, joint, f"one of the joints {', '.join(joints)}")
                body.points[joint] = at[joint]
            if not unset and name not in self.pistons:
                mass, inertia = (finite(self.file, what, v) for v in rest[:2])
                center = self._at(what, rest[2], rest[3])
                if mass < 0 or inertia < 0:
                    raise damaged(self.file, what, rest[:2], "a mass and an inertia of zero or more")
                if mass > 0:
                    body.mass, body.center, body.inertia = mass, center, inertia * self.d.metres**2

    def _drive(
        self, joints: dict[str, list[str]], slides: dict[str, Slide], rpm: str, clockwise: bool
    ) -> None:
        speed = finite(self.file, "s=", rpm) if rpm else 0.0
        for id_, row in joints.items():
            if not self._yes(f"joint {id_}", row[-1]):
                continue
            held = [name for name, body in self.d.bodies.items() if id_ in body.points and name != GROUND]
            if self.d.drives:
                self.d.leave(f"input {id_}", "another joint is the input")
            elif id_ in slides:
                self.d.drives.append(Drive(slide=slides[id_]))
                self.d.leave(f"speed {rpm} rpm", f"the input {id_} is a slide")
            elif held:
                on = GROUND if id_ in self.d.bodies[GROUND].points or len(held) == 1 else held[1]
                turn = -abs(speed) if clockwise else speed
                self.d.drives.append(Drive(held[0], on, speed=f"{turn!r} rpm" if turn else None))

    def _force(self, row: list[str]) -> None:
        what = f"force {row[0]}"
        if len(row) != 9 or row[1] not in self.d.bodies:
            self.d.leave(what, "expected id,link,x1,y1,x2,y2,global,outward,size")
            return
        *ends, size = (finite(self.file, what, row[k]) for k in (2, 3, 4, 5, 8))
        sign = 1.0 if self._yes(what, row[7]) else -1.0
        _add_force(self.d, what, row[1], ends, (sign * size, "N"), local=not self._yes(what, row[6]))


DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_-"
STRING = re.compile(r"[\w-]*\.[\w,-]*\.[\w,-]+\.\w*\.[^\s?]*")
LENGTHS = ("in", "cm", "m")
FORCES = ("lbf", "N")


@dataclass
class Joint:
    """A joint of the string."""

    name: str
    at: Exact
    angle: float
    slot: list[str]
    """The link that carries its slot, and the two joints on whose line that lies."""
    prismatic: bool
    driven: bool
    grounded: bool
    welded: bool


def read(file: str, text: str) -> list[Drawing]:
    """Read every link or string, one a line; of a link of before 2022 the only one."""
    if LISTED.search(text):
        return [_List(file, unquote(text.strip())).drawing()]
    lines = [unquote(line).strip() for line in text.splitlines()]
    queries = [(i, line.rpartition("?")[2]) for i, line in enumerate(lines, 1) if line]
    strings = [(i, s) for i, s in queries if STRING.fullmatch(s)]
    if not strings:
        raise damaged(
            file,
            "line 1",
            text.strip()[:40],
            "parts separated by dots: flags.decimals.integers.enums.joints…",
        )
    return [_String(file if len(strings) == 1 else f"{file}: line {i}", s).drawing() for i, s in strings]


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
        self.file = file
        parts = text.split(".")
        head, rest = parts[:4], parts[4:]
        if len(rest) < 4 or rest.count("") < 2:
            raise DataError(
                f"{file}: part {len(parts)}: the string ends there: expected joints, links, forces, each list "
                "closed by an empty part; is it cut off?"
            )
        self.settings = head
        lists = iter(rest if rest.count("") > 2 else [*rest[:-1], ""])
        self.joint_parts, self.link_parts, self.force_parts = (list(takewhile(bool, lists)) for _ in range(3))
        self.slides: dict[str, Slide] = {}
        self.d = Drawing()
        whole = len(text) - 1
        if text[-1] != DIGITS[whole % 62]:
            self.d.notes.append("the checksum does not fit the string's length: look whether it is complete")

    def _decimal(self, what: str, digits: str) -> float:
        try:
            return number(digits) / 1000
        except ValueError as error:
            raise DataError(f"{self.file}: {what}: {error}") from None

    def _tokens(self, what: str, part: str, least: int) -> list[str]:
        tokens = part.split(",")
        if len(tokens) < least or not tokens[0]:
            raise damaged(self.file, what, part, f"at least {least} values with commas between")
        return tokens

    def drawing(self) -> Drawing:
        d = self.d
        enums = [DIGITS.find(c) for c in self.settings[3]]
        d.length = LENGTHS[enums[0]] if enums and 0 <= enums[0] < len(LENGTHS) else "m"
        force_unit = FORCES[enums[2]] if len(enums) > 2 and 0 <= enums[2] < len(FORCES) else "N"
        joints = dict(self._joint(k, part) for k, part in enumerate(self.joint_parts, 1))
        if not joints:
            raise DataError(f"{self.file}: no joints in the string")
        self._links(joints)
        for id_, j in joints.items():
            if j.grounded and not j.prismatic:
                d.bodies[GROUND].points[id_] = j.at
        for id_, j in joints.items():
            self._joins(id_, j, joints)
        clockwise, gravity = flags(self.settings[0], 2)
        if gravity:
            d.gravity = (0.0, -9.81)
        self._drive(joints, clockwise)
        for k, part in enumerate(self.force_parts, 1):
            self._force(k, part, force_unit)
        return d

    def _joint(self, k: int, part: str) -> tuple[str, Joint]:
        what = f"joint {k}"
        digits = re.match(r"[\w-]", part)
        if digits is None:
            raise damaged(self.file, what, part, "a flag digit, then id,name,x,y,angle")
        bits = flags(part[0], 6)
        id_, name, x, y, angle, *more = self._tokens(what, part[1:], 5)
        at = place(self._decimal(what, x), self._decimal(what, y))
        # of newer strings
        slot = more[:3] if len(more) > 2 and more[0] else []
        return id_, Joint(name or id_, at, self._decimal(what, angle), slot, *bits[:4])

    def _links(self, joints: dict[str, Joint]) -> None:
        rows: list[tuple[str, str, list[str], list[str], list[str]]] = []
        for k, part in enumerate(self.link_parts, 1):
            what = f"link {k}"
            tokens = self._tokens(what, part[2:], 8)
            outer, _, inner = ",".join(tokens[7:]).partition(",,")
            rows.append((what, part[:2], tokens, [i for i in outer.split(",") if i], inner.split(",")))
        inside = {s for *_, subsets in rows for s in subsets if s}
        real = [tokens for _, kind, tokens, *_ in rows if kind[1:] == "R"]
        unset = _are_defaults(self.d, (self._decimal("mass", t[k]) for t in real for k in (2, 3)))
        if not unset:
            self.d.notes.append(
                f"masses are read as kg, inertias as kg·{self.d.length}2: the string has no unit"
            )
        for what, kind, tokens, ids, _rest in rows:
            id_ = tokens[0]
            if kind[:1] == "N" and id_ in inside:
                continue
            body = self.d.body(id_)
            for joint in ids:
                if joint not in joints:
                    raise damaged(self.file, what, joint, f"one of the joints {', '.join(joints)}")
                if not joints[joint].prismatic:
                    body.points[joint] = joints[joint].at
            mass, inertia, x, y = (self._decimal(what, t) for t in tokens[2:6])
            if mass < 0 or inertia < 0:
                raise damaged(
                    self.file, what, f"{mass:g}, {inertia:g}", "a mass and an inertia of zero or more"
                )
            if not unset and mass > 0:
                body.mass = mass
                body.inertia = inertia * self.d.metres**2
                body.center = place(x, y) if kind[1:] == "R" or not ids else joints[ids[0]].at
        self.members = {
            joint: [
                tokens[0] for _, kind, tokens, ids, _ in rows if joint in ids and tokens[0] in self.d.bodies
            ]
            for joint in joints
        }

    def _joins(self, id_: str, j: Joint, joints: dict[str, Joint]) -> None:
        held = self.members[id_]
        if j.welded:
            self.d.weld([*held, GROUND] if j.grounded and not j.prismatic else held)
        if not j.prismatic:
            return
        if j.slot and j.slot[0] in self.d.bodies and {*j.slot[1:]} <= joints.keys():
            on, a, b = j.slot
            angle = direction(joints[a].at, joints[b].at)
        elif j.grounded:
            on, angle = GROUND, math.degrees(j.angle)
        else:
            self.d.leave(f"slider {j.name}", "the string has no guide for it")
            return
        for link in [name for name in held if name != on][:1]:
            self.slides[id_] = self.d.guide(id_, link, on, j.at, angle)

    def _drive(self, joints: dict[str, Joint], clockwise: bool) -> None:
        try:
            speed = number(self.settings[2].split(",")[0])
        except ValueError as error:
            raise DataError(f"{self.file}: part 3 (integers): {error}") from None
        for id_, j in joints.items():
            if not j.driven:
                continue
            if self.d.drives:
                self.d.leave(f"input {j.name}", "another joint is the input")
            elif j.prismatic and id_ in self.slides:
                self.d.drives.append(Drive(slide=self.slides[id_]))
                self.d.leave(f"speed {speed} rpm", f"the input {j.name} is a slide")
            elif self.members[id_] and not j.prismatic:
                first, *others = self.members[id_]
                link, on = (first, GROUND) if j.grounded or not others else (others[0], first)
                self.d.drives.append(Drive(link, on, speed=f"{-abs(speed) if clockwise else speed} rpm"))
            else:
                self.d.leave(f"input {j.name}", "it drives no link")

    def _force(self, k: int, part: str, unit: str) -> None:
        what = f"force {k}"
        local, outward = flags(part[:1], 2)
        tokens = self._tokens(what, part[1:], 8)
        *ends, size = (self._decimal(what, t) for t in tokens[3:8])
        if tokens[1] not in self.d.bodies:
            self.d.leave(f"force {tokens[2]}", f"its link {tokens[1]} is none of the string's")
            return
        sign = 1.0 if outward else -1.0
        _add_force(self.d, f"force {tokens[2]}", tokens[1], ends, (sign * size, unit), local)


def _add_force(
    d: Drawing, what: str, link: str, ends: Sequence[float], force: tuple[float, str], local: bool
) -> None:
    """Add a force, its size and its unit, at the first of two places (x, y, x, y) in the direction of the second."""
    x1, y1, x2, y2 = ends
    span = math.hypot(x2 - x1, y2 - y1)
    if span == 0:
        d.leave(what, "its two ends coincide: it has no direction")
        return
    size, unit = force
    values: dict[str, object] = {"force": [f"{size * way / span!r} {unit}" for way in (x2 - x1, y2 - y1)]}
    d.loads.append(Load("forces", [(link, place(x1, y1))], values | ({"frame": "link"} if local else {})))


def _are_defaults(d: Drawing, masses: Iterable[float]) -> bool:
    """Return whether all masses and inertias are 1, the program's defaults; they are left out then."""
    values = list(masses)
    if not values or any(value != 1 for value in values):
        return False
    d.leave("masses and inertias", "every link has 1 and 1, the program's defaults")
    return True
