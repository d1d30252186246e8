"""Mechanisms by other packages."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.scenes import EVERY, four_bar, sweep
from benchmarks.speed.measure import Measurement, around, measured, worst
from benchmarks.truth import reference
from virtualwork.motion import Motion

Real = NDArray[np.float64]


def by_pylinkage(quick: bool) -> Iterator[Measurement]:
    """Four-bar and Klann leg by `step_fast` (compiled by numba where that is installed): the crank goes in steps."""
    pl = import_module("pylinkage")
    how = "step_fast" if find_spec("numba") else "step_fast, without numba"
    poses = 10_000 if quick or not find_spec("numba") else 100_000
    for name, work, point, scale in (
        ("four_bar", "four-bar: positions", 3, 0.12),
        ("klann", "Klann leg: position of the foot", 7, 0.43),
    ):
        known = reference(name)
        angles, stride = sweep(known, poses)
        step = float(angles[-1] - angles[0]) / (len(angles) - 1)
        # a fresh linkage each time: the next call would go on where the last one stopped
        build = partial(_four_bar_linkage if name == "four_bar" else _klann_linkage, pl, known, step)
        true = np.array(known["C" if name == "four_bar" else "H"])

        def positions(build: Callable[[], Any] = build, count: int = len(angles)) -> Real:
            return np.asarray(build().step_fast(count))

        path = positions()[:, point]
        yield measured(
            "mechanisms",
            work,
            how,
            positions,
            size=len(angles),
            error=_from_start(path, true[:, 0], stride, scale),
        )
        if name == "klann":
            work = "Klann leg: velocities and accelerations"
        else:
            work = "four-bar: positions, ω and α"

        def rates(build: Callable[[], Any] = build, count: int = len(angles), known: Any = known) -> Any:
            linkage = build()
            linkage.set_input_velocity(linkage.components[CRANK], float(known["omega_rad_s"]), 0.0)
            return linkage.step_fast_with_kinematics(count)

        found = rates()
        error = max(
            _from_start(found[k][:, point], true[:, k], stride, float(np.abs(true[:, k]).max()))
            for k in range(3)
        )
        yield measured("mechanisms", work, f"{how}, of points", rates, size=len(angles), error=error)


CRANK = 2


def _from_start(path: Real, true: Real, stride: int, scale: float) -> float:
    """Return the error of a path that is one step ahead or not, by how the package counts."""
    at = np.arange(EVERY + 1) * stride
    ways = [at, np.maximum(at - 1, 0)]
    # where the path runs one step ahead its first pose is the second one asked for
    return min(worst(path[way][1:], true[1:], scale) for way in ways)


def _four_bar_linkage(pl: Any, known: Any, step: float) -> Any:
    start = known["angle_rad"][0]
    a, d = pl.Ground(0.0, 0.0), pl.Ground(0.1, 0.0)
    crank = pl.Crank(a, 0.04, angular_velocity=step, initial_angle=start)
    c = pl.RRRDyad(crank.output, d, 0.12, 0.08, *known["C"][0][0])
    return pl.Linkage([a, d, crank, c])


def _klann_linkage(pl: Any, known: Any, step: float) -> Any:
    start = known["angle_rad"][0]
    turn = math.pi / 180
    pins = [pl.Ground(x, y) for x, y in ((0.0, 0.09), (0.35, 0.0))]
    crank = pl.Crank(pins[0], 0.12, angular_velocity=step, initial_angle=start)
    b = complex(0.12 * math.cos(start), 0.09 + 0.12 * math.sin(start))
    coupler, arm = (known[name][0][0] for name in ("coupler", "arm"))
    c = b + 0.35 * complex(math.cos(coupler), math.sin(coupler))
    f = 0.29 + 0.23j + 0.27 * complex(math.cos(arm), math.sin(arm))
    C = pl.RRRDyad(crank.output, pins[1], 0.35, 0.14, c.real, c.imag)
    # G is drawn from C along B → C, H from G along F → G: the angle is to the line from the first anchor on
    G = pl.FixedDyad(C, crank.output, 0.36, math.pi + 10 * turn)
    e = pl.Ground(0.29, 0.23)
    F = pl.RRRDyad(e, G, 0.27, 0.36, f.real, f.imag)
    H = pl.FixedDyad(G, F, 0.43, math.pi - 40 * turn)
    return pl.Linkage([*pins, crank, C, G, e, F, H])


def by_mechanism(quick: bool) -> Iterator[Measurement]:
    """The four-bar by the package `mechanism`: scipy's fsolve, pose after pose."""
    package = import_module("mechanism")
    known = reference("four_bar")
    angles, stride = sweep(known, 126)
    O, B, C, D = package.get_joints("O B C D")
    crank = package.Vector((O, B), r=0.04)
    coupler, rocker = package.Vector((B, C), r=0.12), package.Vector((D, C), r=0.08)
    base = package.Vector((O, D), r=0.1, theta=0.0, style="ground")

    def loops(x: Any, i: Any) -> Any:
        return (crank(i) + coupler(x[0]) - rocker(x[1]) - base()).flatten()

    rates = np.full(len(angles), float(known["omega_rad_s"]))
    start = [np.array([known[name][0][k] for name in ("coupler", "rocker")]) for k in range(3)]
    for work, order in (("four-bar: positions, both angles", 0), ("four-bar: positions, ω and α", 2)):
        whole = package.Mechanism(
            vectors=(crank, coupler, rocker, base),
            origin=O,
            loops=loops,
            pos=angles,
            vel=rates if order else None,
            acc=np.zeros(len(angles)) if order else None,
            guess=start[: order + 1],
        )
        whole.iterate()
        found = [
            np.stack(
                [
                    getattr(part, field)
                    for part in (coupler.acc if order else coupler.pos, rocker.acc if order else rocker.pos)
                ]
            )
            for field in ("thetas", "omegas", "alphas")[: order + 1]
        ]
        true = np.array([known["coupler"], known["rocker"]])
        error = around(found[0][:, ::stride], true[..., 0])
        if order:
            error = max(worst(found[k][:, ::stride], true[..., k]) for k in (1, 2))
        yield measured("mechanisms", work, "fsolve", whole.iterate, size=len(angles), error=error)


