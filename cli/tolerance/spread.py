"""What the tolerances of the file do to every number that is shown: to first order, by drawn mechanisms, as a picture."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cli.cases import poses, remarks
from cli.cases.analysis import Analysis
from cli.cases.case import Case, Study
from cli.cases.poses import cells, keys_of
from cli.cases.study import METHOD
from cli.read.options import processes
from dalembert.dataclass import dataclass
from dalembert.errors import DataError
from dalembert.results.columns import Column, Table, names
from virtualwork.describe.dimensions import Dimension
from virtualwork.family.tolerance import Drawn, Spread, drawn, drawn_numbers, limits, spread, summary
from virtualwork.formulas.kinematics import Point
from virtualwork.formulas.quantity import Quantity
from virtualwork.quantities import Component

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from cli.cases.cases import Rows
    from cli.cases.poses import Reals
    from cli.show.commands import ShowOptions
    from dalembert.results.way import Topic

# how far a drawn standard deviation may be from the linear one, in its sampling errors and by its size
SURE, APART = 5.0, 0.02
NAMES = ("p0.135", "p99.865")


@dataclass
class Tolerances(Case):
    """The effect of the tolerances on one mechanism."""

    study: Spreads
    analysis: Analysis

    @property
    def draws(self) -> int:
        """How many mechanisms are drawn; 0 for none."""
        return self.study.draws

    @cached_property
    def limits(self) -> dict[Dimension, float]:
        """The limit of each dimension, SI."""
        tolerances = self.analysis.mechanism.tolerances
        if not tolerances:
            raise DataError(
                f"{self.analysis.file}: [tolerances]: missing; expected limits such as "
                '"links.crank.B.x" = "0.05 mm"'
            )
        return limits(self.analysis.mechanism, tolerances)

    @cached_property
    def numbers(self) -> list[Component]:
        """What is shown and varies with the tolerances."""
        shown = [each for each in self.analysis.tabled if each.key and not each.less]
        keys = keys_of(shown)
        varies = dict(zip(keys, self.analysis.motions[0].sensitivities.vary(keys, self.limits), strict=True))
        return [each for each in shown if varies[each.key][each.imaginary]]

    @cached_property
    def keys(self) -> list[Quantity]:
        """The quantities that this is of."""
        return keys_of(self.numbers)

    @cached_property
    def slopes(self) -> dict[Quantity, list[Any]]:
        """Of each quantity to each dimension."""
        result = self.analysis.motions[0].sensitivities.of(self.keys, list(self.limits))
        return dict(zip(self.keys, result, strict=True))

    @cached_property
    def linear(self) -> dict[str, Spread]:
        """To first order, by header."""
        sizes = list(self.limits.values())
        return {
            number.header: spread([number.of(slope) for slope in self.slopes[number.key]], sizes)
            for number in self.numbers
        }

    @cached_property
    def drawn(self) -> tuple[dict[str, Drawn], float]:
        """From drawn mechanisms, by header; and which share of them is assembled in every pose."""
        m, motion, q = self.analysis.mechanism, self.analysis.motions[0], self.analysis.inputs.whole
        numbers = drawn_numbers(m, self.limits, self.draws, self.study.seed, self.study.distribution)
        nominal = dict(zip(self.keys, motion.sensitivities.values(self.keys), strict=True))
        parts: dict[str, list[Drawn]] = {number.header: [] for number in self.numbers}
        whole = np.ones(self.draws, dtype=bool)
        rates = q.speed, q.acceleration
        with processes(self.study.workers) as pool:
            for rows, values, assembled in drawn(m, numbers, motion.inputs, rates, self.keys, pool):
                whole &= assembled.all(axis=1)
                solved = dict(zip(self.keys, values, strict=True))
                for number in self.numbers:
                    its, mean = number.of(solved[number.key]), number.of(nominal[number.key][rows])
                    parts[number.header].append(summary(its, mean, 360.0 if number.link else None))
        joined = {
            header: Drawn(*(np.concatenate([getattr(p, name) for p in some], axis=-1) for name in _FIELDS))
            for header, some in parts.items()
        }
        nowhere = ~motion.assembled
        for each in joined.values():
            for name in _FIELDS:
                getattr(each, name)[..., nowhere] = np.nan
        return joined, float(whole.mean())

    def warnings(self) -> list[str]:
        """Return the warnings of the poses, and where the first order is not enough."""
        a = self.analysis
        lines = [*a.warnings, *remarks.limits(a), *(remarks.of_forces(a) if a.forces else [])]
        return [*lines, *self.apart()]

    def apart(self) -> list[str]:
        """Where the first order is not enough: the drawn standard deviation is another."""
        if not self.numbers:
            return [
                "none of the numbers shown varies with [tolerances]: they have none, nor a picture of them"
            ]
        if not self.draws:
            return []
        samples, whole = self.drawn
        lines = []
        sampling = SURE / np.sqrt(2 * max(self.draws - 1, 1))
        # a uniform distribution between the limits is wider than a normal one of a third of them
        wider = np.sqrt(3.0) if self.study.distribution == "uniform" else 1.0
        for header, its in samples.items():
            linear = self.linear[header].sd * wider
            with np.errstate(invalid="ignore", divide="ignore"):
                apart = np.abs(its.sd - linear) / linear
            apart[~(linear > 1e-9 * np.nanmax(linear, initial=0.0))] = 0.0
            if np.nanmax(apart, initial=0.0) > sampling + APART:
                i = int(np.nanargmax(apart))
                shown = self.analysis.inputs.whole.shown[i, 0]
                lines.append(
                    f"{header}: linear estimate unreliable at input {shown:g} {self.analysis.unit}: standard deviation "
                    f"{linear[i]:.6g}, but {its.sd[i]:.6g} from the drawn mechanisms"
                )
        if whole < 1:
            lines.append(
                f"{(1 - whole) * 100:.3g} % of the drawn mechanisms cannot be assembled in every pose"
            )
        return lines

    def table(self) -> Table:
        """The table of poses, each number with its worst case and its standard deviation."""
        base = poses.table(self.analysis)
        columns: list[Column] = []
        further: list[Column] = []
        for column in base.columns:
            header = column.header
            columns.append(column)
            if header not in self.linear:
                continue

            def of(name: str, values: Reals, *lead: str, shown: str, base: Column = column) -> Column:
                place = (*lead, "columns", base.header, name)
                return Column(f"{base.name}_{shown}", base.unit, cells(values), place=place)

            its = self.linear[header]
            columns += [
                of(name, values, shown=name) for name, values in (("worst", its.worst), ("sd", its.sd))
            ]
            if self.draws:
                sample = self.drawn[0][header]
                columns += [
                    of(name, values, "drawn", shown=f"drawn_{name}")
                    for name, values in _sample(sample).items()
                ]
                further += [
                    of(f"{name}_error", values, "drawn", shown=f"drawn_{name}_error")
                    for name, values in zip(NAMES, sample.errors, strict=True)
                ]
        return Table(columns, base.keys, "tolerance", by_column=True, documented=further)

    def further(self) -> dict[str, Callable[[], Table]]:
        """Which share of the variance each dimension has; how the mechanisms were drawn."""
        tables: dict[str, Callable[[], Table]] = {"largest shares": self.largest} if self.linear else {}
        return tables | ({"drawn": self.drawing} if self.draws else {})

    def documented(self) -> list[Table]:
        """The numbers of every pose, of which there may be none, and the shares of them."""
        tables = [Table([], place="tolerance.columns", by_column=True), self.table(), self.shares()]
        return [*tables, *([self.drawing()] if self.draws else [])]

    def shares(self) -> Table:
        """The shares of the variance over the poses, a row for each number and dimension."""
        rows = [
            (d.path, header, cells(its.shares[i]))
            for header, its in self.linear.items()
            for i, d in enumerate(self.limits)
        ]
        columns = [
            names(name, [row[i] for row in rows]) for i, name in enumerate(("path", "column", "share"))
        ]
        return Table(columns, ("column", "path"), "tolerance.shares[]")

    def largest(self) -> Table:
        """Which dimensions matter most to each number, in the mean of the poses."""
        texts = []
        for its in self.linear.values():
            finite = np.isfinite(its.shares).any()
            mean = np.nanmean(its.shares, axis=1) if finite else np.zeros(len(self.limits))
            order = np.argsort(-mean, kind="stable")[:3]
            paths = [d.path for d in self.limits]
            texts.append(", ".join(f"{paths[i]} {mean[i] * 100:.3g} %" for i in order if mean[i] > 0))
        above = "shares of the variance, means over the poses"
        columns = [names("column", self.linear, None), names("dimensions", texts, None)]
        return Table(columns, ("column",), "", above=above)

    def drawing(self) -> Table:
        """How the mechanisms were drawn."""
        study = self.study
        columns = [names("draws", [self.draws]), names("seed", [study.seed])]
        columns += [names("distribution", [study.distribution]), names("assembled", [self.drawn[1]])]
        return Table(columns, place="tolerance.drawn")

    def assembled(self, rows: int = 0) -> list[bool] | bool:
        """Return whether the pose of each row is assembled; where the rows are no poses, whether any is."""
        (motion,) = self.analysis.motions
        whole: list[bool] = self.analysis.assembled(motion).tolist()
        return whole if rows == len(whole) else any(whole)

    @property
    def is_drawn(self) -> bool:
        """Whether anything varies."""
        return bool(self.numbers)

    def way(self) -> list[Topic]:
        """The terms of every dimension."""
        from cli.tolerance.way import way

        return way(self.analysis, self.numbers, self.slopes, self.limits)

    def figure(self) -> Figure:
        """The band of paths, and which dimension has which share."""
        return draw(self)


@dataclass(frozen=True)
class Spreads(Study):
    """What the tolerances do to every case.

    Attributes
    ----------
    draws : int
        How many mechanisms are drawn; 0 for none.
    seed : int
    distribution : str
        `normal` or `uniform`.
    workers : int
        Processes that solve what is drawn.
    """

    draws: int = 0
    seed: int = 0
    distribution: str = "normal"
    workers: int = 1

    title = "poses"
    method = METHOD
    one_blank_row = False

    def warnings(self) -> list[str]:
        """Return the warnings of rates without a speed, and forces without a mass or a load."""
        return remarks.without_meaning(self.cases.nominal, self.cases.names)

    def case(self, row: Rows | None = None) -> Tolerances:
        """Return the effect on the variant of a row, or on the mechanism itself."""
        analysis = self.cases.analysis(row)
        _ = analysis.motions
        return Tolerances(self, analysis)

    def check_size(self, show: ShowOptions, times: int) -> None:
        """Refuse more poses than the memory holds."""
        self.cases.nominal.check_size(json=show.as_json, table=show.needs_table, times=times)


def _sample(its: Drawn) -> dict[str, Reals]:
    """Mean, standard deviation and quantiles of what was drawn, by the names that they are shown under."""
    return dict(zip(("mean", "sd", *NAMES), (its.mean, its.sd, *its.quantiles), strict=True))


_FIELDS = ("mean", "sd", "quantiles", "errors")


# of the picture's width: a band that is narrower is drawn wider
SEEN = 0.02
BARS = 10


def draw(tolerances: Tolerances) -> Figure:
    """The band of the path of each point, and the shares; without points, bands over the input."""
    from matplotlib.figure import Figure

    points = [each.key for each in tolerances.numbers if isinstance(each.key, Point) and not each.key.order]
    points = list(
        dict.fromkeys(key for key in points if key.node not in tolerances.analysis.mechanism.ground)
    )
    figure = Figure(figsize=(11.0, 5.2), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.3, 1))
    if points:
        _paths(left, tolerances, points)
        _shares(right, tolerances, points, "variance of the position")
    else:
        header = tolerances.numbers[0].header
        _over_input(left, tolerances, header)
        _shares(right, tolerances, [tolerances.numbers[0].key], f"variance of {header}")
    figure.suptitle(tolerances.analysis.mechanism.name, fontsize=10)
    return figure


def _paths(axes: Axes, tolerances: Tolerances, points: list[Point]) -> None:
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import to_rgb

    analysis = tolerances.analysis
    scale, unit = (1e3, "mm") if analysis.mechanism.size < 2 else (1.0, "m")
    sizes = np.array(list(tolerances.limits.values()))
    paths = {key: analysis.motions[0].point(str(key.node)).complex(0) * scale for key in points}
    width = max((np.nanmax(abs(z - np.nanmean(z)), initial=0.0) for z in paths.values()), default=1.0) or 1.0
    bands = {}
    for key, z in paths.items():
        slopes = np.array(tolerances.slopes[key]) * scale
        along = np.gradient(z) if len(z) > 1 else np.ones(1, complex)
        with np.errstate(invalid="ignore", divide="ignore"):
            normal = 1j * along / np.abs(along)
        normal = np.where(np.isfinite(normal), normal, 1j)
        bands[key] = normal, (np.abs((slopes * normal.conj()).real) * sizes[:, None]).sum(axis=0)
    widest = max((np.nanmax(band, initial=0.0) for _, band in bands.values()), default=0.0)
    enlarged = 1.0
    if 0 < widest < SEEN * width:
        enlarged = 10.0 ** np.ceil(np.log10(SEEN * width / widest))
    for i, (key, z) in enumerate(paths.items()):
        normal, band = bands[key]
        good = np.isfinite(z) & np.isfinite(band)
        outer, inner = ((z + side * enlarged * band * normal)[good] for side in (1, -1))
        corners = np.stack([outer[:-1], outer[1:], inner[1:], inner[:-1]], axis=1)
        light = [1 - 0.3 * (1 - part) for part in to_rgb(f"C{i}")]
        quads = PolyCollection(
            list(np.stack([corners.real, corners.imag], axis=-1)), facecolor=light, edgecolor=light
        )
        axes.add_collection(quads)
        axes.plot(z.real, z.imag, color=f"C{i}", lw=1.2, label=key.node)
    much = "" if enlarged == 1 else f", drawn {enlarged:g} times as wide"
    axes.set_title(f"paths, and their worst case across{much}", fontsize=9)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel(f"x, {unit}")
    axes.set_ylabel(f"y, {unit}")
    axes.grid(color="0.9", lw=0.6)
    axes.set_axisbelow(True)
    axes.legend(fontsize=8)


def _over_input(axes: Axes, tolerances: Tolerances, header: str) -> None:
    """A number over the input, with its worst case."""
    base = next(c for c in tolerances.table().columns if c.header == header)
    q = tolerances.analysis.inputs.whole.shown[:, 0]
    values = np.array([np.nan if v is None else float(v) for v in base.values])
    worst = tolerances.linear[header].worst
    axes.fill_between(q, values - worst, values + worst, color="C0", alpha=0.3, lw=0)
    axes.plot(q, values, color="C0", lw=1.2)
    axes.set_xlabel(tolerances.analysis.input_columns[0])
    axes.set_ylabel(header)
    axes.set_title("with its worst case", fontsize=9)
    axes.grid(color="0.9", lw=0.6)


def _shares(axes: Axes, tolerances: Tolerances, keys: Sequence[Quantity], of: str) -> None:
    """Bars of the shares, means over the poses."""
    variances = np.zeros(len(tolerances.limits))
    for key in keys:
        slopes = (
            np.abs(np.array(tolerances.slopes[key])) * np.array(list(tolerances.limits.values()))[:, None]
        )
        variances += np.nansum(slopes**2, axis=1)
    shares = variances / variances.sum() if variances.sum() > 0 else variances
    order = np.argsort(shares, kind="stable")[-BARS:]
    names = [list(tolerances.limits)[i].path for i in order]
    bars = axes.barh(range(len(order)), shares[order] * 100, color="0.45")
    axes.bar_label(bars, [f"{shares[i] * 100:.3g} %" for i in order], padding=3, fontsize=8)
    axes.set_yticks(range(len(order)), names, fontsize=8)
    axes.set_xlim(0, 118)
    axes.set_xticks(range(0, 101, 20))
    axes.set_xlabel(f"share of the {of}, %")
    axes.set_title("which dimension matters", fontsize=9)
