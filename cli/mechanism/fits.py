"""Dimensions of which points, links and slides come nearest to a target, the file with them in it, the worked solution."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import cache, cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cli.cases.axes import assigned_paths, quantity
from cli.cases.case import Case, Study
from cli.cases.cases import beside
from cli.cases.inputs import Varied
from cli.mechanism.targets import targets, wanted, weights
from cli.read import options
from dalembert.angles import read_degrees
from dalembert.arithmetic.exact import EPS
from dalembert.dataclass import dataclass, field, replace
from dalembert.drawing.sheet import blank
from dalembert.errors import DataError
from dalembert.results.columns import ABSENT, Column, Table, names, number
from dalembert.results.result import Result
from dalembert.results.way import Topic, figures
from dalembert.tables.files import read_bytes
from virtualwork.describe import DescriptionError
from virtualwork.describe.dimensions import Dimension, dimensions, number_of
from virtualwork.describe.units import Units

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from cli.cases.analysis import Analysis
    from virtualwork import Mechanism
    from virtualwork.family.fitted import Fit
    from virtualwork.family.keep import Bound, Kept
    from virtualwork.family.target import Reached, Target

STARTS = 256
# relative: how well what is written has to read as what was fitted
WRITTEN = 1e-12


@dataclass
class Fitted(Case):
    """The fit of one mechanism."""

    study: Fits
    mechanism: Mechanism

    @cached_property
    def best(self) -> Fit[Mechanism]:
        """The best solution."""
        s = self.study
        try:
            with options.processes(s.workers) as pool:
                return self.mechanism.fit(
                    s.aims, free=s.free, starts=s.starts, seed=s.seed, best=s.best, executor=pool, keep=s.keep
                )
        except DescriptionError as error:
            raise options.bad("--free", error) from None

    @property
    def solutions(self) -> list[Fit[Mechanism]]:
        """All distinct solutions that are requested, as far as there are."""
        return [self.best, *self.best.others]

    def table(self) -> Table:
        """Return a row for each solution."""
        return _numbers(self.solutions)

    def further(self) -> dict[str, Callable[[], Table]]:
        """Return the distances of the best solution from each of several targets, and the constraints."""
        several, tables = len(self.best.reached) > 1, dict[str, Callable[[], Table]]()
        if several:
            tables["misses"] = lambda: _misses_by_target([self.best], "fit")
        if self.best.kept:
            tables["kept"] = lambda: _kept([self.best], "fit")
        return tables

    def documented(self) -> list[Table]:
        """Return the best solution, and below it the others."""
        best, *others = self.solutions
        tables = [_numbers([best], "fit"), _misses_by_target([best], "fit"), _kept([best], "fit")]
        if others:
            tables += [each(others, "fit.others[]") for each in (_numbers, _misses_by_target, _kept)]
        return [table for table in tables if table.columns]

    def warnings(self) -> list[str]:
        """Return the warnings: fewer solutions than requested, and doubts about each solution."""
        solutions, lines = self.solutions, []
        if len(solutions) < self.study.best:
            some = "1 distinct solution" if len(solutions) == 1 else f"{len(solutions)} distinct solutions"
            lines.append(f"fit: --best {self.study.best} finds {some}")
        lines += self.best.remarks
        for i, other in enumerate(self.best.others, 2):
            lines += [f"solution {i}: {remark}" for remark in other.remarks]
        return lines

    def way(self) -> list[Topic]:
        """Return the sum that is minimised, and the remaining distances."""

        return way(self.best, self.table(), _misses_by_target([self.best], "fit"))

    def figure(self) -> Figure:
        """Draw the target and the fitted mechanism."""
        figure = blank()
        self.best.plot(figure)
        if self.mechanism.name:
            figure.suptitle(self.mechanism.name, fontsize=10)
        return figure

    def result(self) -> Result:
        """Return the result of this mechanism alone: in addition the places of the target, and the fitted file."""
        result, cases = super().result(), self.study.cases
        result.tables = {**result.tables, **_places(self.best)}
        result.toml = lambda: _text(cases.request.file, self.best, cases.bare).encode()
        return result


@dataclass(frozen=True)
class Fits(Study):
    """Fit every case.

    Attributes
    ----------
    aims : list of Target
    free : dict of path to (low, high), SI
    keep : list of Bound
    starts, seed, best, workers : int
    """

    aims: Sequence[Target] = ()
    free: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    keep: Sequence[Bound] = ()
    starts: int = STARTS
    seed: int = 0
    best: int = 1
    workers: int = 1

    title = "fit"
    method = "Nonlinear least squares within bounds, from many starts, with exact derivatives."

    def case(self, analysis: Analysis) -> Fitted:
        """Return the fit of one mechanism."""
        return Fitted(self, analysis.mechanism)


def aims(
    m: Mechanism, paths: Sequence[str], names: Sequence[str], weight: Sequence[str] | None, remarks: list[str]
) -> list[Target]:
    """Read the targets from the tables."""
    if len(m.inputs) != 1:
        raise options.bad("FILE.toml", f"{len(m.inputs)} inputs: expected a mechanism with one")
    every = wanted(m, names)
    return targets(m, paths, every, weights(weight, every), remarks)


def bounds(m: Mechanism, free: Sequence[str], bare: Mapping[str, str]) -> dict[str, tuple[float, float]]:
    """Read every `--free NAME=LOW:HIGH`, SI."""
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
        low, high = (quantity(of, end, "--free", bare).si for end in ends)
        if not low < high:
            raise options.bad(
                "--free", f"'{text}': expected the lower bound first, and a higher one after it"
            )
        bounds[first.path] = low, high
    return bounds


def _dimension(fit: Fit[Mechanism], each: Reached) -> str:
    return each.dimension or ("force" if fit.before.inputs[0].is_slide else "torque")


def _size(each: Reached, value: Any) -> Any:
    """Return a distance in the unit of JSON."""
    return np.degrees(value) if each.dimension == "angle" else value


def _shown(dimension: Dimension, si: float) -> float:
    return read_degrees(si) if dimension.unit == "deg" else si


def _misses(fits: Sequence[Fit[Mechanism]], every: Sequence[Sequence[Reached]]) -> list[Column]:
    """Return r.m.s. and largest distance of all lengths, of all angles and of all efforts; a row for each group, of the fit beside it."""
    fit = fits[0]
    columns = []
    for dimension in ("length", "angle", "torque", "force"):
        rows = [[_size(r, r.distances) for r in group if _dimension(fit, r) == dimension] for group in every]
        if any(rows):
            parts = [np.concatenate(row) if row else np.array([np.nan]) for row in rows]
            # a target of the other kind has none
            absent = [not row for row in rows]
            for name, norm in (("rms", _rms), ("max", np.max)):
                errors = partial(_largest_errors, fits, every, dimension, norm)
                column = number(name, dimension, [norm(part) for part in parts], error=errors)
                cells = zip(column.documented, absent, strict=True)
                column.stored = [ABSENT if none else value for value, none in cells]
                columns.append(column)
    return columns


def _largest_errors(
    fits: Sequence[Fit[Mechanism]],
    every: Sequence[Sequence[Reached]],
    dimension: str,
    norm: Callable[[Any], float],
) -> list[float]:
    """Return the rounding errors of a norm of distances; a row for each group."""
    rows = [
        [_size(r, _errors(fit, r)[1]) for r in group if _dimension(fit, r) == dimension]
        for fit, group in zip(fits, every, strict=True)
    ]
    return [norm(np.concatenate(row)) if row else 0.0 for row in rows]


def _errors(fit: Fit[Mechanism], each: Reached) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the rounding errors of the values of a quantity and of their distances from the target, SI."""
    from virtualwork.family.design import numbers_of

    motion = fit.mechanism.motion(each.inputs)
    (error,) = motion.error_estimates(each.label if each.kind == "coordinate" else each.name).values()
    # the fit computes a value in another order
    numbers = map(motion.value, numbers_of(fit.mechanism, each.name))
    apart = sum(number * unit for number, unit in zip(numbers, (1, 1j), strict=False)) - each.values
    apart = np.abs(np.remainder(apart + np.pi, 2 * np.pi) - np.pi if each.kind == "angle" else apart)
    # a target is the double nearest to its decimals, and a difference is rounded
    return error + apart, error + apart + EPS * (np.abs(each.target) + each.distances)


