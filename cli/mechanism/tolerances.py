"""The effect of the tolerances of the file on every number: to first order, from drawn mechanisms, as a picture."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cli.cases import poses, remarks
from cli.cases.analysis import Analysis
from cli.cases.case import Case, Study
from cli.cases.poses import bounds_of, cells, keys_of
from cli.cases.study import METHOD
from cli.mechanism.tolerance_terms import by_quantity, largest, way
from cli.read.options import processes
from dalembert.dataclass import dataclass
from dalembert.drawing.amounts import NOISE
from dalembert.errors import DataError
from dalembert.results.columns import Column, Table, names
from dalembert.results.way import Topic
from virtualwork.describe.dimensions import Dimension
from virtualwork.family.tolerance import Drawn, Spread, drawn, drawn_numbers, limits, rounded, spread, summary
from virtualwork.formulas.kinematics import Point
from virtualwork.formulas.quantity import Quantity
from virtualwork.quantities import Component

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from cli.cases.poses import Reals
    from dalembert.results.result import Result

# how far a drawn standard deviation may be from the linear one, in its sampling errors and by its size
SURE, APART = 5.0, 0.02
NAMES = ("p0.135", "p99.865")
FULL = (
    "--digits: numbers of drawn mechanisms are printed in full, because their errors are those of the sample"
)


@dataclass
class Tolerances(Case):
    """The effect of the tolerances on one mechanism."""

    study: Spreads
    analysis: Analysis

    @cached_property
    def mask(self) -> NDArray[np.bool_]:
        """Which poses are assembled."""
        (motion,) = self.analysis.motions
        return self.analysis.assembled(motion)

    @property
    def draws(self) -> int:
        """The number of drawn mechanisms; 0 for none."""
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
        """The components that are shown and vary with the tolerances."""
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
        """The derivative of each quantity to each dimension."""
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
    def rounded(self) -> dict[str, tuple[Reals, Reals]]:
        """The rounding errors of worst case and standard deviation of first order, by header: the slopes computed twice."""
        slopes = list(self.slopes.values())
        errors = self.analysis.motions[0].sensitivities.errors(self.keys, list(self.limits), slopes)
        by_key, sizes = dict(zip(self.keys, errors, strict=True)), list(self.limits.values())
        return {
            each.header: rounded(
                self.linear[each.header],
                [np.degrees(error) if each.in_degrees else error for error in by_key[each.key]],
                sizes,
            )
            for each in self.numbers
        }

    @cached_property
    def drawn(self) -> tuple[dict[str, Drawn], float]:
        """From drawn mechanisms, by header; and which share of them is assembled in every pose that the mechanism itself has."""
        m, motion, q = self.analysis.mechanism, self.analysis.motions[0], self.analysis.inputs.whole
        numbers = drawn_numbers(m, self.limits, self.draws, self.study.seed, self.study.distribution)
        nominal = dict(zip(self.keys, motion.sensitivities.values(self.keys), strict=True))
        parts: dict[str, list[Drawn]] = {number.header: [] for number in self.numbers}
        whole = np.ones(self.draws, dtype=bool)
        rates = q.speed, q.acceleration
        with processes(self.study.workers) as pool:
            for rows, values, assembled in drawn(m, numbers, motion.inputs, rates, self.keys, pool):
                whole &= assembled[:, motion.assembled[rows]].all(axis=1)
                solved = dict(zip(self.keys, values, strict=True))
                for number in self.numbers:
                    sample, mean = number.of(solved[number.key]), number.of(nominal[number.key][rows])
                    parts[number.header].append(summary(sample, mean, 360.0 if number.link else None))
        joined = {
            header: Drawn(*(np.concatenate([getattr(p, name) for p in some], axis=-1) for name in _FIELDS))
            for header, some in parts.items()
        }
        nowhere = ~motion.assembled
        for each in joined.values():
            for name in _FIELDS:
                getattr(each, name)[..., nowhere] = np.nan
        return joined, float(whole.mean()) if motion.assembled.any() else 0.0

    def warnings(self) -> list[str]:
        """Return the warnings of the poses, and where the first order is not enough."""
        a = self.analysis
        gap = ~self.mask
        lines = [
            *a.warnings,
            *remarks.limits(a, [(int(gap.sum()), int(np.argmax(gap)))]),
            *(remarks.of_poses(a) if a.forces else []),
        ]
        return [*lines, *self.apart()]

    def apart(self) -> list[str]:
        """Return the warnings of numbers whose drawn standard deviation differs from that of first order."""
        if not self.numbers:
            return ["none of the numbers shown depends on [tolerances]: no spread and no picture"]
        if not self.draws:
            return []
        samples, whole = self.drawn
        lines = [FULL] if self.study.show.digits else []
        sampling = SURE / np.sqrt(2 * max(self.draws - 1, 1))
        # a uniform distribution between the limits is wider than a normal one of a third of them
        wider = np.sqrt(3.0) if self.study.distribution == "uniform" else 1.0
        for header, sample in samples.items():
            linear = self.linear[header].sd * wider
            with np.errstate(invalid="ignore", divide="ignore"):
                apart = np.abs(sample.sd - linear) / linear
            apart[~(linear > 1e-9 * np.nanmax(linear, initial=0.0))] = 0.0
            if np.nanmax(apart, initial=0.0) > sampling + APART:
                i = int(np.nanargmax(apart))
                shown = self.analysis.inputs.whole.shown[i, 0]
                lines.append(
                    f"{header}: linear estimate unreliable at input {shown:g} {self.analysis.unit}: standard deviation "
                    f"{linear[i]:.6g}, but {sample.sd[i]:.6g} from the drawn mechanisms"
                )
        if whole < 1:
            lines.append(
                f"{(1 - whole) * 100:.3g} % of the drawn mechanisms cannot be assembled in every pose"
            )
        return lines

    def table(self) -> Table:
        """Return the table of poses, each number with its worst case and its standard deviation."""
        base = poses.table(self.analysis)
        columns, further = list[Column](), list[Column]()
        for column in base.columns:
            header = column.header
            columns.append(column)
            if header not in self.linear:
                continue

            def of(
                name: str, values: Reals, error: Callable[[], Reals] | None, *lead: str, base: Column = column
            ) -> Column:
                place, shown = (*lead, "columns", base.header, name), "_".join((base.name, *lead, name))
                bounds = None if error is None else lambda: bounds_of(error())
                return Column(shown, base.unit, cells(values), bounds, place)

            effect = self.linear[header]
            for i, name in enumerate(("worst", "sd")):
                columns.append(of(name, getattr(effect, name), partial(self._rounded, header, i)))
            if self.draws:
                sample = self.drawn[0][header]
                columns += [of(name, values, None, "drawn") for name, values in _sample(sample).items()]
                further += [
                    of(f"{name}_error", values, None, "drawn")
                    for name, values in zip(NAMES, sample.errors, strict=True)
                ]
        return Table(columns, base.keys, "tolerance", by_column=True, documented=further)

    def _rounded(self, header: str, i: int) -> Reals:
        return self.rounded[header][i]

    def result(self) -> Result:
        """Return the result in every form: a terminal has a row for each quantity of a single pose."""
        result = super().result()
        if self.analysis.inputs.n == 1 and self.numbers:
            result.screen = lambda: by_quantity(self.table(), self.numbers)
        return result

    def further(self) -> dict[str, Callable[[], Table]]:
        """Return the largest shares of the variance, and how the mechanisms were drawn."""
        tables: dict[str, Callable[[], Table]] = (
            {"largest shares": lambda: largest(self.linear, self.limits)} if self.linear else {}
        )
        return tables | ({"drawn": self.drawing} if self.draws else {})

    def documented(self) -> list[Table]:
        """Return the numbers of every pose, which may be none, and their shares."""
        tables = [Table([], place="tolerance.columns", by_column=True), self.table(), self.shares()]
        return [*tables, *([self.drawing()] if self.draws else [])]

    def shares(self) -> Table:
        """Return the shares of the variance over the poses, a row for each number and dimension."""
        rows = [
            (d.path, header, cells(effect.shares[i]))
            for header, effect in self.linear.items()
            for i, d in enumerate(self.limits)
        ]
        columns = [
            names(name, [row[i] for row in rows]) for i, name in enumerate(("path", "column", "share"))
        ]
        return Table(columns, ("column", "path"), "tolerance.shares[]")

    def drawing(self) -> Table:
        """Return how the mechanisms were drawn."""
        study = self.study
        columns = [names("draws", [self.draws]), names("seed", [study.seed])]
        columns += [names("distribution", [study.distribution]), names("assembled", [self.drawn[1]])]
        return Table(columns, place="tolerance.drawn")

    def assembled(self, rows: int = 0) -> list[bool] | bool:
        """Return whether the pose of each row is assembled; where the rows are no poses, whether any is."""
        whole: list[bool] = self.mask.tolist()
        return whole if rows == len(whole) else any(whole)

    @property
    def is_drawn(self) -> bool:
        """Whether anything varies."""
        return bool(self.numbers)

    def way(self) -> list[Topic]:
        """Return the terms of every dimension."""
        return way(self.analysis, self.numbers, self.slopes, self.linear, self.limits)

    def figure(self) -> Figure:
        """Draw the band of paths, and the share of each dimension."""
        return draw(self)


@dataclass(frozen=True)
class Spreads(Study):
    """Compute the effect of the tolerances on every case.

    Attributes
    ----------
    draws : int
        The number of drawn mechanisms; 0 for none.
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

    def case(self, analysis: Analysis) -> Tolerances:
        """Return the effect on one mechanism."""
        _ = analysis.motions
        return Tolerances(self, analysis)

    def check_size(self, times: int) -> None:
        """Refuse more poses than the memory holds."""
        self.cases.nominal.check_size(json=self.show.as_json, table=self.show.needs_table, times=times)


