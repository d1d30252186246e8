"""What is computed of rotors whose vibration was measured: corrections, trim, vibration before and after, tolerance."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cli.field.field_balancing import FieldBalancing
from cli.field.runs import Channel, Complex, Real
from cli.field.solution import Solved
from cli.field.trim import Trim
from cli.read.rounding import angle_error, size_error
from dalembert.angles import degrees
from dalembert.results.columns import ABSENT, Column, Table, names, number
from dalembert.results.text import angle_text
from dalembert.units import from_si, written

Tables = dict[str, Callable[[], Table]]

METHOD = (
    "Influence coefficients from trial runs (E. L. Thearle 1934), corrections by least squares or by the smallest largest "
    "residual (T. P. Goodman 1964; second-order cone program), all runs of a log fitted together; tolerance after ISO "
    "21940-11. The masses are at the radius of the trial masses."
)
READINGS = ("rotor", "sensor", "state", "speed_rpm")
"""What names a row that is of a sensor."""


class Rows:
    """The rows of a table that has as many for each rotor of a group: one for each plane, sensor …"""

    def __init__(self, b: FieldBalancing, count: Callable[[Solved], int] = lambda _: 1) -> None:
        self.solved, self.count = b.solved, [count(solved) for solved in b.solved]
        groups = list(zip((solved.group.rotors for solved in b.solved), self.count, strict=True))
        rotor = np.concatenate([np.repeat(of, n) for of, n in groups])
        place = np.concatenate([np.tile(np.arange(n), len(of)) for of, n in groups])
        self.order = np.lexsort((place, rotor))
        several, named = b.runs.several, [b.runs.rotors[r] for r in rotor[self.order].tolist()]
        self.rotor = names("rotor", named)
        self.shown = [self.rotor] if several else []
        """The column of rotors where there are several; else it is of the document alone."""
        self.hidden = [] if several else [self.rotor]

    def numbers(self, of: Callable[[Solved], ArrayLike]) -> NDArray[Any]:
        """Put numbers of the groups, (g, n) each, into the order of the rows."""
        return np.concatenate([np.ravel(of(solved)) for solved in self.solved])[self.order]

    def cells(self, of: Callable[[Solved], Sequence[Any]]) -> list[Any]:
        """Put what the rotors of each group share, n cells, into the order of the rows."""
        every = [cell for solved in self.solved for cell in list(of(solved)) * len(solved.group.rotors)]
        return [every[k] for k in self.order.tolist()]

    def some(self, of: Callable[[Solved], ArrayLike | None]) -> tuple[Real, list[Any]]:
        """Put numbers that not every group has into the order of the rows: as shown, and as JSON has them."""
        tables = [of(solved) for solved in self.solved]
        sizes = [len(solved.group.rotors) * n for solved, n in zip(self.solved, self.count, strict=True)]
        parts = [np.full(n, np.nan) if v is None else np.broadcast_to(v, n) for v, n in zip(tables, sizes, strict=True)]  # fmt: skip
        there = np.repeat([v is not None for v in tables], sizes)[self.order].tolist()
        values = np.concatenate(parts).astype(float)[self.order]
        return values, [v if has else ABSENT for v, has in zip(values.tolist(), there, strict=True)]


def of_planes(b: FieldBalancing) -> tuple[Rows, Column]:
    """Return the rows of tables with one for each plane, and their planes."""
    rows = Rows(b, lambda solved: len(solved.planes))
    return rows, names("plane", rows.cells(lambda solved: solved.planes))


def of_channels(b: FieldBalancing) -> tuple[Rows, list[Column], list[Column]]:
    """Return the rows of tables with one for each sensor, their columns, and those of the document alone."""
    rows = Rows(b, lambda solved: len(solved.group.channels))
    shown, hidden = channels(b, rows.cells(lambda solved: solved.group.channels))
    return rows, [*rows.shown, *shown], [*rows.hidden, *hidden]


def channels(b: FieldBalancing, of: Sequence[Channel]) -> tuple[list[Column], list[Column]]:
    """Return the columns that name sensors, with state and speed where the table has them; and those of JSON alone."""
    states = [channel.state for channel in of]
    # in JSON states stand where speeds do
    speeds = [ABSENT if c.state is not None and c.speed is None else c.speed for c in of]
    shown, hidden = [names("sensor", [channel.sensor for channel in of])], []
    if any(state is not None for state in states):
        stored = [ABSENT if state is None else state for state in states]
        shown.append(Column("state", "", states, None, "state", stored))
    unit = b.runs.speed_unit or "rpm"
    cells = [None if c.speed is None else from_si(c.speed, "speed", unit) for c in of]
    if any(cell is not None for cell in cells):
        shown.append(Column("speed", unit, cells, None, "speed_rad_s", speeds))
    else:
        hidden.append(Column("speed", unit, cells, None, "speed_rad_s", speeds))
    return shown, hidden


def masses(b: FieldBalancing, values: Complex, place: str | None = "") -> list[Column]:
    """Return size and angle of masses or unbalances."""
    per, unit = b.runs.per, b.runs.mass_unit
    return [
        number(per, per, np.abs(values), unit, place=place),
        number("angle", "angle", degrees(values), place=place),
    ]


def amplitude(b: FieldBalancing, name: str, values: ArrayLike, place: str | None = "") -> Column:
    """Return a quantity in the unit of the readings, which JSON keeps; `place`: its key, if that is not the name."""
    array = np.asarray(values, dtype=float)
    return Column(name, b.runs.amplitude_unit, array, None, name if place == "" else place, array)


def phase(name: str, values: Complex, place: str | None = "phase") -> Column:
    """Return the phases of vibrations; none is shown where nothing moves."""
    angle = degrees(values)
    column = number(name, "angle", np.where(values == 0, np.nan, angle), place=place)
    column.stored = angle
    return column


def corrections(b: FieldBalancing, warnings: list[str]) -> Table:
    """One row per rotor and plane. A correction whose error has no bound stays whole, and `warnings` says why."""
    per, unit = b.runs.per, b.runs.mass_unit
    rows, plane = of_planes(b)
    fix = rows.numbers(lambda solved: solved.corrections)
    trim = rows.numbers(lambda solved: solved.trim)

    @cache
    def bounds() -> dict[int, Real]:
        from cli.field.rounding import correction_errors

        return {id(solved): correction_errors(b, solved, warnings) for solved in b.solved}

    @cache
    def fix_bound() -> Real:
        return rows.numbers(lambda solved: bounds()[id(solved)])

    @cache
    def trim_bound() -> Real:
        from cli.field.rounding import trim_errors

        return rows.numbers(lambda solved: trim_errors(solved, bounds()[id(solved)]))

    @cache
    def share() -> Real:
        from cli.field.rounding import uncertainty_share

        return rows.numbers(lambda solved: uncertainty_share(b, solved, bounds()[id(solved)]))

    along, across = (rows.numbers(lambda solved, k=k: solved.uncertainty[k]) for k in (0, 1))  # type: ignore[misc]
    uncertainty = [
        number(f"{per}_uncertainty", per, along, unit, lambda: share() * np.nan_to_num(along)),
        number("angle_uncertainty", "angle", across, error=lambda: share() * np.nan_to_num(across)),
    ]
    columns = [
        rows.rotor,
        plane,
        number(per, per, np.abs(fix), unit, lambda: size_error(fix, fix_bound())),
        number("angle", "angle", degrees(fix), error=lambda: angle_error(fix, fix_bound(), degrees(fix))),
        *(uncertainty if b.uncertain else []),
        number(f"trim_{per}", per, np.abs(trim), unit, lambda: size_error(trim, trim_bound()), place=None),
        number(
            "trim_angle",
            "angle",
            degrees(trim),
            error=lambda: angle_error(trim, trim_bound(), degrees(trim)),
            place=None,
        ),
    ]
    opposite = "or REMOVE the same amounts at the opposite angles (+180°)"
    below = [opposite if fix.any() else "nothing to correct"]
    if not any(solved.standing.any() for solved in b.solved):
        below.append("no mass is on the rotor in its last run: the trim is the correction")
    return Table(
        columns,
        keys=("rotor", "plane"),
        place="rotors[].corrections[]",
        above=conventions(b),
        below="\n".join(below),
        documented=[] if b.uncertain else uncertainty,
    )


def sense(b: FieldBalancing) -> str:
    """Say how phases and mass angles are counted."""
    request = b.request
    lags = request.phase_lag or b.runs.lags
    if request.four_run:
        return "Mass angles as in the table; no phase is used."
    if request.rotation is None and not lags:
        return "Phases and mass angles are counted in one common sense, from one mark on the rotor."
    turning = (
        f"the shaft turns {request.rotation} as seen against +z"
        if request.rotation
        else "phases are counted with the mass angles"
    )
    return (
        f"The instrument's phases {'lag' if lags else 'lead'} ({turning}); all phases given out are counted in the sense of "
        "the mass angles."
    )


def conventions(b: FieldBalancing) -> str:
    """Say how angles and phases are counted and what the corrections mean."""
    amounts = f"{b.runs.per}{'es' if b.runs.per == 'mass' else 's'}"
    radius = "at the radius of the trial masses"
    if b.request.from_here:
        return f"{sense(b)}\nTrim: {amounts} to ADD to the rotor as it stands in its last run, {radius}."
    return (
        f"{sense(b)}\nCorrections: {amounts} to ADD to the rotor in its initial state, all trial masses off, {radius}. "
        "Trim: what to ADD to the rotor as it stands in its last run."
    )


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


def standing(b: FieldBalancing) -> Table:
    """What is on the rotors in their last run, of the document alone: the trim shows it."""
    rows, plane = of_planes(b)
    on = masses(b, rows.numbers(lambda solved: solved.standing))
    return Table([], ("rotor", "plane"), place="rotors[].standing[]", documented=[rows.rotor, plane, *on])


def trim(b: FieldBalancing) -> Table:
    """What to add to the rotors as they stand in their last run, and whether that is needed."""
    rows, plane = of_planes(b)
    trims = {id(solved): Trim(b, solved) for solved in b.solved}
    on = rows.numbers(lambda solved: solved.standing)
    reasons = rows.numbers(lambda solved: np.array(trims[id(solved)].reasons, dtype=object)).tolist()
    along, across = (rows.numbers(lambda solved, of=of: getattr(trims[id(solved)], of)) for of in ("along", "angle"))  # type: ignore[misc]  # fmt: skip
    size, angle = masses(b, rows.numbers(lambda solved: solved.trim))
    run = rows.numbers(lambda s: np.repeat(np.array(s.group.last, dtype=object), len(s.planes))).tolist()
    uncertainty = [
        number(f"{b.runs.per}_uncertainty", b.runs.per, along, b.runs.mass_unit),
        number("angle_uncertainty", "angle", across),
    ]
    finite = bool(np.isfinite(along).any())
    needed = Column("needed", "", ["no" if why else "yes" for why in reasons], None, "needed", [not why for why in reasons])  # fmt: skip
    stands = [
        names("last_run", run, place=None),
        *(replace(c, name=f"standing_{c.name}", place=None) for c in masses(b, on)),
    ]
    columns = [*rows.shown, plane, *stands, size, angle, *(uncertainty if finite else []), needed]
    if any(reasons):
        columns.append(names("reason", reasons, place=None))
    hidden = [*rows.hidden, *([] if finite else uncertainty)]
    above = "what to ADD to the rotor as it stands in its last run"
    if not on.any():
        # nothing to show: the trim is the correction
        columns, hidden = [], [*columns, *hidden]
    return Table(columns, ("rotor", "plane"), "rotors[].trim[]", above, documented=hidden)


def prediction(b: FieldBalancing) -> Table:
    """The vibration before, and as predicted with the corrections: a row for each rotor and sensor."""
    rows, named, hidden = of_channels(b)
    before, after = (rows.numbers(lambda s, of=of: getattr(s, of)) for of in ("initial", "residual"))  # type: ignore[misc]
    columns = [
        *named,
        amplitude(b, "before_amplitude", np.abs(before), None),
        phase("before_phase", before, None),
        amplitude(b, "predicted_amplitude", np.abs(after), "amplitude"),
        phase("predicted_phase", after),
    ]
    columns[-3].values = degrees(before)
    if b.request.four_run:
        columns = [column for column in columns if not column.name.endswith("_phase")]
        hidden.append(Column("phase", "deg", [None] * len(after), None, "phase_deg"))
    if b.runs.fitted:
        deviation = rows.numbers(lambda s: s.fitted.vibration_deviation(s.total))
        spread = [amplitude(b, "amplitude_uncertainty", deviation)]
        ceiling = b.ceiling
        if ceiling is not None:
            chance = rows.numbers(lambda s: s.fitted.probability_within(ceiling))
            spread.append(number("probability_within", "number", chance))
        finite = bool(np.isfinite(deviation).any())
        (columns if finite else hidden).extend(spread)
    above = "vibration before, and as predicted with the corrections"
    return Table(columns, READINGS, "rotors[].residual[]", above, documented=hidden)


def rotors(b: FieldBalancing, further: Sequence[Column] = ()) -> Table:
    """One row per rotor: how large the vibration is before and after, how sure that is; `further` columns are JSON's."""
    rows, request = Rows(b), b.request
    initial, largest = (
        rows.numbers(lambda s, of=of: np.abs(getattr(s, of)).max(axis=1))  # type: ignore[misc]
        for of in ("initial", "residual")
    )

    def rms(solved: Solved) -> Real:
        size = np.abs(solved.residual)
        most = size.max(axis=1, keepdims=True)
        mean = np.square(size / np.where(most > 0, most, 1.0)).mean(axis=1)
        return np.asarray(most[:, 0] * np.sqrt(mean))

    columns = [
        rows.rotor,
        amplitude(b, "initial_max", initial),
        amplitude(b, "residual_max", largest),
        amplitude(b, "residual_rms", rows.numbers(rms)),
    ]
    below = []

    def some(name: str, of: Callable[[Solved], ArrayLike | None], place: str = "", unit: str = "") -> bool:
        values, stored = rows.some(of)
        if all(v is ABSENT for v in stored):
            return False
        columns.append(Column(name, unit, values, None, place or name, stored))
        return True

    vibration = b.runs.amplitude_unit
    if some("residual_bound", lambda s: s.bound, unit=vibration):
        below.append("residual_bound: the smallest possible largest residual, by the dual problem")
    if some("residual_max_95", lambda s: s.residual_95, unit=vibration):
        below.append(
            f"residual_max_95: the largest residual stays below it in 95 % of cases, with {_errors(b)}"
        )
    columns.append(number("condition_number", "number", rows.numbers(lambda s: s.condition)))
    repeated: dict[str, tuple[Callable[[Solved], ArrayLike], str]] = {
        "readings": (lambda s: s.group.counts[s.group.counts > 1].sum(), ""),
        "degrees_of_freedom": (lambda s: s.group.repeats, ""),
        "reading_sd": (lambda s: s.group.reading_sd, vibration),
    }
    for name, (of, unit) in repeated.items():
        key = f"repeats.{name}"
        if some(f"repeated_{name}", lambda s, of=of: of(s) if s.group.repeats else None, key, unit):  # type: ignore[misc]
            columns[-1].stored = [
                v if v is ABSENT or name == "reading_sd" else int(v) for v in columns[-1].stored
            ]
    documented = [names("objective", [request.objective] * len(initial))]
    if request.tolerance is not None:
        grade, permissible = request.tolerance.grade, request.tolerance.permissible
        documented += [
            names("grade", [grade] * len(initial), "tolerance.grade"),
            number("permissible", "unbalance", [permissible] * len(initial), place="tolerance.permissible"),
        ]
    documented += further
    return Table(columns, ("rotor",), "rotors[]", below="\n".join(below), documented=documented)


