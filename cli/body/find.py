"""`dalembert body --find`: the ω, the dimension or the angle of a part with which a quantity of the body has a value."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from cli.body.moving import AXES, ORIGIN, MovingBody, Request
from cli.body.tables import numbers_of
from cli.read import root_search
from cli.read.options import bad
from cli.read.parts import bodies_of
from dalembert.errors import DataError
from dalembert.hints import nearest
from dalembert.tables.table import Table

Change = Callable[[float], tuple[Table, Request]]


def find(
    table: Table, path: str, request: Request, name: str, wanted: str
) -> tuple[MovingBody, root_search.Found]:
    """Return the body with the number nearest to its own with which the quantity has the value.

    Raises
    ------
    typer.BadParameter
        A name or a value that means nothing.
    DataError
        No number in reach gives the value.
    """

    def body(changed: Table, moved: Request) -> MovingBody:
        bodies = bodies_of(changed, path)
        if len(bodies) > 1:
            raise bad("--find", f"expected a table of one body, found {len(bodies)}")
        return MovingBody(bodies[0], moved)

    choices = {**_motions(table, request), **_cells(table, request)}
    sought = root_search.named({key: number for key, (number, _) in choices.items()}, name)
    change = choices[name][1]
    word, text = root_search.quantity_and_value(wanted, "bearing1_dynamic.x=20N")
    quantities = numbers_of(body(*change(sought.start)))
    if word not in quantities:
        each = dict.fromkeys(quantity.partition(".")[0] for quantity in quantities)
        expected = f"expected one of {', '.join(each)}, with .x, .y, .z or .size behind a vector"
        raise bad("--so-that", f"'{word}': {expected}{nearest(word, quantities)}")
    unit = quantities[word][1]
    goal = root_search.Goal(word, unit, root_search.value_in(unit, text), unit == "deg")

    def value(x: float) -> float | None:
        try:
            return numbers_of(body(*change(x)))[word][0]
        except (DataError, ValueError):
            return None

    root = root_search.search(name, sought, goal, value)
    return body(*change(root)), root_search.sentence(name, sought, root, goal)


def _motions(table: Table, request: Request) -> dict[str, tuple[root_search.Sought, Change]]:
    """The numbers of the motion: of a shaft its speed and rate, else components of ω, of its rate, of Ω."""
    choices: dict[str, tuple[root_search.Sought, Change]] = {}
    shaft = request.shaft
    if shaft is not None:
        for name, unit in (("speed", "rad_s"), ("speed_rate", "rad_s2")):

            def turned(x: float, name: str) -> tuple[Table, Request]:
                assert shaft is not None
                return table, replace(request, shaft=replace(shaft, **{name: x}))  # type: ignore[arg-type]

            number = root_search.Sought(f"{name}_{unit}", unit, getattr(shaft, name))
            choices[name] = number, partial(turned, name=name)
        return choices
    for name, unit in (("omega", "rad_s"), ("alpha", "rad_s2"), ("frame_omega", "rad_s")):
        vector = getattr(request, name)
        # axes that turn with the body and axes at rest are two motions
        if vector is None and name == "frame_omega":
            continue
        for i, axis in enumerate(AXES):

            def moved(x: float, name: str, i: int) -> tuple[Table, Request]:
                components = list(getattr(request, name) or ORIGIN)
                components[i] = x
                return table, replace(request, **{name: tuple(components)})  # type: ignore[arg-type]

            number = root_search.Sought(f"{name}.{axis}_{unit}", unit, (vector or ORIGIN)[i])
            choices[f"{name}.{axis}"] = number, partial(moved, name=name, i=i)
    return choices


def _cells(table: Table, request: Request) -> dict[str, tuple[root_search.Sought, Change]]:
    """The numbers of the parts, in the file's units."""
    choices: dict[str, tuple[root_search.Sought, Change]] = {}
    for row, part in enumerate(table.texts.get("part", [str(k + 1) for k in range(table.rows)])):
        for key, column in table.numbers.items():
            if np.isnan(column.values[row]):
                continue

            def changed(x: float, key: str, row: int) -> tuple[Table, Request]:
                own = table.numbers[key]
                values = own.values.copy()
                values[row] = x
                return replace(table, numbers={**table.numbers, key: replace(own, values=values)}), request

            header = f"{part}.{key}_{column.unit}".rstrip("_")
            number = root_search.Sought(header, column.unit, float(column.values[row]))
            choices[f"{part}.{key}"] = number, partial(changed, key=key, row=row)
    return choices
