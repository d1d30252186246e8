"""A flexible rotor by finite elements: what unbalances do to it, and its modes; a truth for balancing at several speeds.

Euler-Bernoulli elements of a round shaft, discs with their inertias, isotropic bearings, in complex coordinates x + iy and
slopes: M q̈ + (C − iΩG) q̇ + K q = Ω² u e^{iΩt} (M. Lalanne, G. Ferraris, Rotordynamics Prediction in Engineering, 2nd ed., ch. 4).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class Disc:
    """A disc at a node: mass, kg, and inertias about a diameter and the axis, kg·m²."""

    node: int
    mass: float
    diametral: float
    polar: float


@dataclass(frozen=True)
class Bearing:
    """A bearing at a node: stiffness, N/m, and damping, N·s/m, the same in all directions."""

    node: int
    stiffness: float
    damping: float


@dataclass(frozen=True)
class Rotor:
    """A shaft of round elements between nodes at z, m, with discs and bearings."""

    z: Real
    diameter: float
    discs: tuple[Disc, ...]
    bearings: tuple[Bearing, ...]
    modulus: float = 2.1e11
    density: float = 7850.0
    matrices: dict[str, Real] = field(default_factory=dict, compare=False)

    def __post_init__(self) -> None:
        """Assemble mass, stiffness, damping and gyroscopic matrix."""
        n = 2 * len(self.z)
        m, k, c, g = np.zeros((4, n, n))
        area, inertia = np.pi / 4 * self.diameter**2, np.pi / 64 * self.diameter**4
        for e, length in enumerate(np.diff(self.z)):
            at = slice(2 * e, 2 * e + 4)
            s = np.array([1, length, 1, length])
            stiff = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]])
            heavy = np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]])
            turn = np.array([[36, 3, -36, 3], [3, 4, -3, -1], [-36, -3, 36, -3], [3, -1, -3, 4]])
            scale = np.outer(s, s)
            k[at, at] += self.modulus * inertia / length**3 * stiff * scale
            of_slopes = self.density * inertia / (30 * length) * turn * scale
            m[at, at] += self.density * area * length / 420 * heavy * scale + of_slopes
            g[at, at] += 2 * of_slopes
        for disc in self.discs:
            i = 2 * disc.node
            m[i, i] += disc.mass
            m[i + 1, i + 1] += disc.diametral
            g[i + 1, i + 1] += disc.polar
        for bearing in self.bearings:
            i = 2 * bearing.node
            k[i, i] += bearing.stiffness
            c[i, i] += bearing.damping
        self.matrices.update(m=m, k=k, c=c, g=g)

    def response(self, speed: float, unbalances: dict[int, complex]) -> Complex:
        """Return the deflection of every node, m, at a speed, rad/s; unbalances kg·m by node."""
        of = self.matrices
        force = np.zeros(len(of["m"]), dtype=complex)
        for node, u in unbalances.items():
            force[2 * node] += speed**2 * u
        dynamic = of["k"] - speed**2 * of["m"] + 1j * speed * of["c"] + speed**2 * of["g"]
        return np.asarray(np.linalg.solve(dynamic, force)[::2], dtype=complex)

    def modes(self, count: int) -> tuple[Real, Real]:
        """Return the lowest natural frequencies at rest, rad/s, and the shapes (count, nodes), largest value 1."""
        lower = np.linalg.inv(np.linalg.cholesky(self.matrices["m"]))
        square, vectors = np.linalg.eigh(lower @ self.matrices["k"] @ lower.T)
        shapes = (lower.T @ vectors).T[:count, ::2]
        largest = shapes[np.arange(count), np.abs(shapes).argmax(axis=1)]
        return np.sqrt(square[:count]), shapes / largest[:, None]

    def influence(self, speed: float, planes: ArrayLike, probes: ArrayLike) -> Complex:
        """Return the deflection of the probes for one kg·m in each plane, (s, p), m."""
        columns = [self.response(speed, {int(node): 1.0})[np.asarray(probes)] for node in np.asarray(planes)]
        return np.stack(columns, axis=1)


def turbine() -> Rotor:
    """A shaft of 1.2 m with three discs in two bearings: criticals near 2 700 and 8 700 rpm."""
    z = np.linspace(0.0, 1.2, 25)
    discs = (Disc(8, 18.0, 0.08, 0.15), Disc(12, 22.0, 0.1, 0.19), Disc(17, 15.0, 0.06, 0.11))
    return Rotor(z, 0.06, discs, (Bearing(1, 2e7, 4e3), Bearing(23, 2e7, 4e3)))
