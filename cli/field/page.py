"""The sheet of a machine that was balanced in the field."""

from __future__ import annotations

import numpy as np

from balancing import initial_unbalance
from balancing.sheet import machine_sheet
from cli.field.field_balancing import FieldBalancing
from cli.field.logs import spread
from cli.field.tables import sense
from cli.read.options import bad
from dalembert.page import Page

LEAST_SQUARES = (
    "this sheet computes least squares without limits; where a mass is beyond its limit, or the least maximum is wanted, "
    "dalembert field solves the problem with limits from the rows of this sheet"
)


def sheet(b: FieldBalancing) -> Page:
    """The page of one machine.

    Raises
    ------
    typer.BadParameter
        Where no phases are read, or there are several machines.
    """
    runs, request = b.runs, b.request
    if len(runs.rotors) > 1:
        raise bad("--page", f"a sheet is of one machine, found {len(runs.rotors)}")
    if request.four_run:
        raise bad("--page", "a sheet computes from amplitudes with phases")
    solved = b.solved[0]
    group = solved.group
    spreads = spread(b, solved)
    covariance, deviations = None, None
    if spreads is not None:
        deviations = spreads.along[0], spreads.across[0]
        size = np.sqrt(np.square(spreads.along[0]) + np.square(spreads.across[0]))
        covariance = size[:, :, None] * size[:, None, :] * spreads.correlation[0]
    elif b.stored is not None:
        stored = b.stored.coefficients(runs.rotors[0], group.channels, list(solved.planes), runs)
        covariance = stored.covariance
        if covariance is not None:
            # in any direction alike
            each = np.sqrt(np.einsum("spp->sp", covariance).real / 2)
            deviations = each, each
    weights = group.own_weights(0)
    permissible, unbalance = None, None
    if request.tolerance is not None:
        of_one = b.in_kg_m(np.ones(1, dtype=complex))
        permissible = (request.tolerance.shares(len(solved.planes)) / of_one).tolist()
        readings = np.eye(len(group.channels))
        unbalance = np.stack([initial_unbalance(solved.alpha[0], one, weights) for one in readings])
    return machine_sheet(
        np.asarray(solved.alpha[0]),
        np.asarray(group.fit.initial[0]),
        [str(channel) for channel in group.channels],
        solved.planes,
        weights=None if weights is None else np.asarray(weights),
        ridge=request.ridge,
        errors=request.reading_error,
        covariance=covariance,
        runout=b.runout(group),
        against=request.against or runs.lags,
        first=next(
            (run for run, bare in zip(group.lines.runs(0), group.bare[0], strict=True) if bare), "initial"
        ),
        amplitude_unit=runs.amplitude_unit,
        mass=(runs.per, runs.mass_unit),
        channels=[(channel.sensor, channel.speed_written) for channel in group.channels],
        speed_unit=runs.speed_unit,
        spread=deviations,
        limits=[b.max_mass.get(plane, b.max_mass.get("")) for plane in solved.planes] if b.max_mass else (),
        ceiling=b.ceiling,
        permissible=permissible,
        unbalance=unbalance,
        facts=[("Convention", sense(b)), *([("Objective", LEAST_SQUARES)] if b.limited else [])],
        places=None
        if request.places is None
        else [(str(k), float(np.radians(x))) for k, x in enumerate(request.places, 1)],
    )
