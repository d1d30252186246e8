"""Groups without a closed form along the inputs, of all variants at once, as `branch` follows them for one.

Each variant starts from its own guess. Along one input its nodes are those that the nominal mechanism's lead to
(`branch.continuation`); with several inputs every pose has a straight line from the guess (`branch.lines`). Where the steps
are too long for a continuation, the variant is left to be described alone.
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
from virtualwork.formulas.winding import NODES
from virtualwork.plan.steps import Group

# of how far its Jacobian is from singular anywhere on the way: a group that comes nearer is described alone
LEAST = 1e-3
# of the nominal mechanism: inputs and unknowns of the nodes of each group
Nodes = Mapping[str, tuple[Reals, Reals]]
EMPTY: Mapping[str, Any] = MappingProxyType({})


class Ways:
    """How the groups without a closed form of some variants stand, wherever their inputs go.

    Parameters
    ----------
    written : VariedFormulas
        With the signs as inputs.
    own : Assembly
        Of the nominal mechanism.
    numbers : mapping of path to array (n,)
    n : int

    Attributes
    ----------
    starts : dict
        What enters a tape at the guess, by name, (n,): the unknowns there.
    followed : array (n,) of bool
        Which variants are closed at the guess, and go on as steps of a continuation do.
    """

    def __init__(self, written: VariedFormulas, own: Assembly, numbers: Mapping[str, Reals], n: int) -> None:
        self.written, self.own, self.n = written, own, n
        self.followed = np.ones(n, dtype=bool)
        self.starts = dict[str, Reals]()
        # the dimensions, and the sign of each closed form at the guess
        self.numbers: dict[str, Any] = dict(numbers)
        self._loops = {group.name: _Loops(group) for group in written.iterated}
        with np.errstate(all="ignore"):
            self._begin()

    def of(self, rows: Any) -> Self:
        """Some of the variants."""
        result = object.__new__(type(self))
        vars(result).update(vars(self))
        result.numbers = {
            name: values[rows] if np.ndim(values) else values for name, values in self.numbers.items()
        }
        result.starts = {name: values[rows] for name, values in self.starts.items()}
        result.followed = self.followed[rows]
        result.n = len(result.followed)
        return result

    def _begin(self) -> None:
        """Close every group at the guess, as `guess.choose` does, from the unknowns that the guess says."""
        written, m = self.written, self.own.mechanism
        at_guess = {**self.numbers, **{f"q{j}": at for j, at in enumerate(m.at)}}
        self.starts = {name: np.full(self.n, np.nan) for group in written.iterated for name in group.unknowns}
        for group in written.iterated:
            choice = run(written.choice, at_guess | self.starts)
            self.numbers |= {f"sign {g.name}": choice[f"sign {g.name}"] + 0.0 for g in written.closed}
            start = self._guessed(group, run(written.guessed, at_guess | self.numbers | self.starts))
            there = {name: values[:, None] for name, values in self.starts.items()}
            fixed, size = self._fixed(group, np.array(m.at)[None, None], there)
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

    def unknowns(self, group: Group, q: Reals) -> Reals:
        """The unknowns of a group at inputs (n or 1, k, inputs), (n, k, u); NaN where it is not closed there."""
        raise NotImplementedError

    def entering(self, names: Iterable[str], q: Reals) -> dict[str, Reals]:
        """The unknowns among what enters a tape, (n, k), at inputs (n or 1, k, inputs)."""
        names, result = set(names), dict[str, Reals]()
        for group in self.written.iterated:
            if not names.isdisjoint(group.unknowns):
                result |= zip(group.unknowns, np.moveaxis(self.unknowns(group, q), 2, 0), strict=True)
        return result

    def _entering(self, names: Iterable[str], q: Reals, unknowns: Mapping[str, Reals]) -> dict[str, Any]:
        """All that enters a tape over a grid, with the unknowns that are known."""
        across = {
            name: values[:, None] if np.ndim(values) else values for name, values in self.numbers.items()
        }
        return {**across, **_inputs(q), **unknowns, **self.entering(set(names) - unknowns.keys(), q)}

    def _fixed(self, group: Group, q: Reals, unknowns: Mapping[str, Reals] = EMPTY) -> tuple[Any, Reals]:
        """What enters the loops of a group at inputs (n or 1, k, inputs), and the mechanism's size, (n k,) each."""
        tape = self.written.enters(group.name)
        rows = run_grid(tape, self._entering(tape.inputs, q, unknowns), (self.n, q.shape[1]))
        *fixed, size = (np.reshape(row, -1) for row in rows)
        return fixed, size


