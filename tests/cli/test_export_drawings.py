"""Drawings and curves that `dalembert export` writes, read back: DXF by ezdxf, SVG as XML, CSV."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from tests.cli.exported import FILES, FOUR_BAR, exported
from tests.conftest import Dalembert
from virtualwork import Mechanism


def test_ezdxf_reads_the_drawing_in_the_unit_of_the_file(tmp_path: Path, dalembert: Dalembert) -> None:
    ezdxf = pytest.importorskip(
        "ezdxf", reason="DXF is written and read by ezdxf: pip install 'dalembert[cad]'"
    )
    (tmp_path / "m.toml").write_text(FOUR_BAR)
    done = dalembert("export", "m.toml", "-o", "m.dxf")
    assert (done.returncode, done.stderr, done.stdout) == (0, "", "")
    drawing = ezdxf.readfile(tmp_path / "m.dxf")
    assert not drawing.audit().has_errors
    assert drawing.header["$INSUNITS"] == 4
    space = drawing.modelspace()
    m = Mechanism.from_toml_text(FOUR_BAR)
    pins = sorted(
        (round(c.dxf.center.x, 9), round(c.dxf.center.y, 9)) for c in space.query("CIRCLE[layer=='JOINTS']")
    )
    stand = m.motion()
    assert pins == sorted(tuple(np.round(stand.point(p).position[0] * 1000, 9)) for p in "ABCD")
    (curve,) = space.query("LWPOLYLINE[layer=='CURVES']")
    assert curve.closed
    ours = m.motion(np.linspace(m.at[0], m.at[0] + 2 * math.pi, 721)[:-1]).point("P").position * 1000
    assert np.array(curve.get_points("xy")) == pytest.approx(ours, abs=1e-9)
    assert len(space.query("LWPOLYLINE[layer=='LINKS']")) == 3
    assert {t.dxf.text for t in space.query("TEXT")} >= {
        "A",
        "B",
        "C",
        "D",
        "P",
        "crank",
        "coupler",
        "rocker",
    }
    assert (tmp_path / "m.dxf").read_text().startswith("999\nFour-bar <A & B>, from m.toml by dalembert ")


def test_svg_is_in_true_size_with_a_group_for_each_layer(tmp_path: Path, dalembert: Dalembert) -> None:
    (tmp_path / "m.toml").write_text(FOUR_BAR)
    assert dalembert("export", "m.toml", "-o", "m.svg", "--at", "90").returncode == 0
    text = (tmp_path / "m.svg").read_text()
    root = ElementTree.fromstring(text)
    space = "{http://www.w3.org/2000/svg}"
    width = float((root.get("viewBox") or "").split()[2])
    assert float((root.get("width") or "")[:-2]) == pytest.approx(width, rel=1e-5)
    groups = {g.get("id"): g for g in root.findall(f"{space}g")}
    layers = "GROUND GUIDES LINKS GEARS SPRINGS MASSES CURVES JOINTS POINTS NAMES"
    assert list(groups) == layers.split()
    pins = {
        (float(c.get("cx") or 0), float(c.get("cy") or 0)) for c in groups["JOINTS"].findall(f"{space}circle")
    }
    assert any(math.dist(p, (0, -40)) < 1e-12 for p in pins)
    assert "crank = 90 deg" in text
    assert "Four-bar &lt;A &amp; B" not in text.partition("<svg")[0]


def test_curves_are_the_motion(tmp_path: Path, dalembert: Dalembert) -> None:
    (tmp_path / "m.toml").write_text(FOUR_BAR)
    assert dalembert("export", "m.toml", "-o", "m.csv").returncode == 0
    rows = list(csv.DictReader((tmp_path / "m.csv").read_text().splitlines()))
    assert list(rows[0]) == ["input_deg", "B_x_mm", "B_y_mm", "C_x_mm", "C_y_mm", "P_x_mm", "P_y_mm"]
    assert len(rows) == 721
    # degrees as people write them: 60 was 59.99999999999999
    start = float(rows[0]["input_deg"])
    assert [float(r["input_deg"]) for r in rows] == [start + k / 2 for k in range(721)]
    m = Mechanism.from_toml_text(FOUR_BAR)
    q = np.radians([float(r["input_deg"]) for r in rows])
    found = np.array([[float(r["P_x_mm"]), float(r["P_y_mm"])] for r in rows])
    assert found == pytest.approx(m.motion(q).point("P").position * 1000, abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".dxf", ".svg"])
@pytest.mark.parametrize("file", FILES, ids=lambda file: file.parent.name)
def test_every_example_is_drawn(file: Path, suffix: str) -> None:
    if suffix == ".dxf":
        pytest.importorskip("ezdxf", reason="pip install 'dalembert[cad]'")
    assert len(exported(Mechanism.from_toml(file), suffix)) > 1000
