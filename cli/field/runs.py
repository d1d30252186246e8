"""Runs as arrays: rotors that were measured in the same way, side by side."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple, overload

import numpy as np
from numpy.typing import NDArray

import balancing
from dalembert.errors import DataError
from dalembert.tables.table import Table
from dalembert.units import UNITS, Scaled, amplitude_kind, from_si, to_si

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Rows = NDArray[np.intp]
YES = ("yes", "y", "true", "1", "kept", "on", "ja", "j", "bleibt")
NO = ("no", "n", "false", "0", "", "removed", "off", "nein")
NEAR_SPEED = 0.05  # speeds are one within this share

SHOWN = 5  # a remark names so many rotors, readings …; of the others it gives the number


@dataclass(frozen=True)
class Channel:
    """A sensor at a speed (rad/s; None where the table names none)."""

    sensor: str
    speed: float | None
    speed_given: float | None = None
    state: str | None = None
    """The operating state, where the table names one."""

    def __str__(self) -> str:
        named = self.sensor if self.state is None else f"{self.sensor} ({self.state})"
        return named if self.speed_given is None else f"{named} at {self.speed_given:g}"

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


@dataclass(frozen=True, eq=False, repr=False)
class Log:
    """The rows of a rotor's fit: for each the run's name, and which of its repeated readings it holds."""

    rows: list[tuple[str, int]]
    sense: str | None = None
    """"lead" or "lag", as the runs show it; None where they cannot tell."""

    years: list[float] | None = None
    """When each was read, from any origin; NaN where it is not known, None where the log has no dates."""

    @property
    def runs(self) -> list[str]:
        """The runs, in order."""
        return list(dict.fromkeys(run for run, _ in self.rows))


@dataclass(frozen=True, eq=False, repr=False)
class Before:
    """What was known of a machine before its runs."""

    prior: balancing.Prior
    machines: int
    """Whose coefficients they are."""
    scatter: float | None
    """Between machines, as a share of the coefficients; None of one machine."""
    reading: tuple[float, float] | None
    """Standard deviation of their readings as vectors, in the runs' unit, and its complex degrees of freedom."""


@dataclass(eq=False, repr=False)
class Group:
    """Rotors that were measured in the same way."""

    rotors: Rows
    """Their numbers, (g,)."""
    channels: list[Channel]
    planes: list[str]
    logs: Sequence[Log]
    """Of what run each row of readings is, rotor by rotor."""
    readings: Complex
    """(g, r, s), as read, in the table's amplitude unit; NaN where a row lacks a channel."""
    masses: Complex
    """What was on the rotor, (g, r, p), SI."""
    standing: Complex
    """What is on the rotor in its last run, whether it is meant to stay or not, (g, p), SI."""
    last: list[str]
    """What that run is called, (g,)."""
    weights: Real | None
    errors: Callable[[], tuple[Real, Real]]
    """Bounds of the errors of `readings` and `masses` against the decimals of the table; worked out when asked for."""
    fit: balancing.JointFit | None = None
    """Where the readings alone tell the coefficients: not with stored ones, nor without phase."""
    trials: Sequence[Trial] = ()
    """The runs, the initial one first; none of a log whose runs are all fitted together."""
    before: Before | None = None
    """Where coefficients known before take part in the fit."""

    def own_weights(self, i: int) -> Real | None:
        """The weights of one rotor's channels, (s,)."""
        return None if self.weights is None else self.weights[i]

    @cached_property
    def chance(self) -> Real:
        """How often by chance a residual of the fit is as large as each of them, (g, r, s)."""
        from balancing import outlier_probability

        assert self.fit is not None
        return outlier_probability(self.fit)

    @property
    def initial(self) -> Complex:
        """The vibration without masses, (g, s): the mean of the initial run, or as fitted."""
        return self.means[:, 0] if self.trials or self.fit is None else self.fit.initial

    @cached_property
    def counts(self) -> Rows:
        """How often each sensor was read in each run, (1 + r, s)."""
        return np.array([np.isfinite(self.readings[0, of.lines]).sum(axis=0) for of in self.trials])

    @cached_property
    def means(self) -> Complex:
        """What was read in each run, (g, 1 + r, s): the mean of repeats."""
        read = np.where(np.isfinite(self.readings), self.readings, 0)
        sums = np.stack([read[:, of.lines].sum(axis=1) for of in self.trials], axis=1)
        return np.asarray(sums / self.counts)

    @property
    def on(self) -> Complex:
        """What was on the rotor in each run, (g, 1 + r, p)."""
        return self.masses[:, [of.lines[0] for of in self.trials]]

    @cached_property
    def scatter(self) -> Real:
        """Σ|reading - mean|² of the repeats of each run, (g, 1 + r, s)."""
        off = [np.abs(self.readings[:, of.lines] - self.means[:, [j]]) for j, of in enumerate(self.trials)]
        return np.stack([np.nansum(np.square(each), axis=1) for each in off], axis=1)

    @property
    def repeats(self) -> int:
        """Complex degrees of freedom of the repeats in an initial run and trial runs: readings less means."""
        return int((self.counts - 1).sum()) if self.trials else 0

    @cached_property
    def reading_sd(self) -> Real:
        """Standard deviation of one reading as the repeats show it, √(Σ|reading - mean|²/degrees of freedom), (g,)."""
        if not self.repeats:
            return np.zeros(len(self.rotors))
        sd = np.sqrt(self.scatter.sum(axis=(1, 2)) / self.repeats)
        # what lies in the rounding of the mean is agreement
        return np.where(sd > 1e-14 * np.abs(self.means).max(axis=(1, 2)), sd, 0.0)

    @cached_property
    def contradictory(self) -> NDArray[np.bool_]:
        """Where repeats lie as far apart as a trial mass should move the vibration, 30 % of it, (g, 1 + r, s)."""
        spread = self.scatter / self.counts
        largest = np.sqrt((np.square(np.abs(self.means)) + spread).max(axis=1, keepdims=True))
        return np.asarray(np.sqrt(spread) > 0.15 * largest)

    @cached_property
    def mean_error(self) -> Real:
        """Standard deviation of each component of each mean as the repeats show it, (g, 1 + r, s).

        One estimate serves all readings; where repeats contradict each other their own holds if it is larger.
        """
        pooled = np.square(self.reading_sd)[:, None, None]
        own = np.where(self.contradictory, self.scatter / np.maximum(self.counts - 1, 1), 0.0)
        return np.asarray(np.sqrt(np.maximum(pooled, own) / (2 * self.counts)))


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


