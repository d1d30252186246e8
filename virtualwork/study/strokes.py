"""How far slides, points and rockers travel: their least and largest places, with the inputs there.

An extreme inside the range is a zero of the first derivative over the input, found by Newton's method with the exact
second one, kept inside its bracket; the ends of a range are tried too (places there are known to √ε: they move with the
root of the distance from a limit). At the ends of its stroke a slide or a rocker is
at its dead centre.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dalembert.dataclass import dataclass
from virtualwork.branch.assembly import Assembly
from virtualwork.formulas.lanes import Lanes
from virtualwork.formulas.newton import bracketed
from virtualwork.formulas.numbers import EPS, Reals
from virtualwork.quantities import Component, links, points, slides

SAMPLES = 720
# what moves less than this, of the mechanism's size or of a radian, rests; at a limit of the input places are known to √ε
RESTS, RESTS_AT_LIMITS = 1e-12, 4 * math.sqrt(EPS)
# periods of the loops within which all that turns beside them is looked for to come back
PERIODS = 32
# places nearer than this, in sizes of the mechanism or radians, are one
ALIKE = 1e-9


@dataclass(frozen=True)
class Stroke:
    """The travel of one quantity over the input's range.

    Attributes
    ----------
    name : str
        `B` of a slide, `C.x` and `C.y` of a point, `rocker.angle` of a link that does not turn round.
    turns : bool
        Whether it is an angle.
    least, most : float
        m or rad; of an angle the least lies in [0, 2π).
    at, most_at : float
        The inputs there, rad or m; of several the first.
    """

    name: str
    turns: bool
    least: float
    at: float
    most: float
    most_at: float

    @property
    def stroke(self) -> float:
        """From the least to the largest, m or rad."""
        return self.most - self.least


def _places(assembly: Assembly) -> list[Component]:
    """Slides, points and links, but for the input."""
    m = assembly.mechanism
    driven = m.inputs[0]
    guided = [name for name in reversed(m.guided) if name != driven.slider]
    turning = [link for link in m.links if link != driven.link]
    return [*slides(m, guided, 0), *points(m, m.points, 0), *links(turning, 0)]


def strokes(assembly: Assembly, limits: tuple[float, float] | None) -> tuple[Stroke, ...]:
    """Return the stroke of every slide, of every coordinate of a point that moves, and of every link that swings.

    Parameters
    ----------
    assembly : Assembly
        Of a mechanism with one input.
    limits : (float, float), optional
        The ends of the input's range around the guess, rad or m.

    Returns
    -------
    tuple of Stroke
        Empty with several inputs, and where the input runs on for ever without coming back. The range is that around the
        guess; a quantity that does not come back over `PERIODS` periods of the loops has none.

    Examples
    --------
    A slider-crank in line: twice the crank.

    >>> from virtualwork import Guess, Guide, Input, Link, Mechanism
    >>> m = Mechanism({"O": 0j}, {"crank": Link({"O": 0j, "A": 0.05}), "rod": Link({"A": 0j, "B": 0.2})},
    ...               [Guide("B", "rod")], inputs=Input("crank"), guess=Guess(1.0, {"rod": -0.2}))
    >>> s = strokes(m.assembly, None)[0]
    >>> s.name, round(s.least, 12), round(s.most, 12), round(s.at, 9), round(s.most_at, 9) + 0.0
    ('B', 0.15, 0.25, 3.141592654, 0.0)
    """
    m, track, period = assembly.mechanism, assembly.track, assembly.reach.period
    if len(m.inputs) > 1 or not track.active:
        return ()
    low, high = limits or (-np.inf, np.inf)
    limited = math.isfinite(high - low)
    if not (limited or period) or not Lanes(assembly, np.array([m.at[0]])).assembled[0]:
        return ()
    shown = _places(assembly)
    if not limited:
        assert period is not None
        low, high = 0.0, period * _periods(assembly, shown, period)
    search = _Search(assembly, track.samples(low, high, SAMPLES), shown, limited)
    return tuple(s for s in map(search.stroke, shown) if s is not None)


def _periods(assembly: Assembly, shown: list[Component], period: float) -> int:
    """How many periods of the loops bring back all that comes back: a planet's arm may need six turns of its sun."""
    q = period * (0.1234 + np.arange(PERIODS + 1))
    assembly.track.cover(0.0, float(q[-1]) + period)
    poses = Lanes(assembly, q)
    size = assembly.mechanism.size
    back = np.ones(PERIODS, dtype=bool)
    for each, place in zip(shown, poses.values([each.key for each in shown]), strict=True):
        value = np.broadcast_to(np.exp(1j * place) if each.in_degrees else place / size, q.shape)
        returns = np.abs(value[1:] - value[0]) <= ALIKE
        # what comes back at no time holds up nothing
        back &= returns if returns.any() else True
    return int(np.argmax(back)) + 1


