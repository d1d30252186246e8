"""Balancing of rotors: from known eccentric masses and from measured vibration.

An unbalance is a complex number m·r·e^{iθ} (kg·m, rad); corrections are what to ADD.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from dalembert.on_use import on_use

if TYPE_CHECKING:
    from balancing.amplitudes import AmplitudeFit, influence_from_amplitudes
    from balancing.balance import Balance, least_squares, minimax
    from balancing.correction import CoincidentPlanes, Correction, Unbalances, correct
    from balancing.dependence import (
        DependentPlanes,
        DependentTrials,
        condition_number,
        plane_significance,
        unseen,
    )
    from balancing.doubt import Drift, drift, outlier_probability, phase_sense, repeats, robust_fit
    from balancing.flywheel import TorqueCycle, torque_cycle
    from balancing.indexing import Indexed, index_balancing
    from balancing.influence import influence_coefficients
    from balancing.limited import Infeasible, NotConverged
    from balancing.log_balance import LogBalance, region_factor, spread
    from balancing.modal import ModalCorrection, UnreachedMode, modal_corrections, shapes_at
    from balancing.next_run import NextRun, suggest_run
    from balancing.placement import Placement, drill_depth, place, transfer
    from balancing.prior import Prior, fit_with_prior, pooled_prior, stored_prior
    from balancing.rotor import by_size
    from balancing.rounding import influence_error
    from balancing.run_log import JointFit, Undetermined, determined, initial_alone, joint_fit
    from balancing.runs import read_runs
    from balancing.synchronous import OncePerTurn, once_per_turn
    from balancing.tolerance import (
        GRADES,
        ZONE_BOUNDARIES,
        allocate,
        api_unbalance,
        grade_value,
        journal_loads,
        mil_unbalance,
        permissible_unbalance,
        severity_zone,
    )
    from balancing.trial import (
        ErrorBudget,
        TrialEffect,
        error_budget,
        trial_effect,
        trial_unbalance,
    )
    from balancing.unbalance import initial_unbalance
    from balancing.weights import FewestWeights, fewest_from_stock, place_from_stock, place_weights

# A rotor with known masses needs none of what vibration needs: each module is loaded when one of its names is used.
_HOMES = {
    "balancing.amplitudes": "AmplitudeFit influence_from_amplitudes",
    "balancing.balance": "Balance least_squares minimax",
    "balancing.correction": "CoincidentPlanes Correction Unbalances correct",
    "balancing.dependence": "DependentPlanes DependentTrials condition_number plane_significance unseen",
    "balancing.doubt": "Drift drift outlier_probability phase_sense repeats robust_fit",
    "balancing.flywheel": "TorqueCycle torque_cycle",
    "balancing.indexing": "Indexed index_balancing",
    "balancing.influence": "influence_coefficients",
    "balancing.runs": "read_runs",
    "balancing.run_log": "JointFit Undetermined determined initial_alone joint_fit",
    "balancing.limited": "Infeasible NotConverged",
    "balancing.modal": "ModalCorrection UnreachedMode modal_corrections shapes_at",
    "balancing.log_balance": "LogBalance region_factor spread",
    "balancing.next_run": "NextRun suggest_run",
    "balancing.synchronous": "OncePerTurn once_per_turn",
    "balancing.prior": "Prior fit_with_prior pooled_prior stored_prior",
    "balancing.placement": "Placement drill_depth place transfer",
    "balancing.weights": "FewestWeights fewest_from_stock place_from_stock place_weights",
    "balancing.rotor": "by_size",
    "balancing.rounding": "influence_error",
    "balancing.tolerance": "GRADES ZONE_BOUNDARIES allocate api_unbalance grade_value journal_loads mil_unbalance permissible_unbalance "
    "severity_zone",
    "balancing.trial": "ErrorBudget TrialEffect error_budget trial_effect trial_unbalance",
    "balancing.unbalance": "initial_unbalance",
}

__getattr__, __dir__ = on_use(globals(), _HOMES)

__all__ = [
    "GRADES",
    "ZONE_BOUNDARIES",
    "AmplitudeFit",
    "Balance",
    "CoincidentPlanes",
    "Correction",
    "DependentPlanes",
    "DependentTrials",
    "Drift",
    "ErrorBudget",
    "FewestWeights",
    "Indexed",
    "Infeasible",
    "JointFit",
    "LogBalance",
    "ModalCorrection",
    "NextRun",
    "NotConverged",
    "OncePerTurn",
    "Placement",
    "Prior",
    "TorqueCycle",
    "TrialEffect",
    "Unbalances",
    "Undetermined",
    "UnreachedMode",
    "allocate",
    "api_unbalance",
    "by_size",
    "condition_number",
    "correct",
    "determined",
    "drift",
    "drill_depth",
    "error_budget",
    "fewest_from_stock",
    "fit_with_prior",
    "grade_value",
    "index_balancing",
    "influence_coefficients",
    "influence_error",
    "influence_from_amplitudes",
    "initial_alone",
    "initial_unbalance",
    "joint_fit",
    "journal_loads",
    "least_squares",
    "mil_unbalance",
    "minimax",
    "modal_corrections",
    "once_per_turn",
    "outlier_probability",
    "permissible_unbalance",
    "phase_sense",
    "place",
    "place_from_stock",
    "place_weights",
    "plane_significance",
    "pooled_prior",
    "read_runs",
    "region_factor",
    "repeats",
    "robust_fit",
    "severity_zone",
    "shapes_at",
    "spread",
    "stored_prior",
    "suggest_run",
    "torque_cycle",
    "transfer",
    "trial_effect",
    "trial_unbalance",
    "unseen",
]