def _sample(sample: Drawn) -> dict[str, Reals]:
    """Return mean, standard deviation and quantiles of drawn mechanisms, by the names of their columns."""
    return dict(zip(("mean", "sd", *NAMES), (sample.mean, sample.sd, *sample.quantiles), strict=True))


_FIELDS = ("mean", "sd", "quantiles", "errors")


# --- the picture ----------------------------------------------------------------------------------------------------
# of the picture's width: a band that is narrower is drawn wider
SEEN = 0.02
BARS = 10


def draw(tolerances: Tolerances) -> Figure:
    """Draw the band of the path of each point, and the shares; without points, bands over the input."""
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
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel(f"x, {unit}")
    axes.set_ylabel(f"y, {unit}")
    axes.grid(color="0.9", lw=0.6)
    axes.set_axisbelow(True)
    if analysis.inputs.n == 1:
        worst = {}
        for key in points:
            slopes = np.array(tolerances.slopes[key]) * scale
            worst[key] = [sizes @ np.abs(part) for part in (slopes.real, slopes.imag)]
        enlarged, much = _enlarged(np.nan_to_num(list(worst.values())).max(), analysis.mechanism.size * scale)
        for key, z in paths.items():
            x, y = (enlarged * part for part in worst[key])
            axes.errorbar(z.real, z.imag, y, x, fmt="o", ms=3, capsize=4, label=key.node)
        axes.set_title(f"points with their worst case in x and y{much}", fontsize=9)
        axes.legend(fontsize=8)
        return
    parts = [z[np.isfinite(z)] for z in paths.values()]
    width = max((abs(z - z.mean()).max() for z in parts if len(z)), default=1.0) or 1.0
    bands = {}
    for key, z in paths.items():
        slopes = np.array(tolerances.slopes[key]) * scale
        normal = 1j * _directions(z)
        bands[key] = normal, (np.abs((slopes * normal.conj()).real) * sizes[:, None]).sum(axis=0)
    widest = max((np.nanmax(band, initial=0.0) for _, band in bands.values()), default=0.0)
    enlarged, much = _enlarged(widest, width)
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
    axes.set_title(f"paths with their worst case across{much}", fontsize=9)
    axes.legend(fontsize=8)


