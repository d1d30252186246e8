"""`dalembert work`: the balance of virtual power of a table of link states."""

from __future__ import annotations

from functools import partial
from types import SimpleNamespace
from typing import TYPE_CHECKING

from cli.read.options import plane_vector
from cli.show.output import command

if TYPE_CHECKING:
    from cli.show.commands import ShowOptions
    from dalembert.results.result import Result


METHOD = (
    "Virtual power: the applied forces and the inertia forces −m·a, −I·α together do no work on the given velocities "
    "(d'Alembert and Lagrange; J. A. Riul, Dinâmica das Máquinas, unit II, eqs. 1–5)."
)
OPTIONS = """
Arguments:
  states STATES  CSV of link states with the unknown marked ?; - is standard input.
What:
  gravity GX,GY  Gravity, m/s², such as 0,-9.81 (default: none).
Output:
  ledger  Show the power of every load (default: the unknowns).
"""


@command(OPTIONS, example="riul-slider-crank")
def run(options: SimpleNamespace, _: ShowOptions) -> Result:
    """Find the unknown force or torque that balances a table of link states, by virtual power.

    STATES has a row for each link, at each step (instant). Its columns are step, link, mass_*, inertia_*; vx_* vy_* and
    ax_* ay_* of the centre of mass; omega_*, alpha_*; the applied force fx_* fy_* with the velocity fvx_* fvy_* of its
    point; torque_*. The star is a unit: mass_kg, vx_m_s, omega_rad_s, torque_N_m. Empty cells are zero; an empty fv is
    the velocity of the centre of mass. One cell of a force or torque holds ?. Several unknowns are marked ?NAME; they
    need as many fields of virtual velocities, named in a column field.
    """
    g = 0j if options.gravity is None else plane_vector("--gravity", options.gravity, "acceleration")
    from cli.work.power import WorkBalance, draw, tables, way
    from cli.work.states import read_states
    from dalembert.results.result import Result

    table = read_states(options.states)
    balance = WorkBalance(table, g)

    return Result(
        tables=tables(balance, ledger_first=options.ledger),
        figure=partial(draw, balance),
        method=METHOD,
        way=partial(way, balance),
        about={"title": "Balance of virtual power"},
        warnings=[*table.table.warnings, *table.warnings, *balance.warnings],
    )
