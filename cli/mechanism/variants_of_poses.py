"""Poses and studies of many variants: those that the formulas take are solved at once, the others one by one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any
from uuid import uuid4

import numpy as np

from cli.mechanism.asked import Home, Question, Said, emptied, length, like, without_bounds
from cli.mechanism.families import Families
from cli.mechanism.read import Inputs, wanted
from cli.mechanism.result import result_of
from cli.mechanism.solve import Analysis
from cli.mechanism.words import METHOD
from cli.show.columns import Column, Table
from virtualwork import MechanismError
from virtualwork.family.family import Family
from virtualwork.family.part import Part, Solver

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cli.mechanism.asked import Rows
    from cli.mechanism.variants import Variants
    from cli.show.columns import Document

    Mask = NDArray[np.bool_]

# variants from which on it pays to write the formulas down; rows of a part solved together, and variants and rows of one
# solved one by one, of a table and of documents, where a row takes some kilobytes; variants of a part that are described
# alone only to say why poses are not assembled
FEW, TOGETHER, ONE_BY_ONE, EXPLAINED = 32, (1 << 16, 1 << 12), (64, (1 << 14, 1 << 12)), 50


@dataclass(frozen=True)
class AskedOfPoses(Question):
    """What is asked of every variant.

    Attributes
    ----------
    inputs : Inputs or None
        None: each variant's own pose.
    name : str
        Of the question, by which a process knows what it has prepared for it.
    """

    inputs: Inputs | None
    name: str = field(default_factory=lambda: uuid4().hex)

    method = METHOD

    def analysis(self, row: Rows | None = None) -> Analysis:
        """The question, asked of a variant, or of the mechanism itself."""
        m = self.mechanism if row is None else self.variant(row)
        q = self.inputs or wanted(m, None, None, None, self.bare)
        return Analysis.of(self.asked, m, q)

    drawn = analysis

    def home(self, variants: Variants, json: bool) -> Home:
        """The first variant that can be put together, and whether and how many are solved at once."""
        poses = 1 if self.inputs is None else self.inputs.n
        lanes = variants.count * poses
        for i in range(variants.count):
            (row,) = variants.part(i, i + 1)
            found = self.one(row, "", json, Said())
            if found is not None:
                break
        else:
            return Home(_size(ONE_BY_ONE[1][json], poses, ONE_BY_ONE[0]), lanes=lanes)
        pattern = Table([]) if json else without_bounds(found[0])
        together = variants.count >= FEW and self.families(variants.part(0, 1), json) is not None
        each = _size(TOGETHER[json], poses) if together else _size(ONE_BY_ONE[1][json], poses, ONE_BY_ONE[0])
        return Home(each, pattern, row, together, lanes)

    def families(self, shown: Rows, json: bool) -> Families | None:
        """How variants are solved together, for documents or for a table; None where they are not."""
        plain = self.asked.branch is None and self.asked.tables in ([], ["--forces"])
        # a cycle of work, which stands in the document only, is of each variant
        cycle = json and self.asked.forces and self.asked.swept and len(self.mechanism.inputs) == 1
        if not plain or self.digits or cycle:
            return None
        found = Families(self.analysis(), self.asked.forces, Solver(self._part(shown)), json)
        return found if found.pays else None

    def _part(self, shown: Rows) -> Part:
        """Variants as a part of a family."""
        q, family = self.inputs, Family(self.mechanism, self.numbers(shown))
        motion = family.motion() if q is None else family.motion(q.values, q.speed, q.acceleration)
        return motion.part

    def one(self, row: Rows, name: str, json: bool, said: Said) -> Any:
        """A variant's document, or its table with which poses are assembled; None where it cannot be put together."""
        try:
            analysis = self.analysis(row)
            result = result_of(analysis, self.asked)
            if json:
                found: Any = result.document()
                del found["name"]
            else:
                table = next(iter(result.tables.values()))()
                found = table, _rows_assembled(table, analysis)
            said.any_assembled |= not result.failed()
            remarks = result.warnings
        except MechanismError as error:
            found, remarks = None, [str(error)]
        for remark in dict.fromkeys(remarks):
            said.add(remark, [name])
        return found

    # --- as JSON --------------------------------------------------------------------------------------------------
    def documents(self, home: Home, first: int, shown: Rows, said: Said) -> list[Document]:
        """What JSON says of some variants; poses of one that cannot be put together are not assembled."""
        if home.together:
            listed, assembled, alone = _families(self, shown, json=True).of(self._part(shown))
            v, n = assembled.shape
            found: list[Any] = [{"poses": listed[i * n : (i + 1) * n]} for i in range(v)]
            for i, document in self._left(first, shown, assembled, alone, True, said):
                found[i] = document
            said.any_assembled |= bool(assembled[~alone].any())
        else:
            found = [self.one(row, str(first + i), True, said) for i, row in enumerate(shown)]
        if home.row is not None and any(document is None for document in found):
            blank = {"poses": _blank(self.one(home.row, "", True, Said())["poses"])}
        else:
            blank = {"poses": []}
        return self.named(first, shown, [blank if document is None else document for document in found])

    # --- as a table -----------------------------------------------------------------------------------------------
    def table(self, home: Home, first: int, shown: Rows, said: Said) -> Table:
        """The rows of some variants, which say whether the pose is assembled."""
        if home.together:
            return self._table_together(home.pattern, first, shown, said)
        tables = []
        for i, row in enumerate(shown):
            of, there = self._rows(home.pattern, self.one(row, str(first + i), False, said))
            tables.append(Table([Column("assembled", "", there), *of.columns]))
        table = replace(self.below(first, shown, tables), keys=self._keys(home.pattern))
        return table if self.digits else without_bounds(table)

    def _rows(self, pattern: Table, found: Any) -> tuple[Table, list[Any]]:
        """The rows of what `one` gives, and of each whether its pose is assembled."""
        table, there = (emptied(pattern), False) if found is None else (like(pattern, found[0]), found[1])
        return table, there if isinstance(there, list) else [there] * length(table)

    def _table_together(self, pattern: Table, first: int, shown: Rows, said: Said) -> Table:
        table, assembled, alone = _families(self, shown, json=False).of(self._part(shown))
        v, n = assembled.shape
        columns: list[list[Any]] = [list(c.values) for c in like(pattern, table).columns]
        whole = assembled.ravel().tolist()
        for i, found in self._left(first, shown, assembled, alone, False, said):
            here = slice(i * n, (i + 1) * n)
            its, whole[here] = self._rows(pattern, found)
            for values, column in zip(columns, its.columns, strict=True):
                values[here] = list(column.values)
        said.any_assembled |= any(whole)
        names = [str(first + i) for i in range(v) for _ in range(n)]
        given = self.given(names, [np.repeat(c, n) for c in shown.T])
        made = [replace(c, values=values) for c, values in zip(pattern.columns, columns, strict=True)]
        return Table([*given, Column("assembled", "", whole), *made], self._keys(pattern))

    def _keys(self, table: Table) -> tuple[str, ...]:
        return ("variant", *(d.header for d in self.dimensions), *table.keys)

    def _left(
        self, first: int, shown: Rows, assembled: Mask, alone: Mask, json: bool, said: Said
    ) -> Iterator[tuple[int, Any]]:
        """Of variants solved together those that are left, as `one` gives them; of others it is said why poses are missing."""
        told = 0
        for i in np.flatnonzero(alone | ~assembled.all(axis=1)).tolist():
            if not alone[i]:
                # its rows are there: only why poses are not is still to be said
                if told >= EXPLAINED:
                    said.further += 1
                    continue
                told += 1
            found = self.one(shown[i], str(first + i), json and bool(alone[i]), said)
            if alone[i]:
                yield i, found


