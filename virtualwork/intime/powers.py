"""The motion of what is recorded as tapes: accelerations, the power of what stores nothing, and the energies."""

from __future__ import annotations

from collections.abc import Iterable

from dalembert.arithmetic.adjoint import derivatives
from dalembert.arithmetic.recorded import RECORDED, Number
from dalembert.arithmetic.systems import solved
from dalembert.arithmetic.tape import Tape
from virtualwork.formulas.block import Block
from virtualwork.formulas.loads import Load
from virtualwork.formulas.recording import Recording


def motion_of(recording: Recording, k: int) -> tuple[Tape, Tape]:
    """The tapes of accelerations and power, and of the energies, of k inputs that move."""
    names = [f"effort {j}" for j in range(k)]
    motion = recording.tape([("effort", j) for j in range(k)])
    free = derivatives(motion, [f"a{j}" for j in range(k) if f"a{j}" in motion.inputs])
    _, _, block = recording.forces
    again = recording.recorder
    inputs = {name: again.input(name) for name in motion.inputs}
    still = motion.on(inputs | {f"a{j}": 0.0 for j in range(k)}, RECORDED)
    slopes = free.on(inputs, RECORDED)
    mass = [[slopes.get(f"d({name})/d(a{j})", 0.0) for j in range(k)] for name in names]
    right = [-still[name] for name in names]
    found = [right[0] / mass[0][0]] if k == 1 else solved(mass, right)
    loads = recording.forces[0].case.loads
    speeds = [again.input(f"v{j}") for j in range(k)]
    kinetic: Number = 0.0
    for i in range(k):
        for j in range(k):
            kinetic = kinetic + 0.5 * (speeds[i] * mass[i][j] * speeds[j])
    outputs = {f"a{j}": value for j, value in enumerate(found)}
    return (
        again.tape(outputs | {"power": wasted(loads, block, speeds)}),
        again.tape({"energy": kinetic + potential(loads, block)}),
    )


def places_and_speeds(k: int) -> list[str]:
    """What q and q̇ are called on the tape."""
    return [f"{name}{j}" for name in "qv" for j in range(k)]


def wasted(loads: Iterable[Load], block: Block, speeds: list[Number]) -> Number:
    """The power of what stores nothing: of applied forces and torques, dampers, drives."""
    total: Number = 0.0
    for load in loads:
        for j, speed in enumerate(speeds):
            work = load.wasted(block, j)
            total = total if work is None else total + work * speed
    return total


def potential(loads: Iterable[Load], block: Block) -> Number:
    """What gravity and springs hold, J."""
    total: Number = 0.0
    for load in loads:
        if load.stores and load.carries:
            total = total + load.potential(block)
    return total
