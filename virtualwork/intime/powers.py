"""The motion of a recording as tapes: accelerations, the power of what stores nothing, the energies, and what the accelerations are summed from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from dalembert.arithmetic.adjoint import derivatives
from dalembert.arithmetic.recorded import RECORDED, Number
from dalembert.arithmetic.systems import solved
from dalembert.arithmetic.tape import Tape
from virtualwork.formulas.forces import Effort
from virtualwork.formulas.recording import Recording


def names(k: int) -> tuple[list[str], list[str], list[str]]:
    """What q, q̇ and the rates (the accelerations, and the power) are called on a tape."""
    places, speeds, rates = ([f"{name}{j}" for j in range(k)] for name in "qva")
    return places, speeds, [*rates, "power"]


def state_names(k: int) -> list[str]:
    """What (t, q, q̇) is called on a tape."""
    places, speeds, _ = names(k)
    return ["t", *places, *speeds]


def motion_of(
    recording: Recording, k: int, frictions: Sequence[str] = (), more: Mapping[str, Number] | None = None
) -> tuple[Tape, Tape, Tape]:
    """The tapes of accelerations and power, of the energies, and of the sizes of loads, of k inputs that move.

    The sizes are those of what the loads, each by itself, add to each acceleration (`size0` and so on), summed without their signs.

    The effort depends linearly on the accelerations and on the inputs `frictions`. With these, the accelerations and
    quantities (`more`) are those without friction, and beside each stands its derivative to each friction: `NAME FRICTION`.
    """
    with recording.lock:
        return _motion_of(recording, k, frictions, more or {})


def _motion_of(
    recording: Recording, k: int, frictions: Sequence[str], more: Mapping[str, Number]
) -> tuple[Tape, Tape, Tape]:
    again = recording.recorder
    case, pose = recording.forces.case, recording.forces.pose
    efforts, accelerations = [f"effort {j}" for j in range(k)], names(k)[2][:-1]
    motion = recording.tape([Effort(j) for j in range(k)], more)
    free = [name for name in (*accelerations, *frictions) if name in motion.inputs]
    inputs = {name: again.input(name) for name in motion.inputs}
    slopes = derivatives(motion, free).on(inputs, RECORDED)
    still = motion.on(inputs | dict.fromkeys(free, 0.0), RECORDED)

    def slope(of: str, to: str) -> Number:
        return slopes.get(f"d({of})/d({to})", 0.0)

    mass = [[slope(effort, a) for a in accelerations] for effort in efforts]

    def moved(by: Sequence[Number]) -> list[Number]:
        right = [-x for x in by]
        return [right[0] / mass[0][0]] if k == 1 else solved(mass, right)

    powers = moved([still[effort] for effort in efforts])
    per = {name: moved([slope(effort, name) for effort in efforts]) for name in frictions}
    out = dict(zip(accelerations, powers, strict=True))
    for name, by in per.items():
        out |= {f"{a} {name}": x for a, x in zip(accelerations, by, strict=True)}
    for quantity in more:
        along = [slope(quantity, a) for a in accelerations]
        out[quantity] = sum((s * x for s, x in zip(along, powers, strict=True)), still[quantity])
        for name, by in per.items():
            own = slope(quantity, name)
            out[f"{quantity} {name}"] = sum((s * x for s, x in zip(along, by, strict=True)), own)
    speeds = [again.input(name) for name in names(k)[1]]
    kinetic: Number = 0.0
    for row, speed in zip(mass, speeds, strict=True):
        for m, other in zip(row, speeds, strict=True):
            kinetic = kinetic + 0.5 * (speed * m * other)
    loads = case.loads
    wasted = [(load.wasted(pose, j), speed) for load in loads for j, speed in enumerate(speeds)]
    power = sum((work * speed for work, speed in wasted if work is not None), 0.0)
    potential = sum((load.potential(pose) for load in loads if load.stores and load.carries), 0.0)
    sizes: list[Number] = [0.0] * k
    for load in loads:
        by = [] if load.kind.startswith("inertia") else [load.power(pose, j) for j in range(k)]
        if any(of is not None for of in by):
            alone = moved([0.0 if of is None else of for of in by])
            sizes = [size + abs(x) for size, x in zip(sizes, alone, strict=True)]
    tapes = (
        out | {"power": power},
        {"energy": kinetic + potential},
        {f"size{j}": x for j, x in enumerate(sizes)},
    )
    first, energy, size = map(again.tape, tapes)
    return first, energy, size
