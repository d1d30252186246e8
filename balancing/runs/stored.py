"""The files beside a table of runs: run-out vectors, stored influence coefficients, those of sister machines too."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from balancing.prior import Prior, pooled_prior, stored_prior
from balancing.runs.runs import Before, Channel, Complex, Real, Rows, Runs, apart
from balancing.runs.vectors import Alpha, alpha_of
from dalembert.angles import phasor
from dalembert.errors import DataError, quote
from dalembert.quantities import exactly, parse_number
from dalembert.tables.table import Numbers, Table, read
from dalembert.units import UNITS, from_si

if TYPE_CHECKING:
    from fractions import Fraction

    from dalembert.arithmetic.doubled import Doubled
    from dalembert.arithmetic.doubled_arrays import Vectors


def read_runout(path: str, runs: Runs) -> dict[str, complex]:
    """Read the run-out vector of each sensor as the instrument shows it, in the runs' amplitude unit."""
    dimensions, needed = {"amplitude": "amplitude", "phase": "angle"}, [("amplitude",), ("phase",)]
    table = read(path, numbers=dimensions, texts=["sensor"], needed=needed)
    amplitude, phase = table.require("amplitude", "amplitude"), table.require("phase", "angle")
    table.reject(amplitude.values < 0, "amplitude", "an amplitude that is not negative")
    size = runs.in_unit(amplitude.values, amplitude.unit, f"{table.file}: the run-out")
    vectors = phasor(size, phase.values, phase.unit).tolist()
    sensors = table.named("sensor")
    measured = {channel.sensor for group in runs.groups for channel in group.channels}
    out: dict[str, complex] = {}
    for i, (sensor, vector) in enumerate(zip(sensors, vectors, strict=True)):
        if sensor in out:
            raise table.error(i, "sensor", sensor, "each sensor once")
        if sensor not in measured:
            raise table.error(i, "sensor", sensor, f"a sensor of the runs ({', '.join(sorted(measured))})")
        out[sensor] = vector

    def exact() -> dict[str, Vectors]:
        from dalembert.tables.exact import vectors

        each = vectors(_converted(amplitude.decimals, amplitude.unit, runs.amplitude_unit), phase)
        return {sensor: each[i] for i, sensor in enumerate(sensors)}

    runs.exact_runout = exact
    runs.warnings += table.warnings
    for sensor in sorted(measured - set(out)):
        runs.warnings.append(f"{table.file}: no run-out of sensor {sensor}: taken as zero")
    return out


def _converted(sizes: list[Fraction], unit: str, to: str) -> list[Fraction]:
    """Convert exact amplitudes from one unit to another."""
    factor = exactly("1", UNITS["amplitude"][unit]) / exactly("1", UNITS["amplitude"][to])
    return [size * factor for size in sizes]


class Coefficients(NamedTuple):
    """The stored coefficients of a machine, and how well they are known."""

    alpha: Complex
    """(s, p)."""
    covariance: Complex | None
    """E δδᴴ of each channel, (s, p, p); None where the file states none."""
    reading_sd: float
    """The standard deviation of the readings that they come from, as vectors; NaN where the file does not state it."""
    degrees_of_freedom: float
    """Complex, of that and of the covariance; inf where the file does not state it."""


