"""Springs and dampers, between two points or two bodies: their force or torque, work, potential and second variation."""

from __future__ import annotations

from typing import Any

from dalembert.dataclass import dataclass, field
from virtualwork.describe.parts import Spring, TorsionSpring
from virtualwork.formulas.loaded_pose import LoadedPose
from virtualwork.formulas.loads import Load, angle_rate, times_dot
from virtualwork.formulas.numbers import TOGETHER, Number, dot, minus, plus, times
from virtualwork.formulas.rates import Rates
from virtualwork.plan.steps import Path, path_reads


@dataclass(frozen=True, eq=False)
class SpringSide(Load):
    """One side of a spring and damper between two bodies; the one that carries the work moves by the whole displacement."""

    spring: Spring | TorsionSpring = field(kw_only=True)

    def stretch(self, pose: LoadedPose) -> Number:
        """How far the spring is from free."""
        raise NotImplementedError

    def pull(self, pose: LoadedPose) -> Number:
        """The spring's own part of its value."""
        raise NotImplementedError

    def damped(self, pose: LoadedPose) -> Number:
        """The damper's part."""
        raise NotImplementedError

    def form(self, pose: LoadedPose) -> Number:
        return plus(self.pull(pose), self.damped(pose))

    def wasted(self, pose: LoadedPose, j: int) -> Number:
        return self.work(self.damped(pose), self.displacement(pose, j)) if self.carries else None

    def potential(self, pose: LoadedPose) -> Number:
        if not self.carries:
            return None
        stretch = self.stretch(pose)
        return 0.5 * self.spring.stiffness * stretch * stretch


@dataclass(frozen=True, eq=False)
class SpringEnd(SpringSide):
    """What a spring and damper pulls at one end: toward the other with k(l − l₀) + c·l̇."""

    spring: Spring = field(kw_only=True)
    other: Path = field(kw_only=True)

    def reads(self) -> set[str]:
        return super().reads() | path_reads(self.other)

    def _between(self, of: Any) -> Number:
        """The vector from this end to the other, or its rate."""
        return minus(of(self.other), of(self.path))

    def _inverse(self, pose: LoadedPose, d: Number) -> Number:
        """1/l; NaN where the spring has no length, and its pull no direction."""
        length = pose.kind.sqrt(d.real * d.real + d.imag * d.imag)
        return pose.kind.inverse(length, TOGETHER * pose.setting.mechanism.size)

    def stretch(self, pose: LoadedPose) -> Number:
        return abs(self._between(pose.position)) - self.spring.free_length

    def pull(self, pose: LoadedPose) -> Number:
        s = self.spring
        if not s.stiffness:
            return None
        d = self._between(pose.position)
        if not s.free_length:
            # the pull is k·d: no direction is needed, and none exists at zero length
            return s.stiffness * d
        return s.stiffness * (1 - s.free_length * self._inverse(pose, d)) * d

    def damped(self, pose: LoadedPose) -> Number:
        rate = self._between(pose.velocity) if self.spring.damping else None
        if rate is None:
            return None
        d = self._between(pose.position)
        inverse = self._inverse(pose, d)
        return (self.spring.damping * dot(d, rate) * (inverse * inverse)) * d

    def displacement(self, pose: LoadedPose, j: int) -> Number:
        if not self.carries:
            return None
        moved = self._between(lambda path: pose.coefficient(path, j))
        return None if moved is None else -moved

    def second(self, pose: LoadedPose, rates: Rates) -> Number:
        """−k[(1 − l₀/l)(d′·d′ + d·d″) + l₀(d·d′)²/l³]."""
        s, d1 = self.spring, self._between(lambda path: rates.vector(path, 1))
        if not self.carries or not s.stiffness or d1 is None:
            return None
        d, d2 = self._between(pose.position), self._between(lambda path: rates.vector(path, 2))
        share: Number = 1.0
        bend: Number = 0.0
        if s.free_length:
            inverse = self._inverse(pose, d)
            share, bend = 1 - s.free_length * inverse, s.free_length * inverse**3 * dot(d, d1) ** 2
        return -s.stiffness * (share * plus(dot(d1, d1), times_dot(d, d2)) + bend)


@dataclass(frozen=True, eq=False)
class TorsionEnd(SpringSide):
    """What a torsion spring and damper turns one link with: k·φ + c·φ̇ against the twist φ from free; +1 the first link."""

    spring: TorsionSpring = field(kw_only=True)
    sign: float = 1.0

    def reads(self) -> set[str]:
        return {f"angle:{body}" for body in self.spring.links}

    def _between(self, of: Any) -> Number:
        """Of the second link less the first."""
        a, b = self.spring.links
        return minus(of(b), of(a))

    def stretch(self, pose: LoadedPose) -> Number:
        return pose.setting.twist(pose.st, self.spring)

    def pull(self, pose: LoadedPose) -> Number:
        stiffness = self.spring.stiffness
        return times(stiffness * self.stretch(pose), self.sign) if stiffness else None

    def damped(self, pose: LoadedPose) -> Number:
        rate = self._between(pose.omega) if self.spring.damping else None
        return times(times(rate, self.spring.damping), self.sign)

    def displacement(self, pose: LoadedPose, j: int) -> Number:
        if not self.carries:
            return None
        return times(self._between(lambda body: pose.turning(body, j)), -self.sign)

    def second(self, pose: LoadedPose, rates: Rates) -> Number:
        """−k(φ′² + φ·φ″)."""
        s, first = self.spring, self._between(lambda body: angle_rate(rates, body, 1))
        if not self.carries or not s.stiffness or first is None:
            return None
        bend = self._between(lambda body: angle_rate(rates, body, 2))
        return -s.stiffness * plus(first * first, times(self.stretch(pose), bend))
