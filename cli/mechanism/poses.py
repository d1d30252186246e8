"""Poses as JSON and as tables."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from cli.mechanism.solve import Job
from cli.read.units import degrees

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from virtualwork.motion import Motion

Column = list[Any]
POINT = (("x_m", "y_m"), ("vx_m_s", "vy_m_s"), ("ax_m_s2", "ay_m_s2"), ("jx_m_s3", "jy_m_s3"))
LINK = ("angle_deg", "omega_rad_s", "alpha_rad_s2", "jerk_rad_s3")
SLIDE = ("position_m", "speed_m_s", "acceleration_m_s2", "jerk_m_s3")


def cells(values: NDArray[np.float64]) -> Column:
    """Numbers as Python's own; None where there is none; no −0."""
    listed: Column = (values + 0.0).tolist()
    if np.isfinite(values).all():
        return listed
    return [v if math.isfinite(v) else None for v in listed]


def pair(z: NDArray[np.complex128]) -> tuple[Column, Column]:
    """The components of plane vectors; None for both where one is not a number."""
    known = np.isfinite(z.real) & np.isfinite(z.imag)
    return cells(np.where(known, z.real, np.nan)), cells(np.where(known, z.imag, np.nan))


def of_link(
    motion: Motion, name: str, order: int, given: NDArray[np.float64] | None = None
) -> dict[str, Column]:
    """A link's angle and its rates; `given`: the angle of a driven link as it was asked for, degrees."""
    link = motion.link(name)
    angle = np.where(np.isfinite(link.angle), degrees(np.exp(1j * link.angle)), np.nan)
    if given is not None:
        angle = np.where(np.isfinite(angle), given, np.nan)
    parts = {"angle_deg": cells(exact_degrees(angle))}
    for key, attribute in zip(LINK[1 : order + 1], ("omega", "alpha", "jerk"), strict=False):
        parts[key] = cells(getattr(link, attribute))
    return parts


def exact_degrees(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Degrees in [0, 360)."""
    reduced = np.mod(angle, 360.0)
    return np.where(reduced >= 360.0, 0.0, reduced)


def of_point(motion: Motion, name: str, order: int) -> dict[str, Column]:
    """A point's position and its rates."""
    parts: dict[str, Column] = {}
    for k in range(order + 1):
        parts |= zip(POINT[k], pair(motion.point(name).complex(k)), strict=True)
    return parts


def of_slide(motion: Motion, name: str, order: int) -> dict[str, Column]:
    """A slide and its rates."""
    slide = motion.slide(name)
    return {
        key: cells(getattr(slide, attribute))
        for key, attribute in zip(
            SLIDE[: order + 1], ("position", "speed", "acceleration", "jerk"), strict=False
        )
    }


def inputs_of(job: Job) -> dict[str, Column]:
    """`input_deg` or `input_m`; with several inputs, a value per link."""
    m = job.mechanism
    shown = job.inputs.shown
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


def marks_of(job: Job, motion: Motion) -> list[list[str]]:
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
        for limit in track.limits():
            for i in np.flatnonzero(np.abs(track.apart(q, limit.input)) <= near):
                found[i] += [word for word in ("limit", "dead point") if word not in found[i]]
    return found


def document(job: Job) -> list[dict[str, Any]]:
    """The poses as INTERFACE's JSON has them, every assembly after the other at each input."""
    shown = inputs_of(job)
    columns = []
    for assembly, motion in zip(job.assemblies, job.motions, strict=True):
        assembled = job.assembled(motion)
        columns.append(
            (
                assembly.number,
                assembled.tolist(),
                cells(motion.condition) if job.only is None else None,
                marks_of(job, motion),
                {name: of_link(motion, name, job.order, job.given(name)) for name in job.links},
                {name: of_point(motion, name, job.order) for name in job.points},
                {name: of_slide(motion, name, job.order) for name in job.slides},
            )
        )
    poses = []
    for i in range(len(job.inputs.shown)):
        for number, assembled, condition, marks, links, points, slides in columns:
            pose: dict[str, Any] = {key: values[i] for key, values in shown.items()}
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


def wide_table(job: Job) -> dict[str, Column]:
    """One row for each pose and assembly: what --only asks for, side by side."""
    table: dict[str, Column] = {}
    inputs = inputs_of(job)
    several = job.several

    def put(key: str, values: Column, rows: int) -> None:
        table.setdefault(key, [None] * 0)
        table[key] += values

    for assembly, motion in zip(job.assemblies, job.motions, strict=True):
        put("step", list(job.inputs.steps), motion.n)
        if several:
            put("branch", [str(assembly.number)] * motion.n, motion.n)
        if "inputs" in inputs:
            for j, e in enumerate(job.mechanism.inputs):
                put(
                    f"{e.name}_input_{'m' if e.is_slide else 'deg'}",
                    job.inputs.shown[:, j].tolist(),
                    motion.n,
                )
        else:
            for key, values in inputs.items():
                put(key, values, motion.n)
        for name in job.points:
            for key, values in of_point(motion, name, job.order).items():
                put(f"{name}_{key}", values, motion.n)
        for name in job.slides:
            for key, values in of_slide(motion, name, job.order).items():
                put(f"{name}_{key}", values, motion.n)
        for name in job.links:
            for key, values in of_link(motion, name, job.order, job.given(name)).items():
                put(f"{name}_{key}", values, motion.n)
    return table
