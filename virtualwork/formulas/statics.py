"""Equilibrium of every link at once: for redundantly constrained mechanisms, where the groups cannot be taken apart.

All joint forces and torques x of a pose satisfy A x + b = 0, three equations for each link. A redundant constraint
gives A a null space: states of self-stress, which no statics of rigid bodies can see. A component of x is determined
where every null vector vanishes in it, and so is a sum of components where they cancel; the rest is NaN, never a
least norm.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.guard import Lock, guarded
from virtualwork.describe.description import Description
from virtualwork.describe.parts import GROUND
from virtualwork.formulas.load_paths import LoadPaths
from virtualwork.formulas.loaded_pose import LoadedPose
from virtualwork.formulas.numbers import Number, Reals, cross, imaginary_part, real_part
from virtualwork.plan.joint_forces import Order, Side
from virtualwork.plan.steps import Joint

# ("fx" or "fy", joint, body), ("normal", joint, ""), ("moment", joint, ""), ("gear", number, ""), ...
Column = tuple[str, str, str]

# a singular value below this share of the largest is none, lengths scaled by the mechanism's size
NULL = 1e-9


def unknowns(of: Order) -> list[Column]:
    """The joint forces and torques of a mechanism."""
    unknowns: list[Column] = []
    for joint in of.joints:
        if joint.guide is None:
            unknowns += [
                (axis, joint.key, body) for body in joint.bodies if body != GROUND for axis in ("fx", "fy")
            ]
        else:
            unknowns.append(("normal", joint.key, ""))
            if of.mechanism.guides[joint.guide].is_slider:
                unknowns.append(("moment", joint.key, ""))
    unknowns += [mesh_column(of.mechanism, i) for i in range(len(of.mechanism.meshes))]
    unknowns += [("contact", str(cam), "") for cam in range(len(of.mechanism.cams))]
    for j, entry in enumerate(of.mechanism.inputs):
        unknowns.append(("force" if entry.is_slide else "torque", str(j), ""))
    return unknowns


def mesh_column(m: Description, mesh: int) -> Column:
    """The torque of a gear or a belt, or the tooth force of a rack."""
    return "gear" if m.meshes[mesh].guide is None else "tooth", str(mesh), ""


def equations(paths: LoadPaths, pose: LoadedPose) -> Iterator[tuple[int, int | None, Number]]:
    """What each equation holds at a pose: its row, the unknown (None: what acts), and the real factor.

    Three for each link, ΣF and ΣM about its centre of mass, then two for each pin that is not on the ground. Moments
    and torques are divided by the size. Parts of one entry may come one after the other.
    """
    m, size, of = paths.mechanism, paths.mechanism.size, paths.order
    links = list(m.links)
    column = {unknown: i for i, unknown in enumerate(unknowns(of))}

    def put(body: str, unknown: Column, force: Number, arm: Number) -> Iterator[tuple[int, int, Number]]:
        if body != GROUND:
            i, col = 3 * links.index(body), column[unknown]
            yield i, col, real_part(force)
            yield i + 1, col, imaginary_part(force)
            yield i + 2, col, cross(arm, force) / size

    def turn(body: str, unknown: Column, factor: float) -> Iterator[tuple[int, int, Number]]:
        if body != GROUND:
            yield 3 * links.index(body) + 2, column[unknown], factor

    def arm(side: Side) -> Number:
        """Where a joint's force acts, from the body's centre of mass, in ground axes."""
        body = side[1]
        z, guide, direction = paths.place(side)
        z -= m.rigid[body].center
        return (z if guide is None else z + direction * pose.st.slide[guide]) * pose.st.turn[body] + 0j

    for i, body in enumerate(links):
        force = paths.force(body, touched=False).value(pose)
        moment = paths.moment(body, m.rigid[body].center, touched=False).value(pose)
        if force is not None:
            yield 3 * i, None, real_part(force)
            yield 3 * i + 1, None, imaginary_part(force)
        if moment is not None:
            yield 3 * i + 2, None, moment / size
    for joint in of.joints:
        if joint.guide is None:
            for body in joint.bodies:
                if body != GROUND:
                    at = arm((joint.key, body))
                    yield from put(body, ("fx", joint.key, body), 1 + 0j, at)
                    yield from put(body, ("fy", joint.key, body), 1j, at)
            continue
        g = m.guides[joint.guide]
        rail = pose.rail(joint.guide) + 0j
        for body, sign in ((g.link, 1.0), (g.on, -1.0)):
            if body == GROUND:
                continue
            at = arm((joint.key, body))
            yield from put(body, ("normal", joint.key, ""), sign * 1j * rail, at)
            if g.is_slider:
                yield from turn(body, ("moment", joint.key, ""), sign)
            j = m.driver_of(joint.guide)
            if j is not None:
                yield from put(body, ("force", str(j), ""), sign * rail, at)
    for i, mesh in enumerate(m.meshes):
        # the tooth force of a rack, or the torque of a gear over the size
        unit = 1.0 if mesh.guide is None else size
        for body, factor in mesh.torques.items():
            yield from turn(body, mesh_column(m, i), factor / unit)
        if mesh.guide is not None:
            g = m.guides[mesh.guide]
            rail = pose.rail(mesh.guide) + 0j
            for body, sign in ((g.link, 1.0), (g.on, -1.0)):
                if body != GROUND:
                    at = arm((f"guide:{mesh.guide}", body))
                    yield from put(body, mesh_column(m, i), sign * rail, at)
    for touch in paths.touches.every:
        # along the follower's coordinate, of an arm a torque over the size
        here = touch.at(pose.st)
        push = here.unit() * (1.0 if touch.drive.guide is not None else size)
        for body in links:
            for sign in (sign for other, sign in paths.touches.on(body) if other is touch):
                center = pose.st.at(paths.case.path(body, m.rigid[body].center))
                at = touch.axis(pose.st) - center + here.place()
                yield from put(body, ("contact", str(touch.drive.number), ""), sign * push, at)
    for j, entry in enumerate(m.inputs):
        if not entry.is_slide:
            yield from turn(str(entry.link), ("torque", str(j), ""), 1.0)
            yield from turn(entry.on, ("torque", str(j), ""), -1.0)
    for p, joint in enumerate(_free_pins(of)):
        for axis, key in enumerate(("fx", "fy")):
            for body in joint.bodies:
                yield 3 * len(links) + 2 * p + axis, column[key, joint.key, body], 1.0


def _free_pins(of: Order) -> list[Joint]:
    return [joint for joint in of.joints if joint.guide is None and GROUND not in joint.bodies]


@guarded
class Statics:
    """The equations of all links over all poses, solved where they can be.

    Attributes
    ----------
    unknowns : list of columns
    system : arrays (n, equations, unknowns), (n, equations)
        A and b; moments and torques are divided by the size.
    """

    def __init__(
        self, order: Order, entries: Mapping[tuple[int, int | None], Any], n: int, lock: Lock
    ) -> None:
        self.order, self.n, self.lock = order, n, lock
        self.mechanism = order.mechanism
        self.unknowns = unknowns(order)
        a, b = np.zeros((n, self.rows, len(self.unknowns))), np.zeros((n, self.rows))
        for (row, column), value in entries.items():
            if column is None:
                b[:, row] = value
            else:
                a[:, row, column] = value
        self.system: tuple[Reals, Reals] = a, b

    @cached_property
    def rows(self) -> int:
        """How many equations: three for each link, two for each pin that is not on the ground."""
        return 3 * len(self.mechanism.links) + 2 * len(_free_pins(self.order))

    @cached_property
    def solved(self) -> tuple[Reals, Reals]:
        """The unknowns (n, u) and their null vectors (n, u, u)."""
        x, null, impossible = self.least
        value = x.copy()
        value[(np.abs(null).max(axis=1) > 1e-7) | impossible[:, None]] = np.nan
        return value, null

    @cached_property
    def least(self) -> tuple[Reals, Reals, NDArray[np.bool_]]:
        """Of all solutions the least (n, u), the null vectors (n, u, u), and where there is none after all, (n,)."""
        a, b = self.system
        u = len(self.unknowns)
        good: Any = np.isfinite(a).all(axis=(1, 2)) & np.isfinite(b).all(axis=1)
        value, null = np.full((self.n, u), np.nan), np.zeros((self.n, u, u))
        impossible = np.zeros(self.n, dtype=bool)
        if not good.any():
            return value, null, impossible
        left, s, vh = np.linalg.svd(a[good], full_matrices=True)
        k = s.shape[1]
        seen = s > NULL * s[:, :1]
        along = np.einsum("nij,ni->nj", left, -b[good])
        parts = np.where(seen, along[:, :k] / np.where(seen, s, 1.0), 0.0)
        x = np.einsum("nkj,nk->nj", vh[:, :k], parts)
        free = vh.copy()
        free[:, :k][seen] = 0.0
        # a load against a motion that the constraints leave free (a singular pose) has no equilibrium at all
        rest = along.copy()
        rest[:, :k][seen] = 0.0
        impossible[good] = np.abs(rest).max(axis=1) > 1e-9 * np.maximum(np.abs(b[good]).max(axis=1), 1e-300)
        value[good], null[good] = x, free
        return value, null, impossible

    def undetermined(self) -> list[str]:
        """Which joint forces no statics determines, and which of their sums it does."""
        _, null = self.solved
        size = np.abs(null).max(axis=(0, 1))
        free = [i for i in range(len(self.unknowns)) if size[i] > 1e-7]
        if not free:
            return []
        names = {joint.key: joint.name for joint in self.order.joints}

        def label(unknown: Any) -> str:
            kind, key, body = unknown
            if kind in ("fx", "fy"):
                return f"{kind} at {names[key]} on {body}"
            if kind in ("normal", "moment"):
                return f"the {kind} {'force ' if kind == 'normal' else ''}of guide {names[key]}"
            if kind == "contact":
                return f"the contact force of {self.mechanism.cam_drives[int(key)].label}"
            if kind == "tooth":
                return f"the tooth force of {self.mechanism.meshes[int(key)].label}"
            return f"the {kind} of {'input' if kind in ('force', 'torque') else 'gear'} {int(key) + 1}"

        by_key = self.order.by_key

        def at(axis: str, body: str, joined: bool) -> list[int]:
            """The open forces of an axis on a body, or of the joints it is `joined` by."""
            return [
                i
                for i in free
                for kind, key, on in (self.unknowns[i],)
                if kind == axis and (body in by_key[key].bodies if joined else on == body)
            ]

        links = list(self.mechanism.links)
        sums = []
        for axis in ("fx", "fy"):
            sums += [(f"{axis} on {body}", at(axis, body, False)) for body in links]
            sums.append((f"{axis} from the ground", at(axis, GROUND, True)))
        sums += [(f"normal force on {link}", at("normal", link, True)) for link in links]
        determined = [
            f"{what} at {' and '.join(names[self.unknowns[i][1]] for i in here)}"
            for what, here in sums
            if len(here) > 1 and np.abs(null[:, :, here].sum(axis=2)).max() <= 1e-7
        ]
        result = ["statics does not determine " + ", ".join(label(self.unknowns[i]) for i in free)]
        if determined:
            result.append("determined are the sums of " + "; ".join(determined))
        return result