def _rms(distances: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(distances**2)))


def _numbers(solutions: Sequence[Fit[Mechanism]], place: str | None = None) -> Table:
    """Return a row for each solution: the dimensions, and the distances from the target."""
    best, others = solutions[0], place is not None and place.endswith("[]")
    columns = [
        Column(
            d.path,
            d.unit,
            [_shown(d, float(solution.values[i])) for solution in solutions],
            place=("parameters", d.header),
        )
        for i, d in enumerate(best.dimensions)
    ]
    columns += _misses(solutions, [solution.reached for solution in solutions])
    if not others:
        counts = {"starts": best.starts, "evaluations": best.evaluations}
        columns += [Column(name, "", [count] * len(solutions), place=name) for name, count in counts.items()]
    if len(solutions) == 1 and not others:
        return Table(columns, place=place)
    return Table([_solution(solutions), *columns], ("solution",), place)


def _solution(solutions: Sequence[Fit[Mechanism]]) -> Column:
    return names("solution", [str(i) for i in range(1, len(solutions) + 1)], None)


def _misses_by_target(solutions: Sequence[Fit[Mechanism]], place: str) -> Table:
    """Return a row for each solution and target."""
    every = [r for solution in solutions for r in solution.reached]
    owners = [solution for solution in solutions for _ in solution.reached]
    columns = [names("name", [r.label for r in every]), *_misses(owners, [[r] for r in every])]
    keys: tuple[str, ...] = ("name",)
    if place.endswith("[]"):
        numbers = [str(i) for i, solution in enumerate(solutions, 1) for _ in solution.reached]
        columns, keys = [names("solution", numbers, None), *columns], ("solution", "name")
    return Table(columns, keys, f"{place}.targets[]")


