"""The guess read: each group's assembly is picked in the order of solution, the one nearest to what the guess says."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from dalembert.arithmetic.recorded import bare, squared
from dalembert.arithmetic.varied import rotation
from virtualwork.branch.choice import Choice
from virtualwork.branch.phases import Phases
from virtualwork.describe import AssemblyError, MechanismError, MobilityError, ParallelGuidesError
from virtualwork.describe.description import Description, known_by_guess
from virtualwork.formulas.closed_forms import Case
from virtualwork.formulas.group_loops import Loops, unknowns, write_unknowns
from virtualwork.formulas.newton import newton
from virtualwork.formulas.numbers import Number, cross, dot
from virtualwork.formulas.positions import State, principal, run
from virtualwork.plan.order import plan
from virtualwork.plan.steps import Group, Plan, Step, Turn

C = TypeVar("C", bound=Choice)
# rad, or of the mechanism's size: how far beside a guess that tells nothing one looks
BESIDE = 0.02
# rad, or of the mechanism's size: how far off a rough guess may be; and how many times nearer is clearly nearer
ROUGH, CLEARLY = 0.5, 3.0
# rad: a larger angle of a guess is mostly one in degrees
LARGE = 4 * np.pi + 1e-9


def choose(m: Description, make: Callable[..., C]) -> C:
    """The assembly that the guess chooses; `make` takes what a `Choice` holds.

    Raises
    ------
    AssemblyError
        Where the guess is missing and there is more than one: the choices are listed.
    """
    return _Chooser(m).choose(make)


class _Chooser:
    """Reads the guess and picks each group's assembly in the order of solution."""

    def __init__(self, m: Description) -> None:
        self.m, self.plan = m, plan(m)
        if not m.inputs:
            raise MobilityError("[input]: missing")
        self.angles, self.points = known_by_guess(m)
        # what an assembly holds, as far as it is known; of gears: Σ c·θ
        self.signs: dict[str, int] = {}
        self.starts: dict[str, tuple[float, ...]] = {}
        self.warnings: list[str] = []
        self.phases: dict[int, float] = {}
        self.cases: dict[str, Case] = {}
        self.systems: dict[Group, Loops] = {}
        # of the first input: 1 rad, or the mechanism's size
        self.unit = m.size if m.inputs[0].is_slide else 1.0

    def choose(self, make: Callable[..., C]) -> C:
        """The assembly; a mechanism of which a part floats is refused by that part's name."""
        st = State(list(self.m.at))
        self._warn_of_large_angles()
        try:
            loose = any(2 * len(g.closures) < len(g.angles) + len(g.slides) for g in self.plan.groups)
            if loose or not self.plan.anchors.keys() >= self.m.links.keys():
                raise MobilityError(
                    "[input]: a part can still move, because some constraints depend on each other: add a joint or an [[input]]"
                )
            self._walk(st)
        except ParallelGuidesError:
            raise
        except (MechanismError, ZeroDivisionError) as error:
            self._refuse_floating()
            if isinstance(error, MechanismError):
                raise
            raise AssemblyError(
                "[guess] at: the mechanism is singular there, its motion is not determined: change `at`"
            ) from None
        if self._singular(st):
            self._refuse_floating()
        return self._made(make, tuple(self.warnings))

    def _made(self, make: Callable[..., C], warnings: tuple[str, ...] = ()) -> C:
        """What is chosen so far."""
        result = make(self.m, self.plan, self.signs, self.starts, 1, warnings, self.phases)
        result.cases.update(self.cases)
        result.systems.update(self.systems)
        return result

    def _singular(self, st: State) -> bool:
        """Whether a group has a singular Jacobian at the guess, or none at all."""
        for group in self.plan.groups:
            if group.kind != "Newton":
                if not st.margin.get(group.name, 0.0) > 1e-12:
                    return True
            else:
                x = np.array([unknowns(group, st)], dtype=float)
                _, (jacobian,) = self.systems[group].over(st)(x)
                jacobian[:, : len(group.angles)] /= self.m.size
                if not np.isfinite(jacobian).all() or not np.linalg.cond(jacobian) < 1e9:
                    return True
        return False

    def _refuse_floating(self) -> None:
        """Refuse a mechanism of which a part is free though the count of its joints and inputs says otherwise."""
        from virtualwork.formulas.constraints import hidden_freedom

        x = []
        for name, link in self.m.links.items():
            turn = complex(np.exp(1j * self.angles.get(name, 0.0)))
            origin = next((self.points[p] - z * turn for p, z in link.points.items() if p in self.points), 0j)
            x += [self.angles.get(name, 0.0), origin.real / self.m.size, origin.imag / self.m.size]
        freedom = hidden_freedom(self.m, np.array(x))
        if freedom is not None:
            links, joints = freedom
            names = ", ".join(e.name for e in self.m.inputs)
            raise MobilityError(
                f"a free degree of freedom: {', '.join(links)} can still move while every input ({names}) is held, "
                f"though by the count the mobility is {self.plan.blocks.mobility}: {', '.join(joints)} "
                "depend on each other; join the part that is free"
            )

    def _refuse_overdriven(self, st: State) -> None:
        """Constraints that depend on each other may leave less motion than there are inputs."""
        from virtualwork.formulas.constraints import Constraints, coordinates

        jacobian = Constraints.at(self.m, coordinates(self.m, self.plan, st), {}).jacobian
        if np.isnan(jacobian).any():
            # a group cannot be assembled at the guess, as a warning says: no motion is left to be counted there
            return
        try:
            s = np.linalg.svd(jacobian, compute_uv=False)
        except np.linalg.LinAlgError:
            raise AssemblyError(
                "the lengths of the links differ too much to determine the mechanism's mobility"
            ) from None
        inputs = self.m.inputs
        left = 3 * len(self.m.links) - int((s > 1e-9 * s[0]).sum())
        counted = self.plan.blocks.mobility
        if left < len(inputs) or 1 <= counted < len(inputs):
            left = min(left, counted) if counted >= 1 else left
            names = ", ".join(e.name for e in inputs)
            what = "the joints leave no motion, it is a structure" if left == 0 else f"mobility {left}"
            raise MobilityError(f"[input]: {len(inputs)} input(s) ({names}), but {what}")

    def _walk(self, st: State) -> None:
        """Pick the assembly of each group, and the constants of gears, in the order of solution."""
        waiting: list[Step] = []
        phases = Phases(self.m, self.angles, self.points, float)
        for i, step in enumerate(self.plan.steps):
            if isinstance(step, Group) or (isinstance(step, Turn) and step.angle.gears):
                run(waiting, st)
                waiting = []
            phased = phases.step(step, st)
            if phased is not step:
                self.plan = replace(
                    self.plan, steps=(*self.plan.steps[:i], phased, *self.plan.steps[i + 1 :])
                )
                step = phased
            if not isinstance(step, Group):
                waiting.append(step)
            elif step.kind == "Newton":
                self.starts[step.name] = tuple(map(float, self._newton(step, st)))
            else:
                case = self.cases[step.name] = Case(step)
                self.signs[step.name] = self._sign(step, case, st)
                st.angle.update({b: float(principal(np.angle(st.turn[b]))) for b in step.members})
        run(waiting, st)
        if self.plan.blocks.redundant:
            self._refuse_overdriven(st)
        self.phases = {
            i: sum(
                c * float(st.slide[x] if isinstance(x, int) else st.angle[x]) for x, c in mesh.shares.items()
            )
            for i, mesh in enumerate(self.m.meshes)
        }

    # --- closed forms -------------------------------------------------------------------------------------------
    def _sign(self, group: Group, case: Case, st: State) -> int:
        """The sign of a closed form, which is put into the state."""
        if group.kind == "PRP":
            try:
                case.solve(st, 1, self.m.size)
            except ZeroDivisionError:
                raise ParallelGuidesError(
                    f"{group.name}: its two guides are parallel and do not determine its position; expected "
                    "guides of different directions (`angle`)"
                ) from None
            return 1
        solutions = self._solutions(group, case, st)
        if not solutions:
            ahead = self._ahead(group, case)
            if ahead is None or not informed(self.m, group):
                st.turn.update({b: complex(np.nan, np.nan) for b in group.members})
                st.slide.update(dict.fromkeys(group.slides, np.nan))
                return self._sign_of_guess(group, case, st)
            # no direction is determined there: it stands as just beyond
            self.warnings.append(self._meeting(group))
            sign, near = (1, -1)[int(np.argmin(ahead))], self._beside(group, 1e-7 * self.unit)
            case.solve(near, sign, self.m.size)
            st.turn.update({b: near.turn[b] for b in group.members})
            st.slide.update({g: near.slide[g] for g in group.slides})
            return sign
        named = [self._distances(group, trial) for _, trial in solutions]
        distances = [sum(each.values()) for each in named]
        # a guess to full precision tells apart even assemblies that all but meet; distances are squares
        clear = min(distances) < 1e-3 * max(distances) and max(distances) > 1e-28
        if len(solutions) == 2 and abs(solutions[0][1].margin[group.name]) < 1e-14 and not clear:
            ahead = self._ahead(group, case, solutions[0][1])
            if ahead is not None:
                distances = ahead
            self.warnings.append(self._meeting(group))
        elif len(solutions) == 2 and not informed(self.m, group):
            raise AssemblyError(self._choices(group, [t for _, t in solutions]))
        best = int(np.argmin(distances))
        sign, chosen = solutions[best]
        if len(solutions) == 2:
            self._warn_of_contradictions(
                group, [named[best], named[1 - best]], [chosen, solutions[1 - best][1]]
            )
        for name in ("turn", "point", "slide", "angle", "margin"):
            getattr(st, name).update(getattr(chosen, name))
        return sign

    def _warn_of_large_angles(self) -> None:
        """Warn of each angle of the guess that is more than two turns: mostly it is in degrees, but was read in radians."""
        of_guess = self.m.guess.at is not None
        every = [
            (f"[guess] at {e.name}" if of_guess else f"[input] {e.name}", at)
            for e, at in zip(self.m.inputs, self.m.at, strict=True)
            if not e.is_slide
        ]
        every += [(f"[guess] {link}", angle) for link, angle in self.m.guess.angles.items()]
        for name, angle in every:
            if abs(angle) > LARGE:
                self.warnings.append(
                    f"{name}: {angle:.4g} rad is {abs(angle) / (2 * np.pi):.3g} turns: an angle without a unit is in radians, "
                    'unless [units] has angle = "deg"'
                )

    def _warn_of_contradictions(
        self, group: Group, squares: list[dict[tuple[str, str], float]], states: list[State]
    ) -> None:
        """Warn of each guess that is clearly nearer to the second of two assemblies than to the first, which is taken."""
        guess, links, anchors = self.m.guess, self.m.links, self.plan.anchors
        for (body, point), far in squares[0].items():
            if far < max(ROUGH**2, CLEARLY**2 * squares[1][body, point]):
                continue
            if point in guess.points:
                at = links[body].points[point]
                places = [st.origins({body: anchors[body]})[body] + at * st.turn[body] for st in states]
                shown = [f"({z.real:.4g}, {z.imag:.4g}) m" for z in (guess.points[point], *places)]
            elif not point and body in guess.angles:
                turns = [guess.angles[body], *(np.angle(st.turn[body]) for st in states)]
                shown = [f"{np.degrees(turn):.4g} deg" for turn in turns]
            else:
                continue
            text = (
                f"[guess] {point or body}: {shown[0]} contradicts the other guesses: they select the assembly of "
                f"{group.name} with {shown[1]}; the other assembly has {shown[2]}: correct one of the guesses"
            )
            # a point of two links once
            self.warnings += [text] if text not in self.warnings else []

    def _solutions(self, group: Group, case: Case, st: State) -> list[tuple[int, State]]:
        """The signs of which a closed form has a solution, each with that."""
        solutions = []
        for sign in (1, -1):
            trial = st.copy()
            try:
                case.solve(trial, sign, self.m.size)
            except ZeroDivisionError:
                continue
            unknowns = [*(trial.turn[b] for b in group.members), *(trial.slide[g] for g in group.slides)]
            if all(map(np.isfinite, unknowns)):
                solutions.append((sign, trial))
        return solutions

    def _beside(self, group: Group, apart: float) -> State:
        """What a group depends on, with the one input so far from the guess, rad or m."""
        st = State([self.m.at[0] + apart])
        chosen = self._made(Choice)
        chosen.run_untracked(chosen.before(group), st)
        return st

    def _ahead(self, group: Group, case: Case, here: State | None = None) -> list[float] | None:
        """How far the group's two assemblies go a little beyond the guess.

        Each link's least distance to standing still or to turning with the input, so that a parallelogram is
        preferred to its antiparallel twin; where the pose itself is not determined, the distance to the guess.
        """
        if len(self.m.inputs) != 1:
            return None
        step = BESIDE * self.unit
        for side in (1, -1):
            try:
                st = self._beside(group, side * step)
            except (KeyError, ZeroDivisionError):
                return None
            solutions = self._solutions(group, case, st)
            if len(solutions) < 2:
                continue
            if here is None or not group.members:
                distances = [sum(self._distances(group, trial).values()) for _, trial in solutions]
            else:
                turned = complex(np.exp(1j * side * step))
                distances = [
                    sum(
                        min(abs(e - trial.turn[b]), abs(e * turned - trial.turn[b]))
                        for b in group.members
                        for e in [here.turn[b]]
                    )
                    for _, trial in solutions
                ]
            # seen from before the point, the Jacobian has the other sign on the same branch
            return distances if side > 0 else distances[::-1]
        return None

    def _sign_of_guess(self, group: Group, case: Case, st: State) -> int:
        """Not assembled at the guess: the sign that the guessed angles would have."""
        gap = case.gap(st)
        why = "" if gap is None else f" ({gap.text('{:.6g} m'.format)})"
        self.warnings.append(
            f"[guess] at: {group.name} cannot be assembled there{why}; its branch is that of the guessed angles"
        )
        try:
            seen = sign_of_angles(group, case, st, self.angles)
        except (KeyError, TypeError, ZeroDivisionError):
            seen = None
        return 1 if seen is None or seen >= 0 else -1

    def _meeting(self, group: Group) -> str:
        return (
            f"[guess] at: {group.name} is at a change point or a limit there, where its two assemblies meet: "
            "the one whose links do not turn, or turn with the input, is used; change `at` to choose the other"
        )

    def _choices(self, group: Group, states: list[State]) -> str:
        texts = []
        for st in states:
            parts = [f"{b} = {np.degrees(np.angle(st.turn[b])):.4g} deg" for b in group.members]
            parts += [f"{self.m.guides[g].point} at {st.slide[g]:.4g} m" for g in group.slides]
            texts.append(", ".join(parts))
        ways = "; or ".join(texts)
        return f"[guess]: {group.name} can be assembled in {len(texts)} ways; choose one: {ways}"

    def _distances(self, group: Group, st: State) -> dict[tuple[str, str], float]:
        return distances(group, st, self.plan, self.m, self.angles, self.points)

    # --- groups with no closed form -------------------------------------------------------------------------------
    def _newton(self, group: Group, st: State) -> Any:
        # a mechanism whose groups all have a closed form does not load this
        from virtualwork.branch.solutions import every_solution, guessed_unknowns

        loops, why = self.systems.setdefault(group, Loops(group)), ""
        start = guessed_unknowns(group, st.copy(), self.angles, self.points, self.m, self.plan.directions)
        if start is not None:
            x, closed = newton(loops, st, start, self.m.size)
            if closed[0]:
                write_unknowns(group, st, x)
                return x[0]
            left = float(np.linalg.norm(loops.over(st)(x)[0]))
            why = f": from the guess its loops keep a gap of {left:.6g} m"
        result = every_solution(loops, st, self.m.size)
        if len(result) == 0 and len(group.angles) + len(group.slides) < 2 * len(group.closures):
            raise MobilityError(
                f"{group.name}{': ' * bool(group.name)}more constraints than unknowns, and they contradict each other: a "
                "structure, or lengths "
                f"that do not fit (look at {', '.join(self.plan.blocks.redundant)})"
            )
        if len(result) == 0:
            raise AssemblyError(
                f"[guess] at: {group.name} cannot be assembled there{why} (Newton-Raphson from many starts finds no "
                "closed loop); give an `at` where it can, or check the lengths"
            )
        states = []
        for x in result:
            trial = st.copy()
            write_unknowns(group, trial, x[None])
            states.append(trial)
        if len(result) > 1 and not informed(self.m, group):
            raise AssemblyError(self._choices(group, states))
        best = int(np.argmin([sum(self._distances(group, trial).values()) for trial in states]))
        write_unknowns(group, st, result[best][None])
        return result[best]


