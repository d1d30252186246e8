"""Broken input: the worked examples with their files and options damaged at random.

Whatever comes in, the answer is a result, one line of a data error, or a usage error; never an exception, a
warning of numpy's, or a wait of more than five seconds. A case is replayed by its seed.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import shlex
import tempfile
import time
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import typer

from cli.app import build
from cli.commands.examples import ABOUT, EXAMPLES, describe, names
from cli.errors import DataError

LONGEST = 5.0  # seconds

# what people, spreadsheets and bad luck put into cells
TOKENS = [
    "", " ", "0", "-0", "-1", "1", "1e9", "-1e-9", "1e60", "1e-60", "1e61", "1e308", "1e-320", "nan", "inf", "-inf", "NaN",
    "x", "?", "?A", "yes", "NA", "None", "true", "1,5", "1.5.2", "0x1", "1_0", "½", "ü", "\u2212" + "1", "A", "B", "ground",
    "360", "-90", "1e5deg", "30 deg", "12 furlong", "3000 rpm", "[", "]", "{}", "[[", "= ", "\"", "'", "\\", "#", "\t",
    ";", ",", ",,", "\r", "\n", "\n\n", "\0", "\ufeff", "point = \"A\"", "[0, 0]", "[1e60, 0]",
]  # fmt: skip


@dataclass(frozen=True)
class Outcome:
    """What became of a damaged example; `fault` is None where it was handled."""

    example: str
    arguments: list[str]
    seconds: float
    fault: str | None


def damage(rng: np.random.Generator, data: bytes) -> bytes:
    """Return a file with one to four small faults."""
    text = data.decode("utf-8")
    for _ in range(int(rng.integers(1, 5))):
        lines = text.splitlines(keepends=True) or [""]
        i = int(rng.integers(len(lines)))
        token = TOKENS[int(rng.integers(len(TOKENS)))]
        match int(rng.integers(8)):
            case 0 | 1:
                text = _replace_word(rng, lines, i, token)
            case 2:
                text = _replace_word(rng, lines, i, f"{rng.normal() * 10.0 ** rng.integers(-4, 5):.4g}")
            case 3:
                text = "".join(lines[:i] + lines[i + 1 :])
            case 4:
                text = "".join([*lines[: i + 1], *lines[i:]])
            case 5:
                text = "".join([*lines[:i], token, *lines[i:]])
            case 6:
                text = text[: int(rng.integers(len(text) + 1))]
            case _:
                text = "".join(lines[k] for k in rng.permutation(len(lines)))
    encoded = text.encode("utf-8")
    if rng.random() < 0.05:
        encoded = text.encode(str(rng.choice(["utf-16", "cp1252", "utf-32"])), "replace")
    if rng.random() < 0.05 and encoded:
        place = int(rng.integers(len(encoded)))
        encoded = encoded[:place] + bytes([int(rng.integers(256))]) + encoded[place + 1 :]
    return encoded


def _replace_word(rng: np.random.Generator, lines: list[str], i: int, token: str) -> str:
    """Put a token in the place of one cell, number or word of a line."""
    words = list(re.finditer(r"[^\s,;=\[\]{}]+|(?<=,)(?=[,\n])", lines[i]))
    if not words:
        return "".join(lines)
    word = words[int(rng.integers(len(words)))]
    line = lines[i][: word.start()] + token + lines[i][word.end() :]
    return "".join([*lines[:i], line, *lines[i + 1 :]])


def trial(seed: int) -> Outcome:
    """Damage one example and run its command, in this process and an empty folder."""
    rng = np.random.default_rng(seed)
    known = names()
    example = known[int(rng.integers(len(known)))]
    arguments = shlex.split(describe(example)["command"])[1:]
    arguments = [
        word for word in arguments if not word.endswith((".png", ".svg", ".pdf")) and word != "--plot"
    ]
    if rng.random() < 0.3 and len(arguments) > 1:
        place = int(rng.integers(1, len(arguments)))
        arguments[place] = TOKENS[int(rng.integers(len(TOKENS)))].replace("\0", "")
    if rng.random() < 0.5:
        arguments.append("--json")
    before = Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        files = [file for file in EXAMPLES.joinpath(example).iterdir() if file.name != ABOUT]
        victim = files[int(rng.integers(len(files)))].name
        for file in files:
            data = file.read_bytes()
            Path(folder, file.name).write_bytes(damage(rng, data) if file.name == victim else data)
        os.chdir(folder)
        start = time.monotonic()
        try:
            fault = _run(arguments)
        finally:
            os.chdir(before)
    spent = time.monotonic() - start
    if fault is None and spent > LONGEST:
        fault = f"took {spent:.1f} s"
    return Outcome(example, arguments, spent, fault)


def _run(arguments: list[str]) -> str | None:
    command: Any = typer.main.get_command(build(arguments[0]))
    with (
        contextlib.redirect_stdout(io.StringIO()),
        contextlib.redirect_stderr(io.StringIO()),
        warnings.catch_warnings(),
    ):
        warnings.simplefilter("error")
        try:
            command.main(arguments, prog_name="dalembert")
        except DataError as error:
            return None if str(error).strip() else "an empty message"
        except SystemExit as end:
            return None if end.code in (0, 1, 2, None) else f"status {end.code}"
        except Exception as error:
            import traceback

            where = traceback.extract_tb(error.__traceback__)[-1]
            return f"{type(error).__name__}: {error} ({Path(where.filename).name}:{where.lineno})"
    return None
