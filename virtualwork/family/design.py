"""Quantities of one design after another: what an optimiser asks for, with exact derivatives.

The formulas are written down once with the dimensions as inputs of the tape. An evaluation is one run of it: the branch on
which each loop closes, as the design's own guess has it; the quantities; and a look along the way from the guess to the
poses, where another branch might be met. Derivatives, if requested, are a second one with a sweep backwards. Where the
branch is not decided so simply, more is done; at worst the design is described alone.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.engines import Repeated, run
from dalembert.arithmetic.shapes import as_numbers
from dalembert.hints import choices
from virtualwork.branch.assembly import Assembly
from virtualwork.describe import DescriptionError, MechanismError
from virtualwork.describe.description import Description
from virtualwork.describe.dimensions import Dimension, by_path, changed
from virtualwork.family.branches import meet_on_the_way, samples, signs, with_signs
from virtualwork.family.part import Part, Solver, assembled
from virtualwork.family.varied_formulas import VariedFormulas
from virtualwork.formulas.forces import Effort
from virtualwork.formulas.kinematics import Angle, Coordinate, Slide
from virtualwork.formulas.lanes import Lanes
from virtualwork.formulas.loops import Transmission
from virtualwork.formulas.numbers import Reals
from virtualwork.formulas.quantity import Quantity
from virtualwork.formulas.recording import NAMES

REST = (0.0, 0.0, 0.0)
# the first word of a name, and what is named there
ROOMS = {"points": "point", "links": "link", "slides": "slot or slider", "effort": "input"}
AXES = ("x", "y")


class Design:
    """Positions and the effort over the input, of one set of dimensions after another; `Mechanism.design` makes one.

    Attributes
    ----------
    mechanism : Description
        With one input.
    dimensions : tuple of Dimension
    keys : tuple
        The requested numbers: coordinates of points, angles of links, slides, the effort.
    rates : tuple of float
        Speed, acceleration and jerk of the input: those of the description where the effort is requested, else none.
    evaluations : int
        Designs computed so far.
    """

    def __init__(
        self, mechanism: Description, dimensions: Sequence[Dimension], keys: Sequence[Quantity]
    ) -> None:
        if len(mechanism.inputs) != 1:
            raise DescriptionError(f"found {len(mechanism.inputs)} inputs, expected one")
        self.mechanism, self.dimensions, self.keys = mechanism, tuple(dimensions), tuple(keys)
        self.evaluations = 0
        own = np.zeros((1, len(self.dimensions)))
        driven, forces = mechanism.inputs[0], any(isinstance(key, Effort) for key in keys)
        self.rates = (float(driven.speed or 0.0), float(driven.acceleration or 0.0), 0.0) if forces else REST
        self._moving = {f"{name}0": rate for name, rate in zip(NAMES[1:], self.rates, strict=True)}
        self._at_rates: list[list[Any]] = [[rate] for rate in self.rates]
        self._first = Solver(Part(self.mechanism, self.dimensions, own, np.zeros((1, 1, 1)), self._at_rates))
        self._paths = [d.path for d in self.dimensions]
        self._alone = Alone(self.mechanism, self.dimensions, self.keys, self.rates)
        if forces and (mechanism.friction or not self._first.takes(self.keys)):
            raise DescriptionError(
                "the effort has no derivatives here: friction, redundant joints and tables over an angle or a speed of a link "
                "are of each pose"
            )
        self._chosen: tuple[bytes, dict[str, Any] | None] = b"", None
        self._kept: dict[tuple[tuple[str, ...] | None, bool], tuple[bytes, Repeated]] = {}
        self._held: dict[str, float] | None = None

    def __reduce__(self) -> tuple[type[Design], tuple[object, ...]]:
        # what is written down does not travel
        return Design, (self.mechanism, self.dimensions, self.keys)

    def __repr__(self) -> str:
        return f"Design({self.mechanism.name!r}: {', '.join(self._paths)})"

    @property
    def _written(self) -> VariedFormulas | None:
        """The formulas; None where a branch is more than signs."""
        written = self._first.written
        return None if written is None or written.iterated else written

    @property
    def exact(self) -> bool:
        """Whether derivatives are exact: unless a gear's phase depends on links that have to be placed first."""
        return self._written is not None or self._alone.written is not None

    def hold(self, numbers: Reals | None) -> bool:
        """Close every loop from here on as the guess has it at these numbers; None: as it has it at each design's own.

        Held, designs pass through places where the guess does not decide, as a search has to; what it finds must be looked
        at unheld. Returns whether it can be: not where the branch is more than signs.
        """
        written = self._written
        self._held, self._chosen = None, (b"", None)
        if numbers is not None and written is not None:
            chosen, _ = signs(written, self.mechanism, by_path(self.dimensions, numbers.tolist()), 1)
            if len(chosen) == len(written.closed):
                self._held = with_signs({}, {name: float(sign[0]) for name, sign in chosen.items()})
        return self._held is not None

    # --- one design -----------------------------------------------------------------------------------------------
    def __call__(self, numbers: ArrayLike, inputs: ArrayLike) -> Reals:
        """The requested quantities of one design.

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

        Raises
        ------
        ValueError
            No numbers, or another count of them.
        """
        x, q = self._arrays(numbers, inputs)
        if self._written is not None:
            rows, fine = self._evaluated(x, q, None)
            if fine or self._goes(x, q):
                self.evaluations += 1
                return rows if np.isfinite(rows).all() else np.where(np.isfinite(rows), rows, np.nan)
            # a dip that has to be looked into tells of this design what its signs do not
            self._chosen = x.tobytes(), None
        self.evaluations += 1
        return self._alone.values(x, q)

    def _arrays(self, numbers: ArrayLike, inputs: ArrayLike) -> tuple[Reals, Reals]:
        x, q = as_numbers("numbers", numbers), as_numbers("inputs", inputs)
        if x.shape != (len(self.dimensions),):
            paths = ", ".join(self._paths)
            raise ValueError(
                f"numbers must have the shape ({len(self.dimensions)},), one for each of {paths}, found the shape {x.shape}"
            )
        if q.ndim != 1:
            raise ValueError(f"inputs must have the shape (n,), found the shape {q.shape}")
        return x, q

    def slopes(self, numbers: ArrayLike, inputs: ArrayLike, inputs_alone: bool = False) -> Reals:
        """Return the derivatives with respect to the dimensions, and last to the inputs themselves, (rows, n, d + 1).

        `inputs_alone`: to nothing but the inputs, (rows, n, 1).
        """
        x, q = self._arrays(numbers, inputs)
        enters = ("q0",) if inputs_alone else (*self._paths, "q0")
        if self._written is not None and self._chosen != (x.tobytes(), None):
            slopes, fine = self._evaluated(x, q, enters)
            if fine or self._known(x) is not None:
                return slopes.reshape(len(self.keys), len(enters), len(q)).transpose(0, 2, 1)
        if self._alone.written is not None:
            return self._alone.slopes(x, q, enters)
        return self._differences(x, q, inputs_alone)

    def _evaluated(self, x: Reals, q: Reals, enters: tuple[str, ...] | None) -> tuple[Reals, bool]:
        """The quantities, or their derivatives, from one run of a tape; and whether the branch is certain so simply."""
        held = self._held if self._held is not None else {"at": self.mechanism.at[0]}
        again = self._ready(q, enters)
        rows, fine = again(self._moving | held | by_path(self.dimensions, x.tolist()))
        return rows[:, : len(q)], fine

    def _ready(self, q: Reals, enters: tuple[str, ...] | None) -> Repeated:
        """Return the object that computes one design after another at some inputs; that of the last inputs is kept."""
        own_signs = self._held is None
        key, same = (enters, own_signs), q.tobytes()
        kept = self._kept.get(key)
        if kept is None or kept[0] != same:
            assert self._written is not None
            tape = self._written.evaluation(self.keys, enters, own_signs)
            lanes = self._with_way(q) if own_signs and enters is None else q
            kept = self._kept[key] = same, Repeated(tape, {"q0": lanes}, tested=own_signs)
        return kept[1]

    def _known(self, x: Reals) -> dict[str, Any] | None:
        """Return the inputs of a design's tape other than the input itself; None if it is better described alone."""
        name = x.tobytes()
        if self._chosen[0] != name:
            self._chosen = name, self._enters(x)
        return self._chosen[1]

    def _enters(self, x: Reals) -> dict[str, Any] | None:
        written, m = self._written, self.mechanism
        if written is None:
            return None
        numbers = by_path(self.dimensions, x.tolist())
        chosen, plain = signs(written, m, numbers, 1)
        return (
            with_signs(numbers, {name: float(sign[0]) for name, sign in chosen.items()}) if plain[0] else None
        )

    def _goes(self, x: Reals, q: Reals) -> bool:
        """Whether a design goes by its signs: the guess decides them, and no other branch is met on the way to the poses."""
        entering, written = self._known(x), self._written
        if entering is None or written is None:
            return False
        low, high = self._ends(q)
        return not meet_on_the_way(written, self.mechanism, entering, 1, np.array([low]), np.array([high]))[0]

    def _ends(self, q: Reals) -> tuple[float, float]:
        """The least and the largest of the guess's input and these."""
        at = self.mechanism.at[0]
        return float(np.nanmin(q, initial=at)), float(np.nanmax(q, initial=at))

    def _with_way(self, q: Reals) -> Reals:
        """Inputs, and behind them samples of the way from the guess over all of them, of a turn at most."""
        m, written = self.mechanism, self._written
        assert written is not None
        low, high = self._ends(q)
        last = min(high, low + (np.inf if m.inputs[0].is_slide else 2 * np.pi))
        return np.concatenate([q, np.linspace(low, last, samples(written, m, high - low))])

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
        angles = np.array([key.is_angle for key in self.keys])[:, None]
        columns = []
        for i, h in enumerate((turn, *step)):
            apart = table[:, 2 * i] - table[:, 2 * i + 1]
            columns.append(np.where(angles, np.angle(np.exp(1j * apart)), apart) / (2 * h))
        return np.stack([*columns[1:], columns[0]], axis=-1)

    # --- many designs -----------------------------------------------------------------------------------------------
    def table(self, numbers: Reals, inputs: Reals) -> Reals:
        """The requested quantities of designs (v, d) at their inputs (v or 1, n): (rows, v, n)."""
        self.evaluations += len(numbers)
        return np.stack(self.solved(numbers, inputs, self.keys))

    def solved(self, numbers: Reals, inputs: Reals, keys: Sequence[Quantity]) -> list[NDArray[Any]]:
        """Any quantities of designs (v, d) at their inputs (v or 1, n), (v, n) each."""
        part = Part(self.mechanism, self.dimensions, numbers, inputs[:, :, None], self._at_rates)
        return Solver(part, self._first).values(keys)


