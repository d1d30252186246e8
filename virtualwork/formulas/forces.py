"""The quantities of forces: efforts of the inputs, what joints carry and rub, what shakes the ground, single loads.

Friction enters a tape (`friction 0` …, see `pose_forces`) and is exchanged for `Rub` until the two agree. A further input of such
a tape: `slip 0`, which way the first contact slips, ±1.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar

from dalembert.arithmetic.recorded import RECORDED, bare
from virtualwork.describe.description import Description
from virtualwork.formulas.kinematics import Angle
from virtualwork.formulas.numbers import Number, times
from virtualwork.formulas.quantity import Quantity, Recording
from virtualwork.plan.steps import joints, joints_at

if TYPE_CHECKING:
    from virtualwork.formulas.pose_forces import PoseForces


class Force(Quantity):
    """A quantity that the loads have a part in."""

    is_force = True
    is_rubbed: ClassVar[bool] = True
    """Whether the friction of joints may have a part in it."""

    def steps(self, recording: Recording) -> tuple[tuple[Any, ...], int]:
        """The steps that it depends on, as often differentiated as the loads need."""
        return super().steps(recording)[0], recording.forces.case.targets()[1]

    def write(self, recording: Recording) -> Number:
        return self.value(recording.forces)

    def value(self, forces: PoseForces) -> Number:
        """Its value over one pose, formed once; 0 where it is zero throughout."""
        if self not in forces.formed:
            value = self.form(forces)
            forces.formed[self] = 0.0 if value is None else value
        return forces.formed[self]

    def form(self, forces: PoseForces) -> Number:
        """Its formula over one pose; None is zero."""
        raise NotImplementedError

    @property
    def family(self) -> tuple[type[Quantity], int]:
        return Force, 0

    @classmethod
    def every(cls, m: Description, order: int) -> Iterator[Quantity]:
        yield from (Effort(j) for j in range(len(m.inputs)))
        yield from (Reaction(joint.name, joint.bodies[-1]) for joint in joints(m))


class Effort(Force, kind="effort"):
    """The effort at an input by virtual work, N·m, or N at a slide."""

    input: int

    def form(self, forces: PoseForces) -> Number:
        return forces.efforts[self.input]


class Generalized(Force, kind="generalized"):
    """The effort as if every motor sat on the body that its angle is measured from."""

    input: int

    def form(self, forces: PoseForces) -> Number:
        return forces.generalized(self.input)


class NewtonEuler(Force, kind="newton-euler"):
    """The effort at an input by Newton and Euler."""

    is_joint_force = True
    input: int

    def form(self, forces: PoseForces) -> Number:
        return forces.newton_euler(self.input)


class JointForce(Force, kind="force"):
    """The force of a joint, by its key, on a body, N."""

    is_vector = is_joint_force = True
    joint: str
    body: str

    def form(self, forces: PoseForces) -> Number:
        return forces.force(self.joint, self.body)


class JointMoment(Force, kind="moment"):
    """The moment of a joint, by its key, on a body about the joint's point, N·m: a guide's, or a pin's friction."""

    is_joint_force = True
    joint: str
    body: str

    def form(self, forces: PoseForces) -> Number:
        return forces.moment(self.joint, self.body)


class Reaction(Force, kind="reaction"):
    """The force of all joints of a name on a body, N: of a pin, and of the guide its point runs in."""

    is_vector = is_joint_force = True
    name: str
    body: str

    def form(self, forces: PoseForces) -> Number:
        here = joints_at(forces.order.joints, self.name, self.body)
        return sum((JointForce(joint.key, self.body).value(forces) for joint in here), 0.0)


class Contact(Force, kind="contact"):
    """How hard a cam, from 0, presses on its follower, N."""

    is_joint_force = True
    cam: int

    def form(self, forces: PoseForces) -> Number:
        return forces.contact(self.cam)


class MeshForce(Force, kind="mesh"):
    """The tooth force of a rack along its slide, N, on the link of the guide; of a gear or a belt the torque for a share of 1."""

    is_joint_force = True
    mesh: int

    def form(self, forces: PoseForces) -> Number:
        return forces.mesh(self.mesh)


class MeshTorque(Force, kind="mesh torque"):
    """What a gear, a belt or a rack turns a link by, N·m."""

    is_joint_force = True
    mesh: int
    body: str

    def form(self, forces: PoseForces) -> Number:
        return times(forces.mechanism.meshes[self.mesh].torques[self.body], forces.mesh(self.mesh))


