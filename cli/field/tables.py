"""The tables of what to add: corrections with their digits, trims, splits, tolerance; and the rows that tables have of rotors."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from balancing import Balance, LogBalance
from balancing.runs.runs import Channel, Complex, Real
from cli.field.field_balancing import FieldBalancing, Solved
from cli.field.fit import exact_errors, exact_fit
from cli.field.remarks import conventions
from cli.field.rotor import Rotor, Trim, each
from dalembert.angles import degrees
from dalembert.arithmetic.shapes import in_32_digits
from dalembert.results.columns import ABSENT, Column, Table, names, number
from dalembert.results.text import angle_text
from dalembert.units import from_si, written

if TYPE_CHECKING:
    from dalembert.arithmetic.doubled import Doubled
    from dalembert.arithmetic.doubled_arrays import DoubledArray, Vectors

Tables = dict[str, Callable[[], Table]]

READINGS = ("rotor", "sensor", "state", "speed_rpm")
"""The keys of a row of a sensor."""


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
        """Put several arrays of numbers into the order of the rows."""
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


def masses(b: FieldBalancing, values: Complex) -> list[Column]:
    """Return size and angle of masses or unbalances."""
    per, unit = b.runs.per, b.runs.mass_unit
    return [
        number(per, per, np.abs(values), unit),
        number("angle", "angle", degrees(values)),
    ]


def uncertainties(
    b: FieldBalancing, along: Real, across: Real, *exact: Callable[[], Doubled]
) -> list[Column]:
    """Return the standard deviations of size and angle of masses; `exact`: in 32 digits."""
    per, again = b.runs.per, exact or (None, None)
    return [
        number(f"{per}_uncertainty", per, along, b.runs.mass_unit, exact=again[0]),
        number("angle_uncertainty", "angle", across, exact=again[1]),
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


def corrections(b: FieldBalancing, warnings: list[str]) -> Table:
    """One row per rotor and plane. With --digits a correction without an estimate of its error stays whole; `warnings` takes the reason."""
    per, unit, rows = b.runs.per, b.runs.mass_unit, Rows.planes(b)
    fix, trim = (rows.numbers(lambda s: s.corrections), rows.numbers(lambda s: s.trim))

    again = cache(lambda: rows.several(lambda solved: digits(b, solved, warnings)))

    def doubled(k: int) -> Doubled:
        from dalembert.arithmetic.doubled import Doubled

        return Doubled(*again()[2 * k : 2 * k + 2])

    def exact(k: int) -> Vectors:
        from dalembert.arithmetic.doubled_arrays import Vectors

        return Vectors(doubled(2 * k), doubled(2 * k + 1))

    def sized(name: str, values: Complex, k: int, place: str | None) -> list[Column]:
        size, angle = np.abs(values), degrees(values)
        return [
            number(f"{name}{per}", per, size, unit, None, place, exact=lambda: exact(k).size),
            number(f"{name}angle", "angle", angle, "", lambda: exact(k).turned(values), place),
        ]

    along, across = rows.several(lambda s: s.uncertainty(s.corrections))
    uncertainty = uncertainties(b, along, across, lambda: doubled(4), lambda: doubled(5))
    columns = [*sized("", fix, 0, ""), *sized("trim_", trim, 1, None)]
    columns[2:2] = uncertainty if b.uncertain else []
    opposite = "or REMOVE the same amounts at the opposite angles (+180°)"
    below = [opposite if fix.any() else "nothing to correct"]
    if not any(solved.standing.any() for solved in b.solved):
        below.append("no mass is on the rotor in its last run: the trim is the correction")
    # the CSV has the rotor always
    rows.shown, rows.hidden = [rows.rotor, rows.shown[-1]], []
    hidden = [] if b.uncertain else uncertainty
    return rows.table(
        columns, ("rotor", "plane"), "corrections[]", conventions(b), "\n".join(below), hidden=hidden
    )


class SecondRun:
    """The second run of a group, in 32 digits."""

    def __init__(self, balancing: FieldBalancing, solved: Solved) -> None:
        self.balancing, self.solved, self.group = balancing, solved, solved.group
        self.raw = exact_fit(solved.group, balancing.runs, balancing.request, balancing.stored)
        self.fit = self.raw.without(self._runout())
        self.standing = self.group.in_32_digits.standing

    def _runout(self) -> Any:
        """The run-out of each channel, (g, s)."""
        from dalembert.arithmetic.doubled_arrays import Vectors

        runout, exact = Vectors.of(self.balancing.runout(self.group)), self.balancing.runs.exact_runout
        if exact is not None:
            vectors, sign = exact(), np.where(self.balancing.against(self.group), -1.0, 1.0)
            for s, channel in enumerate(self.group.channels):
                if channel.sensor in vectors:
                    read = vectors[channel.sensor]
                    runout[:, s] = Vectors(read.x + 0.0 * sign, read.y * sign)
        return runout

    @property
    def initial(self) -> Vectors:
        """The vibration without masses, run-out off, (g, s)."""
        return cast("Vectors", self.fit.initial)

    @cached_property
    def here(self) -> Vectors:
        """The vibration where the corrections start from, (g, s)."""
        if not self.solved.start.any():
            return self.initial
        return self.initial + (self.alpha * self.standing[:, None, :]).sum()

    @property
    def alpha(self) -> Vectors:
        """The influence coefficients, (g, s, p)."""
        return cast("Vectors", self.fit.influence)

    @property
    def ridge(self) -> Doubled:
        """That of the option, as it is written."""
        from dalembert.tables.exact import writtens

        return writtens(self.solved.objective.ridge)

    def corrections(self, warnings: list[str]) -> Vectors:
        """Return the corrections, (g, p); NaN where they are not determined, `warnings` takes the reason."""
        solved, group, objective = self.solved, self.group, self.solved.objective
        whole = Balance(solved.alpha, solved.here, solved.corrections, group.weights, ridge=objective.ridge)
        if not objective.limited:
            exact, _ = whole.second_run(self.alpha, self.here, self.ridge)
            assert exact is not None
            return exact
        from dalembert.arithmetic.doubled_arrays import Vectors

        result = Vectors.of(np.full(solved.corrections.shape, complex(np.nan, np.nan)))
        ceiling = None if objective.max_residual is None or objective.minimax else objective.max_residual
        for i in range(len(solved.corrections)):
            one = replace(
                whole,
                influence=solved.alpha[i],
                initial=solved.here[i],
                corrections=solved.corrections[i],
                weights=group.own_weights(i),
                bound=None if solved.bound is None else float(solved.bound[i]),
                of_largest=solved.bound is not None,
                max_mass=objective.max_mass,
                max_residual=None if ceiling is None else np.full(solved.here.shape[-1], ceiling),
            )
            exact, reason = one.second_run(self.alpha[i], self.here[i])
            if exact is not None:
                result[i] = exact
            else:
                warnings.append(
                    f"{self.balancing.of(group, i)}--digits: the corrections are printed in full, without an "
                    f"estimate of their error: {reason}"
                )
        return result

    def deviations(self, corrections: Vectors) -> tuple[DoubledArray, DoubledArray]:
        """Return the deviations of size and angle (degrees) of the corrections, (g, p), to first order."""
        from dalembert.arithmetic.doubled_arrays import DoubledArray

        solved, group = self.solved, self.group
        whole = corrections + self.standing if solved.start.any() else corrections
        weights = None if group.weights is None else in_32_digits(group.weights)
        errors = exact_errors(group, self.balancing.request, self.raw)
        numbers: Any = self.fit, whole, errors, weights, corrections, DoubledArray.of(self.ridge)
        along, across = LogBalance(*numbers).deviations
        size = np.abs(cast("Any", corrections))
        return along, across / np.where(size > 0, size, np.nan) * 180.0 / np.pi  # type: ignore[return-value]


def digits(balancing: FieldBalancing, solved: Solved, warnings: list[str]) -> list[Real]:
    """Return corrections, trims (four numbers each) and the deviations of corrections (two each) in 32 digits; NaN where unknown."""
    from dalembert.arithmetic.doubled import Doubled

    run = SecondRun(balancing, solved)
    corrections = run.corrections(warnings)
    trim = corrections if solved.start.any() else corrections - run.standing
    deviations: Any = (Doubled(np.full(solved.corrections.shape, np.nan)),) * 2
    if solved.drawn:
        sentence = "--digits: the uncertainties from drawn readings are printed in full: their rounding error is not known"
        warnings += [sentence] if sentence not in warnings else []
    elif solved.covariance is not None:
        deviations = run.deviations(corrections)
    numbers = [corrections.x, corrections.y, trim.x, trim.y, *deviations]
    return [np.broadcast_to(part, solved.corrections.shape) for x in numbers for part in (x.high, x.low)]


def standing(b: FieldBalancing) -> Table:
    """The masses on the rotors in their last run, for JSON alone: the trim shows it."""
    rows = Rows.planes(b)
    on = masses(b, rows.numbers(lambda solved: solved.standing))
    return rows.table(on, ("rotor", "plane"), "standing[]", shown=False)


def trim(b: FieldBalancing) -> Table:
    """The masses to add to the rotors as they stand in their last run, and whether they are needed."""
    rows, of_group = Rows.planes(b), cache(lambda solved: Trim(b, solved))
    on = rows.numbers(lambda solved: solved.standing)
    reasons = rows.numbers(lambda solved: np.array(of_group(solved).reasons, dtype=object)).tolist()
    run = rows.numbers(lambda s: np.repeat(np.array(s.group.last, dtype=object), len(s.planes))).tolist()
    along, across = rows.several(lambda solved: (of_group(solved).along, of_group(solved).angle))
    uncertainty, finite = uncertainties(b, along, across), bool(np.isfinite(along).any())
    needed = [not why for why in reasons]
    columns = [
        names("last_run", run, place=None),
        *(replace(c, name=f"standing_{c.name}", place=None) for c in masses(b, on)),
        *masses(b, rows.numbers(lambda solved: solved.trim)),
        *(uncertainty if finite else []),
        Column("needed", "", ["yes" if one else "no" for one in needed], None, "needed", needed),
    ]
    if any(reasons):
        columns.append(names("reason", reasons, place=None))
    above = "what to ADD to the rotor as it stands in its last run"
    hidden = [] if finite else uncertainty
    # with nothing on the rotor there is nothing to show: the trim is the correction
    return rows.table(columns, ("rotor", "plane"), "trim[]", above, hidden=hidden, shown=bool(on.any()))


def rotors(b: FieldBalancing, further: Sequence[Column] = ()) -> Table:
    """One row per rotor: how large the vibration is before and after, how sure that is; `further` columns are JSON's."""
    rows, request, unit = Rows.each(b), b.request, b.runs.amplitude_unit

    def largest(solved: Solved) -> Iterable[Real]:
        before, after = np.abs(solved.initial), np.abs(solved.residual)
        most = after.max(axis=1, keepdims=True)
        mean = np.square(after / np.where(most > 0, most, 1.0)).mean(axis=1)
        return before.max(axis=1), most[:, 0], most[:, 0] * np.sqrt(mean)

    of = ("initial_max", "residual_max", "residual_rms")
    columns = [amplitude(b, name, values) for name, values in zip(of, rows.several(largest), strict=True)]
    below = []

    def some(name: str, of: Callable[[Solved], ArrayLike | None], place: str = "", unit: str = unit) -> bool:
        values, stored = rows.some(of)
        if all(v is ABSENT for v in stored):
            return False
        if place and not unit:
            stored = [v if v is ABSENT else int(v) for v in stored]
        columns.append(Column(name, unit, values, None, place or name, stored))
        return True

    if some("residual_bound", lambda s: s.bound):
        below.append("residual_bound: the smallest possible largest residual, by the dual problem")
    if some("residual_max_95", lambda s: s.residual_95):
        below.append(
            f"residual_max_95: the largest residual stays below it in 95 % of cases, with {_errors(b)}"
        )
    columns.append(number("condition_number", "number", rows.numbers(lambda s: s.condition)))

    hidden = [names("objective", [request.objective] * len(b.runs.rotors))]
    if request.tolerance is not None:
        grade, permissible = request.tolerance.grade, request.tolerance.permissible
        many = len(b.runs.rotors)
        hidden += [
            names("grade", [grade] * many, "tolerance.grade"),
            number("permissible", "unbalance", [permissible] * many, place="tolerance.permissible"),
        ]
    table = Table([rows.rotor, *columns], ("rotor",), "rotors[]", below="\n".join(below))
    return replace(table, documented=[*hidden, *further])


