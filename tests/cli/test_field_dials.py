"""The dial of places: for a log whose runs are all fitted together too."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.cli.measured import runs
from tests.conftest import Dalembert

ON = [[1, 0], [0, 1j], [2, 0], [0, 2j]]


@pytest.mark.parametrize("count", [4, pytest.param(2, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    "places",
    [
        ("--blades", "12"),
        pytest.param(("--positions", "0deg,30deg,270deg,300deg"), marks=pytest.mark.slow),
    ],
)
def test_every_plane_has_its_dial_of_places(
    places: tuple[str, ...], count: int, dalembert: Dalembert, tmp_path: Path
) -> None:
    """With as many runs as unknowns, and with more; the correction in B is 5 g at 300 degrees, on its place."""
    masses = ["A,1,0,", "B,1,90,", "A,2,0,", "B,2,90,"]
    text = runs(*masses[:count], on=np.array(ON[:count]))
    done = dalembert("field", "-", *places, "--report", "r.md", stdin=text)
    assert done.returncode == 0, done.stderr
    picture = (tmp_path / "r.svg").read_text()
    on_blade = 11 if places[0] == "--blades" else 4
    for words in ("plane A: correction to ADD, g", "plane B: correction to ADD, g", f"{on_blade}: 5 g"):
        assert f"<!-- {words} -->" in picture
