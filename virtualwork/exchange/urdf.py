"""URDF, written: a tree of links; loops and what the tree cannot say stand in a `<gazebo>` block."""

from __future__ import annotations

from dataclasses import replace
from xml.etree.ElementTree import Element

from dalembert.documents import markup as xml
from dalembert.documents.robots import ROWS
from virtualwork.describe.parts import GROUND, Belt, Gear, Rack
from virtualwork.exchange import sdf
from virtualwork.exchange.skeleton import Branching, Skeleton, spatial

# a limit that is none
LARGE = 1e9


def write(s: Skeleton, comment: str) -> tuple[bytes, list[str]]:
    """Return the file of a mechanism, and what it leaves out."""
    root = Element("robot", name=s.m.name or "mechanism")
    # where each link's axes begin: at the joint on which it hangs, in its own axes of the mechanism's file
    origin = {GROUND: 0j}
    for b in s.walk():
        origin[b.child] = b.joint.ends[1] if b.child == b.joint.link else b.joint.ends[0]
    for name in s.bodies:
        _add_link(s, root, name, origin[name])
    for b in s.walk():
        _add_joint(s, root, b, origin)
    for name in s.bodies:
        _add_frames(s, root, name, origin[name])
    gazebo = Element("gazebo")
    for j in s.closing:
        ends = (j.ends[0] - origin[j.on], j.ends[1] - origin[j.link])
        sdf.add_joint(gazebo, s, replace(j, ends=ends), GROUND)
    sdf.add_welds(gazebo, s)
    racks = _add_gears(s, root, gazebo)
    sdf.add_plugins(gazebo, s)
    if len(gazebo):
        root.append(gazebo)
    lost = f"racks are left out: {racks}: <mimic> ties one joint to one other" if racks else ""
    return xml.document(root, comment), s.left_out(("massless",), lost)


def _add_link(s: Skeleton, root: Element, name: str, origin: complex) -> None:
    part, link = s.bodies[name], xml.add(root, "link", name=name)
    if part.mass > 0 or part.inertia > 0:
        inertial = xml.add(link, "inertial")
        xml.add(inertial, "origin", xyz=spatial(part.center - origin), rpy="0 0 0")
        xml.add(inertial, "mass", value=part.mass)
        # in the plane only izz acts
        xml.add(inertial, "inertia", None, **{n: part.inertia if n[1] == n[2] else 0.0 for n in ROWS})
    for middle, turn, sides in s.boxes(name):
        visual = xml.add(link, "visual")
        xml.add(visual, "origin", xyz=spatial(middle - origin), rpy=xml.digits(0.0, 0.0, turn))
        xml.add(xml.add(visual, "geometry"), "box", size=xml.digits(*sides))


def _add_joint(s: Skeleton, root: Element, b: Branching, origin: dict[str, complex]) -> None:
    j, parent, part = b.joint, s.bodies[b.parent], s.bodies[b.child]
    kind = "prismatic" if j.kind == "slide" else "continuous" if j.limits is None else "revolute"
    made = xml.add(root, "joint", name=j.name, type=kind)
    at = parent.inside(part.world(origin[b.child])) - origin[b.parent]
    xml.add(made, "origin", xyz=spatial(at), rpy=xml.digits(0.0, 0.0, part.turn - parent.turn))
    xml.add(made, "parent", link=b.parent)
    xml.add(made, "child", link=b.child)
    xml.add(made, "axis", xyz=xml.digits(*j.axis(part, b.sense)))
    if kind != "continuous" or j.input is not None:
        limit = xml.add(made, "limit")
        low, high = (
            j.limits
            or (j.guide is not None and s.travel.way(j.guide))
            or (j.value - s.m.size, j.value + s.m.size)
        )
        if kind != "continuous":
            limit.attrib |= {"lower": xml.digits(low - j.value), "upper": xml.digits(high - j.value)}
        peak = 0.0 if j.input is None else s.travel.peak
        # the format wants both numbers; where nothing limits them they are large
        limit.set("effort", xml.digits(LARGE if peak is None else peak))
        limit.set("velocity", xml.digits(LARGE))


def _add_frames(s: Skeleton, root: Element, name: str, origin: complex) -> None:
    """Add named points that no joint holds as links without mass, fixed there."""
    for frame, z in s.free_points(name).items():
        xml.add(root, "link", name=frame)
        made = xml.add(root, "joint", name=f"{frame} fixed", type="fixed")
        xml.add(made, "origin", xyz=spatial(z - origin), rpy="0 0 0")
        xml.add(made, "parent", link=name)
        xml.add(made, "child", link=frame)


def _add_gears(s: Skeleton, root: Element, gazebo: Element) -> int:
    """Write gears, belts and racks of two joints of the tree as `<mimic>`, other gears as gearboxes of the simulator.

    Returns the number of racks that are neither.
    """
    gearboxes: list[Gear | Belt] = []
    racks = 0
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
            xml.add(joint, "mimic", joint=other, multiplier=factor)
        elif isinstance(g, Rack):
            racks += 1
        else:
            gearboxes.append(g)
    sdf.add_gearboxes(gazebo, gearboxes, GROUND)
    return racks
