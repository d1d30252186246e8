"""The tolerance of a balancing in the field: what the unbalance was, what is predicted, what the last run says."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from balancing import initial_unbalance
from cli.field.runs import Complex
from cli.field.solve import SINGULAR, FieldBalancing, Solved
from cli.read.tolerance import Verdict


class LastRun(NamedTuple):
    """A run with masses on the rotor that was made once the coefficients were known."""

    run: str
    on: Complex
    """What was on the rotor, SI, (p,)."""
    vibration: Complex
    """As read, run-out off, (s,); NaN where a sensor was not read."""


def last_run(found: FieldBalancing, solved: Solved, i: int) -> LastRun | None:
    """Return a rotor's last run, where it tells how well it is balanced; None where it was a trial run."""
    group, request = solved.group, found.request
    if group.fit is not None:
        names, masses = _of_fit(solved, i)
        on = masses[names[-1]]
        if not on.any() or sum(mass.any() for mass in masses.values()) <= len(solved.planes):
            return None
        return LastRun(names[-1], on, _read(found, solved, i, names[-1]))
    if request.four_run or not group.trials:
        return None
    on = group.on[i, -1]
    if not (request.from_here and on.any() and (on == group.kept[i]).all()):
        return None
    return LastRun(group.trials[-1].run, on, group.runs[i, -1] - found.runout(group))


def first_reading(found: FieldBalancing, solved: Solved, i: int) -> Complex | None:
    """Return what was read in the first run without masses, run-out off, (s,); None where there is no such run."""
    if solved.group.fit is None:
        return np.asarray(solved.initial[i])
    names, masses = _of_fit(solved, i)
    bare = next((name for name in names if not masses[name].any()), None)
    return None if bare is None else _read(found, solved, i, bare)


def _of_fit(solved: Solved, i: int) -> tuple[list[str], dict[str, Complex]]:
    """The runs of a fit, in order, and what was on the rotor in each."""
    assert solved.group.fit is not None
    log, fit = solved.group.logs[i], solved.group.fit
    return log.runs, {run: fit.masses[i, j] for j, (run, _) in enumerate(log.rows)}


def _read(found: FieldBalancing, solved: Solved, i: int, run: str) -> Complex:
    """The mean readings of a run of a fit, run-out off."""
    assert solved.group.fit is not None
    fit = solved.group.fit.machine(i)
    rows = [j for j, (name, _) in enumerate(solved.group.logs[i].rows) if name == run]
    there = fit.present[rows]
    sums = np.where(there, fit.readings[rows], 0).sum(axis=0)
    mean = np.full_like(sums, np.nan)
    np.divide(sums, there.sum(axis=0), out=mean, where=there.any(axis=0))
    return np.asarray(mean - found.runout(solved.group))


def verdicts(found: FieldBalancing, solved: Solved, i: int) -> list[Verdict]:
    """Return each plane's tolerance, as predicted; none where no tolerance is asked for."""
    if found.request.tolerance is None or solved.unbalance is None:
        return []
    own = solved.unbalance[i]
    left = own + solved.total[i]
    return _of_planes(found, solved, own, np.where(np.abs(left) <= 1e-12 * np.abs(own), 0, left))


def measured_verdicts(found: FieldBalancing, solved: Solved, i: int, last: LastRun) -> list[Verdict]:
    """Return each plane's tolerance with the unbalance that the last run shows."""
    if found.request.tolerance is None or solved.unbalance is None:
        return []
    read = np.isfinite(last.vibration)
    own = solved.group.own_weights(i)
    weights = None if own is None else own[read]
    left = initial_unbalance(solved.alpha[i][read], last.vibration[read], weights, singular=SINGULAR)
    return _of_planes(found, solved, solved.unbalance[i], left)


def _of_planes(found: FieldBalancing, solved: Solved, before: Complex, after: Complex) -> list[Verdict]:
    assert found.request.tolerance is not None
    share = found.request.tolerance.permissible / len(solved.planes)
    sizes = zip(found.in_kg_m(before).tolist(), found.in_kg_m(after).tolist(), strict=True)
    return [Verdict(plane, share, *size) for plane, size in zip(solved.planes, sizes, strict=True)]
