"""One pose on a terminal: short tables with a row for each point, link and joint, by hand and against the row of CSV."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import pytest

from tests.conftest import Dalembert

# two equal links of 1 m: over a crank at 60 deg stands an equilateral triangle, and the rod points down at -60 deg
SLIDER_CRANK = """
[units]
angle = "deg"
[ground]
O = [0, 0]
[links.crank]
points = {{ O = [0, 0], A = [1, 0] }}
[links.rod]
points = {{ A = [0, 0], B = [1, 0] }}
[[slots]]
point = "B"
link = "rod"
on = "ground"
through = [0, 0]
angle = 0
[input]
link = "crank"
speed = "{speed} rad/s"
[guess]
at = {at}
rod = {rod}
"""


def tables(text: str) -> dict[str, dict[str, dict[str, str]]]:
    """Read short tables: by the header of their first column the rows, by the cell in it."""
    made: dict[str, dict[str, dict[str, str]]] = {}
    for block in text.strip().split("\n\n"):
        head, *rows = (line.split() for line in block.splitlines())
        if rows:
            made[head[0]] = {row[0]: dict(zip(head[1:], row[1:], strict=False)) for row in rows}
    return made


@pytest.mark.parametrize("side", [1, -1])
def test_one_pose_by_hand(dalembert: Dalembert, tmp_path: Path, side: int) -> None:
    (tmp_path / "m.toml").write_text(SLIDER_CRANK.format(speed=2 * side, at=60 * side, rod=-60 * side))
    done = dalembert("mechanism", "m.toml", "--at", f"{60 * side}deg", "--text")
    assert done.returncode == 0, done.stderr
    shown = tables(done.stdout)
    # x = 2 cos q, so vx = -2 sin(q) w and ax = -2 cos(q) w2
    piston = shown["point"]["B"]
    assert float(piston["x_m"]) == pytest.approx(1.0, rel=1e-5)
    assert float(piston["vx_m_s"]) == pytest.approx(-2 * 0.866025 * 2, rel=1e-5)
    assert float(shown["point"]["A"]["y_m"]) == pytest.approx(0.866025 * side, rel=1e-5)
    assert float(shown["link"]["rod"]["angle_deg"]) == pytest.approx(-60 * side % 360)
    assert float(shown["link"]["rod"]["omega_rad_s"]) == pytest.approx(-2 * side)
    assert set(shown["link"]) == {"crank", "rod"}


CALLS = [
    ("klann", "mechanism", "klann.toml", "60deg"),
    ("five-bar", "mechanism", "five-bar.toml", "left=100deg,right=80deg"),
    ("scissors-lift", "forces", "lift.toml", "0.5m"),
    ("inclined-slider-crank", "mechanism", "piston.toml", "40deg"),
]


@pytest.mark.parametrize(("example", "command", "file", "at"), CALLS)
def test_they_hold_every_number_of_the_row(
    dalembert: Dalembert, example: str, command: str, file: str, at: str
) -> None:
    assert dalembert("examples", example).returncode == 0
    call = (command, file, "--at", at)
    row = next(csv.DictReader(io.StringIO(dalembert(*call).stdout)))
    shown = tables(dalembert(*call, "--text").stdout)
    cells = {
        (owner, head): cell
        for kind in ("point", "link", "slide")
        for owner, line in shown.get(kind, {}).items()
        for head, cell in line.items()
    }
    in_row = {pair: float(row["_".join(pair)]) for pair in cells if row.get("_".join(pair))}
    assert len(in_row) >= len(
        [header for header in row if header.endswith(("_x_m", "_vx_m_s", "_omega_rad_s"))]
    )
    assert {pair: float(cells[pair]) for pair in in_row} == pytest.approx(in_row, rel=1e-5)
