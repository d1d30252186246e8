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

from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from virtualwork.describe.description import Description
from virtualwork.describe.dimensions import Dimension, changed, dimensions, named, value
from virtualwork.family.motion import FamilyMotion
from virtualwork.family.part import Part
from virtualwork.formulas.numbers import Number, Reals

if TYPE_CHECKING:
    from concurrent.futures import Executor


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
        known = dimensions(mechanism)
        columns: dict[Dimension, Reals] = {}
        for path, given in numbers.items():
            found = named(mechanism, path, known)
            column = np.asarray(given)
            if np.iscomplexobj(column) and len(found) == 2:
                column = np.stack([column.real, column.imag], axis=-1)
            column = np.asarray(column, dtype=float)
            if column.ndim != len(found) or (len(found) == 2 and column.shape[1:] != (2,)):
                shape = "(v,)" if len(found) == 1 else "(v, 2)"
                raise ValueError(f"{path}: expected shape {shape}, found {column.shape}")
            columns |= zip(found, [column] if len(found) == 1 else column.T, strict=True)
        sizes = {len(column) for column in columns.values()}
        if len(sizes) != 1:
            raise ValueError(f"expected as many values of each dimension, found {sorted(sizes)}")
        for dimension, column in columns.items():
            if not np.isfinite(column).all():
                i = int(np.argmin(np.isfinite(column)))
                raise ValueError(f"{dimension.path}: found {column[i]} at {i}, expected finite numbers")
        self.dimensions = tuple(columns)
        # a column beside the other: each is in one piece
        self.values = np.array(list(columns.values())).T

    def __len__(self) -> int:
        return len(self.values)

    def __repr__(self) -> str:
        varied = ", ".join(d.path for d in self.dimensions)
        return f"Family({self.mechanism.name!r}: {len(self)} variants of {varied})"

    def __getitem__(self, i: int) -> Description:
        """The i-th variant, described alone."""
        numbers = zip(self.dimensions, self.values[i].tolist(), strict=True)
        return changed(self.mechanism, {d.path: number for d, number in numbers})

    def motion(
        self,
        angle: ArrayLike | None = None,
        speed: ArrayLike | None = None,
        acceleration: ArrayLike | None = None,
        executor: Executor | None = None,
    ) -> FamilyMotion:
        """Motion of every variant over the same inputs; every quantity is solved when first asked for.

        Parameters
        ----------
        angle : array (n,), or (n, k) for k inputs
            The input: rad for a turning input, m for a slide. Without it each variant is at its own.
        speed, acceleration : same shape or scalar
            Its derivatives in time: what is given beats the description's own, and a varied one.
        executor : concurrent.futures.Executor
            Works out parts of the variants; without it all are worked out here.

        Returns
        -------
        FamilyMotion
            Every array has a leading axis of variants.
        """
        inputs, rates = self.inputs(angle), self.rates(speed, acceleration)
        return FamilyMotion(Part(self.mechanism, self.dimensions, self.values, inputs, rates), executor)

    def own(self, name: str) -> list[Reals]:
        """What the descriptions say of each input: its value, or a rate, (v,)."""
        return [np.full(len(self), own) if np.ndim(own) == 0 else own for own in self._of_inputs(name)]

    def _of_inputs(self, name: str) -> list[Number]:
        """The same; a number where it is not varied."""
        every = (self._own[j, name] for j in range(len(self.mechanism.inputs)))
        return [number if at is None else self.values[:, at] for at, number in every]

    @cached_property
    def _own(self) -> dict[tuple[int | str, int | str], tuple[int | None, float]]:
        """Of each input's value and rates the place among what is varied, or None; and the description's own number."""
        known = dimensions(self.mechanism)
        places = {d.path: i for i, d in enumerate(self.dimensions)}
        return {
            (d.where[1], d.where[2]): (places.get(d.path), float(value(self.mechanism, d.path).real))
            for d in known.values()
            if d.where[0] == "inputs"
        }

    def inputs(self, angle: ArrayLike | None) -> Reals:
        """(v or 1, n, k)."""
        k = len(self.mechanism.inputs)
        if angle is None:
            return np.stack(self.own("value"), axis=-1)[:, None, :]
        q = np.asarray(angle, dtype=float)
        if k == 1:
            return q.reshape(1, -1, 1)
        if q.shape != (k,) and (q.ndim != 2 or q.shape[1] != k):
            raise ValueError(f"angle: expected shape (n, {k}) for {k} inputs, found {q.shape}")
        return q.reshape(1, -1, k)

    def rates(self, *given: ArrayLike | None) -> list[list[Number]]:
        """Speed, acceleration, jerk of each input: a number, or an array that broadcasts to (v, n)."""
        rates: list[list[Number]] = []
        for rate, name in zip((*given, None), ("speed", "acceleration", "jerk"), strict=True):
            if rate is None:
                own = self._of_inputs(name)
                rates.append(
                    [r if np.ndim(r) == 0 else float(r[0]) if (r == r[0]).all() else r[:, None] for r in own]
                )
                continue
            r = np.asarray(rate, dtype=float)
            k = len(self.mechanism.inputs)
            if r.ndim == 0:
                rates.append([float(r)] * k)
            else:
                rates.append([r.reshape(1, -1)] if k == 1 else [r[..., j].reshape(1, -1) for j in range(k)])
        return rates
