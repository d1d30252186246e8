"""An analysis: one mechanism at its inputs, its assemblies and their motions, and the quantities of a request."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cli.cases.inputs import InputGrid, Inputs
from cli.read.options import bad, between_commas, whole
from dalembert.dataclass import dataclass, field, replace
from dalembert.errors import DataError
from dalembert.hints import nearest
from dalembert.memory import memory
from dalembert.results.way import figures
from dalembert.tables.files import name_of
from virtualwork import quantities
from virtualwork.formulas.kinematics import Angle, Point
from virtualwork.quantities import Component

if TYPE_CHECKING:
    from types import SimpleNamespace

    from numpy.typing import NDArray

    from virtualwork import Mechanism
    from virtualwork.branch.assembly import Assembly
    from virtualwork.formulas.quantity import Quantity
    from virtualwork.motion import Motion
    from virtualwork.plan.steps import Joint

ORDERS = ("position", "velocity", "acceleration", "jerk")


class Request(NamedTuple):
    """Which quantities a call requests of every variant.

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
    def of(cls, options: SimpleNamespace, order: int | None = None, *, forces: bool = False) -> Request:
        """Return what --only, --order and --branch request, as far as a command has these options."""
        values = vars(options)
        if values.get("order") is not None:
            order = ORDERS.index(options.order)
        return cls(options.file, names(values.get("only")), order, branch(values.get("branch")), forces)


def names(
    text: str | None, flag: str = "--only", example: str = "names, such as H, coupler.omega"
) -> list[str] | None:
    """Split names at the commas."""
    if text is None:
        return None
    names = between_commas(text)
    if not names:
        raise bad(flag, f"expected {example}")
    return names


def branch(text: str | None) -> str | None:
    """Check that --branch names `all`, or the number of an assembly."""
    if text is not None and text != "all" and whole(text) < 1:
        raise bad("--branch", f"'{text}': expected all, or the number of an assembly")
    return text


