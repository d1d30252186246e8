"""Over a cycle of one input, or of its law over time: mean, peak and RMS effort, work, the energy balance, the flywheel."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dalembert.arithmetic.guard import guarded
from virtualwork.formulas.at_rest import Potential
from virtualwork.formulas.dynamics import Dynamics
from virtualwork.formulas.forces import Force
from virtualwork.formulas.load_case import LoadCase
from virtualwork.formulas.loads import Load
from virtualwork.formulas.numbers import EPS, Number, Reals, plus
from virtualwork.formulas.pose_forces import PoseForces
from virtualwork.study.sweep import ALIKE, FINE, SAME, Sweep, largest

# of the sweep: how far from its largest value the effort is compared; what falls less than so many times as much twice as far
# away has a kink
BESIDE, KINK = 1e-6, 3.0
# what a parabola leaves out of a top
NEAR = 1.05
AROUND = np.arange(-2.0, 3.0)


@guarded
@dataclass(frozen=True)
class Cycle(Sweep):
    """A sweep as a cycle of work: mean, peak, energy balance, flywheel.

    Attributes
    ----------
    motion : Motion
        One input. Where its poses have a time (`poses.time`), all means are over the time, and work is the integral
        of power; else over the input, which must rise or fall throughout. Over a whole turn in equal steps integrals
        are by the trapezoidal rule, which then converges faster than any power of the step; else by a cubic spline.
    """

    def refined(self) -> Cycle:
        """The same cycle with so many poses that its mean, work and energy do not depend on the sweep's own steps.

        Itself, where the poses are enough or the motion between them is not defined.
        """
        least = FINE * max(1, abs(self.turns or 1))
        steps = self.poses.n - 1
        times = -(-least // steps)
        if times == 1 or not self.between.defined:
            return self
        if self.is_even:
            place = np.linspace(self.place[0], self.place[-1], times * steps + 1)
        else:
            share = np.arange(times) / times
            inner = self.place[:-1, None] + np.diff(self.place)[:, None] * share
            place = np.append(inner.ravel(), self.place[-1])
        return Cycle(_Poses(Dynamics(self.between.at(place))))

    # --- its numbers --------------------------------------------------------------------------------------------------
    @cached_property
    def is_even(self) -> bool:
        """Whether the steps are equal."""
        steps = np.diff(self.place)
        return bool(np.abs(steps - steps.mean()).max() <= SAME * abs(steps.mean()))

    @cached_property
    def is_periodic(self) -> bool:
        """Whether it is a whole number of turns over the input in equal steps, over which the effort comes back."""
        q = self.input
        turns = (q[-1] - q[0]) / (2 * np.pi)
        back = abs(self.effort[-1] - self.effort[0]) <= SAME * np.abs(self.effort).max()
        return bool(
            not self.timed
            and not self.poses.mechanism.inputs[0].is_slide
            and abs(turns - round(turns)) < SAME
            and round(turns) != 0
            and self.is_even
            and back
        )

    def integral(self, values: Reals) -> float:
        """∫ values over the sweep: dt over time, else dq.

        Raises
        ------
        ValueError
            Of one pose, of an input that turns back, or where a value is missing: there is no integral.
        """
        self._refuse_gaps(values)
        if self.is_periodic:
            return float(np.mean(values[:-1]) * self.span)
        if len(values) < 4:
            return float(np.trapezoid(values, self.place))
        from scipy.interpolate import CubicSpline

        forward = self.forward
        return float(
            CubicSpline(self.place[forward], values[forward]).integrate(self.place[0], self.place[-1])
        )

    def _refuse_gaps(self, values: Reals) -> None:
        steps = np.diff(self.place)
        if not len(steps) or not ((steps > 0).all() or (steps < 0).all()):
            raise ValueError(self.reason)
        if not np.isfinite(values).all():
            count = int((~np.isfinite(values)).sum())
            raise ValueError(
                f"{count} of {self.poses.n} poses of the sweep have no effort: expected all of a cycle"
            )

    @property
    def forward(self) -> slice:
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
        return self.largest_effort[1]

    @property
    def peak_at(self) -> float:
        """The input at the first largest effort, rad or m."""
        at = self.largest_effort[0]
        return float(self.between.at(np.array([at])).inputs[0, 0]) if self.between.defined else at

    @property
    def peak_power(self) -> float:
        """The largest size of the power of the input, W, also between the poses."""
        return self.largest_power[1]

    @cached_property
    def largest_power(self) -> tuple[float, float]:
        """Where the power is largest (where no motion is defined between the poses: the input there), and its size."""
        power = np.asarray(self.effort * self.speed)
        return self._largest(self.between.power, power) if np.any(power) else (float(self.place[0]), 0.0)

    @cached_property
    def largest_effort(self) -> tuple[float, float]:
        """The same of the effort."""
        return self._largest(self.between.effort, self.effort)

    def _largest(self, of: Callable[[Reals], Reals], values: Reals) -> tuple[float, float]:
        """Where a quantity is largest, and its size there."""
        if not self.between.defined or not np.isfinite(values).all():
            i = int(np.argmax(np.abs(values)))
            return float(self.input[i]), float(np.abs(values)[i])
        forward = self.forward
        return largest(of, self.place[forward], values[forward])

    @property
    def rms(self) -> float:
        """The root mean square of the effort: the heat in a motor's winding."""
        return float(np.sqrt(self.integral(self.effort**2) / self.span))

    def error_estimate(self) -> dict[str, float]:
        """Return the rounding errors of `work`, `mean`, `peak`, `peak_at`, `rms`, `peak_power` and `fluctuation`.

        They are by what the same in 32 digits differs. What the sum or spline between the poses leaves out of an integral is
        no rounding, and not among them.
        """
        from virtualwork.digits.cycle import CycleRun

        turns = self.turns if self.is_periodic else None
        run = CycleRun(self.motion.dynamics, self.place, self.is_even, turns)
        pace, span = np.asarray(self._pace, dtype=float), abs(self.span)
        # where the input stands an effort without a digit does no work
        effort, more = run.effort, np.abs(pace) * np.where(pace == 0, 0.0, run.more)
        total = run.integral(effort)
        square = run.integral(effort * effort) / run.span
        stored = run.between((effort - total / run.span) * pace, *self.stored[1:])
        peak, peak_at = self._top(self.between.effort, self.largest_effort)
        return {
            "work": run.off(run.integral(effort * pace), self.work, more),
            "mean": run.off(total / run.span, self.mean, run.more / span),
            "peak": peak,
            "peak_at": peak_at,
            # Minkowski: the root mean square of a sum is no more than the sum of those of its parts
            "rms": run.off(np.sqrt(np.abs(square)), self.rms) + np.sqrt(run.most(run.more**2) / span),
            "peak_power": self._top(self.between.power, self.largest_power, power=True)[0],
            "fluctuation": run.off(stored, self.fluctuation, 4 * more),
        }

    def _top(
        self, of: Callable[[Reals], Reals], largest: tuple[float, float], power: bool = False
    ) -> tuple[float, float]:
        """The error of a largest size, and of the input there: how far from it the top of the parabola beside it lies."""
        at, size = largest
        error, speed = self._at_place(at)
        if power:
            error = error * abs(speed) + 0.5 * EPS * size
        low, high = float(self.place.min()), float(self.place.max())
        if not self.between.defined or not size:
            return error, 0.0
        # of tops alike but for rounding the first place counts, and the largest size
        error += abs(size - float(np.abs(of(np.array([at]))[0])))
        if at in (low, high):
            return error, 0.0
        h = min(BESIDE * (high - low), (at - low) / 2, (high - at) / 2)
        far, before, here, behind, farther = np.abs(of(at + h * AROUND)).tolist()
        bend, noise = 2 * here - before - behind, error + EPS * size
        if 2 * here - far - farther < KINK * bend:
            more, off = self._kink(of, largest, 0.01 * h)
        elif bend > noise:
            more = NEAR * (behind - before) ** 2 / (8 * bend)
            off = h * (NEAR * abs(behind - before) / 2 + noise) / bend
        else:
            more, off = 0.0, high - low
        return error + more, off * (abs(speed) if self.timed else 1.0)

    def _kink(
        self, of: Callable[[Reals], Reals], largest: tuple[float, float], h: float
    ) -> tuple[float, float]:
        """How much larger than the largest the top is, and how far away, at a row of a table: by straight lines on both sides."""
        at, size = largest
        far, before, here, behind, farther = np.abs(of(at + h * AROUND)).tolist()
        rise, fall = before - far, behind - farther
        if not (rise > 0 and fall > 0):
            return ALIKE * size, h
        share = (2 * behind - farther - 2 * before + far) / (rise + fall)
        rest = min(abs(2 * before - far + rise * share - here), ALIKE * size)
        off = min(abs(share) * h, ALIKE * size * h / min(rise, fall))
        return NEAR * rest + EPS * size, NEAR * off + 4 * EPS * abs(at)

    def _at_place(self, place: float) -> tuple[float, float]:
        """The error of the effort at one place, and the speed of the input there."""
        from virtualwork.digits.forces import ForceErrors

        if self.between.defined:
            poses = self.between.at(np.array([place]))
            return float(ForceErrors(Dynamics(poses)).effort[0, 0]), float(np.ravel(poses.rates[0][0])[0])
        i = int(np.argmin(np.abs(self.input - place)))
        return float(ForceErrors(self.motion.dynamics).effort[i, 0]), float(
            np.broadcast_to(self.speed, len(self.input))[i]
        )

    @cached_property
    def energy(self) -> tuple[Reals, Reals]:
        """Kinetic energy and potential of weights and springs at each pose, (n,) J."""
        kinetic, held = self.motion.dynamics.values([Kinetic(), Held()])
        return kinetic, held

    @property
    def closure(self) -> float | None:
        """How far the energy balance is from closing, J.

        Work in, plus the work of applied loads, dampers and friction, less the gain in kinetic energy and potential.
        None where the input's acceleration is not zero and the poses have no time: such a sweep is no history.
        """
        speed, acceleration, _ = (rates[0] for rates in self.poses.rates)
        if not self.timed and (np.any(acceleration) or np.ndim(speed)):
            return None
        total = self.effort + self.motion.dynamics.value(Wasted())
        kinetic, potential = self.energy
        gain = (kinetic[-1] - kinetic[0]) + (potential[-1] - potential[0])
        return self.integral(np.asarray(total * self._pace)) - float(gain)

    @property
    def fluctuation(self) -> float:
        """The range of ∫ (τ − mean) dq, J: what a flywheel must store (Norton, Design of Machinery, §11.11)."""
        return self.stored[0]

    @cached_property
    def stored(self) -> tuple[float, float, float]:
        """`fluctuation`, and the places of the least and of the largest ∫ (τ − mean) dq.

        They lie where τ crosses its mean, between the poses: found on the cubic spline through them.
        """
        from scipy.interpolate import CubicSpline

        values = np.asarray((self.effort - self.mean) * self._pace)
        if self.is_periodic:
            values[-1] = values[0]
        forward = self.forward
        spline = CubicSpline(
            self.place[forward], values[forward], bc_type="periodic" if self.is_periodic else "not-a-knot"
        )
        stored = spline.antiderivative()
        crossings = spline.roots(extrapolate=False)
        at = np.concatenate([self.place[[0, -1]], crossings[np.isfinite(crossings)]])
        levels = stored(at)
        low, high = at[[np.argmin(levels), np.argmax(levels)]].tolist()
        return float(levels.max() - levels.min()), low, high

    def flywheel(self, coefficient: float) -> float:
        """The inertia that keeps (ω_max − ω_min)/ω_mean at `coefficient`: ΔE/(coefficient·ω²), kg·m².

        Raises
        ------
        ValueError
            Where the sweep is no whole cycle; where the input does not turn, or stands or turns back in its cycle.
        """
        if not coefficient > 0:
            raise ValueError(f"coefficient: found {coefficient}, expected a number above zero, such as 0.02")
        speed = np.asarray(self.speed)
        if not np.any(speed):
            raise ValueError("a flywheel needs a speed of the input that is not zero")
        if not ((speed > 0).all() or (speed < 0).all()):
            raise ValueError("the input stands or turns back: a flywheel on it has no steady speed to keep")
        if self.reason is not None:
            raise ValueError(self.reason)
        mean = float(speed) if speed.ndim == 0 else self.integral(speed) / self.span
        return self.fluctuation / (coefficient * mean * mean)


