"""The combinations of motion of Ibrahim §1.6–1.11, each with its parts reported apart.

The plane is complex: a vector is x + iy, i·r is r turned by +90°, so that ω×r is iωr. All functions take numbers or
arrays (SI, radians) and return a frozen result; `sense(v)` is the direction in which a part points.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from dalembert.arithmetic.varied import direction
from virtualwork.formulas.closed_forms import angle_and_slide, two_columns
from virtualwork.formulas.numbers import MANY

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

# complex, or an array of complex
Vector = Any


def sense(vector: Vector) -> Any:
    """Return the direction of a vector, (...), rad in [0, 2π) from the horizontal; NaN for a zero vector.

    Parameters
    ----------
    vector : complex, (...)
        x + iy, in any unit.

    Notes
    -----
    Ibrahim §1.2.

    Examples
    --------
    >>> float(np.degrees(sense(-2j)))
    270.0
    """
    v = np.asarray(vector, dtype=complex)
    angle = np.mod(np.arctan2(v.imag + 0.0, v.real + 0.0), 2 * np.pi)
    return np.where(v == 0, np.nan, np.where(angle >= 2 * np.pi, 0.0, angle))[()]


def _vector(x: Vector) -> Any:
    """A vector or several, as numbers of numpy: a list of them is no number of Python's."""
    return np.asarray(x, dtype=complex)[()]


@dataclass(frozen=True)
class Translation:
    """Position, velocity and acceleration of a body that only translates, x + iy."""

    position: Vector
    velocity: Vector
    acceleration: Vector


def on_incline(
    angle: float,
    distance: ArrayLike,
    speed: ArrayLike = 0.0,
    acceleration: ArrayLike = 0.0,
    start: complex = 0j,
) -> Translation:
    """Return the motion of a body that slides on a fixed incline (Ibrahim eqs 1.6.1–1.6.8), in components.

    Parameters
    ----------
    angle : float
        Of the incline, rad; 90° is as good as any other.
    distance, speed, acceleration : float or array
        Along the incline from `start`, m, m/s, m/s².

    Returns
    -------
    Translation
        Position, velocity and acceleration in components, complex, m, m/s, m/s².

    Examples
    --------
    >>> body = on_incline(np.radians(30), 2.0, 1.0)
    >>> complex(np.round(body.position, 6)), complex(np.round(body.velocity, 6))
    ((1.732051+1j), (0.866025+0.5j))
    """
    u = direction(angle)
    return Translation(start + np.multiply(distance, u), np.multiply(speed, u), np.multiply(acceleration, u))


@dataclass(frozen=True)
class Relative:
    """V_A = V_R + V_A/R and A_A = A_R + A_A/R: what is carried along, what is relative, and their sum."""

    carried_velocity: Vector
    relative_velocity: Vector
    velocity: Vector
    carried_acceleration: Vector
    relative_acceleration: Vector
    acceleration: Vector


def on_moving_ramp(
    angle: float,
    ramp_velocity: Vector,
    speed: ArrayLike,
    ramp_acceleration: Vector = 0j,
    acceleration: ArrayLike = 0.0,
) -> Relative:
    """Return the motion of a body that slides on a ramp which itself translates (Ibrahim eqs 1.7.4–1.7.6).

    Parameters
    ----------
    angle : float
        Of the ramp, rad.
    ramp_velocity, ramp_acceleration : complex
        Of the ramp, x + iy.
    speed, acceleration : float or array
        Of the body along the ramp, relative to it.

    Returns
    -------
    Relative
        Velocity and acceleration of the body with their parts, complex, m/s, m/s².

    Examples
    --------
    >>> on_moving_ramp(np.pi / 2, 2 + 0j, 3.0).velocity
    np.complex128(2+3j)
    """
    u = direction(angle)
    v, a = np.multiply(speed, u), np.multiply(acceleration, u)
    return Relative(ramp_velocity, v, ramp_velocity + v, ramp_acceleration, a, ramp_acceleration + a)


