"""A drawing as the parts of a description, and its TOML text: shortest numbers that are read back as the same."""

from __future__ import annotations

import math
from fractions import Fraction

from cli.imports.drawn import GROUND, Body, Drawing, Load, Place, exact
from cli.read.names import unused
from virtualwork.describe.parts import Gear, Guess, Guide, Input, Link
from virtualwork.describe.text import AsWritten, Table, document, written

ORIGIN: Place = (Fraction(0), Fraction(0))


def text(d: Drawing, source: str) -> str:
    """Return the TOML text; `source` says where the mechanism is from."""
    d = _named(d)
    origins = {name: _origin(d, name, body) for name, body in d.bodies.items()}
    tree = document(_parts(d, origins), AsWritten())
    for drive, table in zip(d.drives, tree.get("input", []), strict=True):
        # a speed keeps the unit of the other program
        table |= {} if drive.speed is None else {"speed": drive.speed}
    for load in d.loads:
        tree.setdefault(load.table, []).append(_ends(d, load, origins) | load.values)
    return written(tree | {"source": source, "units": {"length": d.length, "angle": d.angle}})


def _parts(d: Drawing, origins: dict[str, Place]) -> dict[str, object]:
    """Return the parts of a description, their numbers in the units of the file."""
    links = {name: body for name, body in d.bodies.items() if name != GROUND}
    return {
        "name": d.name,
        "gravity": complex(*(d.gravity or (0.0, 0.0))),
        "ground": _places(d.bodies[GROUND].points),
        "links": {name: _link(b, origins[name]) for name, b in links.items()},
        "guides": [
            Guide(s.point, s.link, s.on, _place(s.through, origins[s.on]), s.angle, s.turned)
            for s in d.slides
        ],
        "gears": [Gear((m.a, m.b), m.ratio, m.arm) for m in d.meshes],
        "inputs": [
            Input(e.link, e.on, value=e.at) if e.slide is None else Input(slider=e.slide.point, value=e.at)
            for e in d.drives
        ],
        "guess": Guess([e.at for e in d.drives], {name: b.turn for name, b in links.items()}),
    }


def _link(b: Body, origin: Place) -> Link:
    points = _places(b.points, origin)
    return Link(points, b.mass, _place(b.center, origin), b.inertia) if b.mass > 0 else Link(points)


def _origin(d: Drawing, name: str, body: Body) -> Place:
    """Return where a link's axes begin: at the first of its joints."""
    if d.own_axes or name == GROUND:
        return ORIGIN
    joints = set(d.pins()) | {s.point for s in d.slides}
    first = next((z for p, z in body.points.items() if p in joints), None)
    return first or next(iter(body.points.values()), ORIGIN)


def _ends(d: Drawing, load: Load, origins: dict[str, Place]) -> Table:
    """Name the bodies that a load holds on to; a spring's ends are points that `_named` has made."""
    if load.table == "torsion_springs":
        return {"links": [name for name, _ in load.ends]}
    if load.table == "springs":
        ends = [
            (name, next(p for p, z in d.bodies[name].points.items() if z == at)) for name, at in load.ends
        ]
        return {"between": [".".join(end) for end in ends]}
    ((name, at),) = load.ends
    if at is None:
        return {"link": name}
    z = _place(at, origins[name])
    return {"link": name, "point": [z.real, z.imag]}


def _named(d: Drawing) -> Drawing:
    """Give names that a description takes: no dots, no link `ground` or `at`, no point called as a link is."""
    _own_points(d)
    links = {GROUND: GROUND}
    for name in d.bodies:
        if name != GROUND:
            links[name] = unused(name.replace(".", "_").strip() or "link", {*links.values(), "at"})
    points: dict[str, str] = {}
    for load in d.loads:
        if load.table == "springs":
            for k, (name, at) in enumerate(load.ends):
                held = d.bodies[name].points
                if at is not None and at not in held.values():
                    held[d.fresh(f"S{d.loads.index(load) + 1}{'ab'[k]}")] = at
    for e in d.drives:
        if e.speed is not None and float(str(e.speed).split()[0]) == 0:
            e.speed = None
            d.notes.append(f"the input {' against '.join(e.pair)} has the speed 0: it has no speed here")
    for body in d.bodies.values():
        for p in body.points:
            if p not in points:
                points[p] = unused(p.replace(".", "_").strip() or "P", {*points.values(), *links.values()})
        body.points = {points[p]: z for p, z in body.points.items()}
    d.bodies = {links[n]: b for n, b in d.bodies.items()}
    d.rename(links.__getitem__)
    for s in d.slides:
        s.point = points[s.point]
    return d


def _own_points(d: Drawing) -> None:
    """Give each further guide of a point a point of its own, as a guide is called as its point is.

    It lies on the guide's line away from the pin. A pin in two slots has a shoe in the second.
    """
    guided: set[str] = set()
    for s in d.slides:
        if s.point in guided and not d.own_axes:
            z, shared = d.bodies[s.link].points[s.point], s.point
            if s.turned is None:
                s.link, s.turned = unused(f"{shared} shoe", set(d.bodies)), -s.angle
                d.body(s.link).points[shared] = z
            way, far = math.radians(s.angle), d.size()
            s.through = z[0] + exact(far * math.cos(way)), z[1] + exact(far * math.sin(way))
            s.point = d.fresh(f"{shared} on {s.on}")
            d.bodies[s.link].points[s.point] = s.through
        guided.add(s.point)


def _place(z: Place, origin: Place = ORIGIN) -> complex:
    return complex(float(z[0] - origin[0]), float(z[1] - origin[1]))


def _places(points: dict[str, Place], origin: Place = ORIGIN) -> dict[str, complex]:
    return {p: _place(z, origin) for p, z in points.items()}