class Alone:
    """Positions over the input of designs that are described alone, as their branch is more than signs; the last is kept.

    The formulas are written down once too, with one Newton step of every group that has no closed form. What closes such a
    group enters as the design's own iteration finds it: there the derivative of the step is that of the solution (the
    implicit function theorem), and one sweep backwards over the tape has the derivatives to all dimensions.

    Parameters
    ----------
    mechanism : Description
    dimensions : sequence of Dimension
    keys : sequence of Quantity
    """

    def __init__(
        self,
        mechanism: Description,
        dimensions: Sequence[Dimension],
        keys: Sequence[Quantity],
        rates: tuple[float, float, float] = REST,
    ) -> None:
        self.mechanism, self.dimensions, self.keys, self.rates = (
            mechanism,
            tuple(dimensions),
            tuple(keys),
            rates,
        )
        self._last: tuple[bytes, Assembly | None] | None = None

    @cached_property
    def written(self) -> VariedFormulas | None:
        """The formulas; None where a gear's phase depends on links that have to be placed first, or every pose is singular.

        And where the mechanism's own dimensions cannot be put together.
        """
        try:
            own = assembled(self.mechanism)
        except MechanismError:
            return None
        if own.folded:
            return None
        moves = tuple(bool(rate) for rate in self.rates)
        result = VariedFormulas(own, self.dimensions, moves, own_signs=True, settled=False)
        return None if result.open_gears else result

    def values(self, x: Reals, q: Reals) -> Reals:
        """The requested quantities of one design, (rows, n); NaN where it cannot be assembled."""
        poses = self._poses(x, q)
        if poses is None:
            return np.full((len(self.keys), len(q)), np.nan)
        if any(isinstance(key, Transmission) for key in self.keys):
            # sines that are on the tape alone
            return self._rows(self.written, x, poses)
        return np.stack(poses.values(self.keys))

    def _rows(self, written: VariedFormulas | None, x: Reals, poses: Lanes) -> Reals:
        """The requested quantities, from the tape."""
        if written is None:
            return np.full((len(self.keys), poses.n), np.nan)
        tape = written.tape(self.keys)
        numbers = by_path(self.dimensions, x.tolist())
        rest = [name for name in tape.inputs if name not in numbers]
        with np.errstate(all="ignore"):
            outputs = run(tape, numbers | poses.entering(rest))
        return np.array([key.of_rows(outputs, poses.n) for key in self.keys])

    def slopes(self, x: Reals, q: Reals, enters: tuple[str, ...]) -> Reals:
        """Its derivatives to dimensions by their paths, and to the input `q0`, (rows, n, len(enters))."""
        out = np.full((len(self.keys), len(q), len(enters)), np.nan)
        poses = self._poses(x, q)
        if poses is None:
            return out
        assert self.written is not None
        tape = self.written.slopes(self.keys, enters)
        numbers = by_path(self.dimensions, x.tolist())
        rest = [name for name in tape.inputs if name not in numbers]
        assert self._last is not None
        assert self._last[1] is not None
        with np.errstate(all="ignore"):
            outputs = run(tape, numbers | poses.entering(rest))
        for row, key in enumerate(self.keys):
            for column, to in enumerate(enters):
                out[row, :, column] = key.of_rows(outputs, poses.n, to)
        out[:, ~poses.assembled] = np.nan
        return out

    def _poses(self, x: Reals, q: Reals) -> Lanes | None:
        """A design at some inputs; None where it cannot be put together."""
        name = x.tobytes()
        if self._last is None or self._last[0] != name:
            try:
                self._last = (
                    name,
                    Assembly.from_guess(changed(self.mechanism, by_path(self.dimensions, x.tolist()))),
                )
            except MechanismError:
                self._last = name, None
        return None if self._last[1] is None else Lanes(self._last[1], q, *self.rates)


