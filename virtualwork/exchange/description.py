"""The description of a drawing: its TOML text, read again, assembled and compared with the drawn pose."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import chain
from typing import Any

import numpy as np

from dalembert.documents.values import exact
from virtualwork.describe import MechanismError
from virtualwork.describe.parts import Guess, Input, Link
from virtualwork.describe.text import AsWritten, Table, document, written
from virtualwork.exchange.drawn import GROUND, Body, Drawing, Load, unused
from virtualwork.exchange.places import ORIGIN, Exact, coordinates
from virtualwork.mechanism import Mechanism
from virtualwork.motion import Motion


def text(d: Drawing, source: str, every_point: bool = False) -> str:
    """Return the TOML text; `source` says where the mechanism is from, `every_point` puts all joints into the guess."""
    d = _named(d)
    origins = {name: _origin(d, name, body) for name, body in d.bodies.items()}
    tree = document(parts_of(d, origins, every_point), AsWritten())
    for drive, table in zip(d.drives, tree.get("input", []), strict=True):
        # a speed keeps the unit of the other program
        table |= {} if drive.speed is None else {"speed": drive.speed}
    for load in d.loads:
        tree.setdefault(load.table, []).append(_ends(d, load, origins) | load.values)
    return written(tree | {"source": source, "units": {"length": d.length, "angle": d.angle}})


def parts_of(d: Drawing, origins: Mapping[str, complex], every_point: bool = False) -> dict[str, Any]:
    """Return the parts of a description, their numbers in the units of the file; `origins`: where the axes of bodies begin."""
    links = {name: body for name, body in d.bodies.items() if name != GROUND}
    guides = d.guides.values() if every_point else [d.guides[r.slider] for r in d.racks]
    pins = d.pins() if every_point else {}
    return {
        "name": d.name,
        "gravity": complex(*(d.gravity or (0.0, 0.0))),
        "ground": _places(d.bodies[GROUND].points),
        "links": {name: _link(b, origins[name]) for name, b in links.items()},
        "guides": [
            replace(s, through=complex(s.through - origins[s.on]))  # type: ignore[operator]  # never a name
            for s in d.guides.values()
        ],
        "gears": d.gears,
        "racks": [replace(r, slider=d.guides[r.slider].point) for r in d.racks],
        "inputs": [
            Input(e.link, e.on, None if e.slider is None else d.guides[e.slider].point, e.at)
            for e in d.drives
        ],
        "guess": Guess(
            [e.at for e in d.drives],
            {name: b.turn for name, b in links.items()},
            {point: _stands(d, names[0], point) for point, names in pins.items()}
            | {s.point: _stands(d, s.link, s.point) for s in guides},
        ),
    }


def _stands(d: Drawing, name: str, point: str) -> complex:
    """Return where a point of a body stands in the pose."""
    body = d.bodies[name]
    return complex(body.world(body.points[point]))


def _link(b: Body, origin: complex) -> Link:
    points = _places(b.points, origin)
    return (
        Link(points, b.mass, complex(b.center - origin), b.inertia)
        if b.mass > 0 or b.inertia > 0
        else Link(points)
    )


def _origin(d: Drawing, name: str, body: Body) -> complex:
    """Return where a link's axes begin: at the first of its joints."""
    if d.own_axes or name == GROUND:
        return ORIGIN
    joints = set(d.pins()) | {s.point for s in d.guides.values()}
    first = next((z for p, z in body.points.items() if p in joints), None)
    return next(iter(body.points.values()), ORIGIN) if first is None else first


def _ends(d: Drawing, load: Load, origins: dict[str, complex]) -> Table:
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
    z = at - origins[name]
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
            d.notes.append(f"the input {' against '.join(d.pair(e))} has the speed 0: left out")
    for body in d.bodies.values():
        for p in body.points:
            if p not in points:
                points[p] = unused(p.replace(".", "_").strip() or "P", {*points.values(), *links.values()})
        body.points = {points[p]: z for p, z in body.points.items()}
    d.bodies = {links[n]: b for n, b in d.bodies.items()}
    d.rename(links.__getitem__)
    d.guides = {k: replace(s, point=points[s.point]) for k, s in d.guides.items()}
    return d


def _own_points(d: Drawing) -> None:
    """Give each further guide of a point a point of its own, as a guide is called as its point is.

    It lies on the guide's line away from the pin. A pin in two slots has a shoe in the second.
    """
    guided: set[str] = set()
    for k, s in d.guides.items():
        if s.point in guided and not d.own_axes:
            z, shared = d.bodies[s.link].points[s.point], s.point
            if s.turned is None:
                s = replace(s, link=unused(f"{shared} shoe", d.bodies), turned=-s.angle)
                d.body(s.link).points[shared] = z
            (x, y), way, far = coordinates(z), math.radians(s.angle), d.size()
            at = Exact(x + exact(far * math.cos(way)), y + exact(far * math.sin(way)))
            d.guides[k] = s = replace(s, point=d.fresh(f"{shared} on {s.on}"), through=at)
            d.bodies[s.link].points[s.point] = at
        guided.add(s.point)


