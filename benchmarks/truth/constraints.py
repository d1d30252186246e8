"""The places and rates of a planar mechanism in 50 digits, by another way than the library's.

Every link has three coordinates (θ, x, y), every joint its equations; Newton closes them from a pose in doubles, and the
power series in time of all coordinates follow order by order from the same Jacobian.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import mpmath as mp
import numpy as np

from dalembert.arithmetic.varied import direction
from virtualwork import GROUND
from virtualwork.branch.assembly import Assembly

if TYPE_CHECKING:
    from virtualwork import Guide
    from virtualwork.describe.description import Description
    from virtualwork.motion import Motion

DIGITS = 50
Series = list[Any]  # Taylor coefficients in time


def along(angle: float) -> Any:
    """The direction of a guide: what stands at a quarter turn is exactly there."""
    d = direction(angle)
    return mp.mpc(d) if d in (1, -1, 1j, -1j) else mp.expj(mp.mpf(angle))


def ratio(part: Any) -> Any:
    """The ratio of a gear, or of a belt by its radii."""
    if not hasattr(part, "radii"):
        return mp.mpf(part.ratio)
    return mp.mpf(part.radii[0]) / mp.mpf(part.radii[1]) * (-1 if part.crossed else 1)


class Constraints:
    """One pose of a mechanism in 50 digits, with its rates; `closed` says whether Newton found it.

    Parameters
    ----------
    motion : Motion
        In doubles: the start of Newton, and the rates of its inputs.
    i : int
        The pose.
    order : int
        Of the highest time derivative.
    inputs : sequence of mpf, optional
        The inputs, where a double is not exactly what is meant.
    constants : sequence of mpf, optional
        Those of gears and belts, then of racks, where their guess fixes them by way of loops.
    """

    def __init__(
        self,
        motion: Motion,
        i: int = 0,
        order: int = 2,
        inputs: Series | None = None,
        constants: Series | None = None,
    ) -> None:
        self.motion, self.i = motion, i
        self.m: Description = motion.mechanism
        self.order = order
        self.constants = constants
        self.links = list(self.m.links)
        with mp.workdps(DIGITS):
            self._start(motion, i, inputs)
            self.closed = self._close()
            if self.closed:
                for k in range(1, order + 1):
                    right = [-row[k] for row, _ in self._equations(k)]
                    self._set(self._solve(right), k)

    # --- coordinates ----------------------------------------------------------------------------------------------
    def _start(self, motion: Motion, i: int, inputs: Series | None) -> None:
        rates = [[np.broadcast_to(r, motion.n)[i] for r in of] for of in motion.poses.rates]
        self.drive: list[Series] = []
        for j, _ in enumerate(self.m.inputs):
            series = [mp.mpf(float(motion.inputs[i, j])) if inputs is None else inputs[j]]
            series += [mp.mpf(float(rates[k - 1][j])) / math.factorial(k) for k in range(1, 4)]
            self.drive.append(series[: self.order + 1])
        self.theta: dict[str, Series] = {GROUND: [mp.mpf(0)] * (self.order + 1)}
        self.origin: dict[str, Series] = {GROUND: [mp.mpc(0)] * (self.order + 1)}
        zero = [mp.mpf(0)] * self.order
        for link in self.links:
            self.theta[link] = [mp.mpf(float(motion.link(link).angle[i])), *zero]
            self.origin[link] = [mp.mpc(complex(motion.at(link, 0j).complex(0)[i])), *zero]
        for j, entry in enumerate(self.m.inputs):
            if entry.link is not None and self.constants is None:
                self.theta[entry.link][0] = self.theta[entry.on][0] + self.drive[j][0]
            elif entry.link is not None:
                # in the turn of the answers
                here = self.theta[entry.link][0] - self.theta[entry.on][0]
                self.drive[j][0] += 2 * mp.pi * mp.nint((here - self.drive[j][0]) / (2 * mp.pi))
        self.turned = [self._whole(g) for g in self.m.guides]
        # where a relation does not hang on inputs alone: the double that the motion takes from the guess
        self.seat: Any = Assembly.from_guess(self.m).phases if self.constants is None else self.constants
        self.toothed: list[Any] = [*self.m.gears, *self.m.belts]
        self.phase = (
            [self._phase(i, part) for i, part in enumerate(self.toothed)]
            if self.constants is None
            else self.constants[: len(self.toothed)]
        )

    def _whole(self, g: Guide) -> Any:
        """The angle of a slider's link to its guide's, in the turn of the start."""
        if g.turned is None:
            return mp.mpf(0)
        given = mp.arg(along(g.angle)) + mp.mpf(g.turned)
        here = self.theta[g.link][0] - self.theta[g.on][0]
        return given + 2 * mp.pi * mp.nint((here - given) / (2 * mp.pi))

    def _phase(self, i: int, gear: Any) -> Any:
        """θ_b − r θ_a + (r − 1) θ_arm at the guess."""
        a, b = gear.links
        at = {GROUND: mp.mpf(0)}
        for e, q in zip(self.m.inputs, self.m.at, strict=True):
            if e.link is not None and e.on == GROUND:
                at[e.link] = mp.mpf(float(q))
        if not {a, gear.arm} <= at.keys():
            return mp.mpf(self.seat[i])
        r = ratio(gear)
        guess = self.m.guess.angles
        phase = mp.mpf(guess.get(b, 0.0)) - r * at[a] + (r - 1) * at[gear.arm]
        self.theta[b][0] = phase + r * self.theta[a][0] - (r - 1) * self.theta[gear.arm][0]
        return phase

    def _set(self, x: list[Any], k: int) -> None:
        for i, link in enumerate(self.links):
            self.theta[link][k] = x[3 * i]
            self.origin[link][k] = mp.mpc(x[3 * i + 1], x[3 * i + 2])

    def turn(self, body: str, order: int) -> Series:
        """E^{iθ} as a series."""
        theta = self.theta[body]
        e = [mp.expj(theta[0])]
        for k in range(1, order + 1):
            e.append(mp.mpc(0, 1) * sum(j * theta[j] * e[k - j] for j in range(1, k + 1)) / k)
        return e

    def series(self, body: str, z: complex, order: int | None = None) -> Series:
        """A point of a body as a series."""
        k = self.order if order is None else order
        at = mp.mpc(z)
        e = self.turn(body, k)
        return [self.origin[body][n] + at * e[n] for n in range(k + 1)]

    # --- equations ------------------------------------------------------------------------------------------------
    def _equations(self, order: int) -> list[tuple[Series, dict[int, Any]]]:
        """Every joint's equation: its series up to an order, and its row of the Jacobian."""
        m = self.m
        found: list[tuple[Series, dict[int, Any]]] = []
        self.labels: list[tuple[str, str, int]] = []

        def both(label: tuple[str, str], value: Series, row: dict[int, Any]) -> None:
            for part, take in enumerate((mp.re, mp.im)):
                found.append(([take(v) for v in value], {c: take(v) for c, v in row.items()}))
                self.labels.append((*label, part))

        def point(row: dict[int, Any], body: str, z: complex, factor: Any) -> None:
            if body != GROUND:
                c = 3 * self.links.index(body)
                lever = mp.mpc(0, 1) * mp.mpc(z) * mp.expj(self.theta[body][0])
                for n, v in enumerate((lever, mp.mpc(1), mp.mpc(0, 1))):
                    row[c + n] = row.get(c + n, mp.mpc(0)) + factor * v

        def angles(label: tuple[str, str], parts: list[tuple[str, Any]], const: Series) -> None:
            value = [-c for c in const[: order + 1]] + [mp.mpf(0)] * (order + 1 - len(const))
            row: dict[int, Any] = {}
            for body, f in parts:
                value = [v + f * t for v, t in zip(value, self.theta[body], strict=False)]
                if body != GROUND:
                    c = 3 * self.links.index(body)
                    row[c] = row.get(c, mp.mpf(0)) + f
            found.append((value, row))
            self.labels.append((*label, 0))

        for pin, bodies in m.pins.items():
            first = bodies[0]
            for other in bodies[1:]:
                value = [
                    p - q
                    for p, q in zip(
                        self.series(other, m.bodies[other][pin], order),
                        self.series(first, m.bodies[first][pin], order),
                        strict=True,
                    )
                ]
                row: dict[int, Any] = {}
                point(row, other, m.bodies[other][pin], mp.mpc(1))
                point(row, first, m.bodies[first][pin], mp.mpc(-1))
                both((f"pin:{pin}", other), value, row)
        driven = {e.slider: j for j, e in enumerate(m.inputs) if e.is_slide}
        for i, g in enumerate(m.guides):
            rel, row = self._along(g, order, point)
            found.append(([mp.im(v) for v in rel], {c: mp.im(v) for c, v in row.items()}))
            self.labels.append((f"guide:{i}", g.link, 1))
            if g.point in driven:
                drive = self.drive[driven[g.point]]
                value = [mp.re(v) - d for v, d in zip(rel, drive, strict=False)]
                found.append((value, {c: mp.re(v) for c, v in row.items()}))
                self.labels.append(("input", str(driven[g.point]), 0))
            if g.is_slider:
                angles((f"moment:{i}", g.link), [(g.link, 1), (g.on, -1)], [self.turned[i]])
        for i, gear in enumerate(self.toothed):
            a, b = gear.links
            r = ratio(gear)
            angles((f"gear:{i}", b), [(b, 1), (a, -r), (gear.arm, r - 1)], [self.phase[i]])
        for i, rack in enumerate(m.racks):
            g, r = m.guides[m.guide_at(rack.slider)], mp.mpf(rack.radius)
            rel, row = self._along(g, order, point)
            const = mp.mpf(self.seat[len(self.phase) + i])
            value = [mp.re(v) - (const if k == 0 else 0) for k, v in enumerate(rel)]
            row = {c: mp.re(v) for c, v in row.items()}
            for body, f in ((rack.gear, -r), (g.on, r)):
                value = [v + f * t for v, t in zip(value, self.theta[body], strict=False)]
                if body != GROUND:
                    c = 3 * self.links.index(body)
                    row[c] = row.get(c, mp.mpf(0)) + f
            found.append((value, row))
            self.labels.append((f"rack:{i}", g.link, 0))
        for j, entry in enumerate(m.inputs):
            if entry.link is not None:
                angles(("input", str(j)), [(entry.link, 1), (entry.on, -1)], self.drive[j])
        return found

    def _along(self, g: Guide, order: int, point: Any) -> tuple[Series, dict[int, Any]]:
        """The point from `through`, in axes along the guide, and its row."""
        exact = along(g.angle)
        through = self.m.bodies[g.on][g.through] if isinstance(g.through, str) else g.through
        z = self.m.links[g.link].points[g.point]
        apart = [
            p - q
            for p, q in zip(
                self.series(g.link, z, order), self.series(g.on, complex(through), order), strict=True
            )
        ]
        back = [mp.conj(exact * e) for e in self.turn(g.on, order)]
        rel = [sum(apart[j] * back[k - j] for j in range(k + 1)) for k in range(order + 1)]
        row: dict[int, Any] = {}
        point(row, g.link, z, back[0])
        point(row, g.on, complex(through), -back[0])
        if g.on != GROUND:
            c = 3 * self.links.index(g.on)
            row[c] = row.get(c, mp.mpc(0)) - mp.mpc(0, 1) * rel[0]
        return rel, row

    def slide(self, i: int, order: int) -> Any:
        """A guide's slide or its rate."""
        with mp.workdps(DIGITS):
            rel, _ = self._along(self.m.guides[i], order, lambda *_: None)
            return mp.re(rel[order]) * math.factorial(order)

    def _close(self) -> bool:
        """Newton on all equations, until the step is below the last digits; with the same Jacobian while that converges fast."""
        scale, before, fresh = mp.mpf(self.m.size), mp.inf, True
        for _ in range(60):
            rows = self._equations(0)
            if fresh:
                self._factor([row for _, row in rows])
            if self._lu is None:
                return False
            dx = self._solve([-value[0] for value, _ in rows])
            for i, link in enumerate(self.links):
                self.theta[link][0] += dx[3 * i]
                self.origin[link][0] += mp.mpc(dx[3 * i + 1], dx[3 * i + 2])
            step = max(abs(v) / (1 if i % 3 == 0 else scale) for i, v in enumerate(dx))
            if step < mp.mpf(10) ** (-DIGITS + 22):
                rows = self._equations(0)
                self._factor([row for _, row in rows])
                return self._lu is not None
            if not step < 10:
                return False
            fresh, before = step > before * mp.mpf(10) ** -8, step
        return False

    # --- Gauss ----------------------------------------------------------------------------------------------------
    def _factor(self, rows: list[dict[int, Any]]) -> None:
        n = 3 * len(self.links)
        a = [[mp.mpf(row.get(c, 0)) for c in range(n)] for row in rows]
        order = list(range(len(a)))
        size = [max((abs(v) for v in row), default=mp.mpf(0)) for row in a]
        self._lu: Any = None
        if len(a) != n:
            raise ValueError("redundant constraints: not for this engine")
        for k in range(n):
            p = max(range(k, n), key=lambda i: abs(a[i][k]) / size[i] if a[i][k] else 0)
            if a[p][k] == 0:
                return
            a[k], a[p] = a[p], a[k]
            order[k], order[p] = order[p], order[k]
            size[k], size[p] = size[p], size[k]
            for i in range(k + 1, n):
                if a[i][k] != 0:
                    f = a[i][k] / a[k][k]
                    a[i][k] = f
                    for c in range(k + 1, n):
                        if a[k][c] != 0:
                            a[i][c] -= f * a[k][c]
        self._lu = a, order

    def _solve(self, right: list[Any]) -> list[Any]:
        a, order = self._lu
        n = len(a)
        y = [right[p] for p in order]
        for i in range(n):
            y[i] -= sum(a[i][c] * y[c] for c in range(i) if a[i][c] != 0)
        for i in reversed(range(n)):
            y[i] = (y[i] - sum(a[i][c] * y[c] for c in range(i + 1, n) if a[i][c] != 0)) / a[i][i]
        return y

    def _solve_transposed(self, right: list[Any]) -> list[Any]:
        a, order = self._lu
        n = len(a)
        y = list(right)
        for i in range(n):
            y[i] = (y[i] - sum(a[c][i] * y[c] for c in range(i) if a[c][i] != 0)) / a[i][i]
        for i in reversed(range(n)):
            y[i] -= sum(a[c][i] * y[c] for c in range(i + 1, n) if a[c][i] != 0)
        out = [mp.mpf(0)] * n
        for i, p in enumerate(order):
            out[p] = y[i]
        return out

    # --- what is compared -----------------------------------------------------------------------------------------
    def point(self, body: str, z: complex, order: int) -> Any:
        """A point's position or time derivative."""
        with mp.workdps(DIGITS):
            return self.series(body, z)[order] * math.factorial(order)

    def angle(self, link: str, order: int) -> Any:
        """A link's angle, unwrapped from the start, or its time derivative."""
        with mp.workdps(DIGITS):
            return self.theta[link][order] * math.factorial(order)
