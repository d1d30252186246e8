"""Run time against error for rigid bodies, beside the peers that are installed (scipy always; MuJoCo, pinocchio if there).

    python benchmarks/rigid_body.py [--turns 1000]

Every method turns the same torque-free body for the same number of revolutions; the error is that of the ATTITUDE
against the closed form (itself within ε·phase of integer Taylor series, tests/rigidbody3d), beside the drift of
momentum and energy, which alone says little. Times are CPU times as multiples of the closed form's single state.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from rigidbody3d import FreeBody, Motion, Top, integrate
from rigidbody3d.attitude import angle_between, normalize, rotate

INERTIA, OMEGA = np.array([1.0, 2.0, 2.5]), np.array([1.0, 0.2, 0.6])


def timed(call: Callable[[], Any], least: float = 0.2) -> tuple[float, Any]:
    """Return the least CPU time of a call over some repetitions, and its result."""
    best, spent, result = np.inf, 0.0, None
    while spent < least:
        start = time.process_time()
        result = call()
        took = time.process_time() - start
        best, spent = min(best, took), spent + max(took, 1e-6)
    return best, result


def scipy_method(method: str, rtol: float, stop: float) -> tuple[np.ndarray, np.ndarray]:
    """The textbook's way: Euler's equations for ω and the quaternion's rate, by solve_ivp."""
    from scipy.integrate import solve_ivp

    I1, I2, I3 = INERTIA.tolist()

    def rates(t: float, y: np.ndarray) -> list[float]:
        p, q, r, w, x, y_, z = y.tolist()
        return [
            (I2 - I3) / I1 * q * r,
            (I3 - I1) / I2 * r * p,
            (I1 - I2) / I3 * p * q,
            (-x * p - y_ * q - z * r) / 2,
            (w * p + y_ * r - z * q) / 2,
            (w * q - x * r + z * p) / 2,
            (w * r + x * q - y_ * p) / 2,
        ]

    y = solve_ivp(rates, (0, stop), [*OMEGA, 1, 0, 0, 0], method=method, rtol=rtol, atol=rtol).y[:, -1]
    return y[:3], normalize(y[3:])


