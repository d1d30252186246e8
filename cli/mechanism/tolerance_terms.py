"""The tolerances at one pose: its tables on a terminal, the largest shares, and the worked solution with the terms of every dimension."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from cli.cases.poses import of_rows
from dalembert.results.columns import Column, Table, finite, names
from dalembert.results.way import Topic

if TYPE_CHECKING:
    from cli.cases.analysis import Analysis
    from virtualwork.describe.dimensions import Dimension
    from virtualwork.family.tolerance import Spread
    from virtualwork.formulas.quantity import Quantity
    from virtualwork.quantities import Component


def by_quantity(table: Table, shown: Sequence[Component]) -> list[Table]:
    """Return the table of one pose as short tables: a row for each quantity that varies, one table for each unit.

    The first has what names the pose.
    """
    columns = {each.header: each for each in table.columns}
    units: dict[str, tuple[list[str], list[dict[str, Column]]]] = {}
    for quantity in shown:
        own = columns[quantity.header]
        effects = (c for c in table.columns if isinstance(c.place, tuple) and own.header in c.place)
        row = {f"value_{own.unit}": own} | {c.header.removeprefix(f"{own.name}_"): c for c in effects}
        titles, rows = units.setdefault(own.unit, ([], []))
        titles.append(quantity.names[0] if quantity.names else own.name)
        rows.append(row)
    made = [Table([each for each in table.columns if each.header in table.keys])]
    for titles, rows in units.values():
        numbers = (of_rows(head, rows) for head in rows[0])
        made.append(Table([Column("quantity", "", titles), *numbers], ["quantity"]))
    return made


def largest(linear: Mapping[str, Spread], limits: Mapping[Dimension, float]) -> Table:
    """Return the dimensions with the largest shares of each number, in the mean of the poses."""
    texts, paths = [], [d.path for d in limits]
    for effect in linear.values():
        finite = np.isfinite(effect.shares).any()
        mean = np.nanmean(effect.shares, axis=1) if finite else np.zeros(len(paths))
        order = np.argsort(-mean, kind="stable")[:3]
        texts.append(", ".join(f"{paths[i]} {mean[i] * 100:.3g} %" for i in order if mean[i] > 0))
    above = "shares of the variance, means over the poses"
    return Table(
        [names("column", linear, None), names("dimensions", texts, None)], ("column",), "", above=above
    )


def way(
    analysis: Analysis,
    shown: Sequence[Component],
    slopes_of: Mapping[Quantity, Sequence[Any]],
    linear: Mapping[str, Spread],
    limits: Mapping[Dimension, float],
) -> list[Topic]:
    """Return the one topic: the terms at the first pose that is assembled, and their sums (`linear`)."""
    whole = analysis.motions[0].assembled
    if not shown or not whole.any():
        return [
            Topic("terms", ["None of the numbers shown varies with [tolerances]."], "Terms", {"terms": []})
        ]
    i = int(np.argmax(whole))
    rows: list[tuple[str, str, float, float, float, float]] = []
    sums: list[tuple[str, float, float]] = []
    for each in shown:
        slopes = [float(np.broadcast_to(each.of(slope), len(whole))[i]) for slope in slopes_of[each.key]]
        effect = linear[each.header]
        for (d, limit), slope, share in zip(
            limits.items(), slopes, effect.shares[:, i].tolist(), strict=True
        ):
            rows.append((each.header, d.path, slope, limit, slope * limit, share))
        sums.append((each.header, float(effect.worst[i]), float(effect.sd[i])))
    columns = zip(*((*row[:2], *map(finite, row[2:])) for row in rows), strict=True)
    titles = ("column", "path", "slope", "limit", "term", "share")
    table = Table(
        [names(title, values) for title, values in zip(titles, columns, strict=True)],
        ("column", "path"),
        "terms[]",
    )
    of_all = zip(*((header, finite(worst), finite(sd)) for header, worst, sd in sums), strict=True)
    total = Table(
        [names(title, values) for title, values in zip(("column", "worst", "sd"), of_all, strict=True)],
        ("column",),
        "sums[]",
    )
    at = f"At {analysis.pose_text(i)}: " if len(whole) > 1 else ""
    text = (
        f"{at}Δq = Σ (∂q/∂d)·δd to first order, slopes exact: worst case Σ |∂q/∂d|·limit, "
        "standard deviation √Σ (∂q/∂d·limit/3)²; limits in SI, slopes in the column's unit per SI unit:"
    )
    return [Topic("terms", [text, table, "Sums:", total], "Terms of each dimension")]
