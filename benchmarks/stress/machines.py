"""Stress of engines, flywheels, trial runs and error budgets: what cancels, long rods and short ones, many digits lost."""

from __future__ import annotations

import mpmath as mp
import numpy as np

from balancing import error_budget, once_per_turn, torque_cycle, trial_effect
from balancing.engine import reciprocating_forces
from benchmarks.stress.pairs import Pairs, noise, pairs
from benchmarks.truth.machines import even_marks, shaking, turning_moments
from benchmarks.truth.machines import once_per_turn as once_per_turn_truth
from virtualwork.textbook.link_states import LinkStates, UnitLoad
from virtualwork.textbook.power_balance import balance

ORDERS = 6


def _engine(rng: np.random.Generator) -> Pairs:
    n = int(rng.integers(1, 7))
    step = rng.choice([1.0, 30.0, 90.0])
    crank, bank = (np.round(rng.uniform(0, 360, n) / step) * step + rng.choice([0, 1e-9]) for _ in range(2))
    z, mass = rng.uniform(-1, 1, n), np.full(n, rng.uniform(0.1, 2))
    throw = np.full(n, rng.uniform(0.03, 0.06))
    rod = throw / rng.uniform(0.01, 0.6)
    speed = float(rng.uniform(1, 700))
    forces = reciprocating_forces(crank, bank, z, throw, rod, mass, speed, ORDERS)
    found: Pairs = []
    with mp.workdps(45):
        rows = [[mp.mpf(x) for x in row] for row in zip(crank, bank, z, throw, rod, mass, strict=True)]
        for couple, true in enumerate(shaking(rows, mp.mpf(speed), ORDERS)):
            values = forces.coefficients(bool(couple)).ravel().tolist()
            bound = forces.error_estimate("coefficients", bool(couple)).ravel()
            found += pairs(values, [x for row in true for x in row], bound)
    return found


def _flywheel(rng: np.random.Generator) -> Pairs:
    n = int(rng.integers(2, 60))
    angle = np.concatenate([[0.0], np.sort(rng.uniform(0, 4 * np.pi, n)), [4 * np.pi]])
    torque = rng.normal(size=n + 2) * 10.0 ** rng.uniform(-3, 3) + rng.choice([0.0, 1e6])
    cycle = torque_cycle(angle, torque)
    error = cycle.error_estimate()
    with mp.workdps(45):
        true = turning_moments([mp.mpf(x) for x in angle], [mp.mpf(x) for x in torque])
        found = pairs(cycle.energy.tolist(), true["energy"], error["energy"])
        names = ("mean", "work", "fluctuation")
        return found + pairs(
            [getattr(cycle, x) for x in names], [true[x] for x in names], [error[x] for x in names]
        )


def _effect(rng: np.random.Generator) -> Pairs:
    n = 20
    before = noise(rng, n) * 10.0 ** rng.uniform(-3, 3, n)
    after = before * (1 + 10.0 ** rng.uniform(-15, 1, n) * noise(rng, n))
    effect = trial_effect(before, after)
    bound = effect.error_estimate()
    with mp.workdps(60):
        both = [
            (mp.mpmathify(a), mp.mpmathify(b)) for a, b in zip(before.tolist(), after.tolist(), strict=True)
        ]
        share = [abs(abs(b) - abs(a)) / abs(a) for a, b in both]
        turn = [abs(mp.arg(b / a)) for a, b in both]
        return pairs(effect.amplitude, share, bound.amplitude) + pairs(effect.phase, turn, bound.phase)


def _budget(rng: np.random.Generator) -> Pairs:
    n = 20
    random, systematic = rng.normal(size=(2, n, int(rng.integers(1, 8)))) * 10.0 ** rng.uniform(-3, 3)
    sizes = np.abs(systematic).sum(axis=-1) + np.sqrt(np.square(random).sum(axis=-1))
    permissible = sizes * (1 + 10.0 ** rng.uniform(-15, 1, n))
    budget = error_budget(permissible, random, systematic)
    bound = budget.error_estimate()
    with mp.workdps(45):
        error = [
            mp.fsum(abs(mp.mpf(x)) for x in s) + mp.sqrt(mp.fsum(mp.mpf(x) ** 2 for x in r))
            for r, s in zip(random.tolist(), systematic.tolist(), strict=True)
        ]
        u = [mp.mpf(x) for x in permissible.tolist()]
        accept = [max(x - e, 0) for x, e in zip(u, error, strict=True)]
        reject = [x + e for x, e in zip(u, error, strict=True)]
        return [
            *pairs(budget.error, error, bound.error),
            *pairs(budget.accept, accept, bound.accept),
            *pairs(budget.reject, reject, bound.reject),
        ]


