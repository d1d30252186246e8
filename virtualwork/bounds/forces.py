"""Bounds of the rounding errors of forces: effort, joint forces, shaking force; dimensions, loads and inputs exact.

Each is that of a quantity on the tape (`virtualwork.bounds.quantities`), but for joint forces where statics is
redundant. Those solve the equilibrium of all links, A f + b = 0, by singular values: what the computed f̂ leave there,
with the rounding of A, b and their sum, ρ together, bounds them (N. J. Higham, Accuracy and Stability of Numerical
Algorithms, 2nd ed., §7.2): |δf| ≤ |A⁻¹|·ρ.

Joint friction exchanges loads and forces until neither changes; its poses have no estimate (infinite).
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property

import numpy as np

from dalembert.arithmetic.guard import guarded
from virtualwork.bounds.quantities import Bounds
from virtualwork.bounds.second_order import grown, inverse
from virtualwork.describe.parts import GROUND
from virtualwork.formulas.asked import Key
from virtualwork.formulas.dynamics import Dynamics, joints_at
from virtualwork.formulas.numbers import EPS, Reals
from virtualwork.formulas.statics import Column
from virtualwork.plan.steps import Joint


@guarded
class ForceErrors:
    """Bounds of the rounding errors of forces, under the names of what they bound; each is formed when asked for."""

    def __init__(self, dynamics: Dynamics) -> None:
        self.dynamics, self.n, self.lock = dynamics, dynamics.poses.n, dynamics.lock
        self.mechanism = dynamics.poses.mechanism
        self.bounds = Bounds(dynamics.poses)

    def together(self, reactions: Iterable[Key] | None = None) -> None:
        """Form the bounds of some joints' forces, or of all that `bounds` has: they have most of the sweep in common."""
        if reactions is not None:
            if self._redundant is None:
                self.bounds.together(reactions)
            return
        inputs, joints = range(len(self.mechanism.inputs)), self.dynamics.reactions.joints
        keys: list[Key] = [("shaking",), ("shaking moment",), *(("effort", j) for j in inputs)]
        if self._redundant is None:
            keys += [("newton-euler", j) for j in inputs]
            sides = [(joint, body) for joint in joints for body in joint.bodies]
            keys += [("force", joint.key, body) for joint, body in sides]
            keys += [("moment", joint.key, body) for joint, body in sides if self._holds(joint)]
        self.bounds.together(keys)

    def _holds(self, joint: Joint) -> bool:
        """Whether a joint keeps its bodies from turning against each other."""
        return joint.guide is not None and self.mechanism.guides[joint.guide].is_slider

    def _each(self, kind: str) -> Reals:
        """Of a quantity of every input, (n, k)."""
        keys: list[Key] = [(kind, j) for j in range(len(self.mechanism.inputs))]
        self.bounds.together(keys)
        return np.stack([self.bounds.of(key) for key in keys], axis=1)

    @cached_property
    def effort(self) -> Reals:
        """Of `Dynamics.effort`, (n, k)."""
        return self._each("effort")

    @cached_property
    def generalized(self) -> Reals:
        """Of the generalized forces Σ F·K_j, (n, k): the effort, but for motors that sit on another body than `on`."""
        return self._each("generalized")

    @cached_property
    def newton_euler(self) -> Reals:
        """Of `Dynamics.newton_euler`, (n, k)."""
        if self._redundant is None:
            return self._each("newton-euler")
        kinds = ["force" if entry.is_slide else "torque" for entry in self.mechanism.inputs]
        return np.stack([self._of((kind, str(j), "")) for j, kind in enumerate(kinds)], axis=1)

    def joint_force(self, joint: Joint, body: str) -> Reals:
        """Of `Dynamics.joint_force`, (n,): the length of the error."""
        if self._redundant is None:
            return self.bounds.of(("force", joint.key, body))
        if joint.guide is None:
            if body == GROUND:
                others = [self.joint_force(joint, other) for other in joint.bodies if other != GROUND]
                return np.asarray(sum(others))
            return np.hypot(self._of(("fx", joint.key, body)), self._of(("fy", joint.key, body)))
        name = "normal", joint.key, ""
        assert self.dynamics.statics is not None
        turned = self.bounds.of(("turn", self.mechanism.guides[joint.guide].on))
        return np.asarray(self._of(name) + np.abs(self.dynamics.statics.get(name)) * turned)

    def joint_moment(self, joint: Joint, body: str) -> Reals:
        """Of `Dynamics.joint_moment`, (n,)."""
        if not self._holds(joint):
            return np.zeros(self.n)
        if self._redundant is None:
            return self.bounds.of(("moment", joint.key, body))
        return self._of(("moment", joint.key, ""))

    def reaction(self, joint: str, on: str) -> Reals:
        """Of `Dynamics.reaction`, (n,): the length of the error."""
        if self._redundant is None:
            return self.bounds.of(("reaction", joint, on))
        here = joints_at(self.dynamics.reactions.joints, joint, on)
        return np.asarray(sum(self.joint_force(found, on) for found in here))

    @cached_property
    def shaking(self) -> tuple[Reals, Reals]:
        """Of `Dynamics.shaking`: the length of the force's error (n,), and the moment's (n,)."""
        self.bounds.together([("shaking",), ("shaking moment",)])
        return self.bounds.of(("shaking",)), self.bounds.of(("shaking moment",))

    def applied(self, link: str) -> tuple[Reals, Reals]:
        """Of `Dynamics.applied`: the length of the force's error (n,), and the moment's (n,)."""
        self.bounds.together([("applied", link), ("applied moment", link)])
        return self.bounds.of(("applied", link)), self.bounds.of(("applied moment", link))

    # --- redundant statics ------------------------------------------------------------------------------------------
    @cached_property
    def _redundant(self) -> tuple[list[Column], Reals] | None:
        """The unknown forces of all links and their bounds, (n, unknowns); torques divided by the size."""
        statics = self.dynamics.statics
        if statics is None:
            return None
        value = statics.solved[0]
        if self.dynamics.scene.friction:
            return statics.unknowns, np.full(value.shape, np.inf)
        # what statics does not determine has a part in the balance too
        known = {f"f {i}": column for i, column in enumerate(np.nan_to_num(statics.least[0]).T)}
        keys: list[Key] = [("balance", row) for row in range(statics.rows)]
        left, tau = self.bounds.residual(keys, known)
        with np.errstate(all="ignore"):
            found = (np.abs(inverse(statics.system()[0])) @ left[..., None])[..., 0]
            found *= np.atleast_1d(grown(tau, 1))[:, None]
        found[~np.isfinite(found) & np.isfinite(value)] = np.inf
        return statics.unknowns, found

    def _of(self, unknown: Column) -> Reals:
        """One of the unknowns of redundant statics, (n,)."""
        assert self._redundant is not None
        assert self.dynamics.statics is not None
        names, bounds = self._redundant
        scale = self.mechanism.size if unknown[0] in ("moment", "gear", "torque") else 1.0
        own = EPS * np.abs(self.dynamics.statics.get(unknown))
        return np.asarray(scale * bounds[:, names.index(unknown)] + own)
