"""Runs as arrays: rotors that were measured in the same way, side by side; channels: which sensor, at which speed or in which state, a row reads; dates."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from datetime import datetime
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dalembert.decimals import Scaled
from dalembert.errors import DataError
from dalembert.tables.table import Table, numbered
from dalembert.units import UNITS, amplitude_kind, from_si, to_si

if TYPE_CHECKING:
    from balancing.amplitudes import AmplitudeFit
    from balancing.doubt import Drift
    from balancing.prior import Prior
    from balancing.run_log import JointFit
    from dalembert.arithmetic.doubled_arrays import Vectors

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


class Lines:
    """Which run each row of readings belongs to, for many rotors; the names are formed on request."""

    def __init__(self, names: list[str], run: Rows, place: Rows, years: Real | None) -> None:
        self.names, self.run, self.place, self.years = names, run, place, years
        self.senses: list[str | None] = [None] * len(run)
        """For each rotor "lead" or "lag", as the runs show it; None where they do not."""

    @cached_property
    def rows(self) -> list[list[int]]:
        """The rows of each run, in the order of the file: all rotors have them in the same places."""
        return [np.flatnonzero(self.place == k).tolist() for k in dict.fromkeys(self.place.tolist())]

    def of(self, i: int) -> list[str]:
        """Return the run of each row of a rotor."""
        return [self.names[r] for r in self.run[i].tolist()]

    def runs(self, i: int) -> list[str]:
        """Return the runs of a rotor, each once."""
        return [self.names[self.run[i, rows[0]]] for rows in self.rows]

    def only(self, rotors: Rows, lines: Rows) -> Lines:
        """Return some lines of some of the rotors."""
        mine = np.ix_(rotors, lines)
        years = None if self.years is None else self.years[mine]
        return Lines(self.names, self.run[mine], self.place[lines], years)


@dataclass(frozen=True, eq=False, repr=False)
class Before:
    """Coefficients of a machine, or of machines like it, that are stored from earlier runs."""

    prior: Prior
    machines: int
    """How many machines they are of."""
    scatter: float | None
    """Between machines, as a share of the coefficients; None of one machine."""
    reading: tuple[float, float] | None
    """Standard deviation of their readings as vectors, in the runs' unit, and its complex degrees of freedom."""
    exact: Callable[[], tuple[Prior, Any]]
    """The coefficients and that deviation in 32 digits, as the files have them; computed on request."""


