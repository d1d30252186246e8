"""On which branch each variant closes, for all variants at once: the sign of every closed form, as its own guess has it.

Where a variant's choice takes more than a comparison (a guess at a change point or out of reach, a change point on the
way to the poses), it is left to be described alone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.engines import run, run_grid
from dalembert.arithmetic.tape import Tape
from virtualwork.branch.assembly import Assembly
from virtualwork.branch.guess import BESIDE, informed
from virtualwork.branch.sampling import TURNED
from virtualwork.describe.description import Description
from virtualwork.family.varied_formulas import CHOICE, CLOSE, DIP, TOLD, VariedFormulas
from virtualwork.family.ways import AlongInput, AlongLines, Ways, nodes_of
from virtualwork.formulas.kinematics import Angle
from virtualwork.formulas.loops import Margin
from virtualwork.formulas.numbers import Reals
from virtualwork.formulas.quantity import Quantity
from virtualwork.plan.steps import turns

Mask = NDArray[np.bool_]
# rad, or of the mechanism's size: how finely the way to the poses is looked through
STEP = 2 * np.pi / 90
# so many times wider are the steps at which `CLEAR` tells that no dip can be; and samples of these that are told at once
WIDER, AT_ONCE = 2, 8
# what a dip has to go down to for two branches to meet there
MEETS = 1e-8
# of the decisions on variants: how their groups without a closed form go
WAYS = "ways"
# lanes worked on together
LANES = 1 << 18


def chosen(
    written: VariedFormulas, m: Description, numbers: Mapping[str, Reals], n: int, low: Reals, high: Reals
) -> tuple[dict[str, Reals], Mask]:
    """The sign of each closed form of each variant, (n,), and which variants go by them over their inputs, (n,).

    Parameters
    ----------
    written : VariedFormulas
        With the signs as inputs.
    m : Description
    numbers : mapping of path to array (n,)
    low, high : array (n,), or (1,) where they are the same of all
        The least and the largest input that is requested, and the guess's. Of several inputs no way is looked along.
    """
    if not all(informed(m, group) for group in written.closed):
        return {}, np.zeros(n, dtype=bool)
    one = len(m.inputs) == 1
    # steps of a way, each as wide as lets `CLEAR` tell that there is no dip
    steps = -(-(_count(written, m, low, high) - 1) // WIDER) if one and n else 0
    at_once, way = steps < AT_ONCE and not _levers(written), np.empty((0, 1))
    if steps and at_once:
        way = _way(written, m, low, high, steps + 1)
        # at the guess it is looked at anyhow
        way = way[[not (q == m.at[0]).all() for q in way]]
    tape = written.told(len(way))
    enters = {**_across(numbers), **_inputs(m)} | {f"way {i}": q[:, None] for i, q in enumerate(way)}
    *table, level = (row[:, 0] for row in run_grid(tape, enters, (n, 1)))
    result = {group.name: sign for group, sign in zip(written.closed, table, strict=True)}
    decided, clear = level > 0, level > 1
    if not decided.all():
        rest = np.flatnonzero(~decided)
        again, decided[rest] = signs(written, m, _of(numbers, rest), len(rest))
        for name, sign in again.items():
            result[name][rest] = sign
    if one and not (at_once and clear.all()):
        rest = np.flatnonzero(decided & ~clear if at_once else decided)
        entering = _of(with_signs(numbers, result), rest)
        decided[rest] = ~meet_on_the_way(written, m, entering, len(rest), *_ends(rest, low, high))
    return result, decided


def followed(
    written: VariedFormulas,
    own: Assembly,
    numbers: Mapping[str, Reals],
    n: int,
    inputs: Reals,
    low: Reals,
    high: Reals,
) -> tuple[dict[str, Reals], dict[str, Reals], Mask]:
    """The same where groups have no closed form; and their unknowns at inputs (n or 1, k, inputs), (n, k, u) by the group's name."""
    k = inputs.shape[1]
    sizes = {group.name: len(group.angles) + len(group.slides) for group in written.iterated}
    signs_of = {group.name: np.ones(n) for group in written.closed}
    unknowns = {name: np.full((n, k, u), np.nan) for name, u in sizes.items()}
    decided, m = np.zeros(n, dtype=bool), own.mechanism
    one = len(m.inputs) == 1
    nodes = nodes_of(own, float(low.min()), float(high.max())) if one else {}
    if one and not nodes:
        return signs_of, unknowns, decided
    each = max(1, LANES // max(k, 1, *(len(q) for q, _ in nodes.values())))
    for a in range(0, n, each):
        here = slice(a, min(a + each, n))
        ends, some = _ends(here, low, high), _of(numbers, here)
        count = here.stop - a
        ways: Ways = (
            AlongInput(written, own, nodes, some, count, *ends)
            if one
            else AlongLines(written, own, some, count)
        )
        chosen, fine = signs(written, m, some | ways.starts, ways.n)
        ways.numbers |= with_signs({}, chosen)
        fine &= ways.followed
        margins = at_guess(written, m, some | ways.starts, ways.n)
        fine &= np.logical_and.reduce([margin > 0 for margin in margins.values()], initial=True)
        if one:
            left = np.flatnonzero(fine)
            way = ways.of(left)
            fine[left] = ~meet_on_the_way(written, m, way.numbers | {WAYS: way}, way.n, *_ends(left, *ends))
        for group in written.iterated:
            x = ways.unknowns(group, inputs[here] if len(inputs) > 1 else inputs)
            unknowns[group.name][here] = x
            fine &= np.isfinite(x).all(axis=(1, 2))
        decided[here] = fine
        for name, sign in chosen.items():
            signs_of[name][here] = sign
    return signs_of, unknowns, decided


def _ends(rows: Any, low: Reals, high: Reals) -> tuple[Reals, Reals]:
    """The ends of the way of some variants, where they are not the same of all."""
    return low if len(low) == 1 else low[rows], high if len(high) == 1 else high[rows]


def signs(
    written: VariedFormulas, m: Description, numbers: Mapping[str, Any], n: int
) -> tuple[dict[str, Reals], Mask]:
    """The sign of each closed form of each variant, (n,), and for which variants it is decided.

    Parameters
    ----------
    written : VariedFormulas
        With the signs as inputs.
    m : Description
    numbers : mapping of path to number or array (n,)
    """
    if not all(informed(m, group) for group in written.closed):
        return {}, np.zeros(n, dtype=bool)
    with np.errstate(all="ignore"):
        choice = run(written.choice, {**numbers, **_inputs(m)})
        decided, opens = np.broadcast_to(choice["allowed"] > 0, n).copy(), {}
        for group in written.closed:
            margin, a, b, seen, _ = (np.asarray(choice[f"{what} {group.name}"]) for what in CHOICE)
            stands = margin > 0
            near, far = np.minimum(a, b), np.maximum(a, b)
            decided &= ~(np.abs(margin) <= CLOSE)
            decided &= np.where(stands, near < TOLD * far, (seen == 0) | ~(np.abs(seen) < CLOSE))
            opens[group.name] = np.broadcast_to(~stands, n)
    chosen = {g.name: np.broadcast_to(choice[f"sign {g.name}"], n) + 0.0 for g in written.closed}
    if len(m.inputs) == 1 and any(each.any() for each in opens.values()):
        # one that is assembled next to the guess is chosen by how it stands there
        entering = with_signs(numbers, chosen)
        step = BESIDE * (m.size if m.inputs[0].is_slide else 1.0)
        for side in (step, -step):
            for name, open_ in opens.items():
                depth = _sampled(written, Margin(name), entering, np.array([[m.at[0] + side]]), n)
                decided &= ~(open_ & (depth[0] >= 0))
    return chosen, decided


def at_guess(written: VariedFormulas, m: Description, numbers: Mapping[str, Any], n: int) -> dict[str, Reals]:
    """The radicand of each closed form of each variant at the input of the guess, (n,), by the group's name."""
    with np.errstate(all="ignore"):
        result = run(written.choice, {**numbers, **_inputs(m)})
    return {g.name: np.broadcast_to(result[f"margin {g.name}"], n) for g in written.closed}


def with_signs(numbers: Mapping[str, Any], signs: Mapping[str, Any]) -> dict[str, Any]:
    """The decisions on variants: their dimensions, and the sign of each closed form by the group's name."""
    return {**numbers, **{f"sign {name}": sign for name, sign in signs.items()}}


def _inputs(m: Description) -> dict[str, float]:
    return {f"q{j}": at for j, at in enumerate(m.at)}


def meet_on_the_way(
    written: VariedFormulas, m: Description, entering: Mapping[str, Any], n: int, low: Reals, high: Reals
) -> Mask:
    """Which variants may have a change point over their inputs from low to high, (n,) or (1,) each.

    Where two branches meet the radicand of a closed form touches zero from above; wherever a sample of it lies lower
    than its neighbours, the dip is followed down.
    """
    result = np.zeros(n, dtype=bool)
    if not written.closed:
        return result
    for here, some, q in _along(written, m, entering, n, low, high):
        count = len(result[here])
        for lever in _levers(written):
            # no sample shows what follows from a lever that turns far between two of them
            turn = np.exp(1j * _sampled(written, Angle(lever, 0), some, q, count))
            with np.errstate(invalid="ignore"):
                result[here] |= (np.abs(np.diff(turn, axis=0)) > TURNED).any(axis=0)
        clear = np.empty(count, dtype=bool)
        run_grid(written.clear, _over(written.clear, some, q), (count, len(q)), [clear])
        left = np.flatnonzero(~clear)
        if len(left):
            its, near = _of(some, left), q if q.shape[1] == 1 else q[:, left]
            for group in written.closed:
                radicand = partial(_sampled, written, Margin(group.name))
                result[left + here.start] |= _meets(its, near, radicand, len(left))
    return result


def stays_within(
    written: VariedFormulas,
    m: Description,
    entering: Mapping[str, Any],
    key: Quantity,
    bound: float,
    n: int,
    low: Reals,
    high: Reals,
) -> Mask:
    """Return the variants whose quantity stays within a bound over their inputs from low to high, (n,) or (1,)."""
    result = np.ones(n, dtype=bool)
    for here, some, q in _along(written, m, entering, n, low, high):
        result[here] = (np.abs(_sampled(written, key, some, q, len(result[here]))) < bound).all(axis=0)
    return result


def samples(written: VariedFormulas, m: Description, span: float) -> int:
    """Return the number of samples of a way; more if a gear turns a body fast."""
    fast = max((abs(k) for t in turns(written.plan.steps) for _, k in t.angle.inputs), default=1.0)
    unit = m.size if m.inputs[0].is_slide else 1.0
    return int(np.ceil(min(span, longest(written, m)) / unit * max(fast, 1.0) / STEP)) + 2


def longest(written: VariedFormulas, m: Description) -> float:
    """Return how far a way has to be looked through: a turn, where a turn brings every group back to where it stood."""
    return np.inf if m.inputs[0].is_slide or written.iterated else 2 * np.pi


def _levers(written: VariedFormulas) -> list[str]:
    """The bodies that a guide along them turns, however fast, where other loops follow from them."""
    plan, levers = written.plan, []
    for group in plan.groups:
        for later in plan.groups:
            if later is not group and group.kind == "RPR" and group in plan.needed(plan.writes(later)):
                levers.append(group.angles[0])
    return list(dict.fromkeys(levers))


def _along(
    written: VariedFormulas, m: Description, entering: Mapping[str, Any], n: int, low: Reals, high: Reals
) -> Iterator[tuple[slice, dict[str, Any], Reals]]:
    """Yield some variants at a time, the decisions on them, and inputs on their way, (samples, variants or 1)."""
    count = _count(written, m, low, high)
    each = max(1, LANES // count)
    for a in range(0, n, each):
        here = slice(a, min(a + each, n))
        first, last = _ends(here, low, high)
        yield here, _of(entering, here), _way(written, m, first, last, count)


def _count(written: VariedFormulas, m: Description, low: Reals, high: Reals) -> int:
    """Return the number of samples of the longest way."""
    return samples(written, m, float(np.max(high - low, initial=0.0)))


def _way(written: VariedFormulas, m: Description, low: Reals, high: Reals, count: int) -> Reals:
    """Inputs from low to high, as far as the way is looked through: (count, n), or (count, 1) where all share them."""
    if len(low) > 1 and (low == low[0]).all() and (high == high[0]).all():
        low, high = low[:1], high[:1]
    return np.linspace(low, np.minimum(high, low + longest(written, m)), count)


def _of(entering: Mapping[str, Any], rows: Any) -> dict[str, Any]:
    """The decisions on some variants, and their ways."""
    some = {name: x[rows] if np.ndim(x) else x for name, x in entering.items() if name != WAYS}
    return some | ({WAYS: entering[WAYS].of(rows)} if WAYS in entering else {})


def _across(entering: Mapping[str, Any]) -> dict[str, Any]:
    """The decisions on each variant, as the rows of a grid."""
    return {name: x[:, None] if np.ndim(x) else x for name, x in entering.items() if name != WAYS}


def _over(tape: Tape, entering: Mapping[str, Any], q: Reals) -> dict[str, Any]:
    """What enters a tape over a grid of variants and inputs (samples, n or 1)."""
    unknowns = entering[WAYS].entering(tape.inputs, q.T[..., None]) if WAYS in entering else {}
    return _across(entering) | {"q0": q.T} | unknowns


def _sampled(written: VariedFormulas, key: Quantity, entering: Mapping[str, Any], q: Reals, n: int) -> Reals:
    """A quantity at inputs (samples, n or 1): (samples, n)."""
    tape = written.tape([key])
    shape = len(q), n
    turned = {name: np.transpose(x) if np.ndim(x) else x for name, x in _over(tape, entering, q).items()}
    with np.errstate(all="ignore"):
        return run_grid(tape, turned, shape)[0]


def _meets(entering: Mapping[str, Any], q: Reals, radicand: Callable[..., Reals], n: int) -> Mask:
    """Return where a dip of the radicand, which is followed down, goes to zero."""
    depth = radicand(entering, q, n)
    inner = depth[1:-1]
    dips = (inner <= depth[:-2]) & (inner <= depth[2:]) & (inner < DIP) & (inner > 0)
    meets: Mask = np.asarray((np.abs(depth[[0, -1]]) < MEETS).any(axis=0))
    places, lanes = np.nonzero(dips)
    if not len(lanes):
        return meets
    here = _of(entering, lanes)
    of = lanes if q.shape[1] > 1 else np.zeros_like(lanes)
    centre, half = q[places + 1, of], q[1, of] - q[0, of]
    every = np.arange(len(lanes))
    for _ in range(5):
        near = centre + half * np.linspace(-1, 1, 9)[:, None]
        below = radicand(here, near, len(lanes))
        lowest = np.argmin(below, axis=0)
        centre, half, least = near[lowest, every], half / 4, below[lowest, every]
    meets[lanes[least < MEETS]] = True
    return meets
