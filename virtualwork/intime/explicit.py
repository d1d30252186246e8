"""Dormand and Prince's explicit Runge-Kutta method of order 8, for q̈ = a(t, q, q̇).

E. Hairer, S. P. Nørsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed., Springer 1993, §II.5 and II.10.

A step is written down once, on recorded numbers, with calls of the accelerations between its stages: Python's floats run
it for one motion, and compiled code (`marching`) for many steps or many motions. On arrays the same text is the dense
output, from the node before each requested time: it has the method's own order.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import lru_cache
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np

from dalembert.arithmetic.engines import floats
from dalembert.arithmetic.loop import Calls
from dalembert.arithmetic.recorded import RECORDED, Number, Recorder
from dalembert.arithmetic.tape import Tape
from virtualwork.formulas.numbers import Reals
from virtualwork.intime.equations import Equations, Lost
from virtualwork.intime.powers import names, state_names
from virtualwork.intime.watch import Floats, Step

# below it the square of an error is nothing
TINY = 1e-300
# steps up to which Python's floats are faster than numpy's calls
FEW = 20
Numbers = list[Number]
Rates = Callable[[Number, Numbers, Numbers], Numbers]
"""(t, q, q̇) → the accelerations, and the power."""

# --- coefficients -------------------------------------------------------------------------------------------------
# the same numbers as those of scipy.integrate.DOP853, which takes longer to load than most motions to follow
# fmt: off
# where each stage but the first stands, and its weights of those before
AT = (
    0.05260015195876773, 0.0789002279381516, 0.1183503419072274, 0.2816496580927726,
    0.3333333333333333, 0.25, 0.3076923076923077, 0.6512820512820513, 0.6, 0.8571428571428571, 1.0,
)
STAGES: tuple[tuple[float, ...], ...] = (
    (
        0.05260015195876773,
    ),
    (
        0.0197250569845379, 0.0591751709536137,
    ),
    (
        0.02958758547680685, 0.0, 0.08876275643042054,
    ),
    (
        0.2413651341592667, 0.0, -0.8845494793282861, 0.924834003261792,
    ),
    (
        0.037037037037037035, 0.0, 0.0, 0.17082860872947386, 0.12546768756682242,
    ),
    (
        0.037109375, 0.0, 0.0, 0.17025221101954405, 0.06021653898045596, -0.017578125,
    ),
    (
        0.03709200011850479, 0.0, 0.0, 0.17038392571223998, 0.10726203044637328,
        -0.015319437748624402, 0.008273789163814023,
    ),
    (
        0.6241109587160757, 0.0, 0.0, -3.3608926294469414, -0.868219346841726, 27.59209969944671,
        20.154067550477894, -43.48988418106996,
    ),
    (
        0.47766253643826434, 0.0, 0.0, -2.4881146199716677, -0.590290826836843, 21.230051448181193,
        15.279233632882423, -33.28821096898486, -0.020331201708508627,
    ),
    (
        -0.9371424300859873, 0.0, 0.0, 5.186372428844064, 1.0914373489967295, -8.149787010746927,
        -18.52006565999696, 22.739487099350505, 2.4936055526796523, -3.0467644718982196,
    ),
    (
        2.273310147516538, 0.0, 0.0, -10.53449546673725, -2.0008720582248625, -17.9589318631188,
        27.94888452941996, -2.8589982771350235, -8.87285693353063, 12.360567175794303,
        0.6433927460157636,
    ),
)
# of the result
WEIGHTS = (
    0.054293734116568765, 0.0, 0.0, 0.0, 0.0, 4.450312892752409, 1.8915178993145003,
    -5.801203960010585, 0.3111643669578199, -0.1521609496625161, 0.20136540080403034,
    0.04471061572777259,
)
# of two errors, of orders 3 and 5, the end's own rates last
THIRD = (
    -0.18980075407240762, 0.0, 0.0, 0.0, 0.0, 4.450312892752409, 1.8915178993145003,
    -5.801203960010585, -0.4226823213237919, -0.1521609496625161, 0.20136540080403034,
    0.02265179219836082, 0.0,
)
FIFTH = (
    0.01312004499419488, 0.0, 0.0, 0.0, 0.0, -1.2251564463762044, -0.4957589496572502,
    1.6643771824549864, -0.35032884874997366, 0.3341791187130175, 0.08192320648511571,
    -0.022355307863886294, 0.0,
)
# fmt: on


class Stepped(NamedTuple):
    """Changes of q and q̇, the work, the rates at the end, two errors of (q, q̇), and what shows stiffness.

    `steep` is the squared change of the accelerations between two states at one time, `apart` that of the speeds.
    """

    dq: Numbers
    dv: Numbers
    work: Number
    rates: Numbers
    third: Numbers
    fifth: Numbers
    steep: Number
    apart: Number


def combined(weights: Sequence[float], values: Numbers) -> Number:
    """Σ w·x, without what has no weight."""
    total: Number = 0.0
    for w, x in zip(weights, values, strict=False):
        if w:
            total = total + w * x
    return total


def stages(
    f: Rates, t: Number, q: Numbers, v: Numbers, rates: Numbers, h: Number
) -> tuple[list[Numbers], list[Numbers], Numbers]:
    """The speeds and rates of all stages, component by component, and the speeds of the last."""
    speeds, others, place = [[x] for x in v], [[x] for x in rates], v
    for c, row in zip(AT, STAGES, strict=True):
        there = [x + h * combined(row, s) for x, s in zip(q, speeds, strict=True)]
        place = [x + h * combined(row, s) for x, s in zip(v, others, strict=False)]
        slopes = f(t + c * h, there, place)
        for s, x in zip((*speeds, *others), (*place, *slopes), strict=True):
            s.append(x)
    return speeds, others, place


def step(f: Rates, t: Number, q: Numbers, v: Numbers, rates: Numbers, h: Number) -> Stepped:
    """One step of length h from a state whose rates are known."""
    k = len(q)
    speeds, others, last = stages(f, t, q, v, rates, h)
    dq, dv, work = _ends(speeds, others, h)
    end = [x + d for x, d in zip(q, dq, strict=True)], [x + d for x, d in zip(v, dv, strict=True)]
    result = f(t + h, *end)
    # the last two evaluations stand at one time: how fast the rates change between them is what is stiff
    apart = sum(((a - b) * (a - b) for a, b in zip(end[1], last, strict=True)), 0.0)
    steep = sum(((a - s[-1]) * (a - s[-1]) for a, s in zip(result[:k], others, strict=False)), 0.0)
    every = [[*s, x] for s, x in zip((*speeds, *others[:k]), (*end[1], *result[:k]), strict=True)]
    third, fifth = ([h * combined(weights, s) for s in every] for weights in (THIRD, FIFTH))
    return Stepped(dq, dv, work, result, third, fifth, steep, apart)


def _ends(speeds: list[Numbers], others: list[Numbers], h: Number) -> tuple[Numbers, Numbers, Number]:
    *dv, work = [h * combined(WEIGHTS, s) for s in others]
    return [h * combined(WEIGHTS, s) for s in speeds], dv, work


def size(third: Numbers, fifth: Numbers, scale: Numbers) -> Number:
    """A step's error over the one allowed in each of (q, q̇) (Hairer, Nørsett and Wanner, §II.10, eq. 10.17)."""
    low, high = (
        sum(((e / s) * (e / s) for e, s in zip(of, scale, strict=True)), 0.0) for of in (third, fifth)
    )
    whole = (high + 0.01 * low) * len(scale)
    # no error at all is none; what is NaN stays so
    return high / RECORDED.sqrt(RECORDED.select(whole - TINY, whole, TINY))


