"""What a mechanism at rest has: the potential of its loads, its second variation, and the generalized mass.

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
from virtualwork.plan.steps import path_reads

if TYPE_CHECKING:
    from virtualwork.formulas.pose_forces import PoseForces


def potential(loads: Iterable[Load], pose: LoadedPose) -> Number:
    """V, J; NaN where a load has no potential."""
    total: Number = None
    for load in loads:
        total = plus(total, load.potential(pose))
    return total


def second_variation(loads: Iterable[Load], pose: LoadedPose, rates: Rates) -> Number:
    """The second variation of the loads' work, along the direction of the rates."""
    total: Number = None
    for load in loads:
        total = plus(total, load.second(pose, rates))
    return total


def mass(case: LoadCase, pose: LoadedPose, i: int, j: int) -> Number:
    """M_ij: kg·m² between two angles, kg between two slides."""
    total: Number = None
    for body, of in case.mechanism.rigid.items():
        if of.mass:
            first, second = (pose.coefficient(case.path(body, of.center), way) for way in (i, j))
            if first is not None and second is not None:
                total = plus(total, of.mass * dot(first, second))
        if of.inertia:
            turned = times(pose.turning(body, i), pose.turning(body, j))
            total = plus(total, times(turned, of.inertia))
    return total


def mass_reads(case: LoadCase) -> list[str]:
    """What the generalized mass depends on."""
    keys: set[str] = set()
    for body, of in case.mechanism.rigid.items():
        if of.mass:
            keys |= path_reads(case.path(body, of.center))
        if of.inertia:
            keys.add(f"angle:{body}")
    return sorted(keys)


class Potential(Force, kind="potential"):
    """V, J."""

    is_rubbed = False

    def form(self, forces: PoseForces) -> Number:
        return potential(forces.case.loads, forces.pose)


class Mass(Force, kind="mass"):
    """An entry of the generalized mass."""

    is_rubbed = False
    row: int
    column: int

    def form(self, forces: PoseForces) -> Number:
        forces.solve(mass_reads(forces.case), 1)
        return mass(forces.case, forces.pose, self.row, self.column)


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
            variation = second_variation(loads, forces.pose, recording.by[self.row])
            return None if variation is None else -variation
        inputs = range(len(recording.mechanism.inputs))
        pair = recording.rates_of(
            len(inputs), [[1.0] if j in (self.row, self.column) else [] for j in inputs]
        )
        for order in (1, 2):
            pair.advance(recording.plan.needed(reads), order)
        own = [recording.value(Stiffness(j, j)) for j in (self.row, self.column)]
        variation = second_variation(loads, forces.pose, pair)
        return -0.5 * plus(plus(variation, own[0]), own[1])
