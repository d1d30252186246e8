"""What a terminal alone shows: colours of verdicts and warnings, how far long work has come."""

from __future__ import annotations

import os
import re
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import TextIO, TypeVar

_GREEN, _RED, _YELLOW, _PLAIN = "\033[32m", "\033[1;31m", "\033[33m", "\033[0m"
# verdicts stand in brackets or at the end of a line: elsewhere these are words like others
_WORDS = (
    r"(?<=\()(?:within|beyond)\b|\b(?:ok|WRONG|outlier)(?=\s*$)|(?<=  )(?:within|beyond)(?=\s*$)|^warning:"
)
_COLOURS = {
    **dict.fromkeys(("within", "ok"), _GREEN),
    **dict.fromkeys(("beyond", "WRONG"), _RED),
}


def coloured(text: str, stream: TextIO, wanted: bool = True) -> str:
    """Return a text as this stream shows it: with colours on a terminal, unless NO_COLOR or the user says no."""
    if not wanted or not stream.isatty() or os.environ.get("NO_COLOR") or os.environ.get("TERM") == "dumb":
        return text

    def painted(match: re.Match[str]) -> str:
        return f"{_COLOURS.get(match[0], _YELLOW)}{match[0]}{_PLAIN}"

    return re.sub(_WORDS, painted, text, flags=re.MULTILINE)


T = TypeVar("T")
AFTER, EVERY = 2.0, 0.5  # s


class StatusLine:
    """A line on the terminal that long work writes again and again; at the end it is wiped away."""

    def __enter__(self) -> StatusLine:
        self._start = self._shown = self._now = time.monotonic()
        self._text = ""
        return self

    @property
    def elapsed(self) -> float:
        """Seconds from the beginning to the last look at the clock."""
        return self._now - self._start

    def due(self) -> bool:
        """Whether the work is long, and the line has not been written just now."""
        self._now = time.monotonic()
        return self.elapsed > AFTER and self._now - self._shown > EVERY

    def show(self, text: str) -> None:
        """Write the line."""
        print(f"\r{text:<60}", end="", file=sys.stderr, flush=True)
        self._shown, self._text = self._now, text

    def __exit__(self, *_: object) -> None:
        # the next message, an error too, begins on a line of its own
        if self._text:
            print(f"\r{'':<60}\r", end="", file=sys.stderr, flush=True)


def progress(items: Iterable[T], count: int, what: str, each: int = 1) -> Iterator[T]:
    """Hand the items on, and say how many of them are done, where every one counts for so many."""
    if not sys.stderr.isatty():
        yield from items
        return
    with StatusLine() as line:
        for number, item in enumerate(items, 1):
            yield item
            # whoever asks for the next has done with this one
            done = min(number * each, count)
            if line.due():
                left = line.elapsed / done * (count - done)
                line.show(f"{done} of {count} {what}, {left:.0f} s to go")


@contextmanager
def progress_in_time() -> Iterator[Callable[[float, float, int], None] | None]:
    """Give a function that shows the time that a simulation has reached, its last time, and which solution it is.

    None where standard error is no terminal.
    """
    if not sys.stderr.isatty():
        yield None
        return
    with StatusLine() as line:

        def show(reached: float, end: float, solution: int) -> None:
            if line.due():
                line.show(f"simulated {reached:.4g} of {end:.4g} s, solution {solution}")

        yield show
