"""What is shown of a pose, each number once: where it stands in JSON, its header in tables, what it is asked for by.

Tables, JSON, bounds of errors, variants, motion in time and tolerances all walk these.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from dalembert.angles import degrees
from virtualwork.formulas.asked import FORCES, Key, over_blocks

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from virtualwork import Mechanism
    from virtualwork.motion import Motion
    from virtualwork.plan.steps import Joint

    Reals = NDArray[np.float64]
    Numbers = Sequence[float | None]

# of an input that was turned to radians and back, or to metres
TURNED = 2 * float(np.finfo(float).eps)
# by how often they are differentiated in time
POINT = (("x_m", "y_m"), ("vx_m_s", "vy_m_s"), ("ax_m_s2", "ay_m_s2"), ("jx_m_s3", "jy_m_s3"))
LINK = ("angle_deg", "omega_rad_s", "alpha_rad_s2", "jerk_rad_s3")
SLIDE = ("position_m", "speed_m_s", "acceleration_m_s2", "jerk_m_s3")
FORCE = ("fx_N", "fy_N")


class Quantity(NamedTuple):
    """A number that is shown of every pose."""

    path: tuple[Any, ...]
    """Where it stands in JSON, a reaction below (joint, on, from); empty where tables alone have it."""
    header: str
    key: Key = ()
    """What a motion computes for it (`Recording.value`); empty for what is zero throughout, or no motion has."""
    imaginary: bool = False
    """Whether it is the y of a vector."""
    less: Key = ()
    """What is subtracted."""
    names: tuple[str, ...] = ()
    """What `--only` calls it: `H.x`, `B.coupler.fx`, `B.coupler.guide.fx`."""
    owners: tuple[str, ...] = ()
    """The bare names that it belongs to."""
    order: int = 0
    """How often it is differentiated in time."""
    reverse: bool = False
    """Whether it is the other side of a joint force, shown only where its full name is requested."""

    @property
    def turns(self) -> bool:
        """Whether it is an angle, shown in degrees."""
        return self.key[:1] == ("angle",) and not self.key[2]

    def of(self, value: Any) -> Reals:
        """The number as it is shown, from the quantity or from its slope."""
        part = value.imag if self.imaginary else value.real
        return np.asarray(np.degrees(part) if self.turns else part)


# --- which there are --------------------------------------------------------------------------------------------------
def vector(path: tuple[Any, ...], lead: str, names: Sequence[str], key: Key) -> list[Quantity]:
    """The two components of a vector."""
    return [Quantity((*path, name), f"{lead}{name}", key, imaginary=bool(i)) for i, name in enumerate(names)]


def called(found: Iterable[Quantity], owner: str, order: int = 0) -> list[Quantity]:
    """Quantities with the names that a point, link or slide has for them: `H.vx`."""
    return [each._replace(names=(f"{owner}.{_word(each)}",), owners=(owner,), order=order) for each in found]


def _word(each: Quantity) -> str:
    """The name of a quantity without its unit: `vx` of `vx_m_s`."""
    return str(each.path[-1]).partition("_")[0]


def points(m: Mechanism, names: Iterable[str], order: int) -> list[Quantity]:
    """Places of points and their rates up to an order."""
    return [
        part
        for name in names
        for k in range(order + 1)
        # the name says where on the body
        for part in called(
            vector(("points", name), f"{name}_", POINT[k], ("point", m.points[name][0], 0j, name, k)), name, k
        )
    ]


def slides(m: Mechanism, names: Iterable[str], order: int) -> list[Quantity]:
    """Travels along guides and their rates up to an order."""
    guides = {g.point: i for i, g in reversed(list(enumerate(m.guides)))}
    return [
        part
        for name in names
        for k in range(order + 1)
        for part in called(
            [Quantity(("slides", name, SLIDE[k]), f"{name}_{SLIDE[k]}", ("slide", guides[name], k))], name, k
        )
    ]


def links(names: Iterable[str], order: int) -> list[Quantity]:
    """Angles of links and their rates up to an order."""
    return [
        part
        for name in names
        for k in range(order + 1)
        for part in called(
            [Quantity(("links", name, LINK[k]), f"{name}_{LINK[k]}", ("angle", name, k))], name, k
        )
    ]


def places(m: Mechanism, order: int) -> list[Quantity]:
    """All that moves, in the order of tables."""
    guided = dict.fromkeys(g.point for g in m.guides)
    return [*points(m, m.points, order), *slides(m, guided, order), *links(m.links, order)]


def effort_name(slide: bool) -> str:
    """`torque_N_m` of a turning input, `force_N` of a slide."""
    return "force_N" if slide else "torque_N_m"


def forces(m: Mechanism, pairs: Iterable[tuple[Joint, str, str]]) -> list[Quantity]:
    """The effort of every input both ways and their difference, and what the joints carry and the ground feels."""
    found = []
    for j, entry in enumerate(m.inputs):
        name, several = effort_name(entry.is_slide), len(m.inputs) > 1
        lead = f"{entry.name}_" if several else ""
        path = ("effort", "inputs", entry.name) if several else ("effort",)
        euler, work = ("newton-euler", j), ("effort", j)
        word, owner = name.partition("_")[0], str(entry.name)
        every = [
            Quantity((*path, f"input_{name}"), f"{lead}input_{name}", euler, names=(f"{owner}.{word}",)),
            Quantity(
                (*path, f"virtual_work_{name}"),
                f"{lead}virtual_work_{name}",
                work,
                names=(f"{owner}.virtual_work_{word}",),
            ),
            Quantity((), f"{lead}difference_{name}", euler, less=work, names=(f"{owner}.difference_{word}",)),
        ]
        found += [each._replace(owners=(owner,)) for each in every]
    return found + reactions(m, pairs)


def reactions(m: Mechanism, pairs: Iterable[tuple[Joint, str, str]]) -> list[Quantity]:
    """What the joints carry, on one side and on the other, and what shakes the ground."""
    rub = {each.joint for each in m.friction}
    found: list[Quantity] = []
    for joint, on, of in pairs:
        found += _joint_force(joint, on, of, joint.guide is not None or joint.name in rub)
        if len(joint.bodies) == 2:
            other = _joint_force(joint, of, on, joint.guide is not None or joint.name in rub)
            found += [each._replace(reverse=True, owners=(f"{joint.name}.{of}",)) for each in other]
    shaking = vector(("shaking",), "shaking_", FORCE, ("shaking",))
    shaking.append(Quantity(("shaking", "moment_N_m"), "shaking_moment_N_m", ("shaking moment",)))
    return found + called(shaking, "shaking")


def _joint_force(joint: Joint, on: str, of: str, turns: bool) -> list[Quantity]:
    """The force and the moment of a joint on a body; a pin has a moment where it rubs."""
    path, lead = ("reactions", (joint.name, on, of)), f"{joint.name}_{of}_on_{on}_"
    found = vector(path, lead, FORCE, ("force", joint.key, on))
    key = ("moment", joint.key, on) if turns else ()
    found.append(Quantity((*path, "moment_N_m"), f"{lead}moment_N_m", key))
    side, kind = f"{joint.name}.{on}", joint.key.partition(":")[0]
    return [
        each._replace(
            names=(f"{side}.{_word(each)}", f"{side}.{kind}.{_word(each)}"),
            owners=(joint.name, on, of, side, f"{side}.{kind}"),
        )
        for each in found
    ]


# --- which are requested ----------------------------------------------------------------------------------------------
def chosen(every: Sequence[Quantity], words: Sequence[str] | None, order: int) -> list[Quantity]:
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


def unknown(every: Sequence[Quantity], words: Sequence[str]) -> str | None:
    """The first of some names that none of the quantities has."""
    known = {name for each in every for name in (*each.names, *each.owners)}
    return next((word for word in words if word not in known), None)


# --- what they are ----------------------------------------------------------------------------------------------------
def keys_of(wanted: Iterable[Quantity]) -> list[Key]:
    """What they are asked for by, each once."""
    return list(dict.fromkeys(key for each in wanted for key in (each.key, each.less) if key))


def solved(motion: Motion, keys: Sequence[Key]) -> dict[Key, Any]:
    """Quantities of a motion by their keys, (n,): places in one pass, forces in another."""
    moving = [key for key in keys if key[0] not in FORCES]
    found = dict(zip(moving, motion.values(moving), strict=True)) if moving else {}
    if len(moving) < len(keys):
        d = motion.dynamics
        d.solve([(d.reactions.by_key[key[1]], key[2]) for key in keys if key[0] == "force"])
        found |= {key: over_blocks(motion.poses, key, d) for key in keys if key[0] in FORCES}
    return found


def cells(values: Reals, known: NDArray[np.bool_] | None = None) -> Numbers:
    """Numbers as Python's own; None where there is none; no −0."""
    known = np.isfinite(values) if known is None else known
    listed: list[float] = (values + 0.0).tolist()
    if known.all():
        return listed
    return [v if there else None for v, there in zip(listed, known.tolist(), strict=True)]


