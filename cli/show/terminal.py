"""What a terminal alone shows: colours of verdicts and warnings, how far long work has come."""

from __future__ import annotations

import os
import re
import sys
import time
from collections.abc import Iterable, Iterator
from typing import TextIO, TypeVar

_GREEN, _RED, _YELLOW, _PLAIN = "\033[32m", "\033[1;31m", "\033[33m", "\033[0m"
# verdicts stand in brackets, behind a colon or at the end of a line: elsewhere these are words like others
_WORDS = (
    r"(?<=\()(?:within|beyond)\b|(?<=: )(?:stable|unstable)\b|\b(?:ok|WRONG|outlier)(?=\s*$)|(?<=  )(?:within|beyond)(?=\s*$)"
    r"|^warning:|\b(?:dead|change) points?: (?!none)|\binput limits: (?!none)"
)
_COLOURS = {
    **dict.fromkeys(("within", "stable", "ok"), _GREEN),
    **dict.fromkeys(("beyond", "unstable", "WRONG"), _RED),
}


def coloured(text: str, stream: TextIO, wanted: bool = True) -> str:
    """Return a text as this stream shows it: with colours on a terminal, unless NO_COLOR or the user says no."""
    if not wanted or not stream.isatty() or os.environ.get("NO_COLOR") or os.environ.get("TERM") == "dumb":
        return text

    def painted(found: re.Match[str]) -> str:
        return f"{_COLOURS.get(found[0], _YELLOW)}{found[0]}{_PLAIN}"

    return re.sub(_WORDS, painted, text, flags=re.MULTILINE)


T = TypeVar("T")
AFTER, EVERY = 2.0, 0.5  # s


def progress(items: Iterable[T], count: int, what: str, each: int = 1) -> Iterator[T]:
    """Hand the items on, and say how many of them are done, where every one counts for so many."""
    if not sys.stderr.isatty():
        yield from items
        return
    start = shown = time.monotonic()
    told = ""
    try:
        for number, item in enumerate(items, 1):
            yield item
            # whoever asks for the next has done with this one
            done, now = min(number * each, count), time.monotonic()
            if now - start > AFTER and now - shown > EVERY:
                told = f"{done} of {count} {what}, {(now - start) / done * (count - done):.0f} s to go"
                print(f"\r{told:<60}", end="", file=sys.stderr, flush=True)
                shown = now
    finally:
        # what is said next, an error too, begins on a line of its own
        if told:
            print(f"\r{'':<60}\r", end="", file=sys.stderr, flush=True)
