"""Bounds of the rounding errors of the tables' numbers, for --digits: column name -> one bound per row."""

from __future__ import annotations

import math
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from cli.mechanism import forces, states
from cli.mechanism.poses import LINK, POINT, SLIDE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cli.mechanism.solve import Job
    from virtualwork.motion import Motion

    Reals = NDArray[np.float64]

Column = list[float]
TURNED = 2 * float(np.finfo(float).eps)  # of an input that was turned to radians and back, or to metres


def _cells(bounds: Reals) -> Column:
    """Bounds as Python's numbers; where there is none, no digit holds."""
    return [math.inf if bound != bound else bound for bound in bounds.tolist()]


def _of_link(job: Job, motion: Motion, name: str, order: int) -> Reals:
    """The bound of a link's angle (degrees) or of its rate."""
    if order:
        return motion.link(name).error_estimate(order)
    given = job.given(name)
    if given is not None:
        return TURNED * np.abs(given)
    angle = np.degrees(motion.link(name).error_estimate(0))
    return np.asarray(angle + np.finfo(float).eps * 360)  # in degrees it lies in a whole turn


def _inputs(job: Job) -> dict[str, Reals]:
    """The bounds of the columns of inputs."""
    several = len(job.mechanism.inputs) > 1
    return {
        f"{entry.name}_" * several + f"input_{'m' if entry.is_slide else 'deg'}": TURNED
        * np.abs(job.inputs.shown[:, j])
        for j, entry in enumerate(job.mechanism.inputs)
    }


def of_poses(job: Job) -> dict[str, Column]:
    """The bounds of `poses.wide_table`."""
    found: dict[str, Column] = {}

    def put(key: str, bounds: Reals) -> None:
        found.setdefault(key, []).extend(_cells(bounds))

    for motion in job.motions:
        for key, given in _inputs(job).items():
            put(key, given)
        for name in job.points:
            for k, keys in enumerate(POINT[: job.order + 1]):
                for key in keys:
                    put(f"{name}_{key}", motion.point(name).error_estimate(k))
        for name in job.slides:
            for k, key in enumerate(SLIDE[: job.order + 1]):
                put(f"{name}_{key}", motion.slide(name).error_estimate(k))
        for name in job.links:
            for k, key in enumerate(LINK[: job.order + 1]):
                put(f"{name}_{key}", _of_link(job, motion, name, k))
    return found


def of_forces(job: Job) -> dict[str, Column]:
    """The bounds of `forces.table`."""
    found: dict[str, Column] = {}

    def put(key: str, bounds: Reals) -> None:
        found.setdefault(key, []).extend(_cells(bounds))

    for motion in job.motions:
        bounds = motion.dynamics.error_estimate()
        for key, given in _inputs(job).items():
            put(key, given)
        several = len(job.mechanism.inputs) > 1
        for j, entry in enumerate(job.mechanism.inputs):
            name = f"{entry.name}_" if several else ""
            unit = forces.effort_name(entry.is_slide)
            euler, work = bounds.newton_euler[:, j], bounds.effort[:, j]
            put(f"{name}input_{unit}", euler)
            put(f"{name}virtual_work_{unit}", work)
            put(f"{name}difference_{unit}", euler + work)
        for joint, on, of in forces.rows_of(job, motion):
            lead = f"{joint.name}_{of}_on_{on}"
            length = bounds.joint_force(joint, on)
            put(f"{lead}_fx_N", length)
            put(f"{lead}_fy_N", length)
            put(f"{lead}_moment_N_m", bounds.joint_moment(joint, on))
        length, moment = bounds.shaking
        put("shaking_fx_N", length)
        put("shaking_fy_N", length)
        put("shaking_moment_N_m", moment)
    return found


def of_states(job: Job) -> dict[str, Column]:
    """The bounds of `states.table`."""
    rows = states.rows(job)

    @cache
    def bounds(motion: Motion, link: str, field: int | None, guide: int | None, key: str) -> Column:
        along = motion if field is None else motion.unit(field)
        center = motion.dynamics.scene.rigid[link].center
        if key in ("fvx_m_s", "fvy_m_s"):
            assert guide is not None
            return _cells(_guided(along, guide, link))
        if key in ("fx_N", "fy_N", "torque_N_m"):
            force, moment = motion.dynamics.error_estimate().applied(link)
            return _cells(moment if key == "torque_N_m" else force)
        for k, keys in enumerate(POINT):
            if key in keys:
                which = along if k == 1 else motion
                return _cells(which.at(link, center).error_estimate(k))
        k = LINK.index(key)
        return _cells(_of_link(job, along if k == 1 else motion, link, k))

    known = [
        key
        for key in states.ORDER
        if key not in ("step", "branch", "field", "link", "mass_kg", "inertia_kg_m2")
    ]
    found: dict[str, Column] = {key: [] for key in known}
    for place, row in rows:
        guide = None if place.mark is None else place.mark.guide
        for key, column in found.items():
            value = row.get(key)
            number = isinstance(value, float) and value != 0
            column.append(
                bounds(place.motion, place.link, place.field, guide, key)[place.pose] if number else 0.0
            )
    return found


def _guided(motion: Motion, guide: int, link: str) -> Reals:
    """The bound of the velocity of the point of a link at which a driven slider's force acts."""
    m, r = motion.mechanism, motion.rounding
    g = m.guides[guide]
    if link == g.link:
        return motion.at(link, g.point).error_estimate(1)
    slide, omega = np.abs(motion.poses.slide_derivative(guide, 0)), np.abs(motion.link(link).omega)
    carried = motion.at(link, m.through(g)).error_estimate(1)
    turned = slide * (r.angle(link, 1) + omega * r.rotation(link)) + omega * r.slide(guide)
    return np.asarray(carried + turned)
