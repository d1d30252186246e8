"""The tables of a balancing in the field: corrections, trim, vibration before and after, tolerance, zones, coefficients."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from cli.field.field_balancing import FieldBalancing, Solved
from cli.field.rotor import READINGS, Rotor, Rows, Tables, Trim, amplitude, each, masses, uncertainties
from cli.read.runs.runs import Complex, Real
from dalembert.angles import degrees
from dalembert.results.columns import ABSENT, Column, Table, names, number
from dalembert.units import amplitude_kind, from_si, to_si

if TYPE_CHECKING:
    from dalembert.arithmetic.doubled_vectors import Vectors

METHOD = (
    "Influence coefficients from trial runs (E. L. Thearle 1934), corrections by least squares or by the smallest largest "
    "residual (T. P. Goodman 1964; second-order cone program), all runs of a log fitted together; tolerance after ISO "
    "21940-11. The masses are at the radius of the trial masses."
)
RMS = {"": 1.0, "_rms": 1.0, "_pk": 0.5**0.5, "_pp": 0.5 * 0.5**0.5}
"""The r.m.s. value of a vibration whose amplitude is read in one of these ways is 1."""


def tables(b: FieldBalancing, warnings: list[str]) -> Tables:
    """The tables of a result, the CSV's first. `warnings` takes in why --digits leaves a correction whole."""
    request, logs, further = b.request, Tables(), list[Column]()
    if b.runs.fitted:
        from cli.field import logs as of

        logs = of.tables(b)
        further = [of.unsuggested(b)] if request.suggest else []
    made: Tables = {
        "corrections": cache(lambda: corrections(b, warnings)),
        "influence": lambda: _influence(b),
        "prediction": lambda: prediction(b),
    }
    if request.places is not None:
        on = any(solved.standing.any() for solved in b.solved)
        made["split"] = lambda: split(b, lambda rotor: rotor.solved.corrections, "corrections")
        made["trim_split"] = lambda: split(b, lambda rotor: rotor.solved.trim, "trim", shown=on)
    made |= {"trim": lambda: trim(b), "standing": lambda: standing(b), "rotors": lambda: rotors(b, further)}
    if request.tolerance is not None:
        made["tolerance"] = lambda: tolerance(b)
    if request.zone_class is not None:
        made["zones"] = lambda: zones(b)
    if request.four_run:
        made |= {"misfit": lambda: misfit(b), "alternatives": lambda: alternatives(b)}
    if request.view is not None:
        made |= {"static": lambda: static_couple(b, 0), "couple": lambda: static_couple(b, 1)}
    return {**made, **logs}


def _influence(b: FieldBalancing) -> Table:
    from cli.field.logs import influence

    return influence(b)


def corrections(b: FieldBalancing, warnings: list[str]) -> Table:
    """One row per rotor and plane. A correction whose error has no bound stays whole, and `warnings` says why."""
    per, unit, rows = b.runs.per, b.runs.mass_unit, Rows.planes(b)
    fix, trim = (rows.numbers(lambda s: s.corrections), rows.numbers(lambda s: s.trim))

    @cache
    def again() -> list[Real]:
        """The second run."""
        from cli.field.rounding import digits

        return rows.several(lambda solved: digits(b, solved, warnings).parts)

    def exact(k: int) -> Vectors:
        from cli.field.rounding import vectors_of

        return vectors_of(again()[4 * k :])

    def sized(name: str, values: Complex, k: int, place: str | None) -> list[Column]:
        size, angle = np.abs(values), degrees(values)
        return [
            number(f"{name}{per}", per, size, unit, None, place, exact=lambda: exact(k).size),
            number(f"{name}angle", "angle", angle, "", lambda: exact(k).turned(values), place),
        ]

    uncertainty = uncertainties(b, *rows.several(lambda s: s.uncertainty(s.corrections)))
    for column in uncertainty:
        column.error = lambda column=column: again()[8] * np.nan_to_num(column.values)
    columns = [*sized("", fix, 0, ""), *sized("trim_", trim, 1, None)]
    columns[2:2] = uncertainty if b.uncertain else []
    below = [
        "or REMOVE the same amounts at the opposite angles (+180°)" if fix.any() else "nothing to correct"
    ]
    if not any(solved.standing.any() for solved in b.solved):
        below.append("no mass is on the rotor in its last run: the trim is the correction")
    # the CSV has the rotor always
    rows.shown, rows.hidden = [rows.rotor, rows.shown[-1]], []
    hidden = [] if b.uncertain else uncertainty
    return rows.table(
        columns, ("rotor", "plane"), "corrections[]", conventions(b), "\n".join(below), hidden=hidden
    )


