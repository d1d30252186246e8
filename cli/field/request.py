"""What the options of a balancing in the field ask for, in the units of the runs."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from cli.field.files import convert_amplitude
from cli.field.runs import Runs
from cli.read import options
from cli.read.tolerance import Tolerance
from cli.read.units import UNITS, amplitude_kind, parse_number, to_si


@dataclass(frozen=True, eq=False, repr=False)
class Request:
    """What the options ask for."""

    objective: str = "least-squares"
    max_mass: dict[str, float] = field(default_factory=dict)
    """Limit of each plane, SI; the key "" is for all."""
    max_residual: float | None = None
    """In the table's amplitude unit."""
    from_here: bool = False
    runout: dict[str, complex] = field(default_factory=dict)
    reading_error: tuple[float, float] | None = None
    """Relative, rad."""
    monte_carlo: int = 0
    four_run: bool = False
    ridge: float = 0.0
    tolerance: Tolerance | None = None
    radius: float | None = None
    conventions: str = ""
    against: bool = False
    """Whether the instrument counts phases against the sense of the mass angles: they were turned round."""
    places: list[float] | None = None
    """Where masses can go, degrees: the corrections are split onto them."""


def conventions(method: str, phase_lag: bool, rotation: str | None) -> str:
    """Say how phases and mass angles are counted."""
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


def reading_error(text: str | None) -> tuple[float, float] | None:
    """Read `2%,2deg`: relative error of the amplitude, error of the phase in rad."""
    if text is None:
        return None
    amplitude, phase = 0.0, 0.0
    for part in text.split(","):
        part = part.strip()
        if part.endswith("%"):
            try:
                amplitude = parse_number(part[:-1]) / 100
            except ValueError:
                raise options.bad("--reading-error", f"'{part}': expected a share such as 2%") from None
        else:
            phase = options.quantity("--reading-error", part, "angle") or 0.0
    if amplitude < 0 or phase < 0 or amplitude + phase == 0:
        raise options.bad("--reading-error", f"'{text}': expected positive errors, such as 2%,2deg")
    return amplitude, phase


def limits(texts: list[str]) -> dict[str, tuple[float, str]]:
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


def limits_in(limits: dict[str, tuple[float, str]], runs: Runs) -> dict[str, float]:
    """Return limits in SI, in the dimension of the trials."""
    for value, unit in limits.values():
        if unit not in UNITS[runs.per]:
            raise options.bad(
                "--max-mass", f"'{value:g}{unit}': expected a limit in units of {runs.per}, as the trials are"
            )
    return {plane: float(to_si(value, runs.per, unit)) for plane, (value, unit) in limits.items()}


def ceiling_in(given: tuple[float, str], runs: Runs) -> float:
    """Return the residual limit in the table's unit; without a tag it is meant as the table's amplitudes are."""
    value, unit = given
    if not amplitude_kind(unit)[1]:
        unit += amplitude_kind(runs.amplitude_unit)[1]
    return float(convert_amplitude(np.array([value]), unit, runs.amplitude_unit, "--max-residual")[0])
