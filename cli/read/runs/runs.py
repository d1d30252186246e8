"""Runs as arrays: rotors that were measured in the same way, side by side; channels: which sensor, at which speed or in which state, a row reads."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

import balancing
from balancing.run_means import RunMeans
from cli.read.runs.masses import Masses
from dalembert.errors import DataError
from dalembert.tables.table import Table, numbered
from dalembert.units import UNITS, Scaled, amplitude_kind, from_si, to_si

if TYPE_CHECKING:
    from dalembert.arithmetic.doubled_vectors import Vectors

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Rows = NDArray[np.intp]
NEAR_SPEED = 0.05  # speeds are one within this share

SHOWN = 5  # a remark names so many rotors, readings …; of the others it gives the number


@dataclass(frozen=True)
class Channel:
    """A sensor at a speed (rad/s; None where the table names none)."""

    sensor: str
    speed: float | None
    speed_written: float | None = None
    state: str | None = None
    """The operating state, where the table names one."""

    def __str__(self) -> str:
        named = self.sensor if self.state is None else f"{self.sensor} ({self.state})"
        return named if self.speed_written is None else f"{named} at {self.speed_written:g}"

    @property
    def key(self) -> dict[str, str | float | None]:
        """How the JSON names it: states stand where speeds do."""
        key: dict[str, str | float | None] = {"sensor": self.sensor}
        if self.state is not None:
            key["state"] = self.state
        return key if self.state is not None and self.speed is None else {**key, "speed_rad_s": self.speed}


@dataclass(frozen=True)
class Trial:
    """A run of an initial run with trial runs."""

    run: str
    lines: list[int]
    """Which rows of readings are of it."""
    tried: bool
    """Whether a mass was put on for it."""
    kept: bool


class Lines:
    """Of which run each row of readings is, for many rotors; the names are formed on request."""

    def __init__(self, names: list[str], run: Rows, years: Real | None) -> None:
        self.names, self.run, self.years = names, run, years
        self.senses: list[str | None] = [None] * len(run)
        """For each rotor "lead" or "lag", as the runs show it; None where they cannot tell."""

    def of(self, i: int) -> list[str]:
        """Return the runs of a rotor's rows."""
        return [self.names[r] for r in self.run[i].tolist()]

    def runs(self, i: int) -> list[str]:
        """Return the runs of a rotor, each once."""
        return list(dict.fromkeys(self.of(i)))

    def only(self, rotors: Rows, lines: Rows) -> Lines:
        """Return some lines of some of the rotors."""
        mine = np.ix_(rotors, lines)
        return Lines(self.names, self.run[mine], None if self.years is None else self.years[mine])


@dataclass(frozen=True, eq=False, repr=False)
class Before:
    """Coefficients of a machine, or of machines like it, that are stored from earlier runs."""

    prior: balancing.Prior
    machines: int
    """How many machines they are of."""
    scatter: float | None
    """Between machines, as a share of the coefficients; None of one machine."""
    reading: tuple[float, float] | None
    """Standard deviation of their readings as vectors, in the runs' unit, and its complex degrees of freedom."""


