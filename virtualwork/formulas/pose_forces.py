"""The forces of one pose: effort by virtual work, joint forces by Newton and Euler, sums of loads; of floats, or of recorded numbers.

The velocity coefficients are the virtual displacements: for a unit of input j every point moves by K_j = ∂P/∂q_j and every link turns
by κ_j = ∂θ/∂q_j, so that by d'Alembert's principle (Riul, unit II, eqs. 3 and 5, divided by the input's own displacement)

    τ_j + Σ F·K_j + Σ T κ_j = 0,      F, T with the inertia loads −m a_G and −I α.

Joint forces do no work and do not appear. Every K_j is Σ i z e^{iθ} κ_j over the links between the ground and the point. The effort
gathers the loads by links first, Q_θ = Σ T + Σ (z e^{iθ}) × F, and is −Σ Q_θ κ_j; the ledger takes the loads one by one.

How joint forces follow from each other is worked out once for a mechanism (`load_paths`); here the combinations become numbers.

What a tape does not solve enters it. The friction of each contact (`friction 0`, `friction 1` …: the torque of a pin, the force
along a guide) is exchanged for the forces that the contacts bear until the two fit (`friction`). A system whose rank is not known,
as where statics is redundant, is solved outside (`statics`): the entries of A and b are on the tape, and the joint forces by
unknowns that enter, with A f + b = 0 (`f 0`, `f 1` …; torques divided by the size).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cached_property

from dalembert.arithmetic.recorded import bare
from virtualwork.describe.parts import GROUND, TorsionSpring
from virtualwork.formulas.force_terms import Combination
from virtualwork.formulas.load_case import LoadCase
from virtualwork.formulas.load_paths import LoadPaths
from virtualwork.formulas.loaded_pose import LoadedPose, Shared, Table
from virtualwork.formulas.loads import applied_loads, reduced, resultant, shaking_loads
from virtualwork.formulas.numbers import WRITTEN, Number, dot, minus, plus, times
from virtualwork.formulas.positions import State
from virtualwork.formulas.quantity import Quantity, Recording
from virtualwork.formulas.rates import Rates
from virtualwork.formulas.statics import Column, equations, mesh_column, unknowns
from virtualwork.plan.joint_forces import Side
from virtualwork.plan.steps import Joint

# a rate of a contact beside those of all links that is rounding alone, also where the pose is ill-conditioned
AT_REST = 2.0**-40


class PoseForces:
    """The forces of a pose, as the kinds of `forces.Force` read them.

    Attributes
    ----------
    paths : LoadPaths
    order : Order
        In which order the joint forces follow from each other.
    pose : LoadedPose
        The pose as the loads see it.
    formed : dict of quantity to its value

    Parameters
    ----------
    solve : function
        Works out what targets depend on, to an order of derivatives.
    system : function
        Solves rows·x = right.
    enter : function
        A number that enters, by its name.
    """

    def __init__(
        self,
        paths: LoadPaths,
        pose: LoadedPose,
        solve: Callable[[Iterable[str], int], None],
        system: Callable[[list[list[Number]], list[Number]], list[Number]],
        enter: Callable[[str], Number],
    ) -> None:
        self.paths, self.case, self.mechanism = paths, paths.case, paths.mechanism
        self.pose, self.solve, self.system_of, self.enter = pose, solve, system, enter
        self.order = paths.order
        self.formed: dict[Quantity, Number] = {}
        self._placed = False
        pose.drive = lambda j: self.efforts[j]
        solve(*self.case.targets())
        if self.case.contacts:
            self.solve_places()
        for n, (joint, *_) in enumerate(self.case.contacts):
            rub = enter(f"friction {n}")
            pose.friction[n] = rub if joint.guide is None else rub * pose.rail(joint.guide)

    @property
    def redundant(self) -> bool:
        """Whether statics cannot give every joint force, so that unknown ones enter."""
        return self.order.redundant

    def solve_places(self) -> None:
        """Solve what the places of all joints depend on, once."""
        if not self._placed:
            self.solve(*self.case.targets(self.case.places))
            self._placed = True

    # --- the inputs and the ground ----------------------------------------------------------------------------------
    @cached_property
    def efforts(self) -> list[Number]:
        """The effort at each input by virtual work, through the carriers of motors."""
        m, k = self.mechanism, len(self.mechanism.inputs)
        force = [self.generalized(j) for j in range(k)]
        if not m.carried:
            return force
        matrix: list[list[Number]] = [[float(i == j) for j in range(k)] for i in range(k)]
        for j in m.carried:
            link, carrier = str(m.inputs[j].link), m.carrier(j)
            self.solve([f"angle:{link}", f"angle:{carrier}"], 1)
            for i in range(k):
                matrix[i][j] = self._apart(*(self.pose.turning(body, i) for body in (link, carrier)))
        return self.system_of(matrix, force) if k > 1 else [force[0] / matrix[0][0]]

    def _apart(self, driven: Number, carried: Number) -> Number:
        """The rate of a driven link against its carrier, or 0 where both turn alike but for rounding: the motor does no work."""
        if carried is None:
            return 0.0 if driven is None else driven
        if driven is None:
            return -carried
        rate = driven - carried
        least = AT_REST * (abs(driven) + abs(carried))
        return self.pose.kind.select(abs(rate) - least, rate, 0.0)

    def generalized(self, j: int) -> Number:
        total: Number = None
        for body, guide, load in self.paths.working:
            moved = self.pose.by[j].slide[guide][0] if body is None else self.pose.turning(body, j)
            # what cannot move is not evaluated
            if moved is not None:
                value = self._value(load)
                total = plus(total, value if isinstance(moved, float) and moved == 1 else times(value, moved))
        return 0.0 if total is None else -bare(total)

    def newton_euler(self, j: int) -> Number:
        """By ΣM = 0 of the driven link, or the force along the slide."""
        entry = self.mechanism.inputs[j]
        if self.redundant:
            return self._bears("force" if entry.is_slide else "torque", str(j))
        self.solve_places()
        if not entry.is_slide:
            return self._value(self.paths.couple("input", j))
        guide = self.mechanism.guide_of(entry)
        value = self._side((f"guide:{guide}", self.mechanism.guides[guide].link))
        value = None if value is None else dot(value, self.pose.rail(guide))
        for mesh in self.order.racks.get(guide, ()):
            value = minus(value, self.mesh(mesh))
        return value

    def shaking(self) -> tuple[Number, Number]:
        return resultant(shaking_loads(self.case.loads), self.pose)

    # --- loads ------------------------------------------------------------------------------------------------------
    def applied(self, link: str) -> tuple[Number, Number]:
        self.solve([f"angle:{link}"], 0)
        loads = applied_loads(self.case.everything, link)
        return reduced(loads, self.pose, self.mechanism.rigid[link].center)

    def load_place(self, number: int) -> Number:
        path = self.case.loads[number].path
        assert path is not None
        self.solve_places()
        return self.pose.position(path)

    # --- joints -----------------------------------------------------------------------------------------------------
    def rail(self, guide: int) -> Number:
        self.solve_places()
        return self.pose.rail(guide)

    def _value(self, terms: Combination) -> Number:
        return self.paths.value(self.pose, terms)

    def _side(self, side: Side) -> Number:
        """The force of a joint on a body, complex, as the equilibrium of bodies and pins has it; None where it is zero throughout."""
        joint, body = side
        self.pose.names.add(f"{joint} on {body}")
        return self._value(self.paths.side(side))

    def force(self, joint: str, body: str) -> Number:
        """The force of a joint on a body, without the force of an input that drives it."""
        self.solve_places()
        at = self.order.by_key[joint]
        guide = at.guide
        if not self.redundant:
            value = self._side((joint, body))
            if guide is not None and value is not None and self.order.is_pushed(guide):
                # along a driven guide the joint's own equilibrium leaves the effort, which is a result of its own, or a tooth force
                rail = self.pose.rail(guide)
                value = value - dot(value, rail) * rail
        elif guide is not None:
            sign = 1.0 if body == self.mechanism.guides[guide].link else -1.0
            value = (sign * self._bears("normal", joint)) * (1j * self.pose.rail(guide))
        elif body == GROUND:
            return -sum((self.force(joint, other) for other in at.bodies if other != GROUND), 0j)
        else:
            value = self._bears("fx", joint, body) + 1j * self._bears("fy", joint, body)
        return plus(plus(value, self._borne(at, body)), self._rubbed(at, body))

    def _borne(self, joint: Joint, body: str) -> Number:
        """What the bearing of a rack's wheel bears of the tooth force, on one body."""
        total: Number = None
        for guide, meshes in self.order.racks.items() if joint.guide is None else ():
            for mesh in meshes:
                if self.order.meshing(mesh) != joint.name:
                    continue
                wheel, carrier = self.mechanism.meshes[mesh].wheel, self.mechanism.guides[guide].on
                if body in (wheel, carrier):
                    force = times(self.pose.rail(guide), self.mesh(mesh))
                    total = plus(total, force) if body == wheel else minus(total, force)
        return total

    def _rubbed(self, joint: Joint, body: str) -> Number:
        """The friction force along a guide belongs to its reaction."""
        total: Number = None
        for load in self.case.friction:
            if load.path is None or load.joint != joint.key:
                continue
            # no load stands there: it feels the reverse of the other body's
            if body == GROUND:
                total = minus(total, load.form(self.pose))
            elif load.body == body:
                total = plus(total, load.form(self.pose))
        return total

    def moment(self, joint: str, body: str) -> Number:
        """The moment of a joint on a body about its point: a guide's, or a pin's friction."""
        self.solve_places()
        guide, value = self.order.by_key[joint].guide, None
        if guide is not None and self.mechanism.guides[guide].is_slider:
            own = (
                self._bears("moment", joint)
                if self.redundant
                else self._value(self.paths.couple("guide", guide))
            )
            value = plus(own, self._beside(guide))
            value = value if value is None or body == self.mechanism.guides[guide].link else -value
        for load in self.case.friction:
            if load.path is None and load.joint == joint and load.body == body:
                value = plus(value, load.form(self.pose))
        return value

    def _beside(self, guide: int) -> Number:
        """The load of a guide whose link teeth push, off the guide's line: at the pitch point of the wheel."""
        g, m = self.mechanism.guides[guide], self.mechanism
        total: Number = None
        for mesh in self.order.racks.get(guide, ()):
            pin, rack = self.order.meshing(mesh), m.meshes[mesh].rack
            if pin and rack is not None:
                off = m.bodies[g.on][pin] - m.through(g)
                across = dot(1j * self.paths.plan.directions[guide], off) - rack.radius
                total = plus(total, times(across, self.mesh(mesh)))
        return total

    def contact(self, cam: int) -> Number:
        """How hard a cam presses on its follower along the normal; below zero it would have to pull."""
        self.solve_places()
        touch = self.paths.touches.every[cam]
        self.solve(touch.targets, 0)
        push = self._bears("contact", str(cam)) if self.redundant else self._value(self.paths.push(touch))
        return times(times(touch.drive.cam.sign, abs(touch.at(self.pose.st).unit())), push)

    def mesh(self, mesh: int) -> Number:
        """The tooth force of a rack along its slide, positive on the link of the guide; the torque of a gear or a belt."""
        self.solve_places()
        if self.redundant:
            return self._bears(*mesh_column(self.mechanism, mesh))
        of = self.mechanism.meshes[mesh]
        return self._value(self.paths.couple(of.kind, mesh) if of.guide is None else self.paths.tooth(mesh))

    def tooth_place(self, mesh: int) -> Number:
        self.solve_places()
        of, bodies = self.mechanism.meshes[mesh], self.mechanism.bodies
        assert of.guide is not None
        assert of.rack is not None
        guide, pin = self.mechanism.guides[of.guide], self.order.meshing(mesh)
        # the wheel turns on a pin of the guide's body, or rolls along it
        body, point, side = (of.wheel, pin, -1j) if pin else (guide.link, guide.point, 1j)
        axis = self.pose.position(self.case.path(body, bodies[body][point]))
        return plus(axis, times(side * of.rack.radius, self.pose.rail(of.guide)))

    # --- redundant statics ------------------------------------------------------------------------------------------
    @cached_property
    def unknowns(self) -> list[Column]:
        """The joint forces and torques that enter where statics is redundant."""
        return unknowns(self.order)

    @cached_property
    def system(self) -> dict[tuple[int, int | None], Number]:
        """The entries of A by row and column, those of b by row and None."""
        self.solve_places()
        for touch in self.paths.touches.every:
            self.solve(touch.targets, 0)
        entries: dict[tuple[int, int | None], Number] = {}
        for row, column, part in equations(self.paths, self.pose):
            entries[row, column] = entries.get((row, column), 0.0) + bare(part)
        return entries

    def _bears(self, kind: str, key: str, body: str = "") -> Number:
        f = self.enter(f"f {self.unknowns.index((kind, key, body))}")
        turns = kind == "contact" and self.mechanism.cam_drives[int(key)].guide is None
        return f * bare(self.mechanism.size) if turns or kind in ("moment", "gear", "torque") else f

    # --- friction ---------------------------------------------------------------------------------------------------
    def bearing(self, n: int) -> Number:
        self.solve_places()
        joint, body, *_ = self.case.contacts[n]
        if self.redundant:
            force = self.force(joint.key, body)
        else:
            force = plus(self._side((joint.key, body)), self._borne(joint, body))
        if force is None or joint.guide is None:
            return force
        return dot(force, 1j * self.pose.rail(joint.guide))

    def rubbing_rate(self, n: int) -> Number:
        self.solve_places()
        joint, body, other, *_ = self.case.contacts[n]
        if joint.guide is not None:
            return self.pose.slide_rate(joint.guide)
        return minus(self.pose.omega(body), self.pose.omega(other))

    def slipping_rate(self, n: int) -> Number:
        """The rate of a contact, or 0 where it is negligible against the rates of all links: the parts do not move against each other."""
        rate = self.rubbing_rate(n)
        if rate is None:
            return None
        m, pose = self.mechanism, self.pose
        self.solve([*(f"angle:{body}" for body in m.links), *(f"slide:{i}" for i in range(len(m.guides)))], 1)
        size = float(complex(m.size).real)
        all_: Number = 0.0
        for turning in map(pose.omega, m.links):
            all_ = all_ if turning is None else all_ + abs(turning) * size
        for sliding in map(pose.slide_rate, range(len(m.guides))):
            all_ = all_ if sliding is None else all_ + abs(sliding)
        least = all_ * (AT_REST if self.case.contacts[n][0].guide is not None else AT_REST / size)
        return pose.kind.select(abs(rate) - least, rate, 0.0)


