"""`--tolerance`: what the tolerances of the file do to every number that is shown."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cli.errors import DataError
from cli.mechanism import columns
from cli.mechanism.forces import effort_name, rows_of
from cli.mechanism.poses import LINK, POINT, SLIDE, cells
from cli.mechanism.solve import Analysis
from cli.read.options import processes
from cli.show.columns import Column, Table
from virtualwork.describe.dimensions import Dimension
from virtualwork.family.tolerance import Drawn, Spread, drawn, drawn_numbers, limits, spread, summary
from virtualwork.formulas.asked import COMPLEX, Key

if TYPE_CHECKING:
    from numpy.typing import NDArray

# how far a drawn standard deviation may be from the linear one, in its sampling errors and by its size
SURE, APART = 5.0, 0.02
NAMES = ("p0.135", "p99.865")


@dataclass(frozen=True)
class Shown:
    """A number of the table: its header, the quantity it is of, and which part.

    Attributes
    ----------
    imaginary : bool
        Whether it is the y of a vector.
    factor : float
        From SI to what is shown.
    turn : float or None
        Of an angle.
    """

    header: str
    key: Key
    imaginary: bool = False
    factor: float = 1.0
    turn: float | None = None

    def of(self, values: Any) -> NDArray[np.float64]:
        """The number, from the quantity or its slope."""
        part = values.imag if self.imaginary else values.real if self.key[0] in COMPLEX else values
        return np.asarray(part * self.factor)


def shown(analysis: Analysis, forces: bool) -> list[Shown]:
    """Every number of the table of poses, or of forces, in its order."""
    m, motion = analysis.mechanism, analysis.motions[0]
    found: list[Shown] = []

    def pair(first: str, second: str, key: Key) -> None:
        found.extend((Shown(first, key), Shown(second, key, imaginary=True)))

    if forces:
        several = len(m.inputs) > 1
        for j, entry in enumerate(m.inputs):
            prefix, name = f"{entry.name}_" if several else "", effort_name(entry.is_slide)
            found.append(Shown(f"{prefix}input_{name}", ("newton-euler", j)))
            found.append(Shown(f"{prefix}virtual_work_{name}", ("effort", j)))
        for joint, on, of in rows_of(analysis, motion):
            lead = f"{joint.name}_{of}_on_{on}"
            pair(f"{lead}_fx_N", f"{lead}_fy_N", ("force", joint.key, on))
            if joint.guide is not None:
                found.append(Shown(f"{lead}_moment_N_m", ("moment", joint.key, on)))
        pair("shaking_fx_N", "shaking_fy_N", ("shaking",))
        found.append(Shown("shaking_moment_N_m", ("shaking moment",)))
        return found
    for name in analysis.points:
        body = next(body for body, points in m.bodies.items() if name in points)
        for k in range(analysis.order + 1):
            x, y = POINT[k]
            pair(f"{name}_{x}", f"{name}_{y}", ("point", body, 0j, name, k))
    for name in analysis.slides:
        guide = next(i for i, g in enumerate(m.guides) if g.point == name)
        found += [Shown(f"{name}_{SLIDE[k]}", ("slide", guide, k)) for k in range(analysis.order + 1)]
    for name in analysis.links:
        for k in range(analysis.order + 1):
            key: Key = ("angle", name, k)
            degrees = (180 / np.pi, 360.0) if k == 0 else (1.0, None)
            found.append(Shown(f"{name}_{LINK[k]}", key, False, *degrees))
    return found


@dataclass
class Tolerances:
    """What the tolerances do, worked out when it is asked for.

    Attributes
    ----------
    draws : int
        How many mechanisms are drawn; 0 for none.
    """

    analysis: Analysis
    forces: bool
    draws: int = 0
    seed: int = 0
    distribution: str = "normal"
    workers: int = 1
    said: list[str] = field(default_factory=list)

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
    def numbers(self) -> list[Shown]:
        """What is shown."""
        return shown(self.analysis, self.forces)

    @cached_property
    def keys(self) -> list[Key]:
        """The quantities that this is of."""
        return list(dict.fromkeys(number.key for number in self.numbers))

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
        numbers = drawn_numbers(m, self.limits, self.draws, self.seed, self.distribution)
        nominal = dict(zip(self.keys, motion.sensitivities.values(self.keys), strict=True))
        parts: dict[str, list[Drawn]] = {number.header: [] for number in self.numbers}
        whole = np.ones(self.draws, dtype=bool)
        rates = q.speed, q.acceleration
        with processes(self.workers) as pool:
            for rows, values, assembled in drawn(m, numbers, motion.inputs, rates, self.keys, pool):
                whole &= assembled.all(axis=1)
                found = dict(zip(self.keys, values, strict=True))
                for number in self.numbers:
                    its, mean = number.of(found[number.key]), number.of(nominal[number.key][rows])
                    parts[number.header].append(summary(its, mean, number.turn))
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
        wider = np.sqrt(3.0) if self.distribution == "uniform" else 1.0
        for header, its in found.items():
            linear = self.linear[header].sd * wider
            with np.errstate(invalid="ignore", divide="ignore"):
                apart = np.abs(its.sd - linear) / linear
            apart[~(linear > 1e-9 * np.nanmax(linear, initial=0.0))] = 0.0
            if np.nanmax(apart, initial=0.0) > sampling + APART:
                i = int(np.nanargmax(apart))
                shown = self.analysis.inputs.shown[i, 0]
                unit = "m" if self.analysis.mechanism.inputs[0].is_slide else "deg"
                lines.append(
                    f"{header}: the first order is not enough at input {shown:g} {unit}: a standard deviation of "
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
                    header: {"mean": cells(its.mean), "sd": cells(its.sd)}
                    | {name: cells(q) for name, q in zip(NAMES, its.quantiles, strict=True)}
                    | {f"{name}_error": cells(e) for name, e in zip(NAMES, its.errors, strict=True)}
                    for header, its in drawn.items()
                },
                "draws": self.draws,
                "seed": self.seed,
                "distribution": self.distribution,
                "assembled": whole,
            }
        return found

    def table(self) -> Table:
        """The table of poses, each number with its worst case and its standard deviation."""
        base = columns.forces(self.analysis) if self.forces else columns.poses(self.analysis)
        found: list[Column] = []
        for column in base.columns:
            found.append(column)
            if column.header not in self.linear:
                continue
            its = self.linear[column.header]
            found.append(Column(f"{column.name}_worst", column.unit, cells(its.worst)))
            found.append(Column(f"{column.name}_sd", column.unit, cells(its.sd)))
            if self.draws:
                sample = self.drawn[0][column.header]
                named = (("mean", sample.mean), ("sd", sample.sd), *zip(NAMES, sample.quantiles, strict=True))
                found += [
                    Column(f"{column.name}_drawn_{name}", column.unit, cells(values))
                    for name, values in named
                ]
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


_FIELDS = ("mean", "sd", "quantiles", "errors")
