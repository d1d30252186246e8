"""The pictures of a balancing in the field: vibration and corrections as dials; of a fitted log its history."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from balancing.picture import Vibration, vibration
from cli.field.field_balancing import FieldBalancing
from cli.field.rotor import Rotor
from cli.field.rows import amplitude_unit
from cli.show.picture import blank

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from balancing.log_picture import History


def draw(b: FieldBalancing, rotors: Sequence[Rotor]) -> Figure:
    """Draw for each rotor the vibration before and after, and the corrections; of a fit with all that it was found from."""
    if not b.runs.fitted:
        return dials(b, rotors)
    from balancing.log_picture import log_history

    return log_history([_history(b, rotor) for rotor in rotors], amplitude_unit(b), b.unit, blank())


def dials(b: FieldBalancing, rotors: Sequence[Rotor], *, trims: bool = False) -> Figure:
    """Draw for each rotor the vibration before and after, and the corrections, as dials; or what to add as it stands."""
    figure = blank()
    vibration([_rotor(b, rotor, trims) for rotor in rotors], amplitude_unit(b), b.unit, figure=figure)
    return figure


def _rotor(b: FieldBalancing, rotor: Rotor, trims: bool) -> Vibration:
    solved, i = rotor.solved, rotor.i
    fix, start = (solved.trim, 0 * solved.standing) if trims else (solved.corrections, solved.start)
    places = b.request.places or ()
    return Vibration(
        rotor.heading,
        [str(channel) for channel in rotor.channels],
        solved.initial[i],
        solved.residual[i],
        solved.planes,
        b.amount(fix[i]),
        b.amount(start[i]),
        places=np.radians(places).tolist(),
        split=[_on_places(b, w) for w in fix[i].tolist()] if places else [],
    )


def _on_places(b: FieldBalancing, w: complex) -> list[float]:
    """Return what of a correction goes on each of the places, in the unit of the trial masses."""
    masses = [0.0] * len(b.request.places or ())
    for name, _, mass in b.split(w):
        masses[int(name) - 1] = float(b.amount(mass))
    return masses


def _history(b: FieldBalancing, rotor: Rotor) -> History:
    from balancing import region_factor
    from balancing.log_picture import History
    from cli.field.logs import predicted, run_to_predict, suggested

    solved, i, balance = rotor.solved, rotor.i, rotor.solved.fitted
    spreads, prediction, masses = [], None, None
    if solved.covariance is not None:
        factors = region_factor(0.95, balance.degrees_of_freedom[i]).tolist()
        covariances = solved.covariance[i] * b.amount(1.0) ** 2
        spreads = list(zip(covariances, factors, strict=True))
    if b.predict is not None:
        on = np.broadcast_to(run_to_predict(b, solved.planes), solved.corrections.shape)
        prediction = predicted(b, solved)[0][i], balance.vibration_spread(on, reading=True)
    if b.request.suggest and (run := suggested(rotor)) is not None:
        masses = np.asarray(b.amount(run.masses))
    places = b.request.places or ()
    return History(
        rotor.heading,
        i,
        [str(channel) for channel in rotor.channels],
        rotor.group.lines.of(i),
        balance.fit,
        rotor.group.chance[i],
        solved.initial[i],
        solved.residual[i],
        balance.vibration_spread(solved.total),
        solved.planes,
        np.asarray(b.amount(solved.corrections[i])),
        spreads,
        prediction,
        masses,
        places,
        [_on_places(b, complex(w)) for w in solved.corrections[i]] if places else [],
    )
