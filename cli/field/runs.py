"""Runs as arrays: rotors that were measured in the same way, side by side."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

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

SHOWN = 5  # of so many rotors, readings … the same is said; of the others how many they are


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
