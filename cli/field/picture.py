"""The polar pictures of a balancing in the field: vibration before and after, and the corrections."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from balancing.picture import Vibration, vibration
from cli.field.solve import FieldBalancing
from cli.field.words import amplitude_unit
from cli.show.picture import blank

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw(found: FieldBalancing, rotors: Sequence[int]) -> Figure:
    """Draw for each rotor the vibration vectors before and after, and beside them the corrections; of a fit its runs too."""
    if found.runs.fitted:
        from cli.field import fit_picture

        return fit_picture.draw(found, rotors)
    figure = blank()
    vibration([_rotor(found, rotor) for rotor in rotors], amplitude_unit(found), found.unit, figure=figure)
    return figure


def _rotor(found: FieldBalancing, rotor: int) -> Vibration:
    k, i = found.place[rotor]
    solved = found.solved[k]
    places = found.request.places or ()
    split = []
    for w in solved.corrections[i].tolist() if places else ():
        masses = [0.0] * len(places)
        for name, _, mass in found.split(w):
            masses[int(name) - 1] = float(found.amount(mass))
        split.append(masses)
    return Vibration(
        found.runs.rotors[rotor] if found.runs.several else "",
        [str(channel) for channel in solved.group.channels],
        solved.initial[i],
        solved.residual[i],
        solved.planes,
        found.amount(solved.corrections[i]),
        found.amount(solved.standing[i]),
        places=np.radians(places).tolist(),
        split=split,
    )