def by_fsolve(quick: bool) -> Iterator[Measurement]:
    """The four-bar's loop closure handed to scipy's fsolve, each pose from the one before."""
    from scipy.optimize import fsolve

    known = reference("four_bar")
    angles, stride = sweep(known, 126)
    start = [known[name][0][0] for name in ("coupler", "rocker")]
    true = np.array([[row[0] for row in known[name]] for name in ("coupler", "rocker")]).T

    def gap(x: Any, q: float) -> list[float]:
        return [
            0.04 * math.cos(q) + 0.12 * math.cos(x[0]) - 0.08 * math.cos(x[1]) - 0.1,
            0.04 * math.sin(q) + 0.12 * math.sin(x[0]) - 0.08 * math.sin(x[1]),
        ]

    def slope(x: Any, _: float) -> list[list[float]]:
        return [
            [-0.12 * math.sin(x[0]), 0.08 * math.sin(x[1])],
            [0.12 * math.cos(x[0]), -0.08 * math.cos(x[1])],
        ]

    def solve(tolerance: float) -> Real:
        x, out = np.array(start), []
        for q in angles.tolist():
            x = fsolve(gap, x, (q,), fprime=slope, xtol=tolerance)
            out.append(x)
        return np.array(out)

    work = "Four-bar: every angle, closed form against Newton"
    for tolerance in (1e-2, 1e-4, 1e-8) if not quick else (1e-8,):
        call = partial(solve, tolerance)
        error = around(call()[::stride], true)
        yield measured("mechanisms", work, "fsolve, pose after pose", call, size=len(angles), error=error)


def by_kinepy(quick: bool) -> Iterator[Measurement]:
    """The four-bar by kinepy: positions in closed form, torque with accelerations by differences."""
    kp = import_module("kinepy")
    units = import_module("kinepy.units")
    for quantity in list(units.SYSTEM.dct):
        units.set_unit(quantity, 1.0, "SI")
    known = reference("four_bar")
    angles, stride = sweep(known, 10_000 if quick else 100_000)
    system = kp.System()
    mass, inertia, center = (known[key] for key in ("mass_kg", "inertia_kg_m2", "center_m"))
    links = [
        system.add_solid(name, mass[i], inertia[i], tuple(center[i]))
        for i, name in enumerate(("crank", "coupler", "rocker"))
    ]
    drive = system.add_revolute(system.ground, links[0], (0.0, 0.0), (0.0, 0.0))
    system.add_revolute(links[0], links[1], (0.04, 0.0), (0.0, 0.0))
    end = system.add_revolute(links[1], links[2], (0.12, 0.0), (0.08, 0.0))
    system.add_revolute(system.ground, links[2], (0.1, 0.0), (0.0, 0.0))
    system.pilot(drive)
    system.compile()
    true = np.array(known["C"])[:, 0]

    def positions() -> Real:
        system.solve_kinematics(angles.copy())
        return np.asarray(end.point)

    def error() -> float:
        return worst(positions().T[::stride], true, 0.12)

    signs = [1]
    system.change_signs(signs)
    if not error() < 1e-3:
        signs = [-1]
        system.change_signs(signs)
    yield measured(
        "mechanisms", "four-bar: positions", "closed form", positions, size=len(angles), error=error()
    )
    system.add_gravity((0.0, -known["gravity_m_s2"]))
    links[2].add_torque(known["rocker_torque_N_m"])
    drive_time = float(angles[-1] - angles[0]) / known["omega_rad_s"]
    system.block(drive)
    # it is compiled anew, which forgets the assembly
    system.compile()
    system.change_signs(signs)

    def torque() -> Real:
        system.solve_dynamics(angles.copy(), drive_time)
        return np.asarray(drive.torque)

    found = torque().ravel()[::stride]
    off = min(worst(sign * found[2:-2], np.array(known["torque"])[2:-2]) for sign in (1, -1))
    yield measured(
        "mechanisms",
        "four-bar: torque and all reactions",
        "accelerations by differences",
        torque,
        size=len(angles),
        error=off,
    )


