"""The formulas of one assembly written down with some of its dimensions as inputs of the tape."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any

from dalembert.arithmetic.adjoint import derivatives
from dalembert.arithmetic.guard import guarded, own_lock
from dalembert.arithmetic.recorded import RECORDED, Recorder, bare
from dalembert.arithmetic.tape import Tape
from dalembert.arithmetic.varied import Varied
from virtualwork.branch.assembly import Assembly
from virtualwork.branch.guess import distances, sign_of_angles
from virtualwork.branch.phases import Phases, with_constants
from virtualwork.branch.solutions import of_guess
from virtualwork.describe.description import Description, joints_apart, known_by_guess
from virtualwork.describe.dimensions import Dimension, changed, number_of
from virtualwork.describe.keys import keys_of
from virtualwork.describe.parts import Link
from virtualwork.formulas.closed_forms import Case, missing
from virtualwork.formulas.group_loops import Loops, gaps, put_unknowns, unknowns
from virtualwork.formulas.loops import Closed, Margin, Regularity, Size
from virtualwork.formulas.numbers import PARTS, SINGULAR, WRITTEN, Number
from virtualwork.formulas.positions import State, columns, principal_of, run
from virtualwork.formulas.quantity import Quantity
from virtualwork.formulas.recording import NEAR, Recording
from virtualwork.plan.order import plan
from virtualwork.plan.steps import Group, Plan, geared, turns

# what the tape of the choice says of each group
CHOICE = ("margin", "plus", "minus", "guessed", "sign")
# radicand (a squared sine) below which a guess stands at a change point or a limit, or nearly so
CLOSE = 1e-9
# of two assemblies the nearer one is certain if its squared distance is below this share of the other's
TOLD = 0.5
# the radicand above which no change point is within two steps of `branches.STEP`: it grows with the square of the distance
CLEAR = 0.2
# and below which it may dip down to one between samples that are one step apart
DIP = 0.05


@guarded
class VariedFormulas:
    """Formulas of an assembly, in which dimensions are inputs of the tape, called by their paths.

    Parameters
    ----------
    assembly : Assembly
        Of the description that the dimensions are varied of.
    dimensions : sequence of Dimension
        None of an input of the mechanism: those enter as its value and rates.
    moves : tuple of bool
        Whether the inputs have a speed, an acceleration, a jerk.
    own_signs : bool
        Whether the sign of every closed form enters too (`sign GROUP`), as each variant has its own.
    settled : bool
        See `Recording`.
    """

    def __init__(
        self,
        assembly: Assembly,
        dimensions: Sequence[Dimension],
        moves: tuple[bool, ...],
        own_signs: bool,
        settled: bool = True,
    ) -> None:
        recorder = Recorder()
        # that of the recording
        self.lock = own_lock(recorder)
        m: Description = assembly.mechanism
        self.mechanism = varied(m, dimensions, recorder)
        self.plan = self._open_plan = plan(self.mechanism)
        # whether a gear's constant is that of links which the guess has to place first
        self.phases = sorted({i for turn in turns(self.plan.steps) for i, _ in turn.angle.gears})
        self.open_gears = bool(self.phases)
        # the same of one assembly with its own signs, whose links the tape places at the guess
        self.placed = not self.open_gears
        winding = assembly.geared
        if self.open_gears and own_signs:
            enter = {i: recorder.input(f"phase {i}") for i in self.phases}
            self.plan, winding = with_constants(self.plan, enter), geared(self.plan.steps)
        elif self.open_gears:
            placed = _placed(self.mechanism, self.plan, assembly)
            if placed is not None:
                self.plan, self.placed = placed, True
        # two slides have one solution: their sign is that of any
        signs = {g.name: assembly.signs.get(g.name, 1) for g in self.plan.groups if g.kind != "Newton"}
        turning = [g.name for g in self.closed] if own_signs else assembly.turning_over
        self.recording = Recording(
            self.mechanism, self.plan, signs, moves, turning, winding, settled, recorder
        )
        self._tapes: dict[tuple[Any, ...], Tape] = {}
        # of each group without a closed form the unknowns that the guess leaves to the loops, once `guessed` is written
        self.free: dict[str, list[int]] = {}

    @cached_property
    def closed(self) -> list[Group]:
        """The groups with a closed form that has two branches."""
        return [g for g in self.plan.groups if g.kind not in ("Newton", "PRP")]

    @cached_property
    def iterated(self) -> list[Group]:
        """The groups without a closed form."""
        return [g for g in self.plan.groups if g.kind == "Newton"]

    @property
    def follows(self) -> bool:
        """Whether the groups without a closed form can be followed along the inputs, for all variants at once.

        The guess has to say all their angles, and the ratios of what is tied to them are those of all variants.
        """
        angles, _ = known_by_guess(self.mechanism)
        tied = [tie.angle for group in self.iterated for tie in group.ties]
        factors = [r for angle in tied for _, r in (*angle.inputs, *angle.bases)]
        return not (
            any(isinstance(r, Varied) for r in factors)
            or any(angle.cams for angle in tied)
            or any(body not in angles for group in self.iterated for body in group.angles)
            or any(2 * len(g.closures) != len(g.angles) + len(g.slides) for g in self.iterated)
        )

    def doubts(self, keys: Iterable[Quantity]) -> dict[Quantity, float]:
        """What has to be above which number for the tape to have quantities: of poses at which it is not no digit is left."""
        keys = tuple(keys)
        result: dict[Quantity, float] = {}
        if any(key.is_force for key in keys):
            result |= dict.fromkeys(self.margins, NEAR)
        if any(key.is_force or key.order for key in keys):
            result |= {Regularity(group.name): SINGULAR for group in self.iterated}
        return result

    @cached_property
    def margins(self) -> list[Quantity]:
        """The keys of their radicands."""
        return [Margin(group.name) for group in self.closed]

    def _once(self, write: Callable[..., Tape], *arguments: Any) -> Tape:
        """A tape, written on the first request."""
        key = write.__name__, *arguments
        if key not in self._tapes:
            self._tapes[key] = write(*arguments)
        return self._tapes[key]

    def tape(self, keys: Iterable[Quantity]) -> Tape:
        """The tape of quantities."""
        return self._once(self.recording.tape, tuple(keys))

    def tested(self, keys: Sequence[Quantity], also: Sequence[Quantity] = ()) -> Tape:
        """The tape of quantities, and `sound`: positive where all is assembled that they, and others, depend on.

        And where forces among them have digits.
        """
        return self._once(self._tested, tuple(keys), tuple(also))

    def _tested(self, keys: tuple[Quantity, ...], also: tuple[Quantity, ...]) -> Tape:
        closed = [Closed(key.groups(self.recording)) for key in (*keys, *also)]
        sound = [sys.float_info.max - abs(self.recording.value(key)) for key in dict.fromkeys(closed)]
        sound += [abs(self.recording.value(key)) - least for key, least in self.doubts(keys).items()]
        return self.recording.tape(keys, {"sound": every(sound)})

    @cached_property
    def clear(self) -> Tape:
        """The tape of `clear`: positive where no radicand dips down to zero, by the input and the signs."""
        depths = [self.recording.value(key) - DIP for key in self.margins]
        return self.recording.recorder.tape({"clear": every(depths)})

    def _allowed(self) -> Iterator[Number]:
        """Return numbers that are positive if a description is not refused for its numbers (`describe.description.refuse`)."""
        m = self.mechanism
        least = CLOSE * bare(m.size)
        for name, earlier, later in joints_apart(m):
            points = m.links[name].points
            yield abs(bare(points[earlier] - points[later])) - least
        for link in m.links.values():
            # zero is allowed
            bounded = (getattr(link, key.field) for key in keys_of(Link) if key.form.restricts)
            yield from (RECORDED.select(-bare(x), -1.0, 1.0) for x in bounded)
        yield from (abs(bare(ratio)) for ratio in m.ratios)
        yield from (bare(radius) for belt in m.belts for radius in belt.radii)
        yield from (abs(bare(rack.radius)) for rack in m.racks)

    @cached_property
    def short(self) -> Tape:
        """The tape of how much each closed form lacks of closing, m, in the order of solution; negative where it closes."""
        of, outputs = self.recording, {}
        for group in (g for g in self.plan.groups if g.kind != "Newton"):
            case = of.cases[of.solved(group.name).name]
            vectors = map(bare, case.vectors(of.st))
            outputs[group.name] = missing(group.kind, bare(case.offset(of.st)), *vectors)
        return of.recorder.tape(outputs)

    @cached_property
    def steps(self) -> Tape:
        """The tape of a Newton step of each group without a closed form: how far its loops are open, then its next unknowns."""
        of, outputs = self.recording, {}
        for group in (g for g in self.plan.groups if g.kind == "Newton"):
            solved = unknowns(of.solved(group.name), of.st)
            outputs[f"open {group.name}"] = of.open_loops[group.name]
            outputs |= {f"next {group.name} {i}": x for i, x in enumerate(solved)}
        return of.recorder.tape(outputs)

    def enters(self, group: str) -> Tape:
        """The tape of what enters the loops of a group without a closed form (`Loops.entering`), and of the mechanism's size."""
        return self._once(self._enters, group)

    def _enters(self, group: str) -> Tape:
        of = self.recording
        entering = Loops(of.solved(group)).entering(of.st)
        return of.recorder.tape({str(i): x for i, x in enumerate((*entering, of.value(Size())))})

    def rates(self, group: str) -> Tape:
        """The tape of how fast its unknowns change with each input, and of how far it is from singular."""
        return self._once(self._rates, group)

    def _rates(self, group: str) -> Tape:
        of, g = self.recording, self.recording.solved(group)
        of.solve(self.plan.writes(g), 1)
        firsts = [
            rate[0]
            for by in of.by
            for rate in (*(by.angle[body] for body in g.angles), *(by.slide[i] for i in g.slides))
        ]
        values = {str(i): 0.0 if rate is None else bare(rate) for i, rate in enumerate(firsts)}
        return of.recorder.tape({**values, "regularity": of.value(Regularity(group))})

    def told(self, samples: int) -> Tape:
        """The tape of how all closed forms close at the inputs of the guess, and whether that is certain.

        `sign GROUP`; and `told`: positive where the guess is far from a change point and much nearer to one assembly, 2 where
        the radicands are far from zero there and at further inputs `way 0`, `way 1` …, so many. Where it is not told the
        signs mean nothing.
        """
        return self._once(self._told, samples)

    def _told(self, samples: int) -> Tape:
        recorder = Recorder()
        choice, margins = _again(self.choice, recorder, {}), self.tape(self.margins)
        signs, clear = {}, []
        for name in (group.name for group in self.closed):
            nearer = choice[f"plus {name}"] - choice[f"minus {name}"]
            signs[f"sign {name}"] = RECORDED.select(nearer, -1.0, 1.0)
            clear.append(choice[f"margin {name}"] - CLEAR)
        for i in range(samples):
            depths = _again(margins, recorder, signs | {"q0": recorder.input(f"way {i}")})
            clear += [depth - CLEAR for depth in depths.values()]
        told = every(self._plain(choice), every(clear, 2.0, 1.0))
        return recorder.tape(signs | {"told": told})

    def _plain(self, values: Mapping[str, Number]) -> list[Number]:
        """Return a number that is positive if a choice is certain, and the description is that of all variants."""
        plain = [values["allowed"]]
        for name in (group.name for group in self.closed):
            plus, minus = values[f"plus {name}"], values[f"minus {name}"]
            plain.append(values[f"margin {name}"] - CLOSE)
            plain.append(RECORDED.select(TOLD * plus - minus, 1.0, TOLD * minus - plus))
        return plain

    def evaluation(self, keys: Sequence[Quantity], enters: tuple[str, ...] | None, own_signs: bool) -> Tape:
        """The tape of quantities, or of the derivatives of each to all that enters, one after the other.

        `own_signs`: the signs are those of the guess, at the input `at`, and last comes `fine`: positive where these are
        told plainly, and for the quantities themselves where no radicand is near zero. Else the signs enter.
        """
        return self._once(self._evaluation, tuple(keys), enters, own_signs)

    def _evaluation(
        self, keys: tuple[Quantity, ...], enters: tuple[str, ...] | None, own_signs: bool
    ) -> Tape:
        recorder = Recorder()
        signs: dict[str, Number] = {}
        fine: list[Number] = []
        if own_signs:
            numbers = _again(self.choice, recorder, {"q0": recorder.input("at")})
            signs = {name: numbers[name] for name in numbers if name.startswith("sign ")}
            fine = self._plain(numbers)
        if enters is None:
            margins = self.margins if own_signs else []
            outputs = _again(self.tape((*keys, *margins)), recorder, signs)
            fine += [outputs.pop(name) - DIP for key in margins for name in key.names]
        else:
            numbers = _again(self.slopes(keys, enters), recorder, signs)
            parts = [part for key in keys for part in key.names]
            every_one = [f"d({part})/d({name})" for part in parts for name in enters]
            outputs = {name: numbers.get(name, 0.0) for name in every_one}
        if own_signs:
            outputs["fine"] = every(fine)
        return recorder.tape(outputs)

    def slopes(self, keys: tuple[Quantity, ...], enters: tuple[str, ...]) -> Tape:
        """The tape of quantities' derivatives to what enters, as far as they depend on that."""
        return self._once(self._slopes, keys, enters)

    def _slopes(self, keys: tuple[Quantity, ...], enters: tuple[str, ...]) -> Tape:
        tape = self.tape(keys)
        return derivatives(tape, [name for name in enters if name in tape.inputs])

    def along(self, keys: tuple[Quantity, ...], steps: tuple[tuple[str, float], ...]) -> Tape:
        """The tape of quantities' derivatives along one direction: `steps` of what enters, taken together."""
        return self._once(self._along, keys, steps)

    def _along(self, keys: tuple[Quantity, ...], steps: tuple[tuple[str, float], ...]) -> Tape:
        recorder = Recorder()
        result = _again(self.slopes(keys, tuple(name for name, _ in steps)), recorder, {})
        parts = [part for key in keys for part in key.names]
        return recorder.tape(
            {
                part: sum(step * result.get(f"d({part})/d({name})", 0.0) for name, step in steps)
                for part in parts
            }
        )

    @cached_property
    def choice(self) -> Tape:
        """The tape of how each closed form's branch is chosen at the inputs of the guess, in the order of solution.

        Of a group without one the unknowns enter. Of each other group: its radicand (`margin`), the distance of both assemblies from what the guess says (`plus`,
        `minus`), the sign that the guessed angles have (`guessed`), and what follows from these (`sign`): the nearer
        assembly, or where there is none the guessed angles' sign. Then the constants of gears that are open (`phase i`), and
        `allowed`: positive where no description is refused.
        """
        recorder, m = self.recording.recorder, self.mechanism
        st = State([recorder.input(f"q{j}") for j in range(len(m.inputs))], kind=WRITTEN)
        angles, points = known_by_guess(m)
        phases = Phases(m, angles, points, bare)
        outputs: dict[str, Number] = {}
        allowed = list(self._allowed())

        def close(group: Group, st: State) -> None:
            if group.kind == "Newton":
                put_unknowns(group, st, self.recording.unknowns(group))
                return
            choose(group, st)
            st.angle.update({body: principal_of(st.turn[body]) for body in group.members})

        def choose(group: Group, st: State) -> None:
            case, size, name = Case(group, bare), bare(m.size), group.name
            if group not in self.closed:
                case.solve(st, 1, size)
                # guides that are parallel at the guess are refused
                allowed.append(bare(st.margin[name]) - CLOSE)
                return
            apart = []
            for sign in (1.0, -1.0):
                trial = st.copy()
                case.solve(trial, sign, size)
                apart.append(sum(distances(group, trial, self.plan, m, angles, points).values()))
            guessed = sign_of_angles(group, case, st, angles)
            guessed = 1.0 if guessed is None else guessed
            margin = bare(trial.margin[name])
            # at zero the guess is taken as positive; what is not a number is not
            beyond = RECORDED.select(1.0 + guessed, 1.0, -1.0)
            beyond = RECORDED.select(guessed, 1.0, RECORDED.select(-guessed, -1.0, beyond))
            sign = RECORDED.select(margin, RECORDED.select(apart[0] - apart[1], -1.0, 1.0), beyond)
            case.solve(st, sign, size)
            values = margin, apart[0], apart[1], guessed, sign
            outputs.update(zip((f"{what} {name}" for what in CHOICE), values, strict=True))

        for step in self._open_plan.steps:
            run([phases.step(step, st)], st, close)
        outputs.update({f"phase {i}": bare(phases.constants[i]) for i in self.phases})
        outputs["allowed"] = every(allowed)
        return recorder.tape(outputs)

    @cached_property
    def guessed(self) -> Tape:
        """The tape of what the guess says of each group without a closed form, at its inputs.

        The unknowns that it says, in `guess GROUP i`, zero where it says nothing of a slide; the gaps of the loops there
        (`gap GROUP row`) and their columns (`column GROUP row i`) by such slides; how far the unknowns that enter are from
        the guess (`far GROUP`).
        """
        recorder, m = self.recording.recorder, self.mechanism
        st = State([recorder.input(f"q{j}") for j in range(len(m.inputs))], kind=WRITTEN)
        angles, points = known_by_guess(m)
        outputs: dict[str, Number] = {}

        def close(group: Group, st: State) -> None:
            name = group.name
            if group.kind != "Newton":
                sign = recorder.input(f"sign {name}") if group in self.closed else 1
                Case(group, bare).solve(st, sign, bare(m.size))
                st.angle.update({body: principal_of(st.turn[body]) for body in group.members})
                return
            trial = st.copy()
            x, free = of_guess(group, trial, angles, points, m, self.plan.directions)
            self.free[name] = free
            outputs.update({f"guess {name} {i}": number for i, number in enumerate(x)})
            along = columns(group, trial)
            for loop, gap in enumerate(gaps(group, trial)):
                for part, of in enumerate(PARTS):
                    row = 2 * loop + part
                    outputs[f"gap {name} {row}"] = of(bare(gap))
                    outputs.update({f"column {name} {row} {i}": of(bare(along[loop][i])) for i in free})
            put_unknowns(group, st, self.recording.unknowns(group))
            outputs[f"far {name}"] = sum(distances(group, st, self.plan, m, angles, points).values())

        run(self.plan.steps, st, close)
        return recorder.tape(outputs)