def numbers_of(m: Description, name: str) -> tuple[Quantity, ...]:
    """The numbers that a name stands for: `points.H.x` (or `H.x`), `links.rocker`, `slides.B`, the input's `effort.crank`.

    `points.H` (or `H`) stands for both coordinates.

    Raises
    ------
    DescriptionError
        With the nearest name in place of the unknown one.
    """
    room, _, of = name.partition(".")
    if room not in ROOMS or not of:
        room, of = "points", name
    points = {point: body for body, named in m.bodies.items() for point in named}
    owner, _, axis = of.rpartition(".")
    if room == "points" and of in points:
        return tuple(Coordinate(points[of], 0j, of, i) for i in (0, 1))
    if room == "points" and owner in points and axis in AXES:
        return (Coordinate(points[owner], 0j, owner, AXES.index(axis)),)
    if room == "links" and of in m.links:
        return (Angle(of, 0),)
    if room == "slides" and of in m.guided:
        return (Slide(m.guided[of], 0),)
    if room == "effort" and of == m.inputs[0].name:
        return (Effort(0),)
    every = {"points": points, "links": m.links, "slides": m.guided, "effort": (str(m.inputs[0].name),)}[room]
    raise DescriptionError(f"no {ROOMS[room]} is named '{of}'{choices(of, every)}")


def numbers_of_each(m: Description, names: Iterable[str]) -> dict[str, tuple[Quantity, ...]]:
    """The numbers of each name; ValueError where two names share one."""
    result = {name: numbers_of(m, name) for name in names}
    every = [key for of in result.values() for key in of]
    shared = [name for name, of in result.items() if any(every.count(key) > 1 for key in of)]
    if shared:
        raise ValueError(f"{' and '.join(shared)} name the same number: expected each once")
    return result
