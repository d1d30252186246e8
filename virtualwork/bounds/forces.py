"""Bounds of the rounding errors of forces: effort, joint forces, shaking force; dimensions, loads and inputs exact.

Loads inherit the errors of the points and links on which they act (see `virtualwork.bounds.motion`): −m a_G that of a_G, a
spring those of its ends. By virtual work τ = −Σ F·K, so that

    |δτ| ≤ Σ |δF||K| + |F||δK| + ε|F||K|,

with K the velocities for a unit speed of the input. Joint forces solve the equilibrium of all links, A f + b = 0;
what the computed f̂ leave there, with the errors of the entries, bounds them (N. J. Higham, Accuracy and Stability of
Numerical Algorithms, 2nd ed., §7.2):

    |δf| ≤ |A⁻¹|·(|A f̂ + b̂| + |δA||f̂| + |δb| + ε(|A||f̂| + |b|)).

Joint friction exchanges loads and forces until neither changes; its poses have no estimate (infinite).
"""

from __future__ import annotations

from functools import cached_property, partial
from typing import Any

import numpy as np

from virtualwork.bounds.motion import ENTRIES, MotionErrors
from virtualwork.bounds.second_order import grown, inverse
from virtualwork.describe.parts import GROUND
from virtualwork.formulas.dynamics import Dynamics
from virtualwork.formulas.loads import (
    EXTERNAL,
    OWN,
    Follower,
    InertiaForce,
    InertiaTorque,
    Load,
    Tabled,
)
from virtualwork.formulas.numbers import EPS, Reals
from virtualwork.formulas.springs import SpringEnd, TorsionEnd
from virtualwork.formulas.statics import Statics
from virtualwork.plan.joints import Joint


