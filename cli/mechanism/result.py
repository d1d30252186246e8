"""One mechanism's result: poses, forces and studies as tables, JSON, words and pictures."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING

from cli.errors import DataError
from cli.mechanism import columns, remarks, words
from cli.mechanism.solve import Analysis
from cli.mechanism.states import table as link_states
from cli.mechanism.studies import Studies
from cli.mechanism.studies import tables as study_tables
from cli.show.columns import Result, Sheet

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cli.mechanism.options import Options
    from cli.show.columns import Document, Table


def result_of(
    analysis: Analysis, asked: Options, about: dict[str, str] | None = None, digits: bool = False
) -> Result:
    """What is asked of a mechanism, in every form it can be shown in."""
    studies = Studies(analysis, asked)
    found = studies.document
    if asked.graph:
        from cli.mechanism import picture

        # a bad name is an error before anything is written
        picture.check_names(analysis, asked.graph)

    def of_poses() -> Table:
        return columns.table(analysis, asked.forces)

    def document() -> Document:
        poses = columns.document(analysis, asked.forces)
        return {"name": analysis.mechanism.name, "poses": poses, **found}

    def figure() -> Figure:
        from cli.mechanism import picture

        several = len(analysis.inputs.shown) > 2 and analysis.motions[0].assembled.any()
        if asked.graph:
            return picture.draw_curves(analysis, asked.graph)
        return picture.draw_forces(analysis) if asked.forces and several else picture.draw(analysis)

    def beside() -> Iterable[bytes]:
        # every link, whatever --only names
        every = replace(analysis, only=None)
        every.motions = analysis.motions
        return csv_parts([link_states(every)], digits)

    own = study_tables(studies)
    # the table of a study asked for alone stands in place of the poses
    alone = bool(own) and len(asked.tables) == 1
    tables = {**own, "poses": of_poses} if alone else {"poses": of_poses, **own}
    return Result(
        document=document,
        tables=tables,
        screen=of_poses if alone else None,
        expected=(lambda: columns.table(analysis, forces=False), lambda: link_states(analysis)),
        notes=lambda: analysis.mechanism.name,
        afterword=lambda: words.afterword(studies),
        figure=figure,
        method=words.METHOD,
        sheets=lambda: [Sheet("", words.sections(studies, tables), figure)],
        about={"title": analysis.mechanism.name or "Mechanism"} | (about or {}),
        beside={} if asked.states is None else {asked.states: beside},
        warnings=remarks.warnings(studies),
        failed=lambda: not any(analysis.assembled(motion).any() for motion in analysis.motions),
        within=lambda: told(analysis.file),
    )


@contextmanager
def told(file: str) -> Iterator[None]:
    """Name the file in what is wrong with a mechanism."""
    from virtualwork import MechanismError

    try:
        yield
    except MechanismError as error:
        raise DataError(f"{error}" if str(error).startswith(file) else f"{file}: {error}") from None


def csv_parts(tables: Iterable[Table], digits: bool) -> Iterator[bytes]:
    """Tables that are one, as CSV; only the digits that hold, if wanted."""
    from cli.show.digits import digits_that_hold
    from cli.show.text import csv_text

    for i, whole in enumerate(tables):
        table = digits_that_hold(whole)[0] if digits else whole
        yield csv_text(table.cells, header=i == 0).encode()
