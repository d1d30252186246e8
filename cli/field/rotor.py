"""One rotor: its runs, its trim and whether that is needed, its tolerance; and the rows that tables have of rotors."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from balancing import initial_unbalance
from cli.field.field_balancing import SINGULAR, FieldBalancing, Solved
from cli.read.runs.runs import Channel, Complex, Group, Real
from cli.read.tolerance import Verdict
from dalembert.angles import degrees
from dalembert.arithmetic.exact import EPS
from dalembert.results.columns import ABSENT, Column, Table, names, number
from dalembert.results.text import angle_text
from dalembert.units import from_si, written

Flags = NDArray[np.bool_]


class Trim:
    """The trims of a group of rotors."""

    def __init__(self, b: FieldBalancing, solved: Solved) -> None:
        self.b, self.solved = b, solved
        self.masses: Complex = solved.trim
        """(g, p), SI."""
        self.along, self.angle = solved.uncertainty(self.masses)
        """Standard deviations of size (SI) and angle (degrees), (g, p) each; NaN where they are not known."""

    @cached_property
    def vibration(self) -> Complex:
        """The vibration of the rotors as they stand, (g, s): as read in the last run, else by the coefficients."""
        solved = self.solved
        read = np.stack([Rotor(self.b, solved, i).last_reading for i in range(len(self.masses))])
        expected = solved.initial + np.matvec(solved.alpha, solved.standing)
        return np.where(np.isfinite(read), read, expected)

    @cached_property
    def _holds(self) -> dict[str, Flags]:
        """Why no trim is needed, and in which planes."""
        solved, size = self.solved, np.abs(self.masses)
        terms = np.abs(solved.total).max(axis=1, keepdims=True) + np.abs(solved.standing)
        condition = np.where(np.isfinite(solved.condition), solved.condition, 1.0)[:, None]
        return {
            "nothing is left to correct": size <= 16 * EPS * condition * terms,
            "below its own uncertainty": size < np.where(np.isfinite(self.along), self.along, 0.0),
            **self._limits(),
        }

    def _limits(self) -> dict[str, Flags]:
        """Where the rotor as it stands is within every limit that was requested."""
        b, solved = self.b, self.solved
        within: dict[str, Flags] = {}
        if b.ceiling is not None:
            fine = np.all(np.abs(self.vibration) <= b.ceiling * (1 + 1e-9), axis=1, keepdims=True)
            within["the vibration is within the limit"] = np.repeat(fine, len(solved.planes), axis=1)
        if b.request.tolerance is not None and solved.unbalance is not None:
            left = solved.unbalance + solved.standing
            if not b.request.four_run:
                weights = solved.group.weights
                left = initial_unbalance(solved.alpha, self.vibration, weights, singular=SINGULAR)
            share = b.request.tolerance.shares(len(solved.planes))
            within["the unbalance is within the tolerance"] = b.in_kg_m(left) <= share
        if not within:
            return {}
        return {" and ".join(within): np.logical_and.reduce(list(within.values()))}

    @property
    def reasons(self) -> list[list[str]]:
        """Why a rotor's plane needs no trim, rotor by rotor; "" where it does."""
        rotors, planes = self.masses.shape
        return [
            [next((why for why, holds in self._holds.items() if holds[i, p]), "") for p in range(planes)]
            for i in range(rotors)
        ]


class LastRun(NamedTuple):
    """A run with masses on the rotor that was made once the coefficients were known."""

    run: str
    on: Complex
    """What was on the rotor, SI, (p,)."""
    vibration: Complex
    """As read, run-out off, (s,); NaN where a sensor was not read."""


class Reading(NamedTuple):
    """A reading of a log, fitted."""

    run: str
    channel: Channel
    value: complex
    residual: complex
    standardized: float
    outlier: bool
    """Whether it does not go with the others."""
    chance: float
    """How often by chance a residual is as large."""