@dataclass
class Analysis:
    """One mechanism at its inputs; its assemblies and motions are computed when they are first read."""

    request: Request
    mechanism: Mechanism
    inputs: Inputs | InputGrid
    warnings: list[str] = field(default_factory=list)
    # the analysis of which this is a block of poses
    block_of: Analysis | None = None

    @property
    def file(self) -> str:
        """The name of the file, for messages."""
        return name_of(self.request.file)

    @cached_property
    def input_order(self) -> int:
        """The order of the highest rate that an input has."""
        orders = self.inputs.orders
        for k, name in enumerate(("jerk", "acceleration", "speed")):
            if 3 - k in orders or any(getattr(e, name) is not None for e in self.mechanism.inputs):
                return 3 - k
        return 0

    @property
    def order(self) -> int:
        """The highest order of the derivatives of places."""
        return self.input_order if self.request.order is None else self.request.order

    @property
    def is_long(self) -> bool:
        """Whether the poses fill more than one block."""
        from virtualwork.formulas.positions import BLOCK

        return self.inputs.n > BLOCK

    @property
    def several(self) -> bool:
        """Whether every assembly is requested, however many there are: their number differs from variant to variant."""
        return self.request.branch == "all"

    @cached_property
    def assemblies(self) -> tuple[Assembly, ...]:
        """The guess's assembly, or those that --branch names."""
        if self.request.branch is None:
            return (self.mechanism.assembly,)
        assemblies = self.mechanism.assemblies()
        if any(g.kind == "Newton" for g in assemblies[0].plan.groups):
            self.warnings.append(
                "--branch: groups without a closed form were searched from many starts; an assembly may be missing"
            )
        if self.request.branch == "all":
            return assemblies
        number = int(self.request.branch)
        if number > len(assemblies):
            raise DataError(
                f"--branch {number}: the mechanism has {len(assemblies)} assemblies at the guess's input"
            )
        return (assemblies[number - 1],)

    @cached_property
    def motions(self) -> tuple[Motion, ...]:
        """The motion of each assembly."""
        inputs = self.inputs.whole
        return tuple(_motion(assembly, inputs) for assembly in self.assemblies)

    # --- other poses, another request ---------------------------------------------------------------------------
    def at(self, inputs: Inputs | InputGrid) -> Analysis:
        """Return the analysis of the same assemblies at other inputs."""
        other = replace(self, inputs=inputs, warnings=[])
        other.assemblies = self.assemblies
        return other

    def block(self, assembly: Assembly, low: int, high: int) -> Analysis:
        """Return the analysis of some poses of one assembly, with the digits of the sweep solved whole."""
        inputs = self.inputs.part(low, high)
        block = replace(self, inputs=inputs, warnings=[], block_of=self)
        block.assemblies = (assembly,)
        block.motions = (_motion(assembly, inputs, self.inputs.n),)
        return block

    def requesting(self, **changes: Any) -> Analysis:
        """Return the analysis of the same poses with another request; motions that are solved stay solved."""
        other = replace(self, request=self.request._replace(**changes))
        other.assemblies = self.assemblies
        if not self.is_long or "motions" in vars(self):
            other.motions = self.motions
        return other

    def of_assembly(self, i: int) -> Analysis:
        """Return the analysis of one of the assemblies."""
        other = replace(self)
        other.assemblies, other.motions = (self.assemblies[i],), (self.motions[i],)
        return other

    # --- quantities -----------------------------------------------------------------------------------------------
    @cached_property
    def places(self) -> list[Component]:
        """The places and rates that are requested."""
        components = quantities.places(self.mechanism, 3, self.request.only or ())
        return chosen(components, self.request.only, self.order)

    @cached_property
    def forces(self) -> list[Component]:
        """The forces that are requested."""
        if not self.request.forces:
            return []
        return chosen(quantities.forces(self.mechanism, self.pairs), self.request.only, 0)

    @cached_property
    def pairs(self) -> list[tuple[Joint, str, str]]:
        """The joint forces, each once: (joint, on, from), `on` the later in the file."""
        # loaded where forces are requested
        from virtualwork.plan.joint_forces import pairs
        from virtualwork.plan.steps import joints

        return pairs(joints(self.mechanism))

    @property
    def shown_pairs(self) -> list[tuple[Joint, str, str]]:
        """The joint forces that are requested."""
        names = {each.path[1] for each in self.forces if each.path[:1] == ("reactions",)}
        return [(j, on, by) for j, on, by in self.pairs if names & {(j.name, on, by), (j.name, by, on)}]

    @cached_property
    def tabled(self) -> list[Component]:
        """The columns of a table: the forces alone where they are requested without names."""
        return self.forces if self.request.forces and self.request.only is None else self.places + self.forces

    @property
    def links(self) -> tuple[str, ...]:
        """The links that the request names, or that it names a rate of."""
        return self._named("links", self.mechanism.links)

    @property
    def points(self) -> tuple[str, ...]:
        """The points that the request names, in the order of the file."""
        return self._named("points", self.mechanism.points)

    def _named(self, kind: str, names: Iterable[str]) -> tuple[str, ...]:
        requested = {each.path[1] for each in self.places if each.path[0] == kind}
        return tuple(name for name in names if name in requested)

    def check_names(self, flag: str = "--only") -> None:
        """Refuse names of an option that are no quantities of this mechanism, as any wrong value of an option."""
        only = self.request.only
        if only is None:
            return
        moving = quantities.places(self.mechanism, 3, only)
        forces = quantities.forces(self.mechanism, self.pairs)
        components = [*moving, *forces] if self.request.forces else moving
        word = unknown(components, only)
        if word is None:
            return
        if unknown(forces, [word]) is None:
            where = "dalembert forces shows it, dalembert simulate with --forces"
            raise bad(flag, f"'{word}': this is a force: {where}")
        names = {name for each in components for name in (*each.names, *each.owners)}
        owner = word.rpartition(".")[0]
        parts = [
            name.removeprefix(f"{owner}.")
            for each in components
            for name in each.names[:1]
            if owner in each.owners and name.startswith(f"{owner}.")
        ]
        if parts:
            choices = ", ".join(dict.fromkeys(parts))
            raise bad(flag, f"'{word}': expected {owner}. with one of {choices}")
        raise bad(flag, f"no link or point is named '{owner or word}'{nearest(word, names)}")

    # --- inputs ---------------------------------------------------------------------------------------------------
    def pose_text(self, i: int) -> str:
        """Return the inputs of a pose for a sentence: 60°, 0.35 m; several with their names."""
        values = [
            f"{figures(float(value))}{'°' if key.endswith('_deg') else ' m'}"
            for value, key in zip(self.inputs.whole.shown[i], self.input_names.values(), strict=True)
        ]
        if len(values) == 1:
            return values[0]
        return ", ".join(f"{name} {text}" for name, text in zip(self.input_names, values, strict=True))

    @cached_property
    def input_names(self) -> dict[str, str]:
        """The header of the value of each input: `input_deg`, or `input_m` of a slide."""
        return {e.name: "input_m" if e.is_slide else "input_deg" for e in self.mechanism.inputs}

    @property
    def unit(self) -> str:
        """The unit that the first input is shown in."""
        return "m" if any(e.is_slide for e in self.mechanism.inputs[:1]) else "deg"

    @cached_property
    def input_columns(self) -> tuple[str, ...]:
        """The headers of the inputs in a table."""
        several = len(self.mechanism.inputs) > 1
        return tuple(f"{name}_{key}" if several else key for name, key in self.input_names.items())

    @cached_property
    def set_angles(self) -> dict[str, NDArray[np.float64]]:
        """The requested angles of the links that are driven against the ground, degrees."""
        shown, inputs = self.inputs.whole.shown, self.mechanism.inputs
        return {e.link: shown[:, j] for j, e in enumerate(inputs) if e.link and e.on == "ground"}

    # --- sizes ----------------------------------------------------------------------------------------------------
    def bytes_each(self, *, json: bool, table: bool, states: bool) -> float:
        """Return the memory that one pose takes at most, as measured."""
        numbers = len(self.places) + (5 + 6 * len(self.mechanism.points)) * bool(self.forces)
        return 300 + 110 * numbers * json + 100 * numbers * table + 1200 * len(self.mechanism.links) * states

    def check_size(self, *, json: bool, table: bool, states: bool = False, times: int = 1) -> None:
        """Refuse poses of so many variants (`times`) that would take more memory than there is, before they are solved."""
        each = self.bytes_each(json=json, table=table, states=states) * len(self.assemblies)
        poses, room = self.inputs.n * times, memory()
        if poses * each > room:
            raise DataError(
                f"{self.file}: {poses} poses{f' of {times} variants' if times > 1 else ''} of {len(self.links)} links and {len(self.points)} points would take "
                f"{float(f'{poses * each / 1e9:.2g}'):g} GB: expected at most {room / each:.0f} poses, or fewer names by --only, or CSV, Parquet or a workbook, which are not limited"
            )

    # --- which poses there are ------------------------------------------------------------------------------------
    def assembled(self, motion: Motion) -> NDArray[np.bool_]:
        """Return which poses are assembled; with --only the rest of the mechanism is not solved, and does not count."""
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
        """The places of the points, links and slides that are requested, as a motion computes them."""
        bodies = self.mechanism.points
        result: list[Quantity] = [Point(bodies[name][0], 0j, name, 0) for name in self.points]
        result += [Angle(name, 0) for name in self.links]
        slides = [each.key for each in self.places if each.path[0] == "slides"]
        return [*result, *dict.fromkeys(key.of_order(0) for key in slides)]


