"""Over a cycle of one input, or of its law over time: mean, peak and RMS effort, work, the energy balance, the flywheel."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dalembert.arithmetic.guard import Lock, guarded
from virtualwork.branch.limits import TURNS
from virtualwork.digits.forces import ForceErrors
from virtualwork.formulas.dynamics import Dynamics, Moving
from virtualwork.formulas.loaded_pose import LoadedPose
from virtualwork.formulas.loads import OWN
from virtualwork.formulas.numbers import Number, Reals, minus, plus
from virtualwork.formulas.poses import Poses
from virtualwork.plan.steps import path_reads
from virtualwork.study.between import Between, largest

# the fewest poses of a turn, or of a law of motion, from which mean, work and energy are formed
FINE = 1440
# whole turns, and a law that ends where it begins, as tables have them in six decimals; loads that repeat themselves
ROUNDED, SAME = 1e-6, 1e-9
# poses at which loads are compared with those some turns later
COMPARED = 16


@guarded
@dataclass(frozen=True)
class Cycle:
    """A sweep as a cycle of work: mean, peak, energy balance, flywheel.

    Attributes
    ----------
    motion : Motion
        One input. Where its poses have a time (`poses.time`), all means are over the time, and work is the integral
        of power; else over the input, which must rise or fall throughout. Over a whole turn in equal steps integrals
        are by the trapezoidal rule, which then converges faster than any power of the step; else by a cubic spline.
    """

    motion: Moving

    @property
    def lock(self) -> Lock:
        """That of the poses."""
        return self.motion.dynamics.lock

    @property
    def poses(self) -> Poses:
        """The poses of the sweep."""
        return self.motion.dynamics.poses

    @cached_property
    def between(self) -> Between:
        """The same motion between the poses."""
        return Between(self.poses)

    @cached_property
    def input(self) -> Reals:
        """The input, (n,)."""
        return self.poses.inputs[:, 0]

    @property
    def timed(self) -> bool:
        """Whether the cycle is over time."""
        return self.poses.time is not None

    @cached_property
    def place(self) -> Reals:
        """What the cycle is over, (n,): the time, s, or the input, rad or m."""
        return self.between.place

    @cached_property
    def effort(self) -> Reals:
        """The effort by virtual work, (n,)."""
        return self.motion.dynamics.effort[:, 0]

    @cached_property
    def speed(self) -> Number:
        """The input's speed, one or (n,)."""
        return self.poses.rates[0][0]

    # --- whether it is one ------------------------------------------------------------------------------------------
    @cached_property
    def turns(self) -> int | None:
        """How many whole turns of the input the sweep is; None where it is not a whole number of them, or a slide.

        A law over time that comes back is no turn: 0.
        """
        span = float(self.input[-1] - self.input[0])
        if self.poses.mechanism.inputs[0].is_slide:
            return 0 if self.timed and abs(span) <= ROUNDED * float(np.ptp(self.input)) else None
        turns = round(span / (2 * np.pi))
        within = ROUNDED * max(abs(span), float(np.ptp(self.input)))
        return turns if abs(span - 2 * np.pi * turns) <= within else None

    @cached_property
    def whole(self) -> bool:
        """Whether the sweep is a whole cycle, after which pose and loads come back to themselves."""
        return self.reason is None

    @cached_property
    def reason(self) -> str | None:
        """Why the sweep is no whole cycle, and which would be one; None where it is one."""
        entry = self.poses.mechanism.inputs[0]
        if self.poses.n < 2:
            return "one pose is no cycle: give a sweep over whole turns of the input, 0deg:360deg:1deg"
        if self.timed:
            if self.turns is None:
                return (
                    f"the law of motion does not end where it begins ({self._shown(self.input[0])}, then "
                    f"{self._shown(self.input[-1])}): a cycle over time ends in its first pose"
                )
        elif not self._one_way:
            return (
                f"the input {entry.name} does not rise or fall throughout: a cycle that dwells or returns needs a "
                "column time_s with a time for each row"
            )
        elif entry.is_slide:
            return (
                f"one stroke of the slide {entry.name} is no cycle: give its motion there and back as a table over "
                "time (--cases with a column time_s)"
            )
        if self.turns and self._repeats(self.turns):
            return None
        if self.timed and self.turns == 0:
            return None
        return self._turns_needed()

    @property
    def _one_way(self) -> bool:
        steps = np.diff(self.input)
        return bool((steps > 0).all() or (steps < 0).all())

    def _shown(self, q: float) -> str:
        slide = self.poses.mechanism.inputs[0].is_slide
        return f"{q:.6g} m" if slide else f"{np.degrees(q):.6g} deg"

    def _turns_needed(self) -> str:
        """Why a sweep of angles is no whole cycle: it is a part of one, or not one turn brings the loads back."""
        name = self.poses.mechanism.inputs[0].name
        sense = -1 if self.input[-1] < self.input[0] else 1
        covered = self._shown(abs(float(self.input[-1] - self.input[0])))
        turn = self._steady(np.linspace(self.input[0], self.input[0] + sense * 2 * np.pi, FINE + 1))
        if not np.isfinite(turn).all():
            return (
                f"the sweep covers {covered}, and the input {name} cannot turn a whole turn: give its motion "
                "there and back as a table over time (--cases with a column time_s)"
            )
        for turns in range(1, TURNS + 1):
            if self._alike(self._after(sense * turns)):
                start = float(np.degrees(self.input[0]))
                end = start + sense * 360 * turns
                return (
                    f"the sweep covers {covered} of the input {name}, and a whole cycle is {360 * turns} deg: "
                    f"sweep from {start:.10g}deg to {end:.10g}deg"
                )
        return f"the loads do not come back to themselves within {TURNS} turns of the input {name}"

    def _repeats(self, turns: int) -> bool:
        return self._alike(self._after(turns))

    @cached_property
    def _compared(self) -> Reals:
        """Some inputs over the sweep, in uneven steps."""
        share = (np.arange(COMPARED) + 0.5) / COMPARED
        return np.asarray(self.input.min() + np.ptp(self.input) * share**1.5)

    def _steady(self, q: Reals) -> Reals:
        """The effort at other inputs, of a law over time at its mean speed."""
        rates = self.poses.rates
        if any(np.ndim(rate) for of in rates for rate in of):
            rates = [[float(np.abs(self.speed).mean())], [0.0], [0.0]]
        poses = self.poses.again(q[:, None], rates)
        if self.timed:
            poses.time = np.full(len(q), self.place[0])
        return Dynamics(poses).effort[:, 0]

    @cached_property
    def _before(self) -> Reals:
        return self._steady(self._compared)

    def _after(self, turns: int) -> Reals:
        """The effort some turns later."""
        return self._steady(self._compared + 2 * np.pi * turns)

    def _alike(self, after: Reals) -> bool:
        size = float(np.abs(self._before).max())
        return bool(np.abs(after - self._before).max() <= SAME * size)

    def refined(self) -> Cycle:
        """The same cycle with so many poses that its mean, work and energy do not depend on the sweep's own steps.

        Itself, where the poses are enough or the motion between them is not defined.
        """
        least = FINE * max(1, abs(self.turns or 1))
        steps = self.poses.n - 1
        times = -(-least // steps)
        if times == 1 or not self.between.defined:
            return self
        if self._even:
            place = np.linspace(self.place[0], self.place[-1], times * steps + 1)
        else:
            share = np.arange(times) / times
            inner = self.place[:-1, None] + np.diff(self.place)[:, None] * share
            place = np.append(inner.ravel(), self.place[-1])
        return Cycle(_Poses(Dynamics(self.between.at(place))))

    # --- its numbers --------------------------------------------------------------------------------------------------
    @cached_property
    def _even(self) -> bool:
        """Whether the steps are equal."""
        steps = np.diff(self.place)
        return bool(np.abs(steps - steps.mean()).max() <= SAME * abs(steps.mean()))

    @cached_property
    def _periodic(self) -> bool:
        """Whether it is a whole number of turns over the input in equal steps, over which the effort comes back."""
        q = self.input
        turns = (q[-1] - q[0]) / (2 * np.pi)
        back = abs(self.effort[-1] - self.effort[0]) <= SAME * np.abs(self.effort).max()
        return bool(
            not self.timed
            and not self.poses.mechanism.inputs[0].is_slide
            and abs(turns - round(turns)) < SAME
            and round(turns) != 0
            and self._even
            and back
        )

    def integral(self, values: Reals) -> float:
        """∫ values over the sweep: dt over time, else dq."""
        if self._periodic:
            return float(np.mean(values[:-1]) * self.span)
        if len(values) < 4:
            return float(np.trapezoid(values, self.place))
        from scipy.interpolate import CubicSpline

        forward = self._forward
        return float(
            CubicSpline(self.place[forward], values[forward]).integrate(self.place[0], self.place[-1])
        )

    @property
    def _forward(self) -> slice:
        """The poses in a rising order, as splines want them."""
        return slice(None, None, -1 if self.place[-1] < self.place[0] else 1)

    @cached_property
    def span(self) -> float:
        """The length of the sweep, of the time or of the input: negative backwards."""
        return float(self.place[-1] - self.place[0])

    @cached_property
    def _pace(self) -> Number:
        """How fast the input goes with what the cycle is over: its speed over time, 1 over itself."""
        return self.speed if self.timed else 1.0

    @cached_property
    def work(self) -> float:
        """∫ τ dq, J: what the input puts in; over time ∫ τ·q̇ dt."""
        return self.integral(np.asarray(self.effort * self._pace))

    @property
    def mean(self) -> float:
        """The mean effort over the sweep, or over the time."""
        return self.integral(self.effort) / self.span

    @property
    def peak(self) -> float:
        """The largest size of the effort, also between the poses where the motion is defined there."""
        return self._peak[1]

    @property
    def peak_at(self) -> float:
        """The input at the first largest effort, rad or m."""
        at = self._peak[0]
        return float(self.between.at(np.array([at])).inputs[0, 0]) if self.between.defined else at

    @cached_property
    def peak_power(self) -> float:
        """The largest size of the power of the input, W, also between the poses."""
        power = np.asarray(self.effort * self.speed)
        return self._largest(self.between.power, power)[1] if np.any(power) else 0.0

    @cached_property
    def _peak(self) -> tuple[float, float]:
        return self._largest(self.between.effort, self.effort)

    def _largest(self, of: Callable[[Reals], Reals], values: Reals) -> tuple[float, float]:
        """Where a quantity is largest, and its size there."""
        if not self.between.defined or not np.isfinite(values).all():
            i = int(np.argmax(np.abs(values)))
            return float(self.input[i]), float(np.abs(values)[i])
        forward = self._forward
        return largest(of, self.place[forward], values[forward])

    @property
    def rms(self) -> float:
        """The root mean square of the effort: the heat in a motor's winding."""
        return float(np.sqrt(self.integral(self.effort**2) / self.span))

    def error_estimate(self) -> dict[str, float]:
        """Return bounds of the rounding errors of `work`, `mean`, `peak`, `rms` and `fluctuation`.

        They follow from those of the effort at the poses; what the sum or spline between the poses leaves out of an
        integral is no rounding, and not among them.
        """
        error, size = ForceErrors(self.motion.dynamics).effort[:, 0], np.abs(self.effort)
        # of a pairwise sum
        last = float(np.finfo(float).eps) * (2 + np.log2(len(size)))
        q = np.abs(self.place - self.place[0])
        # the weights of a spline exceed those of the trapezoidal rule by less than a half
        total = 1.5 * float(np.trapezoid(error + last * size, q))
        work = 1.5 * float(np.trapezoid((error + last * size) * np.abs(self._pace), q))
        span = abs(self.span)
        return {
            "work": work,
            "mean": total / span,
            "peak": float(error.max()),
            # Minkowski: the root mean square of a sum is no more than the sum of those of its parts
            "rms": 1.5 * float(np.sqrt(np.trapezoid((error + last * size) ** 2, q) / span)),
            "fluctuation": 4 * work,
        }

    @cached_property
    def energy(self) -> tuple[Reals, Reals]:
        """Kinetic energy and potential of weights and springs at each pose, (n,) J."""
        scene = self.motion.dynamics.scene
        centers = {body: scene.case.path(body, r.center) for body, r in scene.rigid.items() if r.mass}
        keys: set[str] = set()
        for path in centers.values():
            keys |= path_reads(path)

        def kinetic(pose: LoadedPose) -> Number:
            total: Number = None
            for body, r in scene.rigid.items():
                if body in centers and (v := pose.velocity(centers[body])) is not None:
                    total = plus(total, 0.5 * r.mass * (v.real * v.real + v.imag * v.imag))
                if r.inertia and (w := pose.omega(body)) is not None:
                    total = plus(total, 0.5 * r.inertia * w * w)
            return total

        def potential(pose: LoadedPose) -> Number:
            total: Number = None
            for load in scene.loads:
                total = plus(total, load.potential(pose) if load.stores else None)
            return total

        moving, stored = scene.over([kinetic, potential], float, sorted(keys))
        return moving, stored

    @property
    def closure(self) -> float | None:
        """How far the energy balance is from closing, J.

        Work in, plus the work of applied loads, dampers and friction, less the gain in kinetic energy and potential.
        None where the input's acceleration is not zero and the poses have no time: such a sweep is no history.
        """
        speed, acceleration, _ = (rates[0] for rates in self.poses.rates)
        if not self.timed and (np.any(acceleration) or np.ndim(speed)):
            return None
        scene = self.motion.dynamics.scene

        def work(pose: LoadedPose) -> Number:
            total: Number = None
            for load in scene.case.everything:
                if load.kind not in OWN:
                    total = plus(total, minus(load.power(pose, 0), load.elastic(pose)))
            return total

        total = self.effort + scene.over([work], float)[0]
        kinetic, potential = self.energy
        gain = (kinetic[-1] - kinetic[0]) + (potential[-1] - potential[0])
        return self.integral(np.asarray(total * self._pace)) - float(gain)

    @cached_property
    def fluctuation(self) -> float:
        """The range of ∫ (τ − mean) dq, J: what a flywheel must store (Norton, Design of Machinery, §11.11).

        The extremes lie where τ crosses its mean, between the poses: found on the cubic spline through them.
        """
        from scipy.interpolate import CubicSpline

        values = np.asarray((self.effort - self.mean) * self._pace)
        if self._periodic:
            values[-1] = values[0]
        forward = self._forward
        spline = CubicSpline(
            self.place[forward], values[forward], bc_type="periodic" if self._periodic else "not-a-knot"
        )
        stored = spline.antiderivative()
        crossings = spline.roots(extrapolate=False)
        at = np.concatenate([self.place[[0, -1]], crossings[np.isfinite(crossings)]])
        levels = stored(at)
        return float(levels.max() - levels.min())

    def flywheel(self, coefficient: float) -> float:
        """The inertia that keeps (ω_max − ω_min)/ω_mean at `coefficient`: ΔE/(coefficient·ω²), kg·m².

        Raises
        ------
        ValueError
            Where the input does not turn, or stands or turns back in its cycle.
        """
        speed = np.asarray(self.speed)
        if not np.any(speed):
            raise ValueError("a flywheel needs a speed of the input that is not zero")
        if not ((speed > 0).all() or (speed < 0).all()):
            raise ValueError("the input stands or turns back: a flywheel on it has no steady speed to keep")
        mean = float(speed) if speed.ndim == 0 else self.integral(speed) / self.span
        return self.fluctuation / (coefficient * mean * mean)


@dataclass(frozen=True)
class _Poses:
    """A motion of which the forces alone are of interest."""

    dynamics: Dynamics
