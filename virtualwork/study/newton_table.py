"""Newton-Raphson on all loops of a mechanism at once, with the table of iterates."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from dalembert.arithmetic.records import record
from virtualwork.branch.assembly import Assembly
from virtualwork.branch.solutions import guessed_unknowns
from virtualwork.describe import AssemblyError
from virtualwork.describe.description import known_by_guess
from virtualwork.formulas.group_loops import LAST, ROUNDED, Loops
from virtualwork.formulas.newton import CLOSED
from virtualwork.formulas.numbers import Reals, solve
from virtualwork.formulas.positions import State
from virtualwork.plan.steps import Group


@record
@dataclass(frozen=True, eq=False, repr=False)
class Iterate:
    """One row of the Newton-Raphson table: the unknowns and the gap they leave."""

    k: int
    unknowns: Reals
    residual: float


@record
@dataclass(frozen=True, eq=False, repr=False)
class AllAtOnce:
    """Newton-Raphson on all loops of a mechanism together, as Nicoletti, lecture 7, does it.

    Attributes
    ----------
    unknowns : tuple of str
        The links whose angle is unknown, then the points whose slide is.
    iterates : tuple of Iterate
        x1 is the guess; angles in rad as the iteration leaves them (not wrapped), slides in m.
    jacobian : array
        Φ at the guess: two rows (x, y) for each loop, one column for each unknown, m/rad or 1.
    closed : bool
        Did it converge?
    difference : float
        Largest difference of an angle to the assembly solved group by group, rad.
    """

    unknowns: tuple[str, ...]
    angles: int
    iterates: tuple[Iterate, ...]
    jacobian: Reals
    closed: bool
    difference: float

    def __repr__(self) -> str:
        end = f"closed, residual {self.iterates[-1].residual:.3g} m" if self.closed else "not closed"
        return f"AllAtOnce({', '.join(self.unknowns)}: {len(self.iterates)} iterates, {end})"


class Worked(NamedTuple):
    """An iterate with its system: the unknowns, f (m; x and y of each loop), Φ, and Δx = −Φ⁻¹·f."""

    k: int
    unknowns: Reals
    residual: Reals
    jacobian: Reals
    step: Reals


def worked(assembly: Assembly, inputs: tuple[float, ...], done: AllAtOnce) -> list[Worked]:
    """Return the system of every iterate of `all_at_once`, with its numbers (Nicoletti, lecture 7).

    Examples
    --------
    >>> from virtualwork import Guess, Input, Link, Mechanism
    >>> m = Mechanism({"A": 0j, "D": 3}, {"crank": Link({"A": 0j, "B": 1}), "coupler": Link({"B": 0j, "C": 3}),
    ...     "rocker": Link({"D": 0j, "C": 2})}, inputs=Input(link="crank"), guess=Guess(0.0, {"coupler": 0.7, "rocker": 1.7}))
    >>> done = m.newton(0.0)
    >>> first, second, *_ = worked(m.assembly, (0.0,), done)
    >>> first.jacobian.shape, bool(np.allclose(first.unknowns + first.step, second.unknowns))
    ((2, 2), True)
    """
    group, st = _prepared(assembly, inputs)
    at, result = assembly.loops(group).over(st), []
    for iterate in done.iterates:
        with np.errstate(all="ignore"):
            f, jacobian = at(iterate.unknowns[None])
            step = solve(jacobian, -f)
        result.append(Worked(iterate.k, iterate.unknowns, f[0], jacobian[0], step[0]))
    return result


def _prepared(assembly: Assembly, inputs: tuple[float, ...]) -> tuple[Group, State]:
    """All loops as one group, and the state of what is known without them."""
    merged, group = assembly.merged
    if group is None:
        raise AssemblyError("newton: the mechanism has no loop to close")
    st = State(list(inputs))
    for step in merged.steps:
        if step is group:
            break
        assembly.run([step], st)
    return group, st


def all_at_once(
    assembly: Assembly, inputs: tuple[float, ...], limit: int = 50, start: Reals | None = None
) -> AllAtOnce:
    """Solve all loops of a mechanism at once by Newton-Raphson from its guess, undamped, with the table of iterates.

    x_{k+1} = x_k − Φ(x_k)⁻¹·f(x_k) (Nicoletti, lecture 7). `start`: the unknowns to begin with, in place of the guess.

    Raises
    ------
    AssemblyError
        Where the guess does not give every unknown angle.
    """
    m = assembly.mechanism
    group, st = _prepared(assembly, inputs)
    first = _guessed(assembly, group, st) if start is None else start[None]
    loops = assembly.loops(group)
    _, (jacobian,) = loops.over(st)(first)
    with np.errstate(all="ignore"):
        table, closed = iterates(loops, st, first[0], m.size, limit)
        x = table[-1].unknowns
        exact = assembly.state(inputs)
        # numpy's maximum keeps a NaN: where one link is not assembled there is nothing to compare with
        away = [
            np.abs(np.angle(np.exp(1j * x[j]) / np.ravel(exact.turn[body])[0]))
            for j, body in enumerate(group.angles)
        ]
        difference = float(np.max(away, initial=0.0))
    names = (*group.angles, *(m.guides[g].point for g in group.slides))
    return AllAtOnce(names, len(group.angles), tuple(table), jacobian, closed, difference)


def iterates(loops: Loops, st: State, start: Reals, size: float, limit: int) -> tuple[list[Iterate], bool]:
    """The table of an undamped search in one pose, from its start (unknowns,) on; and whether it closes the loops."""
    at, x, result = loops.over(st), start, list[Iterate]()
    slides = np.arange(len(x)) >= len(loops.group.angles)
    longest = np.inf
    while True:
        f, jacobian = at(x[None])
        gap = float(np.linalg.norm(f))
        far = float(np.abs(x[slides]).max(initial=size))
        result.append(Iterate(len(result) + 1, x, gap))
        if not np.isfinite(gap) or (gap <= ROUNDED * far and longest <= LAST) or len(result) > limit:
            return result, gap <= CLOSED * far
        (step,) = solve(jacobian, -f)
        step = np.where(np.isfinite(step).all(), step, 0.0)
        longest = float(np.abs(step / np.where(slides, far, 1.0)).max(initial=0.0))
        x = x + step


def _guessed(assembly: Assembly, group: Group, st: State) -> Reals:
    """The unknowns at the guess, (1, unknowns)."""
    m = assembly.mechanism
    angles, points = known_by_guess(m)
    for body in group.angles:
        if body not in angles:
            raise AssemblyError(
                f"[guess]: newton starts from the guess, and the angle of '{body}' is missing there"
            )
    start = guessed_unknowns(group, st, angles, points, m, assembly.merged[0].directions)
    assert start is not None
    return np.asarray(start)
