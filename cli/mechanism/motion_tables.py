"""The tables of a motion in time: inputs with their errors, quantities at each time, energy; its worked solution."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from cli.cases.poses import cells, column, in_rows, nested
from dalembert.angles import read_degrees
from dalembert.results.columns import Column, Table, document, number
from dalembert.results.way import Topic, figures
from virtualwork.quantities import SLIDE, Component

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from dalembert.results.columns import Document
    from virtualwork import Mechanism
    from virtualwork.describe.parts import Input
    from virtualwork.intime.run import Run

    Reals = NDArray[np.float64]
    Values = dict[Component, Reals]


# an input's angle and its rates
INPUT = ("angle_deg", "speed_rad_s", "acceleration_rad_s2")
ENERGY = Component(("energy_J",), "energy_J")


def inputs_of(m: Mechanism, q: Reals, v: Reals, a: Reals, error: Reals) -> Values:
    """Return the inputs, their rates and errors (n, k), as they are shown."""
    result: Values = {}
    for j, entry in enumerate(m.inputs):
        lead = f"{entry.name}_input_" if len(m.inputs) > 1 else "input_"
        values = (q[:, j], v[:, j], a[:, j], error[:, j])
        if not entry.is_slide:
            values = (_degrees(q[:, j]), *values[1:3], np.degrees(error[:, j]))
        unit = "m" if entry.is_slide else "deg"
        names = *(SLIDE if entry.is_slide else INPUT)[:3], f"error_estimate_{unit}"
        for name, numbers in zip(names, values, strict=True):
            header = f"{lead}{unit if name in (SLIDE[0], INPUT[0]) else name}"
            result[Component(("inputs", entry.name, name), header)] = numbers
    return result


def _degrees(q: Reals) -> Reals:
    """Return an input in degrees; its first and last value as they are written."""
    angle = np.degrees(q)
    for i in {0, len(q) - 1}:
        angle[i] = read_degrees(float(q[i]))
    return np.asarray(angle)


def _is_error(each: Component) -> bool:
    return str(each.path[-1]).startswith("error")


def trusted(values: Values, unknown: NDArray[np.bool_]) -> Values:
    """Return the values with NaN where no digit holds; the errors stay, and the energy, which has its own error."""
    if not unknown.any():
        return values
    return {
        each: of if each == ENERGY or _is_error(each) else np.where(unknown, np.nan, of)
        for each, of in values.items()
    }


def columns_of(
    t: Reals, values: Mapping[Component, Reals], error: Callable[[Component], list[float]] | None = None
) -> list[Column]:
    """Return the numbers at each time as columns."""
    columns = [column("t_s", t.tolist())]
    for each, of in values.items():
        bounds = None if error is None or _is_error(each) else partial(error, each)
        # an error is infinite where no digit holds
        columns.append(column(each.header, of.tolist() if _is_error(each) else cells(of), bounds))
    return columns


def documents(t: Reals, values: Values, further: Table) -> Document:
    """Return the numbers at each time and the integration, for JSON."""
    numbers = {each: cells(of) for each, of in values.items()}
    rows = list(in_rows({"t_s": t.tolist(), **nested(numbers, len(t))}, len(t)))
    return {"time": rows, **document([further])}


def drift(change: Reals) -> Column:
    """Return the largest change of energy that the work of the loads does not explain, with its sign."""
    finite = change[np.isfinite(change)]
    return number("energy_drift", "energy", [finite[np.argmax(np.abs(finite))] if len(finite) else np.nan])


# --- the worked solution ----------------------------------------------------------------------------------------------
def way(run: Run, inputs: Sequence[Input]) -> list[Topic]:
    """Return the equation of motion at the start, and the balance of energy."""
    q, v, a = (np.asarray(each, dtype=float) for each in (run.angle[0], run.speed[0], run.acceleration[0]))
    law = [
        "The inputs are free: by d'Alembert's principle M(q)·q̈ + h(q, q̇, t) = 0, with no effort at any input "
        "(Riul, unit II, eq. 5, solved for the accelerations).",
    ]
    for entry, place, speed, rate in zip(inputs, q.tolist(), v.tolist(), a.tolist(), strict=True):
        unit = "m" if entry.is_slide else "rad"
        law.append(
            f"  at t = {figures(float(run.t[0]))} s: {entry.name} = {figures(place)} {unit}, speed {figures(speed)} {unit}/s, "
            f"acceleration {figures(rate)} {unit}/s²"
        )
    energy = np.asarray(run.energy, dtype=float)
    first, last = float(energy[0]), float(energy[-1])
    drift = float(np.abs(run.energy_drift).max())
    balance = [
        f"E = T + V (gravity, springs): {figures(first)} J at t = {figures(float(run.t[0]))} s, "
        f"{figures(last)} J at t = {figures(float(run.t[-1]))} s",
        f"  E_end − E_start = {figures(last - first)} J is the work of applied loads, dampers and friction; unexplained {figures(drift)} J",
    ]
    start = {"angle": q.tolist(), "speed": v.tolist(), "acceleration": a.tolist()}
    head = {"start_J": first, "end_J": last, "energy_drift_J": drift}
    return [Topic("start", law, "Equation of motion", start), Topic("energy", balance, "Energy", head)]
