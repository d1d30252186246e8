"""The link-state table: one row for each pose and link, as `dalembert work` reads it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cli.mechanism.job import Job
from cli.mechanism.poses import cells, of_link

if TYPE_CHECKING:
    from virtualwork.motion import Motion

UNKNOWN = "?"


def table(job: Job) -> dict[str, list[Any]]:
    """Centre of mass, angle, rates and loads of every link at every pose."""
    m = job.mechanism
    driven = {e.link for e in m.inputs if e.link is not None}
    several = len(job.motions) > 1
    columns: dict[str, list[Any]] = {}
    for assembly, motion in zip(job.assemblies, job.motions, strict=True):
        parts: dict[str, dict[str, list[Any]]] = {}
        for name in job.links:
            link = m.links[name]
            part: dict[str, list[Any]] = {
                "mass_kg": [link.mass] * motion.n,
                "inertia_kg_m2": [link.inertia] * motion.n,
            }
            for k, (x, y) in enumerate(
                (("x_m", "y_m"), ("vx_m_s", "vy_m_s"), ("ax_m_s2", "ay_m_s2"))[: job.order + 1]
            ):
                z = motion.at(name, link.center).complex(k)
                part[x], part[y] = cells(z.real + 0.0), cells(z.imag + 0.0)
            angle = of_link(motion, name, min(job.order, 2), job.given(name))
            part["angle_deg"] = angle["angle_deg"]
            part |= {key: angle[key] for key in ("omega_rad_s", "alpha_rad_s2") if key in angle}
            if job.order >= 1:
                part |= _loads(motion, name)
                if name in driven:
                    part["torque_N_m"] = [UNKNOWN] * motion.n
            parts[name] = part
        for i in range(motion.n):
            for name, part in parts.items():
                row: dict[str, Any] = {"step": job.inputs.steps[i]}
                if several:
                    row["branch"] = str(assembly.number)
                row |= {"link": name, **{key: values[i] for key, values in part.items()}}
                for key, value in row.items():
                    columns.setdefault(key, []).append(value)
    order = ["step", "branch", "link", "x_m", "y_m", "angle_deg", "mass_kg", "inertia_kg_m2"]
    return {key: columns[key] for key in (*order, *(k for k in columns if k not in order)) if key in columns}


def _loads(motion: Motion, link: str) -> dict[str, list[Any]]:
    """Applied forces and torques of the description, reduced to the link's centre of mass; no weights."""
    m = motion.mechanism
    force = np.zeros(motion.n, dtype=complex)
    torque = np.zeros(motion.n)
    center = m.links[link].center
    for f in m.forces:
        if f.link == link:
            turn = np.exp(1j * motion.angle(link))
            vector = f.force * turn if f.frame == "link" else np.full(motion.n, f.force)
            arm = (f.point - center) * turn
            force += vector
            torque += (arm.conjugate() * vector).imag
    for t in m.torques:
        if t.link == link:
            torque += t.torque
    return {"fx_N": cells(force.real), "fy_N": cells(force.imag), "torque_N_m": cells(torque)}
