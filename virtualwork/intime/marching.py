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
from dalembert.arithmetic.loop import Calls, Loop
from dalembert.arithmetic.recorded import RECORDED, Number, Recorder
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
from virtualwork.intime.explicit import DormandPrince, called_by, size, step
from virtualwork.intime.powers import names, state_names

# an error that is surely enough, and is no zero
SMALL = 1e-30
# rounds between two looks at what has been found
ROUNDS = 256
Lanes = Mapping[str, Any]


@lru_cache(maxsize=64)
def body(k: int, passed: tuple[str, ...]) -> Tape:
    """A step of k inputs, tried, judged and taken or not, as the body of a loop.

    States: `t`, `h` (of the next step), `grow`, `stiff`, `left`, `work`; `q0`, `v0`, `a0` and so on, `power`; what
    rounding left over of q and q̇ (`lq0`, `lv0`); the largest speeds so far (`f0`). Constants: `end`, `span`,
    `tolerance`, and `scale0` and so on.
    """
    recorder = Recorder()
    enter = recorder.input
    places, speeds, rates = names(k)
    calls = Calls(recorder, passed, rates)
    t, h, grow, stiff, left, work = (enter(x) for x in ("t", "h", "grow", "stiff", "left", "work"))
    end, span, tolerance = (enter(x) for x in ("end", "span", "tolerance"))
    q, v, a = ([enter(name) for name in of] for of in (places, speeds, rates))
    low_q, low_v, fastest, scale = ([enter(f"{x}{j}") for j in range(k)] for x in ("lq", "lv", "f", "scale"))
    whole = end - t
    length = tried(h, whole)
    done = step(called_by(calls), t, q, v, a, length)
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
    there = RECORDED.select(length - whole, end, RECORDED.select(whole - length, t + length, end))
    out["t"] = taken(there, t)
    out["work"] = taken(work + done.work, work)
    out["stiff"] = taken(stiffer(stiff, stiffness, DormandPrince.stable), stiff)
    after = taken(longer(length, wanted, h, grow), shorter(length, wanted))
    out["h"] = RECORDED.select(left, after, h)
    out["grow"] = RECORDED.select(left, taken(GROW, 1.0), grow)
    # it goes on where the end is not reached, the next step is not too short, and nothing is stiff
    further = least(
        end - out["t"],
        least(tried(out["h"], end - out["t"]) - shortest(out["t"], span), STIFF - out["stiff"] - 0.5),
    )
    out["left"] = RECORDED.select(left, further, left)
    return recorder.tape(out | calls.outputs)


@lru_cache(maxsize=64)
def loop(k: int, rates: Tape) -> Loop:
    """The loop of steps with the tape of accelerations and power of k inputs."""
    own = state_names(k)
    passed = tuple(name for name in rates.inputs if name in own)
    kept = (*own, *names(k)[2], "work")
    return Loop(body(k, passed), rates, kept)


@lru_cache(maxsize=64)
def again(k: int, rates: Tape) -> Loop:
    """The loop of steps whose ends are given (`next`): no step is judged."""
    recorder = Recorder()
    enter = recorder.input
    places, speeds, slopes = names(k)
    own = state_names(k)
    calls = Calls(recorder, [name for name in rates.inputs if name in own], slopes)
    t, end, work = enter("t"), enter("next"), enter("work")
    q, v, a = ([enter(name) for name in of] for of in (places, speeds, slopes))
    done = step(called_by(calls), t, q, v, a, end - t)
    out: dict[str, Number] = {"t": end, "left": enter("left"), "work": work + done.work}
    out |= dict(zip(slopes, done.rates, strict=True))
    for x, d, name in (*zip(q, done.dq, places, strict=True), *zip(v, done.dv, speeds, strict=True)):
        out[name], out[f"l{name}"] = added(x, enter(f"l{name}"), d)
    kept = (*own, *slopes, "work")
    return Loop(recorder.tape(out | calls.outputs), rates, kept, ("next",))


class March(NamedTuple):
    """What a march has found: the nodes, (rounds, n) each, by name; and the last state, (n,) each.

    A round in which a lane took no step repeats its last node.
    """

    nodes: dict[str, Reals]
    state: dict[str, Reals]

    @property
    def stiff(self) -> Any:
        """Which lanes are stiff, (n,)."""
        return self.state["stiff"] >= STIFF


def march(
    k: int, rates: Tape, given: Lanes, state: Lanes, capacity: int = ROUNDS, engine: str | None = None
) -> March:
    """Do steps in every lane, at most `capacity`.

    Parameters
    ----------
    rates : Tape
    given, state : mapping of name to float or array (n,)
        See `body`; what further enters the rates is given.
    """
    found, nodes = rounds.run(loop(k, rates), given, state, capacity, engine)
    return March(nodes, found)


def beginning(
    t: Number,
    q: Several,
    v: Several,
    rates: Several,
    h: Number,
    fastest: Several,
    work: Number,
) -> dict[str, Any]:
    """The state at the first node: q and the others (k, n) or (k,)."""
    places, speeds, slopes = names(len(q))
    low = {f"l{name}": 0.0 for name in (*places, *speeds)}
    found = {"t": t, "h": h, "grow": GROW, "stiff": 0.0, "left": 1.0, "work": work}
    for of, values in (
        (places, q),
        (speeds, v),
        (slopes, rates),
        ([f"f{j}" for j in range(len(q))], fastest),
    ):
        found |= dict(zip(of, values, strict=True))
    return found | low


def follow(k: int, rates: Tape, given: Lanes, state: Lanes, times: Reals, engine: str | None = None) -> March:
    """Steps that end at given times, (rounds, n)."""
    loop_of = again(k, rates)
    begin = {name: state[name] for name in loop_of.states}
    found, nodes = rounds.run(loop_of, given, begin, len(times), engine, {"next": times})
    return March(nodes, {**state, **found})


def over(
    k: int, rates: Tape, given: Lanes, t: Reals, q: Reals, v: Reals, slopes: Reals, h: Reals
) -> tuple[Reals, Reals, Reals]:
    """Changes of q and q̇ (n, k) and the work (n,) over one step of a length of its own from each of n states; NaN where there is none."""
    state = beginning(t, q.T, v.T, slopes.T, h, np.ones((k, len(q))), 0.0)
    # any error will do
    whole = {**given, "end": t + h, "span": 0.0, "tolerance": 1e100} | {f"scale{j}": 1.0 for j in range(k)}
    found = march(k, rates, whole, state, 1).state
    there = found["t"] == whole["end"]
    places, speeds, _ = names(k)
    dq, dv = (
        np.stack(
            [np.where(there, found[name] - x, np.nan) for name, x in zip(of, before.T, strict=True)], axis=1
        )
        for of, before in ((places, q), (speeds, v))
    )
    return dq, dv, np.where(there, found["work"], np.nan)