@dataclass(eq=False, repr=False)
class Group:
    """Rotors that were measured in the same way, g of them: r rows of readings of s channels, masses in p planes."""

    rotors: Rows
    """Their numbers, (g,)."""
    lines: Lines
    """Which run each row of readings belongs to."""
    channels: list[Channel]
    planes: list[str]
    readings: Complex
    """(g, r, s), in the table's amplitude unit; NaN where a row lacks a channel."""
    masses: Complex
    """The masses on the rotor, (g, r, p), SI."""
    standing: Complex
    """The masses on the rotor in its last run, meant to stay or not, (g, p), SI."""
    last: list[str]
    """The name of that run, (g,)."""
    weights: Real | None
    """Those of the channels, (g, s)."""
    exact: Callable[[], Exact]
    """Readings, masses and standing in 32 digits, as the table has them; computed on request."""
    fit: JointFit = field(init=False)
    """Initial vibration and coefficients: of all runs together, or the coefficients are stored, or of amplitudes alone."""
    amplitude_fits: list[list[AmplitudeFit]] = field(init=False, default_factory=list)
    """The fits of the four-run method, rotor by rotor, plane by plane."""
    before: Before | None = None
    """Where stored coefficients take part in the fit."""

    def __repr__(self) -> str:
        g, r, s = self.readings.shape
        size = f"readings ({g}, {r}, {s}), masses ({g}, {r}, {len(self.planes)})"
        return f"Group({size}, planes {', '.join(self.planes)})"

    def before_run(self, j: int) -> Rows:
        """Return for each rotor the run that shows best what the masses of run j do, (g,); -1 where they are not new.

        It is the first of the earlier runs, and those without masses, whose masses differ in one plane alone; else the first
        without masses, where there is one.
        """
        apart = (self.on != self.on[:, [j]]).sum(axis=2)
        earlier = np.arange(apart.shape[1]) < j
        at = np.where(self.bare.any(axis=1), np.argmax(self.bare, axis=1), -1)
        alone = (apart == 1) & (earlier | self.bare)
        at = np.where(alone.any(axis=1), np.argmax(alone, axis=1), at)
        return np.where(self.bare[:, j] | ((apart == 0) & earlier).any(axis=1), -1, at)

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

    @cached_property
    def chance(self) -> Real:
        """How often by chance a residual of the fit is as large as each of them, (g, r, s)."""
        from balancing.doubt import outlier_probability

        return outlier_probability(self.fit)

    @cached_property
    def drift(self) -> Drift | None:
        """How the vibration of each rotor changes in a year, and how often so much by chance; None without dates."""
        from balancing.doubt import drift

        return None if self.lines.years is None else drift(self.fit, self.lines.years)

    @cached_property
    def means(self) -> Complex:
        """The mean reading of each run as vectors, (g, runs, s); NaN where a run lacks a channel."""
        read = np.isfinite(self.readings)
        sums, counts = (
            np.stack([of[:, rows].sum(axis=1) for rows in self.lines.rows], axis=1)
            for of in (np.where(read, self.readings, 0), read)
        )
        mean = np.full(sums.shape, complex(np.nan))
        return np.asarray(np.divide(sums, counts, out=mean, where=counts > 0))

    @property
    def on(self) -> Complex:
        """The masses on the rotor in each run, (g, runs, p)."""
        return self.masses[:, [rows[0] for rows in self.lines.rows]]

    @property
    def bare(self) -> NDArray[np.bool_]:
        """Which runs are without masses, (g, runs)."""
        return np.asarray(~self.on.any(axis=2))

    @cached_property
    def in_32_digits(self) -> Exact:
        """Readings, masses and standing, once the fit has shown the sense of the phases."""
        return self.exact()

    def exact_scatter(self, fit: JointFit) -> Any:
        """Return the deviation of the readings in 32 digits, (g,): as residuals scatter, or as those of sisters did, or none."""
        sd, estimated = self.fit.residual_sd, np.asarray(self.fit.degrees_of_freedom > 0)
        scatter = np.where(estimated & (sd > 0), fit.residual_sd, 0.0)
        if self.before is None or self.before.reading is None:
            return scatter
        return np.where(estimated, scatter, self.before.exact()[1])

    def exact_of_amplitudes(self, i: int) -> Vectors:
        """Return the coefficients of a rotor without phase in 32 digits, (s, p)."""
        from dalembert.arithmetic.doubled_arrays import Vectors

        readings, masses, _ = self.in_32_digits
        read = np.isfinite(self.readings[i]).astype(float)

        def mean(rows: list[int]) -> Vectors:
            counts: Real = read[rows].sum(axis=0)
            means: Vectors = ((readings[i, rows] * read[rows]).sum(0) / counts)[None]
            return means

        first = mean([j for of in self.lines.rows for j in of if not self.masses[i, j].any()])
        columns = []
        for p, fit in enumerate(self.amplitude_fits[i]):
            tried = [of for of in self.lines.rows if self.masses[i, of[0], p] != 0]
            each = Vectors.joined([mean(of) for of in tried])
            on = Vectors.joined([masses[i, of[0], p][None] for of in tried])
            columns.append(fit.second_run(first[0].x, each.x, on)[0][:, None])
        return Vectors.joined(columns, axis=-1)


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

    def in_planes(self, own: list[int], there: list[int], count: int) -> Exact:
        """Return the same with the masses of the planes `own` in the planes `there` of so many."""
        from dalembert.arithmetic.doubled_arrays import Vectors

        masses, standing = (
            Vectors.of(np.zeros((*of.shape[:-1], count))) for of in (self.masses, self.standing)
        )
        masses[..., there], standing[..., there] = self.masses[..., own], self.standing[..., own]
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
    """The unit of the trial masses, or unbalances."""
    other_masses: bool = False
    """Whether the stored coefficients are per mass and the runs have unbalances, or the other way."""
    fitted: bool = False
    """Whether the fit is shown: on request, where readings are more than unknowns, or where no run is without masses."""
    groups: list[Group] = field(default_factory=list)
    max_mass: dict[str, float] = field(default_factory=dict)
    """The limits that the file states, plane -> SI."""
    lags: bool = False
    """Whether runs show that the phase lags, so that phases were turned round."""
    stored_lags: dict[str, bool] = field(default_factory=dict)
    """Files of stored coefficients, and whether they state that they were measured with a phase that lags."""
    runout: dict[str, complex] = field(default_factory=dict)
    """That of a file, sensor -> vector as the instrument shows it."""
    exact_runout: Callable[[], dict[str, Vectors]] | None = None
    """These in 32 digits, where --runout names a file; None: they are the floats."""
    warnings: list[str] = field(default_factory=list)
    """Shown once each, however often they stand here."""

    def __repr__(self) -> str:
        n = len(self.rotors)
        size = f"{n} rotor{'s' * (n != 1)}"
        return f"Runs({self.table.file}: {size}, amplitudes in {self.amplitude_unit}, per {self.per_si})"

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
    def unbalance_unit(self) -> str:
        """The unit of unbalances: that of the table, oz·in for trial masses in oz or lb, else g·mm."""
        of_masses = "oz_in" if self.mass_unit in ("oz", "lb") else "g_mm"
        return self.mass_unit if self.per == "unbalance" else of_masses

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
    """The relative difference of two speeds; 0 where either is not known."""
    if one is None or other != other or one == other:
        return 0.0
    return abs(one - other) / max(abs(one), abs(other))


