"""`dalembert field`: rotors whose vibration was measured, with trial masses."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cli.read import options
from cli.show.shown import Digits, Expect, Json, Output, Plot, Rtol, Shown, Text, show

if TYPE_CHECKING:
    from cli.field_runs import Runs


def _html(path: Path | None) -> Path | None:
    if path is not None and path.suffix.lower() not in (".html", ".htm"):
        raise typer.BadParameter(f"'{path}' has no known suffix: expected .html")
    return path


def _csv(path: Path | None) -> Path | None:
    if path is not None and path.suffix.lower() != ".csv":
        raise typer.BadParameter(f"'{path}' has no known suffix: expected .csv")
    return path


def run(
    runs: Annotated[
        str | None,
        typer.Argument(metavar="RUNS", help="CSV of runs; - is standard input.", show_default=False),
    ] = None,
    influence: Annotated[
        str | None,
        typer.Option(metavar="COEFFICIENTS.csv", help="Stored coefficients in place of trial runs."),
    ] = None,
    save_influence: Annotated[
        Path | None,
        typer.Option(metavar="FILE.csv", help="Store the coefficients.", callback=_csv),
    ] = None,
    objective: Annotated[str, typer.Option(help="least-squares or minimax.")] = "least-squares",
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
        str, typer.Option(help="influence, or four-run: amplitudes only, one plane.")
    ] = "influence",
    ridge: Annotated[
        float, typer.Option(min=0.0, help="Damp the corrections of nearly dependent planes, such as 0.1.")
    ] = 0.0,
    phase_lag: Annotated[bool, typer.Option("--phase-lag", help="The instrument's phase lags.")] = False,
    rotation: Annotated[
        str | None,
        typer.Option(help="ccw or cw, seen against +z: phases lead in that sense, mass angles are ccw."),
    ] = None,
    grade: Annotated[
        str | None, typer.Option(help="Balance quality grade of ISO 21940-11, such as G6.3.")
    ] = None,
    speed: Annotated[str | None, typer.Option(help="Highest service speed, such as 3000rpm.")] = None,
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
    planes: Annotated[int, typer.Option(min=1, help="Number of planes, for --suggest-trial.")] = 1,
    blades: Annotated[
        int | None,
        typer.Option(
            min=1, max=options.PLACES, help="Split the corrections onto so many places, evenly spaced."
        ),
    ] = None,
    positions: Annotated[
        str | None, typer.Option(metavar="ANGLES", help="Split them onto these places: 0deg,30deg,60deg.")
    ] = None,
    first: Annotated[str, typer.Option(metavar="ANGLE", help="Angle of the first of --blades.")] = "0deg",
    report: Annotated[
        Path | None,
        typer.Option(metavar="FILE.html", help="Write a report to print.", callback=_html),
    ] = None,
    json: Json = False,
    output: Output = None,
    plot: Plot = None,
    expect: Expect = None,
    rtol: Rtol = 1e-3,
    text: Text = False,
    digits: Digits = False,
) -> None:
    """Balance rotors from measured vibration and trial masses (influence coefficients).

    RUNS has a row for each run and sensor: run, sensor, amplitude_*, phase_deg, trial_plane, trial_mass_* (or
    trial_unbalance_*), trial_angle_deg, these three empty in the initial run; if wanted rotor, speed_*, weight
    and trial_kept (yes: the trial mass stays on in all later runs). Several trial masses in one run are joined
    by ';'. Phase and mass angle are counted in one common sense. amplitude_um_pp, _pk, _rms tell how it is read.
    """
    if objective not in ("least-squares", "minimax"):
        raise options.bad("--objective", f"'{objective}': expected least-squares or minimax")
    if method not in ("influence", "four-run"):
        raise options.bad("--method", f"'{method}': expected influence or four-run")
    if rotation not in (None, "ccw", "cw"):
        raise options.bad("--rotation", f"'{rotation}': expected ccw or cw")
    if not ridge < float("inf"):
        raise options.bad("--ridge", "expected a finite number")
    if ridge and (objective == "minimax" or max_mass or max_residual is not None):
        raise options.bad("--ridge", "goes with the least-squares objective without limits")
    error = _reading_error(reading_error)
    if monte_carlo and error is None:
        raise options.bad("--monte-carlo", "needs --reading-error")
    if method == "four-run":
        for flag, given in (
            ("--influence", influence),
            ("--runout", runout),
            ("--reading-error", reading_error),
            ("--phase-lag", phase_lag),
            ("--rotation", rotation),
        ):
            if given:
                raise options.bad(flag, "has no meaning with --method four-run, which uses no phase")
    if influence is not None and from_here:
        raise options.bad("--from-here", "has no meaning with --influence: there are no trial masses")
    arm = options.quantity("--radius", radius, "length", positive=True)
    shared = {
        "json": json,
        "output": output,
        "plot": plot,
        "expect": expect,
        "rtol": rtol,
        "text": text,
        "digits": digits,
    }
    if suggest_trial:
        if runs is not None:
            raise options.bad("--suggest-trial", "is for the time before the first run: expected no RUNS")
        show(_suggestion(rotor_mass, speed, arm, planes), **shared)  # type: ignore[arg-type]
        return
    if runs is None:
        raise typer.BadParameter("expected RUNS, a CSV file or -", param_hint="RUNS")
    from cli.read.tolerance import tolerance_of

    tolerance = tolerance_of(grade, speed, rotor_mass, permissible, None)
    limits = _limits(max_mass or [])
    ceiling = options.with_unit("--max-residual", max_residual, "amplitude", positive=True)

    from cli.field_files import read_runout, read_stored
    from cli.field_job import Field, Wanted
    from cli.field_runs import read_runs

    # a phase that lags, or a shaft that turns clockwise, turns the sense of the phase against the mass angles
    against = phase_lag != (rotation == "cw")
    stored = read_stored(influence) if influence is not None else None
    measured = read_runs(
        runs,
        lagging=against,
        phaseless=method == "four-run",
        stored_unit=None if stored is None else stored.unit,
    )
    if stored is not None:
        measured.warnings += stored.table.warnings
    if tolerance is not None and measured.per == "mass" and arm is None:
        raise options.bad(
            "--radius", "the tolerance is of unbalances: expected the radius of the trial masses"
        )
    wanted = Wanted(
        objective=objective,
        max_mass=_in(limits, measured),
        max_residual=None if ceiling is None else _ceiling(ceiling, measured),
        from_here=from_here,
        runout={} if runout is None else read_runout(runout, measured, lagging=against),
        reading_error=error,
        monte_carlo=monte_carlo,
        four_run=method == "four-run",
        ridge=ridge,
        tolerance=None if tolerance is None else (tolerance.grade, tolerance.permissible),
        radius=arm,
        conventions=_conventions(method, phase_lag, rotation),
        places=options.places(positions, blades, first),
    )
    field = Field(measured, wanted, stored)
    shown = field.shown()
    beside: dict[Path, bytes] = {}
    if save_influence is not None:
        from cli.show.text import csv_text

        beside[save_influence] = csv_text(field.coefficients()).encode()
    if report is not None:
        from cli.field_report import html

        source = "standard input" if runs == "-" else Path(runs).name
        beside[report] = html(field, source, shown.warnings)
    show(shown, beside=beside, **shared)


def _conventions(method: str, phase_lag: bool, rotation: str | None) -> str:
    if method == "four-run":
        return "Mass angles as in the table; no phase is used."
    if rotation is None and not phase_lag:
        return "Phases and mass angles are counted in one common sense, from one mark on the rotor."
    lead = "lag" if phase_lag else "lead"
    turning = (
        f"the shaft turns {rotation} as seen against +z"
        if rotation
        else "phases are counted with the mass angles"
    )
    return f"The instrument's phases {lead} ({turning}); all phases given out are counted in the sense of the mass angles."


def _reading_error(text: str | None) -> tuple[float, float] | None:
    """Read `2%,2deg`: relative error of the amplitude, error of the phase in rad."""
    if text is None:
        return None
    amplitude, phase = 0.0, 0.0
    for part in text.split(","):
        part = part.strip()
        if part.endswith("%"):
            try:
                from cli.read.units import parse_number

                amplitude = parse_number(part[:-1]) / 100
            except ValueError:
                raise options.bad("--reading-error", f"'{part}': expected a share such as 2%") from None
        else:
            phase = options.quantity("--reading-error", part, "angle") or 0.0
    if amplitude < 0 or phase < 0 or amplitude + phase == 0:
        raise options.bad("--reading-error", f"'{text}': expected positive errors, such as 2%,2deg")
    return amplitude, phase


def _limits(texts: list[str]) -> dict[str, tuple[float, str]]:
    """Read `5g`, `A=5g`, several in one joined by commas: plane -> (value, unit)."""
    limits: dict[str, tuple[float, str]] = {}
    for text in ",".join(texts).split(",") if texts else ():
        plane, mark, value = text.rpartition("=")
        if mark and not plane.strip():
            raise options.bad("--max-mass", f"'{text}': expected a plane's name before =, such as A=5g")
        dimension = "unbalance" if "_" in value or "*" in value or "·" in value else "mass"
        given = options.with_unit("--max-mass", value, dimension, positive=True)
        assert given is not None
        if plane.strip() in limits:
            raise options.bad("--max-mass", f"'{text}': this limit is given twice")
        limits[plane.strip()] = given
    return limits


def _in(limits: dict[str, tuple[float, str]], runs: Runs) -> dict[str, float]:
    """Return limits in SI, in the dimension of the trials."""
    from cli.read.units import UNITS, to_si

    for value, unit in limits.values():
        if unit not in UNITS[runs.per]:
            raise options.bad(
                "--max-mass", f"'{value:g}{unit}': expected a limit in units of {runs.per}, as the trials are"
            )
    return {plane: float(to_si(value, runs.per, unit)) for plane, (value, unit) in limits.items()}


def _ceiling(given: tuple[float, str], runs: Runs) -> float:
    """Return the residual limit in the table's unit; without a tag it is meant as the table's amplitudes are."""
    import numpy as np

    from cli.field_files import convert_amplitude
    from cli.read.units import amplitude_kind

    value, unit = given
    if not amplitude_kind(unit)[1]:
        unit += amplitude_kind(runs.amplitude_unit)[1]
    return float(convert_amplitude(np.array([value]), unit, runs.amplitude_unit, "--max-residual")[0])


def _suggestion(rotor_mass: str | None, speed: str | None, radius: float | None, planes: int) -> Shown:
    """Suggest a trial mass."""
    mass = options.quantity("--rotor-mass", rotor_mass, "mass", positive=True)
    omega = options.quantity("--speed", speed, "speed", positive=True)
    for flag, given in (("--rotor-mass", mass), ("--speed", omega), ("--radius", radius)):
        if given is None:
            raise options.bad(flag, "--suggest-trial needs --rotor-mass, --speed and --radius")
    assert mass is not None
    assert omega is not None
    assert radius is not None
    from balancing import trial_unbalance
    from cli.read.units import from_si

    unbalance = float(trial_unbalance(mass, omega, planes))
    rule = "centrifugal force a tenth of the static load of each plane: m r ω² = 0.1 (M/planes) g"
    trial = {
        "unbalance_kg_m": unbalance,
        "mass_kg": unbalance / radius,
        "radius_m": radius,
        "planes": planes,
        "rule": rule,
    }
    return Shown(
        document=lambda: {"trial": trial},
        columns={
            "mass_g": [from_si(unbalance / radius, "mass", "g")],
            "radius_mm": [from_si(radius, "length", "mm")],
            "unbalance_g_mm": [from_si(unbalance, "unbalance", "g_mm")],
        },
        errors=lambda: {
            "mass_g": [1e-14 * from_si(unbalance / radius, "mass", "g")],
            "unbalance_g_mm": [1e-14 * from_si(unbalance, "unbalance", "g_mm")],
        },
        notes=lambda: "trial mass for each plane\nrule: " + rule,
    )
