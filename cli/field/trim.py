"""What to add to rotors as they stand in their last run, whether that is needed, and the tolerance."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from balancing import initial_unbalance
from cli.field.field_balancing import SINGULAR, FieldBalancing
from cli.field.runs import Complex
from cli.field.solution import Solved
from cli.read.rounding import EPS
from cli.read.tolerance import Verdict

Flags = NDArray[np.bool_]


class Trim:
    """The trims of a group of rotors."""

    def __init__(self, balancing: FieldBalancing, solved: Solved) -> None:
        self.found, self.solved = balancing, solved
        self.masses: Complex = solved.trim
        """(g, p), SI."""
        self.along, self.angle = solved.uncertainty_of(self.masses)
        """Standard deviations of size (SI) and angle (degrees), (g, p) each; NaN where they are not known."""

    @cached_property
    def vibration(self) -> Complex:
        """The vibration of the rotors as they stand, (g, s): as read in the last run, else by the coefficients."""
        solved = self.solved
        read = np.stack([last_reading(self.found, solved, i) for i in range(len(self.masses))])
        expected = solved.initial + np.matvec(solved.alpha, solved.standing)
        return np.where(np.isfinite(read), read, expected)

    @cached_property
    def _holds(self) -> dict[str, Flags]:
        """Why no trim is needed, and in which planes."""
        solved, size = self.solved, np.abs(self.masses)
        terms = np.abs(solved.total).max(axis=1, keepdims=True) + np.abs(solved.standing)
        condition = np.where(np.isfinite(solved.condition), solved.condition, 1.0)[:, None]
        return {
            "nothing is left to correct": size <= 16 * EPS * condition * terms,
            "below its own uncertainty": size < np.where(np.isfinite(self.along), self.along, 0.0),
            **self._limits(),
        }

    def _limits(self) -> dict[str, Flags]:
        """Where the rotor as it stands is within every limit that is asked for."""
        found, solved = self.found, self.solved
        within: dict[str, Flags] = {}
        if found.ceiling is not None:
            fine = np.all(np.abs(self.vibration) <= found.ceiling * (1 + 1e-9), axis=1, keepdims=True)
            within["the vibration is within the limit"] = np.repeat(fine, len(solved.planes), axis=1)
        if found.request.tolerance is not None and solved.unbalance is not None:
            left = solved.unbalance + solved.standing
            if not found.request.four_run:
                weights = solved.group.weights
                left = initial_unbalance(solved.alpha, self.vibration, weights, singular=SINGULAR)
            share = found.request.tolerance.shares(len(solved.planes))
            within["the unbalance is within the tolerance"] = found.in_kg_m(left) <= share
        if not within:
            return {}
        return {" and ".join(within): np.logical_and.reduce(list(within.values()))}

    @property
    def reasons(self) -> list[list[str]]:
        """Why a rotor's plane needs no trim, rotor by rotor; "" where it does."""
        rotors, planes = self.masses.shape
        return [
            [next((why for why, holds in self._holds.items() if holds[i, p]), "") for p in range(planes)]
            for i in range(rotors)
        ]


class LastRun(NamedTuple):
    """A run with masses on the rotor that was made once the coefficients were known."""

    run: str
    on: Complex
    """What was on the rotor, SI, (p,)."""
    vibration: Complex
    """As read, run-out off, (s,); NaN where a sensor was not read."""


def last_run(balancing: FieldBalancing, solved: Solved, i: int) -> LastRun | None:
    """Return a rotor's last run, where it tells how well it is balanced; None where it was a trial run."""
    group, request = solved.group, balancing.request
    if balancing.runs.fitted:
        names, masses = _of_fit(solved, i)
        on = masses[names[-1]]
        if not on.any() or sum(mass.any() for mass in masses.values()) <= len(solved.planes):
            return None
        return LastRun(names[-1], on, _read(balancing, solved, i, names[-1]))
    if request.four_run or len(group.trials) < 2:
        return None
    on = group.standing[i]
    if not (request.from_here and on.any()):
        return None
    return LastRun(group.last[i], on, last_reading(balancing, solved, i))


def last_reading(balancing: FieldBalancing, solved: Solved, i: int) -> Complex:
    """Return what was read in a rotor's last run, run-out off, (s,); NaN where a sensor was not read."""
    group = solved.group
    if balancing.runs.fitted:
        return _read(balancing, solved, i, group.last[i])
    if len(group.trials) > 1 and group.trials[-1].run == group.last[i]:
        return np.asarray(group.means[i, -1] - balancing.runout(group))
    bare = not group.standing[i].any()
    return np.asarray(solved.initial[i] if bare else np.full_like(solved.initial[i], np.nan))


def first_reading(balancing: FieldBalancing, solved: Solved, i: int) -> Complex | None:
    """Return what was read in the first run without masses, run-out off, (s,); None where there is no such run."""
    if not balancing.runs.fitted:
        return np.asarray(solved.initial[i])
    names, masses = _of_fit(solved, i)
    bare = next((name for name in names if not masses[name].any()), None)
    return None if bare is None else _read(balancing, solved, i, bare)


def _of_fit(solved: Solved, i: int) -> tuple[list[str], dict[str, Complex]]:
    """The runs of a fit, in order, and what was on the rotor in each."""
    log, fit = solved.group.logs[i], solved.fit
    return log.runs, {run: fit.masses[i, j] for j, (run, _) in enumerate(log.rows)}


def _read(balancing: FieldBalancing, solved: Solved, i: int, run: str) -> Complex:
    """The mean readings of a run of a fit, run-out off."""
    fit = solved.fit.machine(i)
    rows = [j for j, (name, _) in enumerate(solved.group.logs[i].rows) if name == run]
    there = fit.present[rows]
    sums = np.where(there, fit.readings[rows], 0).sum(axis=0)
    mean = np.full_like(sums, np.nan)
    np.divide(sums, there.sum(axis=0), out=mean, where=there.any(axis=0))
    return np.asarray(mean - balancing.runout(solved.group))


def verdicts(balancing: FieldBalancing, solved: Solved, i: int) -> list[Verdict]:
    """Return each plane's tolerance, as predicted; none where no tolerance is asked for."""
    if balancing.request.tolerance is None or solved.unbalance is None:
        return []
    own = solved.unbalance[i]
    left = own + solved.total[i]
    return _of_planes(balancing, solved, own, np.where(np.abs(left) <= 1e-12 * np.abs(own), 0, left))


def measured_verdicts(balancing: FieldBalancing, solved: Solved, i: int, last: LastRun) -> list[Verdict]:
    """Return each plane's tolerance with the unbalance that the last run shows."""
    if balancing.request.tolerance is None or solved.unbalance is None:
        return []
    read = np.isfinite(last.vibration)
    own = solved.group.own_weights(i)
    weights = None if own is None else own[read]
    left = initial_unbalance(solved.alpha[i][read], last.vibration[read], weights, singular=SINGULAR)
    return _of_planes(balancing, solved, solved.unbalance[i], left)


def _of_planes(balancing: FieldBalancing, solved: Solved, before: Complex, after: Complex) -> list[Verdict]:
    assert balancing.request.tolerance is not None
    shares = balancing.request.tolerance.shares(len(solved.planes)).tolist()
    sizes = zip(balancing.in_kg_m(before).tolist(), balancing.in_kg_m(after).tolist(), strict=True)
    return [
        Verdict(plane, share, *size) for plane, share, size in zip(solved.planes, shares, sizes, strict=True)
    ]
