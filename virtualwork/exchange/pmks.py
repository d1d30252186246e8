"""PMKS text: one line a joint (`link [link …] TYPE x y [angle] [flags]`), the same in a link, and its JSON.

M. I. Campbell, Planar Mechanism Kinematic Simulator.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Any
from urllib.parse import unquote

from dalembert.documents.values import damaged, finite
from dalembert.errors import DataError, quote
from virtualwork.describe.parts import Gear, Rack
from virtualwork.exchange.drawn import GROUND, Body, Drawing, Drive, centers
from virtualwork.exchange.places import Exact, apart, direction, place

TYPES = ("R", "P", "RP", "G")
GROUNDS = {"gnd", "grnd", "grond", "gound", "groud", "0"}
SPEED = 10.0  # rpm, where the file says none
EXPECTED = "link [link …] R|P|RP|G x y [angle] [flags]"


@dataclass
class Joint:
    """One line of the text."""

    where: str
    links: list[str]
    kind: str
    at: Exact
    angle: float
    driven: bool = False


def read(file: str, text: Any) -> list[Drawing]:
    """Read every mechanism of a PMKS text, of several links, one a line, or of a JSON document."""
    if not isinstance(text, str):
        return [_json(file, entry) for entry in (text if isinstance(text, list) else [text])]
    lines = [unquote(line) if "mech=" in line else line for line in text.splitlines()]
    starts = [i for i, line in enumerate(lines) if "mech=" in line]
    if len(starts) <= 1 and not any(line.partition("mech=")[2].strip() for line in lines):
        return [_one(file, "\n".join(lines), 1)]
    result = []
    titles: list[str] = []
    for i, line in enumerate(lines):
        if i in starts:
            d = _one(file, line, i + 1)
            d.name = titles[-1].strip().rstrip(":") if titles else ""
            titles = []
            result.append(d)
        elif line.strip():
            titles.append(line)
    return result


def _one(file: str, text: str, first: int) -> Drawing:
    head, _, body = text.rpartition("mech=")
    d = Drawing()
    speed = SPEED
    settings = re.search(r"(?:^|[?&])set=([^&\n]*)", head, re.MULTILINE)
    for word in re.split(r"[|,\s]+", settings[1] if settings else ""):
        if word[:1] == "s":
            speed = finite(file, "set", word[1:])
        elif word:
            d.leave(f"setting {word}", "it is the other program's step or tolerance")
    if re.search(r"(?:^|[?&])ts=[^&\s]", head, re.MULTILINE):
        d.leave("ts", "a target shape is no part of the mechanism")
    body, *more = body.split("&")
    for rest in more:
        d.leave(rest[:40], "it follows the joints")
    line = first + head.count("\n")
    joints = []
    for i, row in enumerate(body.split("\n")):
        for k, sentence in enumerate(row.split("|"), 1):
            if sentence.strip(" ,\t\r"):
                where = f"line {line + i}" + (f", joint {k}" if "|" in row else "")
                joints.append(_joint(file, where, sentence))
    return _drawing(file, d, joints, speed)


def _link(word: str) -> str:
    low = word.lower()
    return GROUND if low in GROUNDS or low.startswith("ground") else word


def _joint(file: str, where: str, sentence: str) -> Joint:
    words = [w for w in re.split(r"[,\s]+", sentence) if w]
    kinds = [i for i, w in enumerate(words) if w.upper() in TYPES]
    if not kinds or kinds[-1] == 0:
        raise damaged(file, where, sentence.strip(), EXPECTED)
    i = kinds[-1]
    rest = words[i + 1 :]
    numbers: list[float] = []
    while rest and len(numbers) < 3 and re.fullmatch(r"[-+]?[\d.].*", rest[0]):
        numbers.append(finite(file, where, rest.pop(0)))
    if len(numbers) < 2:
        raise damaged(file, where, sentence.strip(), EXPECTED)
    flags = rest[0] if len(rest) == 1 and len(rest[0]) > 1 else [w[:1] for w in rest]
    driven = len(flags) > 3 and flags[3].lower() in ("t", "+")
    links = list(dict.fromkeys(_link(w) for w in words[:i]))
    angle = numbers[2] if len(numbers) > 2 else 0.0
    return Joint(where, links, words[i].upper(), place(*numbers[:2]), angle, driven)


def _drawing(file: str, d: Drawing, joints: list[Joint], speed: float) -> Drawing:
    """Make bodies of the joints."""
    if not joints:
        raise DataError(f"{file}: no joints: expected lines such as 'ground, input, R, 0, 0'")
    if not any(GROUND in j.links for j in joints):
        raise DataError(f"{file}: no joint of the ground: expected a link called ground")
    driven = [j for j in joints if j.driven and len(j.links) > 1 and j.kind in ("R", "P")]
    for j in joints:
        if j.driven and j not in driven[:1]:
            why = "another joint is the input" if driven else f"a joint of type {j.kind} cannot be driven"
            d.leave(f"input flag of {j.where}", why)
    driven = driven or [j for j in joints if len(j.links) > 1 and j.kind in ("R", "P")]
    sliders: dict[int, str] = {}
    for k, j in enumerate(joints, 1):
        name = f"J{k}"
        if len(j.links) == 1 or j.kind == "R":
            for link in j.links:
                d.body(link).points[name] = j.at
        elif j.kind == "P":
            a, b = j.links[:2]
            # the block is the link that moves
            link, on = (a, b) if b == GROUND else (b, a)
            sliders[k] = d.guide(name, link, on, j.at, j.angle)
            _more(d, j, k)
        elif j.kind == "RP":
            _slot(d, j, name, joints)
            _more(d, j, k)
    for j in joints:
        if j.kind == "G" and len(j.links) > 1:
            mesh(d, j.links[0], j.links[1], j.at, f"gear teeth of {j.where}")
    if driven:
        j = driven[0]
        if j.kind == "P":
            d.drives.append(Drive(slider=sliders[joints.index(j) + 1]))
            d.leave(f"speed {speed:g} rpm", f"the input {j.where} is a slide")
        else:
            a, b = j.links[:2]
            link, on = (a, b) if b == GROUND else (b, a)
            d.drives.append(Drive(link, on, speed=f"{speed!r} rpm"))
    d.notes.append("the file has no unit of length: numbers are taken as metres")
    return d


def _more(d: Drawing, j: Joint, k: int) -> None:
    """Of three or more links the first two slide, the rest are pins on the second."""
    if len(j.links) > 2:
        for link in j.links[1:]:
            d.body(link).points[f"J{k}"] = j.at


def _slot(d: Drawing, j: Joint, name: str, joints: list[Joint]) -> None:
    on, link = j.links[:2]
    others = [o for o in joints if o is not j and on in o.links and len(o.links) > 1]
    if link == GROUND and len(others) == 1:
        # a slider-crank drawn the other way about: the slot of a rod whose line misses its only pin is the ground's
        along = direction(j.at, others[0].at) - j.angle
        if apart(j.at, others[0].at) > 0 and abs((along + 90) % 180 - 90) > 0.5:
            on, link = link, on
            d.notes.append(f"{j.where}: the slot is the ground's: its line misses the other joint of {link}")
    d.guide(name, link, on, j.at, j.angle, prism=False)


def mesh(d: Drawing, a: str, b: str, at: Exact, what: str) -> None:
    """Two gears that touch at a pitch point: their centres are pins that one arm holds (R. Willis, 1841).

    Where one of them slides on a body on which the other one turns, it is a rack.
    """
    if _rack(d, a, b, at) or _rack(d, b, a, at):
        return
    best: tuple[float, Gear] | None = None
    for p, q, arm in centers(d, a, b):
        zp, zq = d.bodies[a].points[p], d.bodies[b].points[q]
        between = apart(zp, zq)
        if between == 0:
            continue
        way, to_a, to_b = zq - zp, at - zp, at - zq
        ux, uy = way.real / between, way.imag / between
        off = abs(to_a.real * uy - to_a.imag * ux) / between
        ra, rb = (to.real * ux + to.imag * uy for to in (to_a, to_b))
        if ra * rb != 0 and (best is None or off < best[0]):
            best = off, Gear((a, b), ra / rb, arm)
    if best is None:
        d.leave(f"{what} ({a}, {b})", "no link holds a pin of both, and none slides where the other turns")
        return
    if best[0] > 1e-6:
        d.notes.append(
            f"{what}: its pitch point is off the line of the centres: the nearest point of the line is used"
        )
    d.gears.append(best[1])


def _rack(d: Drawing, wheel: str, rack: str, at: Exact) -> bool:
    """Add a rack that slides on a body on which a wheel turns; False where it is none."""
    pins = d.pins()
    for slider, s in d.guides.items():
        if s.turned is None or s.link != rack:
            continue
        for pin in d.bodies.get(wheel, Body()).points:
            if pin in pins and s.on in pins[pin]:
                z = d.bodies[wheel].points[pin]
                along = math.radians(s.angle)
                to = at - z
                # the pitch point lies on the right of the way that the slide takes as the wheel turns
                radius = to.real * math.sin(along) - to.imag * math.cos(along)
                if radius != 0:
                    d.racks.append(Rack(wheel, slider, radius))
                    return True
    return False


def _json(file: str, data: Any) -> Drawing:
    """Read the program's JSON: `Joints` with X, Y, Angle, TypeOfJoint, Links."""
    joints = []
    try:
        for k, entry in enumerate(data["Joints"], 1):
            entry = {str(key).lower(): value for key, value in entry.items()}
            where = f"joint {k}"
            links = entry.get("links", entry.get("linknames", ""))
            names = re.split(r"[,\s]+", links) if isinstance(links, str) else [str(n) for n in links]
            kind = str(entry.get("typeofjoint", entry.get("jointtype", "R"))).upper()
            if kind not in TYPES:
                raise damaged(file, where, kind, "R, P, RP or G")
            x, y, angle = (finite(file, where, str(entry.get(key) or 0.0)) for key in ("x", "y", "angle"))
            names = list(dict.fromkeys(_link(n) for n in names if n))
            if not names:
                raise damaged(file, where, quote(str(links)), "the names of its links")
            joints.append(Joint(where, names, kind, place(x, y), angle))
    except (TypeError, AttributeError, KeyError):
        raise damaged(
            file, "Joints", "something else", "a list of joints with X, Y, TypeOfJoint, Links"
        ) from None
    return _drawing(file, Drawing(), joints, SPEED)
