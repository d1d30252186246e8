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

    from cli.field.fit import LogFits
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
    if not ridge < float("inf"):
        raise options.bad("--ridge", "expected a finite number")
    if ridge and (objective == "minimax" or max_mass or max_residual is not None):
        raise options.bad("--ridge", "goes with the least-squares objective without limits")
    four_run = method == "four-run"
    if four_run:
        needs_phase: dict[str, object] = {
            "influence": influence,
            "runout": runout,
            "reading_error": reading_error,
        }
        needs_phase |= {"phase_lag": phase_lag, "rotation": rotation}
        options.refuse("has no meaning with --method four-run, which uses no phase", **needs_phase)
    if influence and from_here:
        raise options.bad("--from-here", "has no meaning with --influence: there are no trial masses")
    if monte_carlo and reading_error is None:
        raise options.bad("--monte-carlo", "needs --reading-error")
    arm = options.quantity("--radius", radius, "length", positive=True)
    if suggest_trial:
        if runs is not None:
            raise options.bad("--suggest-trial", "is for the time before the first run: expected no RUNS")
        from cli.field.trial import suggestion

        return suggestion(rotor_mass, speed, arm, planes)
    if signal is not None:
        if runs is not None:
            raise options.bad("--signal", "reads a recording: expected no RUNS")
        from cli.field.signal import signal as recorded

        return recorded(signal, pulses)
    if pulses != 1:
        raise options.bad("--pulses", "goes with --signal")
    if runs is None:
        raise typer.BadParameter("expected RUNS, a CSV file or -", param_hint="RUNS")

    from cli.field import request as asked
    from cli.field.files import read_runout, read_stored, stored_alpha
    from cli.field.layouts import alpha_of, is_log
    from cli.field.read import NotOneInitialRun, read_runs, runs_table
    from cli.field.runs import more_than_unknowns
    from cli.field.solve import FieldBalancing
    from cli.read.tolerance import tolerance_of

    error = asked.reading_error(reading_error)
    tolerance = tolerance_of(grade, speed, rotor_mass, permissible, None)
    limits = asked.limits(max_mass or [])
    ceiling = options.with_unit("--max-residual", max_residual, "amplitude", positive=True)
    # a phase that lags, or a shaft that turns clockwise, turns the sense of the phase against the mass angles
    against = phase_lag != (rotation == "cw")
    files = [read_stored(path) for path in influence or ()]
    of_fit = {"fit": fit, "exclude": exclude, "predict": predict, "suggest": suggest, "robust": robust}
    if four_run:
        options.refuse("fits all runs: it does not go with --method four-run", **of_fit)
    fit = any(of_fit.values()) or len(files) > 1 or any(one.along is not None for one in files)
    if not four_run and not fit:
        fit = is_log(runs)
    if fit and not files and (own := alpha_of(runs)) is not None and not own.trials:
        files = [stored_alpha(own)]
    stored = files[0] if files and not fit else None
    stored_unit = None if stored is None else stored.unit
    measured = table = None
    if not fit:
        table = runs_table(runs)
        fit = stored is None and not four_run and more_than_unknowns(table)
    if table is not None and not fit:
        try:
            measured = read_runs(table, lagging=against, phaseless=four_run, stored_unit=stored_unit)
        except NotOneInitialRun:
            if stored is not None or four_run:
                raise
            fit = True
    lagging = against if phase_lag or rotation is not None else None
    if measured is None:
        from cli.field.log import read_log
        from cli.field.sisters import Sisters

        measured = read_log(
            runs,
            table,
            lagging=lagging,
            exclude=exclude or [],
            sisters=Sisters(files) if files else None,
            reading_error=error,
        )
    for one in files:
        measured.warnings += one.table.warnings
    if tolerance is not None and measured.per == "mass" and arm is None:
        raise options.bad(
            "--radius", "the tolerance is of unbalances: expected the radius of the trial masses"
        )
    lags = against or measured.lags
    still = {sensor: v.conjugate() if lags else v for sensor, v in measured.runout.items()}
    request = asked.Request(
        objective=objective,
        max_mass=asked.limits_in(limits, measured) or measured.max_mass,
        max_residual=None if ceiling is None else asked.ceiling_in(ceiling, measured),
        from_here=from_here,
        runout=still if runout is None else read_runout(runout, measured, lagging=lags),
        reading_error=error,
        monte_carlo=monte_carlo,
        four_run=four_run,
        ridge=ridge,
        tolerance=tolerance,
        radius=arm,
        conventions=asked.conventions(method, phase_lag or measured.lags, rotation),
        places=options.places(positions, blades, first),
        against=against or measured.lags,
    )
    with options.processes(workers) as executor:
        found = FieldBalancing(measured, request, stored, executor)
    fits = None
    if fit:
        from cli.field.fit import Asked, LogFits, masses_at

        fits = LogFits(found, Asked(masses_at(predict, measured), suggest, robust))
    return _result(found, fits, save_influence)


def _result(found: FieldBalancing, fits: LogFits | None, save_influence: Path | None) -> Result:
    from cli.field import columns, remarks, words
    from cli.show.columns import Result

    warnings = remarks.warnings(found)
    if fits is not None:
        from cli.field import fit, fit_columns, fit_words

        warnings += fit.remarks(found)

    def document() -> Document:
        whole = columns.document(found)
        return whole if fits is None else fit_columns.document(fits, whole)

    def residuals() -> Table:
        assert fits is not None
        return fit_columns.residuals(fits)

    def influence() -> Table:
        from cli.field.coefficient_columns import coefficients

        return coefficients(found)

    def sheets() -> Iterator[Sheet]:
        from cli.field.report import sheets

        return sheets(found, fits)

    def stored() -> bytes:
        from cli.show.text import csv_text

        return csv_text(influence().cells).encode()

    def figure() -> Figure:
        from cli.field import fit_picture, picture

        few = range(min(len(found.runs.rotors), 3))
        return picture.draw(found, few) if fits is None else fit_picture.draw(fits, few)

    return Result(
        document=document,
        tables={
            "corrections": lambda: columns.corrections(found, warnings),
            "influence": influence,
            "prediction": lambda: columns.prediction(found),
            **({} if found.request.places is None else {"split": lambda: columns.split(found)}),
            **({} if fits is None else {"residuals": residuals}),
        },
        companions=["prediction"] if found.request.places is None else ["prediction", "split"],
        notes=lambda: (fit_words.notes(fits) if fits is not None else "") + words.notes(found),
        afterword=lambda: words.afterword(found) + (fit_words.afterword(fits) if fits is not None else ""),
        figure=figure,
        method=words.METHOD,
        sheets=sheets,
        shows_input=True,
        about={"title": "Balancing in the field"},
        beside={} if save_influence is None else {save_influence: stored},
        warnings=warnings,
    )
