"""The polar picture of a balancing: masses, their resultant, the correction; a dial for each plane."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from balancing import correct
from balancing.picture import MOST, KnownMasses, known_masses
from cli.balance import modal_way
from cli.balance.rotors import Balancing
from cli.show.picture import blank
from dalembert.units import from_si

if TYPE_CHECKING:
    from matplotlib.figure import Figure, FigureBase


def draw(balancing: Balancing, *, polygons: bool = False) -> Figure:
    """Draw the first rotors below each other, their planes beside each other; with --steps the closed polygons too."""
    figure = blank()
    if polygons:
        from cli.balance.way import polygons_below

        polygons_below(balancing, figure, lambda part: _dials(balancing, part))
    else:
        _dials(balancing, figure)
    return figure


def _dials(balancing: Balancing, figure: FigureBase) -> None:
    unit = balancing.rotors.unbalance_unit.replace("_", "·")
    known_masses(list(_rotors(balancing)), unit, remove=balancing.request.remove, figure=figure)


def _rotors(balancing: Balancing) -> Iterator[KnownMasses]:
    rotors, planes = balancing.rotors, balancing.planes
    mass_names = rotors.table.texts.get("name") or [str(i + 1) for i in range(rotors.table.rows)]
    for r, name in enumerate(rotors.names[:MOST]):
        mine = np.flatnonzero(rotors.rotor == r)
        rows = balancing.rows_of(r)
        here = balancing.plane_of_row[rows]
        at = rotors.z[mine, None] if rotors.z is not None else np.zeros((len(mine), 1))
        plane_z = planes.z[here] if planes.z is not None else np.zeros(len(here))
        # each mass alone, carried to the planes as they will balance it
        if balancing.modal:
            shares = modal_way.shares(balancing, r)
        else:
            shares = -correct(rotors.moment[mine, None], at, plane_z).unbalance
        yield KnownMasses(
            name if len(rotors.names) > 1 else "",
            [mass_names[i] for i in mine],
            [planes.name[p] for p in here],
            from_si(shares, "unbalance", rotors.unbalance_unit),
            from_si(balancing.made[rows], "unbalance", rotors.unbalance_unit),
        )
