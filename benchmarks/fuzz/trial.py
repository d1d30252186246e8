"""Broken input: worked examples with their files and options damaged at random, run by the real command.

Whatever comes in, the answer is a result, one line of a data error, or a usage error; never an exception, a warning
of numpy's, half a file, a long wait or much memory. A case is replayed by its seed.
"""

from __future__ import annotations

import contextlib
import functools
import io
import json
import os
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import typer

from benchmarks.fuzz.cases import Case, draw
from cli.app import build, main

LONGEST = 5.0  # seconds of processor time
LONGEST_LINE = 2000  # characters of a data error: more is no message


@dataclass(frozen=True)
class Outcome:
    """What became of a case; `handled` is result, data error or usage error, `fault` None where it was handled."""

    command: str
    arguments: list[str]
    seconds: float
    handled: str
    fault: str | None
    bytes: int = 0
    """Memory above that at the start of the case."""


@dataclass(frozen=True)
class Ended:
    """How a call ended: its status, what it printed, the exception that came through."""

    status: object
    out: str
    err: str
    exception: str | None = None


def trial(seed: int) -> Outcome:
    """Draw a case and run its command, in this process and a folder of its own."""
    case = draw(np.random.default_rng(seed))
    before = Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        for name, data in case.files.items():
            Path(folder, name).write_bytes(data)
        os.chdir(folder)
        try:
            start = time.process_time()
            ended = _call(case)
            spent = time.process_time() - start
            handled, fault = judge(case, ended)
        finally:
            os.chdir(before)
    if fault is None and spent > LONGEST:
        fault = f"took {spent:.1f} s"
    return Outcome(case.command, case.arguments, spent, handled, fault)


def _call(case: Case) -> Ended:
    """Run the command as its console script does, with numpy's warnings as errors and no net under it."""
    given, shown = sys.argv, os.environ.get("DALEMBERT_TRACEBACK")
    out = io.TextIOWrapper(io.BytesIO(), encoding="utf-8")
    err = io.TextIOWrapper(io.BytesIO(), encoding="utf-8", errors="backslashreplace")
    status: object = 0
    exception = None
    sys.argv = ["dalembert", *case.arguments]
    os.environ["DALEMBERT_TRACEBACK"] = "1"
    try:
        with (
            _standard_input(case.stdin),
            contextlib.redirect_stdout(out),
            contextlib.redirect_stderr(err),
            warnings.catch_warnings(),
        ):
            warnings.simplefilter("error")
            try:
                main(_front)
            except SystemExit as end:
                status = end.code
            except Exception as error:
                exception = _told(error)
    finally:
        sys.argv = given
        os.environ.pop("DALEMBERT_TRACEBACK")
        if shown is not None:
            os.environ["DALEMBERT_TRACEBACK"] = shown
    return Ended(status, _text(out), _text(err), exception)


@functools.cache
def _front(called: str | None) -> Any:
    """The command line, built once: that takes as long as a case."""
    return typer.main.get_command(build(called))


@contextlib.contextmanager
def _standard_input(data: bytes) -> Iterator[None]:
    before = sys.stdin
    sys.stdin = io.TextIOWrapper(io.BytesIO(data), encoding="utf-8")
    try:
        yield
    finally:
        sys.stdin = before


def _text(stream: io.TextIOWrapper) -> str:
    stream.flush()
    stream.seek(0)
    return stream.read()


def _told(error: Exception) -> str:
    """The exception and the last two places of this project's that it went through."""
    frames = traceback.extract_tb(error.__traceback__)
    ours = [f for f in frames if "site-packages" not in f.filename and "fuzz" not in f.filename]
    places = [f"{Path(f.filename).name}:{f.lineno}" for f in (ours[-2:] or frames[-1:])]
    return f"{type(error).__name__}: {str(error)[:300]} ({' '.join(places)})"


def judge(case: Case, ended: Ended) -> tuple[str, str | None]:
    """Say how a call was handled, and what is wrong with that."""
    if ended.exception is not None:
        return "", ended.exception
    lines = ended.err.splitlines()
    changed = [
        name
        for name in sorted(os.listdir())
        if name not in case.files or Path(name).read_bytes() != case.files[name]
    ]
    fault = None
    if halves := [name for name in changed if name.endswith(".part")]:
        fault = f"left {halves[0]}"
    if ended.status in (0, None):
        return "result", fault or _of_result(ended, changed)
    if ended.status == 2:
        if not any(line.startswith("Error: ") and len(line) > 10 for line in lines):
            fault = fault or f"a usage error that says nothing: {ended.err[-200:]!r}"
        return "usage error", fault or _left(ended, changed)
    if ended.status != 1:
        return "", f"status {ended.status}"
    if not any(line.startswith("dalembert: ") for line in lines):
        # a check that failed, or no pose that can be assembled: shown, with status 1
        return "result", fault or _of_result(ended, changed)
    if "not enough memory" in ended.err:
        return "data error", "not enough memory"
    if len(lines) != 1 or len(lines[0].removeprefix("dalembert: ")) < 10:
        fault = fault or f"a data error of {len(lines)} lines: {ended.err[:200]!r}"
    elif len(lines[0]) > LONGEST_LINE:
        fault = fault or f"a data error of {len(lines[0])} characters: {lines[0][:100]!r}"
    elif not lines[0].isprintable():
        fault = fault or f"a data error with control characters: {lines[0][:300]!r}"
    return "data error", fault or _left(ended, changed)


def _left(ended: Ended, changed: list[str]) -> str | None:
    """What an error may not leave behind."""
    if ended.out.strip():
        return f"an error after output: {ended.out[:100]!r}, {ended.err[:200]!r}"
    # of several files the first may be written, whole, when the second cannot be
    if changed and "cannot write" not in ended.err:
        return f"an error after writing {', '.join(changed)}: {ended.err[:200]!r}"
    return None


def _of_result(ended: Ended, changed: list[str]) -> str | None:
    """What a result must be: something, and JSON where it looks like it."""
    if not ended.out.strip() and not changed:
        return f"status {ended.status} and nothing shown: {ended.err[:200]!r}"
    documents = {"standard output": ended.out if ended.out.startswith("{\n") else ""}
    documents |= {name: Path(name).read_text("utf-8") for name in changed if name.endswith(".json")}
    for name, text in documents.items():
        try:
            if text:
                json.loads(text, parse_constant=_refuse)
        except ValueError as error:
            return f"{name} is no JSON: {error}"
    if "Warning" in ended.err or "Traceback" in ended.err:
        return f"a stray warning: {ended.err[:300]!r}"
    return None


def _refuse(constant: str) -> NoReturn:
    raise ValueError(f"{constant} in it")


def replayed(seed: int) -> dict[str, Any]:
    """Return a case in full: its arguments, files and standard input, to be looked at."""
    case = draw(np.random.default_rng(seed))
    return {"arguments": case.arguments, "files": case.files, "stdin": case.stdin}
