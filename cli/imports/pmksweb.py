"""PMKS+ links: one string of parts separated by dots; numbers to the base 64, decimals in thousandths.

flags . decimals . integers . enums . joint . joint … . . link … . . force … . active object and checksum
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from itertools import takewhile
from urllib.parse import unquote

from cli.imports.drawn import GROUND, Drawing, Drive, Load, Place, Slide, direction, exact, place
from cli.imports.words import damaged
from dalembert.errors import DataError

DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_-"
STRING = re.compile(r"[\w-]*\.[\w,-]*\.[\w,-]+\.\w*\.[^\s?]*")
LENGTHS = ("in", "cm", "m")
FORCES = ("lbf", "N")


@dataclass
class Joint:
    """One joint as the string has it."""

    name: str
    at: Place
    angle: float
    slot: list[str]
    """The link that carries its slot, and the two joints on whose line that lies."""
    prismatic: bool
    driven: bool
    grounded: bool
    welded: bool


def read(file: str, text: str) -> list[Drawing]:
    """Read every link or string, one a line."""
    lines = [unquote(line).strip() for line in text.splitlines()]
    found = [(i, line.rpartition("?")[2]) for i, line in enumerate(lines, 1) if line]
    strings = [(i, s) for i, s in found if STRING.fullmatch(s)]
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
    """Takes one string apart; complaints name the part."""

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
        unset = bool(real) and all(self._decimal("mass", t[k]) == 1 for t in real for k in (2, 3))
        if unset:
            self.d.leave("masses and inertias", "every link has 1 and 1, the defaults nobody set")
        else:
            self.d.notes.append(
                f"masses are taken as kg, inertias as kg·{self.d.length}2: the string names no unit"
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
            self.d.leave(f"slider {j.name}", "the string says of no guide")
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
        x1, y1, x2, y2, size = (self._decimal(what, t) for t in tokens[3:8])
        if tokens[1] not in self.d.bodies:
            self.d.leave(f"force {tokens[2]}", f"its link {tokens[1]} is none of the string's")
            return
        span = math.hypot(x2 - x1, y2 - y1)
        if span == 0:
            self.d.leave(f"force {tokens[2]}", "its two ends coincide: it has no direction")
            return
        size = size if outward else -size
        force = [f"{size * (b - a) / span!r} {unit}" for a, b in ((x1, x2), (y1, y2))]
        values: dict[str, object] = {"force": force} | ({"frame": "link"} if local else {})
        self.d.loads.append(Load("forces", [(tokens[1], (exact(x1), exact(y1)))], values))