class _Search:
    """Samples of the range, and what is looked for between them."""

    def __init__(self, assembly: Assembly, q: Reals, shown: list[Component], limited: bool) -> None:
        self.assembly, self.length = assembly, assembly.mechanism.size
        self.q, self.limited = q, limited
        keys = dict.fromkeys(s.key for s in shown)
        at = self._poses(q)
        places = [at.values((key,))[0] for key in keys]
        rates = [at.values((key.of_order(1),))[0] for key in keys]
        self.values = dict(zip(keys, zip(places, rates, strict=True), strict=True))
        self.ends = [self._at_limit(end, list(keys)) for end in ((0, 1.0), (-1, -1.0))] if limited else []

    def _at_limit(self, end: tuple[int, float], keys: list[Any]) -> dict[Any, Any]:
        """The places next to a limit, at the limit itself but for its rounding."""
        limit, unit = float(self.q[end[0]]), self.assembly.track.length
        inward = end[1] * EPS * max(abs(limit), unit) * np.append(0.0, 2.0 ** np.arange(40))
        poses = self._poses(limit + inward)
        places = [np.broadcast_to(v, 41) for v in poses.values(keys)]
        # what is assembled by one way of computing may not be by another, a rounding from the limit
        first = int(np.argmax(np.isfinite(places).all(axis=0)))
        return {key: place[first] for key, place in zip(keys, places, strict=True)}

    def _poses(self, q: Reals) -> Lanes:
        return Lanes(self.assembly, q, 1.0, 0.0)

    def _shown(self, q: float) -> float:
        """An input in [0, period), of several periods of the loops in [0, all of them)."""
        if self.limited:
            return self.assembly.reach.in_period(q)
        return 0.0 if min(q, float(self.q[-1]) - q) < ALIKE else q

    def stroke(self, shown: Component) -> Stroke | None:
        """The stroke of one quantity; None where it rests, or turns round."""
        place, rate = (np.broadcast_to(shown.in_si(v), self.q.shape) for v in self.values[shown.key])
        good = np.isfinite(place)
        if not good.any():
            return None
        turns = shown.in_degrees
        if turns:
            place = place.copy()
            place[good] = np.unwrap(place[good])
        travel = float(np.ptp(place[good]))
        unit = 1.0 if turns else self.length
        if travel <= (RESTS_AT_LIMITS if self.limited else RESTS) * unit:
            return None
        # what turns round, or runs on, has no stroke
        if not self.limited and not abs(place[0] - place[-1]) <= ALIKE * unit:
            return None
        least, most = (self._extreme(shown, place, rate, good, sign) for sign in (-1, 1))
        base = 2 * math.pi * math.floor(least[0] / (2 * math.pi)) if turns else 0.0
        return Stroke(
            shown.names[0].removesuffix(".position"),
            turns,
            least[0] - base,
            self._shown(least[1]),
            most[0] - base,
            self._shown(most[1]),
        )

    def _extreme(
        self,
        shown: Component,
        place: Reals,
        rate: Reals,
        good: NDArray[np.bool_],
        sign: int,
    ) -> tuple[float, float]:
        """The least (sign −1) or the largest value and the first input that has it."""
        q, height = self.q, np.where(good, sign * place, -np.inf)
        slope = np.where(np.isfinite(rate), sign * rate, 0.0)
        # between two samples it can rise by what the slopes allow
        rise = np.maximum(slope[:-1], 0.0) * np.diff(q)
        tops = np.flatnonzero((slope[:-1] > 0) & (slope[1:] < 0) & good[:-1] & good[1:])
        tops = tops[height[tops] + rise[tops] >= height.max()]
        candidates = [(float(height[i]), float(q[i])) for i in np.flatnonzero(height == height.max())]
        if len(tops):
            x = self._refined(shown, q[tops], q[tops + 1], sign)
            values = shown.in_si(self._poses(x).values((shown.key,))[0])
            near = place[tops]
            if shown.in_degrees:
                values = near + np.angle(np.exp(1j * (values - near)))
            candidates += [(float(v), float(at)) for v, at in zip(sign * values, x, strict=True)]
        for i, end in zip((0, -1), self.ends, strict=False):
            value, beside = float(shown.in_si(end[shown.key])), float(place[good][i])
            if shown.in_degrees:
                value = beside + math.remainder(value - beside, math.tau)
            candidates.append((sign * value, float(q[i])))
        best = max(v for v, _ in candidates)
        # equal to rounding: the first
        alike = 16 * EPS * max(abs(best), float(np.abs(place[good]).max()))
        value, at = min((pair for pair in candidates if pair[0] >= best - alike), key=lambda pair: pair[1])
        return sign * value, at

    def _refined(self, shown: Component, low: Reals, high: Reals, sign: int) -> Reals:
        """Zeros of the rate in brackets, all at once."""

        def at(x: Reals) -> tuple[Reals, Reals]:
            poses = self._poses(x)
            slope, bend = (sign * shown.in_si(poses.values((shown.key.of_order(k),))[0]) for k in (1, 2))
            return slope, bend

        return bracketed(at, low, high, 1.0, (low + high) / 2)
