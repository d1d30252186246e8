"""Least squares and minimax beside hsbalance: `python benchmarks/field.py`, with hsbalance installed beside dalembert.

24 sensors and 8 planes at random; the two in turn in one process, the least of several repetitions each. The error is that
of the objective: against the dual bound, which no corrections can undercut.
"""

from __future__ import annotations

import os
import sys
import time
import warnings
from collections.abc import Callable
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from balancing import least_squares, minimax


def seconds(call: Callable[[], Any], repeat: int) -> float:
    call()
    best = float("inf")
    for _ in range(5):
        start = time.process_time()
        for _ in range(repeat):
            call()
        best = min(best, (time.process_time() - start) / repeat)
    return best


def main() -> None:
    rng = np.random.default_rng(0)
    alpha = rng.normal(size=(24, 8)) + 1j * rng.normal(size=(24, 8))
    v = rng.normal(size=24) + 1j * rng.normal(size=24)
    ours = {"least squares": lambda: least_squares(alpha, v), "minimax": lambda: minimax(alpha, v)}
    theirs: dict[str, Callable[[], Any]] = {}
    try:
        import hsbalance

        matrix = hsbalance.Alpha()
        matrix.add(direct_matrix=alpha)
        theirs = {
            "least squares": lambda: hsbalance.LeastSquares(A=v[:, None], alpha=matrix).solve(),
            "minimax": lambda: hsbalance.Min_max(A=v[:, None], alpha=matrix).solve(),
        }
    except ImportError:
        print("hsbalance is not installed: measured alone", file=sys.stderr)
    bound = minimax(alpha, v).bound
    assert bound is not None
    optimum = {"least squares": float(np.linalg.norm(least_squares(alpha, v).residual)), "minimax": bound}
    norm = {"least squares": np.linalg.norm, "minimax": lambda r: np.abs(r).max()}
    print("work,program,ms,objective,relative error of the objective")
    for work, call in ours.items():
        rows = [("dalembert", seconds(call, 50), call().corrections)]
        if work in theirs:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                try:
                    rows.append(("hsbalance", seconds(theirs[work], 5), np.ravel(theirs[work]())))
                except Exception as error:  # its solver's free licence ends at 200 rows
                    print(f"{work}: hsbalance fails: {error}", file=sys.stderr)
        for program, time_, w in rows:
            value = float(norm[work](v + alpha @ w))
            print(f"{work},{program},{time_ * 1e3:.3f},{value:.12f},{value / optimum[work] - 1:.2e}")


if __name__ == "__main__":
    main()
