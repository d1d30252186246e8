"""`--tolerance`: what the tolerances of the file do to every number that is shown."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cli.errors import DataError
from cli.mechanism import columns, quantities
from cli.mechanism.quantities import Quantity, cells, keys_of
from cli.mechanism.solve import Analysis
from cli.read.options import processes
from cli.show.columns import Column, Table
from virtualwork.describe.dimensions import Dimension
from virtualwork.family.tolerance import Drawn, Spread, drawn, drawn_numbers, limits, spread, summary
from virtualwork.formulas.asked import Key

if TYPE_CHECKING:
    from cli.mechanism.options import Options
    from cli.mechanism.quantities import Numbers

if TYPE_CHECKING:
    pass

# how far a drawn standard deviation may be from the linear one, in its sampling errors and by its size
SURE, APART = 5.0, 0.02
NAMES = ("p0.135", "p99.865")


@dataclass
class Tolerances:
    """What the tolerances do, worked out when it is asked for."""

    analysis: Analysis
    asked: Options

    @property
    def draws(self) -> int:
        """How many mechanisms are drawn; 0 for none."""
        return self.asked.draws or 0

    @cached_property
    def limits(self) -> dict[Dimension, float]:
        """The limit of each dimension, SI."""
        given = self.analysis.mechanism.tolerances
        if not given:
            raise DataError(
                f"{self.analysis.file}: [tolerances]: missing; expected limits such as "
                '"links.crank.B.x" = "0.05 mm" for --tolerance'
            )
        return limits(self.analysis.mechanism, given)

    @cached_property
    def numbers(self) -> list[Quantity]:
        """What is shown."""
        every = (quantities.forces if self.asked.forces else quantities.places)(self.analysis)
        return [each for each in every if each.key and not each.less]

    @cached_property
    def keys(self) -> list[Key]:
        """The quantities that this is of."""
        return keys_of(self.numbers)

    @cached_property
    def slopes(self) -> dict[Key, list[Any]]:
        """Of each quantity to each dimension."""
        found = self.analysis.motions[0].sensitivities.of(self.keys, list(self.limits))
        there = self.analysis.motions[0].assembled
        return {
            key: [np.where(there, slope, np.nan) for slope in slopes]
            for key, slopes in zip(self.keys, found, strict=True)
        }

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
        m, motion, q = self.analysis.mechanism, self.analysis.motions[0], self.analysis.inputs
        numbers = drawn_numbers(m, self.limits, self.draws, self.asked.seed, self.asked.distribution)
        nominal = dict(zip(self.keys, motion.sensitivities.values(self.keys), strict=True))
        parts: dict[str, list[Drawn]] = {number.header: [] for number in self.numbers}
        whole = np.ones(self.draws, dtype=bool)
        rates = q.speed, q.acceleration
        with processes(self.asked.workers or 1) as pool:
            for rows, values, assembled in drawn(m, numbers, motion.inputs, rates, self.keys, pool):
                whole &= assembled.all(axis=1)
                found = dict(zip(self.keys, values, strict=True))
                for number in self.numbers:
                    its, mean = number.of(found[number.key]), number.of(nominal[number.key][rows])
                    parts[number.header].append(summary(its, mean, 360.0 if number.turns else None))
        joined = {
            header: Drawn(*(np.concatenate([getattr(p, name) for p in some], axis=-1) for name in _FIELDS))
            for header, some in parts.items()
        }
        return joined, float(whole.mean())

    def remarks(self) -> list[str]:
        """Where the first order is not enough: the drawn standard deviation is another."""
        if not self.draws:
            return []
        found, whole = self.drawn
        lines = []
        sampling = SURE / np.sqrt(2 * max(self.draws - 1, 1))
        # a uniform distribution between the limits is wider than a normal one of a third of them
        wider = np.sqrt(3.0) if self.asked.distribution == "uniform" else 1.0
        for header, its in found.items():
            linear = self.linear[header].sd * wider
            with np.errstate(invalid="ignore", divide="ignore"):
                apart = np.abs(its.sd - linear) / linear
            apart[~(linear > 1e-9 * np.nanmax(linear, initial=0.0))] = 0.0
            if np.nanmax(apart, initial=0.0) > sampling + APART:
                i = int(np.nanargmax(apart))
                shown = self.analysis.inputs.shown[i, 0]
                lines.append(
                    f"{header}: the first order is not enough at input {shown:g} {self.analysis.unit}: a standard deviation of "
                    f"{linear[i]:.6g}, but {its.sd[i]:.6g} of the drawn mechanisms"
                )
        if whole < 1:
            lines.append(
                f"{(1 - whole) * 100:.3g} % of the drawn mechanisms cannot be assembled in every pose"
            )
        return lines

    def document(self) -> dict[str, Any]:
        """As the JSON document has it."""
        found: dict[str, Any] = {
            "columns": {
                header: {"worst": cells(its.worst), "sd": cells(its.sd)}
                for header, its in self.linear.items()
            },
            "shares": [
                {"path": d.path, "column": header, "share": cells(its.shares[i])}
                for header, its in self.linear.items()
                for i, d in enumerate(self.limits)
            ],
        }
        if self.draws:
            drawn, whole = self.drawn
            found["drawn"] = {
                "columns": {
                    header: _sample(its)
                    | {f"{name}_error": cells(e) for name, e in zip(NAMES, its.errors, strict=True)}
                    for header, its in drawn.items()
                },
                "draws": self.draws,
                "seed": self.asked.seed,
                "distribution": self.asked.distribution,
                "assembled": whole,
            }
        return found

    def table(self) -> Table:
        """The table of poses, each number with its worst case and its standard deviation."""
        base = columns.table(self.analysis, self.asked.forces)
        found: list[Column] = []
        for column in base.columns:
            found.append(column)
            if column.header not in self.linear:
                continue
            its = self.linear[column.header]
            found.append(Column(f"{column.name}_worst", column.unit, cells(its.worst)))
            found.append(Column(f"{column.name}_sd", column.unit, cells(its.sd)))
            if self.draws:
                sample = _sample(self.drawn[0][column.header])
                found += [Column(f"{column.name}_drawn_{name}", column.unit, sample[name]) for name in sample]
        return Table(found, base.keys)

    def words(self) -> str:
        """Which dimensions matter most, for the terminal."""
        lines = []
        for header, its in self.linear.items():
            mean = (
                np.nanmean(its.shares, axis=1)
                if np.isfinite(its.shares).any()
                else np.zeros(len(self.limits))
            )
            order = np.argsort(-mean, kind="stable")[:3]
            ranked = zip(order, [list(self.limits)[i].path for i in order], strict=True)
            told = ", ".join(f"{path} {mean[i] * 100:.3g} %" for i, path in ranked if mean[i] > 0)
            if told:
                lines.append(f"{header}: {told}")
        return (
            "shares of the variance, the largest, means over the poses:\n" + "\n".join(lines) if lines else ""
        )


def _sample(its: Drawn) -> dict[str, Numbers]:
    """Mean, standard deviation and quantiles of what was drawn, by the names that they are shown under."""
    values = its.mean, its.sd, *its.quantiles
    return {name: cells(each) for name, each in zip(("mean", "sd", *NAMES), values, strict=True)}


_FIELDS = ("mean", "sd", "quantiles", "errors")