def _placed(m: Description, order: Plan, assembly: Assembly) -> Plan | None:
    """The order of solution with the constants of gears, belts and racks as the guess's own pose has them.

    None where a group without a closed form has to be placed for one.
    """
    phases = Phases(m, *known_by_guess(m), bare)
    st = State([bare(q) for q in m.at], kind=WRITTEN)

    def close(group: Group, st: State) -> None:
        Case(group, bare).solve(st, assembly.signs.get(group.name, 1), bare(m.size))
        st.angle.update({body: principal_of(st.turn[body]) for body in group.members})

    for i, step in enumerate(order.steps):
        if isinstance(step, Group) and step.kind == "Newton":
            if any(turn.angle.gears for turn in turns(order.steps[i:])):
                return None
            break
        run([phases.step(step, st)], st, close)
    return with_constants(order, phases.constants)


def every(conditions: Iterable[Number], value: Number = 1.0, otherwise: float = -1.0) -> Number:
    """A number where all of these are positive, and another one where they are not."""
    for condition in reversed(list(conditions)):
        value = RECORDED.select(condition, value, otherwise)
    return value


def _again(tape: Tape, recorder: Recorder, values: Mapping[str, Number]) -> dict[str, Number]:
    """The outputs of a tape on another one, where some of what enters is known."""
    enters = {name: values[name] if name in values else recorder.input(name) for name in tape.inputs}
    return tape.on(enters, RECORDED)


def varied(m: Description, dimensions: Sequence[Dimension], recorder: Recorder) -> Description:
    """The description with recorded numbers at some dimensions, called by their paths; decisions see its own numbers."""
    numbers = {d.path: Varied(float(number_of(m, d)), recorder.input(d.path)) for d in dimensions}
    return changed(m, numbers)
