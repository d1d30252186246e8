"""Dimensions of which points, links and slides come nearest to a target, and the file with them in it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cli.cases.call import beside
from cli.cases.case import Case, TableCase, TableStudy
from cli.cases.values import Varied, assigned_paths, quantity
from cli.fit.targets import targets, wanted, weights
from cli.read import options
from cli.show.picture import blank
from cli.show.result import Result
from dalembert.angles import read_degrees
from dalembert.errors import DataError
from dalembert.results.columns import Column, Table
from dalembert.tables.files import read_bytes
from virtualwork.describe import DescriptionError
from virtualwork.describe.dimensions import Dimension, value
from virtualwork.describe.units import Units

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cli.cases.case import Rows
    from dalembert.results.columns import Document, Json
    from dalembert.results.way import Topic
    from virtualwork import Mechanism
    from virtualwork.family.fitting import Fit
    from virtualwork.family.target import Reached, Target

STARTS = 256
# relative: how well what is written has to read as what was fitted
WRITTEN = 1e-12


@dataclass
class Fitted(TableCase):
    """The fit of one mechanism."""

    study: Fits
    mechanism: Mechanism
    name: str = field(init=False)

    def __post_init__(self) -> None:
        self.name = self.mechanism.name

    @cached_property
    def best(self) -> Fit[Mechanism]:
        """The best solution."""
        s = self.study
        try:
            with options.processes(s.workers) as pool:
                return self.mechanism.fit(
                    s.aims, free=s.free, starts=s.starts, seed=s.seed, best=s.best, executor=pool
                )
        except DescriptionError as error:
            raise options.bad("--free", error) from None

    @property
    def solutions(self) -> list[Fit[Mechanism]]:
        """All distinct solutions that are requested, as far as there are."""
        return [self.best, *self.best.others]

    def document(self) -> Document:
        """What the JSON document has of it."""
        return {"fit": _document(self.solutions)}

    def table(self) -> Table:
        """A row for each solution."""
        return _numbers(self.solutions)

    def warnings(self) -> list[str]:
        """Fewer solutions than requested, and what is doubtful about each."""
        solutions, lines = self.solutions, []
        if len(solutions) < self.study.best:
            lines.append(f"fit: {len(solutions)} distinct of the {self.study.best} solutions of --best")
        lines += self.best.remarks
        for i, other in enumerate(self.best.others, 2):
            lines += [f"solution {i}: {remark}" for remark in other.remarks]
        return lines

    def words(self) -> str:
        """How near it comes."""
        return _sentence(self.best)

    def way(self) -> list[Topic]:
        """What is minimised, and what is left."""
        from cli.fit.way import way

        return way(_document(self.solutions))

    def figure(self) -> Figure:
        """The target, and the fitted mechanism."""
        return _drawn(self.best)


@dataclass(frozen=True)
class Fits(TableStudy):
    """Fit every case.

    Attributes
    ----------
    aims : list of Target
    free : dict of path to (low, high), SI
    starts, seed, best, workers : int
    """

    aims: Sequence[Target] = ()
    free: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    starts: int = STARTS
    seed: int = 0
    best: int = 1
    workers: int = 1

    title = "fit"
    method = "Nonlinear least squares within bounds, from many starts, with exact derivatives."

    def case(self, row: Rows | None = None) -> Fitted:
        """A variant, or the mechanism itself."""
        return Fitted(self, self.mechanism if row is None else self.variant(row))

    def result(self, case: Case) -> Result:
        """With the places of the target, and the file with the fitted numbers."""
        assert isinstance(case, Fitted)
        result, best = super().result(case), case.best
        return replace(
            result,
            tables={**result.tables, **_places(best)},
            toml=lambda: _text(self.request.file, best, self.bare).encode(),
        )


def aims(
    m: Mechanism, paths: Sequence[str], names: Sequence[str], weight: Sequence[str] | None, remarks: list[str]
) -> list[Target]:
    """The targets of the tables."""
    if len(m.inputs) != 1:
        raise options.bad("FILE.toml", f"{len(m.inputs)} inputs: expected a mechanism with one")
    every = wanted(m, names)
    return targets(m, paths, every, weights(weight, every), remarks)


def bounds(m: Mechanism, free: Sequence[str], bare: Mapping[str, str]) -> dict[str, tuple[float, float]]:
    """Every `--free NAME=LOW:HIGH` in SI."""
    bounds: dict[str, tuple[float, float]] = {}
    for text in free:
        (first, *both), span = assigned_paths(m, text, "--free", "LOW:HIGH")
        if both:
            raise options.bad("--free", f"'{text}': two numbers: expected {first.path} or {both[0].path}")
        if first.path in bounds:
            raise options.bad("--free", f"'{text}': {first.path} is given twice")
        ends = span.split(":")
        if len(ends) != 2:
            raise options.bad("--free", f"'{text}': expected NAME=LOW:HIGH, such as {first.path}=...:...")
        of = Varied(first)
        low, high = (of.si(quantity(of, end, "--free", bare)) for end in ends)
        if not low < high:
            raise options.bad(
                "--free", f"'{text}': expected the lower bound first, and a higher one after it"
            )
        bounds[first.path] = low, high
    return bounds


def _drawn(fit: Fit[Mechanism]) -> Figure:
    figure = blank()
    fit.plot(figure)
    if fit.mechanism.name:
        figure.suptitle(fit.mechanism.name, fontsize=10)
    return figure


def _sentence(fit: Fit[Mechanism]) -> str:
    parts = [
        f"{_name(each)} comes within {_size(each, each.max):.3g} {_unit(each)} of all {len(each.target)} rows of its "
        f"target, {_size(each, each.rms):.3g} {_unit(each)} in the root of the mean square"
        for each in fit.reached
    ]
    return f"{'; '.join(parts)}. The file's own numbers and {fit.starts - 1} others were starts."


def _name(each: Reached) -> str:
    return each.name.rpartition(".")[2]


def _unit(each: Reached) -> str:
    return "deg" if each.kind == "angle" else "m"


def _size(each: Reached, value: Any) -> Any:
    """A distance as it is shown."""
    return np.degrees(value) if each.kind == "angle" else value


def _shown(dimension: Dimension, si: float) -> float:
    return read_degrees(si) if dimension.unit == "deg" else si


def _parameters(fit: Fit[Mechanism]) -> dict[str, float]:
    return {d.header: _shown(d, si) for d, si in zip(fit.dimensions, fit.values.tolist(), strict=True)}


def _misses(reached: Sequence[Reached]) -> dict[str, float]:
    """Root of the mean square and largest distance of lengths together, and of angles."""
    misses: dict[str, float] = {}
    for unit in ("m", "deg"):
        parts = [_size(each, each.distances) for each in reached if _unit(each) == unit]
        if parts:
            every = np.concatenate(parts)
            misses |= {
                f"rms_{unit}": float(np.sqrt(np.mean(every**2))),
                f"max_{unit}": float(every.max()),
            }
    return misses


def _document(solutions: Sequence[Fit[Mechanism]]) -> Document:
    def one(found: Fit[Mechanism]) -> Document:
        each: list[Json] = [{"name": _name(r), **_misses([r])} for r in found.reached]
        return {"parameters": _parameters(found), **_misses(found.reached), "targets": each}

    best, *others = solutions
    document = one(best) | {"starts": best.starts, "evaluations": best.evaluations}
    return document | ({"others": [one(other) for other in others]} if others else {})


def _numbers(solutions: Sequence[Fit[Mechanism]]) -> Table:
    """A row for each solution: the dimensions, and how near they come."""
    best = solutions[0]
    columns = [
        Column(d.path, d.unit, [_parameters(found)[d.header] for found in solutions]) for d in best.dimensions
    ]
    misses = [_misses(found.reached) for found in solutions]
    for header in misses[0]:
        name, unit = header.split("_")
        columns.append(Column(name, unit, [each[header] for each in misses]))
    columns.append(Column("starts", "", [float(best.starts)] * len(solutions)))
    columns.append(Column("evaluations", "", [float(best.evaluations)] * len(solutions)))
    if len(solutions) == 1:
        return Table(columns)
    numbers = [str(i) for i in range(1, len(solutions) + 1)]
    return Table([Column("solution", "", numbers), *columns], keys=("solution",))


def _places(fit: Fit[Mechanism]) -> dict[str, Callable[[], Table]]:
    """A table for each target, a row for each of its rows."""
    by_target: dict[int, list[Reached]] = {}
    for each in fit.reached:
        by_target.setdefault(id(each.inputs), []).append(each)
    turning = not fit.mechanism.inputs[0].is_slide

    def table(reached: Sequence[Reached]) -> Table:
        inputs = reached[0].inputs
        columns = [Column("input", "deg" if turning else "m", np.degrees(inputs) if turning else inputs)]
        for each in reached:
            name = "" if len(fit.reached) == 1 else f"{_name(each)}_"
            for title, values in (("", each.values), ("target_", each.target)):
                if each.kind == "point":
                    columns.append(Column(f"{name}{title}x", "m", values.real))
                    columns.append(Column(f"{name}{title}y", "m", values.imag))
                else:
                    what = "angle" if each.kind == "angle" else "position"
                    columns.append(Column(f"{name}{title}{what}", _unit(each), _size(each, values)))
            columns.append(Column(f"{name}distance", _unit(each), _size(each, each.distances)))
        return Table(columns)

    names = ["points" if i == 0 else f"points {i + 1}" for i in range(len(by_target))]
    return {name: partial(table, of) for name, of in zip(names, by_target.values(), strict=True)}


def _text(file: str, fit: Fit[Mechanism], bare: Mapping[str, str]) -> str:
    """The file's own text with the fitted numbers."""
    import tomlkit

    from virtualwork import Mechanism

    name, data = read_bytes(file)
    document = tomlkit.parse(data.decode("utf-8-sig"))
    for dimension, si in zip(fit.dimensions, fit.values.tolist(), strict=True):
        _write(document, dimension, si, Units(dict(bare)))
    text = tomlkit.dumps(document)
    folder = Path() if file == "-" else Path(file).parent
    again = Mechanism.from_toml_text(text, name, folder, partial(beside, []))
    for path, si in fit.parameters.items():
        if not math.isclose(float(value(again, path).real), si, rel_tol=WRITTEN, abs_tol=1e-15):
            raise DataError(
                f"{name}: {path}: it does not stand in the file as a number that could be replaced"
            )
    return text


def _write(document: Any, dimension: Dimension, si: float, units: Units) -> None:
    """Put a number where it stands in the document, in the unit of the file."""
    path, where = dimension.path.split("."), dimension.where
    if where[0] in ("guides", "gears", "belts", "racks"):
        # lists count from 1, and slots apart from sliders
        rows = document[path[0]]
        of, rest = (rows[int(path[1]) - 1] if isinstance(rows, list) else rows), where[2:]
    elif where[0] == "links":
        of, rest = document["links"][where[1]]["points"], where[3:]
    else:
        of, rest = document[where[0]], where[1:]
    *way, last = (0 if key == "x" else 1 if key == "y" else key for key in rest)
    for key in way:
        of = of[key]
    if isinstance(of.get(last) if isinstance(last, str) else of[last], str):
        of[last] = f"{_shown(dimension, si)!r} {dimension.unit}".strip()
    else:
        of[last] = units.bare(si, dimension.kind)