@dataclass(eq=False, repr=False)
class Group:
    """Rotors that were measured in the same way, g of them: r rows of readings of s channels, masses in p planes."""

    rotors: Rows
    """Their numbers, (g,)."""
    lines: Lines
    """Of which run each row of readings is."""
    channels: list[Channel]
    planes: list[str]
    readings: Complex
    """(g, r, s), in the table's amplitude unit; NaN where a row lacks a channel."""
    masses: Complex
    """What was on the rotor, (g, r, p), SI."""
    standing: Complex
    """What is on the rotor in its last run, whether it is meant to stay or not, (g, p), SI."""
    last: list[str]
    """What that run is called, (g,)."""
    weights: Real | None
    """Those of the channels, (g, s)."""
    trials: list[Trial]
    """The runs, the initial one first; none of a log whose runs are all fitted together."""
    exact: Callable[[], Exact]
    """Readings, masses and standing in 32 digits, as the table has them; worked out on request."""
    fit: balancing.JointFit | None = None
    """Where the readings tell the coefficients: not with stored ones, nor without phase."""
    before: Before | None = None
    """Where stored coefficients take part in the fit."""

    def only(self, rotors: Rows, lines: Rows, channels: Rows) -> Group:
        """Return some lines and channels of some of the rotors."""
        mine = np.ix_(rotors, lines)
        return replace(
            self,
            rotors=self.rotors[rotors],
            lines=self.lines.only(rotors, lines),
            channels=[self.channels[s] for s in channels],
            readings=self.readings[np.ix_(rotors, lines, channels)],
            masses=self.masses[mine],
            standing=self.standing[rotors],
            last=[self.last[k] for k in rotors],
            weights=None if self.weights is None else self.weights[np.ix_(rotors, channels)],
            exact=lambda: self.exact().only(rotors, lines, channels),
        )

    def own_weights(self, i: int) -> Real | None:
        """The weights of one rotor's channels, (s,)."""
        return None if self.weights is None else self.weights[i]

    @property
    def fitted(self) -> balancing.JointFit:
        """The fit of a group that has one."""
        assert self.fit is not None
        return self.fit

    @cached_property
    def chance(self) -> Real:
        """How often by chance a residual of the fit is as large as each of them, (g, r, s)."""
        return balancing.outlier_probability(self.fitted)

    @cached_property
    def repeats(self) -> RunMeans:
        """The mean readings of an initial run and trial runs, and how far repeats scatter; of a fitted log none."""
        return RunMeans(self.readings, [of.lines for of in self.trials])

    @property
    def means(self) -> Complex:
        """What was read in each run, (g, 1 + r, s): the mean of repeats."""
        return self.repeats.values

    @property
    def initial(self) -> Complex:
        """The vibration without masses, (g, s): the mean of the initial run, or as fitted."""
        return self.means[:, 0] if self.trials or self.fit is None else self.fit.initial

    @property
    def on(self) -> Complex:
        """What was on the rotor in each run, (g, 1 + r, p)."""
        return self.masses[:, [of.lines[0] for of in self.trials]]


class Exact(NamedTuple):
    """The numbers of a group in 32 digits."""

    readings: Vectors
    """(g, r, s); 0 where a row lacks a channel."""
    masses: Vectors
    """(g, r, p)."""
    standing: Vectors
    """(g, p)."""

    def only(self, rotors: Rows, lines: Rows, channels: Rows) -> Exact:
        """Return some lines and channels of some of the rotors."""
        readings, masses, standing = self
        return Exact(
            readings[np.ix_(rotors, lines, channels)], masses[np.ix_(rotors, lines)], standing[rotors]
        )

    def with_planes(self, at: list[int], count: int) -> Exact:
        """Return the same with masses in the planes `at` of so many."""
        from dalembert.arithmetic.doubled_vectors import Vectors

        masses, standing = (
            Vectors.of(np.zeros((*of.shape[:-1], count))) for of in (self.masses, self.standing)
        )
        masses[..., at], standing[..., at] = self.masses, self.standing
        return Exact(self.readings, masses, standing)

    def turned(self, rotors: NDArray[np.bool_]) -> Exact:
        """Return the same with the phases of some rotors counted in the other sense, (g,)."""
        sign = np.where(rotors, -1.0, 1.0)[:, None, None]
        return self._replace(readings=type(self.readings)(self.readings.x, self.readings.y * sign))


