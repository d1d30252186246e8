"""Free-body diagrams: every link cut loose, with all that acts on it, inertia forces too: ΣF = 0, ΣM = 0.

Ibrahim §2.2 and §2.3, Riul, unit II, figures 3 to 5: loads, weights, joint forces, −m·a_G and −I_G·α (d'Alembert).
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from virtualwork.describe.parts import GROUND
from virtualwork.formulas.dynamics import Dynamics
from virtualwork.plan.joint_forces import pairs

if TYPE_CHECKING:
    from virtualwork.formulas.block import Block
    from virtualwork.formulas.numbers import Complexes, Number, Reals
    from virtualwork.plan.steps import Path

SHORT = {
    "weight": "W",
    "inertia force": "−m·a",
    "inertia torque": "−I·α",
    "applied force": "F",
    "applied torque": "T",
}


class Force(NamedTuple):
    """A force on a link over all poses: where it acts (m) and what it is (N), (n,) complex in ground axes."""

    name: str
    kind: str
    at: Complexes
    force: Complexes


class Torque(NamedTuple):
    """A torque on a link over all poses, (n,) N·m."""

    name: str
    kind: str
    torque: Reals


class FreeBody(NamedTuple):
    """A link cut loose."""

    link: str
    outline: dict[str, Complexes]
    """Its points, (n,) m."""
    center: Complexes
    forces: list[Force]
    torques: list[Torque]

    def resultant(self) -> tuple[Complexes, Reals]:
        """ΣF and ΣM about the centre of mass, (n,): rounding, as the link is in (dynamic) equilibrium."""
        total = sum((f.force for f in self.forces), np.zeros_like(self.center))
        moment = sum((t.torque for t in self.torques), np.zeros(len(self.center)))
        for f in self.forces:
            arm = f.at - self.center
            moment = moment + (np.conj(arm) * f.force).imag
        return total, moment


def free_bodies(dynamics: Dynamics) -> list[FreeBody]:
    """Return every link cut loose, with all that acts on it.

    Examples
    --------
    A weight of 2·9.81 N on an arm of 0.5 m, held at 0°: the bearing carries it, the drive holds its moment.

    >>> from virtualwork import Input, Link, Mechanism
    >>> arm = Mechanism({"O": 0j}, {"arm": Link({"O": 0j}, mass=2, center=0.5)}, inputs=Input(link="arm"), gravity=-9.81j)
    >>> body, = free_bodies(arm.motion(0.0).dynamics)
    >>> [(f.name, complex(f.force[0])) for f in body.forces], [(t.name, float(t.torque[0])) for t in body.torques]
    ([('W', -19.62j), ('O: ground', 19.62j)], [('T', 9.81)])
    """
    m, poses = dynamics.poses.mechanism, dynamics.poses
    effort = dynamics.effort
    over = dynamics.reactions.over
    result = {
        body: FreeBody(
            body,
            {name: poses.point(body, 0j, 0, name) for name in link.points},
            poses.point(body, m.rigid[body].center),
            [],
            [],
        )
        for body, link in m.links.items()
    }
    for load in dynamics.scene.case.everything:
        if load.body == GROUND or load.kind == "friction":
            # the friction of a joint is in its force and moment
            continue
        name = SHORT.get(load.kind, load.kind)
        if load.path is None:
            (torque,) = over(load.form)
            result[load.body].torques.append(Torque(name, load.kind, torque))
        else:
            force, at = over(load.form, partial(_position, path=load.path), kind=complex)
            result[load.body].forces.append(Force(name, load.kind, at, force))
    for joint in dynamics.reactions.joints:
        for body in joint.bodies:
            if body == GROUND:
                continue
            others = [of for _, on, of in pairs([joint]) if on == body] or [
                on for _, on, of in pairs([joint]) if of == body
            ]
            if joint.guide is None:
                at = poses.point(body, 0j, 0, joint.name)
            else:
                at = _block(dynamics, joint.guide)
            name = f"{joint.name}: {others[0]}"
            result[body].forces.append(Force(name, "joint force", at, dynamics.joint_force(joint, body)))
            moment = dynamics.joint_moment(joint, body)
            if np.any(np.nan_to_num(moment)):
                result[body].torques.append(Torque(name, "joint moment", moment))
    for j, entry in enumerate(m.inputs):
        if not entry.is_slide:
            for body, sign in ((str(entry.link), 1.0), (m.carrier(j), -1.0)):
                if body != GROUND:
                    result[body].torques.append(
                        Torque("T" if sign > 0 else "−T", "drive", sign * effort[:, j])
                    )
            continue
        i = m.guide_of(entry)
        g = m.guides[i]
        (rail,) = over(partial(dynamics.reactions.rail, guide=i), kind=complex)
        at = _block(dynamics, i)
        for body, sign in ((g.link, 1.0), (g.on, -1.0)):
            if body != GROUND:
                result[body].forces.append(
                    Force("F" if sign > 0 else "−F", "drive", at, sign * effort[:, j] * rail)
                )
    return list(result.values())


def _position(block: Block, path: Path) -> Number:
    return block.position(path)


def _block(dynamics: Dynamics, guide: int) -> Complexes:
    """Where a guide's block stands, (n,)."""
    m, poses = dynamics.poses.mechanism, dynamics.poses
    g = m.guides[guide]
    z = m.bodies[g.link][g.point]
    return np.full(poses.n, z) if g.link == GROUND else poses.point(g.link, z)
