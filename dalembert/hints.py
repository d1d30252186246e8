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


LISTED = 8
"""The number of names that a message lists."""


def choices(word: str, names: Iterable[str]) -> str:
    """Suggest the nearest name, or list the names where none is near.

    Examples
    --------
    >>> choices("crnak", ["crank", "rod"]), choices("abc", ["crank", "rod"]), choices("abc", ["rod"])
    ("; did you mean 'crank'?", ': expected one of crank, rod', ': expected rod')
    """
    listed = list(names)
    if (hint := nearest(word, listed)) or not listed:
        return hint
    more = f" and {len(listed) - LISTED} more" if len(listed) > LISTED else ""
    return f": expected {'one of ' * (len(listed) > 1)}{', '.join(listed[:LISTED])}{more}"
