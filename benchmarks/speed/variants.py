"""Families: many variants of one mechanism, beside a loop over mechanisms and poses of one; designs of an optimiser."""

from __future__ import annotations

import os
import pickle
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.scenes import four_bar
from benchmarks.speed.evaluators import engine
from benchmarks.speed.measure import Measurement, calibration, measured, worst
from dalembert.arithmetic.engines import compiled_code
from dalembert.arithmetic.processes import Processes
from virtualwork import Mechanism
from virtualwork.describe.dimensions import changed, value
from virtualwork.family.family import Family
from virtualwork.formulas.forces import Effort, JointForce, NewtonEuler
from virtualwork.formulas.kinematics import Angle
from virtualwork.formulas.quantity import Quantity
from virtualwork.plan.steps import joints

Real = NDArray[np.float64]
DOMAIN = "variants"
PATHS = ("links.crank.B.x", "links.coupler.C.x", "links.rocker.C.x", "ground.D.x")
# the dimensions of an optimiser
TEN = (
    *PATHS,
    "ground.A.x",
    "ground.A.y",
    "ground.D.y",
    "links.crank.B.y",
    *(f"links.coupler.H.{k}" for k in "xy"),
)
SPEED = 10.0
RATES: list[Quantity] = [Angle(name, k) for name in ("coupler", "rocker") for k in (1, 2)]
# how many are described alone, for the time of a loop and for the error
ALONE = 200


def measure(quick: bool) -> Iterator[Measurement]:
    """Yield time and error of families: one pose of many variants, many poses with forces, an optimiser's evaluation, two processes."""
    bare, loaded = four_bar(), four_bar(loaded=True)
    many = 10_000 if quick else 100_000
    numbers = lengths(bare, 2 * many)
    work = "ω and α of a variant in one pose"

    def of(v: int) -> Family:
        return bare.vary({path: column[:v] for path, column in numbers.items()})

    def alone() -> Real:
        rows = [one.motion(1.0, SPEED) for one in (_variant(bare, numbers, i) for i in range(ALONE))]
        links = [[row.link(name) for name in ("coupler", "rocker")] for row in rows]
        return np.array([[x for link in of for x in (link.omega[0], link.alpha[0])] for of in links])

    true = alone()
    yield measured(DOMAIN, work, "described one by one", alone, size=ALONE)
    for method, v, aims in (("", many, (110.0, 15.0)), (", twice as many", 2 * many, (None, None))):
        family = of(v)
        for name, aim in zip(("numpy", "llvm"), aims, strict=True):
            if name == "llvm" and not compiled_code():
                continue
            with engine(name):
                found = np.stack(family.motion(1.0, SPEED).values(RATES), axis=-1)[:ALONE, 0]
                off = max(worst(found[:, k], true[:, k]) for k in range(4))
                call = partial(_solve, family, 1.0, RATES)
                yield measured(DOMAIN, work, name + method, call, size=v, error=off, aim_ns=aim)
    yield from _forces(loaded, 100 if quick else 1000)
    yield from _evaluations()
    yield from _processes(loaded, many if quick else 1_000_000)


def lengths(m: Mechanism, v: int) -> dict[str, Real]:
    """The lengths of all links, each ± 2 % (one standard deviation)."""
    rng = np.random.default_rng(0)
    return {path: np.real(value(m, path)) * (1 + 0.02 * rng.normal(size=v)) for path in PATHS}


def _variant(m: Mechanism, numbers: dict[str, Real], i: int) -> Mechanism:
    return changed(m, {path: float(column[i]) for path, column in numbers.items()})