def cells_of(
    wanted: Iterable[Quantity],
    found: Mapping[Key, Any],
    n: int,
    given: Mapping[str, Reals],
    where: NDArray[np.bool_] | None = None,
) -> dict[Quantity, Numbers]:
    """The numbers of n poses as they are shown.

    Parameters
    ----------
    found : mapping
        What the motion has been asked for.
    given : mapping
        Of driven links the angles as they were asked for, degrees.
    where : array (n,) of bool, optional
        The poses that have any.
    """
    shown: dict[Quantity, Numbers] = {}
    known = np.ones(n, dtype=bool)
    for each in wanted:
        if not each.key:
            # the moment of a pin is zero where there is a force in it
            shown[each] = cells(np.zeros(n), known)
            continue
        value = found[each.key] - found[each.less] if each.less else found[each.key]
        # a vector is known where both its components are
        known = np.isfinite(value)
        if each.turns:
            name = each.key[1]
            part = exact_degrees(given[name]) if name in given else degrees(np.exp(1j * value))
        else:
            part = each.of(value)
        shown[each] = cells(part, known if where is None else known & where)
    return shown


def exact_degrees(angle: Reals) -> Reals:
    """Degrees in [0, 360)."""
    reduced = np.mod(angle, 360.0)
    return np.where(reduced >= 360.0, 0.0, reduced)


