"""The forces of `dalembert forces`, and over a cycle: mean, peak and r.m.s. effort, work, flywheel, counterweights."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from functools import cache, cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cli.cases.study import PoseCase, PoseStudy
from cli.read.options import bad
from dalembert.angles import degrees, in_turn
from dalembert.arithmetic.exact import EPS
from dalembert.dataclass import dataclass, replace
from dalembert.errors import DataError
from dalembert.hints import choices
from dalembert.results.columns import Column, Table, names, number

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from cli.cases.analysis import Analysis
    from dalembert.results.result import Result
    from dalembert.results.way import Topic

Document = dict[str, Any]


@dataclass
class ForceCase(PoseCase):
    """The forces of one mechanism, its cycle and its counterweights."""

    study: Forces

    @cached_property
    def cycle(self) -> tuple[Table, str]:
        """The table of the cycle, and the reason why the poses are none, else empty."""
        study = self.study
        table, reason = cycle_of(self.analysis, study.flywheel)
        if reason and (study.json or study.flywheel is not None):
            self.analysis.warnings.append(f"no cycle, so no mean, peak, work or flywheel: {reason}")
        return table, reason

    @cached_property
    def extra(self) -> dict[str, Table]:
        """The cycle, and the counterweights."""
        study, tables = self.study, dict[str, Table]()
        if study.has_cycle or study.flywheel is not None:
            tables["cycle"], _ = self.cycle
        if study.counterweights is not None:
            tables |= counterweights(self.analysis, study.counterweights)
        return tables

    def afterword(self) -> str:
        """Return the reason why there is no cycle, where no warning has it."""
        study = self.study
        if not study.has_cycle or study.json or study.flywheel is not None:
            return ""
        _, reason = self.cycle
        return f"no cycle: {reason}" if reason else ""

    def way(self) -> list[Topic]:
        """Return the ledger of every pose, and free-body diagrams."""
        from cli.mechanism.free_bodies import way

        return way(self.analysis)

    def figure(self) -> Figure:
        """Draw the forces or the requested quantities against the input; of one pose the mechanism."""
        from cli.cases.picture import curves, drawn, forces_drawn, is_by_quantity

        analysis = self.analysis
        if is_by_quantity(analysis):
            return curves(analysis)
        several = len(analysis.inputs.whole.shown) > 2 and analysis.motions[0].assembled.any()
        return forces_drawn(analysis) if several else drawn(analysis)

    def states(self) -> PoseCase:
        """Return the case of the same poses with all links."""
        return PoseCase(self.study, self.analysis.requesting(only=None))

    def result(self) -> Result:
        """Return the result of this mechanism alone, in every form; the states of all links can be expected."""
        from cli.mechanism.free_bodies import table

        result = super().result()
        result.expected = (*result.expected, lambda: table(self.states().analysis))
        result.beside = self.study.files()
        return result


@dataclass(frozen=True)
class Forces(PoseStudy):
    """Solve the forces of every case: effort, joint forces, shaking force.

    Attributes
    ----------
    flywheel : float, optional
        The speed fluctuation with the flywheel.
    counterweights : list of str, optional
        The links that get counterweights.
    states : Path, optional
        The file of the table of link states.
    """

    flywheel: float | None = None
    counterweights: list[str] | None = None
    states: Path | None = None

    kind = ForceCase

    @property
    def is_swept(self) -> bool:
        """Whether the inputs go through a range or a table."""
        moved = self.cases.moved
        return moved is not None and any(axis.option in ("--over", "--cases") for axis in moved.axes)

    @property
    def has_cycle(self) -> bool:
        """Whether the poses may be a cycle."""
        return self.is_swept and len(self.cases.mechanism.inputs) == 1

    @property
    def poses_alone(self) -> bool:
        """Whether a file of tables has the poses and nothing else; a workbook of a long sweep has no cycle."""
        return self.flywheel is None and self.counterweights is None

    @property
    def extra_in_json(self) -> bool:
        """Whether the JSON document of each variant has more than its poses."""
        return self.has_cycle or self.counterweights is not None

    def check_options(self) -> None:
        """Refuse options that need a cycle where there is none, and values that mean nothing."""
        if self.flywheel is not None and not 0 < self.flywheel < math.inf:
            raise bad("--flywheel", "expected a positive speed fluctuation, such as 0.02")
        for flag, value in (("--flywheel", self.flywheel), ("--counterweights", self.counterweights)):
            if value is not None and not self.is_swept:
                raise bad(flag, "expected a cycle too, such as --over 0deg:360deg:1deg")
        links = self.cases.mechanism.links
        for link in self.counterweights or ():
            if link not in links:
                raise bad("--counterweights", f"unknown link '{link}'{choices(link, links)}")
        if self.states is not None and self.cases.varied is not None:
            raise bad("--states", "expected one mechanism: --over and --cases of dimensions make several")

    def files(self) -> dict[Path, Callable[[], Iterable[bytes]]]:
        """Return the file of the states."""
        if self.states is None:
            return {}
        case = ForceCase(self, self.cases.nominal).states()
        return {self.states: lambda: _csv_parts(case, self.show.digits)}


def _csv_parts(case: PoseCase, digits: bool) -> Iterator[bytes]:
    """Yield the states of all links as CSV; with `digits` only the digits that hold."""
    from cli.mechanism.free_bodies import table
    from dalembert.results.digits import digits_that_hold
    from dalembert.results.text import csv_text

    for i, whole in enumerate(case.tables(table)):
        shown = digits_that_hold(whole)[0] if digits else whole
        yield csv_text(shown.cells, header=i == 0).encode()


def cycle_of(analysis: Analysis, coefficient: float | None) -> tuple[Table, str]:
    """Return mean, peak and r.m.s. effort over the cycle, work, energy error and flywheel; and why the sweep is no cycle."""
    from virtualwork.study.cycle import Cycle

    motion = analysis.motions[0]
    m = analysis.mechanism
    if len(m.inputs) != 1:
        raise DataError(f"{analysis.file}: a cycle has one input, found {len(m.inputs)}")
    slide = m.inputs[0].is_slide
    coarse = Cycle(motion)
    if not np.isfinite(motion.effort).all():
        reason = "the effort is not finite at every pose of the sweep"
    else:
        reason = coarse.reason or ""
    c = coarse if reason else coarse.refined()
    if not reason and not np.isfinite(c.effort).all():
        reason = "the effort is not finite at every pose between those of the sweep"
    effort, place = ("force", "length") if slide else ("torque", "angle")
    quantities: dict[str, tuple[str, str, Callable[[], float | None]]] = {
        f"mean_{effort}": (effort, "mean", lambda: c.mean),
        f"peak_{effort}": (effort, "peak", lambda: c.peak),
        "peak_at": (place, "peak_at", lambda: c.peak_at if slide else _in_turns(c.peak_at, c.turns)),
        f"rms_{effort}": (effort, "rms", lambda: c.rms),
        "peak_power": ("power", "peak_power", lambda: c.peak_power),
        "work": ("energy", "work", lambda: c.work),
        "energy_closure": ("energy", "work", lambda: c.closure),
    }

    @cache
    def errors() -> dict[str, float]:
        known = c.error_estimate()
        known["peak_at"] = known["peak_at"] if slide else math.degrees(known["peak_at"])
        # the inertia of a flywheel is in proportion to it
        known["share"] = known["fluctuation"] / c.fluctuation + 8 * EPS if c.fluctuation else math.inf
        return known

    def column(name: str, dimension: str, of: str, value: float | None) -> Column:
        computed = np.array([value], dtype=float)
        error = (lambda: [errors()[of]]) if of and value is not None else None
        return number(name, dimension, computed, error=error)

    columns = [
        column(name, dimension, of, None if reason else value())
        for name, (dimension, of, value) in quantities.items()
    ]
    wheel = math.nan
    if coefficient is not None and not reason:
        if slide:
            raise DataError(f"{analysis.file}: --flywheel: the input is a slide: a flywheel turns")
        try:
            wheel = c.flywheel(coefficient)
        except ValueError as error:
            raise DataError(f"{analysis.file}: --flywheel: {error}") from None
    flywheel = [number("flywheel_inertia", "inertia", [wheel])]
    if coefficient is not None and not reason:
        columns += [
            number("flywheel_inertia", "inertia", [wheel], error=lambda: [wheel * errors()["share"]]),
            column("energy_fluctuation", "energy", "fluctuation", c.fluctuation),
        ]
        flywheel = []
    if reason:
        return Table([], place="cycle", documented=[*columns, *flywheel]), reason
    return Table(columns, place="cycle", documented=flywheel), ""


def _in_turns(angle: float, turns: int | None) -> float:
    """Return an angle in degrees, within the whole turns of a cycle."""
    return in_turn(math.degrees(angle), max(1, abs(turns or 1)))


def counterweights(analysis: Analysis, links: list[str]) -> dict[str, Table]:
    """Return the counterweights on links with the least r.m.s. shaking force over the sweep, a row each."""
    from virtualwork.study.counterweights import least_squares

    weights, before, after = least_squares(analysis.motions[0], links)

    def rms(name: str, force: NDArray[np.complex128], rows: int) -> Column:
        value = float(np.sqrt(np.nanmean(np.abs(force) ** 2)))
        return number(f"shaking_rms_{name}", "force", [value] * rows)

    shaking = {"before": before, "after": after}
    rows = [replace(rms(name, force, len(weights)), place=None) for name, force in shaking.items()]
    columns = [
        names("link", list(weights)),
        number("mass_radius", "unbalance", [abs(w) for w in weights.values()]),
        number("angle", "angle", [degrees(w) for w in weights.values()]),
        *rows,
    ]
    above = "mass times radius from the pivot of the link, angle from its x-axis; shaking force of inertia"
    return {
        "counterweights": Table(columns, ("link",), "counterweights.weights[]", above=above),
        # these once in the document
        "shaking force": Table(
            [], place="counterweights", documented=[rms(name, force, 1) for name, force in shaking.items()]
        ),
    }
