"""Seeded random campaigns at singular places: the true error against the bound that the program itself gives.

A campaign draws a case from a seed, solves it, and compares the error with the program's own estimate. A case is
replayed by its seed. Short campaigns are run by the tests, long ones by `python -m benchmarks stress --time 10min`.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from importlib import import_module

import numpy as np

# the modules that have a dict CAMPAIGNS: name -> (what it does, trial(rng) -> [(error, bound), ...])
MODULES = tuple(
    f"benchmarks.stress.{name}"
    for name in (
        "rotors",
        "linkages",
        "groups",
        "vibration",
        "placing",
        "machines",
        "rotation",
        "solids",
        "gyroscopes",
        "topology_rates",
        "loaded",
        "equilibria",
        "assemblies",
        "in_time",
        "released",
        "tapes",
        "digits",
    )
)

Trial = Callable[[np.random.Generator], list[tuple[float, float]]]


@dataclass
class Tally:
    """What a campaign has seen: of each trial the largest error over its bound, and the worst one's seed."""

    name: str
    line: str
    trials: int = 0
    worst: float = 0.0
    seed: int = -1
    ratios: list[float] = field(default_factory=list)

    @property
    def bounded(self) -> float:
        """The share of answers whose error is within the program's estimate."""
        return float(np.mean(np.array(self.ratios) <= 1)) if self.ratios else 1.0

    @property
    def slack(self) -> float:
        """The median of estimate over error, among answers that have an error."""
        return self.slacks(0.5)[0]

    def slacks(self, *shares: float) -> list[float]:
        """The estimate over the error that shares of the answers with an error do not exceed."""
        errors = np.array([ratio for ratio in self.ratios if ratio > 0] or [1.0])
        return [float(x) for x in np.quantile(1 / errors, shares)]


def campaigns() -> dict[str, tuple[str, Trial]]:
    """Return every campaign by name."""
    found: dict[str, tuple[str, Trial]] = {}
    for module in MODULES:
        more = import_module(module).CAMPAIGNS
        if not found.keys().isdisjoint(more):
            raise ValueError(f"two campaigns of one name: {', '.join(found.keys() & more.keys())}")
        found |= more
    return found


def replay(name: str, seed: int) -> list[tuple[float, float]]:
    """Return the (error, bound) pairs of one trial."""
    return campaigns()[name][1](np.random.default_rng(seed))


def run(name: str, seconds: float, first_seed: int = 0) -> Iterator[Tally]:
    """Run a campaign for a time, yielding its tally after every trial."""
    line, trial = campaigns()[name]
    tally = Tally(name, line)
    end = time.monotonic() + seconds
    seed = first_seed
    while tally.trials == 0 or time.monotonic() < end:
        for error, bound in trial(np.random.default_rng(seed)):
            ratio = error / bound if bound > 0 else float("inf") if error > 0 else 0.0
            tally.ratios.append(ratio)
            if ratio > tally.worst or tally.seed < 0:
                tally.worst, tally.seed = ratio, seed
        tally.trials += 1
        seed += 1
        yield tally
