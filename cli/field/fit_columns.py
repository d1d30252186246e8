"""A fit of all runs as columns, and its part of the JSON document."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from balancing.doubt import LEVEL
from cli.field.columns import mass_in
from cli.field.fit import Fitted, LogFits, drifts, polar
from cli.field.solve import Solved
from cli.read.units import degrees
from cli.show.columns import Column, Table, finite

if TYPE_CHECKING:
    from cli.show.columns import Document


def residuals(fits: LogFits) -> Table:
    """One row per reading: what was read, and how far it lies from the fitted vibration."""
    found = fits.found
    unit = found.runs.amplitude_unit
    names, rows = [], []
    for solved in found.solved:
        fitted = Fitted(solved.group)
        for i, r in enumerate(solved.group.rotors.tolist()):
            for row in fitted.rows(i):
                names.append(found.runs.rotors[r])
                rows.append(row)
    read, left = (
        np.array([getattr(row, name) for row in rows], dtype=complex) for name in ("value", "residual")
    )
    columns = [
        Column("rotor", "", names),
        Column("run", "", [row.run for row in rows]),
        Column("sensor", "", [row.channel.sensor for row in rows]),
        Column("state", "", [row.channel.state or "" for row in rows]),
        Column("amplitude", unit, np.abs(read)),
        Column("phase", "deg", degrees(read)),
        Column("residual", unit, np.abs(left)),
        Column("residual_phase", "deg", degrees(left)),
        Column("standardized", "", [row.standardized for row in rows]),
        Column("outlier", "", ["yes" if row.outlier else "" for row in rows]),
    ]
    return Table([c for c in columns if c.name != "state" or any(c.values)])


def document(fits: LogFits, document: Document) -> Document:
    """The JSON document of the corrections with the fits, predictions and suggestions of its rotors."""
    rotors: list[Document] = document["rotors"]  # type: ignore[assignment]
    for solved in fits.found.solved:
        fitted = Fitted(solved.group)
        parts = _Parts(fits, solved)
        for i, r in enumerate(solved.group.rotors.tolist()):
            _fill(rotors[r], fits, solved, fitted, i, parts)
    return document


class _Parts:
    """What of a group is worked out for all rotors together."""

    def __init__(self, fits: LogFits, solved: Solved) -> None:
        balance = solved.balance
        assert balance is not None
        self.of_residual = balance.vibration_deviation(solved.total)
        self.of_initial = balance.vibration_deviation(np.zeros_like(solved.total))
        ceiling = fits.found.request.max_residual
        self.within = None if ceiling is None else balance.probability_within(ceiling)
        self.predicted = None if fits.asked.predict is None else fits.predicted(solved)
        self.robust = fits.robust(solved) if fits.asked.robust else None
        self.drift = drifts(solved.group)


def _fill(entry: Document, fits: LogFits, solved: Solved, fitted: Fitted, i: int, parts: _Parts) -> None:
    """Add a rotor's fit to its part of the document."""
    group, fit = solved.group, fitted.fit
    log, runs = group.logs[i], fits.found.runs
    keys = [channel.key for channel in group.channels]
    entry["fit"] = {
        "runs": len(log.runs),
        "readings": int(fit.present[i].sum()),
        "degrees_of_freedom": int(fit.degrees_of_freedom[i]),
        "residual_sd": finite(fit.residual_sd[i]),
        "phase_sense": log.sense,
        "initial": [
            {**name, **polar(v), "amplitude_uncertainty": finite(sd)}
            for name, v, sd in zip(keys, fit.initial[i], parts.of_initial[i], strict=True)
        ],
        "residuals": [
            {
                "run": row.run,
                **row.channel.key,
                **polar(row.residual),
                "standardized": finite(row.standardized),
                "outlier": row.outlier,
            }
            for row in fitted.rows(i)
        ],
    }
    if group.before is not None:
        entry["fit"]["prior"] = {  # type: ignore[index]
            "machines": group.before.machines,
            "scatter_between_machines": group.before.scatter,
            "reading_sd": None if group.before.reading is None else group.before.reading[0],
        }
    if parts.drift is not None:
        chance = finite(parts.drift.probability[i])
        entry["fit"]["drift"] = {  # type: ignore[index]
            "probability": chance,
            "level": LEVEL,
            "drifts": None if chance is None else chance < LEVEL,
            "rates": [
                {
                    **name,
                    "amplitude_per_year": finite(abs(rate)),
                    "phase_deg": float(degrees(rate)) if np.isfinite(rate) else None,
                    "amplitude_per_year_uncertainty": finite(sd),
                }
                for name, rate, sd in zip(keys, parts.drift.rate[i], parts.drift.deviation[i], strict=True)
            ],
        }
    residual: list[Document] = entry["residual"]  # type: ignore[assignment]
    for s, one in enumerate(residual):
        one["amplitude_uncertainty"] = finite(parts.of_residual[i, s])
        if parts.within is not None:
            one["probability_within"] = finite(parts.within[i, s])
    if parts.predicted is not None:
        entry["predict"] = [
            {**name, **polar(v), "amplitude_uncertainty": finite(sd)}
            for name, v, sd in zip(keys, parts.predicted[0][i], parts.predicted[1][i], strict=True)
        ]
    if fits.asked.suggest:
        entry["suggest"] = _suggested(fits, solved, i)
    if parts.robust is not None:
        robust, corrections = parts.robust
        entry["robust"] = {
            "initial": [{**name, **polar(v)} for name, v in zip(keys, robust.initial[i], strict=True)],
            "corrections": [
                mass_in(runs, plane, w) for plane, w in zip(solved.planes, corrections[i], strict=True)
            ],
        }


def _suggested(fits: LogFits, solved: Solved, i: int) -> Document | None:
    run, runs = fits.suggested(solved, i), fits.found.runs
    if run is None:
        return None
    return {
        "masses": [mass_in(runs, plane, w) for plane, w in zip(solved.planes, run.masses, strict=True)],
        f"uncertainty_before_{runs.per_si}": run.before,
        f"uncertainty_after_{runs.per_si}": run.after,
    }
