"""Redundant statics written down: the equations of all links, and the joint forces by unknowns that enter the tape.

A tape solves no system whose rank is not known. So the entries of A and b (`statics`) are outputs of one tape, whoever runs it
solves A f + b = 0, and what follows from f (`f 0`, `f 1` …; torques divided by the size) is on another.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property

from dalembert.arithmetic.recorded import Number, bare
from dalembert.arithmetic.tape import Tape
from virtualwork.describe.parts import GROUND
from virtualwork.formulas.block import Block
from virtualwork.formulas.kinematics import Angle
from virtualwork.formulas.numbers import plus
from virtualwork.formulas.quantity import Quantity
from virtualwork.formulas.recording import Recording
from virtualwork.formulas.rubbing import Rubbing
from virtualwork.formulas.statics import Column, equations, mesh_column, unknowns


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


class Balanced(Rubbing):
    """The formulas of an assembly; where its statics is redundant, the unknown forces enter."""

    @property
    def redundant(self) -> bool:
        """Whether they do."""
        return bool(self.forces[0].order.redundant)

    def takes(self, quantities: Iterable[Quantity]) -> bool:
        """Whether quantities can be written down: not forces where statics is redundant, with friction."""
        concerned = bool(self.mechanism.friction) and any(each.is_force for each in quantities)
        return not (concerned and self.redundant)

    @cached_property
    def unknown_forces(self) -> list[Column]:
        """The joint forces and torques that enter."""
        return unknowns(self.forces[1])

    @cached_property
    def system(self) -> dict[tuple[int, int | None], Number]:
        """The entries of A by row and column, those of b by row and None."""
        _, of, block = self.placed_forces()
        for touch in of.paths.touches.every:
            self.solve(touch.targets, 0)
        entries: dict[tuple[int, int | None], Number] = {}
        for row, column, part in equations(of, block):
            entries[row, column] = entries.get((row, column), 0.0) + bare(part)
        return entries

    @cached_property
    def statics(self) -> Tape:
        """The tape of the entries of `system`, in its order."""
        named = {f"{row} {column}": value for (row, column), value in self.system.items()}
        return self.recorder.tape(named)

    def _bears(self, kind: str, key: str, body: str = "") -> Number:
        f = self.recorder.input(f"f {self.unknown_forces.index((kind, key, body))}")
        return f * bare(self.mechanism.size) if kind in ("moment", "gear", "torque") else f

    def _tooth(self, _: Block, mesh: int) -> Number:
        """The tooth force of a rack."""
        return self._bears(*mesh_column(self.mechanism, mesh))

    def newton_euler(self, j: int) -> Number:
        if not self.redundant:
            return super().newton_euler(j)
        return self._bears("force" if self.mechanism.inputs[j].is_slide else "torque", str(j))

    def joint_force(self, joint: str, body: str) -> Number:
        if not self.redundant:
            return super().joint_force(joint, body)
        _, of, block = self.placed_forces()
        at = of.by_key[joint]
        if at.guide is not None:
            sign = 1.0 if body == self.mechanism.guides[at.guide].link else -1.0
            return (sign * self._bears("normal", joint)) * (1j * of.rail(block, at.guide))
        if body == GROUND:
            return -sum((self.joint_force(joint, other) for other in at.bodies if other != GROUND), 0j)
        force = self._bears("fx", joint, body) + 1j * self._bears("fy", joint, body)
        return plus(force, of.borne(block, at, body, self._tooth))

    def joint_moment(self, joint: str, body: str) -> Number:
        if not self.redundant:
            return super().joint_moment(joint, body)
        _, of, block = self.placed_forces()
        guide = of.by_key[joint].guide
        if guide is None or not self.mechanism.guides[guide].is_slider:
            return None
        on_link = plus(self._bears("moment", joint), of.beside(block, guide, self._tooth))
        return on_link if body == self.mechanism.guides[guide].link else -on_link

    def contact(self, cam: int) -> Number:
        if not self.redundant:
            return super().contact(cam)
        _, of, block = self.placed_forces()
        self.solve(of.paths.touches.every[cam].targets, 0)
        arm = self.mechanism.cam_drives[cam].guide is None
        return of.contact(
            block, cam, self._bears("contact", str(cam)) * (bare(self.mechanism.size) if arm else 1.0)
        )