class AlongInput(Ways):
    """Along the one input, over nodes.

    Parameters
    ----------
    nodes : mapping of a group's name to inputs (m,) and unknowns (m, u)
        Those of the nominal mechanism.
    low, high : array (n,), or (1,) where they are the same of all
        The least and the largest input.
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
        super().__init__(written, own, numbers, n)
        self._nodes: dict[str, tuple[Reals, Reals, Reals]] = {}
        with np.errstate(all="ignore"):
            for group in written.iterated:
                self._follow(group, *nodes[group.name], low, high)

    def of(self, rows: Any) -> Self:
        """Some of the variants."""
        result = super().of(rows)
        result._nodes = {name: (q, x[rows], rate[rows]) for name, (q, x, rate) in self._nodes.items()}
        return result

    def _follow(self, group: Group, q: Reals, nominal: Reals, low: Reals, high: Reals) -> None:
        """Lay down the nodes of a group, all at once, and see in which variants they are the steps of a continuation."""
        name, at = group.name, self.own.mechanism.at[0]
        first, last = np.searchsorted(q, low, "right"), np.searchsorted(q, high, "left")
        self.followed &= (first > 0) & (last < len(q))
        some = slice(max(int(first.min()) - 1, 0), int(last.max()) + 1)
        q, nominal, first, last = q[some], nominal[some], first - 1 - some.start, last - some.start
        m, u = nominal.shape
        loops, (fixed, size) = self._loops[name], self._fixed(group, q[None, :, None])
        start = np.broadcast_to(nominal, (self.n, m, u)).reshape(-1, u)
        solution, closed = newton(loops, fixed, start, size, limit=8)
        det = np.sign(np.linalg.det(loops.over(fixed)(solution)[1])).reshape(self.n, m)
        size = size.reshape(self.n, m, 1)
        x, here = solution.reshape(self.n, m, u), int(np.searchsorted(q, at))
        x[:, here] = np.stack([self.starts[each] for each in group.unknowns], axis=-1)
        entering = {each: x[..., i] for i, each in enumerate(group.unknowns)}
        tape = self.written.rates(name)
        *rates, regular = run_grid(tape, self._entering(tape.inputs, q[None, :, None], entering), (self.n, m))
        rate = np.stack(rates, axis=-1)
        place = np.arange(m)
        needed = (place >= first[:, None]) & (place <= last[:, None])
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
        step = (q[b] - q[a])[:, None]
        fine = fine_steps(group, size[:, a], step, x[:, a], x[:, b], rate[:, a], rate[:, b])
        self.followed &= (sound | ~needed).all(axis=1) & (fine | ~(needed[:, a] & needed[:, b])).all(axis=1)
        self._nodes[name] = q, x, rate

    def unknowns(self, group: Group, q: Reals) -> Reals:
        """The unknowns of a group at inputs (n or 1, k, 1), (n, k, u); NaN where it is not closed there."""
        (nodes, x, rate), at = self._nodes[group.name], q[..., 0]
        i = np.clip(np.searchsorted(nodes, at) - 1, 0, len(nodes) - 2)
        h, rows = nodes[i + 1] - nodes[i], np.arange(self.n)[:, None]
        t = ((at - nodes[i]) / h)[..., None]
        start = cubic(h[..., None], t, x[rows, i], x[rows, i + 1], rate[rows, i], rate[rows, i + 1])
        fixed, size = self._fixed(group, q)
        with np.errstate(all="ignore"):
            solution, closed = newton(
                self._loops[group.name], fixed, start.reshape(-1, start.shape[-1]), size
            )
        solution[~closed] = np.nan
        return solution.reshape(start.shape)


class AlongLines(Ways):
    """With several inputs: every pose on its own straight line from the guess, in equal steps."""

    def unknowns(self, group: Group, q: Reals) -> Reals:
        """The unknowns of a group at inputs (n or 1, k, inputs), (n, k, u); NaN where a step is too long for it."""
        k, u = q.shape[1], len(group.angles) + len(group.slides)
        lanes = self.of(np.repeat(np.arange(self.n), k))
        with np.errstate(all="ignore"):
            x = lanes._walked(group, np.broadcast_to(q, (self.n, *q.shape[1:])).reshape(self.n * k, -1))
        return x.reshape(self.n, k, u)

    def _walked(self, group: Group, q: Reals) -> Reals:
        """The unknowns (n, u) of variants that have one pose each, (n, inputs)."""
        m, result = self.own.mechanism, np.full((self.n, len(group.unknowns)), np.nan)
        at = np.broadcast_to(m.at, q.shape)
        _, size = self._fixed(group, at[:, None])
        unit = np.stack([size if of.is_slide else np.full(self.n, 2 * np.pi) for of in m.inputs], axis=1)
        steps = np.maximum(1.0, np.ceil(np.abs((q - at) / unit).max(axis=1) * NODES))
        x = np.stack([self.starts[name] for name in group.unknowns], axis=1)
        rows = np.flatnonzero(np.isfinite(steps) & np.isfinite(x).all(axis=1))
        some, x, ways = self.of(rows), x[rows], (q - at)[rows]
        slope, taken = some._slope(group, at[rows], ways, x), 0
        while len(rows):
            taken += 1
            last, step = steps[rows] == taken, 1 / steps[rows, None]
            there = np.where(last[:, None], q[rows], at[rows] + taken * step * ways)
            fixed, size = some._fixed(group, there[:, None])
            new, closed = newton(some._loops[group.name], fixed, x + step * slope, size, limit=8)
            after = some._slope(group, there, ways, new)
            closed &= fine_steps(group, size[:, None], step, x, new, slope, after)
            result[rows[closed & last]] = new[closed & last]
            on = closed & ~last
            rows, x, slope, ways, some = rows[on], new[on], after[on], ways[on], some.of(on)
        return result

    def _slope(self, group: Group, q: Reals, ways: Reals, x: Reals) -> Reals:
        """dx of variants with one pose each, (n, u), where every input changes by its way, (n, inputs)."""
        tape = self.written.rates(group.name)
        unknowns = {name: x[:, i, None] for i, name in enumerate(group.unknowns)}
        *rates, _ = run_grid(tape, self._entering(tape.inputs, q[:, None], unknowns), (self.n, 1))
        by = np.reshape(rates, (ways.shape[1], x.shape[1], self.n))
        return np.asarray(sum(rate.T * way[:, None] for rate, way in zip(by, ways.T, strict=True)))


class _Loops(Loops):
    """The loops of a group in lanes of variants: all that enters is there, and every lane is one of many."""

    few = 0

    def fixed(self, st: Any) -> list[Number]:
        return list(st)


def _inputs(q: Reals) -> dict[str, Reals]:
    """Inputs (n or 1, k, inputs) by their names on a tape."""
    return {f"q{j}": q[..., j] for j in range(q.shape[-1])}


def nodes_of(own: Assembly, low: float, high: float) -> Nodes:
    """The nodes of a mechanism's groups without a closed form over inputs from low to high; none where it does not go so far."""
    with own.lock:
        try:
            own.cover(low, high)
        except MechanismError:
            return {}
        return {name: way.nodes[:2] for name, way in own.track.continuations.items()}