@dataclass(frozen=True, eq=False, repr=False)
class Stored:
    """Stored influence coefficients."""

    table: Table
    unit: str
    values: Complex
    """Amplitude (of `amplitude_unit`, or of the runs) per kg or kg·m."""
    speed: Real
    amplitude_unit: str | None
    along: Real | None = None
    """Standard deviations of the coefficients along themselves and across, where the file states them; NaN where it leaves
    some out."""
    across: Real | None = None

    @property
    def lags(self) -> bool:
        """Whether the phases of the instrument lagged that measured them."""
        return "lag" in self.table.texts.get("phase_sense", ())

    @property
    def rotors(self) -> list[str]:
        """The machines that the file names."""
        return list(dict.fromkeys(self.table.texts.get("rotor", ())))

    def _column(self, name: str) -> list[str]:
        return self.table.named(name)

    def _rows(self, rotor: str) -> list[int]:
        texts = self.table.texts
        mine = [
            i
            for i in range(self.table.rows)
            if not rotor or "rotor" not in texts or texts["rotor"][i] == rotor
        ]
        if not mine:
            raise DataError(f"{self.table.file}: no coefficients of rotor {quote(rotor)}")
        return mine

    def key(self, rotor: str) -> str:
        """Return a key that rotors with the same planes share."""
        return "" if "rotor" not in self.table.texts else ";".join(self.planes(rotor))

    def planes(self, rotor: str) -> list[str]:
        """Return the planes of a machine, in order."""
        plane = self._column("plane")
        return list(dict.fromkeys(plane[i] for i in self._rows(rotor)))

    def exact_matrix(self, rotor: str, channels: Sequence[Channel], runs: Runs) -> Vectors:
        """Return α (s, p) of a rotor in 32 digits, of the decimals as they are written."""
        from dalembert.tables.exact import vectors

        sizes = self._exact_sizes("magnitude_per", runs)
        return vectors(sizes, self.table.numbers["phase"])[self._rows_of(rotor, channels, self.planes(rotor))]

    def _exact_sizes(self, name: str, runs: Runs) -> list[Fraction]:
        """Return the numbers of a column per kg or kg·m, as they are written; 0 where it is blank."""
        size = self.table.numbers[name]
        sizes = replace(size, values=np.nan_to_num(size.values)).decimals
        sizes = [x / exactly("1", UNITS["per"][size.unit]) for x in sizes]
        if self.amplitude_unit:
            sizes = _converted(sizes, self.amplitude_unit, runs.amplitude_unit)
        return sizes

    def exact_coefficients(
        self, rotor: str, channels: Sequence[Channel], planes: list[str], runs: Runs
    ) -> tuple[Vectors, Vectors, Doubled]:
        """Return α (s, p), the covariance (s, p, p) and the deviation of the readings in 32 digits; 0 where none is stated."""
        from fractions import Fraction

        from dalembert.arithmetic.doubled import PI, Doubled
        from dalembert.arithmetic.doubled_arrays import Vectors
        from dalembert.arithmetic.doubled_functions import DOUBLED
        from dalembert.arithmetic.doubled_operations import doubled_array, part
        from dalembert.tables.exact import vectors

        table, at = self.table, self._rows_of(rotor, channels, planes)
        alpha = vectors(self._exact_sizes("magnitude_per", runs), table.numbers["phase"])[at]
        sd = Doubled(np.array(0.0))
        if "reading_sd" in table.numbers and (value := table.numbers["reading_sd"].values[at[0, 0]]) > 0:
            (exactly_sd,) = _converted(
                [Fraction(repr(float(value)))],
                self.amplitude_unit or runs.amplitude_unit,
                runs.amplitude_unit,
            )
            sd = doubled_array([exactly_sd], ())
        correlation = self._correlation(at)
        if correlation is None:
            return alpha, Vectors.of(np.zeros((*at.shape, at.shape[1]))), sd
        rows = (table.rows,)
        along = part(doubled_array(self._exact_sizes("magnitude_uncertainty_per", runs), rows), at)
        across = along
        if "phase_uncertainty" in table.numbers:
            of_phase = table.numbers["phase_uncertainty"]
            turn = part(
                doubled_array(replace(of_phase, values=np.nan_to_num(of_phase.values)).exact, rows), at
            )
            aside = alpha.size * (turn * PI / 180.0 if of_phase.unit == "deg" else turn)
            blank = np.isnan(of_phase.values[at])
            across = Doubled(np.where(blank, along.high, aside.high), np.where(blank, along.low, aside.low))
        sizes = DOUBLED.sqrt(along * along + across * across)
        share = Vectors.of(np.eye(at.shape[1]) + np.zeros((*at.shape, 1)))
        for (s, p, q), (size, angle) in correlation.items():
            numbers = Numbers("", "deg", np.array([angle]), "angle")
            share[s, p, q] = vectors([Fraction(repr(size))], numbers)[0]
            share[s, q, p] = share[s, p, q].conj()
        return alpha, share * part(sizes, (..., None)) * part(sizes, (..., None, slice(None))), sd

    def matrix(self, rotor: str, channels: Sequence[Channel], runs: Runs) -> Complex:
        """Return α (s, p) of a rotor."""
        return self.coefficients(rotor, channels, self.planes(rotor), runs).alpha

    def coefficients(
        self, rotor: str, channels: Sequence[Channel], planes: list[str], runs: Runs
    ) -> Coefficients:
        """Return what the file knows of a machine in these channels."""
        speeds = {channel.speed for channel in channels}
        if len(speeds) > 1 and np.isnan(self.speed[self._rows(rotor)]).any():
            runs.warnings.append(
                f"{self.table.file}: coefficients without a speed are used at each of {len(speeds)} speeds"
            )
        at = self._rows_of(rotor, channels, planes)
        factor = 1.0
        if self.amplitude_unit:
            factor = runs.in_unit(1.0, self.amplitude_unit, self.table.file)
        sd, nu = np.nan, np.inf
        if "reading_sd" in self.table.numbers:
            sd = factor * float(self.table.numbers["reading_sd"].values[at[0, 0]])
        if "degrees_of_freedom" in self.table.numbers:
            nu = float(self.table.numbers["degrees_of_freedom"].values[at[0, 0]])
            nu = nu if nu > 0 else np.inf
        covariance = self._covariance(at)
        return Coefficients(
            self.values[at] * factor, None if covariance is None else covariance * factor**2, sd, nu
        )

    def _rows_of(self, rotor: str, channels: Sequence[Channel], planes: list[str]) -> Rows:
        """Find the row of each channel and plane, (s, p)."""
        mine, sensor, plane = self._rows(rotor), self._column("sensor"), self._column("plane")
        state = self.table.texts.get("state")
        at = np.zeros((len(channels), len(planes)), dtype=np.intp)
        for s, channel in enumerate(channels):
            for p, name in enumerate(planes):
                rows = [
                    i
                    for i in mine
                    if sensor[i] == channel.sensor
                    and plane[i] == name
                    and (state is None or state[i] == (channel.state or ""))
                ]
                off = [0.0 if channel.speed is None else apart(channel.speed, self.speed[i]) for i in rows]
                least = min(off, default=np.inf)
                best = [i for i, far in zip(rows, off, strict=True) if far == least and far <= 0.01]
                if not best:
                    raise DataError(f"{self.table.file}: no coefficient of sensor {channel} for plane {name}")
                if len(best) > 1:
                    speeds = ", or runs with a speed" if channel.speed is None else ""
                    raise self.table.error(
                        best[1],
                        "sensor",
                        sensor[best[1]],
                        f"one coefficient for sensor {channel} and plane {name}{speeds}",
                    )
                at[s, p] = best[0]
        return at

    def _covariance(self, at: Rows) -> Complex | None:
        """Return E δδᴴ of each channel, (s, p, p), out of deviations and correlations."""
        correlation = self._correlation(at)
        if correlation is None or self.along is None or self.across is None:
            return None
        along, across = (np.nan_to_num(part[at]) for part in (self.along, self.across))
        size = np.sqrt(np.square(along) + np.square(across))
        planes = at.shape[1]
        share = np.zeros((*at.shape, planes), dtype=complex) + np.eye(planes)
        for (s, p, q), (one, turn) in correlation.items():
            share[s, p, q] = complex(phasor(np.array([one]), np.array([turn]), "deg")[0])
            share[s, q, p] = share[s, p, q].conjugate()
        return np.asarray(size[:, :, None] * size[:, None, :] * share)

    def _correlation(self, at: Rows) -> dict[tuple[int, int, int], tuple[float, float]] | None:
        """Return size and angle (degrees) of the correlation of channel s between planes p > q; None without deviations."""
        if self.along is None or np.isnan(self.along[at]).all():
            return None
        correlations: dict[tuple[int, int, int], tuple[float, float]] = {}
        for s, p in np.argwhere(np.ones(at.shape)).tolist():
            cell = self.table.texts["correlation"][at[s, p]] if "correlation" in self.table.texts else ""
            cells = cell.split(";") if cell else []
            try:
                if cells and len(cells) != p:
                    raise ValueError
                for q, one in enumerate(cells):
                    part, turn = (parse_number(number) for number in one.split("@"))
                    correlations[s, p, q] = part, turn
            except ValueError:
                raise self.table.error(
                    int(at[s, p]),
                    "correlation",
                    cell,
                    f"{p} correlations with the planes before, joined by ';', such as 0.5@0",
                ) from None
        return correlations


