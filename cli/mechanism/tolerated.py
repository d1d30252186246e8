"""A result of poses with what the tolerances do to it, in every form."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from cli.mechanism.tolerance import Tolerances
from cli.read import options

if TYPE_CHECKING:
    from cli.show.columns import Result


def with_tolerances(result: Result, found: Tolerances) -> Result:
    """A result of poses with what the tolerances do to it."""
    from cli.mechanism.tolerance_picture import draw

    before = result.document
    said = found.remarks()
    _, *others = result.tables.items()
    return replace(
        result,
        document=lambda: {**before(), "tolerance": found.document()},
        tables={"poses": found.table, **dict(others)},
        screen=None,
        afterword=found.words,
        figure=lambda: draw(found),
        warnings=[*result.warnings, *said],
    )


def checked(draws: int | None, tolerance: bool, others: Sequence[str]) -> None:
    """Refuse what does not go with it."""
    flag = "--tolerance" if tolerance else "--draws"
    if draws is not None and draws < 2:
        raise options.bad("--draws", f"{draws}: expected two or more drawn mechanisms")
    if others:
        raise options.bad(
            flag, f"expected poses or forces of one mechanism, and no {' or '.join(others)} beside it"
        )
