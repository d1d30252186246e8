"""`dalembert spin --find`: the ω, the moment or the tilt with which a quantity of the rotation has a value."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from math import atan2, cos, degrees, hypot, radians, sin

import numpy as np

from cli.read import root_search
from cli.read.options import bad
from cli.spin.rotation import Rotation, TurningBody
from cli.spin.tables import constants, states
from dalembert.errors import DataError
from dalembert.hints import nearest
from rigidbody3d import check

Change = Callable[[float], TurningBody]


def find(rotation: Rotation, name: str, wanted: str) -> tuple[Rotation, root_search.Found]:
    """Return the rotation with the number nearest to its own with which the quantity has the value.

    Raises
    ------
    typer.BadParameter
        A name or a value that means nothing.
    DataError
        No number in reach gives the value.
    """
    if len(rotation.time) > 1:
        raise bad("--find", "expected one instant, such as --at 2")
    choices = _choices(rotation.body)
    sought = root_search.named({key: number for key, (number, _) in choices.items()}, name)
    change = choices[name][1]
    word, text = root_search.quantity_and_value(wanted, "slow=0.5rad_s")
    quantities = _quantities(rotation)
    if word not in quantities:
        expected = f"expected one of {', '.join(quantities)}{nearest(word, quantities)}"
        raise bad("--so-that", f"'{word}': {expected}")
    unit = quantities[word][1]
    goal = root_search.Goal(word, unit, root_search.value_in(unit, text))

    def value(x: float) -> float | None:
        try:
            body = change(x)
            if not check(body.inertia).valid:
                return None
            return _quantities(replace(rotation, body=body))[word][0]
        except (DataError, ValueError, KeyError):
            return None

    root = root_search.search(name, sought, goal, value)
    return replace(rotation, body=change(root)), root_search.sentence(name, sought, root, goal)


def _quantities(r: Rotation) -> dict[str, tuple[float, str]]:
    """Every number of the result by its name, such as omega.x, and its unit."""
    kept = [column for column in constants(r).columns if not column.name.startswith("drift")]
    columns = [*states(r).columns[1:], *kept]
    return {re.sub(r"_([wxyz])$", r".\1", c.name): (float(c.values[0]), c.unit) for c in columns}  # type: ignore[arg-type]


def _choices(body: TurningBody) -> dict[str, tuple[root_search.Sought, Change]]:
    """The numbers of the file."""
    choices: dict[str, tuple[root_search.Sought, Change]] = {}

    def entry(x: float, key: str, i: int) -> TurningBody:
        vector = np.array(getattr(body, key))
        vector[i] = x
        return replace(body, **{key: vector})  # type: ignore[arg-type]

    vectors = [("omega", "rad_s", "xyz")]
    if body.inertia.ndim == 1:
        vectors.append(("inertia", "kg_m2", "123"))
    if body.torque is not None:
        vectors.append(("torque", "N_m", "xyz"))
    for key, unit, names in vectors:
        for i, letter in enumerate(names):
            number = root_search.Sought(f"{key}.{letter}_{unit}", unit, float(getattr(body, key)[i]))
            choices[f"{key}.{letter}"] = number, partial(entry, key=key, i=i)
    if body.mgl is not None:
        choices["top.mgl"] = (
            root_search.Sought("top.mgl_N_m", "N_m", body.mgl),
            lambda x: replace(body, mgl=x),
        )
        w, x, y, z = body.attitude.tolist()
        if z == 0:
            # the axis leans by a turn about a horizontal line
            lean = degrees(2 * atan2(hypot(x, y), w))
            across = (x / hypot(x, y), y / hypot(x, y)) if x or y else (1.0, 0.0)

            def leaning(tilt: float) -> TurningBody:
                half = radians(tilt) / 2
                return replace(body, attitude=np.array([cos(half), *(sin(half) * a for a in across), 0.0]))

            choices["tilt"] = root_search.Sought("tilt_deg", "deg", lean), leaning
    return choices
