"""The worked solution of `dalembert engine`: coefficients of each order, the cylinders' shares, their sums."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from balancing.engine import piston_orders, reciprocating_forces
from dalembert.results.columns import Column, Table, names, number
from dalembert.results.way import Topic, figures

if TYPE_CHECKING:
    from cli.engine.cylinders import Engine

SHOWN = 1e-12
"""An order whose coefficient is below this share of the first is not listed."""


def way(e: Engine) -> list[Topic]:
    """The topics."""
    c, names_of = e.cylinders, e.cylinders.names
    ratios = (c.throw / c.rod).tolist()
    orders = np.array([piston_orders(ratio, e.highest) for ratio in ratios])
    used = [k for k in range(e.highest) if np.abs(orders[:, k]).max() > SHOWN]
    text: list[str | Table] = [
        "Piston: F = m·r·ω²·Σ A_k·cos k(θ + crank − bank) along its axis, A_1 = 1, A_2 = λ + λ³/4 + …, λ = r/l:"
    ]
    size = c.reciprocating * c.throw * e.speed**2
    text.append(
        Table(
            [
                names("cylinder", names_of),
                number("ratio", "number", np.array(ratios)),
                number("m_r_omega2", "force", size, place="size"),
                *(number(f"A{k + 1}", "number", orders[:, k]) for k in used),
            ],
            ("cylinder",),
            "cylinders[]",
        )
    )
    result = [Topic("orders", text, "Orders of each piston")]
    rows: list[tuple[Any, ...]] = []
    for i, name in enumerate(names_of):
        one = slice(i, i + 1)
        force = reciprocating_forces(
            c.crank[one],
            c.bank[one],
            c.z[one],
            c.throw[one],
            c.rod[one],
            c.reciprocating[one],
            e.speed,
            e.highest,
        )
        f = force.coefficients()
        rows += [(name, k + 1, *f[k].ravel().tolist()) for k in used]
    whole = e.reciprocating.coefficients()
    sums = [("sum", k + 1, *whole[k].ravel().tolist()) for k in used]
    heads = ("x_cos", "x_sin", "y_cos", "y_sin")
    every = [*rows, *sums]
    table = Table(
        [
            names("cylinder", [row[0] for row in every]),
            Column("order", "", [row[1] for row in every], place="order"),
            *(
                Column(head, "N", [row[2 + j] for row in every], place=f"{head}_N")
                for j, head in enumerate(heads)
            ),
        ],
        ("cylinder", "order"),
        "shares[]",
    )
    result.append(
        Topic("forces", ["Coefficients of cos kθ and sin kθ of each cylinder's force, and their sums:", table], "Shares and sums")
    )  # fmt: skip
    if e.rotating.any():
        u = complex(e.rotating.sum())
        result.append(
            Topic(
                "rotating",
                [f"Rotating masses: Σ m·r·e^(i·crank) = ({figures(u.real)}, {figures(u.imag)}) kg·m"],
                "Rotating masses",
                {"x_kg_m": u.real, "y_kg_m": u.imag},
            )
        )
    weights = e.counterweights
    if weights is not None:
        lines = [
            f"  {name}: ({figures(w.real)}, {figures(w.imag)}) kg·m at z = {figures(z)} m"
            for name, w, z in zip(weights.names, weights.unbalance.tolist(), weights.z.tolist(), strict=True)
        ]
        result.append(
            Topic(
                "counterweights",
                ["Against the rotating masses and the share of the reciprocating ones:", *lines],
            )
        )
    left = e.residual.coefficients()
    lines = [
        f"  order {k + 1}: {', '.join(f'{head} {figures(v)} N' for head, v in zip(heads, left[k].ravel().tolist(), strict=True))}"
        for k in used
    ]
    if e.balanced:
        result.append(
            Topic("residual", ["Residual forces with counterweights and balance shafts:", *lines], "Residual")
        )
    return result
