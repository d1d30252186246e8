"""Which quantities of a pose are requested, and what they are as they are shown; which there are: `virtualwork.quantities`."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from dalembert.angles import degrees
from virtualwork.formulas.forces import Force
from virtualwork.formulas.kinematics import Angle
from virtualwork.formulas.quantity import Quantity
from virtualwork.quantities import Component

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from virtualwork.motion import Motion

    Reals = NDArray[np.float64]
    Numbers = Sequence[float | None]

# of an input that was turned to radians and back, or to metres
TURNED = 2 * float(np.finfo(float).eps)


# --- which are requested ----------------------------------------------------------------------------------------------
def chosen(every: Sequence[Component], words: Sequence[str] | None, order: int) -> list[Component]:
    """The quantities of these names, up to an order where a bare name stands; all without names.

    `every` has them to the highest order.
    """
    if words is None:
        return [each for each in every if each.order <= order and not each.reverse]
    bare, full = set(words), set(words)
    return [
        each
        for each in every
        if not full.isdisjoint(each.names)
        or (
            each.order <= order
            and not bare.isdisjoint(each.owners)
            and (not each.reverse or bool({name for name in bare if "." in name} & set(each.owners)))
        )
    ]


def unknown(every: Sequence[Component], words: Sequence[str]) -> str | None:
    """The first of some names that none of the quantities has."""
    names = {name for each in every for name in (*each.names, *each.owners)}
    return next((word for word in words if word not in names), None)


# --- what they are ----------------------------------------------------------------------------------------------------
def keys_of(wanted: Iterable[Component]) -> list[Quantity]:
    """What they are asked for by, each once."""
    return list(dict.fromkeys(key for each in wanted for key in (each.key, each.less) if key))


def solved(motion: Motion, keys: Sequence[Quantity]) -> dict[Quantity, Any]:
    """Quantities of a motion by their keys, (n,), in one pass."""
    return dict(zip(keys, motion.values(keys), strict=True))


def cells(values: Reals, finite: NDArray[np.bool_] | None = None) -> Numbers:
    """Numbers as Python's own; None where there is none; no −0."""
    finite = np.isfinite(values) if finite is None else finite
    listed: list[float] = (values + 0.0).tolist()
    if finite.all():
        return listed
    return [v if there else None for v, there in zip(listed, finite.tolist(), strict=True)]


def cells_of(
    wanted: Iterable[Component],
    computed: Mapping[Quantity, Any],
    n: int,
    driven: Mapping[str, Reals],
    where: NDArray[np.bool_] | None = None,
) -> dict[Component, Numbers]:
    """The numbers of n poses as they are shown.

    Parameters
    ----------
    computed : mapping
        What the motion has computed.
    driven : mapping
        Of driven links the angles as requested, degrees.
    where : array (n,) of bool, optional
        The poses that have any.
    """
    shown: dict[Component, Numbers] = {}
    finite = np.ones(n, dtype=bool)
    for each in wanted:
        if not each.key:
            # the moment of a pin is zero where there is a force in it
            shown[each] = cells(np.zeros(n), finite)
            continue
        value = computed[each.key]
        if each.less:
            # where neither has a finite value, there is no difference
            with np.errstate(invalid="ignore"):
                value = value - computed[each.less]
        # a vector is known where both its components are
        finite = np.isfinite(value)
        if each.link:
            set_by_hand = each.link in driven
            part = exact_degrees(driven[each.link]) if set_by_hand else degrees(np.exp(1j * value))
        else:
            part = each.of(value)
            finite = finite & np.isfinite(part)
        shown[each] = cells(part, finite if where is None else finite & where)
    return shown


def exact_degrees(angle: Reals) -> Reals:
    """Degrees in [0, 360)."""
    reduced = np.mod(angle, 360.0)
    return np.where(reduced >= 360.0, 0.0, reduced)


def form_bounds(motion: Motion, wanted: Iterable[Component], driven: Mapping[str, Reals]) -> None:
    """Form the bounds of all numbers, which have most of the work in common."""
    keys = keys_of(wanted)
    moving = [key for key in keys if not key.is_force]
    if len(moving) < len(keys):
        motion.dynamics.error_estimate().together()
    # an angle that was given is as it was given
    motion.rounding.together(
        [key for key in moving if not (isinstance(key, Angle) and key.is_angle and key.body in driven)]
    )


def bound(motion: Motion, key: Quantity, driven: Mapping[str, Reals]) -> Reals:
    """Bound the error of a quantity, as it is shown."""
    if isinstance(key, Force):
        return np.asarray(key.read(motion.dynamics.error_estimate()))
    if not key.is_angle:
        return motion.rounding.of(key)
    if not isinstance(key, Angle):
        return np.asarray(np.degrees(motion.rounding.of(key)))
    if key.body in driven:
        return TURNED * np.abs(driven[key.body])
    from dalembert.arithmetic.doubled import PI, Doubled

    # what the degrees as they are shown round besides
    value = motion.value(key)
    off = (Doubled(value) * (180.0 / PI) - degrees(np.exp(1j * value))).value
    return np.asarray(np.degrees(motion.rounding.of(key)) + np.abs(off - 360.0 * np.rint(off / 360.0)))


def bounds_of(bounds: Reals) -> list[float]:
    """Return bounds as Python's numbers; where there is none, no digit holds."""
    return [math.inf if bound != bound else bound for bound in bounds.tolist()]


# --- in JSON ----------------------------------------------------------------------------------------------------------
def nested(numbers: Mapping[Component, Numbers], n: int) -> dict[str, Any]:
    """Columns of n poses where they stand in JSON."""
    result: dict[str, Any] = {}
    for each, values in numbers.items():
        if each.path:
            of = result
            for name in each.path[:-1]:
                of = of.setdefault(name, {})
            of[each.path[-1]] = values
    if "reactions" in result:
        result["reactions"] = tuple(
            {"joint": [joint] * n, "on": [on] * n, "from": [of] * n} | force
            for (joint, on, of), force in result["reactions"].items()
        )
    return result


def in_rows(tree: Any, n: int) -> Iterator[Any]:
    """A tree of columns, its branches mappings and tuples, as n trees of their values, one after the other."""
    if not isinstance(tree, (dict, tuple)):
        return iter(tree)
    if not tree:
        return ({} if isinstance(tree, dict) else [] for _ in range(n))
    rows = zip(*[in_rows(of, n) for of in (tree.values() if isinstance(tree, dict) else tree)], strict=True)
    if isinstance(tree, tuple):
        return map(list, rows)
    names = tuple(tree)
    return (dict(zip(names, row, strict=True)) for row in rows)
