"""`dalembert field`: rotors whose vibration was measured, with trial masses."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING

from cli.read.options import (
    bad,
    mass_limits,
    places,
    processes,
    quantity,
    reading_error,
    refuse,
    weights,
    with_unit,
)
from cli.show.output import command

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from matplotlib.figure import Figure

    from cli.field.field_balancing import FieldBalancing
    from cli.field.tables import Tables
    from cli.show.commands import ShowOptions
    from dalembert.results.columns import Column
    from dalembert.results.result import Result, Sheet


METHOD = (
    "Influence coefficients from trial runs (E. L. Thearle 1934), corrections by least squares or by the smallest largest "
    "residual (T. P. Goodman 1964; second-order cone program), all runs of a log fitted together; tolerance after ISO "
    "21940-11, API (4W/N) or MIL-STD-167-1. The masses are at the radius of the trial masses."
)
FEWEST_DRAWS = 40  # they give a standard deviation to a ninth
REQUESTED = (
    "predict", "suggest", "suggest_gain", "robust", "static", "couple", "split", "trim_split", "tolerance", "zones",
)  # fmt: skip
OPTIONS = """
Arguments:
  runs RUNS  CSV of runs; - is standard input.
What:
  influence FILE.csv...  Stored influence coefficients, in place of trial runs.
  runout FILE.csv  Run-out vectors to subtract: sensor, amplitude_*, phase_deg.
  phase_lag  The instrument's phase lags: reverse its sign.
How:
  objective least-squares|minimax=least-squares  Least sum of squares, or least maximum, of the residual vibration.
  max_mass [PLANE=]MASS...  Largest mass of a correction: 5g or A=5g.
  max_residual AMPLITUDE  Largest residual vibration, such as 76um.
  from_here  Give the trim: what to add to the rotor with the masses of its last run.
  reading_error 2%,2deg  Standard deviations of amplitude and phase.
  grade GRADE  Balance quality grade: G6.3, API or MIL.
  blades N(1-10000)  Split the corrections onto N blades.
  save_influence FILE(.csv)  Store the influence coefficients.
Output:
  page FILE(.html)  Write the machine's sheet, a page that computes.
Further options (docs/commands.md describes them):
  fit  Fit all runs together, initial vibration and coefficients.
  predict MASS@ANGLE,…  Predict a run: 10kg@-90deg or A=1g@0deg.
  columns FILE.toml  File of other headers: lines such as mass_g = "Masse".
  rotation ccw|cw  Direction of rotation seen against +z: phases lead in that direction, mass angles are ccw.
  exclude RUN...  Leave a run out of the fit; repeatable.
  method influence|four-run=influence  Influence coefficients, or amplitudes only (an initial run, then three trial runs in each plane).
  monte_carlo N(0-100000)=0  Compute the uncertainties from N drawn sets of readings, 40 or more.
  ridge NUMBER(0-)=0  Damp the corrections of nearly dependent planes, such as 0.1.
  robust  Compute a robust fit in addition (Huber): outliers have little influence on it.
  speed SPEED  Highest service speed, such as 3000rpm, for --grade.
  rotor_mass MASS  Mass of the rotor, such as 120kg, for --grade.
  permissible UNBALANCE  Permissible residual unbalance in place of a grade.
  radius LENGTH  Radius of the trial masses, for the tolerance.
  positions ANGLES  Split the corrections onto these places: 0deg,30deg,60deg.
  stock MASSES  With --blades or --positions: weights in stock, such as 1g,2g,5g; uses the fewest within 1 % of a correction, at most three.
  first ANGLE=0deg  Angle of the first blade.
  numbering with|against=with  Blade numbers increase with the angles or against them.
  suggest  Suggest the most informative next run within --max-mass.
  view static-couple  Show the corrections of two planes as a static part and a couple.
  zone_class 1-rigid|1-flexible|2-rigid|2-flexible  Show zone A to D of ISO 10816-3 for velocities: group 1 (above 300 kW) or 2 (15 to 300 kW), rigid or flexible support.
  workers N=1  Number of processes for many machines.
