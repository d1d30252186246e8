"""URDF: a tree, each link's axes at its joint; what closes the loops stands in `<gazebo>`, which other readers skip."""

from __future__ import annotations

from dataclasses import replace
from xml.etree.ElementTree import Element

from cli.exports import sdf
from cli.exports.markup import add, digits, document, spatial
from cli.exports.skeleton import Branching, Part, Skeleton, Travel
from virtualwork.describe.parts import GROUND, Belt, Gear, Rack

# a limit that is none
LARGE = 1e9


def urdf(s: Skeleton, travel: Travel, comment: str) -> bytes:
    """Return the file of a mechanism."""
    root = Element("robot", name=s.m.name or "mechanism")
    # where each link's axes begin: at the joint on which it hangs, in its own axes of the mechanism's file
    origin = {GROUND: 0j}
    for b in s.walk():
        origin[b.child] = b.joint.ends[1] if b.child == b.joint.link else b.joint.ends[0]
    for name, part in s.parts.items():
        _link(s, root, part, origin[name])
    for b in s.walk():
        _joint(s, root, b, origin, travel)
    for name, part in s.parts.items():
        _frames(s, root, part, origin[name])
    gazebo = Element("gazebo")
    for j in s.closing:
        ends = (j.ends[0] - origin[j.on], j.ends[1] - origin[j.link])
        sdf.joint(gazebo, s, replace(j, ends=ends), travel, GROUND)
    sdf.welds(gazebo, s)
    _gears(s, root, gazebo)
    sdf.plugins(gazebo, s)
    if len(gazebo):
        root.append(gazebo)
    return document(root, comment)


def _link(s: Skeleton, root: Element, part: Part, origin: complex) -> None:
    link = add(root, "link", name=part.name)
    if part.mass > 0:
        inertial = add(link, "inertial")
        add(inertial, "origin", xyz=spatial(part.center - origin), rpy="0 0 0")
        add(inertial, "mass", value=part.mass)
        # in the plane only izz acts
        add(inertial, "inertia", None, **{n: part.inertia if n[1] == n[2] else 0.0 for n in sdf.AXES})
    for middle, turn, sides in part.boxes(s.m.size):
        visual = add(link, "visual")
        add(visual, "origin", xyz=spatial(middle - origin), rpy=digits(0.0, 0.0, turn))
        add(add(visual, "geometry"), "box", size=digits(*sides))


def _joint(s: Skeleton, root: Element, b: Branching, origin: dict[str, complex], travel: Travel) -> None:
    j, parent, part = b.joint, s.parts[b.parent], s.parts[b.child]
    kind = "prismatic" if j.kind == "slide" else "continuous" if j.limits is None else "revolute"
    made = add(root, "joint", name=j.name, type=kind)
    at = parent.inside(part.world(origin[b.child])) - origin[b.parent]
    add(made, "origin", xyz=spatial(at), rpy=digits(0.0, 0.0, part.turn - parent.turn))
    add(made, "parent", link=b.parent)
    add(made, "child", link=b.child)
    add(made, "axis", xyz=digits(*j.axis(part, b.sense)))
    if kind != "continuous" or j.input is not None:
        limit = add(made, "limit")
        low, high = (
            j.limits
            or (j.guide is not None and travel.way(j.guide))
            or (j.value - s.m.size, j.value + s.m.size)
        )
        if kind != "continuous":
            limit.attrib |= {"lower": digits(low - j.value), "upper": digits(high - j.value)}
        peak = 0.0 if j.input is None else travel.peak
        # the format wants both numbers; where nothing limits them they are large
        limit.set("effort", digits(LARGE if peak is None else peak))
        limit.set("velocity", digits(LARGE))


def _frames(s: Skeleton, root: Element, part: Part, origin: complex) -> None:
    """Named points that no joint holds: links without mass, fixed there."""
    for point, z in s.free_points(part).items():
        name = point if point not in s.parts else f"{point} point"
        add(root, "link", name=name)
        made = add(root, "joint", name=f"{name} fixed", type="fixed")
        add(made, "origin", xyz=spatial(z - origin), rpy="0 0 0")
        add(made, "parent", link=part.name)
        add(made, "child", link=name)


def _gears(s: Skeleton, root: Element, gazebo: Element) -> None:
    """Gears, belts and racks of two joints of the tree are mimicked; other gears are gearboxes of the simulator."""
    boxes: list[Gear | Belt] = []
    parts: tuple[Gear | Belt | Rack, ...] = (*s.m.gears, *s.m.belts, *s.m.racks)
    for g, mesh in zip(parts, s.m.meshes, strict=True):
        terms = s.mesh(mesh)
        driven = {j.name for j in s.joints if j.input is not None}
        last = [name for name in terms if name not in driven]
        joint = next((e for e in root.iter("joint") if last and e.get("name") == last[-1]), None)
        if len(terms) == 2 and joint is not None and joint.find("mimic") is None:
            (other,) = (name for name in terms if name != last[-1])
            # of coordinates that may run against the pins' own sense
            factor = -terms[other] / terms[last[-1]]
            add(joint, "mimic", joint=other, multiplier=factor)
        elif not isinstance(g, Rack):
            boxes.append(g)
    sdf.gearboxes(gazebo, boxes, GROUND)
