"""Runs as arrays: rotors that were measured in the same way, side by side."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

import balancing
from dalembert.errors import DataError
from dalembert.tables.table import Table
from dalembert.units import UNITS, Scaled, amplitude_kind, from_si, to_si

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Rows = NDArray[np.intp]
Value = TypeVar("Value", np.float64, np.complex128)

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
    """A trial run: its name, and the (plane, row) of the masses that were put on for it."""

    run: str
    masses: list[tuple[int, int, int]]
    """(plane, row of the rotor, place in the cell) of each mass."""
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
    trials: list[Trial]
    initial: Complex
    """(g, s), as read, in the table's amplitude unit."""
    runs: Complex
    """(g, r, s)."""
    on: Complex
    """What was on the rotor in each trial run, (g, r, p), SI."""
    standing: Complex
    """What is on the rotor in its last run, whether it is meant to stay or not, (g, p), SI."""
    last: list[str]
    """What that run is called, (g,)."""
    weights: Real | None
    counts: Rows
    """How often each sensor was read in the initial and in each trial run, (1 + r, s)."""
    scatter: Real
    """Σ|reading - mean|² of the repeats, (g, 1 + r, s)."""
    errors: Callable[[], tuple[Real, Real, Real]]
    """Bounds of the errors of `initial`, `runs` and `on` against the decimals of the table; worked out when asked for."""
    fit: balancing.JointFit | None = None
    """Where all runs were fitted at once: `initial` is fitted then, and there are no trial runs."""
    logs: Sequence[Log] = ()
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
    def repeats(self) -> int:
        """Complex degrees of freedom of the repeats: readings less means."""
        return int((self.counts - 1).sum())

    @cached_property
    def reading_sd(self) -> Real:
        """Standard deviation of one reading as the repeats show it, √(Σ|reading - mean|²/degrees of freedom), (g,)."""
        sd = np.sqrt(self.scatter.sum(axis=(1, 2)) / max(self.repeats, 1))
        # what lies in the rounding of the mean is agreement
        largest = np.maximum(
            np.abs(self.initial).max(axis=1), np.abs(self.runs).max(axis=(1, 2), initial=0.0)
        )
        return np.where(sd > 1e-14 * largest, sd, 0.0)

    @cached_property
    def contradictory(self) -> NDArray[np.bool_]:
        """Where repeats lie as far apart as a trial mass should move the vibration, 30 % of it, (g, 1 + r, s)."""
        means = np.concatenate([self.initial[:, None], self.runs], axis=1)
        spread = self.scatter / self.counts
        largest = np.sqrt((np.square(np.abs(means)) + spread).max(axis=1, keepdims=True))
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

    @property
    def fitted(self) -> bool:
        """Whether all runs are fitted together."""
        return any(group.fit is not None for group in self.groups)

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


def more_than_unknowns(table: Table) -> bool:
    """Tell whether a rotor has more runs than unknowns: the initial vibration and a coefficient of each plane."""
    sizes = [table.cells[name] for name in ("trial_mass", "trial_unbalance") if name in table.cells]
    if "run" not in table.texts or len(sizes) != 1:
        return False
    _, rotor = table.numbered("rotor", "1")
    _, run = table.numbered("run")
    names, plane = table.numbered("trial_plane")
    if "trial_plane" not in table.texts:
        names, plane = ["", "1"], np.array([bool(cell) for cell in sizes[0].values]).astype(np.intp)
    planes: dict[str, int] = {}
    each = [
        [planes.setdefault(part.strip(), len(planes)) for part in name.split(";") if part.strip()]
        for name in names
    ]

    def count(codes: Rows, of: Rows) -> Rows:
        """Count what differs, rotor by rotor."""
        many = int(codes.max(initial=0)) + 1
        # with indices: without them numpy loads its masked arrays, which takes longer than a small table
        each, _ = np.unique(of * many + codes, return_index=True)
        return np.bincount(each // many, minlength=int(rotor.max()) + 1)

    most = max(map(len, each))
    several = np.array([one + one[-1:] * (most - len(one)) if one else [-1] * most for one in each])[plane]
    told = several[:, 0] >= 0 if most else np.zeros(table.rows, dtype=bool)
    if not told.any():
        return False
    known = count(several[told].ravel(), np.repeat(rotor[told], most))
    return bool(((count(run, rotor) > 1 + known) & (known > 0)).any())


def alike(table: Table, rotor: Rows) -> Iterator[tuple[Rows, Rows]]:
    """Yield rotors whose rows name the same runs, sensors, speeds and planes: their numbers, and rows (g, n)."""
    order = np.argsort(rotor, kind="stable")
    count = np.bincount(rotor)
    start = np.cumsum(count) - count
    if len(count) == 1:
        yield np.zeros(1, dtype=np.intp), order[None]
        return
    kind = np.zeros(table.rows, dtype=np.intp)
    for name in ("run", "sensor", "trial_plane", "trial_kept"):
        names, code = table.numbered(name)
        kind = np.unique(kind * len(names) + code, return_inverse=True)[1] if len(names) > 1 else kind
    if (speed := table.numbers.get("speed")) is not None:
        speeds, code = np.unique(np.nan_to_num(speed.values, nan=-1.0), return_inverse=True)
        kind = np.unique(kind * len(speeds) + code, return_inverse=True)[1]
    most = int(kind.max()) + 1
    for size in np.unique(count):
        rotors = np.flatnonzero(count == size)
        rows = order[start[rotors, None] + np.arange(size)]
        label = np.zeros(len(rotors), dtype=np.intp)
        for of_place in kind[rows].T:
            label = np.unique(label * most + of_place, return_inverse=True)[1]
        by_label = np.argsort(label, kind="stable")
        groups = np.split(by_label, np.cumsum(np.bincount(label))[:-1])
        for same in sorted(groups, key=lambda group: int(group[0])):
            yield rotors[same], rows[same]
