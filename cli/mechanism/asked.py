"""What is asked of many variants, so that another process knows it too, and what there is to say of them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING
from uuid import uuid4

import numpy as np
from numpy.typing import NDArray

from cli.mechanism.families import Families
from cli.mechanism.read import Inputs, wanted
from cli.mechanism.result import result_of
from cli.mechanism.solve import Analysis
from cli.mechanism.studies import Request
from cli.mechanism.variants import in_si, with_numbers
from cli.show.columns import Result
from virtualwork import Mechanism
from virtualwork.describe.dimensions import Dimension
from virtualwork.family.family import Family
from virtualwork.family.part import Part, Solver

if TYPE_CHECKING:
    from cli.show.columns import Document

# of these kinds of remark each is printed, and of each the first so many variants are named
REMARKS, NAMED = 10, 5


@dataclass(frozen=True)
class Asked:
    """What is asked of every variant: all that another process needs to know.

    Attributes
    ----------
    mechanism : Mechanism
        What they are variants of.
    dimensions : tuple of Dimension
        What is varied.
    inputs : Inputs or None
        None: each variant's own pose.
    order, only, branch
        As in `Analysis`.
    digits : bool
        Whether bounds of the rounding errors are asked for.
    name : str
        Of the question, by which a process knows what it has prepared for it.
    """

    file: str
    mechanism: Mechanism
    dimensions: tuple[Dimension, ...]
    inputs: Inputs | None
    bare: dict[str, str]
    order: int | None
    only: list[str] | None
    branch: str | None
    request: Request
    about: dict[str, str]
    digits: bool
    name: str = field(default_factory=lambda: uuid4().hex)

    def analysis(self, mechanism: Mechanism) -> Analysis:
        """The question, asked of one mechanism."""
        q = self.inputs or wanted(mechanism, None, None, None, self.bare)
        return Analysis.of(self.file, mechanism, q, self.order, self.only, self.branch)

    def result(self, analysis: Analysis) -> Result:
        """Its answer."""
        return result_of(analysis, self.request, None, False, None, self.about)

    def variant(self, row: NDArray[np.float64]) -> Analysis:
        """The question, asked of a variant.

        Raises
        ------
        MechanismError
        """
        return self.analysis(with_numbers(self.mechanism, self.dimensions, row.tolist()))

    def set(self, row: NDArray[np.float64]) -> Document:
        """A variant's numbers as they are shown, by the names that they have in JSON and tables."""
        return {d.header: value for d, value in zip(self.dimensions, row.tolist(), strict=True)}

    def part(self, shown: NDArray[np.float64]) -> Part:
        """Variants as a part of a family."""
        numbers = {
            d.path: [in_si(d, x) for x in c] for d, c in zip(self.dimensions, shown.T.tolist(), strict=True)
        }
        q = self.inputs
        family = Family(self.mechanism, numbers)
        if q is None:
            return family.motion().part
        return family.motion(q.values, q.speed, q.acceleration).part

    def families(self, shown: NDArray[np.float64], json: bool) -> Families | None:
        """How variants are solved together, for documents or for a table; None where they are not."""
        plain = self.branch is None and self.request.tables in ([], ["--forces"])
        # a cycle of work, which stands in the document only, is of each variant
        cycle = json and self.request.forces and self.request.swept and len(self.mechanism.inputs) == 1
        if not plain or self.digits or cycle:
            return None
        found = Families(self.analysis(self.mechanism), self.request.forces, Solver(self.part(shown)), json)
        return found if found.pays else None


@dataclass
class Said:
    """What there is to say of variants: each remark once, with the variants that it is about.

    Attributes
    ----------
    remarks : dict
        Remark -> the first variants, and how many there are.
    further : int
        Variants with a remark of their own that is not kept.
    """

    remarks: dict[str, tuple[list[str], int]] = field(default_factory=dict)
    further: int = 0
    any_assembled: bool = False

    def add(self, remark: str, names: list[str], count: int = 1) -> None:
        """Add a remark about some variants."""
        if remark not in self.remarks and len(self.remarks) >= REMARKS:
            self.further += count
            return
        before, number = self.remarks.get(remark, ([], 0))
        self.remarks[remark] = [*before, *names][:NAMED], number + count

    def join(self, other: Said) -> None:
        """Add what is said of later variants."""
        for remark, (names, count) in other.remarks.items():
            self.add(remark, names, count)
        self.further += other.further
        self.any_assembled |= other.any_assembled

    def lines(self) -> list[str]:
        """As it is printed."""
        lines = []
        for remark, (names, count) in self.remarks.items():
            more = f" and {count - NAMED} more" if count > NAMED else ""
            lines.append(f"variant{'s' * (count > 1)} {', '.join(names)}{more}: {remark}")
        if self.further:
            lines.append(f"{self.further} further variants have remarks of their own")
        return lines
