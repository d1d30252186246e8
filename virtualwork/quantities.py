"""The quantities of a pose, each once: its request, its name, its header, its place in JSON.

Tables, JSON, pages, bounds of errors, variants, motion in time and tolerances all walk these.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from dalembert.hints import choices
from virtualwork.describe import DescriptionError
from virtualwork.describe.description import Description
from virtualwork.formulas.forces import (
    Contact,
    Effort,
    JointForce,
    JointMoment,
    NewtonEuler,
    Shaking,
    ShakingMoment,
)
from virtualwork.formulas.kinematics import Angle, CurvatureRadius, Point, PressureAngle, Slide
from virtualwork.formulas.quantity import NOTHING, Quantity

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from virtualwork.plan.steps import Joint

    Reals = NDArray[np.float64]

# by how often they are differentiated in time
POINT = (("x_m", "y_m"), ("vx_m_s", "vy_m_s"), ("ax_m_s2", "ay_m_s2"), ("jx_m_s3", "jy_m_s3"))
LINK = ("angle_deg", "omega_rad_s", "alpha_rad_s2", "jerk_rad_s3")
SLIDE = ("position_m", "speed_m_s", "acceleration_m_s2", "jerk_m_s3")
FORCE = ("fx_N", "fy_N")
# of a cam
TOUCH = (("pressure_angle_deg", PressureAngle), ("curvature_radius_m", CurvatureRadius))
CONTACT = (("contact_force_N", Contact),)


class Component(NamedTuple):
    """A number that is shown of every pose."""

    path: tuple[Any, ...]
    """Its path in JSON, a reaction below (joint, on, from); empty if only tables have it."""
    header: str
    key: Quantity = NOTHING
    """Its quantities of a motion; none if it is zero throughout, or if no motion has it."""
    imaginary: bool = False
    """Whether it is the y of a vector."""
    less: Quantity = NOTHING
    """The quantity that is subtracted."""
    names: tuple[str, ...] = ()
    """Its name for `--only`: `H.x`, `B.coupler.fx`, `B.coupler.guide.fx`."""
    owners: tuple[str, ...] = ()
    """The bare names that it belongs to."""
    order: int = 0
    """The order of its derivative in time."""
    polar: str = ""
    """`length` or `angle` of a vector, in place of a component (Ibrahim §1.2)."""
    reverse: bool = False
    """Whether it is the other side of a joint force, shown only where its full name is requested."""

    def in_si(self, value: Any, less: Any = 0.0) -> Any:
        """The number in SI and radians, from its quantity and the one that is subtracted."""
        value = value - less
        if self.polar:
            return np.abs(value) if self.polar == "length" else np.angle(value)
        return value.imag if self.imaginary else value.real

    @property
    def link(self) -> str:
        """The link whose angle it is; empty of all else."""
        return self.key.body if isinstance(self.key, Angle) and self.key.is_angle else ""

    @property
    def in_degrees(self) -> bool:
        """Whether it is shown in degrees: an angle, or one that has a sign."""
        return self.key.is_angle

    def of(self, value: Any) -> Reals:
        """The number as it is shown, from the quantity or from its slope."""
        if self.polar == "length":
            return np.asarray(np.abs(value))
        if self.polar:
            # a vector without length has no direction
            angle = np.mod(np.degrees(np.angle(value)), 360.0)
            return np.where(np.asarray(value) == 0, np.nan, np.where(angle >= 360.0, 0.0, angle))
        part = value.imag if self.imaginary else value.real
        return np.asarray(np.degrees(part) if self.in_degrees else part)


def vector(path: tuple[Any, ...], lead: str, names: Sequence[str], key: Quantity) -> list[Component]:
    """The two components of a vector."""
    return [Component((*path, name), f"{lead}{name}", key, imaginary=bool(i)) for i, name in enumerate(names)]


def called(quantities: Iterable[Component], owner: str, order: int = 0) -> list[Component]:
    """Quantities with the names that a point, link or slide has for them: `H.vx`."""
    return [
        each._replace(names=(f"{owner}.{_word(each)}",), owners=(owner,), order=order) for each in quantities
    ]


def _word(each: Component) -> str:
    """The name of a quantity without its unit: `vx` of `vx_m_s`."""
    return str(each.path[-1]).partition("_")[0]


def points(m: Description, names: Iterable[str], order: int) -> list[Component]:
    """Places of points and their rates up to an order."""
    return [
        part
        for name in names
        for k in range(order + 1)
        # the name says where on the body
        for part in called(
            vector(("points", name), f"{name}_", POINT[k], Point(m.points[name][0], 0j, name, k)), name, k
        )
    ]


def slides(m: Description, names: Iterable[str], order: int) -> list[Component]:
    """Travels along guides and their rates up to an order."""
    return [
        part
        for name in names
        for k in range(order + 1)
        for part in called(
            [Component(("slides", name, SLIDE[k]), f"{name}_{SLIDE[k]}", Slide(m.guided[name], k))], name, k
        )
    ]


def links(names: Iterable[str], order: int) -> list[Component]:
    """Angles of links and their rates up to an order."""
    return [
        part
        for name in names
        for k in range(order + 1)
        for part in called(
            [Component(("links", name, LINK[k]), f"{name}_{LINK[k]}", Angle(name, k))], name, k
        )
    ]


def places(m: Description, order: int, words: Iterable[str] = ()) -> list[Component]:
    """All that moves, in the order of tables, and the vectors between two points that these words name."""
    every = [*points(m, m.points, order), *slides(m, m.guided, order), *links(m.links, order)]
    pairs = dict.fromkeys(pair for word in words if (pair := _two_points(m, word)) is not None)
    touches = [part for number in range(len(m.cams)) for part in cam(m, number, TOUCH)]
    return [*every, *touches, *(part for pair in pairs for part in between(m, *pair, order))]


def cam(m: Description, number: int, of: Iterable[tuple[str, type[Quantity]]]) -> list[Component]:
    """Return the quantities of a cam other than its follower's position, under the name of the follower."""
    name = str(m.cams[number].slider or m.cams[number].follower)
    return [
        Component(
            ("cams", name, header),
            f"{name}_{header}",
            kind(number),
            names=(f"{name}.{header.rpartition('_')[0]}",),
            owners=(name,),
        )
        for header, kind in of
    ]


