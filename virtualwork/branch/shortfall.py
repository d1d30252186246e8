"""Why a pose cannot be assembled: the group that does not close, by how much, and the nearest input where it would."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from virtualwork.branch.assembly import Assembly
from virtualwork.formulas.closed_forms import Gap
from virtualwork.formulas.newton import gaps, newton
from virtualwork.formulas.numbers import stack_rows
from virtualwork.formulas.positions import State
from virtualwork.plan.steps import Group


@dataclass(frozen=True)
class Shortfall:
    """The first group of a pose that does not close.

    Attributes
    ----------
    group : str
    gap : Gap
        The length that it needs and the one that there is, m.
    nearest : float or None
        The nearest input at which it would close, rad or m; None with several inputs, and where none is known.
    """

    group: str
    gap: Gap
    nearest: float | None

    def text(self, length: Callable[[float], str] = "{:.6g} m".format) -> str:
        """By how much it does not close, with lengths as they are to be shown."""
        text = self.gap.text(length)
        return text if text.startswith(self.group.split(" + ")[0]) else f"{self.group}: {text}"


def shortfall(assembly: Assembly, inputs: tuple[float, ...]) -> Shortfall | None:
    """Say why a pose cannot be assembled; None where it can.

    Parameters
    ----------
    assembly : Assembly
    inputs : tuple of float
        rad, or m for a slide.

    Examples
    --------
    A rod of 50 mm that should reach a line 52 mm away.

    >>> from virtualwork import Guess, Guide, Input, Link, Mechanism
    >>> m = Mechanism({"O": (0, 0)}, {"crank": Link({"O": (0, 0), "A": (0.06, 0)}),
    ...               "rod": Link({"A": (0, 0), "B": (0.05, 0)})}, [Guide("B", "rod")],
    ...               inputs=Input("crank"), guess=Guess(0.0, {"rod": 0.1}))
    >>> found = shortfall(m.assembly, (np.arcsin(52 / 60),))
    >>> found.text(), round(float(np.degrees(found.nearest)), 6)
    ('rod reaches 0.05 m, 0.052 m needed: 0.002 m short', 56.44269)
    """
    st = State(list(inputs))
    track = assembly.track
    if track.active:
        track.cover(inputs[0], inputs[0])
    with np.errstate(all="ignore"):
        for step in assembly.plan.steps:
            if isinstance(step, Group):
                gap = None
                if step.kind == "Newton":
                    gap = _left(assembly, step, inputs)
                elif step.name not in track.folded:
                    gap = assembly.cases[step.name].gap(st)
                if gap is not None:
                    return Shortfall(step.name, gap, _nearest(assembly, inputs[0]))
            assembly.run([step], st)
    return None


def _nearest(assembly: Assembly, q: float) -> float | None:
    """The limit of the input next to q, on q's own turn; of two as near, the one towards the guess."""
    track = assembly.track
    if not track.active:
        return None
    apart = [float(track.apart(np.array(q), limit.input)) for limit in track.limits()]
    least = min(map(abs, apart), default=0.0)
    near = [q - d for d in apart if abs(d) <= least + 1e-9 * track.length]
    return min(near, key=lambda x: abs(x - track.start)) if near else None


def _left(assembly: Assembly, group: Group, inputs: tuple[float, ...]) -> Gap | None:
    """The least gap that Newton-Raphson leaves in a group without a closed form, from the guess's own pose on."""
    many = State([np.array([q]) for q in inputs], many=True)
    assembly.run(assembly.needed(assembly.plan.writes(group)), many)
    if all(np.isfinite(many.turn[b]).all() for b in group.members) and all(
        np.isfinite(many.slide[s]).all() for s in group.slides
    ):
        return None
    start = np.asarray(assembly.starts[group.name], dtype=float)[None]
    newton(group, many, start, assembly.mechanism.size)
    gap = float(np.linalg.norm(stack_rows(gaps(group, many), 1)))
    return Gap(gap, 0.0, "its loops stay {by} apart where they come nearest")
