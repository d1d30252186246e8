"""Many variants of one mechanism as one result, whatever is asked of each: every row begins with the variant.

They are solved in parts of fixed size, here or by processes: no number hangs on how many there are.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import closing, suppress
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, NamedTuple

from cli.errors import DataError
from cli.mechanism.asked import Home, Question, Said, joined
from cli.mechanism.variants import Variants
from cli.read.options import processes
from cli.show.columns import Result, Table, Written
from cli.show.progress import progress
from dalembert.arithmetic.engines import as_part
from dalembert.arithmetic.parts import LostPart, in_parts

if TYPE_CHECKING:
    from cli.mechanism.asked import Rows
    from cli.show.columns import Document, Form, Part


class Solved(NamedTuple):
    """What a part gives: what is written of it, and what is said."""

    written: Written
    said: Said


def solved(question: Question, home: Home, form: Form, json: bool, first: int, shown: Rows) -> Solved:
    """Work out a part: some variants, which are called from `first` on."""
    said = Said()
    of = question.documents if json else question.table
    return Solved(form(of(home, first, shown, said), first - 1), said)


def as_it_is(part: Part, number: int) -> Written:
    """The form of a part that stays a table, or documents."""
    return Written(part, 0)


@dataclass
class Many:
    """The variants, solved when they are asked for.

    Attributes
    ----------
    workers : int
        How many processes.
    """

    question: Question
    variants: Variants
    workers: int = 1
    said: Said = field(default_factory=Said)

    def blocks(self, form: Form, json: bool = False) -> Iterator[Written]:
        """What is written of the table, or of the documents, part by part, in their order."""
        self.said = Said()
        variants, count = self.variants, self.variants.count
        home = self.question.home(variants, json)
        work: Any = partial(solved, self.question, home, form, json)
        if home.lanes:
            work = partial(as_part, home.lanes, work)
        each = home.each
        starts = range(0, count, each)
        some = ((a + 1, variants.part(a, a + each)) for a in starts)
        workers = min(self.workers, len(starts))
        with processes(workers) as pool:
            try:
                with closing(in_parts(work, some, pool, 2 * workers)) as parts:
                    for written, its in progress(parts, count, "variants", each):
                        self.said.join(its)
                        yield written
            except LostPart as lost:
                first, last = (lost.number - 1) * each + 1, min(lost.number * each, count)
                raise DataError(
                    f"variants {first} to {last}: the process that solved them died, and died again when it was done once more"
                ) from None

    @cached_property
    def table(self) -> Table:
        """All of them, one below the other."""
        # bounds of errors are worked out when they are asked for, and cannot be sent
        here = replace(self, workers=1) if self.question.digits else self
        tables = [written.data for written in here.blocks(as_it_is)]
        self.said = here.said
        return joined([table for table in tables if isinstance(table, Table)])

    @cached_property
    def documents(self) -> list[Document]:
        """What the JSON document says of each variant."""
        parts = (written.data for written in self.blocks(as_it_is, json=True))
        return [document for part in parts if isinstance(part, list) for document in part]

    def alone(self) -> list[tuple[str, Any]]:
        """Each variant that can be put together, by its name; the rows say why others cannot."""
        from virtualwork import MechanismError

        found = []
        for i in range(self.variants.count):
            with suppress(MechanismError):
                found.append((str(i + 1), self.question.drawn(self.variants.part(i, i + 1)[0])))
        return found

    def result(
        self, streams: bool, json: bool, table: bool, remarks: list[str], about: Mapping[str, str]
    ) -> Result:
        """The result: as one table or document alone, written part by part, or the forms asked for, at once."""
        name = self.question.mechanism.name
        result = Result(
            document=lambda: {"name": name},
            warnings=remarks,
            failed=lambda: not self.said.any_assembled,
            method=self.question.method,
            about={"title": name or "Mechanism"} | dict(about),
        )
        if streams:
            return replace(
                result,
                blocks=partial(self.blocks, json=json),
                blocks_name="variants",
                shared=self.workers > 1,
                late_warnings=lambda: self.said.lines(),
            )
        # what there is to say of them stands in the document too
        _ = (json and self.documents), (table and self.table)
        return replace(
            result,
            document=lambda: {"name": name, "variants": self.documents},
            tables={"variants": lambda: self.table},
            notes=lambda: name,
            warnings=[*remarks, *self.said.lines()],
        )