@dataclass(eq=False, repr=False)
class Runs:
    """A table of runs."""

    table: Table
    rotors: list[str]
    mass_unit: str
    """Of the trials: a mass's or an unbalance's."""
    fitted: bool = False
    """Whether all runs are fitted together, or are an initial one and trial runs."""
    groups: list[Group] = field(default_factory=list)
    max_mass: dict[str, float] = field(default_factory=dict)
    """The limits that the file states, plane -> SI."""
    lags: bool = False
    """Whether the runs themselves told that the phase lags, and it was turned round."""
    runout: dict[str, complex] = field(default_factory=dict)
    """What the file itself states of it, sensor -> vector as read."""
    exact_runout: Callable[[], dict[str, Vectors]] | None = None
    """The same in 32 digits, of a file of run-out; None: it is the floats."""
    warnings: list[str] = field(default_factory=list)
    """Shown once each, however often they stand here."""

    @property
    def amplitude_unit(self) -> str:
        """The unit of the readings."""
        return self.table.numbers["amplitude"].unit

    @property
    def per(self) -> str:
        """`mass` or `unbalance`: what the trials are."""
        return "mass" if self.mass_unit in UNITS["mass"] else "unbalance"

    @property
    def per_si(self) -> str:
        """The SI unit of the trials, as keys and headers have it."""
        return "kg" if self.per == "mass" else "kg_m"

    @property
    def speed_unit(self) -> str:
        """The unit of the speeds that stand in the table."""
        return self.table.numbers["speed"].unit if "speed" in self.table.numbers else "rpm"

    @property
    def several(self) -> bool:
        """Whether there are several rotors, which sentences and tables then name."""
        return len(self.rotors) > 1

    def in_unit(self, value: Scaled, unit: str, what: str) -> Scaled:
        """Convert amplitudes to the unit of the readings; DataError where they are another quantity, or read another way."""
        wanted = self.amplitude_unit
        if amplitude_kind(unit) != amplitude_kind(wanted):
            raise DataError(
                f"{what} is in {unit}, the runs in {wanted}: displacement, velocity, acceleration, voltage, counts, peak "
                "(_pk), peak to peak (_pp) and r.m.s. (_rms) do not mix"
            )
        return value if unit == wanted else from_si(to_si(value, "amplitude", unit), "amplitude", wanted)

    def of(self, rotor: int) -> str:
        """Return what a sentence about a rotor begins with, where there are several."""
        return f"rotor {self.rotors[rotor]}: " if self.several else ""


def apart(one: float | None, other: float) -> float:
    """How far two speeds are apart, relatively; 0 where either is not known."""
    if one is None or other != other or one == other:
        return 0.0
    return abs(one - other) / max(abs(one), abs(other))


@dataclass
class LogRows:
    """The rows of a table of runs, as arrays."""

    of: Runs
    """What the rows are of."""
    rotor: Rows
    vibration: Complex
    masses: Masses
    named: NDArray[np.bool_]
    """Whether a row names a plane, or a mass where there is but one plane."""
    run: Rows
    runs: list[str]
    exact: Callable[[], Vectors]
    """`vibration` in 32 digits, as the table has it; worked out on request."""
    years: Real | None = None
    """When it was read; NaN where the row does not say."""
    channels: list[Channel] = field(default_factory=list)
    channel: Rows = field(default_factory=lambda: np.zeros(0, dtype=np.intp))
    """The sensor, state and speed of each row."""


Flags = NDArray[np.bool_]


def near_speeds(table: Table, rotor: Rows) -> tuple[list[Channel], Rows]:
    """Return the channels, and that of each row; speeds within 5 % of the slowest of their kind are one."""
    sensors, sensor = table.numbered("sensor", "1")
    states, state = table.numbered("state")
    kind, first = numbered(sensor * len(states) + state)
    named = "state" in table.texts
    kinds = [(sensors[sensor[i]], states[state[i]] if named else None) for i in first.tolist()]
    speed = table.numbers.get("speed")
    if speed is None:
        return [Channel(one, None, state=of) for one, of in kinds], kind
    written, si = speed.values, speed.si
    of_rotor = numbered(rotor * len(kinds) + kind)[0]
    value = np.where(np.isnan(written), -np.inf, written)
    near, left, many = np.zeros(table.rows, dtype=np.intp), np.arange(table.rows), int(of_rotor.max()) + 1
    while len(left):
        slowest = np.full(many, np.inf)
        np.minimum.at(slowest, of_rotor[left], value[left])
        slowest = np.maximum(slowest, slowest * (1 + NEAR_SPEED))
        inside = value[left] <= slowest[of_rotor[left]]
        near[left[~inside]] += many
        left = left[~inside]
    number, first = numbered(near + of_rotor)
    count = np.bincount(number)
    means = [np.bincount(number, of) / count for of in (written, np.asarray(si))]
    alike = np.ones(len(first), dtype=bool)
    np.logical_and.at(alike, number, value == value[first[number]])
    out: dict[Channel, int] = {}
    code = []
    for k, i in enumerate(first.tolist()):
        one, of = kinds[kind[i]]
        mean = (written[i], si[i]) if alike[k] else (means[0][k], means[1][k])
        none = written[i] != written[i]
        channel = Channel(one, None if none else float(mean[1]), None if none else float(mean[0]), state=of)
        code.append(out.setdefault(channel, len(out)))
    return list(out), np.array(code)[number]


