"""Corrections from measured vibration by other packages."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from importlib import import_module
from typing import Any

import numpy as np

from benchmarks.speed.field import as_complex
from benchmarks.speed.measure import Measurement, measured, worst
from benchmarks.truth import reference


def by_hsbalance(quick: bool) -> Iterator[Measurement]:
    """Least squares and minimax by hsbalance, which hands them to cvxpy."""
    # cvxpy would take this solver of hsbalance's dependencies, which refuses 24 × 8 without a bought licence
    sys.modules.setdefault("xpress", None)  # type: ignore[arg-type]
    hs = import_module("hsbalance")

    def model(kind: str, alpha: Any, v: Any) -> Any:
        matrix = hs.Alpha()
        matrix.add(direct_matrix=alpha)
        return getattr(hs, kind)(A=v[:, None], alpha=matrix)

    cases = reference("least_squares")["cases"]
    for case in cases[:1] if quick else cases:
        alpha, v, true = (as_complex(case[key]) for key in ("influence", "initial", "corrections"))

        def corrections(alpha: Any = alpha, v: Any = v) -> Any:
            return np.ravel(model("LeastSquares", alpha, v).solve())

        yield measured(
            "field",
            "least squares, 24 sensors × 8 planes",
            "LeastSquares",
            corrections,
            error=worst(corrections(), true),
            condition=case["condition"],
            budget=0.1,
        )
    known = reference("minimax")
    alpha, v = as_complex(known["influence"]), as_complex(known["initial"])

    def smallest() -> Any:
        return np.ravel(model("Min_max", alpha, v).solve())

    reached = float(np.abs(alpha @ smallest() + v).max())
    off = abs(reached - known["objective"]) / known["objective"]
    yield measured("field", "minimax, 24 sensors × 8 planes", "Min_max", smallest, error=off)
