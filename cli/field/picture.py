"""The polar pictures of a balancing in the field: vibration before and after, and the corrections."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from cli.field.solve import FieldBalancing
from cli.field.words import amplitude_unit
from cli.show.picture import arrow, free_direction

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw(found: FieldBalancing, rotors: Sequence[int]) -> Figure:
    """Draw for each rotor the vibration vectors before and after, and beside them the corrections."""
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    figure = Figure(figsize=(10.4, 5.0 * len(rotors) + 0.7), layout="constrained")
    grid = figure.subplots(len(rotors), 2, subplot_kw={"projection": "polar"}, squeeze=False)
    amounts = found.unit
    for (left, right), rotor in zip(grid, rotors, strict=True):
        k, i = found.place[rotor]
        solved = found.solved[k]
        name = f"rotor {found.runs.rotors[rotor]}: " if found.several else ""
        before, after = solved.initial[i], solved.residual[i]
        scale = float(np.abs([*before, *after]).max()) or 1.0
        few = len(before) <= 16
        for channel, v, r in zip(solved.group.channels, before, after, strict=True):
            arrow(left, v, scale, "0.5", 1.4, "--", str(channel) if few else "")
            arrow(left, r, scale, "tab:red", 2.0, "-", "")
            if 1e-9 * scale < abs(r) < 0.04 * scale:  # too short for an arrow
                left.plot([np.angle(r)], [abs(r)], "o", color="tab:red", ms=4)
        left.set_title(f"{name}vibration, {amplitude_unit(found)}", pad=16)
        left.set_rlim(0, 1.12 * scale)
        left.set_rlabel_position(free_direction([*before, *after]))
        masses = found.amount(solved.corrections[i])
        standing = found.amount(solved.standing[i])
        size = float(np.abs([*masses, *standing]).max()) or 1.0
        for plane, w, on in zip(solved.planes, masses, standing, strict=True):
            arrow(right, on, size, "0.5", 1.2, "--", "")
            arrow(right, w, size, "tab:red", 2.6, "-", plane)
        right.set_title(f"{name}corrections to ADD, {amounts}", pad=16)
        right.set_rlim(0, 1.12 * size)
        right.set_rlabel_position(free_direction([*masses, *standing]))
        for axes in (left, right):
            axes.tick_params(labelsize=8, colors="0.3")
            axes.grid(color="0.85")
    handles = [
        Line2D(
            [],
            [],
            color="0.5",
            lw=1.4,
            ls="--",
            label="vibration before" + ("; trial masses left on" if found.request.from_here else ""),
        ),
        Line2D([], [], color="tab:red", lw=2.0, label="predicted vibration; correction, named by its plane"),
    ]
    figure.get_layout_engine().set(rect=(0, 0, 1, 0.985))  # type: ignore[union-attr, call-arg]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), fontsize=9, frameon=False)
    return figure
