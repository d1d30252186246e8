"""Results of an engine: orders, rotating part, counterweights, shafts, residuals."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from balancing.engine import Forces
from cli.engine.cylinders import Engine
from dalembert.angles import degrees
from dalembert.results.columns import Column, Table, names, number

if TYPE_CHECKING:
    from cli.engine.cylinders import Counterweights, Real

METHOD = (
    "Each piston's inertia force m·r·ω²·Σ A_k cos kφ with the exact orders A_k of the slider-crank; forces of an order are parts "
    "that turn with and against the crank. Counterweights are opposite to the rotating masses and a share of the reciprocating "
    "ones; shafts are opposite to the part that turns as they do. Couples are Σ z·F about z = 0 (after R. L. Norton, Design of "
    "Machinery, ch. 14; exact orders by the binomial series of the rod's inclination)."
)


def tables(e: Engine) -> dict[str, Callable[[], Table]]:
    """The tables of a result, the CSV's first."""
    result: dict[str, Callable[[], Table]] = {"orders": lambda: orders(e), "rotating": lambda: rotating(e)}
    result |= {"counterweights": lambda: counterweights(e), "shafts": lambda: shafts(e)}
    result["residual_orders"] = lambda: residual(e)
    weights = e.counterweights
    return result | (
        {"locomotive": lambda: locomotive(e, weights)}
        if weights is not None and e.cylinders.horizontal
        else {}
    )


def coefficients(e: Engine, forces: Forces) -> list[Column]:
    """The coefficients of cos kθ and sin kθ of the force and the couple."""
    columns = []
    for name, dimension, couple in (("force", "force", False), ("couple", "torque", True)):
        values = forces.coefficients(couple)
        for i, axis in enumerate("xy"):
            for j, part in enumerate(("cos", "sin")):
                column = number(
                    f"{name}_{axis}_{part}", dimension, values[:, i, j], error=_bound(forces, couple)
                )
                column.place = f"{name}_{column.unit}.{axis}.{j}"
                columns.append(column)
    return columns


def _bound(forces: Forces, couple: bool) -> Callable[[], Real]:
    return lambda: forces.rounding(couple)


def largest(forces: Forces, prefix: str = "", place: str | None = "") -> list[Column]:
    """The largest force and couple of each order over a turn."""
    return [
        number(
            f"{prefix}{name}_max",
            dimension,
            forces.largest(couple),
            error=_bound(forces, couple),
            place=place,
        )
        for name, dimension, couple in (("force", "force", False), ("couple", "torque", True))
    ]


def orders(e: Engine) -> Table:
    """A row for each order."""
    columns = [
        names("order", list(range(1, e.highest + 1))),
        *largest(e.reciprocating),
        *(largest(e.residual, "residual_", None) if e.balanced or e.rotating.any() else []),
        *coefficients(e, e.reciprocating),
    ]
    above = "forces on the frame and couples about z = 0 of the reciprocating masses, coefficients of cos kθ and sin kθ:"
    return Table(columns, ("order",), "orders[]", above)


def residual(e: Engine) -> Table:
    """The orders after counterweights and shafts, the rotating masses included."""
    columns = [
        names("order", list(range(1, e.highest + 1))),
        *largest(e.residual),
        *coefficients(e, e.residual),
    ]
    kept = "reciprocating and rotating masses" + ", counterweights" * (e.counterweights is not None)
    above = f"{kept} and shafts together:" if e.shafts else f"{kept} together:"
    return Table(columns, ("order",), "residual_orders[]", above)


def rotating(e: Engine) -> Table:
    """The unbalance of the rotating masses at θ = 0."""
    c = e.cylinders
    static, couple = (np.array([each.sum()]) for each in (e.rotating, e.rotating * c.z))
    bounds = [8e-16 * len(c.names) * np.abs(each).sum() for each in (e.rotating, e.rotating * c.z)]
    static, couple = (np.where(np.abs(v) > b, v, 0) for v, b in zip((static, couple), bounds, strict=True))
    return Table(
        [
            number("unbalance", "unbalance", np.abs(static), c.unbalance_unit),
            number("angle", "angle", degrees(static)),
            number("couple", "inertia", np.abs(couple)),
            number("couple_angle", "angle", degrees(couple)),
        ],
        place="rotating",
    )


def counterweights(e: Engine) -> Table:
    """A row for each; none where none are wanted."""
    weights = e.counterweights
    if weights is None:
        return Table([], place="counterweights[]", documented=[names("counterweight", [])])
    unbalance = np.abs(weights.unbalance)
    columns = [
        names("counterweight", weights.names),
        number("z", "length", weights.z, e.cylinders.length_unit),
        number("unbalance", "unbalance", unbalance, e.cylinders.unbalance_unit),
        number("angle", "angle", degrees(weights.unbalance)),
    ]
    if weights.radius is not None:
        mass = e.cylinders.table.numbers["reciprocating"].unit
        columns.append(number("mass", "mass", unbalance / weights.radius, mass))
    return Table(columns, ("counterweight",), "counterweights[]", "at θ = 0")


def shafts(e: Engine) -> Table:
    """A row for each."""
    shaft_unbalances = e.shaft_unbalances
    columns = [
        names("order", [s.order for s in e.shafts]),
        number("z", "length", [s.z for s in e.shafts], e.cylinders.length_unit),
        names("direction", ["against" if s.against else "with" for s in e.shafts]),
        number("unbalance", "unbalance", np.abs(shaft_unbalances), e.cylinders.unbalance_unit),
        number("angle", "angle", degrees(shaft_unbalances)),
    ]
    if not e.shafts:
        return Table([], place="shafts[]", documented=columns)
    return Table(columns, ("order", "z", "direction"), "shafts[]", "at θ = 0")


def locomotive(e: Engine, weights: Counterweights) -> Table:
    """What a driver of a locomotive and the track feel of the first order."""
    blow = float(np.abs(weights.for_reciprocating).max()) * e.speed**2
    x = [np.hypot(*e.residual.coefficients(couple)[0, 0]) for couple in (False, True)]
    return Table(
        [
            number("tractive_effort", "force", [x[0]]),
            number("swaying_couple", "torque", [x[1]]),
            number("hammer_blow", "force", [blow]),
        ],
        place="locomotive",
        above="variation of the tractive effort and swaying couple about z = 0 (±, first order), hammer blow of one wheel (±)",
    )


def warnings(e: Engine) -> list[str]:
    """What a reader of the orders has to know."""
    lines = [
        text
        for shaft, unbalance in zip(e.shafts, e.shaft_unbalances, strict=True)
        if (text := e.idle(shaft, unbalance))
    ]
    if not e.cylinders.reciprocating.any():
        lines.append("every reciprocating mass is zero: the orders are")
    if e.share and not e.cylinders.rotating.any() and "rotating" not in e.cylinders.table.numbers:
        lines.append("no column rotating_*: the counterweights are for the reciprocating masses alone")
    return lines