def _motion(assembly: Assembly, inputs: Inputs, block_of: int | None = None) -> Motion:
    """Return the motion of an assembly through some inputs, which may be a block of so many poses."""
    from virtualwork.motion import Motion

    motion = Motion(assembly, inputs.values, inputs.speed, inputs.acceleration, block_of=block_of)
    motion.poses.input_rest = inputs.rest
    motion.poses.time = inputs.time
    return motion


# --- which quantities are requested ---
def chosen(components: Sequence[Component], words: Sequence[str] | None, order: int) -> list[Component]:
    """Return the quantities of these names, up to an order where a bare name stands; all without names.

    `components` has them to the highest order.
    """
    if words is None:
        return [each for each in components if each.order <= order and not each.reverse]
    requested = set(words)
    with_part = {word for word in requested if "." in word}
    return [
        each
        for each in components
        if not requested.isdisjoint(each.names)
        or (
            each.order <= order
            and not requested.isdisjoint(each.owners)
            and (not each.reverse or not with_part.isdisjoint(each.owners))
        )
    ]


def unknown(components: Sequence[Component], words: Sequence[str]) -> str | None:
    """Return the first of some names that no quantity has; None where all are names of quantities."""
    names = {name for each in components for name in (*each.names, *each.owners)}
    return next((word for word in words if word not in names), None)