def sense(b: FieldBalancing) -> str:
    """Return how phases and mass angles are counted, as a sentence."""
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
    """Return how angles and phases are counted and what the corrections mean, as sentences."""
    amounts = f"{b.runs.per}{'es' if b.runs.per == 'mass' else 's'}"
    radius = "at the radius of the trial masses"
    if b.request.from_here:
        return f"{sense(b)}\nTrim: {amounts} to ADD to the rotor as it stands in its last run, {radius}."
    return (
        f"{sense(b)}\nCorrections: {amounts} to ADD to the rotor in its initial state, all trial masses off, {radius}. "
        "Trim: what to ADD to the rotor as it stands in its last run."
    )


def standing(b: FieldBalancing) -> Table:
    """What is on the rotors in their last run, of the document alone: the trim shows it."""
    rows = Rows.planes(b)
    on = masses(b, rows.numbers(lambda solved: solved.standing))
    return rows.table(on, ("rotor", "plane"), "standing[]", shown=False)


def trim(b: FieldBalancing) -> Table:
    """What to add to the rotors as they stand in their last run, and whether that is needed."""
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


def prediction(b: FieldBalancing) -> Table:
    """The vibration before, and as predicted with the corrections: a row for each rotor and sensor."""
    rows = Rows.sensors(b)
    before, after = rows.several(lambda s: (s.initial, s.residual))

    def phase(name: str, values: Complex, place: str | None = None) -> Column:
        # none is shown where nothing moves; JSON has 0
        column = number(name, "angle", np.where(values == 0, np.nan, degrees(values)), place=place)
        column.stored = degrees(values)
        return column

    phases = [
        number("before_phase", "angle", degrees(before), place=None),
        phase("predicted_phase", after, "phase"),
    ]
    sizes = [
        amplitude(b, "before_amplitude", np.abs(before), None),
        amplitude(b, "predicted_amplitude", np.abs(after), "amplitude"),
    ]
    columns, hidden = [column for pair in zip(sizes, phases, strict=True) for column in pair], list[Column]()
    if b.request.four_run:
        columns, hidden = sizes, [Column("phase", "deg", [None] * len(after), None, "phase_deg")]
    if b.runs.fitted:
        deviation = rows.numbers(lambda s: s.fitted.vibration_deviation(s.total))
        spread = [amplitude(b, "amplitude_uncertainty", deviation)]
        ceiling = b.ceiling
        if ceiling is not None:
            chance = rows.numbers(lambda s: s.fitted.probability_within(ceiling))
            spread.append(number("probability_within", "number", chance))
        (columns if np.isfinite(deviation).any() else hidden).extend(spread)
    above = "vibration before, and as predicted with the corrections"
    return rows.table(columns, READINGS, "residual[]", above, hidden=hidden)


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
    from cli.read.tolerance import verdict_table

    limit = b.request.tolerance
    assert limit is not None
    table = verdict_table([(rotor.name, v) for rotor in each(b) for v in rotor.verdicts()], "g_mm")
    whole = from_si(limit.permissible, "unbalance", "g_mm")
    named = f"{limit.grade}: " if limit.grade else ""
    return replace(table, above=f"{named}U_per = {whole:.6g} g·mm, {limit.sharing}; residual as predicted")


