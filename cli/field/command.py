"""`dalembert field`: rotors whose vibration was measured, with trial masses."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from cli.read import options
from cli.show.commands import suffix_among
from cli.show.output import command

if TYPE_CHECKING:
    from collections.abc import Iterator

    from matplotlib.figure import Figure

    from cli.field.solve import FieldBalancing
    from cli.show.columns import Document, Result, Sheet, Table


EXAMPLE = "fan-one-plane"
OPTIONS = """
Arguments:
  runs RUNS  CSV of runs; - is standard input.
What:
  influence COEFFICIENTS.csv  Stored coefficients in place of trial runs; of several machines (repeatable), or with uncertainties: prior knowledge of a fit.
  runout FILE.csv  Run-out vectors: sensor, amplitude_*, phase_deg.
  phase_lag  The instrument's phase lags.
  rotation  Seen against +z: phases lead in that sense, mass angles are ccw.
  exclude RUN  Leave a run out of the fit; repeatable.
  signal FILE.csv  Once-per-turn vectors of a recording: t_s, mark, A_um …; no RUNS.
  pulses  Pulses of the mark in a turn, for --signal.
  workers N  Processes that solve what each of many machines needs alone.
How:
  objective  Least sum of squares of the residuals, or the smallest largest one.
  max_mass [PLANE=]MASS  Limit of each correction (5g), or of one plane's (A=5g).
  max_residual AMPLITUDE  No residual beyond this, such as 76um.
  from_here  What to add to the rotor as it stands, kept trial masses on.
  reading_error 2%,2deg  Standard deviations of amplitude and phase: adds uncertainties.
  monte_carlo N  Uncertainties from N drawn sets of readings.
  method  By influence coefficients, or by amplitudes only in one plane.
  ridge NUMBER  Damp the corrections of nearly dependent planes, such as 0.1.
  fit  Fit all runs at once, the initial one too (implied where runs are more than unknowns).
  robust  Beside the fit one that hardly counts outliers (Huber).
How: the tolerance, the first trial mass:
  grade GRADE  Balance quality grade of ISO 21940-11, such as G6.3.
  speed SPEED  Highest service speed, such as 3000rpm.
  rotor_mass MASS  Mass of the rotor, such as 120kg.
  permissible UNBALANCE  Permissible residual unbalance in place of a grade.
  radius LENGTH  Radius of the trial masses: for the tolerance.
  suggest_trial  Suggest a trial mass for --rotor-mass, --speed, --radius and --planes; no RUNS.
  planes N  Number of planes, for --suggest-trial.
Output: where masses go, the next run:
  save_influence FILE.csv  Store the coefficients.
  blades N  Split the corrections onto so many places, evenly spaced.
  positions ANGLES  Split them onto these places: 0deg,30deg,60deg.
  first ANGLE  Angle of the first of --blades.
  predict [PLANE=]MASS@ANGLE,…  What a run with these masses should read: 10kg@-90deg.
  suggest  The run within --max-mass that would tell most about the correction.
