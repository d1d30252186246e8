"""Units in a mechanism's description: "120 mm", "700 rpm", "4 N/mm" to SI.

The description is a file that the library reads without the command line, so it brings its own small reader; tables
and options of the command have theirs in `cli.units`.
"""

from __future__ import annotations

import math
import re
from fractions import Fraction
from typing import Any

from virtualwork.describe import DescriptionError

# SI: no quantity of a machine is larger, and no product of five of them overflows
LARGEST = 1e60
# dimensions as exponents of (length, mass, time, angle)
Dimension = tuple[int, int, int, int]

_FACTORS: dict[str, tuple[float, Dimension]] = {
    "m": (1.0, (1, 0, 0, 0)),
    "mm": (1e-3, (1, 0, 0, 0)),
    "cm": (1e-2, (1, 0, 0, 0)),
    "um": (1e-6, (1, 0, 0, 0)),
    "µm": (1e-6, (1, 0, 0, 0)),
    "nm": (1e-9, (1, 0, 0, 0)),
    "km": (1e3, (1, 0, 0, 0)),
    "in": (0.0254, (1, 0, 0, 0)),
    "ft": (0.3048, (1, 0, 0, 0)),
    "kg": (1.0, (0, 1, 0, 0)),
    "g": (1e-3, (0, 1, 0, 0)),
    "mg": (1e-6, (0, 1, 0, 0)),
    "t": (1e3, (0, 1, 0, 0)),
    "lb": (0.45359237, (0, 1, 0, 0)),
    "oz": (0.028349523125, (0, 1, 0, 0)),
    "slug": (14.593902937206364, (0, 1, 0, 0)),
    "blob": (175.12683524647636, (0, 1, 0, 0)),
    "s": (1.0, (0, 0, 1, 0)),
    "ms": (1e-3, (0, 0, 1, 0)),
    "min": (60.0, (0, 0, 1, 0)),
    "h": (3600.0, (0, 0, 1, 0)),
    "rad": (1.0, (0, 0, 0, 1)),
    "mrad": (1e-3, (0, 0, 0, 1)),
    "deg": (math.pi / 180, (0, 0, 0, 1)),
    "°": (math.pi / 180, (0, 0, 0, 1)),
    "rev": (2 * math.pi, (0, 0, 0, 1)),
    "rpm": (math.pi / 30, (0, 0, -1, 1)),
    "N": (1.0, (1, 1, -2, 0)),
    "kN": (1e3, (1, 1, -2, 0)),
    "MN": (1e6, (1, 1, -2, 0)),
    "mN": (1e-3, (1, 1, -2, 0)),
    "kgf": (9.80665, (1, 1, -2, 0)),
    "lbf": (4.4482216152605, (1, 1, -2, 0)),
    "J": (1.0, (2, 1, -2, 0)),
    "1": (1.0, (0, 0, 0, 0)),
}

EXPECTED: dict[str, tuple[str, Dimension]] = {
    "length": ("a length such as '120 mm'", (1, 0, 0, 0)),
    "angle": ("an angle such as '30 deg'", (0, 0, 0, 1)),
    "mass": ("a mass such as '0.8 kg'", (0, 1, 0, 0)),
    "inertia": ("a moment of inertia such as '0.01 kg m2'", (2, 1, 0, 0)),
    "speed": ("an angular speed such as '20 rad/s' or '700 rpm'", (0, 0, -1, 1)),
    "acceleration": ("an angular acceleration such as '5 rad/s2'", (0, 0, -2, 1)),
    "jerk": ("an angular jerk such as '5 rad/s3'", (0, 0, -3, 1)),
    "slide speed": ("a speed such as '20 mm/s'", (1, 0, -1, 0)),
    "slide acceleration": ("an acceleration such as '5 m/s2'", (1, 0, -2, 0)),
    "slide jerk": ("a jerk such as '5 m/s3'", (1, 0, -3, 0)),
    "force": ("a force such as '50 N'", (1, 1, -2, 0)),
    "torque": ("a torque such as '3 N m'", (2, 1, -2, 0)),
    "stiffness": ("a stiffness such as '4 N/mm'", (0, 1, -2, 0)),
    "damping": ("a damping such as '4 N s/m'", (0, 1, -1, 0)),
    "torsion stiffness": ("a torsional stiffness such as '4 N m/rad'", (2, 1, -2, -1)),
    "torsion damping": ("a torsional damping such as '4 N m s/rad'", (2, 1, -1, -1)),
    "time": ("a time such as '0.1 s'", (0, 0, 1, 0)),
    "number": ("a number", (0, 0, 0, 0)),
}