def _link_states(rng: np.random.Generator) -> Pairs:
    n, k = int(rng.integers(1, 8)), int(rng.integers(1, 4))
    shape = (n,) if k == 1 else (k, n)
    near = 10.0 ** rng.uniform(-9, 0)
    velocity, omega = (
        noise(rng, n) + near * noise(rng, *shape),
        rng.normal(size=n) + near * rng.normal(size=shape),
    )
    real = {name: rng.normal(size=n) for name in ("mass", "inertia", "alpha", "torque")}
    given = {"acceleration": noise(rng, n), "force": noise(rng, n), **real}
    states = LinkStates(velocity, omega, **given, gravity=-9.81j)
    unknowns = [UnitLoad(force=noise(rng, n), torque=rng.normal(size=n)) for _ in range(k)]
    found = balance(states, unknowns)
    with mp.workdps(60):
        rows, right, sizes = mp.matrix(k, k), mp.matrix(k, 1), []
        for f in range(k):
            v, w = ([mp.mpmathify(x) for x in (a if k == 1 else a[f]).tolist()] for a in (velocity, omega))
            of = {name: [mp.mpmathify(x) for x in x.tolist()] for name, x in given.items()}
            right[f] = -mp.fsum(
                (
                    (of["force"][i] + of["mass"][i] * (mp.mpc(0, -9.81) - of["acceleration"][i]))
                    * mp.conj(v[i])
                ).real
                + (of["torque"][i] - of["inertia"][i] * of["alpha"][i]) * w[i]
                for i in range(n)
            )
            sizes.append(-right[f])
            for j, unknown in enumerate(unknowns):
                force, torque = (
                    [mp.mpmathify(x) for x in np.asarray(each).tolist()]
                    for each in (unknown.force, unknown.torque)
                )
                rows[f, j] = mp.fsum((force[i] * mp.conj(v[i])).real + torque[i] * w[i] for i in range(n))
        if not found.determined.all():
            return []
        true = list(mp.lu_solve(rows, right))
    bound = states.error_estimate()
    return pairs(found.value, true, found.error_estimate()) + pairs(
        np.atleast_1d(states.power), sizes, np.atleast_1d(bound)
    )


def _recording(rng: np.random.Generator) -> Pairs:
    turns, per = int(rng.integers(2, 6)), int(rng.integers(8, 24))
    n, period = turns * per + int(rng.integers(4, per)), rng.uniform(0.01, 0.1)
    t = np.arange(n) * period / (per + rng.uniform(0, 0.9)) + rng.choice([0.0, 1e3]) * period
    phase = 2 * np.pi * (t - t[0]) / period + rng.uniform(0, 6)
    x = np.cos(phase + 1.0) + 0.3 * np.cos(2 * phase) + 10.0 ** rng.uniform(-12, 0) * rng.normal(size=n)
    two_levels = rng.random() < 0.5
    mark = (np.sin(phase) > 0.3).astype(float) if two_levels else np.sin(phase)
    try:
        found = once_per_turn(t, x[:, None], mark)
    except ValueError:
        return []
    errors = found.error_estimate()
    with mp.workdps(50):
        at, levels, values = ([mp.mpf(float(v)) for v in each] for each in (t, mark, x))
        half = (min(levels) + max(levels)) / 2
        rises = [i for i in range(n - 1) if levels[i] < half <= levels[i + 1]]
        if two_levels:
            if mark[0] > 0:
                return []
            falls = max(i for i in range(n - 1) if levels[i] >= half > levels[i + 1])
            inside = [i for i in rises if i < falls]
            places = even_marks([at[i] for i in inside], [at[i + 1] for i in inside])
        else:
            places = [
                at[i] + (half - levels[i]) / (levels[i + 1] - levels[i]) * (at[i + 1] - at[i]) for i in rises
            ]
        if len(places) != found.turns + 1:
            return []
        mean, deviation = once_per_turn_truth(at, values, places, 3)
        speed = 2 * mp.pi * found.turns / (places[-1] - places[0])
    pairs_of = [(float(abs(mp.mpmathify(complex(found.vector[0])) - mean)), float(errors.vector[0]))]
    pairs_of += pairs([found.speed], [speed], [errors.speed])
    return pairs_of if deviation is None else pairs_of + pairs(found.deviation, [deviation], errors.deviation)


CAMPAIGNS = {
    "once per turn": (
        "recordings of some turns with harmonics and noise, marks of two levels and others",
        _recording,
    ),
    "link states": ("loads and unknowns of up to seven links, fields that nearly agree", _link_states),
    "engines": ("one to six cylinders of any layout, λ of 0.01 … 0.6", _engine),
    "flywheels": ("torque over two turns, up to 60 rows, on a large mean now and then", _flywheel),
    "trial runs": ("readings that a trial mass changes by 1e-15 … 10 times", _effect),
    "error budgets": ("errors that use up the permissible unbalance to 1e-15", _budget),
}
