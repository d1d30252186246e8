"""Springs with their dampers between two bodies, as loads: those between points, and torsion springs between links."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from virtualwork.describe.parts import Spring, TorsionSpring
from virtualwork.formulas.block import Block
from virtualwork.formulas.loads import Load, angle_rate, times_dot
from virtualwork.formulas.numbers import TOGETHER, Number, dot, minus, plus, times
from virtualwork.formulas.rates import Rates
from virtualwork.plan.steps import Path, path_reads


@dataclass(frozen=True, eq=False)
class SpringEnd(Load):
    """What a spring and damper pulls at one end: toward the other with k(l − l₀) + c·l̇.

    Its potential is k(l − l₀)²/2. The end that carries the work moves by the whole relative displacement.
    """

    spring: Spring = field(kw_only=True)
    other: Path = field(kw_only=True)

    def reads(self) -> set[str]:
        return super().reads() | path_reads(self.other)

    def _between(self, of: Any) -> Number:
        """The vector from this end to the other, or its rate."""
        return minus(of(self.other), of(self.path))

    def _elastic(self, block: Block, d: Number) -> Number:
        s = self.spring
        if not s.free_length:
            # the pull is k·d: no direction is needed, and none is asked for at zero length
            return s.stiffness * d
        return s.stiffness * (1 - s.free_length * self._inverse(block, d)) * d

    def _inverse(self, block: Block, d: Number) -> Number:
        """1/l; NaN where the spring has no length, and its pull no direction."""
        kind = block.st.kind
        length = kind.sqrt(d.real * d.real + d.imag * d.imag)
        return kind.inverse(length, TOGETHER * block.setting.mechanism.size)

    def form(self, block: Block) -> Number:
        s, d = self.spring, self._between(block.position)
        pull = self._elastic(block, d) if s.stiffness else None
        return plus(pull, self._damped(block, d))

    def _damped(self, block: Block, d: Number) -> Number:
        """The damper's part."""
        rate = self._between(block.velocity) if self.spring.damping else None
        if rate is None:
            return None
        inverse = self._inverse(block, d)
        return (self.spring.damping * dot(d, rate) * (inverse * inverse)) * d

    def displacement(self, block: Block, j: int) -> Number:
        if not self.carries:
            return None
        moved = self._between(lambda path: block.coefficient(path, j))
        return None if moved is None else -moved

    def elastic(self, block: Block) -> Number:
        if not self.carries or not self.spring.stiffness:
            return None
        return self.work(self._elastic(block, self._between(block.position)), self.displacement(block, 0))

    def wasted(self, block: Block, j: int) -> Number:
        if not self.carries:
            return None
        return self.work(self._damped(block, self._between(block.position)), self.displacement(block, j))

    def potential(self, block: Block) -> Number:
        if not self.carries:
            return None
        stretch = abs(self._between(block.position)) - self.spring.free_length
        return 0.5 * self.spring.stiffness * stretch * stretch

    def second(self, block: Block, rates: Rates) -> Number:
        """−k[(1 − l₀/l)(d′·d′ + d·d″) + l₀(d·d′)²/l³]."""
        s, d1 = self.spring, self._between(lambda path: rates.vector(path, 1))
        if not self.carries or not s.stiffness or d1 is None:
            return None
        d, d2 = self._between(block.position), self._between(lambda path: rates.vector(path, 2))
        share: Number = 1.0
        bend: Number = 0.0
        if s.free_length:
            inverse = self._inverse(block, d)
            share, bend = 1 - s.free_length * inverse, s.free_length * inverse**3 * dot(d, d1) ** 2
        return -s.stiffness * (share * plus(dot(d1, d1), times_dot(d, d2)) + bend)


@dataclass(frozen=True, eq=False)
class TorsionEnd(Load):
    """What a torsion spring and damper turns one link with: k·φ + c·φ̇ against the twist φ from free.

    Its potential is k·φ²/2; `sign` is +1 on the first link.
    """

    spring: TorsionSpring = field(kw_only=True)
    sign: float = 1.0

    def reads(self) -> set[str]:
        return {f"angle:{body}" for body in self.spring.links}

    def _between(self, of: Any) -> Number:
        """Of the second link less the first."""
        a, b = self.spring.links
        return minus(of(b), of(a))

    def form(self, block: Block) -> Number:
        s = self.spring
        turn = s.stiffness * block.setting.twist(block.st, s) if s.stiffness else None
        return times(plus(turn, self._damped(block)), self.sign)

    def _damped(self, block: Block) -> Number:
        """The damper's part."""
        return times(self._between(block.omega), self.spring.damping) if self.spring.damping else None

    def displacement(self, block: Block, j: int) -> Number:
        if not self.carries:
            return None
        return times(self._between(lambda body: block.turning(body, j)), -self.sign)

    def elastic(self, block: Block) -> Number:
        if not self.carries or not self.spring.stiffness:
            return None
        turn = self.spring.stiffness * block.setting.twist(block.st, self.spring) * self.sign
        return self.work(turn, self.displacement(block, 0))

    def wasted(self, block: Block, j: int) -> Number:
        if not self.carries:
            return None
        return self.work(times(self._damped(block), self.sign), self.displacement(block, j))

    def potential(self, block: Block) -> Number:
        if not self.carries:
            return None
        angle = block.setting.twist(block.st, self.spring)
        return 0.5 * self.spring.stiffness * angle * angle

    def second(self, block: Block, rates: Rates) -> Number:
        """−k(φ′² + φ·φ″)."""
        s, first = self.spring, self._between(lambda body: angle_rate(rates, body, 1))
        if not self.carries or not s.stiffness or first is None:
            return None
        bend = self._between(lambda body: angle_rate(rates, body, 2))
        return -s.stiffness * plus(first * first, times(block.setting.twist(block.st, s), bend))
