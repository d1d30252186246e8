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
from virtualwork.formulas.asked import FORCES, JOINTS, Key
from virtualwork.formulas.rubbing import Rubbing
from virtualwork.formulas.statics import Column, equations, unknowns


class Balanced(Rubbing):
    """The formulas of an assembly; where its statics is redundant, the unknown forces enter.

    A further key of `value`: ("over", number), what a load's table is over.
    """

    @property
    def redundant(self) -> bool:
        """Whether they do."""
        return bool(self.forces[0].order.redundant)

    def takes(self, keys: Iterable[Key]) -> bool:
        """Whether quantities can be written down: not where statics is redundant with friction, racks or cams."""
        m, kinds = self.mechanism, {key[0] for key in keys}
        concerned = FORCES if m.friction else JOINTS if m.racks or m.cams else set[str]()
        return kinds.isdisjoint(concerned) or not self.redundant

    @cached_property
    def unknown_forces(self) -> list[Column]:
        """The joint forces and torques that enter."""
        return unknowns(self.forces[1])

    @cached_property
    def system(self) -> dict[tuple[int, int | None], Number]:
        """The entries of A by row and column, those of b by row and None."""
        _, of, block = self._places()
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
        return f * bare(self.mechanism.size) if kind in ("moment", "torque") else f

    def _over(self, number: int) -> Number:
        """What a table is over; an angle of unknown turns in (−π, π]."""
        load = self.tables[number]
        if load.axis == "time":
            return self.recorder.input("time")
        if load.axis == "input":
            return self.st.inputs[0]
        angle = self.plan.angles[load.body]
        if load.axis == "angle" and not angle.bases:
            return self.st.affine(angle)
        return self.value(("angle", load.body, int(load.axis == "speed")))

    def _newton_euler(self, j: int) -> Number:
        if not self.redundant:
            return super()._newton_euler(j)
        return self._bears("force" if self.mechanism.inputs[j].is_slide else "torque", str(j))

    def _force(self, joint: str, body: str) -> Number:
        if not self.redundant:
            return super()._force(joint, body)
        _, of, block = self._places()
        at = of.by_key[joint]
        if at.guide is not None:
            sign = 1.0 if body == self.mechanism.guides[at.guide].link else -1.0
            return (sign * self._bears("normal", joint)) * (1j * of.rail(block, at.guide))
        if body == GROUND:
            return -sum((self._force(joint, other) for other in at.bodies if other != GROUND), 0j)
        return self._bears("fx", joint, body) + 1j * self._bears("fy", joint, body)

    def _moment(self, joint: str, body: str) -> Number:
        if not self.redundant:
            return super()._moment(joint, body)
        guide = self.forces[1].by_key[joint].guide
        if guide is None or not self.mechanism.guides[guide].is_slider:
            return None
        on_link = self._bears("moment", joint)
        return on_link if body == self.mechanism.guides[guide].link else -on_link