def by_mujoco(quick: bool) -> Iterator[Measurement]:
    """The four-bar's torque by MuJoCo's inverse dynamics, the loop cut at C and the motion given exactly.

    The torque at the input follows from the open tree's joint torques by the velocity coefficients.
    """
    mj = import_module("mujoco")
    known = reference("four_bar")
    mass, inertia, center = (known[key] for key in ("mass_kg", "inertia_kg_m2", "center_m"))

    def link(i: int, inside: str = "", at: str = "0 0 0") -> str:
        x, y = center[i]
        # the inertia about the axes in the plane does not matter, but must make a body
        return (
            f"<body pos='{at}'><joint axis='0 0 1'/><inertial pos='{x} {y} 0' mass='{mass[i]}' "
            f"diaginertia='{inertia[i]} {inertia[i]} {inertia[i]}'/>{inside}</body>"
        )

    model = mj.MjModel.from_xml_string(
        f"<mujoco><option gravity='0 -{known['gravity_m_s2']} 0'/><worldbody>"
        f"{link(0, link(1, at='0.04 0 0'))}{link(2, at='0.1 0 0')}</worldbody></mujoco>"
    )
    data = mj.MjData(model)
    coupler, rocker = (np.array(known[name]) for name in ("coupler", "rocker"))
    angle, omega = np.array(known["angle_rad"]), float(known["omega_rad_s"])
    # joint coordinates: crank, coupler against crank, rocker
    q = np.stack([angle, coupler[:, 0] - angle, rocker[:, 0]], axis=-1)
    v = np.stack([np.full(len(angle), omega), coupler[:, 1] - omega, rocker[:, 1]], axis=-1)
    a = np.stack([np.zeros(len(angle)), coupler[:, 2], rocker[:, 2]], axis=-1)
    outside = np.array([0.0, 0.0, known["rocker_torque_N_m"]])

    def torque() -> Real:
        out = np.empty(len(q))
        for i in range(len(q)):
            data.qpos[:], data.qvel[:], data.qacc[:] = q[i], v[i], a[i]
            mj.mj_inverse(model, data)
            out[i] = (data.qfrc_inverse - outside) @ v[i] / omega
        return out

    yield measured(
        "mechanisms",
        "four-bar: torque and all reactions",
        "mj_inverse, torque only, exact motion given",
        torque,
        size=len(q),
        error=worst(torque(), known["torque"]),
    )


def by_nine_equations(quick: bool) -> Iterator[Measurement]:
    """Torque and joint forces as texts and general programs find them: Newton's and Euler's nine equations by LU."""
    known = reference("four_bar")
    angles, stride = sweep(known, 10_000 if quick else 100_000)
    mechanism = four_bar(loaded=True)
    joints = np.array(known["reactions"])

    def solve() -> Real:
        return _nine_equations(mechanism.motion(angles, float(known["omega_rad_s"]), 0.0))

    found = solve()[::stride]
    error = max(
        worst(found[:, 8], known["torque"]),
        worst(found[:, :8].reshape(-1, 4, 2), joints),
    )
    work = "four-bar: torque and all reactions"
    yield measured(
        "mechanisms", work, "nine equations at once, by LU", solve, size=len(angles), error=error, budget=0.5
    )


def _nine_equations(motion: Motion) -> Real:
    """Return the forces at A, B, C, D on the later link, and the torque, of each pose."""
    m = motion.mechanism
    links = ("crank", "coupler", "rocker")
    acts = {
        "A": (("crank", 1),),
        "B": (("coupler", 1), ("crank", -1)),
        "C": (("rocker", 1), ("coupler", -1)),
        "D": (("rocker", 1),),
    }
    a, b = np.zeros((motion.n, 9, 9)), np.zeros((motion.n, 9))
    for i, link in enumerate(links):
        body = m.links[link]
        force = body.mass * (motion.at(link, body.center).complex(2) - m.gravity)
        b[:, 3 * i], b[:, 3 * i + 1] = force.real, force.imag
        b[:, 3 * i + 2] = body.inertia * motion.link(link).alpha
        b[:, 3 * i + 2] -= sum(t.torque for t in m.torques if t.link == link)
        turn = np.exp(1j * motion.link(link).angle)
        for j, (pin, sides) in enumerate(acts.items()):
            for side, sign in sides:
                if side == link:
                    arm = (body.points[pin] - body.center) * turn
                    a[:, 3 * i, 2 * j] = a[:, 3 * i + 1, 2 * j + 1] = sign
                    a[:, 3 * i + 2, 2 * j], a[:, 3 * i + 2, 2 * j + 1] = -sign * arm.imag, sign * arm.real
    a[:, 2, 8] = 1.0
    return np.asarray(np.linalg.solve(a, b[..., None])[..., 0])
