"""Pinned bars and blocks in time, by another way: every body's own coordinates, constraint forces as multipliers.

x, y and θ of each body, the joints as constraints, [M Jᵀ; J 0]·[a; λ] = [F; −J̇v], integrated by scipy's DOP853. λ are
the joint forces, on which Coulomb friction of the pins hangs: found by iteration at each state. Nothing is stabilised:
over some seconds at a tight tolerance the constraints drift by some 1e-11.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import solve_ivp

from virtualwork import Mechanism

Reals = NDArray[np.float64]


class Bodies:
    """A mechanism of bars pinned to each other and to the ground, and of blocks that slide along the ground's x.

    Gravity acts; friction in pins of two bodies.
    """

    def __init__(self, m: Mechanism) -> None:
        self.names = list(m.links)
        links = [m.links[name] for name in self.names]
        self.gravity = complex(m.gravity)
        self.center = [complex(link.center or 0) for link in links]
        self.mass = np.array([link.mass for link in links], dtype=float)
        self.inertia = np.array([link.inertia for link in links], dtype=float)
        rubs = {f.joint: f.coefficient * f.radius for f in m.friction}
        # (body or −1, its vector from the centre) twice, and μ r
        self.pins: list[tuple[int, complex, int, complex, float]] = []
        held: dict[str, list[tuple[int, complex]]] = {
            name: [(-1, complex(z))] for name, z in m.ground.items()
        }
        for i, link in enumerate(links):
            for name, z in link.points.items():
                held.setdefault(name, []).append((i, complex(z) - self.center[i]))
        for name, ends in held.items():
            for (a, u), (b, w) in pairwise(ends):
                self.pins.append((a, u, b, w, rubs.get(name, 0.0)))
        self.blocks = [
            (self.names.index(g.link), complex(links[self.names.index(g.link)].points[g.point]))
            for g in m.guides
        ]
        self.m = m

    def start(self, q: ArrayLike, v: ArrayLike) -> Reals:
        """All coordinates and speeds at inputs q that move with v."""
        motion = self.m.motion(np.atleast_2d(q), np.atleast_1d(v))
        places: list[float] = []
        speeds: list[float] = []
        for name, center in zip(self.names, self.center, strict=True):
            for order, of, turn in ((0, places, "angle"), (1, speeds, "omega")):
                z = complex(motion.at(name, center).complex(order)[0])
                of += [z.real, z.imag, float(getattr(motion.link(name), turn)[0])]
        return np.array([*places, *speeds])

    def _rates(self, _: float, y: Reals) -> Reals:
        n = 3 * len(self.names)
        x, v = y[:n], y[n:]
        jacobian = np.zeros((2 * len(self.pins) + 2 * len(self.blocks), n))
        bias = np.zeros(len(jacobian))
        for row, (a, u, b, w, _r) in enumerate(self.pins):
            for body, arm, sign in ((a, u, 1.0), (b, w, -1.0)):
                if body < 0:
                    continue
                turned = arm * complex(math.cos(x[3 * body + 2]), math.sin(x[3 * body + 2]))
                i, j = 2 * row, 3 * body
                jacobian[i, j] = jacobian[i + 1, j + 1] = sign
                jacobian[i, j + 2], jacobian[i + 1, j + 2] = -sign * turned.imag, sign * turned.real
                bias[i] -= sign * turned.real * v[j + 2] ** 2
                bias[i + 1] -= sign * turned.imag * v[j + 2] ** 2
        for row, (body, arm) in enumerate(self.blocks, len(self.pins)):
            i, j = 2 * row, 3 * body
            turned = arm * complex(math.cos(x[j + 2]), math.sin(x[j + 2]))
            jacobian[i, j + 1], jacobian[i, j + 2], jacobian[i + 1, j + 2] = 1.0, turned.real, 1.0
            bias[i] -= turned.imag * v[j + 2] ** 2
        size = n + len(jacobian)
        whole = np.zeros((size, size))
        whole[range(n), range(n)] = np.stack([self.mass, self.mass, self.inertia], axis=1).ravel()
        whole[:n, n:], whole[n:, :n] = jacobian.T, jacobian
        force = np.zeros(size)
        force[:n:3], force[1:n:3] = self.mass * self.gravity.real, self.mass * self.gravity.imag
        force[n:] = -bias
        inverse = np.linalg.inv(whole)
        found = inverse @ force
        rubbing = [(row, a, b, arm) for row, (a, _u, b, _w, arm) in enumerate(self.pins) if arm]
        for _round in range(200 if rubbing else 0):
            acting = force.copy()
            for row, a, b, arm in rubbing:
                slip = (v[3 * a + 2] if a >= 0 else 0.0) - (v[3 * b + 2] if b >= 0 else 0.0)
                torque = arm * math.hypot(found[n + 2 * row], found[n + 2 * row + 1]) * np.sign(slip)
                if a >= 0:
                    acting[3 * a + 2] -= torque
                if b >= 0:
                    acting[3 * b + 2] += torque
            before, found = found, inverse @ acting
            if np.abs(found - before).max() <= 1e-14 * np.abs(found).max():
                break
        return np.concatenate([v, found[:n]])

    def angles(self, q: ArrayLike, v: ArrayLike, times: Reals, tolerance: float = 1e-12) -> dict[str, Reals]:
        """Every link's angle at the times, rad, from inputs q and their speeds v at the first."""
        begin = self.start(q, v)
        found: Any = solve_ivp(
            self._rates, (times[0], times[-1]), begin, "DOP853", times, rtol=tolerance, atol=1e-3 * tolerance
        )
        return {name: found.y[3 * i + 2] for i, name in enumerate(self.names)}
