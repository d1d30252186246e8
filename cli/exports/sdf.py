"""SDF: links where they stand, a joint for every pin and guide (loops need nothing else), gears as gearboxes."""

from __future__ import annotations

from collections.abc import Iterable
from xml.etree.ElementTree import Element, SubElement

from cli.exports.markup import add, digits, document
from cli.exports.skeleton import LIGHT, Joint, Part, Skeleton, Travel
from virtualwork.describe.parts import GROUND, Belt, Gear

WORLD = "world"
SPACE = "https://dalembert.invalid/sdf"
PLUGIN = {"filename": "gz-sim-joint-controller-system", "name": "gz::sim::systems::JointController"}
AXES = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


def sdf(s: Skeleton, travel: Travel, comment: str) -> bytes:
    """Return the file of a mechanism."""
    m = s.m
    root = Element("sdf", {"version": "1.9", "xmlns:dalembert": SPACE})
    world = add(root, "world", name="default")
    add(world, "gravity", digits(m.gravity.real, m.gravity.imag, 0.0))
    model = add(world, "model", name=m.name or "mechanism")
    light = LIGHT * max((p.mass for p in s.parts.values()), default=0.0) or LIGHT
    for part in s.parts.values():
        if part.name != GROUND:
            _link(s, model, part, light)
    for j in s.joints:
        joint(model, s, j, travel)
    welds(model, s)
    gearboxes(model, (*m.gears, *m.belts), WORLD)
    plugins(model, s)
    return document(root, comment)


def at(element: Element, z: complex, turn: float = 0.0) -> None:
    """Add the pose of a place of the plane."""
    add(element, "pose", digits(z.real, z.imag, 0.0, 0.0, 0.0, turn))


def _link(s: Skeleton, model: Element, part: Part, light: float) -> None:
    link = add(model, "link", name=part.name)
    at(link, part.at, part.turn)
    inertial = add(link, "inertial")
    mass, inertia = part.mass, part.inertia
    if mass <= 0:
        mass, inertia = light, light * s.m.size**2
        SubElement(inertial, "dalembert:massless")
    elif inertia <= 0:
        inertia = LIGHT * mass * s.m.size**2
        SubElement(inertial, "dalembert:point_mass")
    at(inertial, part.center)
    add(inertial, "mass", digits(mass))
    tensor = add(inertial, "inertia")
    for name in AXES:
        # in the plane only izz acts
        add(tensor, name, digits(inertia if name[1] == name[2] else 0.0))
    for k, (middle, turn, sides) in enumerate(part.boxes(s.m.size), 1):
        visual = add(link, "visual", name=f"stroke {k}")
        at(visual, middle, turn)
        add(add(add(visual, "geometry"), "box"), "size", digits(*sides))
    for point, z in s.free_points(part).items():
        at(add(model, "frame", name=point, attached_to=part.name), z)


def joint(model: Element, s: Skeleton, j: Joint, travel: Travel, ground: str = WORLD) -> None:
    """Add a joint; its place is seen from the link, which cannot be the ground."""
    on, link, ends, sense = j.on, j.link, j.ends, 1.0
    if link == GROUND:
        on, link, ends, sense = link, on, (ends[1], ends[0]), -1.0
    kind = {"turn": "revolute", "slide": "prismatic"}[j.kind]
    made = add(model, "joint", name=j.name, type=kind)
    add(made, "parent", ground if on == GROUND else on)
    add(made, "child", link)
    at(made, ends[1])
    axis = add(made, "axis")
    add(axis, "xyz", digits(*j.axis(s.parts[link], sense)))
    limit = add(axis, "limit")
    if j.limits is not None:
        for tag, value in zip(("lower", "upper"), j.limits, strict=True):
            # the coordinate is 0 in the start pose
            add(limit, tag, digits(value - j.value))
    effort = 0.0 if j.input is None else -1.0 if travel.peak is None else travel.peak
    add(limit, "effort", digits(effort))


def welds(model: Element, s: Skeleton) -> None:
    """Add the joints that fix blocks to their links."""
    for link, block in s.welds:
        made = add(model, "joint", name=f"{block} fixed", type="fixed")
        add(made, "parent", link)
        add(made, "child", block)


def gearboxes(model: Element, gears: Iterable[Gear | Belt], ground: str) -> None:
    """Add gears and belts: θ of the child is −gearbox_ratio times that of the parent, both against the reference body."""
    for k, g in enumerate(gears, 1):
        a, b, arm = (ground if x == GROUND else x for x in (*g.links, g.arm))
        ratio = g.ratio
        if b == ground:
            a, b, ratio = b, a, 1 / ratio
        made = add(model, "joint", name=f"gears {k}", type="gearbox")
        add(made, "parent", a)
        add(made, "child", b)
        add(made, "gearbox_ratio", digits(-ratio))
        add(made, "gearbox_reference_body", arm)
        for tag in ("axis", "axis2"):
            add(add(made, tag), "xyz", digits(0.0, 0.0, 1.0))


def plugins(model: Element, s: Skeleton) -> None:
    """Add what drives the inputs, with the speed they begin with."""
    for k, e in enumerate(s.m.inputs):
        j = s.driven(k)
        if j is not None:
            plugin = add(model, "plugin", None, **PLUGIN)
            add(plugin, "joint_name", j.name)
            if e.speed is not None:
                add(plugin, "initial_velocity", digits(j.rate))
