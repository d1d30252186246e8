"""Which inputs are asked for: `--at`, `--sweep`, `--inputs`, or what the file itself says."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from cli.errors import DataError, nearest
from cli.read import options
from cli.read.units import UNITS, is_number, parse_number, parse_quantity, read_degrees, to_si
from virtualwork.describe.units import scaled, unit

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from virtualwork import Mechanism

    Reals = NDArray[np.float64]

# poses in one sweep: beyond it a double cannot count them; `Analysis.check_size` knows what one takes in memory
MOST = 10**15


@dataclass(frozen=True)
class Inputs:
    """The inputs of every pose, in SI and as they are shown (degrees or metres), and their rates where a table gives them."""

    values: Reals  # (n, k)
    shown: Reals  # (n, k), deg or m
    speed: Reals | None = None
    acceleration: Reals | None = None
    steps: list[str] = field(default_factory=list)

    # whether the values are given one by one
    listed = True

    @property
    def n(self) -> int:
        """How many poses."""
        return len(self.shown)

    @property
    def span(self) -> tuple[float, float]:
        """The least and the largest value of the first input."""
        return float(self.values[:, 0].min()), float(self.values[:, 0].max())

    def part(self, low: int, high: int) -> Inputs:
        """The poses from low to high."""
        speed, acceleration = (None if r is None else r[low:high] for r in (self.speed, self.acceleration))
        return Inputs(self.values[low:high], self.shown[low:high], speed, acceleration, self.steps[low:high])


@dataclass(frozen=True)
class Sweep:
    """A sweep of one input: the poses are formed when they are asked for, a part at a time where they are many."""

    mechanism: Mechanism
    swept: int
    rest: list[float]
    at: Callable[[Reals], Reals]
    n: int
    last: float
    speed: None = None
    acceleration: None = None
    listed = False

    @property
    def span(self) -> tuple[float, float]:
        """The least and the largest value of the first input."""
        ends = [float(self.part(i, i + 1).values[0, 0]) for i in (0, self.n - 1)]
        return min(ends), max(ends)

    def part(self, low: int, high: int) -> Inputs:
        """The poses from low to high, or to the last."""
        high = min(high, self.n)
        shown = np.tile(np.array(self.rest, dtype=float), (high - low, 1))
        shown[:, self.swept] = self.at(np.arange(low, high, dtype=float))
        if high == self.n:
            shown[-1, self.swept] = self.last
        return replace(_inputs(self.mechanism, shown), steps=[str(i) for i in range(low + 1, high + 1)])

    @cached_property
    def _whole(self) -> Inputs:
        return self.part(0, self.n)

    @property
    def values(self) -> Reals:
        """The inputs in SI, (n, k)."""
        return self._whole.values

    @property
    def shown(self) -> Reals:
        """The inputs as they are shown, degrees or metres, (n, k)."""
        return self._whole.shown

    @property
    def steps(self) -> list[str]:
        """The poses' names."""
        return self._whole.steps


def wanted(
    m: Mechanism,
    at: list[str] | None,
    sweep: str | None,
    table: str | None,
    bare: Mapping[str, str] | None = None,
) -> Inputs | Sweep:
    """The inputs that the options ask for; `bare`: the units of bare lengths and angles, as the file's `[units]` say."""
    bare = bare or {}
    if sum(x is not None for x in (sweep, table)) > 1 or (at and table):
        raise options.bad("--inputs", "expected one of --at, --sweep and --inputs")
    if table is not None:
        return _from_table(m, table)
    if sweep is not None:
        return _sweep(m, sweep, at, bare)
    if at:
        rows = [_at(m, text, bare) for text in at]
        return _inputs(m, np.array(rows, dtype=float))
    if any(e.history for e in m.inputs):
        return _from_history(m)
    return _as_shown(m, np.array([_home(m)]))


def _home(m: Mechanism) -> list[float]:
    """The file's own pose: each input's value, else the guess's."""
    return [at if e.value is None else e.value for e, at in zip(m.inputs, m.at, strict=True)]


def _shown(m: Mechanism, j: int, value: float) -> float:
    return value if m.inputs[j].is_slide else read_degrees(value)


def _inputs(m: Mechanism, shown: Reals) -> Inputs:
    values = shown.copy()
    for j, e in enumerate(m.inputs):
        if not e.is_slide:
            values[:, j] = np.radians(shown[:, j])
    return Inputs(values, shown, steps=[str(i) for i in range(1, len(shown) + 1)])