def _errors(b: FieldBalancing) -> str:
    """Say which errors of the readings the uncertainties are of."""
    scatter = any(solved.group.reading_sd.any() for solved in b.solved)
    if b.request.reading_error is not None:
        relative, angle = b.request.reading_error
        stated = (
            f"reading errors of {100 * relative:.3g} % and {np.degrees(angle):.3g}° (one standard deviation)"
        )
        return f"{stated}, or as the repeats scatter where that is more" if scatter else stated
    if b.runs.fitted:
        left = any((s.fit.degrees_of_freedom > 0).any() for s in b.solved)
        return f"reading errors as the {'residuals of the fit' if left else 'readings behind the coefficients'} scatter"
    return "reading errors as the repeats scatter"


def split(b: FieldBalancing) -> Table:
    """The corrections on the places there are: a row for each mass."""
    return _split(b, lambda solved: solved.corrections, "corrections")


def trim_split(b: FieldBalancing) -> Table:
    """The trims on the places there are: a row for each mass."""
    table = _split(b, lambda solved: solved.trim, "trim")
    if any(solved.standing.any() for solved in b.solved):
        return table
    return replace(table, columns=[], documented=[*table.columns, *table.documented])


def _split(b: FieldBalancing, of: Callable[[Solved], Complex], name: str) -> Table:
    rows = [
        (rotor, plane, position, angle, mass)
        for rotor, (_, solved, i) in zip(b.runs.rotors, b.each(), strict=True)
        for plane, w in zip(solved.planes, of(solved)[i].tolist(), strict=True)
        for position, angle, mass in b.split(w)
    ]
    rotors, planes, positions, angles, parts = zip(*rows, strict=True) if rows else ((),) * 5
    rotor = [names("rotor", rotors)]
    columns = [
        *(rotor if b.runs.several else []),
        names("plane", planes),
        names("position", positions),
        number(b.runs.per, b.runs.per, parts, b.runs.mass_unit),
        number("angle", "angle", angles),
    ]
    hidden = [] if b.runs.several else rotor
    return Table(columns, ("rotor", "plane", "position"), f"rotors[].{name}[].split[]", documented=hidden)


