"""`dalembert simulate`: the motion in time under the loads."""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING

from cli.cases import BRANCH, CASES, FILE, WORKERS
from cli.read.options import bad, time_range
from cli.show.output import command

if TYPE_CHECKING:
    from cli.show.commands import ShowOptions
    from cli.show.result import Result

EXAMPLE = "double-pendulum"
OPTIONS = f"""
{FILE}{CASES}{BRANCH}{WORKERS}
Time and accuracy:
  time START:STOP:STEP  Times in seconds: 0:10:0.01 or 0:10/1000; required.
  accuracy NUMBER  Permissible error of the inputs (default 1e-9).
  until INPUT=VALUE...  Stop where an input reaches a value: crank=90deg; repeatable, the first ends the motion.
Quantities:
  only NAME,...  Show these quantities in addition: H.x,coupler.omega; H is all of H.
  forces  Show the joint forces in addition.
Output:
  page FILE(.html)  Write a page that replays the motion.
"""


@command(OPTIONS)
def run(options: SimpleNamespace, show: ShowOptions) -> Result:
    """Simulate a mechanism whose inputs are released: its motion in time under the loads of FILE.toml.

    The inputs start at the first time with the file's angle (or position) and speed; --at, --over and --cases set
    other starts. The table has a row for each time: the inputs, the energy, and what --only names.
    """
    from cli.cases.cases import Cases
    from cli.cases.loop import result
    from cli.simulate.motion import Simulation

    if options.time is None:
        raise bad("--time", "expected the times, such as --time 0:10:0.01")
    until = ",".join(options.until or ()) or None
    if until is not None and options.page is not None and (options.over or options.cases):
        raise bad(
            "--until",
            "--page shows all variants at the same time: expected no --until, or one mechanism by --set",
        )
    times, accuracy = times_and_accuracy(options.time, options.accuracy)
    cases = Cases.of(options, 2, forces=options.forces).at_start()
    study = Simulation(cases, show, times=times, accuracy=accuracy, until=until)
    return result(study, options)


def times_and_accuracy(time: str, accuracy: float | None) -> tuple[list[float], float]:
    """Read the times and the accuracy."""
    times = time_range("--time", time)
    if len(times) > 1 and times[1] < times[0]:
        raise bad("--time", f"'{time}': expected rising times")
    value = 1e-9 if accuracy is None else accuracy
    if not 0 < value < 1:
        raise bad("--accuracy", f"{accuracy}: expected a number between 0 and 1, such as 1e-9")
    return times, value
