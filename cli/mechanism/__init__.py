"""The commands on a planar mechanism: which options each takes, and the study that it runs.

`mechanism`, `forces`, `inspect`, `equilibrium`, `simulate`, `tolerance` and `fit` each have one study here (`poses.py`,
`cycle.py`, `inspection.py`, `equilibria.py`, `simulation.py`, `tolerances.py`, `fits.py`), which `cli/cases` runs for
every case. `work` balances a table of link states without a mechanism (`virtual_power.py`).
"""

from __future__ import annotations

from functools import partial
from types import SimpleNamespace
from typing import TYPE_CHECKING

import typer

from cli.read.options import bad, plane_vector, refuse, time_range
from cli.show.output import command

if TYPE_CHECKING:
    from cli.show.commands import ShowOptions
    from dalembert.results.result import Result

# -- the options that several of them take ----------------------------------------------------------------------

FILE = """
Arguments:
  file FILE.toml  The mechanism; - is standard input.
"""
SET = """
  set NAME=VALUE...  Change a dimension: links.crank.B.x=62mm; repeatable.
"""
OVER = f"""
  over RANGE...  Range of the input, 0deg:360deg:1deg or 0deg:360deg/360; of any input or dimension, NAME=FROM:TO:STEP; repeatable.
  cases FILE.csv  Table with a row for each case, a column for each input or dimension (crank_deg, t_s, links.crank.B.x_mm).
{SET}"""
CASES = f"""
Which poses, which mechanism:
  at INPUT...  Pose: 60deg, 20mm, crank=60deg,arm=30deg; repeatable.
{OVER}"""
# without help: a command that searches a range of the input, or has no single pose, refuses it by a message of its own
RANGES = f"""
Which range, which mechanism:
  at INPUT...
{OVER}"""
VARIANTS = f"""
Which mechanism:
  at INPUT...
  over RANGE...  Range of a dimension: NAME=FROM:TO:STEP; repeatable.
  cases FILE.csv  Table with a row for each variant, a column for each dimension (links.crank.B.x_mm).
{SET}"""
BRANCH = """
  branch all|NUMBER  Every assembly, or one (default: that of the guess).
"""
WORKERS = """
  workers N  Number of processes for many variants.
"""
ORDER = """
  order position|velocity|acceleration|jerk  Highest derivative (default: the highest that the input's rates give).
"""
FIND = """
  find NAME  Dimension to find: input.speed, links.crank.B.x.
  so_that QUANTITY=VALUE  With --find: wanted value of a quantity, such as B.vx=3m_s or crank.torque=12.
"""

# -- the commands -----------------------------------------------------------------------------------------------


def print_schema(_: bool) -> None:
    """Print the JSON Schema of a mechanism's file."""
    import json

    from virtualwork.describe.schema import schema

    typer.echo(json.dumps(schema(), indent=2, ensure_ascii=False))


@command(
    f"""{FILE}{CASES}{BRANCH}{WORKERS}
Quantities:
  only NAME,...  Show only these quantities: H.x,coupler.omega; H is all of H.
{ORDER}{FIND}
Output:
  newton  Solve all loops at once by Newton-Raphson too, and show the iterates.
  page FILE(.html)  Write a page that computes: the mechanism moves, and its dimensions can be dragged.
Further options (docs/commands.md describes them):
  schema  Print the JSON Schema of FILE.toml; no FILE is needed.
""",
    eager={"schema": print_schema},
    example="klann",
)
def mechanism(options: SimpleNamespace, show: ShowOptions) -> Result:
    """Solve the poses of a planar mechanism: positions, velocities, accelerations.

    FILE.toml describes ground, links, slots, sliders, gears, input and guess. The table has a row for each pose: its
    input, every point and link, or what --only names.
    """
    from cli.cases.cases import Cases
    from cli.cases.loop import result
    from cli.mechanism.poses import Poses

    study = Poses(Cases.of(options), show, find=options.find, so_that=options.so_that, newton=options.newton)
    return result(study, options)


@command(
    f"""{FILE}{CASES}{BRANCH}{WORKERS}
Quantities:
  only NAME,...  Show only these: crank.torque,B.coupler.fx,H.x.
{FIND}
Over a whole cycle:
  flywheel NUMBER  Compute the flywheel for this fluctuation of speed, such as 0.02.
  counterweights LINK,...  Compute counterweights on these links for the least shaking force.
Output:
  page FILE(.html)  Write a page that computes: the mechanism moves, with its forces as arrows.
  states FILE(.csv)  Write the states of all links, as dalembert work reads them.
""",
    example="door-closer",
)
def forces(options: SimpleNamespace, show: ShowOptions) -> Result:
    """Compute the forces of a planar mechanism: effort at the inputs, joint forces, shaking force.

    The loads of FILE.toml act: gravity, forces, torques, springs, friction and the inertia of its masses. The table has
    a row for each pose. A whole cycle gives mean, peak, r.m.s., power and energy in addition.
    """
    from cli.cases.analysis import names
    from cli.cases.cases import Cases
    from cli.cases.loop import result
    from cli.mechanism.cycle import Forces

    weights = names(options.counterweights, "--counterweights", "names of links, such as crank, rocker")
    study = Forces(
        Cases.of(options, forces=True),
        show,
        find=options.find,
        so_that=options.so_that,
        flywheel=options.flywheel,
        counterweights=weights,
        states=options.states,
    )
    study.check_options()
    return result(study, options)


