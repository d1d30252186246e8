"""Angles in degrees and vectors as complex numbers, without losing what degrees say exactly."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, overload

from dalembert.units import to_si

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

ROUNDED = 4.0


def cosine_sine(angle: NDArray[np.float64], unit: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return cos and sin of angles in a unit; degrees and turns are reduced first, so that 90° and a quarter turn have cosine 0.

    The reduction to within 45° of a quarter turn is exact in degrees, where 360 is a number. The angles may be numbers of 32
    digits too.
    """
    import numpy as np

    angle = angle if hasattr(angle, "high") else np.asarray(angle, dtype=float)
    if unit == "rev":
        angle, unit = np.fmod(angle, 1.0) * 360.0, "deg"
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
    """Return magnitude·e^{i·angle} for an angle in a unit, of floats or of numbers of 32 digits."""
    import numpy as np

    c, s = cosine_sine(angle, unit)
    x, y = magnitude * c, magnitude * s
    z = np.empty_like(x, dtype=complex)
    z.real, z.imag = x, y
    return z


def read_degrees(angle: float) -> float:
    """Return an angle that was read, rad, in degrees: one that was written in degrees comes out as it was written.

    >>> math.degrees(math.radians(60.0)), read_degrees(math.radians(60.0))
    (59.99999999999999, 60.0)
    """
    shown = math.degrees(angle)
    short = float(f"{shown:.15g}")
    return short if abs(math.radians(short) - angle) <= math.ulp(angle) else shown


def in_turn(angle: float, turns: int = 1) -> float:
    """Return an angle in degrees, in [0, 360), or in this number of turns.

    The remainder of a tiny negative angle alone rounds to 360.

    >>> in_turn(-90.0), -1e-20 % 360.0, in_turn(-1e-20)
    (270.0, 360.0, 0.0)
    """
    end = 360.0 * turns
    rest = angle % end
    return rest if rest < end else 0.0


@overload
def degrees(z: NDArray[np.complex128]) -> NDArray[np.float64]: ...
@overload
def degrees(z: complex) -> float: ...
def degrees(z: complex | NDArray[np.complex128]) -> float | NDArray[np.float64]:
    """Return the angle of a complex number, or of each in an array, in degrees in [0, 360); 0 for zero.

    An angle that is one of six decimals but for the rounding of a vector at this angle comes out as that one.

    >>> import numpy as np
    >>> z = phasor(2.0, 30.0, "deg")
    >>> float(np.degrees(np.angle(z))) == 30.0, float(degrees(z))
    (False, 30.0)
    """
    import numpy as np

    vector = np.asarray(z)
    # + 0.0: the angle of -0 is 0, not 180; and a tiny negative angle plus 360 rounds to 360 itself
    angle = np.degrees(np.arctan2(vector.imag + 0.0, vector.real + 0.0)) % 360.0
    short = np.round(angle, 6)
    # cosine and sine, and their products with a size, turn a vector by four units of the last place of its angle at most
    angle = np.where(np.abs(short - angle) <= ROUNDED * np.spacing(angle), short, angle)
    return np.where(angle >= 360.0, 0.0, angle)[()]