def read_stored(path: str) -> Stored:
    """Read stored coefficients: sensor, speed_*, plane, magnitude_per_*, phase_deg, and how well they are known."""
    alpha = alpha_of(path)
    if alpha is not None:
        return stored_alpha(alpha)
    table = read(
        path,
        numbers={
            "speed": "speed",
            "magnitude_per": "per",
            "phase": "angle",
            "magnitude_uncertainty_per": "per",
            "phase_uncertainty": "angle",
            "reading_sd": "amplitude",
            "degrees_of_freedom": "number",
        },
        texts=["rotor", "sensor", "state", "plane", "amplitude_unit", "phase_sense", "correlation"],
        blank=["speed", "magnitude_uncertainty_per", "phase_uncertainty", "reading_sd", "degrees_of_freedom"],
    )
    size, phase = table.require("magnitude_per", "per"), table.require("phase", "angle")
    table.reject(size.values < 0, "magnitude_per", "a magnitude that is not negative")
    speed = table.numbers.get("speed")
    units = set(table.texts.get("amplitude_unit", [])) - {""}
    if len(units) > 1 or not units <= set(UNITS["amplitude"]):
        raise DataError(f"{table.file}: amplitude_unit {', '.join(sorted(units))}: expected one known unit")
    values = phasor(from_si(size.values, "per", size.unit), phase.values, phase.unit)
    along = across = None
    if "magnitude_uncertainty_per" in table.numbers:
        of_size, of_phase = table.numbers["magnitude_uncertainty_per"], table.numbers.get("phase_uncertainty")
        for name in ("magnitude_uncertainty_per", "phase_uncertainty", "reading_sd"):
            if name in table.numbers:
                table.reject(table.numbers[name].values < 0, name, "an uncertainty that is not negative")
        along = np.asarray(from_si(of_size.values, "per", of_size.unit))
        # an uncertainty in all directions, where none of the phase is stated
        across = along
        if of_phase is not None:
            turn = of_phase.si
            across = np.where(np.isnan(turn), along, np.abs(values) * turn)
    return Stored(
        table,
        size.unit,
        values,
        speed.si if speed is not None else np.full(table.rows, np.nan),
        units.pop() if units else None,
        along,
        across,
    )


