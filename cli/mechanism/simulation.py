"""The motion of a mechanism in time under its loads, with its table, JSON, picture and page; of variants one by one or together."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import nullcontext, suppress
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from cli.cases.analysis import Analysis
from cli.cases.axes import input_values
from cli.cases.case import Case, Study
from cli.cases.poses import bounds_of, keys_of
from cli.cases.remarks import idle_friction
from cli.mechanism.motion_tables import ENERGY, columns_of, documents, drift, inputs_of, trusted, way
from cli.read import options
from cli.show.commands import ShowOptions
from dalembert.arithmetic.engines import anew
from dalembert.dataclass import dataclass, replace
from dalembert.errors import DataError
from dalembert.results.chosen_units import shown as on_page
from dalembert.results.columns import Column, Table, names
from dalembert.tables.files import name_of
from dalembert.terminal import progress_in_time
from virtualwork import MechanismError, quantities
from virtualwork.describe.parts import GROUND
from virtualwork.formulas.forces import Shaking
from virtualwork.quantities import Component

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from cli.cases.cases import Rows
    from cli.mechanism.motion_tables import Values
    from dalembert.results.columns import Document
    from dalembert.results.way import Topic
    from virtualwork import Mechanism
    from virtualwork.animation import Series
    from virtualwork.intime.run import Run
    from virtualwork.intime.travel import Moved, Travel

    Reals = NDArray[np.float64]


METHOD = (
    "Motion under forces: the effort at the inputs by virtual work with d'Alembert's forces is M·q̈ + h; of released inputs "
    "it is zero, and q̈ is integrated in the inputs. Loops are closed at every evaluation. The error is estimated from a "
    "second solution in steps half as long."
)
# variants of a part that are simulated together, and one by one
TOGETHER, ONE_BY_ONE = 512, 8


@dataclass(eq=False)
class Motion(Case):
    """One mechanism released."""

    study: Simulation
    analysis: Analysis
    # the only one, whose progress a terminal shows; of many variants it is counted how many are done
    alone: bool = False

    @cached_property
    def run(self) -> Run:
        """The simulation."""
        from virtualwork.intime.run import simulate

        a, study = self.analysis, self.study
        (assembly,) = a.assemblies
        try:
            with progress_in_time() if self.alone else nullcontext() as progress:
                return simulate(
                    assembly,
                    study.times,
                    accuracy=study.accuracy,
                    until=study.levels(a.mechanism),
                    progress=progress,
                )
        except MechanismError:
            raise
        except ValueError as error:
            raise DataError(f"{a.file}: {error}") from None

    @cached_property
    def _wanted(self) -> list[Component]:
        """The components that are requested in addition to the inputs and the energy."""
        return [*(self.analysis.places if self.analysis.request.only is not None else []), *self._forces]

    @property
    def _forces(self) -> list[Component]:
        """The joint forces and the shaking force, where they are requested."""
        a = self.analysis
        if not a.request.forces:
            return []
        # --forces requests joint forces: those that --only names, of all joints where it names none
        joints = [each for each in a.forces if each.path[:1] == ("reactions",)]
        every = quantities.forces(a.mechanism, a.pairs)
        joints = joints or [each for each in every if each.path[:1] == ("reactions",) and not each.reverse]
        return [*joints, *(each for each in every if each.path[:1] == Shaking())]

    def values(
        self, way: Travel, wanted: Sequence[Component], times: Reals | None = None, moved: Moved | None = None
    ) -> Values:
        """Return the inputs, the energy and some quantities of one of the two solutions; `moved`: with other states."""
        m, t = self.analysis.mechanism, self.run.t if times is None else times
        q, v, acceleration, _ = way.at(t)
        if moved is not None:
            q, v = q + moved[0], v + moved[1]
        error = self.run.error_estimate if times is None else np.zeros_like(q)
        values = inputs_of(m, q, v, acceleration, error)
        turned = {each.path[1]: angles for each, angles in values.items() if each.path[2] == "angle_deg"}
        driven = {e.link: turned[e.name] for e in m.inputs if not e.is_slide and e.on == GROUND}
        values[ENERGY] = way.energy(t, moved)
        keys = keys_of(wanted)
        solved = dict(zip(keys, way.motion(t, moved).values(keys), strict=True)) if keys else {}
        for each in wanted:
            if each.link:
                # whole turns and all
                name = each.link
                values[each] = driven[name] if name in driven else np.degrees(way.link_angle(name, t, moved))
            else:
                values[each] = each.of(solved[each.key]) if each.key else np.zeros(len(t))
        return values

    @cached_property
    def fine(self) -> Values:
        """The answer."""
        return self.values(self.run.fine, self._wanted)

    @cached_property
    def errors(self) -> Values:
        """The errors of the answer."""

        def of(way: Travel, t: Reals, moved: Moved | None) -> list[Reals]:
            return list(self.values(way, self._wanted, t, moved).values())

        run, errors = self.run, dict(zip(self.fine, self.run.errors(of), strict=True))
        if run.unknown.any() and not np.any(run.work):
            # no load takes energy: what the energy has changed by is its error, also where the states are lost
            kept = errors[ENERGY][0] + np.maximum.accumulate(np.abs(run.energy_drift))
            errors[ENERGY] = np.where(run.unknown, np.minimum(errors[ENERGY], kept), errors[ENERGY])
        return errors

    def table(self) -> Table:
        """Return a row for each time."""
        columns = columns_of(self.run.t, self.shown, self._error if self.study.needs_errors else None)
        return Table(columns, keys=("t_s",))

    def pattern(self) -> Table:
        """Return the columns, from the first time alone."""
        show = ShowOptions(**(vars(self.study.show) | {"digits": False}))
        first = replace(self.study, times=self.study.times[:1], until=None, show=show)
        return Motion(first, self.analysis).table()

    @cached_property
    def shown(self) -> Values:
        """The answer as far as any digit of it can be trusted."""
        return trusted(self.fine, self.run.unknown)

    def _error(self, each: Component) -> list[float]:
        error = self.errors[each]
        if each.key:
            own = self.run.rounding(each.key)
            error = error + (np.degrees(own) if each.in_degrees else own)
        return bounds_of(error)

    def further(self) -> dict[str, Callable[[], Table]]:
        """Return the table of the integration."""
        return {"integration": self.integration}

    def integration(self) -> Table:
        """Return how it was integrated, and how exactly: method, steps, errors of the inputs, energy."""
        run, inputs = self.run, self.analysis.mechanism.inputs
        of_run = [
            Column(
                "methods", "", [" and ".join(run.fine.methods)], place="methods", stored=[run.fine.methods]
            ),
            names("steps", [run.fine.steps]),
        ]
        errors = [
            Column(f"error of {entry.name}, estimated", "m" if entry.is_slide else "rad", [float(error)])
            for entry, error in zip(inputs, run.error_estimate.max(axis=0), strict=True)
        ]
        if self.study.cases.names:
            # variants that are solved together have none
            of_run = [replace(column, place=None) for column in of_run]
        return Table([drift(run.energy_drift), *of_run, *errors], place="")

    def document(self) -> Document:
        """Return the JSON document."""
        shown, request = self.shown, self.analysis.request
        if request.only is None:
            # in addition to the forces all points and links
            every = self.values(self.run.fine, [*self.analysis.places, *self._forces])
            shown = trusted(every, self.run.unknown)
        return documents(self.run.t, shown, self.integration())

    def warnings(self) -> list[str]:
        """Return the warnings: an early end, and doubts."""
        own = [*self.analysis.warnings, *self.run.warnings, *idle_friction(self.analysis.mechanism)]
        unknown = self.run.fine.undetermined(self.run.t) if self._forces else np.zeros(0, dtype=bool)
        if unknown.any():
            more = int(unknown.sum()) - 1
            others = f" and {more} later time{'s' if more > 1 else ''}" if more else ""
            own.append(
                f"joint forces at {self.run.t[np.argmax(unknown)]:.6g} s{others}: without the friction of joints that are at rest "
                "there, which statics does not determine"
            )
        return own

    def way(self) -> list[Topic]:
        """Return the start, and the energy."""
        return way(self.run, self.analysis.mechanism.inputs)

    def figure(self) -> Figure:
        """Draw inputs, speeds and energy over time, and the mechanism at instants."""
        from dalembert.drawing.sheet import blank

        drawn = blank()
        self.run.plot(drawn)
        return drawn

    def series(self, variant: str, units: Mapping[str, str] | None) -> Series:
        """Return all points and links over time for a page, whatever --only names."""
        from virtualwork.animation import JointForce

        a, m = self.analysis, self.analysis.mechanism
        every = replace(a, request=a.request._replace(only=[*m.links, *m.points]))
        every.assemblies = a.assemblies
        whole = Motion(self.study, every)
        whole.run = self.run
        arrows = [JointForce.of(*row) for row in (every.pairs if a.request.forces else ())]
        name = f"variant {variant}" if variant else ""
        return self.run.series(on_page(whole.table(), units), ["t_s", *a.input_columns], arrows, name)


@dataclass(frozen=True)
class Simulation(Study):
    """Release every case.

    Attributes
    ----------
    times : list of float
        s.
    accuracy : float
    until : str, optional
        The input at which it ends.
    """

    times: Sequence[float] = ()
    accuracy: float = 1e-9
    until: str | None = None

    title = "time"
    blank: ClassVar[Mapping[str, Any]] = {"time": [], "energy_drift_J": None}
    method = METHOD

    @property
    def needs_errors(self) -> bool:
        """Whether a table has the bounds of its numbers: of variants only where digits are cut by them."""
        return self.show.digits or not self.cases.names

    def warnings(self) -> list[str]:
        """Return a warning for each effort among --only: a released input has none."""
        nominal = self.cases.nominal
        efforts = {name for each in nominal.forces if each.path[:1] == ("effort",) for name in each.names}
        names = [name for name in nominal.request.only or () if name in efforts]
        return [f"--only {name}: a released input has no effort: left out" for name in names]

    def levels(self, m: Mechanism) -> dict[str, float] | None:
        """Return the inputs at which it ends, SI."""
        if self.until is None:
            return None
        levels = input_values(m, self.until, "--until", self.cases.bare)
        return {m.inputs[j].name: value.si for j, value in levels.items()}

    def case(self, analysis: Analysis) -> Motion:
        """Return the motion of one mechanism."""
        motion = Motion(self, analysis, alone=not self.cases.names)
        if len(motion.analysis.assemblies) > 1:
            raise options.bad("--branch", "simulate follows one assembly: expected its number")
        return motion

    def size(self, json: bool, together: bool) -> int:
        """Return the number of variants of a part."""
        return TOGETHER if self.at_once else ONE_BY_ONE

    @property
    def frames(self) -> int:
        """The number of states of a variant that the page shows."""
        return len(self.times)

    def page(self, cases: Sequence[tuple[str, Case]], units: Mapping[str, str] | None) -> bytes:
        """Return the page of motions under forces: the longest is drawn in full, the others as ghosts."""
        from virtualwork.animation import moving_page

        series = []
        for name, case in cases:
            # a variant that cannot be simulated is named by the remarks
            with suppress(MechanismError) if name else nullcontext():
                assert isinstance(case, Motion)
                series.append(case.series(name, units))
        if not series:
            raise MechanismError("--page: no variant can be simulated, and there is nothing to draw")
        series.sort(key=lambda one: -one.poses.n)
        return moving_page(series[0].mechanism.name, series, time="t_s").html.encode()

    @property
    def at_once(self) -> bool:
        """Whether the inputs and the energy are all that is shown, which variants have as lanes; JSON has points and links."""
        r = self.cases.request
        return r.only is None and r.branch is None and not (r.forces or self.show.digits or self.json)

    def each(self, rows: Rows) -> Iterator[tuple[Case | None, list[str]]]:
        """Yield the cases of some variants, each with its warnings; None where one cannot be simulated."""
        anew()
        if self.at_once:
            yield from _lanes(self, rows)
        else:
            yield from super().each(rows)


@dataclass(eq=False)
class Lane(Case):
    """A variant that was simulated together with others."""

    t: Reals
    values: Values
    drift: Reals

    def tables(self) -> Iterator[Table]:
        """Yield a row for each time."""
        yield Table(columns_of(self.t, self.values), keys=("t_s",))

    def document(self) -> Document:
        """Return the JSON document."""
        return documents(self.t, self.values, Table([drift(self.drift)], place=""))


def _lanes(study: Simulation, rows: Rows) -> Iterator[tuple[Case | None, list[str]]]:
    """Simulate variants together, and yield them."""
    m = study.cases.mechanism
    try:
        runs = m.vary(study.cases.in_si(rows)).simulate(
            study.times, accuracy=study.accuracy, until=study.levels(m)
        )
    except ValueError as error:
        raise DataError(f"{name_of(study.cases.request.file)}: {error}") from None
    for i, reached in enumerate(np.isfinite(runs.times)):
        remarks = list(runs.warnings.get(i, ()))
        if not reached.any():
            yield None, remarks
            continue
        of = (runs.angle, runs.speed, runs.acceleration, runs.error_estimate)
        values = inputs_of(m, *(x[i, reached] for x in of)) | {ENERGY: runs.energy[i, reached]}
        yield (
            Lane(
                runs.times[i, reached],
                trusted(values, runs.unknown[i, reached]),
                runs.energy_drift[i, reached],
            ),
            remarks,
        )