def _as_shown(
    m: Mechanism, q: Reals, speed: Reals | None = None, acceleration: Reals | None = None
) -> Inputs:
    """Inputs that are given in SI."""
    shown = np.array([[_shown(m, j, v) for j, v in enumerate(row)] for row in q])
    return Inputs(q, shown, speed, acceleration, [str(i) for i in range(1, len(q) + 1)])


def _quantity(m: Mechanism, j: int, text: str, flag: str, bare: Mapping[str, str]) -> float:
    """One input's value, in degrees or metres."""
    return place_or_angle(text, "length" if m.inputs[j].is_slide else "angle", flag, bare)


def place_or_angle(text: str, kind: str, flag: str, bare: Mapping[str, str]) -> float:
    """A length in metres, or an angle in degrees: those of an angle in degrees stay as they are written."""
    named = bare.get(kind)
    if named is not None and is_number(text):
        factor = unit(named)
        if named in ("deg", "°"):
            return parse_number(text)
        si = scaled(text.strip(), factor[0] if factor else 1.0)
        return si if kind == "length" else read_degrees(si)
    try:
        value, given = parse_quantity(text, kind)
    except ValueError as error:
        raise options.bad(flag, error) from None
    if kind == "length":
        return float(to_si(value, "length", given))
    return value if given == "deg" else read_degrees(value)


def _named(m: Mechanism, text: str, flag: str) -> dict[int, str]:
    """`crank=60deg,arm=30deg` by input; a bare value is the only input's."""
    names = [e.name for e in m.inputs]
    found: dict[int, str] = {}
    for part in text.split(","):
        name, equals, value = part.partition("=")
        if not equals:
            if len(names) > 1:
                raise options.bad(
                    flag, f"'{text}': expected a value for each input, such as {names[0]}=...,{names[1]}=..."
                )
            name, value = names[0], part
        if name.strip() not in names:
            raise options.bad(
                flag,
                f"'{text}': no input drives '{name.strip()}': expected {', '.join(names)}{nearest(name, names)}",
            )
        j = names.index(name.strip())
        if j in found:
            raise options.bad(flag, f"'{text}': {name.strip()} is given twice")
        found[j] = value.strip()
    return found


def until_inputs(m: Mechanism, text: str, bare: Mapping[str, str]) -> dict[str, float]:
    """The inputs' values that `--until` names, in SI."""
    found = {}
    for j, value in _named(m, text, "--until").items():
        shown = _quantity(m, j, value, "--until", bare)
        found[m.inputs[j].name] = shown if m.inputs[j].is_slide else math.radians(shown)
    return found


def _at(m: Mechanism, text: str, bare: Mapping[str, str]) -> list[float]:
    given = _named(m, text, "--at")
    home = _home(m)
    return [
        _quantity(m, j, given[j], "--at", bare) if j in given else _shown(m, j, home[j])
        for j in range(len(m.inputs))
    ]


def _sweep(m: Mechanism, text: str, at: list[str] | None, bare: Mapping[str, str]) -> Sweep:
    """`0deg:360deg:1deg` or `0deg:360deg/3600`; with several inputs one is swept by name and the others held."""
    (j, span), *more = _named(m, text, "--sweep").items()
    if more:
        raise options.bad(
            "--sweep",
            f"'{text}': one input can be swept; hold the others with --at, or use --inputs FILE.csv",
        )
    if at and len(m.inputs) == 1:
        raise options.bad("--sweep", "expected --at or --sweep, not both")
    body, slash, count = span.partition("/")
    parts = body.split(":")
    if len(parts) != (2 if slash else 3):
        raise options.bad(
            "--sweep", f"'{span}': expected START:STOP:STEP or START:STOP/COUNT, such as 0deg:360deg:1deg"
        )
    start, stop = (_quantity(m, j, part, "--sweep", bare) for part in parts[:2])
    last = None
    if slash:
        n = options.whole(count)
        if not 1 <= n <= MOST:
            raise options.bad(
                "--sweep", f"'{span}': expected a whole number of steps from 1 to {MOST} after the /"
            )
        last = stop

        def values(i: Reals) -> Reals:
            return np.asarray(start + (stop - start) * (i / n))

    else:
        step = _quantity(m, j, parts[2], "--sweep", bare)
        if step == 0 or (stop - start) / step < 0:
            raise options.bad(
                "--sweep", f"'{span}': a step of {parts[2]} does not lead from {parts[0]} to {parts[1]}"
            )
        ratio = (stop - start) / step
        if ratio > MOST:
            raise options.bad("--sweep", f"'{span}': more than {MOST} poses")
        n = round(ratio) if abs(ratio - round(ratio)) <= 1e-9 * max(1.0, ratio) else math.floor(ratio)
        if abs(n - ratio) <= 1e-9 * max(1.0, ratio):
            last = stop

        def values(i: Reals) -> Reals:
            return np.asarray(start + step * i)

    rest = _at(m, at[0], bare) if at else [_shown(m, i, value) for i, value in enumerate(_home(m))]
    end = float(values(np.array([float(n)]))[0]) if last is None else last
    return Sweep(m, j, rest, values, n + 1, end)


