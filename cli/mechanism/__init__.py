"""`dalembert mechanism`: positions, velocities, accelerations and jerks of a planar mechanism."""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING

import typer

from cli.cases import BRANCH, CASES, FILE, WORKERS
from cli.show.output import command

if TYPE_CHECKING:
    from cli.show.commands import ShowOptions
    from cli.show.result import Result

EXAMPLE = "klann"
OPTIONS = f"""
{FILE}{CASES}{BRANCH}{WORKERS}
Quantities:
  only NAME,...  Show only these quantities: H.x,coupler.omega; H is all of H.
  order position|velocity|acceleration|jerk  Highest derivative (default: the highest that the input's rates give).
  find NAME  Dimension to find: input.speed, links.crank.B.x.
  so_that QUANTITY=VALUE  With --find: wanted value of a quantity, such as B.vx=3m_s or crank.torque=12.
Output:
  newton  Solve all loops at once by Newton-Raphson too, and show the iterates.
  page FILE(.html)  Write a page that computes: the mechanism moves, and its dimensions can be dragged.
Further options (docs/commands.md describes them):
  schema  Print the JSON Schema of FILE.toml; no FILE is needed.
"""


def print_schema(_: bool) -> None:
    """Print the JSON Schema of a mechanism's file."""
    import json

    from virtualwork.describe.schema import schema

    typer.echo(json.dumps(schema(), indent=2, ensure_ascii=False))


@command(OPTIONS, eager={"schema": print_schema})
def run(options: SimpleNamespace, show: ShowOptions) -> Result:
    """Solve the poses of a planar mechanism: positions, velocities, accelerations.

    FILE.toml describes ground, links, slots, sliders, gears, input and guess. The table has a row for each pose: its
    input, every point and link, or what --only names.
    """
    from cli.cases.cases import Cases
    from cli.cases.loop import result
    from cli.mechanism.solution import Poses

    study = Poses(Cases.of(options), show, find=options.find, so_that=options.so_that, newton=options.newton)
    return result(study, options)
