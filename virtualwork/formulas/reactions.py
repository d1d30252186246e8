"""Joint forces by Newton and Euler over the poses of a motion, each formed when it is asked for.

How they follow from each other is worked out once for a mechanism (`load_paths`); here the combinations become arrays.

Coulomb friction in pins and guides are loads that depend on the reactions they change, found by iteration (`settle`). A
pin of radius r with the reaction R resists its relative turning with μ r |R|; a guide resists sliding with μ |N|, N normal
to it (Norton, Design of Machinery, §11.9 names the model; the iteration starts without friction). Where nothing slides
there is no friction: its value at rest is not determined, only bounded.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.guard import guarded
from virtualwork.describe.parts import GROUND
from virtualwork.formulas.block import Block
from virtualwork.formulas.effort import effort
from virtualwork.formulas.load_paths import LoadPaths
from virtualwork.formulas.locking import balanced
from virtualwork.formulas.numbers import Number, dot, leave_out, minus, plus, times
from virtualwork.formulas.positions import BLOCK
from virtualwork.formulas.scene import Scene
from virtualwork.plan.joint_forces import Side
from virtualwork.plan.steps import Joint

# iterations of friction; each gains a factor of some μ r / l
LIMIT = 200
# relative change at which a pose has converged
CLOSE = 1e-14


class JointForces:
    """The joint forces over one block of poses."""

    def __init__(self, paths: LoadPaths, formed: set[str]) -> None:
        self.paths = paths
        # the names of what has been formed, for `dalembert inspect` and the tests
        self.formed = formed
        self.order = paths.order
        self.plan, self.mechanism = paths.plan, paths.mechanism
        self.joints, self.by_key = self.order.joints, self.order.by_key

    @property
    def redundant(self) -> bool:
        """Whether statics cannot give every joint force: more unknowns than equations."""
        return self.order.redundant

    def force(self, block: Block, body: str, *, touched: bool = True) -> Number:
        """The sum of the loads on a body, those of cams (`touched`) among them."""
        return self.paths.force(body, touched=touched).value(block)

    def moment(self, block: Block, body: str, *, touched: bool = True) -> Number:
        """The moment of the loads on a body about its centre of mass."""
        return self.paths.moment(body, self.mechanism.rigid[body].center, touched=touched).value(block)

    def on_side(self, block: Block, side: Side) -> Number:
        """The force of a joint on a body, complex; None where it is zero throughout."""
        joint, body = side
        self.formed.add(f"{joint} on {body}")
        return self.paths.value(block, self.paths.side(side))

    def place(self, block: Block, side: Side) -> Number:
        """Where a joint's force acts, from the body's centre of mass, in ground axes."""
        body = side[1]
        z, guide, direction = self.paths.place(side)
        z -= self.mechanism.rigid[body].center
        return (z if guide is None else z + direction * block.st.slide[guide]) * block.st.turn[body]

    def joint_force(self, block: Block, joint: Joint, body: str) -> Number:
        """The force of a joint on a body over a block, without the force of an input that drives it."""
        value = self.on_side(block, (joint.key, body))
        guide = joint.guide
        if guide is not None and value is not None and self.is_pushed(guide):
            # along a driven guide the joint's own equilibrium leaves the effort, which is given apart, or a tooth force
            rail = self.rail(block, guide)
            value = value - dot(value, rail) * rail
        value = plus(value, self.borne(block, joint, body))
        return plus(value, self.rubbed(block, joint, body))

    def is_pushed(self, guide: int) -> bool:
        """Whether another part than the rail pushes along a guide: an input, a cam, or the teeth of a wheel that has a bearing."""
        driven = self.mechanism.driver_of(guide) is not None
        cam = any(drive.guide == guide for drive in self.mechanism.cam_drives)
        return (
            driven or cam or any(self.meshing(mesh) is not None for mesh in self.order.racks.get(guide, ()))
        )

    def meshing(self, mesh: int) -> str | None:
        """Where the teeth of a rack's wheel act.

        The name of the pin on which the wheel turns on the body that carries the rack's guide; "" where the wheel rolls
        along a rack of that body; None where it is neither, and the tooth force is taken to act along the guide.
        """
        of = self.mechanism.meshes[mesh]
        assert of.guide is not None
        g = self.mechanism.guides[of.guide]
        if of.wheel == g.link:
            return ""
        wheel, carrier = self.mechanism.bodies[of.wheel], self.mechanism.bodies[g.on]
        return next((name for name in wheel if name in carrier), None)

    def tooth(self, block: Block, mesh: int) -> Number:
        """The tooth force of a rack along its slide, positive on the link of the guide."""
        return self.paths.value(block, self.paths.tooth(mesh))

    def contact(self, block: Block, cam: int, push: Number = None) -> Number:
        """How hard a cam presses on its follower along the normal; below zero it would have to pull.

        `push`: what it does along the follower's coordinate, where statics has told it.
        """
        touch = self.paths.touches.every[cam]
        if push is None:
            push = self.paths.value(block, self.paths.push(touch))
        return times(times(touch.drive.cam.sign, abs(touch.at(block.st).unit())), push)

    def borne(
        self, block: Block, joint: Joint, body: str, tooth: Callable[[Block, int], Number] | None = None
    ) -> Number:
        """What the bearing of a rack's wheel bears of the tooth force (`tooth`), on one body."""
        tooth = tooth or self.tooth
        total: Number = None
        if joint.guide is not None:
            return total
        for guide, meshes in self.order.racks.items():
            for mesh in meshes:
                if self.meshing(mesh) != joint.name:
                    continue
                wheel, carrier = self.mechanism.meshes[mesh].wheel, self.mechanism.guides[guide].on
                if body in (wheel, carrier):
                    force = times(self.rail(block, guide), tooth(block, mesh))
                    total = plus(total, force) if body == wheel else minus(total, force)
        return total

    def rubbed(self, block: Block, joint: Joint, body: str) -> Number:
        """The friction force along a guide belongs to its reaction."""
        total: Number = None
        for load in self.paths.case.friction:
            if load.path is None or load.joint != joint.key:
                continue
            # no load stands there: it feels the reverse of the other body's
            if body == GROUND:
                total = minus(total, load.form(block))
            elif load.body == body:
                total = plus(total, load.form(block))
        return total

    def rail(self, block: Block, guide: int | None) -> Number:
        """The direction of a guide, a unit vector."""
        assert guide is not None
        on = self.mechanism.guides[guide].on
        d = self.plan.directions[guide]
        return d if on == GROUND else d * block.st.turn[on]

    def guide_moment(self, block: Block, guide: int, body: str) -> Number:
        """The moment a guide puts on one of its bodies about its point, over a block."""
        g = self.mechanism.guides[guide]
        if not g.is_slider:
            return None
        value = self.paths.value(block, self.paths.couple("guide", guide))
        value = plus(value, self.beside(block, guide))
        return value if value is None or body == g.link else -value

    def beside(self, block: Block, guide: int, tooth: Callable[[Block, int], Number] | None = None) -> Number:
        """What a guide bears because teeth push its link beside the guide's line: at the pitch point of the wheel."""
        tooth = tooth or self.tooth
        g, m = self.mechanism.guides[guide], self.mechanism
        total: Number = None
        for mesh in self.order.racks.get(guide, ()):
            pin, rack = self.meshing(mesh), m.meshes[mesh].rack
            if pin and rack is not None:
                across = (
                    dot(1j * self.plan.directions[guide], m.bodies[g.on][pin] - m.through(g)) - rack.radius
                )
                total = plus(total, times(across, tooth(block, mesh)))
        return total

    def effort(self, block: Block, j: int) -> Number:
        """The effort at input j by Newton and Euler: ΣM = 0 of the driven link, or the force along the slide."""
        entry = self.mechanism.inputs[j]
        if not entry.is_slide:
            return self.paths.value(block, self.paths.couple("input", j))
        guide = self.mechanism.guide_of(entry)
        value = self.on_side(block, (f"guide:{guide}", self.mechanism.guides[guide].link))
        value = None if value is None else dot(value, self.rail(block, guide))
        for mesh in self.order.racks.get(guide, ()):
            value = minus(value, self.tooth(block, mesh))
        return value


