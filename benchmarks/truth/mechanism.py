"""A planar mechanism in 50 digits, by another way than the library's: the truth for its campaigns.

Every link has three coordinates (θ, x, y), every joint its equations; Newton closes them from a pose in doubles, the
power series in time of all coordinates follow order by order from the same Jacobian, and the multipliers of the same
equations, under the loads of d'Alembert, are the joint forces and the drive's effort.
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
    from virtualwork import Guide, TorsionSpring
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


class Exact:
    """One pose of a mechanism in 50 digits, with its rates and forces; `closed` says whether Newton found it.

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

    def loads(self) -> list[tuple[str, complex, Any, Any]]:
        """(body, point, force, torque) of weights, inertia, forces, torques and springs; a motor is a mass on its carrier."""
        m = self.m
        found: list[tuple[str, complex, Any, Any]] = []
        masses = [(name, link.mass, link.center) for name, link in m.links.items()]
        masses += [(motor.carrier, motor.mass, motor.center) for motor in m.motors]
        for name, mass, center in masses:
            if mass:
                force = mp.mpf(mass) * (mp.mpc(m.gravity) - self.point(name, center, 2))
                found.append((name, center, force, mp.mpf(0)))
        for name, link in m.links.items():
            if link.inertia:
                found.append((name, 0j, mp.mpc(0), -mp.mpf(link.inertia) * self.angle(name, 2)))
        for f in m.forces:
            value = mp.mpc(f.force)
            turned = value * self.turn(f.link, 0)[0] if f.frame == "link" else value
            found.append((f.link, m.place(f.link, f.point), turned, mp.mpf(0)))
        found += [(t.link, 0j, mp.mpc(0), mp.mpf(t.torque)) for t in m.torques]
        for s in m.springs:
            (a, za), (b, zb) = ((body, m.place(body, point)) for body, point in s.between)
            d, v = (self.point(b, zb, k) - self.point(a, za, k) for k in (0, 1))
            length = abs(d)
            pull = mp.mpf(s.stiffness) * (1 - mp.mpf(s.free_length) / length) * d
            pull += mp.mpf(s.damping) * mp.re(mp.conj(d) * v) / length**2 * d
            found += [(a, za, pull, mp.mpf(0)), (b, zb, -pull, mp.mpf(0))]
        for ts in m.torsion_springs:
            angle, rate = (self.angle(ts.links[1], k) - self.angle(ts.links[0], k) for k in (0, 1))
            twist = angle - mp.mpf(ts.free_angle) - 2 * mp.pi * self._turns(ts, angle)
            torque = mp.mpf(ts.stiffness) * twist + mp.mpf(ts.damping) * rate
            found += [(ts.links[0], 0j, mp.mpc(0), torque), (ts.links[1], 0j, mp.mpc(0), -torque)]
        return [load for load in found if load[0] != GROUND]

    def _turns(self, spring: TorsionSpring, angle: Any) -> Any:
        """The whole turns that a spring's angle counts too many, less than half a turn from the guess."""
        guess = [0.0 if link == GROUND else self.m.guess.angles.get(link) for link in spring.links]
        if None in guess:
            return 0
        drawn = mp.mpf(guess[1]) - mp.mpf(guess[0])
        off = mp.nint((drawn - mp.mpf(spring.free_angle)) / (2 * mp.pi)) - spring.turns
        return off + mp.nint((angle - drawn) / (2 * mp.pi))

    def _rack_guide(self, i: int) -> Guide:
        return self.m.guides[self.m.guide_at(self.m.racks[i].slider)]

    def _at_pitch_point(self, i: int, row: dict[int, Any]) -> None:
        """Let the tooth force act where the teeth meet: at the pitch point, on the rack's body and on the wheel."""
        rack, g = self.m.racks[i], self._rack_guide(i)
        rail = along(g.angle) * self.turn(g.on, 0)[0]
        if rack.gear == g.link:
            wheel = self.series(rack.gear, self.m.bodies[rack.gear][g.point], 0)[0]
            touch, bodies = wheel + 1j * mp.mpf(rack.radius) * rail, ((g.link, 1), (g.on, -1))
        else:
            pin = next((p for p in self.m.bodies[rack.gear] if p in self.m.bodies[g.on]), None)
            if pin is None:
                return
            wheel = self.series(rack.gear, self.m.bodies[rack.gear][pin], 0)[0]
            touch, bodies = wheel - 1j * mp.mpf(rack.radius) * rail, ((g.link, 1), (rack.gear, -1))
        # in a slot the link may turn: a block of no mass takes the teeth, pinned to the link, and its guide the moment
        seat = (
            touch
            if g.is_slider or rack.gear == g.link
            else self.series(g.link, self.m.bodies[g.link][g.point], 0)[0]
        )
        row.clear()
        if g.on != GROUND:
            row[3 * self.links.index(g.on)] = mp.im(mp.conj(touch - seat) * rail)
        for body, sign in bodies:
            if body != GROUND:
                c = 3 * self.links.index(body)
                arm = (seat if body == g.link else touch) - self.origin[body][0]
                row[c] = row.get(c, mp.mpf(0)) + sign * mp.im(mp.conj(arm) * rail)
                row[c + 1] = row.get(c + 1, mp.mpf(0)) + sign * mp.re(rail)
                row[c + 2] = row.get(c + 2, mp.mpf(0)) + sign * mp.im(rail)

    def generalized_loads(self, loads: list[tuple[str, complex, Any, Any]] | None = None) -> list[Any]:
        """The work of the loads, or of some, for each coordinate: θ, x, y of every link."""
        q = [mp.mpf(0)] * (3 * len(self.links))
        for body, z, force, torque in self.loads() if loads is None else loads:
            c = 3 * self.links.index(body)
            arm = mp.mpc(z) * mp.expj(self.theta[body][0])
            q[c] += torque + mp.im(mp.conj(arm) * force)
            q[c + 1] += mp.re(force)
            q[c + 2] += mp.im(force)
        return q

    def forces(self) -> dict[tuple[str, str, int], Any]:
        """The multipliers by label: ("pin:B", body, 0 or 1) the components on that body, ("input", "0", 0) the effort.

        NaN where friction does not settle.
        """
        with mp.workdps(DIGITS):
            rows = [row for _, row in self._equations(0)]
            for (kind, which, _), row in zip(self.labels, rows, strict=True):
                if kind == "input":  # a motor on a link reacts there, not on what its angle is counted from
                    for motor in self.m.motors:
                        if motor.drives == self.m.inputs[int(which)].link:
                            c = 3 * self.links.index(motor.carrier)
                            row[c] = row.get(c, mp.mpf(0)) - 1
            for i in range(len(self.m.racks)):
                self._at_pitch_point(i, rows[self.labels.index((f"rack:{i}", self._rack_guide(i).link, 0))])
            self._factor(rows)
            free = self._solve_transposed([-v for v in self.generalized_loads()])
            contacts = self._contacts()
            per = [self._solve_transposed([-v for v in self.generalized_loads(of)]) for of, _, _ in contacts]
            friction = self._settled(contacts, free, per)
            borne = [
                f + sum(x * own[i] for x, own in zip(friction, per, strict=True)) for i, f in enumerate(free)
            ]
            return dict(zip(self.labels, borne, strict=True))

    def _contacts(self) -> list[tuple[list[tuple[str, complex, Any, Any]], list[int], Any]]:
        """Of each contact that rubs: a unit of its friction as loads, the labels of what it bears, −μ or −μ r by its sense."""
        m = self.m
        result = []
        turning = max(abs(self.angle(link, 1)) for link in self.links)
        moving = max([turning * mp.mpf(m.size), *(abs(self.slide(i, 1)) for i in range(len(m.guides)))])
        for rub in m.friction:
            bodies = m.pins.get(rub.joint)
            if bodies is not None:
                first, other = bodies
                loads = [(other, 0j, mp.mpc(0), mp.mpf(1)), (first, 0j, mp.mpc(0), mp.mpf(-1))]
                rate = self.angle(other, 1) - self.angle(first, 1)
                bears = [self.labels.index((f"pin:{rub.joint}", other, part)) for part in (0, 1)]
                arm, fastest = mp.mpf(rub.coefficient) * mp.mpf(rub.radius), turning
            else:
                i = m.guide_at(rub.joint)
                g = m.guides[i]
                z = m.links[g.link].points[g.point]
                rail = along(g.angle) * self.turn(g.on, 0)[0]
                there = (self.point(g.link, z, 0) - self.origin[g.on][0]) / self.turn(g.on, 0)[0]
                loads = [(g.link, z, rail, mp.mpf(0)), (g.on, there, -rail, mp.mpf(0))]
                rate, arm, fastest = self.slide(i, 1), mp.mpf(rub.coefficient), moving
                bears = [self.labels.index((f"guide:{i}", g.link, 1))]
            # parts that do not move against each other do not rub: beside a limit their rate is rounding of large ones
            sense = mp.sign(rate) if abs(rate) > mp.mpf(10) ** (20 - DIGITS) * fastest else 0
            result.append(([load for load in loads if load[0] != GROUND], bears, -arm * sense))
        return result

    def _settled(self, contacts: list[Any], free: list[Any], per: list[list[Any]]) -> list[Any]:
        """The friction of each contact, exchanged for what the contacts bear from none on until the two fit."""
        friction = [mp.mpf(0)] * len(contacts)
        for _ in range(1000 if contacts else 0):
            new = []
            for _, bears, arm in contacts:
                parts = [
                    free[i] + sum(x * own[i] for x, own in zip(friction, per, strict=True)) for i in bears
                ]
                new.append(arm * mp.hypot(*parts, *[0] * (2 - len(parts))))
            change = max(abs(x - y) for x, y in zip(new, friction, strict=True))
            friction = new
            if change <= mp.mpf(10) ** (5 - DIGITS) * max(map(abs, friction)):
                return friction
        return [mp.nan] * len(contacts) if contacts else []
