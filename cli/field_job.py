"""The corrections of a table of runs, in every form they are shown in."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cli.field_solve import UNKNOWN_ANGLE, Solved, Solver, Wanted
from cli.read.units import degrees, from_si, to_si
from cli.show.shown import Shown

Real = NDArray[np.float64]

__all__ = ["Field", "Solved", "Wanted"]


class Field(Solver):
    """The corrections of every rotor of a table of runs, ready to be shown."""

    def shown(self) -> Shown:
        """Return the result in every form."""
        from cli.field_text import afterword, notes

        warnings = [*self.runs.warnings, *self.warnings]
        return Shown(
            document=self.document,
            columns=self.columns,
            keys=("rotor", "plane"),
            notes=lambda: notes(self),
            afterword=lambda: afterword(self),
            figure=self.figure,
            errors=lambda: self.errors(warnings),
            warnings=warnings,
        )

    def errors(self, warnings: list[str]) -> dict[str, Any]:
        """Bounds of the rounding errors of the CSV's columns; what has none is said in the warnings."""
        from cli.field_digits import errors

        return errors(self, warnings)

    def figure(self) -> Any:
        """Draw the first rotors."""
        from cli.plots.field import draw

        return draw(self, range(min(len(self.runs.rotors), 3)))

    @property
    def uncertain(self) -> bool:
        """Whether reading errors are known, stated or from repeats."""
        return any(solved.covariance is not None for solved in self.solved)

    def uncertainty(self, solved: Solved) -> tuple[Real, Real] | None:
        """Return the standard deviations of size (SI) and angle (degrees; NaN where it is not known), (g, p) each."""
        if solved.covariance is None:
            return None
        size = np.abs(solved.corrections)
        along = np.sqrt(solved.covariance[..., 0, 0])
        across = np.sqrt(solved.covariance[..., 1, 1])
        safe = np.where(size > 0, size, 1.0)
        angle = np.where(size > 0, np.degrees(across / safe), np.nan)
        return along, np.where(angle <= UNKNOWN_ANGLE, angle, np.nan)

    @cached_property
    def _order(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Rotor, plane and group of every correction, group by group; and the order of the CSV's rows."""
        keys = []
        for k, solved in enumerate(self.solved):
            g, p = solved.corrections.shape
            keys.append(
                np.stack(
                    [np.repeat(solved.group.rotors, p), np.tile(np.arange(p), g), np.full(g * p, k)],
                )
            )
        joined = np.concatenate(keys, axis=1)
        return joined, np.lexsort((joined[1], joined[0]))

    @property
    def _keys(self) -> NDArray[np.intp]:
        keys, order = self._order
        return keys[:, order]

    def rows(self, values: Sequence[NDArray[Any]]) -> NDArray[Any]:
        """Put values of the groups, (g, p) each, into the CSV's order."""
        return np.concatenate([value.ravel() for value in values])[self._order[1]]

    @cached_property
    def columns(self) -> dict[str, Any]:
        """The CSV: one row per rotor and plane."""
        flat = self.rows([solved.corrections for solved in self.solved])
        rotor, plane, group = (row.tolist() for row in self._keys)
        rotors = self.runs.rotors
        columns: dict[str, Any] = {
            "rotor": [rotors[r] for r in rotor],
            "plane": [self.solved[k].planes[p] for k, p in zip(group, plane, strict=True)],
            f"{self.runs.per}_{self.runs.mass_unit}": self._amount(np.abs(flat)),
            "angle_deg": degrees(flat),
        }
        if self.uncertain:
            pairs = [
                self.uncertainty(solved) or (np.full(solved.corrections.shape, np.nan),) * 2
                for solved in self.solved
            ]
            along, angle = (self.rows([pair[k] for pair in pairs]) for k in (0, 1))
            columns[f"{self.runs.per}_uncertainty_{self.runs.mass_unit}"] = self._amount(along)
            columns["angle_uncertainty_deg"] = angle
        return columns

    def document(self) -> dict[str, Any]:
        """The JSON document."""
        documents = []
        suffix = "kg" if self.runs.per == "mass" else "kg_m"
        key = self.runs.per
        for rotor, (k, i) in enumerate(self.place):
            solved = self.solved[k]
            group = solved.group
            spreads = self.uncertainty(solved)
            corrections: list[dict[str, Any]] = []
            for p, plane in enumerate(solved.planes):
                w = solved.corrections[i, p]
                entry = {"plane": plane, f"{key}_{suffix}": abs(w), "angle_deg": float(degrees(w))}
                entry[f"{key}_uncertainty_{suffix}"] = None if spreads is None else _number(spreads[0][i, p])
                entry["angle_uncertainty_deg"] = None if spreads is None else _number(spreads[1][i, p])
                if self.wanted.places is not None:
                    entry["split"] = [
                        {"position": name, "angle_deg": angle, f"{key}_{suffix}": part}
                        for name, angle, part in self.split(w)
                    ]
                corrections.append(entry)
            residual = solved.residual[i]
            size = np.abs(residual)
            largest = float(size.max())
            document: dict[str, Any] = {
                "rotor": self.runs.rotors[rotor],
                "influence": [
                    {
                        "sensor": channel.sensor,
                        "speed_rad_s": channel.speed,
                        "plane": plane,
                        f"magnitude_per_{suffix}": abs(solved.alpha[i, s, p]),
                        "phase_deg": float(degrees(solved.alpha[i, s, p])),
                    }
                    for s, channel in enumerate(group.channels)
                    for p, plane in enumerate(solved.planes)
                ],
                "condition_number": _number(solved.condition[i]),
                "corrections": corrections,
                "residual": [
                    {
                        "sensor": channel.sensor,
                        "speed_rad_s": channel.speed,
                        "amplitude": abs(residual[s]),
                        "phase_deg": None if self.wanted.four_run else float(degrees(residual[s])),
                    }
                    for s, channel in enumerate(group.channels)
                ],
                "residual_rms": largest * float(np.sqrt(np.square(size / largest).mean()))
                if largest
                else 0.0,
                "residual_max": largest,
                "initial_max": float(np.abs(solved.initial[i]).max()),
                "objective": self.wanted.objective,
            }
            if solved.bound is not None:
                document["residual_bound"] = float(solved.bound[i])
            if solved.residual_95 is not None:
                document["residual_max_95"] = float(solved.residual_95[i])
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
                others = [
                    -v / a for v, a in zip(group.initial[i], solved.fits[i].other, strict=True) if a == a
                ]
                document["alternatives"] = [
                    {"plane": solved.planes[0], f"{key}_{suffix}": abs(w), "angle_deg": float(degrees(w))}
                    for w in others
                ]
            if self.wanted.tolerance is not None:
                document["tolerance"] = {
                    "grade": self.wanted.tolerance[0],
                    "permissible_kg_m": self.wanted.tolerance[1],
                    "planes": [
                        {
                            "plane": plane,
                            "permissible_kg_m": share,
                            "initial_kg_m": _number(before),
                            "within": before <= share if np.isfinite(before) else None,
                        }
                        for plane, share, before in self._verdict(solved, i)
                    ],
                }
            documents.append(document)
        return {
            "correction": "add",
            "state": "as it stands" if self.wanted.from_here else "initial",
            "convention": self.wanted.conventions,
            "rotors": documents,
            "amplitude_unit": self.runs.amplitude_unit,
        }

    def coefficients(self) -> dict[str, Any]:
        """The columns of --save-influence."""
        columns: dict[str, list[Any]] = {}
        per = self.runs.mass_unit
        for rotor, (k, i) in enumerate(self.place):
            solved = self.solved[k]
            for s, channel in enumerate(solved.group.channels):
                for p, plane in enumerate(solved.planes):
                    a = solved.alpha[i, s, p]
                    row: dict[str, Any] = {"rotor": self.runs.rotors[rotor]} if self.several else {}
                    speed = None
                    if channel.speed is not None and channel.speed_given is not None:
                        speed = (
                            channel.speed_given
                            if self.runs.speed_unit == "rpm"
                            else from_si(channel.speed, "speed", "rpm")
                        )
                    row |= {
                        "sensor": channel.sensor,
                        "speed_rpm": speed,
                        "plane": plane,
                        f"magnitude_per_{per}": float(to_si(abs(a), self.runs.per, per)),
                        "phase_deg": float(degrees(a)),
                        "amplitude_unit": self.runs.amplitude_unit,
                    }
                    for name, value in row.items():
                        columns.setdefault(name, []).append(value)
        return columns


def _number(value: Any) -> float | None:
    """A finite number, or None."""
    number = float(value)
    return number if np.isfinite(number) else None
