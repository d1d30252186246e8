"""The one table of units: names, dimensions, exact factors. Readers, writers, TOML, options and headers all ask it.

A factor is a pair (numerator, denominator): a value times the one over the other is SI. Decimal units keep integers: then a
decimal is converted with one rounding (`dalembert/decimals.py`). A unit is a word (`mm`), or words joined: `N*mm`,
`kg m2`, `rad/s^2` in files and options, `N_mm`, `kg_m2`, `rad_s2` in headers.
"""

from __future__ import annotations

import math
import re
from collections.abc import Container
from functools import cache
from typing import NamedTuple

from dalembert.decimals import Factor, Scaled, shown, times

# exponents of length, mass, time, angle
Exponents = tuple[int, int, int, int]

LARGEST = 1e60  # no quantity of a machine is larger, and no product of five of them overflows
MINUS = "\N{MINUS SIGN}"  # as word processors and web pages write it
SMALLEST = 1e-60  # what has to be positive is no smaller: it can be divided by
G0 = 9.80665

# an international inch, pound and pound-force, and a turn
_LB = (45359237, 10**8)
_LBF = (45359237 * 980665, 10**13)
_KGF = (980665, 10**5)
_DEG = (math.pi, 180)
_MASS, _FORCE, _TIME = (0, 1, 0, 0), (1, 1, -2, 0), (0, 0, 1, 0)
_LENGTH, _ANGLE, _RATE = (1, 0, 0, 0), (0, 0, 0, 1), (0, 0, -1, 1)

WORDS: dict[str, tuple[Factor, Exponents]] = {
    "m": ((1, 1), _LENGTH),
    "mm": ((1, 1000), _LENGTH),
    "cm": ((1, 100), _LENGTH),
    "um": ((1, 10**6), _LENGTH),
    "nm": ((1, 10**9), _LENGTH),
    "km": ((1000, 1), _LENGTH),
    "in": ((127, 5000), _LENGTH),
    "ft": ((381, 1250), _LENGTH),
    "mil": ((127, 5 * 10**6), _LENGTH),
    "kg": ((1, 1), _MASS),
    "g": ((1, 1000), _MASS),
    "mg": ((1, 10**6), _MASS),
    "t": ((1000, 1), _MASS),
    "lb": (_LB, _MASS),
    "oz": ((45359237, 16 * 10**8), _MASS),
    "slug": ((_LBF[0] * 1250, _LBF[1] * 381), _MASS),
    "blob": ((_LBF[0] * 5000, _LBF[1] * 127), _MASS),
    "s": ((1, 1), _TIME),
    "ms": ((1, 1000), _TIME),
    "min": ((60, 1), _TIME),
    "h": ((3600, 1), _TIME),
    "rad": ((1, 1), _ANGLE),
    "mrad": ((1, 1000), _ANGLE),
    "deg": (_DEG, _ANGLE),
    "rev": ((2 * math.pi, 1), _ANGLE),
    "rpm": ((math.pi, 30), _RATE),
    "Hz": ((2 * math.pi, 1), _RATE),
    "N": ((1, 1), _FORCE),
    "kN": ((1000, 1), _FORCE),
    "MN": ((10**6, 1), _FORCE),
    "mN": ((1, 1000), _FORCE),
    "kgf": (_KGF, _FORCE),
    "lbf": (_LBF, _FORCE),
    "J": ((1, 1), (2, 1, -2, 0)),
    "kJ": ((1000, 1), (2, 1, -2, 0)),
    "W": ((1, 1), (2, 1, -3, 0)),
    "kW": ((1000, 1), (2, 1, -3, 0)),
    "1": ((1, 1), (0, 0, 0, 0)),
}
"""Word -> factor and exponents. Units of more words are made of these."""


class Dimension(NamedTuple):
    """The dimension of a quantity."""

    exponents: Exponents
    units: str
    """Its usual units as headers spell them, blanks between; the first is SI."""
    article: str = "a"
    example: str = ""
    """An example of a value in a file, for messages."""


