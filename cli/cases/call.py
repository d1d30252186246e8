"""One call on a mechanism: its file with the tables beside it, its cases, its results."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from cli.cases.analysis import Request
from cli.cases.axes import assigned, grids
from cli.cases.case import Study
from cli.cases.inputs import Driven, Grid, Varied, with_numbers
from cli.cases.loop import Loop
from cli.read.options import about, bad
from cli.show.result import Result, with_found
from dalembert.dataclass import dataclass, replace
from dalembert.errors import DataError
from dalembert.results.text import csv_text
from dalembert.tables.files import note, read_bytes, remember, split_sheet
from dalembert.tables.table import Numbers, read
from dalembert.units import UNITS, to_si

if TYPE_CHECKING:
    from cli.cases.options import Options
    from cli.read.root_search import Found
    from cli.show.commands import ShowOptions
    from dalembert.results.way import Topic
    from virtualwork import Mechanism


class Described(NamedTuple):
    """A mechanism as its file describes it."""

    mechanism: Mechanism
    bare: dict[str, str]
    """The units of bare lengths and angles, as far as `[units]` names them."""
    warnings: list[str]
    """Remarks about the tables that the file names."""
    about: dict[str, str]
    """What the file has for the head of a report."""


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
    """Name the file in what is wrong with a mechanism."""
    from virtualwork import MechanismError

    try:
        yield
    except MechanismError as error:
        raise DataError(f"{error}" if str(error).startswith(file) else f"{file}: {error}") from None


_KNOWN = {
    "time": "time",
    "t": "time",
    "angle": "angle",
    "position": "length",
    "speed": "speed",
    "fx": "force",
    "fy": "force",
    "torque": "torque",
    "lift": "length",
    "swing": "angle",
}
# what the library reads as it stands; anything else is put into the first of them
_PLAIN = {"angle": ("rad", "deg"), "position": ("m", "mm"), "lift": ("m", "mm"), "swing": ("rad", "deg")}


def beside(warnings: list[str], path: Path) -> bytes:
    """Return a table as plain CSV: commas, points, units of the library; remarks are added to `warnings`.

    Raises
    ------
    OSError
        No such file.
    DataError
        As of every table: row or cell, column, what was found, what was expected.
    """
    note(split_sheet(str(path))[0]).stat()
    table = read(str(path), numbers=_KNOWN, texts=("step",), blank=tuple(_KNOWN))
    warnings += table.warnings
    columns = dict(_plain(name, column) for name, column in table.numbers.items())
    return csv_text(columns).encode()


def _plain(name: str, column: Numbers) -> tuple[str, list[float]]:
    """Return header and values of a column; where the library knows its unit the digits are those of the file."""
    dimension = _KNOWN[name]
    first = next(iter(UNITS[dimension]))
    if column.unit in _PLAIN.get(name, (first,)):
        return f"{name}_{column.unit}", column.values.tolist()
    si = _PLAIN.get(name, (first,))[0]
    return f"{name}_{si}", to_si(column.values, dimension, column.unit).tolist()


@dataclass(eq=False, repr=False)
class Call:
    """One call: which mechanism, which cases of it, in which form.

    Attributes
    ----------
    varied, moved : Grid, optional
        What makes variants, and the inputs that all of them go through.
    """

    request: Request
    show: ShowOptions
    mechanism: Mechanism
    bare: dict[str, str]
    remarks: list[str]
    about: dict[str, str]
    varied: Grid | None
    moved: Grid | None
    workers: int
    page: Path | None
    """Where the page goes that moves."""
    found: Found | None = None
    """The number that --find asked for."""

    @classmethod
    def of(cls, own: Options, show: ShowOptions, order: int | None = None, *, forces: bool = False) -> Call:
        """Read the file, change its numbers, and lay out the cases; `order` and `forces` as in a `Request`."""
        request = Request.of(own, order, forces=forces)
        with naming(request.file):
            mechanism, bare, remarks, about = load(own.file)
            if own.set:
                mechanism = assigned(mechanism, bare, own.set)
            varied, moved = grids(mechanism, own.at, own.over, own.cases, bare, remarks)
            found = None
            name, wanted = getattr(own, "find", None), getattr(own, "so_that", None)
            if (name, wanted) != (None, None):
                from cli.cases.find import find

                if varied is not None or (moved is not None and moved.n > 1):
                    raise bad("--find", "expected one pose of one mechanism, such as --at 60deg")
                mechanism, found = find(mechanism, bare, request, moved, name, wanted)
        workers, page = getattr(own, "workers", None) or 1, getattr(own, "page", None)
        return cls(request, show, mechanism, bare, remarks, about, varied, moved, workers, page, found)

    def refuse_inputs(self, message: str) -> None:
        """Refuse options that move inputs, where these mean nothing."""
        for grid in (self.varied, self.moved):
            for axis in () if grid is None else grid.axes:
                if axis.option.startswith("--") and any(isinstance(name, Driven) for name in axis.names):
                    raise bad(axis.option, message)

    def started(self) -> Call:
        """The same call, its inputs as numbers of the file: where a motion starts."""
        from virtualwork.describe.dimensions import dimensions

        every = {d.where: Varied(d) for d in dimensions(self.mechanism).values()}
        grids = [grid for grid in (self.varied, self.moved) if grid is not None]
        # a law of motion in the file gives no start
        axes = [axis for grid in grids for axis in grid.axes if axis.option.startswith("--")]
        kinds = ("value", "speed", "acceleration")
        axes = [
            replace(
                axis,
                names=tuple(
                    every["inputs", name.j, kinds[name.order]] if isinstance(name, Driven) else name
                    for name in axis.names
                ),
            )
            for axis in axes
        ]
        varied = Grid(tuple(axes)) if axes else None
        if varied is None or varied.n > 1:
            return replace(self, varied=varied, moved=None)
        with naming(self.request.file):
            row = varied.part(0, 1).shown[0].tolist()
            numbers = [name.of for name in varied.names if isinstance(name, Varied)]
            m = with_numbers(self.mechanism, numbers, row)
        return replace(self, mechanism=m, varied=None, moved=None)

    def result(self, kind: type[Study], **more: Any) -> Result:
        """What a study makes of all cases, in the forms that are requested."""
        names = () if self.varied is None else self.varied.names
        study = kind(
            self.request,
            self.mechanism,
            self.bare,
            self.show.digits,
            self.show.as_json,
            names,
            self.moved,
            **more,
        )
        with naming(self.request.file):
            study.own.check_names()
            loop = Loop(study, self.varied, self.workers)
            self.remarks += study.warnings()
            if self.page is not None:
                from cli.show.picture import refuse_long

                refuse_long(study.frames * loop.count)
            result = self._alone(study, loop) if self.varied is None else self._of_variants(loop)
        if self.page is not None:
            beside = {self.page: lambda: study.page(loop.every_case(), self.show.units)}
            result = replace(result, beside={**result.beside, **beside})
        if self.found is not None:
            result = with_found(result, self.found)
        title = {"title": self.mechanism.name or "Mechanism"}
        if self.show.steps:
            result = replace(result, way=lambda: self._way(loop))
        return replace(result, about=title | self.about, within=partial(naming, self.request.file))

    def _way(self, loop: Loop) -> list[Topic]:
        """The worked solution of every mechanism; of variants each topic says which."""
        result = []
        for name, case in loop.every_case():
            for topic in case.way():
                if name:
                    title = f"Variant {name}: {topic.heading}"
                    topic = replace(topic, head={"variant": name, **topic.head}, title=title)
                result.append(topic)
        return result

    def _alone(self, study: Study, loop: Loop) -> Result:
        """The mechanism itself: as one table, written part by part, or in every form."""
        if study.in_blocks(self.show):
            return Result(
                blocks=loop.blocks,
                beside=study.beside_table(),
                warnings=self.remarks,
                late_warnings=loop.warnings,
                failed=loop.failed,
            )
        study.check_size(self.show, 1)
        case = study.case()
        result = study.result(case)
        return replace(result, warnings=[*self.remarks, *result.warnings])

    def _of_variants(self, loop: Loop) -> Result:
        """All variants: as one table or document, written part by part, or in the forms that are requested, at once."""
        name, show = self.mechanism.name, self.show
        result = Result(
            document=lambda: {"name": name},
            warnings=self.remarks,
            failed=loop.failed,
            method=loop.study.method,
        )
        if show.streams or show.streams_json:
            return replace(
                result,
                blocks=partial(loop.blocks, json=show.streams_json),
                blocks_name="variants",
                shared=self.workers > 1,
                late_warnings=loop.warnings,
            )
        loop.study.check_size(show, loop.count)
        # what there is to remark on stands in the document too
        _ = (show.as_json and loop.documents), (show.needs_table and loop.table)
        return replace(
            result,
            document=lambda: {"name": name, "variants": loop.documents},
            tables={"variants": lambda: loop.table},
            notes=lambda: name,
            warnings=[*self.remarks, *loop.remarks.lines()],
        )
