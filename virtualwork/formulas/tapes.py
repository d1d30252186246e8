"""The tapes of an assembly: each is written once, for whoever asks, and kept with it.

A motion keeps of one request, for later ones, values that much depends on and that cost more to form than to read. The operations
of a recording are numbered, whatever the request. The tape of a later request begins at the values that earlier ones have left:
they enter it as `kept 0`, `kept 1`, … (`Later`).
"""

from __future__ import annotations

from collections.abc import Callable, Container, Iterator, Sequence

from dalembert.arithmetic.engines import floats
from dalembert.arithmetic.recorded import Complex, Real
from dalembert.arithmetic.tape import Operation, Tape, reached, shortened
from dalembert.dataclass import dataclass
from virtualwork.formulas.branch import Branch
from virtualwork.formulas.numbers import Number
from virtualwork.formulas.quantity import Quantity
from virtualwork.formulas.recording import NAMES, Entering, Recording

# tapes of later requests that an assembly keeps
MANY = 256
# operations that a value must spare those who ask later: what it takes to write an array and to read it
WORTH = 10
COSTS = {"sin": 10, "cos": 10, "atan2": 10, "div": 3, "sqrt": 3}
# operations that a value may cost beside what is requested, to be left for later requests
FEW = 2
# operations of a recording up to which it is looked through at every new request
LONGEST = 8000

# quantities of one pose, real or complex, as a function of the input, its speed, acceleration and jerk
Ready = Callable[[float, float, float, float], tuple[complex, ...]]


def recorded(branch: Branch, moves: tuple[bool, ...]) -> Recording:
    """The formulas of a branch, written down once for rates that are zero or not."""
    key = moves, branch.turning_over
    with branch.lock:
        if key not in branch.recordings:
            branch.recordings[key] = Recording(
                branch.mechanism, branch.plan, branch.signs, moves, branch.turning_over, branch.geared
            )
    result: Recording = branch.recordings[key]
    return result


def entered(branch: Branch, moves: tuple[bool, ...]) -> Entering:
    """The recording that groups enter: those without a closed form, singular in every pose, or with a change point."""
    changes = () if branch.passage is None else branch.passage.changes
    names = frozenset(g.name for g in branch.plan.groups if g.kind == "Newton").union(branch.folded, changes)
    key = "entering", names, moves, branch.turning_over
    with branch.lock:
        if key not in branch.recordings:
            of = branch.mechanism, branch.plan, branch.signs, moves, branch.turning_over, branch.geared
            branch.recordings[key] = Entering(names, *of)
            branch.recordings[key].st.folded.update(branch.folded)
    result: Entering = branch.recordings[key]
    return result


def taped(branch: Branch, recording: Recording, keys: tuple[Quantity, ...]) -> Tape:
    """The tape of quantities, pruned once."""
    key = recording, keys
    with branch.lock:
        if key not in branch.recordings:
            branch.recordings[key] = recording.tape(keys)
    result: Tape = branch.recordings[key]
    return result


def cut(
    branch: Branch,
    recording: Recording,
    keys: tuple[Quantity, ...],
    known: frozenset[int] | None,
    first: bool,
) -> Later:
    """The tape of quantities, from what is known on (see `later`); None where nothing is to be left for later requests."""
    with branch.lock:
        made = branch.recordings.setdefault("later", {})
        key = recording, keys, known, first
        if key not in made:
            if len(made) >= MANY:
                del made[next(iter(made))]
            if known is None:
                made[key] = Later(taped(branch, recording, keys), {}, {})
            else:
                made[key] = later(recording, keys, known, first)
        result: Later = made[key]
        return result


def ready(branch: Branch, moves: tuple[bool, ...], keys: tuple[Quantity, ...]) -> Ready | None:
    """Quantities of one pose as a function of floats; None where they depend on more than the input and its rates.

    Such a mechanism has one input that turns, no change point, no limit, and a closed form for every group.
    """
    recordings = branch.recordings
    name = "ready", moves, keys
    if name not in recordings:
        with branch.lock:
            recordings[name] = _made(branch, moves, keys)
    result: Ready | None = recordings[name]
    return result


