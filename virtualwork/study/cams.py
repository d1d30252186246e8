"""What a designer asks of a cam: the largest pressure angle, undercutting, steps of its law, the speed of lift-off."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from operator import itemgetter

import numpy as np

from virtualwork.branch.assembly import Assembly
from virtualwork.describe.cams import CamDrive
from virtualwork.describe.description import Description
from virtualwork.describe.laws import TURN
from virtualwork.formulas.dynamics import Dynamics
from virtualwork.formulas.lanes import Lanes
from virtualwork.formulas.lifts import lift, located, placed
from virtualwork.formulas.numbers import ONE, Reals
from virtualwork.formulas.profiles import FINE, profile
from virtualwork.formulas.touches import Touching, carried

# of the largest value of a derivative: what differs less between two pieces is no step
STEP = 1e-9
# of the input over which contact is looked at, before the least is refined
SAMPLES = 720


@dataclass(frozen=True)
class CamCheck:
    """The character of a cam.

    Attributes
    ----------
    name : str
        Of its follower: the sliding point, or the arm.
    pressure_angle, pressure_angle_at : float
        The largest by size, with its sign, and the cam's angle there, rad.
    curvature_radius, curvature_radius_at : float
        The least convex radius of the profile, m, or where it is undercut the one that lies farthest below zero; NaN where the
        profile is convex nowhere.
    undercut : bool
        Whether the profile would have to turn back on itself.
    steps : tuple of (order, angle)
        The ends of segments, rad, at which the velocity (1) or the acceleration (2) of the law has a step.
    """

    name: str
    pressure_angle: float
    pressure_angle_at: float
    curvature_radius: float
    curvature_radius_at: float
    undercut: bool
    steps: tuple[tuple[int, float], ...]

    @property
    def warnings(self) -> list[str]:
        """One line for an undercut profile, and one for each derivative of the law that has steps."""
        lines = []
        if self.undercut:
            lines.append(
                f"cam of {self.name}: the profile is undercut at {math.degrees(self.curvature_radius_at):.6g} deg: "
                "use a larger base radius, a smaller roller or a slower law"
            )
        for order, what in ((1, "velocity"), (2, "acceleration")):
            places = [f"{math.degrees(angle):.6g}" for k, angle in self.steps if k == order]
            if places:
                lines.append(f"cam of {self.name}: the {what} has a step at {', '.join(places)} deg")
        return lines


def check_cam(m: Description, number: int) -> CamCheck:
    """The character of one of the cams of a mechanism, from 0.

    Examples
    --------
    An eccentric circle, as a law of simple harmonic motion on a flat face: its radius is constant.

    >>> from virtualwork import Cam, Guide, Input, Link, Segment
    >>> law = (Segment(end=3.141592653589793, rise=0.02, motion="simple harmonic"), Segment(motion="simple harmonic"))
    >>> m = Description({"O": 0j}, {"cam": Link({"O": 0j}), "rod": Link({"F": 0j})}, [Guide("F", "rod", turned=0.0)],
    ...                 inputs=Input("cam"), cams=[Cam("cam", 0.04, slider="F", face="flat", law=law)])
    >>> found = check_cam(m, 0)
    >>> round(found.curvature_radius, 12), found.undercut
    (0.05, False)
    """
    drive = m.cam_drives[number]
    points = profile(m, drive, FINE)
    angles = [point.angle for point in points]

    def touching(angle: float) -> Touching:
        return carried(m, drive, ONE, located(ONE, drive.lift, ONE.exp(angle)))

    def convex(of: Touching) -> float:
        """The radius of the profile where what it is made from is convex; infinite elsewhere."""
        if of.flat:
            return float(of.curvature_radius())
        pitch = float(of.pitch_radius())
        return pitch - drive.cam.roller if pitch > 0 else math.inf

    at, pressure = _least(lambda a: -abs(float(touching(a).pressure_angle())), angles)
    here, radius = _least(lambda a: convex(touching(a)), angles)
    return CamCheck(
        str(drive.cam.slider or drive.cam.follower),
        float(touching(at).pressure_angle()) if pressure else 0.0,
        at % TURN,
        radius if math.isfinite(radius) else math.nan,
        here % TURN,
        radius < 0,
        tuple(_steps(drive)),
    )


def _least(value: Callable[[float], float], angles: list[float]) -> tuple[float, float]:
    """Where a function of the cam's angle is least, of samples and between the neighbours of the least of them."""
    from scipy.optimize import minimize_scalar

    values = np.array([value(angle) for angle in angles])
    k = int(np.argmin(values))
    if not math.isfinite(values[k]):
        return angles[k], float(values[k])
    before = angles[k - 1] if k else angles[-1] - TURN
    after = angles[k + 1] if k + 1 < len(angles) else angles[0] + TURN
    finer = minimize_scalar(value, bounds=(before, after), method="bounded", options={"xatol": 1e-9})
    return (float(finer.x), float(finer.fun)) if finer.fun < values[k] else (angles[k], float(values[k]))


