"""Mechanisms in motion: closed form against Newton, cost against poses and links, torque and joint forces."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.scenes import chain, four_bar, klann, sweep
from benchmarks.speed.evaluators import engine
from benchmarks.speed.measure import Measurement, around, measured, peak, worst
from benchmarks.truth import reference
from virtualwork import Mechanism
from virtualwork.branch.assembly import Assembly
from virtualwork.formulas.forces import Effort, Reaction
from virtualwork.formulas.group_loops import Loops
from virtualwork.formulas.newton import newton
from virtualwork.formulas.positions import State
from virtualwork.motion import Motion
from virtualwork.plan.order import plan
from virtualwork.plan.steps import Group

Real = NDArray[np.float64]

DOMAIN = "mechanisms"
CHUNK = 100_000

KLANN = ("coupler", "rocker", "arm", "leg")
PINS = (("A", "crank"), ("B", "coupler"), ("C", "rocker"), ("D", "rocker"))


def measure(quick: bool) -> Iterator[Measurement]:
    """Yield time and error of sweeps, single poses, Newton's steps, long sweeps and long chains."""
    # one engine in every table: left to itself, what is requested often goes over to compiled code
    with engine("numpy"):
        poses = 10_000 if quick else 100_000
        yield from _four_bar(poses)
        yield from _klann(poses)
        yield from _newton(2_000 if quick else 20_000)
    # one pose runs as it does for anybody
    yield from _one_pose()
    with engine("numpy"):
        yield from _sizes(
            (1, 10, 100, 1000, 10_000, 100_000) if quick else tuple(10**k for k in range(7)), not quick
        )
        yield from _chains((4, 20, 40) if quick else (4, 10, 40, 100, 200, 400))


def _four_bar(poses: int) -> Iterator[Measurement]:
    known = reference("four_bar")
    angles, stride = sweep(known, poses)
    speed = float(known["omega_rad_s"])
    true = np.array(known["C"])
    turns = np.array([known["coupler"], known["rocker"]])  # link, pose, order
    bare, loaded = four_bar(), four_bar(loaded=True)
    # the same poses in no order and at no equal distance: e^{iθ} of the crank costs a sine and a cosine
    scattered = angles.copy()
    steps = np.arange(len(angles)) % stride != 0
    scattered[steps] += (
        np.random.default_rng(3).uniform(-1, 1, int(steps.sum())) * (angles[1] - angles[0]) / 3
    )
    work = "four-bar: positions"
    for method, at in (("closed form", angles), ("closed form, uneven steps", scattered)):
        call = partial(_positions, bare, at)
        error = worst(call()[::stride], true[:, 0], 0.12)
        yield measured(DOMAIN, work, method, call, size=len(at), error=error, aim_ns=30.0)

    def both() -> list[Real]:
        motion = bare.motion(angles)
        return [motion.point("C").position, motion.link("coupler").angle, motion.link("rocker").angle]

    error = max(around(both()[k][::stride], turns[k - 1, :, 0]) for k in (1, 2))
    work = "four-bar: positions, both angles"
    yield measured(DOMAIN, work, "closed form", both, size=len(angles), error=error, aim_ns=40.0)

    def rates() -> list[Real]:
        motion = bare.motion(angles, speed=speed, acceleration=0.0)
        links = [motion.link("coupler"), motion.link("rocker")]
        return [motion.point("C").position, *(x.omega for x in links), *(x.alpha for x in links)]

    found = rates()
    error = max(worst(found[1 + k + 2 * o][::stride], turns[k, :, o + 1]) for k in (0, 1) for o in (0, 1))
    work = "four-bar: positions, ω and α"
    yield measured(DOMAIN, work, "closed form", rates, size=len(angles), error=error, aim_ns=60.0)

    work, names = (
        "four-bar: position, both angles, ω and α, with estimates of their seven errors",
        _estimated(),
    )

    def answers() -> Motion:
        motion = bare.motion(angles, speed=speed, acceleration=0.0)
        for x in (motion.link("coupler"), motion.link("rocker")):
            _ = x.angle, x.omega, x.alpha
        _ = motion.point("C").position
        return motion

    def each() -> list[Real]:
        motion = answers()
        return [motion.error_estimates(name)[name] for name in names]

    least = measured(DOMAIN, work, "the answers alone", answers, size=len(angles))
    yield least
    for method, estimated, most in (
        ("together", lambda: [*answers().error_estimates(*names).values()], 600.0),
        ("one by one", each, 1200.0),
    ):
        timed = measured(DOMAIN, work, method, estimated, size=len(angles), aim_ns=most)
        yield replace(timed, floor="the answers alone", ratio=timed.units / least.units, aim_ratio=15.0)

    def ask(motion: Motion) -> list[Real]:
        return [motion.effort, *(motion.reaction(pin, on=link) for pin, link in PINS)]

    def together() -> list[Real]:
        motion = loaded.motion(angles, speed=speed, acceleration=0.0)
        motion.values([Effort(0), *(Reaction(*pin) for pin in PINS)])
        return ask(motion)

    def one_by_one() -> list[Real]:
        return ask(loaded.motion(angles, speed=speed, acceleration=0.0))

    def alone() -> list[Real]:
        return [loaded.motion(angles, speed=speed, acceleration=0.0).effort]

    joints = np.array(known["reactions"])
    work = "four-bar: torque and all reactions"
    for method, forces, aim in (
        ("all in one pass", together, 100.0),
        ("requested one by one", one_by_one, None),
        ("the torque alone, by virtual work", alone, None),
    ):
        # on one engine: left to itself, the torque alone goes over to compiled code and the others do not
        with engine("numpy"):
            found = forces()
            timed = measured(DOMAIN, work, method, forces, size=len(angles), aim_ns=aim)
        error = max(
            worst(found[0][::stride], known["torque"]),
            *(
                worst(force[::stride], joints[:, j], float(np.abs(joints).max()))
                for j, force in enumerate(found[1:])
            ),
            0.0,
        )
        yield replace(timed, error=error)