def named(m: Description, name: str) -> list[Component]:
    """The quantities of a name as `--only` has it: `H.vx`, `crank.torque`, `B.coupler.fx`; of a bare name up to accelerations.

    Raises
    ------
    DescriptionError
        No quantity has this name.

    Examples
    --------
    >>> from virtualwork import Link
    >>> m = Description({"O": 0j}, {"crank": Link({"O": 0j, "P": 1})})
    >>> [each.names[0] for each in named(m, "crank")], [each.key for each in named(m, "P.vy")]
    (['crank.angle', 'crank.omega', 'crank.alpha'], [Point('crank', 0j, 'P', 1)])
    """
    from virtualwork.plan.joint_forces import pairs
    from virtualwork.plan.steps import joints

    moving, acting = places(m, 3, [name]), forces(m, pairs(joints(m)))
    if result := [each for each in (*moving, *acting) if name in each.names]:
        # a short name that two joints share is that of the first
        return result[:1]
    for every in (moving, acting):
        if result := [each for each in every if name in each.owners and each.order < 3 and not each.reverse]:
            return result
    names = dict.fromkeys(of for each in (*moving, *acting) if not each.reverse for of in each.names[:1])
    raise DescriptionError(f"no quantity is named '{name}'{choices(name, names)}")


def _two_points(m: Description, word: str) -> tuple[str, str] | None:
    """The points P, Q of `P-Q` or `P-Q.x`; names of points may have hyphens themselves."""
    for text in (word, word.rpartition(".")[0]):
        for i, sign in enumerate(text):
            if sign == "-" and text[:i] in m.points and text[i + 1 :] in m.points:
                return text[:i], text[i + 1 :]
    return None


