"""Time and error of balancing with known masses; `python benchmarks/balance.py` writes docs/balancing.md's table.

Times are whole processes, the two of a ratio in turn, A B A B, and the median of the pairs' ratios is kept.
"""

from __future__ import annotations

import math
import os
import re
import statistics
import subprocess
import sys
import tempfile
import time
from fractions import Fraction
from pathlib import Path

import numpy as np

from balancing import correct

DALEMBERT = str(Path(sys.executable).with_name("dalembert"))
PAGE = Path(__file__).parents[1] / "docs" / "balancing.md"


def seconds(command: list[str]) -> float:
    start = time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return time.perf_counter() - start


def ratio(command: list[str], floor: list[str], pairs: int) -> float:
    seconds(command), seconds(floor)
    return statistics.median(seconds(command) / seconds(floor) for _ in range(pairs))


def python(script: str) -> list[str]:
    return [sys.executable, "-c", script]


def write_rotors(path: Path, rows: int, rotors: int) -> None:
    rng = np.random.default_rng(1)
    columns = [rng.uniform(*limits, rows) for limits in ((0, 100), (10, 50), (0, 360), (0, 90))]
    with path.open("w") as file:
        file.write("rotor,mass_g,radius_mm,angle_deg,z_mm\n")
        for i, (mass, radius, angle, z) in enumerate(zip(*columns, strict=True)):
            file.write(f"R{i * rotors // rows},{mass:.6f},{radius:.4f},{angle:.4f},{z:.3f}\n")


def error_of_corrections() -> float:
    """Return the worst relative error of two-plane corrections of random rotors, against fractions."""
    rng = np.random.default_rng(2)
    worst = 0.0
    for _ in range(1000):
        k = int(rng.integers(1, 20))
        u, z = rng.normal(size=k) + 1j * rng.normal(size=k), rng.uniform(-1, 2, k)
        a, b = (Fraction(x) for x in rng.uniform(0, 1, 2))
        found = correct(u, z, [float(a), float(b)]).unbalance
        for w, here, other in ((found[0], a, b), (found[1], b, a)):
            true = [
                -sum(Fraction(x) * (Fraction(at) - other) for x, at in zip(part, z, strict=True))
                / (here - other)
                for part in (u.real, u.imag)
            ]
            off = math.hypot(*(Fraction(x) - t for x, t in zip((w.real, w.imag), true, strict=True)))
            worst = max(worst, off / math.hypot(*true))
    return worst


def errors_of_sums() -> tuple[float, float]:
    """Return the error of the sum of 10⁶ nearly cancelling masses, ours and numpy's, over the sum of magnitudes."""
    rng = np.random.default_rng(3)
    half = rng.uniform(size=500_000)
    u = np.concatenate([half, -rng.permutation(half) * (1 + 1e-15)])
    true, size = math.fsum(u), np.abs(u).sum()
    naive = 0.0
    for x in u.tolist():
        naive += x
    return abs(float(correct(u).static.real) - true) / size, abs(naive - true) / size


def main() -> None:
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        small, large, out = folder / "small.csv", folder / "large.csv", folder / "out.csv"
        write_rotors(small, 10, 1)
        write_rotors(large, 1_000_000, 100_000)
        planes = ["--plane", "A:0mm:20mm", "--plane", "B:90mm:20mm"]
        subprocess.run([DALEMBERT, "balance", large, *planes, "-o", out], check=True)
        empty_app = (
            "import typer\napp = typer.Typer(rich_markup_mode=None, pretty_exceptions_enable=False, add_completion=False)\n"
            "@app.command()\ndef run(): ...\napp(['--help'])"
        )
        pandas = (
            f"import pandas as pd, sys\npd.read_csv({str(large)!r})\nframe = pd.read_pickle({str(folder / 'out.pkl')!r})\n"
            f"frame.to_csv({str(folder / 'copy.csv')!r}, index=False)"
        )
        import pandas as pd

        pd.read_csv(out).to_pickle(folder / "out.pkl")
        ours, naive = errors_of_sums()
        rows = [
            (
                "`dalembert --help`, over an empty typer app",
                ratio([DALEMBERT, "--help"], python(empty_app), 15),
                "≤ 1.3",
            ),
            (
                "`balance` of ten rows, over importing numpy, csv and typer",
                ratio([DALEMBERT, "balance", str(small), *planes], python("import numpy, csv, typer"), 15),
                "≤ 1.5",
            ),
            (
                "`balance` of 10⁶ rows, 10⁵ rotors, over pandas reading that file and writing that output",
                ratio([DALEMBERT, "balance", str(large), *planes, "-o", str(out)], python(pandas), 3),
                "≤ 2",
            ),
            ("worst relative error of 2000 two-plane corrections", error_of_corrections(), "≤ 1e-14"),
            ("error of the sum of 10⁶ nearly cancelling masses, over the sum of magnitudes", ours, "≤ 5e-16"),
            ("the same, summed in sequence", naive, ""),
        ]
    table = "| | measured | aim |\n|---|---|---|\n"
    table += "".join(
        f"| {name} | {f'{value:.2f}' if value > 0.1 else f'{value:.1e}'} | {aim} |\n"
        for name, value, aim in rows
    )
    print(table)
    page = PAGE.read_text(encoding="utf-8")
    block = f"<!-- table:balance -->\n{table}<!-- end -->"
    PAGE.write_text(
        re.sub(r"<!-- table:balance -->.*?<!-- end -->", lambda _: block, page, flags=re.DOTALL),
        encoding="utf-8",
    )


if __name__ == "__main__":
    main()
