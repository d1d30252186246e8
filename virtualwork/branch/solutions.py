"""All assemblies at one input: of a group with no closed form, from the guess or from many starts; of a whole mechanism."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from dalembert.arithmetic.recorded import bare
from dalembert.arithmetic.varied import rotation
from virtualwork.branch.choice import Choice
from virtualwork.describe.description import Description
from virtualwork.describe.parts import GROUND
from virtualwork.formulas.group_loops import Loops, gaps, put_unknowns, write_unknowns
from virtualwork.formulas.newton import newton
from virtualwork.formulas.numbers import Number, dot, stack, stack_rows
from virtualwork.formulas.positions import State, columns
from virtualwork.plan.steps import Group

C = TypeVar("C", bound=Choice)


def guessed_unknowns(
    group: Group,
    st: State,
    angles: Mapping[str, float],
    points: Mapping[str, complex],
    m: Description,
    directions: Mapping[int, complex],
) -> Any:
    """A Newton group's unknowns from the guess, or None where an angle is not known.

    A slide is that of the guessed points; where they do not say, it closes the loops as nearly as it can.
    """
    if any(b not in angles for b in group.angles):
        return None
    numbers, left = of_guess(group, st, angles, points, m, directions)
    x = np.array([numbers], dtype=float)
    if left:
        # the loops are linear in the slides
        along, gap = stack(columns(group, st), 1)[0][:, left], stack_rows(gaps(group, st), 1)[0]
        if np.isfinite(along).all() and np.isfinite(gap).all():
            x[0, left] = np.linalg.lstsq(along, -gap)[0]
            write_unknowns(group, st, x)
    return x


def of_guess(
    group: Group,
    st: State,
    angles: Mapping[str, Number],
    points: Mapping[str, Number],
    m: Description,
    directions: Mapping[int, Number],
) -> tuple[list[Number], list[int]]:
    """A Newton group's unknowns as the guess has them, zero where it does not say them, and the places of slides that it does not.

    They are put into the state.
    """
    x: list[Number] = [bare(angles.get(body, 0.0)) for body in group.angles]
    put_unknowns(group, st, [*x, *(0.0 for _ in group.slides)])
    for i in group.slides:
        g = m.guides[i]
        # of a link that a rack turns with a slide of this group the turn is not known yet: the guess says it
        tied = g.on in group.links and g.on in angles
        on = rotation(angles[g.on]) if tied else st.turn[g.on]
        origin = _origin(g.on, m.through(g), on, points, m)
        known = g.point in points and origin is not None
        x.append(bare(dot(points[g.point] - origin, directions[i] * on)) if known else None)
    left = [j for j, slide in enumerate(x) if slide is None]
    x = [0.0 if slide is None else slide for slide in x]
    put_unknowns(group, st, x)
    return x, left


def _origin(body: str, z: Number, turn: Number, points: Mapping[str, Number], m: Description) -> Number:
    if body == GROUND:
        return z
    for name, local in m.links[body].points.items():
        if name in points:
            return points[name] + (z - local) * turn
    return None


def every_solution(loops: Loops, st: State, size: float) -> Any:
    """Every assembly of a Newton group at one input, by damped Newton from many starts spread evenly.

    A systematic multi-start (Kronecker sequence of the generalised golden ratio): it finds what it finds, and does
    not prove that there is no other.
    """
    na = len(loops.group.angles)
    n = na + len(loops.group.slides)
    starts = min(4096, 128 * n)
    g = 1.0
    for _ in range(64):
        g = (1 + g) ** (1 / (n + 1))
    u = (0.5 + np.outer(np.arange(1, starts + 1), g ** -np.arange(1.0, n + 1))) % 1.0
    x0 = np.empty((starts, n))
    x0[:, :na] = u[:, :na] * 2 * np.pi
    x0[:, na:] = (2 * u[:, na:] - 1) * size
    with np.errstate(all="ignore"):
        x, closed = newton(loops, st, x0, size)
    x = x[closed]
    if not len(x):
        return x
    x[:, :na] = (x[:, :na] + np.pi) % (2 * np.pi) - np.pi
    keep: list[Any] = []
    for row in x:
        for other in keep:
            d = row - other
            d[:na] = np.abs(np.exp(1j * row[:na]) - np.exp(1j * other[:na]))
            d[na:] /= size
            if np.abs(d).max() < 1e-6:
                break
        else:
            keep.append(row)
    return np.array(keep)


def all_assemblies(chosen: C) -> tuple[C, ...]:
    """Every assembly at the guess's input: all signs of the closed forms, all solutions found for the others."""
    result = [chosen]
    for signs, starts in _combinations(chosen):
        if signs != chosen.signs or any(
            np.abs(np.exp(1j * np.asarray(starts[k])) - np.exp(1j * np.asarray(chosen.starts[k]))).max()
            > 1e-6
            for k in starts
        ):
            result.append(replace(chosen, signs=signs, starts=starts, number=len(result) + 1, warnings=()))
    return tuple(result)


def _combinations(chosen: Choice) -> list[tuple[dict[str, int], dict[str, Any]]]:
    """Walk the steps at the guess's input and fork wherever a group closes in more than one way."""
    m = chosen.mechanism
    fronts: list[tuple[State, dict[str, int], dict[str, Any]]] = [(State(list(m.at)), {}, {})]
    for step in chosen.plan.steps:
        after: list[tuple[State, dict[str, int], dict[str, Any]]] = []
        for st, signs, starts in fronts:
            if not isinstance(step, Group):
                chosen.run_untracked([step], st)
                after.append((st, signs, starts))
            elif step.kind == "Newton":
                for x in every_solution(chosen.loops(step), st, m.size):
                    trial = st.copy()
                    write_unknowns(step, trial, x[None])
                    after.append((trial, signs, starts | {step.name: tuple(map(float, x))}))
            else:
                for sign in (1,) if step.kind == "PRP" else (1, -1):
                    trial = st.copy()
                    try:
                        chosen.close_with(step, trial, sign)
                    except ZeroDivisionError:
                        continue
                    if trial.margin[step.name] >= 0:
                        after.append((trial, signs | {step.name: sign}, starts))
        fronts = after
    return [(signs, starts) for _, signs, starts in fronts]
