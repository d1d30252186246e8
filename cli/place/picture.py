"""The picture of a placement: the places on the rotor, the masses on them, what they are to be and what they are."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from balancing.picture import Places, places
from cli.place.solve import Placing
from cli.read.units import from_si
from cli.show.picture import blank

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw(found: Placing) -> Figure:
    """Draw for each plane its places with their masses on the rim, target and total as vectors."""
    unit = found.of.unit
    panels = [
        Places(
            "" if share.z is None else f"z = {from_si(share.z, 'length', 'mm'):g} mm: ",
            np.radians(share.places).tolist(),
            from_si(share.placed.masses, "mass", unit).tolist(),
            from_si(share.goal, "mass", unit),
            complex(from_si(share.placed.total, "mass", unit)),
        )
        for share in found.shares
    ]
    figure = blank()
    places(panels, unit, remove=found.request.removes, figure=figure)
    return figure