def misfit(b: FieldBalancing) -> Table:
    """Of the four-run method: how far the amplitudes of each sensor are from any vector's."""
    rows = Rows(b, lambda solved: len(solved.group.channels) * len(solved.planes))
    off = rows.numbers(lambda solved: [[fit.misfit for fit in one] for one in solved.fits])
    sensor = names("sensor", rows.cells(lambda s: [c.sensor for c in s.group.channels] * len(s.planes)))
    plane = names("plane", rows.cells(lambda s: [name for name in s.planes for _ in s.group.channels]))
    planes = [plane] if any(len(solved.planes) > 1 for solved in b.solved) else []
    above = "r.m.s. misfit of the amplitudes"
    columns = [*rows.shown, sensor, *planes, amplitude(b, "amplitude", off)]
    keys = ("rotor", "sensor", *(column.name for column in planes))
    return Table(columns, keys, "rotors[].misfit[]", above, documented=rows.hidden)


def alternatives(b: FieldBalancing) -> Table:
    """Of the four-run method: the other corrections that fit the amplitudes as well."""
    of = [
        (rotor, solved.planes[0], -v / a)
        for rotor, (_, solved, i) in zip(b.runs.rotors, b.each(), strict=True)
        for v, a in zip(solved.group.initial[i], solved.fits[i][0].other, strict=True)
        if a == a
    ]
    rotor = [names("rotor", [one[0] for one in of])]
    columns = [
        *(rotor if b.runs.several else []),
        names("plane", [one[1] for one in of]),
        *masses(b, np.array([one[2] for one in of], dtype=complex)),
    ]
    hidden = [] if b.runs.several else rotor
    return Table(columns, ("rotor", "plane"), "rotors[].alternatives[]", documented=hidden)


def static_couple(b: FieldBalancing, part: int) -> Table:
    """The static part of two corrections, (A + B)/2 in each plane, or the couple, (A − B)/2 in the first plane."""
    rows, sign = Rows(b), (1, -1)[part]
    half = rows.numbers(lambda s: (s.corrections[:, 0] + sign * s.corrections[:, 1]) / 2)
    above = ("to ADD in each of both planes", "to ADD in the first plane, and its opposite in the second")[
        part
    ]
    place = f"rotors[].static_couple.{('static', 'couple')[part]}"
    return Table([*rows.shown, *masses(b, half)], ("rotor",), place, above, documented=rows.hidden)
