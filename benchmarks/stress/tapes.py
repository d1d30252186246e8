"""The engines of the tape on mechanisms of all kinds: against each other, and against fifty digits within their estimates."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import mpmath as mp
import numpy as np

from benchmarks.stress import random_linkages
from benchmarks.stress.topologies import generate
from dalembert.arithmetic.engines import run
from dalembert.arithmetic.engines.doubled import Answer, compared
from dalembert.arithmetic.tape import Tape
from virtualwork import Mechanism
from virtualwork.describe import MechanismError
from virtualwork.describe.description import Description
from virtualwork.formulas.forces import Effort, JointForce, NewtonEuler, Shaking, ShakingMoment
from virtualwork.formulas.kinematics import Angle, Point, Slide
from virtualwork.formulas.quantity import Quantity
from virtualwork.formulas.tapes import taped
from virtualwork.motion import Motion

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Reals = NDArray[np.float64]
    Generator = np.random.Generator

DIGITS = 50
POSES = 6
# quantities of a mechanism that are worked out in fifty digits, each with its bound
FEW = 3


class Digits:
    """The operations of mpmath's numbers, for `Tape.values`."""

    const = mp.mpf
    sin, cos, atan2 = staticmethod(mp.sin), staticmethod(mp.cos), staticmethod(mp.atan2)

    @staticmethod
    def binade(x: Any) -> Any:
        return mp.ldexp(0.5, mp.frexp(abs(x))[1])

    @staticmethod
    def sqrt(x: Any) -> Any:
        return mp.sqrt(x) if x >= 0 else mp.nan

    @staticmethod
    def select(test: Any, positive: Any, otherwise: Any) -> Any:
        return positive if test > 0 else otherwise


def every_key(motion: Motion) -> list[Quantity]:
    """Every quantity that the command can show."""
    m = motion.mechanism
    keys: list[Quantity] = [
        Point(body, z, p, order)
        for body, points in m.bodies.items()
        if body != "ground"
        for p, z in points.items()
        for order in range(3)
    ]
    keys += [Angle(body, order) for body in m.links for order in range(3)]
    keys += [Slide(i, order) for i in range(len(m.guides)) for order in range(3)]
    keys += [kind(j) for kind in (Effort, NewtonEuler) for j in range(len(m.inputs))]
    keys += [JointForce(joint.key, b) for joint in motion.dynamics.reactions.joints for b in joint.bodies]
    return [*keys, Shaking(), ShakingMoment()]


def dimension(key: Quantity) -> tuple[str, int]:
    """What is zero but for rounding is measured by the largest of its dimension: length, angle, force, with its order."""
    return key.dimension or {"shaking": "force"}.get(key.kind, key.kind), key.order


def sizes(m: Description, keys: list[Quantity], values: list[Any]) -> dict[tuple[str, int], float]:
    """The largest value of every dimension; a moment's is that of a force at the mechanism's size at least."""
    largest: dict[tuple[str, int], float] = {}
    for key, value in zip(keys, values, strict=True):
        size = float(np.nanmax(np.abs(value), initial=0.0))
        largest[dimension(key)] = max(largest.get(dimension(key), 0.0), size)
    for kind in ("shaking moment", "effort", "newton-euler"):
        largest[kind, 0] = max(largest.get((kind, 0), 0.0), largest.get(("force", 0), 0.0) * m.size)
    return largest


def near_the_guess(m: Mechanism, rng: Generator, n: int = POSES) -> Motion:
    """Poses about the guess, with rates."""
    k = len(m.inputs)
    spread = np.array([0.02 * (m.size if e.is_slide else 1.0) for e in m.inputs])
    q = np.array(m.at) + spread * rng.uniform(-1, 1, (n, k))
    speed, acceleration = rng.normal(size=(2, n, k))
    return m.motion(q if k > 1 else q[:, 0], speed, acceleration)


def disagreement(motion: Motion, engines: tuple[str, ...]) -> tuple[float, float] | None:
    """The most that two engines differ by, of the largest value of the same dimension; and the poses' condition."""
    m, keys = motion.mechanism, every_key(motion)
    lanes = motion.poses
    if not lanes.takes(keys):
        return None
    tape = taped(motion.assembly, lanes.recording, tuple(keys))
    given = lanes.entering(tape.inputs)
    found = [run(tape, given, engine) for engine in engines]
    largest = sizes(m, keys, [np.array([found[0][name] for name in key.names]) for key in keys])
    worst = 0.0
    for key in keys:
        for name in key.names:
            rows = [np.broadcast_to(of[name], motion.n) for of in found]
            if any((np.isnan(row) != np.isnan(rows[0])).any() for row in rows):
                return np.inf, 1.0
            apart = max(float(np.nanmax(np.abs(row - rows[0]), initial=0.0)) for row in rows[1:])
            worst = max(worst, apart / largest[dimension(key)] if apart else 0.0)
    return worst, float(np.nanmax(motion.condition, initial=1.0))


def exact(tape: Tape, given: dict[str, Any], lane: int) -> dict[str, Any]:
    """What the operations of a tape give in fifty digits."""
    one = {name: mp.mpf(float(np.ravel(x)[lane if np.ndim(x) else 0])) for name, x in given.items()}
    with mp.workdps(DIGITS):
        return tape.on(one, Digits())


def beside_fifty_digits(
    motion: Motion, rng: Generator, engines: tuple[str, ...]
) -> list[tuple[float, float]]:
    """Some quantities on each engine: the error, and its estimate by a second run in 32 digits."""
    keys = every_key(motion)
    lanes = motion.poses
    if not lanes.takes(keys):
        return []
    chosen = tuple(keys[i] for i in sorted(rng.choice(len(keys), FEW, replace=False)))
    tape = taped(motion.assembly, lanes.recording, chosen)
    given = lanes.entering(tape.inputs)
    lane = int(rng.integers(motion.n))
    truth = exact(tape, given, lane)
    found = []
    for engine in engines:
        rows = run(tape, given, engine)
        bounds, _ = compared(tape, given, {Answer((name,)): [rows[name]] for name in tape.names})
        for name, of in zip(tape.names, bounds, strict=True):
            row, bound = np.broadcast_to(rows[name], motion.n), np.broadcast_to(of, motion.n)
            if np.isfinite(row[lane]) and np.isfinite(bound[lane]):
                found.append((abs(float(row[lane] - truth[name])), float(bound[lane])))
    return found


def _any(rng: Generator, engines: tuple[str, ...] = ("python", "numpy")) -> list[tuple[float, float]]:
    seed = int(rng.integers(1 << 30))
    try:
        return beside_fifty_digits(near_the_guess(generate(seed).mechanism, rng), rng, engines)
    except MechanismError:
        return []


def _four_bar(rng: Generator) -> list[tuple[float, float]]:
    at = float(rng.uniform(-np.pi, np.pi))
    m, _ = random_linkages.four_bar(rng, at, 10.0 ** float(rng.uniform(-3, 3)), limit=rng.random() < 0.5)
    return beside_fifty_digits(near_the_guess(m, rng), rng, ("python", "numpy"))


CAMPAIGNS = {
    "tapes of any topology": ("some quantities near the guess, Python's engine and numpy's", _any),
    "tapes of four-bars": ("of any size, anywhere and at a limit", _four_bar),
}
