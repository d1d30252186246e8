"""Parquet and workbooks, whole and block by block: every digit of the CSV."""

from __future__ import annotations

import csv
import gc
import itertools
import weakref
from collections.abc import Callable, Iterator
from pathlib import Path

import openpyxl
import pyarrow
import pyarrow.parquet
import pytest

from dalembert.results import files
from dalembert.results.columns import Column, Table
from tests.conftest import Dalembert
from virtualwork.formulas.positions import BLOCK

LONG = 2 * BLOCK + 5


def cells(path: Path) -> tuple[list[str], list[list[str | float | None]]]:
    """A CSV's header and rows; empty cells are None, numbers read."""

    def read(cell: str) -> str | float | None:
        try:
            return float(cell) if cell else None
        except ValueError:
            return cell

    with path.open() as stream:
        header, *rows = csv.reader(stream)
    return header, [[read(cell) for cell in row] for row in rows]


def of_parquet(path: Path) -> tuple[list[str], list[list[str | float | None]]]:
    table = pyarrow.parquet.read_table(path)
    return table.column_names, [list(row.values()) for row in table.to_pylist()]


def of_workbook(path: Path) -> tuple[list[str], list[list[str | float | None]]]:
    book = openpyxl.load_workbook(path, read_only=True)
    header, *rows = book.worksheets[0].iter_rows(values_only=True)
    book.close()
    return [str(name) for name in header], [list(row) for row in rows]


def same(found: list[list[str | float | None]], expected: list[list[str | float | None]]) -> bool:
    """Whether cells are equal, names as texts."""
    pairs = zip(itertools.chain(*found), itertools.chain(*expected), strict=True)
    return all(a == b or (isinstance(a, str) and not isinstance(b, str) and float(a) == b) for a, b in pairs)


@pytest.mark.parametrize(("suffix", "read"), [(".parquet", of_parquet), (".xlsx", of_workbook)])
def test_a_long_sweep_has_the_digits_of_its_csv(
    suffix: str, read: Callable[[Path], object], dalembert: Dalembert, tmp_path: Path
) -> None:
    dalembert("examples", "klann")
    call = ("mechanism", "klann.toml", "--over", f"0deg:360deg/{LONG}", "--only", "H")
    for name in ("h.csv", f"h{suffix}"):
        done = dalembert(*call, "-o", name)
        assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    header, expected = cells(tmp_path / "h.csv")
    names, found = read(tmp_path / f"h{suffix}")  # type: ignore[misc]
    assert names == header
    assert len(found) == LONG + 1
    assert same(found, expected)


def test_a_block_is_a_row_group(dalembert: Dalembert, tmp_path: Path) -> None:
    dalembert("examples", "klann")
    dalembert("mechanism", "klann.toml", "--over", f"0deg:360deg/{LONG}", "--only", "H", "-o", "h.parquet")
    file = pyarrow.parquet.ParquetFile(tmp_path / "h.parquet")
    assert [file.metadata.row_group(k).num_rows for k in range(file.num_row_groups)] == [BLOCK, BLOCK, 6]
    assert file.schema_arrow.field("H_x_m").type == pyarrow.float64()


@pytest.mark.parametrize("form", [files.parquet, lambda tables: files.workbook({"poses": tables})])
def test_no_block_is_held_once_it_is_written(form: Callable[[Iterator[Table]], Iterator[bytes]]) -> None:
    made: list[weakref.ref[Table]] = []

    def blocks() -> Iterator[Table]:
        for k in range(6):
            table = Table([Column("step", "", [str(k)]), Column("x", "m", [0.1 * k])])
            made.append(weakref.ref(table))
            yield table
            del table
            gc.collect()
            # the one that was handed over last may still be at hand
            assert sum(each() is not None for each in made) <= 1

    assert sum(map(len, form(blocks()))) > 100
    assert len(made) == 6


def test_a_full_sheet_goes_on_on_the_next(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(files, "MOST", 3)
    blocks = [Table([Column("x", "m", [float(4 * k + i) for i in range(4)])]) for k in range(2)]
    (tmp_path / "b.xlsx").write_bytes(b"".join(files.workbook({"poses": blocks})))
    book = openpyxl.load_workbook(tmp_path / "b.xlsx")
    assert book.sheetnames == ["poses", "poses 2", "poses 3"]
    rows = [list(sheet.iter_rows(values_only=True)) for sheet in book.worksheets]
    assert rows == [[("x_m",), (0,), (1,), (2,)], [("x_m",), (3,), (4,), (5,)], [("x_m",), (6,), (7,)]]


def test_names_and_empty_cells_stay_what_they_are(dalembert: Dalembert, tmp_path: Path) -> None:
    table = "rotor,mass_g,radius_mm,angle_deg\n07,5,20,30\nNA,1,10,90\n"
    done = dalembert("balance", "-", "--plane", "A:20mm", "-o", "r.parquet", stdin=table)
    assert done.returncode == 0, done.stderr
    names, found = of_parquet(tmp_path / "r.parquet")
    assert names == ["rotor", "plane", "radius_mm", "unbalance_g_mm", "mass_g", "angle_deg"]
    assert [row[0] for row in found] == ["07", "NA"]
    dalembert("examples", "riul-rod")
    dalembert("body", "rod.csv", "--shaft=-500mm:500mm", "--speed", "10rad_s", "-o", "b.parquet")
    dalembert("body", "rod.csv", "--shaft=-500mm:500mm", "--speed", "10rad_s", "-o", "b.csv")
    header, expected = cells(tmp_path / "b.csv")
    names, found = of_parquet(tmp_path / "b.parquet")
    assert names == header
    assert same(found, expected)
