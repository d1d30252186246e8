"""Estimates of the rounding errors of a motion's quantities: computed twice, with 16 and with 32 digits, and compared.

The second run is the same tape with every number of the description as an input (`exact`), on doubled numbers. What was
decided in the first run, which assembly and which whole turn, enters; the unknowns of groups without a closed form go on
with Newton's method from those of the first. What neither run knows adds to the difference: an input that is not exact,
and the constant of a gear that the guess fixes by way of other links.

Close to a change point, where the Jacobian of a loop vanishes though the branch goes on, the second run is interpolated
between poses farther off, by Lagrange's polynomial in its barycentric form (J.-P. Berrut, L. N. Trefethen, SIAM Review 46,
2004, eq. 4.2).

An estimate is infinite where no digit holds, NaN where the pose is not assembled.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.doubled import Doubled
from dalembert.arithmetic.engines.doubled import OWN, estimated
from dalembert.arithmetic.guard import guarded
from virtualwork.digits.second_run import Results, SecondRun, apart, parts
from virtualwork.formulas.kinematics import Angle, Point, Slide, Turn
from virtualwork.formulas.lanes import MANY_POSES, Lanes
from virtualwork.formulas.loops import Margin
from virtualwork.formulas.numbers import Reals
from virtualwork.formulas.quantity import Quantity

# a radicand, relative, that rounding may reach, and the share of it that rounding takes
NEAR, DOUBTED = 1e-12, 0.1
# nodes on the way through a change point, and how many times farther off than the poses that a series carries through
NODES, FARTHER = 24, (8.0, 5.0)
# of the radicand: where branches are no farther apart they meet
MEETING = 1e-18
# quantities whose estimates are requested one after the other
ASKED = (Point, Angle, Slide)

Values = Callable[[Sequence[Quantity]], Sequence[Any]]


@guarded
class Estimates:
    """Estimates of the rounding errors of quantities.

    Parameters
    ----------
    poses : Lanes
    values : function of keys, optional
        Gives the quantities as they were handed out, (n,) each; default those of the poses.
    """

    def __init__(self, poses: Lanes, values: Values | None = None) -> None:
        self.poses, self.n, self.lock = poses, poses.n, poses.lock
        self.branch = poses.branch
        self._values = values or poses.values
        self._known: dict[Quantity, Reals] = {}
        # of each group, once it was looked at, the poses whose assembly rounding may have exchanged
        self._undecided: dict[str, NDArray[np.bool_]] = {}

    def of(self, key: Quantity) -> Reals:
        """The estimate of a quantity's error, (n,); the length of the error of a vector."""
        self.together([key])
        return self._known[key]

    def together(self, keys: Iterable[Quantity]) -> None:
        """Form the estimates of several quantities, which have most of the second run in common; `of` gives them out."""
        new = [key for key in dict.fromkeys(keys) if key not in self._known]
        if new and self._known and self.n >= MANY_POSES and all(isinstance(key, ASKED) for key in new):
            # who asks again for an estimate will ask for those of all that he has: a second run has most of it in common
            others = (
                key for key in self.poses.requested if isinstance(key, ASKED) and key not in self._known
            )
            new = list(dict.fromkeys((*new, *others)))
        values = dict(zip(new, self._values(new), strict=True)) if new else {}
        for key in filter(self._lost, new):
            value = values.pop(key)
            self._known[key] = _without_nan(np.full(self.n, np.inf), value)
        new = list(values)
        if not new:
            return
        margins = [Margin(g.name) for g in self.second.exact.closed if g.name not in self._undecided]
        if margins:
            # of groups that none of these depend on nothing is formed
            depended = {group for key in new for group in key.groups(self.second.exact)}
            margins = [key for key in margins if key.group in depended]
        estimates, results = self.second.compared(values, margins)
        self._undecided |= self._doubted({key.group: results[key][0].value for key in margins})
        rows = self._close_to_change
        if rows.any():
            self._pass(rows, values, estimates)
        for group, rows in self._undecided.items():
            here = [key for key in new if group in key.groups(self.second.exact)] if rows.any() else []
            if here:
                some = self.second.some(rows)
                other = {f"sign {group}": -some.sign(group)}
                there, _ = some.compared({key: values[key][rows] for key in here}, changed=other)
                for key in here:
                    estimates[key][rows] = np.maximum(estimates[key][rows], there[key])
        for key in new:
            for more in self.second.uncertain(key):
                estimates[key] += OWN * more
            self._known[key] = _without_nan(estimates[key], values[key])

    @cached_property
    def second(self) -> SecondRun:
        """The poses in 32 digits."""
        return SecondRun(self.poses)

    def _lost(self, key: Quantity) -> bool:
        """Whether a quantity has no second run: a rate where the speed is not determined."""
        if not self.branch.folded:
            return False
        rates = key.is_force or key.order > 0
        return rates and not self.branch.folded.isdisjoint(key.groups(self.second.exact))

    def _doubted(self, margins: Mapping[str, Any]) -> dict[str, NDArray[np.bool_]]:
        """The poses so near a limit of a group that rounding may have taken the one of its two assemblies for the other."""
        results = {}
        for group in self.second.exact.closed:
            if group.name not in margins:
                continue
            exact = margins[group.name]
            results[group.name] = np.zeros(self.n, dtype=bool)
            if group.name in self.second.exact.folded or not np.any(np.abs(exact) < NEAR):
                continue
            (margin,) = self.poses.taped([Margin(group.name)])
            off = np.abs(margin - exact) > DOUBTED * np.abs(exact)
            results[group.name] = (np.abs(exact) < NEAR) & off & ~self._close_to_change
        return results

    # --- change points ----------------------------------------------------------------------------------------------
    @cached_property
    def _close_to_change(self) -> NDArray[np.bool_]:
        """The poses close to a change point, where a series replaces the closed forms."""
        if self.poses.inputs.shape[1] > 1:
            return np.zeros(self.n, dtype=bool)
        _ = self.second.poses.recording
        return self.branch.close_to_change(self.poses.inputs[:, 0])

    def _pass(
        self, rows: NDArray[np.bool_], values: Mapping[Quantity, Any], estimates: dict[Quantity, Reals]
    ) -> None:
        """The estimates close to change points, by interpolation where two branches meet there exactly.

        Where the numbers keep them apart, if only in their last digits, the formulas themselves say what happens.
        """
        turns: list[Quantity] = [Turn(body) for g in self.second.exact.closed for body in g.angles]
        margins = [Margin(g.name) for g in self.second.exact.closed]
        some = self.second.some(rows)
        beside = self._interpolated([*values, *turns], rows)
        here = some.doubled([*turns, *margins])
        root = np.sqrt(
            np.abs(np.min([np.broadcast_to(here[key][0].value, some.n) for key in margins], axis=0))
        )
        gaps = [apart(key, here[key], beside[0][key]) for key in turns]
        meet = np.max(gaps, axis=0) * root < MEETING
        for key, value in values.items():
            answered = parts(key, value[rows])
            smooth = np.maximum(*(estimated(each[key], answered, key.is_angle) for each in beside))
            estimates[key][rows] = np.where(meet, smooth, estimates[key][rows])

    def _interpolated(self, keys: Sequence[Quantity], rows: NDArray[np.bool_]) -> list[Results]:
        """The quantities close to change points from poses farther off, two times: how far these are apart tells of both."""
        q = self.poses.inputs[rows, 0]
        places = self.branch.change_points
        nearest = [min(places, key=lambda place: abs(x - place[0])) for x in q.tolist()]
        results = []
        for farther in FARTHER:
            steps = np.cos((np.arange(NODES) + 0.5) * (math.pi / NODES))
            nodes = np.array([at + farther * reach * steps for at, reach in nearest])
            lanes = self.second.again(np.flatnonzero(rows), nodes).doubled(keys)
            weights = _weights(nodes, Doubled(q, self.second.rest[rows, 0]))
            results.append(
                {
                    key: [_weighted(part, weights, nodes.shape) for part in parts]
                    for key, parts in lanes.items()
                }
            )
        return results


def _without_nan(estimates: Reals, values: Any) -> Reals:
    """Estimates where what is no number is infinite, and NaN where the quantity itself is none."""
    if np.isfinite(np.add.reduce(estimates)):
        return estimates
    return np.where(np.isfinite(values), np.where(np.isnan(estimates), np.inf, estimates), np.nan)


def _weights(nodes: Reals, q: Doubled) -> list[Doubled]:
    """The barycentric weights of values at nodes (rows, nodes) for their polynomial at q (rows,); their sum is 1."""
    weights = []
    columns = [Doubled(column) for column in nodes.T]
    for i, node in enumerate(columns):
        product = q - node
        for k, other in enumerate(columns):
            if k != i:
                product = product * (node - other)
        weights.append(1.0 / product)
    total = weights[0]
    for weight in weights[1:]:
        total = total + weight
    return [weight / total for weight in weights]


def _weighted(values: Doubled, weights: Sequence[Doubled], shape: tuple[int, ...]) -> Doubled:
    total: Doubled = Doubled(0.0)
    high, low = (np.broadcast_to(part, math.prod(shape)).reshape(shape) for part in (values.high, values.low))
    for i, weight in enumerate(weights):
        total = total + weight * Doubled(high[:, i], low[:, i])
    return total