@command(
    f"""{FILE}{VARIANTS}{WORKERS}
Quantities:
  only NAME,...  Count the operations of these quantities in addition: H.x,coupler.omega,crank.torque.
""",
    example="watt-six-bar",
)
def inspect(options: SimpleNamespace, show: ShowOptions) -> Result:
    """Inspect a planar mechanism: mobility, groups, Grashof classes, limits, dead and change points, strokes.

    The results hold for the whole range of the input. A terminal shows the order of solution in addition.
    """
    from cli.cases.cases import Cases
    from cli.cases.loop import result
    from cli.mechanism.inspection import Inspection

    cases = Cases.of(options, forces=True)
    cases.refuse_inputs(
        "inspect covers the whole range of the input: expected a dimension, links.crank.B.x=..."
    )
    return result(Inspection(cases, show), options)


@command(f"{FILE}{RANGES}{WORKERS}", example="desk-lamp")
def equilibrium(options: SimpleNamespace, show: ShowOptions) -> Result:
    """Find the positions in which a mechanism rests under its loads without effort, and their stability.

    A stable position has its period of small oscillations, without dampers and friction. --over or --cases of an
    input set the range of the search. The default is one turn, or as many turns as the loads need to repeat. Where
    they never repeat (turns wind up a torsion spring), it is one turn either way of the guess, or the range between
    the limits; for a slide, two sizes of the mechanism either way.
    """
    from cli.cases.cases import Cases
    from cli.cases.loop import result
    from cli.mechanism.equilibria import Equilibria

    cases = Cases.of(options)
    if options.at:
        raise bad(
            "--at",
            "equilibrium searches a range of the input: expected --over, such as --over 0deg:90deg:1deg",
        )
    return result(Equilibria(cases, show), options)


@command(
    f"""{FILE}{CASES}{BRANCH}{WORKERS}
Time and accuracy:
  time START:STOP:STEP  Times in seconds: 0:10:0.01 or 0:10/1000; required.
  accuracy NUMBER  Permissible error of the inputs (default 1e-9).
  until INPUT=VALUE...  Stop where an input reaches a value: crank=90deg; repeatable, the first ends the motion.
Quantities:
  only NAME,...  Show these quantities in addition: H.x,coupler.omega; H is all of H.
  forces  Show the joint forces in addition.
Output:
  page FILE(.html)  Write a page that replays the motion.
""",
    example="double-pendulum",
)
def simulate(options: SimpleNamespace, show: ShowOptions) -> Result:
    """Simulate a mechanism whose inputs are released: its motion in time under the loads of FILE.toml.

    The inputs start at the first time with the file's angle (or position) and speed; --at, --over and --cases set
    other starts. The table has a row for each time: the inputs, the energy, and what --only names.
    """
    from cli.cases.cases import Cases
    from cli.cases.loop import result
    from cli.mechanism.simulation import Simulation

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


@command(
    f"""{FILE}{CASES}{WORKERS}
Quantities:
  only NAME,...  Show only these quantities: H.x,coupler.angle,crank.torque; H is all of H.
{ORDER}
Drawn mechanisms:
  draws N  Number of mechanisms drawn at random within the tolerances.
  seed N(0-)  With --draws: random seed (default 0).
  distribution normal|uniform  With --draws: normal (default; a limit is three standard deviations) or uniform (a limit is an end).
""",
    example="tolerances",
)
def tolerance(options: SimpleNamespace, show: ShowOptions) -> Result:
    """Compute the effect of the [tolerances] of FILE.toml on the motion: worst case, standard deviation, shares.

    Worst case and standard deviation are of first order, from exact derivatives. --draws solves drawn mechanisms in
    addition. The table has a row for each pose.
    """
    from cli.cases.analysis import unknown
    from cli.cases.cases import Cases
    from cli.cases.loop import result
    from cli.mechanism.tolerances import Spreads
    from dalembert.dataclass import replace
    from virtualwork.quantities import places

    if options.draws is not None and options.draws < 2:
        raise bad("--draws", f"{options.draws}: expected two or more drawn mechanisms")
    if options.draws is None:
        refuse("needs --draws", seed=options.seed is not None, distribution=options.distribution)
    cases = Cases.of(options)
    only = cases.request.only
    if only is not None and unknown(places(cases.mechanism, 3, only), only) is not None:
        cases = replace(cases, request=cases.request._replace(forces=True))
    # worker processes solve the variants, or what is drawn of one mechanism
    workers = 1 if cases.varied is not None else options.workers or 1
    study = Spreads(
        cases,
        show,
        draws=options.draws or 0,
        seed=options.seed or 0,
        distribution=options.distribution or "normal",
        workers=workers,
    )
    return result(study, options)


