"""The forces of a planar mechanism in 50 digits, by another way than the library's: the truth for its campaigns.

The multipliers of the equations of all joints (`constraints`), under the loads of d'Alembert, are the joint forces and the
drive's effort.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

import mpmath as mp
import numpy as np

from benchmarks.truth.constraints import DIGITS, Constraints, along
from virtualwork import GROUND

if TYPE_CHECKING:
    from virtualwork import Guide, Mechanism, TorsionSpring

# poses on the way from the guess, on which the turns of torsion springs are counted
WAY = 400


class Exact(Constraints):
    """One pose of a mechanism in 50 digits, with its rates and forces; as `Constraints`."""

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
            twist = angle - mp.mpf(ts.free_angle) - 2 * mp.pi * self.whole_turns(ts, angle)
            torque = mp.mpf(ts.stiffness) * twist + mp.mpf(ts.damping) * rate
            found += [(ts.links[0], 0j, mp.mpc(0), torque), (ts.links[1], 0j, mp.mpc(0), -torque)]
        return [load for load in found if load[0] != GROUND]

    def whole_turns(self, spring: TorsionSpring, angle: Any) -> Any:
        """The whole turns that a spring's angle counts too many: on the straight way of the inputs from the guess it is followed."""
        guess = [0.0 if link == GROUND else self.m.guess.angles.get(link) for link in spring.links]
        if None in guess:
            return 0
        drawn = mp.mpf(guess[1]) - mp.mpf(guess[0])
        off = mp.nint((drawn - mp.mpf(spring.free_angle)) / (2 * mp.pi)) - spring.turns
        return off + mp.nint((angle - drawn - self._wound(spring)) / (2 * mp.pi))

    def _wound(self, spring: TorsionSpring) -> Any:
        """By how much the twist of a spring grows from the guess to the pose, in doubles; 0 where the way is not closed."""
        home, there = np.array(self.m.at), self.motion.inputs[self.i]
        # closer at both ends, where a limit may be
        shares = (1 - np.cos(np.linspace(0, np.pi, WAY))) / 2
        way = cast("Mechanism", self.m).motion(home + shares[:, None] * (there - home))
        first, second = (np.zeros(WAY) if x == GROUND else way.link(x).angle for x in spring.links)
        twist = np.unwrap(second - first)
        return mp.mpf(float(twist[-1] - twist[0])) if way.assembled.all() else mp.mpf(0)

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
