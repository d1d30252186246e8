"""Make the stored answers, in 50 digits: `python -m benchmarks.truth.make_answers`.

Nothing of dalembert is imported: each answer is worked out here by another road than the program's.
"""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path
from typing import Any

import mpmath as mp
import numpy as np

from benchmarks.truth.four_bar import circles
from benchmarks.truth.rotation import period_of, power, taylor

FOLDER = Path(__file__).with_name("answers")
mp.mp.dps = 50


def series(position: Any, order: int = 2) -> list[Any]:
    """Return a function of time and its derivatives at 0, by mpmath's Taylor coefficients with extra digits."""
    with mp.workdps(90):
        coefficients = mp.taylor(position, 0, order)
    return [c * mp.factorial(k) for k, c in enumerate(coefficients)]


def pair(z: Any) -> list[float]:
    return [float(mp.re(z)), float(mp.im(z))]


def four_bar() -> dict[str, Any]:
    """Norton's four-bar of example 4-1, in m: C and the links' angles with two derivatives, and its forces.

    Forces by Newton and Euler, link by link (ΣF = m a, ΣM = I α), as one linear system of nine unknowns per pose.
    """
    a, b, c, d = (mp.mpf(x) / 1000 for x in (40, 120, 80, 100))
    omega = 25
    angles = np.linspace(0.05, 6.2, 64)
    masses, inertias = (0.3, 0.8, 0.5), (5e-5, 1.2e-3, 3e-4)
    # centres of mass in each link's own axes, and a force and a torque from outside
    centers = (mp.mpc(0.015, 0), mp.mpc(0.06, 0.02), mp.mpc(0.04, -0.01))
    gravity, torque = mp.mpc(0, "-9.81"), mp.mpf(-3)

    def links(t: Any, angle: float) -> tuple[Any, Any, Any, Any]:
        e1 = mp.expj(mp.mpf(angle) + omega * t)
        # C left of the line from B to D is the open assembly: sign -1 on the other side
        point = circles(a * e1, b, mp.mpc(d), c, 1)[0]
        return e1, (point - a * e1) / b, (point - d) / c, point

    out: dict[str, list[Any]] = {"C": [], "coupler": [], "rocker": [], "torque": [], "reactions": []}
    for x in angles.tolist():
        out["C"].append([pair(v) for v in complex_series(lambda t, x=x: links(t, x)[3])])
        e1, e2, e3, point = links(mp.mpf(0), x)
        turns = [e1, e2, e3]
        rates = [[mp.mpf(x), mp.mpf(omega), mp.mpf(0)]]
        for k, name in ((1, "coupler"), (2, "rocker")):
            # the angle against its value here, so that no branch of arg is near
            rate = series(lambda t, x=x, k=k, e=turns[k]: mp.arg(links(t, x)[k] / e))
            rates.append([mp.arg(turns[k]), *rate[1:]])
            out[name].append([float(v) for v in rates[-1]])
        pins = {"A": mp.mpc(0), "B": a * e1, "C": point, "D": mp.mpc(d)}
        first = (pins["A"], pins["B"], pins["D"])

        def center(k: int, t: Any, x: float = x) -> Any:
            *e, _ = links(t, x)
            return (mp.mpc(0), a * e[0], mp.mpc(d))[k] + centers[k] * e[k]

        # unknowns: forces at A on crank, B on coupler, C on rocker, D on rocker, and the input torque
        acts = (("A", 0, 1), ("B", 0, -1), ("B", 1, 1), ("C", 1, -1), ("C", 2, 1), ("D", 2, 1))
        matrix, right = mp.zeros(9, 9), mp.zeros(9, 1)
        for name, k, sign in acts:
            j = 2 * "ABCD".index(name)
            r = pins[name] - first[k] - centers[k] * turns[k]
            matrix[3 * k, j] += sign
            matrix[3 * k + 1, j + 1] += sign
            matrix[3 * k + 2, j] -= sign * mp.im(r)
            matrix[3 * k + 2, j + 1] += sign * mp.re(r)
        matrix[2, 8] = 1
        for k in range(3):
            acceleration = complex_series(lambda t, k=k: center(k, t))[2]
            force = mp.mpf(masses[k]) * (acceleration - gravity)
            right[3 * k], right[3 * k + 1] = mp.re(force), mp.im(force)
            right[3 * k + 2] = mp.mpf(inertias[k]) * rates[k][2] - (torque if k == 2 else 0)
        found = mp.lu_solve(matrix, right)
        out["torque"].append(float(found[8]))
        out["reactions"].append([[float(found[2 * j]), float(found[2 * j + 1])] for j in range(4)])
    return {
        "lengths_m": [0.04, 0.12, 0.08, 0.1],
        "omega_rad_s": omega,
        "mass_kg": masses,
        "inertia_kg_m2": inertias,
        "center_m": [pair(z) for z in centers],
        "gravity_m_s2": 9.81,
        "rocker_torque_N_m": float(torque),
        "angle_rad": angles.tolist(),
        **out,
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

    def leg(t: Any, angle: float) -> list[Any]:
        """e^{iθ} of coupler, rocker, arm and leg, and the foot."""
        b = pin_a + ab * mp.expj(mp.mpf(angle) + 10 * t)
        c = circles(b, bc, pin_d, dc, 1)[0]
        g = c + cg * (c - b) / bc * mp.expj(10 * turn)
        f = circles(pin_e, ef, g, fg, 1)[0]
        h = g + gh * (g - f) / fg * mp.expj(-40 * turn)
        return [(c - b) / bc, (c - pin_d) / dc, (f - pin_e) / ef, (g - f) / fg, h]

    def foot(t: Any, angle: float) -> Any:
        return leg(t, angle)[4]

    check = foot(0, float(mp.pi / 3))
    assert abs(check - mp.mpc("0.7960057379415451", "-0.30376275028920315")) < 1e-15, check
    rows = [[pair(v) for v in complex_series(lambda t, x=x: foot(t, x))] for x in angles.tolist()]
    out: dict[str, Any] = {"omega_rad_s": 10, "angle_rad": angles.tolist(), "H": rows}
    for k, name in enumerate(("coupler", "rocker", "arm", "leg")):
        out[name] = []
        for x in angles.tolist():
            e = leg(mp.mpf(0), x)[k]
            rate = series(lambda t, x=x, k=k, e=e: mp.arg(leg(t, x)[k] / e))
            out[name].append([float(mp.arg(e)), *(float(v) for v in rate[1:])])
    return out


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


def minimax() -> dict[str, Any]:
    """24 sensors and 8 planes: the corrections whose largest residual is least, with the multipliers that prove it.

    Lawson's iteration (weights times residuals, each time a weighted least squares) finds which sensors share the
    largest residual; Newton's method in 50 digits then solves Σ λ_s ᾱ_s r_s = 0, Σ λ_s = 1, |r_s| = t for those.
    The problem is convex: with every λ_s ≥ 0 and every other residual below t, t is the least there is.
    """
    rng = np.random.default_rng(248)
    alpha = rng.normal(size=(24, 8)) + 1j * rng.normal(size=(24, 8))
    initial = 20 * (rng.normal(size=24) + 1j * rng.normal(size=24))
    weight = np.full(24, 1 / 24)
    for _ in range(20_000):
        root = np.sqrt(weight)
        w = np.linalg.lstsq(alpha * root[:, None], -initial * root, rcond=None)[0]
        residual = np.abs(alpha @ w + initial)
        weight *= residual
        weight /= weight.sum()
    active = np.flatnonzero(weight > 1e-7)
    k = len(active)
    a = [[mp.mpc(complex(x)) for x in alpha[s]] for s in active]
    v = [mp.mpc(complex(initial[s])) for s in active]

    def equations(*x: Any) -> list[Any]:
        z = [mp.mpc(x[2 * j], x[2 * j + 1]) for j in range(8)]
        lam, t = x[16 : 16 + k], x[-1]
        r = [mp.fsum(a[i][j] * z[j] for j in range(8)) + v[i] for i in range(k)]
        balance = [mp.fsum(lam[i] * mp.conj(a[i][j]) * r[i] for i in range(k)) for j in range(8)]
        rows = [part for b in balance for part in (mp.re(b), mp.im(b))]
        return [*rows, *(mp.re(x) ** 2 + mp.im(x) ** 2 - t * t for x in r), mp.fsum(lam) - 1]

    start = (
        [part for z in w.tolist() for part in (z.real, z.imag)]
        + weight[active].tolist()
        + [float(residual.max())]
    )
    found = mp.findroot(equations, start, tol=1e-60, maxsteps=30)
    z = [mp.mpc(found[2 * j], found[2 * j + 1]) for j in range(8)]
    every = [
        abs(mp.fsum(mp.mpc(complex(alpha[s, j])) * z[j] for j in range(8)) + mp.mpc(complex(initial[s])))
        for s in range(24)
    ]
    t = found[16 + k]
    assert all(found[16 + i] > 0 for i in range(k)), "a multiplier is negative: not the least"
    assert all(every[s] < t for s in range(24) if s not in active), "another sensor lies above"
    return {
        "influence": [[[x.real, x.imag] for x in row] for row in alpha.tolist()],
        "initial": [[x.real, x.imag] for x in initial.tolist()],
        "objective": float(t),
        "active": active.tolist(),
        "corrections": [pair(x) for x in z],
    }


def rotation() -> dict[str, Any]:
    """Torque-free bodies: attitude after given times, by power series in integers."""
    bodies = [
        ([1.0, 2.0, 3.0], [1.0, 0.1, 0.5], "generic"),
        ([1.0, 2.0, 3.0], [0.5, 0.15, 0.2886751], "near the separatrix"),
        ([1.0, 1.0000000001, 2.0], [0.6, 0.4, 0.6], "nearly symmetric"),
        ([2.0, 2.0, 1.0], [0.3, 0.4, 2.0], "symmetric"),
        ([1.0, 1.5, 1.7], [0.01, 2.0, 0.01], "the middle axis"),
    ]
    return {
        "bodies": [
            {
                "name": name,
                "inertia": inertia,
                "omega": omega,
                "answers": [at(inertia, omega, time) for time in (1.0, 5.0, 20.0)],
            }
            for inertia, omega, name in bodies
        ],
        "long": long_rotation(),
    }


def at(inertia: list[float], omega: list[float], time: Any, attitude: Any = (1, 0, 0, 0)) -> dict[str, Any]:
    w, q = taylor(inertia, omega, time, attitude)
    return {"t_s": float(time), "omega": [float(x) for x in w], "attitude": [float(x) for x in q]}


def long_rotation() -> dict[str, Any]:
    """A generic body after up to 10⁵ periods: after each, ω is as it was, and the body has turned by the same angle."""
    inertia, omega = [1.0, 2.0, 3.0], [1.0, 0.1, 0.5]
    period = period_of(inertia, omega)
    once = taylor(inertia, omega, period)[1]
    answers = []
    for time in (1e1, 1e3, 1e4, 1e5, 1e6, 1.4897368369859e6):
        turns = int(Fraction(time) // period)
        rest = at(inertia, omega, Fraction(time) - turns * period, power(once, turns))
        answers.append({**rest, "t_s": time, "periods": turns})
    return {"inertia": inertia, "omega": omega, "period_s": float(period), "answers": answers}


def main() -> None:
    FOLDER.mkdir(exist_ok=True)
    for make in (four_bar, klann, least_squares, minimax, rotation):
        path = FOLDER / f"{make.__name__}.json"
        path.write_text(json.dumps(make()) + "\n", encoding="utf-8")
        print(path.name, path.stat().st_size)


if __name__ == "__main__":
    main()
