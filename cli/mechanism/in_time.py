"""`--time`: the motion under forces as columns, as JSON, as words and as a picture."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np

from cli.errors import DataError
from cli.mechanism.columns import column
from cli.mechanism.quantities import (
    SLIDE,
    Quantity,
    bounds_of,
    cells,
    in_rows,
    keys_of,
    links,
    nested,
    points,
    reactions,
    slides,
)
from cli.mechanism.read import until_inputs
from cli.mechanism.solve import Analysis
from cli.read import options
from cli.read.units import read_degrees
from cli.show.columns import Result, Table
from virtualwork.describe.parts import GROUND

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from cli.show.columns import Column, Document
    from virtualwork import Mechanism
    from virtualwork.intime.run import Run
    from virtualwork.intime.travel import Travel

    Reals = NDArray[np.float64]
    Values = dict[Quantity, Reals]

# an input's angle and its rates
INPUT = ("angle_deg", "speed_rad_s", "acceleration_rad_s2")
ENERGY = Quantity(("energy_J",), "energy_J")
METHOD = (
    "Motion under forces: the effort at the inputs by virtual work with d'Alembert's forces is M·q̈ + h; let go, it is "
    "zero, and q̈ is integrated in the inputs. Loops are closed at every evaluation. The error is estimated from a "
    "second solution in steps half as long."
)


def times_and_accuracy(time: str, accuracy: str | None) -> tuple[list[float], float]:
    """The times and the accuracy."""
    times = options.time_range("--time", time)
    if len(times) > 1 and times[1] < times[0]:
        raise options.bad("--time", f"'{time}': expected rising times")
    try:
        value = 1e-9 if accuracy is None else float(accuracy)
    except ValueError:
        value = math.nan
    if not 0 < value < 1:
        raise options.bad("--accuracy", f"'{accuracy}': expected a number between 0 and 1, such as 1e-9")
    return times, value


@dataclass(eq=False)
class InTime:
    """One call with `--time`."""

    analysis: Analysis
    times: list[float]
    accuracy: float
    until: str | None
    bare: Mapping[str, str]
    forces: bool = False

    @cached_property
    def run(self) -> Run:
        """The simulation."""
        from virtualwork import MechanismError
        from virtualwork.intime.run import simulate

        a = self.analysis
        level = None if self.until is None else until_inputs(a.mechanism, self.until, self.bare)
        (assembly,) = a.assemblies
        try:
            return simulate(assembly, self.times, accuracy=self.accuracy, until=level)
        except MechanismError:
            raise
        except ValueError as error:
            raise DataError(f"{a.file}: {error}") from None

    @cached_property
    def _asked(self) -> list[Quantity]:
        """What is asked for beside the inputs and the energy."""
        a, m, found = self.analysis, self.analysis.mechanism, []
        if a.only is not None:
            found = [*links(a.links, 2), *points(m, a.points, 2), *slides(m, a.slides, 2)]
        return found + (reactions(a) if self.forces else [])

    def values(self, way: Travel) -> Values:
        """All that is asked for, of one of the two solutions."""
        m, t = self.analysis.mechanism, self.run.t
        q, v, acceleration, _ = way.at(t)
        found = inputs_of(m, q, v, acceleration, self.run.error_estimate)
        turned = {each.path[1]: values for each, values in found.items() if each.path[2] == "angle_deg"}
        given = {e.link: turned[e.name] for e in m.inputs if not e.is_slide and e.on == GROUND}
        found[ENERGY] = way.energy(t)
        keys = keys_of(self._asked)
        known = dict(zip(keys, way.motion(t).values(keys), strict=True)) if keys else {}
        for each in self._asked:
            if each.turns:
                # whole turns and all
                name = each.key[1]
                found[each] = given[name] if name in given else np.degrees(way.link_angle(name, t))
            else:
                found[each] = each.of(known[each.key]) if each.key else np.zeros(len(t))
        return found

    @cached_property
    def fine(self) -> Values:
        """The answer."""
        return self.values(self.run.fine)

    @cached_property
    def coarse(self) -> Values:
        """The coarser solution, for the errors."""
        return self.values(self.run.coarse)

    def table(self) -> Table:
        """A row for each time."""
        return Table(columns_of(self.run.t, self.shown, self._error), keys=("t_s",))

    @cached_property
    def shown(self) -> Values:
        """The answer as far as any digit of it is known."""
        return known(self.fine, self.run.unknown)

    def _error(self, each: Quantity) -> list[float]:
        return bounds_of(self.run.spread(self.fine[each], self.coarse[each]))

    @property
    def errors(self) -> dict[Quantity, list[float]]:
        """The bounds of the errors of all that has one, worked out."""
        return {each: self._error(each) for each in self.fine if not _is_error(each)}

    def document(self) -> Document:
        """The JSON document."""
        return {
            "name": self.analysis.mechanism.name,
            "time": rows_of_time(self.run.t, self.shown),
            "energy_drift_J": largest(self.run.energy_drift),
            "methods": self.run.fine.methods,
            "steps": self.run.fine.steps,
        }

    def words(self) -> str:
        """What is told below the table."""
        run = self.run
        drift = float(np.abs(run.energy_drift).max())
        error = ", ".join(
            f"{entry.name} {value:.1e} {'m' if entry.is_slide else 'rad'}"
            for entry, value in zip(
                self.analysis.mechanism.inputs, run.error_estimate.max(axis=0), strict=True
            )
        )
        return (
            f"{' and '.join(run.fine.methods)}: {run.fine.steps} steps\n"
            f"error of the inputs, estimated: {error}\n"
            f"energy that the work of the loads does not explain: {drift:.1e} J"
        )

    def result(self, about: dict[str, str]) -> Result:
        """The call in every form it can be shown in."""
        a = self.analysis

        def figure() -> Figure:
            from cli.show.picture import blank

            drawn = blank()
            self.run.plot(drawn)
            return drawn

        return Result(
            document=self.document,
            tables={"time": self.table},
            notes=lambda: a.mechanism.name,
            afterword=self.words,
            figure=figure,
            method=METHOD,
            about={"title": a.mechanism.name or "Mechanism"} | about,
            warnings=[*a.warnings, *self.run.warnings],
        )


def inputs_of(m: Mechanism, q: Reals, v: Reals, a: Reals, error: Reals) -> Values:
    """The inputs, their rates and errors (n, k), as they are shown."""
    found: Values = {}
    for j, entry in enumerate(m.inputs):
        lead = f"{entry.name}_input_" if len(m.inputs) > 1 else "input_"
        values = (q[:, j], v[:, j], a[:, j], error[:, j])
        if not entry.is_slide:
            values = (_degrees(q[:, j]), *values[1:3], np.degrees(error[:, j]))
        unit = "m" if entry.is_slide else "deg"
        names = *(SLIDE if entry.is_slide else INPUT)[:3], f"error_estimate_{unit}"
        for name, its in zip(names, values, strict=True):
            header = f"{lead}{unit if name in (SLIDE[0], INPUT[0]) else name}"
            found[Quantity(("inputs", entry.name, name), header)] = its
    return found


def _degrees(q: Reals) -> Reals:
    """An input in degrees; where it starts, and where it may have been told to end, as it was written."""
    angle = np.degrees(q)
    for i in {0, len(q) - 1}:
        angle[i] = read_degrees(float(q[i]))
    return np.asarray(angle)


def _is_error(each: Quantity) -> bool:
    return str(each.path[-1]).startswith("error")


def known(values: Values, unknown: NDArray[np.bool_]) -> Values:
    """Values without what no digit is known of: what stays are the errors, and the energy, which has one of its own."""
    if not unknown.any():
        return values
    return {
        each: of if each == ENERGY or _is_error(each) else np.where(unknown, np.nan, of)
        for each, of in values.items()
    }


def columns_of(
    t: Reals, values: Values, error: Callable[[Quantity], list[float]] | None = None
) -> list[Column]:
    """What is found at each time as columns."""
    columns = [column("t_s", t.tolist())]
    for each, of in values.items():
        told = None if error is None or _is_error(each) else partial(error, each)
        columns.append(column(each.header, cells(of), told))
    return columns


def rows_of_time(t: Reals, values: Values) -> list[Document]:
    """What is found at each time as JSON."""
    numbers = {each: cells(of) for each, of in values.items()}
    return list(in_rows({"t_s": t.tolist(), **nested(numbers, len(t))}, len(t)))


def largest(drift: Reals) -> float | None:
    """The largest of numbers by size, sign and all; None where there is none."""
    there = drift[np.isfinite(drift)]
    return float(there[np.argmax(np.abs(there))]) if len(there) else None
