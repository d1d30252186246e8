"""Units: the suffix of a column's name, the unit of an option's value. Inside, everything is SI and radians.

A unit is a pair (numerator, denominator): a value times the one over the other is SI. Decimal units
keep an integer denominator, because 20/1000 is the correctly rounded 0.02 and 20*0.001 need not be.
"""

from __future__ import annotations

import math
import re
from collections.abc import Container
from typing import TYPE_CHECKING, TypeVar, overload

from cli.errors import nearest

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Unit = tuple[float, float]
Scaled = TypeVar("Scaled", float, complex, "NDArray[np.float64]", "NDArray[np.complex128]")

_LENGTH: dict[str, Unit] = {"m": (1, 1), "mm": (1, 1000), "cm": (1, 100), "um": (1, 10**6), "in": (127, 5000)}
_LB = (45359237, 10**8)
_OZ = (45359237, 16 * 10**8)
G0 = 9.80665
_TURN = (math.pi, 180)

UNITS: dict[str, dict[str, Unit]] = {
    "number": {"": (1, 1)},
    "length": _LENGTH,
    "mass": {"kg": (1, 1), "g": (1, 1000), "mg": (1, 10**6), "lb": _LB, "oz": _OZ},
    "force": {"N": (1, 1), "kN": (1000, 1), "lbf": (_LB[0] * G0, _LB[1])},
    "angle": {"deg": _TURN, "rad": (1, 1)},
    "unbalance": {
        "kg_m": (1, 1),
        "kg_mm": (1, 1000),
        "g_m": (1, 1000),
        "g_mm": (1, 10**6),
        "g_cm": (1, 10**5),
        "oz_in": (_OZ[0] * 127, _OZ[1] * 5000),
        "g_in": (127, 5 * 10**6),
        "lb_in": (_LB[0] * 127, _LB[1] * 5000),
    },
    "inertia": {
        "kg_m2": (1, 1),
        "kg_mm2": (1, 10**6),
        "g_mm2": (1, 10**9),
        "lb_in2": (_LB[0] * 127**2, _LB[1] * 5000**2),
    },
    "speed": {"rad_s": (1, 1), "rpm": (math.pi, 30), "Hz": (2 * math.pi, 1), "deg_s": _TURN},
    "angular acceleration": {"rad_s2": (1, 1), "deg_s2": _TURN, "rpm_s": (math.pi, 30)},
    "velocity": {"m_s": (1, 1), "mm_s": (1, 1000), "in_s": (127, 5000)},
    "acceleration": {"m_s2": (1, 1), "mm_s2": (1, 1000), "in_s2": (127, 5000)},
    "torque": {
        "N_m": (1, 1),
        "N_mm": (1, 1000),
        "kN_m": (1000, 1),
        "lbf_in": (_LB[0] * G0 * 127, _LB[1] * 5000),
    },
    "density": {"kg_m3": (1, 1), "g_cm3": (1000, 1)},
    "area density": {"kg_m2": (1, 1), "g_cm2": (10, 1)},
    "linear density": {"kg_m": (1, 1), "g_m": (1, 1000)},
    "time": {"s": (1, 1), "ms": (1, 1000), "min": (60, 1), "h": (3600, 1)},
    "angular jerk": {"rad_s3": (1, 1), "deg_s3": _TURN},
    "jerk": {"m_s3": (1, 1), "mm_s3": (1, 1000)},
    "stiffness": {"N_per_m": (1, 1), "N_per_mm": (1000, 1)},
    "damping": {"N_s_per_m": (1, 1), "N_s_per_mm": (1000, 1)},
    "torsional stiffness": {"N_m_per_rad": (1, 1), "N_m_per_deg": (180, math.pi)},
    "torsional damping": {"N_m_s_per_rad": (1, 1), "N_m_s_per_deg": (180, math.pi)},
}
"""Dimension -> suffix -> unit. The first suffix of each dimension is SI."""

# A vibration is a displacement, a velocity, an acceleration or what an instrument gave without a scale; it keeps its
# unit, and the units of different rows do not mix.
AMPLITUDES: dict[str, dict[str, Unit]] = {
    "length": {
        "um": (1, 10**6),
        "mm": (1, 1000),
        "m": (1, 1),
        "mil": (127, 5 * 10**6),
        "in": (127, 5000),
    },
    "velocity": {"mm_s": (1, 1000), "m_s": (1, 1), "in_s": (127, 5000)},
    "acceleration": {"mm_s2": (1, 1000), "m_s2": (1, 1), "g": (G0, 1)},
    "voltage": {"V": (1, 1), "mV": (1, 1000)},
    "digital signal": {"counts": (1, 1)},
}
# A tag says how it is read: peak, peak to peak, r.m.s.; amplitudes of different tags are different quantities.
TAGS = ("", "_pk", "_pp", "_rms")
UNITS["amplitude"] = {
    unit + tag: si for tag in TAGS for units in AMPLITUDES.values() for unit, si in units.items()
}