DIMENSIONS: dict[str, Dimension] = {
    "number": Dimension((0, 0, 0, 0), ""),
    "length": Dimension(_LENGTH, "m mm cm um in ft", example="120 mm"),
    "mass": Dimension(_MASS, "kg g mg lb oz", example="0.8 kg"),
    "force": Dimension(_FORCE, "N kN lbf", example="50 N"),
    "angle": Dimension(_ANGLE, "deg rad", "an", "30 deg"),
    "unbalance": Dimension((1, 1, 0, 0), "kg_m kg_mm g_m g_mm g_cm oz_in g_in lb_in", "an", "30 g mm"),
    "inertia": Dimension((2, 1, 0, 0), "kg_m2 kg_mm2 g_mm2 lb_in2", example="0.01 kg m2"),
    "speed": Dimension(_RATE, "rad_s rpm Hz deg_s", "an", "20 rad/s"),
    "angular acceleration": Dimension((0, 0, -2, 1), "rad_s2 deg_s2 rpm_s", "an", "5 rad/s2"),
    "velocity": Dimension((1, 0, -1, 0), "m_s mm_s in_s", example="20 mm/s"),
    "acceleration": Dimension((1, 0, -2, 0), "m_s2 mm_s2 in_s2", "an", "5 m/s2"),
    "torque": Dimension((2, 1, -2, 0), "N_m N_mm kN_m lbf_in", example="3 N m"),
    "density": Dimension((-3, 1, 0, 0), "kg_m3 g_cm3", example="7850 kg/m3"),
    "area density": Dimension((-2, 1, 0, 0), "kg_m2 g_cm2", "an", "20 kg/m2"),
    "linear density": Dimension((-1, 1, 0, 0), "kg_m g_m", example="2 kg/m"),
    "time": Dimension(_TIME, "s ms min h", example="0.1 s"),
    "angular jerk": Dimension((0, 0, -3, 1), "rad_s3 deg_s3", "an", "5 rad/s3"),
    "jerk": Dimension((1, 0, -3, 0), "m_s3 mm_s3", example="5 m/s3"),
    "stiffness": Dimension((0, 1, -2, 0), "N_per_m N_per_mm", example="4 N/mm"),
    "damping": Dimension((0, 1, -1, 0), "N_s_per_m N_s_per_mm", example="4 N s/m"),
    "torsional stiffness": Dimension((2, 1, -2, -1), "N_m_per_rad N_m_per_deg", example="4 N m/rad"),
    "torsional damping": Dimension((2, 1, -1, -1), "N_m_s_per_rad N_m_s_per_deg", example="4 N m s/rad"),
}
# results alone have these
RESULTS: dict[str, str] = {
    "angular momentum": "kg_m2_s",
    "energy": "J",
    "power": "W",
}

_ENERGY = ("J", "kJ")  # and no torque, whose exponents are the same


def _power(word: str) -> tuple[Factor, Exponents] | None:
    """A word, perhaps with its exponent, such as `m2` or `s^-1`."""
    match = re.fullmatch(r"(\D+?|1)(?:\^?(-?\d))?", word)
    if match is None or match[1].rstrip("^") not in WORDS:
        return None
    (num, den), exponents = WORDS[match[1].rstrip("^")]
    power = int(match[2] or 1)
    if power < 0:
        num, den = den, num
    return (num ** abs(power), den ** abs(power)), _times(exponents, power)


def _times(exponents: Exponents, power: int) -> Exponents:
    a, b, c, d = exponents
    return a * power, b * power, c * power, d * power


@cache
def composed(text: str) -> tuple[Factor, Exponents] | None:
    """The factor and the exponents of a unit; None where it is none.

    Words behind a `/` or `_per_` divide; in a header the time behind another word divides too (`mm_s`, `rpm_s`).

    >>> composed("N/mm"), composed("mm_s"), composed("furlong")
    (((1000, 1), (0, 1, -2, 0)), ((1, 1000), (1, 0, -1, 0)), None)
    """
    text = _spelled(text).replace("_per_", "/")
    num: float = 1
    den: float = 1
    total: Exponents = (0, 0, 0, 0)
    for i, side in enumerate(text.split("/")):
        words = [word for word in re.split(r"[\s*.()_]+", side.strip()) if word]
        for k, word in enumerate(words):
            unit = _power(word)
            if unit is None:
                return None
            (n, d), exponents = unit
            header = k > 0 and k == len(words) - 1 and "_" in side and "/" not in text
            if i or (header and exponents[:2] == (0, 0) and exponents[2] > 0):
                n, d, exponents = d, n, _times(exponents, -1)
            num, den = num * n, den * d
            total = tuple(a + b for a, b in zip(total, exponents, strict=True))  # type: ignore[assignment]
    return _lowest(num, den), total


