"""Groups without a closed form along the input, of all variants at once, as `branch.continuation` follows them for one.

Each variant starts from its own guess, and its nodes are those that the nominal mechanism's lead to. Where they do not go on
from one to the next as steps of a continuation do, the variant is left to be described alone.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any, Self

import numpy as np

from dalembert.arithmetic.engines import run, run_grid
from virtualwork.branch.assembly import Assembly
from virtualwork.branch.continuation import STEEP, cubic, fine_steps
from virtualwork.describe import MechanismError
from virtualwork.family.varied_formulas import VariedFormulas
from virtualwork.formulas.group_loops import Loops
from virtualwork.formulas.newton import newton
from virtualwork.formulas.numbers import SINGULAR, Number, Reals
from virtualwork.plan.steps import Group

# of how far its Jacobian is from singular anywhere on the way: a group that comes nearer is described alone
LEAST = 1e-3
# of the nominal mechanism: inputs and unknowns of the nodes of each group
Nodes = Mapping[str, tuple[Reals, Reals]]
EMPTY: Mapping[str, Any] = MappingProxyType({})


class Ways:
    """How the groups without a closed form of some variants stand, wherever their input goes.

    Parameters
    ----------
    written : VariedFormulas
        With the signs as inputs.
    own : Assembly
        Of the nominal mechanism.
    nodes : mapping of a group's name to inputs (m,) and unknowns (m, u)
        Its own.
    numbers : mapping of path to array (n,)
    n : int
    low, high : array (n,), or (1,) where they are the same of all
        The least and the largest input.

    Attributes
    ----------
    starts : dict
        What enters a tape at the guess, by name, (n,): the unknowns there.
    followed : array (n,) of bool
        Which variants go on from node to node over their inputs.
    """

    def __init__(
        self,
        written: VariedFormulas,
        own: Assembly,
        nodes: Nodes,
        numbers: Mapping[str, Reals],
        n: int,
        low: Reals,
        high: Reals,
    ) -> None:
        self.written, self.own, self.n = written, own, n
        self.followed = np.ones(n, dtype=bool)
        self.starts = dict[str, Reals]()
        # the dimensions, and the sign of each closed form at the guess
        self.given: dict[str, Any] = dict(numbers)
        self._loops = {group.name: _Loops(group) for group in written.iterated}
        self._nodes: dict[str, tuple[Reals, Reals, Reals]] = {}
        with np.errstate(all="ignore"):
            self._begin()
            for group in written.iterated:
                self._follow(group, *nodes[group.name], low, high)

    def of(self, rows: Any) -> Self:
        """Some of the variants."""
        result = object.__new__(type(self))
        vars(result).update(vars(self))
        result.given = {
            name: values[rows] if np.ndim(values) else values for name, values in self.given.items()
        }
        result._nodes = {name: (q, x[rows], rate[rows]) for name, (q, x, rate) in self._nodes.items()}
        result.followed = self.followed[rows]
        result.n = len(result.followed)
        return result

    def _begin(self) -> None:
        """Close every group at the guess, as `guess.choose` does, from the unknowns that the guess says."""
        written, m = self.written, self.own.mechanism
        given = {**self.given, "q0": m.at[0]}
        self.starts = {name: np.full(self.n, np.nan) for group in written.iterated for name in group.unknowns}
        for group in written.iterated:
            choice = run(written.choice, given | self.starts)
            self.given |= {f"sign {g.name}": choice[f"sign {g.name}"] + 0.0 for g in written.closed}
            start = self._guessed(group, run(written.guessed, given | self.given | self.starts))
            there = {name: values[:, None] for name, values in self.starts.items()}
            fixed, size = self._fixed(group, np.full((1, 1), m.at[0]), there)
            solution, closed = newton(self._loops[group.name], fixed, start, size)
            self.followed &= closed
            self.starts |= zip(group.unknowns, solution.T, strict=True)

    def _guessed(self, group: Group, guess: Any) -> Reals:
        """The unknowns that the guess says, (n, u); slides of which it says nothing close the loops as nearly as they can."""
        name, free = group.name, self.written.free[group.name]
        rows = range(2 * len(group.closures))

        def stacked(names: Iterable[str]) -> Reals:
            return np.stack([np.broadcast_to(guess[each], self.n) for each in names], axis=-1)

        x = stacked(f"guess {name} {i}" for i in range(len(group.angles) + len(group.slides)))
        if free:
            gap = stacked(f"gap {name} {row}" for row in rows)
            along = np.stack([stacked(f"column {name} {row} {i}" for row in rows) for i in free], axis=-1)
            there = np.flatnonzero(np.isfinite(along).all(axis=(1, 2)) & np.isfinite(gap).all(axis=1))
            x[np.ix_(there, np.array(free))] = -(np.linalg.pinv(along[there]) @ gap[there][..., None])[..., 0]
        return x

    def _follow(self, group: Group, q: Reals, nominal: Reals, low: Reals, high: Reals) -> None:
        """Lay down the nodes of a group, all at once, and see in which variants they are the steps of a continuation."""
        name, at = group.name, self.own.mechanism.at[0]
        first, last = np.searchsorted(q, low, "right"), np.searchsorted(q, high, "left")
        self.followed &= (first > 0) & (last < len(q))
        some = slice(max(int(first.min()) - 1, 0), int(last.max()) + 1)
        q, nominal, first, last = q[some], nominal[some], first - 1 - some.start, last - some.start
        m, u = nominal.shape
        loops, (fixed, size) = self._loops[name], self._fixed(group, q[None])
        start = np.broadcast_to(nominal, (self.n, m, u)).reshape(-1, u)
        solution, closed = newton(loops, fixed, start, size, limit=8)
        det = np.sign(np.linalg.det(loops.over(fixed)(solution)[1])).reshape(self.n, m)
        size = size.reshape(self.n, m, 1)
        x, here = solution.reshape(self.n, m, u), int(np.searchsorted(q, at))
        x[:, here] = np.stack([self.starts[each] for each in group.unknowns], axis=-1)
        entering = {each: x[..., i] for i, each in enumerate(group.unknowns)}
        tape = self.written.rates(name)
        *rates, regular = run_grid(tape, self._entering(tape.inputs, q[None], entering), (self.n, m))
        rate = np.stack(rates, axis=-1)
        place = np.arange(m)
        needed = (place >= first[:, None]) & (place <= last[:, None])
        far = np.maximum(np.abs(x), size)
        far[..., : len(group.angles)] = 1.0
        sound = (
            closed.reshape(self.n, m) & np.isfinite(rate).all(axis=2) & (det == det[:, [here]]) & (det != 0)
        )
        sound &= (
            regular >= np.maximum(LEAST * np.where(needed, regular, 0.0).max(axis=1), 10 * SINGULAR)[:, None]
        )
        # a guess where the branch stands upright
        unit = np.where(np.arange(u) < len(group.angles), 1.0, size[:, here])
        sound[:, here] &= np.abs(rate[:, here] / unit).max(axis=1) * self.own.track.length < STEEP
        # from the guess outwards
        a, b = np.append(place[1 : here + 1], place[here:-1]), np.append(place[:here], place[here + 1 :])
        moved, step = x[:, b] - x[:, a], (q[b] - q[a])[:, None]
        fine = fine_steps(step, moved, rate[:, a], rate[:, b], far[:, a])
        self.followed &= (sound | ~needed).all(axis=1) & (fine | ~(needed[:, a] & needed[:, b])).all(axis=1)
        self._nodes[name] = q, x, rate

    # --- anywhere on the way ----------------------------------------------------------------------------------------
    def unknowns(self, group: Group, q: Reals) -> Reals:
        """The unknowns of a group at inputs (n or 1, k), (n, k, u); NaN where it is not closed there."""
        nodes, x, rate = self._nodes[group.name]
        i = np.clip(np.searchsorted(nodes, q) - 1, 0, len(nodes) - 2)
        h, rows = nodes[i + 1] - nodes[i], np.arange(self.n)[:, None]
        t = ((q - nodes[i]) / h)[..., None]
        start = cubic(h[..., None], t, x[rows, i], x[rows, i + 1], rate[rows, i], rate[rows, i + 1])
        fixed, size = self._fixed(group, q)
        with np.errstate(all="ignore"):
            solution, closed = newton(
                self._loops[group.name], fixed, start.reshape(-1, start.shape[-1]), size
            )
        solution[~closed] = np.nan
        return solution.reshape(start.shape)

    def entering(self, names: Iterable[str], q: Reals) -> dict[str, Reals]:
        """The unknowns among what enters a tape, (n, k), at inputs (n or 1, k)."""
        names, result = set(names), dict[str, Reals]()
        for group in self.written.iterated:
            if not names.isdisjoint(group.unknowns):
                result |= zip(group.unknowns, np.moveaxis(self.unknowns(group, q), 2, 0), strict=True)
        return result

    def _entering(self, names: Iterable[str], q: Reals, unknowns: Mapping[str, Reals]) -> dict[str, Any]:
        """All that enters a tape over a grid, with the unknowns that are known."""
        across = {name: values[:, None] if np.ndim(values) else values for name, values in self.given.items()}
        return {**across, "q0": q, **unknowns, **self.entering(set(names) - unknowns.keys(), q)}

    def _fixed(self, group: Group, q: Reals, unknowns: Mapping[str, Reals] = EMPTY) -> tuple[Any, Reals]:
        """What enters the loops of a group at inputs (n or 1, k), and the mechanism's size, (n k,) each."""
        tape = self.written.enters(group.name)
        rows = run_grid(tape, self._entering(tape.inputs, q, unknowns), (self.n, q.shape[1]))
        *fixed, size = (np.reshape(row, -1) for row in rows)
        return fixed, size


class _Loops(Loops):
    """The loops of a group in lanes of variants: all that enters is there, and every lane is one of many."""

    few = 0

    def fixed(self, st: Any) -> list[Number]:
        return list(st)


def nodes_of(own: Assembly, low: float, high: float) -> Nodes:
    """The nodes of a mechanism's groups without a closed form over inputs from low to high; none where it does not go so far."""
    with own.lock:
        try:
            own.cover(low, high)
        except MechanismError:
            return {}
        return {name: way.nodes[:2] for name, way in own.track.continuations.items()}