class ForceErrors:
    """Bounds of the rounding errors of forces, under the names of what they bound; each is formed when asked for."""

    def __init__(self, dynamics: Dynamics, motion: MotionErrors | None = None) -> None:
        self.dynamics, self.poses, self.scene = dynamics, dynamics.poses, dynamics.scene
        self.mechanism = self.poses.mechanism
        self.motion = motion or MotionErrors(self.poses)
        self.n = self.poses.n
        self._known: dict[int, tuple[Any, Reals]] = {}
        self._units: dict[int, MotionErrors] = {}

    # --- loads ------------------------------------------------------------------------------------------------------
    def load(self, load: Load) -> tuple[Any, Reals]:
        """A load's value and the bound of its error, each (n,)."""
        if id(load) not in self._known:
            value = np.zeros(self.n, float if load.path is None else complex)
            for block in self.scene.blocks():
                found = load.form(block)
                if found is not None:
                    value[block.rows] = found
            with np.errstate(all="ignore"):
                self._known[id(load)] = value, self._error(load, np.abs(value))
        return self._known[id(load)]

    def _error(self, load: Load, size: Reals) -> Reals:
        r = self.motion
        own = EPS / 2 * size
        if isinstance(load, InertiaForce):
            return np.asarray(own + load.mass * r.point(load.body, load.place, None, 2))
        if isinstance(load, InertiaTorque):
            return np.asarray(own + load.inertia * r.angle(load.body, 2))
        if isinstance(load, Follower):
            return own + size * r.rotation(load.body)
        if isinstance(load, Tabled):
            at = np.array([row[0] for row in load.table])
            force = np.array([row[1] for row in load.table])
            steep = float(np.max(np.abs(np.diff(force) / np.diff(at)), initial=0.0))
            q = np.abs(self.poses.inputs[:, 0]) if load.axis == "input" else np.abs(at).max()
            if load.axis == "angle":
                own = own + steep * r.rotation(load.body)
            elif load.axis == "speed":
                own = own + steep * r.angle(load.body, 1)
            read = 2 * EPS * float(np.abs(force).max()) + EPS * steep * (q + np.abs(at).max())
            turning = size * r.rotation(load.body) if load.link_axes else 0.0
            return np.asarray(own + read + turning)
        if isinstance(load, SpringEnd):
            return own + self._spring(load)
        if isinstance(load, TorsionEnd):
            s = load.spring
            formed = 2 * np.pi + abs(s.free_angle) + np.abs(self.poses.inputs).sum(axis=1)
            turned: Reals = own + EPS * s.stiffness * formed
            for body in s.links:
                turned = turned + s.stiffness * r.rotation(body)
                if s.damping and self.scene.moves:
                    turned = turned + s.damping * r.angle(body, 1)
            return turned
        return own

    def _spring(self, load: SpringEnd) -> Reals:
        """Of k(1 − l₀/l)d + c(d·ḋ/l²)d."""
        s, r, p = load.spring, self.motion, self.poses
        ends = [(body, self.mechanism.place(body, point)) for body, point in s.between]
        moved = sum(r.point(body, z) for body, z in ends)
        d = np.abs(np.subtract(*(p.point_derivative(body, z, 0) for body, z in ends)))
        # a spring without length has no direction, and its pull no value
        d = np.where(d > 0, d, np.nan)
        slack = s.free_length / d if s.free_length else np.zeros(self.n)
        error: Any = s.stiffness * ((np.abs(1 - slack) + slack) * moved + 4 * EPS * s.free_length)
        if s.damping and self.scene.moves:
            rate = np.abs(np.subtract(*(p.point_derivative(body, z, 1) for body, z in ends)))
            error = error + s.damping * (3 * rate * moved / d + sum(r.point(b, z, None, 1) for b, z in ends))
        return np.asarray(error)

    # --- by virtual work ----------------------------------------------------------------------------------------------
    @cached_property
    def effort(self) -> Reals:
        """Of `Dynamics.effort`, (n, k)."""
        return self._settled(self._through(self.generalized))

    @cached_property
    def generalized(self) -> Reals:
        """Of the generalized forces Σ F·K_j, (n, k): the effort, but for motors that sit on another body than `on`."""
        k = len(self.mechanism.inputs)
        out = np.zeros((self.n, k))
        for j in range(k):
            unit = self.unit(j)
            for load in self.scene.loads:
                if load.body == GROUND:
                    continue
                value, error = self.load(load)
                moved: Any
                if load.path is None:
                    moved = unit.poses.angle_derivative(load.body, 1)
                    lost = unit.angle(load.body, 1)
                else:
                    moved = unit.poses.point_derivative(load.body, load.place, 1)
                    lost = unit.point(load.body, load.place, None, 1)
                out[:, j] += error * np.abs(moved) + np.abs(value) * (lost + EPS / 2 * np.abs(moved))
        return out

    def unit(self, j: int) -> MotionErrors:
        """The errors of the motion at a unit speed of input j alone."""
        if j not in self._units:
            k = len(self.mechanism.inputs)
            poses = self.poses.again(self.poses.inputs, [np.eye(k)[j].tolist(), [0.0] * k, [0.0] * k])
            poses.input_error = self.poses.input_error
            self._units[j] = MotionErrors(poses)
        return self._units[j]

    def _through(self, force: Reals) -> Reals:
        """Through motors that sit on another body than `on`; see `effort.through_carriers`."""
        inputs = self.mechanism.inputs
        k = len(inputs)
        moved = [j for j, e in enumerate(inputs) if not e.is_slide and self.mechanism.carrier(j) != e.on]
        if not moved:
            return force
        matrix = np.broadcast_to(np.eye(k), (self.n, k, k)).copy()
        wrong = np.zeros((self.n, k, k))
        for i in range(k):
            unit = self.unit(i)
            for j in moved:
                ends = str(inputs[j].link), self.mechanism.carrier(j)
                matrix[:, i, j] = np.subtract(*(unit.poses.angle_derivative(body, 1) for body in ends))
                wrong[:, i, j] = sum(unit.angle(body, 1) for body in ends)
        total = force + (wrong @ np.abs(self.dynamics.effort)[..., None])[..., 0]
        return np.asarray((np.abs(inverse(matrix)) @ total[..., None])[..., 0])

    # --- by Newton and Euler ------------------------------------------------------------------------------------------
    @cached_property
    def _unknowns(self) -> tuple[list[Any], Reals, Reals]:
        """The unknown forces of all links, their sizes and bounds, (n, unknowns); torques divided by the size."""
        d = self.dynamics
        statics = d.statics or Statics(d.reactions)
        poses = max(1, 4 * ENTRIES // len(statics.unknowns) ** 2)
        if self.n > poses:
            parts = [self._part(slice(i, i + poses))._unknowns for i in range(0, self.n, poses)]
            return statics.unknowns, *(np.concatenate([part[i] for part in parts]) for i in (1, 2))  # type: ignore
        a, b = statics.system()
        value = d.statics.solved[0] if d.statics is not None else self._gears(statics, a, b)
        known = np.nan_to_num(value)
        found = np.full(value.shape, np.nan)
        step = max(1, ENTRIES // max(1, a.shape[1] * a.shape[2]))
        with np.errstate(all="ignore"):
            wrong = self._entries(statics, known)
            for start in range(0, self.n, step):
                rows = slice(start, start + step)
                f = known[rows][..., None]
                left = wrong[rows] + EPS / 2 * ((np.abs(a[rows]) @ np.abs(f))[..., 0] + np.abs(b[rows]))
                left += np.abs((a[rows] @ f)[..., 0] + b[rows])
                found[rows] = (np.abs(inverse(a[rows])) @ left[..., None])[..., 0]
            tau = self.motion.tau.max(axis=1, initial=0.0)
            found *= grown(tau, 1)[:, None]
        found[~np.isfinite(wrong).all(axis=1) & np.isfinite(value).all(axis=1)] = np.inf
        return statics.unknowns, value, self._settled(found)

    def _part(self, rows: slice) -> ForceErrors:
        """The same over some of the poses: the equations of all would not fit into memory."""
        poses = self.poses
        rates = [[rate if isinstance(rate, float) else rate[rows] for rate in of] for of in poses.rates]
        part = poses.again(poses.inputs[rows], rates)
        whole = np.broadcast_to(np.asarray(poses.input_error, dtype=float), poses.inputs.shape)
        part.input_error = whole[rows]
        return ForceErrors(Dynamics(part))

    def _gears(self, statics: Any, a: Reals, b: Reals) -> Reals:
        """The unknowns with the gears' torques that go best with the others."""
        value = self._found(statics)
        gears = [i for i, unknown in enumerate(statics.unknowns) if unknown[0] == "gear"]
        if gears:
            rest = np.asarray(a @ value[..., None])[..., 0] + b
            # how a gear's torque acts on its links is the same in every pose
            value[:, gears] = -rest @ np.linalg.pinv(a[0][:, gears]).T
        return value

    def _found(self, statics: Any) -> Reals:
        """The unknowns as the reactions found them."""
        d, r, m = self.dynamics, self.dynamics.reactions, self.mechanism
        out = np.zeros((self.n, len(statics.unknowns)))
        for i, (kind, key, body) in enumerate(statics.unknowns):
            if kind in ("fx", "fy"):
                force = d.joint_force(r.by_key[key], body)
                out[:, i] = force.real if kind == "fx" else force.imag
            elif kind == "normal":
                joint = r.by_key[key]
                (rail,) = r.over(partial(r.rail, guide=joint.guide), kind=complex)
                force = d.joint_force(joint, m.guides[joint.guide].link)  # type: ignore[index]
                out[:, i] = (np.conj(1j * rail) * force).real
            elif kind == "moment":
                joint = r.by_key[key]
                out[:, i] = d.joint_moment(joint, m.guides[joint.guide].link) / statics.size  # type: ignore[index]
            elif kind == "gear":
                # its torque is nobody's answer: it follows from the others, see `_gears`
                continue
            else:
                out[:, i] = d.newton_euler[:, int(key)] / (1.0 if kind == "force" else statics.size)
        return out

    def _entries(self, statics: Any, known: Reals) -> Reals:
        """|δA||f̂| + |δb|: what wrong places, directions and loads do to each equation, (n, equations)."""
        m, r, poses = self.mechanism, self.motion, self.poses
        links, size = list(m.links), statics.size
        column = {unknown: i for i, unknown in enumerate(statics.unknowns)}
        equations = 3 * len(links) + 2 * sum(
            joint.guide is None and GROUND not in joint.bodies for joint in self.dynamics.reactions.joints
        )
        out = np.zeros((self.n, equations))
        center = {body: self.scene.rigid[body].center for body in links}
        turned = {body: r.rotation(body) for body in [GROUND, *links]}

        def put(body: str, bent: Any, lever: Any) -> None:
            """A force wrong by `bent`, its moment by `lever`."""
            i = 3 * links.index(body)
            out[:, i] += bent
            out[:, i + 1] += bent
            out[:, i + 2] += lever / size

        for load in self.scene.loads:
            if load.body == GROUND:
                continue
            value, error = self.load(load)
            if load.path is None:
                put(load.body, 0.0, error)
                continue
            arm = abs(load.place - center[load.body])
            put(load.body, error, arm * (error + np.abs(value) * turned[load.body]))
        for j, entry in enumerate(m.inputs):
            body = entry.on if entry.is_slide else m.carrier(j)
            # the motor's reaction is put there as a load
            if body != entry.on:
                for carrying in {body, entry.on} - {GROUND}:
                    put(carrying, 0.0, self.effort[:, j])
        for joint in self.dynamics.reactions.joints:
            if joint.guide is None:
                for body in joint.bodies:
                    if body != GROUND:
                        x, y = (known[:, column[axis, joint.key, body]] for axis in ("fx", "fy"))
                        lever = abs(m.links[body].points[joint.name] - center[body])
                        put(body, 0.0, np.hypot(x, y) * lever * turned[body])
                continue
            g = m.guides[joint.guide]
            force = np.abs(known[:, column["normal", joint.key, ""]])
            for j, entry in enumerate(m.inputs):
                if entry.slider == g.point:
                    force = force + np.abs(known[:, column["force", str(j), ""]])
            bent = force * turned[g.on]
            if g.link != GROUND:
                lever = abs(m.links[g.link].points[g.point] - center[g.link])
                put(g.link, bent, lever * (bent + force * turned[g.link]))
            if g.on != GROUND:
                slide = poses.slide_derivative(joint.guide, 0)
                reach = abs(m.through(g) - center[g.on]) + np.abs(slide)
                put(g.on, bent, 2 * reach * bent + force * r.slide(joint.guide))
        return out

    @cached_property
    def newton_euler(self) -> Reals:
        """Of `Dynamics.newton_euler`, (n, k)."""
        names = [
            ("force" if e.is_slide else "torque", str(j), "") for j, e in enumerate(self.mechanism.inputs)
        ]
        return np.stack([self._of(name) for name in names], axis=1)

    def _of(self, unknown: Any) -> Reals:
        unknowns, value, bounds = self._unknowns
        i = unknowns.index(unknown)
        scale = self.mechanism.size if unknown[0] in ("moment", "gear", "torque") else 1.0
        return np.asarray(scale * (bounds[:, i] + EPS * np.abs(value[:, i])))

    def joint_force(self, joint: Joint, body: str) -> Reals:
        """Of `Dynamics.joint_force`, (n,): the length of the error."""
        if joint.guide is None:
            if body == GROUND:
                others = [self.joint_force(joint, other) for other in joint.bodies if other != GROUND]
                return np.asarray(sum(others))
            return np.hypot(self._of(("fx", joint.key, body)), self._of(("fy", joint.key, body)))
        unknowns, value, _ = self._unknowns
        normal = np.abs(value[:, unknowns.index(("normal", joint.key, ""))])
        on = self.mechanism.guides[joint.guide].on
        return np.asarray(self._of(("normal", joint.key, "")) + normal * (self.motion.rotation(on)))

    def joint_moment(self, joint: Joint, body: str) -> Reals:
        """Of `Dynamics.joint_moment`, (n,)."""
        if joint.guide is None or not self.mechanism.guides[joint.guide].is_slider:
            return np.zeros(self.n)
        return self._of(("moment", joint.key, ""))

    def reaction(self, joint: str, on: str) -> Reals:
        """Of `Dynamics.reaction`, (n,): the length of the error."""
        here = [found for found in self.dynamics.joints_named(joint) if on in found.bodies]
        return np.asarray(sum(self.joint_force(found, on) for found in here))

    @cached_property
    def shaking(self) -> tuple[Reals, Reals]:
        """Of `Dynamics.shaking`: the length of the force's error (n,), and the moment's (n,)."""
        force, moment = np.zeros(self.n), np.zeros(self.n)
        for load in self.scene.loads:
            if load.kind not in EXTERNAL or load.body == GROUND:
                continue
            value, error = self.load(load)
            if load.path is None:
                moment += error + EPS * np.abs(value)
                continue
            at = np.abs(self.poses.point_derivative(load.body, load.place, 0))
            force += error + EPS * np.abs(value)
            moment += at * (error + EPS / 2 * np.abs(value))
            moment += np.abs(value) * self.motion.point(load.body, load.place)
        return self._settled(force), self._settled(moment)

    def applied(self, link: str) -> tuple[Reals, Reals]:
        """Of `Dynamics.applied`: the length of the force's error (n,), and the moment's (n,)."""
        force, moment = np.zeros(self.n), np.zeros(self.n)
        center = self.scene.rigid[link].center
        for load in self.scene.loads:
            if load.body != link or load.kind in OWN:
                continue
            value, error = self.load(load)
            if load.path is None:
                moment += error
                continue
            force += error + EPS / 2 * np.abs(value)
            moment += abs(load.place - center) * (error + np.abs(value) * self.motion.rotation(link))
        return self._settled(force), self._settled(moment)

    def _settled(self, bounds: Reals) -> Reals:
        return np.full_like(bounds, np.inf) if self.scene.friction else bounds
