"""Poses as Python's numbers, and as the JSON document has them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from cli.mechanism.solve import Analysis
from cli.read.units import degrees

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cli.show.columns import Document, Json
    from virtualwork.formulas.asked import Key
    from virtualwork.motion import Motion

Column = Sequence[float | None]
POINT = (("x_m", "y_m"), ("vx_m_s", "vy_m_s"), ("ax_m_s2", "ay_m_s2"), ("jx_m_s3", "jy_m_s3"))
LINK = ("angle_deg", "omega_rad_s", "alpha_rad_s2", "jerk_rad_s3")
SLIDE = ("position_m", "speed_m_s", "acceleration_m_s2", "jerk_m_s3")


def cells(values: NDArray[np.float64]) -> Column:
    """Numbers as Python's own; None where there is none; no −0."""
    listed: list[float] = (values + 0.0).tolist()
    if np.isfinite(values).all():
        return listed
    return [v if math.isfinite(v) else None for v in listed]


def pair(z: NDArray[np.complex128]) -> tuple[Column, Column]:
    """The components of plane vectors; None for both where one is not a number."""
    known = np.isfinite(z.real) & np.isfinite(z.imag)
    return cells(np.where(known, z.real, np.nan)), cells(np.where(known, z.imag, np.nan))


def up_to(motion: Motion, order: int, of: dict[str, Key]) -> dict[str, list[Any]]:
    """Quantities and their derivatives in time up to an order, from one pass; `of`: their keys without the order."""
    found = iter(motion.values([(*key, k) for key in of.values() for k in range(order + 1)]))
    return {name: [next(found) for _ in range(order + 1)] for name in of}


def of_links(
    motion: Motion, names: Sequence[str], order: int, given: Mapping[str, NDArray[np.float64]]
) -> dict[str, dict[str, Column]]:
    """Links' angles and their rates; `given`: the angles of driven links as they were asked for, degrees."""
    found = {}
    for name, (angle, *rates) in up_to(motion, order, {name: ("angle", name) for name in names}).items():
        shown = exact_degrees(given[name]) if name in given else degrees(np.exp(1j * angle))
        columns = [np.where(np.isfinite(angle), shown, np.nan), *rates]
        found[name] = {key: cells(values) for key, values in zip(LINK, columns, strict=False)}
    return found


def exact_degrees(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Degrees in [0, 360)."""
    reduced = np.mod(angle, 360.0)
    return np.where(reduced >= 360.0, 0.0, reduced)


def of_points(motion: Motion, names: Sequence[str], order: int) -> dict[str, dict[str, Column]]:
    """Points' positions and their rates."""
    homes = motion.mechanism.points
    # the name says where on the body
    keys_of = {name: ("point", homes[name][0], 0j, name) for name in names}
    return {
        name: {
            key: values
            for keys, z in zip(POINT, found, strict=False)
            for key, values in zip(keys, pair(z), strict=True)
        }
        for name, found in up_to(motion, order, keys_of).items()
    }


def of_slide(motion: Motion, name: str, order: int) -> dict[str, Column]:
    """A slide and its rates."""
    slide = motion.slide(name)
    return {
        key: cells(getattr(slide, attribute))
        for key, attribute in zip(
            SLIDE[: order + 1], ("position", "speed", "acceleration", "jerk"), strict=False
        )
    }


def inputs_of(analysis: Analysis) -> dict[str, Sequence[Json]]:
    """`input_deg` or `input_m`; with several inputs, a value per link."""
    m = analysis.mechanism
    shown = analysis.inputs.shown
    if len(m.inputs) == 1:
        return {"input_m" if m.inputs[0].is_slide else "input_deg": shown[:, 0].tolist()}
    rows = [
        {
            e.name: {"input_m" if e.is_slide else "input_deg": float(value)}
            for e, value in zip(m.inputs, row, strict=True)
        }
        for row in shown
    ]
    return {"inputs": rows}


def marks_of(analysis: Analysis, motion: Motion) -> list[list[str]]:
    """What is special about each pose: a change point, a limit of the input, a dead point."""
    found: list[list[str]] = [[] for _ in range(motion.n)]
    track = motion.assembly.track
    if not track.active:
        return found
    near = 1e-9 * track.length
    q = motion.inputs[:, 0]
    for at in track.crossings:
        for i in np.flatnonzero(np.abs(q - at) <= near):
            if "change point" not in found[i]:
                found[i].append("change point")
    if track.has_limits:
        reach = motion.assembly.reach
        for limit in reach.limits():
            for i in np.flatnonzero(np.abs(reach.apart(q, limit.input)) <= near):
                found[i] += [word for word in ("limit", "dead point") if word not in found[i]]
    return found


def document(
    analysis: Analysis, marks_of: Callable[[Analysis, Motion], list[list[str]]] = marks_of
) -> list[Document]:
    """The poses as INTERFACE's JSON has them, every assembly after the other at each input."""
    shown = inputs_of(analysis)
    columns = []
    for assembly, motion in zip(analysis.assemblies, analysis.motions, strict=True):
        assembled = analysis.assembled(motion)
        columns.append(
            (
                assembly.number,
                assembled.tolist(),
                cells(motion.condition) if analysis.only is None else None,
                marks_of(analysis, motion),
                of_links(motion, analysis.links, analysis.order, analysis.given),
                of_points(motion, analysis.points, analysis.order),
                {name: of_slide(motion, name, analysis.order) for name in analysis.slides},
            )
        )
    poses = []
    for i in range(len(analysis.inputs.shown)):
        for number, assembled, condition, marks, links, points, slides in columns:
            pose: Document = {key: values[i] for key, values in shown.items()}
            pose |= {"branch": number, "assembled": assembled[i]}
            if condition is not None:
                pose["condition"] = condition[i]
            pose["marks"] = marks[i]
            for kind, parts in (("links", links), ("points", points), ("slides", slides)):
                if parts:
                    pose[kind] = {
                        name: {key: values[i] if assembled[i] else None for key, values in entry.items()}
                        for name, entry in parts.items()
                    }
            poses.append(pose)
    return poses