def between(m: Description, p: str, q: str, order: int) -> list[Component]:
    """The vector R_PQ from Q to P (Ibrahim §1.2), Cartesian and polar, and its rates: `P-Q.x`, `P-Q.length`.

    >>> from virtualwork import Link
    >>> m = Description({"O": 0j}, {"crank": Link({"O": 0j, "P": 1})})
    >>> [each.header for each in between(m, "P", "O", 1)]
    ['P-O_x_m', 'P-O_y_m', 'P-O_length_m', 'P-O_angle_deg', 'P-O_vx_m_s', 'P-O_vy_m_s']
    """
    name, parts_of = f"{p}-{q}", []
    for k in range(order + 1):
        to, start = (Point(m.points[point][0], 0j, point, k) for point in (p, q))
        parts = vector(("vectors", name), f"{name}_", POINT[k], to)
        if k == 0:
            for kind, header in (("length", "length_m"), ("angle", "angle_deg")):
                parts.append(Component(("vectors", name, header), f"{name}_{header}", to, polar=kind))
        parts_of += [part._replace(less=start) for part in called(parts, name, k)]
    return parts_of


def effort_name(slide: bool) -> str:
    """`torque_N_m` of a turning input, `force_N` of a slide."""
    return "force_N" if slide else "torque_N_m"


def forces(m: Description, pairs: Iterable[tuple[Joint, str, str]]) -> list[Component]:
    """The effort of every input both ways and their difference, and what the joints carry and the ground feels."""
    result = []
    for j, entry in enumerate(m.inputs):
        name, several = effort_name(entry.is_slide), len(m.inputs) > 1
        lead = f"{entry.name}_" if several else ""
        path = ("effort", "inputs", entry.name) if several else ("effort",)
        euler, work = NewtonEuler(j), Effort(j)
        word, owner = name.partition("_")[0], str(entry.name)
        every = [
            Component((*path, f"input_{name}"), f"{lead}input_{name}", euler, names=(f"{owner}.{word}",)),
            Component(
                (*path, f"virtual_work_{name}"),
                f"{lead}virtual_work_{name}",
                work,
                names=(f"{owner}.virtual_work_{word}",),
            ),
            Component(
                (), f"{lead}difference_{name}", euler, less=work, names=(f"{owner}.difference_{word}",)
            ),
        ]
        result += [each._replace(owners=(owner,)) for each in every]
    touches = [part for number in range(len(m.cams)) for part in cam(m, number, CONTACT)]
    return [*result, *reactions(m, pairs), *touches]


def reactions(m: Description, pairs: Iterable[tuple[Joint, str, str]]) -> list[Component]:
    """Return the forces of the joints, on either side, and the shaking force."""
    rub = {each.joint for each in m.friction}
    result: list[Component] = []
    for joint, on, of in pairs:
        result += _joint_force(joint, on, of, joint.guide is not None or joint.name in rub)
        if len(joint.bodies) == 2:
            other = _joint_force(joint, of, on, joint.guide is not None or joint.name in rub)
            result += [each._replace(reverse=True, owners=(f"{joint.name}.{of}",)) for each in other]
    shaking = vector(("shaking",), "shaking_", FORCE, Shaking())
    shaking.append(Component(("shaking", "moment_N_m"), "shaking_moment_N_m", ShakingMoment()))
    return result + called(shaking, "shaking")


def _joint_force(joint: Joint, on: str, of: str, turns: bool) -> list[Component]:
    """The force and the moment of a joint on a body; a pin has a moment where it rubs."""
    path, lead = ("reactions", (joint.name, on, of)), f"{joint.name}_{of}_on_{on}_"
    result = vector(path, lead, FORCE, JointForce(joint.key, on))
    key = JointMoment(joint.key, on) if turns else NOTHING
    result.append(Component((*path, "moment_N_m"), f"{lead}moment_N_m", key))
    side, kind = f"{joint.name}.{on}", joint.key.partition(":")[0]
    return [
        each._replace(
            names=(f"{side}.{_word(each)}", f"{side}.{kind}.{_word(each)}"),
            owners=(joint.name, on, of, side, f"{side}.{kind}"),
        )
        for each in result
    ]
