"""Planar linkages in redundant coordinates, the angles of all links, as they are written by hand for an integrator.

Every centre of mass and every loop is a chain Σ w_j e_j of vectors that turn with the links, e_j = exp(iφ_j). With
A = Zᴴ m Z of the centres' chains and B_ij = ē_i A_ij e_j, virtual work gives  (Re B + I) φ̈ − Im B φ̇² + Gᵀλ = Q,  and the
loops W e + c = 0, differentiated twice,  Re(iWe) φ̈ = Re(We φ̇²): the index is reduced from three to one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from virtualwork import Mechanism

Real = NDArray[np.float64]
# of the loops' errors, 1/s: how soon Baumgarte's terms take them away, in the falling four-bar
SOON = 20.0


@dataclass
class Spring:
    """Between a fixed point and the end of a chain."""

    fixed: complex
    start: complex
    chain: Any
    stiffness: float
    length: float


class Linkage:
    """The equations of one linkage; states are (φ, φ̇)."""

    def __init__(
        self,
        start: Any,
        centres: Any,
        masses: Any,
        inertias: Any,
        loops: Any,
        torque: Any,
        gravity: complex = 0j,
        spring: Spring | None = None,
        constants: Any = 0.0,
    ) -> None:
        z, m = np.array(centres, complex), np.array(masses)
        self.k, self.start = len(m), np.concatenate([start, np.zeros(len(m))])
        self.pairs, self.inertias = z.conj().T @ (m[:, None] * z), np.array(inertias)
        self.loops, self.constants = np.array(loops, complex), np.broadcast_to(constants, len(loops))
        self.weights, self.gravity = m @ z, gravity
        self.torque, self.spring = np.array(torque, float), spring
        self.diagonal = np.arange(self.k), np.arange(self.k)

    def forces(self, e: Any) -> Real:
        """Q."""
        found = self.torque
        if self.gravity:
            found = found + (np.conj(1j * e * self.weights) * self.gravity).real
        if self.spring is not None:
            s = self.spring
            reach = s.fixed - s.start - s.chain @ e
            length = abs(reach)
            force = s.stiffness * (length - s.length) / length * reach
            found = found + (np.conj(1j * e * s.chain) * force).real
        return found

    def system(self, y: Real) -> tuple[Real, Real, Real, Real]:
        """M, the right side without joint forces, G, and what Gφ̈ must be."""
        angle, speed = y[: self.k], y[self.k : 2 * self.k]
        e, square = np.exp(1j * angle), y[self.k : 2 * self.k] ** 2
        b = self.pairs * (e.conj()[:, None] * e)
        mass = b.real.copy()
        mass[self.diagonal] += self.inertias
        turned = self.loops * e
        jacobian = np.concatenate([-turned.imag, turned.real])
        quick = turned @ square
        gap = turned.sum(axis=1) + self.constants
        drift = SOON * (2 * jacobian @ speed + SOON * np.concatenate([gap.real, gap.imag]))
        return (
            mass,
            self.forces(e) + b.imag @ square,
            jacobian,
            np.concatenate([quick.real, quick.imag]) - drift,
        )

    def solved(self, y: Real) -> tuple[Real, Real]:
        """φ̈ and λ."""
        mass, right, jacobian, rate = self.system(y)
        n = len(jacobian)
        whole = np.block([[mass, jacobian.T], [jacobian, np.zeros((n, n))]])
        found = np.linalg.solve(whole, np.concatenate([right, rate]))
        return found[: self.k], found[self.k :]

    def rates(self, t: float, y: Any) -> Real:
        """(φ̇, φ̈): an ordinary differential equation."""
        return np.concatenate([y[self.k :], self.solved(y)[0]])

    def residual(self, t: float, y: Any, yp: Any, out: Any) -> None:
        """The same as a differential-algebraic one of index one in (φ, φ̇, λ)."""
        k = self.k
        mass, right, jacobian, rate = self.system(y)
        out[:k] = yp[:k] - y[k : 2 * k]
        out[k : 2 * k] = mass @ yp[k : 2 * k] + jacobian.T @ y[2 * k :] - right
        out[2 * k :] = jacobian @ yp[k : 2 * k] - rate


def andrews(m: Mechanism) -> Linkage:
    """Andrews' squeezing mechanism from its printed numbers; `m` says where its links stand at first.

    W. Schiehlen (ed.), Multibody Systems Handbook, Springer 1990.
    """
    pivots = {name: complex(z) for name, z in m.ground.items()}
    a, b, c = (pivots[name] for name in "ABC")
    centres = np.zeros((7, 7), complex)
    centres[[0, 2, 4, 6], [0, 2, 4, 6]] = 0.00092, 0.01874 + 0.01043j, 0.02308 + 0.00916j, 0.01228 - 0.00449j
    centres[1, [0, 1]] = 0.007, 0.0115
    centres[3, [2, 3]] = centres[5, [2, 5]] = 0.035, 0.01421
    loops = np.zeros((3, 7))
    loops[0, [0, 1, 2]] = 0.007, 0.028, -0.035
    loops[1, [2, 3, 4]] = loops[2, [2, 5, 6]] = 0.035, 0.02, -0.04
    chain = np.zeros(7, complex)
    chain[2] = 0.018 + 0.02j
    motion = m.motion([m.at[0]])
    return Linkage(
        [float(motion.link(f"K{i}").angle[0]) for i in range(1, 8)],
        centres,
        [0.04325, 0.00365, 0.02373, 0.00706, 0.0705, 0.00706, 0.05498],
        [2.194e-6, 4.41e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5],
        loops,
        [0.033, 0, 0, 0, 0, 0, 0],
        spring=Spring(c, b, chain, 4530.0, 0.07785),
        constants=[-b, b - a, b - a],
    )


def four_bar(m: Mechanism) -> Linkage:
    """The four-bar of `benchmarks.speed.in_time` that falls; `m` says where its links stand at first."""
    motion = m.motion([m.at[0]])
    return Linkage(
        [float(motion.link(name).angle[0]) for name in ("crank", "coupler", "rocker")],
        [[0.05, 0, 0], [0.1, 0.175, 0], [0, 0, 0.125]],
        [1.0, 2.0, 1.5],
        [0.1, 0.02, 0.008],
        [[0.1, 0.35, -0.25]],
        [0, 0, 0],
        gravity=-9.81j,
        constants=[-0.4],
    )


def exudyn_system(exu: Any, items: Any, m: Mechanism, end: float, steps: int) -> float:
    """The angle of the first input's link after EXUDYN's steps: rigid bodies in the plane, pins as constraints."""
    system = exu.SystemContainer().AddSystem()
    motion = m.motion([m.at[0]])
    gravity = complex(m.gravity)
    ends: dict[str, list[Any]] = {}
    ground, nodes = system.AddObject(items.ObjectGround()), {}

    def marked(body: Any, point: str, z: complex) -> None:
        ends.setdefault(point, []).append(
            system.AddMarker(items.MarkerBodyPosition(bodyNumber=body, localPosition=[z.real, z.imag, 0]))
        )

    for point, place in m.ground.items():
        marked(ground, point, complex(place))
    for name, link in m.links.items():
        angle, center = float(motion.link(name).angle[0]), complex(link.center)
        point, place = next(iter(link.points.items()))
        at = complex(motion.point(point).complex(0)[0]) + (center - place) * np.exp(1j * angle)
        nodes[name] = system.AddNode(items.NodeRigidBody2D(referenceCoordinates=[at.real, at.imag, angle]))
        body = system.AddObject(
            items.ObjectRigidBody2D(nodeNumber=nodes[name], mass=link.mass, inertia=link.inertia)
        )
        for point, place in link.points.items():
            marked(body, point, complex(place) - center)
        if gravity:
            marker = system.AddMarker(items.MarkerBodyMass(bodyNumber=body))
            system.AddLoad(
                items.LoadMassProportional(markerNumber=marker, loadVector=[gravity.real, gravity.imag, 0])
            )
        for torque in m.torques:
            if torque.link == name:
                marker = system.AddMarker(items.MarkerBodyRigid(bodyNumber=body))
                load = [0, 0, float(torque.torque)]
                system.AddLoad(items.LoadTorqueVector(markerNumber=marker, loadVector=load))
    for markers in ends.values():
        for other in markers[1:]:
            system.AddObject(items.ObjectJointRevolute2D(markerNumbers=[markers[0], other]))
    for spring in m.springs:
        system.AddObject(
            items.ObjectConnectorSpringDamper(
                markerNumbers=[ends[str(point)][0] for _, point in spring.between],
                stiffness=spring.stiffness,
                referenceLength=spring.free_length,
            )
        )
    system.Assemble()
    settings = exu.SimulationSettings()
    settings.solutionSettings.writeSolutionToFile = False
    by_time = settings.timeIntegration
    by_time.verboseMode, by_time.endTime, by_time.numberOfSteps = 0, end, steps
    by_time.newton.relativeTolerance, by_time.newton.absoluteTolerance = 1e-11, 1e-13
    by_time.generalizedAlpha.spectralRadius = 1
    by_time.generalizedAlpha.useIndex2Constraints = by_time.generalizedAlpha.useNewmark = True
    system.SolveDynamic(settings)
    turned = system.GetNodeOutput(nodes[str(m.inputs[0].link)], exu.OutputVariableType.Coordinates)[2]
    return m.at[0] + float(turned)
