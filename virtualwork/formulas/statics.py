"""Equilibrium of every link at once: for redundantly constrained mechanisms, where the groups cannot be taken apart.

All joint forces and torques x of a pose satisfy A x + b = 0, three equations for each link. A redundant constraint
gives A a null space: states of self-stress, which no statics of rigid bodies can see. A component of x is determined
where every null vector vanishes in it, and so is a sum of components where they cancel; the rest is NaN, never a
least norm.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from virtualwork.describe.parts import GROUND
from virtualwork.formulas.numbers import Reals, cross
from virtualwork.formulas.reactions import Reactions
from virtualwork.plan.joints import Joint

# ("fx" or "fy", joint, body), ("normal", joint, ""), ("moment", joint, ""), ("gear", number, ""), ...
Column = tuple[str, str, str]

# a singular value below this share of the largest is none, lengths scaled by the mechanism's size
NULL = 1e-9


class Statics:
    """The equations of all links over all poses, solved where they can be.

    Attributes
    ----------
    unknowns : list of columns
    value : array (n, unknowns), NaN where statics does not determine it
    null : array (n, unknowns, unknowns)
        Rows that span the states of self-stress; zero rows else.
    """

    def __init__(self, reactions: Reactions) -> None:
        self.reactions = reactions
        self.mechanism = mechanism = reactions.scene.mechanism
        self.n = reactions.scene.poses.n
        self.size: float = mechanism.size
        self.unknowns: list[Any] = self._unknowns()

    def _unknowns(self) -> list[Any]:
        found: list[Any] = []
        for joint in self.reactions.joints:
            if joint.guide is None:
                found += [
                    (axis, joint.key, body)
                    for body in joint.bodies
                    if body != GROUND
                    for axis in ("fx", "fy")
                ]
            else:
                found.append(("normal", joint.key, ""))
                if self.mechanism.guides[joint.guide].is_slider:
                    found.append(("moment", joint.key, ""))
        found += [("gear", str(i), "") for i in range(len(self.mechanism.gears))]
        for j, entry in enumerate(self.mechanism.inputs):
            found.append(("force" if entry.is_slide else "torque", str(j), ""))
        return found

    def system(self) -> tuple[Reals, Reals]:
        """A (n, equations, unknowns) and b (n, equations); moments and torques are divided by the size."""
        r = self.reactions
        m = self.mechanism
        links = list(m.links)
        free_pins = [joint for joint in r.joints if joint.guide is None and GROUND not in joint.bodies]
        rows = 3 * len(links) + 2 * len(free_pins)
        a = np.zeros((self.n, rows, len(self.unknowns)))
        b = np.zeros((self.n, rows))
        column = {unknown: i for i, unknown in enumerate(self.unknowns)}
        for block in r.blocks():
            at = block.rows

            def put(body: str, col: int, force: Any, arm: Any, at: Any = at) -> None:
                if body == GROUND:
                    return
                i = 3 * links.index(body)
                a[at, i, col] += np.real(force)
                a[at, i + 1, col] += np.imag(force)
                a[at, i + 2, col] += cross(arm, force) / self.size

            def turn(body: str, col: int, factor: float, at: Any = at) -> None:
                if body != GROUND:
                    a[at, 3 * links.index(body) + 2, col] += factor

            for body in links:
                i = 3 * links.index(body)
                force, moment = r.force(block, body), r.moment(block, body)
                if force is not None:
                    b[at, i], b[at, i + 1] = np.real(force), np.imag(force)
                if moment is not None:
                    b[at, i + 2] = moment / self.size
            for joint in r.joints:
                if joint.guide is None:
                    for body in joint.bodies:
                        if body != GROUND:
                            arm = r.place(block, (joint.key, body)) + 0j
                            put(body, column["fx", joint.key, body], 1 + 0j, arm)
                            put(body, column["fy", joint.key, body], 1j, arm)
                    continue
                g = m.guides[joint.guide]
                rail = r.rail(block, joint.guide) + 0j
                for body, sign in ((g.link, 1.0), (g.on, -1.0)):
                    if body == GROUND:
                        continue
                    arm = r.place(block, (joint.key, body)) + 0j
                    put(body, column["normal", joint.key, ""], sign * 1j * rail, arm)
                    if g.is_slider:
                        turn(body, column["moment", joint.key, ""], sign)
                    j = m.driver_of(joint.guide)
                    if j is not None:
                        put(body, column["force", str(j), ""], sign * rail, arm)
            for i, gear in enumerate(m.gears):
                first, second = gear.links
                for body, factor in ((second, 1.0), (first, -gear.ratio), (gear.arm, gear.ratio - 1.0)):
                    turn(body, column["gear", str(i), ""], factor)
            for j, entry in enumerate(m.inputs):
                if not entry.is_slide:
                    turn(str(entry.link), column["torque", str(j), ""], 1.0)
                    turn(entry.on, column["torque", str(j), ""], -1.0)
        for p, joint in enumerate(free_pins):
            for axis, key in enumerate(("fx", "fy")):
                for body in joint.bodies:
                    a[:, 3 * len(links) + 2 * p + axis, column[key, joint.key, body]] = 1.0
        return a, b

    @cached_property
    def solved(self) -> tuple[Reals, Reals]:
        """The unknowns (n, u) and their null vectors (n, u, u)."""
        a, b = self.system()
        u = len(self.unknowns)
        good: Any = np.isfinite(a).all(axis=(1, 2)) & np.isfinite(b).all(axis=1)
        value, null = np.full((self.n, u), np.nan), np.zeros((self.n, u, u))
        if not good.any():
            return value, null
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
        impossible = np.abs(rest).max(axis=1) > 1e-9 * np.maximum(np.abs(b[good]).max(axis=1), 1e-300)
        x[np.abs(free).max(axis=1) > 1e-7] = np.nan
        x[impossible] = np.nan
        value[good], null[good] = x, free
        return value, null

    def get(self, unknown: Any) -> Reals:
        """One unknown over the poses; torques in N·m."""
        value = self.solved[0][:, self.unknowns.index(unknown)]
        return value * self.size if unknown[0] in ("moment", "gear", "torque") else value

    def joint_force(self, joint: Joint, body: str) -> NDArray[np.complex128]:
        """The force of a joint on a body, (n,) complex."""
        if joint.guide is None:
            if body == GROUND:
                others = [self.joint_force(joint, other) for other in joint.bodies if other != GROUND]
                return np.asarray(-sum(others))
            return np.asarray(self.get(("fx", joint.key, body)) + 1j * self.get(("fy", joint.key, body)))
        r = self.reactions
        rail, rub = r.over(
            lambda block: r.rail(block, joint.guide),
            lambda block: r.rubbed(block, joint, body),
            kind=complex,
        )
        sign = 1.0 if body == self.mechanism.guides[joint.guide].link else -1.0
        return np.asarray(sign * self.get(("normal", joint.key, "")) * 1j * rail + rub)

    def undetermined(self) -> list[str]:
        """Which joint forces no statics determines, and which of their sums it does."""
        _, null = self.solved
        size = np.abs(null).max(axis=(0, 1))
        free = [i for i in range(len(self.unknowns)) if size[i] > 1e-7]
        if not free:
            return []
        names = {joint.key: joint.name for joint in self.reactions.joints}

        def label(unknown: Any) -> str:
            kind, key, body = unknown
            if kind in ("fx", "fy"):
                return f"{kind} at {names[key]} on {body}"
            if kind in ("normal", "moment"):
                return f"the {kind} {'force ' if kind == 'normal' else ''}of guide {names[key]}"
            return f"the {kind} of {'input' if kind in ('force', 'torque') else 'gear'} {int(key) + 1}"

        found = ["statics does not determine " + ", ".join(label(self.unknowns[i]) for i in free)]
        sums = []
        for axis in ("fx", "fy"):
            for body in self.mechanism.links:
                here = [i for i in free if self.unknowns[i][0] == axis and self.unknowns[i][2] == body]
                if len(here) > 1 and np.abs(null[:, :, here].sum(axis=2)).max() <= 1e-7:
                    places = " and ".join(names[self.unknowns[i][1]] for i in here)
                    sums.append(f"{axis} on {body} at {places}")
            ground = [
                i
                for i in free
                if self.unknowns[i][0] == axis and GROUND in self.reactions.by_key[self.unknowns[i][1]].bodies
            ]
            if len(ground) > 1 and np.abs(null[:, :, ground].sum(axis=2)).max() <= 1e-7:
                sums.append(
                    f"{axis} from the ground at {' and '.join(names[self.unknowns[i][1]] for i in ground)}"
                )
        for link in self.mechanism.links:
            here = [
                i
                for i in free
                if self.unknowns[i][0] == "normal"
                and link in self.reactions.by_key[self.unknowns[i][1]].bodies
            ]
            if len(here) > 1 and np.abs(null[:, :, here].sum(axis=2)).max() <= 1e-7:
                sums.append(
                    f"normal force on {link} at {' and '.join(names[self.unknowns[i][1]] for i in here)}"
                )
        if sums:
            found.append("determined are the sums of " + "; ".join(sums))
        return found