def _from_table(m: Mechanism, path: str) -> Inputs:
    """A CSV with a column for each input (`crank_deg`, `B_mm`), perhaps `time_s`, `crank_speed_rad_s`, ..."""
    from cli.read.tables import read

    numbers = {"time": "time"}
    names = {e.name: e for e in m.inputs}
    for e in m.inputs:
        numbers[e.name.lower()] = "length" if e.is_slide else "angle"
    for e in m.inputs:
        numbers[f"{e.name.lower()}_speed"] = "velocity" if e.is_slide else "speed"
        numbers[f"{e.name.lower()}_acceleration"] = "acceleration" if e.is_slide else "angular acceleration"
    table = read(path, numbers=numbers, texts=("step",))
    si = {key: c.si for key, c in table.numbers.items()}
    shown, values = [], []
    for name, e in names.items():
        key = name.lower()
        if key not in si:
            units = " or ".join(f"{name}_{u}" for u in list(UNITS[numbers[key]])[:2])
            raise DataError(f"{path}: no column {units} for the input '{name}' {table.told}")
        given = table.numbers[key]
        values.append(si[key])
        in_degrees = given.values if given.unit == "deg" else np.degrees(si[key])
        shown.append(si[key] if e.is_slide else in_degrees)
    q = np.array(values).T
    rates: list[Reals | None] = []
    for kind in ("speed", "acceleration"):
        of = [si.get(f"{name.lower()}_{kind}") for name in names]
        none = all(rate is None for rate in of)
        rates.append(None if none else np.stack([np.zeros(len(q)) if r is None else r for r in of], axis=1))
    if "time" in si and rates[0] is None:
        rates = list(_rates_of(path, si["time"], q))
    steps = table.texts.get("step") or [str(i) for i in range(1, len(q) + 1)]
    return Inputs(q, np.array(shown).T, rates[0], rates[1], steps)


def _rates_of(path: str, time: Reals, q: Reals) -> tuple[Reals, Reals]:
    """Speed and acceleration of a law given as a table over time: those of the cubic spline through it."""
    if len(time) < 4 or not (np.diff(time) > 0).all():
        raise DataError(
            f"{path}: time_s: expected at least 4 rows with rising time, for the speeds of the law of motion"
        )
    from scipy.interpolate import CubicSpline

    with np.errstate(all="ignore"):
        try:
            spline = CubicSpline(time, q, axis=0)
            speed, acceleration = spline(time, 1), spline(time, 2)
        except (ValueError, np.linalg.LinAlgError):
            speed = acceleration = np.array([np.nan])
    if not (np.isfinite(speed).all() and np.isfinite(acceleration).all()):
        raise DataError(f"{path}: time_s: rows too close in time for the speeds of the law of motion")
    return speed, acceleration


def _from_history(m: Mechanism) -> Inputs:
    """Inputs whose law of motion is a table in the file."""
    laws = [np.array(e.history) if e.history else None for e in m.inputs]
    first = next(law for law in laws if law is not None)
    time = first[:, 0]
    home = _home(m)
    q = np.empty((len(time), len(laws)))
    for j, law in enumerate(laws):
        if law is None:
            q[:, j] = home[j]
        elif np.array_equal(law[:, 0], time):
            q[:, j] = law[:, 1]
        else:
            raise DataError("[[input]] law: the tables of several inputs must have the same times")
    speed, acceleration = _rates_of("[input] law", time, q)
    return _as_shown(m, q, speed, acceleration)
