"""The effort at the inputs by virtual work: the velocity coefficients are the virtual displacements.

For a unit of input j every point moves by K_j = ∂P/∂q_j and every link turns by κ_j = ∂θ/∂q_j, so that by
d'Alembert's principle (Riul, unit II, eqs. 3 and 5, divided by the input's own displacement)

    τ_j + Σ F·K_j + Σ T κ_j = 0,      F, T with the inertia loads −m a_G and −I α.

Joint forces do no work and do not appear. A load whose point cannot move has no K and is never evaluated.

Every K_j is Σ i z e^{iθ} κ_j over the links between the ground and the point. The effort gathers the loads by links
first, Q_θ = Σ T + Σ (z e^{iθ}) × F, and is −Σ Q_θ κ_j; the ledger takes the loads one by one.
"""

from __future__ import annotations

from virtualwork.formulas.load_paths import LoadPaths
from virtualwork.formulas.loaded_pose import LoadedPose
from virtualwork.formulas.numbers import Number, plus, times


def generalized_force(paths: LoadPaths, pose: LoadedPose, j: int) -> Number:
    """The work of the loads for a unit of input j; None where they do none."""
    total: Number = None
    for body, guide, load in paths.working:
        moved = pose.by[j].slide[guide][0] if body is None else pose.turning(body, j)
        # what cannot move is not evaluated
        if moved is not None:
            value = paths.value(pose, load)
            total = plus(total, value if isinstance(moved, float) and moved == 1 else times(value, moved))
    return total
