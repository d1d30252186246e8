"""Forces of a four-bar: time AND error, in one run: `python benchmarks/forces.py`.

Times are CPU times per pose over a sweep, best of several, and as multiples of the kinematics that precede them. The
peer at hand is the way textbooks and general multibody codes take: all nine equations of Newton and Euler at once, by
numpy's batched LU, on the same positions and accelerations. Errors are relative to the largest force of the pose,
against absolute coordinates with Lagrange multipliers in 40 digits (the oracle of the tests).
"""

from __future__ import annotations

import importlib.util
import math
import os
import sys
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import mpmath as mp
import numpy as np

from virtualwork import Guess, Input, Link, Mechanism

ORACLE = Path(__file__).parents[1] / "tests" / "virtualwork" / "test_forces_against_mpmath.py"
POSES = 100_000
SPEED = 30.0


def four_bar() -> Mechanism:
    return Mechanism(
        ground={"A": 0j, "D": 0.1},
        links={
            "crank": Link({"A": 0j, "B": 0.04}, 1.0, 0.01 + 0.003j, 1e-3),
            "coupler": Link({"B": 0j, "C": 0.12}, 2.0, 0.04 + 0.01j, 2e-3),
            "rocker": Link({"D": 0j, "C": 0.08}, 1.5, 0.03 - 0.01j, 1e-3),
        },
        inputs=Input(link="crank"),
        guess=Guess(at=(math.radians(40),), angles={"coupler": 0.3, "rocker": 1.0}),
    )


def cpu(call, repeat=9):
    call()
    best = math.inf
    for _ in range(repeat):
        start = time.process_time()
        call()
        best = min(best, time.process_time() - start)
    return best


def kinematics(motion):
    for link in ("crank", "coupler", "rocker"):
        _ = motion.link(link).alpha
        _ = motion.at(link, motion.mechanism.links[link].center).acceleration
    return motion


def newton_euler(motion):
    """All nine equations of each pose: forces at A, B, C, D on the later link, and the torque."""
    m, n = motion.mechanism, motion.n
    a, b = np.zeros((n, 9, 9)), np.zeros((n, 9))
    links = ("crank", "coupler", "rocker")
    acts = {
        "A": (("crank", 1),),
        "B": (("coupler", 1), ("crank", -1)),
        "C": (("rocker", 1), ("coupler", -1)),
        "D": (("rocker", 1),),
    }
    turn = {link: np.exp(1j * motion.link(link).angle) for link in links}
    for i, link in enumerate(links):
        body = m.links[link]
        acceleration = motion.at(link, body.center).complex(2)
        b[:, 3 * i] = body.mass * acceleration.real
        b[:, 3 * i + 1] = body.mass * acceleration.imag
        b[:, 3 * i + 2] = body.inertia * motion.link(link).alpha
        for j, (pin, sides) in enumerate(acts.items()):
            for side, sign in sides:
                if side == link:
                    arm = (body.points[pin] - body.center) * turn[link]
                    a[:, 3 * i, 2 * j] = a[:, 3 * i + 1, 2 * j + 1] = sign
                    a[:, 3 * i + 2, 2 * j], a[:, 3 * i + 2, 2 * j + 1] = -sign * arm.imag, sign * arm.real
    a[:, 2, 8] = 1.0
    return np.linalg.solve(a, b[..., None])[..., 0]


def errors(found, inputs, m):
    """Worst relative error of torque and joint forces at some poses; `found(i)` gives (torque, forces by joint)."""
    spec = importlib.util.spec_from_file_location("oracle", ORACLE)
    oracle = importlib.util.module_from_spec(spec)
    sys.modules["oracle"] = oracle
    spec.loader.exec_module(oracle)
    mp.mp.dps = 40
    torque_error = force_error = 0.0
    for i in np.unique(np.linspace(0, len(inputs) - 1, 25).astype(int)):
        motion = m.motion(inputs[i], SPEED)
        start = [(complex(motion.at(n, 0j).complex(0)[0]), float(motion.link(n).angle[0])) for n in m.links]
        # the oracle starts from the library's angles, which lie within half a turn
        exact = oracle.Oracle(oracle.Made(m, SPEED, 0.0), (math.remainder(inputs[i], math.tau),), start)
        torque, forces = found(i)
        size = max(abs(exact.pin(joint, on)) for joint, on in forces)
        torque_error = max(
            torque_error, abs(torque - float(exact.effort())) / max(abs(float(exact.effort())), 0.01 * size)
        )
        force_error = max(force_error, *(abs(forces[key] - exact.pin(*key)) / size for key in forces))
    return torque_error, force_error


def main():
    m = four_bar()
    q = np.linspace(0, 2 * np.pi, POSES)
    m.motion(q[:2])
    base = cpu(lambda: kinematics(m.motion(q, SPEED)))
    rows = []

    def effort():
        return m.motion(q, SPEED).effort

    def everything():
        motion = m.motion(q, SPEED)
        motion.dynamics.solve()
        return motion

    def dense():
        motion = kinematics(m.motion(q, SPEED))
        return newton_euler(motion)

    done = everything()
    keys = [("A", "crank"), ("B", "coupler"), ("C", "rocker"), ("D", "rocker")]
    forces = {key: done.reaction(*key) @ np.array([1, 1j]) for key in keys}

    def by_work(i):
        return done.effort[i], {key: forces[key][i] for key in keys}

    def by_newton_euler(i):
        return done.dynamics.newton_euler[i, 0], {key: forces[key][i] for key in keys}

    rows.append(("kinematics alone: α and a_G of every link", base, None))
    rows.append(("torque by virtual work, with its kinematics", cpu(effort), errors(by_work, q, m)))
    rows.append(
        ("torque and all joint forces, with kinematics", cpu(everything), errors(by_newton_euler, q, m))
    )
    solved = dense()
    rows.append(
        (
            "nine equations at once (numpy LU), with kinematics",
            cpu(dense, 3),
            errors(
                lambda i: (
                    solved[i, 8],
                    {k: complex(*solved[i, 2 * j : 2 * j + 2]) for j, k in enumerate(keys)},
                ),
                q,
                m,
            ),
        )
    )
    print(f"four-bar, {POSES} poses, CPU time")
    for name, seconds, error in rows:
        shown = "" if error is None else f"  errors: torque {error[0]:.1e}, forces {error[1]:.1e}"
        print(f"  {name:<52} {seconds / POSES * 1e9:8.0f} ns a pose  {seconds / base:6.2f} x{shown}")


if __name__ == "__main__":
    main()