def zones(b: FieldBalancing) -> Table:
    """One row per rotor and sensor: the zone of its vibration velocity before, in the last run with corrections, as predicted."""
    from balancing import ZONE_BOUNDARIES, severity_zone

    machine, (_, tag) = b.request.zone_class or "", amplitude_kind(b.runs.amplitude_unit)
    unit = b.runs.amplitude_unit.removesuffix(tag)

    def zone(vibration: Complex) -> list[str | None]:
        size = to_si(np.abs(vibration), "amplitude", unit)
        speed = RMS[tag] * np.asarray(size) / to_si(1.0, "amplitude", "m_s")
        return [str(severity_zone(v, machine)) if v == v else None for v in speed.tolist()]

    def measured(solved: Solved) -> Complex:
        runs = [Rotor(b, solved, i).last for i in range(len(solved.initial))]
        unread = np.full(solved.initial.shape[1], np.nan)
        return np.array([unread if run is None else run.vibration for run in runs])

    rows = Rows.sensors(b)
    before, last, after = map(zone, rows.several(lambda s: (s.initial, measured(s), s.residual)))
    columns = [
        names("before_zone", before),
        *([names("measured_zone", last)] if any(last) else []),
        names("predicted_zone", after),
    ]
    a, bb, c = (f"{1e3 * bound:g}" for bound in ZONE_BOUNDARIES[machine])
    meant = "" if tag else ", taken as r.m.s."
    above = f"zones of ISO 10816-3, {machine}: A to {a}, B to {bb}, C to {c} mm/s r.m.s.; of the once-per-turn vibration{meant}"
    return rows.table(columns, READINGS, "zones[]", above)


def misfit(b: FieldBalancing) -> Table:
    """How far the amplitudes of each sensor are from any vector's, by the four-run method."""
    rows = Rows.each(b, lambda solved: len(solved.group.channels) * len(solved.planes))
    off = rows.numbers(lambda solved: [[fit.misfit for fit in one] for one in solved.group.amplitude_fits])
    plane = names("plane", rows.cells(lambda s: [name for name in s.planes for _ in s.group.channels]))
    columns = [
        names("sensor", rows.cells(lambda s: [c.sensor for c in s.group.channels] * len(s.planes))),
        *([plane] if any(len(solved.planes) > 1 for solved in b.solved) else []),
    ]
    keys = ("rotor", *(column.name for column in columns))
    above = "r.m.s. misfit of the amplitudes"
    return rows.table([*columns, amplitude(b, "amplitude", off)], keys, "misfit[]", above)


def alternatives(b: FieldBalancing) -> Table:
    """The other corrections that fit the amplitudes as well, by the four-run method."""
    of = [
        (rotor.name, rotor.planes[0], -v / a)
        for rotor in each(b)
        for v, a in zip(
            rotor.group.fit.initial[rotor.i], rotor.solved.group.amplitude_fits[rotor.i][0].other, strict=True
        )
        if a == a
    ]
    fix = masses(b, np.array([w for *_, w in of], dtype=complex))
    columns = [names("plane", [plane for _, plane, _ in of]), *fix]
    return Rows.of(b, [name for name, *_ in of]).table(columns, ("rotor", "plane"), "alternatives[]")


def static_couple(b: FieldBalancing, part: int) -> Table:
    """The static part of two corrections, (A + B)/2 in each plane, or the couple, (A − B)/2 in the first plane."""
    rows, sign = Rows.each(b), (1, -1)[part]
    half = rows.numbers(lambda s: (s.corrections[:, 0] + sign * s.corrections[:, 1]) / 2)
    above = ("to ADD in each of both planes", "to ADD in the first plane, and its opposite in the second")
    return rows.table(masses(b, half), ("rotor",), f"static_couple.{('static', 'couple')[part]}", above[part])
