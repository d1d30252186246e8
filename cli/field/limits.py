"""The tables that hold a result against what is permissible: the tolerance of the unbalance, the zones of the vibration."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from balancing import ZONE_BOUNDARIES, severity_zone
from cli.field.field_balancing import FieldBalancing
from cli.field.runs import Complex
from cli.field.solution import Solved
from cli.field.tables import READINGS, of_channels
from cli.field.trim import last_run, verdicts
from cli.read.tolerance import verdict_table
from dalembert.results.columns import Table, names
from dalembert.units import amplitude_kind, from_si, to_si

RMS = {"": 1.0, "_rms": 1.0, "_pk": 0.5**0.5, "_pp": 0.5 * 0.5**0.5}


def tolerance(b: FieldBalancing) -> Table:
    """One row per rotor and plane: what is permissible, what the unbalance was, what is predicted."""
    limit = b.request.tolerance
    assert limit is not None
    planes = [
        (rotor, v)
        for rotor, (_, solved, i) in zip(b.runs.rotors, b.each(), strict=True)
        for v in verdicts(b, solved, i)
    ]
    table = verdict_table(planes, "g_mm")
    whole = from_si(limit.permissible, "unbalance", "g_mm")
    named = f"{limit.grade}: " if limit.grade else ""
    return replace(table, above=f"{named}U_per = {whole:.6g} g·mm, {limit.sharing}; residual as predicted")


def zones(b: FieldBalancing) -> Table:
    """One row per rotor and sensor: the zone of its vibration velocity before, in the last run with corrections, as predicted."""
    machine, (_, tag) = b.request.zone_class or "", amplitude_kind(b.runs.amplitude_unit)

    def zone(vibration: Complex) -> list[str | None]:
        size = to_si(np.abs(vibration), "amplitude", b.runs.amplitude_unit.removesuffix(tag))
        speed = RMS[tag] * np.asarray(size) / to_si(1.0, "amplitude", "m_s")
        return [str(severity_zone(v, machine)) if v == v else None for v in speed.tolist()]

    def measured(solved: Solved) -> Complex:
        runs = [last_run(b, solved, i) for i in range(len(solved.initial))]
        return np.array(
            [np.full(solved.initial.shape[1], np.nan) if run is None else run.vibration for run in runs]
        )

    rows, named, hidden = of_channels(b)
    before, after = (rows.numbers(lambda s, of=of: getattr(s, of)) for of in ("initial", "residual"))  # type: ignore[misc]
    last = zone(rows.numbers(measured))
    a, bb, c = (f"{1e3 * bound:g}" for bound in ZONE_BOUNDARIES[machine])
    meant = "" if tag else ", taken as r.m.s."
    return Table(
        [
            *named,
            names("before_zone", zone(before)),
            *([names("measured_zone", last)] if any(last) else []),
            names("predicted_zone", zone(after)),
        ],
        READINGS,
        "rotors[].zones[]",
        f"zones of ISO 10816-3, {machine}: A to {a}, B to {bb}, C to {c} mm/s r.m.s.; of the once-per-turn vibration{meant}",
        documented=hidden,
    )
