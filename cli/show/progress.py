"""How far long work has come, on standard error: on a terminal alone, and once it has taken two seconds."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable, Iterator
from typing import TypeVar

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
