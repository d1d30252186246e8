"""A drawing as the TOML text of a mechanism: shortest numbers that are read back as the same."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from fractions import Fraction

from cli.imports.drawn import GROUND, Body, Drawing, Drive, Place, unused

ORIGIN: Place = (Fraction(0), Fraction(0))


def text(d: Drawing, source: str) -> str:
    """Return the TOML text; `source` says where the mechanism is from."""
    d = _named(d)
    lines = [f"name = {_value(d.name)}", f"source = {_value(source)}"]
    if d.gravity is not None:
        lines.append(f"gravity = {_value(list(d.gravity))}")
    lines += ["", "[units]", f"length = {_value(d.length)}", f"angle = {_value(d.angle)}", "", "[ground]"]
    lines += [f"{_key(p)} = {_place(z)}" for p, z in d.bodies[GROUND].points.items()]
    origins = {name: _origin(d, name, body) for name, body in d.bodies.items()}
    for name, body in d.bodies.items():
        if name != GROUND:
            lines += _link(name, body, origins[name])
    for s in d.slides:
        lines += ["", "[[sliders]]" if s.turned is not None else "[[slots]]"]
        rows: dict[str, object] = {"point": s.point, "link": s.link, "on": s.on}
        lines += [f"{k} = {_value(v)}" for k, v in rows.items()]
        lines += [f"through = {_place(s.through, origins[s.on])}", f"angle = {_value(s.angle)}"]
        lines += [] if s.turned is None else [f"turned = {_value(s.turned)}"]
    for m in d.meshes:
        lines += ["", "[[gears]]", f"links = {_value([m.a, m.b])}", f"ratio = {_value(m.ratio)}"]
        lines += [] if m.arm == GROUND else [f"arm = {_value(m.arm)}"]
    for e in d.drives:
        lines += ["", "[input]" if len(d.drives) == 1 else "[[input]]", *_input(e)]
    ats = [_value(e.at) for e in d.drives]
    lines += ["", "[guess]", f"at = {ats[0] if len(ats) == 1 else '[' + ', '.join(ats) + ']'}"]
    lines += [f"{_key(n)} = {_value(b.turn)}" for n, b in d.bodies.items() if n != GROUND]
    for load in d.loads:
        lines += ["", f"[[{load.table}]]"]
        lines += _ends(d, load.table, [(n, at, origins[n]) for n, at in load.ends])
        lines += [f"{k} = {_value(v)}" for k, v in load.values.items()]
    return "\n".join(lines) + "\n"


def _origin(d: Drawing, name: str, body: Body) -> Place:
    """Return where a link's axes begin: at the first of its joints."""
    if d.own_axes or name == GROUND:
        return ORIGIN
    joints = set(d.pins()) | {s.point for s in d.slides}
    first = next((z for p, z in body.points.items() if p in joints), None)
    return first or next(iter(body.points.values()), ORIGIN)


def _link(name: str, body: Body, origin: Place) -> Iterable[str]:
    points = ", ".join(f"{_key(p)} = {_place(z, origin)}" for p, z in body.points.items())
    yield from ("", f"[links.{_key(name)}]", f"points = {{ {points} }}")
    if body.mass > 0:
        yield f"mass = {_value(body.mass)}"
        yield f"center = {_place(body.center, origin)}"
        yield f"inertia = {_value(body.inertia)}"


def _input(e: Drive) -> Iterable[str]:
    if e.slide is not None:
        yield from (f"slider = {_value(e.slide.point)}", f"position = {_value(e.at)}")
    else:
        yield f"link = {_value(e.link)}"
        if e.on != GROUND:
            yield f"on = {_value(e.on)}"
        yield f"angle = {_value(e.at)}"
    if e.speed is not None:
        yield f"speed = {_value(e.speed)}"


def _ends(d: Drawing, table: str, ends: list[tuple[str, Place | None, Place]]) -> Iterable[str]:
    """Name the bodies that a load holds on to; a spring's ends are points that `_named` has made."""
    if table == "torsion_springs":
        yield f"links = {_value([name for name, _, _ in ends])}"
    elif table == "springs":
        yield f"between = {_value([f'{name}.{_point_at(d, name, at)}' for name, at, _ in ends])}"
    else:
        (name, at, origin) = ends[0]
        yield f"link = {_value(name)}"
        if at is not None:
            yield f"point = {_place(at, origin)}"


def _point_at(d: Drawing, name: str, at: Place | None) -> str:
    return next(p for p, z in d.bodies[name].points.items() if z == at)


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
    d.bodies = {links[n]: _with_points(b, points) for n, b in d.bodies.items()}
    for s in d.slides:
        s.link, s.on, s.point = links[s.link], links[s.on], points[s.point]
    for m in d.meshes:
        m.a, m.b, m.arm = links[m.a], links[m.b], links[m.arm]
    for e in d.drives:
        e.link, e.on = None if e.link is None else links[e.link], links[e.on]
    for load in d.loads:
        load.ends = [(links[name], at) for name, at in load.ends]
    return d


def _with_points(body: Body, names: Mapping[str, str]) -> Body:
    body.points = {names[p]: z for p, z in body.points.items()}
    return body


def _place(z: Place, origin: Place = ORIGIN) -> str:
    return f"[{_value(float(z[0] - origin[0]))}, {_value(float(z[1] - origin[1]))}]"


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else _value(name)


def _value(value: object) -> str:
    """Return a value as TOML has it.

    >>> _value(-0.0), _value(1e22), _value(["a", 0.1]), _value('x"')
    ('0.0', '1e+22', '["a", 0.1]', '"x\\\\""')
    """
    if isinstance(value, float):
        return repr(value + 0.0)
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_value, value))}]"
    # a JSON string is a basic string of TOML, but for the one control character that JSON leaves as it is
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
