"""What a call of `dalembert mechanism` works on: the mechanism, its assemblies, their motions, what is asked."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from cli.errors import DataError, memory, nearest
from cli.mechanism.read import Inputs, Sweep
from cli.read.about import about
from cli.read.files import read_bytes, remember

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cli.mechanism.options import Options
    from virtualwork import Mechanism
    from virtualwork.branch.assembly import Assembly
    from virtualwork.formulas.asked import Key
    from virtualwork.motion import Motion

ORDERS = ("position", "velocity", "acceleration", "jerk")


class Described(NamedTuple):
    """A mechanism as its file describes it."""

    mechanism: Mechanism
    bare: dict[str, str]
    """The units of bare lengths and angles, as far as `[units]` says them."""
    warnings: list[str]
    """Remarks about the tables beside the file."""
    about: dict[str, str]
    """What the file says for the head of a report."""


def load(path: str) -> Described:
    """Read a description; - is standard input."""
    import tomllib

    from cli.mechanism.tables import beside
    from virtualwork import Mechanism

    remember(path)
    file, data = read_bytes(path)
    warnings: list[str] = []
    try:
        text = data.decode("utf-8-sig")
        folder = Path() if path == "-" else Path(path).parent
        mechanism = Mechanism.from_toml_text(text, file, folder, partial(beside, warnings))
    except UnicodeDecodeError:
        raise DataError(f"{file}: this is not text: expected TOML in UTF-8") from None
    except ValueError as error:
        raise DataError(str(error)) from None
    document = tomllib.loads(text)
    units = {kind: str(unit) for kind, unit in document.get("units", {}).items()}
    return Described(mechanism, units, warnings, about(file, document))


@dataclass
class Analysis:
    """One call: lazily the assemblies and their motions."""

    file: str
    mechanism: Mechanism
    inputs: Inputs | Sweep
    order: int
    only: Sequence[str] | None = None
    branch: str | None = None
    warnings: list[str] = field(default_factory=list)
    # the analysis of which this is a block of poses
    block_of: Analysis | None = None

    @classmethod
    def of(
        cls,
        asked: Options,
        mechanism: Mechanism,
        inputs: Inputs | Sweep,
        order: int | None = None,
    ) -> Analysis:
        """Return the analysis to this order, or as --order has it, or to the highest that the inputs' rates give."""
        given = 0
        for k, name in enumerate(("speed", "acceleration", "jerk"), 1):
            if any(getattr(e, name) is not None for e in mechanism.inputs) or (
                getattr(inputs, name, None) is not None
            ):
                given = k
        if order is None:
            order = given if asked.order is None else ORDERS.index(asked.order)
        return cls(asked.file, mechanism, inputs, order, asked.names, asked.branch)

    @property
    def is_long(self) -> bool:
        """Whether the poses are more than one block."""
        from virtualwork.formulas.positions import BLOCK

        return self.inputs.n > BLOCK

    @property
    def several(self) -> bool:
        """Whether several assemblies are asked for."""
        return len((self.block_of or self).assemblies) > 1

    @cached_property
    def assemblies(self) -> tuple[Assembly, ...]:
        """The guess's assembly, or those that --branch asks for."""
        if self.branch is None:
            return (self.mechanism.assembly,)
        every = self.mechanism.assemblies()
        if any(g.kind == "Newton" for g in every[0].plan.groups):
            self.warnings.append(
                "--branch: groups without a closed form were searched from many starts; an assembly may be missing"
            )
        if self.branch == "all":
            return every
        number = int(self.branch)
        if number > len(every):
            raise DataError(
                f"--branch {number}: the mechanism has {len(every)} assemblies at the guess's input"
            )
        return (every[number - 1],)

    @cached_property
    def motions(self) -> tuple[Motion, ...]:
        """The motion of each assembly."""
        from virtualwork.motion import Motion

        q = self.inputs
        found = tuple(Motion(a, q.values, q.speed, q.acceleration) for a in self.assemblies)
        for motion in found:  # read from decimals, turned to radians: for the estimates of --digits
            motion.input_error = float(np.finfo(float).eps) * np.abs(motion.inputs)
        return found

    @cached_property
    def links(self) -> tuple[str, ...]:
        """The links asked for."""
        return self._asked(self.mechanism.links)

    @cached_property
    def points(self) -> tuple[str, ...]:
        """The points asked for, in the order of the file."""
        return self._asked(self.mechanism.points)

    @cached_property
    def slides(self) -> tuple[str, ...]:
        """The guides asked for, by their point; the points themselves tell where they are."""
        return self._asked(g.point for g in self.mechanism.guides)

    def _asked(self, names: Iterable[str]) -> tuple[str, ...]:
        return tuple(name for name in names if self.only is None or name in self.only)

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
    def given(self) -> dict[str, NDArray[np.float64]]:
        """The angles asked for of the links that are driven against the ground, degrees."""
        shown, inputs = self.inputs.shown, self.mechanism.inputs
        return {e.link: shown[:, j] for j, e in enumerate(inputs) if e.link and e.on == "ground"}

    def check_names(self) -> None:
        """Refuse names that --only cannot find."""
        known = {*self.mechanism.links, *self.mechanism.points}
        for name in self.only or ():
            if name not in known:
                raise DataError(
                    f"{self.file}: --only: no link or point is named '{name}'{nearest(name, known)}"
                )

    def bytes_each(self, *, json: bool, table: bool, states: bool, forces: bool) -> float:
        """What the answer for one pose takes at most, as measured."""
        rates = self.order + 1
        numbers = rates * (len(self.links) + 2 * len(self.points) + len(self.slides))
        if forces:
            numbers += 5 + 6 * len(self.points)
        return 300 + 110 * numbers * json + 100 * numbers * table + 1200 * len(self.mechanism.links) * states

    def check_size(self, *, json: bool, table: bool, states: bool, forces: bool, times: int = 1) -> None:
        """Refuse what would take more memory than there is, before it is begun; `times` so many variants."""
        each = self.bytes_each(json=json, table=table, states=states, forces=forces) * len(self.assemblies)
        poses, room = self.inputs.n * times, memory()
        if poses * each > room:
            raise DataError(
                f"{self.file}: {poses} poses{f' of {times} variants' if times > 1 else ''} of {len(self.links)} links and {len(self.points)} points would take "
                f"{float(f'{poses * each / 1e9:.2g}'):g} GB: expected at most {room / each:.0f} poses, or fewer names by --only, or CSV, Parquet or a workbook, which are not limited"
            )

    def assembled(self, motion: Motion) -> NDArray[np.bool_]:
        """Which poses are assembled, as far as what is asked for goes: with --only the rest is not solved."""
        if self.only is None:
            return motion.assembled
        whole = np.ones(motion.n, dtype=bool)
        for found in motion.values(self.named):
            whole &= np.isfinite(found)
        return whole

    @property
    def named(self) -> list[Key]:
        """Places of the points and links asked for, as a motion is asked for them."""
        homes = self.mechanism.points
        places = [("point", homes[name][0], 0j, name, 0) for name in self.points]
        return [*places, *(("angle", name, 0) for name in self.links)]
