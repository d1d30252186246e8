"""A machine's sheet as a page: coefficients stand in it, readings are typed in, corrections and trim come out."""

from __future__ import annotations

from collections.abc import Sequence
from hashlib import sha256
from typing import Any

import numpy as np
from numpy.typing import NDArray

from balancing.tapes import measured, split
from dalembert.angles import degrees
from dalembert.arithmetic.engines.javascript import engine, written
from dalembert.page import Page, spelled
from dalembert.page import sheet as sheet_page
from dalembert.units import to_si

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

RUNS = 4
"""The initial run, and runs with masses on."""


def machine_sheet(
    influence: Complex,
    initial: Complex,
    sensors: Sequence[str],
    planes: Sequence[str],
    *,
    weights: Real | None = None,
    ridge: float = 0.0,
    errors: tuple[float, float] | None = None,
    covariance: Complex | None = None,
    runout: Complex | None = None,
    against: bool = False,
    amplitude_unit: str = "",
    mass: tuple[str, str] = ("mass", "kg"),
    channels: Sequence[tuple[str, float | None]] | None = None,
    speed_unit: str = "rpm",
    places: Sequence[tuple[str, float]] | None = None,
    spread: tuple[Real, Real] | None = None,
    limits: Sequence[float | None] = (),
    ceiling: float | None = None,
    permissible: Sequence[float] | None = None,
    unbalance: Complex | None = None,
    facts: Sequence[tuple[str, str]] = (),
) -> Page:
    """Return the sheet of one machine.

    Parameters
    ----------
    influence : complex array (s, p)
        Amplitude per kg or kg·m.
    initial : complex array (s,)
        What the sheet begins with.
    weights, ridge, errors, covariance, runout
        See `tapes.measured`.
    against : bool
        Whether typed phases are counted against the sense of the mass angles.
    mass : (kind, unit)
        "mass" or "unbalance", and the unit it is shown in.
    channels : sequence of (sensor, speed)
        The sensors' names in the rows; default: as `sensors`, without a speed.
    places : sequence of (name, angle)
        Where masses go, rad.
    spread : (along, across), arrays (s, p), optional
        Standard deviations of the coefficients along themselves and across.
    limits : sequence of float
        The largest mass of each plane, kg or kg·m; None where it has no limit. The sheet names a plane that is beyond.
    ceiling : float, optional
        The largest vibration with which no trim is needed, in the amplitude unit.
    permissible : sequence of float, optional
        The largest unbalance of each plane with which no trim is needed, in kg or kg·m as `mass` is.
    unbalance : complex array (s, p), optional
        The unbalance that explains a vibration of 1 at each sensor (`initial_unbalance`), NaN where readings do not determine it.
    facts : sequence of (name, text)
        Facts of the machine, shown below the answers.
    """
    seen, shares = None, None
    if permissible is not None and unbalance is not None:
        seen = np.nan_to_num(unbalance, nan=0.0)
        hidden = [bool(column.any()) for column in np.isnan(unbalance).T]
        shares = [None if unknown else share for unknown, share in zip(hidden, permissible, strict=True)]
    tape = measured(influence, weights, ridge, RUNS, errors, runout, covariance, seen)
    values: dict[str, float] = {}
    for sensor, v in zip(sensors, initial, strict=True):
        # fifteen digits: a reading stands there as it was typed
        turned = float(f"{degrees(v.conjugate() if against else v):.15g}")
        values[f"initial/{sensor}/amplitude"] = float(f"{abs(v):.15g}")
        values[f"initial/{sensor}/phase"] = float(np.radians(turned))
    kind, unit = mass
    coefficients = [
        [
            sensor,
            plane,
            float(abs(influence[s, p])),
            float(degrees(influence[s, p])),
            # the standard deviations of size and angle, if there are any
            *(
                []
                if spread is None
                else [float(spread[0][s, p]), float(spread[1][s, p] / abs(influence[s, p]))]
            ),
        ]
        for s, sensor in enumerate(sensors)
        for p, plane in enumerate(planes)
    ]
    whole: dict[str, Any] = {
        "runs": ["initial", *(f"run {k + 1}" for k in range(1, RUNS))],
        "sensors": list(sensors),
        "channels": [list(each) for each in channels or [(sensor, None) for sensor in sensors]],
        "speedUnit": speed_unit,
        "planes": list(planes),
        "values": values,
        "rows": [],
        "first": [],
        "outputs": list(tape.names),
        "against": against,
        "errors": errors,
        "amplitude": {"unit": spelled(amplitude_unit), "header": amplitude_unit},
        "mass": {"kind": kind, "unit": spelled(unit), "header": unit, "si": float(to_si(1.0, kind, unit))},
        "word": kind,
        "coefficients": coefficients,
        "limits": list(limits) or [None] * len(planes),
        "ceiling": ceiling,
        "permissible": shares,
        "facts": [list(fact) for fact in facts],
        "places": None
        if places is None
        else [list(place) for place in sorted(places, key=lambda place: place[1])],
    }
    whole["id"] = sha256(repr(sorted(whole.items(), key=lambda item: item[0])).encode()).hexdigest()[:16]
    script = f"{engine()}\nconst tapes = {{ solve: {written(tape)}, split: {written(split())} }};\n"
    return sheet_page("Balancing in the field", "field", script, whole)
