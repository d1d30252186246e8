"""The corrections of measured rotors as columns, what they leave, and the residuals of a fit."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

from cli.field.runs import Channel, Real
from cli.field.solve import FieldBalancing
from cli.read.rounding import angle_error, size_error
from cli.read.units import degrees, from_si
from cli.show.columns import Column, Table


def corrections(found: FieldBalancing, warnings: list[str]) -> Table:
    """One row per rotor and plane. A correction whose error has no bound stays whole, and `warnings` says why."""
    per, unit = found.runs.per, found.runs.mass_unit
    flat = found.rows([solved.corrections for solved in found.solved])
    rotor, plane, group = (row.tolist() for row in found.keys)

    @cache
    def bounds() -> list[Real]:
        from cli.field.rounding import correction_errors

        return [correction_errors(found, solved, warnings) for solved in found.solved]

    def size() -> Real:
        return from_si(size_error(flat, found.rows(bounds())), per, unit)

    def angle() -> Real:
        return angle_error(flat, found.rows(bounds()), degrees(flat))

    columns = [
        Column("rotor", "", [found.runs.rotors[r] for r in rotor]),
        Column("plane", "", [found.solved[k].planes[p] for k, p in zip(group, plane, strict=True)]),
        Column(per, unit, found.amount(np.abs(flat)), size),
        Column("angle", "deg", degrees(flat), angle),
    ]
    if found.uncertain:
        pairs = [solved.uncertainty for solved in found.solved]
        along, across = (found.rows([pair[k] for pair in pairs]) for k in (0, 1))

        def share(of: Real) -> Real:
            from cli.field.rounding import uncertainty_share

            pairs = zip(found.solved, bounds(), strict=True)
            return found.rows([uncertainty_share(found, *pair) for pair in pairs]) * np.nan_to_num(of)

        columns += [
            Column(f"{per}_uncertainty", unit, found.amount(along), lambda: share(found.amount(along))),
            Column("angle_uncertainty", "deg", across, lambda: share(across)),
        ]
    return Table(columns, keys=("rotor", "plane"))


def channels(found: FieldBalancing, of: Sequence[Channel]) -> list[Column]:
    """The columns that name sensors: with their state and speed, where the table has them."""
    columns = [Column("sensor", "", [channel.sensor for channel in of])]
    if any(channel.state is not None for channel in of):
        columns.append(Column("state", "", [channel.state for channel in of]))
    if any(channel.speed is not None for channel in of):
        unit = found.runs.speed_unit or "rpm"
        columns.append(
            Column("speed", unit, [None if c.speed is None else from_si(c.speed, "speed", unit) for c in of])
        )
    return columns


def prediction(found: FieldBalancing) -> Table:
    """The vibration before, and as predicted with the corrections: a row for each rotor and sensor."""
    parts = [
        (
            np.repeat(solved.group.rotors, len(solved.group.channels)),
            solved.initial.ravel(),
            solved.residual.ravel(),
        )
        for solved in found.solved
    ]
    rotor, before, after = (np.concatenate(part) for part in zip(*parts, strict=True))
    order = np.argsort(rotor, kind="stable")
    rotor, before, after = rotor[order], before[order], after[order]
    read = [channel for solved in found.solved for channel in solved.group.channels * len(solved.initial)]
    unit = found.runs.amplitude_unit
    columns = [
        *(
            [Column("rotor", "", [found.runs.rotors[r] for r in rotor.tolist()])]
            if found.runs.several
            else []
        ),
        *channels(found, [read[k] for k in order.tolist()]),
        Column("before_amplitude", unit, np.abs(before)),
        Column("predicted_amplitude", unit, np.abs(after)),
    ]
    if not found.request.four_run:
        columns.insert(-1, Column("before_phase", "deg", degrees(before)))
        phase = np.where(after == 0, np.nan, degrees(after))
        columns.append(Column("predicted_phase", "deg", phase))
    return Table(columns, keys=("rotor", "sensor", "state", "speed_rpm"))


def split(found: FieldBalancing) -> Table:
    """The corrections on the places there are: a row for each mass."""
    rows = [
        (rotor, plane, position, angle, mass)
        for rotor, solved, i in found.each()
        for plane, w in zip(solved.planes, solved.corrections[i].tolist(), strict=True)
        for position, angle, mass in found.split(w)
    ]
    rotors, planes, positions, angles, masses = zip(*rows, strict=True) if rows else ((),) * 5
    per, unit = found.runs.per, found.runs.mass_unit
    columns = [
        Column("rotor", "", list(rotors)),
        Column("plane", "", list(planes)),
        Column("position", "", list(positions)),
        Column(per, unit, [found.amount(mass) for mass in masses]),
        Column("angle", "deg", list(angles)),
    ]
    return Table(columns if found.runs.several else columns[1:], keys=("rotor", "plane", "position"))


def residuals(found: FieldBalancing) -> Table:
    """One row per reading of a fit: what was read, and how far it lies from the fitted vibration."""
    from cli.field.fit import rows

    unit, runs = found.runs.amplitude_unit, found.runs
    named = [
        (runs.rotors[r], row)
        for solved in found.solved
        for i, r in enumerate(solved.group.rotors.tolist())
        for row in rows(solved.group, i)
    ]
    names, of_fit = zip(*named, strict=True)
    read, left = (np.array([getattr(row, name) for row in of_fit]) for name in ("value", "residual"))
    columns = [
        Column("rotor", "", names),
        Column("run", "", [row.run for row in of_fit]),
        Column("sensor", "", [row.channel.sensor for row in of_fit]),
        Column("state", "", [row.channel.state or "" for row in of_fit]),
        Column("amplitude", unit, np.abs(read)),
        Column("phase", "deg", degrees(read)),
        Column("residual", unit, np.abs(left)),
        Column("residual_phase", "deg", degrees(left)),
        Column("standardized", "", [row.standardized for row in of_fit]),
        Column("outlier", "", ["yes" if row.outlier else "" for row in of_fit]),
    ]
    return Table([c for c in columns if c.name != "state" or any(c.values)])