def _kept(solutions: Sequence[Fit[Mechanism]], place: str) -> Table:
    """Return a row for each solution and constraint: the extreme of the quantity over the sweep; no columns without --keep."""
    every = [(str(i), kept) for i, solution in enumerate(solutions, 1) for kept in solution.kept]
    if not every:
        return Table([])
    effort = ".force" if solutions[0].before.inputs[0].is_slide else ".torque"
    columns = [names("quantity", [_of_bound(kept, effort) for _, kept in every])]
    for title in ("least", "most"):
        cells = [
            _shown_extreme(kept) if getattr(kept.bound, title) is not None else None for _, kept in every
        ]
        if any(cell is not None for cell in cells):
            stored = [ABSENT if cell is None else cell for cell in cells]
            columns.append(Column(title, "", cells, place=title, stored=stored))
    columns.append(names("met", [kept.met for _, kept in every]))
    keys: tuple[str, ...] = ("quantity",)
    if place.endswith("[]"):
        columns, keys = [names("solution", [i for i, _ in every], None), *columns], ("solution", "quantity")
    return Table(columns, keys, f"{place}.kept[]")


def _of_bound(kept: Kept, effort: str) -> str:
    """Return the name of the quantity in --keep."""
    kind, _, name = kept.bound.name.partition(".")
    part = {"links": ".angle", "slides": ".position", "effort": effort}.get(kind, "")
    return f"{name}{part}" if name else kind


def _shown_extreme(kept: Kept) -> float:
    turns = kept.bound.name == "transmission" or kept.bound.name.startswith("links.")
    return math.degrees(kept.extreme) if turns else kept.extreme