# --- what its loads make of a pose --------------------------------------------------------------------------------------
class Kinetic(Force, kind="kinetic energy"):
    """The kinetic energy, J."""

    is_rubbed = False

    def form(self, forces: PoseForces) -> Number:
        forces.solve_places()
        pose, total = forces.pose, None
        for body, r in forces.mechanism.rigid.items():
            if r.mass and (v := pose.velocity(forces.case.path(body, r.center))) is not None:
                total = plus(total, 0.5 * r.mass * (v.real * v.real + v.imag * v.imag))
            if r.inertia and (w := pose.omega(body)) is not None:
                total = plus(total, 0.5 * r.inertia * w * w)
        return total


class Held(Potential, kind="held"):
    """The potential of weights and springs, J."""

    def loads(self, case: LoadCase) -> list[Load]:
        return [load for load in case.loads if load.stores]


class Wasted(Force, kind="wasted"):
    """The virtual work of applied loads, dampers and friction for a unit of the input."""

    is_rubbed = False

    def form(self, forces: PoseForces) -> Number:
        total: Number = None
        for load in forces.case.everything:
            total = plus(total, load.wasted(forces.pose, 0))
        return total


@dataclass(frozen=True)
class _Poses:
    """A motion of which the forces alone are of interest."""

    dynamics: Dynamics