class RecordedSetting(Shared):
    """Rates and twists that enter the tape."""

    def __init__(self, recording: Recording) -> None:
        super().__init__(recording.mechanism, recording.plan)
        self.recording, self.turn = recording, recording.turn

    @property
    def rates(self) -> tuple[Number, Number]:
        """q̇ and q̈ of the one input."""
        speed, acceleration, _ = self.recording.rates
        return speed[0], acceleration[0]

    def wound(self, spring: TorsionSpring, st: State, within: Number) -> Number:
        """The twist next to the one that enters."""
        number = self.mechanism.torsion_springs.index(spring)
        return self.recording.unwrapped(f"near spring {number}", WRITTEN.exp(within))


class RecordedPose(LoadedPose):
    """The recorded pose as the loads see it."""

    def __init__(self, recording: Recording, along: Rates | None, by: list[Rates]) -> None:
        super().__init__(RecordedSetting(recording), recording.st, along, by)
        self.recording = recording

    def table(self, load: Table) -> Number:
        """The force of a table, as it enters."""
        return self._entering("table", load)

    def slope(self, load: Table) -> Number:
        """How steep it is, as it enters."""
        return self._entering("slope", load)

    def _entering(self, what: str, load: Table) -> Number:
        number = next(i for i, of in enumerate(self.recording.tables) if load.alike(of))
        enter = self.recording.recorder.input
        return WRITTEN.join(enter(f"{what} {number} x"), enter(f"{what} {number} y"))


def forces_of(recording: Recording) -> PoseForces:
    """The forces of the recorded pose; friction and redundant joint forces enter the tape."""
    paths = LoadPaths(LoadCase(recording.mechanism, recording.plan, any(recording.moves[:2])))
    pose = RecordedPose(recording, recording.together, recording.by)
    return PoseForces(paths, pose, recording.solve, recording.kind.system, recording.recorder.input)
