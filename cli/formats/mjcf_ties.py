"""What ties and drives the bodies of MJCF: equalities that close loops and couple joints, tendons, actuators."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from xml.etree.ElementTree import Element

import numpy as np

from cli.formats import markup as xml
from cli.formats.mjcf_bodies import Defaults
from cli.formats.robot import WORLD, Array, Kind, Motor, Robot, RobotJoint, Spring, pose, rotation
from dalembert.errors import DataError

# a sine: what decimals of an orientation are off by
TURNED = 1e-6


class Ties:
    """Reads them into a robot whose bodies are read; `sites` are its named places, each a link and the pose in it."""

    def __init__(
        self, robot: Robot, root: Element, defaults: Defaults, sites: Mapping[str, tuple[str, Array]]
    ) -> None:
        self.robot, self.file, self.root = robot, robot.file, root
        self.defaults, self.sites = defaults, sites
        # those that close loops
        self.closing: set[str] = set()

    def read(self) -> None:
        """Read all of them."""
        self._equalities()
        self._tendons()
        self._actuators()

    def _every(self, section: str) -> Iterator[tuple[int, Element]]:
        """Yield the elements of all sections of a name, with their numbers there."""
        for part in xml.children(self.root, section):
            yield from enumerate(part, 1)

    # --- what closes loops ----------------------------------------------------------------------------------
    def _equalities(self) -> None:
        robot = self.robot
        for k, e in self._every("equality"):
            values = self.defaults.whole(e, kind="equality")
            name = values.get("name") or f"{e.tag} {k}"
            where = f"equality '{name}'"
            at = xml.At(self.file, where)
            if values.get("active") == "false":
                robot.notes.append(f"{where}: left out: it is not active")
            elif e.tag in ("connect", "weld"):
                self._connect(e.tag, name, at, values)
            elif e.tag == "joint":
                stated = at.numbers("polycoef", values.get("polycoef", ""))
                offset, factor, *powers = [*stated, *(0.0, 1.0, 0.0, 0.0, 0.0)[len(stated) :]]
                if any(powers):
                    robot.notes.append(f"{where}: left out: its polynomial is not a straight line")
                    continue
                first = xml.named(self.file, e, "joint1")
                robot.couple(name, first, values.get("joint2", ""), factor, offset, where)
            elif e.tag == "tendon" and "tendon2" not in values:
                robot.couplings.append((name, self._fixed(xml.named(self.file, e, "tendon1"), at)))
                robot.note_offset(where, *at.numbers("polycoef", values.get("polycoef", ""))[:1])
            else:
                robot.notes.append(f"{where}: left out: <{e.tag}> has no equivalent")

    def _connect(self, tag: str, name: str, at: xml.At, values: dict[str, str]) -> None:
        """Pin or weld two bodies: where a weld holds no angle, it is a pin too."""
        robot = self.robot
        if "site1" in values or "site2" in values:
            (a, one), (b, other) = (self._side(values.get(key), at) for key in ("site1", "site2"))
        else:
            a, b = values.get("body1", ""), values.get("body2") or WORLD
            first, second = (robot.link(body, at.where).pose for body in (a, b))
            anchor = pose(at.numbers("anchor", values.get("anchor"), 3, (0.0, 0.0, 0.0)))
            # at the file's own configuration the place is the same on both
            one = other = first @ anchor if tag == "connect" else second @ anchor
            stated = at.numbers("relpose", values.get("relpose"), 7, (0.0,) * 7)
            if tag == "weld" and any(stated[3:]):
                one = first @ pose(stated[:3], rotation(at.inside("relpose"), stated[3:])) @ anchor
        kind: Kind = "ball"
        if tag == "weld" and at.number("torquescale", values.get("torquescale", "1")) != 0:
            kind = "fixed"
            apart = one[:3, :3].T @ other[:3, :3]
            off = float(np.linalg.norm(apart - apart.T) / np.sqrt(8))
            if off > TURNED:
                robot.notes.append(
                    f"{at.where}: as the file stands its bodies are turned by a sine of {off:.3g} out of it: fixed as they stand"
                )
        robot.join(RobotJoint(name, kind, a, b, (one[:3, 3], other[:3, 3]), np.zeros(3)))

    def _side(self, site: str | None, at: xml.At) -> tuple[str, Array]:
        """Return the body of a site that closes a loop, and its pose."""
        if site is None or site not in self.sites:
            raise DataError(f"{at.file}: {at.where}: no site is called '{site}'")
        self.closing.add(site)
        link, inside = self.sites[site]
        return link, self.robot.links[link].pose @ inside

    def _fixed(self, name: str, at: xml.At) -> list[tuple[str, float]]:
        """Return the terms of a fixed tendon by its name."""
        for _, e in self._every("tendon"):
            if e.tag == "fixed" and e.get("name") == name:
                return self._terms(e, xml.At(self.file, f"tendon '{name}'"))
        raise DataError(f"{self.file}: {at.where}: no fixed tendon is called '{name}'")

    def _terms(self, e: Element, at: xml.At) -> list[tuple[str, float]]:
        joints = xml.children(e, "joint")
        return [(xml.named(self.file, j, "joint"), at.number("", j.get("coef"))) for j in joints]

    def _tendons(self) -> None:
        for k, e in self._every("tendon"):
            self._spring(e, xml.At(self.file, f"tendon '{e.get('name') or k}'"))
        for name, (link, at) in self.sites.items():
            if name not in self.closing:
                self.robot.links[link].points[name] = at[:3, 3]

    def _spring(self, e: Element, at: xml.At) -> None:
        """Read a tendon that pulls: between two sites, or on joints."""
        values = self.defaults.whole(e, kind="tendon")
        lost = xml.stated([values.get("range")], values.get("frictionloss"))
        if lost:
            self.robot.notes.append(f"{at.where}: its {' and '.join(lost)} are left out")
        stiffness, damping = leading(at, values, "stiffness", "damping")
        if not (stiffness or damping):
            return
        text = values.get("springlength", "-1")
        rest = at.numbers("springlength", text)
        if not 1 <= len(rest) <= 2:
            raise at.error("springlength", text, "1 or 2 numbers")
        ends, terms = [], []
        if e.tag == "fixed":
            terms = self._terms(e, at)
        else:
            sites = [s.get("site", "") for s in e]
            if len(sites) != 2 or not all(s in self.sites for s in sites):
                self.robot.notes.append(f"{at.where}: left out: it does not run straight between two sites")
                return
            ends = [(link, place[:3, 3]) for link, place in map(self.sites.__getitem__, sites)]
        if len(rest) > 1 and rest[0] != rest[-1]:
            self.robot.notes.append(
                f"{at.where}: it is slack from {rest[0]:g} to {rest[-1]:g}: the first length is used"
            )
        open_ = "springlength" not in values or (rest[0] == -1.0 and not terms)
        self.robot.springs.append(
            Spring(at.where, ends, terms, stiffness, damping, None if open_ else rest[0])
        )

    def _actuators(self) -> None:
        robot = self.robot
        speeds = self._speeds()
        for k, e in self._every("actuator"):
            values = self.defaults.whole(e)
            name = values.get("name") or f"actuator {k}"
            if "joint" in values:
                terms = [(values["joint"], 1.0)]
            elif "tendon" in values:
                terms = self._fixed(values["tendon"], xml.At(self.file, f"actuator '{name}'"))
            else:
                robot.notes.append(f"actuator '{name}': left out: it drives no joint")
                continue
            speed = sum(factor * speeds.get(joint, 0.0) for joint, factor in terms)
            robot.motors.append(Motor(name, terms, speed or None))

    def _speeds(self) -> dict[str, float]:
        """Return the joints' speeds in the first key frame."""
        text = next((e.get("qvel") for _, e in self._every("keyframe")), None)
        own = [j.name for j in self.robot.joints.values() if j.kind in ("turn", "slide")]
        result = xml.At(self.file, "key").numbers("qvel", text)
        if len(result) != len(own):
            if result:
                self.robot.notes.append(
                    f"key, qvel: left out: found {len(result)} speeds, expected {len(own)}: one for each joint"
                )
            return {}
        # a key frame at rest has no speed
        return {name: v for name, v in zip(own, result, strict=True) if v != 0}


def leading(at: xml.At, values: Mapping[str, str], *keys: str) -> list[float]:
    """Return for each key the first of one number or several, such as a stiffness with its polynomial's."""
    return [(at.numbers(key, values.get(key)) or [0.0])[0] for key in keys]