def _places(fit: Fit[Mechanism]) -> dict[str, Callable[[], Table]]:
    """Return a table for each target, with a row for each of its rows."""
    by_target: dict[int, list[Reached]] = {}
    for each in fit.reached:
        by_target.setdefault(id(each.inputs), []).append(each)
    turning = not fit.mechanism.inputs[0].is_slide

    def table(reached: Sequence[Reached]) -> Table:
        inputs = reached[0].inputs
        columns = [
            number("input", "angle", np.degrees(inputs)) if turning else number("input", "length", inputs)
        ]
        for each in reached:
            name, dimension = each.label, _dimension(fit, each)
            what = {"angle": "angle", "point": "", "slide": "position"}.get(each.kind, dimension)
            if each.kind == "coordinate":
                name, _, what = name.rpartition(".")
            lead = "" if len(fit.reached) == 1 else f"{name}_"
            errors = cache(lambda each=each: [_size(each, error) for error in _errors(fit, each)])
            for title, values in (("", each.values), ("target_", each.target)):
                parts = {what: _size(each, values)} if what else {"x": values.real, "y": values.imag}
                own = None if title else lambda of=errors: of()[0]
                columns += [
                    number(f"{lead}{title}{part}", dimension, values, error=own)
                    for part, values in parts.items()
                ]
            # both coordinates of a point have one
            lead = f"{lead}{what}_" if each.kind == "coordinate" and lead else lead
            far, off = _size(each, each.distances), lambda of=errors: of()[1]
            columns.append(number(f"{lead}distance", dimension, far, error=off))
        return Table(columns)

    names = ["points" if i == 0 else f"points {i + 1}" for i in range(len(by_target))]
    return {name: partial(table, of) for name, of in zip(names, by_target.values(), strict=True)}


def _text(file: str, fit: Fit[Mechanism], bare: Mapping[str, str]) -> str:
    """Return the file's own text with the fitted numbers, and those that --set changed."""
    import tomlkit

    from virtualwork import Mechanism

    name, data = read_bytes(file)
    text = data.decode("utf-8-sig")
    document = tomlkit.parse(text)

    def read(text: str) -> Mechanism:
        return Mechanism.from_toml_text(
            text, name, Path() if file == "-" else Path(file).parent, partial(beside, [])
        )

    own = read(text)
    new = {
        d: si for d in dimensions(own).values() if (si := number_of(fit.mechanism, d)) != number_of(own, d)
    }
    for dimension, si in new.items():
        _write(document, dimension, si, Units(dict(bare)))
    text = tomlkit.dumps(document)
    again = read(text)
    for dimension, si in new.items():
        if not math.isclose(number_of(again, dimension), si, rel_tol=WRITTEN, abs_tol=1e-15):
            raise DataError(
                f"{name}: {dimension.path}: the file does not have it as a number that can be replaced"
            )
    return text


def _write(document: Any, dimension: Dimension, si: float, units: Units) -> None:
    """Put a number where it stands in the document, in the unit of the file."""
    path, where = dimension.path.split("."), dimension.where
    if where[0] not in ("links", "ground"):
        # lists count from 1, and slots apart from sliders
        rows = document[path[0]]
        of, rest = (rows[int(path[1]) - 1] if isinstance(rows, list) else rows), where[2:]
        if where[0] == "cams":
            # the keys of a segment are not its fields
            rest = tuple(int(word) - 1 if word.isdigit() else word for word in path[2:])
        elif where[0] == "inputs":
            # an input's value is called by what it is
            rest = (path[-1],)
    elif where[0] == "links":
        link, weight = document["links"][where[1]], where[2] in ("mass", "center", "inertia")
        of, rest = (link, where[2:]) if weight else (link["points"], where[3:])
    else:
        of, rest = document[where[0]], where[1:]
    *way, last = (0 if key == "x" else 1 if key == "y" else key for key in rest)
    for key in way:
        of = of[key]
    if isinstance(of.get(last) if isinstance(last, str) else of[last], str):
        of[last] = f"{_shown(dimension, si)!r} {dimension.unit}".strip()
    else:
        of[last] = units.bare(si, dimension.kind)


def way(best: Fit[Mechanism], solutions: Table, misses: Table) -> list[Topic]:
    """Return the topics."""
    parameters = {of.header: of.documented[0] for of in solutions.columns if of.keys[:1] == ("parameters",)}
    text = [
        "Σ weight²·|q(d) − q_target|² over all rows of the target is least over the free dimensions d within their bounds;"
    ]
    text.append(f"each start ends in a local minimum, the least of {best.starts} starts is taken:")
    text += [f"  {path} = {figures(value)}" for path, value in parameters.items()]
    topic = Topic("least squares", text, "Least squares", {"parameters": parameters, "starts": best.starts})
    left = replace(misses, place="targets[]")
    return [topic, Topic("misses", ["What is left of each target:", left], "Distances to the target")]
