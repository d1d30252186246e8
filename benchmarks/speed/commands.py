"""Whole commands as processes: CPU time from start to end, over the least that any such process takes here."""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path

import numpy as np

from benchmarks.speed.measure import Measurement, calibration

DOMAIN = "commands"

APP = (
    "import typer\n"
    "app = typer.Typer(rich_markup_mode=None, pretty_exceptions_enable=False, add_completion=False)\n"
    "@app.command()\n"
    "def run(): ...\n"
    "app(['--help'])"
)
NUMPY = "import numpy, csv, typer"
PANDAS = "import pandas, typer"


def measure(quick: bool) -> Iterator[Measurement]:
    """Yield times of `--help`, a ten-row `balance` and one pose of a mechanism."""
    pairs = 2 if quick else 15
    with tempfile.TemporaryDirectory() as name:
        table = Path(name) / "rotors.csv"
        table.write_text(
            "mass_g,radius_mm,angle_deg,z_mm\n"
            + "".join(f"{10 + i},{20 + i},{36 * i},{9 * i}\n" for i in range(10)),
            encoding="utf-8",
        )
        klann = str(files("cli") / "examples" / "klann" / "klann.toml")
        balance = ["balance", str(table), "--plane", "A:0mm:20mm", "--plane", "B:90mm:20mm"]
        yield _beside("dalembert --help", ["--help"], "an empty typer app's --help", APP, pairs, 60e6, 1.3)
        yield _beside(
            "dalembert balance, ten rows", balance, "importing numpy, csv, typer", NUMPY, pairs, 110e6, 1.5
        )
        if not quick:
            least = [sys.executable, "-c", PANDAS]
            yield _alone("importing pandas and typer, for comparison", least, 3)
            yield _million(Path(name), 3)
        pose = ["mechanism", klann, "--at", "60deg"]
        yield _beside("dalembert mechanism, one pose", pose, "importing numpy, csv, typer", NUMPY, pairs)


def _million(folder: Path, pairs: int) -> Measurement:
    """Measure `balance` of 10⁶ rows, over pandas that reads the same file and writes the same output."""
    rng = np.random.default_rng(1)
    table, out, copy = folder / "large.csv", folder / "out.csv", folder / "copy.csv"
    columns = [rng.uniform(*limits, 1_000_000) for limits in ((0, 100), (10, 50), (0, 360), (0, 90))]
    with table.open("w", encoding="utf-8") as file:
        file.write("rotor,mass_g,radius_mm,angle_deg,z_mm\n")
        for i, (mass, radius, angle, z) in enumerate(zip(*columns, strict=True)):
            file.write(f"R{i // 10},{mass:.6f},{radius:.4f},{angle:.4f},{z:.3f}\n")
    balance = ["balance", str(table), "--plane", "A:0mm:20mm", "--plane", "B:90mm:20mm", "-o", str(out)]
    subprocess.run([sys.executable, "-m", "cli", *balance], check=True)
    script = (
        f"import pandas as pd\npd.read_csv({str(table)!r})\n"
        f"pd.read_pickle({str(folder / 'out.pkl')!r}).to_csv({str(copy)!r}, index=False)"
    )
    import pandas as pd

    pd.read_csv(out).to_pickle(folder / "out.pkl")
    method, floor = "dalembert balance, 10⁶ rows of 10⁵ rotors", "pandas reading and writing as much"
    return _beside(method, balance, floor, script, pairs, aim_ratio=2.0)


def _seconds(command: list[str]) -> float:
    """Return the CPU time of a process, or where the system does not tell, its wall time."""
    try:
        import resource
    except ImportError:  # Windows
        start = time.perf_counter()
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        return time.perf_counter() - start

    def spent() -> float:
        use = resource.getrusage(resource.RUSAGE_CHILDREN)
        return use.ru_utime + use.ru_stime

    # byte code is kept, as an installed package has it, also where this environment says not to
    settings = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "PYTHONDONTWRITEBYTECODE": ""}
    start = spent()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env=settings)
    return spent() - start


def _beside(
    method: str,
    arguments: list[str],
    floor: str,
    script: str,
    pairs: int,
    aim_ns: float | None = None,
    aim_ratio: float | None = None,
) -> Measurement:
    command, least = [sys.executable, "-m", "cli", *arguments], [sys.executable, "-c", script]
    # the first process of a checkout makes the byte code
    _seconds(command), _seconds(least)
    both = [(_seconds(command), _seconds(least)) for _ in range(pairs)]
    ns = min(a for a, _ in both) * 1e9
    return Measurement(
        DOMAIN,
        "a whole process",
        method,
        1,
        ns,
        ns / calibration(),
        aim_ns=aim_ns,
        floor=floor,
        ratio=statistics.median(a / b for a, b in both),
        aim_ratio=aim_ratio,
    )


def _alone(method: str, command: list[str], pairs: int) -> Measurement:
    _seconds(command)
    ns = min(_seconds(command) for _ in range(pairs)) * 1e9
    return Measurement(DOMAIN, "a whole process", method, 1, ns, ns / calibration())