@dataclass(eq=False, repr=False)
class Rotor:
    """A rotor among those of its group."""

    b: FieldBalancing
    solved: Solved
    i: int

    @property
    def group(self) -> Group:
        """Its group as measured."""
        return self.solved.group

    @property
    def number(self) -> int:
        """Its number in the table."""
        return int(self.group.rotors[self.i])

    @property
    def name(self) -> str:
        """Its name in the table."""
        return self.b.runs.rotors[self.number]

    @property
    def heading(self) -> str:
        """Its name where there are several, as pages and pictures show it."""
        return self.name if self.b.runs.several else ""

    @property
    def planes(self) -> list[str]:
        """Its correction planes."""
        return self.solved.planes

    @property
    def channels(self) -> list[Channel]:
        """What was read."""
        return self.group.channels

    @property
    def standing(self) -> Complex:
        """What is on it in its last run, (p,)."""
        return np.asarray(self.solved.standing[self.i])

    @cached_property
    def reasons(self) -> list[str]:
        """Why a plane needs no trim; "" where it does."""
        return Trim(self.b, self.solved).reasons[self.i]

    def readings(self) -> Iterator[Reading]:
        """Yield the readings of its log."""
        from balancing.doubt import LEVEL

        fit, lines = self.group.fit, self.group.lines.of(self.i)
        for j, s in np.argwhere(fit.present[self.i]).tolist():
            value, residual, far, chance = (
                of[self.i, j, s].item()
                for of in (fit.readings, fit.residuals, fit.standardized, self.group.chance)
            )
            yield Reading(lines[j], self.channels[s], value, residual, far, chance < LEVEL, chance)

    # -- its runs ------------------------------------------------------------------------------------------

    @cached_property
    def last(self) -> LastRun | None:
        """Its last run, where that shows how well it is balanced; None where it was a trial run."""
        runs = self._runs
        # of an excluded one nothing is known here
        run = self.group.last[self.i] if self.group.last[self.i] in runs else list(runs)[-1]
        if self.b.request.four_run or not runs[run].any():
            return None
        # as many runs with masses as planes tell the coefficients
        tried = sum(on.any() for on in runs.values()) <= len(self.planes)
        if tried and not self.b.request.from_here:
            return None
        return LastRun(run, runs[run], self._read(run))

    @property
    def last_reading(self) -> Complex:
        """What was read in its last run, run-out off, (s,); NaN where a sensor was not read."""
        return self._read(self.group.last[self.i])

    @property
    def first_reading(self) -> Complex | None:
        """What was read in the first run without masses, run-out off, (s,); None where there is no such run."""
        bare = next((run for run, on in self._runs.items() if not on.any()), None)
        return None if bare is None else self._read(bare)

    @property
    def _runs(self) -> dict[str, Complex]:
        """Its runs, in order, and what was on the rotor in each."""
        return dict(zip(self.group.lines.of(self.i), self.group.masses[self.i], strict=True))

    def _read(self, run: str) -> Complex:
        """The mean readings of a run, run-out off; NaN where a sensor was not read."""
        rows = [j for j, name in enumerate(self.group.lines.of(self.i)) if name == run]
        readings = self.group.readings[self.i, rows]
        there = np.isfinite(readings)
        mean = np.full(readings.shape[-1:], complex(np.nan))
        np.divide(
            np.where(there, readings, 0).sum(axis=0), there.sum(axis=0), out=mean, where=there.any(axis=0)
        )
        return np.asarray(mean - self.b.runout(self.group))

    # -- its tolerance -------------------------------------------------------------------------------------

    def verdicts(self, *, measured: bool = False) -> list[Verdict]:
        """Return each plane's tolerance, as predicted or as its last run shows it; none where none was requested."""
        solved, i, tolerance = self.solved, self.i, self.b.request.tolerance
        if tolerance is None or solved.unbalance is None:
            return []
        own = solved.unbalance[i]
        if measured and self.last is not None:
            read, weights = np.isfinite(self.last.vibration), self.group.own_weights(i)
            left = initial_unbalance(
                solved.alpha[i][read],
                self.last.vibration[read],
                None if weights is None else weights[read],
                singular=SINGULAR,
            )
        else:
            left = own + solved.total[i]
            left = np.where(np.abs(left) <= 1e-12 * np.abs(own), 0, left)
        sizes: list[Real] = [tolerance.shares(len(self.planes)), self.b.in_kg_m(own), self.b.in_kg_m(left)]
        return [
            Verdict(plane, *size)
            for plane, size in zip(self.planes, np.transpose(sizes).tolist(), strict=True)
        ]


