"""A drawing as the TOML text of a mechanism: shortest numbers that are read back as the same."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from fractions import Fraction

from cli.imports.drawn import GROUND, Body, Drawing, Drive, Load, Place
from cli.read.names import unused

ORIGIN: Place = (Fraction(0), Fraction(0))
Table = dict[str, object]


def text(d: Drawing, source: str) -> str:
    """Return the TOML text; `source` says where the mechanism is from."""
    lines: list[str] = []
    for head, table in _tables(_named(d), source):
        lines += ["", head] if head else []
        lines += [f"{_key(k)} = {_value(v)}" for k, v in table.items()]
    return "\n".join(lines) + "\n"


def _tables(d: Drawing, source: str) -> Iterable[tuple[str, Table]]:
    """Yield the tables of the file with their heads."""
    gravity: Table = {} if d.gravity is None else {"gravity": d.gravity}
    yield "", {"name": d.name, "source": source} | gravity
    yield "[units]", {"length": d.length, "angle": d.angle}
    yield "[ground]", _places(d.bodies[GROUND].points)
    origins = {name: _origin(d, name, body) for name, body in d.bodies.items()}
    links = {name: body for name, body in d.bodies.items() if name != GROUND}
    for name, b in links.items():
        table: Table = {"points": _places(b.points, origins[name])}
        if b.mass > 0:
            table |= {"mass": b.mass, "center": _place(b.center, origins[name]), "inertia": b.inertia}
        yield f"[links.{_key(name)}]", table
    for s in d.slides:
        table = {"point": s.point, "link": s.link, "on": s.on}
        table |= {"through": _place(s.through, origins[s.on]), "angle": s.angle}
        yield ("[[slots]]", table) if s.turned is None else ("[[sliders]]", table | {"turned": s.turned})
    for m in d.meshes:
        arm: Table = {} if m.arm == GROUND else {"arm": m.arm}
        yield "[[gears]]", {"links": [m.a, m.b], "ratio": m.ratio} | arm
    for e in d.drives:
        yield "[input]" if len(d.drives) == 1 else "[[input]]", _input(e)
    ats = [e.at for e in d.drives]
    at: Table = {"at": ats[0] if len(ats) == 1 else ats}
    yield "[guess]", at | {n: b.turn for n, b in links.items()}
    for load in d.loads:
        yield f"[[{load.table}]]", _ends(d, load, origins) | load.values


def _origin(d: Drawing, name: str, body: Body) -> Place:
    """Return where a link's axes begin: at the first of its joints."""
    if d.own_axes or name == GROUND:
        return ORIGIN
    joints = set(d.pins()) | {s.point for s in d.slides}
    first = next((z for p, z in body.points.items() if p in joints), None)
    return first or next(iter(body.points.values()), ORIGIN)


def _input(e: Drive) -> Table:
    if e.slide is not None:
        table: Table = {"slider": e.slide.point, "position": e.at}
    else:
        table = {"link": e.link} | ({} if e.on == GROUND else {"on": e.on}) | {"angle": e.at}
    return table if e.speed is None else table | {"speed": e.speed}


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
    return {"link": name} | ({} if at is None else {"point": _place(at, origins[name])})


def _named(d: Drawing) -> Drawing:
    """Give names that a description takes: no dots, no link `ground` or `at`, no point called as a link is."""
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


def _place(z: Place, origin: Place = ORIGIN) -> object:
    return [float(z[0] - origin[0]), float(z[1] - origin[1])]


def _places(points: dict[str, Place], origin: Place = ORIGIN) -> Table:
    return {p: _place(z, origin) for p, z in points.items()}


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else _value(name)


def _value(value: object) -> str:
    """Return a value as TOML has it.

    >>> _value(-0.0), _value(1e22), _value(["a", 0.1]), _value('x"'), _value({"A": [1.0]})
    ('0.0', '1e+22', '["a", 0.1]', '"x\\\\""', '{ A = [1.0] }')
    """
    if isinstance(value, float):
        return repr(value + 0.0)
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_value, value))}]"
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{_key(k)} = {_value(v)}' for k, v in value.items())} }}"
    # a JSON string is a basic string of TOML, but for the one control character that JSON leaves as it is
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
