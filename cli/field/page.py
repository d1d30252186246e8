"""The sheet of a machine that was balanced in the field."""

from __future__ import annotations

import numpy as np

from balancing.sheet import machine_sheet
from cli.field.coefficients import spread
from cli.field.field_balancing import FieldBalancing
from cli.read.options import bad
from dalembert.page import Page


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
    known = spread(b, solved)
    covariance = None
    if known is not None:
        size = np.sqrt(np.square(known.along[0]) + np.square(known.across[0]))
        covariance = size[:, :, None] * size[:, None, :] * known.correlation[0]
    weights = group.own_weights(0)
    return machine_sheet(
        np.asarray(solved.alpha[0]),
        np.asarray(group.initial[0]),
        [str(channel) for channel in group.channels],
        solved.planes,
        weights=None if weights is None else np.asarray(weights),
        ridge=request.ridge,
        errors=request.reading_error,
        covariance=covariance,
        runout=b.runout(group),
        against=request.against or runs.lags,
        first=group.trials[0].run if group.trials else "initial",
        amplitude_unit=runs.amplitude_unit,
        mass=(runs.per, runs.mass_unit),
        channels=[(channel.sensor, channel.speed_given) for channel in group.channels],
        speed_unit=runs.speed_unit,
        places=None if request.places is None else [float(np.radians(x)) for x in request.places],
    )
