"""The loads of a mechanism, as its designer gives them: forces, torques, springs, motors, friction."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Force:
    """A force of fixed components in ground or link axes (N), at a point of a link.

    The point is given in the link's axes (m), by its name, or not at all: the link's own centre of mass.
    `history` is a table (input, force) in place of a constant, linear between its rows; with a turning input and a
    span of whole turns it is `periodic`, one cycle that repeats.
    """

    link: str
    point: complex | str | None
    force: complex = 0j
    frame: Literal["ground", "link"] = "ground"
    history: tuple[tuple[float, complex], ...] | None = None
    periodic: bool = False


@dataclass(frozen=True)
class Torque:
    """A torque on a link, N·m, counter-clockwise.

    `history` is a table (x, torque) in place of a constant, linear between its rows, `over` the time (s), the link's
    angle (rad) or its speed (rad/s); over an angle with a span of whole turns it is `periodic`.
    """

    link: str
    torque: float = 0.0
    history: tuple[tuple[float, float], ...] | None = None
    over: Literal["time", "angle", "speed"] = "time"
    periodic: bool = False


@dataclass(frozen=True)
class Spring:
    """A spring and damper between two points, each given as (link, point): its name, or its place in the link's axes."""

    between: tuple[tuple[str, complex | str], tuple[str, complex | str]]
    stiffness: float = 0.0
    free_length: float = 0.0
    damping: float = 0.0


@dataclass(frozen=True)
class TorsionSpring:
    """A torsion spring and damper between two links; its angle is θ_second − θ_first."""

    links: tuple[str, str]
    stiffness: float = 0.0
    free_angle: float = 0.0
    damping: float = 0.0


@dataclass(frozen=True)
class Motor:
    """A motor carried by one link and driving another; its mass joins the carrier (Ibrahim §2.3)."""

    carrier: str
    drives: str
    mass: float = 0.0
    center: complex = 0j


@dataclass(frozen=True)
class Friction:
    """Coulomb friction in a joint: a pin of `radius`, or a guide (radius 0)."""

    joint: str
    coefficient: float
    radius: float = 0.0
