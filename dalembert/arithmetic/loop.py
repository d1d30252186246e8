"""A tape that is done again and again on its own results, and calls another one on the way.

A step of an integrator is one: it takes a state to the next and asks for rates at every stage. The tape of the rates
stands once, however often a step asks for it, and whoever runs the loop stays in it: Python's own cost is paid once
for many steps.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property

from dalembert.arithmetic.recorded import RECORDED, Number, Recorder
from dalembert.arithmetic.tape import Tape, performed
from dalembert.dataclass import dataclass


class Calls:
    """Writes calls of a tape into a recording; `outputs` are what the recording must have as outputs for them.

    Parameters
    ----------
    recorder : Recorder
    passed, results : names of what each call takes, and of what it returns
    """

    def __init__(self, recorder: Recorder, passed: Sequence[str], results: Sequence[str]) -> None:
        self.recorder, self.passed, self.results = recorder, tuple(passed), tuple(results)
        self.count = 0
        self.outputs: dict[str, Number] = {}

    def __call__(self, inputs: Mapping[str, Number]) -> list[Number]:
        """The results of one more call."""
        number, self.count = self.count, self.count + 1
        self.outputs |= {f"call {number} {name}": inputs[name] for name in self.passed}
        return [self.recorder.input(f"call {number} {name}") for name in self.results]


def called(name: str) -> tuple[int, str] | None:
    """The number of a call and what of it an input or output of the body is; None where it is of no call.

    >>> called("call 3 q0"), called("tolerance")
    ((3, 'q0'), None)
    """
    kind, _, of = name.partition(" ")
    if kind != "call" or not of:
        return None
    number, _, what = of.partition(" ")
    return int(number), what


@dataclass(frozen=True)
class Loop:
    """A body that is done on its own results, and the tape that it calls.

    Attributes
    ----------
    body : Tape
        Its outputs are the next state, by the names of the inputs that they take the place of, and what each call is
        given, `call NUMBER NAME`; what a call finds are inputs of such names. `left` is among the states: lanes go on
        as long as it is positive. Further inputs are given once for each lane.
    inner : Tape
        Its inputs that a call does not give are those of the same name of the lane.
    kept : names of states
        Written down after every round.
    fed : names, optional
        Inputs of the body of which every round has its own.

    Examples
    --------
    Heron's rule for the root of 2, with the quotient as the tape that is called:

    >>> again, quotient = Recorder(), Recorder()
    >>> inner = quotient.tape({"y": quotient.input("of") / quotient.input("x")})
    >>> calls, x, left = Calls(again, ["x"], ["y"]), again.input("x"), again.input("left")
    >>> (y,) = calls({"x": x})
    >>> body = again.tape({"x": 0.5 * (x + y), "left": left - 1.0} | calls.outputs)
    >>> loop = Loop(body, inner, ("x",))
    >>> loop.states, loop.constants
    (('x', 'left'), ('of',))
    >>> loop.whole.inputs
    ('x', 'left', 'of')
    """

    body: Tape
    inner: Tape
    kept: tuple[str, ...]
    fed: tuple[str, ...] = ()

    @cached_property
    def states(self) -> tuple[str, ...]:
        """The names of the state."""
        return tuple(name for name in self.body.names if called(name) is None)

    @cached_property
    def passed(self) -> tuple[str, ...]:
        """What a call is given."""
        return tuple(of[1] for name in self.body.names if (of := called(name)) is not None and of[0] == 0)

    @cached_property
    def constants(self) -> tuple[str, ...]:
        """What a lane is given once."""
        own = [
            name
            for name in self.body.inputs
            if called(name) is None and name not in (*self.states, *self.fed)
        ]
        return tuple(dict.fromkeys([*own, *(name for name in self.inner.inputs if name not in self.passed)]))

    @cached_property
    def cost(self) -> int:
        """The count of operations of a round."""
        count = sum((of := called(name)) is not None and of[1] == self.passed[0] for name in self.body.names)
        return self.body.cost + count * self.inner.cost

    @cached_property
    def whole(self) -> Tape:
        """The body with what it calls written out, for engines that know no calls."""
        recorder = Recorder()
        inputs = {name: recorder.input(name) for name in (*self.states, *self.fed, *self.constants)}
        places = dict(self.body.outputs)
        results: dict[int, Mapping[str, Number]] = {}
        values: list[Number] = []
        for kind, *arguments in self.body.operations:
            if kind == "input":
                of = called(arguments[0])
                if of is None:
                    values.append(inputs[arguments[0]])
                    continue
                number, name = of
                if number not in results:
                    here = {
                        x: values[places[f"call {number} {x}"]] if x in self.passed else inputs[x]
                        for x in self.inner.inputs
                    }
                    results[number] = self.inner.on(here, RECORDED)
                values.append(results[number][name])
            elif kind == "const":
                values.append(arguments[0])
            else:
                values.append(performed(kind, [values[a] for a in arguments], RECORDED))
        return recorder.tape({name: values[places[name]] for name in self.states})
