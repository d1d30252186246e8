"""The mechanisms of a drawing: what is rigid is one body, what nothing holds or drives is left out."""

from __future__ import annotations

from dataclasses import replace

from cli.formats.drawn import GROUND, SAME, Body, Drawing, Drive, Groups, apart, together


def merge(d: Drawing, keep: str, gone: str) -> None:
    """Make two bodies one; both stand at the same angle."""
    if gone == GROUND:
        keep, gone = gone, keep
    a, b = d.bodies[keep], d.bodies.pop(gone)
    if keep != GROUND:
        a.mass, a.center, a.inertia = together([(x.mass, x.center, x.inertia) for x in (a, b)])
    for point, at in b.points.items():
        a.points.setdefault(point, at)

    d.rename(lambda name: keep if name == gone else name)


def _rename_point(d: Drawing, old: str, new: str) -> None:
    for body in d.bodies.values():
        if old in body.points:
            at = body.points.pop(old)
            body.points.setdefault(new, at)
    for s in d.slides:
        s.point = new if s.point == old else s.point


def _one_pin_at_a_place(d: Drawing) -> bool:
    """Join two joints of one body at the same place into one pin; return whether there were two."""
    near = SAME * d.size()
    joints = set(d.pins()) | {s.point for s in d.slides}
    for body in d.bodies.values():
        held = [p for p in body.points if p in joints]
        for i, p in enumerate(held):
            for q in held[:i]:
                if apart(body.points[p], body.points[q]) <= near:
                    if body is d.bodies[GROUND]:
                        # two shafts in one place of the ground are not pinned to each other
                        continue
                    _rename_point(d, p, q)
                    return True
    return False


def _rigid_pair(d: Drawing) -> tuple[str, str] | None:
    """Return two bodies that share two pins at different places: they cannot move against each other."""
    near = SAME * d.size()
    met: dict[tuple[str, str], list[str]] = {}
    for point, names in d.pins().items():
        for i, b in enumerate(names):
            for a in names[:i]:
                met.setdefault((a, b), []).append(point)
    for (a, b), points in met.items():
        at = d.bodies[a].points
        if len(points) > 1 and any(apart(at[points[0]], at[p]) > near for p in points[1:]):
            return a, b
    return None


def settle(d: Drawing) -> list[Drawing]:
    """Return the mechanisms of a drawing: what is rigid is one body, what nothing drives or holds is left out."""
    for _ in range(len(d.welds)):
        a, b = d.welds.pop()
        if a != b and a in d.bodies and b in d.bodies:
            merge(d, a, b)
    while not d.own_axes:
        if _one_pin_at_a_place(d):
            continue
        pair = _rigid_pair(d)
        if pair is None:
            break
        merge(d, *pair)
        d.notes.append(f"{pair[1]} and {pair[0]} share two pins: they are one body")
    _drop_what_is_rigid(d)
    _drop_what_dangles(d)
    return _parts(d)


def _drop_what_is_rigid(d: Drawing) -> None:
    for s in [s for s in d.slides if s.link == s.on]:
        d.slides.remove(s)
        d.leave(f"slide at {s.point}", "both sides are one body")
    for m in [m for m in d.meshes if len({m.a, m.b, m.arm}) < 3]:
        d.meshes.remove(m)
        d.leave(f"gears {m.a}, {m.b}", "they are one body, or one is its own arm")
    slides = list(map(id, d.slides))
    for r in list(d.racks):
        # a wheel in a slot may roll along a rack
        held = (r.slide.on,) if r.slide.turned is None else (r.slide.on, r.slide.link)
        if id(r.slide) in slides and r.gear not in held:
            continue
        d.racks.remove(r)
        d.leave(f"rack at {r.slide.point}", "its wheel and its guide are one body")
    for e in list(d.drives):
        if (e.slide is not None and id(e.slide) not in slides) or (e.link is not None and e.link == e.on):
            d.drives.remove(e)
            d.leave(f"input {e.link or (e.slide and e.slide.point)}", "its two sides are one body")


def _drop_what_dangles(d: Drawing) -> None:
    """Leave out bodies that no joint holds, or one pin or slot alone that nothing drives."""
    while True:
        holds = dict.fromkeys(d.bodies, 0)
        for names, joints in d.ties():
            for name in names:
                holds[name] += joints
        gone = [name for name, n in holds.items() if n < 2 and name != GROUND]
        if not gone:
            return
        for name in gone:
            d.bodies.pop(name)
            alone = "one joint alone holds it, and nothing drives it"
            d.leave(name, alone if holds[name] else "it has no joint")
        d.slides = [s for s in d.slides if {s.link, s.on} <= d.bodies.keys()]
        d.racks = [r for r in d.racks if {r.gear, r.slide.link, r.slide.on} <= d.bodies.keys()]
        for m in [m for m in d.meshes if not {m.a, m.b, m.arm} <= d.bodies.keys()]:
            d.meshes.remove(m)
            d.notes.append(f"gears {m.a}, {m.b}: left out with their link")
        for load in [a for a in d.loads if not {name for name, _ in a.ends} <= d.bodies.keys()]:
            d.loads.remove(load)
            d.notes.append(f"load on {', '.join(name for name, _ in load.ends)}: left out with its link")


def _parts(d: Drawing) -> list[Drawing]:
    """Split into mechanisms that have nothing but the ground in common; what nothing drives is left out."""
    groups = Groups(d.bodies)
    for names in (*(names for names, _ in d.ties()), *(dict(load.ends) for load in d.loads)):
        groups.join(*(name for name in names if name != GROUND))
    parts = []
    for group in groups.all():
        drives = [e for e in d.drives if e.pair[0] in group]
        if drives:
            parts.append(_part(d, set(group), drives))
        elif group != [GROUND]:
            d.leave(", ".join(group), f"nothing drives {'it' if len(group) == 1 else 'them'}")
    return parts


def _part(d: Drawing, names: set[str], drives: list[Drive]) -> Drawing:
    bodies = {name: body for name, body in d.bodies.items() if name in names}
    slides = [s for s in d.slides if {s.link, s.on} & names]
    used = {p for body in bodies.values() for p in body.points} | {s.point for s in slides}
    ground = Body({p: at for p, at in d.bodies[GROUND].points.items() if p in used})
    return replace(
        d,
        bodies={GROUND: ground} | bodies,
        slides=slides,
        meshes=[m for m in d.meshes if m.a in names or m.b in names],
        racks=[r for r in d.racks if r.gear in names],
        drives=drives,
        spare=[e for e in d.spare if set(e.pair) <= {GROUND, *names}],
        loads=[load for load in d.loads if any(name in names for name, _ in load.ends)],
        notes=[],
    )
