"""What the options of a balancing in the field ask for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from cli.read import options
from cli.read.runs.runs import Runs
from cli.read.tolerance import Tolerance
from dalembert.angles import phasor
from dalembert.quantities import parse_number
from dalembert.units import UNITS, amplitude_kind, to_si

Given = tuple[float, str]
"""A value and the unit it was given in."""


@dataclass(frozen=True, eq=False, repr=False)
class Request:
    """What the options ask for."""

    reading_error: tuple[float, float] | None = None
    """Relative, rad."""
    tolerance: Tolerance | None = None
    max_mass: Mapping[str, Given] = field(default_factory=dict)
    """Limit of each plane; the key "" is for all."""
    max_residual: Given | None = None
    objective: str = "least-squares"
    from_here: bool = False
    monte_carlo: int = 0
    four_run: bool = False
    ridge: float = 0.0
    radius: float | None = None
    phase_lag: bool = False
    rotation: str | None = None
    places: list[float] | None = None
    """Where masses can go, degrees: the corrections are split onto them."""
    stock: list[float] | None = None
    """The weights in stock, kg, of which the corrections are made there."""
    fit: bool = False
    """Whether all runs are to be fitted together; from here on what else is asked of that."""
    exclude: Sequence[str] = ()
    predict: str | None = None
    suggest: bool = False
    robust: bool = False
    view: str | None = None
    """`static-couple`: the corrections of two planes as a static part and a couple."""
    zone_class: str | None = None
    """The machine whose zones of severity are asked for."""

    @property
    def against(self) -> bool:
        """Whether the instrument counts phases against the sense of the mass angles."""
        return self.phase_lag != (self.rotation == "cw")

    @property
    def lagging(self) -> bool | None:
        """The same, None where the options do not say it."""
        return self.against if self.phase_lag or self.rotation is not None else None


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
            phase = options.needed("--reading-error", part, "angle")
    if amplitude < 0 or phase < 0 or amplitude + phase == 0:
        raise options.bad("--reading-error", f"'{text}': expected positive errors, such as 2%,2deg")
    return amplitude, phase


def limits(texts: Sequence[str]) -> dict[str, Given]:
    """Read `5g`, `A=5g`, several in one joined by commas."""
    limits: dict[str, Given] = {}
    for text in ",".join(texts).split(",") if texts else ():
        plane, mark, value = text.rpartition("=")
        if mark and not plane.strip():
            raise options.bad("--max-mass", f"'{text}': expected a plane's name before =, such as A=5g")
        dimension = "unbalance" if "_" in value or "*" in value or "·" in value else "mass"
        limit = options.with_unit("--max-mass", value, dimension, positive=True)
        assert limit is not None
        if plane.strip() in limits:
            raise options.bad("--max-mass", f"'{text}': this limit is given twice")
        limits[plane.strip()] = limit
    return limits


def limits_in(limits: Mapping[str, Given], runs: Runs) -> dict[str, float]:
    """Return limits in SI, in the dimension of the trials."""
    for value, unit in limits.values():
        if unit not in UNITS[runs.per]:
            raise options.bad(
                "--max-mass", f"'{value:g}{unit}': expected a limit in units of {runs.per}, as the trials are"
            )
    return {plane: float(to_si(value, runs.per, unit)) for plane, (value, unit) in limits.items()}


def ceiling_in(limit: Given | None, runs: Runs) -> float | None:
    """Return the residual limit in the table's unit; without a tag it is meant as the table's amplitudes are."""
    if limit is None:
        return None
    value, unit = limit
    if not amplitude_kind(unit)[1]:
        unit += amplitude_kind(runs.amplitude_unit)[1]
    return runs.in_unit(value, unit, "--max-residual")


def masses_at(text: str | None, runs: Runs) -> dict[str, complex] | None:
    """Read `10kg@-90deg`, or `A=10kg@-90deg,B=5kg@20deg`, SI; the key "" is the only plane."""
    if text is None:
        return None
    out: dict[str, complex] = {}
    for part in text.split(","):
        plane, _, value = part.strip().rpartition("=")
        expected = f"'{part}': expected MASS@ANGLE, such as 10kg@-90deg"
        size, unit, angle, of_angle = options.mass_at("--predict", part, value, runs.per, expected)
        if plane.strip() in out:
            raise options.bad("--predict", f"'{part}': this plane is given twice")
        on = float(to_si(size, runs.per, unit))
        out[plane.strip()] = complex(phasor(np.array(on), np.array(angle), of_angle))
    return out