@dataclass(frozen=True)
class Rotation:
    """Velocity of a point of a turning body, its tangential and normal acceleration, and their sum."""

    velocity: Vector
    tangential: Vector
    normal: Vector
    acceleration: Vector


def rotation(arm: Vector, omega: ArrayLike, alpha: ArrayLike = 0.0) -> Rotation:
    """Return the motion of a point of a body that turns about a fixed point (Ibrahim eqs 1.8.1–1.8.5).

    Parameters
    ----------
    arm : complex
        R, from the fixed point to the point, m.
    omega, alpha : float or array
        rad/s, rad/s².

    Returns
    -------
    Rotation
        Velocity V = ω×R, tangential Aᵗ = α×R and normal acceleration Aⁿ = −ω²R, complex, m/s, m/s².

    Examples
    --------
    >>> p = rotation(2 + 0j, 3.0, 5.0)
    >>> complex(p.velocity), complex(p.tangential), complex(p.normal)
    (6j, 10j, (-18+0j))
    """
    r, w, a = _vector(arm), np.asarray(omega, dtype=float)[()], np.asarray(alpha, dtype=float)[()]
    tangential, normal = 1j * a * r, -(w * w) * r
    return Rotation(1j * w * r, tangential, normal, tangential + normal)


@dataclass(frozen=True)
class TwoPoints:
    """V_B = V_A + V_BA and A_B = A_A + Aᵗ_BA + Aⁿ_BA for two points of one body."""

    velocity: Vector
    velocity_difference: Vector
    tangential: Vector
    normal: Vector
    acceleration: Vector


def second_point(
    arm: Vector, omega: ArrayLike, alpha: ArrayLike, velocity: Vector, acceleration: Vector = 0j
) -> TwoPoints:
    """Return the motion of a second point B of a body from that of its point A (Ibrahim eqs 1.9.1–1.9.4).

    Parameters
    ----------
    arm : complex
        R_BA, from A to B.
    omega, alpha : float or array
        Of the body.
    velocity, acceleration : complex
        Of A.

    Returns
    -------
    TwoPoints
        Velocity and acceleration of B with their parts, complex, m/s, m/s².

    Examples
    --------
    >>> complex(second_point(1 + 0j, 2.0, 0.0, velocity=1j).velocity)
    3j
    """
    turn = rotation(arm, omega, alpha)
    return TwoPoints(
        _vector(velocity) + turn.velocity,
        turn.velocity,
        turn.tangential,
        turn.normal,
        _vector(acceleration) + turn.acceleration,
    )


@dataclass(frozen=True)
class SlidingBlock:
    """The parts of the motion of a block that slides on a turning, translating bar (Ibrahim eq. 1.10.7).

    `carried_…` is the bar's own point under the block; velocity = carrier + turning + relative; acceleration =
    carrier + tangential + normal + relative + Coriolis.
    """

    carrier_velocity: Vector
    turning_velocity: Vector
    relative_velocity: Vector
    velocity: Vector
    carrier_acceleration: Vector
    tangential: Vector
    normal: Vector
    relative_acceleration: Vector
    coriolis: Vector
    acceleration: Vector