def _forces(m: Mechanism, v: int) -> Iterator[Measurement]:
    """All forces of variants over a turn, over as many poses of one mechanism."""
    n = 360
    turn, long = np.linspace(0, 2 * np.pi, n), np.linspace(0, 2 * np.pi, v * n)
    keys: list[Quantity] = [Effort(0), NewtonEuler(0)]
    keys += [JointForce(joint.key, joint.bodies[-1]) for joint in joints(m)]
    pins = ("A.crank", "B.coupler", "C.rocker", "D.rocker")
    numbers = lengths(m, v)
    family, one = m.vary(numbers), m.evaluator("effort", *(f"reactions.{pin}" for pin in pins))
    some = range(0, v, max(1, v // 20))
    true = np.stack([_variant(m, numbers, i).motion(turn, SPEED).effort for i in some])
    work = "effort both ways and 4 joint forces, a pose"
    for name in ("numpy", "llvm"):
        if name == "llvm" and not compiled_code():
            continue
        with engine(name):
            least = measured(
                DOMAIN, work, f"poses of one mechanism, {name}", lambda: one(long, SPEED), size=v * n
            )
            off = worst(family.motion(turn, SPEED).effort[some], true)
            found = measured(
                DOMAIN,
                work,
                f"{v} variants × {n} poses, {name}",
                lambda: family.motion(turn, SPEED).values(keys),
                size=v * n,
                error=off,
            )
        yield least
        yield replace(found, floor="poses of one mechanism", ratio=found.units / least.units, aim_ratio=1.3)


def _evaluations() -> Iterator[Measurement]:
    """What an optimiser asks for, of one design after another, and with its gradient to ten dimensions."""
    bare, turn = four_bar(), np.linspace(0, 2 * np.pi, 73)
    coupler = bare.links["coupler"]
    links = dict(bare.links, coupler=replace(coupler, points={**coupler.points, "H": 0.06 + 0.04j}))
    m = replace(bare, links=links)
    own, rng = np.array([float(np.real(value(m, path))) for path in TEN]), np.random.default_rng(0)
    numbers = own + 1e-4 * rng.normal(size=(ALONE, len(TEN)))
    alone = [changed(m, dict(zip(TEN, x.tolist(), strict=True))).motion(turn).point("H") for x in numbers[:5]]
    place = np.stack([point.position.T for point in alone])
    slopes = np.stack([[point.sensitivity(path) for path in TEN] for point in alone])
    work = "an optimiser's evaluation: new dimensions, 73 poses, position of a point"
    for name, aim in (("numpy", 60e3), ("llvm", 25e3)):
        if name == "llvm" and not compiled_code():
            continue
        with engine(name):
            design = m.design(TEN, "points.H")
            off = worst([design(x, turn) for x in numbers[:5]], place)
            value_alone = measured(
                DOMAIN,
                work,
                name,
                lambda design=design: [design(x, turn) for x in numbers],  # type: ignore[misc]
                size=ALONE,
                error=off,
                aim_ns=aim,
            )
            found = np.array([design.slopes(x, turn)[..., :-1] for x in numbers[:5]])
            both = measured(
                DOMAIN,
                work,
                f"{name}, with the gradient to ten dimensions",
                lambda design=design: [(design(x, turn), design.slopes(x, turn)) for x in numbers],  # type: ignore[misc]
                size=ALONE,
                error=worst(found.transpose(0, 3, 2, 1), slopes),
            )
        yield value_alone
        yield replace(both, floor="without the gradient", ratio=both.units / value_alone.units, aim_ratio=4.0)


def _processes(m: Mechanism, v: int) -> Iterator[Measurement]:
    """The clock's time of one and of two worker processes, and what is sent."""
    family = m.vary(lengths(m, v))
    turn = np.linspace(0, 2 * np.pi, 12)
    motion = family.motion(turn, SPEED)
    sent = sum(len(pickle.dumps(motion.part.some(rows))) for _, rows in motion.parts())
    times = []
    keys: list[Quantity] = [Effort(0)]
    for workers in (1, 2):
        with Processes(workers) as pool:
            # the processes begin, and write the formulas down
            _solve(family, turn[:2], keys, pool)
            best = min(_clock(partial(_solve, family, turn, keys, pool)) for _ in range(3))
        times.append(best)
        yield Measurement(
            DOMAIN,
            f"the effort of {v:,} variants in 12 poses, by the clock, {sent / 1e6:.3g} MB sent",
            f"{workers} process{'es' * (workers > 1)} of {os.cpu_count()}",
            v * len(turn),
            best / (v * len(turn)) * 1e9,
            best / (v * len(turn)) * 1e9 / calibration(),
            floor="one process",
            ratio=best / times[0],
            aim_ratio=1 / 1.7 if workers == 2 else None,
        )


def _solve(family: Family, angle: Any, keys: list[Quantity], executor: Executor | None = None) -> Any:
    return family.motion(angle, SPEED, executor=executor).values(keys)


def _clock(call: Callable[[], Any]) -> float:
    start = time.perf_counter()
    call()
    return time.perf_counter() - start
