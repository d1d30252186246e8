"""The kinds of call of `dalembert mechanism`: a fit, a motion in time, a long sweep, poses; of one mechanism or of variants."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

from cli.mechanism.options import refuse_clashes
from cli.mechanism.read import wanted
from cli.mechanism.result import csv_parts, result_of, told
from cli.mechanism.solve import Analysis, load
from cli.show.columns import Result

if TYPE_CHECKING:
    from cli.mechanism.asked import Question
    from cli.mechanism.options import Options
    from cli.mechanism.variants import Variants
    from cli.show.commands import ShowOptions
    from virtualwork import Mechanism


def answer(asked: Options, show: ShowOptions) -> Result:
    """What a call finds; which kind of call it is, is decided here."""
    refuse_clashes(asked, show)
    with told(asked.file):
        if asked.fits:
            from cli.mechanism.fitted import fitted

            result = fitted(asked)
        else:
            call = Call.of(asked, show)
            result = call.in_time() if asked.time is not None else call.poses()
    return replace(result, within=lambda: told(asked.file))


@dataclass(eq=False, repr=False)
class Call:
    """One call: what is asked of which mechanism, or of which of its variants."""

    asked: Options
    show: ShowOptions
    mechanism: Mechanism
    bare: Mapping[str, str]
    said: list[str]
    about: dict[str, str]
    several: Variants | None = None

    @classmethod
    def of(cls, asked: Options, show: ShowOptions) -> Call:
        """Read the mechanism, and put in the numbers that options give."""
        mechanism, bare, said, about = load(asked.file)
        several = None
        if asked.change or asked.vary or asked.variants is not None:
            from cli.mechanism import variants

            mechanism = variants.assigned(mechanism, bare, asked.change) if asked.change else mechanism
            several = variants.asked(mechanism, bare, asked.vary, asked.variants, said)
        return cls(asked, show, mechanism, bare, said, about, several)

    @property
    def count(self) -> int:
        """How many mechanisms there are."""
        return 1 if self.several is None else self.several.count

    # --- over time ------------------------------------------------------------------------------------------------
    def in_time(self) -> Result:
        """The motion under forces."""
        from cli.mechanism.in_time import InTime, times_and_accuracy

        asked, m, several = self.asked, self.mechanism, self.several
        home = Analysis.of(asked, m, wanted(m, None, None, None, self.bare), 2)
        home.warnings += self.said
        home.check_names()
        times, accuracy = times_and_accuracy(asked.time or "", asked.accuracy)
        self._refuse_long(len(times))
        if several is None:
            motion = InTime(home, times, accuracy, asked.until, self.bare, asked.forces)
            return self._with_page(motion.result(self.about), lambda: [("", motion)])
        from cli.mechanism.variants_in_time import AskedInTime

        question = AskedInTime(
            asked, m, several.dimensions, self.bare, self.show.digits, times, accuracy, asked.until
        )
        return self._of_many(question, several)

    # --- over the inputs ------------------------------------------------------------------------------------------
    def poses(self) -> Result:
        """Poses, forces and studies."""
        asked, show, m = self.asked, self.show, self.mechanism
        q = wanted(m, asked.at, asked.sweep, asked.inputs, self.bare)
        analysis = Analysis.of(asked, m, q)
        analysis.warnings += self.said
        analysis.check_names()
        self._refuse_long(q.n)
        spreads = asked.tolerance or asked.draws is not None
        alone = self.several is None and asked.html is None and not spreads
        if alone and asked.tables in ([], ["--forces"]) and show.streams and analysis.is_long:
            return self._long(analysis)
        analysis.check_size(
            json=show.as_json,
            table=self._table,
            states=asked.states is not None,
            forces=asked.forces,
            times=1 if self._streams else self.count,
        )
        if self.several is not None:
            return self._of_variants(analysis, self.several)
        result = result_of(analysis, asked, self.about, show.digits)
        if spreads:
            return self._with_tolerances(result, analysis)
        return self._with_page(result, lambda: [("", analysis)])

    def _of_variants(self, analysis: Analysis, several: Variants) -> Result:
        """Poses of many variants."""
        from cli.mechanism.variants_of_poses import AskedOfPoses

        asked, q = self.asked, analysis.inputs
        own_pose = asked.at is None and not asked.swept and several.moves_inputs
        inputs = None if own_pose else q.part(0, q.n)
        question = AskedOfPoses(
            asked, self.mechanism, several.dimensions, self.bare, self.show.digits, inputs
        )
        return self._of_many(question, several)

    def _with_tolerances(self, result: Result, analysis: Analysis) -> Result:
        """Poses with what the tolerances do to them, in every form."""
        from cli.mechanism.tolerance import Tolerances
        from cli.mechanism.tolerance_picture import draw

        found = Tolerances(analysis, self.asked)
        before, said = result.document, found.remarks()
        _, *others = result.tables.items()
        return replace(
            result,
            document=lambda: {**before(), "tolerance": found.document()},
            tables={"poses": found.table, **dict(others)},
            screen=None,
            afterword=found.words,
            figure=lambda: draw(found),
            warnings=[*result.warnings, *said],
        )

    def _long(self, analysis: Analysis) -> Result:
        """The table of a long sweep, a block of poses at a time."""
        from cli.mechanism import columns
        from cli.mechanism.states import table as link_states
        from cli.mechanism.stream import Stream

        forces, states = self.asked.forces, self.asked.states
        stream = Stream(analysis, partial(columns.table, forces=forces), forces)
        every = Stream(replace(analysis, only=None), link_states)
        digits = self.show.digits
        return Result(
            blocks=lambda form: (form(table, i) for i, table in enumerate(stream.tables())),
            beside={} if states is None else {states: lambda: csv_parts(every.tables(), digits)},
            late_warnings=stream.warnings,
            failed=lambda: not stream.any_assembled,
        )

    # --- what the kinds have in common ------------------------------------------------------------------------------
    @property
    def _table(self) -> bool:
        """Whether a table is formed: that of a long sweep costs as much as its solution, and JSON alone asks for none."""
        return not self.show.json or self.show.expect is not None or self.show.output is not None

    @property
    def _streams(self) -> bool:
        """Whether many variants are written part by part."""
        return self.show.streams or self.show.streams_json

    def _of_many(self, question: Question, several: Variants) -> Result:
        """What is asked of each variant."""
        from cli.mechanism.many import Many

        many = Many(question, several, self.asked.workers or 1)
        result = many.result(self._streams, self.show.as_json, self._table, self.said, self.about)
        return self._with_page(result, many.alone)

    def _refuse_long(self, states: int) -> None:
        """Refuse a page of more states than it can hold."""
        if self.asked.html is not None:
            from cli.show.page import refuse_long

            refuse_long(states * self.count)

    def _with_page(self, result: Result, found: Callable[[], list[tuple[str, Any]]]) -> Result:
        """Add the page that moves to what a result writes beside, where it is asked for; `found`: what is drawn, by variant."""
        html, units = self.asked.html, self.show.units
        if html is None:
            return result
        from cli.mechanism import animation

        def page() -> bytes:
            if self.asked.time is not None:
                return animation.page_in_time(found(), units).html.encode()
            return animation.page(found(), self.asked.forces, units).html.encode()

        return replace(result, beside={**result.beside, html: page})