def distances(
    group: Group,
    st: State,
    done: Plan,
    m: Description,
    angles: Mapping[str, Number],
    points: Mapping[str, Number],
) -> dict[tuple[str, str], Any]:
    """How far an assembly is from each guess, squared: chords of the unit circle by (link, ""), points relative to the size by (link, point)."""
    result = {}
    named = {
        body: [(name, z) for name, z in m.links[body].points.items() if name in points]
        for body in group.links
    }
    origins = st.origins({body: done.anchors[body] for body, here in named.items() if here})
    for body in group.links:
        if body in angles and body in st.turn:
            result[body, ""] = squared(bare(st.turn[body] - bare(rotation(angles[body]))))
        if body in origins:
            for name, z in named[body]:
                here = origins[body] + z * st.turn[body]
                result[body, name] = squared(bare(here - points[name])) / bare(m.size**2)
    return result


def sign_of_angles(group: Group, case: Case, st: State, angles: Mapping[str, Number]) -> Number:
    """The sine or cosine that a closed form's sign is of, at the guessed angles; None where they do not say."""
    e = [rotation(angles[b]) if b in angles else None for b in group.angles]
    if group.kind == "RRR" and e[0] is not None and e[1] is not None:
        v, u = case.arm(0, st), case.arm(1, st)
        return bare(cross(v * e[0], u * e[1]) / (abs(v) * abs(u)))
    if group.kind == "RRP" and e[0] is not None:
        v, (z, body) = case.arm(0, st), case.rails[0]
        return bare(dot(v * e[0], z * st.turn[body]) / abs(v))
    return None


def informed(m: Description, group: Group) -> bool:
    """Does the guess say anything about the links of this group?"""
    guess = m.guess
    return any(b in guess.angles for b in group.links) or any(
        p in guess.points for b in group.links for p in m.links[b].points
    )
