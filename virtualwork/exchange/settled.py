"""The mechanisms of a drawing: rigid parts become one body, what nothing holds or drives is left out, the inputs are completed."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from virtualwork.describe import DescriptionError
from virtualwork.describe.description import Description
from virtualwork.exchange.description import parts_of
from virtualwork.exchange.drawn import GROUND, SAME, Body, Drawing, Drive, Groups, together
from virtualwork.exchange.places import ORIGIN, apart
from virtualwork.formulas.constraints import Constraints

# below this share a row of speeds follows from others: a file's decimals are fewer than ours
FOLLOWS = 1e-6
# of two coordinates: how far the difference of their floats may be from their own
FLOATS = 4e-16


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
    d.guides = {k: replace(s, point=new) if s.point == old else s for k, s in d.guides.items()}


def _one_pin_at_a_place(d: Drawing) -> bool:
    """Join two joints of one body at the same place into one pin; return whether there were two."""
    near = SAME * d.size()
    joints = set(d.pins()) | {s.point for s in d.guides.values()}
    for name, body in d.bodies.items():
        # two shafts in one place of the ground are not pinned to each other
        held = [p for p in body.points if p in joints and name != GROUND]
        for i, p in enumerate(held):
            for q in held[:i]:
                a, b = body.points[p], body.points[q]
                # floats show most that are apart; exact differences take twenty times as long
                close = abs(complex(a) - complex(b)) <= near + FLOATS * (abs(a) + abs(b))
                if close and apart(a, b) <= near:
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
    return [part for part in _parts(d) if _can_move(d, part)]


def _can_move(d: Drawing, part: Drawing) -> bool:
    """Give a part the inputs that determine its motion; one that cannot move is left out."""
    if part.spare:
        _fit_inputs(part)
    if not part.drives:
        d.notes += part.notes
        d.leave(", ".join(name for name in part.bodies if name != GROUND), "no joint there can move")
    return bool(part.drives)


def _drop_what_is_rigid(d: Drawing) -> None:
    rigid = [k for k, s in d.guides.items() if s.link == s.on]
    for k in rigid:
        d.leave(f"slide at {d.guides[k].point}", "both sides are one body")
    for g in [g for g in d.gears if len({*g.links, g.arm}) < 3]:
        d.gears.remove(g)
        d.leave(f"gears {', '.join(g.links)}", "they are one body, or one of them is the arm")
    for r in list(d.racks):
        s = d.guides[r.slider]
        # a wheel in a slot may roll along a rack
        if s.link == s.on or r.gear in ((s.on,) if s.turned is None else (s.on, s.link)):
            d.racks.remove(r)
            d.leave(f"rack at {s.point}", "its wheel and its guide are one body")
    for e in list(d.drives):
        if len({*d.pair(e)}) == 1:
            d.drives.remove(e)
            d.leave(f"input {e.link or d.guides[str(e.slider)].point}", "its two sides are one body")
    for k in rigid:
        del d.guides[k]


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
            alone = "only one joint holds it, and nothing drives it"
            d.leave(name, alone if holds[name] else "it has no joint")
        d.guides = {k: s for k, s in d.guides.items() if {s.link, s.on} <= d.bodies.keys()}
        d.racks = [r for r in d.racks if r.gear in d.bodies and r.slider in d.guides]
        for g in [g for g in d.gears if not {*g.links, g.arm} <= d.bodies.keys()]:
            d.gears.remove(g)
            d.notes.append(f"gears {', '.join(g.links)}: left out with their link")
        for load in [a for a in d.loads if not {name for name, _ in a.ends} <= d.bodies.keys()]:
            d.loads.remove(load)
            d.notes.append(f"load on {', '.join(name for name, _ in load.ends)}: left out with its link")


def _parts(d: Drawing) -> list[Drawing]:
    """Split into mechanisms that have nothing but the ground in common; what nothing drives is left out."""
    groups = Groups(d.bodies)
    for names in (*(names for names, _ in d.ties()), *(dict(load.ends) for load in d.loads)):
        groups.join(*(name for name in names if name != GROUND))
    parts = []
    d.spare = [e for e in d.spare if e.slider is None or e.slider in d.guides]
    for group in groups.all():
        drives = [e for e in d.drives if d.pair(e)[0] in group]
        if drives:
            parts.append(_part(d, set(group), drives))
        elif group != [GROUND]:
            d.leave(", ".join(group), f"nothing drives {'it' if len(group) == 1 else 'them'}")
    return parts


def _part(d: Drawing, names: set[str], drives: list[Drive]) -> Drawing:
    bodies = {name: body for name, body in d.bodies.items() if name in names}
    guides = {k: s for k, s in d.guides.items() if {s.link, s.on} & names}
    used = {p for body in bodies.values() for p in body.points} | {s.point for s in guides.values()}
    ground = Body({p: at for p, at in d.bodies[GROUND].points.items() if p in used})
    return replace(
        d,
        bodies={GROUND: ground} | bodies,
        guides=guides,
        gears=[g for g in d.gears if not names.isdisjoint(g.links)],
        racks=[r for r in d.racks if r.gear in names],
        drives=drives,
        spare=[e for e in d.spare if set(d.pair(e)) <= {GROUND, *names}],
        loads=[load for load in d.loads if any(name in names for name, _ in load.ends)],
        notes=[],
    )


# --- inputs ------------------------------------------------------------------------------------------------------
def _fit_inputs(d: Drawing) -> None:
    """Remove inputs that depend on those before them, and add free joints as inputs until all is driven."""
    spare = [e for e in d.spare if all(e.moves != other.moves for other in d.drives)]
    # where the file drives too many, those at the ground stay
    every = [*sorted(d.drives, key=lambda e: GROUND not in d.pair(e)), *spare]
    try:
        m = Description(**parts_of(replace(d, drives=every), dict.fromkeys(d.bodies, ORIGIN)))
    except DescriptionError:
        # it is named when the description is read again
        return
    bodies = (d.bodies[name] for name in m.links)
    pose = [(b.turn, b.at.real / m.size, b.at.imag / m.size) for b in bodies]
    rows = Constraints.at(m, np.ravel(pose), {})
    # many joints that say the same become as few rows as there are columns
    _, s, vt = np.linalg.svd(np.linalg.qr(rows.jacobian, mode="r"))
    free = vt[int(np.sum(s > FOLLOWS * s.max(initial=0.0))) :]
    kept: list[Drive] = []
    for e, speed in zip(every, rows.inputs, strict=True):
        row = free @ speed
        if np.linalg.norm(row) > FOLLOWS:
            # what the input holds is free no more
            kept.append(e)
            free = np.linalg.svd(row[None])[2][1:] @ free
    _note(
        d,
        (e for e in d.drives if e not in kept),
        "left out as an input: the joints and the other inputs determine its motion",
    )
    _note(d, (e for e in kept if e not in d.drives), "taken as an input in addition: it was free to move")
    d.drives = [e for e in (*d.drives, *spare) if e in kept]


def _note(d: Drawing, drives: Iterable[Drive], what: str) -> None:
    d.notes += [f"{' against '.join(d.pair(e))}: {what}" for e in drives]
