"""The door out: what a mechanism does over given inputs, its points, links, slides and forces.

Each quantity is solved on the first request, and never twice; the files of forces, bounds and studies are loaded then.

>>> import numpy as np
>>> from virtualwork import Input, Link, Mechanism
>>> crank = Mechanism({"O": 0j}, {"crank": Link({"O": 0j, "P": 1})}, inputs=Input(link="crank"))
>>> crank.motion(np.linspace(0, np.pi, 3), speed=2.0).link("crank").omega
array([2., 2., 2.])
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.guard import Lock, guarded, unlocked
from dalembert.arithmetic.records import alike
from virtualwork.branch.assembly import Assembly
from virtualwork.describe import DescriptionError
from virtualwork.describe.description import Description
from virtualwork.formulas.forces import Effort, Force, Reaction, Shaking, ShakingMoment
from virtualwork.formulas.lanes import Lanes
from virtualwork.formulas.numbers import Complexes, Number, Reals, xy
from virtualwork.formulas.one_pose import one_pose
from virtualwork.formulas.quantity import Quantity
from virtualwork.motion_views import MotionViews
from virtualwork.parts_of_motion import LinkMotion, NamedParts, PointMotion, SlideMotion, number_of_input
from virtualwork.plan.steps import Step

if TYPE_CHECKING:
    from pandas import DataFrame

    from virtualwork.digits.estimates import Estimates
    from virtualwork.family.sensitivity import Sensitivities
    from virtualwork.forces import Forces
    from virtualwork.study.cycle import Cycle

EFFORT = Effort(0)
# what a loop asks of each pose is made once
_reaction = lru_cache(maxsize=1024)(Reaction)


@guarded
class Motion(NamedParts[PointMotion, LinkMotion, SlideMotion], MotionViews):
    """Position, velocity, acceleration, jerk and forces at given inputs, each computed on request.

    `Mechanism.motion` makes one. See there for the parameters.

    Attributes
    ----------
    assembly : Assembly
        Which assembly moves.
    """

    kinds = PointMotion, LinkMotion, SlideMotion

    def __init__(
        self,
        assembly: Assembly,
        angle: ArrayLike | None = None,
        speed: ArrayLike | None = None,
        acceleration: ArrayLike | None = None,
        jerk: ArrayLike | None = None,
        block_of: int | None = None,
    ) -> None:
        self.assembly = assembly
        self._one = one_pose(assembly, angle, speed, acceleration, jerk)
        if self._one is None:
            self.poses = Lanes(assembly, angle, speed, acceleration, jerk, block_of)

    def __repr__(self) -> str:
        m, over = self.mechanism, ", ".join(e.name for e in self.mechanism.inputs)
        doubts = "; see .warnings" if self.assembly.warnings else ""
        return f"Motion({m.name!r}: {self.n} pose{'s' * (self.n != 1)} over {over}{doubts})"

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Motion):
            return NotImplemented
        mine, its = self.poses, other.poses
        return self.assembly == other.assembly and all(
            alike(a, b) for a, b in zip((mine.inputs, *mine.rates), (its.inputs, *its.rates), strict=True)
        )

    __hash__ = object.__hash__

    def __reduce__(self) -> tuple[Any, ...]:
        poses = self.poses
        own = self.inputs, poses.input_error, poses.input_rest
        held = None if poses.held is None else poses.holding
        return _again, (self.assembly, own, poses.rates, poses.block_of, poses.time, held)

    @property
    def lock(self) -> Lock:
        """The lock of the assembly."""
        return self.assembly.lock

    @cached_property
    def _units(self) -> dict[int, Motion]:
        return {}

    @cached_property
    def poses(self) -> Lanes:
        """The poses, with everything solved so far."""
        # only of one pose are they not made with the motion
        assert self._one is not None
        return Lanes(self.assembly, *self._one.numbers)

    # --- over what ------------------------------------------------------------------------------------------------
    @property
    @unlocked
    def mechanism(self) -> Description:
        """The mechanism that moves."""
        return self.assembly.mechanism

    @property
    def inputs(self) -> Reals:
        """(n, k): the inputs, rad or m."""
        return self.poses.inputs.copy()

    @property
    def n(self) -> int:
        """The number of poses."""
        return self.poses.n

    @property
    def input_error(self) -> ArrayLike:
        """The errors of the inputs, for the estimates of rounding errors; 0 for exact inputs."""
        return self.poses.input_error

    @input_error.setter
    def input_error(self, value: ArrayLike) -> None:
        self.poses.input_error = value

    @property
    def solved(self) -> list[tuple[Step, int]]:
        """The solved steps and their orders, (step, order); order 0 is position."""
        return self.poses.solved

    @property
    def assembled(self) -> NDArray[np.bool_]:
        """Whether each pose can be assembled, (n,) bool."""
        return self.poses.assembled.copy()

    def reason(self, i: int) -> str | None:
        """Return why the i-th pose cannot be assembled, in m and rad; None if it can.

        Examples
        --------
        A rod of 50 mm reaches a line 52 mm away no longer:

        >>> from virtualwork import Guess, Guide, Input, Link, Mechanism
        >>> m = Mechanism({"O": (0, 0)}, {"crank": Link({"O": (0, 0), "A": (0.06, 0)}),
        ...               "rod": Link({"A": (0, 0), "B": (0.05, 0)})}, [Guide("B", "rod")],
        ...               inputs=Input("crank"), guess=Guess(0.0, {"rod": 0.1}))
        >>> m.motion([0.5, np.arcsin(52 / 60)]).reason(1)
        'rod reaches 0.05 m, 0.052 m needed: 0.002 m short; it would close at 0.985111 rad'
        """
        from virtualwork.doubts import reason_at

        return reason_at(self.assembly, tuple(self.poses.inputs[i].tolist()))

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is doubtful: guesses that contradict each other, loops without a speed, poses that cannot be assembled and why."""
        from virtualwork.doubts import warnings_of

        return warnings_of(self.assembly, self.poses)

    @property
    def condition(self) -> Reals:
        """(n,): ‖J⁻¹‖∞ of all loops, lengths divided by the size: a relative error ε moves the pose by some ε·condition."""
        return self.poses.condition.copy()

    # --- what moves -----------------------------------------------------------------------------------------------
    @unlocked
    def values(self, keys: Sequence[Quantity]) -> list[Any]:
        """Return several quantities by their keys, (n,) each."""
        return self._values(tuple(keys))

    @unlocked
    def value(self, key: Quantity) -> Any:
        """Return a quantity by its key, (n,)."""
        result = None if self._one is None else self._one.value(key)
        return self._values((key,))[0] if result is None else result

    @unlocked
    def vector(self, key: Quantity) -> Reals:
        """Return a vector by its key, (n, 2)."""
        result = None if self._one is None else self._one.vector(key)
        return xy(self._values((key,))[0]) if result is None else result

    def _values(self, keys: tuple[Quantity, ...]) -> list[Any]:
        if self._one is not None:
            result = self._one.values(keys)
            if result is not None:
                return result
            # what was handed out once stays as it is, to its last digit
            if len(keys) > 1 and not self._one.known.keys().isdisjoint(keys):
                return [self._values((key,))[0] for key in keys]
        return self.poses.values(keys, lambda: self.dynamics)

    @cached_property
    def rounding(self) -> Estimates:
        """Estimates of the rounding errors of this motion, each formed on the first request."""
        from virtualwork.digits.estimates import Estimates

        return Estimates(self.poses, self.values)

    def error_estimates(self, *names: str) -> dict[str, Reals]:
        """Return estimates (n,) of the rounding errors of several quantities, as `error_estimate` gives them one by one.

        They come from one second run, of which they have most in common.

        Parameters
        ----------
        names : str
            Called as in `Mechanism.evaluator`: `points.H.velocity`, `links.coupler.omega`, `effort`; `H.vx`, `crank.torque`.

        Raises
        ------
        DescriptionError
            Where a name is not known.

        Examples
        --------
        >>> from virtualwork import Input, Link, Mechanism
        >>> crank = Mechanism({"O": 0j}, {"crank": Link({"O": 0j, "P": 1})}, inputs=Input(link="crank"))
        >>> found = crank.motion(1.0, speed=2.0).error_estimates("points.P", "links.crank.omega")
        >>> bool(0 < found["points.P"][0] < 1e-15), bool(found["links.crank.omega"][0] < 1e-28)
        (True, True)
        """
        from virtualwork.evaluator import key_of, requests

        # as JSON names them, or as --only does
        whole = {name: key for name in names if (key := key_of(self.assembly, name)) is not None}
        parts = {
            part: key for name in names if name not in whole for part, key, _ in requests(self.assembly, name)
        }
        keys = whole | parts
        joints: dict[str, Force] = {name: key for name, key in whole.items() if isinstance(key, Reaction)}
        joints |= {name: key for name, key in parts.items() if isinstance(key, Force)}
        self.rounding.together(key for name, key in keys.items() if name not in joints)
        estimates = {name: self.rounding.of(key) for name, key in keys.items() if name not in joints}
        if joints:
            errors = self.dynamics.error_estimate()
            errors.together(joints.values())
            estimates |= {name: errors.value(key) for name, key in joints.items()}
        return {name: estimates[name] for name in keys}

    # --- forces -----------------------------------------------------------------------------------------------
    @cached_property
    def dynamics(self) -> Forces:
        """All forces of this motion, each formed on the first request."""
        from virtualwork.forces import Forces

        return Forces(self.poses)

    @property
    @unlocked
    def effort(self) -> Reals:
        """The effort at the input by virtual work, (n,) N·m (N at a slide); (n, k) for k inputs.

        Static where speed and acceleration are zero (Riul, unit II, eq. 3), else with inertia loads (eq. 5).
        """
        inputs = 1 if self._one is not None else len(self.mechanism.inputs)
        if inputs == 1:
            return self.value(EFFORT)  # type: ignore[no-any-return]
        return np.stack(self._values(tuple(Effort(j) for j in range(inputs))), axis=1)

    @unlocked
    def reaction(self, joint: str, on: str) -> Reals:
        """Return the force of all other links on a link at a joint, (n, 2) N (Ibrahim §2.2).

        Parameters
        ----------
        joint : str
            The name of a pin, or of the point of a slot or slider.
        on : str
            A link that the joint holds.
        """
        return self.vector(_reaction(joint, on))

    def applied(self, link: str) -> tuple[Complexes, Reals]:
        """Return the applied loads of a link without weight and inertia, at its centre of mass: (n,) complex N, (n,) N·m."""
        self.link(link)
        if not self.mechanism.applies:
            return np.zeros(self.n, complex), np.zeros(self.n)
        return self.dynamics.applied(link)

    def unit(self, j: int = 0) -> Motion:
        """Return the motion through these poses at a unit speed of input j alone; its velocities are virtual displacements."""
        if number_of_input(self.mechanism, j) not in self._units:
            k = self.inputs.shape[1]
            rates: list[list[Number]] = [[float(i == j) for i in range(k)], [0.0] * k, [0.0] * k]
            own = self.inputs, self.poses.input_error, self.poses.input_rest
            self._units[j] = _again(self.assembly, own, rates, self.poses.block_of)
        return self._units[j]

    @property
    def cycle(self) -> Cycle:
        """Return the sweep as a cycle of work: mean and peak effort, energy balance, flywheel.

        Raises
        ------
        ValueError
            A motion of several inputs, or of no poses.
        """
        if len(self.mechanism.inputs) > 1 or not self.n:
            raise ValueError(
                f"a cycle of work needs a sweep of one input, found {self.n} poses of {len(self.mechanism.inputs)}"
            )
        from virtualwork.study.cycle import Cycle

        return Cycle(self)

    def counterweights(self, links: Sequence[str]) -> tuple[dict[str, complex], Complexes, Complexes]:
        """Return the counterweights of the least r.m.s. shaking force: see `virtualwork.study.counterweights.least_squares`."""
        from virtualwork.study.counterweights import least_squares

        return least_squares(self, links)

    # --- sensitivities to the dimensions -------------------------------------------------------------------------
    @cached_property
    def sensitivities(self) -> Sensitivities:
        """The derivatives of all quantities with respect to the numbers of the description."""
        from virtualwork.family.sensitivity import Sensitivities

        return Sensitivities(self.assembly, self.poses)

    def derivative(self, key: Quantity, path: str) -> Any:
        """Return the derivative (n,) of a quantity with respect to the number at a path."""
        sensitivities = self.sensitivities
        return sensitivities.of([key], [sensitivities.dimension(path)])[0][0]

    def sensitivity(self, what: str, path: str) -> Reals:
        """Return the derivative of a quantity with respect to a number of the description.

        Parameters
        ----------
        what : str
            A name as `--only` has it: "H.x", "coupler.omega", "crank.torque", "B.coupler.fx": (n,), SI and radians;
            or "effort": (n,), or (n, k) for k inputs; "shaking force": (n, 2); "shaking moment": (n,).
        path : str
            Of the number, such as "links.crank.B.x".

        Raises
        ------
        DescriptionError
            No quantity has this name, or no number this path.
        MechanismError
            With friction, whose forces are no closed form.

        Examples
        --------
        A weight of m·g on an arm of 0.5 m: the torque grows by 4.905 N·m a kg.

        >>> from virtualwork import Input, Link, Mechanism
        >>> arm = Mechanism({"O": 0j}, {"arm": Link({"O": 0j}, mass=2, center=0.5)}, inputs=Input(link="arm"),
        ...                 gravity=-9.81j)
        >>> arm.motion(0.0).sensitivity("effort", "links.arm.mass")
        array([4.905])
        """
        if what == "effort":
            k = self.inputs.shape[1]
            slopes = [self.derivative(Effort(j), path) for j in range(k)]
            return np.asarray(slopes[0]) if k == 1 else np.stack(slopes, axis=1)
        if what == "shaking force":
            return xy(self.derivative(Shaking(), path))
        if what == "shaking moment":
            return np.asarray(self.derivative(ShakingMoment(), path))
        from virtualwork.quantities import named

        if len(of := named(self.mechanism, what)) > 1:
            raise DescriptionError(
                f"'{what}': expected one quantity, such as {of[0].names[0]} or {of[1].names[0]}"
            )
        if not of[0].key or of[0].polar:
            raise DescriptionError(f"'{what}' has no sensitivity")
        less = self.derivative(of[0].less, path) if of[0].less else 0.0
        return np.asarray(of[0].in_si(self.derivative(of[0].key, path), less))

    # --- as a table -------------------------------------------------------------------------------------------------
    def to_frame(self) -> DataFrame:
        """Return a table with a row for each pose: inputs, assembled, and position and rates of points and links.

        Velocities and accelerations are there where the inputs have a speed or an acceleration. SI units, radians.

        Examples
        --------
        >>> from virtualwork import Input, Link, Mechanism
        >>> crank = Mechanism({"O": 0j}, {"crank": Link({"O": 0j, "P": 2})}, inputs=Input(link="crank"))
        >>> list(crank.motion([0.0, 1.0]).to_frame().columns)
        ['crank_rad', 'assembled', 'crank_angle_rad', 'P_x_m', 'P_y_m']
        """
        from pandas import DataFrame

        from virtualwork.motion_table import columns

        return DataFrame(columns(self.poses))


def _again(
    assembly: Assembly,
    own: tuple[Reals, ArrayLike, Any],
    rates: list[list[Number]],
    block_of: int | None,
    time: Reals | None = None,
    held: Reals | None = None,
) -> Motion:
    """Make a motion again, as pickles and copies do; what it had solved is solved anew on request."""
    inputs, error, rest = own
    motion = Motion(assembly, inputs, block_of=block_of)
    poses = motion.poses
    poses.rates, poses.time, poses.input_error, poses.input_rest = rates, time, error, rest
    poses.held = held
    return motion
