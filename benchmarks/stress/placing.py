"""Stress of the four-run method, of placement, and of the commands' own digits: phases at the wrap, from decimals."""

from __future__ import annotations

import tempfile
from fractions import Fraction
from pathlib import Path
from typing import Any

import mpmath as mp
import numpy as np

from balancing import influence_from_amplitudes, place
from benchmarks.stress.pairs import Pairs, noise, pairs
from benchmarks.truth.vibration import DIGITS, nearest_fit

# --- four runs ---


def _four_runs(rng: np.random.Generator) -> Pairs:
    """Amplitudes that fit (rounded once) or that do not, scales of 1e-12 … 1e12, two to five runs."""
    runs = int(rng.integers(3, 6))
    mass, unit = 10.0 ** rng.uniform(-12, 12, 2)
    t = mass * np.exp(1j * (2 * np.pi * np.arange(runs) / runs + rng.normal(size=runs) * 0.4))
    t *= 10.0 ** rng.uniform(-0.3, 0.3, runs)
    first = unit * rng.uniform(0.5, 2)
    true = first / mass * 10.0 ** rng.uniform(-2, 1) * np.exp(1j * rng.uniform(0, 2 * np.pi))
    read = np.abs(first + true * t) * (1 + 10.0 ** rng.uniform(-17, -2) * rng.normal(size=runs))
    fit = influence_from_amplitudes([first], read[:, None], t)
    with mp.workdps(DIGITS):
        alpha, misfit = nearest_fit(complex(fit.influence[0]), first, read.tolist(), t.tolist())
        if alpha is None:
            return []
        return pairs(fit.influence.tolist(), [alpha], fit.error_estimate()) + pairs(
            fit.misfit.tolist(), [misfit], fit.error_estimate("misfit")
        )


# --- placement ---


def _placed(rng: np.random.Generator) -> Pairs:
    """Blades down to 1e-7 apart, or nearly opposite, with and without limits, reachable or not, 1e-12 … 1e12 kg."""
    n = int(rng.integers(2, 17))
    angles = rng.uniform(0, 2 * np.pi) + np.sort(rng.uniform(0, 2 * np.pi, n))
    if rng.random() < 0.5:
        angles[1] = angles[0] + 10.0 ** rng.uniform(-7, 0) + np.pi * rng.integers(0, 2)
    size = 10.0 ** rng.uniform(-12, 12)
    target = complex(size * noise(rng, 1)[0])
    if rng.random() < 0.3:
        target = complex(size * np.exp(1j * (angles[0] + 10.0 ** rng.uniform(-9, 0))))
    limit = size * 10.0 ** rng.uniform(-1, 1) if rng.random() < 0.5 else None
    try:
        found = place(target, angles, limit)
    except ValueError:  # two at the same angle
        return []
    with mp.workdps(DIGITS):
        goal = mp.mpmathify(target)
        arms = [mp.expj(mp.mpf(float(angle))) for angle in angles]
        true = [mp.mpf(float(mass)) for mass in found.masses]
        rest = goal - mp.fsum(true[i] * arms[i] for i in range(n) if i not in found.free)
        if len(found.free) == 2:
            i, j = found.free
            det = (mp.conj(arms[i]) * arms[j]).imag
            true[i] = (mp.conj(rest) * arms[j]).imag / det
            true[j] = (mp.conj(arms[i]) * rest).imag / det
        elif found.free:
            (i,) = found.free
            value = (rest * mp.conj(arms[i])).real
            cap = mp.inf if limit is None else mp.mpf(limit)
            true[i] = max(min(value, cap), mp.mpf(0))
        total = mp.fsum(m * arm for m, arm in zip(true, arms, strict=True))
        # what the truth itself is rounded by
        own = float((abs(goal) + mp.fsum(true)) * mp.mpf(10) ** (20 - DIGITS))
        each = pairs(found.masses.tolist(), true, found.error_estimate()) + pairs(
            [found.total, found.error],
            [total, total - goal],
            [found.error_estimate("total"), found.error_estimate("error")],
        )
        return [(error if error > own else 0.0, bound) for error, bound in each]


# --- the commands' own digits ---


def _decimal_phase(rng: np.random.Generator) -> str:
    """Draw a phase as it may be written: anywhere, at the wrap, many turns."""
    kind = rng.integers(5)
    if kind == 0:
        return f"{360 - 10.0 ** rng.uniform(-13, -1):.13f}"
    if kind == 1:
        return f"-1e-{rng.integers(1, 15)}"
    if kind == 2:
        return f"{360 * int(rng.integers(-1000, 1000)) + int(rng.integers(0, 4)) * 90}"
    if kind == 3:
        return f"{rng.integers(-1000, 1000) * 360 + rng.uniform(0, 360):.6f}"
    return f"{rng.uniform(-360, 720):.3f}"


def _written(rng: np.random.Generator) -> tuple[str, str]:
    return f"{10.0 ** rng.uniform(-6, 6):.6g}", _decimal_phase(rng)


def _vector(size: str, phase: str) -> Any:
    """A vector of decimals, exactly reduced."""
    turn = Fraction(phase) % 360
    angle = mp.mpf(turn.numerator) / turn.denominator * mp.pi / 180
    return mp.mpf(size) * mp.expj(angle)


def _wrapped(rng: np.random.Generator) -> Pairs:
    """Single-plane balancing from a written table to the columns of the command."""
    from cli.field.field_balancing import FieldBalancing
    from cli.field.fit import Request, measured_groups
    from cli.field.tables import corrections

    v0, t, v1 = _written(rng), _written(rng), _written(rng)
    if rng.random() < 0.4:  # a trial run that hardly differs from the initial one
        phase = Fraction(v0[1]) + Fraction(round(1e9 * 10.0 ** rng.uniform(-5, 0)), 10**9)
        v1 = (f"{float(v0[0]) * (1 + 10.0 ** rng.uniform(-5, -1)):.8g}", f"{float(phase):.9f}")
    rows = [
        "run,sensor,amplitude_um,phase_deg,trial_plane,trial_mass_g,trial_angle_deg",
        f"0,1,{v0[0]},{v0[1]},,,",
        f"1,1,{v1[0]},{v1[1]},A,{t[0]},{t[1]}",
    ]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "runs.csv"
        path.write_text("\n".join(rows) + "\n")
        request = Request()
        runs, _ = measured_groups(str(path), request)
        columns = {c.header: c for c in corrections(FieldBalancing(runs, request), []).columns}
    size, angle = (float(str(columns[name].values[0])) for name in ("mass_g", "angle_deg"))
    bound = {name: column.error() for name, column in columns.items() if column.error is not None}
    with mp.workdps(DIGITS):
        a, b = _vector(*v0), _vector(*v1)
        if a == b:
            return []
        w = -a / (b - a) * _vector(*t)
        off = (mp.mpf(angle) - mp.degrees(mp.arg(w))) % 360
        return [
            *pairs([size], [abs(w)], bound["mass_g"]),
            (
                float(mp.chop(min(off, 360 - off), tol=mp.mpf(10) ** (20 - DIGITS))),
                float(bound["angle_deg"][0]),
            ),
            (0.0 if 0 <= angle < 360 else 1.0, 1e-300),
        ]


CAMPAIGNS = {
    "four runs": ("amplitudes that fit or do not, three to five runs, scales 1e-12 … 1e12", _four_runs),
    "placement": (
        "blades down to 1e-7 apart or nearly opposite, limits, out of reach, 1e-12 … 1e12 kg",
        _placed,
    ),
    "phases at the wrap": ("single-plane balancing by the command: 359.999…°, -1e-13°, many turns", _wrapped),
}
