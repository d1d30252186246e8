"""The forces of `dalembert forces`, and over a cycle: mean, peak and r.m.s. effort, work, flywheel, counterweights."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cli.cases.case import Case
from cli.cases.poses import column, records
from cli.cases.quantities import effort_name
from cli.cases.study import Further, PoseCase, PoseStudy
from cli.read.options import bad
from cli.show.result import Result
from dalembert.errors import DataError
from dalembert.results.columns import Table
from dalembert.units import written

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from cli.cases.analysis import Analysis
    from cli.cases.axes import Grid
    from cli.cases.call import Call
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
        """Whether something stands beside the poses of each variant."""
        return self.has_cycle or self.counterweights is not None

    def in_blocks(self, show: ShowOptions) -> bool:
        """Whether the table alone is written: a block of poses at a time."""
        plain = self.flywheel is None and self.counterweights is None
        # a long sweep's workbook has the poses alone
        return plain and super().in_blocks(show)

    def further(self, analysis: Analysis) -> Further:
        """The cycle, and counterweights."""
        document: Document = {}
        tables: dict[str, Callable[[], Table]] = {}
        words = []
        if self.has_cycle or self.flywheel is not None:
            document["cycle"], reason = cycle_of(analysis, self.flywheel)
            if not reason:
                cycle = document["cycle"]
                tables["cycle"] = lambda: records([cycle])
                words.append(cycle_text(cycle))
            elif self.json or self.flywheel is not None:
                analysis.warnings.append(f"no cycle, so no mean, peak, work or flywheel: {reason}")
            else:
                words.append(f"no cycle: {reason}")
        if self.counterweights is not None:
            weights = document["counterweights"] = counterweights(analysis, self.counterweights)
            tables["counterweights"] = lambda: of_counterweights(weights)
            words.append(counterweights_text(weights))
        return Further(document, tables, "\n\n".join(words))

    def way(self, analysis: Analysis) -> list[Topic]:
        """The ledger of every pose, free-body diagrams."""
        from cli.forces.way import way

        return way(analysis)

    def figure(self, analysis: Analysis) -> Figure:
        """The forces against the input, or the requested quantities; of one pose the mechanism."""
        from cli.cases.picture import curves, drawn, forces_drawn, is_by_quantity

        if is_by_quantity(analysis):
            return curves(analysis)
        several = len(analysis.inputs.shown) > 2 and analysis.motions[0].assembled.any()
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


def cycle_of(analysis: Analysis, coefficient: float | None) -> tuple[Document, str]:
    """Mean, peak and r.m.s. effort over the cycle, work, energy error, flywheel; why the sweep is none, else empty."""
    from virtualwork.study.cycle import Cycle

    motion = analysis.motions[0]
    m = analysis.mechanism
    if len(m.inputs) != 1:
        raise DataError(f"{analysis.file}: a cycle has one input, found {len(m.inputs)}")
    slide = m.inputs[0].is_slide
    name = effort_name(slide)
    keys = (
        f"mean_{name}", f"peak_{name}", f"peak_at_{analysis.unit}", f"rms_{name}", "peak_power_W", "work_J",
        "energy_closure_J",
    )  # fmt: skip
    result: Document = dict.fromkeys((*keys, "flywheel_inertia_kg_m2"))
    swept = Cycle(motion)
    if not np.isfinite(motion.effort).all():
        reason = "the effort is not finite at every pose of the sweep"
    else:
        reason = swept.reason or ""
    c = swept if reason else swept.refined()
    if not reason and not np.isfinite(c.effort).all():
        reason = "the effort is not finite at every pose between those of the sweep"
    if reason:
        return result, reason
    at = c.peak_at if slide else math.degrees(c.peak_at) % (360.0 * max(1, abs(c.turns or 1)))
    result |= zip(keys, (c.mean, c.peak, at, c.rms, c.peak_power, c.work, c.closure), strict=True)
    if coefficient is not None:
        if slide:
            raise DataError(f"{analysis.file}: --flywheel: the input is a slide: a flywheel turns")
        try:
            result["flywheel_inertia_kg_m2"] = c.flywheel(coefficient)
        except ValueError as error:
            raise DataError(f"{analysis.file}: --flywheel: {error}") from None
        result["energy_fluctuation_J"] = c.fluctuation
    return result, ""


def cycle_text(part: Document) -> str:
    """The cycle below the table."""
    lines = ["cycle:"]
    for key, value in part.items():
        if value is not None:
            its = column(key, [value])
            lines.append(f"  {its.name.replace('_', ' '):<18} {value:.6g} {written(its.unit)}")
    return "\n".join(lines)


def counterweights(analysis: Analysis, links: list[str]) -> Document:
    """Counterweights on links that leave the least r.m.s. shaking force over the sweep."""
    from virtualwork.study.counterweights import least_squares

    weights, before, after = least_squares(analysis.motions[0], links)

    def rms(force: NDArray[np.complex128]) -> float:
        return float(np.sqrt(np.nanmean(np.abs(force) ** 2)))

    return {
        "weights": [
            {
                "link": link,
                "mass_radius_kg_m": abs(w),
                "angle_deg": math.degrees(math.atan2(w.imag, w.real)) % 360.0,
            }
            for link, w in weights.items()
        ],
        "shaking_rms_before_N": rms(before),
        "shaking_rms_after_N": rms(after),
    }


def of_counterweights(part: Document) -> Table:
    """A counterweight a row, with the shaking force before and after all of them."""
    rms = {key: value for key, value in part.items() if key != "weights"}
    return records([w | rms for w in part["weights"]])


def counterweights_text(part: Document) -> str:
    """The counterweights below the table."""
    lines = ["counterweights (mass times radius from the link's pivot, angle from the link's x-axis):"]
    lines += [
        f"  {w['link']}: {w['mass_radius_kg_m']:.6g} kg·m at {w['angle_deg']:.4g}°" for w in part["weights"]
    ]
    lines.append(
        f"  RMS shaking force of inertia {part['shaking_rms_before_N']:.6g} N -> {part['shaking_rms_after_N']:.6g} N"
    )
    return "\n".join(lines)