def _estimated() -> list[str]:
    """The seven quantities whose errors are estimated."""
    rates = [f"links.{link}.{k}" for k in ("angle", "omega", "alpha") for link in ("coupler", "rocker")]
    return ["points.C", *rates]


def _klann(poses: int) -> Iterator[Measurement]:
    known = reference("klann")
    angles, stride = sweep(known, poses)
    leg, size = klann(), len(angles)
    turns = np.array([known[name] for name in KLANN])
    foot = np.array(known["H"])

    def four() -> list[Real]:
        motion = leg.motion(angles)
        return [motion.link(name).angle for name in KLANN]

    error = max(around(x[::stride], turns[k, :, 0]) for k, x in enumerate(four()))
    yield measured(DOMAIN, "Klann leg: four angles", "closed form", four, size=size, error=error, aim_ns=70.0)
    call = partial(_positions, leg, angles, "H")
    # over the longest length, 430 mm: the aim is 4e-13 mm of it
    error = worst(call()[::stride], foot[:, 0], 0.43)
    work = "Klann leg: position of the foot"
    yield measured(DOMAIN, work, "closed form", call, size=size, error=error, aim_error=4e-13 / 430)

    def rates() -> list[Real]:
        motion = leg.motion(angles, speed=float(known["omega_rad_s"]), acceleration=0.0)
        H = motion.point("H")
        return [H.position, H.velocity, H.acceleration]

    error = max(worst(x[::stride], foot[:, k]) for k, x in enumerate(rates()))
    work = "Klann leg: velocities and accelerations"
    yield measured(DOMAIN, work, "closed form", rates, size=size, error=error, aim_ns=130.0)


def _positions(mechanism: Mechanism, angles: Real, point: str = "C") -> Real:
    return mechanism.motion(angles).point(point).position


def all_loops(mechanism: Mechanism) -> Callable[[Real, Real, int], Real]:
    """Return a function of (crank angles, start, steps): all loops at once by so many steps of Newton and Raphson."""
    order = plan(mechanism, merged=True)
    run = Assembly(mechanism, order, {}, {}).run
    loops = Loops(order.groups[0])

    def solve(angles: Real, start: Real, steps: int) -> Real:
        state = State([angles])
        for step in order.steps:
            if isinstance(step, Group):
                return newton(loops, state, start, mechanism.size, limit=steps)[0]
            run([step], state)
        raise AssertionError("the mechanism has no loop")

    return solve


def unknowns(mechanism: Mechanism) -> tuple[str, ...]:
    """Return the links whose angles Newton finds, in its order."""
    order = plan(mechanism, merged=True)
    return next(tuple(step.angles) for step in order.steps if isinstance(step, Group))


