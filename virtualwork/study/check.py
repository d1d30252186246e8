"""What kind of mechanism this is: mobility, redundant constraints, Grashof classes, limits, dead and change points."""

from __future__ import annotations

import math
from functools import cached_property
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from dalembert.arithmetic.guard import Lock, guarded
from dalembert.dataclass import dataclass
from virtualwork.branch.assembly import Assembly
from virtualwork.describe import AssemblyError
from virtualwork.describe.description import Description
from virtualwork.describe.parts import GROUND
from virtualwork.formulas.constraints import Constraints, coordinates, dependent
from virtualwork.formulas.lanes import Lanes
from virtualwork.formulas.positions import State

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from virtualwork.study.cams import CamCheck, LiftOff
    from virtualwork.study.strokes import Stroke

# two sums of lengths nearer than this, relative, are equal
EQUAL = 1e-12


@dataclass(frozen=True)
class FourBar:
    """A closed chain of four pinned bodies.

    `grashof`: crank-rocker, double-crank, double-rocker, triple-rocker (no link turns fully), change-point; for a
    chain that does not hold the ground, as seen from its first body. `transmission`: the least and the largest
    angle between its coupler and follower, rad.
    """

    links: tuple[str, ...]
    lengths: tuple[float, float, float, float]
    grashof: str
    transmission: tuple[float, float]


