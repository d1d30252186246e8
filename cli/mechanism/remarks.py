"""What is said of a mechanism as warnings: limits, branches, forces that have no value."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from cli.mechanism.solve import Analysis
from cli.mechanism.studies import Studies

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from virtualwork.branch.assembly import Assembly

GROUND = "ground"


def warnings(studies: Studies) -> list[str]:
    """All of them, once the studies are done."""
    analysis = studies.analysis
    said = [*analysis.warnings, *limits(analysis), *studies.said]
    return [*said, *of_forces(analysis)] if studies.asked.forces else said


def _on_branch(analysis: Analysis, assembly: Assembly, found: list[float], digits: int) -> list[float]:
    """Inputs as they are shown, each once, deg in [0, period of the branch) or m."""
    if analysis.mechanism.inputs[0].is_slide:
        return sorted({round(v, digits) for v in found})
    turns = assembly.reach.turns
    if turns is None:
        return sorted({round(math.degrees(v), digits) for v in found})
    full = 360.0 * turns
    return sorted({round(math.degrees(v) % full, digits) % full for v in found})


def limits(analysis: Analysis, counted: list[tuple[int, int]] | None = None) -> list[str]:
    """One line for the poses that cannot be assembled, with the limit of the input that is near them; and branches.

    `counted`: how many these are of each assembly, and the first, where blocks of poses have told it.
    """
    lines = []
    if counted is None:
        gaps = [~analysis.assembled(motion) for motion in analysis.motions]
        counted = [(int(gap.sum()), int(np.argmax(gap))) for gap in gaps]
    for assembly, (missing, first) in zip(analysis.assemblies, counted, strict=True):
        track = assembly.track
        name = analysis.mechanism.inputs[0].name
        if missing:
            text = f"{missing} of {analysis.inputs.n} poses cannot be assembled"
            if track.active:
                shown = _on_branch(analysis, assembly, [v.input for v in assembly.reach.limits()], 12)
                if shown:
                    values = ", ".join(f"{v:.13g}" for v in shown)
                    text += (
                        f": the input {name} has the limit{'s' * (len(shown) > 1)} {values} {analysis.unit}"
                    )
            lines.append(text + _shortfall(analysis, assembly, first))
        lines += _branch_lines(analysis, assembly)
        lines += track.warnings()
    return list(dict.fromkeys(lines))


def _shortfall(analysis: Analysis, assembly: Assembly, i: int) -> str:
    """By how much a pose does not close, and the nearest input where it would."""
    pose = analysis.inputs.part(i, i + 1)
    found = assembly.reach.shortfall(tuple(pose.values[0].tolist()))
    if found is None:
        return ""
    factor, unit = (1e3, "mm") if analysis.mechanism.size < 2 else (1.0, "m")
    shown = ", ".join(
        f"{v:.10g} {'m' if e.is_slide else 'deg'}"
        for e, v in zip(analysis.mechanism.inputs, pose.shown[0], strict=True)
    )
    text = f"; at {shown}: {found.text(lambda v: f'{v * factor:.6g} {unit}')}"
    if found.nearest is not None:
        there = found.nearest if analysis.unit == "m" else math.degrees(found.nearest)
        text += f"; it would close at {there:.10g} {analysis.unit}"
    return text


def _branch_lines(analysis: Analysis, assembly: Assembly) -> list[str]:
    """Change points on the way from the guess to the poses: which branch was taken, and the other."""
    track = assembly.track
    if not track.active:
        return []
    least, largest = analysis.inputs.span
    low, high = min(least, track.start), max(largest, track.start)
    lines = []
    for changes in track.changes.values():
        inside = [c for c in changes if low - 1e-12 <= c.input <= high + 1e-12]
        if not inside:
            continue
        at = _on_branch(analysis, assembly, [c.input for c in inside], 9)
        c = inside[0]
        group = next(g for g in assembly.plan.groups if g.name == c.group)
        names = [*group.angles, *(analysis.mechanism.guides[g].point for g in group.slides)]

        def rates(values: Iterable[float], names: list[str] = names) -> str:
            return ", ".join(
                f"d{n}/dq = {round(float(v), 12) + 0.0:.6g}" for n, v in zip(names, values, strict=True)
            )

        text = f"change point at {', '.join(f'{v:.10g}' for v in at)} {analysis.unit}: the branches of {c.group} cross; "
        text += f"the motion goes on along its tangent ({rates(c.rates[0])})"
        if c.other is not None:
            text += f", the other branch would go with {rates(c.other)}"
        lines.append(text)
    return lines


def of_forces(analysis: Analysis) -> list[str]:
    """What the forces cannot say, pose by pose: dead points, change points, locked friction, redundant joints."""
    found = [listed(analysis, what, places, len(places)) for what, places in troubles(analysis)]
    return list(dict.fromkeys([*found, *statements(analysis)]))


def troubles(analysis: Analysis) -> list[tuple[str, list[float]]]:
    """What the forces cannot say, and the inputs where they cannot."""
    found: list[tuple[str, list[float]]] = []

    def note(bad: NDArray[np.bool_], what: str) -> None:
        if bad.any():
            found.append((what, analysis.inputs.shown[bad, 0].tolist()))

    for motion in analysis.motions:
        d = motion.dynamics
        there = motion.assembled
        for number, meet in d.without_length.items():
            note(
                there & meet,
                f"the ends of [[springs]] {number} meet, so that its pull has no direction: the forces that hang "
                "on it have no value",
            )
            there = there & ~meet
        for values, what in (
            (
                d.effort,
                "the effort by virtual work has no finite value: a dead point, where the input cannot move the rest",
            ),
            (
                d.newton_euler if d.statics is None else d.effort,
                "the joint forces have no finite value: loads in line with the links at a dead or change point",
            ),
        ):
            if not motion.assembly.track.folded:  # singular in every pose: that is said once
                note(there & ~np.isfinite(values).all(axis=1) & ~d.locked, what)
        if d.scene.friction:
            note(there & d.locked, "friction locks the mechanism: no reaction balances its own friction")
    return found


def statements(analysis: Analysis) -> list[str]:
    """What is to be said of the forces whatever the pose."""
    found: list[str] = []
    for motion in analysis.motions:
        d = motion.dynamics
        if d.statics is not None:
            found += d.statics.undetermined()
    for motion in analysis.motions[:1]:
        for body, r in motion.mechanism.rigid.items():
            if (
                r.inertia
                and not r.mass
                and motion.dynamics.scene.moves
                and not _pinned(analysis, body, r.center)
            ):
                found.append(
                    f"[links.{body}]: an inertia and no mass, though its centre moves: no inertia force from it"
                )
    if analysis.mechanism.friction and not any(motion.dynamics.scene.moves for motion in analysis.motions):
        found.append(
            "friction: nothing moves (speed zero), so that its direction and size are not determined: left out"
        )
    return list(dict.fromkeys(found))


def _pinned(analysis: Analysis, body: str, center: complex) -> bool:
    """Whether a link turns about its centre, pinned to the ground there."""
    points = analysis.mechanism.links[body].points
    return any(
        GROUND in bodies and points.get(name) == center for name, bodies in analysis.mechanism.pins.items()
    )


def listed(analysis: Analysis, what: str, places: list[float], count: int) -> str:
    """One line for what happens at some inputs: the first five of them, and how many more there are."""
    named = ", ".join(f"{place:g} {analysis.unit}" for place in places[:5])
    more = f" and {count - 5} further poses" if count > 5 else ""
    return f"at input {named}{more}: {what}"
