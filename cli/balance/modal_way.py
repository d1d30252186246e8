"""The worked solution of `dalembert balance --modes`: modal sums of the unbalances, the shapes at the planes, the system, its check."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cli.balance.equations import Scale, labels, plane_topic
from cli.balance.rotors import Balancing
from dalembert.results.columns import Table, names, number
from dalembert.results.way import Topic, figures
from dalembert.units import from_si

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from balancing import ModalCorrection
    from balancing.polygons import Polygon

SHOWN = 6
"""So many terms of a sum are written."""


def of_rotor(b: Balancing, rotor: int, rows: list[int], fix: ModalCorrection, i: int) -> list[Topic]:
    """The topics of a rotor."""
    scale = Scale(b)
    shapes = b.request.modes
    assert shapes is not None
    mine = np.flatnonzero(b.rotors.rotor == rotor)
    u, phi = b.rotors.moment[mine], _at_masses(b, rotor)
    made, at_planes = b.ideal[rows], fix.at_planes[i]
    planes = [b.planes.name[b.plane_of_row[row]] for row in rows]
    conditions, unit = shapes.conditions, b.rotors.unbalance_unit
    signs = [_sign(name) for name in conditions]
    sums = fix.modal[i]
    columns = [names("name", labels(b, mine)), number("unbalance_x", "unbalance", u.real, unit)]
    columns.append(number("unbalance_y", "unbalance", u.imag, unit))
    columns += [
        number(f"phi {name}", "number", row, place=f"phi.{name}")
        for name, row in zip(conditions, phi, strict=True)
    ]
    total = Table(
        [
            names("condition", conditions),
            number("x", "unbalance", sums.real, unit),
            number("y", "unbalance", sums.imag, unit),
        ],
        ("condition",),
        "sums[]",
    )
    text = [
        "What the unbalances do to each mode, s_k = Σ U_i·φ_k(z_i), φ by cubic splines through the stations (Bishop and Gladwell):"
    ]
    if shapes.rigid:
        text.append(
            "force: φ = 1; couple: φ = (z − middle)/length of the shaft (N + 2 planes, Kellenberger)."
        )
    for sign, row, s in zip(signs, phi, sums, strict=True):
        for axis, component in (("x", u.real), ("y", u.imag)):
            value = float(s.real if axis == "x" else s.imag)
            text.append(
                f"  {sign}_{axis} = {_products(scale, component, row)} = {scale.of(value)} {scale.name}"
            )
    topics = [
        Topic(
            "modal sums", [*text, Table(columns, ("name",), "rows[]"), total], "Modal sums of the unbalances"
        )
    ]
    topics.append(_system(conditions, signs, planes, at_planes, sums, scale))
    for row, name, value in zip(rows, planes, made, strict=True):
        lines = [
            f"  {axis} = {scale.of(part)} {scale.name}"
            for axis, part in (("x", value.real), ("y", value.imag))
        ]
        topics.append(plane_topic(b, row, name, complex(value), ["From the system:", *lines], scale))
    topics.append(_check(conditions, signs, planes, at_planes, sums, made, scale, unit))
    topics[-1].figure = partial(_figure, b, rotor)
    return topics


def _system(
    conditions: list[str], signs: list[str], planes: list[str], at_planes: Any, sums: Any, scale: Scale,
) -> Topic:  # fmt: skip
    """The system Σ_p φ_k(z_p)·w_p = −s_k."""
    text = ["The corrections w_p leave no mode excited: Σ_p φ_k(z_p)·w_p = −s_k for x and for y:"]
    for sign, row, s in zip(signs, at_planes, sums, strict=True):
        left = " + ".join(f"({figures(float(f))})·{name}" for f, name in zip(row, planes, strict=True))
        text.append(
            f"  {sign}: {left} = {scale.of(-float(s.real))} (x), {scale.of(-float(s.imag))} (y) {scale.name}"
        )
    if len(planes) > len(conditions):
        text.append(
            f"{len(planes)} planes for {len(conditions)} conditions: of all solutions that of least Σ|w_p|² (singular values)."
        )
    shown = [names("condition", conditions)]
    shown += [
        number(f"phi at {name}", "number", at_planes[:, p], place=f"at_planes.{p}")
        for p, name in enumerate(planes)
    ]
    return Topic("system", [*text, Table(shown, ("condition",), "rows[]")], "The system")


def _check(
    conditions: list[str], signs: list[str], planes: list[str], at_planes: Any, sums: Any,
    made: Any, scale: Scale, unit: str,
) -> Topic:  # fmt: skip
    """The modal sums with the corrections vanish."""
    text = ["With the corrections s_k + Σ_p φ_k(z_p)·w_p, each component:"]
    left = []
    for sign, row, s in zip(signs, at_planes, sums, strict=True):
        rest = complex(s + row @ made)
        size = abs(s) + float(np.abs(row) @ np.abs(made))
        rest = rest if abs(rest) > 1e-12 * size else 0j
        left.append(rest)
        for axis, of in (("x", np.real), ("y", np.imag)):
            products = _products(scale, of(made), row)
            text.append(
                f"  {sign}_{axis}: {scale.of(float(of(s)))} + {products} = {scale.of(float(of(rest)))} {scale.name}"
            )
    table = Table(
        [],
        (),
        "residual[]",
        documented=[
            names("condition", conditions),
            number("x", "unbalance", [z.real for z in left], unit),
            number("y", "unbalance", [z.imag for z in left], unit),
        ],
    )
    return Topic("check", [*text, table], "Check: the modal sums with the corrections")


def _products(scale: Scale, values: Any, row: Any) -> str:
    terms = [
        f"({scale.of(float(value))})·({figures(float(f))})"
        for value, f in list(zip(values, row, strict=True))[:SHOWN]
    ]
    return " + ".join(terms) + (" + …" if len(values) > SHOWN else "")


def _sign(condition: str) -> str:
    """The letter of a condition's sum: s_1 of mode 1."""
    return {"force": "F", "couple": "M"}.get(condition, f"s_{condition.removeprefix('mode ')}")


