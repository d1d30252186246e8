"""Kinematics beside the peers: time AND error of each, in one run: `python benchmarks/mechanisms.py`.

Peers that are not installed are left out and said so; `pip install pylinkage numba mechanism` brings them. Errors are
against 50 digits (mpmath), at poses spread over the sweep. Times are CPU times per pose, also as multiples of a
calibration loop of the same run (one element of the root of x² + y² over 4096 doubles).
"""

from __future__ import annotations

import math
import os
import sys
import time
import warnings

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import mpmath as mp
import numpy as np

from virtualwork import Guess, Input, Link, Mechanism
from virtualwork.newton import all_at_once

A, B, C, D = 40.0, 120.0, 80.0, 100.0  # Norton, Design of Machinery, example 4-1, mm
mp.mp.dps = 50


def cpu(call, repeat=5):
    call()
    best = math.inf
    for _ in range(repeat):
        start = time.process_time()
        call()
        best = min(best, time.process_time() - start)
    return best


def exact(q):
    """The pin between coupler and rocker on the open branch, in 50 digits."""
    b = A * mp.expj(mp.mpf(float(q)))
    d = mp.mpc(D) - b
    along = (abs(d) ** 2 + mp.mpf(B) ** 2 - mp.mpf(C) ** 2) / (2 * abs(d))
    return b + d / abs(d) * mp.mpc(along, mp.sqrt(mp.mpf(B) ** 2 - along**2))


def error(q, found):
    """Worst distance in mm at 40 poses spread over the sweep."""
    rows = np.unique(np.linspace(0, len(q) - 1, 40).astype(int))
    return max(float(abs(exact(q[i]) - mp.mpc(complex(*found[i])))) for i in rows)


def ours():
    return Mechanism(
        {"A": (0, 0), "D": (D, 0)},
        {
            "crank": Link({"A": (0, 0), "B": (A, 0)}),
            "coupler": Link({"B": (0, 0), "C": (B, 0)}),
            "rocker": Link({"D": (0, 0), "C": (C, 0)}),
        },
        inputs=Input(link="crank"),
        guess=Guess(0.7, {"coupler": 0.35, "rocker": 1.0}),
    )


def rows(n):
    q = np.linspace(0, 2 * np.pi, n, endpoint=False)
    m = ours()
    yield "dalembert, closed form", n, lambda: m.motion(q).point("C").position, q
    few = q[:: max(1, n // 50)]
    yield (
        "dalembert, Newton-Raphson from the guess, one at a time",
        len(few),
        lambda: np.array(
            [
                [A * math.cos(v) + B * math.cos(x), A * math.sin(v) + B * math.sin(x)]
                for v in few
                for x in [all_at_once(m.assembly, (v,)).iterates[-1].unknowns[0]]
            ]
        ),
        few,
    )
    yield "scipy fsolve, pose by pose from the last", len(few), lambda: fsolve_loop(few), few
    yield from pylinkage_rows(n, q)
    yield from mechanism_rows(few)


def fsolve_loop(q):
    from scipy.optimize import fsolve

    x = np.array([0.35, 1.0])
    x = fsolve(gap, x, args=(q[0],))
    out = []
    for v in q:
        x = fsolve(gap, x, args=(v,))
        out.append([A * math.cos(v) + B * math.cos(x[0]), A * math.sin(v) + B * math.sin(x[0])])
    return np.array(out)


def gap(x, v):
    return [
        A * math.cos(v) + B * math.cos(x[0]) - C * math.cos(x[1]) - D,
        A * math.sin(v) + B * math.sin(x[0]) - C * math.sin(x[1]),
    ]


def pylinkage_rows(n, q):
    try:
        from pylinkage import Crank, Ground, RRRDyad
        from pylinkage.simulation import Linkage
    except ImportError:
        print("pylinkage is not installed: left out", file=sys.stderr)
        return
    start = exact(0.0)

    def run():
        o, d = Ground(0.0, 0.0), Ground(D, 0.0)
        crank = Crank(anchor=o, radius=A, angular_velocity=2 * np.pi / n, initial_angle=-2 * np.pi / n)
        dyad = RRRDyad(crank.output, d, distance1=B, distance2=C, x=float(start.real), y=float(start.imag))
        return Linkage([o, d, crank, dyad]).step_fast(n)[:, -1]

    yield "pylinkage, step_fast (numba, compiled before)", n, run, q


def mechanism_rows(q):
    try:
        from mechanism import Mechanism as Peer
        from mechanism import get_joints
    except ImportError:
        print("mechanism is not installed: left out", file=sys.stderr)
        return
    from mechanism import Vector

    def run():
        o, b, c, d = get_joints("O B C D")
        ob, bc = Vector((o, b), r=A), Vector((b, c), r=B)
        dc, od = Vector((d, c), r=C), Vector((o, d), r=D, theta=0, style="ground")

        def loops(x, i):
            return ob(i) + bc(x[0]) - dc(x[1]) - od()

        peer = Peer(vectors=(ob, bc, dc, od), origin=o, loops=loops, pos=q, guess=([0.35, 1.0],))
        peer.iterate()
        return np.array(
            [[np.nan, np.nan] if v is None else v for v in np.stack([c.x_positions, c.y_positions], axis=1)]
        )

    yield "mechanism, iterate", len(q), run, q


def main():
    x, y = np.linspace(0, 1, 4096), np.linspace(1, 2, 4096)
    unit = cpu(lambda: [np.sqrt(x * x + y * y) for _ in range(500)]) / 500 / 4096
    print(
        "| four-bar, positions | poses | time a pose | in units of the run | worst error, mm |\n|---|---|---|---|---|"
    )
    for n in (1000, 100_000):
        for name, size, call, q in rows(n):
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    found = np.asarray(call())
                    seconds = cpu(call, 3 if size * len(name) > 0 else 1) / size
            except Exception as failure:
                print(f"| {name} | {size} | failed: {type(failure).__name__}: {failure} | | |")
                continue
            print(
                f"| {name} | {size} | {seconds * 1e9:.3g} ns | {seconds / unit:.3g} | {error(q, found):.1e} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
