"""Make the stored answers of `dalembert bench`, in 50 digits with mpmath: `python benchmarks/make_references.py`.

Nothing of dalembert is imported: each answer is worked out here by another road than the program's.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import mpmath as mp
import numpy as np

FOLDER = Path(__file__).parents[1] / "cli" / "bench" / "references"
mp.mp.dps = 50


def circles(p: Any, r1: Any, q: Any, r2: Any, sign: int) -> Any:
    """Return the point at r1 from p and r2 from q, on the side of q - p that `sign` gives."""
    d = abs(q - p)
    along = (d**2 + r1**2 - r2**2) / (2 * d)
    up = mp.sqrt(r1**2 - along**2)
    return p + (q - p) / d * mp.mpc(along, sign * up)


def series(position: Any, order: int = 2) -> list[Any]:
    """Return a function of time and its derivatives at 0, by mpmath's Taylor coefficients with extra digits."""
    with mp.workdps(90):
        coefficients = mp.taylor(position, 0, order)
    return [c * mp.factorial(k) for k, c in enumerate(coefficients)]


def pair(z: Any) -> list[float]:
    return [float(mp.re(z)), float(mp.im(z))]


def four_bar() -> dict[str, Any]:
    """Norton's four-bar of example 4-1, in m: positions, velocities and accelerations of C at given crank angles."""
    a, b, c, d = (mp.mpf(x) / 1000 for x in (40, 120, 80, 100))
    omega = 25
    angles = np.linspace(0.05, 6.2, 64)

    def point(t: Any, angle: float) -> Any:
        crank = a * mp.expj(mp.mpf(angle) + omega * t)
        # C left of the line from B to D is the open assembly: sign -1 on the other side
        return circles(crank, b, mp.mpc(d), c, 1)

    rows = [[pair(v) for v in complex_series(lambda t, x=x: point(t, x))] for x in angles.tolist()]
    return {
        "lengths_m": [0.04, 0.12, 0.08, 0.1],
        "omega_rad_s": omega,
        "angle_rad": angles.tolist(),
        "C": rows,
    }


def complex_series(function: Any) -> list[Any]:
    """Return value, first and second derivative of a complex function of a real variable."""
    real = series(lambda t: mp.re(function(t)))
    imaginary = series(lambda t: mp.im(function(t)))
    return [mp.mpc(x, y) for x, y in zip(real, imaginary, strict=True)]


def klann() -> dict[str, Any]:
    """The Klann leg of the source 003, in m: position, velocity, acceleration of the foot H, crank at 10 rad/s."""
    mm = [mp.mpf(x) / 1000 for x in (120, 350, 140, 360, 270, 360, 430)]
    ab, bc, dc, cg, ef, fg, gh = mm
    pin_a, pin_d, pin_e = (mp.mpc(*(mp.mpf(x) / 1000 for x in p)) for p in ((0, 90), (350, 0), (290, 230)))
    turn = mp.pi / 180
    angles = np.linspace(0.05, 6.2, 64)

    def foot(t: Any, angle: float) -> Any:
        b = pin_a + ab * mp.expj(mp.mpf(angle) + 10 * t)
        c = circles(b, bc, pin_d, dc, 1)
        g = c + cg * (c - b) / bc * mp.expj(10 * turn)
        f = circles(pin_e, ef, g, fg, 1)
        return g + gh * (g - f) / fg * mp.expj(-40 * turn)

    check = foot(0, float(mp.pi / 3))
    assert abs(check - mp.mpc("0.7960057379415451", "-0.30376275028920315")) < 1e-15, check
    rows = [[pair(v) for v in complex_series(lambda t, x=x: foot(t, x))] for x in angles.tolist()]
    return {"omega_rad_s": 10, "angle_rad": angles.tolist(), "H": rows}


