"""One mechanism over its inputs: its assemblies, their motions, the quantities that are requested of them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from cli.cases.inputs import InputGrid, Inputs
from cli.read import options
from dalembert.dataclass import dataclass, field
from dalembert.errors import DataError
from dalembert.hints import nearest
from dalembert.memory import memory
from dalembert.results.way import figures
from virtualwork import quantities
from virtualwork.formulas.kinematics import Angle, Point
from virtualwork.quantities import Component

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cli.cases.options import Options
    from virtualwork import Mechanism
    from virtualwork.branch.assembly import Assembly
    from virtualwork.formulas.quantity import Quantity
    from virtualwork.motion import Motion
    from virtualwork.plan.steps import Joint

ORDERS = ("position", "velocity", "acceleration", "jerk")


class Request(NamedTuple):
    """What is requested of a mechanism, whichever variant it is.

    Attributes
    ----------
    only : list of str, or None
        The names of quantities; None for all.
    order : int, or None
        How often places are differentiated; None for the highest that the input's own rates give.
    branch : str, or None
        `all`, or the number of an assembly.
    forces : bool
        Whether the forces are among the quantities.
    """

    file: str
    only: list[str] | None = None
    order: int | None = None
    branch: str | None = None
    forces: bool = False

    @classmethod
    def of(cls, own: Options, order: int | None = None, *, forces: bool = False) -> Request:
        """What --only, --order and --branch ask for, as far as a command has these options."""
        options_of = vars(own)
        if options_of.get("order") is not None:
            order = ORDERS.index(own.order)
        return cls(own.file, names(options_of.get("only")), order, branch(options_of.get("branch")), forces)


def names(
    text: str | None, flag: str = "--only", example: str = "names, such as H, coupler.omega"
) -> list[str] | None:
    """Names between commas."""
    if text is None:
        return None
    names = [name.strip() for name in text.split(",") if name.strip()]
    if not names:
        raise options.bad(flag, f"expected {example}")
    return names


def branch(text: str | None) -> str | None:
    """`all`, or the number of an assembly."""
    if text is not None and text != "all" and options.whole(text) < 1:
        raise options.bad("--branch", f"'{text}': expected all, or the number of an assembly")
    return text


@dataclass
class Analysis:
    """A mechanism over its inputs; assemblies and motions are worked out when they are needed."""

    request: Request
    mechanism: Mechanism
    inputs: Inputs | InputGrid
    warnings: list[str] = field(default_factory=list)
    # the analysis of which this is a block of poses
    block_of: Analysis | None = None

    @property
    def file(self) -> str:
        """What messages call the mechanism."""
        return self.request.file

    @cached_property
    def own_order(self) -> int:
        """How high the rates go that the inputs have."""
        orders = self.inputs.orders
        for k, name in enumerate(("jerk", "acceleration", "speed")):
            if 3 - k in orders or any(getattr(e, name) is not None for e in self.mechanism.inputs):
                return 3 - k
        return 0

    @property
    def order(self) -> int:
        """How often places are differentiated."""
        return self.own_order if self.request.order is None else self.request.order

    @property
    def is_long(self) -> bool:
        """Whether the poses are more than one block."""
        from virtualwork.formulas.positions import BLOCK

        return self.inputs.n > BLOCK

    @property
    def several(self) -> bool:
        """Whether several assemblies are requested."""
        return len((self.block_of or self).assemblies) > 1

    @cached_property
    def assemblies(self) -> tuple[Assembly, ...]:
        """The guess's assembly, or those of --branch."""
        if self.request.branch is None:
            return (self.mechanism.assembly,)
        every = self.mechanism.assemblies()
        if any(g.kind == "Newton" for g in every[0].plan.groups):
            self.warnings.append(
                "--branch: groups without a closed form were searched from many starts; an assembly may be missing"
            )
        if self.request.branch == "all":
            return every
        number = int(self.request.branch)
        if number > len(every):
            raise DataError(
                f"--branch {number}: the mechanism has {len(every)} assemblies at the guess's input"
            )
        return (every[number - 1],)

    @cached_property
    def motions(self) -> tuple[Motion, ...]:
        """The motion of each assembly."""
        from virtualwork.motion import Motion

        q = self.inputs.whole
        result = tuple(Motion(a, q.values, q.speed, q.acceleration) for a in self.assemblies)
        for motion in result:
            motion.poses.input_rest = q.rest
            motion.poses.time = q.time
        return result

    # --- quantities -----------------------------------------------------------------------------------------------
    @cached_property
    def places(self) -> list[Component]:
        """The places and rates that are requested."""
        every = quantities.places(self.mechanism, 3, self.request.only or ())
        return chosen(every, self.request.only, self.order)

    @cached_property
    def forces(self) -> list[Component]:
        """The forces that are requested."""
        if not self.request.forces:
            return []
        return chosen(quantities.forces(self.mechanism, self.pairs), self.request.only, 0)

    @cached_property
    def pairs(self) -> list[tuple[Joint, str, str]]:
        """Every joint force once: (joint, on, from), `on` the later in the file."""
        # loaded where forces are requested
        from virtualwork.plan.joint_forces import pairs
        from virtualwork.plan.steps import joints

        return pairs(joints(self.mechanism))

    @property
    def shown_pairs(self) -> list[tuple[Joint, str, str]]:
        """The joint forces that are requested."""
        shown = {each.path[1] for each in self.forces if each.path[:1] == ("reactions",)}
        return [(j, on, of) for j, on, of in self.pairs if shown & {(j.name, on, of), (j.name, of, on)}]

    @cached_property
    def tabled(self) -> list[Component]:
        """What a table has: the forces alone where they are requested without names."""
        return self.forces if self.request.forces and self.request.only is None else self.places + self.forces

    @property
    def links(self) -> tuple[str, ...]:
        """The links of which something is requested."""
        return self._named("links", self.mechanism.links)

    @property
    def points(self) -> tuple[str, ...]:
        """The points of which something is requested, in the order of the file."""
        return self._named("points", self.mechanism.points)

    def _named(self, kind: str, every: Iterable[str]) -> tuple[str, ...]:
        shown = {each.path[1] for each in self.places if each.path[0] == kind}
        return tuple(name for name in every if name in shown)

    def check_names(self) -> None:
        """Refuse names that --only cannot find."""
        only = self.request.only
        if only is None:
            return
        moving = quantities.places(self.mechanism, 3, only)
        forces = quantities.forces(self.mechanism, self.pairs)
        here = [*moving, *forces] if self.request.forces else moving
        word = unknown(here, only)
        if word is None:
            return
        if unknown(forces, [word]) is None:
            raise DataError(f"{self.file}: --only {word}: this is a force: dalembert forces shows it")
        names = {name for each in here for name in (*each.names, *each.owners)}
        owner = word.rpartition(".")[0]
        of_owner = [
            name.rpartition(".")[2] for each in here if owner in each.owners for name in each.names[:1]
        ]
        if of_owner:
            choices = ", ".join(dict.fromkeys(of_owner))
            raise DataError(f"{self.file}: --only: '{word}': expected {owner}. with one of {choices}")
        raise DataError(
            f"{self.file}: --only: no link or point is named '{owner or word}'{nearest(word, names)}"
        )

    # --- inputs ---------------------------------------------------------------------------------------------------
    def pose_text(self, i: int) -> str:
        """Return the inputs of a pose as a sentence has them: 60°, 0.35 m; several with their names."""
        values = [
            f"{figures(float(value))}{'°' if key.endswith('_deg') else ' m'}"
            for value, key in zip(self.inputs.whole.shown[i], self.input_names.values(), strict=True)
        ]
        if len(values) == 1:
            return values[0]
        return ", ".join(f"{name} {text}" for name, text in zip(self.input_names, values, strict=True))

    @cached_property
    def input_names(self) -> dict[str, str]:
        """Each input and the name of its value: `input_deg`, or `input_m` of a slide."""
        return {e.name: "input_m" if e.is_slide else "input_deg" for e in self.mechanism.inputs}

    @property
    def unit(self) -> str:
        """The unit that the first input is shown in."""
        return "m" if any(e.is_slide for e in self.mechanism.inputs[:1]) else "deg"

    @cached_property
    def input_columns(self) -> tuple[str, ...]:
        """The columns of the inputs in a table."""
        several = len(self.mechanism.inputs) > 1
        return tuple(f"{name}_{key}" if several else key for name, key in self.input_names.items())

    @cached_property
    def set_angles(self) -> dict[str, NDArray[np.float64]]:
        """The angles of the links that are driven against the ground, as they were requested, degrees."""
        shown, inputs = self.inputs.whole.shown, self.mechanism.inputs
        return {e.link: shown[:, j] for j, e in enumerate(inputs) if e.link and e.on == "ground"}

    # --- sizes ----------------------------------------------------------------------------------------------------
    def bytes_each(self, *, json: bool, table: bool, states: bool) -> float:
        """What the answer for one pose takes at most, as measured."""
        numbers = len(self.places) + (5 + 6 * len(self.mechanism.points)) * bool(self.forces)
        return 300 + 110 * numbers * json + 100 * numbers * table + 1200 * len(self.mechanism.links) * states

    def check_size(self, *, json: bool, table: bool, states: bool = False, times: int = 1) -> None:
        """Refuse what would take more memory than there is, before it is begun; `times` so many variants."""
        each = self.bytes_each(json=json, table=table, states=states) * len(self.assemblies)
        poses, room = self.inputs.n * times, memory()
        if poses * each > room:
            raise DataError(
                f"{self.file}: {poses} poses{f' of {times} variants' if times > 1 else ''} of {len(self.links)} links and {len(self.points)} points would take "
                f"{float(f'{poses * each / 1e9:.2g}'):g} GB: expected at most {room / each:.0f} poses, or fewer names by --only, or CSV, Parquet or a workbook, which are not limited"
            )

    # --- which poses there are ------------------------------------------------------------------------------------
    def assembled(self, motion: Motion) -> NDArray[np.bool_]:
        """Which poses are assembled, as far as the requested names go: with --only the rest is not solved."""
        if self.whole:
            return motion.assembled
        result = np.ones(motion.n, dtype=bool)
        for values in motion.values(self.named):
            result &= np.isfinite(values)
        return result

    @property
    def whole(self) -> bool:
        """Whether a pose is assembled only where all of the mechanism is."""
        return self.request.only is None or not self.named

    @cached_property
    def named(self) -> list[Quantity]:
        """Places of the points, links and slides that are requested, as a motion computes them."""
        homes = self.mechanism.points
        result: list[Quantity] = [Point(homes[name][0], 0j, name, 0) for name in self.points]
        result += [Angle(name, 0) for name in self.links]
        slides = [each.key for each in self.places if each.path[0] == "slides"]
        return [*result, *dict.fromkeys(key.of_order(0) for key in slides)]


# --- which quantities are requested ---
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