def form_bounds(motion: Motion, wanted: Iterable[Quantity], given: Mapping[str, Reals]) -> None:
    """Form the bounds of all numbers, which have most of the work in common."""
    keys = keys_of(wanted)
    moving = [key for key in keys if key[0] not in FORCES]
    if len(moving) < len(keys):
        motion.dynamics.error_estimate().together()
    # an angle that was given is as it was given
    motion.rounding.together([key for key in moving if key[0] != "angle" or key[2] or key[1] not in given])


def bound(motion: Motion, key: Key, given: Mapping[str, Reals]) -> Reals:
    """Bound the error of a quantity, as it is shown."""
    kind, *of = key
    if kind in FORCES:
        bounds = motion.dynamics.error_estimate()
        if kind == "effort":
            return bounds.effort[:, of[0]]
        if kind == "newton-euler":
            return bounds.newton_euler[:, of[0]]
        if kind.startswith("shaking"):
            return bounds.shaking[kind != "shaking"]
        if kind.startswith("applied"):
            return bounds.applied(of[0])[kind != "applied"]
        joint = motion.dynamics.reactions.by_key[of[0]]
        return (bounds.joint_force if kind == "force" else bounds.joint_moment)(joint, of[1])
    if kind != "angle" or of[1]:
        return motion.rounding.of(key)
    if of[0] in given:
        return TURNED * np.abs(given[of[0]])
    from dalembert.arithmetic.doubled import PI, Doubled

    # what the degrees as they are shown round besides
    value = motion.value(key)
    off = (Doubled(value) * (180.0 / PI) - degrees(np.exp(1j * value))).value
    return np.asarray(np.degrees(motion.rounding.of(key)) + np.abs(off - 360.0 * np.rint(off / 360.0)))


def bounds_of(bounds: Reals) -> list[float]:
    """Return bounds as Python's numbers; where there is none, no digit holds."""
    return [math.inf if bound != bound else bound for bound in bounds.tolist()]


# --- in JSON ----------------------------------------------------------------------------------------------------------
def nested(numbers: Mapping[Quantity, Numbers], n: int) -> dict[str, Any]:
    """Columns of n poses where they stand in JSON."""
    found: dict[str, Any] = {}
    for each, values in numbers.items():
        if each.path:
            of = found
            for name in each.path[:-1]:
                of = of.setdefault(name, {})
            of[each.path[-1]] = values
    if "reactions" in found:
        found["reactions"] = tuple(
            {"joint": [joint] * n, "on": [on] * n, "from": [of] * n} | force
            for (joint, on, of), force in found["reactions"].items()
        )
    return found


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