# What influence coefficients are per: a mass or an unbalance.
UNITS["per"] = {**UNITS["mass"], **UNITS["unbalance"]}


def _tag(unit: str) -> str:
    return next((tag for tag in TAGS[1:] if unit.endswith(tag)), "")


def amplitude_kind(unit: str) -> tuple[str, str]:
    """Return what an amplitude measures (length, velocity, acceleration …) and its tag; only like ones convert."""
    tag = _tag(unit)
    bare = unit.removesuffix(tag)
    return next(kind for kind, units in AMPLITUDES.items() if bare in units), tag


_QUANTITY = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*\Z", re.ASCII)


_SIGNS = str.maketrans(
    {"µ": "u", "μ": "u", "°": "deg", "²": "2", "³": "3", "^": ""} | dict.fromkeys("·⋅×* /", "_")
)
# compiled where a unit may be one: that takes longer than to read a small table
_PER_MINUTE = r"(?:1|r|rev|u|tr|giri|rot)\s*/\s*min|min\s*(?:\^?-1|⁻¹)"


def unit_name(written: str) -> str:
    """Return a unit as the suffixes spell it: `mm/s` is mm_s, `g·mm` g_mm, `µm` um, `°` deg, `1/min` rpm."""
    written = written.strip()
    if "min" in written.lower() and re.fullmatch(_PER_MINUTE, written.lower()):
        return "rpm"
    return re.sub("_+", "_", written.translate(_SIGNS)).strip("_")


_SPOKEN = {"_pp": " pk-pk", "_pk": " pk", "_rms": " r.m.s."}


def written(unit: str) -> str:
    """Return a unit as people write it: `g·mm`, `mm/s²`, `µm pk-pk`, `°`; the other way round than `unit_name`."""
    tag = _tag(unit)
    bare = unit.removesuffix(tag).replace("um", "µm").replace("deg", "°")
    for per in ("_s3", "_s2", "_s", "_m3", "_cm3"):
        if bare.endswith(per):
            bare = f"{bare.removesuffix(per)}/{per[1:]}"
            break
    return bare.translate(str.maketrans("_23", "·²³")) + _SPOKEN.get(tag, "")


def find_unit(dimension: str, suffix: str) -> str | None:
    """Return the unit of this dimension whose name is `suffix`, in any case of letters; None if there is none."""
    units = UNITS[dimension]
    if suffix in units:
        return suffix
    return next((unit for unit in units if unit.lower() == suffix.lower()), None)


def dimensions(unit: str) -> set[str]:
    """Return the dimensions that have a unit of this name; of an amplitude, what it measures."""
    found = {
        dimension
        for dimension in UNITS
        if dimension not in ("number", "amplitude", "per") and find_unit(dimension, unit)
    }
    amplitude = find_unit("amplitude", unit)
    return found | {amplitude_kind(amplitude)[0]} if amplitude else found


def parted(name: str, further: Container[str] = ()) -> tuple[str, str]:
    """Part a column's name from the unit at its end, the longest that is one; `further` are units of no input.

    >>> parted("trial_mass_g"), parted("x_N_m"), parted("plane")
    (('trial_mass', 'g'), ('x', 'N_m'), ('plane', ''))
    """
    parts = name.split("_")
    for k in range(1, len(parts)):
        unit = "_".join(parts[k:])
        if unit in further or dimensions(unit):
            return "_".join(parts[:k]), unit
    return name, ""


def column_dimensions(name: str) -> set[str]:
    """Return the dimensions of the unit at the end of a column's name; none for a name."""
    return dimensions(parted(name)[1])


def nearest_unit(suffix: str, dimension: str) -> str:
    """Suggest the unit of the dimension that is meant; a unit of another dimension is called what it is."""
    others = dimensions(suffix)
    if others:
        return f"; '{suffix}' is a unit of {' or '.join(sorted(others))}"
    word = suffix.lower()
    same = [unit for unit in UNITS[dimension] if word.replace("_", "") == unit.lower().replace("_", "")]
    plural = [unit for unit in UNITS[dimension] if word == f"{unit.lower()}s"]
    if same or plural:
        return f"; did you mean '{(same or plural)[0]}'?"

    # mm2 is no misspelt mm, nor mil_s a misspelt mil or mil_rms: short words are not guessed at
    def like(unit: str) -> bool:
        return (
            unit.count("_") >= suffix.count("_")
            and _tag(unit) == _tag(suffix)
            and re.findall(r"\d", unit) == re.findall(r"\d", suffix)
        )

    return nearest(suffix, filter(like, UNITS[dimension]), cutoff=0.75) if len(suffix) > 3 else ""


