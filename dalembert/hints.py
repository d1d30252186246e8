"""The name that is meant where an unknown one stands."""

from __future__ import annotations

from collections.abc import Iterable


def nearest(word: str, names: Iterable[str], cutoff: float = 0.6) -> str:
    """Suggest the nearest name: `; did you mean 'mm'?`, or nothing where none is near.

    Examples
    --------
    >>> nearest("lenght", ["length", "angle"]), nearest("cams", ["name"])
    ("; did you mean 'length'?", '')
    """
    from difflib import get_close_matches

    close = get_close_matches(word, list(names), n=1, cutoff=cutoff)
    return f"; did you mean '{close[0]}'?" if close else ""
