"""Warnings about a mechanism: limits, branches, forces that have no value."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from cli.cases.analysis import Analysis
from cli.cases.inputs import Driven, Varied
from dalembert.angles import in_turn
from dalembert.dataclass import dataclass, field

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from virtualwork.branch.assembly import Assembly
    from virtualwork.branch.change_point import ChangePoint
    from virtualwork.describe.cams import CamDrive
    from virtualwork.describe.description import Description
    from virtualwork.formulas.loads import Tabled
    from virtualwork.motion import Motion

GROUND = "ground"
# of many change points or limits a warning names so many, and how many there are
NAMED = 10


def _on_branch(analysis: Analysis, assembly: Assembly, inputs: Iterable[float]) -> list[float]:
    """Return inputs as they are shown, each once, deg in [0, period of the branch) or m."""
    distinct = assembly.reach.distinct(inputs)
    # 0 is no 1e-17
    return [
        round(v if analysis.mechanism.inputs[0].is_slide else math.degrees(v), 11) + 0.0 for v in distinct
    ]


def _listed(values: list[float], digits: int) -> str:
    """Name numbers, of many numbers the first ones.

    >>> _listed([0.5, 90.0], 10), _listed([float(v) for v in range(2000)], 10)
    ('0.5, 90', '0, 1, 2, 3, 4, 5, 6, 7, 8, 9 … (2000 in all)')
    """
    first = ", ".join(f"{v:.{digits}g}" for v in values[:NAMED])
    return first if len(values) <= NAMED else f"{first} … ({len(values)} in all)"


def limits(analysis: Analysis, gaps: Sequence[tuple[int, int]]) -> list[str]:
    """Return the warnings of poses that cannot be assembled, with the limits of the input; and of branches.

    `gaps`: for each assembly the number of such poses, and the first of them.
    """
    lines = []
    for assembly, (missing, first) in zip(analysis.assemblies, gaps, strict=True):
        track = assembly.track
        name = analysis.mechanism.inputs[0].name
        if missing:
            text = f"{missing} of {analysis.inputs.n} poses cannot be assembled"
            if track.active:
                shown = _on_branch(analysis, assembly, (v.input for v in assembly.reach.limits()))
                if shown:
                    several = "s" * (len(shown) > 1)
                    text += f": the input {name} has the limit{several} {_listed(shown, 13)} {analysis.unit}"
            lines.append(text + _shortfall(analysis, assembly, first))
        lines += _branch_lines(analysis, assembly)
        lines += track.warnings()
    return list(dict.fromkeys(lines))


def _shortfall(analysis: Analysis, assembly: Assembly, i: int) -> str:
    """Return by how much a pose does not close, and the nearest input at which it closes."""
    pose = analysis.inputs.part(i, i + 1)
    gap = assembly.reach.shortfall(tuple(pose.values[0].tolist()))
    if gap is None:
        return ""
    factor, unit = (1e3, "mm") if analysis.mechanism.size < 2 else (1.0, "m")
    shown = ", ".join(
        f"{v:.10g} {'m' if e.is_slide else 'deg'}"
        for e, v in zip(analysis.mechanism.inputs, pose.shown[0], strict=True)
    )
    text = f"; at {shown}: {gap.text(lambda v: f'{v * factor:.6g} {unit}')}"
    if gap.nearest is not None:
        closing = gap.nearest if analysis.unit == "m" else math.degrees(gap.nearest)
        text += f"; it would close at {closing:.10g} {analysis.unit}"
    return text


def _branch_lines(analysis: Analysis, assembly: Assembly) -> list[str]:
    """Return the warnings of change points between the guess and the poses: the branch that is taken, and the other."""
    track = assembly.track
    if not track.active or not any(track.changes.values()):
        return []
    least, largest = analysis.inputs.span
    low, high = min(least, track.start), max(largest, track.start)
    lines = []
    for changes in track.changes.values():
        # the points at which the branches cross alike
        alike: dict[str, list[float]] = {}
        for c in changes:
            if low - 1e-12 <= c.input <= high + 1e-12:
                alike.setdefault(_crossing(analysis, assembly, c), []).append(c.input)
        for text, inputs in alike.items():
            at = _listed(_on_branch(analysis, assembly, inputs), 10)
            lines.append(f"change point at {at} {analysis.unit}: {text}")
    return lines


def _crossing(analysis: Analysis, assembly: Assembly, change: ChangePoint) -> str:
    """Return which branches cross at a change point, the tangent that the motion takes, and the other one."""
    group = next(g for g in assembly.plan.groups if g.name == change.group)
    names = [*group.angles, *(analysis.mechanism.guides[g].point for g in group.slides)]

    def rates(values: Iterable[float]) -> str:
        return ", ".join(
            f"d{n}/dq = {round(float(v), 12) + 0.0:.6g}" for n, v in zip(names, values, strict=True)
        )

    text = f"the branches of {change.group} cross; the motion continues along its tangent ({rates(change.rates[0])})"
    return text if change.other is None else f"{text}, the other branch would have {rates(change.other)}"


def of_poses(analysis: Analysis) -> list[str]:
    """Return the warnings of rates and forces without a value: dead points, change points, locked friction, redundant joints."""
    result = [at_places(analysis, what, places, len(places)) for what, places in troubles(analysis)]
    return list(dict.fromkeys([*result, *statements(analysis)]))


def troubles(analysis: Analysis) -> list[tuple[str, list[float]]]:
    """Return the reasons why rates and forces have no value, with the inputs where."""
    troubles: list[tuple[str, list[float]]] = []

    def note(bad: NDArray[np.bool_], what: str) -> None:
        if bad.any():
            troubles.append((what, analysis.inputs.whole.shown[bad, 0].tolist()))

    rates = [each.key for each in analysis.places if each.order]
    for motion in analysis.motions:
        if not analysis.forces:
            if rates and not motion.assembly.track.folded:
                known = np.isfinite(motion.values(rates)).all(axis=0)
                what = "the pose is singular: the speed of the input does not determine the other rates, which have no value"
                note(analysis.assembled(motion) & ~known, what)
            continue
        d = motion.dynamics
        whole = motion.assembled
        for number, meet in d.without_length.items():
            note(
                whole & meet,
                f"the ends of [[springs]] {number} coincide: its force has no direction there, and the forces that depend "
                "on it have no value",
            )
            whole = whole & ~meet
        for load, bad in d.beyond_tables:
            note(whole & bad, _beyond(analysis, load))
            whole = whole & ~bad
        for values, what in (
            (
                d.effort,
                "the effort by virtual work has no finite value: a dead point, where the input cannot move the other links",
            ),
            (
                d.newton_euler if d.statics is None else d.effort,
                "the joint forces have no finite value: loads in line with the links at a dead or change point",
            ),
        ):
            if not motion.assembly.track.folded:  # singular in every pose: that is warned of once
                note(whole & ~np.isfinite(values).all(axis=1) & ~d.locked, what)
        for number, drive in enumerate(analysis.mechanism.cam_drives):
            press = d.contact(number)
            with np.errstate(invalid="ignore"):
                pulls = press < -1e-12 * np.nanmax(np.abs(press), initial=0.0)
            if (whole & pulls).any():
                note(whole & pulls, contact_lost(motion, drive))
        if d.case.friction:
            note(whole & d.locked, "friction locks the mechanism: no reaction balances its own friction")
    return troubles


def _beyond(analysis: Analysis, load: Tabled) -> str:
    """Return the warning of a load outside the rows of its table."""
    over, unit, factor = {
        "input": ("input", analysis.unit, 1.0 if analysis.unit == "m" else 180 / math.pi),
        "speed": ("speed", "rad/s", 1.0),
    }.get(load.axis, ("angle", "deg", 180 / math.pi))
    low, high = (f"{load.table[i][0] * factor:.6g}" for i in (0, -1))
    return (
        f"the {load.kind} on {load.body} has no value: its table over the {over} has rows from {low} to {high} {unit}; the forces "
        "that depend on it have none"
    )


def contact_lost(motion: Motion, drive: CamDrive) -> str:
    """Return the warning of a cam that would have to pull its follower."""
    from virtualwork.study.cams import lift_off

    off = lift_off(motion.assembly, drive.number)
    text = f"contact lost: {drive.label} would have to pull its follower"
    if off is None or not np.isfinite(off.speed):
        return text
    if off.speed == 0:
        return f"{text}, also at rest"
    return f"{text}, at constant speed from {off.speed:.6g} rad/s on, first at {in_turn(np.degrees(off.at)):.6g} deg"


def statements(analysis: Analysis) -> list[str]:
    """Return the warnings of the forces that hold for all poses."""
    result: list[str] = []
    if not analysis.forces:
        return result
    for motion in analysis.motions:
        d = motion.dynamics
        if d.statics is not None:
            result += d.statics.undetermined()
    for motion in analysis.motions[:1]:
        for body, r in motion.mechanism.rigid.items():
            if (
                r.inertia
                and not r.mass
                and motion.dynamics.moves
                and not pinned(analysis.mechanism, body, r.center)
            ):
                result.append(
                    f"[links.{body}]: an inertia and no mass, but its centre moves: its inertia force is missing; add mass"
                )
    if analysis.mechanism.friction and not any(motion.dynamics.moves for motion in analysis.motions):
        result.append("friction is left out: at speed zero its direction and size are not determined")
    return list(dict.fromkeys([*result, *idle_friction(analysis.mechanism)]))


def idle_friction(m: Description) -> list[str]:
    """Return the warnings of pins that rub on no radius."""
    guides = {guide.point for guide in m.guides}
    return [
        f"[[friction]] {number}: no effect at the pin {each.joint}: its friction acts on the radius of the pin; add radius"
        for number, each in enumerate(m.friction, 1)
        if each.coefficient and not each.radius and each.joint not in guides
    ]


def pinned(m: Description, body: str, center: complex) -> bool:
    """Whether a link turns about its centre, pinned to the ground there."""
    points = m.links[body].points
    return any(GROUND in bodies and points.get(name) == center for name, bodies in m.pins.items())


def without_meaning(analysis: Analysis, varied: Sequence[Driven | Varied] = ()) -> list[str]:
    """Return the warnings of numbers without a meaning: rates without a speed, forces without a mass or a load.

    `varied`: what variants set; a speed, a mass or a load among it gives numbers a meaning.
    """
    m, request, lines = analysis.mechanism, analysis.request, []
    paths = [name.of.where for name in varied if isinstance(name, Varied)]
    moves = (
        analysis.input_order > 0
        or any(isinstance(name, Driven) and name.order for name in varied)
        or any(where[0] == "inputs" and where[-1] != "value" for where in paths)
    )
    if not moves and (request.order or request.only) and any(each.order for each in analysis.places):
        lines.append(
            "no input has a speed: all rates are zero; add speed to [input], or --set input.speed=10rad/s"
        )
    if not request.forces or any((m.forces, m.torques, m.springs, m.torsion_springs, m.motors)):
        return lines
    if not any(each.mass or each.inertia for each in m.rigid.values()):
        if not any(where[0] == "links" and where[-1] in ("mass", "inertia") for where in paths):
            lines.append(
                "no mass and no load: all forces are zero; add mass to a link, or a load such as [[forces]]"
            )
    elif not m.gravity and not moves and not any(where[0] == "gravity" for where in paths):
        lines.append(
            "masses at rest without gravity or a load: all forces are zero; add gravity, or speed to [input]"
        )
    return lines


def at_places(analysis: Analysis, what: str, places: list[float], count: int) -> str:
    """Return one line for what happens at some inputs: the first five of them, and the number of the others."""
    named = ", ".join(f"{place:g} {analysis.unit}" for place in places[:5])
    more = f" and {count - 5} further poses" if count > 5 else ""
    return f"at input {named}{more}: {what}"


# --- the warnings of many variants ---
# the first so many variants that have remarks keep them, whoever computes them; so many different remarks are
# printed, each with the first so many variants that have it
KEPT, PRINTED, VARIANTS = 50, 10, 5


@dataclass
class Remarks:
    """The warnings of all variants: each once, with the variants that have it.

    Attributes
    ----------
    kept : list of (variant, its warnings)
        Those of the first variants that have any; the mechanism itself has an empty name.
    further : int
        The number of variants after these that have warnings too.
    any_assembled : bool
        Whether any pose of any variant is assembled.
    """

    kept: list[tuple[str, tuple[str, ...]]] = field(default_factory=list)
    further: int = 0
    any_assembled: bool = False

    @property
    def full(self) -> bool:
        """Whether no further warning is kept."""
        return len(self.kept) >= KEPT

    def clear(self) -> None:
        """Begin anew."""
        self.kept, self.further, self.any_assembled = [], 0, False

    def failed(self) -> bool:
        """Whether no pose of any variant is assembled."""
        return not self.any_assembled

    def add(self, name: str, warnings: Iterable[str], assembled: list[bool] | bool = False) -> None:
        """Add the warnings of a variant, which may be none, and whether its poses are assembled."""
        lines = tuple(dict.fromkeys(warnings))
        if lines and self.full:
            self.further += 1
        elif lines:
            self.kept.append((name, lines))
        self.any_assembled |= assembled if isinstance(assembled, bool) else any(assembled)

    def join(self, other: Remarks) -> None:
        """Add the warnings of later variants."""
        for name, lines in other.kept:
            self.add(name, lines)
        self.further += other.further
        self.any_assembled |= other.any_assembled

    def lines(self) -> list[str]:
        """Return the lines that are printed."""
        about: dict[str, list[str]] = {}
        for name, remarks in self.kept:
            for remark in remarks:
                about.setdefault(remark, []).append(name)
        if any(names == [""] for names in about.values()):
            return list(about)
        lines = []
        for remark, names in list(about.items())[:PRINTED]:
            more = f" and {len(names) - VARIANTS} more" if len(names) > VARIANTS else ""
            lines.append(f"variant{'s' * (len(names) > 1)} {', '.join(names[:VARIANTS])}{more}: {remark}")
        printed = set(list(about)[:PRINTED])
        further = self.further + sum(printed.isdisjoint(remarks) for _, remarks in self.kept)
        if further:
            lines.append(f"{further} further variant{'s have' if further > 1 else ' has'} remarks too")
        return lines
