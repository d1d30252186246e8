"""Quantities of one design after another: what an optimiser asks for, with exact derivatives.

The formulas are written down once with the dimensions as inputs of the tape. An evaluation is three runs of tapes: the
branch on which each loop closes, as the design's own guess has it; the quantities, together with a look along the way from
the guess to the poses, where another branch might be met; and, if asked for, one sweep backwards. A design of which the
branch is not told so simply is described alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.engines import run
from virtualwork.describe.description import Description
from virtualwork.describe.dimensions import Dimension
from virtualwork.describe.errors import DescriptionError, hint
from virtualwork.family.branches import DIP, meet_on_the_way, samples, signs
from virtualwork.family.part import Part, Solver
from virtualwork.family.written import CLOSE, TOLD
from virtualwork.formulas.asked import COMPLEX, Key, names
from virtualwork.formulas.numbers import Reals

AT_REST: list[list[Any]] = [[0.0], [0.0], [0.0]]


class Design:
    """Positions over the input, of one set of dimensions after another; `Mechanism.design` makes one.

    Attributes
    ----------
    mechanism : Description
        With one input.
    dimensions : tuple of Dimension
    keys : tuple
        What is asked for: points, angles of links, slides.
    evaluations : int
        Designs worked out so far.
    """

    def __init__(self, mechanism: Description, dimensions: Sequence[Dimension], keys: Sequence[Key]) -> None:
        if len(mechanism.inputs) != 1:
            raise DescriptionError(f"found {len(mechanism.inputs)} inputs, expected one")
        self.mechanism, self.dimensions, self.keys = mechanism, tuple(dimensions), tuple(keys)
        self.evaluations = 0
        own = np.zeros((1, len(self.dimensions)))
        self._first = Solver(Part(self.mechanism, self.dimensions, own, np.zeros((1, 1, 1)), AT_REST))
        self._paths = [d.path for d in self.dimensions]
        self._chosen: tuple[bytes, dict[str, Any] | None] = b"", None
        self._lanes: tuple[Reals, Reals] | None = None
        self._held: dict[str, float] | None = None

    def __reduce__(self) -> tuple[type[Design], tuple[object, ...]]:
        # what is written down does not travel
        return Design, (self.mechanism, self.dimensions, self.keys)

    def __repr__(self) -> str:
        return f"Design({self.mechanism.name!r}: {', '.join(self._paths)})"

    @property
    def rows(self) -> int:
        """How many rows a table has: two of each point, x and y, one of an angle or a slide."""
        return sum(2 if key[0] in COMPLEX else 1 for key in self.keys)

    @property
    def exact(self) -> bool:
        """Whether derivatives are exact: no group without a closed form, no gear on a coupler."""
        return self._first.written is not None

    def hold(self, numbers: Reals | None) -> bool:
        """Close every loop from here on as the guess has it at these numbers; None: as it has it at each design's own.

        Held, designs pass through places where the guess tells nothing, as a search has to; what it finds must be looked
        at unheld. Returns whether it can be: not where the branch is more than signs.
        """
        written = self._first.written
        self._held, self._chosen = None, (b"", None)
        if numbers is not None and written is not None:
            given = dict(zip(self._paths, numbers.tolist(), strict=True))
            chosen, _ = signs(written, self.mechanism, given, 1)
            if len(chosen) == len(written.closed):
                self._held = {f"sign {name}": float(sign[0]) for name, sign in chosen.items()}
        return self._held is not None

    # --- one design -----------------------------------------------------------------------------------------------
    def __call__(self, numbers: ArrayLike, inputs: ArrayLike) -> Reals:
        """What is asked for, of one design.

        Parameters
        ----------
        numbers : array (d,)
            The dimensions, SI.
        inputs : array (n,)
            Rad, or m for a slide.

        Returns
        -------
        array (rows, n)
            m; rad within (−π, π]. NaN where a pose cannot be assembled.
        """
        x, q = np.asarray(numbers, dtype=float), np.asarray(inputs, dtype=float)
        known = self._known(x)
        if known is not None:
            found = self._on_tape(known, q)
            if found is not None:
                self.evaluations += 1
                return found
            # a dip that has to be looked into tells of this design what its signs do not
            self._chosen = x.tobytes(), None
        return self.table(x[None], q[None])[:, 0]

    def slopes(self, numbers: ArrayLike, inputs: ArrayLike, inputs_alone: bool = False) -> Reals:
        """The derivatives of that to the dimensions, and last to the inputs themselves, (rows, n, d + 1).

        `inputs_alone`: to nothing but the inputs, (rows, n, 1).
        """
        x, q = np.asarray(numbers, dtype=float), np.asarray(inputs, dtype=float)
        known = self._known(x)
        if known is None:
            return self._differences(x, q, inputs_alone)
        written = self._first.written
        assert written is not None
        enters = ("q0",) if inputs_alone else (*self._paths, "q0")
        tape = written.slopes(self.keys, enters)
        found = run(tape, {**known, "q0": q})
        out = np.zeros((self.rows, len(q), len(enters)))
        here = [part for key in self.keys for part in names(key)]
        for row, part in enumerate(here):
            for column, name in enumerate(enters):
                place = tape.rows.get(f"d({part})/d({name})")
                if place is not None:
                    out[row, :, column] = found.table[place]
        return out

    def _known(self, x: Reals) -> dict[str, Any] | None:
        """What enters the tape of a design beside the input; None where it is better described alone."""
        name = x.tobytes()
        if self._chosen[0] != name:
            self._chosen = name, self._enters(x)
        return self._chosen[1]

    def _enters(self, x: Reals) -> dict[str, Any] | None:
        written, m = self._first.written, self.mechanism
        if written is None:
            return None
        known: dict[str, Any] = dict(zip(self._paths, x.tolist(), strict=True))
        if self._held is not None:
            return known | self._held
        if not written.closed:
            return known
        found = run(written.choice, {**known, "q0": m.at[0]})
        chosen = {}
        for group in written.closed:
            a, b = found[f"plus {group.name}"], found[f"minus {group.name}"]
            if not (found[f"margin {group.name}"] > CLOSE and min(a, b) < TOLD * max(a, b)):
                arrays, told = signs(written, m, known, 1)
                if not told[0]:
                    return None
                return known | {f"sign {name}": float(sign[0]) for name, sign in arrays.items()}
            chosen[f"sign {group.name}"] = float(found[f"sign {group.name}"])
        return known | chosen

    def _on_tape(self, known: dict[str, Any], q: Reals) -> Reals | None:
        """The quantities; None where another branch may be met on the way from the guess."""
        written, n = self._first.written, len(q)
        assert written is not None
        rows, looked = self.rows, [] if self._held is not None else written.closed
        lanes = q
        if looked:
            if self._lanes is None or self._lanes[0] is not q:
                self._lanes = q, self._with_way(q)
            lanes = self._lanes[1]
        margins = [("margin", group.name) for group in looked]
        table = run(written.tape((*self.keys, *margins)), {**known, "q0": lanes}).table
        # NaN is not greater either
        if looked and not table[rows:, n:].min() > DIP:
            ends = (lanes[n:].min(keepdims=True), lanes[n:].max(keepdims=True))
            if meet_on_the_way(written, self.mechanism, known, 1, *ends)[0]:
                return None
        return np.where(np.isfinite(table[:rows, :n]), table[:rows, :n], np.nan)

    def _with_way(self, q: Reals) -> Reals:
        """Inputs, and behind them samples of the way from the guess over all of them, of a turn at most."""
        m = self.mechanism
        low, high = min(np.nanmin(q), m.at[0]), max(np.nanmax(q), m.at[0])
        last = min(high, low + (np.inf if m.inputs[0].is_slide else 2 * np.pi))
        return np.concatenate([q, np.linspace(low, last, samples(m, float(high - low)))])

    def _differences(self, x: Reals, q: Reals, inputs_alone: bool) -> Reals:
        """The derivatives from differences; those to all inputs from one design."""
        size, slide = self.mechanism.size, self.mechanism.inputs[0].is_slide
        step = np.array([1e-7 * (size if d.kind == "length" else 1.0) for d in self.dimensions])
        step = step[:0] if inputs_alone else step
        turn = 1e-7 * (size if slide else 1.0)
        rows, along = [x, x], [q + turn, q - turn]
        for i, h in enumerate(step):
            apart = h * np.eye(len(x))[i]
            rows += [x + apart, x - apart]
            along += [q, q]
        table = self.table(np.array(rows), np.array(along))
        angles = np.array([key[0] == "angle" for key in self.keys for _ in names(key)])[:, None]
        columns = []
        for i, h in enumerate((turn, *step)):
            apart = table[:, 2 * i] - table[:, 2 * i + 1]
            columns.append(np.where(angles, np.angle(np.exp(1j * apart)), apart) / (2 * h))
        return np.stack([*columns[1:], columns[0]], axis=-1)

    # --- many designs -----------------------------------------------------------------------------------------------
    def table(self, numbers: Reals, inputs: Reals) -> Reals:
        """What is asked for of designs (v, d) at their inputs (v or 1, n): (rows, v, n)."""
        self.evaluations += len(numbers)
        out = []
        for key, found in zip(self.keys, self.solved(numbers, inputs, self.keys), strict=True):
            out += [found.real, found.imag] if key[0] in COMPLEX else [found]
        return np.stack(out)

    def solved(self, numbers: Reals, inputs: Reals, keys: Sequence[Key]) -> list[NDArray[Any]]:
        """Any quantities of designs (v, d) at their inputs (v or 1, n), (v, n) each."""
        part = Part(self.mechanism, self.dimensions, numbers, inputs[:, :, None], AT_REST)
        return Solver(part, self._first).values(keys)


def place_key(m: Description, name: str) -> Key:
    """The key of a place: `points.H` (or `H`), `links.rocker`, `slides.B`.

    Raises
    ------
    DescriptionError
        With what is known in place of what is not.
    """
    kind, _, of = name.rpartition(".")
    points = {point: body for body, named in m.bodies.items() for point in named}
    guides = {guide.point: i for i, guide in enumerate(m.guides)}
    for word, what, known in (
        ("points", "point", points),
        ("links", "link", m.links),
        ("slides", "slot or slider", guides),
    ):
        if kind == word or (not kind and word == "points"):
            if of not in known:
                raise DescriptionError(f"no {what} is named '{of}'{hint(of, known)}")
            if word == "points":
                return "point", points[of], 0j, of, 0
            return ("angle", of, 0) if word == "links" else ("slide", guides[of], 0)
    raise DescriptionError(f"'{name}': expected points.NAME, links.NAME or slides.NAME")