def _at_masses(b: Balancing, rotor: int) -> Any:
    """The conditions' rows at the masses, (q, m)."""
    assert b.request.modes is not None
    assert b.rotors.z is not None
    return b.request.modes.at(b.rotors.z[b.rotors.rotor == rotor], "a mass")


def shares(b: Balancing, rotor: int) -> Any:
    """Return what each unbalance alone asks of the planes, with its sign turned, (m, p)."""
    from balancing import modal_corrections

    group, _, fix = next(each for each in b.modal if rotor in each[0])
    i = int(np.flatnonzero(group == rotor)[0])
    moment = np.diag(b.rotors.moment[b.rotors.rotor == rotor])
    return -modal_corrections(moment, _at_masses(b, rotor), fix.at_planes[i]).unbalance


def polygons(b: Balancing, rotor: int) -> list[Polygon]:
    """Return the closed polygon of each condition: unbalances and corrections, each times its φ."""
    from balancing.polygons import Polygon

    assert b.request.modes is not None
    unit = b.rotors.unbalance_unit
    moment = b.rotors.moment[b.rotors.rotor == rotor]
    group, rows, fix = next(each for each in b.modal if rotor in each[0])
    i = int(np.flatnonzero(group == rotor)[0])
    planes = [b.planes.name[b.plane_of_row[row]] for row in rows[i]]
    made = b.ideal[rows[i]]
    return [
        Polygon(
            f"{name}: U·φ", labels(b, np.flatnonzero(b.rotors.rotor == rotor)), from_si(moment * masses, "unbalance", unit), planes,
            from_si(made * at, "unbalance", unit), unit,
        )
        for name, masses, at in zip(b.request.modes.conditions, _at_masses(b, rotor), fix.at_planes[i], strict=True)
    ]  # fmt: skip


def _figure(b: Balancing, rotor: int) -> Figure:
    from balancing.polygons import closed
    from cli.show.picture import blank

    figure = blank()
    closed(polygons(b, rotor), figure=figure)
    return figure