"""


@command(OPTIONS, example="fan-one-plane")
def run(options: SimpleNamespace, _: ShowOptions) -> Result:
    """Balance rotors from measured vibration and trial masses (influence coefficients).

    RUNS has a row for each run and sensor: run, sensor, amplitude_*, phase_deg, trial_plane, trial_mass_* (or
    trial_unbalance_*), trial_angle_deg, trial_kept (yes: it stays on). In the initial run the last four are empty. Phase
    and mass angle are counted in one sense. docs/field-balancing.md has more.
    """
    if options.columns is not None:
        from dalembert.tables.headers import rename_from

        rename_from(options.columns)
    four_run = options.method == "four-run"
    needs_phase: dict[str, object] = {"influence": options.influence, "runout": options.runout}
    needs_phase |= {
        "reading_error": options.reading_error,
        "phase_lag": options.phase_lag,
        "rotation": options.rotation,
    }
    limited = options.objective == "minimax" or options.max_mass or options.max_residual is not None
    refuse("expected a finite number", ridge=not options.ridge < float("inf"))
    refuse("goes with the least-squares objective without limits", ridge=options.ridge and limited)
    if four_run:
        refuse("has no meaning with --method four-run, which uses no phase", **needs_phase)
    no_trials = "has no meaning with --influence: there are no trial masses"
    refuse(no_trials, from_here=options.from_here and options.influence)
    refuse("needs --reading-error", monte_carlo=options.monte_carlo and options.reading_error is None)
    if 0 < options.monte_carlo < FEWEST_DRAWS:
        spread = 100 / (2 * options.monte_carlo) ** 0.5
        few = f"{options.monte_carlo} drawn set{'s' * (options.monte_carlo > 1)} of readings give a standard deviation to {spread:.0f} % only"
        raise bad("--monte-carlo", f"{few}: expected {FEWEST_DRAWS} at least")
    chosen = places(options.positions, options.blades, options.first, options.numbering)
    in_stock = weights("--stock", options.stock)
    refuse("expected --positions or --blades for the weights to go to", stock=in_stock and not chosen)
    refuse("the sheet that --page writes has no stock of weights", stock=in_stock and options.page)
    arm = quantity("--radius", options.radius, "length", positive=True)

    from cli.field.field_balancing import FieldBalancing
    from cli.field.fit import Request, measured_groups
    from cli.read.rotor_options import tolerance_of

    same = (
        "objective", "from_here", "monte_carlo", "ridge", "phase_lag", "rotation", "fit", "predict", "suggest", "robust", "view",
        "zone_class",
    )  # fmt: skip
    request = Request(
        **{name: getattr(options, name) for name in same},
        reading_error=reading_error(options.reading_error),
        tolerance=tolerance_of(options.grade, options.speed, options.rotor_mass, options.permissible, None),
        max_mass=mass_limits(options.max_mass or []),
        max_residual=with_unit("--max-residual", options.max_residual, "amplitude", positive=True),
        four_run=four_run,
        radius=arm,
        places=chosen,
        stock=in_stock,
        exclude=options.exclude or (),
    )
    measured, stored = measured_groups(options.runs, request, options.influence or (), options.runout)
    with processes(options.workers) as executor:
        balancing = FieldBalancing(measured, request, stored, executor)
    return _result(balancing, options.save_influence, options.page)


def _tables(b: FieldBalancing, warnings: list[str]) -> Tables:
    """The tables of a result, the CSV's first. `warnings` takes the reasons why --digits prints a number in full."""
    from functools import cache

    from cli.field import fit_tables as read
    from cli.field import tables as to_add

    request = b.request
    further: list[Column] = []
    made: Tables = {
        "corrections": cache(lambda: to_add.corrections(b, warnings)),
        "influence": lambda: read.influence(b),
        "prediction": lambda: read.prediction(b),
    }
    if request.places is not None:
        on = any(solved.standing.any() for solved in b.solved)
        made["split"] = lambda: to_add.split(b, lambda rotor: rotor.solved.corrections, "corrections")
        made["trim_split"] = lambda: to_add.split(b, lambda rotor: rotor.solved.trim, "trim", shown=on)
    made |= {
        "trim": lambda: to_add.trim(b),
        "standing": lambda: to_add.standing(b),
        "rotors": lambda: to_add.rotors(b, further),
    }
    if request.tolerance is not None:
        made["tolerance"] = lambda: to_add.tolerance(b)
    if request.zone_class is not None:
        made["zones"] = lambda: read.zones(b)
    if request.four_run:
        made |= {"misfit": lambda: read.misfit(b), "alternatives": lambda: read.alternatives(b)}
    if request.view is not None:
        made |= {"static": lambda: to_add.static_couple(b, 0), "couple": lambda: to_add.static_couple(b, 1)}
    if not b.runs.fitted:
        return made
    made |= {
        "residuals": lambda: read.residuals(b),
        "fit": lambda: read.of_fit(b),
        "fit_initial": lambda: read.initial(b),
    }
    if any(solved.group.drift is not None for solved in b.solved):
        made["drift"] = lambda: read.drift_rates(b)
    if b.predict is not None:
        made["predict"] = lambda: read.predicted_run(b)
    if request.suggest:
        further.append(read.unsuggested(b))
        made |= {"suggest": lambda: read.suggested_run(b), "suggest_gain": lambda: read.suggested_gain(b)}
    if request.robust:
        of = cache(lambda solved: read.robust(b, solved))
        made["robust"] = lambda: read.robust_corrections(b, of)
        made["robust_initial"] = lambda: read.robust_initial(b, of)
    return made


def _result(b: FieldBalancing, save_influence: Path | None, page: Path | None) -> Result:
    from balancing.runs.runs import latest
    from cli.field.remarks import sense, warnings
    from cli.field.rotor import each, way
    from dalembert.results.result import Result

    remarks, day = warnings(b), latest(b.runs.table)
    made = _tables(b, remarks)

    def stored() -> bytes:
        from dalembert.results.text import csv_text

        return csv_text(made["influence"]().cells).encode()

    def sheets() -> Iterator[Sheet]:
        from cli.field.report import sheets

        return sheets(b, made)

    def figure() -> Figure:
        from cli.field.report import draw

        return draw(b, list(each(b, 3)))

    beside: dict[Path, Callable[[], bytes]] = {} if save_influence is None else {save_influence: stored}
    if page is not None:
        from cli.field.report import machine_page

        html = machine_page(b).html.encode()
        beside[page] = lambda: html
    return Result(
        tables=made,
        head={
            "correction": "add",
            "state": "as it stands" if b.request.from_here else "initial",
            "convention": sense(b),
            "amplitude_unit": b.runs.amplitude_unit,
        },
        requested=REQUESTED,
        companions=[name for name in ("prediction", "split", "predict", "zones") if name in made],
        figure=figure,
        method=METHOD,
        sheets=sheets,
        shows_input=True,
        about={"title": "Balancing in the field"} | ({} if day is None else {"date": day}),
        way=lambda: way(b),
        beside=beside,
        warnings=remarks,
    )
