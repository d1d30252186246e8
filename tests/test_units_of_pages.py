"""Numbers typed in pages: the units of files and options, to the same bits."""

from __future__ import annotations

import math
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest

from dalembert.page import sheet, spelled
from dalembert.quantities import number_in_si
from dalembert.units import ABBREVIATIONS, LISTED, WORDS, composed, written
from tests.computed_pages import script_and_data
from tests.node import needs_node, run_script

pytestmark = needs_node
PI = math.pi
DIMENSIONS = [d for d in LISTED if d not in ("number", "amplitude", "per")]


def typed(folder: Path, entries: Sequence[tuple[str, ...]]) -> list[Any]:
    """What a page reads from (text, unit shown) or (text, unit shown, unit of the answer)."""
    _, data = script_and_data(sheet("", "balance", "", {}).html)
    entry = (files("dalembert.page") / "entry.js").read_text(encoding="utf-8")
    reading = entry[: entry.index("// a field for a number")]
    script = f"const data = given.data;\n{reading}\nanswer(given.entries.map((entry) => typed(...entry)));"
    return list(run_script(script, folder, {"data": data, "entries": entries}))


def test_a_unit_in_full(tmp_path: Path) -> None:
    entries = [
        ("4 inches", "mm"),
        ("4 Inch", "mm"),
        ("90 degrees", "deg"),
        ("2 pounds", "kg"),
        ("0,12 km", "mm"),
        ("12 MM", "mm"),
        ("3 Nm", "N m"),
        ("0.5 N/mm", "N/m"),
        ("30 gmm", "g mm"),
        ("3 oz-in", "oz in"),
        ("30º", "deg"),
        ("7.85 g/cm³", "kg/m3"),
        ("−30 °", "deg"),
        ("700 1/min", "rad/s"),
        ("2", "deg"),
        ("5", ""),
    ]
    right = [
        0.1016,
        0.1016,
        PI / 2,
        0.90718474,
        120,
        0.012,
        3,
        500,
        3e-5,
        3 * 0.028349523125 * 0.0254,
        PI / 6,
        7850,
        -PI / 6,
        70 * PI / 3,
        PI / 90,
        5,
    ]
    assert typed(tmp_path, entries) == pytest.approx(right, rel=4e-16)


def test_what_measures_something_else_is_no_number(tmp_path: Path) -> None:
    """4 N m is no stiffness of a spring, which is N/m; rad counts in a speed."""
    entries = [
        ("4 N m", "N/m"),
        ("3 kg", "mm"),
        ("2 mm", "deg"),
        ("1 furlong", "mm"),
        ("3 /s", "rad/s"),
        ("4 constructor", "mm"),
    ]
    assert typed(tmp_path, entries) == ["NaN"] * len(entries)


def test_an_amplitude_comes_in_the_units_of_the_file(tmp_path: Path) -> None:
    """1 mil is 25.4 µm; peak to peak is no r.m.s.; a volt or a count is what the instrument shows."""
    entries = [
        ("3 mil", "um", "um"),
        ("76.2 µm", "um", "um"),
        ("0.1", "um", "um"),
        ("2 in/s rms", "mm/s rms", "mm/s rms"),
        ("2 mm/s", "mm/s rms", "mm/s rms"),
        ("2 mm/s pp", "mm/s rms", "mm/s rms"),
        ("7 mV", "V", "V"),
        ("12", "counts", "counts"),
        ("3 mil peak to peak", "µm pk-pk", "µm pk-pk"),
        ("2 in/s RMS", "mm/s r.m.s.", "mm/s r.m.s."),
        ("2 mm/s 0-pk", "mm/s pk-pk", "mm/s pk-pk"),
    ]
    right = [76.2, 76.2, 0.1, 50.8, "NaN", "NaN", 0.007, 12, 76.2, 50.8, "NaN"]
    assert typed(tmp_path, entries) == right
    # every unit as a page writes it
    units = [spelled(unit) for unit in LISTED["amplitude"]]
    assert typed(tmp_path, [(f"3 {unit}", unit, unit) for unit in units]) == [3] * len(units)


def test_the_units_of_files_to_the_same_bits(tmp_path: Path) -> None:
    """Every listed unit, every word alone and in full, and words that are joined; with decimals that are rounded."""
    spellings = {
        d: [unit.replace("_per_", "/") for unit in LISTED[d]] + list(map(written, LISTED[d]))
        for d in DIMENSIONS
    }
    texts = [
        *WORDS,
        *ABBREVIATIONS,
        "Nm",
        "kNm",
        "gmm",
        "lbfin",
        "N s/m",
        "kN mm/deg",
        "lbf/in",
        "lbf s/in",
        "slug ft2",
        "g/cm^3",
        "m·s⁻¹",
        "rads s⁻²",
        "RPM",
        "Kg",
        "kgfm",
    ]
    for d in DIMENSIONS:
        spellings[d] += [text for text in texts if number_in_si(f"1 {text}", d) is not None]
    entries, wanted = [], []
    for d, units in spellings.items():
        for unit in units:
            # a header's `kg_m3` and `1` are for columns
            if composed(unit) is None or unit == "1" or number_in_si(f"1 {unit}", d) is None:
                continue
            for number in ("0.3", "7.41e-3", "-12345.678", "1e23"):
                entries.append((f"{number} {unit}", spelled(LISTED[d][0])))
                wanted.append(number_in_si(f"{number} {unit}", d))
    assert len(entries) > 600
    assert list(map(float, typed(tmp_path, entries))) == wanted
