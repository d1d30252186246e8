"""MJCF: nested bodies, loops closed by `connect`, gears, belts and racks by fixed tendons, inputs by motors, the start as a key frame."""

from __future__ import annotations

from xml.etree.ElementTree import Element

from cli.exports.markup import add, digits, document, spatial
from cli.exports.skeleton import LIGHT, THICK, Branching, Joint, Part, Skeleton, Travel
from virtualwork.describe.parts import GROUND

PLURAL = {"gear": "gears", "belt": "belt", "rack": "rack"}
# MuJoCo takes nothing lighter
LIGHTEST = 2e-15


def mjcf(s: Skeleton, travel: Travel, comment: str) -> bytes:
    """Return the file of a mechanism."""
    m = s.m
    root = Element("mujoco", model=m.name or "mechanism")
    masses = [p.mass for p in s.parts.values() if p.mass > 0]
    light = max(LIGHT * max(masses, default=1.0), LIGHTEST)
    inertias = [p.inertia for p in s.parts.values() if p.inertia > 0]
    least = max(min([light * m.size**2, *inertias]), LIGHTEST)
    add(
        root, "compiler", angle="radian", autolimits="true", inertiafromgeom="false", boundmass=light, boundinertia=least
    )  # fmt: skip
    add(root, "option", gravity=spatial(m.gravity), timestep=0.0005, integrator="implicitfast")
    default = add(root, "default")
    # as stiff as the solver of constraints takes it
    add(default, "equality", solref="0.001 1", solimp="0.9999 0.9999 0.001 0.5 2")
    add(default, "geom", contype="0", conaffinity="0")
    world = add(root, "worldbody")
    bodies = {GROUND: world}
    for b in s.walk():
        bodies[b.child] = _body(s, b, bodies[b.parent])
    for name, part in s.parts.items():
        _inside(s, part, bodies[name])
    equality = Element("equality")
    for j in s.closing:
        _close(j, bodies, equality)
    for link, block in s.welds:
        add(equality, "weld", body1=link, body2=block)
    tendon = Element("tendon")
    count = dict.fromkeys(PLURAL, 0)
    for mesh in m.meshes:
        count[mesh.kind] += 1
        name = f"{PLURAL[mesh.kind]} {count[mesh.kind]}"
        _fixed(tendon, name, s.mesh(mesh))
        add(equality, "tendon", tendon1=name)
    _springs(s, tendon, bodies)
    actuator = Element("actuator")
    for k, e in enumerate(m.inputs):
        joint = s.joint_of(k)
        motor = add(actuator, "motor", name=e.name)
        if joint is None:
            _fixed(tendon, f"input {e.name}", s.free_input(k))
            motor.set("tendon", f"input {e.name}")
        else:
            motor.set("joint", joint.name)
        if travel.peak is not None:
            motor.set("ctrlrange", digits(-travel.peak, travel.peak))
    root.extend(e for e in (equality, tendon, actuator) if len(e))
    _key(s, add(root, "keyframe"))
    return document(root, comment)


def _fixed(tendon: Element, name: str, terms: dict[str, float]) -> Element:
    made = add(tendon, "fixed", name=name)
    for joint, factor in terms.items():
        add(made, "joint", joint=joint, coef=factor)
    return made


def _springs(s: Skeleton, tendon: Element, bodies: dict[str, Element]) -> None:
    """Add springs and dampers, between two places and between two links."""
    m = s.m
    for k, spring in enumerate(m.springs, 1):
        made = add(tendon, "spatial", name=f"spring {k}", stiffness=spring.stiffness, damping=spring.damping)
        made.set("springlength", digits(spring.free_length))
        for side, (body, point) in zip("ab", spring.between, strict=True):
            site = f"spring {k} {side}"
            add(bodies[body], "site", name=site, pos=spatial(m.place(body, point)))
            add(made, "site", site=site)
    for k, turning in enumerate(m.torsion_springs, 1):
        on, link = turning.links
        terms = s.terms({link: 1.0, on: -1.0})
        made = _fixed(tendon, f"torsion spring {k}", terms)
        made.attrib |= {"stiffness": digits(turning.stiffness), "damping": digits(turning.damping)}
        here = sum(c * next(j.value for j in s.joints if j.name == name) for name, c in terms.items())
        made.set("springlength", digits(here - s.twist(turning)))


def _body(s: Skeleton, b: Branching, inside: Element) -> Element:
    """Add a body with its joint."""
    parent, part, j = s.parts[b.parent], s.parts[b.child], b.joint
    body = add(inside, "body", name=part.name, pos=spatial(parent.inside(part.at)))
    turned = part.turn - parent.turn
    if turned:
        body.set("euler", digits(0.0, 0.0, turned))
    made = add(body, "joint", name=j.name, type="hinge" if j.kind == "turn" else "slide")
    # of a slide the place means nothing to MuJoCo, but it is the point's
    made.set("pos", spatial(j.ends[1] if b.child == j.link else j.ends[0]))
    made.set("axis", digits(*j.axis(part, b.sense)))
    if j.value:
        made.set("ref", digits(j.value))
    if j.limits is not None:
        made.set("range", digits(*j.limits))
    return body


def _inside(s: Skeleton, part: Part, body: Element) -> None:
    """Add what a body has: mass, named points, a drawing."""
    if part.mass > 0:
        add(
            body,
            "inertial",
            pos=spatial(part.center),
            mass=part.mass,
            diaginertia=digits(*3 * (part.inertia,)),
        )
    for point, z in part.points.items():
        # a point of several links stands on the first
        if next(name for name, other in s.parts.items() if point in other.points) == part.name:
            add(body, "site", name=point, pos=spatial(z))
    for a, b in part.strokes:
        add(body, "geom", type="capsule", size=THICK * s.m.size, fromto=f"{spatial(a)} {spatial(b)}")


def _close(j: Joint, bodies: dict[str, Element], equality: Element) -> None:
    """Close a loop at a pin."""
    sites = []
    for name, z in zip((j.on, j.link), j.ends, strict=True):
        sites.append(f"{j.name} on {name}")
        add(bodies[name], "site", name=sites[-1], pos=spatial(z))
    add(equality, "connect", name=j.name, site1=sites[0], site2=sites[1])


def _key(s: Skeleton, keyframe: Element) -> None:
    """The start: coordinates, speeds, efforts of the inputs."""
    walked = [b.joint for b in s.walk()]
    key = add(keyframe, "key", name="start")
    key.set("qpos", digits(*(j.value for j in walked)))
    key.set("qvel", digits(*(j.rate for j in walked)))
