"""`--time`: the motion under forces as columns, as JSON, as words and as a picture."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cli.errors import DataError
from cli.mechanism.columns import bounds_of, column
from cli.mechanism.forces import rows_of
from cli.mechanism.poses import LINK, POINT, SLIDE, cells
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
    # kind -> name -> quantity -> values; a reaction's name is (joint, on, from)
    Parts = dict[str, dict[Any, dict[str, Reals]]]

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

    def parts(self, way: Travel) -> Parts:
        """All that is asked for, of one of the two solutions."""
        a, run = self.analysis, self.run
        found: Parts = {"inputs": self._inputs(way), "energy": {"": {"energy_J": way.energy(run.t)}}}
        motion = way.motion(run.t)
        if a.only is not None:
            given = {e.link: e.name for e in a.mechanism.inputs if not e.is_slide and e.on == GROUND}
            found["links"] = {
                name: dict(
                    zip(
                        LINK,
                        (
                            found["inputs"][given[name]]["angle_deg"]
                            if name in given
                            else np.degrees(way.link_angle(name, run.t)),
                            link.omega,
                            link.alpha,
                        ),
                        strict=False,
                    )
                )
                for name, link in ((name, motion.link(name)) for name in a.links)
            }
            found["points"] = {
                name: {
                    key: values
                    for order, keys in enumerate(POINT[:3])
                    for key, values in zip(keys, _xy(motion.point(name).complex(order)), strict=True)
                }
                for name in a.points
            }
            found["slides"] = {
                name: dict(zip(SLIDE, (slide.position, slide.speed, slide.acceleration), strict=False))
                for name, slide in ((name, motion.slide(name)) for name in a.slides)
            }
        if self.forces:
            found |= self._forces(motion)
        return found

    def _inputs(self, way: Travel) -> dict[Any, dict[str, Reals]]:
        q, v, acceleration, _ = way.at(self.run.t)
        return inputs_of(self.analysis.mechanism, q, v, acceleration, self.run.error_estimate)

    def _forces(self, motion: Any) -> Parts:
        found: dict[Any, dict[str, Reals]] = {}
        dynamics = motion.dynamics
        for joint, on, of in rows_of(self.analysis, self.run.first_motion):
            force = dynamics.joint_force(joint, on)
            values = force.real, force.imag, dynamics.joint_moment(joint, on)
            found[joint.name, on, of] = dict(zip(("fx_N", "fy_N", "moment_N_m"), values, strict=True))
        force, moment = dynamics.shaking
        shaking = {"fx_N": force[:, 0], "fy_N": force[:, 1], "moment_N_m": moment}
        return {"reactions": found, "shaking": {"": shaking}}

    @cached_property
    def fine(self) -> Parts:
        """The answer."""
        return self.parts(self.run.fine)

    @cached_property
    def coarse(self) -> Parts:
        """The coarser solution, for the errors."""
        return self.parts(self.run.coarse)

    def table(self) -> Table:
        """A row for each time."""
        several = len(self.analysis.mechanism.inputs) > 1
        return Table(columns_of(self.run.t, self.shown, several, self._error), keys=("t_s",))

    @cached_property
    def shown(self) -> Parts:
        """The answer as far as any digit of it is known."""
        return known(self.fine, self.run.unknown)

    def _error(self, kind: str, name: Any, key: str) -> list[float]:
        return bounds_of(self.run.spread(self.fine[kind][name][key], self.coarse[kind][name][key]))

    @property
    def errors(self) -> dict[tuple[str, Any, str], list[float]]:
        """The bounds of the errors of all that has one, worked out."""
        return {
            (kind, name, key): self._error(kind, name, key)
            for kind, entries in self.fine.items()
            for name, of in entries.items()
            for key in of
            if not key.startswith("error")
        }

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


def inputs_of(m: Mechanism, q: Reals, v: Reals, a: Reals, error: Reals) -> dict[Any, dict[str, Reals]]:
    """The inputs, their rates and errors (n, k) by name, as they are shown."""
    found: dict[Any, dict[str, Reals]] = {}
    for j, entry in enumerate(m.inputs):
        if entry.is_slide:
            found[entry.name] = {
                "position_m": q[:, j],
                "speed_m_s": v[:, j],
                "acceleration_m_s2": a[:, j],
                "error_estimate_m": error[:, j],
            }
        else:
            found[entry.name] = {
                "angle_deg": _degrees(q[:, j]),
                "speed_rad_s": v[:, j],
                "acceleration_rad_s2": a[:, j],
                "error_estimate_deg": np.degrees(error[:, j]),
            }
    return found


def _degrees(q: Reals) -> Reals:
    """An input in degrees; where it starts, and where it may have been told to end, as it was written."""
    angle = np.degrees(q)
    for i in {0, len(q) - 1}:
        angle[i] = read_degrees(float(q[i]))
    return np.asarray(angle)


def known(parts: Parts, unknown: NDArray[np.bool_]) -> Parts:
    """Parts without what no digit is known of: what stays are the errors, and the energy, which has one of its own."""
    if not unknown.any():
        return parts
    return {
        kind: {
            name: {
                key: values
                if kind == "energy" or key.startswith("error")
                else np.where(unknown, np.nan, values)
                for key, values in of.items()
            }
            for name, of in entries.items()
        }
        for kind, entries in parts.items()
    }


def columns_of(
    t: Reals, parts: Parts, several: bool, error: Callable[[str, Any, str], list[float]] | None = None
) -> list[Column]:
    """What is found at each time as columns; `several`: whether there are several inputs."""
    columns = [column("t_s", t.tolist())]
    for kind, entries in parts.items():
        for name, values in entries.items():
            for key, numbers in values.items():
                told = None if error is None or key.startswith("error") else partial(error, kind, name, key)
                columns.append(column(_header(kind, name, key, several=several), cells(numbers), told))
    return columns


def rows_of_time(t: Reals, parts: Parts) -> list[Document]:
    """What is found at each time as JSON."""
    lists = {
        kind: {name: {key: cells(values) for key, values in of.items()} for name, of in entries.items()}
        for kind, entries in parts.items()
    }
    rows: list[Document] = []
    for i, time in enumerate(t.tolist()):
        row: dict[str, Any] = {"t_s": time}
        for kind, entries in lists.items():
            here = {name: {key: values[i] for key, values in of.items()} for name, of in entries.items()}
            if kind == "energy":
                row |= here[""]
            elif kind == "shaking":
                row[kind] = here[""]
            elif kind == "reactions":
                row[kind] = [
                    {"joint": joint, "on": on, "from": of, **values}
                    for (joint, on, of), values in here.items()
                ]
            elif here:
                row[kind] = here
        rows.append(row)
    return rows


def largest(drift: Reals) -> float | None:
    """The largest of numbers by size, sign and all; None where there is none."""
    there = drift[np.isfinite(drift)]
    return float(there[np.argmax(np.abs(there))]) if len(there) else None


def _xy(z: NDArray[np.complex128]) -> tuple[Reals, Reals]:
    return z.real, z.imag


def _header(kind: str, name: Any, key: str, *, several: bool) -> str:
    """How a quantity is called in a table."""
    if kind == "inputs":
        rest = {"angle_deg": "deg", "position_m": "m"}.get(key, key)
        return f"{name}_input_{rest}" if several else f"input_{rest}"
    if kind == "energy":
        return key
    if kind == "shaking":
        return f"shaking_{key}"
    if kind == "reactions":
        joint, on, of = name
        return f"{joint}_{of}_on_{on}_{key}"
    return f"{name}_{key}"
