"""What a user's data can do wrong, in one line each."""

from __future__ import annotations

from collections.abc import Iterable

LONGEST = 1200  # characters of a message
MEMORY = 900e6  # bytes that a result may take: what takes more is refused before it is begun


def memory() -> float:
    """Bytes that a result may take: four fifths of what the machine has free, or of what the process is allowed."""
    from contextlib import suppress
    from pathlib import Path

    free = [float("inf")]
    with suppress(OSError, ValueError, StopIteration):
        lines = Path("/proc/meminfo").read_text().splitlines()
        free.append(next(float(line.split()[1]) * 1024 for line in lines if line.startswith("MemAvailable")))
    with suppress(OSError, ValueError):
        group = Path("/sys/fs/cgroup")
        used = float((group / "memory.current").read_text())
        free.append(float((group / "memory.max").read_text()) - used)
    # Windows has no such limits
    with suppress(ImportError):
        import resource

        allowed = resource.getrlimit(resource.RLIMIT_AS)[0]
        if allowed != resource.RLIM_INFINITY:
            free.append(float(allowed) - 0.5e9)
    least = max(0.0, min(free))
    return 0.8 * least if least < float("inf") else MEMORY


class DataError(Exception):
    """Bad data: shown as one line, status 1."""


def needs(what: str, package: str, extra: str) -> DataError:
    """Say what is missing where a package of an extra is not installed."""
    return DataError(f"{what} needs {package}: install dalembert with its extra, dalembert[{extra}]")


def cell_error(file: str, row: int, line: int, column: str, found: str, expected: str) -> DataError:
    """Name file, row, column, the value found and what was expected.

    `row` counts the data rows from 1; `line` is the file's own line, header and blank lines included.
    """
    return DataError(
        f"{file}: row {row} (line {line}), column {column}: found {quote(found)}, expected {expected}"
    )


def quote(found: str) -> str:
    """Show a value from a file on one line, whatever it holds."""
    text = ascii(found) if not found.isprintable() else f"'{found}'"
    return text if len(text) <= 60 else text[:57] + "...'"


def one_line(message: str) -> str:
    """Put a message on one line that a terminal can show, whatever names and values of a file stand in it."""
    line = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in " ".join(message.split()))
    # what was found stands at the front, what was expected at the end
    return line if len(line) <= LONGEST else f"{line[: LONGEST * 2 // 3]} ... {line[-LONGEST // 3 :]}"


def nearest(word: str, known: Iterable[str], cutoff: float = 0.4) -> str:
    """Suggest the nearest known name: `; did you mean 'mm'?`, or nothing."""
    from difflib import get_close_matches

    close = get_close_matches(word, list(known), n=1, cutoff=cutoff)
    return f"; did you mean '{close[0]}'?" if close else ""
