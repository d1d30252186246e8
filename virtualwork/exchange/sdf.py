"""SDF, written: links with poses of their own, loops closed by joints as any other, gears as gearboxes."""

from __future__ import annotations

from collections.abc import Iterable
from xml.etree.ElementTree import Element, SubElement

from dalembert.documents import markup as xml
from dalembert.documents.robots import INERTIA_ALONE, LIGHT, MASSLESS, POINT_MASS, ROWS, WORLD
from virtualwork.describe.parts import GROUND, Belt, Gear
from virtualwork.exchange.skeleton import Joint, Skeleton

# name space of the marks on numbers that the format asks for and the mechanism does not have
SPACE = "https://dalembert.invalid/sdf"
PLUGIN = {"filename": "gz-sim-joint-controller-system", "name": "gz::sim::systems::JointController"}


def write(s: Skeleton, comment: str) -> tuple[bytes, list[str]]:
    """Return the file of a mechanism, and what it leaves out."""
    m = s.m
    root = Element("sdf", {"version": "1.9", "xmlns:dalembert": SPACE})
    world = xml.add(root, "world", name="default")
    xml.add(world, "gravity", xml.digits(m.gravity.real, m.gravity.imag, 0.0))
    model = xml.add(world, "model", name=m.name or "mechanism")
    light = LIGHT * max((p.mass for p in s.bodies.values()), default=0.0) or LIGHT
    for name in s.bodies:
        if name != GROUND:
            _add_link(s, model, name, light)
    for j in s.joints:
        add_joint(model, s, j)
    add_welds(model, s)
    add_gearboxes(model, (*m.gears, *m.belts), WORLD)
    add_plugins(model, s)
    lost = f"racks are left out: {len(m.racks)}: the format has no such joint" if m.racks else ""
    return xml.document(root, comment), s.left_out(("gravity",), lost)


def add_pose(element: Element, z: complex, turn: float = 0.0) -> None:
    """Add the pose of a place of the plane."""
    xml.add(element, "pose", xml.digits(z.real, z.imag, 0.0, 0.0, 0.0, turn))


def _add_link(s: Skeleton, model: Element, name: str, light: float) -> None:
    part, link = s.bodies[name], xml.add(model, "link", name=name)
    add_pose(link, part.at, part.turn)
    inertial = xml.add(link, "inertial")
    mass, inertia = part.mass, part.inertia
    if mass <= 0 < inertia:
        mass = light
        SubElement(inertial, f"dalembert:{INERTIA_ALONE}")
    elif mass <= 0:
        mass, inertia = light, light * s.m.size**2
        SubElement(inertial, f"dalembert:{MASSLESS}")
    elif inertia <= 0:
        inertia = LIGHT * mass * s.m.size**2
        SubElement(inertial, f"dalembert:{POINT_MASS}")
    add_pose(inertial, part.center)
    xml.add(inertial, "mass", xml.digits(mass))
    tensor = xml.add(inertial, "inertia")
    for entry in ROWS:
        # in the plane only izz acts
        xml.add(tensor, entry, xml.digits(inertia if entry[1] == entry[2] else 0.0))
    for k, (middle, turn, sides) in enumerate(s.boxes(name), 1):
        visual = xml.add(link, "visual", name=f"stroke {k}")
        add_pose(visual, middle, turn)
        xml.add(xml.add(xml.add(visual, "geometry"), "box"), "size", xml.digits(*sides))
    for point, z in s.free_points(name).items():
        add_pose(xml.add(model, "frame", name=point, attached_to=name), z)


def add_joint(model: Element, s: Skeleton, j: Joint, ground: str = WORLD) -> None:
    """Add a joint; its place is seen from the link, which cannot be the ground."""
    on, link, ends, sense = j.on, j.link, j.ends, 1.0
    if link == GROUND:
        on, link, ends, sense = link, on, (ends[1], ends[0]), -1.0
    kind = {"turn": "revolute", "slide": "prismatic"}[j.kind]
    made = xml.add(model, "joint", name=j.name, type=kind)
    xml.add(made, "parent", ground if on == GROUND else on)
    xml.add(made, "child", link)
    add_pose(made, ends[1])
    axis = xml.add(made, "axis")
    xml.add(axis, "xyz", xml.digits(*j.axis(s.bodies[link], sense)))
    limit = xml.add(axis, "limit")
    if j.limits is not None:
        for tag, value in zip(("lower", "upper"), j.limits, strict=True):
            # the coordinate is 0 in the start pose
            xml.add(limit, tag, xml.digits(value - j.value))
    effort = 0.0 if j.input is None else -1.0 if s.travel.peak is None else s.travel.peak
    xml.add(limit, "effort", xml.digits(effort))


def add_welds(model: Element, s: Skeleton) -> None:
    """Add the joints that fix blocks to their links."""
    for link, block in s.welds:
        made = xml.add(model, "joint", name=f"{block} fixed", type="fixed")
        xml.add(made, "parent", link)
        xml.add(made, "child", block)


def add_gearboxes(model: Element, gears: Iterable[Gear | Belt], ground: str) -> None:
    """Add gears and belts: θ of the child is −gearbox_ratio times that of the parent, both against the reference body."""
    for k, g in enumerate(gears, 1):
        a, b, arm = (ground if x == GROUND else x for x in (*g.links, g.arm))
        ratio = g.ratio
        if b == ground:
            a, b, ratio = b, a, 1 / ratio
        made = xml.add(model, "joint", name=f"gears {k}", type="gearbox")
        xml.add(made, "parent", a)
        xml.add(made, "child", b)
        xml.add(made, "gearbox_ratio", xml.digits(-ratio))
        xml.add(made, "gearbox_reference_body", arm)
        for tag in ("axis", "axis2"):
            xml.add(xml.add(made, tag), "xyz", xml.digits(0.0, 0.0, 1.0))


def add_plugins(model: Element, s: Skeleton) -> None:
    """Add what drives the inputs, with the speed they begin with."""
    for k, e in enumerate(s.m.inputs):
        j = s.driven(k)
        if j is not None:
            plugin = xml.add(model, "plugin", None, **PLUGIN)
            xml.add(plugin, "joint_name", j.name)
            if e.speed is not None:
                xml.add(plugin, "initial_velocity", xml.digits(j.rate))
