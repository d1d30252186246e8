"""The corrections of measured rotors as columns, their influence coefficients, and the JSON document."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from cli.field.runs import Channel, Real, Runs
from cli.field.solve import FieldBalancing
from cli.field.tolerance import verdicts
from cli.read.rounding import angle_error, size_error
from cli.read.units import degrees, from_si
from cli.show.columns import Column, Table, finite

if TYPE_CHECKING:
    from cli.show.columns import Document


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
        pairs = [
            found.uncertainty(solved) or (np.full(solved.corrections.shape, np.nan),) * 2
            for solved in found.solved
        ]
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
    kinds: dict[Channel, int] = {}
    parts = [
        (
            np.repeat(solved.group.rotors, len(solved.group.channels)),
            np.tile([kinds.setdefault(of, len(kinds)) for of in solved.group.channels], len(solved.initial)),
            solved.initial.ravel(),
            solved.residual.ravel(),
        )
        for solved in found.solved
    ]
    rotor, kind, before, after = (np.concatenate(part) for part in zip(*parts, strict=True))
    order = np.argsort(rotor, kind="stable")
    before, after, known = before[order], after[order], list(kinds)
    unit = found.runs.amplitude_unit
    columns = [
        *(
            [Column("rotor", "", [found.runs.rotors[r] for r in rotor[order].tolist()])]
            if found.several
            else []
        ),
        *channels(found, [known[k] for k in kind[order].tolist()]),
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
    return Table(columns if found.several else columns[1:], keys=("rotor", "plane", "position"))


def mass_in(runs: Runs, plane: str, w: complex) -> Document:
    """A mass in a plane, as the JSON has it."""
    return {"plane": plane, f"{runs.per}_{runs.per_si}": abs(w), "angle_deg": float(degrees(complex(w)))}


def document(found: FieldBalancing) -> Document:
    """The JSON document."""
    documents: list[Document] = []
    suffix, key = found.runs.per_si, found.runs.per
    for rotor, (_, solved, i) in zip(found.runs.rotors, found.each(), strict=True):
        group = solved.group
        spreads = found.uncertainty(solved)
        corrections: list[Document] = []
        for p, plane in enumerate(solved.planes):
            w = solved.corrections[i, p]
            entry = mass_in(found.runs, plane, w)
            entry[f"{key}_uncertainty_{suffix}"] = None if spreads is None else finite(spreads[0][i, p])
            entry["angle_uncertainty_deg"] = None if spreads is None else finite(spreads[1][i, p])
            if found.request.places is not None:
                entry["split"] = [
                    {"position": name, "angle_deg": angle, f"{key}_{suffix}": part}
                    for name, angle, part in found.split(w)
                ]
            corrections.append(entry)
        residual = solved.residual[i]
        size = np.abs(residual)
        largest = float(size.max())
        document: Document = {
            "rotor": rotor,
            "influence": [
                channel.key
                | {"plane": plane, f"magnitude_per_{suffix}": abs(solved.alpha[i, s, p])}
                | {"phase_deg": float(degrees(solved.alpha[i, s, p]))}
                for s, channel in enumerate(group.channels)
                for p, plane in enumerate(solved.planes)
            ],
            "condition_number": finite(solved.condition[i]),
            "corrections": corrections,
            "residual": [
                {
                    **channel.key,
                    "amplitude": abs(residual[s]),
                    "phase_deg": None if found.request.four_run else float(degrees(residual[s])),
                }
                for s, channel in enumerate(group.channels)
            ],
            "residual_rms": largest * float(np.sqrt(np.square(size / largest).mean())) if largest else 0.0,
            "residual_max": largest,
            "initial_max": float(np.abs(solved.initial[i]).max()),
            "objective": found.request.objective,
        }
        if solved.bound is not None:
            document["residual_bound"] = float(solved.bound[i])
        if solved.residual_95 is not None:
            document["residual_max_95"] = finite(solved.residual_95[i])
        if group.repeats:
            document["repeats"] = {
                "readings": int(group.counts[group.counts > 1].sum()),
                "degrees_of_freedom": group.repeats,
                "reading_sd": float(group.reading_sd[i]),
            }
        if solved.fits:
            document["misfit"] = [
                {"sensor": channel.sensor, "amplitude": float(misfit)}
                for channel, misfit in zip(group.channels, solved.fits[i].misfit, strict=True)
            ]
            others = [-v / a for v, a in zip(group.initial[i], solved.fits[i].other, strict=True) if a == a]
            document["alternatives"] = [mass_in(found.runs, solved.planes[0], w) for w in others]
        if found.request.tolerance is not None:
            document["tolerance"] = found.request.tolerance.document(verdicts(found, solved, i))
        documents.append(document)
    return {
        "correction": "add",
        "state": "as it stands" if found.request.from_here else "initial",
        "convention": found.request.conventions,
        "rotors": documents,
        "amplitude_unit": found.runs.amplitude_unit,
    }
