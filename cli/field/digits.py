"""Field balancing in 32 digits: from the readings as they are written to corrections and trims."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from balancing import Balance, condition_number
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
        self.readings, self.masses, self.standing = self.group.exact()

    def _mean(self, present: NDArray[np.bool_]) -> Vectors:
        """Return the mean of these readings (g, r, s) of each sensor, (g, s)."""
        sums: Vectors = (self.readings * present.astype(float)).total(1)
        count: Real = present.sum(axis=1).astype(float)
        return sums / count

    @cached_property
    def unknowns(self) -> Vectors:
        """Initial vibration, run-out and all, and coefficients, (g, s, 1 + p)."""
        balancing, group = self.balancing, self.group
        if balancing.stored is None and not group.amplitude_fits:
            return group.fit.second_run(self.readings, self.masses)
        alpha, first = Vectors.of(np.zeros(self.solved.alpha.shape)), self._mean(group.fit.present)
        if balancing.stored is not None:
            for i, rotor in enumerate(group.rotors):
                name = balancing.runs.rotors[rotor]
                alpha[i] = balancing.stored.exact_matrix(name, group.channels, balancing.runs)
        else:
            for i, p in np.ndindex(len(group.rotors), len(group.planes)):
                alpha[i, :, p] = self._of_amplitudes(first, i, p)
        return Vectors.joined([first[..., None], alpha], axis=-1)

    def _of_amplitudes(self, first: Vectors, i: int, p: int) -> Vectors:
        """Return the coefficients of a plane without phase, (s,)."""
        rows = [of for of in self.group.lines.rows if self.group.masses[i, of[0], p] != 0]
        read = np.isfinite(self.group.readings)
        each = [self._mean(read & np.isin(np.arange(read.shape[1]), of)[:, None])[i][None] for of in rows]
        masses = Vectors.joined([self.masses[i, of[0], p][None] for of in rows])
        fit = self.group.amplitude_fits[i][p]
        return fit.second_run(first[i].x, Vectors.joined(each).x, masses)[0]

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
    if solved.group.fit.foreknown is not None:
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
    of_all = run.unknowns.apart(solved.group.fit.unknowns)
    of_alpha = np.linalg.norm(of_all[..., 1:], axis=-2)
    norms = np.linalg.norm(solved.alpha, axis=-2)
    relative = 8 * EPS + (of_alpha / np.where(norms > 0, norms, 1.0)).max(axis=-1)
    share = condition_number(solved.alpha, solved.group.weights) * relative
    fit = solved.group.fit
    of_fit = of_all.max(axis=1) / np.abs(fit.unknowns).max(axis=1)
    share = share + of_fit.max(axis=-1)
    if balancing.stored is None:
        # the design is that of the masses
        on = solved.group.masses
        share = share + 8 * EPS * condition_number(on[:, np.abs(on).any(axis=(0, 2))])
    if balancing.request.reading_error is None:
        # the scatter of the residuals is a difference of readings
        scatter = np.where(fit.residual_sd > 0, fit.residual_sd, np.inf)
        share = share + 32 * EPS * np.nanmax(np.abs(fit.readings), axis=(1, 2)) / scatter
    size = np.abs(solved.corrections)
    own = np.where(size > 0, corrections.apart(solved.corrections) / np.where(size > 0, size, 1.0), 0.0)
    return np.asarray(4 * share[:, None] + own)