def to_si(value: Scaled, dimension: str, unit: str) -> Scaled:
    """Convert a number or an array from `unit` to SI."""
    numerator, denominator = UNITS[dimension][unit]
    return value * numerator / denominator


def from_si(value: Scaled, dimension: str, unit: str) -> Scaled:
    """Convert a number or an array from SI to `unit`."""
    numerator, denominator = UNITS[dimension][unit]
    return value * denominator / numerator


LARGEST = 1e60  # no quantity of a machine is larger, and no product of five of them overflows
SMALLEST = 1e-60  # what has to be positive is no smaller: it can be divided by


def parse_number(text: str) -> float:
    """Read a finite decimal number; ValueError otherwise (NaN, inf, `1_000`, `0x10`, above 1e60)."""
    text = text.strip()
    if not text.isascii() or "_" in text:
        raise ValueError(text)
    value = float(text)
    if not abs(value) <= LARGEST:
        raise ValueError(text)
    return value


def is_number(text: str) -> bool:
    """Whether a text is a number and nothing else."""
    try:
        parse_number(text)
    except ValueError:
        return False
    return True


def parse_quantity(text: str, dimension: str) -> tuple[float, str]:
    """Read an option's value such as `3000rpm` or `30 g_mm`: the number and the unit it was given in.

    Raises ValueError with a sentence that says what is wrong and which units there are.
    """
    known = ", ".join(UNITS[dimension])
    match = _QUANTITY.match(text)
    if match is None:
        raise ValueError(f"'{text}' is not a number with a unit (units: {known})")
    number, suffix = match.groups()
    suffix = unit_name(suffix)
    unit = find_unit(dimension, suffix)
    if unit is None:
        if not suffix:
            raise ValueError(f"'{text}' has no unit (units: {known})")
        raise ValueError(
            f"'{text}' has the unknown {dimension} unit '{suffix}' (units: {known}){nearest_unit(suffix, dimension)}"
        )
    value = float(number)
    if not abs(value) <= LARGEST:
        raise ValueError(f"'{text}' is too large a number")
    return value, unit


def cosine_sine(angle: NDArray[np.float64], unit: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return cos and sin of angles in `deg` or `rad`; degrees are reduced first, so that 90° has cosine 0.

    The reduction to within 45° of a quarter turn is exact in degrees, where 360 is a number.
    """
    import numpy as np

    angle = np.asarray(angle, dtype=float)
    if unit != "deg":
        angle = to_si(angle, "angle", unit)
        return np.cos(angle), np.sin(angle)
    turn = np.fmod(angle, 360.0)
    quarter = np.rint(turn / 90.0)
    rest = (turn - 90.0 * quarter) * (math.pi / 180)
    c, s = np.cos(rest), np.sin(rest)
    q = quarter.astype(np.int64) % 4
    # + 0.0 turns -0.0 into 0.0
    return np.choose(q, [c, -s, -c, s]) + 0.0, np.choose(q, [s, c, -s, -c]) + 0.0


def phasor(magnitude: NDArray[np.float64], angle: NDArray[np.float64], unit: str) -> NDArray[np.complex128]:
    """Return magnitude·e^{i·angle} for an angle in `deg` or `rad`."""
    import numpy as np

    c, s = cosine_sine(angle, unit)
    z = np.empty(np.broadcast(magnitude, c).shape, dtype=complex)
    z.real, z.imag = magnitude * c, magnitude * s
    return z


def read_degrees(angle: float) -> float:
    """Return an angle that was read, rad, in degrees: one that was written in degrees comes out as it was written.

    >>> math.degrees(math.radians(60.0)), read_degrees(math.radians(60.0))
    (59.99999999999999, 60.0)
    """
    shown = math.degrees(angle)
    short = float(f"{shown:.15g}")
    return short if abs(math.radians(short) - angle) <= math.ulp(angle) else shown


@overload
def degrees(z: NDArray[np.complex128]) -> NDArray[np.float64]: ...
@overload
def degrees(z: complex) -> float: ...
def degrees(z: complex | NDArray[np.complex128]) -> float | NDArray[np.float64]:
    """Return the angle of a complex number, or of each in an array, in degrees in [0, 360); 0 for zero."""
    import numpy as np

    vector = np.asarray(z)
    # + 0.0: the angle of -0 is 0, not 180; and a tiny negative angle plus 360 rounds to 360 itself
    angle = np.degrees(np.arctan2(vector.imag + 0.0, vector.real + 0.0)) % 360.0
    return np.where(angle >= 360.0, 0.0, angle)[()]
