"""FreeCAD sketches: lines as links, written as FreeCAD 0.15 to 1.0 lay them out."""

from __future__ import annotations

import io
import tomllib
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import Dalembert

HEAD = '<?xml version="1.0" encoding="utf-8"?>\n<Document SchemaVersion="4" ProgramVersion="0.21"><Objects Count="1">'
LINE = '<Geometry type="Part::GeomLineSegment"><Construction value="{c}"/><LineSegment StartX="{}" StartY="{}" StartZ="0" EndX="{}" EndY="{}" EndZ="0"/></Geometry>'
HELD = '<Constrain Name="" Type="{}" Value="0" First="{}" FirstPos="{}" Second="{}" SecondPos="{}" Third="-2000" ThirdPos="0"/>'
NONE = (-2000, 0)


def document(
    lines: Sequence[tuple[Any, ...]], held: Sequence[tuple[Any, ...]], more: str = "", construction: int = 0
) -> bytes:
    """A document with one sketch."""
    geometry = "".join(LINE.format(*line, c=construction) for line in lines)
    constraints = "".join(HELD.format(*each) for each in held)
    text = (
        f'{HEAD}<Object type="Sketcher::SketchObject" name="Sketch"/></Objects><ObjectData Count="1"><Object name="Sketch">'
        f'<Properties Count="3"><Property name="Constraints"><ConstraintList count="{len(held)}">{constraints}</ConstraintList>'
        f'</Property><Property name="Geometry"><GeometryList count="{len(lines)}">{geometry}{more}</GeometryList></Property>'
        f'<Property name="ExternalGeo"><GeometryList count="1">{LINE.format(0, 0, 1, 0, c=0)}</GeometryList></Property>'
        "</Properties></Object></ObjectData></Document>"
    )
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        archive.writestr("Document.xml", text)
        archive.writestr("GuiDocument.xml", "<x/>")
    return out.getvalue()


FOUR_BAR = [(0, 0, 20, 30), (20, 30, 90, 60), (90, 60, 100, 0)]
PINS = [
    (1, 0, 2, 1, 1),
    (1, 1, 2, 2, 1),
    (1, -1, 1, 0, 1),
    (7, 2, 2, *NONE),
    (8, 2, 2, *NONE),
    (6, 0, 0, *NONE),
]


def imported(dalembert: Dalembert, folder: Path, data: bytes) -> tuple[Any, str]:
    (folder / "a.FCStd").write_bytes(data)
    done = dalembert("import", "a.FCStd", "-o", "a.toml")
    assert done.returncode == 0, done.stderr
    return tomllib.loads((folder / "a.toml").read_text()), done.stderr


def test_a_four_bar(dalembert: Dalembert, tmp_path: Path) -> None:
    """Three lines between the origin and a point at a given distance from it; it turns, and stands as it was drawn."""
    made, notes = imported(dalembert, tmp_path, document(FOUR_BAR, PINS))
    assert set(made["links"]) == {"line1", "line2", "line3"}
    assert made["units"]["length"] == "mm"
    assert sorted(made["ground"].values()) == [[0, 0], [100, 0]]
    assert made["input"]["link"] == "line1"
    assert "names no input: line1" in notes
    done = dalembert("mechanism", "a.toml", "--at", "0", "--units", "mm")
    header, row = (line.split(",") for line in done.stdout.splitlines()[:2])
    places = dict(zip(header, row, strict=True))
    at = {
        (round(float(places[f"P{k}_x_mm"]), 9), round(float(places[f"P{k}_y_mm"]), 9)) for k in (1, 2, 3, 4)
    }
    assert at == {(0, 0), (20, 30), (90, 60), (100, 0)}


def test_a_blocked_line_is_ground_and_a_triangle_one_link(dalembert: Dalembert, tmp_path: Path) -> None:
    """A coupler of three lines; the base is a blocked line."""
    lines = [
        (0, 0, 100, 0),
        (0, 0, 20, 30),
        (20, 30, 90, 60),
        (90, 60, 60, 90),
        (60, 90, 20, 30),
        (90, 60, 100, 0),
    ]
    pins = [
        (17, 0, 0, *NONE),
        (1, 0, 1, 1, 1),
        (1, 1, 2, 2, 1),
        (1, 2, 2, 3, 1),
        (1, 3, 2, 4, 1),
        (1, 4, 2, 2, 1),
        (1, 2, 2, 5, 1),
        (1, 5, 2, 0, 2),
    ]
    made, _ = imported(dalembert, tmp_path, document(lines, pins))
    assert {name: len(link["points"]) for name, link in made["links"].items()} == {
        "line2": 2,
        "line3": 3,
        "line6": 2,
    }


def test_a_slider_and_lines_at_an_angle(dalembert: Dalembert, tmp_path: Path) -> None:
    """A point on the x-axis slides; a line at a given angle to the rod belongs to it; what is no line is named."""
    lines = [(0, 0, 10, 20), (10, 20, 80, 0), (80, 0, 90, 15)]
    pins = [(1, 0, 1, -1, 1), (1, 0, 2, 1, 1), (13, 1, 2, -1, 0), (1, 1, 2, 2, 1), (9, 1, 2, 2, 1)]
    circle = '<Geometry type="Part::GeomCircle"><Construction value="0"/><Circle CenterX="0" Radius="5"/></Geometry>'
    made, notes = imported(dalembert, tmp_path, document(lines, pins, circle))
    assert set(made["links"]) == {"line1", "line2"}
    assert len(made["links"]["line2"]["points"]) == 3
    (slot,) = made["slots"]
    assert slot["link"] == "line2"
    assert "circle 4: left out" in notes
    swept = dalembert("mechanism", "a.toml", "--over", "0:360:30", "--only", "P3.y")
    assert max(abs(float(line.split(",")[-1])) for line in swept.stdout.splitlines()[1:]) < 1e-12


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (document([], []), "no sketch with lines"),
        (document(FOUR_BAR, PINS, construction=1), "no sketch with lines"),
        (document(FOUR_BAR, PINS)[:300], "no zip of FreeCAD"),
        (document([(0, 0, "x", 1)], []), "expected a finite number"),
        (document([(0, 0, 5, 1)], [(1, "a", 0, 0, 0)]), "expected a finite number"),
    ],
)
def test_bad_files_are_one_line(dalembert: Dalembert, tmp_path: Path, data: bytes, said: str) -> None:
    (tmp_path / "a.FCStd").write_bytes(data)
    done = dalembert("import", "a.FCStd", "--from", "freecad")
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (1, "", 1)
    assert said in done.stderr