class RecordedStep:
    """A step from a state of k inputs, being written down: with calls of the accelerations, which are given what is `passed`."""

    def __init__(self, k: int, passed: Sequence[str]) -> None:
        self.recorder = Recorder()
        places, speeds, rates = names(k)
        self.t, self.q, self.v, self.rates = self.enter("t"), *map(self.several, (places, speeds, rates))
        self._calls, self._called = Calls(self.recorder, passed, rates), state_names(k)

    def enter(self, name: str) -> Number:
        """An input of the tape."""
        return self.recorder.input(name)

    def several(self, of: Iterable[str]) -> Numbers:
        """Inputs of the tape."""
        return [self.enter(name) for name in of]

    def step(self, h: Number) -> Stepped:
        """The step of length h."""

        def rates(t: Number, q: Numbers, v: Numbers) -> Numbers:
            return self._calls(dict(zip(self._called, (t, *q, *v), strict=True)))

        return step(rates, self.t, self.q, self.v, self.rates, h)

    def tape(self, outputs: Mapping[str, Number]) -> Tape:
        """The tape of outputs and calls."""
        return self.recorder.tape({**outputs, **self._calls.outputs})


class DormandPrince:
    """The method: its steps, and how large the error of one is."""

    name = "explicit Runge-Kutta method of order 8 (Dormand and Prince)"
    order = 8
    # h·|λ| beyond which it is not stable (Hairer and Wanner, §IV.2)
    stable = 6.1
    # where the stages stand in a step, and their weights
    stages = np.array([0.0, *AT]), np.array(WEIGHTS)

    def step(self, f: Equations, t: float, q: Floats, v: Floats, rates: Floats, h: float) -> Step:
        """One step of length h from a state whose rates are known."""
        k = len(q)
        passed, rate = f.called
        function, chosen = _function(k, passed)
        out = function(rate, *chosen((t, h, *q, *v, *rates)))
        dq, dv, end = out[:k], out[k : 2 * k], out[2 * k : 3 * k + 1]
        third, fifth = out[3 * k + 1 : 5 * k + 1], out[5 * k + 1 : 7 * k + 1]
        work, steep, apart = out[7 * k + 1 :]
        stiffness = abs(h) * (steep / apart) ** 0.5 if apart > 0 else 0.0
        return Step(list(dq), list(dv), work, list(end), (third, fifth), stiffness)

    def steps(
        self, f: Equations, t: Reals, q: Reals, v: Reals, rates: Reals, h: Reals
    ) -> tuple[Reals, Reals, Reals]:
        """Changes of q and q̇ (n, k) and the work (n,) over a step from each of n states, each of its own length."""
        if len(t) <= FEW:
            return self._one_by_one(f, t, q, v, rates, h)

        def many(t: Number, q: Numbers, v: Numbers) -> Numbers:
            return list(f.many(t, np.stack(q, axis=1), np.stack(v, axis=1)).T)

        speeds, others, _ = stages(many, t, list(q.T), list(v.T), list(rates.T), h)
        dq, dv, work = _ends(speeds, others, h)
        return np.stack(dq, axis=1), np.stack(dv, axis=1), np.asarray(work)

    def _one_by_one(
        self, f: Equations, t: Reals, q: Reals, v: Reals, rates: Reals, h: Reals
    ) -> tuple[Reals, Reals, Reals]:
        out = np.full((len(t), 2 * q.shape[1] + 1), np.nan)
        for row, *state in zip(out, *(x.tolist() for x in (t, q, v, rates, h)), strict=True):
            try:
                done = self.step(f, *state)
            except (Lost, ZeroDivisionError, ValueError, OverflowError):
                continue
            row[:] = *done.dq, *done.dv, done.work
        k = q.shape[1]
        return out[:, :k], out[:, k : 2 * k], out[:, 2 * k]

    def size(self, done: Step, scale: Floats) -> float:
        """A step's error over the one allowed in each of (q, q̇)."""
        third, fifth = done.errors
        return float(size(list(third), list(fifth), scale))


@lru_cache(maxsize=64)
def _function(k: int, passed: tuple[str, ...]) -> tuple[Callable[..., Any], Callable[[Any], Any]]:
    """A step on floats, and what of (t, h, q, q̇, rates) it is given."""
    written = RecordedStep(k, passed)
    done = written.step(written.enter("h"))
    parts = zip(("dq", "dv", "rate", "third", "fifth"), (*done[:2], *done[3:6]), strict=True)
    entering = {f"{name}{j}": x for name, values in parts for j, x in enumerate(values)}
    tape = written.tape(entering | {"work": done.work, "steep": done.steep, "apart": done.apart})
    places, speeds, rates = names(k)
    every = ["t", "h", *places, *speeds, *rates]
    wanted = [every.index(name) for name in tape.inputs if name in every]
    return floats.compiled(tape, passed, tuple(rates)), itemgetter(*wanted)