def _steps(drive: CamDrive) -> list[tuple[int, float]]:
    """The knots at which the velocity or the acceleration of a law has a step."""
    of = drive.lift
    ends = []
    for i in range(len(of.pieces)):
        sides = [placed(ONE, of, knot, itemgetter(i)) for knot in of.knots[i : i + 2]]
        ends.append([[float(lift(at, k)) for k in (1, 2)] for at in sides])
    largest = [
        max(abs(piece.height) * (math.pi / abs(piece.width)) ** k for piece in of.pieces) for k in (1, 2)
    ]
    result = []
    for i in range(len(ends)):
        before, after = ends[i - 1][1], ends[i][0]
        order = next((k + 1 for k in (0, 1) if abs(after[k] - before[k]) > STEP * largest[k]), None)
        if order is not None:
            result.append((order, (of.first + of.knots[i]) % TURN))
    return result


@dataclass(frozen=True)
class LiftOff:
    """The speed at which a cam first loses its follower.

    Attributes
    ----------
    speed : float
        Of the input, rad/s, at constant speed; 0 where nothing holds the follower at rest either, infinite where none is
        too fast.
    at : float
        The input there, rad.
    """

    speed: float
    at: float


def lift_off(assembly: Assembly, cam: int) -> LiftOff | None:
    """The speed of the one turning input from which on a cam would have to pull its follower.

    At constant speed the contact force is N₀ + N₁ω + N₂ω² at every pose: weight and springs, dampers, inertia. It is taken
    apart at speeds as large as the answer, where its parts are of one size.

    One turn of it is looked through.

    Returns
    -------
    LiftOff, or None where nothing acts at rest, with friction, several inputs or a slide as the input
    """
    m = assembly.mechanism
    if m.friction or len(m.inputs) != 1 or m.inputs[0].is_slide:
        return None
    q = np.linspace(m.at[0], m.at[0] + TURN, SAMPLES + 1)

    def contact(at: Reals, speed: float) -> Reals:
        poses = Lanes(assembly, at, speed, 0.0)
        return np.asarray(Dynamics(poses).contact(cam))

    def limit(at: Reals, unit: float) -> Reals:
        """The least speed above zero at which contact is lost, infinite where none is."""
        rest, fast, back = (contact(at, speed) for speed in (0.0, unit, -unit))
        a, b = 0.5 * (fast + back) - rest, 0.5 * (fast - back)
        with np.errstate(all="ignore"):
            root = np.sqrt(b * b - 4 * a * rest)
            # of a x² + b x + c with c > 0 the least root above zero: 2c/(−b + √(b² − 4ac))
            x = 2 * rest / (root - b)
        x = np.where((x > 0) & np.isfinite(x), x, np.inf)
        return np.where(rest > 0, x, 0.0) * unit

    here = contact(q, 0.0)
    scale = float(np.nanmax(np.abs(here), initial=0.0))
    if scale == 0:
        # nothing acts at rest
        return None
    if not float(np.nanmin(here)) > 1e-12 * scale:
        return LiftOff(0.0, float(q[int(np.nanargmin(here))]))
    unit = 1.0
    for _ in range(60):
        speeds = limit(q, unit)
        k = int(np.nanargmin(speeds))
        if not math.isfinite(speeds[k]) and unit > 1e12:
            return LiftOff(math.inf, float(q[k]))
        new = float(speeds[k]) if math.isfinite(speeds[k]) else unit * 100
        done, unit = abs(new - unit) <= 1e-3 * unit, new
        if done:
            break
    near = q[max(k - 1, 0) : k + 2]
    for _ in range(12):
        finer = np.linspace(near[0], near[-1], 9)
        speeds = limit(finer, unit)
        k = int(np.nanargmin(speeds))
        near = finer[max(k - 1, 0) : k + 2]
    return LiftOff(float(speeds[k]), float(finer[k]))
