"""The quantities of loops: whether they close, how far a group is from its limits, the entries of their Jacobian."""

from __future__ import annotations

from dalembert.arithmetic.recorded import RECORDED, bare
from dalembert.arithmetic.systems import regularity
from virtualwork.formulas.group_loops import unknowns
from virtualwork.formulas.numbers import PARTS, WRITTEN, Number, cross
from virtualwork.formulas.positions import columns
from virtualwork.formulas.quantity import Quantity, Recording


class Closed(Quantity, kind="closed"):
    """A finite number where these groups are assembled."""

    of: tuple[str, ...]

    @property
    def names(self) -> tuple[str, ...]:
        return (" ".join((self.kind, *self.of)),)

    def write(self, recording: Recording) -> Number:
        total: Number = 0.0
        for group in map(recording.solved, self.of):
            if recording.enters(group):
                total = sum(map(abs, unknowns(group, recording.st)), total)
            else:
                total = total + WRITTEN.sqrt(recording.st.margin[group.name])
                if group.kind == "PRP":
                    total = total + abs(recording.st.slide[group.slides[0]])
        return total


class Everywhere(Quantity):
    """A quantity that has a value where nothing is assembled too."""

    def groups(self, recording: Recording) -> tuple[str, ...]:
        return ()


class Margin(Everywhere, kind="margin"):
    """The radicand of a closed form, relative."""

    group: str

    def write(self, recording: Recording) -> Number:
        of = recording.solved(self.group)
        # a group that enters the tape has no margin on it
        return 0.0 if recording.enters(of) else recording.st.margin[of.name]


class Transmission(Everywhere, kind="transmission"):
    """sin² of the transmission angle of a two-link group.

    Between the two links, between a rod and the normal of its guide, of a slot as it passes its pivot, between guides.
    """

    group: str

    def write(self, recording: Recording) -> Number:
        of = recording.solved(self.group)
        if recording.enters(of):
            (c1, c2), *_ = columns(of, recording.st)
            across = cross(c1, c2)
            return across * across / ((c1.conjugate() * c1).real * (c2.conjugate() * c2).real)
        margin: Number = recording.st.margin[of.name]
        if of.kind != "RPR":
            return margin
        size, w = bare(recording.mechanism.size), recording.cases[of.name].offset(recording.st)
        return margin * (size * size / (w.conjugate() * w).real)


class Regularity(Quantity, kind="regularity"):
    """How far the Jacobian of a larger group is from singular, of 1."""

    group: str

    def write(self, recording: Recording) -> Number:
        entries = columns(recording.solved(self.group), recording.st)
        return regularity([[part(c) for c in row] for row in entries for part in PARTS])


class Twist(Quantity, kind="twist"):
    """The twist of a torsion spring, rad, within half a turn of free."""

    spring: int

    def write(self, recording: Recording) -> Number:
        spring = recording.mechanism.torsion_springs[self.spring]
        if all(recording.plan.angles[body].by_inputs for body in spring.links):
            # the inputs alone fix it, whole turns included
            return 0.0
        from virtualwork.formulas.loaded_pose import Shared

        recording.solve([f"angle:{body}" for body in spring.links], 0)
        return Shared.within(recording.st, spring)


class Column(Quantity, kind="column"):
    """An entry of the Jacobian of all loops: of a loop, by an unknown."""

    is_vector = True
    loop: int
    unknown: int

    def write(self, recording: Recording) -> Number:
        assert recording.loops is not None
        recording.solve([key for step in recording.plan.steps for key in recording.plan.writes(step)], 0)
        return columns(recording.loops, recording.st)[self.loop][self.unknown]


class Size(Everywhere, kind="size"):
    """The mechanism's characteristic length, m."""

    def write(self, recording: Recording) -> Number:
        longest: Number = 0.0
        for span in map(bare, recording.mechanism.spans):
            longest = RECORDED.select(span - longest, span, longest)
        return longest
