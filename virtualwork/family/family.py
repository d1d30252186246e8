"""Variants of one mechanism: the same links and joints with other dimensions, solved together.

>>> import numpy as np
>>> from virtualwork import Input, Link, Mechanism
>>> arm = Mechanism({"O": 0j}, {"arm": Link({"O": 0j, "P": 1})}, inputs=Input("arm"))
>>> family = arm.vary({"links.arm.P.x": [1.0, 2.0, 3.0]})
>>> family.motion([0.0, 1.0], speed=2.0).point("P").velocity.shape
(3, 2, 2)
>>> family.motion(0.0).point("P").position[:, 0, 0]
array([1., 2., 3.])
"""

from __future__ import annotations

import math
import threading
import weakref
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any
from uuid import uuid4

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.engines import as_part
from dalembert.arithmetic.guard import Lock, guarded, own_lock
from dalembert.arithmetic.parts import in_parts
from virtualwork.branch.assembly import Assembly
from virtualwork.describe import DescriptionError, MechanismError
from virtualwork.describe.description import Description
from virtualwork.describe.dimensions import Dimension, by_path, changed, dimensions, named, number_of
from virtualwork.family.part import ASSEMBLED, LANES, Part, Solver, room
from virtualwork.formulas.forces import Effort, Reaction
from virtualwork.formulas.numbers import Number, Reals, real_array, xy
from virtualwork.formulas.poses import as_inputs, check_rate
from virtualwork.formulas.quantity import Quantity
from virtualwork.parts_of_motion import LinkRates, NamedParts, PointRates, SlideRates
from virtualwork.plan.steps import joints

if TYPE_CHECKING:
    from concurrent.futures import Executor


@guarded
class Family:
    """Variants of a mechanism; `Mechanism.vary` makes one.

    Attributes
    ----------
    mechanism : Description
        What they are variants of.
    dimensions : tuple of Dimension
        What is varied.
    values : array (v, d)
        The numbers of each variant, SI.
    """

    def __init__(self, mechanism: Description, numbers: Mapping[str, ArrayLike]) -> None:
        self.mechanism = mechanism
        if not isinstance(numbers, Mapping) or not numbers:
            raise ValueError(
                f"vary: expected numbers by their paths, such as {{'{next(iter(dimensions(mechanism)), 'path')}': [...]}}, found {numbers!r}"
            )
        columns: dict[Dimension, Reals] = {}
        for path, values in numbers.items():
            components = named(mechanism, path)
            column = np.asanyarray(values)
            if np.iscomplexobj(column) and len(components) == 2:
                column = np.stack([column.real, column.imag], axis=-1)
            column = real_array(path, column)
            if column.ndim != len(components) or (len(components) == 2 and column.shape[1:] != (2,)):
                shape = "(v,)" if len(components) == 1 else "(v, 2)"
                raise ValueError(f"{path}: expected shape {shape}, found {column.shape}")
            columns |= zip(components, [column] if len(components) == 1 else column.T, strict=True)
        sizes = {len(column) for column in columns.values()}
        if len(sizes) != 1:
            raise ValueError(f"expected as many values of each dimension, found {sorted(sizes)}")
        for dimension, column in columns.items():
            if not np.isfinite(column).all():
                i = int(np.argmin(np.isfinite(column)))
                raise ValueError(f"{dimension.path}: found {column[i]} at {i}, expected finite numbers")
        self.dimensions = tuple(columns)
        # each column is in one piece
        self.values = np.array(list(columns.values())).T

    @property
    def lock(self) -> Lock:
        """Its own."""
        return own_lock(self)

    def __len__(self) -> int:
        return len(self.values)

    def __repr__(self) -> str:
        varied = ", ".join(d.path for d in self.dimensions)
        return f"Family({self.mechanism.name!r}: {len(self)} variants of {varied})"

    def __getitem__(self, i: int) -> Description:
        """The i-th variant, described alone."""
        return changed(self.mechanism, by_path(self.dimensions, self.values[i].tolist()))

    def motion(
        self,
        angle: ArrayLike | None = None,
        speed: ArrayLike | None = None,
        acceleration: ArrayLike | None = None,
        executor: Executor | None = None,
    ) -> FamilyMotion:
        """Return the motion of every variant over the same inputs; every quantity is solved on the first request.

        Parameters
        ----------
        angle : array (n,), or (n, k) for k inputs
            The input: rad for a turning input, m for a slide. Without it each variant is at its own.
        speed, acceleration : same shape or scalar
            Its derivatives in time: what is given beats the description's own, and a varied one.
        executor : concurrent.futures.Executor
            Computes parts of the variants; without it all are computed here.

        Returns
        -------
        FamilyMotion
            Every array has a leading axis of variants.
        """
        inputs = self.inputs(angle)
        for name, rate in (("speed", speed), ("acceleration", acceleration)):
            if rate is not None:
                check_rate(name, real_array(name, rate), *inputs.shape[1:])
        rates = self.rates(speed, acceleration)
        return FamilyMotion(Part(self.mechanism, self.dimensions, self.values, inputs, rates), executor)

    def own(self, name: str) -> list[Reals]:
        """Return each input of the descriptions: its value, or a rate, (v,)."""
        return [np.full(len(self), own) if np.ndim(own) == 0 else own for own in self._of_inputs(name)]

    def _of_inputs(self, name: str) -> list[Number]:
        """Return each input's value or rate, (v,); a number if it is not varied."""
        every = (self._own[j, name] for j in range(len(self.mechanism.inputs)))
        return [number if at is None else self.values[:, at] for at, number in every]

    @cached_property
    def _own(self) -> dict[tuple[int | str, int | str], tuple[int | None, float]]:
        """Return the index of each input's value and rates among the varied dimensions, or None; and the description's own number."""
        every = dimensions(self.mechanism)
        places = {d.path: i for i, d in enumerate(self.dimensions)}
        return {
            (d.where[1], d.where[2]): (places.get(d.path), float(number_of(self.mechanism, d)))
            for d in every.values()
            if d.where[0] == "inputs"
        }

    def inputs(self, angle: ArrayLike | None) -> Reals:
        """(v or 1, n, k)."""
        if angle is None:
            return np.stack(self.own("value"), axis=-1)[:, None, :]
        return as_inputs(angle, len(self.mechanism.inputs))[None]

    def rates(self, *requested: ArrayLike | None) -> list[list[Number]]:
        """Speed, acceleration, jerk of each input: a number, or an array that broadcasts to (v, n)."""
        rates: list[list[Number]] = []
        for rate, name in zip((*requested, None), ("speed", "acceleration", "jerk"), strict=True):
            if rate is None:
                own = self._of_inputs(name)
                rates.append(
                    [r if np.ndim(r) == 0 else float(r[0]) if (r == r[0]).all() else r[:, None] for r in own]
                )
                continue
            r = real_array(name, rate)
            k = len(self.mechanism.inputs)
            if r.ndim == 0:
                rates.append([float(r)] * k)
            else:
                rates.append([r.reshape(1, -1)] if k == 1 else [r[..., j].reshape(1, -1) for j in range(k)])
        return rates


