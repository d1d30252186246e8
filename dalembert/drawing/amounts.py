"""Numbers as a picture shows them: in a unit whose prefix suits their size, and without the noise of rounding."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import ArrayLike, NDArray

PREFIXES = {-9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
LADDERS = {
    "g": (-6, -3, 0, 3),
    "m": (-9, -6, -3, 0, 3),
    **dict.fromkeys(("N", "W", "J", "V", "Pa"), tuple(PREFIXES)),
}
"""Units that take prefixes, and which of them are in use."""
NOISE = 1e-12
"""A value below this share of the scale of its kind is the rounding of zero."""


def prefixed(largest: float, unit: str) -> tuple[float, str]:
    """Return by what to multiply numbers up to `largest` in a unit, and the unit they are then in.

    Numbers from 0.01 up to 10 000 stay in the unit they have. A unit that takes no prefix goes by powers of ten.

    >>> prefixed(2.5e6, "W"), prefixed(0.4, "N·m"), prefixed(2e5, "g·mm"), prefixed(3e5, "rad/s²")
    ((1e-06, 'MW'), (1, 'N·m'), (0.001, 'kg·mm'), (0.001, '10³ rad/s²'))
    >>> prefixed(1.2e6, "g·mm")
    (1e-06, 'kg·m')
    """
    if not np.isfinite(largest) or largest <= 0 or 0.01 <= largest < 1e4:
        return 1, unit
    steps = int(np.floor(np.log10(largest) / 3)) * 3
    parts = re.fullmatch(rf"([{''.join(PREFIXES.values())}]?)({'|'.join(LADDERS)})((?![A-Za-z]).*)", unit)
    if parts:
        prefix, base, rest = parts.groups()
        own = next(power for power, letter in PREFIXES.items() if letter == prefix)
        power = min(LADDERS[base], key=lambda p: abs(p - own - steps))
        if abs(power - own - steps) < 3:
            return float(f"1e{own - power}"), f"{PREFIXES[power]}{base}{rest}"
        if base == "g" and rest == "·mm" and power - own - steps == -3:  # an unbalance of some kg·m
            return float(f"1e{-steps}"), f"{PREFIXES[power]}{base}·m"
    raised = str(steps).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return float(f"1e{-steps}"), f"10{raised} {unit}"


def dimensioned(size: float, least: float = 2e-3) -> tuple[float, str]:
    """Return by what to multiply metres in a drawing of this size, and the unit: millimetres up to two metres.

    >>> dimensioned(0.3), dimensioned(5.0), dimensioned(1e-4)
    ((1000.0, 'mm'), (1, 'm'), (1000000.0, 'µm'))
    """
    return (1e3, "mm") if least <= size < 2 else prefixed(size, "m")


def quiet(values: ArrayLike, scale: float) -> NDArray[np.float64]:
    """Return numbers without what rounding leaves of zero, or of a constant, on the scale of their kind.

    >>> nothing, one, also_one = quiet([1e-15, 1.0, 1.0 + 2e-16], 1.0).tolist()
    >>> nothing, one == also_one
    (0.0, True)
    """
    x = np.asarray(values, dtype=float)
    finite = np.abs(x[np.isfinite(x)])
    scale = max(scale, float(finite.max(initial=0.0)))
    if not scale > 0 or not np.isfinite(scale):
        return x
    step = NOISE * scale
    return np.where(np.abs(x) < step, 0.0, np.round(x / step) * step) + 0.0
