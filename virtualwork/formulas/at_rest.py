"""What a mechanism at rest has: the work of its loads, their potential, its second variation, and the generalized mass.

With K_j = ∂P/∂q_j and κ_j = ∂θ/∂q_j the mass is M_jk = Σ m K_j·K_k + Σ I κ_j κ_k (Meriam & Kraige, Dynamics, §8/5; Lagrange). The
stiffness is V″ = −∂Q/∂q (Lagrange and Dirichlet).
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from virtualwork.formulas.forces import Force
from virtualwork.formulas.load_case import LoadCase
from virtualwork.formulas.loaded_pose import LoadedPose
from virtualwork.formulas.loads import Load
from virtualwork.formulas.numbers import Number, dot, plus, times
from virtualwork.formulas.quantity import Recording
from virtualwork.formulas.rates import Rates

if TYPE_CHECKING:
    from virtualwork.formulas.pose_forces import PoseForces


def _second_variation(loads: Iterable[Load], pose: LoadedPose, rates: Rates) -> Number:
    """The second variation of the loads' work, along the direction of the rates."""
    total: Number = None
    for load in loads:
        total = plus(total, load.second(pose, rates))
    return total


class Work(Force, kind="work"):
    """The generalized force Q_j: the virtual work of the loads, one by one, for a unit of an input."""

    is_rubbed = False
    input: int

    def form(self, forces: PoseForces) -> Number:
        total: Number = None
        for load in forces.case.loads:
            total = plus(total, self.counted(load.power(forces.pose, self.input)))
        return total

    def counted(self, work: Number) -> Number:
        """What one load adds."""
        return work


class WorkSize(Work, kind="work size"):
    """The sum of the sizes of its terms."""

    def counted(self, work: Number) -> Number:
        return None if work is None else abs(work)


class Potential(Force, kind="potential"):
    """V, J; NaN where a load has no potential."""

    is_rubbed = False

    def form(self, forces: PoseForces) -> Number:
        total: Number = None
        for load in self.loads(forces.case):
            total = plus(total, load.potential(forces.pose))
        return total

    def loads(self, case: LoadCase) -> list[Load]:
        """Those whose potential it is."""
        return case.loads


class Mass(Force, kind="mass"):
    """An entry of the generalized mass: kg·m² between two angles, kg between two slides."""

    is_rubbed = False
    row: int
    column: int

    def form(self, forces: PoseForces) -> Number:
        forces.solve_places()
        pose, total = forces.pose, None
        for body, of in forces.mechanism.rigid.items():
            if of.mass:
                path = forces.case.path(body, of.center)
                first, second = (pose.coefficient(path, way) for way in (self.row, self.column))
                if first is not None and second is not None:
                    total = plus(total, of.mass * dot(first, second))
            if of.inertia:
                turned = times(pose.turning(body, self.row), pose.turning(body, self.column))
                total = plus(total, times(turned, of.inertia))
        return total


class Stiffness(Force, kind="stiffness"):
    """An entry of V″; off the diagonal by polarization of second derivatives along the inputs and their pairs."""

    is_rubbed = False
    row: int
    column: int

    def write(self, recording: Recording) -> Number:
        forces, reads = recording.forces, recording.forces.case.targets()[0]
        recording.solve(reads, 2)
        loads = forces.case.loads
        if self.row == self.column:
            variation = _second_variation(loads, forces.pose, recording.by[self.row])
            return None if variation is None else -variation
        inputs = range(len(recording.mechanism.inputs))
        pair = recording.rates_of(
            len(inputs), [[1.0] if j in (self.row, self.column) else [] for j in inputs]
        )
        for order in (1, 2):
            pair.advance(recording.plan.needed(reads), order)
        own = [recording.value(Stiffness(j, j)) for j in (self.row, self.column)]
        variation = _second_variation(loads, forces.pose, pair)
        return -0.5 * plus(plus(variation, own[0]), own[1])