class OfInitialRun:
    """The channels of the initial runs, which the trial runs read again."""

    def __init__(self, table: Table, rotor: Rows, runs: Runs, initial: Flags) -> None:
        self.table, self.rotor, self.runs, self.initial = table, rotor, runs, initial

    def channels(self) -> tuple[list[Channel], Rows]:
        """Return the sensors and speeds of the initial runs, and that of each row; the nearest speed is meant."""
        table = self.table
        sensors, sensor = table.numbered("sensor", "1")
        speed = table.numbers.get("speed")
        of_sensor = self.rotor * len(sensors) + sensor
        initial = self.initial
        if speed is None:
            missing = ~np.isin(of_sensor, of_sensor[initial])
            channels = [Channel(name, None) for name in sensors]
            if missing.any():
                raise self._not_there(int(np.argmax(missing)), sensors, sensor, initial, channels, sensor)
            return channels, sensor
        written, si = speed.values, np.asarray(speed.si)
        out: dict[Channel, int] = {}
        exact: dict[tuple[int, float | None], int] = {}
        of: dict[int, list[int]] = {}
        code = np.full(table.rows, -1)
        for i in np.flatnonzero(initial).tolist():
            value = None if written[i] != written[i] else float(written[i])
            channel = Channel(sensors[sensor[i]], None if value is None else float(si[i]), value)
            code[i] = out.setdefault(channel, len(out))
            if exact.setdefault((int(of_sensor[i]), value), code[i]) == code[i]:
                mine = of.setdefault(int(of_sensor[i]), [])
                mine += [] if code[i] in mine else [int(code[i])]
        channels = list(out)
        for i in np.flatnonzero(~initial).tolist():
            value = None if written[i] != written[i] else float(written[i])
            match = exact.get((int(of_sensor[i]), value))
            if match is None:
                match = self._nearest(
                    i, written[i], [(c, channels[c]) for c in of.get(int(of_sensor[i]), ())]
                )
            if match is None:
                raise self._not_there(i, sensors, sensor, initial, channels, code)
            code[i] = match
        return channels, code

    def _nearest(self, row: int, speed: float, same: list[tuple[int, Channel]]) -> int | None:
        """Return the channel that is meant: the speed of a run is never quite that of another."""
        off = [apart(channel.speed_written, speed) for _, channel in same]
        nearest = min(range(len(same)), key=off.__getitem__, default=None)
        if nearest is None or (off[nearest] > NEAR_SPEED and len(same) > 1):
            return None
        if off[nearest] > 0.01:
            self.runs.warnings.append(
                f"{self.runs.of(int(self.rotor[row]))}run {self.table.texts['run'][row]} ran at {speed:g}, the initial run at "
                f"{same[nearest][1].speed_written or 0:g}: coefficients hold at one speed"
            )
        return same[nearest][0]

    def _not_there(
        self, row: int, sensors: list[str], sensor: Rows, initial: Flags, channels: list[Channel], code: Rows
    ) -> DataError:
        mine = np.flatnonzero(initial & (self.rotor == self.rotor[row]))
        present = ", ".join(dict.fromkeys(str(channels[code[i]]) for i in mine.tolist()))
        speed = self.table.numbers.get("speed")
        name = sensors[sensor[row]]
        at = np.nan if speed is None else speed.values[row]
        what = name if at != at else f"{name} at {at:g}"
        return self.table.error(row, "sensor", what, f"a sensor and speed of the initial run ({present})")