class PointOfFamily(PointRates):
    """Motion of one point in every variant: `position`, `velocity`, `acceleration`, `jerk`, each (v, n, 2)."""

    motion: FamilyMotion

    def __repr__(self) -> str:
        return f"PointOfFamily({self.node or self.place!r} of {self.body}, {len(self.motion)} variants)"


class LinkOfFamily(LinkRates):
    """Motion of one link in every variant: `angle`, `omega`, `alpha`, `jerk`, each (v, n)."""

    motion: FamilyMotion

    def __repr__(self) -> str:
        return f"LinkOfFamily({self.body}, {len(self.motion)} variants)"


@guarded
class FamilyMotion(NamedParts[PointOfFamily, LinkOfFamily, SlideRates]):
    """Position, rates and forces of all variants over given inputs, on demand; `Family.motion` makes one.

    Attributes
    ----------
    part : Part
        The variants and the inputs of their poses.
    executor : concurrent.futures.Executor or None
    """

    kinds = PointOfFamily, LinkOfFamily, SlideRates

    def __init__(self, part: Part, executor: Executor | None = None) -> None:
        self.part, self.executor = part, executor
        self._name = uuid4().hex
        self._known: dict[Quantity, Any] = {}
        self._reasons: dict[int, str] = {}
        weakref.finalize(self, forget, self._name)

    @property
    def lock(self) -> Lock:
        """Its own: workers of an executor have that of their part's assembly."""
        return own_lock(self)

    def __len__(self) -> int:
        return self.part.shape[0]

    def __repr__(self) -> str:
        v, n = self.part.shape
        return f"FamilyMotion({self.part.mechanism.name!r}: {v} variants in {n} poses)"

    @property
    def mechanism(self) -> Description:
        """What they are variants of."""
        return self.part.mechanism

    @property
    def inputs(self) -> Reals:
        """(v or 1, n, k): the inputs, rad or m."""
        return self.part.inputs

    # --- solving ------------------------------------------------------------------------------------------------
    def parts(self) -> Iterator[tuple[int, slice]]:
        """The variants in parts: always the same ones, whoever computes them, and so are the numbers."""
        v, n = self.part.shape
        each = max(1, LANES // max(n, 1))
        for number, i in enumerate(range(0, v, each)):
            yield number, slice(i, min(i + each, v))

    def values(self, keys: Sequence[Quantity]) -> list[Any]:
        """Return several quantities by their keys, each (v, n), real or complex."""
        new = tuple(key for key in keys if key not in self._known)
        if new:
            rows = [rows for _, rows in self.parts()]
            out = room(new, *self.part.shape)
            here = self.executor is None
            work = (
                (self._name, number, self.part.some(some), new, [x[some] for x in out] if here else None)
                for number, some in self.parts()
            )
            # what others work out depends on the whole, and not on what each of them did before
            of = answer if here else partial(as_part, math.prod(self.part.shape), answer)
            for some, (values, reasons) in zip(rows, in_parts(of, work, self.executor), strict=True):
                if not here:
                    for x, value in zip(out, values, strict=True):
                        x[some] = value
                self._reasons |= {some.start + place: reason for place, reason in reasons.items()}
            self._known |= zip(new, out, strict=True)
        return [self._known[key] for key in keys]

    def value(self, key: Quantity) -> Any:
        """Return a quantity by its key, (v, n)."""
        return self.values([key])[0].copy()

    def vector(self, key: Quantity) -> Reals:
        """Return a vector by its key, (v, n, 2)."""
        return xy(self.value(key))

    @cached_property
    def assembled(self) -> NDArray[np.bool_]:
        """Whether each pose of each variant can be assembled, (v, n) bool."""
        return np.asarray(np.isfinite(self.values([ASSEMBLED])[0]))

    @property
    def failed(self) -> int:
        """The number of variants that cannot be assembled in some pose."""
        return int((~self.assembled.all(axis=1)).sum())

    def reason(self, i: int) -> str | None:
        """Return why the i-th variant cannot be assembled in some pose; None if it can in all."""
        bad = np.flatnonzero(~self.assembled[i])
        if not len(bad):
            return None
        if i in self._reasons:
            return self._reasons[i]
        q = np.broadcast_to(self.part.inputs, (*self.part.shape, self.part.inputs.shape[2]))[i, bad[0]]
        try:
            result = Assembly.from_guess(self.part.described(i)).reach.shortfall(tuple(q.tolist()))
        except MechanismError as error:
            return str(error)
        return None if result is None else result.text()

    # --- forces ---------------------------------------------------------------------------------------------------
    @property
    def effort(self) -> Reals:
        """The effort at the input by virtual work, (v, n) N·m (N at a slide); (v, n, k) for k inputs."""
        k = len(self.part.mechanism.inputs)
        result = self.values([Effort(j) for j in range(k)])
        return result[0] if k == 1 else np.stack(result, axis=-1)

    def reaction(self, joint: str, on: str) -> Reals:
        """Return the force of all other links on a link at a joint, (v, n, 2) N.

        Raises
        ------
        DescriptionError
            Where the link has no joint of that name.
        """
        if not any(j.name == joint and on in j.bodies for j in joints(self.part.mechanism)):
            raise DescriptionError(f"link '{on}' has no joint at '{joint}'")
        return self.vector(Reaction(joint, on))


# --- the solutions of parts that a process keeps for further requests -------------------------------------------------
_lock = threading.Lock()
_solvers: dict[tuple[str, int], Solver] = {}
# so many parts
PARTS = 16


def answer(
    family: str,
    number: int,
    part: Part,
    keys: Sequence[Quantity],
    out: Sequence[NDArray[Any]] | None = None,
) -> tuple[list[Any], dict[int, str]]:
    """Quantities of a part, and why some of its variants have none; what a process has solved of it is kept.

    `family` names the request and its variants, and `number` the part; `out` is where to write them.
    """
    with _lock:
        solver = _solvers.get((family, number))
        if solver is None:
            while len(_solvers) >= PARTS:
                _solvers.pop(next(iter(_solvers)), None)
            before = next((s for (name, _), s in list(_solvers.items()) if name == family), None)
            solver = _solvers[family, number] = Solver(part, before)
    return solver.values(keys, out), solver.reasons


def forget(family: str) -> None:
    """Let what this process keeps of a family go."""
    # called wherever a family is collected, in the midst of `answer` too: it must not wait for the lock
    for key in [key for key in list(_solvers) if key[0] == family]:
        _solvers.pop(key, None)
