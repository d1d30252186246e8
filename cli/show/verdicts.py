"""What a report shows of the tolerance: a row for each plane."""

from __future__ import annotations

from collections.abc import Sequence

from cli.read.tolerance import Verdict
from cli.read.units import from_si
from cli.show.columns import Column


def verdict_columns(verdicts: Sequence[Verdict], unit: str) -> list[Column]:
    """Each plane's permissible unbalance, what it was and what it is after, and whether that is within it."""
    names = {"permissible": "permissible", "before": "initial", "after": "residual"}
    return [
        Column("plane", "", [verdict.plane for verdict in verdicts]),
        *(
            Column(name, unit, [from_si(getattr(verdict, of), "unbalance", unit) for verdict in verdicts])
            for name, of in names.items()
        ),
        Column("verdict", "", [verdict.of(verdict.residual) for verdict in verdicts]),
    ]
