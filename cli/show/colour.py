"""Colour, on a terminal alone: verdicts, warnings, marks."""

from __future__ import annotations

import os
import re
from typing import TextIO

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
