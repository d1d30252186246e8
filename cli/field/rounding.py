"""The digits of field balancing that hold against rounding: from the readings as written to the corrections."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from balancing import Balance, condition_number
from cli.field.field_balancing import FieldBalancing, Solved
from cli.read.rounding import EPS
from cli.read.runs.runs import Real


def fit_errors(balancing: FieldBalancing, solved: Solved) -> Real:
    """Bound the errors of initial vibration and coefficients, (g, s, 1 + p)."""
    readings, masses = solved.group.errors()
    if balancing.stored is None and not solved.fits:
        return solved.fit.error_estimate(readings, masses)
    first = readings[:, solved.group.trials[0].lines].mean(axis=1)
    if balancing.stored is not None:
        phase = balancing.stored.table.require("phase", "angle")
        turn = float(np.abs(phase.si).max())
        of_alpha = EPS * (6 + turn / 2) * np.abs(solved.alpha)
    else:
        # relative errors of amplitudes and masses: what is written with many digits is rounded once
        on = np.abs(solved.group.masses)
        share = (masses / np.where(on > 0, on, 1.0)).max(axis=(1, 2)).tolist()
        of_alpha = np.array(
            [
                [fit.error_estimate(data_error=s) for fit in one]
                for one, s in zip(solved.fits, share, strict=True)
            ]
        ).swapaxes(1, 2)
    return np.concatenate([first[..., None], of_alpha], axis=-1)


def correction_errors(balancing: FieldBalancing, solved: Solved, warnings: list[str]) -> Real:
    """Bound the errors of the corrections, (g, p), SI; NaN where they cannot be bounded."""
    request, group = balancing.request, solved.group
    if solved.fit.foreknown is not None:
        sentence = "--digits: the corrections are given in full, for no bound of the rounding of a fit with --influence is known"
        if sentence not in warnings:
            warnings.append(sentence)
        return np.full(solved.corrections.shape, np.nan)
    of_all = fit_errors(balancing, solved)
    initial, of_alpha = of_all[..., 0], of_all[..., 1:]
    here, limit, ceiling = solved.here, solved.objective.max_mass, balancing.ceiling
    of_here = initial + 8 * EPS * (np.abs(balancing.runout(group)) + np.abs(solved.initial))
    if solved.start.any():
        size = np.abs(solved.start)
        of_standing = group.errors()[1].max(axis=1) + 4 * EPS * size
        of_here = of_here + np.matvec(of_alpha, size) + np.matvec(np.abs(solved.alpha), of_standing)
    whole = Balance(solved.alpha, here, solved.corrections, group.weights, ridge=request.ridge)
    minimax = request.objective == "minimax"
    if not minimax and limit is None and ceiling is None:
        return whole.error_estimate(influence_error=of_alpha, initial_error=of_here)
    ceilings = None if ceiling is None or minimax else np.full(here.shape[-1], ceiling)
    bounds = []
    for i in range(len(here)):
        one = replace(
            whole,
            influence=solved.alpha[i],
            initial=here[i],
            corrections=solved.corrections[i],
            weights=group.own_weights(i),
            bound=None if solved.bound is None else float(solved.bound[i]),
            of_largest=solved.bound is not None,
            max_mass=limit,
            max_residual=ceilings,
        )
        bounds.append(one.error_estimate(influence_error=of_alpha[i], initial_error=of_here[i]))
        if one.error_reason:
            warnings.append(
                f"{balancing.of(group, i)}--digits: the corrections are given in full, for no bound of their error is known: "
                f"{one.error_reason}"
            )
    return np.where(np.isfinite(bounds), bounds, np.nan)


def trim_errors(solved: Solved, bound: Real) -> Real:
    """Bound the errors of the trims, (g, p), SI, where `bound` is that of the corrections."""
    errors = solved.group.errors()[1]
    # of stored coefficients no trial run takes part
    of_masses = errors.max(axis=1) if errors.shape[-1] == bound.shape[-1] else 0.0
    return np.asarray(bound + of_masses + 8 * EPS * (np.abs(solved.total) + np.abs(solved.standing)))


def uncertainty_share(balancing: FieldBalancing, solved: Solved, bound: Real) -> Real:
    """Bound the relative errors of the uncertainties, (g, p).

    To first order: the pseudo-inverses of coefficients and trial masses are right to their condition numbers times
    the relative errors of what they are of, and the corrections they are for to their own.
    """
    if solved.fit.foreknown is not None:
        return np.full(bound.shape, np.nan)
    of_all = fit_errors(balancing, solved)
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
    own = np.where(size > 0, bound / np.where(size > 0, size, 1.0), 0.0)
    return np.asarray(4 * share[:, None] + own)


def errors(balancing: FieldBalancing, solved: Solved, warnings: list[str]) -> tuple[Real, Real, Real]:
    """Bound the errors of corrections and trims, SI, and the relative errors of the uncertainties, (g, p) each."""
    bound = correction_errors(balancing, solved, warnings)
    return bound, trim_errors(solved, bound), uncertainty_share(balancing, solved, bound)