def _lowest(num: float, den: float) -> Factor:
    if isinstance(num, int) and isinstance(den, int):
        common = math.gcd(num, den)
        return num // common, den // common
    return num, den


SIGNS = {"µ": "u", "μ": "u", MINUS: "-", "°": "deg", "º": "deg", **dict.fromkeys("·⋅×", "*")}
SIGNS |= dict(zip("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-", strict=True))
_PLAIN = str.maketrans(SIGNS)
# revolutions a minute, as instruments of several languages print them
PER_MINUTE = r"(?:1|r|rev|u|tr|giri|rot)\s*/\s*min|min\s*(?:\^?-1|⁻¹)"

_IN_FULL = {
    "m": "metre meter metres meters",
    "mm": "millimetre millimeter millimetres millimeters",
    "um": "micrometre micrometer micrometres micrometers micron microns",
    "in": "inch inches",
    "ft": "foot feet",
    "mil": "mils thou",
    "in_s": "ips",
    "kg": "kg kilogram kilograms kilogramm",
    "g": "gram grams gramm",
    "lb": "lbs pound pounds",
    "oz": "ounce ounces",
    "s": "sec second seconds",
    "deg": "degree degrees",
    "rad": "rads radian radians",
    "rev": "revolution revolutions",
    "rpm": "rpm",
    "N": "newton newtons",
}
"""Units in full and in capitals, as people write them in files and options."""
ABBREVIATIONS = {word: unit for unit, words in _IN_FULL.items() for word in words.split()}
# products without a sign between their words: Nm, kNm, gmm, kgm2; `gm` may be grams
JOINED = r"(?!gm\b)([kMm]?N|kgf?|g|mg|oz|lbf?)(mm|cm|m|in|ft)(s?)(?![A-Za-z])"


def _spelled(text: str) -> str:
    """A unit in plain signs: `µ` is u, `°` deg, `1/min` rpm, `degrees` deg, `Nm` N*m.

    >>> [_spelled(text) for text in ("µm", "inches", "kNm", "gmm", "kgm²", "Nm/rad", "oz-in", "s-1", "gm", "mm")]
    ['um', 'in', 'kN*m', 'g*mm', 'kg*m2', 'N*m/rad', 'oz*in', 's-1', 'gm', 'mm']
    """
    text = text.strip()
    if "min" in text.lower() and re.fullmatch(PER_MINUTE, text.lower()):
        return "rpm"
    text = text.translate(_PLAIN).replace("**", "^")
    # `oz-in` is a product, `s-1` a power
    text = re.sub("(?<=[A-Za-z])-(?=[A-Za-z])", "*", text)
    return re.sub("[A-Za-z]+", _word, text)


def _word(match: re.Match[str]) -> str:
    """A word of a unit as the table has it."""
    word = match[0]
    if joined := re.fullmatch(JOINED, word):
        return "*".join(filter(None, joined.groups()))
    return ABBREVIATIONS.get(word.lower(), word)


# how an amplitude is read, as instruments and people write it: `µm pk-pk`, `in/s 0-pk`, `mm/s RMS`
_P = r"p(?:ea)?k?"
READ_AS = {"_pp": rf"{_P}[ -]*(?:to)?[ -]*{_P}", "_rms": r"r\.?m\.?s\.?|eff", "_pk": rf"(?:0-)?{_P}"}


def unit_name(written: str) -> str:
    """Return a unit as headers spell it: `mm/s` is mm_s, `g·mm` and `g.mm` g_mm, `N/mm` N_per_mm, `µm` um, `°` deg, `1/min` rpm.

    >>> unit_name("µm pk-pk"), unit_name("mm/s RMS"), unit_name("um_pp"), unit_name("oz-in")
    ('um_pp', 'mm_s_rms', 'um_pp', 'oz_in')
    """
    last = written.strip().replace("_", " ").rpartition(" ")[2]
    for tag, words in READ_AS.items() if last[:1] in "0pPrReE" else ():
        if match := re.fullmatch(rf"(.*[^\s_])[\s_]+(?:{words})", written.strip(), re.IGNORECASE):
            return unit_name(match[1]) + tag
    text = _spelled(written).replace("^", "")
    above, slash, below = (part.strip() for part in text.partition("/"))
    if slash:
        joint = (
            "_"
            if re.fullmatch(r"(s|ms|min|h|m|cm|mm)[23]?|in2", below) and not _is_stiffness(above, below)
            else "_per_"
        )
        text = f"{above}{joint}{below}"
    return re.sub("_+", "_", re.sub(r"[\s*./]", "_", text)).strip("_")


