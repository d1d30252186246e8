"""Rigid bodies in space: inertia, angular momentum, shafts, rotation in time.

SI units and radians; leading axes of an array are bodies, states or times. Quaternions are [w, x, y, z], body
to space. Products of inertia are +∫ x y dm, and a tensor carries them with the minus sign.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from dalembert.on_use import on_use

if TYPE_CHECKING:
    from dalembert.documents.robots import Robot
    from rigidbody3d.attitude import from_scipy, to_scipy
    from rigidbody3d.body import Body, compose
    from rigidbody3d.freebody import FreeBody, FreeState
    from rigidbody3d.gyroscope import cones, gyroscopic_couple, sleeping_threshold, steady_precession
    from rigidbody3d.inertia import check, principal, products, shift, tensor
    from rigidbody3d.integration import Trajectory, integrate
    from rigidbody3d.momentum import Motion, Wrench
    from rigidbody3d.parts import read_parts
    from rigidbody3d.percussion import strike
    from rigidbody3d.robots.inertias import check_robot_inertias, link_body
    from rigidbody3d.robots.reading import read_robot
    from rigidbody3d.shaft import Shaft
    from rigidbody3d.shapes import SHAPES, inertia_of, load_mesh, measure_of, mesh
    from rigidbody3d.top import Top, TopState

# each module is loaded when one of its names is used: inertia waits for no rotation in time, and numbers for no table
_HOMES = {
    "dalembert.documents.robots": "Robot",
    "rigidbody3d.attitude": "from_scipy to_scipy",
    "rigidbody3d.body": "Body compose",
    "rigidbody3d.freebody": "FreeBody FreeState",
    "rigidbody3d.gyroscope": "cones gyroscopic_couple sleeping_threshold steady_precession",
    "rigidbody3d.inertia": "check principal products shift tensor",
    "rigidbody3d.integration": "Trajectory integrate",
    "rigidbody3d.momentum": "Motion Wrench",
    "rigidbody3d.parts": "read_parts",
    "rigidbody3d.percussion": "strike",
    "rigidbody3d.robots.inertias": "check_robot_inertias link_body",
    "rigidbody3d.robots.reading": "read_robot",
    "rigidbody3d.shaft": "Shaft",
    "rigidbody3d.shapes": "SHAPES inertia_of load_mesh measure_of mesh",
    "rigidbody3d.top": "Top TopState",
}

__getattr__, __dir__ = on_use(globals(), _HOMES)

__all__ = [
    "SHAPES",
    "Body",
    "FreeBody",
    "FreeState",
    "Motion",
    "Robot",
    "Shaft",
    "Top",
    "TopState",
    "Trajectory",
    "Wrench",
    "check",
    "check_robot_inertias",
    "compose",
    "cones",
    "from_scipy",
    "gyroscopic_couple",
    "inertia_of",
    "integrate",
    "link_body",
    "load_mesh",
    "measure_of",
    "mesh",
    "principal",
    "products",
    "read_parts",
    "read_robot",
    "shift",
    "sleeping_threshold",
    "steady_precession",
    "strike",
    "tensor",
    "to_scipy",
]
