"""What is shown of a pose, each number once: where it stands in JSON, its header in tables, what it is asked for by.

Tables, JSON, bounds of errors, variants, motion in time and tolerances all walk these.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cli.mechanism.solve import Analysis
from cli.read.units import degrees
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
    """What a motion is asked for (`Recording.value`); empty for what is zero throughout, or no motion has."""
    imaginary: bool = False
    """Whether it is the y of a vector."""
    less: Key = ()
    """What is subtracted."""

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


def points(m: Mechanism, names: Sequence[str], order: int) -> list[Quantity]:
    """Places of points and their rates up to an order."""
    return [
        # the name says where on the body
        part
        for name in names
        for k in range(order + 1)
        for part in vector(("points", name), f"{name}_", POINT[k], ("point", m.points[name][0], 0j, name, k))
    ]


def slides(m: Mechanism, names: Sequence[str], order: int) -> list[Quantity]:
    """Travels along guides and their rates up to an order."""
    guides = {g.point: i for i, g in reversed(list(enumerate(m.guides)))}
    return [
        Quantity(("slides", name, SLIDE[k]), f"{name}_{SLIDE[k]}", ("slide", guides[name], k))
        for name in names
        for k in range(order + 1)
    ]


def links(names: Sequence[str], order: int) -> list[Quantity]:
    """Angles of links and their rates up to an order."""
    return [
        Quantity(("links", name, LINK[k]), f"{name}_{LINK[k]}", ("angle", name, k))
        for name in names
        for k in range(order + 1)
    ]


def places(analysis: Analysis) -> list[Quantity]:
    """All that is asked for and moves, in the order of tables."""
    m, order = analysis.mechanism, analysis.order
    return [
        *points(m, analysis.points, order),
        *slides(m, analysis.slides, order),
        *links(analysis.links, order),
    ]


def pairs(analysis: Analysis) -> list[tuple[Joint, str, str]]:
    """The reactions asked for: (joint, on, from), each pair once, `on` the later in the file."""
    # loaded where forces are asked for
    from virtualwork.plan.joint_forces import Order

    every = Order(analysis.mechanism, analysis.assemblies[0].plan).pairs
    only = analysis.only
    return [(j, on, of) for j, on, of in every if only is None or {j.name, on, of} & set(only)]


def effort_name(slide: bool) -> str:
    """`torque_N_m` of a turning input, `force_N` of a slide."""
    return "force_N" if slide else "torque_N_m"


def forces(analysis: Analysis) -> list[Quantity]:
    """The effort of every input both ways and their difference, and what the joints carry and the ground feels."""
    m = analysis.mechanism
    found = []
    for j, entry in enumerate(m.inputs):
        name, several = effort_name(entry.is_slide), len(m.inputs) > 1
        lead = f"{entry.name}_" if several else ""
        path = ("effort", "inputs", entry.name) if several else ("effort",)
        euler, work = ("newton-euler", j), ("effort", j)
        found += [
            Quantity((*path, f"input_{name}"), f"{lead}input_{name}", euler),
            Quantity((*path, f"virtual_work_{name}"), f"{lead}virtual_work_{name}", work),
            Quantity((), f"{lead}difference_{name}", euler, less=work),
        ]
    return found + reactions(analysis)


def reactions(analysis: Analysis) -> list[Quantity]:
    """What the joints carry, and what shakes the ground."""
    rub = {each.joint for each in analysis.mechanism.friction}
    found = []
    for joint, on, of in pairs(analysis):
        path, lead = ("reactions", (joint.name, on, of)), f"{joint.name}_{of}_on_{on}_"
        # a pin has a moment where it rubs
        turns = joint.guide is not None or joint.name in rub
        found += vector(path, lead, FORCE, ("force", joint.key, on))
        key = ("moment", joint.key, on) if turns else ()
        found.append(Quantity((*path, "moment_N_m"), f"{lead}moment_N_m", key))
    found += vector(("shaking",), "shaking_", FORCE, ("shaking",))
    return [*found, Quantity(("shaking", "moment_N_m"), "shaking_moment_N_m", ("shaking moment",))]


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
    for each in wanted:
        if not each.key:
            shown[each] = [0.0] * n
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


def form_bounds(analysis: Analysis, motion: Motion, wanted: Iterable[Quantity]) -> None:
    """Form the bounds of all numbers, which have most of the work in common."""
    keys = keys_of(wanted)
    moving = [key for key in keys if key[0] not in FORCES]
    if len(moving) < len(keys):
        motion.dynamics.error_estimate().together()
    # an angle that was given is as it was given
    motion.rounding.together(
        [key for key in moving if key[0] != "angle" or key[2] or key[1] not in analysis.given]
    )


def bound(analysis: Analysis, motion: Motion, key: Key) -> Reals:
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
    if of[0] in analysis.given:
        return TURNED * np.abs(analysis.given[of[0]])
    # in degrees it lies in a whole turn
    return np.asarray(np.degrees(motion.rounding.of(key)) + np.finfo(float).eps * 360)


def bounds_of(bounds: Reals) -> list[float]:
    """Return bounds as Python's numbers; where there is none, no digit holds."""
    return [math.inf if bound != bound else bound for bound in bounds.tolist()]


# --- in JSON ----------------------------------------------------------------------------------------------------------
def nested(numbers: Mapping[Quantity, Numbers], n: int) -> dict[str, Any]:
    """Columns of n poses where they stand in JSON."""
    found: dict[str, Any] = {}
    for each, values in numbers.items():
        if each.path[:1] == ("shaking",):
            # where no joint is asked for the list is there, empty
            found.setdefault("reactions", {})
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
