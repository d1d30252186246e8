"""What a notebook shows of a motion: its head and its tail, and nothing else is solved."""

from __future__ import annotations

import numpy as np
import pytest

import virtualwork.motion_table
from tests.virtualwork.mechanisms import four_bar


@pytest.mark.parametrize("n", [50, 21, 1, 2, 19, 20, 22])
def test_head_and_tail_are_those_of_the_whole_table(n, monkeypatch):
    m, q = four_bar(), np.linspace(0.5, 9.0, n)
    expected = m.motion(q, 2.0, 1.0).to_frame().to_html(max_rows=20)
    asked = []
    columns = virtualwork.motion_table.columns
    monkeypatch.setattr(
        virtualwork.motion_table, "columns", lambda poses: asked.append(poses.n) or columns(poses)
    )
    assert m.motion(q, 2.0, 1.0)._repr_html_() == expected
    assert asked == [min(n, 21)]
