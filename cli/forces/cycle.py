"""The forces of `dalembert forces`, and over a cycle: mean, peak and r.m.s. effort, work, flywheel, counterweights."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cli.cases.case import Case
from cli.cases.study import Further, PoseCase, PoseStudy
from cli.read.options import bad
from cli.show.result import Result
from dalembert.angles import degrees, in_turn
from dalembert.dataclass import dataclass, replace
from dalembert.errors import DataError
from dalembert.results.columns import Column, Table, names, number

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from cli.cases.analysis import Analysis
    from cli.cases.call import Call
    from cli.cases.inputs import Grid
    from cli.show.commands import ShowOptions
    from dalembert.results.way import Topic

Document = dict[str, Any]


def swept(moved: Grid | None) -> bool:
    """Whether the inputs go through a range or a table."""
    return moved is not None and any(axis.option in ("--over", "--cases") for axis in moved.axes)


def checked(call: Call, flywheel: float | None, weights: list[str] | None, states: Path | None) -> None:
    """Refuse what needs a cycle where there is none, and values that mean nothing."""
    if flywheel is not None and not 0 < flywheel < math.inf:
        raise bad("--flywheel", "expected a positive speed fluctuation, such as 0.02")
    for flag, value in (("--flywheel", flywheel), ("--counterweights", weights)):
        if value is not None and not swept(call.moved):
            raise bad(flag, "expected a cycle too, such as --over 0deg:360deg:1deg")
    if states is not None and call.varied is not None:
        raise bad("--states", "expected one mechanism: --over and --cases of dimensions make several")


@dataclass(frozen=True)
class Forces(PoseStudy):
    """Effort, joint forces, shaking force.

    Attributes
    ----------
    flywheel : float, optional
        The speed fluctuation that a flywheel is to leave.
    counterweights : list of str, optional
        The links that get counterweights.
    states : Path, optional
        Where the table of link states goes.
    """

    flywheel: float | None = None
    counterweights: list[str] | None = None
    states: Path | None = None

    @property
    def has_cycle(self) -> bool:
        """Whether the poses may be a cycle."""
        return swept(self.moved) and len(self.mechanism.inputs) == 1

    @property
    def beside_each(self) -> bool:
        """Whether each variant has more than its poses."""
        return self.has_cycle or self.counterweights is not None

    def in_blocks(self, show: ShowOptions) -> bool:
        """Whether the table alone is written: a block of poses at a time."""
        plain = self.flywheel is None and self.counterweights is None
        # a long sweep's workbook has the poses alone
        return plain and super().in_blocks(show)

    def further(self, analysis: Analysis) -> Further:
        """The cycle, and counterweights."""
        tables: dict[str, Table] = {}
        words = ""
        if self.has_cycle or self.flywheel is not None:
            tables["cycle"], reason = cycle_of(analysis, self.flywheel)
            if reason and (self.json or self.flywheel is not None):
                analysis.warnings.append(f"no cycle, so no mean, peak, work or flywheel: {reason}")
            elif reason:
                words = f"no cycle: {reason}"
        if self.counterweights is not None:
            tables |= counterweights(analysis, self.counterweights)
        return Further(tables, words)

    def way(self, analysis: Analysis) -> list[Topic]:
        """The ledger of every pose, free-body diagrams."""
        from cli.forces.way import way

        return way(analysis)

    def figure(self, analysis: Analysis) -> Figure:
        """The forces against the input, or the requested quantities; of one pose the mechanism."""
        from cli.cases.picture import curves, drawn, forces_drawn, is_by_quantity

        if is_by_quantity(analysis):
            return curves(analysis)
        several = len(analysis.inputs.whole.shown) > 2 and analysis.motions[0].assembled.any()
        return forces_drawn(analysis) if several else drawn(analysis)

    def result(self, case: Case) -> Result:
        """With the states of all links."""
        from cli.forces.states import table

        assert isinstance(case, PoseCase)
        result = super().result(case)
        return replace(
            result,
            expected=(*result.expected, lambda: table(every_link(case.analysis))),
            beside=self.beside_table(),
        )

    def beside_table(self) -> dict[Path, Callable[[], Iterable[bytes]]]:
        """The file of the states."""
        if self.states is None:
            return {}
        case = self.case()
        every = PoseCase(self, every_link(case.analysis))
        return {self.states: lambda: _csv_parts(every, self.digits)}


def every_link(analysis: Analysis) -> Analysis:
    """The same poses, with all links."""
    every = replace(analysis, request=analysis.request._replace(only=None))
    every.assemblies = analysis.assemblies
    if not analysis.is_long:
        every.motions = analysis.motions
    return every


def _csv_parts(case: PoseCase, digits: bool) -> Iterator[bytes]:
    """The states of all links as CSV; only the digits that hold, if wanted."""
    from cli.forces.states import table
    from dalembert.results.digits import digits_that_hold
    from dalembert.results.text import csv_text

    for i, whole in enumerate(case.tables(table)):
        shown = digits_that_hold(whole)[0] if digits else whole
        yield csv_text(shown.cells, header=i == 0).encode()


def cycle_of(analysis: Analysis, coefficient: float | None) -> tuple[Table, str]:
    """Mean, peak and r.m.s. effort over the cycle, work, energy error, flywheel; why the sweep is none, else empty."""
    from virtualwork.study.cycle import Cycle

    motion = analysis.motions[0]
    m = analysis.mechanism
    if len(m.inputs) != 1:
        raise DataError(f"{analysis.file}: a cycle has one input, found {len(m.inputs)}")
    slide = m.inputs[0].is_slide
    swept = Cycle(motion)
    if not np.isfinite(motion.effort).all():
        reason = "the effort is not finite at every pose of the sweep"
    else:
        reason = swept.reason or ""
    c = swept if reason else swept.refined()
    if not reason and not np.isfinite(c.effort).all():
        reason = "the effort is not finite at every pose between those of the sweep"
    effort, place = ("force", "length") if slide else ("torque", "angle")
    quantities: dict[str, tuple[str, Callable[[], float | None]]] = {
        f"mean_{effort}": (effort, lambda: c.mean),
        f"peak_{effort}": (effort, lambda: c.peak),
        "peak_at": (place, lambda: c.peak_at if slide else _in_turns(c.peak_at, c.turns)),
        f"rms_{effort}": (effort, lambda: c.rms),
        "peak_power": ("power", lambda: c.peak_power),
        "work": ("energy", lambda: c.work),
        "energy_closure": ("energy", lambda: c.closure),
    }
    values = {name: None if reason else value() for name, (_, value) in quantities.items()}
    columns = [
        number(name, dimension, np.array([values[name]], dtype=float))
        for name, (dimension, _) in quantities.items()
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
        columns += [*flywheel, number("energy_fluctuation", "energy", [c.fluctuation])]
        flywheel = []
    if reason:
        return Table([], place="cycle", documented=[*columns, *flywheel]), reason
    return Table(columns, place="cycle", documented=flywheel), ""


def _in_turns(angle: float, turns: int | None) -> float:
    """An angle in degrees, within the whole turns of a cycle."""
    return in_turn(math.degrees(angle), max(1, abs(turns or 1)))


def counterweights(analysis: Analysis, links: list[str]) -> dict[str, Table]:
    """Counterweights on links that leave the least r.m.s. shaking force over the sweep, a row each."""
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