_known: dict[tuple[str, bool], Families] = {}


def _families(asked: AskedOfPoses, shown: Rows, json: bool) -> Families:
    """The formulas of a question, which a process writes down once."""
    name = asked.name, json
    if name not in _known:
        found = asked.families(shown[:1], json)
        assert found is not None
        _known.clear()
        _known[name] = found
    return _known[name]


def _size(rows: int, poses: int, most: int | None = None) -> int:
    """How many variants of so many poses a part of so many rows has."""
    return max(1, rows // poses if most is None else min(most, rows // poses))


def _rows_assembled(table: Table, analysis: Analysis) -> list[bool] | bool:
    """Of each row whether its pose is assembled."""
    rows = len(table.columns[0].values)
    whole = [analysis.assembled(motion).tolist() for motion in analysis.motions]
    poses = [pose for each in zip(*whole, strict=True) for pose in each]
    if analysis.several and not any(c.header == "link" for c in table.columns):
        poses = [pose for each in whole for pose in each]
    if poses and rows % len(poses) == 0:
        # of a pose one row for each link
        return [pose for pose in poses for _ in range(rows // len(poses))]
    return any(poses)


def _blank(part: Any, key: str = "") -> Any:
    """Poses that are not assembled, in the form of others: what they are asked at stays."""
    if isinstance(part, dict):
        return {key: _blank(value, key) for key, value in part.items()}
    if isinstance(part, list):
        return [] if key == "marks" else [_blank(each, key) for each in part]
    if isinstance(part, bool):
        return False
    return part if isinstance(part, str) or key in ("input_deg", "input_m", "branch") else None
