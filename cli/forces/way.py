"""The worked solution of `dalembert forces`: the ledger of every pose, links that carry motors, free-body diagrams."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cli.cases.ledger import PERPENDICULAR, REST, Entry, ledger
from dalembert.results.columns import Column, names
from dalembert.results.way import Topic, figures

if TYPE_CHECKING:
    from cli.cases.analysis import Analysis
    from virtualwork.motion import Motion
    from virtualwork.study.ledger import Item

TINY = 1e-13
"""A power below this share of load times largest velocity is rounding."""


def way(analysis: Analysis) -> list[Topic]:
    """The topics of one mechanism."""
    instants: list[tuple[list[Column], list[Entry]]] = []
    equations: list[str] = []
    for assembly, motion in zip(analysis.assemblies, analysis.motions, strict=True):
        moves = motion.dynamics.scene.moves and any(np.any(rate) for rate in motion.poses.rates[0])
        # at rest the displacements are virtual: of a unit speed of each input alone
        units = [None] if moves else list(range(len(analysis.mechanism.inputs)))
        entries = [_entries(analysis, motion, unit) for unit in units]
        if not equations:
            equations = _equations(analysis, motion, [e[0] for e in entries], moves)
        for i in range(motion.n):
            head = _pose(analysis, i)
            if analysis.several:
                head.append(names("branch", [assembly.number]))
            instants.append((head, [entry for each in entries for entry in each[i]]))
    return [ledger("poses[]", instants, equations)]


def _pose(analysis: Analysis, i: int) -> list[Column]:
    """The columns that name a pose: its inputs, as they are shown and as JSON has them."""
    shown = analysis.inputs.shown[i].tolist()
    inputs = analysis.mechanism.inputs
    if len(inputs) == 1:
        key = analysis.input_names[inputs[0].name]
        return [Column("input", key.removeprefix("input_"), [shown[0]], place=key)]
    return [
        Column(f"{entry.name}_input", key.removeprefix("input_"), [value], place=f"inputs.{entry.name}.{key}")
        for (entry, key), value in zip(
            ((e, analysis.input_names[e.name]) for e in inputs), shown, strict=True
        )
    ]


def _entries(analysis: Analysis, motion: Motion, unit: int | None) -> list[list[Entry]]:
    """The loads of every pose; none of one that is not assembled."""
    from virtualwork.study.ledger import items

    every = items(motion.dynamics, unit)
    with np.errstate(invalid="ignore"):
        speeds = [np.abs(item.rate) for item in every if not item.turns]
        fast = np.max(speeds, axis=0) if speeds else np.zeros(motion.n)
        turns = [np.abs(item.rate) for item in every if item.turns]
        turning = np.max(turns, axis=0) if turns else np.zeros(motion.n)
    several = unit is not None and len(analysis.mechanism.inputs) > 1
    field = analysis.mechanism.inputs[unit].name if several and unit is not None else ""
    whole = motion.assembled
    return [
        [_entry(item, i, float(turning[i] if item.turns else fast[i]), field) for item in every] if whole[i] else []
        for i in range(motion.n)
    ]  # fmt: skip


def _entry(item: Item, i: int, fastest: float, field: str) -> Entry:
    load, rate, power = item.load[i], item.rate[i], float(item.power[i])
    at_rest = abs(rate) <= TINY * fastest
    if item.workless:
        why: str | None = REST if at_rest and item.workless == PERPENDICULAR else item.workless
    elif at_rest:
        why = REST
    else:
        why = PERPENDICULAR if not item.turns and abs(power) <= TINY * abs(load) * fastest else None
    if why is not None:
        power = 0.0
    if item.turns:
        return Entry(
            item.link, item.kind, torque=float(load), omega=float(rate), power=power, workless=why, field=field
        )  # fmt: skip
    return Entry(
        item.link, item.kind, complex(load), complex(rate), power=power, workless=why, field=field, point=item.joint
    )  # fmt: skip


def _equations(analysis: Analysis, motion: Motion, entries: list[list[Entry]], moves: bool) -> list[str]:
    """The balance of the first pose with its numbers."""
    lines = []
    if motion.n * len(analysis.motions) > 1:
        lines.append(f"Pose {analysis.inputs.shown[0][0]:g}; the others in the same way.")
    if not moves:
        lines.append("The mechanism is at rest: the velocities are virtual, of a unit speed of the input.")
    for found in entries:
        if not found:
            lines.append("The pose cannot be assembled.")
            continue
        idle: dict[str, list[str]] = {}
        for e in found:
            if e.workless:
                name = f"{e.symbol} at {e.point}" if e.point else f"{e.symbol} ({e.kind})"
                idle.setdefault(e.workless, []).append(name)
        lines += [f"No work, {why}: {', '.join(dict.fromkeys(which))}." for why, which in idle.items()]
        here = [e for e in found if not e.workless]
        known = [e for e in here if e.kind != "unknown"]
        drives = [e for e in here if e.kind == "unknown"]
        lines.append(f"ΣF·V + ΣT·ω = 0{f' for input {found[0].field}' if found[0].field else ''}:")
        lines.append("  " + (" + ".join(f"{e.symbol}·{e.rate}" for e in here) or "0") + " = 0")
        lines += [f"  {e.equation()}" for e in known]
        lines.append(f"  sum without the drive: {figures(sum(e.power for e in known))} W")
        lines += [f"  {e.equation()}" for e in drives]
    return lines
