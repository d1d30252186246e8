"""Sums of loads and their moments: on one link, and on the ground that shakes."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from virtualwork.describe.parts import GROUND
from virtualwork.formulas.block import Block
from virtualwork.formulas.loads import EXTERNAL, OWN, Load
from virtualwork.formulas.numbers import Number, cross, plus


def applied_loads(loads: Iterable[Load], link: str) -> list[Load]:
    """What acts on a link but its weight and inertia."""
    return [load for load in loads if load.body == link and load.kind not in OWN]


def reduced(loads: Iterable[Load], block: Block, center: complex) -> tuple[Number, Number]:
    """The sum of a link's loads over a block and their moment about a point of the link; None where zero."""
    return _summed(loads, block, lambda load: load.arm(block, center))


def shaking_loads(loads: Iterable[Load]) -> list[Load]:
    """What acts on the moving links from outside."""
    return [load for load in loads if load.kind in EXTERNAL and load.body != GROUND]


def resultant(loads: Iterable[Load], block: Block) -> tuple[Number, Number]:
    """The sum of loads over a block and their moment about the ground's origin; None where zero."""
    return _summed(loads, block, lambda load: None if load.path is None else block.position(load.path))


def _summed(loads: Iterable[Load], block: Block, arm: Callable[[Load], Number]) -> tuple[Number, Number]:
    """The sum of loads, and their moment by the arm of each."""
    force: Number = None
    moment: Number = None
    for load in loads:
        value = block.formed(load)
        if value is None:
            continue
        if load.path is None:
            moment = plus(moment, value)
            continue
        force = plus(force, value)
        at = arm(load)
        if at is not None:
            moment = plus(moment, cross(at, value))
    return force, moment