def _made(branch: Branch, moves: tuple[bool, ...], keys: tuple[Quantity, ...]) -> Ready | None:
    if len(branch.mechanism.inputs) > 1 or not branch.settled or branch.folded or branch.may_open:
        return None
    recording = recorded(branch, moves)
    if not recording.takes(keys):
        return None
    tape = taped(branch, recording, keys)
    arguments = tuple(f"{name}0" for name in NAMES)
    if not floats.takes(tape) or not set(tape.inputs) <= set(arguments):
        return None
    return floats.compiled(tape, among=arguments, numbers=tuple(key.names for key in keys))


@dataclass(frozen=True)
class Later:
    """The tape of a request that comes after others.

    Attributes
    ----------
    tape : Tape
    takes : dict of an input's name to the operation whose value it is
    leaves : dict of an output's name to the operation whose value it is
    """

    tape: Tape
    takes: dict[str, int]
    leaves: dict[str, int]


def later(recording: Recording, keys: Sequence[Quantity], formed: frozenset[int], first: bool) -> Later:
    """The tape of quantities from the values of operations that are known, and what it leaves besides.

    What is requested first may be all: it leaves the sines and cosines alone, which cost as much as all else of a position.
    """
    recorder = recording.recorder
    with recording.lock:
        outputs = recorder.numbers(recording.outputs(keys))
        operations = recorder.operations
        # since a product was left it may have become part of a sum
        summed = set() if first else _summed_products(operations)
        formed = formed - summed
        below = reached(operations, (number for _, number in outputs), formed)
        # what is known with the other sign is not worked out anew
        turned = {number: recorder.opposite(number) for number in below if number not in formed}
    signs = {a: b for a, b in turned.items() if b is not None and b in formed and b < a and a not in summed}
    if signs:
        operations = [("neg", signs[k]) if k in signs else of for k, of in enumerate(operations)]
        below = reached(operations, (number for _, number in outputs), formed)
    takes = {number: f"kept {k}" for k, number in enumerate(number for number in below if number in formed)}
    if first:
        worth = {number for number in below if operations[number][0] in ("sin", "cos")}
    else:
        worth = _worth_keeping(recording, operations, summed) if len(operations) <= LONGEST else set()
    known = set(below)
    others = (number for number in worth - known if number not in formed)
    near = {number for number in others if _is_near(operations, number, known)}
    leaves = {f"left {k}": number for k, number in enumerate(sorted((near | worth & known) - takes.keys()))}
    tape = shortened(operations, [*outputs, *leaves.items()], takes)
    return Later(tape, {name: number for number, name in takes.items()}, leaves)


def _summed_products(operations: Sequence[Operation]) -> set[int]:
    """The products that are part of a sum: compiled code rounds both at once, so that no request may begin between them."""
    terms = {number for kind, *of in operations if kind in ("add", "sub") for number in of}
    return {number for number in terms if operations[number][0] == "mul"}


def _worth_keeping(recording: Recording, operations: Sequence[Operation], summed: Container[int]) -> set[int]:
    """The operations whose values are the state of a pose and cost much, with nothing but others of these known."""
    whole = {number for value in recording.state() for number in _numbers(value)}
    # of a product within a sum the factors
    state = {number for number in whole if number not in summed}
    state.update(factor for number in whole - state for factor in operations[number][1:])
    result: set[int] = set()
    costs: list[int] = []
    for number, operation in enumerate(operations):
        cost = 0
        if operation[0] not in ("const", "input"):
            cost = COSTS.get(operation[0], 1)
            for argument in operation[1:]:
                cost += costs[argument]
        if number in state and cost >= WORTH:
            result.add(number)
            cost = 0
        costs.append(min(cost, WORTH))
    return result


def _is_near(operations: Sequence[Operation], number: int, known: set[int]) -> bool:
    """Whether a value costs few operations where others are known: the other link of a group that has been solved."""
    needed, ahead = set[int](), [number]
    while ahead and len(needed) <= FEW:
        here = ahead.pop()
        kind, *arguments = operations[here]
        if kind not in ("const", "input") and here not in known:
            needed.add(here)
            ahead += arguments
    return len(needed) <= FEW


def _numbers(value: Number) -> Iterator[int]:
    if isinstance(value, Real):
        yield value.number
    elif isinstance(value, Complex):
        yield from (*_numbers(value.real), *_numbers(value.imag))
