"""The states of a body in time as columns, and as the JSON document."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from cli.show.columns import Column, Table
from cli.spin.read import Array
from cli.spin.solve import Rotation

if TYPE_CHECKING:
    from cli.show.columns import Document


def states(found: Rotation) -> Table:
    """A row for each time."""
    s = found.states

    def bound(of: str, i: int | None = None) -> Array:
        return found.bounds[of] if i is None else found.bounds[of][:, i]

    # a turn by an angle moves a quaternion by half of it
    def half(of: str) -> Array:
        return found.bounds[of] / 2

    columns = [Column("t", "s", found.time + 0.0)]
    for of, unit, axes in (
        ("omega", "rad_s", "xyz"),
        ("attitude", "", "wxyz"),
        ("momentum", "kg_m2_s", "xyz"),
    ):
        for i, axis in enumerate(axes):
            error = partial(half, of) if of == "attitude" else partial(bound, of, i)
            columns.append(Column(f"{of}_{axis}", unit, getattr(s, of)[:, i] + 0.0, error))
    columns.append(Column("energy", "J", s.energy + 0.0, partial(bound, "energy")))
    return Table(columns)


def document(found: Rotation) -> Document:
    """The JSON document."""
    s = found.states
    rows = zip(
        found.time.tolist(),
        (s.omega + 0.0).tolist(),
        (s.attitude + 0.0).tolist(),
        (s.momentum + 0.0).tolist(),
        s.energy.tolist(),
        strict=True,
    )
    names = ("t_s", "omega_rad_s", "attitude", "momentum_kg_m2_s", "energy_J")
    return {
        "states": [dict(zip(names, row, strict=True)) for row in rows],
        "method": "exact" if found.exact else found.integrator,
        "drift": found.drift,
        "period_s": found.period,
        "nutation_period_s": found.nutation_period,
        "cones": found.cones(),
        "steady": found.steady(),
    }
