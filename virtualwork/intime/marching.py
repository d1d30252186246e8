"""Many steps at once: a step, its error and the choice of the next one's length as a loop of tapes.

The loop runs until the end, or until a step is refused for ever (it cannot get shorter), or where stability limits the
steps: compiled code does it for one motion or many (lanes), numpy for many. The steps are those that `path.walk` does
one by one: the same formulas, `explicit` and `control`.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from dalembert.arithmetic.engines import rounds
from dalembert.arithmetic.loop import Loop
from dalembert.arithmetic.recorded import RECORDED, Number
from dalembert.arithmetic.tape import Tape
from virtualwork.formulas.numbers import Reals
from virtualwork.intime.control import (
    GROW,
    SAFETY,
    STIFF,
    Several,
    added,
    allowed,
    least,
    longer,
    most,
    shorter,
    shortest,
    stiffer,
    tried,
)
from virtualwork.intime.explicit import DormandPrince, RecordedStep, size
from virtualwork.intime.powers import names, state_names

# an error that is surely enough, and is no zero
SMALL = 1e-30
# rounds between two looks at the nodes
ROUNDS = 256
Lanes = Mapping[str, Any]


@lru_cache(maxsize=64)
def body(k: int, passed: tuple[str, ...]) -> Tape:
    """A step of k inputs, tried, judged and taken or not, as the body of a loop.

    States: `t`, `h` (of the next step), `grow`, `stiff`, `left`, `work`; `q0`, `v0`, `a0` and so on, `power`;
    the rounding of earlier sums in q and q̇ (`lq0`, `lv0`); the largest speeds so far (`f0`). Constants: `end`, `span`,
    `tolerance`, and `scale0` and so on.
    """
    places, speeds, rates = names(k)
    written = RecordedStep(k, passed)
    t, q, v, a = written.t, written.q, written.v, written.rates
    h, grow, stiff, left, work = written.several(("h", "grow", "stiff", "left", "work"))
    end, span, tolerance = written.several(("end", "span", "tolerance"))
    low_q, low_v, fastest, scale = (
        written.several(f"{x}{j}" for j in range(k)) for x in ("lq", "lv", "f", "scale")
    )
    whole = end - t
    part = tried(h, whole)
    there = RECORDED.select(part - whole, end, RECORDED.select(whole - part, t + part, end))
    # as long as the times at its ends say, whatever their rounding
    length = there - t
    done = written.step(length)
    error = size(done.third, done.fifth, allowed(tolerance, scale, q, fastest, v, done.dv))
    # the eighth root, by three; NaN where the error is
    some = most(error, SMALL)
    wanted = SAFETY / RECORDED.sqrt(RECORDED.sqrt(RECORDED.sqrt(some)))
    stiffness = abs(length) * RECORDED.sqrt(done.steep / most(done.apart, 1e-300))
    holds = least(left, 1.0 - error)

    def taken(new: Number, old: Number) -> Number:
        return RECORDED.select(holds, new, old)

    out: dict[str, Number] = {}
    for x, low, d, name in (
        *zip(q, low_q, done.dq, places, strict=True),
        *zip(v, low_v, done.dv, speeds, strict=True),
    ):
        new, rest = added(x, low, d)
        out[name], out[f"l{name}"] = taken(new, x), taken(rest, low)
    for j in range(k):
        out[f"f{j}"] = most(fastest[j], abs(out[f"v{j}"]))
    out |= {name: taken(x, y) for name, x, y in zip(rates, done.rates, a, strict=True)}
    out["t"] = taken(there, t)
    out["work"] = taken(work + done.work, work)
    out["stiff"] = taken(stiffer(stiff, stiffness, DormandPrince.stable), stiff)
    after = taken(longer(part, wanted, h, grow), shorter(part, wanted))
    out["h"] = RECORDED.select(left, after, h)
    out["grow"] = RECORDED.select(left, taken(GROW, 1.0), grow)
    # it goes on where the end is not reached, the next step is not too short, and nothing is stiff
    further = least(
        end - out["t"],
        least(tried(out["h"], end - out["t"]) - shortest(out["t"], span), STIFF - out["stiff"] - 0.5),
    )
    out["left"] = RECORDED.select(left, further, left)
    return written.tape(out)


@lru_cache(maxsize=64)
def loop(k: int, rates: Tape) -> Loop:
    """The loop of steps with the tape of accelerations and power of k inputs."""
    return Loop(body(k, _passed(k, rates)), rates, _kept(k))


@lru_cache(maxsize=64)
def again(k: int, rates: Tape) -> Loop:
    """The loop of steps whose ends are given (`next`): no step is judged."""
    places, speeds, slopes = names(k)
    written = RecordedStep(k, _passed(k, rates))
    end = written.enter("next")
    done = written.step(end - written.t)
    work, left = written.several(("work", "left"))
    out: dict[str, Number] = {"t": end, "left": left, "work": work + done.work}
    out |= dict(zip(slopes, done.rates, strict=True))
    for name, x, d in zip((*places, *speeds), (*written.q, *written.v), (*done.dq, *done.dv), strict=True):
        out[name], out[f"l{name}"] = added(x, written.enter(f"l{name}"), d)
    return Loop(written.tape(out), rates, _kept(k), ("next",))


def _passed(k: int, rates: Tape) -> tuple[str, ...]:
    """What of a state the accelerations depend on."""
    return tuple(name for name in rates.inputs if name in state_names(k))


def _kept(k: int) -> tuple[str, ...]:
    return (*state_names(k), *names(k)[2], "work")


class Nodes(NamedTuple):
    """States of lanes side by side, (…, 3k + 3): the times and works (…), q and q̇ (…, k), the rates (…, k + 1)."""

    table: Reals
    k: int

    @property
    def t(self) -> Reals:
        """The times."""
        return self.table[..., 0]

    @property
    def q(self) -> Reals:
        """The coordinates."""
        return self.table[..., 1 : self.k + 1]

    @property
    def v(self) -> Reals:
        """Their speeds."""
        return self.table[..., self.k + 1 : 2 * self.k + 1]

    @property
    def rates(self) -> Reals:
        """The accelerations, and the power."""
        return self.table[..., 2 * self.k + 1 : -1]

    @property
    def work(self) -> Reals:
        """The work so far."""
        return self.table[..., -1]

    def at(self, where: Any) -> Nodes:
        """Some of them."""
        return Nodes(self.table[where], self.k)

    def then(self, *others: Nodes) -> Nodes:
        """These and others, one round after the other."""
        return _nodes(self.k, np.concatenate([np.moveaxis(of.table, -1, 1) for of in (self, *others)]))


def _nodes(k: int, kept: Reals) -> Nodes:
    """What is kept of each round, (rounds, 3k + 3, n), as nodes (rounds, n)."""
    return Nodes(np.moveaxis(kept, 1, -1), k)


class March(NamedTuple):
    """The result of a march: the nodes at the ends of rounds, (rounds, n); and the last state, (n,) each.

    A round in which a lane took no step repeats its last node.
    """

    nodes: Nodes
    state: dict[str, Reals]

    @property
    def stiff(self) -> Any:
        """Which lanes are stiff, (n,)."""
        return self.state["stiff"] >= STIFF


def march(k: int, rates: Tape, numbers: Lanes, state: Lanes, capacity: int = ROUNDS) -> March:
    """Do steps in every lane, at most `capacity`.

    Parameters
    ----------
    rates : Tape
    numbers, state : mapping of name to float or array (n,)
        See `body`; `numbers`: what further enters the rates.
    """
    last, kept = rounds.run(loop(k, rates), numbers, state, capacity)
    return March(_nodes(k, np.stack(list(kept.values()), axis=1)), last)


def follow(k: int, rates: Tape, numbers: Lanes, state: Lanes, times: Reals) -> March:
    """Steps that end at given times, (rounds, n)."""
    steps = again(k, rates)
    begin = {name: state[name] for name in steps.states}
    last, kept = rounds.run(steps, numbers, begin, len(times), fed={"next": times})
    return March(_nodes(k, np.stack(list(kept.values()), axis=1)), {**state, **last})


def beginning(
    node: Nodes,
    h: Number = 0.0,
    fastest: Several | None = None,
) -> dict[str, Any]:
    """The state of steps from nodes: the next one's length, and the largest speeds so far, (k, n) or (k,)."""
    k = node.k
    places, speeds, rates = names(k)
    low = {f"l{name}": 0.0 for name in (*places, *speeds)}
    result = {"t": node.t, "h": h, "grow": GROW, "stiff": 0.0, "left": 1.0, "work": node.work}
    several = (places, node.q.T), (speeds, node.v.T), (rates, node.rates.T)
    for of, values in (*several, ([f"f{j}" for j in range(k)], [1.0] * k if fastest is None else fastest)):
        result |= dict(zip(of, values, strict=True))
    return result | low


def over(rates: Tape, numbers: Lanes, node: Nodes, h: Reals) -> tuple[Reals, Reals, Reals]:
    """Changes of q and q̇ (n, k) and the work (n,) over one step of a length of its own from each of n states; NaN where there is none."""
    k, end = node.k, node.t + h
    # any error will do
    whole = {**numbers, "end": end, "span": 0.0, "tolerance": 1e100} | {f"scale{j}": 1.0 for j in range(k)}
    state = beginning(node, h) | {"work": 0.0}
    result = march(k, rates, whole, state, 1).nodes.at(0)
    there = result.t == end
    dq, dv = (np.where(there[:, None], x, np.nan) for x in (result.q - node.q, result.v - node.v))
    return dq, dv, np.where(there, result.work, np.nan)