def each(b: FieldBalancing, most: int | None = None) -> Iterator[Rotor]:
    """Yield the rotors in the order of the table."""
    for k, i in b.place[:most]:
        yield Rotor(b, b.solved[k], i)


# -- the rows of tables --------------------------------------------------------------------------------------

Tables = dict[str, Callable[[], Table]]

READINGS = ("rotor", "sensor", "state", "speed_rpm")
"""What names a row that is of a sensor."""


@dataclass(eq=False, repr=False)
class Rows:
    """The rows of a table, and the columns that name them: the rotor, where there are several, then plane, sensor …"""

    rotor: Column
    shown: list[Column]
    hidden: list[Column]
    """Those of the JSON document alone."""
    solved: Sequence[Solved] = ()
    sizes: Sequence[int] = ()
    """How many rows the rotors of each group have together."""
    order: NDArray[np.intp] = field(default_factory=lambda: np.zeros(0, dtype=np.intp))

    @classmethod
    def of(cls, b: FieldBalancing, rotors: Iterable[str]) -> Rows:
        """Return rows of these rotors."""
        rotor = names("rotor", rotors)
        return cls(rotor, [rotor] if b.runs.several else [], [] if b.runs.several else [rotor])

    @classmethod
    def each(cls, b: FieldBalancing, count: Callable[[Solved], int] = lambda _: 1) -> Rows:
        """Return rows of all rotors, as many of each rotor of a group."""
        counts = [count(solved) for solved in b.solved]
        groups = list(zip((solved.group.rotors for solved in b.solved), counts, strict=True))
        rotor = np.concatenate([np.repeat(of, n) for of, n in groups])
        order = np.lexsort((np.concatenate([np.tile(np.arange(n), len(of)) for of, n in groups]), rotor))
        rows = cls.of(b, [b.runs.rotors[r] for r in rotor[order].tolist()])
        return replace(rows, solved=b.solved, sizes=[len(of) * n for of, n in groups], order=order)

    @classmethod
    def planes(cls, b: FieldBalancing) -> Rows:
        """Return a row for each rotor and plane."""
        rows = cls.each(b, lambda solved: len(solved.planes))
        rows.shown.append(names("plane", rows.cells(lambda solved: solved.planes)))
        return rows

    @classmethod
    def sensors(cls, b: FieldBalancing) -> Rows:
        """Return a row for each rotor and sensor."""
        rows = cls.each(b, lambda solved: len(solved.group.channels))
        return rows.read(b, rows.cells(lambda solved: solved.group.channels))

    def read(self, b: FieldBalancing, of: Sequence[Channel]) -> Rows:
        """Add the columns that name sensors: with state and speed where the table has them, else those are JSON's alone."""
        self.shown.append(names("sensor", [channel.sensor for channel in of]))
        states = [channel.state for channel in of]
        if any(state is not None for state in states):
            stored = [ABSENT if state is None else state for state in states]
            self.shown.append(Column("state", "", states, None, "state", stored))
        # in JSON states stand where speeds do
        speeds = [ABSENT if c.state is not None and c.speed is None else c.speed for c in of]
        unit = b.runs.speed_unit or "rpm"
        cells = [None if c.speed is None else from_si(c.speed, "speed", unit) for c in of]
        column = Column("speed", unit, cells, None, "speed_rad_s", speeds)
        (self.hidden if all(cell is None for cell in cells) else self.shown).append(column)
        return self

    def table(
        self,
        columns: Sequence[Column],
        keys: Sequence[str],
        place: str,
        above: str = "",
        below: str = "",
        *,
        hidden: Sequence[Column] = (),
        shown: bool = True,
    ) -> Table:
        """Return the table of these rows; one that is not shown is of the document alone."""
        every, unseen = [*self.shown, *columns], [*self.hidden, *hidden]
        if not shown:
            every, unseen = [], [*every, *unseen]
        return Table(every, keys, f"rotors[].{place}".removesuffix("."), above, below, unseen)

    def numbers(self, of: Callable[[Solved], ArrayLike]) -> NDArray[Any]:
        """Put numbers of the groups, (g, n) each, into the order of the rows."""
        return np.concatenate([np.ravel(of(solved)) for solved in self.solved])[self.order]

    def several(self, of: Callable[[Solved], Iterable[ArrayLike]]) -> list[NDArray[Any]]:
        """Put several such numbers into the order of the rows."""
        parts = zip(*(of(solved) for solved in self.solved), strict=True)
        return [np.concatenate([np.ravel(part) for part in groups])[self.order] for groups in parts]

    def cells(self, of: Callable[[Solved], Sequence[Any]]) -> list[Any]:
        """Put cells that all rotors of a group have into the order of the rows."""
        every = [cell for solved in self.solved for cell in list(of(solved)) * len(solved.group.rotors)]
        return [every[k] for k in self.order.tolist()]

    def some(self, of: Callable[[Solved], ArrayLike | None]) -> tuple[Real, list[Any]]:
        """Put numbers that not every group has into the order of the rows: as shown, and as JSON has them."""
        parts = [(of(solved), n) for solved, n in zip(self.solved, self.sizes, strict=True)]
        there = np.repeat([v is not None for v, _ in parts], self.sizes)[self.order].tolist()
        numbers = [np.broadcast_to(np.nan if v is None else np.asarray(v, dtype=float), n) for v, n in parts]
        values = np.concatenate(numbers)[self.order]
        return values, [v if has else ABSENT for v, has in zip(values.tolist(), there, strict=True)]