@guarded
@dataclass(frozen=True)
class Check:
    """The character of a mechanism: mobility, limits, dead and change points, strokes, each computed on request.

    Examples
    --------
    >>> from virtualwork import Guess, Input, Link, Mechanism
    >>> m = Mechanism(ground={"A": (0, 0), "D": (4, 0)},
    ...               links={"crank": Link({"A": (0, 0), "B": (2, 0)}),
    ...                      "coupler": Link({"B": (0, 0), "C": (5, 0)}),
    ...                      "rocker": Link({"D": (0, 0), "C": (2, 0)})},
    ...               inputs=Input(link="crank"),
    ...               guess=Guess(at=3.14, angles={"coupler": 0.3, "rocker": 2.0}))
    >>> check = Check(m.assembly)
    >>> check.four_bars[0].grashof, [round(math.degrees(q), 6) for q in check.input_limits]
    ('triple-rocker', [46.567463, 313.432537])
    """

    assembly: Assembly

    @property
    def lock(self) -> Lock:
        """That of the assembly."""
        return self.assembly.lock

    def __repr__(self) -> str:
        four_bars = ", ".join(f"{'-'.join(f.links)}: {f.grashof}" for f in self.four_bars) or "no four-bar"
        return f"Check({self.mechanism.name!r}: mobility {self.mobility}, {four_bars})"

    @property
    def mechanism(self) -> Description:
        """What is checked."""
        return self.assembly.mechanism

    @property
    def mobility(self) -> int:
        """Grübler's count: three for each link, less what the joints take."""
        return self.assembly.plan.blocks.mobility

    @cached_property
    def cams(self) -> tuple[CamCheck, ...]:
        """The largest pressure angle, the least radius of curvature and the steps of every cam."""
        if not self.mechanism.cams:
            return ()
        from virtualwork.study.cams import check_cam

        return tuple(check_cam(self.mechanism, number) for number in range(len(self.mechanism.cams)))

    def lift_off(self, cam: int) -> LiftOff | None:
        """The speed from which on a cam, from 0, would have to pull its follower; None where that has no meaning."""
        from virtualwork.study.cams import lift_off

        return lift_off(self.assembly, cam)

    @cached_property
    def _rank(self) -> tuple[int, tuple[str, ...]]:
        m, plan = self.mechanism, self.assembly.plan
        here = Constraints.at(m, coordinates(m, plan, self._typical()), self.assembly.phases)
        if not len(here.labels):
            return 0, ()
        if not np.isfinite(here.jacobian).all():
            raise AssemblyError("no assembled pose of the motion determines the rank of the joints")
        return dependent(here.labels, here.jacobian)

    @property
    def mobility_by_rank(self) -> int:
        """The degrees of freedom that the Jacobian of the joints leaves, at a pose that is not singular."""
        return 3 * len(self.mechanism.links) - self._rank[0]

    @property
    def redundant(self) -> tuple[str, ...]:
        """The joints whose constraints depend on each other, so that some of them could be left out."""
        return self._rank[1]

    def _typical(self) -> State:
        """A pose away from the singular ones."""
        m, track = self.mechanism, self.assembly.track
        low, high = self._span()
        qs = (
            [m.at[0] + (high - low) * f for f in (0.0, 0.0137, 0.0511, -0.0271, 0.113)]
            if track.active
            else [m.at[0]]
        )
        best, chosen = np.inf, None
        for q in qs:
            inputs = (q, *m.at[1:])
            condition = float(Lanes(self.assembly, np.array([inputs])).condition[0])
            if condition < best or (chosen is None and condition == np.inf):
                best, chosen = condition, inputs
        if chosen is None and track.active and not np.isnan(self._sampled.condition).all():
            # the guess lies beyond a limit
            chosen = (float(self._along[np.nanargmin(self._sampled.condition)]),)
        if chosen is None:
            raise self.assembly.reach.nowhere()
        return self.assembly.state(chosen)

    # --- along the input ------------------------------------------------------------------------------------
    def _span(self) -> tuple[float, float]:
        track = self.assembly.track
        if not track.active:
            return 0.0, 0.0
        if self.mechanism.inputs[0].is_slide:
            return track.start - track.length, track.start + track.length
        return track.start, track.start + (self.assembly.reach.period or track.length)

    @property
    def _along(self) -> NDArray[np.float64]:
        """Inputs over the whole span."""
        return np.linspace(*self._span(), 1441)

    @cached_property
    def input_limits(self) -> tuple[float, float] | None:
        """The ends of the input's range around the guess, rad or m; None where it goes on for ever."""
        reach = self.assembly.reach
        if not reach.track.active or not reach.limits():
            return None
        low, high = reach.range
        # on the other side it goes on as far as it was looked for
        return None if math.isinf(low) and math.isinf(high) else (low, high)

    @cached_property
    def dead_points(self) -> tuple[float, ...]:
        """Inputs at which the linkage locks, every end of a range of the input, rad, or m.

        Of a slide, of the ranges that are met within one size of the mechanism from the guess, or farther where its
        own range is longer.

        Angles in [0, period of the branch): where change points make a branch need two turns of the input, the
        same angle a turn later is another pose (`virtualwork.branch.limits.Reach.turns`).
        """
        reach = self.assembly.reach
        return reach.distinct(limit.input for limit in reach.limits()) if reach.track.active else ()

    @cached_property
    def change_points(self) -> tuple[float, ...]:
        """Inputs at which two branches cross, rad in [0, period of the branch), or m."""
        track = self.assembly.track
        if not track.active:
            return ()
        track.cover(*self._span())
        return self.assembly.reach.distinct(track.crossings)

    @property
    def printed_limits(self) -> tuple[float, ...] | None:
        """The same ends in [0, period of the branch), as tables and JSON have them.

        The range goes from the first up to the second, through the end of the period where the second is the smaller.
        """
        return (
            None
            if self.input_limits is None
            else tuple(map(self.assembly.reach.in_period, self.input_limits))
        )

    @property
    def singular(self) -> tuple[str, ...]:
        """The groups that are singular in every pose: their assemblies meet all along, their rates are not determined."""
        track = self.assembly.track
        if track.active:
            track.cover(*self._span())
        return tuple(g.name for g in self.assembly.plan.groups if g.name in track.folded)

    @cached_property
    def strokes(self) -> tuple[Stroke, ...]:
        """How far each slide, each point and each link that swings travels, with the inputs at both ends."""
        from virtualwork.study.strokes import strokes

        return strokes(self.assembly, self.input_limits)

    # --- parts ------------------------------------------------------------------------------------------------
    @property
    def groups(self) -> tuple[dict[str, Any], ...]:
        """The Assur groups in their order of solution, each with its links, its kind and its method."""
        return tuple(
            {
                "links": list(g.links),
                "kind": g.kind if g.kind != "Newton" else f"{len(g.angles) + len(g.slides)} unknowns",
                "method": "Newton-Raphson" if g.kind == "Newton" else "closed form",
            }
            for g in self.assembly.plan.groups
        )

    @cached_property
    def four_bars(self) -> tuple[FourBar, ...]:
        """Every closed chain of four pinned bodies, with its Grashof class."""
        m = self.mechanism
        pins: dict[frozenset[str], list[str]] = {}
        for point, bodies in m.pins.items():
            for a, b in combinations(bodies, 2):
                pins.setdefault(frozenset((a, b)), []).append(point)
        driven = [str(e.link) for e in m.inputs if e.link is not None]
        order = [GROUND, *driven, *(b for b in m.links if b not in driven)]
        result = []
        for a, b, c, d in _cycles(order, pins):
            corners = [pins[frozenset(pair)][0] for pair in ((a, b), (b, c), (c, d), (d, a))]
            if len(set(corners)) < 4:
                continue
            lengths = tuple(
                abs(m.bodies[body][p] - m.bodies[body][q])
                for body, p, q in zip((a, b, c, d), (corners[-1], *corners[:-1]), corners, strict=True)
            )
            result.append(self._four_bar((a, b, c, d), corners, lengths))  # type: ignore[arg-type]
        return tuple(result)

    def _four_bar(
        self,
        bodies: tuple[str, str, str, str],
        corners: list[str],
        lengths: tuple[float, float, float, float],
    ) -> FourBar:
        ground, crank, coupler, rocker = lengths
        links = bodies[1:] if bodies[0] == GROUND else bodies
        if bodies[0] == GROUND and any(e.link == bodies[1] and e.on == GROUND for e in self.mechanism.inputs):
            low, high = abs(coupler - rocker), coupler + rocker
            # in line where the sums of lengths are equal, as in the class: the angle has the root of a difference
            same = EQUAL * max(lengths)
            reach = (abs(ground - crank), ground + crank)
            ends = [low if r < low + same else high if r > high - same else r for r in reach]
            angles = sorted(_angle(coupler, rocker, r) for r in ends)
        else:
            angles = self._seen(bodies, corners)
        return FourBar(links, lengths, grashof_class(*lengths), (angles[0], angles[-1]))

    @cached_property
    def _sampled(self) -> Lanes:
        """Poses over the whole span, for every four-bar the same."""
        return Lanes(
            self.assembly, self._along if self.assembly.track.active else np.array([self.mechanism.at])
        )

    def _seen(self, bodies: tuple[str, ...], corners: list[str]) -> list[float]:
        """The transmission angle over the motion, sampled, for chains that are not driven at their own crank."""
        b, c, d = (self._sampled.point(GROUND, 0j, 0, p) for p in corners[1:])
        mu = np.abs(np.angle((b - c) * np.conj(d - c)))
        mu = mu[np.isfinite(mu)]
        return [float(mu.min()), float(mu.max())] if len(mu) else [math.nan, math.nan]


