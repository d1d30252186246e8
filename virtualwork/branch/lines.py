"""With several inputs: every pose of a block on its own straight line of inputs from the guess, all poses together."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

import numpy as np

from virtualwork.branch.change_point import Along
from virtualwork.branch.continuation import FINEST, fine_steps
from virtualwork.formulas.group_loops import write_unknowns
from virtualwork.formulas.newton import newton
from virtualwork.formulas.numbers import Complexes, Reals, solve, stack_rows
from virtualwork.formulas.positions import State, unwound
from virtualwork.formulas.rates import Rates
from virtualwork.formulas.winding import counted, straight_lines
from virtualwork.plan.steps import Group, Step


def along_lines(track: Along, group: Group, st: State) -> None:
    """Close a group that has no closed form: tangent prediction, Newton-Raphson correction."""
    assembly = track.assembly
    m = assembly.mechanism
    before = assembly.before(group)
    at, way, longest = straight_lines(m, st.inputs)
    n = len(way)
    x: Any = np.tile(np.asarray(assembly.starts[group.name], dtype=float), (n, 1))
    # of each pose: the share of its way that is gone, the next step, and dx of the whole way
    gone, step = np.zeros(n), longest.copy()
    slope = _slope(track, group, before, at + 0 * way, way, x)
    left = np.asarray(np.isfinite(way).all(axis=1))
    closed = left.copy()
    while left.any():
        i = np.flatnonzero(left)
        to = np.minimum(gone[i] + step[i], 1.0)
        trial = State(list((at + to[:, None] * way[i]).T))
        moved = (to - gone[i])[:, None]
        with np.errstate(all="ignore"):
            track.run(before, trial)
            start = x[i] + moved * slope[i]
            solution, ok = newton(assembly.loops(group), trial, start, m.size, limit=8)
            new = _slope(track, group, before, at + to[:, None] * way[i], way[i], solution)
            ok &= fine_steps(group, m.size, moved, x[i], solution, slope[i], new)
        some = i[ok]
        x[some], slope[some], gone[some] = solution[ok], new[ok], to[ok]
        step[some] = np.minimum(2 * step[some], longest[some])
        step[i[~ok]] /= 2
        closed &= step > FINEST * longest
        left &= closed & (gone < 1)
    x[~closed] = np.nan
    write_unknowns(group, st, x)
    st.margin[group.name] = np.where(closed, 1.0, -1.0) if st.many else (1.0 if closed[0] else -1.0)


def _slope(track: Along, group: Group, before: Sequence[Step], inputs: Reals, way: Reals, x: Reals) -> Reals:
    """dx of a group's unknowns where every input changes by its way; none where it is singular."""
    st, n = State(list(inputs.T)), len(x)
    with np.errstate(all="ignore"):
        track.run(before, st)
        write_unknowns(group, st, x)
        d = Rates(track.assembly.plan, st, [[rate] for rate in way.T])
        d.advance(before, 1)
        loops = track.assembly.loops(group)
        _, jacobian = loops.over(st)(x)
        return np.nan_to_num(solve(jacobian, -stack_rows(d.right_side(group, 1), n)))


def wind_along_lines(track: Along, group: Group, st: State, bodies: Collection[str]) -> None:
    """The angles of some bodies of a closed form with their whole turns, counted from the guess.

    A pose that is not reached on its line has no number of turns, and is not assembled.
    """
    assembly = track.assembly
    case, sign, size = assembly.case(group), assembly.signs[group.name], assembly.mechanism.size
    before = assembly.before(group)

    def rotations(inputs: list[Reals]) -> Complexes:
        trial = State(list(inputs))
        track.run(before, trial)
        case.solve(trial, sign, size)
        n = len(inputs[0])
        result = np.array([np.broadcast_to(trial.turn[body], n) for body in bodies], dtype=complex)
        result[:, np.broadcast_to(~(np.asarray(trial.margin[group.name]) >= 0), n)] = np.nan
        return result

    with np.errstate(all="ignore"):
        totals, reached = counted(rotations, assembly.mechanism, st.inputs)
    n = len(reached)
    for body, total in zip(bodies, totals, strict=True):
        angle = np.angle(st.turn[body])
        # what no input moves is one number for all poses
        wound = np.broadcast_to(unwound(angle, total), n)
        turn, margin = (
            np.where(reached, st.turn[body], np.nan),
            np.where(reached, st.margin[group.name], -1.0),
        )
        st.angle[body] = np.where(reached, wound, np.nan) if st.many else float(wound[0])
        st.turn[body] = turn if st.many else complex(turn[0])
        st.margin[group.name] = margin if st.many else float(margin[0])