class ToothPlace(Force, kind="teeth at"):
    """The pitch point of a rack's wheel, m."""

    is_rubbed = False
    is_vector = is_joint_force = True
    mesh: int

    def form(self, forces: PoseForces) -> Number:
        return forces.tooth_place(self.mesh)


class Shaking(Force, kind="shaking"):
    """The shaking force on the ground, N."""

    is_rubbed = False
    is_vector = True

    def form(self, forces: PoseForces) -> Number:
        return forces.shaking()[0]


class ShakingMoment(Force, kind="shaking moment"):
    """The shaking moment about the ground's origin, N·m."""

    is_rubbed = False

    def form(self, forces: PoseForces) -> Number:
        return forces.shaking()[1]


class Applied(Force, kind="applied"):
    """What acts on a link but its weight and inertia, N, reduced to its centre of mass."""

    is_vector = True
    link: str

    def form(self, forces: PoseForces) -> Number:
        return forces.applied(self.link)[0]


class AppliedMoment(Force, kind="applied moment"):
    """The moment of the same about the centre of mass, N·m."""

    link: str

    def form(self, forces: PoseForces) -> Number:
        return forces.applied(self.link)[1]


# --- one load alone, for free-body diagrams ----------------------------------------------------------------------------
class LoadTorque(Force, kind="load torque"):
    """A torque of the load case, by its number, N·m; those of friction come last."""

    is_rubbed = False
    number: int

    def form(self, forces: PoseForces) -> Number:
        return forces.case.everything[self.number].form(forces.pose)


class Load(LoadTorque, kind="load"):
    """A force of the load case, by its number, N."""

    is_vector = True


class LoadPlace(Force, kind="load at"):
    """Where a force of the load case acts, m."""

    is_rubbed = False
    is_vector = True
    number: int

    def form(self, forces: PoseForces) -> Number:
        return forces.load_place(self.number)


class Rail(Force, kind="rail"):
    """The unit vector along a guide, in which an input drives."""

    is_rubbed = False
    is_vector = is_joint_force = True
    guide: int

    def form(self, forces: PoseForces) -> Number:
        return forces.rail(self.guide)


# --- what is solved outside of a tape ----------------------------------------------------------------------------------
class Bearing(Force, kind="bearing"):
    """The force that a contact with friction bears, N: of a pin complex, of a guide along its normal."""

    is_vector = is_joint_force = True
    contact: int

    def form(self, forces: PoseForces) -> Number:
        return forces.bearing(self.contact)


class RubbingRate(Force, kind="rubbing"):
    """The rate at which a contact slides: rad/s of a pin, m/s of a guide."""

    is_rubbed = False
    contact: int

    def form(self, forces: PoseForces) -> Number:
        return forces.rubbing_rate(self.contact)


class SlippingRate(Force, kind="slipping"):
    """The rate at which a contact slides; 0 where its parts do not move against each other, but for rounding."""

    is_rubbed = False
    contact: int

    def form(self, forces: PoseForces) -> Number:
        return forces.slipping_rate(self.contact)


class Entry(Force, kind="entry"):
    """An entry of the equations of all links, A f + b = 0 (`statics`): of A, or of b (column None)."""

    is_joint_force = True
    row: int
    column: int | None

    def form(self, forces: PoseForces) -> Number:
        return forces.system[self.row, self.column]


class Over(Quantity, kind="over"):
    """What the table of a load, by its number, is over; an angle of unknown turns in (−π, π]."""

    number: int

    def write(self, recording: Recording) -> Number:
        load = recording.tables[self.number]
        if load.axis == "time":
            return recording.recorder.input("time")
        if load.axis == "input":
            return recording.st.inputs[0]
        angle = recording.plan.angles[load.body]
        if load.axis == "angle" and not angle.bases:
            return recording.st.affine(angle)
        return recording.value(Angle(load.body, int(load.axis == "speed")))


class Rub(Quantity, kind="rub"):
    """The friction of a contact by the force that it bears."""

    contact: int

    def write(self, recording: Recording) -> Number:
        joint, *_, coefficient, radius = recording.forces.case.contacts[self.contact]
        slip = recording.recorder.input(f"slip {self.contact}") * bare(coefficient)
        arm = slip * bare(radius) if joint.guide is None else slip
        return -(arm * abs(recording.value(Bearing(self.contact))))


class Slip(Quantity, kind="slip"):
    """Which way a contact slips: ±1, or 0."""

    contact: int

    def write(self, recording: Recording) -> Number:
        rate = recording.value(SlippingRate(self.contact))
        return RECORDED.select(rate, 1.0, RECORDED.select(-rate, -1.0, 0.0))