def _errors(b: FieldBalancing) -> str:
    """Name the errors of the readings that the uncertainties are of."""
    if b.request.reading_error is not None:
        relative, angle = b.request.reading_error
        return (
            f"reading errors of {100 * relative:.3g} % and {np.degrees(angle):.3g}° (one standard deviation)"
        )
    left = any((s.group.fit.degrees_of_freedom > 0).any() for s in b.solved)
    return f"reading errors as the {'residuals of the fit' if left else 'readings behind the coefficients'} scatter"


def split(b: FieldBalancing, of: Callable[[Rotor], Complex], name: str, *, shown: bool = True) -> Table:
    """The corrections, or the trims, on the places there are: a row for each mass."""
    every = [
        (rotor.name, plane, *part)
        for rotor in each(b)
        for plane, w in zip(rotor.planes, of(rotor)[rotor.i].tolist(), strict=True)
        for part in b.split(w)
    ]
    rotors, planes, positions, angles, parts = zip(*every, strict=True) if every else ((),) * 5
    columns = [
        names("plane", planes),
        names("position", positions),
        number(b.runs.per, b.runs.per, parts, b.runs.mass_unit),
        number("angle", "angle", angles),
    ]
    keys = ("rotor", "plane", "position")
    return Rows.of(b, rotors).table(columns, keys, f"{name}[].split[]", shown=shown)


def tolerance(b: FieldBalancing) -> Table:
    """One row per rotor and plane: what is permissible, what the unbalance was, what is predicted."""
    from cli.read.rotor_options import verdict_table

    limit = b.request.tolerance
    assert limit is not None
    unit = b.runs.unbalance_unit
    table = verdict_table([(rotor.name, v) for rotor in each(b) for v in rotor.verdicts()], unit)
    named = f"{limit.grade}: " if limit.grade else ""
    return replace(table, above=f"{named}U_per = {limit.text(unit)}, {limit.sharing}; residual as predicted")


def static_couple(b: FieldBalancing, part: int) -> Table:
    """The static part of two corrections, (A + B)/2 in each plane, or the couple, (A − B)/2 in the first plane."""
    rows, sign = Rows.each(b), (1, -1)[part]
    half = rows.numbers(lambda s: (s.corrections[:, 0] + sign * s.corrections[:, 1]) / 2)
    above = ("to ADD in each of both planes", "to ADD in the first plane, and its opposite in the second")
    return rows.table(masses(b, half), ("rotor",), f"static_couple.{('static', 'couple')[part]}", above[part])
