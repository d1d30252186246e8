"""As many inputs as a drawn mechanism has degrees of freedom: those that follow from the others go, free joints come in."""

from __future__ import annotations

import cmath
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from cli.imports.drawn import GROUND, Drawing, Drive, Place, Slide

Rows = NDArray[np.float64]
# below this share a row of speeds follows from others: a file's decimals are fewer than ours
FOLLOWS = 1e-6


class _Speeds:
    """Speeds of a drawing's bodies: (vx, vy, ω) of each, as columns; lengths as shares of its size."""

    def __init__(self, d: Drawing) -> None:
        self.d = d
        self.size = d.size() or 1.0
        self.columns = {name: 3 * k for k, name in enumerate(d.bodies)}

    def at(self, body: str, z: Place) -> complex:
        """Where a body's place stands, a share of the size."""
        b = self.d.bodies[body]
        x, y = (complex(float(p[0]), float(p[1])) for p in (b.at, z))
        return (x + y * cmath.rect(1.0, b.turn)) / self.size

    def moves(self, body: str, at: complex) -> Rows:
        """The speed of a body's point, (2, columns)."""
        rows = np.zeros((2, 3 * len(self.columns)))
        k = self.columns[body]
        rows[:, k : k + 2] = np.eye(2)
        rows[:, k + 2] = -at.imag, at.real
        return rows

    def turns(self, body: str) -> Rows:
        """A body's angular velocity, (columns,)."""
        row = np.zeros(3 * len(self.columns))
        row[self.columns[body] + 2] = 1.0
        return row

    def along(self, s: Slide, turned: float) -> Rows:
        """The speed of a slide's point against its line, in the line's direction or across it."""
        way = cmath.rect(1.0, self.d.bodies[s.on].turn + s.angle + turned)
        at = self.at(s.link, self.d.bodies[s.link].points[s.point])
        relative = self.moves(s.link, at) - self.moves(s.on, at)
        return np.asarray(np.array([way.real, way.imag]) @ relative)

    def joints(self) -> Rows:
        """What the ground, pins, slides and gears hold at zero."""
        d = self.d
        rows = [np.eye(3, 3 * len(self.columns))]
        for point, (first, *others) in d.pins().items():
            at = self.at(first, d.bodies[first].points[point])
            rows += [self.moves(first, at) - self.moves(other, at) for other in others]
        for s in d.slides:
            rows.append(self.along(s, np.pi / 2)[None])
            if s.turned is not None:
                rows.append((self.turns(s.link) - self.turns(s.on))[None])
        for m in d.meshes:
            a, b, arm = (self.turns(name) for name in (m.a, m.b, m.arm))
            rows.append((b - arm - m.ratio * (a - arm))[None])
        return np.concatenate(rows)

    def driven(self, e: Drive) -> Rows:
        """What an input drives."""
        if e.slide is not None:
            return self.along(e.slide, 0.0)
        return self.turns(str(e.link)) - self.turns(e.on)


def fit(d: Drawing) -> None:
    """Leave out inputs that follow from those before them, and take free joints as inputs in addition."""
    speeds = _Speeds(d)
    _, s, vt = np.linalg.svd(speeds.joints())
    free = vt[int(np.sum(s > FOLLOWS * s[0])) :]
    kept: list[Drive] = []
    spare = [e for e in d.spare if all(e.moves != other.moves for other in d.drives)]
    # where the file drives too many, those at the ground stay
    for e in (*sorted(d.drives, key=lambda e: GROUND not in e.pair), *spare):
        row = free @ speeds.driven(e)
        if np.linalg.norm(row) > FOLLOWS:
            # what the input holds is free no more
            kept.append(e)
            free = np.linalg.svd(row[None])[2][1:] @ free
    _note(
        d, (e for e in d.drives if e not in kept), "left out as an input: its motion follows from the others'"
    )
    _note(d, (e for e in kept if e not in d.drives), "taken as an input in addition: it was free to move")
    d.drives = [e for e in (*d.drives, *spare) if e in kept]


def _note(d: Drawing, drives: Iterable[Drive], what: str) -> None:
    d.notes += [f"{e.pair[0]} against {e.pair[1]}: {what}" for e in drives]
