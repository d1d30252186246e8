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
from virtualwork.branch.guess import BESIDE, informed
from virtualwork.describe.description import Description
from virtualwork.family.written import CHOICE, Written
from virtualwork.formulas.numbers import Reals

Mask = NDArray[np.bool_]
# radicand (a squared sine) below which a guess stands at a change point or a limit, or nearly so
CLOSE = 1e-9
# of two assemblies the nearer one is told from the farther if its squared distance is below this share
TOLD = 0.5
# rad, or of the mechanism's size: how finely the way to the poses is looked through, and what is a dip of a radicand
STEP, DIP = 2 * np.pi / 90, 0.05
# what a dip has to go down to for two branches to meet there
MEETS = 1e-8
# variants from which samples are worked out one after the other
ROWS = 512
# lanes worked on together
LANES = 1 << 18


def signs(
    written: Written, m: Description, given: Mapping[str, Any], n: int
) -> tuple[dict[str, Reals], Mask]:
    """The sign of each closed form of each variant, (n,), and which variants tell theirs.

    Parameters
    ----------
    written : Written
        With the signs as inputs.
    m : Description
    given : mapping of path to number or array (n,)
    """
    if not all(informed(m, group) for group in written.closed):
        return {}, np.zeros(n, dtype=bool)
    with np.errstate(all="ignore"):
        found = run(written.choice, {**given, **_inputs(m)})
        told, opens = np.ones(n, dtype=bool), {}
        for group in written.closed:
            margin, a, b, seen, _ = (np.asarray(found[f"{what} {group.name}"]) for what in CHOICE)
            stands = margin > 0
            near, far = np.minimum(a, b), np.maximum(a, b)
            told &= ~(np.abs(margin) <= CLOSE)
            told &= np.where(stands, near < TOLD * far, (seen == 0) | ~(np.abs(seen) < CLOSE))
            opens[group.name] = np.broadcast_to(~stands, n)
    chosen = {g.name: np.broadcast_to(found[f"sign {g.name}"], n) + 0.0 for g in written.closed}
    if len(m.inputs) == 1 and any(each.any() for each in opens.values()):
        # one that is assembled next to the guess is chosen by how it stands there
        known = {**given} | {f"sign {name}": sign for name, sign in chosen.items()}
        step = BESIDE * (m.size if m.inputs[0].is_slide else 1.0)
        for side in (step, -step):
            for name, depth in _radicands(written, known, np.full((1, n), m.at[0] + side)).items():
                told &= ~(opens[name] & (depth[0] >= 0))
    return chosen, told


def _inputs(m: Description) -> dict[str, float]:
    return {f"q{j}": at for j, at in enumerate(m.at)}


def meet_on_the_way(
    written: Written, m: Description, known: Mapping[str, Any], n: int, low: Reals, high: Reals
) -> Mask:
    """Which variants may have a change point over their inputs from low to high, (n,) each.

    Where two branches meet the radicand of a closed form touches zero from above; wherever a sample of it lies lower
    than its neighbours, the dip is followed down.
    """
    found = np.zeros(n, dtype=bool)
    if not written.closed or not (high > low).any():
        return found
    count = samples(m, float(np.max(high - low)))
    each = max(1, LANES // count)
    for a in range(0, n, each):
        rows = slice(a, min(a + each, n))
        here = {name: value[rows] if np.ndim(value) else value for name, value in known.items()}
        q = way(m, low[rows], high[rows], count)
        for name, depth in _radicands(written, here, q).items():
            found[rows] |= meets(written, name, here, q, depth)
    return found


def samples(m: Description, span: float) -> int:
    """How many samples of a way are looked at."""
    return int(np.ceil(min(span / (m.size if m.inputs[0].is_slide else 1.0), 2 * np.pi) / STEP)) + 2


def way(m: Description, low: Any, high: Any, count: int) -> Reals:
    """The samples of ways from low to high, of a turn at most; (count, n)."""
    return np.linspace(low, np.minimum(high, low + (np.inf if m.inputs[0].is_slide else 2 * np.pi)), count)


def _radicands(written: Written, known: Mapping[str, Any], q: Reals) -> dict[str, Reals]:
    """The radicand of each closed form at inputs (samples, rows)."""
    keys = [("margin", group.name) for group in written.closed]
    tape = written.tape(keys)
    given = {name: known[name] for name in tape.inputs if name != "q0"}
    depth = np.empty((len(keys), *q.shape))
    with np.errstate(all="ignore"):
        if q.shape[1] < ROWS:
            each = {name: np.tile(x, len(q)) if np.ndim(x) else x for name, x in given.items()}
            out = run(tape, each | {"q0": q.ravel()})
            for k, name in enumerate(tape.names):
                depth[k] = np.reshape(out[name], q.shape)
        else:
            for i, sample in enumerate(q):
                # an input that all variants share is turned once
                at = float(sample[0]) if (sample == sample[0]).all() else sample
                out = run(tape, given | {"q0": at})
                for k, name in enumerate(tape.names):
                    depth[k, i] = out[name]
    return dict(zip((group.name for group in written.closed), depth, strict=True))


def meets(written: Written, group: str, known: Mapping[str, Any], q: Reals, depth: Reals) -> Mask:
    """Where a dip of a group's radicand (samples, rows), which is followed down, goes to zero."""
    inner = depth[1:-1]
    dips = (inner <= depth[:-2]) & (inner <= depth[2:]) & (inner < DIP) & (inner > 0)
    found: Mask = np.asarray((np.abs(depth[[0, -1]]) < MEETS).any(axis=0))
    places, lanes = np.nonzero(dips)
    if not len(lanes):
        return found
    here = {name: values[lanes] if np.ndim(values) else values for name, values in known.items()}
    centre, half = q[places + 1, lanes], q[1, lanes] - q[0, lanes]
    every = np.arange(len(lanes))
    for _ in range(5):
        near = centre + half * np.linspace(-1, 1, 9)[:, None]
        below = _radicands(written, here, near)[group]
        lowest = np.argmin(below, axis=0)
        centre, half, least = near[lowest, every], half / 4, below[lowest, every]
    found[lanes[least < MEETS]] = True
    return found