def stored_alpha(alpha: Alpha) -> Stored:
    """Return the coefficients `ALPHA` of a file of vectors, per kg."""
    file, rows = alpha
    table = Table(file, ["ALPHA"], sum(map(len, rows)))
    places = [(s, p) for s, row in enumerate(rows) for p in range(len(row))]
    table.texts = {"sensor": [str(s + 1) for s, _ in places], "plane": [str(p + 1) for _, p in places]}
    size, turn = (np.array([cell[k] for row in rows for cell in row]) for k in (0, 1))
    table.numbers = {
        "magnitude_per": Numbers("ALPHA", "kg", size, "per"),
        "phase": Numbers("ALPHA", "deg", turn, "angle"),
    }
    return Stored(table, "kg", phasor(size, turn, "deg"), np.full(table.rows, np.nan), None)


class Sisters:
    """Files of stored coefficients as prior knowledge of a fit: of the rotor they name, or of all machines in them."""

    def __init__(self, files: Sequence[Stored]) -> None:
        self.files = files
        self.unit = files[0].unit
        for one in files[1:]:
            if one.unit != self.unit:
                raise DataError(
                    f"{one.table.file}: coefficients per {one.unit}, in {files[0].table.file} per {self.unit}: expected one unit"
                )
        self._known: dict[tuple[object, ...], Before] = {}

    def _machines(self, rotor: str) -> list[tuple[Stored, str]]:
        """Return the machines that count for a rotor: itself, where the files name it, or all of them."""
        if self.key(rotor) is not None:
            return [(one, rotor) for one in self.files if rotor in one.rotors]
        return [(one, name) for one in self.files for name in (one.rotors or ("",))]

    def key(self, rotor: str) -> str | None:
        """Return a key that rotors with the same stored coefficients share."""
        return rotor if any(rotor in one.rotors for one in self.files) else None

    def planes(self, rotor: str) -> list[str]:
        """Return the planes of the coefficients."""
        machines = self._machines(rotor)
        first, *others = (one.planes(name) for one, name in machines)
        for planes, (one, _) in zip(others, machines[1:], strict=True):
            if set(planes) != set(first):
                raise DataError(
                    f"{one.table.file}: coefficients of the planes {', '.join(planes)}: expected {', '.join(first)}, as in "
                    f"{machines[0][0].table.file}"
                )
        return first

    def before(self, rotor: str, channels: Sequence[Channel], runs: Runs) -> Before:
        """Return the stored coefficients of a rotor in these channels."""
        key = (self.key(rotor), *channels)
        if key not in self._known:
            self._known[key] = self._pooled(rotor, channels, runs)
        return self._known[key]

    def _pooled(self, rotor: str, channels: Sequence[Channel], runs: Runs) -> Before:
        machines, planes = self._machines(rotor), self.planes(rotor)
        each = [one.coefficients(name, channels, planes, runs) for one, name in machines]
        alpha = np.stack([one.alpha for one in each])
        stated = [one.covariance for one in each if one.covariance is not None]
        if stated and len(stated) < len(each):
            runs.warnings.append("stored coefficients count as exact where their file states no uncertainty")
        covariance: Complex = np.stack(
            [
                np.zeros((*one.alpha.shape, len(planes))) if one.covariance is None else one.covariance
                for one in each
            ]
        )
        if len(each) > 1:
            prior = pooled_prior(alpha, covariance)
        else:
            prior = stored_prior(alpha[0], covariance[0], each[0].degrees_of_freedom)
            if self.key(rotor) is None and stated:
                runs.warnings.append(
                    "one machine's stored coefficients do not show how machines differ: they count with the errors of their "
                    "own runs alone; expected a file of each of several machines"
                )
            elif not stated:
                runs.warnings.append("the stored coefficients state no uncertainty and count as exact")
        # of machines whose readings' deviation is known
        weight = np.array([one.degrees_of_freedom if one.reading_sd > 0 else 0.0 for one in each])
        freedom = float(weight.sum())
        if np.isinf(freedom):
            weight = np.isinf(weight).astype(float)
        scatter = None
        if weight.any():
            sds = np.nan_to_num([one.reading_sd for one in each])
            scatter = (float(np.sqrt((weight * np.square(sds)).sum() / weight.sum())), freedom)
        between = float(prior.scatter)

        def exact() -> tuple[Prior, Any]:
            from dalembert.arithmetic.doubled import Doubled
            from dalembert.arithmetic.doubled_arrays import DoubledArray, Vectors

            known = [one.exact_coefficients(name, channels, planes, runs) for one, name in machines]
            alphas, covariances, _ = zip(*known, strict=True)
            exactly: Any = [Vectors.joined([of[None] for of in part]) for part in (alphas, covariances)]
            square = sum(
                (sd * sd * w for (_, _, sd), w in zip(known, weight.tolist(), strict=True)), Doubled(0.0)
            )
            reading = np.sqrt(DoubledArray.of(square / (float(weight.sum()) or 1.0)))
            if len(known) > 1:
                return pooled_prior(*exactly), reading
            return stored_prior(*(of[0] for of in exactly)), reading

        return Before(prior, len(each), between if between == between else None, scatter, exact)
