"""A machine's sheet: its coefficients stand in the page, readings are typed in, corrections and trim come out."""

from __future__ import annotations

from hashlib import sha256
from typing import Any

import numpy as np

from balancing.tapes import measured, split
from cli.field.coefficients import spread
from cli.field.field_balancing import FieldBalancing
from cli.read.options import bad
from dalembert.angles import degrees
from dalembert.arithmetic.engines.javascript import engine, written
from dalembert.page import Page
from dalembert.page import sheet as sheet_page
from dalembert.page.typed import spelled, units
from dalembert.units import to_si

RUNS = 4
"""The initial run, and runs with masses on."""


def sheet(b: FieldBalancing) -> Page:
    """The page of one machine.

    Raises
    ------
    typer.BadParameter
        Where the corrections are not those of plain least squares, or there are several machines.
    """
    runs, request = b.runs, b.request
    if len(runs.rotors) > 1:
        raise bad("--page", f"a sheet is of one machine, found {len(runs.rotors)}")
    if b.limited or request.four_run:
        raise bad("--page", "a sheet computes least squares without limits, from amplitudes with phases")
    solved = b.solved[0]
    group = solved.group
    sensors = [str(channel) for channel in group.channels]
    weights = group.own_weights(0)
    against = request.against or runs.lags
    runout = b.runout(group)
    known = spread(b, solved)
    covariance = None
    if known is not None:
        size = np.sqrt(np.square(known.along[0]) + np.square(known.across[0]))
        covariance = size[:, :, None] * size[:, None, :] * known.correlation[0]
    tape = measured(
        np.asarray(solved.alpha[0]),
        None if weights is None else np.asarray(weights),
        request.ridge,
        RUNS,
        request.reading_error,
        runout,
        covariance,
    )
    initial = np.asarray(group.initial[0])
    first = "initial" if not group.trials else group.trials[0].run
    names = [first, *(f"run {k + 1}" for k in range(1, RUNS))]
    values: dict[str, float] = {}
    for sensor, v in zip(sensors, initial, strict=True):
        values[f"{first}/{sensor}/amplitude"] = float(abs(v))
        phase = float(np.radians(degrees(v.conjugate() if against else v)))
        values[f"{first}/{sensor}/phase"] = phase
    unit = runs.mass_unit
    kind = runs.per
    places = None if request.places is None else [float(np.radians(x)) for x in sorted(request.places)]
    coefficients = [
        [sensor, plane, float(abs(a)), float(degrees(a))]
        for sensor, row in zip(sensors, solved.alpha[0], strict=True)
        for plane, a in zip(solved.planes, row, strict=True)
    ]
    tapes = f"{{ solve: {written(tape)}, split: {written(split())} }}"
    whole: dict[str, Any] = {
        "runs": names,
        "sensors": sensors,
        "channels": [[channel.sensor, channel.speed_given] for channel in group.channels],
        "speedUnit": runs.speed_unit,
        "planes": solved.planes,
        "values": values,
        "rows": [],
        "first": [],
        "outputs": list(tape.names),
        "against": against,
        "errors": request.reading_error,
        "amplitude": runs.amplitude_unit,
        "mass": {"kind": kind, "unit": spelled(unit), "header": unit, "si": float(to_si(1.0, kind, unit))},
        "word": "unbalance" if kind == "unbalance" else "mass",
        "coefficients": coefficients,
        "places": places,
        "units": {**units([kind, "angle"]), "amplitude": {spelled(runs.amplitude_unit): [1.0, 1.0]}},
    }
    whole["id"] = sha256(repr(sorted(whole.items(), key=lambda item: item[0])).encode()).hexdigest()[:16]
    return sheet_page("Balancing in the field", "field", f"{engine()}\nconst tapes = {tapes};\n", whole)
