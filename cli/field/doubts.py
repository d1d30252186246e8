"""What is said of a balancing in the field as warnings."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

import balancing
from balancing import plane_significance, trial_effect
from cli.field.field_balancing import FieldBalancing
from cli.field.runs import SHOWN, Group
from cli.field.solution import Solved
from dalembert.angles import degrees

NEARLY = 0.1  # a plane whose effect others bring about but for this share is said to be nearly dependent


def warnings(found: FieldBalancing) -> list[str]:
    """What was done otherwise than a reader might think, each once."""
    said = (sentence for solved in found.solved for sentence in _remarks(found, solved))
    fits: Iterable[str] = ()
    if found.runs.fitted:
        from cli.field.fits import remarks

        fits = remarks(found)
    return [*dict.fromkeys([*found.runs.warnings, *found.warnings, *said]), *fits]


def _remarks(found: FieldBalancing, solved: Solved) -> Iterator[str]:
    group, planes = solved.group, solved.planes
    still = np.flatnonzero(~np.abs(solved.initial).any(axis=1))
    for i in still[:SHOWN]:
        yield (f"{found.of(group, int(i))}no vibration in the initial run: nothing to correct")
    yield from _more(len(still), "no vibration in the initial run")
    doubtful = np.flatnonzero(~(solved.condition < 5)) if len(planes) > 1 else np.zeros(0, dtype=int)
    if len(doubtful):
        weights = None if group.weights is None else group.weights[doubtful]
        share = plane_significance(solved.alpha[doubtful], weights)
        weak = share < NEARLY
        rows = np.flatnonzero(weak.any(axis=1))
        for k in rows[:SHOWN]:
            named = [f"{planes[p]} ({share[k, p]:.2g})" for p in np.flatnonzero(weak[k])]
            i = int(doubtful[k])
            yield (
                f"{found.of(group, i)}planes nearly dependent: others bring about what these do but for the share in "
                f"brackets: {', '.join(named)}; condition number {solved.condition[i]:.3g}, errors grow by as much: leave "
                "one out, or damp with --ridge"
            )
        yield from _more(len(rows), "planes nearly dependent")
    if not found.request.four_run:
        yield from _thirty(found, group)
    for i, (fit, *_) in enumerate(solved.fits):
        for s, (first, rival) in enumerate(zip(group.initial[i], fit.other, strict=True)):
            if rival == rival:
                other = -first / rival
                yield (
                    f"{found.of(group, i)}sensor {group.channels[s]}: two corrections fit the amplitudes; the other one is "
                    f"{found.amount(abs(other)):.6g} {found.unit} at {float(degrees(other)):.2f}°: a further trial run at "
                    "another angle decides"
                )
    if found.request.tolerance is not None and solved.unbalance is not None:
        unknown = np.isnan(solved.unbalance)
        lost = np.flatnonzero(unknown.any(axis=1))
        for i in lost[:SHOWN]:
            told = [planes[p] for p in np.flatnonzero(unknown[i])]
            yield (
                f"{found.of(group, int(i))}the initial unbalance is not determined in plane{'s' * (len(told) > 1)} "
                f"{' and '.join(told)}: {_why(group, planes, told)}; whether it is within the tolerance is not known"
            )
        yield from _more(len(lost), "the initial unbalance is not determined in every plane")
        # from here on means with the trial masses that were left on the rotor
        size = found.in_kg_m(solved.unbalance + solved.start)
        good = np.flatnonzero((size <= found.request.tolerance.shares(len(planes))).all(axis=1))
        for i in good[:SHOWN]:
            yield (
                f"{found.of(group, int(i))}already within the permissible residual unbalance in every plane: stop, no "
                "correction is needed"
            )
        yield from _more(len(good), "already within the permissible residual unbalance")
    if found.ceiling is not None:
        fine = (np.abs(solved.initial) <= found.ceiling).all(axis=1)
        for i in np.flatnonzero(fine)[:SHOWN]:
            yield (f"{found.of(group, int(i))}the initial vibration is within --max-residual already")
        yield from _more(int(fine.sum()), "initial vibration within --max-residual already")
    for w in solved.corrections[:SHOWN].ravel():
        if found.request.places is not None and w != 0:
            missed = balancing.place(complex(w), np.radians(found.request.places)).error
            if abs(missed) > 1e-9 * abs(w):
                yield f"a correction at {degrees(w):.4g}° cannot be reached from the places given"


def _thirty(found: FieldBalancing, group: Group) -> Iterator[str]:
    """The 30/30 rule."""
    standing = group.initial
    for j, trial in enumerate(group.trials):
        before, standing = standing, group.means[:, j] if trial.kept else standing
        if not trial.tried:
            continue
        effect = trial_effect(before, group.means[:, j])
        little = ~((effect.amplitude >= 0.3) | (effect.phase >= np.radians(30))).any(axis=1)
        for i in np.flatnonzero(little)[:SHOWN]:
            most = np.max(effect.amplitude[i])
            turn = np.degrees(np.max(effect.phase[i]))
            yield (
                f"{found.of(group, int(i))}run {trial.run}: the trial mass changed the vibration by {most:.0%} and {turn:.0f}° "
                "at most: less than 30 % and 30°, its coefficients may be noise; expected a larger trial mass"
            )
        yield from _more(
            int(little.sum()), f"run {trial.run} changed the vibration by less than 30 % and 30°"
        )


def _more(count: int, what: str) -> Iterator[str]:
    if count > SHOWN:
        yield f"… and the same of {count - SHOWN} further rotors: {what}"


def _why(group: Group, planes: list[str], told: list[str]) -> str:
    """Why the readings do not determine the unbalance in the planes `told`."""
    if len(group.channels) < len(planes):
        return f"{len(group.channels)} readings for {len(planes)} planes"
    return "no reading responds to it" if len(told) == 1 else "the readings cannot tell them apart"
