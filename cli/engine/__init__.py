"""`dalembert engine`: shaking forces and couples of engines of several cylinders."""

from __future__ import annotations

from functools import partial
from types import SimpleNamespace
from typing import TYPE_CHECKING

from cli.read.options import bad, needed
from cli.show.output import command

if TYPE_CHECKING:
    from cli.show.commands import ShowOptions
    from dalembert.results.result import Result


OPTIONS = """
Arguments:
  cylinders CYLINDERS  CSV with a row for each cylinder; - is standard input.
What:
  speed SPEED  Speed of the crankshaft, such as 3000rpm.
  order N(1-100)=8  Highest order: the highest multiple of the speed that is computed.
Counterweights and balance shafts:
  counterweight_share NUMBER(0-1)  Share of the reciprocating masses that counterweights balance, such as 0.5. They balance the rotating masses too.
  plane NAME:Z:RADIUS...  Plane of counterweights, such as A:0mm:60mm; repeatable (default: opposite each crank pin).
  shaft ORDER:Z:with|against...  Balance shaft at ORDER times the speed, with or against the crank, such as 2:150mm:against; repeatable.
"""


@command(OPTIONS, example="inline-four")
def run(options: SimpleNamespace, _: ShowOptions) -> Result:
    """Compute the shaking forces and couples of an engine by exact orders, and the residuals after counterweights and
    balance shafts.

    CYLINDERS has the columns cylinder, crank_deg, bank_deg, z_*, throw_*, rod_*, reciprocating_* and rotating_* (masses).
    The star is a unit. The crank pin stands at θ + crank_deg. bank_deg is the direction of the cylinder's axis,
    counter-clockwise from +x (default 90). Forces are those on the frame, couples are Σ z·F about z = 0. One shaft
    balances a force; two of one order and sense balance force and couple.
    """
    from cli.engine.cylinders import Engine, read_cylinders, read_shafts
    from cli.engine.tables import METHOD, draw, tables, warnings, way
    from cli.read.rotor_options import from_options
    from dalembert.results.result import Result

    if options.speed is None:
        raise bad("--speed", "expected the speed of the crankshaft, such as --speed 3000rpm")
    omega = needed("--speed", options.speed, "speed", positive=True)
    planes = None if options.plane is None else from_options(options.plane)
    read = read_cylinders(options.cylinders)
    engine = Engine(
        read,
        omega,
        options.order,
        options.counterweight_share,
        planes,
        read_shafts(options.shaft or [], options.order),
        read.pins,
    )

    return Result(
        way=partial(way, engine),
        tables=tables(engine),
        figure=partial(draw, engine),
        method=METHOD,
        about={"title": "Balance of an engine"},
        warnings=[*engine.cylinders.table.warnings, *warnings(engine)],
    )