def _is_stiffness(above: str, below: str) -> bool:
    """Whether a unit over a length is written out: `N/mm` is N_per_mm, but `kg/m3` is kg_m3."""
    mass = composed(above)
    return "m" in below and "min" not in below and below[:1] != "s" and not (mass and mass[1] == _MASS)


class Units(dict[str, Factor]):
    """The units of a dimension by their names; a name made of words is formed when it is looked up.

    Examples
    --------
    >>> UNITS["length"]["mm"], UNITS["length"]["km"], "km" in UNITS["length"]
    ((1, 1000), (1000, 1), False)
    """

    def __init__(self, dimension: str) -> None:
        self.exponents = DIMENSIONS[dimension].exponents
        names = DIMENSIONS[dimension].units.split()
        super().__init__({name: self.factor(name) for name in names} or {"": (1, 1)})

    def factor(self, name: str) -> Factor:
        """The factor of a unit; KeyError where it is none of this dimension."""
        unit = composed(name)
        if unit is not None and unit[1] == self.exponents and name not in _ENERGY:
            return unit[0]
        # `kg_m3` in a header is a mass over a volume
        head, _, tail = name.rpartition("_")
        unit = composed(f"{head}/{tail}") if head and tail[:1] in "mc" else None
        if unit is None or unit[1] != self.exponents or unit[1][0] >= 0:
            raise KeyError(name)
        return unit[0]

    def __missing__(self, name: str) -> Factor:
        return self.factor(name)


class _Listed(dict[str, Factor]):
    """Units that are listed, no other: with a tag behind them, of several dimensions, or of results alone."""


UNITS: dict[str, dict[str, Factor]] = {dimension: Units(dimension) for dimension in DIMENSIONS}
"""Dimension -> unit -> factor. The first unit of each dimension is SI (of an angle: degrees)."""
LISTED = {dimension: tuple(units) for dimension, units in UNITS.items()}
"""Dimension -> its usual units, for messages and for headers whose quantity is not known."""

# A vibration is a displacement, a velocity, an acceleration or what an instrument gave without a scale; it keeps its
# unit, and the units of different rows do not mix.
AMPLITUDES: dict[str, dict[str, Factor]] = {
    "length": {name: UNITS["length"].get(name) or WORDS[name][0] for name in ("um", "mm", "m", "mil", "in")},
    "velocity": {name: UNITS["velocity"][name] for name in ("mm_s", "m_s", "in_s")},
    "acceleration": {"mm_s2": (1, 1000), "m_s2": (1, 1), "g": _KGF},
    "voltage": {"V": (1, 1), "mV": (1, 1000)},
    "digital signal": {"counts": (1, 1)},
}
# A tag says how it is read: peak, peak to peak, r.m.s.; amplitudes of different tags are different quantities.
TAGS = ("", "_pk", "_pp", "_rms")
UNITS["amplitude"] = _Listed(
    {unit + tag: si for tag in TAGS for units in AMPLITUDES.values() for unit, si in units.items()}
)
# What influence coefficients are per: a mass or an unbalance.
UNITS["per"] = _Listed({name: UNITS[of][name] for of in ("mass", "unbalance") for name in LISTED[of]})
LISTED |= {dimension: tuple(UNITS[dimension]) for dimension in ("amplitude", "per")}
UNITS |= {
    dimension: _Listed({unit: WORDS[unit][0] for unit in units})
    for dimension, units in {"energy": _ENERGY, "power": ("W", "kW")}.items()
}


def _tag(unit: str) -> str:
    return next((tag for tag in TAGS[1:] if unit.endswith(tag)), "")


def amplitude_kind(unit: str) -> tuple[str, str]:
    """Return what an amplitude measures (length, velocity, acceleration …) and its tag; only like ones convert."""
    tag = _tag(unit)
    bare = unit.removesuffix(tag)
    return next(kind for kind, units in AMPLITUDES.items() if bare in units), tag


_SPOKEN = {"_pp": " pk-pk", "_pk": " pk", "_rms": " r.m.s."}


