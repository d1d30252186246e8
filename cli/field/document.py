"""The JSON document of measured rotors."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cli.field.solve import FieldBalancing, Solved
from cli.field.tolerance import verdicts
from cli.field.words import sense
from cli.read.units import degrees
from cli.show.columns import finite

if TYPE_CHECKING:
    from collections.abc import Iterable

    from cli.field.runs import Complex, Real, Runs
    from cli.show.columns import Document


def document(found: FieldBalancing) -> Document:
    """The JSON document."""
    rotors: list[Document] = [{} for _ in found.runs.rotors]
    for solved in found.solved:
        of_fit = None if solved.balance is None else _Fits(found, solved)
        for i, r in enumerate(solved.group.rotors.tolist()):
            rotors[r] = {"rotor": found.runs.rotors[r], **_rotor(found, solved, i)}
            if of_fit is not None:
                of_fit.add(rotors[r], i)
    return {
        "correction": "add",
        "state": "as it stands" if found.request.from_here else "initial",
        "convention": sense(found),
        "rotors": rotors,
        "amplitude_unit": found.runs.amplitude_unit,
    }


def _rotor(found: FieldBalancing, solved: Solved, i: int) -> Document:
    """What is said of a rotor, however its coefficients were found."""
    group, request, runs = solved.group, found.request, found.runs
    along, across = (spread[i] for spread in solved.uncertainty)
    corrections = _masses(runs, solved.planes, solved.corrections[i])
    for p, (entry, w) in enumerate(zip(corrections, solved.corrections[i], strict=True)):
        entry[f"{runs.per}_uncertainty_{runs.per_si}"] = finite(along[p])
        entry["angle_uncertainty_deg"] = finite(across[p])
        if request.places is not None:
            entry["split"] = [
                {"position": name, "angle_deg": angle, f"{runs.per}_{runs.per_si}": part}
                for name, angle, part in found.split(w)
            ]
    size = np.abs(solved.residual[i])
    largest = float(size.max())
    document: Document = {
        "influence": [
            {
                **channel.key,
                "plane": plane,
                f"magnitude_per_{runs.per_si}": abs(solved.alpha[i, s, p]),
                "phase_deg": float(degrees(solved.alpha[i, s, p])),
            }
            for s, channel in enumerate(group.channels)
            for p, plane in enumerate(solved.planes)
        ],
        "condition_number": finite(solved.condition[i]),
        "corrections": corrections,
        "residual": [
            {
                **channel.key,
                "amplitude": abs(left),
                "phase_deg": None if request.four_run else float(degrees(left)),
            }
            for channel, left in zip(group.channels, solved.residual[i], strict=True)
        ],
        "residual_rms": largest * float(np.sqrt(np.square(size / largest).mean())) if largest else 0.0,
        "residual_max": largest,
        "initial_max": float(np.abs(solved.initial[i]).max()),
        "objective": request.objective,
    }
    if solved.bound is not None:
        document["residual_bound"] = float(solved.bound[i])
    if solved.residual_95 is not None:
        document["residual_max_95"] = finite(solved.residual_95[i])
    if group.repeats:
        document["repeats"] = {
            "readings": int(group.counts[group.counts > 1].sum()),
            "degrees_of_freedom": group.repeats,
            "reading_sd": float(group.reading_sd[i]),
        }
    if solved.fits:
        document["misfit"] = [
            {"sensor": channel.sensor, "amplitude": float(misfit)}
            for channel, misfit in zip(group.channels, solved.fits[i].misfit, strict=True)
        ]
        others = [-v / a for v, a in zip(group.initial[i], solved.fits[i].other, strict=True) if a == a]
        document["alternatives"] = _masses(runs, solved.planes * len(others), others)
    if request.tolerance is not None:
        document["tolerance"] = request.tolerance.document(verdicts(found, solved, i))
    return document


def _masses(runs: Runs, planes: list[str], masses: Iterable[complex]) -> list[Document]:
    """Return masses in their planes."""
    return [
        {"plane": plane, f"{runs.per}_{runs.per_si}": abs(w), "angle_deg": float(degrees(complex(w)))}
        for plane, w in zip(planes, masses, strict=True)
    ]


class _Fits:
    """What the fits of a group's runs add; of all rotors together it is worked out once."""

    def __init__(self, found: FieldBalancing, solved: Solved) -> None:
        from cli.field.fit import drifts, predicted, robust

        balance, asked = solved.balance, found.request
        assert balance is not None
        self.found, self.solved, self.group = found, solved, solved.group
        self.keys = [channel.key for channel in solved.group.channels]
        self.of_residual = balance.vibration_deviation(solved.total)
        self.of_initial = balance.vibration_deviation(np.zeros_like(solved.total))
        self.within = None if found.ceiling is None else balance.probability_within(found.ceiling)
        self.predicted = None if found.predict is None else predicted(found, solved)
        self.robust = robust(found, solved) if asked.robust else None
        self.drift = drifts(solved.group)

    def _vectors(self, values: Complex, deviations: Real | None = None) -> list[Document]:
        """Return a vector of each channel, and its uncertainty."""
        entries = [{**key, **_polar(v)} for key, v in zip(self.keys, values, strict=True)]
        if deviations is not None:
            for entry, sd in zip(entries, deviations, strict=True):
                entry["amplitude_uncertainty"] = finite(sd)
        return entries

    def add(self, entry: Document, i: int) -> None:
        """Add a rotor's fit to its part of the document."""
        asked, runs, planes = self.found.request, self.found.runs, self.solved.planes
        entry["fit"] = self._fit(i)
        residual: list[Document] = entry["residual"]  # type: ignore[assignment]
        for s, one in enumerate(residual):
            one["amplitude_uncertainty"] = finite(self.of_residual[i, s])
            if self.within is not None:
                one["probability_within"] = finite(self.within[i, s])
        if self.predicted is not None:
            entry["predict"] = self._vectors(*(part[i] for part in self.predicted))
        if asked.suggest:
            entry["suggest"] = self._suggested(i)
        if self.robust is not None:
            fit, corrections = self.robust
            entry["robust"] = {
                "initial": self._vectors(fit.initial[i]),
                "corrections": _masses(runs, planes, corrections[i]),
            }

    def _fit(self, i: int) -> Document:
        from cli.field.fit import rows

        group, fit, before = self.group, self.group.fit, self.group.before
        assert fit is not None
        log = group.logs[i]
        document: Document = {
            "runs": len(log.runs),
            "readings": int(fit.present[i].sum()),
            "degrees_of_freedom": int(fit.degrees_of_freedom[i]),
            "residual_sd": finite(fit.residual_sd[i]),
            "phase_sense": log.sense,
            "initial": self._vectors(fit.initial[i], self.of_initial[i]),
            "residuals": [
                {
                    "run": row.run,
                    **row.channel.key,
                    **_polar(row.residual),
                    "standardized": finite(row.standardized),
                    "outlier": row.outlier,
                }
                for row in rows(group, i)
            ],
        }
        if before is not None:
            document["prior"] = {
                "machines": before.machines,
                "scatter_between_machines": before.scatter,
                "reading_sd": None if before.reading is None else before.reading[0],
            }
        if self.drift is not None:
            document["drift"] = self._drift(i)
        return document

    def _drift(self, i: int) -> Document:
        from balancing.doubt import LEVEL

        assert self.drift is not None
        chance = finite(self.drift.probability[i])
        return {
            "probability": chance,
            "level": LEVEL,
            "drifts": None if chance is None else chance < LEVEL,
            "rates": [
                {
                    **key,
                    "amplitude_per_year": finite(abs(rate)),
                    "phase_deg": float(degrees(rate)) if np.isfinite(rate) else None,
                    "amplitude_per_year_uncertainty": finite(sd),
                }
                for key, rate, sd in zip(self.keys, self.drift.rate[i], self.drift.deviation[i], strict=True)
            ],
        }

    def _suggested(self, i: int) -> Document | None:
        from cli.field.fit import suggested

        run, runs = suggested(self.solved, i), self.found.runs
        if run is None:
            return None
        return {
            "masses": _masses(runs, self.solved.planes, run.masses),
            f"uncertainty_before_{runs.per_si}": run.before,
            f"uncertainty_after_{runs.per_si}": run.after,
        }


def _polar(value: complex) -> Document:
    return {"amplitude": abs(value), "phase_deg": float(degrees(complex(value)))}