@command(
    f"""{FILE}  target TARGET.csv...  The target: columns H_x_mm, H_y_mm, coupler_angle_deg, crank_torque_N_m, optionally input_deg.
{VARIANTS}{WORKERS}
Target and free dimensions:
  want NAME...  Quantity that meets the target: H, H.y, coupler.angle, B.position, crank.torque; repeatable.
  free NAME=LOW:HIGH...  Dimension to fit, with its bounds; repeatable.
  weight NAME=NUMBER...  Weight of a wanted quantity (default 1); repeatable.
  keep QUANTITY>=VALUE...  Constraint over the range of the input: transmission>=40deg, H.y<=0.3m; repeatable.
Search:
  starts N  Number of starting points (default 256).
  best N  Number of distinct solutions (default 1).
  seed N(0-)=0  Random seed of the starting points.
""",
    forms=[".toml"],
    example="straight-line-fit",
)
def fit(options: SimpleNamespace, show: ShowOptions) -> Result:
    """Fit dimensions of a mechanism to a target: a path, a function of the input, a guided body, an effort.

    Where the target has no column for the input, the input is free at each row, and the rows keep their order.
    --keep holds from the first to the last input of the target, or over a whole turn where the input is free.
    -o FILE.toml writes the mechanism's file with the fitted numbers.
    """
    from cli.cases.cases import Cases, naming
    from cli.cases.loop import result
    from cli.mechanism.fits import STARTS, Fits, aims, bounds
    from cli.mechanism.targets import kept

    for flag, value, example in (
        ("--want", options.want, "--want H"),
        ("--free", options.free, "--free NAME=LOW:HIGH"),
    ):
        if not value:
            raise bad(flag, f"missing: expected {example}")
    cases = Cases.of(options)
    if cases.varied is not None and show.form == ".toml":
        raise bad(
            "-o",
            f"'{show.output}': expected one mechanism, such as --set NAME=VALUE makes, or a table (.csv)",
        )
    cases.refuse_inputs("the rows of the target have the inputs: expected a dimension, links.crank.B.x=...")
    with naming(options.file):
        targets = aims(cases.mechanism, options.target, options.want, options.weight, cases.warnings)
        free = bounds(cases.mechanism, options.free, cases.bare)
        keep = kept(cases.mechanism, options.keep, cases.bare)
    # worker processes fit the variants, or the starts of one mechanism
    workers = 1 if cases.varied is not None else options.workers or 1
    study = Fits(
        cases,
        show,
        aims=targets,
        free=free,
        keep=keep,
        starts=options.starts or STARTS,
        seed=options.seed,
        best=options.best or 1,
        workers=workers,
    )
    return result(study, options)


@command(
    """
Arguments:
  states STATES  CSV of link states with the unknown marked ?; - is standard input.
What:
  gravity GX,GY  Gravity, m/s², such as 0,-9.81 (default: none).
Output:
  ledger  Show the power of every load (default: the unknowns).
""",
    example="riul-slider-crank",
)
def work(options: SimpleNamespace, _: ShowOptions) -> Result:
    """Find the unknown force or torque that balances a table of link states, by virtual power.

    STATES has a row for each link, at each step (instant). Its columns are step, link, mass_*, inertia_*; vx_* vy_* and
    ax_* ay_* of the centre of mass; omega_*, alpha_*; the applied force fx_* fy_* with the velocity fvx_* fvy_* of its
    point; torque_*. The star is a unit: mass_kg, vx_m_s, omega_rad_s, torque_N_m. Empty cells are zero; an empty fv is
    the velocity of the centre of mass. One cell of a force or torque holds ?. Several unknowns are marked ?NAME; they
    need as many fields of virtual velocities, named in a column field.
    """
    g = 0j if options.gravity is None else plane_vector("--gravity", options.gravity, "acceleration")
    from cli.mechanism.virtual_power import METHOD, draw, tables, way
    from dalembert.results.result import Result
    from virtualwork.textbook.state_table import read_states
    from virtualwork.textbook.table_balance import WorkBalance

    table = read_states(options.states)
    balance = WorkBalance(table, g)
    weightless = (
        ["--gravity: there is no column mass_*: no weights from it"]
        if g and "mass" not in table.values
        else []
    )

    return Result(
        tables=tables(balance, ledger_first=options.ledger),
        figure=partial(draw, balance),
        method=METHOD,
        way=partial(way, balance),
        about={"title": "Balance of virtual power"},
        warnings=[*table.table.warnings, *table.warnings, *weightless, *balance.warnings],
    )