def written(unit: str) -> str:
    """Return a unit as people write it: `g·mm`, `mm/s²`, `µm pk-pk`, `°`; the other way round than `unit_name`."""
    tag = _tag(unit)
    bare = unit.removesuffix(tag).replace("um", "µm").replace("deg", "°").replace("_per_", "/")
    for per in ("_s3", "_s2", "_s", "_min", "_h", "_m3", "_cm3"):
        if bare.endswith(per) and "/" not in bare:
            bare = f"{bare.removesuffix(per)}/{per[1:]}"
            break
    return bare.translate(str.maketrans("_23", "·²³")) + _SPOKEN.get(tag, "")


def find_unit(dimension: str, suffix: str) -> str | None:
    """Return the unit of this dimension whose name is `suffix`, in any case of letters; None if there is none."""
    units = UNITS[dimension]
    if suffix in units:
        return suffix
    same = next((unit for unit in units if unit.lower() == suffix.lower()), None)
    if same is not None or not suffix:
        return same
    # of units that are made of words the case counts (`kN_mm`), unless all are small
    for name in (unit_name(suffix), unit_name(suffix.lower())):
        try:
            units[name]
        except KeyError:
            continue
        return name
    return None


@cache
def _dimensions(unit: str) -> frozenset[str]:
    named = {
        dimension
        for dimension, units in LISTED.items()
        if dimension not in ("number", "amplitude", "per") and unit.lower() in map(str.lower, units)
    }
    amplitude = next((name for name in LISTED["amplitude"] if name.lower() == unit.lower()), None)
    return frozenset(named | {amplitude_kind(amplitude)[0]} if amplitude else named)


def dimensions(unit: str) -> set[str]:
    """Return the dimensions that list a unit of this name; of an amplitude, what it measures."""
    return set(_dimensions(unit))


def parted(name: str, further: Container[str] = ()) -> tuple[str, str]:
    """Part a column's name from the unit at its end, the longest that is one; `further` are units of no input.

    >>> parted("trial_mass_g"), parted("x_N_m"), parted("plane")
    (('trial_mass', 'g'), ('x', 'N_m'), ('plane', ''))
    """
    parts = name.split("_")
    for k in range(1, len(parts)):
        unit = "_".join(parts[k:])
        if unit in further or _dimensions(unit):
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
    word, listed = suffix.lower(), LISTED[dimension]
    same = [unit for unit in listed if word.replace("_", "") == unit.lower().replace("_", "")]
    plural = [unit for unit in listed if word == f"{unit.lower()}s"]
    if same or plural:
        return f"; did you mean '{(same or plural)[0]}'?"

    # mm2 is no misspelt mm, nor mil_s a misspelt mil or mil_rms: short words are not guessed at
    def like(unit: str) -> bool:
        return (
            unit.count("_") >= suffix.count("_")
            and _tag(unit) == _tag(suffix)
            and re.findall(r"\d", unit) == re.findall(r"\d", suffix)
        )

    from dalembert.hints import nearest

    return nearest(suffix, filter(like, listed), cutoff=0.75) if len(suffix) > 3 else ""


def common_dimension(unit: str, other: str) -> str | None:
    """Return the dimension of a listed unit that `unit`, in any case of letters, is of too; None if it is of another.

    >>> common_dimension("mg_mm", "kg_m"), common_dimension("um_pp", "um"), common_dimension("kJ", "N_m")
    ('unbalance', None, None)
    """
    vibrations = [find_unit("amplitude", name) for name in (unit, other)]
    if vibrations[0] and vibrations[1]:
        one, two = map(amplitude_kind, filter(None, vibrations))
        return "amplitude" if one == two else None
    kinds = (d for d, units in UNITS.items() if d not in ("number", "amplitude", "per") and other in units)
    return next((d for d in kinds if find_unit(d, unit) is not None), None)


def to_si(value: Scaled, dimension: str, unit: str) -> Scaled:
    """Convert a number or an array from `unit` to SI; a decimal of at most 15 figures is rounded once.

    >>> to_si(7.1, "mass", "g"), from_si(0.0071, "mass", "g")
    (0.0071, 7.1)
    """
    return times(value, *UNITS[dimension][unit])


def from_si(value: Scaled, dimension: str, unit: str) -> Scaled:
    """Convert a number or an array from SI to `unit`: a short decimal in `unit` comes back as it was written."""
    return shown(value, *UNITS[dimension][unit])