def block_on_bar(
    arm: Vector,
    omega: ArrayLike,
    alpha: ArrayLike,
    speed: ArrayLike,
    acceleration: ArrayLike = 0.0,
    carrier_velocity: Vector = 0j,
    carrier_acceleration: Vector = 0j,
    along: Vector | None = None,
) -> SlidingBlock:
    """Return the motion of a block on a bar which turns and translates (Ibrahim eqs 1.10.1–1.10.7).

    Parameters
    ----------
    arm : complex
        R_BA, from the bar's point A to the block, m.
    omega, alpha : float or array
        Of the bar, rad/s, rad/s².
    speed, acceleration : float or array
        Of the block along the bar, relative to it, m/s, m/s².
    carrier_velocity, carrier_acceleration : complex
        Of the bar's point A.
    along : complex, optional
        Unit vector of the guide; by default that of the arm: NaN where the arm has no length.

    Returns
    -------
    SlidingBlock
        Velocity and acceleration of the block with their parts, complex, m/s, m/s².

    Examples
    --------
    A bar along x turns with 2 rad/s, the block moves outwards with 3 m/s: Coriolis 2·2·3 = 12 m/s², upwards.

    >>> block = block_on_bar(1 + 0j, 2.0, 0.0, 3.0)
    >>> complex(block.coriolis), float(np.degrees(sense(block.coriolis))), complex(block.normal)
    (12j, 90.0, (-4+0j))
    """
    with np.errstate(invalid="ignore"):
        u = _vector(arm) / np.abs(arm) if along is None else _vector(along)
    turn = rotation(arm, omega, alpha)
    relative_v, relative_a = np.multiply(speed, u), np.multiply(acceleration, u)
    coriolis = 2j * np.asarray(omega, dtype=float)[()] * relative_v
    return SlidingBlock(
        carrier_velocity,
        turn.velocity,
        relative_v,
        _vector(carrier_velocity) + turn.velocity + relative_v,
        carrier_acceleration,
        turn.tangential,
        turn.normal,
        relative_a,
        coriolis,
        _vector(carrier_acceleration) + turn.tangential + turn.normal + relative_a + coriolis,
    )


@dataclass(frozen=True)
class Piston:
    """One solution set of the crank, rod and piston: rod angle, piston, and their rates."""

    rod_angle: Any
    position: Vector
    slide: Any
    rod_omega: Any
    velocity: Vector
    rod_alpha: Any
    acceleration: Vector


def crank_rod_piston(
    crank: float,
    rod: float,
    angle: ArrayLike,
    omega: ArrayLike = 0.0,
    alpha: ArrayLike = 0.0,
    incline: float = 0.0,
    through: complex = 0j,
) -> tuple[Piston, Piston]:
    """Return both solutions of a crank, rod and piston on an inclined line (Ibrahim §1.11).

    The rates come from the linear systems (1.11.8, 10, 11) and (1.11.12–14), with the line's condition written as
    V_By·cos α = V_Bx·sin α: printed with |·| it loses the sign, and with tan α it fails at 90°.

    Parameters
    ----------
    crank, rod : float
        Lengths, m; the crank's pivot is the origin.
    angle, omega, alpha : float or array
        Of the crank.
    incline : float
        Angle of the piston's line, rad.
    through : complex
        A point of the line.

    Returns
    -------
    two Piston
        The one further along the line first; NaN where the rod does not reach the line.

    Examples
    --------
    The printed textbook case r = 1, l = 3 at 90°, ω = 1: x = √8, v = −1, a = 1/√8.

    >>> p, _ = crank_rod_piston(1, 3, np.pi / 2, 1.0)
    >>> [round(float(x), 12) for x in (p.slide, p.velocity.real, p.acceleration.real)]
    [2.828427124746, -1.0, 0.353553390593]
    """
    theta = np.asarray(angle, dtype=float)
    w2, a2 = np.asarray(omega, dtype=float), np.asarray(alpha, dtype=float)
    u = direction(incline)
    arm = crank * np.exp(1j * theta)
    states = []
    with np.errstate(all="ignore"):
        for sign in (-1, 1):
            # −1: further along the line. R_A − R_through + rod·e^{iθ3} − s·u = 0
            e, slide, _ = angle_and_slide(arm - through, complex(rod), -u, sign, MANY)
            turned = rod * e
            # the two real equations of the loop's derivative, unknowns ω3 and ṡ
            w3, v, _ = two_columns(1j * w2 * arm, 1j * turned, np.full_like(turned, -u))
            quadratic = 1j * a2 * arm - w2 * w2 * arm - w3 * w3 * turned
            a3, a, _ = two_columns(quadratic, 1j * turned, np.full_like(turned, -u))
            states.append(Piston(np.angle(e), through + slide * u, slide, w3, v * u, a3, a * u))
    return states[0], states[1]
