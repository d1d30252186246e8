"""One result asked from many threads at once: every number is that of one thread alone (DESIGN, rule 4)."""

from __future__ import annotations

import random
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest

from balancing import LogBalance, correct, joint_fit, least_squares, minimax
from rigidbody3d import FreeBody, Motion
from tests.virtualwork.released import four_bar
from virtualwork import Force, Friction, Guess, Guide, Input, Link, Mechanism, Spring

THREADS = 8
Questions = Mapping[str, Callable[[Any], Any]]


@pytest.fixture(autouse=True)
def _often() -> Iterator[None]:
    """Threads take turns as often as the interpreter lets them."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(before)


def agree(
    make: Callable[[], Any],
    questions: Questions,
    times: int,
    seed: int = 1,
    unit: Callable[[str, Any], Any] | None = None,
) -> None:
    """Ask fresh results from many threads, each in an order of its own; and one thread alone.

    `unit`: by how much one may differ, by its name and value; else 1e-12 of its size.
    """
    alone = make()
    truth = {name: ask(alone) for name, ask in questions.items()}
    for time in range(times):
        whole = make()
        gate = threading.Barrier(THREADS)

        def answers(number: int, whole: Any = whole, gate: Any = gate, time: int = time) -> dict[str, Any]:
            order = list(questions)
            random.Random(f"{seed} {time} {number}").shuffle(order)
            gate.wait()
            return {name: questions[name](whole) for name in order}

        with ThreadPoolExecutor(THREADS) as pool:
            for got in [future.result(60) for future in [pool.submit(answers, i) for i in range(THREADS)]]:
                for name, value in got.items():
                    size = np.abs(np.nan_to_num(truth[name])).max(initial=0.0)
                    allowed = 1e-12 * size if unit is None else unit(name, truth[name])
                    if np.ndim(allowed):
                        off, allowed = np.abs(value - truth[name]) / allowed, 1.0
                        np.testing.assert_allclose(off, 0 * off, rtol=0, atol=1, err_msg=name)
                    else:
                        np.testing.assert_allclose(value, truth[name], rtol=0, atol=allowed, err_msg=name)


def loaded(**more: Any) -> Mechanism:
    return four_bar(
        forces=[Force("rocker", "C", 3 - 2j)],
        springs=[Spring((("crank", "B"), ("ground", "D")), 50.0, 0.1, 0.5)],
        **more,
    )


def slider_crank(**more: Any) -> Mechanism:
    """A change of sign nowhere, a guide, a friction if wanted."""
    return Mechanism(
        {"O": 0j},
        {
            "crank": Link({"O": 0j, "A": 0.05 + 0j}, mass=1, center=0.02 + 0j, inertia=0.01),
            "rod": Link({"A": 0j, "B": 0.2 + 0j}, mass=0.5, center=0.1 + 0j, inertia=0.002),
            "piston": Link({"B": 0j}, mass=0.7),
        },
        guides=[Guide("B", "piston", turned=0.0)],
        inputs=Input(link="crank"),
        guess=Guess(0.5, {"rod": -0.1}),
        gravity=-9.81j,
        **more,
    )


def parallelogram() -> Mechanism:
    """Two change points in a turn."""
    return Mechanism(
        {"A": 0j, "D": 0.4 + 0j},
        {
            "crank": Link({"A": 0j, "B": 0.1 + 0j}, inertia=0.1),
            "coupler": Link({"B": 0j, "C": 0.4 + 0j}, mass=2, center=0.2 + 0j, inertia=0.02),
            "rocker": Link({"D": 0j, "C": 0.1 + 0j}, inertia=0.05),
        },
        inputs=Input(link="crank"),
        guess=Guess(1.0, {"coupler": 0.0, "rocker": 1.0}),
        gravity=-9.81j,
    )


def of_motion(m: Mechanism) -> dict[str, Callable[[Any], Any]]:
    """What can be asked of a motion."""
    found: dict[str, Callable[[Any], Any]] = {
        "assembled": lambda a: a.assembled,
        "condition": lambda a: a.condition,
        "effort": lambda a: a.effort,
        "newton_euler": lambda a: a.dynamics.newton_euler,
        "shaking": lambda a: a.dynamics.shaking[0],
        "shaking moment": lambda a: a.dynamics.shaking[1],
        "work": lambda a: a.cycle.work,
        "energy": lambda a: a.cycle.energy[0],
        "fluctuation": lambda a: a.cycle.fluctuation,
        "unit": lambda a: a.unit(0).link("crank").omega,
        "frame": lambda a: a.to_frame().to_numpy(dtype=float),
        # a bound, whose size depends on what was asked before
        "effort's error": lambda a: np.isfinite(a.error_estimates("effort")["effort"]),
    }
    for link in m.links:
        found |= {
            f"{link} {rate}": lambda a, link=link, rate=rate: getattr(a.link(link), rate)
            for rate in ("angle", "omega", "alpha", "jerk")
        }
    for point in m.points:
        found |= {
            f"{point} {rate}": lambda a, point=point, rate=rate: getattr(a.point(point), rate)
            for rate in ("position", "velocity", "acceleration", "jerk")
        }
    for joint in m.assembly.plan.blocks and m.motion().dynamics.reactions.joints:
        for body in joint.bodies:
            if body != "ground":
                found[f"{joint.key} on {body}"] = lambda a, j=joint.name, b=body: a.reaction(j, on=b)
    if not m.friction:
        found["sensitivity"] = lambda a: a.sensitivity("effort", "links.crank.mass")
    return found


SWEEP = np.linspace(0.0, 2 * np.pi, 73)
MECHANISMS = {
    "four-bar": loaded,
    "slider-crank": slider_crank,
    "parallelogram": parallelogram,
    "friction": lambda: slider_crank(friction=[Friction("A", 0.2, 0.01), Friction("B", 0.1)]),
}


@pytest.mark.whole
@pytest.mark.parametrize("name", MECHANISMS)
def test_one_motion(name: str) -> None:
    questions = of_motion(MECHANISMS[name]())
    agree(lambda: MECHANISMS[name]().motion(SWEEP, speed=7.0, acceleration=3.0), questions, 1)


@pytest.mark.slow
@pytest.mark.parametrize("n", [1, 2, 361, 20_000])
@pytest.mark.parametrize("engine", ["", "numpy", "llvm"])
@pytest.mark.parametrize("name", MECHANISMS)
def test_one_motion_often(name: str, engine: str, n: int, monkeypatch: pytest.MonkeyPatch) -> None:
    if engine:
        monkeypatch.setenv("DALEMBERT_ENGINE", engine)
    questions = of_motion(MECHANISMS[name]())
    for whole in ("work", "energy", "fluctuation") if n < 100 else ():
        del questions[whole]
    if n > 1000:
        questions = {k: v for k, v in questions.items() if not k.startswith(("frame", "effort's"))}
    sweep = np.linspace(0.3, 0.3 + 2 * np.pi, n)

    def make() -> Any:
        return MECHANISMS[name]().motion(sweep, speed=7.0, acceleration=3.0)

    unit = beside_change_points(make()) if (name, engine) == ("parallelogram", "llvm") else None
    if engine == "numpy" and n > 100 and name != "friction":
        unit = exactly
    agree(make, questions, 10 if n < 1000 else 3, unit=unit)


def exactly(name: str, value: Any) -> float:
    """Nothing."""
    return 0.0


ORDERS = {"angle": 0, "position": 0, "omega": 1, "velocity": 1, "jerk": 3, "frame": 3}


def beside_change_points(motion: Any) -> Callable[[str, Any], Any]:
    """How far answers of compiled code may lie from each other, by the condition of each pose.

    A product goes into a sum in one rounding; not so where it was computed before and enters. Each order of the rates divides
    once more by the loop's Jacobian, which vanishes there. Of links that stay level most rates are zero but for rounding of the
    crank's.
    """
    condition = np.maximum(motion.condition, 10.0)

    def unit(name: str, value: Any) -> Any:
        if np.asarray(value).dtype == bool:
            return 0.0
        order = ORDERS.get(name.rpartition(" ")[2], 2)
        size = max(np.abs(np.nan_to_num(value)).max(initial=0.0), 7.0**order)
        each = 1e-12 * size + 4e-15 * size * condition ** max(order, 1)
        return each[:, None] if np.ndim(value) > 1 else each if np.ndim(value) else float(each.max())

    return unit


def attributes(*names: str) -> dict[str, Callable[[Any], Any]]:
    """Of a result."""
    return {name: lambda of, name=name: getattr(of, name) for name in names}


def of_family(engine: Any = None) -> tuple[Callable[[], Any], dict[str, Callable[[Any], Any]]]:
    """Variants of a loaded four-bar of which a few cannot turn all the way, and what is asked of them."""
    numbers = {
        "links.crank.mass": np.linspace(1, 2, 40),
        "links.rocker.C.x": np.linspace(0.1, 0.35, 40),
    }
    questions: dict[str, Callable[[Any], Any]] = {
        **attributes("assembled", "failed", "effort"),
        "C": lambda a: a.point("C").acceleration,
        "coupler": lambda a: a.link("coupler").omega,
        "B": lambda a: a.reaction("B", on="coupler"),
        "C on rocker": lambda a: a.reaction("C", on="rocker"),
    }
    return lambda: loaded().vary(numbers).motion(SWEEP[::10], speed=7.0, executor=engine), questions


def test_one_family() -> None:
    agree(*of_family(), 1)


def test_one_family_whose_parts_are_worked_out_by_threads() -> None:
    with ThreadPoolExecutor(4) as pool:
        agree(*of_family(pool), 1)


def of_mechanism() -> dict[str, Callable[[Any], Any]]:
    """What can be asked of a mechanism itself: motions that share what its assembly has written down."""
    times = np.linspace(0, 0.3, 4)
    return {
        "poses": lambda m: m.motion(SWEEP, speed=2.0).point("C").acceleration,
        "backwards": lambda m: m.motion(-3 * SWEEP, speed=-2.0).effort,
        "one pose": lambda m: m.motion(0.7, speed=2.0).reaction("B", on="coupler"),
        "evaluator": lambda m: [
            m.evaluator("effort", "links.coupler.alpha")(0.1 * i, 3.0)["effort"] for i in range(9)
        ],
        "limits": lambda m: [] if m.check.input_limits is None else m.check.input_limits,
        "mobility": lambda m: m.check.mobility_by_rank,
        "rest": lambda m: [e.inputs[0] for e in m.equilibria().found],
        "assemblies": lambda m: len(m.assemblies()),
        "newton": lambda m: m.newton().difference,
        "in time": lambda m: m.simulate(times, angle=0.4).angle,
        "in time at speed": lambda m: m.simulate(times, angle=0.4, speed=9.0).energy,
        "variants": lambda m: m.vary({"links.crank.mass": [1.0, 2.0]}).simulate(times, angle=0.4).angle,
    }


def test_one_mechanism() -> None:
    questions = of_mechanism()
    for long in ("in time at speed", "rest", "variants"):
        del questions[long]
    agree(loaded, questions, 1)


@pytest.mark.slow
@pytest.mark.parametrize("make", [loaded, parallelogram])
def test_one_mechanism_often(make: Callable[[], Mechanism]) -> None:
    questions = of_mechanism()
    if make is parallelogram:
        # through change points they take seconds
        for name in ("in time", "in time at speed", "variants"):
            del questions[name]
    agree(make, questions, 5)


def test_one_run() -> None:
    times = np.linspace(0, 1, 21)
    questions = {
        **attributes("energy", "energy_drift", "unknown"),
        "C": lambda r: r.motion.point("C").velocity,
        "B": lambda r: r.motion.reaction("B", on="coupler"),
        "crank": lambda r: r.motion.link("crank").omega,
        "first": lambda r: r.first_motion.effort,
        "series": lambda r: len(r.animate().html) > 0,
    }
    agree(lambda: loaded().simulate(times, angle=0.4, speed=20.0), questions, 1)


def balance() -> Any:
    moment = np.array([0.01 + 0.02j, -0.03j, 0.02 + 0.01j])
    return correct(moment, np.array([0.0, 0.1, 0.25]), np.array([0.02, 0.2]))


def field() -> Any:
    on = np.array([[0, 0], [1, 0], [0, 1j], [-1, 0.5], [0.3, -1]])
    noise = np.exp(1j * np.arange(15).reshape(5, 3)) / 50
    fit = joint_fit(5 + on @ np.array([[2, 1j, 1], [1 - 1j, 2, 0.5]]) + noise, on)
    return LogBalance(fit, least_squares(fit.influence, fit.initial).corrections, fit.scatter())


BODY = np.array([[2.0, 0.1, 0.0], [0.1, 3.0, -0.2], [0.0, -0.2, 4.0]])
TIMES = np.linspace(0, 20, 101)
RESULTS: dict[str, tuple[Callable[[], Any], dict[str, Callable[[Any], Any]]]] = {
    "balance": (balance, attributes("unbalance", "amplification") | {"rest": lambda c: c.residual.static}),
    "field": (field, attributes("residual", "deviations")),
    "least squares": (
        lambda: least_squares(np.array([[2, 1j], [1 - 1j, 2], [1, 0.5]]), np.array([3, 4j, 1 + 1j])),
        attributes("corrections", "residual", "condition_number"),
    ),
    "minimax": (
        lambda: minimax(np.array([[2, 1j], [1 - 1j, 2], [1, 0.5]]), np.array([3, 4j, 1 + 1j])),
        attributes("corrections", "residual", "condition_number"),
    ),
    "free body": (
        lambda: FreeBody(BODY, [1.0, 0.1, 0.5]),
        attributes("period", "momentum", "energy", "separatrix")
        | {"omega": lambda b: b.at(TIMES).omega, "attitude": lambda b: b.at(TIMES).attitude},
    ),
    "free body's states": (
        lambda: FreeBody(BODY, [1.0, 0.1, 0.5]).at(TIMES),
        attributes("omega", "attitude", "momentum", "energy"),
    ),
    "momentum": (
        lambda: Motion(BODY, np.array([1.0, 2, 3]), np.array([0.1, 0, 2])),
        attributes("momentum", "rate", "transport", "relative", "tensor_rate", "energy"),
    ),
}


@pytest.mark.whole
@pytest.mark.parametrize("name", RESULTS)
def test_results_of_other_rooms(name: str) -> None:
    agree(*RESULTS[name], 3)
