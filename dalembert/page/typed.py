"""The units that a page accepts: every unit of a dimension, as a ratio."""

from __future__ import annotations

import re
from collections.abc import Iterable

from dalembert.units import UNITS, to_si


def units(kinds: Iterable[str]) -> dict[str, dict[str, list[float]]]:
    """Return every unit of these dimensions that can be typed, with its value in SI and radians as a ratio."""
    spellings = {}
    for kind in dict.fromkeys(kinds):
        listed = UNITS.get(kind, {})
        si = min(listed, key=lambda unit: abs(float(to_si(1.0, kind, unit)) - 1.0), default="")
        # the SI unit first
        order = sorted(listed, key=lambda unit: unit != si)
        spellings[kind] = {spelled(unit): [float(x) for x in listed[unit]] for unit in order}
    return spellings


def spelled(unit: str) -> str:
    """A unit of a header as people write it.

    >>> spelled("m_s2"), spelled("N_m"), spelled("N_s_per_m"), spelled("kg_m3")
    ('m/s2', 'N m', 'N s/m', 'kg m3')
    """
    above, per, below = unit.partition("_per_")
    if not per and re.search(r"[a-z]_s[23]?$", above):
        above, per, below = above.rpartition("_")
    return above.replace("_", " ") + (f"/{below.replace('_', ' ')}" if per else "")
