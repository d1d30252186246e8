"""Newton-Raphson on all loops of a mechanism at once, with the table of iterates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dalembert.arithmetic.records import record
from virtualwork.branch.assembly import Assembly
from virtualwork.branch.solutions import guessed_unknowns
from virtualwork.describe import AssemblyError
from virtualwork.describe.description import known_by_guess
from virtualwork.formulas.newton import Iterate, newton, write_unknowns
from virtualwork.formulas.numbers import Reals, stack
from virtualwork.formulas.positions import State, columns


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


def all_at_once(assembly: Assembly, inputs: tuple[float, ...], limit: int = 50) -> AllAtOnce:
    """Solve all loops of a mechanism at once by Newton-Raphson from its guess, undamped, with the table of iterates.

    x_{k+1} = x_k − Φ(x_k)⁻¹·f(x_k) (Nicoletti, lecture 7).

    Raises
    ------
    AssemblyError
        Where the guess does not give every unknown angle.
    """

    m = assembly.mechanism
    merged, group = assembly.merged
    if group is None:
        raise AssemblyError("newton: the mechanism has no loop to close")
    st = State([np.array([q]) for q in inputs], many=True)
    for step in merged.steps:
        if step is group:
            break
        assembly.run([step], st)
    angles, points = known_by_guess(m)
    for body in group.angles:
        if body not in angles:
            raise AssemblyError(
                f"[guess]: newton starts from the guess, and the angle of '{body}' is missing there"
            )
    start = guessed_unknowns(group, st, angles, points, m, merged.directions)
    assert start is not None
    write_unknowns(group, st, start)
    jacobian = stack(columns(group, st), 1)[0]
    table: list[Iterate] = []
    with np.errstate(all="ignore"):
        x, closed = newton(group, st, start, m.size, limit, table, damped=False)
        exact = assembly.state(inputs)
        # numpy's maximum keeps a NaN: where one link is not assembled there is nothing to compare with
        away = [
            np.abs(np.angle(np.exp(1j * x[0, j]) / np.ravel(exact.turn[body])[0]))
            for j, body in enumerate(group.angles)
        ]
        difference = float(np.max(away, initial=0.0))
    names = (*group.angles, *(m.guides[g].point for g in group.slides))
    return AllAtOnce(names, len(group.angles), tuple(table), jacobian, bool(closed[0]), difference)
