"""The influence coefficients as columns, as `--save-influence` stores them: with what is known of their errors."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from balancing import JointFit, joint_fit
from cli.field.runs import Complex, Real
from cli.field.solve import FieldBalancing, Solved
from cli.read.units import degrees, from_si, to_si
from cli.show.columns import Column, Table

if TYPE_CHECKING:
    from balancing.run_log import Errors
    from cli.show.columns import Cell


class Spread(NamedTuple):
    """How well the coefficients of a group are known; SI."""

    along: Real
    """Standard deviation along each coefficient and across it, (g, s, p); NaN where it is not known."""
    across: Real
    correlation: Complex
    """Of the errors of each channel's planes, E δ_p δ̄_q/√(E|δ_p|² E|δ_q|²), (g, s, p, p)."""
    reading_sd: Real
    """√E|ε|² of the readings, (g,); NaN where it is not known."""
    degrees_of_freedom: Real
    """Complex, (g,); inf where the errors are stated."""


def spread(found: FieldBalancing, solved: Solved) -> Spread | None:
    """Return how well a group's coefficients are known, from its fit or from stated errors; None where nothing tells."""
    group, error = solved.group, found.request.reading_error
    if solved.balance is not None:
        return _spread(solved.balance.fit, solved.balance.errors)
    if error is None or found.stored is not None or solved.fits:
        return None
    readings = np.concatenate([group.initial[:, None], group.runs], axis=1)
    masses = np.concatenate([np.zeros_like(group.on[:, :1]), group.on], axis=1)
    fit = joint_fit(readings, masses)
    return _spread(fit, fit.stated(*error))


def _spread(fit: JointFit, errors: Errors) -> Spread | None:
    from balancing.propagation import components

    gain = fit.gain[..., 1:, :]
    unit = np.swapaxes(errors.unit, -1, -2)
    along, across = (np.swapaxes(part, -1, -2) for part in (errors.along, errors.across))
    covariance = components(gain, None, fit.influence, unit, along, across)
    shared = (gain * (np.square(along) + np.square(across))[..., None, :]) @ np.swapaxes(gain, -1, -2).conj()
    if fit.foreknown is not None:
        sources = fit.foreknown.sources[..., 1:, :]
        more = sources @ np.swapaxes(sources, -1, -2).conj()
        shared = shared + more
        own = np.diagonal(more, axis1=-2, axis2=-1).real / 2
        covariance = covariance + own[..., None, None] * np.eye(2)
    if not np.isfinite(covariance).any():
        return None
    size = np.sqrt(np.diagonal(shared, axis1=-2, axis2=-1).real)
    both = size[..., :, None] * size[..., None, :]
    known = np.isfinite(errors.degrees_of_freedom)
    square = np.where(fit.present, np.square(errors.along) + np.square(errors.across), 0.0)
    sd = np.sqrt(square.sum(axis=(-2, -1)) / fit.present.sum(axis=(-2, -1)))
    return Spread(
        np.sqrt(covariance[..., 0, 0]),
        np.sqrt(covariance[..., 1, 1]),
        np.where(both > 0, shared / np.where(both > 0, both, 1.0), 0.0),
        sd,
        np.where(known, errors.degrees_of_freedom, np.inf),
    )


def coefficients(found: FieldBalancing) -> Table:
    """The influence coefficients, as --save-influence stores them."""
    per, unit = found.runs.per, found.runs.mass_unit
    amplitude = found.runs.amplitude_unit
    of_groups = {id(solved): spread(found, solved) for solved in found.solved}
    rows: list[dict[str, Cell]] = []
    for rotor, solved, i in found.each():
        known = of_groups[id(solved)]
        for s, channel in enumerate(solved.group.channels):
            speed = None
            if channel.speed is not None and channel.speed_given is not None:
                rpm = found.runs.speed_unit == "rpm"
                speed = channel.speed_given if rpm else from_si(channel.speed, "speed", "rpm")
            for p, (plane, a) in enumerate(zip(solved.planes, solved.alpha[i, s].tolist(), strict=True)):
                row: dict[str, Cell] = {
                    "rotor": rotor,
                    "sensor": channel.sensor,
                    "state": channel.state or "",
                    "speed": speed,
                    "plane": plane,
                    "magnitude_per": to_si(abs(a), per, unit),
                    "phase": float(degrees(a)),
                    "amplitude_unit": amplitude,
                }
                rows.append(row | ({} if known is None else _errors(known, i, s, p, abs(a), per, unit)))
    units = {
        "speed": "rpm",
        "magnitude_per": unit,
        "phase": "deg",
        "magnitude_uncertainty_per": unit,
        "phase_uncertainty": "deg",
        "reading_sd": amplitude,
    }
    names = dict.fromkeys(name for row in rows for name in row)
    columns = [Column(name, units.get(name, ""), [row.get(name) for row in rows]) for name in names]
    empty = {"rotor": not found.runs.several, "state": not any(row["state"] for row in rows)}
    return Table([column for column in columns if not empty.get(column.name, False)])


def _errors(known: Spread, i: int, s: int, p: int, size: float, per: str, unit: str) -> dict[str, Cell]:
    """Return the cells that say how well a coefficient is known."""
    along, across = float(known.along[i, s, p]), float(known.across[i, s, p])
    nu = float(known.degrees_of_freedom[i])
    cells: dict[str, Cell] = {
        "magnitude_uncertainty_per": to_si(along, per, unit),
        "phase_uncertainty": float(np.degrees(across / size)) if size else None,
    }
    if known.correlation.shape[-1] > 1:
        before = [complex(known.correlation[i, s, p, q]) for q in range(p)]
        cells["correlation"] = ";".join(f"{abs(z)!r}@{float(degrees(z))!r}" for z in before)
    return cells | {
        "reading_sd": float(known.reading_sd[i]),
        "degrees_of_freedom": nu if np.isfinite(nu) else None,
    }
