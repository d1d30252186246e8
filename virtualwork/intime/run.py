"""A simulation: two ways through time, the second in steps half as long, and how far they lie apart."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import count
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.guard import Lock, guarded
from virtualwork.branch.assembly import Assembly
from virtualwork.describe import MechanismError
from virtualwork.describe.parts import Input
from virtualwork.describe.values import as_number
from virtualwork.formulas.numbers import EPS, Reals, real_array
from virtualwork.formulas.quantity import Quantity
from virtualwork.intime.coordinates import Coordinates
from virtualwork.intime.equations import Equations
from virtualwork.intime.estimate import (
    GAIN,
    LEAST,
    TRIES,
    UNKNOWN,
    errors,
    first_tolerance,
    infinite_where_lost,
    share,
    unavoidable,
)
from virtualwork.intime.explicit import DormandPrince
from virtualwork.intime.friction import Rubbing
from virtualwork.intime.implicit import Radau
from virtualwork.intime.travel import UNDECIDED, Moved, Travel, travel
from virtualwork.intime.walk import MOST
from virtualwork.intime.watch import Floats, Levels
from virtualwork.motion import Motion

# nodes at which quantities are compared, and by how many roundings their states are moved to see what rounds in them
NODES, ROUNDINGS = 400, (-5.0, 3.0, 4.0)

if TYPE_CHECKING:
    from matplotlib.figure import FigureBase

    from dalembert.page import Page, Shown
    from virtualwork.animation import JointForce, Series


@guarded
@dataclass(frozen=True, eq=False)
class Run:
    """The result of `Mechanism.simulate`.

    Attributes
    ----------
    t : array (n,)
        The times, s; the last is that of the event or of the end, where the motion was not followed further.
    angle, speed, acceleration : array (n, k)
        The inputs (rad, or m of a slide; not wrapped) and their rates.
    error_estimate : array (n, k)
        How far the inputs may be from the truth; infinite where no digit holds.
    work : array (n,)
        Of what stores no energy, since the first time, J.
    ended : str
        Why it ends before the last time; empty where it does not.
    warnings : tuple of str
    """

    assembly: Assembly
    t: Reals
    angle: Reals = field(repr=False)
    speed: Reals = field(repr=False)
    acceleration: Reals = field(repr=False)
    work: Reals = field(repr=False)
    error_estimate: Reals = field(repr=False)
    fine: Travel = field(repr=False)
    coarse: Travel = field(repr=False)
    warnings: tuple[str, ...] = ()

    @property
    def lock(self) -> Lock:
        """That of the assembly, whose equations of motion it has."""
        return self.assembly.lock

    @property
    def ended(self) -> str:
        """Why it ends before the last time."""
        return self.fine.ended

    @cached_property
    def energy(self) -> Reals:
        """(n,): kinetic energy and that of gravity and springs, J."""
        return self.fine.energy(self.t)

    @property
    def energy_drift(self) -> Reals:
        """(n,): the change of energy since the first time that the work of the loads does not explain, J."""
        return drift(self.energy, self.work)

    @property
    def unknown(self) -> NDArray[np.bool_]:
        """(n,): whether no digit of the inputs holds, nor any after that time."""
        return np.asarray(np.isinf(self.error_estimate).any(axis=1))

    def errors(self, of: Callable[[Travel, Reals, Moved | None], Sequence[Reals]]) -> list[Reals]:
        """The errors of quantities at the times, (n,) each: how far those of states lie that are as wrong as these may be.

        The distance of the two solutions counts too, the largest so far, at the nodes as well: they may meet by chance. Not
        where friction jumps, of which the one knows a moment before the other.

        Parameters
        ----------
        of : function of a solution, times (m,), and by how much inputs and speeds are moved, (m, k) each
            Gives the quantities, (m,) each.
        """
        nodes = np.setdiff1d(self.coarse.nodes[self.coarse.nodes <= self.fine.end], self.coarse.jumps)
        some = nodes[np.unique(np.linspace(0, len(nodes) - 1, min(len(nodes), NODES)).astype(int))]
        t = np.union1d(some, self.t)
        q, (wrong, rates), part = (
            self.fine.at(t)[0],
            errors(self.fine, self.coarse, t),
            share(self.fine, self.coarse),
        )
        units = np.eye(q.shape[1])
        moves = [(wrong * unit, 0.0 * rates) for unit in units] + [
            (0.0 * wrong, rates * unit) for unit in units
        ]
        size = EPS * np.maximum(np.abs(q), self.fine.legs[0].equations.scale)
        moves += [(by * size, 0.0 * rates) for by in ROUNDINGS]
        answers, moved = of(self.fine, t, None), [of(self.fine, t, by) for by in moves]
        rows, result = np.searchsorted(t, self.t), []
        for answer, other, *others in zip(answers, of(self.coarse, t, None), *moved, strict=True):
            error = part * np.maximum.accumulate(np.abs(answer - other)) + 4 * EPS * np.abs(answer)
            off = np.abs(np.array(others) - answer)
            # a quantity rounds by itself, also where it vanishes
            rounded = np.maximum.accumulate(off[-len(ROUNDINGS) :].max(axis=0))
            result.append((error + off[: -len(ROUNDINGS)].sum(axis=0) + 2 * rounded)[rows])
        return result

    def rounding(self, key: Quantity) -> Reals:
        """What the evaluation of a quantity at the states rounds, (n,): computed twice.

        Redundant statics is solved in another way: of forces with it, 0.
        """
        if key.is_force and self.first_motion.dynamics.statics is not None:
            return np.zeros(len(self.t))
        return np.asarray(self.motion.rounding.of(key))

    @cached_property
    def motion(self) -> Any:
        """The motion through all times, a `Motion`: points, links, slides, joint forces.

        Where the motion passes a dead point of an input it is several, joined row by row.
        """
        return self.fine.motion(self.t)

    @property
    def first_motion(self) -> Motion:
        """The motion at the first time, in the coordinates of the beginning: for its joints."""
        first = self.angle[:1], self.speed[:1], self.acceleration[:1], self.t[:1]
        return self.fine.legs[0].coordinates.motion(*first)

    def plot(self, figure: FigureBase | None = None) -> NDArray[np.object_]:
        """Draw inputs, speeds and energy over time and the mechanism at instants; return the axes.

        The curves are drawn through more times than those of the run. Without a figure it is a new one of pyplot's;
        without matplotlib (the extra `plot`) an ImportError.
        """
        from virtualwork.intime.picture import Course, draw, fine_times

        t, way = fine_times(self.t), self.fine
        angle, speed, *_ = way.at(t)
        return draw(Course(t, angle, speed, way.energy(t), way.motion(t)), self.assembly.mechanism, figure)

    def animate(self, forces: bool = False) -> Page:
        """Return a page that moves: the mechanism by its own clock with play, slider, curves and values.

        As `Motion.animate`, over time; its columns are in SI units and radians.

        Parameters
        ----------
        forces : bool
            Draw the joint forces too.

        Raises
        ------
        ValueError
            More times than a page can hold.

        Examples
        --------
        >>> from virtualwork import Input, Link, Mechanism
        >>> bob = Link({"O": 0j, "P": 1}, mass=1, center=1)
        >>> pendulum = Mechanism({"O": 0j}, {"bob": bob}, inputs=Input(link="bob"), gravity=-9.81j)
        >>> "P_vx_m_s" in pendulum.simulate([0, 0.1, 0.2], angle=0.0).animate().html
        True
        """
        from virtualwork.animation import JointForce, force_columns, moving_page, plain
        from virtualwork.motion_table import moving_columns

        m = self.assembly.mechanism
        inputs = {
            f"{e.name}_{'m' if e.is_slide else 'rad'}": self.angle[:, j] for j, e in enumerate(m.inputs)
        }
        table: dict[str, Any] = {"t_s": self.t, **inputs, "energy_J": self.energy}
        table |= moving_columns(m, self.motion.poses, 3)
        pairs = self.first_motion.dynamics.reactions.pairs if forces else ()
        table |= force_columns(self.motion.dynamics, pairs)
        series = self.series(plain(table), ["t_s", *inputs], [JointForce.of(*pair) for pair in pairs])
        return moving_page(m.name, [series], time="t_s")

    def series(
        self,
        columns: Mapping[str, Shown],
        over: Sequence[str],
        arrows: Sequence[JointForce],
        name: str = "",
    ) -> Series:
        """Return this run for a page, with columns (`t_s` and `over` among them); see `virtualwork.animation.Series`.

        They have every place and rate, for a page solves nothing of a motion whose coordinates change on the way.
        """
        from virtualwork.animation import Series
        from virtualwork.picture.paper import shapes_of

        first = self.fine.legs[0].coordinates
        poses = first.motion(self.angle, self.speed, self.acceleration, self.t).poses
        drawing = shapes_of(self.first_motion.poses, self.motion.poses)
        # beyond a dead point the inputs have another pose
        fine = len(self.fine.legs) == 1
        return Series(poses, drawing, columns, over, arrows, name, fine)


def simulate(
    assembly: Assembly,
    times: ArrayLike,
    angle: ArrayLike | None = None,
    speed: ArrayLike | None = None,
    accuracy: float = 1e-9,
    until: Mapping[str, float] | None = None,
    progress: Callable[[float, float, int], None] | None = None,
) -> Run:
    """Simulate; see `Mechanism.simulate`.

    `progress` is called after every step, or some, with the time reached, the last time and the number of the solution.
    """
    with assembly.lock:
        return _simulated(assembly, times, angle, speed, accuracy, until, progress)


def _simulated(
    assembly: Assembly,
    requested: ArrayLike,
    angle: ArrayLike | None,
    speed: ArrayLike | None,
    accuracy: float,
    until: Mapping[str, float] | None,
    progress: Callable[[float, float, int], None] | None,
) -> Run:
    m, t = assembly.mechanism, rising(requested)
    k = len(m.inputs)
    q = _state("angle", angle, [e.value for e in m.inputs], list(m.at), k)
    v = _state("speed", speed, [e.speed for e in m.inputs], [0.0] * k, k)
    if not 0 < accuracy < 1:
        raise ValueError(f"accuracy: found {accuracy:g}, expected a number between 0 and 1")
    own = _own(assembly)
    equations = own.equations
    equations.refuse(float(t[0]), q, v)
    scale = np.array(equations.scale)
    levels, end = levels_of(m.inputs, until), float(t[-1])
    # where steps pass kinks the second solution has steps of its own, at a lower tolerance
    lowest = LEAST * (GAIN + 1) if None in equations.kinks else LEAST
    tolerance = max(lowest, first_tolerance(accuracy, equations.crosses))
    start, solutions = (float(t[0]), q, v), count(1)

    def reports() -> Callable[[float], None] | None:
        """What the next solution reports to."""
        number = next(solutions)
        return None if progress is None else lambda reached: progress(reached, end, number)

    fine = travel(own, start, end, tolerance, levels, DormandPrince(), accuracy, progress=reports())
    if fine.stiff:
        # what is stiff somewhere is from the beginning
        fine = travel(own, start, end, tolerance, levels, Radau(), accuracy, progress=reports())
    for tries in range(TRIES):
        coarse, like, method = fine, fine if lowest == LEAST else None, fine.legs[0].method
        # near change points every solution is interpolated from other poses
        ways = own if tries % 2 else own.otherwise()
        # no farther than both go
        last = coarse.end if coarse.ended == UNDECIDED else end
        finer = max(LEAST, tolerance / (GAIN + 1))
        fine = travel(ways, start, last, finer, levels, method, accuracy, like, reports())
        fine.coarse = coarse
        if last < end and fine.ended == "end":
            fine.ended = coarse.ended
        coarse.backwards()
        times = reached(t, fine.end)
        error, _ = errors(fine, coarse, times)
        worst = float((error / scale).max())
        if worst <= accuracy or tolerance <= lowest or finer < lowest or fine.steps > MOST / 2:
            break
        least = float((unavoidable(fine) / scale).max())
        if worst <= 2 * least and least <= UNKNOWN:
            # shorter steps gain little
            break
        tolerance = finer
    if fine.ended == "end" and _arrives(fine, coarse, levels):
        fine.ended = "until"
    _refuse_lost_energy(fine, max(accuracy, worst))
    run = Run(assembly, times, *fine.at(times), infinite_where_lost(error, scale), fine, coarse)
    return replace(run, warnings=(*equations.warnings, *_warnings(run, accuracy, worst, until, t)))


def _arrives(fine: Travel, coarse: Travel, levels: Levels) -> bool:
    """Whether an input comes to its level at the last time, but for the error of the motion."""
    if not levels:
        return False
    t = fine.nodes
    gap, (error, _) = fine.at(t)[0], errors(fine, coarse, t)
    for j, level in levels.items():
        beside = np.abs(gap[:, j] - level) <= error[:, j]
        if beside[-1] and not beside.all():
            return True
    return False


def _refuse_lost_energy(fine: Travel, error: float) -> None:
    """Refuse a motion through change points whose energy is lost by more than its error explains.

    Raises
    ------
    MechanismError
        From which time on.
    """
    nodes, equations = fine.legs[0].nodes, fine.legs[0].equations
    if not equations.crosses:
        return
    t, q, v = nodes.t, nodes.q, nodes.v
    moving = float(np.max(equations.energies(t, q, v) - equations.energies(t, q, 0 * v)))
    times = fine.nodes
    lost = np.abs(drift(fine.energy(times), fine.at(times)[3])) > 1e3 * error * moving
    if lost.any():
        raise MechanismError(
            f"at {times[np.argmax(lost)]:.6g} s the rates change too fast near a change point: "
            "more energy is lost than the error of the motion explains"
        )


def _own(assembly: Assembly) -> Coordinates:
    """The inputs as coordinates and their equations, written down once."""
    coordinates: Coordinates | None = assembly.recordings.get("in time")
    if coordinates is None:
        m = assembly.mechanism
        coordinates = Coordinates((Rubbing if m.friction else Equations)(assembly), m.inputs)
        assembly.recordings["in time"] = coordinates
    return coordinates


def drift(energy: Reals, work: Reals) -> Reals:
    """The change of energy (…, n) since the first time that work does not explain."""
    return np.asarray(energy - energy[..., :1] - work)


def rising(times: ArrayLike) -> Reals:
    """Times of a motion, checked.

    Raises
    ------
    ValueError
    """
    t = real_array("times", times).reshape(-1)
    if not len(t) or not np.isfinite(t).all() or (np.diff(t) <= 0).any():
        raise ValueError("times: expected rising finite times, s")
    return t


def _state(
    name: str, requested: ArrayLike | None, own: Sequence[float | None], guess: Sequence[float], k: int
) -> Floats:
    if requested is None:
        return [float(at if value is None else value) for value, at in zip(own, guess, strict=True)]
    value = real_array(name, requested)
    if value.ndim > 1 or (value.ndim == 1 and len(value) != k) or not np.isfinite(value).all():
        raise ValueError(f"{name}: expected {k} finite number{'s' if k > 1 else ''}, found {requested!r}")
    return np.broadcast_to(value, (k,)).tolist()  # type: ignore[no-any-return]


def levels_of(inputs: Sequence[Input], until: Mapping[str, float] | None) -> dict[int, float]:
    """The values of inputs that end the motion."""
    names = [e.name for e in inputs]
    for name in until or ():
        if name not in names:
            raise ValueError(f"until: no input is named '{name}': expected {', '.join(names)}")
    return {names.index(name): as_number(level, f"until {name}") for name, level in (until or {}).items()}


def reached(t: Reals, end: float) -> Reals:
    """The times up to the end of a motion; where it ends before the last, its end is the last."""
    if end >= t[-1]:
        return t
    near = 1e-8 * (end - t[0])
    return np.append(t[t < end - near], end)


def not_met(until: Iterable[str], last: float) -> str:
    """The warning where no input has its value up to the last time."""
    return f"{', '.join(until)}: the event is not met before {last:g} s"


def _warnings(
    run: Run, accuracy: float, worst: float, until: Mapping[str, float] | None, requested: Reals
) -> list[str]:
    """The warnings of a run."""
    warnings = []
    if run.fine.ended == "end" and until:
        warnings.append(not_met(until, float(requested[-1])))
    if run.fine.ended == "budget":
        warnings.append(
            f"ends at {run.fine.end:.9g} s, after {MOST} steps: a larger permissible error (--accuracy) needs fewer"
        )
    elif run.fine.ended not in ("end", "until"):
        warnings.append(f"ends at {run.fine.end:.9g} s: {run.fine.ended}")
    undecided = run.fine.undecided
    if undecided is not None:
        warnings.append(
            f"at {undecided:.9g} s it rests at a change point, where two motions are possible: the one on the guess's "
            "branch is followed"
        )
    if run.unknown.any():
        warnings.append(
            f"no digit holds from {run.t[np.argmax(run.unknown)]:.6g} s on: the motion magnifies rounding errors "
            "until they exceed the answer"
        )
    elif worst > accuracy:
        warnings.append(f"accuracy {accuracy:g} is beyond rounding here: the estimated error is {worst:.1e}")
    if drives := run.assembly.mechanism.cam_drives:
        from virtualwork.intime.contacts import contacts_lost

        warnings += contacts_lost(run.fine, drives)
    return warnings