def grashof_class(ground: float, crank: float, coupler: float, rocker: float) -> str:
    """Return the class of a four-bar from its lengths (F. Grashof, 1883).

    Parameters
    ----------
    ground, crank, coupler, rocker : float
        Lengths in any common unit.

    Returns
    -------
    str
        `crank-rocker`, `double-crank`, `double-rocker`, `triple-rocker` or `change-point`, as in Norton, Design of
        Machinery, §2.13.

    Examples
    --------
    >>> grashof_class(100, 40, 120, 80), grashof_class(4, 2, 5, 2), grashof_class(5, 2, 5, 2)
    ('crank-rocker', 'triple-rocker', 'change-point')
    """
    shortest, p, q, longest = sorted((ground, crank, coupler, rocker))
    difference = (shortest + longest) - (p + q)
    if abs(difference) <= EQUAL * longest:
        return "change-point"
    if difference > 0:
        return "triple-rocker"
    if shortest == ground:
        return "double-crank"
    return "double-rocker" if shortest == coupler else "crank-rocker"


def _angle(a: float, b: float, opposite: float) -> float:
    """The angle between sides a and b of a triangle, by its half: no cancellation near 0 and π."""
    up = (opposite - (a - b)) * (opposite + (a - b))
    down = (a + b - opposite) * (a + b + opposite)
    return 2 * math.atan2(math.sqrt(max(up, 0.0)), math.sqrt(max(down, 0.0)))


def _cycles(order: list[str], pins: dict[frozenset[str], list[str]]) -> list[tuple[str, str, str, str]]:
    """Every ring of four bodies once, beginning with the earliest, the earlier neighbour next."""
    cycles = []
    rank = {body: i for i, body in enumerate(order)}
    beside = {b: [o for o in order if frozenset((b, o)) in pins and o != b] for b in order}
    for a in order:
        for b in beside[a]:
            for c in beside[b]:
                for d in beside[c]:
                    if (
                        len({a, b, c, d}) == 4
                        and a in beside[d]
                        and rank[a] < min(rank[b], rank[c], rank[d])
                        and rank[b] < rank[d]
                    ):
                        cycles.append((a, b, c, d))
    return cycles