def _newton(poses: int) -> Iterator[Measurement]:
    """Yield Newton's error after each step from starts some 6° off, beside the closed form on the same poses."""
    for name, mechanism in (("four_bar", four_bar()), ("klann", klann())):
        known = reference(name)
        angles, stride = sweep(known, poses)
        links = unknowns(mechanism)
        true = np.array([[row[0] for row in known[link]] for link in links]).T
        work = f"{name.replace('_', '-').capitalize()}: every angle, closed form against Newton"

        def closed(mechanism: Mechanism = mechanism, angles: Real = angles, links: Any = links) -> Real:
            motion = mechanism.motion(angles)
            return np.stack([motion.link(link).angle for link in links], axis=-1)

        found = closed()
        error = around(found[::stride], true)
        yield measured(DOMAIN, work, "closed form", closed, size=len(angles), error=error)
        start = found + 0.1 * (-1.0) ** np.arange(len(links))
        solve = all_loops(mechanism)
        for steps in range(1, 7):
            call = partial(solve, angles, start, steps)
            error = around(call()[::stride], true)
            yield measured(DOMAIN, work, f"Newton, {steps} steps", call, size=len(angles), error=error)


def _one_pose() -> Iterator[Measurement]:
    known = reference("four_bar")
    ready = four_bar()
    angle = known["angle_rad"][20]
    true = np.array(known["C"])[20, 0]
    work = "four-bar: one pose"

    def anew() -> Real:
        return _positions(four_bar(), angle)

    again = partial(_positions, ready, angle)
    error = worst(again()[0], true, 0.12)
    yield measured(DOMAIN, work, "mechanism ready", again, error=error, aim_ns=60e3)
    # of a topology that was met before: its order of solution is kept
    error = worst(anew()[0], true, 0.12)
    yield measured(DOMAIN, work, "described and put together too", anew, error=error, aim_ns=400e3)


def _sizes(sizes: tuple[int, ...], long: bool) -> Iterator[Measurement]:
    mechanism = four_bar()
    work = "four-bar: cost against poses"
    for poses in sizes:
        angles = np.linspace(0.0, 2 * np.pi, poses)
        once = partial(_positions, mechanism, angles)
        # on one engine, or the sizes requested last would be those of compiled code
        with engine("numpy"):
            timed = measured(DOMAIN, work, "one call", once, size=poses, bytes=float(peak(once)))
        yield timed

    def chunks(angles: Real) -> float:
        """The farthest point of the path: what a long sweep is for, and nothing else is kept."""
        far = 0.0
        for start in range(0, len(angles), CHUNK):
            far = max(far, float(_positions(mechanism, angles[start : start + CHUNK])[:, 0].max()))
        return far

    for poses in (*(s for s in sizes if s > CHUNK), *((10_000_000,) if long else ())):
        angles = np.linspace(0.0, 2 * np.pi, poses)
        call = partial(chunks, angles)
        with engine("numpy"):
            timed = measured(
                DOMAIN, work, "in parts of 100 000", call, size=poses, bytes=float(peak(call)), budget=0.5
            )
        yield timed


def _chains(sizes: tuple[int, ...]) -> Iterator[Measurement]:
    known = reference("four_bar")
    angles, stride = sweep(known, 1000)
    true = np.array(known["rocker"])[:, 0]
    work = "chain of four-bars: cost against links"
    for links in sizes:
        bars = max(1, (links - 1) // 2)
        count, last = 2 * bars + 1, f"rocker{bars - 1}"
        mechanism = chain(bars)

        def move(mechanism: Mechanism = mechanism, last: str = last) -> Real:
            return mechanism.motion(angles).link(last).angle

        error = around(move()[::stride], true)
        yield measured(
            DOMAIN,
            work,
            f"moved, {len(angles)} poses",
            move,
            size=count,
            error=error,
            bytes=float(peak(move)),
        )
        # describing it anew also puts it together and looks for its change points
        anew = partial(_assembled, bars)
        yield measured(DOMAIN, work, "described and put together", anew, size=count, budget=0.1)


def _assembled(bars: int) -> Assembly:
    mechanism = chain(bars)
    _ = mechanism.assembly.track
    return mechanism.assembly
