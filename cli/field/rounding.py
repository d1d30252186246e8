"""Field balancing in 32 digits: from the readings as they are written to corrections and trims."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from balancing import AmplitudeFit, Balance, condition_number
from cli.field.field_balancing import FieldBalancing, Solved
from cli.read.runs.runs import Real
from dalembert.arithmetic.doubled import Doubled
from dalembert.arithmetic.doubled_vectors import Vectors
from dalembert.arithmetic.exact import EPS


class Digits(NamedTuple):
    """Corrections and trims (g, p) in 32 digits, NaN where they are not determined, and relative errors of uncertainties."""

    corrections: Vectors
    trim: Vectors
    uncertainty: Real

    @property
    def parts(self) -> list[Real]:
        """Their numbers one by one, as `vectors_of` takes them, and the errors."""
        numbers = [
            x for w in (self.corrections, self.trim) for part in (w.x, w.y) for x in (part.high, part.low)
        ]
        return [*(np.broadcast_to(x, self.uncertainty.shape) for x in numbers), self.uncertainty]


def vectors_of(parts: Sequence[Real]) -> Vectors:
    """Put the four numbers of vectors together."""
    return Vectors(Doubled(*parts[:2]), Doubled(*parts[2:4]))


class SecondRun:
    """The second run of a group."""

    def __init__(self, balancing: FieldBalancing, solved: Solved) -> None:
        self.balancing, self.solved, self.group = balancing, solved, solved.group
        self.readings, self.masses, standing = self.group.exact()
        self.standing = Vectors.of(np.zeros(solved.standing.shape))
        for own, p in balancing.matches(self.group, solved.planes):
            self.standing[:, p] = standing[:, own]

    def means(self, run: int) -> Vectors:
        """Return what was read in a run, (g, s): the mean of repeats."""
        lines = self.group.trials[run].lines
        count: Real = np.isfinite(self.group.readings[:, lines]).sum(axis=1).astype(float)
        return self.readings[:, lines].total(1) / count

    @cached_property
    def unknowns(self) -> Vectors:
        """Initial vibration, run-out and all, and coefficients, (g, s, 1 + p)."""
        balancing, group, fit = self.balancing, self.group, self.solved.fit
        if balancing.stored is None and not self.solved.fits:
            return fit.second_run(self.readings, self.masses)
        alpha = Vectors.of(np.zeros(self.solved.alpha.shape))
        if balancing.stored is not None:
            for i, rotor in enumerate(group.rotors):
                name = balancing.runs.rotors[rotor]
                alpha[i] = balancing.stored.exact_matrix(name, group.channels, balancing.runs)
        for i, fits in enumerate(self.solved.fits):
            for p, one in enumerate(fits):
                alpha[i, :, p] = self._of_amplitudes(one, i, p)
        return Vectors.joined([self.means(0)[..., None], alpha], axis=-1)

    def _of_amplitudes(self, fit: AmplitudeFit, i: int, p: int) -> Vectors:
        """Return the coefficients of a plane without phase, (s,)."""
        tried = 1 + np.flatnonzero(self.group.on[i, 1:, p] != 0)
        trials = Vectors.joined([self.means(run)[i][None] for run in tried.tolist()])
        masses = Vectors.joined(
            [self.masses[i, self.group.trials[run].lines[0], p][None] for run in tried.tolist()]
        )
        return fit.second_run(self.means(0)[i].x, trials.x, masses)[0]

    @cached_property
    def here(self) -> Vectors:
        """The vibration where the corrections start from, (g, s)."""
        exact, floats = self.balancing.runs.exact_runout, self.balancing.runout(self.group)
        runout = Vectors.of(floats)
        for s, channel in enumerate(self.group.channels):
            if exact is not None and channel.sensor in (known := exact()):
                runout[s] = known[channel.sensor]
        here = self.unknowns[..., 0] - runout
        if self.solved.start.any():
            here = here + (self.alpha * self.standing[:, None, :]).total()
        return here

    @property
    def alpha(self) -> Vectors:
        """The influence coefficients, (g, s, p)."""
        return self.unknowns[..., 1:]

    def corrections(self, warnings: list[str]) -> Vectors:
        """Return the corrections, (g, p); NaN where they are not determined, and `warnings` says why."""
        solved, group, objective = self.solved, self.group, self.solved.objective
        whole = Balance(solved.alpha, solved.here, solved.corrections, group.weights, ridge=objective.ridge)
        if not objective.limited:
            found, _ = whole.second_run(self.alpha, self.here)
            assert found is not None
            return found
        result = Vectors.of(np.full(solved.corrections.shape, complex(np.nan, np.nan)))
        ceiling = None if objective.max_residual is None or objective.minimax else objective.max_residual
        for i in range(len(solved.corrections)):
            one = replace(
                whole,
                influence=solved.alpha[i],
                initial=solved.here[i],
                corrections=solved.corrections[i],
                weights=group.own_weights(i),
                bound=None if solved.bound is None else float(solved.bound[i]),
                of_largest=solved.bound is not None,
                max_mass=objective.max_mass,
                max_residual=None if ceiling is None else np.full(solved.here.shape[-1], ceiling),
            )
            found, reason = one.second_run(self.alpha[i], self.here[i])
            if found is not None:
                result[i] = found
            else:
                warnings.append(
                    f"{self.balancing.of(group, i)}--digits: the corrections are given in full, for no bound of their error is "
                    f"known: {reason}"
                )
        return result


def digits(balancing: FieldBalancing, solved: Solved, warnings: list[str]) -> Digits:
    """Return corrections and trims in 32 digits, (g, p) each, and the relative errors of the uncertainties."""
    if solved.fit.foreknown is not None:
        sentence = "--digits: the corrections are given in full, for no bound of the rounding of a fit with --influence is known"
        if sentence not in warnings:
            warnings.append(sentence)
        unknown = np.full(solved.corrections.shape, np.nan)
        nothing = Vectors.of(unknown + 1j * unknown)
        return Digits(nothing, nothing, unknown)
    run = SecondRun(balancing, solved)
    corrections = run.corrections(warnings)
    trim = corrections - run.standing
    if solved.start.any():
        trim = corrections
    return Digits(corrections, trim, uncertainty_share(run, corrections))


def uncertainty_share(run: SecondRun, corrections: Vectors) -> Real:
    """Bound the relative errors of the uncertainties, (g, p).

    To first order: the pseudo-inverses of coefficients and trial masses are right to their condition numbers times
    the relative errors of what they are of, and the corrections they are for to their own.
    """
    balancing, solved = run.balancing, run.solved
    of_all = run.unknowns.apart(solved.fit.unknowns)
    of_alpha = np.linalg.norm(of_all[..., 1:], axis=-2)
    norms = np.linalg.norm(solved.alpha, axis=-2)
    relative = 8 * EPS + (of_alpha / np.where(norms > 0, norms, 1.0)).max(axis=-1)
    share = condition_number(solved.alpha, solved.group.weights) * relative
    fit = solved.fit
    if balancing.runs.fitted:
        # the scatter of the residuals is a difference of readings, and the design is that of the masses
        of_fit = of_all.max(axis=1) / np.abs(fit.unknowns).max(axis=1)
        scatter = np.where(fit.residual_sd > 0, fit.residual_sd, np.inf)
        rounding = 32 * EPS * np.nanmax(np.abs(fit.readings), axis=(1, 2))
        share = (
            share
            + of_fit.max(axis=-1)
            + (rounding / scatter if balancing.request.reading_error is None else 0.0)
        )
    elif balancing.stored is None:
        share = share + 8 * EPS * condition_number(solved.group.on[:, 1:])
    # the scatter of repeats is a difference of readings
    sd = solved.group.repeats.reading_sd
    of_scatter = EPS * 8 * np.abs(solved.group.initial).max(axis=1) / np.where(sd > 0, sd, 1.0)
    share = share + np.where(sd > 0, of_scatter, 0.0)
    size = np.abs(solved.corrections)
    own = np.where(size > 0, corrections.apart(solved.corrections) / np.where(size > 0, size, 1.0), 0.0)
    return np.asarray(4 * share[:, None] + own)