def masses(b: FieldBalancing, values: Complex, place: str | None = "") -> list[Column]:
    """Return size and angle of masses or unbalances."""
    per, unit = b.runs.per, b.runs.mass_unit
    return [
        number(per, per, np.abs(values), unit, place=place),
        number("angle", "angle", degrees(values), place=place),
    ]


def uncertainties(b: FieldBalancing, along: Real, across: Real) -> list[Column]:
    """Return the standard deviations of size and angle of masses."""
    per, unit = b.runs.per, b.runs.mass_unit
    return [
        number(f"{per}_uncertainty", per, along, unit),
        number("angle_uncertainty", "angle", across),
    ]


def amplitude(b: FieldBalancing, name: str, values: ArrayLike, place: str | None = "") -> Column:
    """Return a quantity in the unit of the readings, which JSON keeps; `place`: its key, if that is not the name."""
    array = np.asarray(values, dtype=float)
    return Column(name, b.runs.amplitude_unit, array, None, name if place == "" else place, array)


def vibration(b: FieldBalancing, value: Complex) -> list[Column]:
    """Return amplitude and phase."""
    return [amplitude(b, "amplitude", np.abs(value)), number("phase", "angle", degrees(value))]


def amplitude_unit(b: FieldBalancing) -> str:
    """The amplitude's unit as people write it."""
    return written(b.runs.amplitude_unit)


def masses_text(b: FieldBalancing, planes: Sequence[str], of: Iterable[complex], spec: str = ".2f") -> str:
    """Write masses in their planes as a sentence has them; those that are zero are left out."""
    return " and ".join(
        f"{b.amount(abs(w)):.6g} {b.unit} at {angle_text(degrees(complex(w)), spec)}° in {plane}"
        for plane, w in zip(planes, of, strict=True)
        if w
    )
