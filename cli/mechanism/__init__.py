"""`dalembert mechanism`: positions, velocities, accelerations and jerks of a planar mechanism."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cli.cases.options import BRANCH, CASES, FILE, WORKERS, Options
from cli.show.output import declared_command

if TYPE_CHECKING:
    from cli.show.commands import ShowOptions
    from cli.show.result import Result

EXAMPLE = "klann"
OPTIONS = f"""
{FILE}{CASES}{BRANCH}{WORKERS}
What:
  only NAME,...  Only these: H.x,coupler.omega; H is all of H.
  order position|velocity|acceleration|jerk  How far to differentiate (default: as the input's rates give).
  newton  Newton-Raphson on all loops at once, with its iterates.
  find NAME  Find this dimension: input.speed, links.crank.B.x; the pose is one.
  so_that QUANTITY=VALUE  What it is to give: B.vx=3m_s, crank.torque=12.
Output:
  page FILE(.html)  Write a page on which the mechanism moves.
Further options (docs/commands.md describes them):
  schema  Print the JSON Schema of FILE.toml; needs no FILE.
"""


def print_schema(_: bool) -> None:
    """Print the JSON Schema of a mechanism's file."""
    import json

    import typer

    from virtualwork.describe.schema import schema

    typer.echo(json.dumps(schema(), indent=2, ensure_ascii=False))


@declared_command(OPTIONS, Options, eager={"schema": print_schema})
def run(own: Options, show: ShowOptions) -> Result:
    """Solve the poses of a planar mechanism: positions, velocities, accelerations.

    FILE.toml describes ground, links, slots, sliders, gears, input and guess. The table has a row for each pose: its
    input, every point and link, or those of --only.
    """
    from cli.cases.call import Call
    from cli.mechanism.newton import Poses

    return Call.of(own, show).result(Poses, newton=own.newton)
