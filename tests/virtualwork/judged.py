"""How errors are judged beside their estimates."""

from __future__ import annotations

import numpy as np


def judge(pairs: list[tuple[float, float]], slack: float = 2) -> None:
    assert pairs
    assert all(error <= bound for error, bound in pairs), max(e / b for e, b in pairs if b)
    over = [bound / error for error, bound in pairs if error > 0]
    assert np.median(over) <= slack
