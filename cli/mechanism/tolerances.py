"""The effect of the tolerances of the file on every number: to first order, from drawn mechanisms; its worked solution."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cli.cases import poses, remarks
from cli.cases.analysis import Analysis
from cli.cases.case import Case, Study
from cli.cases.poses import bounds_of, cells, keys_of, of_rows
from cli.cases.study import METHOD
from cli.read.options import processes
from dalembert.dataclass import dataclass
from dalembert.errors import DataError
from dalembert.results.columns import Column, Table, finite, names
from dalembert.results.way import Topic
from virtualwork.describe.dimensions import Dimension
from virtualwork.family.tolerance import Drawn, Spread, drawn, drawn_numbers, limits, rounded, spread, summary
from virtualwork.formulas.kinematics import Point
from virtualwork.formulas.quantity import Quantity
from virtualwork.quantities import Component

if TYPE_CHECKING:
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
        """Draw the band of paths, and the share of each dimension; without points, the band of a number over the input."""
        from virtualwork.picture.tolerance import Band, draw

        m, motion = self.analysis.mechanism, self.analysis.motions[0]
        points = (each.key for each in self.numbers if isinstance(each.key, Point) and not each.key.order)
        paths = {key: motion.point(str(key.node)).complex(0) for key in points if key.node not in m.ground}
        band = None
        if not paths:
            first = self.numbers[0]
            base = next(c for c in self.table().columns if c.header == first.header)
            values = np.array([np.nan if v is None else float(v) for v in base.values])
            q = self.analysis.inputs.whole.shown[:, 0]
            band = Band(
                first.key,
                first.header,
                self.analysis.input_columns[0],
                q,
                values,
                self.linear[first.header].worst,
            )
        return draw(m.name, m.size, paths, self.limits, self.slopes, band)


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


# --- one pose on a terminal, the largest shares, the worked solution ------------------------------------------------
def by_quantity(table: Table, shown: Sequence[Component]) -> list[Table]:
    """Return the table of one pose as short tables: a row for each quantity that varies, one table for each unit.

    The first has what names the pose.
    """
    columns = {each.header: each for each in table.columns}
    units: dict[str, tuple[list[str], list[dict[str, Column]]]] = {}
    for quantity in shown:
        own = columns[quantity.header]
        effects = (c for c in table.columns if isinstance(c.place, tuple) and own.header in c.place)
        row = {f"value_{own.unit}": own} | {c.header.removeprefix(f"{own.name}_"): c for c in effects}
        titles, rows = units.setdefault(own.unit, ([], []))
        titles.append(quantity.names[0] if quantity.names else own.name)
        rows.append(row)
    made = [Table([each for each in table.columns if each.header in table.keys])]
    for titles, rows in units.values():
        numbers = (of_rows(head, rows) for head in rows[0])
        made.append(Table([Column("quantity", "", titles), *numbers], ["quantity"]))
    return made


def largest(linear: Mapping[str, Spread], limits: Mapping[Dimension, float]) -> Table:
    """Return the dimensions with the largest shares of each number, in the mean of the poses."""
    texts, paths = [], [d.path for d in limits]
    for effect in linear.values():
        finite = np.isfinite(effect.shares).any()
        mean = np.nanmean(effect.shares, axis=1) if finite else np.zeros(len(paths))
        order = np.argsort(-mean, kind="stable")[:3]
        texts.append(", ".join(f"{paths[i]} {mean[i] * 100:.3g} %" for i in order if mean[i] > 0))
    above = "shares of the variance, means over the poses"
    return Table(
        [names("column", linear, None), names("dimensions", texts, None)], ("column",), "", above=above
    )


def way(
    analysis: Analysis,
    shown: Sequence[Component],
    slopes_of: Mapping[Quantity, Sequence[Any]],
    linear: Mapping[str, Spread],
    limits: Mapping[Dimension, float],
) -> list[Topic]:
    """Return the one topic: the terms at the first pose that is assembled, and their sums (`linear`)."""
    whole = analysis.motions[0].assembled
    if not shown or not whole.any():
        return [
            Topic("terms", ["None of the numbers shown varies with [tolerances]."], "Terms", {"terms": []})
        ]
    i = int(np.argmax(whole))
    rows: list[tuple[str, str, float, float, float, float]] = []
    sums: list[tuple[str, float, float]] = []
    for each in shown:
        slopes = [float(np.broadcast_to(each.of(slope), len(whole))[i]) for slope in slopes_of[each.key]]
        effect = linear[each.header]
        for (d, limit), slope, share in zip(
            limits.items(), slopes, effect.shares[:, i].tolist(), strict=True
        ):
            rows.append((each.header, d.path, slope, limit, slope * limit, share))
        sums.append((each.header, float(effect.worst[i]), float(effect.sd[i])))
    columns = zip(*((*row[:2], *map(finite, row[2:])) for row in rows), strict=True)
    titles = ("column", "path", "slope", "limit", "term", "share")
    table = Table(
        [names(title, values) for title, values in zip(titles, columns, strict=True)],
        ("column", "path"),
        "terms[]",
    )
    of_all = zip(*((header, finite(worst), finite(sd)) for header, worst, sd in sums), strict=True)
    total = Table(
        [names(title, values) for title, values in zip(("column", "worst", "sd"), of_all, strict=True)],
        ("column",),
        "sums[]",
    )
    at = f"At {analysis.pose_text(i)}: " if len(whole) > 1 else ""
    text = (
        f"{at}Δq = Σ (∂q/∂d)·δd to first order, slopes exact: worst case Σ |∂q/∂d|·limit, "
        "standard deviation √Σ (∂q/∂d·limit/3)²; limits in SI, slopes in the column's unit per SI unit:"
    )
    return [Topic("terms", [text, table, "Sums:", total], "Terms of each dimension")]
