"""The polar picture of a balancing: masses, their resultant, the correction; a panel for each plane."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from balancing import correct
from cli.balance.solve import Balancing
from cli.read.units import from_si
from cli.show.picture import arrow, free_direction

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Complex = NDArray[np.complex128]


class Panel(NamedTuple):
    """A rotor's row of panels, in one unit; the correction is what is added."""

    rotor: str
    masses: Sequence[str]
    planes: Sequence[str]
    shares: Complex
    """Of each mass in each plane, (k, p)."""
    made: Complex
    """The correction in each plane, (p,)."""


def _panels(found: Balancing) -> Iterator[Panel]:
    """Yield the first rotors."""
    rotors, planes = found.rotors, found.planes
    mass_names = rotors.table.texts.get("name") or [str(i + 1) for i in range(rotors.table.rows)]
    for r, name in enumerate(rotors.names[:4]):
        mine = np.flatnonzero(rotors.rotor == r)
        rows = found.rows_of(r)
        here = found.plane_of_row[rows]
        at = rotors.z[mine, None] if rotors.z is not None else np.zeros((len(mine), 1))
        plane_z = planes.z[here] if planes.z is not None else np.zeros(len(here))
        # each mass alone, carried to the planes as they will balance it
        shares = -correct(rotors.moment[mine, None], at, plane_z).unbalance
        yield Panel(
            name if len(rotors.names) > 1 else "",
            [mass_names[i] for i in mine],
            [planes.name[p] for p in here],
            from_si(shares, "unbalance", rotors.unbalance_unit),
            from_si(found.made[rows], "unbalance", rotors.unbalance_unit),
        )


def draw(found: Balancing) -> Figure:
    """Draw the first rotors below each other, their planes beside each other, all to one scale per rotor."""
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    panels, remove = list(_panels(found)), found.request.remove
    unit = found.rotors.unbalance_unit.replace("_", "·")
    columns = max(len(panel.planes) for panel in panels)
    figure = Figure(figsize=(4.4 * columns, 4.5 * len(panels) + 0.7), layout="constrained")
    grid = figure.subplots(len(panels), columns, subplot_kw={"projection": "polar"}, squeeze=False)
    for axes_row, (rotor, masses, planes, shares, made) in zip(grid, panels, strict=True):
        scale = max(float(np.abs(shares).max(initial=0)), float(np.abs(made).max(initial=0)))
        for column, axes in enumerate(axes_row):
            if column >= len(planes):
                axes.set_visible(False)
                continue
            title = f"plane {planes[column]}" if not rotor else f"rotor {rotor}, plane {planes[column]}"
            axes.set_title(title, pad=14)
            axes.set_rlim(0, 1.12 * scale or 1.0)
            axes.tick_params(labelsize=8, colors="0.3")
            axes.set_rlabel_position(
                free_direction([*shares[:, column], shares[:, column].sum(), made[column]])
            )
            axes.grid(color="0.85")
            few = len(masses) <= 12
            for name, share in zip(masses, shares[:, column], strict=True):
                arrow(axes, share, scale, "0.45", 1.2, "-", name if few else "")
            arrow(axes, shares[:, column].sum(), scale, "black", 1.6, "--", "")
            arrow(axes, -made[column] if remove else made[column], scale, "tab:red", 2.6, "-", "")
    handles = [
        Line2D([], [], color="0.45", lw=1.2, label="masses, their share in the plane"),
        Line2D([], [], color="black", lw=1.6, ls="--", label="resultant"),
        Line2D([], [], color="tab:red", lw=2.6, label=f"correction to {'remove' if remove else 'add'}"),
    ]
    figure.legend(
        handles=handles, loc="outside lower center", ncols=min(3, 2 * columns - 1), fontsize=9, frameon=False
    )
    figure.suptitle(f"unbalance, {unit}; angles counter-clockwise as seen against +z", fontsize=9)
    return figure
