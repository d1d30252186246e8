"""Count the files that a command passes, and how often it goes from one into another: `python benchmarks/trace_passes.py`.

The command runs in this process, from its start with nothing imported; without arguments it is a pose sweep,
`dalembert mechanism klann.toml --over 0deg:360deg:1deg`. Each call and each return of a Python function of the
program, the bodies of its modules too, is a step in the file of that function. *Files* are the files in which there is
a step, *called* those of them of which a function was called (not only the module's body run), *changes* the steps in
another file than the step before. Each package is counted by itself, as if there were no other, and all of them
together. Another installation is counted by its own Python running this same file.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib.util
import io
import os
import sys
from collections import Counter
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from types import FrameType
from typing import Any

PACKAGES = ("cli", "virtualwork", "balancing", "rigidbody3d", "dalembert")


def folders() -> dict[str, str]:
    """Return the folder of each package of the program that is installed."""
    specs = {name: importlib.util.find_spec(name) for name in PACKAGES}
    return {
        name: os.path.join(spec.submodule_search_locations[0], "")
        for name, spec in specs.items()
        if spec is not None and spec.submodule_search_locations
    }


def steps(arguments: list[str]) -> list[tuple[str, str]]:
    """Run `dalembert ARGUMENTS`; return file and function of each call and return in the program."""
    inside = tuple(folders().values())
    found: list[tuple[str, str]] = []

    def watch(frame: FrameType, event: str, _: Any) -> None:
        code = frame.f_code
        if event in ("call", "return") and code.co_filename.startswith(inside):
            found.append((code.co_filename, code.co_name))

    given, sys.argv = sys.argv, ["dalembert", *arguments]
    sys.setprofile(watch)
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):
            import_module("cli.app").main()
    finally:
        sys.setprofile(None)
        sys.argv = given
    return found


def counted(found: list[tuple[str, str]]) -> dict[str, int]:
    """Count files, files of called functions, and changes of file."""
    files = [file for file, _ in found]
    return {
        "files": len(set(files)),
        "called": len({file for file, name in found if name != "<module>"}),
        "changes": sum(here != before for before, here in pairwise(files)),
    }


def main() -> None:
    """Count and print, as CSV."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--list", action="store_true", help="the files too, with the changes into each")
    parser.add_argument("arguments", nargs=argparse.REMAINDER, help="of dalembert (default: the sweep)")
    given = parser.parse_args()
    known = folders()
    klann = Path(known["cli"], "examples", "klann", "klann.toml")
    found = steps(given.arguments or ["mechanism", str(klann), "--over", "0deg:360deg:1deg"])
    print("package,files,called,changes")
    for name, folder in [*known.items(), ("all", "")]:
        mine = counted([step for step in found if step[0].startswith(folder)])
        if mine["files"]:
            print(name, *mine.values(), sep=",")
    if given.list:
        into = Counter(here for (before, _), (here, _) in pairwise(found) if here != before)
        print("\nfile,changes into it")
        for file, count in into.most_common():
            folder = next(folder for folder in known.values() if file.startswith(folder))
            print(os.path.relpath(file, Path(folder).parent), count, sep=",")


if __name__ == "__main__":
    main()