class Masses(NamedTuple):
    """What the rows of a table put on, an entry for each mass."""

    planes: list[str]
    row: Rows
    """Ascending, (k,)."""
    plane: Rows
    value: Complex
    """SI."""
    told: NDArray[np.bool_]
    """Whether a row says anything of masses, (n,)."""

    @classmethod
    def of(cls, rows: Sequence[dict[str, complex] | None]) -> Masses:
        """Take the masses of each row, plane -> mass; None where it says nothing of them."""
        planes: dict[str, int] = {}
        entries = [
            (i, planes.setdefault(plane, len(planes)), mass)
            for i, masses in enumerate(rows)
            for plane, mass in (masses or {}).items()
        ]
        row, plane, value = zip(*entries, strict=True) if entries else ((), (), ())
        told = np.array([masses is not None for masses in rows])
        at, of = (np.array(part, dtype=np.intp) for part in (row, plane))
        return cls(list(planes), at, of, np.array(value, dtype=complex), told)

    def by_row(self) -> list[dict[str, complex] | None]:
        """Return them as `of` takes them."""
        out: list[dict[str, complex] | None] = [{} if told else None for told in self.told.tolist()]
        for i, plane, mass in zip(self.row.tolist(), self.plane.tolist(), self.value.tolist(), strict=True):
            mine = out[i]
            assert mine is not None
            mine[self.planes[plane]] = mass
        return out


@dataclass
class LogRows:
    """What each row of the table says, by row."""

    of: Runs
    """What the rows are of."""
    rotor: Rows
    vibration: Complex
    masses: Masses
    named: NDArray[np.bool_]
    """Whether a row names a plane, or a mass where there is but one plane."""
    run: Rows
    runs: list[str]
    years: Real | None = None
    """When it was read; NaN where the row does not say."""
    reading_share: float = 0.0
    """By what share of it a reading may be off from its decimals."""
    mass_share: float = 0.0
    channels: list[Channel] = field(default_factory=list)
    channel: Rows = field(default_factory=lambda: np.zeros(0, dtype=np.intp))
    """The sensor, state and speed of each row."""


class Lines(Sequence[Log]):
    """The rows of readings of many rotors' fits, each named when it is asked for."""

    def __init__(self, names: list[str], run: Rows, again: Rows, years: Real | None) -> None:
        self.names, self.run, self.again, self.years = names, run, again, years
        self.senses: list[str | None] = [None] * len(run)

    def __len__(self) -> int:
        return len(self.run)

    @overload
    def __getitem__(self, i: int) -> Log: ...
    @overload
    def __getitem__(self, i: slice) -> list[Log]: ...
    def __getitem__(self, i: int | slice) -> Log | list[Log]:
        if isinstance(i, slice):
            return [self[k] for k in range(*i.indices(len(self)))]
        rows = [(self.names[r], k) for r, k in zip(self.run[i].tolist(), self.again[i].tolist(), strict=True)]
        return Log(rows, self.senses[i], None if self.years is None else self.years[i].tolist())

    def only(self, rotors: Rows, lines: Rows) -> Lines:
        """Return some lines of some of the rotors."""
        mine = np.ix_(rotors, lines)
        return Lines(
            self.names, self.run[mine], self.again[mine], None if self.years is None else self.years[mine]
        )


class Part(NamedTuple):
    """Rotors of like shape."""

    rotors: Rows
    """(g,)."""
    lines: Lines
    """The rows of readings, (g, r)."""
    channels: list[Channel]
    planes: list[str]
    readings: Complex
    """(g, r, s)."""
    masses: Complex
    """(g, r, p)."""
    sizes: Real
    """The sizes of all masses of which these are the sum, (g, r, p)."""
    standing: Complex
    """What is on the rotor in its last run, (g, p)."""
    last: list[str]
    """What that run is called, (g,)."""
    weights: Real | None
    """(g, s)."""
    trials: list[Trial]
    """The runs, the initial one first; none where all are fitted together."""

    def only(self, rotors: Rows, lines: Rows, channels: Rows) -> Part:
        """Return some lines and channels of some of the rotors."""
        return Part(
            self.rotors[rotors],
            self.lines.only(rotors, lines),
            [self.channels[s] for s in channels],
            self.planes,
            self.readings[np.ix_(rotors, lines, channels)],
            self.masses[np.ix_(rotors, lines)],
            self.sizes[np.ix_(rotors, lines)],
            self.standing[rotors],
            [self.last[k] for k in rotors],
            None if self.weights is None else self.weights[np.ix_(rotors, channels)],
            self.trials,
        )
