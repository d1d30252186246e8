"""Compare two installations by what they print: `python -m benchmarks.same_outputs OLD NEW`.

OLD and NEW are environments, or their `dalembert` scripts. Every worked example that OLD has is written out and run by
both, each in a folder of its own, as CSV, JSON, text and with --digits; standard output, standard error and the status
must be the same byte for byte. The first line that differs is shown for each command; the status is 1 if one does.
"""

from __future__ import annotations

import argparse
import os
import re
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from itertools import zip_longest
from pathlib import Path

MODES = ((), ("--json",), ("--text",), ("--digits",))


@dataclass(frozen=True)
class Ended:
    """How a command ended."""

    status: int
    out: bytes
    err: bytes

    @property
    def lines(self) -> list[str]:
        """What it printed and said, and its status."""
        return [*(self.out + self.err).decode("utf-8", "replace").splitlines(), f"status {self.status}"]


def script(environment: str) -> str:
    """Return the `dalembert` script of an environment; a script stands for itself."""
    path = Path(environment)
    return str((path / "bin" / "dalembert" if path.is_dir() else path).absolute())


def run(program: str, arguments: list[str], folder: Path) -> Ended:
    """Run a command in a folder."""
    done = subprocess.run(
        [program, *arguments],
        cwd=folder,
        capture_output=True,
        check=False,
        env={**os.environ, "COLUMNS": "120", "OPENBLAS_NUM_THREADS": "1"},
    )
    return Ended(done.returncode, done.stdout, done.stderr)


def examples(program: str) -> list[str]:
    """Return the names of the worked examples: the first word of the lines that begin with one."""
    with tempfile.TemporaryDirectory() as folder:
        lines = run(program, ["examples"], Path(folder)).lines[:-1]
    return [line.split()[0] for line in lines if re.match(r"[a-z0-9-]+\s", line)]


def commands(written: Ended) -> list[list[str]]:
    """Return the calls that an example prints, without pictures."""
    calls = [line.strip() for line in written.lines if line.strip().startswith("dalembert ")]
    return [shlex.split(re.sub(r"\s--plot\s+\S+", "", call))[1:] for call in calls]


def first_difference(old: Ended, new: Ended) -> str:
    """Return the first line that differs, of both."""
    pairs = zip_longest(old.lines, new.lines, fillvalue="(nothing)")
    for number, (mine, its) in enumerate(pairs, 1):
        if mine != its:
            return f"  line {number}\n  old {mine[:300]}\n  new {its[:300]}"
    return "  in its line ends or in which stream it was"


def differences(old: str, new: str, example: str) -> Iterator[str | None]:
    """Yield for each call and mode of an example what differs, or None."""
    with tempfile.TemporaryDirectory() as name:
        folders = [Path(name, "old"), Path(name, "new")]
        for folder in folders:
            folder.mkdir()
        written = [run(p, ["examples", example], f) for p, f in zip((old, new), folders, strict=True)]
        yield None if written[0] == written[1] else f"{example}\n{first_difference(*written)}"
        for call in commands(written[0]):
            for mode in MODES:
                arguments = [*call, *mode]
                ended = [run(p, arguments, f) for p, f in zip((old, new), folders, strict=True)]
                said = f"{example}: dalembert {shlex.join(arguments)}\n{first_difference(*ended)}"
                yield None if ended[0] == ended[1] else said


def compare(old: str, new: str, workers: int = 2, only: list[str] | None = None) -> tuple[int, list[str]]:
    """Return how many calls were compared, and what differs."""
    one = partial(differences, old, new)
    with ThreadPoolExecutor(workers) as pool:
        found = [
            line for lines in pool.map(lambda name: list(one(name)), only or examples(old)) for line in lines
        ]
    return len(found), [line for line in found if line is not None]


def main() -> None:
    """Read the command line, compare, and print what differs."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.same_outputs",
        description="Compare what two installations print for every worked example, byte for byte.",
    )
    parser.add_argument("old", help="environment or dalembert script to compare with")
    parser.add_argument("new", help="environment or dalembert script that is compared")
    parser.add_argument("--example", action="append", help="only this one (repeatable)")
    parser.add_argument("--workers", type=int, default=2, help="examples run at once")
    given = parser.parse_args()
    compared, found = compare(script(given.old), script(given.new), given.workers, given.example)
    for line in found:
        print(line)
    print(f"{compared} calls compared, {len(found)} differ")
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