def mujoco_method(integrator: str, per_turn: int, stop: float) -> tuple[np.ndarray, np.ndarray] | None:
    """MuJoCo: a free body of these moments without gravity."""
    try:
        import mujoco
    except ImportError:
        return None
    steps = int(np.ceil(stop * np.linalg.norm(OMEGA) / (2 * np.pi) * per_turn))
    xml = f"""<mujoco><option gravity="0 0 0" timestep="{stop / steps!r}" integrator="{integrator}"/><worldbody><body>
    <freejoint/><inertial pos="0 0 0" mass="1" diaginertia="{INERTIA[0]} {INERTIA[1]} {INERTIA[2]}"/>
    </body></worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    data.qvel[3:] = OMEGA
    mujoco.mj_step(model, data, nstep=steps)
    if data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number:  # it starts anew where it diverges
        return np.full(3, np.nan), np.full(4, np.nan)
    return np.array(data.qvel[3:]), normalize(data.qpos[3:7])


def pinocchio_method(per_turn: int, stop: float) -> tuple[np.ndarray, np.ndarray] | None:
    """pinocchio: a free flyer, its forward dynamics (aba) stepped semi-implicitly on the Lie group."""
    try:
        import pinocchio as pin
    except ImportError:
        return None
    model = pin.Model()
    joint = model.addJoint(0, pin.JointModelSpherical(), pin.SE3.Identity(), "ball")
    model.appendBodyToJoint(joint, pin.Inertia(1e-9, np.zeros(3), np.diag(INERTIA)), pin.SE3.Identity())
    model.gravity = pin.Motion.Zero()
    data = model.createData()
    steps = int(np.ceil(stop * np.linalg.norm(OMEGA) / (2 * np.pi) * per_turn))
    h = stop / steps
    q, v, still = pin.neutral(model), OMEGA.copy(), np.zeros(3)
    for _ in range(steps):
        v = v + h * pin.aba(model, data, q, v, still)
        q = pin.integrate(model, q, h * v)
    with np.errstate(invalid="ignore"):
        return v, q[[3, 0, 1, 2]] / np.linalg.norm(q)


def rotations(turns: float) -> None:
    """Print the work-precision table of free rotation."""
    stop = 2 * np.pi * turns / float(np.linalg.norm(OMEGA))
    body = FreeBody(INERTIA, OMEGA)
    unit, state = timed(lambda: (lambda s: (s.omega, s.attitude))(FreeBody(INERTIA, OMEGA).at(stop)))
    wanted = state[1]
    H, E = np.linalg.norm(body.momentum), float(body.energy)
    print(
        f"\nfree rotation, {turns:g} revolutions (one closed-form state, body included: {unit * 1e6:.0f} µs)"
    )
    print(f"{'method':34}{'time':>10}{'attitude, rad':>15}{'|H| drift':>11}{'energy':>10}")

    def line(name: str, took: float, found: tuple[np.ndarray, np.ndarray] | None) -> None:
        if found is None:
            print(f"{name:34}{'not installed':>21}")
            return
        omega, q = found
        if not np.isfinite(q).all():
            print(f"{name:34}{took / unit:>10.3g}{'diverged':>15}")
            return
        momentum = rotate(q, INERTIA * omega)
        drift = np.linalg.norm(momentum - body.momentum) / H
        energy = abs((INERTIA * omega**2).sum() / 2 / E - 1)
        print(
            f"{name:34}{took / unit:>10.3g}{float(angle_between(q, wanted)):>15.2g}{drift:>11.1g}{energy:>10.1g}"
        )

    line("closed form", unit, state)

    def last(run: Any) -> tuple[np.ndarray, np.ndarray]:
        return run.omega[-1], run.attitude[-1]

    for rtol in (1e-7, 1e-10, 1e-13):
        took, found = timed(lambda rtol=rtol: last(integrate(INERTIA, OMEGA, t=[stop], rtol=rtol)))
        line(f"integrate, DOP853 {rtol:g}", took, found)
    for method in ("RK45", "DOP853"):
        for rtol in (1e-6, 1e-9, 1e-12):
            took, found = timed(lambda m=method, r=rtol: scipy_method(m, r, stop))
            line(f"solve_ivp, {method} {rtol:g}", took, found)
    for integrator in ("Euler", "RK4"):
        for per_turn in (100, 1000):
            took, found = timed(lambda i=integrator, p=per_turn: mujoco_method(i, p, stop))
            line(f"MuJoCo, {integrator}, {per_turn} steps a turn", took, found)
    for per_turn in (100, 1000):
        took, found = timed(lambda p=per_turn: pinocchio_method(p, stop))
        line(f"pinocchio aba, {per_turn} steps a turn", took, found)


def tops(turns: float) -> None:
    """Print the same for a heavy symmetric top: closed form, DOP853, splitting."""
    I, mgl, w, q = [1.0, 1.0, 0.6], 1.2, [0.5, 1.0, 3.0], [0.8, 0.6, 0, 0]
    stop = 2 * np.pi * turns / float(np.linalg.norm(w))
    unit, state = timed(
        lambda: (lambda s: (s.omega, s.attitude, float(s.energy)))(Top(I, mgl, w, q).at(stop))
    )
    print(f"\nheavy top, {turns:g} revolutions (one closed-form state, roots included: {unit * 1e6:.0f} µs)")
    print(f"{'method':34}{'time':>10}{'attitude, rad':>15}{'energy':>10}")
    for name, options in (
        ("DOP853 1e-13", {}),
        ("splitting, 15 steps a turn", {"method": "splitting", "steps_per_turn": 15}),
        ("splitting, 60 steps a turn", {"method": "splitting", "steps_per_turn": 60}),
    ):
        took, run = timed(lambda o=options: integrate(I, w, q, [stop], mgl=mgl, **o))
        error = float(angle_between(run.attitude[-1], state[1]))
        print(f"{name:34}{took / unit:>10.3g}{error:>15.2g}{abs(run.energy[-1] / state[2] - 1):>10.1g}")


def throughput() -> None:
    """Print the time per state of the vectorised work."""
    rng = np.random.default_rng(0)
    n = 1_000_000
    I = np.diag(INERTIA) - 0.1
    w, alpha, a = rng.normal(size=(3, n, 3))

    def blocks() -> Any:
        motion = Motion(I, w, alpha, mass=2.0, acceleration=a)
        return motion.rate, motion.momentum, motion.inertia_force

    def einsum() -> Any:
        H = np.einsum("ij,nj->ni", I, w)
        return H, np.einsum("ij,nj->ni", I, alpha) + np.cross(w, H), -2.0 * a

    ours, theirs = timed(blocks, 1.0)[0], timed(einsum, 1.0)[0]
    print(
        f"\nH, Ḣ, -m a of 10⁶ states: {ours / n * 1e9:.1f} ns a state, einsum and cross {theirs / ours:.1f} × as long"
    )
    t = np.linspace(0, 1000, 200_000)
    body, top = FreeBody(INERTIA, OMEGA), Top([1, 1, 0.6], 1.2, [0.5, 1.0, 3.0], [0.8, 0.6, 0, 0])
    for name, call in (
        ("free rotation, omega", lambda: body.at(t).omega),
        ("free rotation, attitude", lambda: body.at(t).attitude),
        ("heavy top, both", lambda: top.at(t).omega),
    ):
        print(f"{name}: {timed(call, 0.5)[0] / len(t) * 1e9:.0f} ns a state")
    bodies = 10_000
    moments = np.sort(rng.uniform(0.5, 1, (bodies, 3)), axis=-1)
    spin = rng.normal(size=(bodies, 3))

    def many() -> Any:
        state = FreeBody(moments, spin).at(3.0)
        return state.omega, state.attitude

    print(f"10⁴ bodies, one state each: {timed(many, 0.5)[0] / bodies * 1e9:.0f} ns a body")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--turns", type=float, default=1000)
    given = parser.parse_args()
    throughput()
    rotations(given.turns)
    tops(min(given.turns, 1000))
