"""`dalembert simulate`: the motion in time under the loads."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cli.cases.options import BRANCH, CASES, FILE, WORKERS, Options
from cli.show.output import declared_command

if TYPE_CHECKING:
    from cli.show.commands import ShowOptions
    from cli.show.result import Result

EXAMPLE = "double-pendulum"
OPTIONS = f"""
{FILE}{CASES}{BRANCH}{WORKERS}
What:
  only NAME,...  Show these quantities in addition: H.x,coupler.omega; H is all of H.
  forces  Show the joint forces in addition.
How:
  time START:STOP:STEP  Times in seconds: 0:10:0.01 or 0:10/1000; required.
  accuracy NUMBER  Wanted error of the inputs (default 1e-9).
  until INPUT=VALUE  Stop where an input reaches a value: crank=90deg.
Output:
  page FILE(.html)  Write a page that replays the motion.
"""


@declared_command(OPTIONS, Options)
def run(own: Options, show: ShowOptions) -> Result:
    """Simulate a mechanism whose inputs are released: its motion in time under the loads of FILE.toml.

    The inputs start at the first time with the file's angle (or position) and speed; --at, --over and --cases set
    other starts. The table has a row for each time: the inputs, the energy, and what --only names.
    """
    from cli.cases.call import Call
    from cli.read.options import bad
    from cli.simulate.motion import Simulation, times_and_accuracy

    if own.time is None:
        raise bad("--time", "expected the times, such as --time 0:10:0.01")
    if own.until is not None and own.page is not None and (own.over or own.cases):
        raise bad("--until", "expected no --page: its variants have one clock; --set shows one of them")
    times, accuracy = times_and_accuracy(own.time, own.accuracy)
    call = Call.of(own, show, 2, forces=own.forces).started()
    return call.result(Simulation, times=times, accuracy=accuracy, until=own.until)
