"""On which branch each variant closes, for all variants at once: the sign of every closed form, as its own guess has it.

Where a variant's choice takes more than a comparison (a guess at a change point or out of reach, a change point on the
way to the poses), it is left to be described alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.engines import run
from virtualwork.branch.guess import informed
from virtualwork.describe.description import Description
from virtualwork.family.written import Written
from virtualwork.formulas.numbers import Reals
from virtualwork.plan.steps import Group

Mask = NDArray[np.bool_]
# radicand (a squared sine) below which a guess stands at a change point or a limit, or nearly so
CLOSE = 1e-9
# of two assemblies the nearer one is told from the farther if its squared distance is below this share
TOLD = 0.5
# rad, or of the mechanism's size: how finely the way to the poses is looked through, and what is a dip of a radicand
STEP, DIP = 2 * np.pi / 90, 0.05
# what a dip has to go down to for two branches to meet there
MEETS = 1e-8
# lanes worked on together
LANES = 1 << 18


def signs(
    written: Written, m: Description, given: Mapping[str, Reals], n: int
) -> tuple[dict[str, Reals], Mask]:
    """The sign of each closed form of each variant, (n,), and which variants tell theirs.

    Parameters
    ----------
    written : Written
        With the signs as inputs.
    m : Description
    given : mapping of path to array (n,)
    """
    told = np.ones(n, dtype=bool)
    known: dict[str, Any] = dict(given) | {f"q{j}": at for j, at in enumerate(m.at)}
    found: dict[str, Reals] = {}
    with np.errstate(all="ignore"):
        for group in written.closed:
            if not informed(m, group):
                return found, np.zeros(n, dtype=bool)
            tape, name = written.choice(group), f"sign {group.name}"
            plus, minus = (run(tape, known | {name: sign}) for sign in (1.0, -1.0))
            a, b = plus["distance"], minus["distance"]
            told &= (plus["margin"] > CLOSE) & (np.minimum(a, b) < TOLD * np.maximum(a, b))
            nearer = np.broadcast_to(np.where(a <= b, 1.0, -1.0), n)
            found[group.name] = nearer
            known[name] = float(nearer[0]) if (nearer == nearer[0]).all() else nearer
    return found, told


def meet_on_the_way(
    written: Written, m: Description, known: Mapping[str, Any], n: int, low: Reals, high: Reals
) -> Mask:
    """Which variants may have a change point over their inputs from low to high, (n,) each.

    Where two branches meet the radicand of a closed form touches zero from above; wherever a sample of it lies lower
    than its neighbours, the dip is followed down.
    """
    found = np.zeros(n, dtype=bool)
    span = float(np.max(high - low, initial=0.0))
    if not written.closed or span == 0.0:
        return found
    slide = m.inputs[0].is_slide
    turn = np.inf if slide else 2 * np.pi
    count = int(np.ceil(min(span / (m.size if slide else 1.0), 2 * np.pi) / STEP)) + 2
    each = max(1, LANES // count)
    for a in range(0, n, each):
        rows = slice(a, min(a + each, n))
        q = np.linspace(low[rows], np.minimum(high[rows], low[rows] + turn), count)
        for group in written.closed:
            depth = _radicand(written, group, known, rows, q)
            found[rows] |= _meets(written, group, known, rows, q, depth)
    return found


def _radicand(written: Written, group: Group, known: Mapping[str, Any], rows: slice, q: Reals) -> Reals:
    """A group's radicand at inputs (samples, rows)."""
    tape = written.tape([("margin", group.name)])
    given = {name: known[name][rows] for name in tape.inputs if name != "q0"}
    depth = np.empty(q.shape)
    with np.errstate(all="ignore"):
        for i, sample in enumerate(q):
            # an input that all variants share is turned once
            at = float(sample[0]) if (sample == sample[0]).all() else sample
            depth[i] = run(tape, given | {"q0": at})[f"margin {group.name}"]
    return depth


def _meets(
    written: Written, group: Group, known: Mapping[str, Any], rows: slice, q: Reals, depth: Reals
) -> Mask:
    """Where a dip of the radicand, which is followed down, goes to zero."""
    inner = depth[1:-1]
    dips = (inner <= depth[:-2]) & (inner <= depth[2:]) & (inner < DIP) & (inner > 0)
    meets: Mask = np.asarray((np.abs(depth[[0, -1]]) < MEETS).any(axis=0))
    places, lanes = np.nonzero(dips)
    if not len(lanes):
        return meets
    here = {name: values[rows][lanes] for name, values in known.items()}
    centre, half = q[places + 1, lanes], q[1, lanes] - q[0, lanes]
    every = np.arange(len(lanes))
    for _ in range(5):
        near = centre + half * np.linspace(-1, 1, 9)[:, None]
        below = _radicand(written, group, here, slice(None), near)
        lowest = np.argmin(below, axis=0)
        centre, half, least = near[lowest, every], half / 4, below[lowest, every]
    meets[lanes[least < MEETS]] = True
    return meets