def channels_of(table: Table, rotor: Rows) -> tuple[list[Channel], Rows]:
    """Return the channels, and that of each row; speeds of a sensor within 5 % of the slowest are one speed, their mean."""
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


# -- dates --------------------------------------------------------------------------------------------------

_ISO = re.compile(
    r"(\d{4})[-/](\d{1,2})(?:[-/](\d{1,2}))?(?:[T ]+(\d{1,2}):(\d{2})(?::(\d{2})(?:\.\d+)?)?Z?)?"
)
_POINTS = re.compile(r"(\d{1,2})\.(\d{1,2})\.(\d{4}|\d{2})(?:,?\s+(\d{1,2}):(\d{2})(?::(\d{2}))?)?")
DATE = "a date such as 2019-03-14, 2019-03-14 08:30 or 14.03.2019"
YEAR = 365.25


def years(table: Table) -> Real | None:
    """Return the date of each row in years, from any origin; NaN where there is none, None without a column of dates."""
    written = table.texts.get("date")
    if written is None or not any(written):
        return None
    return np.array([_year(table, i, text) if text else np.nan for i, text in enumerate(written)])


def _year(table: Table, row: int, text: str) -> float:
    at = _date(text)
    if at is None:
        raise table.error(row, "date", text, DATE)
    # in days first, so that no digit is lost
    return (at - datetime(2000, 1, 1)).total_seconds() / 86400 / YEAR


def _date(text: str) -> datetime | None:
    """Read a date; None where it is none.

    >>> _date("14.3.19 08:30"), _date("2019-02-30")
    (datetime.datetime(2019, 3, 14, 8, 30), None)
    """
    iso, points = _ISO.fullmatch(text), _POINTS.fullmatch(text)
    match = iso or points
    if match is None:
        return None
    first, month, last, *clock = match.groups()
    year, day = (first, last or "1") if iso else (last, first)
    try:
        hour, minute, second = (int(part or 0) for part in clock)
        return datetime(int(year) + 2000 * (len(year) == 2), int(month), int(day), hour, minute, second)
    except ValueError:
        return None


def latest(table: Table) -> str | None:
    """Return the last date of a table, as 2019-03-14; None where none can be read."""
    dates = [at for at in map(_date, table.texts.get("date", ())) if at is not None]
    return str(max(dates).date()) if dates else None
