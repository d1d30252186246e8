"""A load alone, for free-body diagrams: what it is, where it acts; and the direction of a guide that is driven."""

from __future__ import annotations

from collections.abc import Callable

from virtualwork.formulas.block import Block
from virtualwork.formulas.load_paths import LoadPaths
from virtualwork.formulas.numbers import Number
from virtualwork.formulas.reactions import JointForces


def _load(paths: LoadPaths, _: JointForces, block: Block, number: int) -> Number:
    return paths.case.loads[number].form(block)


def _place(paths: LoadPaths, _: JointForces, block: Block, number: int) -> Number:
    path = paths.case.loads[number].path
    assert path is not None
    return block.position(path)


def _rail(_: LoadPaths, joints: JointForces, block: Block, guide: int) -> Number:
    return joints.rail(block, guide)


OF_ONE: dict[str, Callable[[LoadPaths, JointForces, Block, int], Number]] = {
    "load": _load,
    "load torque": _load,
    "load at": _place,
    "rail": _rail,
}
"""By the kind of a key: a force of the load case, a torque of it, the place of a force, a unit vector along a guide."""
