"""MJCF, MuJoCo's own format, written: nested bodies, loops closed by equalities, gears and springs as tendons, inputs as actuators, the start as a key frame."""

from __future__ import annotations

from xml.etree.ElementTree import Element

from dalembert.documents import markup as xml
from dalembert.documents.robots import LIGHT
from virtualwork.describe.parts import GROUND
from virtualwork.exchange.skeleton import Branching, Joint, Skeleton, spatial

PLURAL = {"gear": "gears", "belt": "belt", "rack": "rack"}
# MuJoCo takes nothing lighter
LIGHTEST = 2e-15


def write(s: Skeleton, comment: str) -> tuple[bytes, list[str]]:
    """Return the file of a mechanism, and what it leaves out."""
    m = s.m
    root = Element("mujoco", model=m.name or "mechanism")
    light, least, raised = _bounds(s)
    xml.add(
        root, "compiler", angle="radian", autolimits="true", inertiafromgeom="false", boundmass=light, boundinertia=least
    )  # fmt: skip
    xml.add(root, "option", gravity=spatial(m.gravity), timestep=0.0005, integrator="implicitfast")
    default = xml.add(root, "default")
    # as stiff as the solver of constraints takes it
    xml.add(default, "equality", solref="0.001 1", solimp="0.9999 0.9999 0.001 0.5 2")
    xml.add(default, "geom", contype="0", conaffinity="0")
    world = xml.add(root, "worldbody")
    bodies = {GROUND: world}
    for b in s.walk():
        bodies[b.child] = _body(s, b, bodies[b.parent])
    for name, body in bodies.items():
        _add_contents(s, name, body)
    equality = Element("equality")
    for j in s.closing:
        _close(j, bodies, equality)
    for link, block in s.welds:
        xml.add(equality, "weld", body1=link, body2=block)
    tendon = Element("tendon")
    count = dict.fromkeys(PLURAL, 0)
    for mesh in m.meshes:
        count[mesh.kind] += 1
        name = f"{PLURAL[mesh.kind]} {count[mesh.kind]}"
        _fixed(tendon, name, s.mesh(mesh))
        xml.add(equality, "tendon", tendon1=name)
    _springs(s, tendon, bodies)
    actuator = Element("actuator")
    for k, e in enumerate(m.inputs):
        joint = s.joint_of(k)
        motor = xml.add(actuator, "motor", name=e.name)
        if joint is None:
            _fixed(tendon, f"input {e.name}", s.free_input(k))
            motor.set("tendon", f"input {e.name}")
        else:
            motor.set("joint", joint.name)
        if s.travel.peak is not None:
            motor.set("ctrlrange", xml.digits(-s.travel.peak, s.travel.peak))
    root.extend(e for e in (equality, tendon, actuator) if len(e))
    _key(s, xml.add(root, "keyframe"))
    return xml.document(root, comment), raised + s.left_out(
        ("springs", "torsion springs", "inputs", "gravity")
    )


def _bounds(s: Skeleton) -> tuple[float, float, list[str]]:
    """Return the least mass and the least moment of inertia, below all but those of zero; and what MuJoCo raises all the same."""
    bodies = s.bodies.items()
    masses, inertias = (
        [x for x in each if x > 0] for each in zip(*((p.mass, p.inertia) for _, p in bodies), strict=True)
    )
    light = max(min([LIGHT * max(masses, default=1.0), *masses]), LIGHTEST)
    least = max(min([light * s.m.size**2, *inertias]), LIGHTEST)
    names = [name for name, p in bodies if 0 < p.mass < light or 0 < p.inertia < least]
    what = f"{', '.join(names)}: MuJoCo raises a mass or a moment of inertia below {LIGHTEST:g}"
    return light, least, [what] if names else []


def _fixed(tendon: Element, name: str, terms: dict[str, float]) -> Element:
    made = xml.add(tendon, "fixed", name=name)
    for joint, factor in terms.items():
        xml.add(made, "joint", joint=joint, coef=factor)
    return made


def _springs(s: Skeleton, tendon: Element, bodies: dict[str, Element]) -> None:
    """Add springs and dampers, between two places and between two links."""
    m = s.m
    for k, spring in enumerate(m.springs, 1):
        made = xml.add(
            tendon, "spatial", name=f"spring {k}", stiffness=spring.stiffness, damping=spring.damping
        )
        made.set("springlength", xml.digits(spring.free_length))
        for side, (body, point) in zip("ab", spring.between, strict=True):
            site = f"spring {k} {side}"
            xml.add(bodies[body], "site", name=site, pos=spatial(m.place(body, point)))
            xml.add(made, "site", site=site)
    for k, turning in enumerate(m.torsion_springs):
        on, link = turning.links
        terms = s.terms({link: 1.0, on: -1.0})
        made = _fixed(tendon, f"torsion spring {k + 1}", terms)
        made.attrib |= {"stiffness": xml.digits(turning.stiffness), "damping": xml.digits(turning.damping)}
        here = sum(c * next(j.value for j in s.joints if j.name == name) for name, c in terms.items())
        made.set("springlength", xml.digits(here - float(s.start.poses.twist(k)[0])))


def _body(s: Skeleton, b: Branching, inside: Element) -> Element:
    """Add a body with its joint."""
    parent, part, j = s.bodies[b.parent], s.bodies[b.child], b.joint
    body = xml.add(inside, "body", name=b.child, pos=spatial(parent.inside(part.at)))
    turned = part.turn - parent.turn
    if turned:
        body.set("euler", xml.digits(0.0, 0.0, turned))
    made = xml.add(body, "joint", name=j.name, type="hinge" if j.kind == "turn" else "slide")
    # of a slide the place means nothing to MuJoCo, but it is the point's
    made.set("pos", spatial(j.ends[1] if b.child == j.link else j.ends[0]))
    made.set("axis", xml.digits(*j.axis(part, b.sense)))
    if j.value:
        made.set("ref", xml.digits(j.value))
    if j.limits is not None:
        made.set("range", xml.digits(*j.limits))
    return body


def _add_contents(s: Skeleton, name: str, body: Element) -> None:
    """Add what a body has: mass, named points, a drawing."""
    part = s.bodies[name]
    if part.mass > 0 or part.inertia > 0:
        xml.add(
            body,
            "inertial",
            pos=spatial(part.center),
            mass=part.mass,
            diaginertia=xml.digits(*3 * (part.inertia,)),
        )
    for point, z in part.points.items():
        # a point of several links stands on the first
        if next(holder for holder, other in s.bodies.items() if point in other.points) == name:
            xml.add(body, "site", name=point, pos=spatial(z))
    for a, b in s.strokes(name):
        xml.add(body, "geom", type="capsule", size=s.thickness, fromto=f"{spatial(a)} {spatial(b)}")


def _close(j: Joint, bodies: dict[str, Element], equality: Element) -> None:
    """Close a loop at a pin."""
    sites = []
    for name, z in zip((j.on, j.link), j.ends, strict=True):
        sites.append(f"{j.name} on {name}")
        xml.add(bodies[name], "site", name=sites[-1], pos=spatial(z))
    xml.add(equality, "connect", name=j.name, site1=sites[0], site2=sites[1])


def _key(s: Skeleton, keyframe: Element) -> None:
    """The start: coordinates, speeds, efforts of the inputs."""
    walked = [b.joint for b in s.walk()]
    start = {"qpos": xml.digits(*(j.value for j in walked)), "qvel": xml.digits(*(j.rate for j in walked))}
    xml.add(keyframe, "key", name="start", **start)