def _enlarged(widest: float, width: float) -> tuple[float, str]:
    """Return how many times as wide a worst case is drawn to be seen in a picture so wide, and what its title says of it."""
    # a path across which nothing moves has a band of rounding
    if not NOISE * width < widest < SEEN * width:
        return 1.0, ""
    times = 10.0 ** np.ceil(np.log10(SEEN * width / widest))
    return times, f", drawn {times:g} times as wide"


def _directions(path: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Return the direction of a path at each pose; where it turns back, or has no pose, that of the poses before."""
    along = np.gradient(path)
    size = np.nan_to_num(np.abs(along))
    clear = size > NOISE * size.max(initial=0.0)
    if not clear.any():
        return np.ones(len(path), complex)
    before = np.maximum.accumulate(np.where(clear, np.arange(len(path)), np.argmax(clear)))
    return np.asarray(along[before] / size[before])


def _over_input(axes: Axes, tolerances: Tolerances, header: str) -> None:
    """Draw a number over the input, with its worst case."""
    base = next(c for c in tolerances.table().columns if c.header == header)
    q = tolerances.analysis.inputs.whole.shown[:, 0]
    values = np.array([np.nan if v is None else float(v) for v in base.values])
    worst = tolerances.linear[header].worst
    if len(q) == 1:
        axes.errorbar(q, values, worst, fmt="o", ms=3, capsize=4)
    axes.fill_between(q, values - worst, values + worst, color="C0", alpha=0.3, lw=0)
    axes.plot(q, values, color="C0", lw=1.2)
    axes.set_xlabel(tolerances.analysis.input_columns[0])
    axes.set_ylabel(header)
    axes.set_title("with its worst case", fontsize=9)
    axes.grid(color="0.9", lw=0.6)


def _shares(axes: Axes, tolerances: Tolerances, keys: Sequence[Quantity], of: str) -> None:
    """Draw bars of the shares, means over the poses."""
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
    axes.set_title("shares of the dimensions", fontsize=9)
