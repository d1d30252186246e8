"""The tolerance of rotors as a table: a row for each plane."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cli.read.tolerance import Verdict
from dalembert.results.columns import Table, names, number


def verdict_table(rows: Sequence[tuple[str, Verdict]], unit: str) -> Table:
    """Return for each rotor and plane what is permissible, what the unbalance was and is, and whether that is within it."""
    share, before, after = (np.array([v[k] for _, v in rows], dtype=float) for k in (1, 2, 3))

    def within(sizes: np.typing.NDArray[np.float64]) -> list[bool | None]:
        return [
            None if size != size else size <= limit
            for size, limit in zip(sizes.tolist(), share.tolist(), strict=True)
        ]

    columns = [
        names("rotor", [name for name, _ in rows]),
        names("plane", [v.plane for _, v in rows]),
        number("permissible", "unbalance", share, unit),
        number("initial", "unbalance", before, unit),
        number("residual", "unbalance", after, unit),
        names("verdict", [v.of(v.residual) for _, v in rows], place=None),
    ]
    documented = [names("within", within(before)), names("residual_within", within(after))]
    return Table(columns, ("rotor", "plane"), "rotors[].tolerance.planes[]", documented=documented)
