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
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.doubled import Doubled
from dalembert.arithmetic.guard import guarded
from virtualwork.digits.second_run import TURN, Found, SecondRun, length
from virtualwork.formulas.asked import FORCES, Key, over_blocks
from virtualwork.formulas.lanes import Turning
from virtualwork.formulas.numbers import Reals
from virtualwork.formulas.poses import Poses

if TYPE_CHECKING:
    from virtualwork.formulas.dynamics import Dynamics

# of the difference, and of the quantity: what the second run itself may be off by, far from singular places
OWN, LAST = 1.01, 2.0**-96
# a radicand, relative, that rounding may reach, and the share of it that rounding takes
NEAR, DOUBTED = 1e-12, 0.1
# nodes on the way through a change point, and how many times farther off than the poses that a series carries through
NODES, FARTHER = 24, (8.0, 5.0)
# of the radicand: where branches are no farther apart they meet
MEETING = 1e-18

Values = Callable[[Sequence[Key]], Sequence[Any]]


@guarded
class Estimates:
    """Estimates of the rounding errors of quantities, by their keys (`Recording.value`).

    Parameters
    ----------
    poses : Poses
    values : function of keys, optional
        Gives the quantities as they were handed out, (n,) each; default those of the poses.
    dynamics : function, optional
        Gives the forces as they were handed out.
    """

    def __init__(
        self, poses: Poses, values: Values | None = None, dynamics: Callable[[], Dynamics] | None = None
    ) -> None:
        self.poses, self.n, self.lock = poses, poses.n, poses.lock
        # poses that are asked for estimates are those of an assembly
        self.branch = cast(Turning, poses.branch)
        self._values = values or (lambda keys: [over_blocks(poses, key) for key in keys])
        self._dynamics = dynamics
        self._known: dict[Key, Reals] = {}
        # of each group, the poses whose assembly rounding may have exchanged, once they were looked at
        self._undecided: dict[str, NDArray[np.bool_]] | None = None

    def of(self, key: Key) -> Reals:
        """The estimate of a quantity's error, (n,); the length of the error of a vector."""
        self.together([key])
        return self._known[key]

    def together(self, keys: Iterable[Key]) -> None:
        """Form the estimates of several quantities, which have most of the second run in common; `of` gives them out."""
        new = [key for key in dict.fromkeys(keys) if key not in self._known]
        lost = [key for key in new if self._lost(key)]
        self._known |= {key: np.full(self.n, np.inf) for key in lost}
        new = [key for key in new if key not in lost]
        if not new:
            return
        values = dict(zip(new, self._values(new), strict=True))
        margins: list[Key] = [("margin", g.name) for g in self.second.exact.closed]
        found = self.second.doubled([*new, *margins])
        if self._undecided is None:
            self._undecided = self._doubted({key[1]: found[key][0].value for key in margins})
        errors = {key: _apart(key, values[key], found[key]) for key in new}
        rows = self._close_to_change
        if rows.any():
            errors = self._passing(new, rows, values, errors)
        for group, rows in self._undecided.items():
            here = [key for key in new if group in self.second.exact.hangs_on(key)]
            some = self.second.some(rows)
            other = some.doubled(here, {f"sign {group}": -some.sign(group)}) if here else {}
            for key in here:
                errors[key][rows] = np.maximum(errors[key][rows], _apart(key, values[key][rows], other[key]))
        for key in new:
            for more in self.second.uncertain(key, found):
                errors[key] = errors[key] + more
            # what is no number is infinite
            known = np.isfinite(values[key])
            size = np.abs(values[key])
            estimate = np.where(errors[key] < np.inf, OWN * errors[key] + LAST * size, np.inf)
            self._known[key] = np.where(known, estimate, np.nan)

    @cached_property
    def second(self) -> SecondRun:
        """The poses in 32 digits."""
        return SecondRun(self.poses, dynamics=self._dynamics)

    def _lost(self, key: Key) -> bool:
        """Whether a quantity has no second run: a rate where the speed is not determined."""
        if not self.branch.folded:
            return False
        rates = key[0] in FORCES or (key[0] != "turn" and key[-1] != 0)
        return rates and not self.branch.folded.isdisjoint(self.second.exact.hangs_on(key))

    def _doubted(self, margins: Mapping[str, Any]) -> dict[str, NDArray[np.bool_]]:
        """The poses so near a limit of a group that rounding may have taken the one of its two assemblies for the other."""
        found = {}
        for group in self.second.exact.closed:
            exact = margins[group.name]
            if group.name in self.second.exact.folded or not np.any(np.abs(exact) < NEAR):
                continue
            self.poses.solve(self.poses.plan.writes(group), 0)
            off = np.abs(self._margin(group.name) - exact) > DOUBTED * np.abs(exact)
            rows = (np.abs(exact) < NEAR) & off & ~self._close_to_change
            if rows.any():
                found[group.name] = rows
        return found

    def _margin(self, group: str) -> Reals:
        """The radicand of a closed form in the first run, relative, (n,)."""
        return self.poses.over(lambda _, st: st.margin[group])  # type: ignore[no-any-return]

    # --- change points ----------------------------------------------------------------------------------------------
    @cached_property
    def _close_to_change(self) -> NDArray[np.bool_]:
        """The poses close to a change point, where a series replaces the closed forms."""
        if self.poses.inputs.shape[1] > 1:
            return np.zeros(self.n, dtype=bool)
        _ = self.second.lanes.recording
        return self.branch.close_to_change(self.poses.inputs[:, 0])

    def _passing(
        self,
        keys: Sequence[Key],
        rows: NDArray[np.bool_],
        values: Mapping[Key, Any],
        errors: Mapping[Key, Reals],
    ) -> dict[Key, Reals]:
        """The errors close to change points, by interpolation where two branches meet there exactly.

        Where the numbers keep them apart, if only in their last digits, the formulas themselves say what happens.
        """
        turns: list[Key] = [("turn", body) for g in self.second.exact.closed for body in g.angles]
        margins: list[Key] = [("margin", g.name) for g in self.second.exact.closed]
        some = self.second.some(rows)
        beside = self._interpolated([*keys, *turns], rows)
        here = some.doubled([*turns, *margins])
        root = np.sqrt(
            np.abs(np.min([np.broadcast_to(here[key][0].value, some.n) for key in margins], axis=0))
        )
        apart = [
            length([(a - b).value for a, b in zip(here[key], beside[0][key], strict=True)]) for key in turns
        ]
        meet = np.max(apart, axis=0) * root < MEETING
        found = {}
        for key in keys:
            part = values[key][rows]
            smooth = np.maximum(*(_apart(key, part, each[key]) for each in beside))
            found[key] = errors[key].copy()
            found[key][rows] = np.where(meet, smooth, errors[key][rows])
        return found

    def _interpolated(self, keys: Sequence[Key], rows: NDArray[np.bool_]) -> list[Found]:
        """The quantities close to change points from poses farther off, two times: how far these are apart tells of both."""
        q = self.poses.inputs[rows, 0]
        places = self.branch.change_points
        nearest = [min(places, key=lambda place: abs(x - place[0])) for x in q.tolist()]
        found = []
        for farther in FARTHER:
            steps = np.cos((np.arange(NODES) + 0.5) * (math.pi / NODES))
            nodes = np.array([at + farther * reach * steps for at, reach in nearest])
            lanes = self.second.again(np.flatnonzero(rows), nodes).doubled(keys)
            weights = _weights(nodes, Doubled(q, self.second.rest[rows, 0]))
            found.append(
                {
                    key: [_weighted(part, weights, nodes.shape) for part in parts]
                    for key, parts in lanes.items()
                }
            )
        return found


def _apart(key: Key, value: Any, exact: Sequence[Doubled]) -> Reals:
    """The size of the difference of a quantity and its second run, (n,)."""
    parts = [value] if len(exact) == 1 else [value.real, value.imag]
    with np.errstate(invalid="ignore"):
        apart = [of - Doubled(part) for of, part in zip(exact, parts, strict=True)]
        if key[0] == "angle" and key[2] == 0:
            apart = [apart[0] - TURN * np.rint(apart[0].high / (2 * math.pi))]
        return length([each.value for each in apart])


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