def _places(points: dict[str, complex], origin: complex = ORIGIN) -> dict[str, complex]:
    return {p: complex(z - origin) for p, z in points.items()}


# inputs that are tried where the file has none, degrees
TRIED = tuple(range(0, 360, 15))
# how far from its drawn place a point may stand, of the drawing's size: rounding, magnified near change points
NEAR = 1e-9
# a little way of an input: rad, or of the mechanism's size
LITTLE = 1e-3


def described(d: Drawing, source: str) -> str:
    """Return the TOML text of a drawing, and note on the drawing what does not hold, or why it is refused."""
    if not d.posed:
        _seek(d, source)
    made = text(d, source)
    try:
        m = Mechanism.from_toml_text(made)
        off, point = _gap(m, d)
        if off > NEAR * m.size:
            # from the angles alone Newton's method may close the loops in another pose nearby
            again = text(d, source, every_point=True)
            closer = Mechanism.from_toml_text(again)
            if _gap(closer, d)[0] <= NEAR * m.size:
                made, m, off = again, closer, 0.0
        warnings = m.assembly.warnings
        if not _motion(m, d).assembled.all():
            d.notes.append("it cannot be assembled as drawn")
            return made
        d.notes += warnings
        # a little way to one side of the drawn pose at least
        ways = [m.size * LITTLE if e.slider is not None else LITTLE for e in d.drives]
        if not _motion(m, d, *([side * way for way in ways] for side in (-1, 1))).assembled.any():
            d.notes.append(
                "its input cannot move from the drawn pose: a limit, or a pose where assemblies meet"
            )
        if off > NEAR * m.size:
            d.notes.append(
                f"{point} is {off:.3g} m away from its drawn place: the pose is singular, or nearly"
            )
    except (MechanismError, np.linalg.LinAlgError) as error:
        d.refused = str(error)
    return made


def _motion(m: Mechanism, d: Drawing, *ways: Sequence[float]) -> Motion:
    """Return the motion of poses that stand so far from the drawn one; of the drawn one itself where there is none."""
    at = np.array([e.at for e in d.drives])
    inputs = at + np.array(ways) if ways else at[None]
    return m.motion(inputs if len(at) > 1 else inputs[:, 0])


def _gap(m: Mechanism, d: Drawing) -> tuple[float, str]:
    """Return the largest distance of a point from its drawn place, m, and the point; infinite where it is not assembled."""
    if not d.posed:
        return 0.0, ""
    try:
        motion = _motion(m, d)
    except (MechanismError, np.linalg.LinAlgError):
        return math.inf, ""
    if not motion.assembled.all():
        return math.inf, ""
    result = (0.0, "")
    for name, body in d.bodies.items():
        for point, z in body.points.items() if name != GROUND else ():
            off = abs(complex(*motion.point(point).position[0]) - body.world(z) * d.metres)
            result = max(result, (off if off >= 0 else math.inf, point))
    return result


def _seek(d: Drawing, source: str) -> None:
    """Set the angles of bodies that no file places: the assembly nearest to all of them 0, at the input's own value.

    Where nothing closes there, the input is tried all around.
    """
    why = ""
    turns = chain(
        [0.0], (math.radians(t) for t in TRIED[1:]) if d.drives and d.drives[0].slider is None else ()
    )
    start = [e.at for e in d.drives]
    for turn in turns:
        for e, at in zip(d.drives, start, strict=True):
            e.at = at if turn == 0 else turn
        for e in d.drives:
            if e.link is not None and e.on == GROUND:
                d.bodies[e.link].turn = e.at
        try:
            m = Mechanism.from_toml_text(text(d, source))
            motion = _motion(m, d)
            if not motion.assembled.all() or m.assembly.warnings:
                continue
            for name, body in d.bodies.items():
                if name != GROUND:
                    angle = float(motion.link(name).angle[0])
                    body.turn = math.remainder(angle, 2 * math.pi)
        except (MechanismError, np.linalg.LinAlgError) as error:
            why = why or str(error)
            continue
        if turn:
            d.notes.append(f"no assembly at the input's own value: it begins at {math.degrees(turn):g} deg")
        d.notes.append(
            "the file does not say where its bodies stand: the assembly nearest to all angles 0 is used"
        )
        return
    for e, at in zip(d.drives, start, strict=True):
        e.at = at
    d.notes.append(f"no assembly found{': ' + why if why else ''}")