"""


@command(OPTIONS)
def run(
    runs: Annotated[str | None, typer.Argument(show_default=False)] = None,
    influence: list[str] | None = None,
    save_influence: Annotated[Path | None, typer.Option(callback=suffix_among(".csv"))] = None,
    objective: Literal["least-squares", "minimax"] = "least-squares",
    max_mass: list[str] | None = None,
    max_residual: str | None = None,
    from_here: bool = False,
    runout: str | None = None,
    reading_error: str | None = None,
    monte_carlo: Annotated[int, typer.Option(min=0, max=100000)] = 0,
    method: Literal["influence", "four-run"] = "influence",
    ridge: Annotated[float, typer.Option(min=0.0)] = 0.0,
    phase_lag: bool = False,
    rotation: Literal["ccw", "cw"] | None = None,
    grade: str | None = None,
    speed: str | None = None,
    rotor_mass: str | None = None,
    permissible: str | None = None,
    radius: str | None = None,
    suggest_trial: bool = False,
    planes: Annotated[int, typer.Option(min=1)] = 1,
    blades: Annotated[int | None, typer.Option(min=1, max=options.PLACES)] = None,
    positions: str | None = None,
    first: str = "0deg",
    fit: bool = False,
    exclude: list[str] | None = None,
    predict: str | None = None,
    suggest: bool = False,
    robust: bool = False,
    signal: str | None = None,
    pulses: Annotated[int, typer.Option(min=1, max=10000)] = 1,
    workers: Annotated[int, typer.Option(min=1)] = 1,
) -> Result:
    """Balance rotors from measured vibration and trial masses (influence coefficients).

    RUNS has a row for each run and sensor: run, sensor, amplitude_*, phase_deg, trial_plane, trial_mass_* (or
    trial_unbalance_*), trial_angle_deg, these three empty in the initial run; if wanted rotor, speed_*, weight
    and trial_kept (yes: the trial mass stays on in all later runs). Several trial masses in one run are joined
    by ';'. Phase and mass angle are counted in one common sense. amplitude_um_pp, _pk, _rms tell how it is read.
    """
    four_run = method == "four-run"
    needs_phase: dict[str, object] = {"influence": influence, "runout": runout}
    needs_phase |= {"reading_error": reading_error, "phase_lag": phase_lag, "rotation": rotation}
    limited = objective == "minimax" or max_mass or max_residual is not None
    options.refuse("expected a finite number", ridge=not ridge < float("inf"))
    options.refuse("goes with the least-squares objective without limits", ridge=ridge and limited)
    if four_run:
        options.refuse("has no meaning with --method four-run, which uses no phase", **needs_phase)
    no_trials = "has no meaning with --influence: there are no trial masses"
    options.refuse(no_trials, from_here=from_here and influence)
    options.refuse("needs --reading-error", monte_carlo=monte_carlo and reading_error is None)
    arm = options.quantity("--radius", radius, "length", positive=True)
    if suggest_trial:
        no_runs = "is for the time before the first run: expected no RUNS"
        options.refuse(no_runs, suggest_trial=runs is not None)
        from cli.field.trial import suggestion

        return suggestion(rotor_mass, speed, arm, planes)
    if signal is not None:
        options.refuse("reads a recording: expected no RUNS", signal=runs is not None)
        from cli.field.signal import signal as recorded

        return recorded(signal, pulses)
    options.refuse("goes with --signal", pulses=pulses != 1)
    if runs is None:
        raise typer.BadParameter("expected RUNS, a CSV file or -", param_hint="RUNS")

    from cli.field import request as asked
    from cli.field.measured import read_measured
    from cli.field.solve import FieldBalancing
    from cli.read.tolerance import tolerance_of

    request = asked.Request(
        reading_error=asked.reading_error(reading_error),
        tolerance=tolerance_of(grade, speed, rotor_mass, permissible, None),
        max_mass=asked.limits(max_mass or []),
        max_residual=options.with_unit("--max-residual", max_residual, "amplitude", positive=True),
        objective=objective,
        from_here=from_here,
        monte_carlo=monte_carlo,
        four_run=four_run,
        ridge=ridge,
        radius=arm,
        phase_lag=phase_lag,
        rotation=rotation,
        places=options.places(positions, blades, first),
        fit=fit,
        exclude=exclude or (),
        predict=predict,
        suggest=suggest,
        robust=robust,
    )
    measured, stored = read_measured(runs, request, influence or (), runout)
    with options.processes(workers) as executor:
        found = FieldBalancing(measured, request, stored, executor)
    return _result(found, save_influence)


def _result(found: FieldBalancing, save_influence: Path | None) -> Result:
    from cli.field import columns, remarks, words
    from cli.show.columns import Result

    warnings, fitted = remarks.warnings(found), found.runs.fitted
    if fitted:
        from cli.field import fit, fit_words

        fit.check(found)
        warnings += fit.remarks(found)

    # what is not always asked for is loaded where it is
    def influence() -> Table:
        from cli.field.coefficient_columns import coefficients

        return coefficients(found)

    def sheets() -> Iterator[Sheet]:
        from cli.field.report import sheets

        return sheets(found)

    def stored() -> bytes:
        from cli.show.text import csv_text

        return csv_text(influence().cells).encode()

    def document() -> Document:
        from cli.field.document import document

        return document(found)

    def figure() -> Figure:
        from cli.field.picture import draw

        return draw(found, range(min(len(found.runs.rotors), 3)))

    companions = {"prediction": lambda: columns.prediction(found)}
    if found.request.places is not None:
        companions["split"] = lambda: columns.split(found)
    tables = {"corrections": lambda: columns.corrections(found, warnings), "influence": influence}
    tables |= companions
    if fitted:
        tables["residuals"] = lambda: columns.residuals(found)
    return Result(
        document=document,
        tables=tables,
        companions=list(companions),
        notes=lambda: (fit_words.notes(found) if fitted else "") + words.notes(found),
        afterword=lambda: words.afterword(found) + (fit_words.afterword(found) if fitted else ""),
        figure=figure,
        method=words.METHOD,
        sheets=sheets,
        shows_input=True,
        about={"title": "Balancing in the field"},
        beside={} if save_influence is None else {save_influence: stored},
        warnings=warnings,
    )
