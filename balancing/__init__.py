"""Balancing of rotors: from known eccentric masses and from measured vibration.

An unbalance is a complex number m·r·e^{iθ} (kg·m, rad); corrections are what to ADD.
"""

from balancing.amplitudes import AmplitudeFit, influence_from_amplitudes
from balancing.confidence import Readings, spread
from balancing.correction import CoincidentPlanes, Correction, Unbalances, correct
from balancing.influence import (
    Balance,
    DependentPlanes,
    DependentTrials,
    Infeasible,
    condition_number,
    influence_coefficients,
    least_squares,
    plane_significance,
    unseen,
)
from balancing.minimax import minimax
from balancing.placement import Placement, drill_depth, place, place_from_stock, transfer
from balancing.rotor import by_size
from balancing.tolerance import GRADES, allocate, grade_value, permissible_unbalance
from balancing.trial import (
    ErrorBudget,
    Indexed,
    TrialEffect,
    error_budget,
    index_balancing,
    trial_effect,
    trial_unbalance,
)

__all__ = [
    "GRADES",
    "AmplitudeFit",
    "Balance",
    "CoincidentPlanes",
    "Correction",
    "DependentPlanes",
    "DependentTrials",
    "ErrorBudget",
    "Indexed",
    "Infeasible",
    "Placement",
    "Readings",
    "TrialEffect",
    "Unbalances",
    "allocate",
    "by_size",
    "condition_number",
    "correct",
    "drill_depth",
    "error_budget",
    "grade_value",
    "index_balancing",
    "influence_coefficients",
    "influence_from_amplitudes",
    "least_squares",
    "minimax",
    "permissible_unbalance",
    "place",
    "place_from_stock",
    "plane_significance",
    "spread",
    "transfer",
    "trial_effect",
    "trial_unbalance",
    "unseen",
]
