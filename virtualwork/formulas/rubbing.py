"""Joint friction written down: what each contact's friction is enters, and what it would have to be is a quantity.

Whoever runs the tape exchanges one for the other until they agree, as `reactions.settle` does over blocks.
Further inputs of the tape: `friction 0`, of the first contact the torque of a pin or the force along a guide, and `slip 0`, which
way it slips, ±1.
"""

from __future__ import annotations

from dalembert.arithmetic.recorded import RECORDED, Number, bare
from virtualwork.formulas.block import Block
from virtualwork.formulas.load_paths import LoadPaths
from virtualwork.formulas.numbers import dot, minus, plus
from virtualwork.formulas.quantity import Quantity
from virtualwork.formulas.reactions import JointForces
from virtualwork.formulas.recording import Recording


class Rubbing(Recording):
    """The formulas of an assembly; the friction of each contact enters."""

    @property
    def forces(self) -> tuple[LoadPaths, JointForces, Block]:
        """The loads over the recorded pose; the friction of each joint enters."""
        known = self._forces
        paths, of, block = super().forces
        if known is None and paths.case.contacts:
            self.solve(*paths.case.targets(paths.case.places))
            for n, (joint, *_) in enumerate(paths.case.contacts):
                rub = self.recorder.input(f"friction {n}")
                block.friction[n] = rub if joint.guide is None else rub * of.rail(block, joint.guide)
        return paths, of, block

    @property
    def contacts(self) -> int:
        """How many there are."""
        return len(self.forces[0].case.contacts) if self.mechanism.friction else 0

    def joint_moment(self, joint: str, body: str) -> Number:
        value = super().joint_moment(joint, body)
        paths, _, block = self.forces
        for load in paths.case.friction:
            if load.path is None and load.joint == joint and load.body == body:
                value = plus(value, load.form(block))
        return value


class Rub(Quantity, kind="rub"):
    """The friction of a contact by the force that it bears."""

    contact: int

    def write(self, recording: Recording) -> Number:
        paths, of, block = recording.placed_forces()
        joint, body, _, coefficient, radius = paths.case.contacts[self.contact]
        force = plus(of.on_side(block, (joint.key, body)), of.borne(block, joint, body))
        if force is None:
            return None
        slip = recording.recorder.input(f"slip {self.contact}") * bare(coefficient)
        if joint.guide is None:
            return -(slip * bare(radius)) * abs(force)
        return -slip * abs(dot(force, 1j * of.rail(block, joint.guide)))


class Slip(Quantity, kind="slip"):
    """Which way a contact slips: ±1, or 0."""

    contact: int

    def write(self, recording: Recording) -> Number:
        paths, _, block = recording.placed_forces()
        joint, body, other, *_ = paths.case.contacts[self.contact]
        if joint.guide is None:
            rate = minus(block.omega(body), block.omega(other))
        else:
            rate = block.slide_rate(joint.guide)
        if rate is None:
            return None
        rate = bare(rate)
        return RECORDED.select(rate, 1.0, RECORDED.select(-rate, -1.0, 0.0))