@guarded
class Reactions(JointForces):
    """The joint forces over all poses of a scene, each formed on the first request."""

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene.paths, scene.formed)
        self.scene, self.lock = scene, scene.lock

    def blocks(self) -> list[Block]:
        """The scene's blocks, with what all joints' places depend on."""
        self._drive()
        return self.scene.blocks(self.scene.case.places)

    def _drive(self) -> None:
        """Form the efforts of carried motors over all poses, before the blocks are solved one by one."""
        if self.scene.case.carried and self.scene.setting.drive is None:
            self.scene.setting.drive = effort(self.scene)

    def over(self, *forms: Callable[[Block], Number], kind: type = float) -> list[Any]:
        """Quantities over all blocks, formed block by block together; NaN where a pose is not assembled."""
        self._drive()
        n = self.scene.poses.n
        result: list[Any] = [np.empty(n, dtype=kind) for _ in forms]

        def work(block: Block) -> None:
            for out, form in zip(result, forms, strict=True):
                value = form(block)
                out[block.rows] = 0.0 if value is None else value
            if n > BLOCK:
                # over a long sweep what the quantities were made of is not kept
                block.forget(lasting=True)

        self.scene.each(self.scene.case.places, work)
        if self.scene.lost is not None:
            for out in result:
                leave_out(out, self.scene.lost)
        return result


