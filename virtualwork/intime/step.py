"""What a one-step method gives, whichever it is."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from virtualwork.formulas.numbers import Reals
from virtualwork.intime.equations import Equations
from virtualwork.intime.watch import Floats


class Step(NamedTuple):
    """Changes of q and q̇, the work, the rates at the end, the errors of (q, q̇) as the method knows them, and h·|λ|."""

    dq: Floats
    dv: Floats
    work: float
    rates: Floats
    errors: tuple[Floats, ...]
    stiffness: float


class Method(Protocol):
    """A one-step method; `stable` is the h·|λ| beyond which its stability limits the step."""

    name: str
    order: int
    stable: float

    def step(self, f: Equations, t: float, q: Floats, v: Floats, rates: Floats, h: float) -> Step:
        """One step of length h from a state whose rates are known."""

    def size(self, done: Step, scale: Floats) -> float:
        """A step's error over the one allowed in each of (q, q̇)."""

    def steps(
        self, f: Equations, t: Reals, q: Reals, v: Reals, rates: Reals, h: Reals
    ) -> tuple[Reals, Reals, Reals]:
        """Changes of q and q̇ (n, k) and the work (n,) over a step from each of n states, each of its own length."""