# how a column of such quantities ends, and a key of JSON: SI, but degrees
HEADERS: dict[str, str] = {
    "length": "m",
    "angle": "deg",
    "mass": "kg",
    "inertia": "kg_m2",
    "speed": "rad_s",
    "acceleration": "rad_s2",
    "jerk": "rad_s3",
    "slide speed": "m_s",
    "slide acceleration": "m_s2",
    "slide jerk": "m_s3",
    "force": "N",
    "torque": "N_m",
    "stiffness": "N_per_m",
    "damping": "N_s_per_m",
    "torsion stiffness": "N_m_per_rad",
    "torsion damping": "N_m_s_per_rad",
    "number": "",
}

_NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*$")


def unit(text: str) -> tuple[float, Dimension] | None:
    """The SI factor and the dimension of a unit such as `N*mm`, `kg m2`, `rad/s^2`, `g_mm`; None if unknown.

    >>> unit("N/mm")
    (1000.0, (0, 1, -2, 0))
    """
    text = text.replace("**", "^").replace("²", "2").replace("³", "3").replace("_per_", "/")
    factor, total = 1.0, (0, 0, 0, 0)
    for i, side in enumerate(text.split("/")):
        for word in re.split(r"[\s*·._()]+", side.strip()):
            if not word:
                continue
            match = re.fullmatch(r"(\D+?|1)(?:\^?(-?\d))?", word)
            if match is None or match[1].rstrip("^") not in _FACTORS:
                return None
            power = int(match[2] or 1) * (1 if i == 0 else -1)
            base, dimension = _FACTORS[match[1].rstrip("^")]
            factor = factor * base**power if power > 0 else factor / base**-power
            total = tuple(a + power * b for a, b in zip(total, dimension, strict=True))  # type: ignore[assignment]
    return factor, total


def parse(text: str, kind: str) -> float | None:
    """A quantity with its unit in SI; None where text is no quantity of that kind.

    >>> parse("120 mm", "length"), parse("60 rpm", "speed") == 2 * math.pi, parse("3 kg", "length")
    (0.12, True, None)
    """
    match = _NUMBER.match(text)
    found = unit(match[2]) if match and match[2] else None
    if match is None or found is None:
        return None
    factor, dimension = found
    wanted = EXPECTED[kind][1]
    # rad is a pure number: a torque may be N m/rad, but a length is never an angle
    same = dimension == wanted or (
        dimension[:3] == wanted[:3] and wanted[:3] != (0, 0, 0) and 0 in (dimension[3], wanted[3])
    )
    if kind in ("speed", "acceleration", "jerk") and dimension != wanted:
        same = False
    return scaled(match[1], factor) if same else None


def scaled(number: str, factor: float) -> float:
    """number·factor with one rounding, where the factor is a power of ten or an exact inch.

    >>> scaled("0.3", 1e-3), scaled("120", 1e-3)
    (0.0003, 0.12)
    """
    value = float(number)
    if factor >= 1 or not math.isfinite(value):
        return value * factor
    exact = Fraction(repr(factor))
    if exact.denominator > 10**12:
        return value * factor
    return float(Fraction(number) * exact)


def wrong(where: str, found: Any, expected: str) -> DescriptionError:
    """The complaint that something else was expected."""
    return DescriptionError(f"{where}: found {found!r}, expected {expected}")


class Units:
    """What a file's bare numbers mean: its lengths and angles in units of their own, everything else SI."""

    def __init__(self, given: dict[str, Any]) -> None:
        self.factors: dict[str, float] = {}
        for kind, text in given.items():
            found = unit(str(text))
            if found is None or found[1] != EXPECTED[kind][1]:
                raise wrong(
                    f"[units] {kind}",
                    text,
                    f"a unit of {kind} such as '{'deg' if kind == 'angle' else 'mm'}'",
                )
            self.factors[kind] = found[0]

    def number(self, value: Any, kind: str, where: str) -> float:
        """One quantity: a bare number in the file's unit (length, angle) or SI, or a string with its unit."""
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            factor = self.factors.get(kind, 1.0)
            # a whole number of TOML has no bound
            result: float | None = scaled(repr(value), factor) if abs(value) <= LARGEST else math.inf
        elif isinstance(value, str):
            result = parse(value, kind)
            if result is None:
                try:
                    return self.number(float(value), kind, where)
                except ValueError:
                    pass
        else:
            result = None
        if result is None or not abs(result) <= LARGEST:
            raise wrong(where, value, EXPECTED[kind][0])
        return result

    def pair(self, value: Any, kind: str, where: str) -> complex:
        """Two of them, [x, y], as x + iy."""
        if not isinstance(value, list) or len(value) != 2:
            raise wrong(where, value, "two numbers [x, y]")
        return complex(*(self.number(v, kind, where) for v in value))
