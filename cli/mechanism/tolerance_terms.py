"""The worked solution of tolerances: the terms of every dimension at one pose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from dalembert.results.columns import Table, finite, names
from dalembert.results.way import Topic

if TYPE_CHECKING:
    from cli.cases.analysis import Analysis
    from virtualwork.describe.dimensions import Dimension
    from virtualwork.family.tolerance import Spread
    from virtualwork.formulas.quantity import Quantity
    from virtualwork.quantities import Component


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
