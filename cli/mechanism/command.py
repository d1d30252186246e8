"""`dalembert mechanism`: position, velocity, acceleration and jerk of a planar mechanism."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cli.mechanism.options import Options
from cli.show.output import command

if TYPE_CHECKING:
    from cli.show.columns import Result
    from cli.show.commands import ShowOptions

EXAMPLE = "klann"
OPTIONS = """
Arguments:
  file FILE.toml  The mechanism; - is standard input.
What:
  at INPUT  A pose, such as 60deg, 20mm or crank=60deg,arm=30deg; repeatable.
  sweep START:STOP:STEP  Such as 0deg:360deg:1deg or 0deg:360deg/3600.
  inputs FILE.csv  The inputs as a table: crank_deg, ..., perhaps time_s.
  only NAME,...  These links and points; nothing else is computed.
  branch all|NUMBER  Every assembly, or one of them.
Variants:
  change --set PATH=VALUE  Another number in place of the file's, such as links.crank.B.x=62mm; repeatable.
  vary PATH=FROM:TO:STEP  Variants over a range, such as links.crank.B.x=50mm:60mm:1mm; repeatable: the grid of all.
  variants FILE.csv  Variants as a table: a column for each path, links.crank.B.x_mm, a row for each variant.
  tolerance  What [tolerances] of the file do to every number shown.
  draws N  Draw so many mechanisms within the tolerances, and solve each.
  seed  Of what is drawn, and of --fit.
  distribution  Of what is drawn: a limit is three standard deviations, or the end.
  workers N  Processes that solve variants, draws, or the starts of a fit.
Fitting:
  fit TARGET.csv  Dimensions that come nearest to these places; repeatable.
  point NAME  Of --fit: x and y of a point; repeatable.
  link NAME  Of --fit: the angle of a link; repeatable.
  slide NAME  Of --fit: the travel along the guide at a point; repeatable.
  free PATH=LOW:HIGH  With --fit: a dimension and its bounds; repeatable.
  weight NAME=NUMBER  Of --fit: a row counts so often; repeatable.
  starts N  Of --fit: where it begins (default 256).
  best N  Of --fit: the best distinct solutions.
How:
  order  How far to differentiate (default: as the file's input gives it).
  newton  All loops at once by Newton-Raphson from the guess, with its iterates.
  time START:STOP:STEP  Let go of the inputs: the motion under the loads, such as 0:10:0.01 (seconds).
  accuracy NUMBER  With --time: the wanted error of the inputs (default 1e-9).
  until INPUT=VALUE  With --time: end where an input has a value, crank=90deg.
Output: of the mechanism:
  check  Mobility, Grashof classes, limits, dead and change points, groups.
  explain  The order of solution, and what was skipped.
  forces  The input's effort, every joint reaction, the shaking force.
  equilibrium  Where the loads balance without effort, and whether stably.
  flywheel COEFFICIENT  Inertia for this speed fluctuation, such as 0.02.
  counterweights LINK,...  Counterweights on these links that leave the least shaking force.
  graph NAME.QUANTITY,...  --plot draws these against the input, such as H.x,coupler.omega.
  states FILE.csv  Write a row for each pose and link to FILE: what `dalembert work` reads.
  html FILE.html  Write a page that moves to FILE: play, slider, curves, values; with --forces their arrows.
  schema  Print the JSON Schema of FILE.toml, for editors; needs no FILE.
"""


@command(OPTIONS, Options)
def run(asked: Options, show: ShowOptions) -> Result:
    """Solve a planar mechanism: positions, velocities, accelerations, its limits and its assemblies.

    FILE.toml describes ground, links, slots, sliders, gears, input and guess. The table has a row for each pose: its
    input, every point and link, or those of --only; with --forces the forces. In a pipe --check, --equilibrium,
    --flywheel, --counterweights and --newton give their own table in place of the poses.
    """
    from cli.mechanism.calls import answer

    return answer(asked, show)
