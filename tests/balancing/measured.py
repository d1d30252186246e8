"""Balances from readings whose errors are stated, as the tests of uncertainty need them."""

from __future__ import annotations

from typing import Any

import numpy as np

from balancing import JointFit, LogBalance, initial_alone, joint_fit, least_squares


def fitted(v0: Any, trials: Any = None, masses: Any = None, influence: Any = None) -> JointFit:
    """Fit an initial run with trial runs, or with coefficients that are known."""
    if influence is not None:
        return initial_alone(np.asarray(v0)[None], influence)
    readings = np.concatenate([np.asarray(v0)[None], trials])
    return joint_fit(readings, np.concatenate([np.zeros((1, np.shape(masses)[1])), masses]))


def balance(
    fit: JointFit,
    errors: tuple[float, float],
    corrections: Any = None,
    *,
    runout: Any = None,
    weights: Any = None,
    ridge: float = 0.0,
) -> LogBalance:
    """Return the balance by least squares, or with these corrections."""
    still = fit if runout is None else fit.without(runout)
    if corrections is None:
        corrections = least_squares(still.influence, still.initial, weights, ridge=ridge).corrections
    given = None if weights is None else np.asarray(weights, dtype=float)
    return LogBalance(still, np.asarray(corrections, dtype=complex), fit.stated(*errors), given, None, ridge)
