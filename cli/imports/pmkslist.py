"""PMKS+ links of before 2022: `?j=` joints `&l=` links `&f=` forces `&s=` settings, a row each, with commas.

joint: id,x,y,links,R|P,ground,angle,[friction,]input     link: id,[R|P,]mass,inertia,xcom,ycom,joints,forces,…
force: id,link,x1,y1,x2,y2,global,outward,size             settings: rpm,clockwise,gravity,unit
"""

from __future__ import annotations

import math
import re
from urllib.parse import unquote

from cli.imports.drawn import GROUND, Drawing, Drive, Load, Place, Slide, exact, finite, place
from cli.imports.words import damaged
from dalembert.errors import DataError

LINK = re.compile(r"(^|[?&/])j=.*&l=", re.DOTALL)


def read(file: str, text: str) -> list[Drawing]:
    """Read one link."""
    return [_List(file, unquote(text.strip())).drawing()]


class _List:
    """Takes one link apart; complaints name the row."""

    def __init__(self, file: str, text: str) -> None:
        self.file, self.d = file, Drawing()
        found = re.split(r"(?:^|[?&/])(j|l|f|pp|tp|s)=", text)
        self.rows = {
            key: [row.strip().rstrip(",").split(",") for row in part.splitlines() if row.strip()]
            for key, part in zip(found[1::2], found[2::2], strict=True)
        }
        if not self.rows.get("j") or not self.rows.get("l"):
            raise DataError(f"{file}: expected joints after j= and links after &l=; is the link cut off?")

    def _yes(self, what: str, word: str) -> bool:
        if word.lower() not in ("t", "f", "true", "false"):
            raise damaged(self.file, what, word, "t or f")
        return word.lower().startswith("t")

    def _at(self, what: str, x: str, y: str) -> Place:
        return place(finite(self.file, what, x), finite(self.file, what, y))

    def drawing(self) -> Drawing:
        d, file = self.d, self.file
        rpm, clockwise, gravity, length = (*next(iter(self.rows.get("s", [])), []), "", "", "", "")[:4]
        d.length = length if length in ("cm", "m", "in", "mm") else "m"
        if d.length != length:
            d.notes.append("the link names no unit of length: given in m")
        d.gravity = (0.0, -9.81) if gravity and self._yes("s=", gravity) else None
        joints: dict[str, list[str]] = {}
        at: dict[str, Place] = {}
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
                    d.notes.append(f"joint {id_}: the angle {angle:g} of its guide is taken in rad")
                # a piston keeps its direction; a link that has the joint itself turns on it
                body = next((name for name in held if name in self.pistons), held[0])
                prism = body in self.pistons
                slides[id_] = d.guide(id_, body, GROUND, at[id_], math.degrees(angle), prism)
        self._drive(joints, slides, rpm, bool(clockwise) and self._yes("s=", clockwise))
        for row in self.rows.get("f", []):
            self._force(row)
        return d

    def _links(self, joints: dict[str, list[str]], at: dict[str, Place]) -> None:
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
        unset = bool(real) and all(finite(self.file, "mass", v) == 1 for pair in real for v in pair)
        if unset:
            self.d.leave("masses and inertias", "every link has 1 and 1, the defaults nobody set")
        for name, rest in rows:
            body, what = self.d.body(name), f"link {name}"
            for joint in filter(None, rest[4].split("|")):
                if joint not in joints:
                    raise damaged(self.file, what, joint, f"one of the joints {', '.join(joints)}")
                body.points[joint] = at[joint]
            if not unset and name not in self.pistons:
                body.mass, inertia = (finite(self.file, what, v) for v in rest[:2])
                body.inertia = inertia * self.d.metres**2
                body.center = self._at(what, rest[2], rest[3])
                if body.mass < 0 or body.inertia < 0:
                    raise damaged(self.file, what, rest[:2], "a mass and an inertia of zero or more")

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
        (x1, y1, x2, y2), size = (
            [finite(self.file, what, v) for v in row[2:6]],
            finite(self.file, what, row[8]),
        )
        span = math.hypot(x2 - x1, y2 - y1)
        if span == 0:
            self.d.leave(what, "its two ends coincide: it has no direction")
            return
        size = size if self._yes(what, row[7]) else -size
        values: dict[str, object] = {"force": [f"{size * v / span!r} N" for v in (x2 - x1, y2 - y1)]}
        if not self._yes(what, row[6]):
            values["frame"] = "link"
        self.d.loads.append(Load("forces", [(row[1], (exact(x1), exact(y1)))], values))