def least_squares() -> dict[str, Any]:
    """24 sensors and 8 planes, of several condition numbers: the least-squares corrections."""
    rng = np.random.default_rng(24)
    cases = []
    for exponent in (0, 2, 4, 6, 8):
        u = np.linalg.qr(rng.normal(size=(24, 8)) + 1j * rng.normal(size=(24, 8)))[0]
        v = np.linalg.qr(rng.normal(size=(8, 8)) + 1j * rng.normal(size=(8, 8)))[0]
        alpha = (u * np.logspace(0, -exponent, 8)) @ v
        wanted = rng.normal(size=8) + 1j * rng.normal(size=8)
        # a residual of a thousandth: the rest is what the planes can answer
        initial = -alpha @ wanted + 1e-3 * (rng.normal(size=24) + 1j * rng.normal(size=24)) * 10.0**-exponent
        a = mp.matrix(alpha.tolist())
        b = mp.matrix([[complex(x)] for x in initial])
        w = mp.lu_solve(a.H * a, -(a.H * b))
        cases.append(
            {
                "condition": float(np.linalg.cond(alpha)),
                "influence": [[[z.real, z.imag] for z in row] for row in alpha.tolist()],
                "initial": [[z.real, z.imag] for z in initial.tolist()],
                "corrections": [pair(w[i]) for i in range(8)],
            }
        )
    return {"cases": cases}


def rotation() -> dict[str, Any]:
    """Torque-free bodies: attitude after given times, by a Taylor series of high order in small steps."""
    bodies = [
        ([1.0, 2.0, 3.0], [1.0, 0.1, 0.5], "generic"),
        ([1.0, 2.0, 3.0], [0.5, 0.15, 0.2886751], "near the separatrix"),
        ([1.0, 1.0000000001, 2.0], [0.6, 0.4, 0.6], "nearly symmetric"),
        ([2.0, 2.0, 1.0], [0.3, 0.4, 2.0], "symmetric"),
        ([1.0, 1.5, 1.7], [0.01, 2.0, 0.01], "the middle axis"),
    ]
    out = []
    for inertia, omega, name in bodies:
        times = [1.0, 5.0, 20.0]
        state = [*map(mp.mpf, omega), mp.mpf(1), mp.mpf(0), mp.mpf(0), mp.mpf(0)]
        at, answers = mp.mpf(0), []
        for time in times:
            steps = int(np.ceil((time - float(at)) / 0.125))
            h = (mp.mpf(time) - at) / steps
            for _ in range(steps):
                state = taylor_step([mp.mpf(x) for x in inertia], state, h, 40)
            at = mp.mpf(time)
            answers.append(
                {
                    "t_s": time,
                    "omega": [float(x) for x in state[:3]],
                    "attitude": [float(x) for x in state[3:]],
                }
            )
        out.append({"name": name, "inertia": inertia, "omega": omega, "answers": answers})
    return {"bodies": out}


def taylor_step(inertia: list[Any], state: list[Any], h: Any, order: int) -> list[Any]:
    """Advance Euler's equations and q' = q·(0, ω)/2 by the power series of both."""
    i1, i2, i3 = inertia
    rate = [(i2 - i3) / i1, (i3 - i1) / i2, (i1 - i2) / i3]
    c = [[x] for x in state]

    def product(x: list[Any], y: list[Any], n: int) -> Any:
        return mp.fsum(x[k] * y[n - k] for k in range(n + 1))

    for n in range(order):
        w = c[:3]
        for axis in range(3):
            w[axis].append(rate[axis] * product(w[(axis + 1) % 3], w[(axis + 2) % 3], n) / (n + 1))
        q = c[3:]
        derivative = [
            -product(q[1], w[0], n) - product(q[2], w[1], n) - product(q[3], w[2], n),
            product(q[0], w[0], n) + product(q[2], w[2], n) - product(q[3], w[1], n),
            product(q[0], w[1], n) + product(q[3], w[0], n) - product(q[1], w[2], n),
            product(q[0], w[2], n) + product(q[1], w[1], n) - product(q[2], w[0], n),
        ]
        for axis in range(4):
            q[axis].append(derivative[axis] / 2 / (n + 1))
    return [mp.fsum(x * h**n for n, x in enumerate(series)) for series in c]


def main() -> None:
    FOLDER.mkdir(exist_ok=True)
    for make in (four_bar, klann, least_squares, rotation):
        path = FOLDER / f"{make.__name__}.json"
        path.write_text(json.dumps(make()) + "\n", encoding="utf-8")
        print(path.name, path.stat().st_size)


if __name__ == "__main__":
    main()
