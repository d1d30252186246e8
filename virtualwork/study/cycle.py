"""Over a sweep of one input: mean, peak and RMS effort, work, the energy balance, the flywheel."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from virtualwork.bounds.forces import ForceErrors
from virtualwork.formulas.dynamics import Moving
from virtualwork.formulas.loads import OWN
from virtualwork.formulas.numbers import Reals, minus, plus
from virtualwork.formulas.poses import Poses
from virtualwork.plan.steps import path_reads


@dataclass(frozen=True)
class Cycle:
    """A sweep as a cycle of work.

    Attributes
    ----------
    motion : Motion
        One input, in the order of the sweep. Over a whole turn integrals are by the trapezoidal rule, which then
        converges faster than any power of the step; else by a cubic spline.
    """

    motion: Moving

    @property
    def poses(self) -> Poses:
        """The poses of the sweep."""
        return self.motion.dynamics.poses

    @cached_property
    def input(self) -> Reals:
        """The input, (n,)."""
        return self.poses.inputs[:, 0]

    @cached_property
    def effort(self) -> Reals:
        """The effort by virtual work, (n,)."""
        return self.motion.dynamics.effort[:, 0]

    @cached_property
    def whole(self) -> bool:
        """Whether the sweep is a whole number of turns in equal steps, over which the effort comes back to itself."""
        q = self.input
        turns = (q[-1] - q[0]) / (2 * np.pi)
        steps = np.diff(q)
        even = np.abs(steps - steps.mean()).max() <= 1e-9 * abs(steps.mean())
        back = abs(self.effort[-1] - self.effort[0]) <= 1e-9 * np.abs(self.effort).max()
        return bool(
            not self.poses.mechanism.inputs[0].is_slide
            and abs(turns - round(turns)) < 1e-9
            and round(turns) != 0
            and even
            and back
        )

    def integral(self, values: Reals) -> float:
        """∫ values dq over the sweep."""
        if self.whole:
            return float(np.mean(values[:-1]) * (self.input[-1] - self.input[0]))
        if len(values) < 4:
            return float(np.trapezoid(values, self.input))
        from scipy.interpolate import CubicSpline

        forward = self._forward
        return float(
            CubicSpline(self.input[forward], values[forward]).integrate(self.input[0], self.input[-1])
        )

    @property
    def _forward(self) -> slice:
        """The poses in the order of a rising input, as splines want them."""
        return slice(None, None, -1 if self.input[-1] < self.input[0] else 1)

    @cached_property
    def span(self) -> float:
        """The length of the sweep, negative backwards."""
        return float(self.input[-1] - self.input[0])

    @cached_property
    def work(self) -> float:
        """∫ τ dq, J: what the input puts in."""
        return self.integral(self.effort)

    @property
    def mean(self) -> float:
        """The mean effort over the sweep."""
        return self.work / self.span

    @property
    def peak(self) -> float:
        """The largest size of the effort at the poses of the sweep."""
        return float(np.abs(self.effort).max())

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
        q = np.abs(self.input - self.input[0])
        # the weights of a spline exceed those of the trapezoidal rule by less than a half
        work = 1.5 * float(np.trapezoid(error + last * size, q))
        span = abs(self.span)
        return {
            "work": work,
            "mean": work / span,
            "peak": float(error.max()),
            # Minkowski: the root mean square of a sum is no more than the sum of those of its parts
            "rms": 1.5 * float(np.sqrt(np.trapezoid((error + last * size) ** 2, q) / span)),
            "fluctuation": 4 * work,
        }

    @cached_property
    def energy(self) -> tuple[Reals, Reals]:
        """Kinetic energy and potential of weights and springs at each pose, (n,) J."""
        scene = self.motion.dynamics.scene
        kinetic, potential = np.zeros(self.poses.n), np.zeros(self.poses.n)
        centers = {body: scene.case.path(body, r.center) for body, r in scene.rigid.items() if r.mass}
        keys: set[str] = set()
        for path in centers.values():
            keys |= path_reads(path)
        for block in scene.blocks(sorted(keys)):
            total: Any = None
            for body, r in scene.rigid.items():
                if body in centers and (v := block.velocity(centers[body])) is not None:
                    total = plus(total, 0.5 * r.mass * (v.real * v.real + v.imag * v.imag))
                if r.inertia and (w := block.omega(body)) is not None:
                    total = plus(total, 0.5 * r.inertia * w * w)
            if total is not None:
                kinetic[block.rows] = total
            for load in scene.loads:
                if load.stores:
                    value = load.potential(block)
                    if value is not None:
                        potential[block.rows] += value
        return kinetic, potential

    @property
    def closure(self) -> float | None:
        """How far the energy balance is from closing, J.

        Work in, plus the work of applied loads, dampers and friction, less the gain in kinetic energy and potential.
        None where the input's acceleration is not zero: the poses of such a sweep are no history.
        """
        if any(np.any(rate) for rate in self.poses.rates[1]) or np.ndim(self.poses.rates[0][0]):
            return None
        scene = self.motion.dynamics.scene
        total = self.effort.copy()
        for block in scene.blocks():
            for load in scene.case.everything:
                if load.kind in OWN:
                    continue
                value = minus(load.power(block, 0), load.elastic(block))
                if value is not None:
                    total[block.rows] += value
        kinetic, potential = self.energy
        gain = (kinetic[-1] - kinetic[0]) + (potential[-1] - potential[0])
        return self.integral(total) - float(gain)

    @cached_property
    def fluctuation(self) -> float:
        """The range of ∫ (τ − mean) dq, J: what a flywheel must store (Norton, Design of Machinery, §11.11).

        The extremes lie where τ crosses its mean, between the poses: found on the cubic spline through them.
        """
        from scipy.interpolate import CubicSpline

        values = self.effort.copy()
        if self.whole:
            values[-1] = values[0]
        forward = self._forward
        spline = CubicSpline(
            self.input[forward],
            values[forward] - self.mean,
            bc_type="periodic" if self.whole else "not-a-knot",
        )
        stored = spline.antiderivative()
        crossings = spline.roots(extrapolate=False)
        at = np.concatenate([self.input[[0, -1]], crossings[np.isfinite(crossings)]])
        levels = stored(at)
        return float(levels.max() - levels.min())

    def flywheel(self, coefficient: float) -> float:
        """The inertia that keeps (ω_max − ω_min)/ω_mean at `coefficient`: ΔE/(coefficient·ω²), kg·m².

        Raises
        ------
        ValueError
            Where the input does not turn.
        """
        speed = float(np.mean(self.poses.rates[0][0]))
        if speed == 0:
            raise ValueError("a flywheel needs a speed of the input that is not zero")
        return self.fluctuation / (coefficient * speed * speed)