def settle(scene: Scene) -> tuple[int, NDArray[np.bool_]]:
    """Iterate friction and reactions until neither changes; where they do not settle so, follow them from no friction on.

    Returns
    -------
    iterations : int
    converged : array (n,) of bool
        Where False the joints lock: no motion at this speed and coefficient is in equilibrium.
    """
    n = scene.poses.n
    converged = np.zeros(n, dtype=bool)
    count = 0
    reactions = Reactions(scene)
    while count < LIMIT:
        count += 1
        converged[:] = True
        _anew(reactions)
        for block in reactions.blocks():
            change: Number = 0.0
            scale: Number = 0.0
            fresh: dict[int, Number] = {}
            for number, force, along, arm in _rubbing(reactions, block):
                value = times(-arm * abs(force), along)
                fresh[number] = value
                before = block.friction.get(number, 0.0)
                change = np.maximum(change, abs(value - before) / np.where(value == 0, 1.0, abs(value)))
                scale = np.maximum(scale, abs(value))
            block.friction.clear()
            block.friction.update(fresh)
            converged[block.rows] = ~(change > CLOSE * 8) & np.isfinite(scale)
        if (converged | ~scene.poses.assembled).all():
            break
    for block in reactions.blocks():
        rows = np.flatnonzero(~converged[block.rows] & scene.poses.assembled[block.rows])
        if len(rows):
            converged[block.rows] |= _follow(reactions, block, rows, len(converged[block.rows]))
    _anew(reactions)
    scene.formed.clear()
    return count, converged


def _rubbing(reactions: Reactions, block: Block) -> Iterator[tuple[int, Number, Number, Number]]:
    """Of each contact that slides over a block: its number, the force that it bears, along what it rubs, and its friction over the force with the sign of its rate.

    A pin's force is complex and it rubs as a torque, 1; a guide's is the normal one, and it rubs along its rail.
    """
    for number, (joint, body, other, coefficient, radius) in enumerate(reactions.scene.case.contacts):
        force = reactions.on_side(block, (joint.key, body))
        force = plus(force, reactions.borne(block, joint, body))
        if force is None:
            continue
        if joint.guide is None:
            along, arm = 1.0, coefficient * radius
            rate = minus(block.omega(body), block.omega(other))
        else:
            along, arm = reactions.rail(block, joint.guide), coefficient
            force, rate = dot(force, 1j * along), block.slide_rate(joint.guide)
        if rate is not None:
            yield number, force, along, arm * np.sign(rate)


def _follow(reactions: Reactions, block: Block, rows: NDArray[np.intp], n: int) -> NDArray[np.bool_]:
    """Put the friction of some of a block's n poses that did not settle; which of all could be found, (n,)."""
    contacts = [number for number, *_ in _rubbing(reactions, block)]
    alongs = {number: along for number, _, along, _ in _rubbing(reactions, block)}
    arms = np.array([np.broadcast_to(arm, n) for *_, arm in _rubbing(reactions, block)])
    before = dict(block.friction)

    def forces(friction: dict[int, Number]) -> Any:
        block.friction.clear()
        block.friction.update(friction)
        _anew(reactions)
        every = {number: force for number, force, *_ in _rubbing(reactions, block)}
        return np.array([np.broadcast_to(every[number], n) for number in contacts], dtype=complex)

    p = forces({})
    q = np.array([forces({number: alongs[number] * np.ones(n)}) - p for number in contacts])
    solved = np.zeros(n, dtype=bool)
    friction = np.zeros((len(contacts), n))
    for i in rows.tolist():
        phi = balanced(arms[:, i], p[:, i], q[:, :, i].T)
        if phi is not None:
            friction[:, i], solved[i] = phi, True
    for k, number in enumerate(contacts):
        before[number] = np.where(solved, friction[k] * alongs[number], before.get(number, 0.0))
    block.friction.clear()
    block.friction.update(before)
    return solved


def _anew(reactions: Reactions) -> None:
    """Forget what was formed with the friction before."""
    reactions.scene.setting.drive = None
    for block in reactions.scene.blocks(reactions.scene.case.places):
        block.forget()
