"""The influence coefficients as columns, as `--save-influence` stores them: with what is known of their errors."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cli.field.field_balancing import FieldBalancing
from cli.field.runs import Complex, Real
from cli.field.solution import Solved
from cli.field.tables import Rows
from dalembert.angles import degrees
from dalembert.results.columns import ABSENT, Column, Table, names, number
from dalembert.units import from_si, to_si

if TYPE_CHECKING:
    from balancing import JointFit
    from balancing.reading_errors import Errors


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


def spread(b: FieldBalancing, solved: Solved) -> Spread | None:
    """Return how well a group's coefficients are known, from its fit or from stated errors; None where nothing tells."""
    if b.stored is not None or not (b.runs.fitted or b.request.reading_error) or solved.balance is None:
        return None
    return _spread(solved.balance.fit, solved.balance.errors)


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
    finite = np.isfinite(errors.degrees_of_freedom)
    square = np.where(fit.present, np.square(errors.along) + np.square(errors.across), 0.0)
    sd = np.sqrt(square.sum(axis=(-2, -1)) / fit.present.sum(axis=(-2, -1)))
    return Spread(
        np.sqrt(covariance[..., 0, 0]),
        np.sqrt(covariance[..., 1, 1]),
        np.where(both > 0, shared / np.where(both > 0, both, 1.0), 0.0),
        sd,
        np.where(finite, errors.degrees_of_freedom, np.inf),
    )


def coefficients(b: FieldBalancing) -> Table:
    """The influence coefficients, as --save-influence stores them."""
    per, unit = b.runs.per, b.runs.mass_unit
    rows, hidden = Rows(b, lambda solved: len(solved.group.channels) * len(solved.planes)), []
    channels = rows.cells(lambda s: [c for c in s.group.channels for _ in s.planes])
    alpha = rows.numbers(lambda solved: solved.alpha)
    states = [channel.state for channel in channels]
    rpm = b.runs.speed_unit == "rpm"
    speeds = [
        None if c.speed is None else c.speed_given if rpm else from_si(c.speed, "speed", "rpm")
        for c in channels
    ]
    stored = [ABSENT if c.state is not None and c.speed is None else c.speed for c in channels]
    state = Column(
        "state",
        "",
        [of or "" for of in states],
        None,
        "state",
        [ABSENT if of is None else of for of in states],
    )
    size = np.abs(alpha)
    if not any(states):
        hidden.append(state)
    columns = [
        *rows.shown,
        names("sensor", [channel.sensor for channel in channels]),
        *([state] if any(states) else []),
        Column("speed", "rpm", speeds, None, "speed_rad_s", stored),
        names("plane", rows.cells(lambda s: s.planes * len(s.group.channels))),
        Column("magnitude_per", unit, to_si(size, per, unit), None, f"magnitude_per_{b.runs.per_si}", size),
        number("phase", "angle", degrees(alpha)),
        names("amplitude_unit", [b.runs.amplitude_unit] * len(size), place=None),
        *_errors(b, rows, size),
    ]
    return Table(columns, place="rotors[].influence[]", documented=[*rows.hidden, *hidden])


def _errors(b: FieldBalancing, rows: Rows, size: Real) -> list[Column]:
    """Return the columns that say how well the coefficients are known; none where nothing tells."""
    spreads = {id(solved): spread(b, solved) for solved in b.solved}
    if not any(of is not None for of in spreads.values()):
        return []

    def cells(of: Callable[[Spread], ArrayLike]) -> Any:
        def of_group(solved: Solved) -> ArrayLike:
            one = spreads[id(solved)]
            empty = np.full(solved.alpha.shape, None, dtype=object)
            return empty if one is None else np.broadcast_to(np.asarray(of(one)), solved.alpha.shape)

        return rows.numbers(of_group)

    def of_rotor(values: Real) -> Real:
        return values[:, None, None]

    along, across = cells(lambda one: one.along).astype(float), cells(lambda one: one.across).astype(float)
    per, unit, several = b.runs.per, b.runs.mass_unit, any(len(solved.planes) > 1 for solved in b.solved)
    with np.errstate(divide="ignore", invalid="ignore"):
        turn = np.degrees(across / size)
    columns = [
        Column("magnitude_uncertainty_per", unit, to_si(along, per, unit)),
        Column("phase_uncertainty", "deg", np.where(size > 0, turn, np.nan)),
        *([names("correlation", cells(_correlations).tolist(), place=None)] if several else []),
        Column(
            "reading_sd", b.runs.amplitude_unit, cells(lambda one: of_rotor(one.reading_sd)).astype(float)
        ),
    ]
    freedom = cells(lambda one: of_rotor(one.degrees_of_freedom)).astype(float)
    return [*columns, Column("degrees_of_freedom", "", np.where(np.isfinite(freedom), freedom, np.nan))]


def _correlations(one: Spread) -> NDArray[np.object_]:
    """Return for each coefficient the correlations of its error with those of the planes before it, as text."""
    made = np.full(one.along.shape, None, dtype=object)
    if one.along.shape[-1] > 1:
        for at in np.ndindex(*made.shape):
            before = one.correlation[at][: at[-1]].tolist()
            made[at] = ";".join(f"{abs(z)!r}@{float(degrees(z))!r}" for z in before)
    return made
