"""Planar robots: links and joints in space, laid into the plane in which they all move.

A link keeps the axes that the file gives it, turned into the plane; its angle of the guess is that of the file's own
configuration.
"""

from __future__ import annotations

import cmath
import math

import numpy as np

from dalembert.documents.robots import BLOCK, Motor, Robot, RobotJoint, RobotLink, Spring
from dalembert.errors import DataError
from virtualwork.describe.parts import Gear, Guide, Rack
from virtualwork.exchange.drawn import (
    GROUND,
    Body,
    Drawing,
    Drive,
    Groups,
    Load,
    pins_of,
    together,
    unused,
)
from virtualwork.exchange.plane import plane_of

# two ends of a joint nearer than this share of the robot's size are one place
SAME = 1e-6


class ImpossibleInertia(DataError):
    """A link whose inertia no body has; a check of the file's inertias names the likely mistake."""


def drawing(robot: Robot) -> Drawing:
    """Return a robot's drawing."""
    return _Layer(robot).drawing()


class _Layer:
    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.d = Drawing(name=robot.name, angle="rad", own_axes=True, notes=list(robot.notes))

    def drawing(self) -> Drawing:
        robot, d = self.robot, self.d
        self.fixed = Groups(robot.links)
        for j in robot.joints.values():
            if j.kind == "fixed":
                pair = j.parent, j.child
                # what is fixed to the ground is called as that
                first = self.fixed.of(j.child) == self.fixed.of(robot.ground)
                self.fixed.join(*(pair[::-1] if first else pair))
        moving = [
            j
            for j in robot.joints.values()
            if j.kind != "fixed" and self.fixed.of(j.parent) != self.fixed.of(j.child)
        ]
        if not moving:
            raise DataError(f"{robot.file}: nothing in it moves: no joint that turns or slides")
        self.plane = plane_of(robot.file, moving, d.notes)
        places = [self.plane.place(end) for j in moving for end in j.ends]
        places += [self.plane.place(link.pose[:3, 3]) for link in robot.links.values()]
        self.size = max(abs(a - places[0]) for a in places) or 1.0
        # significant digits after the point: the rest is rounding on the way through the tree
        self.digits = 15 - math.ceil(math.log10(self.size))
        self._groups()
        open_ = [j for j in robot.joints.values() if not self._closed(j)]
        d.posed = not any(j in moving for j in open_)
        turning = [
            (j.name, {name: self._place(z) for name, z in self._sides(j)})
            for j in moving
            if j.kind != "slide"
        ]
        self.pins = pins_of(turning, SAME * self.size, lambda new, earlier: min(new, earlier, key=len))
        for label, ends in self.pins:
            for name, z in sorted(ends.items()):
                d.bodies[name].points[label] = z
        for j in moving:
            if j.kind == "slide":
                self._slide(j)
        self.alike = self._turning_alike()
        self._slots()
        self._named_points()
        self._couplings()
        self._drives(moving)
        self._springs(moving)
        for what in dict.fromkeys(what for j in moving for what in j.more):
            names = ", ".join(j.name for j in moving if what in j.more)
            d.leave(f"{what} of {names}", "the joint moves without limits and friction")
        if robot.gravity is not None:
            g = self.plane.direction(robot.gravity)
            d.gravity = (g.real, g.imag) if abs(g) > 1e-12 * float(np.linalg.norm(robot.gravity)) else None
        return d

    # --- links ------------------------------------------------------------------------------------------------
    def _groups(self) -> None:
        robot, d = self.robot, self.d
        parts = {self.fixed.of(names[0]): names for names in self.fixed.all()}
        # the body of each group, by the link that the group is called as
        self.names = {self.fixed.of(robot.ground): GROUND}
        for name, link in robot.links.items():
            if name not in parts or name in self.names:
                continue
            at, turn = self.plane.place(link.pose[:3, 3]), self.plane.turn(link.pose[:3, :3])
            self.names[name] = unused(name, {GROUND})
            body = d.bodies[self.names[name]] = Body(at=at, turn=turn)
            self._masses(body, [robot.links[n] for n in parts[name]])

    def _masses(self, body: Body, links: list[RobotLink]) -> None:
        parts = []
        for link in links:
            held = link.inertial
            if held is None:
                continue
            world = link.pose @ held.pose
            n = self.plane.normal
            turned = world[:3, :3] @ held.tensor @ world[:3, :3].T
            z = body.inside(self.plane.place(world[:3, 3]))
            if held.mass < 0:
                raise DataError(
                    f"{self.robot.file}: link '{link.name}', mass: found {held.mass:g}, expected one of zero or more"
                )
            parts.append((held.mass, z, float(n @ turned @ n)))
        if not parts:
            return
        mass, center, inertia = together(parts)
        if inertia < 0:
            raise ImpossibleInertia(
                f"{self.robot.file}: link '{links[0].name}', inertia about the plane's normal: found {inertia:g}, "
                "expected zero or more"
            )
        body.mass, body.center, body.inertia = mass, self._place(center), inertia

    def _place(self, z: complex) -> complex:
        return complex(round(z.real, self.digits) + 0.0, round(z.imag, self.digits) + 0.0)

    def name(self, link: str) -> str:
        """Return what the body is called that a link is, or is a part of."""
        return self.names[self.fixed.of(link)]

    # --- joints -----------------------------------------------------------------------------------------------
    def _closed(self, j: RobotJoint) -> bool:
        a, b = (self.plane.place(end) for end in j.ends)
        gap = abs(b - a)
        if gap > SAME * self.size and j.kind != "slide":
            self.d.notes.append(f"joint {j.name} is {gap:.3g} m open as the file stands")
            return False
        return True

    def _sides(self, j: RobotJoint) -> list[tuple[str, complex]]:
        return [
            (name, self.d.bodies[name].inside(self.plane.place(end)))
            for name, end in zip((self.name(j.parent), self.name(j.child)), j.ends, strict=True)
        ]

    def _slide(self, j: RobotJoint) -> None:
        """Add a prism; its position is the joint's own coordinate."""
        (on, through), (link, z) = self._sides(j)
        sense = 1.0
        if self._carried_by_child(j):
            on, link, through, z, sense = link, on, z, through, -1.0
        a, b = self.d.bodies[on], self.d.bodies[link]
        angle = cmath.phase(self.plane.direction(j.axis) * sense) - a.turn
        start = self._place(through - j.value * cmath.rect(1.0, angle))
        at, held = self._place(z), self.d.bodies[link].points
        taken = {s.point for s in self.d.guides.values()}
        point = next((p for p, w in held.items() if w == at and p not in taken), None) or self.d.fresh(j.name)
        held[point] = at
        self.d.guides[j.name] = Guide(point, link, on, start, _turn(angle), _turn(b.turn - a.turn - angle))

    def _carried_by_child(self, j: RobotJoint) -> bool:
        """Return whether a slide's line is on the child, not the parent: on the ground, under a rack's wheel, away from its point."""
        pair = self.name(j.parent), self.name(j.child)
        if GROUND in pair:
            return pair[1] == GROUND
        joints, links = self.robot.joints, self.robot.links
        for _, terms in self.robot.couplings:
            others = [name for name, _ in terms if name != j.name]
            if len(terms) != 2 or len(others) != 1 or others[0] not in joints:
                continue
            wheel = joints[others[0]]
            shared = {*pair} & {self.name(wheel.parent), self.name(wheel.child)}
            if wheel.kind == "turn" and len(shared) == 1:
                return pair[1] in shared
        return j.name in links[j.parent].points and j.name not in links[j.child].points

    def _slots(self) -> None:
        """Make slots again of the blocks that `dalembert export` made of them, each with one slide and one pin."""
        d = self.d
        for name, s in d.guides.items():
            for block, carrier in ((s.link, s.on), (s.on, s.link)):
                pins = [label for label, ends in self.pins if block in ends]
                if not self._is_block(block) or len(pins) != 1:
                    continue
                riders = [n for n, body in d.bodies.items() if pins[0] in body.points and n != block]
                if len(riders) == 1 and riders[0] != carrier:
                    self._slot(name, block, carrier, riders[0], pins[0])
                    break

    def _is_block(self, name: str) -> bool:
        """Return whether a body has no use but in a slot: without mass, in one slide, with no gear or spring on it."""
        body, robot = self.d.bodies[name], self.robot
        guides = [s for s in self.d.guides.values() if name in (s.link, s.on)]
        others = [link for g in robot.gears for link in (*g.links, g.arm)]
        others += [link for spring in robot.springs for link, _ in spring.ends]
        return (
            name.startswith(BLOCK)
            and body.mass == body.inertia == 0
            and len(guides) == 1
            and name not in map(self.name, others)
        )

    def _slot(self, name: str, block: str, carrier: str, rider: str, pin: str) -> None:
        """Make a slot of a slide and a pin: the line goes through the pin, in the axes of the carrier."""
        d, s, value = self.d, self.d.guides[name], self.robot.joints[name].value
        frame, moved = d.bodies[carrier], d.bodies[block]
        # where the carrier moves along the block, the block moves against that along the carrier
        line = d.bodies[s.on].turn + s.angle + (0.0 if s.link == block else math.pi)
        start = moved.world(moved.points[pin]) - value * cmath.rect(1.0, line)
        # a point made for the slide alone goes with it
        if s.link == carrier and s.point not in {label for label, _ in self.pins}:
            frame.points.pop(s.point)
        del d.bodies[block]
        through, angle = self._place(frame.inside(start)), _turn(line - frame.turn)
        d.guides[name] = Guide(pin, rider, carrier, through, angle)

    def _named_points(self) -> None:
        """Add the named places of the file, and the origins of links without mass that are fixed to others."""
        robot, d = self.robot, self.d
        for name, link in robot.links.items():
            body = self.name(name)
            if body == GROUND or body not in d.bodies:
                continue
            named = {p: link.pose @ np.append(at, 1.0) for p, at in link.points.items()}
            if self.fixed.of(name) != name and link.inertial is None:
                named[name] = link.pose[:, 3]
            held = d.bodies[body].points
            for point, at in named.items():
                z = self._place(d.bodies[body].inside(self.plane.place(at[:3])))
                if point not in held and z not in held.values():
                    held[d.fresh(point)] = z

    # --- what ties and what drives ---------------------------------------------------------------------------
    def _turning_alike(self) -> Groups[str]:
        """Return the bodies that slides join, which turn alike. The ground stands for its own, blocks for none."""
        result = Groups([GROUND, *self.names.values()])
        for s in self.d.guides.values():
            pair = result.of(s.link), result.of(s.on)
            keep = min(pair, key=lambda name: (name != GROUND, name.startswith(BLOCK)))
            result.join(keep, *pair)
        return result

    def _shares(
        self, terms: list[tuple[str, float]], where: str, wanted: str = ""
    ) -> dict[str, float] | None:
        """Return Σ factor·(joint's coordinate) as a sum of the bodies' angles; None where it holds a slide.

        Of bodies that turn alike the `wanted` one is named, or one that the joints name; a block only where nothing else turns as it does.
        """
        result: dict[str, float] = {}
        names: dict[str, str] = {}
        for name, factor in terms:
            j = self.robot.joints.get(name)
            if j is None:
                raise DataError(f"{self.robot.file}: {where}: no joint is called '{name}'")
            if j.kind != "turn":
                return None
            sense = factor * self.plane.sense(j.axis)
            for link, c in ((j.child, sense), (j.parent, -sense)):
                body = self.name(link)
                top = self.alike.of(body)
                result[top] = result.get(top, 0.0) + c
                first = top not in names and body in self.d.bodies and not body.startswith(BLOCK)
                if body == wanted or first:
                    names[top] = body
        scale = max(map(abs, result.values()), default=0.0)
        return {
            GROUND if top == GROUND else names.get(top, top): c
            for top, c in result.items()
            if abs(c) > 1e-12 * scale
        }

    def _couplings(self) -> None:
        d = self.d
        for g in self.robot.gears:
            a, b = map(self.name, g.links)
            d.gears.append(Gear((a, b), g.ratio, self.name(g.arm)))
        for name, terms in self.robot.couplings:
            if self._rack(terms, name):
                continue
            shares = self._shares(terms, name)
            if shares is None or len(shares) not in (2, 3) or abs(sum(shares.values())) > 1e-9:
                d.leave(f"coupling {name}", "it is no gear of two bodies on an arm, and no rack")
                continue
            first = self.robot.joints[terms[0][0]]
            top = self.alike.of(self.name(first.parent))
            carriers = [body for body in shares if self.alike.of(body) == top]
            # any of the three may be called the arm
            arm = GROUND if GROUND in shares else (carriers or list(shares))[0]
            if len(shares) == 2:
                # two that turn alike: any other body may be the arm
                arm = next((body for body in d.bodies if body not in shares), GROUND)
            pair = [body for body in shares if body != arm]
            b, a = pair[:2]
            d.gears.append(Gear((a, b), -shares[a] / shares[b], arm))

    def _rack(self, terms: list[tuple[str, float]], where: str) -> bool:
        """Add a rack where one slide and the angle of a body against its guide stay in step."""
        guides = self.d.guides
        slides = [term for term in terms if term[0] in guides]
        turns = self._shares([term for term in terms if term[0] not in guides], where)
        if len(slides) != 1 or turns is None or len(turns) != 2 or abs(sum(turns.values())) > 1e-9:
            return False
        slider, factor = slides[0]
        carrier = self.alike.of(guides[slider].on)
        wheels = [body for body in turns if self.alike.of(body) != carrier]
        if len(wheels) != 1 or factor == 0:
            return False
        self.d.racks.append(Rack(wheels[0], slider, -turns[wheels[0]] / factor))
        return True

    def _springs(self, moving: list[RobotJoint]) -> None:
        """Add springs and dampers of joints and tendons; one on a slide alone has no equivalent."""
        robot, d = self.robot, self.d
        springs = [
            Spring(f"spring of joint {j.name}", [], [(j.name, 1.0)], j.stiffness, j.damping, j.rest)
            for j in moving
            if j.stiffness or j.damping
        ]
        for s in springs + robot.springs:
            values: dict[str, object] = {
                k: v for k, v in (("stiffness", s.stiffness), ("damping", s.damping)) if v
            }
            if s.ends:
                ends = []
                for link, at in s.ends:
                    place = self.plane.place((robot.links[link].pose @ np.append(at, 1.0))[:3])
                    ends.append((self.name(link), place))
                length = abs(ends[0][1] - ends[1][1])
                if s.stiffness:
                    values["free_length"] = length if s.rest is None else s.rest
                held: list[tuple[str, complex | None]] = [
                    (name, self._place(d.bodies[name].inside(z))) for name, z in ends
                ]
                d.loads.append(Load("springs", held, values))
                continue
            shares = self._shares(s.terms, s.name)
            pair = sorted(shares.items(), key=lambda e: e[1]) if shares else []
            if len(pair) != 2:
                d.leave(s.name, "it acts neither between two places nor between two links")
                continue
            (on, _), (link, c) = pair
            if s.stiffness:
                # from the sum of the joints' coordinates to the angle between the links
                here = sum(factor * robot.joints[name].value for name, factor in s.terms)
                free = 0.0 if s.rest is None else (s.rest - here) / c
                values["free_angle"] = d.bodies[link].turn - d.bodies[on].turn + free
            for key in ("stiffness", "damping"):
                if key in values:
                    values[key] = float(values[key]) * c * c  # type: ignore[arg-type]
            d.loads.append(Load("torsion_springs", [(on, None), (link, None)], values))

    def _drives(self, moving: list[RobotJoint]) -> None:
        d, robot = self.d, self.robot
        here = [j for j in moving if GROUND in (self.name(j.parent), self.name(j.child))]
        # what may drive it too, where the actuators of the file do not determine its motion
        ordered = [j for j in (*here, *(j for j in moving if j not in here)) if j.kind != "ball"]
        motors = list(robot.motors)
        if not motors:
            first = ordered[0] if ordered and ordered[0] in here else None
            if first is None:
                raise DataError(f"{robot.file}: nothing is driven: no actuator, and no joint on the ground")
            d.notes.append(f"the file has no actuator: {first.name} is taken as the input")
            motors = [Motor(first.name, [(first.name, 1.0)])]
        self.counted = Groups(d.bodies)
        for m in motors:
            drive = self._drive(m)
            if drive is None:
                d.leave(f"actuator {m.name}", "it drives neither one slide nor the angle between two links")
            elif all(drive.moves != e.moves for e in d.drives):
                d.drives.append(drive)
                self._count_turns(drive)
        spare = [self._drive(Motor(j.name, [(j.name, 1.0)])) for j in ordered]
        d.spare = [e for e in spare if e is not None]

    def _count_turns(self, drive: Drive) -> None:
        """Turn a body, and those that inputs before this one tie to it, by whole turns: gears and torsion springs count the input's."""
        if drive.link is None:
            return
        bodies, counted = self.d.bodies, self.counted
        whole = drive.at - bodies[drive.link].turn + bodies[drive.on].turn
        whole = 2 * math.pi * round(whole / (2 * math.pi))
        first, second, ground = map(counted.of, (drive.link, drive.on, GROUND))
        if first == second:
            # both are counted already
            drive.at -= whole
        moved, sense = (second, -1.0) if first == ground else (first, 1.0)
        for name in bodies if first != second else ():
            if counted.of(name) == moved:
                bodies[name].turn += sense * whole
        counted.join(first, second)

    def _drive(self, m: Motor) -> Drive | None:
        """Return the input that an actuator is; None where it is none."""
        d, robot = self.d, self.robot
        if len(m.terms) == 1 and m.terms[0][0] in d.guides:
            slider = m.terms[0][0]
            at = robot.joints[slider].value
            return Drive(slider=slider, at=at, speed=None if m.speed is None else f"{m.speed!r} m/s")
        shares = self._shares(m.terms, f"actuator {m.name}", m.name)
        if shares is None or len(shares) != 2:
            return None
        (link, c), (on, _) = sorted(shares.items(), key=lambda e: -e[1])
        sense = 1.0
        if link == GROUND:
            link, on, sense = on, link, -1.0
        turn = d.bodies[link].turn - d.bodies[on].turn
        # the coordinate of a joint may count whole turns; a sum of several begins anywhere
        name, factor = m.terms[0]
        value = sense * factor * robot.joints[name].value / c if len(m.terms) == 1 else 0.0
        at = turn + 2 * math.pi * round((value - turn) / (2 * math.pi)) if value else turn
        return Drive(link, on, at=at, speed=None if m.speed is None else f"{sense * m.speed / c!r} rad/s")


def _turn(angle: float) -> float:
    """Return an angle in (−π, π]; what is zero but for rounding is zero."""
    a = math.remainder(angle, 2 * math.pi)
    return 0.0 if abs(a) < 1e-15 else a
