"""The cases of a call: the mechanism of its file, its variants, and the inputs that all of them go through.

A case is a variant at its inputs. `--at`, `--over`, `--cases` and `--set` fill one `Cases`, whoever asks; `--find` changes
its mechanism (`with_root`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cli.cases.analysis import Analysis, Request
from cli.cases.axes import assigned, dimension_named, grids, place_or_angle
from cli.cases.inputs import Axis, Driven, Grid, Varied, of_one, with_numbers
from cli.cases.poses import cells_of, keys_of, solved
from cli.cases.poses import column as column_of
from cli.read import root_search
from cli.read.options import bad
from dalembert.dataclass import dataclass, field, replace
from dalembert.errors import DataError
from dalembert.results.about import about
from dalembert.tables.files import name_of, note, read_bytes, remember, split_sheet
from dalembert.tables.table import read
from dalembert.units import UNITS, from_si
from dalembert.units import written as unit_text
from dalembert.written import DEGREES, Written, written
from virtualwork import MechanismError

if TYPE_CHECKING:
    from types import SimpleNamespace

    from numpy.typing import NDArray

    from virtualwork import Mechanism
    from virtualwork.describe.dimensions import Dimension
    from virtualwork.family.part import Part
    from virtualwork.quantities import Component

    # of `Written` numbers
    Rows = NDArray[Any]
    Reals = NDArray[np.float64]


class Described(NamedTuple):
    """A mechanism as its file describes it."""

    mechanism: Mechanism
    bare: dict[str, str]
    """The units of bare lengths and angles, as far as `[units]` names them."""
    warnings: list[str]
    """Warnings of the tables that the file names."""
    about: dict[str, str]
    """The entries of the file for the head of a report."""


def load(path: str) -> Described:
    """Read a description; - is standard input."""
    import tomllib

    from virtualwork import Mechanism

    remember(path)
    file, data = read_bytes(path)
    warnings: list[str] = []
    try:
        text = data.decode("utf-8-sig")
        folder = Path() if path == "-" else Path(path).parent
        mechanism = Mechanism.from_toml_text(text, file, folder, partial(beside, warnings))
    except UnicodeDecodeError:
        raise DataError(f"{file}: this is not text: expected TOML in UTF-8") from None
    except ValueError as error:
        raise DataError(str(error)) from None
    document = tomllib.loads(text)
    units = {kind: str(unit) for kind, unit in document.get("units", {}).items()}
    return Described(mechanism, units, warnings, about(file, document))


@contextmanager
def naming(file: str) -> Iterator[None]:
    """Name the file in the errors of a mechanism."""
    name = name_of(file)
    try:
        yield
    except MechanismError as error:
        raise DataError(f"{error}" if str(error).startswith(name) else f"{name}: {error}") from None


def beside(warnings: list[str], path: Path) -> bytes:
    """Return a table that a mechanism's file names, perhaps with its sheet; its warnings are added to `warnings`.

    Raises
    ------
    OSError
        There is no such file.
    DataError
        The table is wrong: it names row or cell, column, value and what was expected.
    """
    from virtualwork.describe.curves import QUANTITIES

    data = note(split_sheet(str(path))[0]).read_bytes()
    warnings += read(str(path), numbers=QUANTITIES, texts=("step",), blank=tuple(QUANTITIES)).warnings
    return data


@dataclass(frozen=True)
class Cases:
    """The cases of a call.

    Attributes
    ----------
    request : Request
    mechanism : Mechanism
        The mechanism whose dimensions the variants change.
    bare : dict of kind to unit
        The file's units of bare numbers.
    varied : Grid, optional
        The variants; None where there is the mechanism alone.
    moved : Grid, optional
        The inputs that all variants go through.
    warnings : list of str
        Warnings of the files.
    about : dict
        The entries of the file for the head of a report.
    found : Found, optional
        The number that --find has found.
    """

    request: Request
    mechanism: Mechanism
    bare: dict[str, str]
    varied: Grid | None = None
    moved: Grid | None = None
    warnings: list[str] = field(default_factory=list)
    about: dict[str, str] = field(default_factory=dict)
    found: root_search.Found | None = None

    @classmethod
    def of(cls, options: SimpleNamespace, order: int | None = None, *, forces: bool = False) -> Cases:
        """Read the file, change its numbers, and lay out the cases; `order` and `forces` as in a `Request`."""
        request = Request.of(options, order, forces=forces)
        with naming(request.file):
            mechanism, bare, warnings, about = load(options.file)
            if options.set:
                mechanism = assigned(mechanism, bare, options.set)
            varied, moved = grids(mechanism, options.at, options.over, options.cases, bare, warnings)
        return cls(request, mechanism, bare, varied, moved, warnings, about)

    # --- the whole ------------------------------------------------------------------------------------------------
    @property
    def count(self) -> int:
        """The number of mechanisms."""
        return 1 if self.varied is None else self.varied.n

    @property
    def poses(self) -> int:
        """The number of poses that each mechanism goes through."""
        return 1 if self.moved is None else self.moved.n

    def rows(self, low: int, high: int) -> Rows:
        """Return the numbers of the variants from low to high."""
        assert self.varied is not None
        return self.varied.written(low, high)

    @cached_property
    def names(self) -> tuple[Driven | Varied, ...]:
        """The inputs and dimensions that a row of variants sets."""
        return () if self.varied is None else self.varied.names

    @cached_property
    def nominal(self) -> Analysis:
        """The analysis of the mechanism itself."""
        return Analysis(self.request, self.mechanism, of_one(self.mechanism, self.moved))

    def __getstate__(self) -> dict[str, Any]:
        """Return what another process needs: the rows of variants are sent to it part by part."""
        kept = {name: value for name, value in vars(self).items() if name != "nominal"}
        return {**kept, "varied": None, "names": self.names}

    def refuse_inputs(self, message: str) -> None:
        """Refuse options that move inputs, where these mean nothing."""
        for axis in self._requested:
            if any(isinstance(name, Driven) for name in axis.names):
                raise bad(axis.option, message)

    @property
    def _requested(self) -> list[Axis]:
        """The axes that options request: a law of motion in the file is none of them."""
        grids = [grid for grid in (self.varied, self.moved) if grid is not None]
        return [axis for grid in grids for axis in grid.axes if axis.option.startswith("--")]

    def at_start(self) -> Cases:
        """Return these cases with their inputs as numbers of the file: a motion in time starts there."""
        from virtualwork.describe.dimensions import dimensions

        by_place = {d.where: Varied(d) for d in dimensions(self.mechanism).values()}
        kinds = ("value", "speed", "acceleration")

        def in_file(name: Driven | Varied) -> Varied:
            return by_place["inputs", name.j, kinds[name.order]] if isinstance(name, Driven) else name

        axes = [replace(axis, names=tuple(map(in_file, axis.names))) for axis in self._requested]
        varied = Grid(tuple(axes)) if axes else None
        if varied is None or varied.n > 1:
            return replace(self, varied=varied, moved=None)
        with naming(self.request.file):
            paths = [name.of for name in varied.names if isinstance(name, Varied)]
            m = with_numbers(self.mechanism, paths, written(varied.written(0, 1)[0]))
        return replace(self, mechanism=m, varied=None, moved=None)

    # --- one variant, some variants -------------------------------------------------------------------------------
    def analysis(self, row: Rows) -> Analysis:
        """Return the analysis of the variant with the numbers of a row.

        Raises
        ------
        MechanismError
        """
        numbers = list(zip(self.names, written(row), strict=True))
        m = with_numbers(self.mechanism, self.dimensions, [x for of, x in numbers if isinstance(of, Varied)])
        inputs = [(of, x) for of, x in numbers if isinstance(of, Driven)]
        return Analysis(self.request, m, of_one(m, self.moved, inputs))

    @property
    def dimensions(self) -> list[Dimension]:
        """The dimensions that vary."""
        return [name.of for name in self.names if isinstance(name, Varied)]

    def numbers(self, rows: Rows) -> Rows:
        """Return the dimensions of rows of variants, without their inputs."""
        return rows[:, [isinstance(name, Varied) for name in self.names]]

    def in_si(self, rows: Rows) -> dict[str, list[float]]:
        """Return the numbers of variants by path, SI."""
        return {
            d.path: column
            for d, column in zip(self.dimensions, self.numbers(rows)["si"].T.tolist(), strict=True)
        }

    def part(self, rows: Rows) -> tuple[Part, Reals]:
        """Return variants as a part of a family, and their inputs as they are shown, (v or 1, n, k)."""
        from virtualwork.family.family import Family
        from virtualwork.family.part import Part

        m, v = self.mechanism, len(rows)
        family = Family(m, self.in_si(rows))
        nominal = self.nominal.inputs.whole
        names = () if self.moved is None else self.moved.names
        moved = {name.j for name in names if isinstance(name, Driven)}
        si, shown = nominal.values[None], nominal.shown[None]
        rates = family.rates(nominal.speed, nominal.acceleration)
        # a variant may set an input: by a column of inputs, or by another position in its file
        for name, column in zip(self.names, rows.T, strict=True):
            numbers = column["si"]
            if isinstance(name, Driven):
                j, cells = name.j, column["shown"]
                if name.order:
                    rates[name.order - 1][j] = numbers[:, None]
                    continue
            else:
                table, *key = name.of.where
                # another number than a position, or one that the grid of inputs moves anyhow
                if table != "inputs" or key[-1] != "value" or int(key[0]) in moved:
                    continue
                j = int(key[0])
                cells = np.array([Driven.of(m, j).shown(x) for x in numbers.tolist()])
            if len(si) == 1:
                si, shown = (np.repeat(x, v, axis=0) for x in (si, shown))
            si[:, :, j], shown[:, :, j] = numbers[:, None], cells[:, None]
        return Part(m, family.dimensions, family.values, si, rates), shown


# --- --find NAME --so-that QUANTITY=VALUE -----------------------------------------------------------------------------
def with_root(cases: Cases, find: str | None, so_that: str | None) -> Cases:
    """Return the cases with the number that --find seeks, the nearest to the file's own.

    Raises
    ------
    typer.BadParameter
        A name or a value means nothing.
    DataError
        No number in reach gives the value.
    """
    if cases.varied is not None or cases.poses > 1:
        raise bad("--find", "expected one pose of one mechanism, such as --at 60deg")
    m, bare = cases.mechanism, cases.bare
    pair = root_search.pair(find, so_that)
    assert pair is not None
    name, wanted = pair
    dimension = dimension_named(m, name, name, "--find")
    word, text = root_search.quantity_and_value(wanted, "B.vx=3m_s")
    request = cases.request._replace(only=[word], order=None)

    def analysis(mechanism: Mechanism) -> Analysis:
        return Analysis(request, mechanism, of_one(mechanism, cases.moved))

    component = _quantity(analysis(m), word)
    target, unit = _target(component, text, bare)

    def at(x: float) -> Written:
        is_angle = dimension.unit == "deg"
        return Written.of(repr(x), DEGREES if is_angle else (1, 1), is_angle=is_angle)

    def value(x: float) -> float | None:
        try:
            return number_at(analysis(with_numbers(m, [dimension.of], [at(x)])), component)
        except (MechanismError, DataError):
            return None

    own = float(m.value(dimension.label).real)
    start = 0.0 if own != own else math.degrees(own) if dimension.unit == "deg" else own
    sought = root_search.Sought(dimension.of.header, dimension.unit, start)
    goal = root_search.Goal(word, unit, target, bool(component.link))
    root = root_search.search(name, sought, goal, value)
    sentence = f"{name} = {_in_unit_of_file(dimension, root, bare)} gives {word} = {root_search.amount(target, unit)}"
    found = root_search.Found(sought.header, root, sentence)
    return replace(cases, mechanism=with_numbers(m, [dimension.of], [at(root)]), found=found)


def _quantity(nominal: Analysis, word: str) -> Component:
    """Return the one quantity of this name."""
    nominal.check_names("--so-that")
    components = [each for each in nominal.tabled if word in each.names]
    if len(components) != 1:
        names = ", ".join(dict.fromkeys(n for each in nominal.tabled for n in each.names[:1]))
        raise bad("--so-that", f"'{word}': expected one number: {names}")
    return components[0]


def number_at(analysis: Analysis, component: Component) -> float | None:
    """Return a quantity of the first pose, as it is shown; None where it has no value."""
    computed = solved(analysis.motions[0], keys_of([component]))
    return cells_of([component], computed, analysis.inputs.n, analysis.set_angles)[component][0]


def _target(component: Component, text: str, bare: Mapping[str, str]) -> tuple[float, str]:
    """Return the value that --so-that names, in the unit that the quantity is shown in, and that unit."""
    unit = column_of(component.header, []).unit
    kind = {"deg": "angle", "m": "length"}.get(unit)
    if kind is None:
        return root_search.value_in(unit, text), unit
    return place_or_angle(text, kind, "--so-that", bare).shown, unit


def _in_unit_of_file(dimension: Varied, shown: float, bare: Mapping[str, str]) -> str:
    """Return a number in the file's own unit."""
    unit = bare.get("length", dimension.unit) if dimension.kind == "length" else dimension.unit
    if dimension.kind == "length" and unit in UNITS["length"]:
        return f"{float(from_si(shown, 'length', unit)):.10g} {unit_text(unit)}"
    if dimension.unit == "deg":
        return f"{shown:.10g}°"
    return f"{shown:.10g} {unit_text(dimension.unit)}".rstrip()
