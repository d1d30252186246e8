"""`dalembert field`: rotors whose vibration was measured, with trial masses."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from cli.read import options
from cli.show.output import command, suffix_among

if TYPE_CHECKING:
    from collections.abc import Iterator

    from matplotlib.figure import Figure

    from cli.field.fit import LogFits
    from cli.field.solve import FieldBalancing
    from cli.show.columns import Document, Result, Sheet, Table


EXAMPLE = "fan-one-plane"
PANELS = {
    "What": "influence runout phase_lag rotation signal pulses exclude workers",
    "How": "method fit robust objective max_mass max_residual from_here ridge reading_error monte_carlo",
    "How: the tolerance, the first trial mass": "grade speed rotor_mass permissible radius suggest_trial planes",
    "Output: where masses go, the next run": "blades positions first predict suggest save_influence",
}


@command
def run(
    runs: Annotated[
        str | None,
        typer.Argument(metavar="RUNS", help="CSV of runs; - is standard input.", show_default=False),
    ] = None,
    influence: Annotated[
        list[str] | None,
        typer.Option(
            metavar="COEFFICIENTS.csv",
            help="Stored coefficients in place of trial runs; of several machines (repeatable), or with uncertainties: prior "
            "knowledge of a fit.",
        ),
    ] = None,
    save_influence: Annotated[
        Path | None,
        typer.Option(metavar="FILE.csv", help="Store the coefficients.", callback=suffix_among(".csv")),
    ] = None,
    objective: Annotated[
        Literal["least-squares", "minimax"],
        typer.Option(help="Least sum of squares of the residuals, or the smallest largest one."),
    ] = "least-squares",
    max_mass: Annotated[
        list[str] | None,
        typer.Option(metavar="[PLANE=]MASS", help="Limit of each correction (5g), or of one plane's (A=5g)."),
    ] = None,
    max_residual: Annotated[
        str | None, typer.Option(metavar="AMPLITUDE", help="No residual beyond this, such as 76um.")
    ] = None,
    from_here: Annotated[
        bool, typer.Option("--from-here", help="What to add to the rotor as it stands, kept trial masses on.")
    ] = False,
    runout: Annotated[
        str | None, typer.Option(metavar="FILE.csv", help="Run-out vectors: sensor, amplitude_*, phase_deg.")
    ] = None,
    reading_error: Annotated[
        str | None,
        typer.Option(
            metavar="2%,2deg", help="Standard deviations of amplitude and phase: adds uncertainties."
        ),
    ] = None,
    monte_carlo: Annotated[
        int,
        typer.Option(metavar="N", min=0, max=100_000, help="Uncertainties from N drawn sets of readings."),
    ] = 0,
    method: Annotated[
        Literal["influence", "four-run"],
        typer.Option(help="By influence coefficients, or by amplitudes only in one plane."),
    ] = "influence",
    ridge: Annotated[
        float,
        typer.Option(
            metavar="NUMBER", min=0.0, help="Damp the corrections of nearly dependent planes, such as 0.1."
        ),
    ] = 0.0,
    phase_lag: Annotated[bool, typer.Option("--phase-lag", help="The instrument's phase lags.")] = False,
    rotation: Annotated[
        Literal["ccw", "cw"] | None,
        typer.Option(help="Seen against +z: phases lead in that sense, mass angles are ccw."),
    ] = None,
    grade: Annotated[
        str | None, typer.Option(metavar="GRADE", help="Balance quality grade of ISO 21940-11, such as G6.3.")
    ] = None,
    speed: Annotated[
        str | None, typer.Option(metavar="SPEED", help="Highest service speed, such as 3000rpm.")
    ] = None,
    rotor_mass: Annotated[
        str | None, typer.Option(metavar="MASS", help="Mass of the rotor, such as 120kg.")
    ] = None,
    permissible: Annotated[
        str | None,
        typer.Option(metavar="UNBALANCE", help="Permissible residual unbalance in place of a grade."),
    ] = None,
    radius: Annotated[
        str | None, typer.Option(metavar="LENGTH", help="Radius of the trial masses: for the tolerance.")
    ] = None,
    suggest_trial: Annotated[
        bool,
        typer.Option(
            "--suggest-trial",
            help="Suggest a trial mass for --rotor-mass, --speed, --radius and --planes; no RUNS.",
        ),
    ] = False,
    planes: Annotated[
        int, typer.Option(metavar="N", min=1, help="Number of planes, for --suggest-trial.")
    ] = 1,
    blades: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            min=1,
            max=options.PLACES,
            help="Split the corrections onto so many places, evenly spaced.",
        ),
    ] = None,
    positions: Annotated[
        str | None, typer.Option(metavar="ANGLES", help="Split them onto these places: 0deg,30deg,60deg.")
    ] = None,
    first: Annotated[str, typer.Option(metavar="ANGLE", help="Angle of the first of --blades.")] = "0deg",
    fit: Annotated[
        bool,
        typer.Option(
            "--fit",
            help="Fit all runs at once, the initial one too (implied where runs are more than unknowns).",
        ),
    ] = False,
    exclude: Annotated[
        list[str] | None, typer.Option(metavar="RUN", help="Leave a run out of the fit; repeatable.")
    ] = None,
    predict: Annotated[
        str | None,
        typer.Option(
            metavar="[PLANE=]MASS@ANGLE,…", help="What a run with these masses should read: 10kg@-90deg."
        ),
    ] = None,
    suggest: Annotated[
        bool,
        typer.Option(
            "--suggest", help="The run within --max-mass that would tell most about the correction."
        ),
    ] = False,
    robust: Annotated[
        bool, typer.Option("--robust", help="Beside the fit one that hardly counts outliers (Huber).")
    ] = False,
    signal: Annotated[
        str | None,
        typer.Option(
            metavar="FILE.csv", help="Once-per-turn vectors of a recording: t_s, mark, A_um …; no RUNS."
        ),
    ] = None,
    pulses: Annotated[
        int, typer.Option(min=1, max=10_000, help="Pulses of the mark in a turn, for --signal.")
    ] = 1,
    workers: Annotated[
        int,
        typer.Option(min=1, metavar="N", help="Processes that solve what each of many machines needs alone."),
    ] = 1,
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
        needs_phase = {
            "--influence": influence,
            "--runout": runout,
            "--reading-error": reading_error,
            "--phase-lag": phase_lag,
            "--rotation": rotation,
        }
        for flag in (flag for flag, given in needs_phase.items() if given):
            raise options.bad(flag, "has no meaning with --method four-run, which uses no phase")
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
    of_fit = {
        "--fit": fit,
        "--exclude": exclude,
        "--predict": predict,
        "--suggest": suggest,
        "--robust": robust,
    }
    if four_run:
        for flag in (flag for flag, given in of_fit.items() if given):
            raise options.bad(flag, "fits all runs: it does not go with --method four-run")
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
