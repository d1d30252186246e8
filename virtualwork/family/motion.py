"""The motion of all variants of a mechanism: what a `Motion` is asked, with a leading axis of variants."""

from __future__ import annotations

import math
import weakref
from collections.abc import Iterator, Sequence
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any
from uuid import uuid4

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.engines import as_part
from dalembert.arithmetic.parts import in_parts
from virtualwork.branch.assembly import Assembly
from virtualwork.describe import DescriptionError, MechanismError
from virtualwork.describe.parts import Point, as_point
from virtualwork.family.part import ASSEMBLED, LANES, Part, answer, forget, room
from virtualwork.formulas.asked import Key
from virtualwork.formulas.numbers import Complexes, Reals
from virtualwork.plan.steps import joints

if TYPE_CHECKING:
    from concurrent.futures import Executor


class PointOfFamily:
    """Motion of one point in every variant: `position`, `velocity`, `acceleration`, `jerk`, each (v, n, 2)."""

    def __init__(self, motion: FamilyMotion, body: str, place: complex, node: str | None) -> None:
        self.motion, self.body, self.place, self.node = motion, body, place, node

    def __repr__(self) -> str:
        return f"PointOfFamily({self.node or self.place!r} of {self.body}, {len(self.motion)} variants)"

    @property
    def position(self) -> Reals:
        """(v, n, 2) m; NaN where the pose cannot be assembled."""
        return _xy(self.complex(0))

    @property
    def velocity(self) -> Reals:
        """(v, n, 2) m/s."""
        return _xy(self.complex(1))

    @property
    def acceleration(self) -> Reals:
        """(v, n, 2) m/s²."""
        return _xy(self.complex(2))

    @property
    def jerk(self) -> Reals:
        """(v, n, 2) m/s³."""
        return _xy(self.complex(3))

    def complex(self, order: int) -> Complexes:
        """The order-th time derivative as x + iy, (v, n)."""
        return self.motion.values([("point", self.body, self.place, self.node, order)])[0]  # type: ignore[no-any-return]


class LinkOfFamily:
    """Motion of one link in every variant: `angle`, `omega`, `alpha`, `jerk`, each (v, n)."""

    def __init__(self, motion: FamilyMotion, body: str) -> None:
        self.motion, self.body = motion, body

    def __repr__(self) -> str:
        return f"LinkOfFamily({self.body}, {len(self.motion)} variants)"

    def _of(self, order: int) -> Reals:
        return self.motion.values([("angle", self.body, order)])[0]  # type: ignore[no-any-return]

    @property
    def angle(self) -> Reals:
        """(v, n) rad, in (−π, π]."""
        return self._of(0)

    @property
    def omega(self) -> Reals:
        """(v, n) rad/s."""
        return self._of(1)

    @property
    def alpha(self) -> Reals:
        """(v, n) rad/s²."""
        return self._of(2)

    @property
    def jerk(self) -> Reals:
        """(v, n) rad/s³."""
        return self._of(3)


class SlideOfFamily:
    """Motion along one guide in every variant: `position`, `speed`, `acceleration`, `jerk`, each (v, n)."""

    def __init__(self, motion: FamilyMotion, guide: int) -> None:
        self.motion, self.guide = motion, guide

    def _of(self, order: int) -> Reals:
        return self.motion.values([("slide", self.guide, order)])[0]  # type: ignore[no-any-return]

    @property
    def position(self) -> Reals:
        """(v, n) m."""
        return self._of(0)

    @property
    def speed(self) -> Reals:
        """(v, n) m/s."""
        return self._of(1)

    @property
    def acceleration(self) -> Reals:
        """(v, n) m/s²."""
        return self._of(2)

    @property
    def jerk(self) -> Reals:
        """(v, n) m/s³."""
        return self._of(3)


class FamilyMotion:
    """Position, rates and forces of all variants over given inputs, on demand; `Family.motion` makes one.

    Attributes
    ----------
    part : Part
        The variants and the inputs they are asked at.
    executor : concurrent.futures.Executor or None
    """

    def __init__(self, part: Part, executor: Executor | None = None) -> None:
        self.part, self.executor = part, executor
        self._name = uuid4().hex
        self._known: dict[Key, Any] = {}
        self._reasons: dict[int, str] = {}
        weakref.finalize(self, forget, self._name)

    def __len__(self) -> int:
        return self.part.shape[0]

    def __repr__(self) -> str:
        v, n = self.part.shape
        return f"FamilyMotion({self.part.mechanism.name!r}: {v} variants in {n} poses)"

    @property
    def inputs(self) -> Reals:
        """(v or 1, n, k): the inputs, rad or m."""
        return self.part.inputs

    # --- solving ------------------------------------------------------------------------------------------------
    def parts(self) -> Iterator[tuple[int, slice]]:
        """The variants in parts: always the same ones, whoever works them out, and so are the numbers."""
        v, n = self.part.shape
        each = max(1, LANES // max(n, 1))
        for number, i in enumerate(range(0, v, each)):
            yield number, slice(i, min(i + each, v))

    def values(self, keys: Sequence[Key]) -> list[Any]:
        """Quantities by their keys (`Recording.value`), each (v, n), real or complex."""
        new = tuple(key for key in keys if key not in self._known)
        if new:
            rows = [rows for _, rows in self.parts()]
            out = room(new, *self.part.shape)
            here = self.executor is None
            work = (
                (self._name, number, self.part.some(some), new, [x[some] for x in out] if here else None)
                for number, some in self.parts()
            )
            # what others work out hangs on the whole, and not on what each of them did before
            of = answer if here else partial(as_part, math.prod(self.part.shape), answer)
            for some, (values, reasons) in zip(rows, in_parts(of, work, self.executor), strict=True):
                if not here:
                    for x, value in zip(out, values, strict=True):
                        x[some] = value
                self._reasons |= {some.start + place: reason for place, reason in reasons.items()}
            self._known |= zip(new, out, strict=True)
        return [self._known[key] for key in keys]

    @cached_property
    def assembled(self) -> NDArray[np.bool_]:
        """(v, n) bool: which poses of which variants can be assembled."""
        return np.asarray(np.isfinite(self.values([ASSEMBLED])[0]))

    @property
    def failed(self) -> int:
        """How many variants cannot be assembled in some pose."""
        return int((~self.assembled.all(axis=1)).sum())

    def reason(self, i: int) -> str | None:
        """Why the i-th variant cannot be assembled in some pose; None where it can in all."""
        bad = np.flatnonzero(~self.assembled[i])
        if not len(bad):
            return None
        if i in self._reasons:
            return self._reasons[i]
        q = np.broadcast_to(self.part.inputs, (*self.part.shape, self.part.inputs.shape[2]))[i, bad[0]]
        try:
            found = Assembly.from_guess(self.part.described(i)).reach.shortfall(tuple(q.tolist()))
        except MechanismError as error:
            return str(error)
        return None if found is None else found.text()

    # --- what moves -----------------------------------------------------------------------------------------------
    def point(self, name: str) -> PointOfFamily:
        """Motion of a named point.

        Raises
        ------
        DescriptionError
            Where no body has a point of that name.
        """
        for body, points in self.part.mechanism.bodies.items():
            if name in points:
                return PointOfFamily(self, body, 0j, name)
        raise DescriptionError(f"no point is named '{name}'")

    def at(self, link: str, point: Point | str) -> PointOfFamily:
        """Motion of any point of a link: a name, or coordinates in the link's own axes."""
        if isinstance(point, str):
            return self.point(point)
        return PointOfFamily(self, link, as_point(point), None)

    def link(self, name: str) -> LinkOfFamily:
        """Motion of a link.

        Raises
        ------
        DescriptionError
            Where there is no link of that name.
        """
        if name not in self.part.mechanism.links:
            raise DescriptionError(f"no link is named '{name}'")
        return LinkOfFamily(self, name)

    def slide(self, name: str) -> SlideOfFamily:
        """Motion along the guide in which the named point runs."""
        for i, guide in enumerate(self.part.mechanism.guides):
            if guide.point == name:
                return SlideOfFamily(self, i)
        raise DescriptionError(f"no slot or slider runs at a point named '{name}'")

    # --- forces ---------------------------------------------------------------------------------------------------
    @property
    def effort(self) -> Reals:
        """The effort at the input by virtual work, (v, n) N·m (N at a slide); (v, n, k) for k inputs."""
        k = len(self.part.mechanism.inputs)
        found = self.values([("effort", j) for j in range(k)])
        return found[0] if k == 1 else np.stack(found, axis=-1)

    def reaction(self, joint: str, on: str) -> Reals:
        """The force of all others on a link at a joint, (v, n, 2) N.

        Raises
        ------
        DescriptionError
            Where the link has no joint of that name.
        """
        if not any(j.name == joint and on in j.bodies for j in joints(self.part.mechanism)):
            raise DescriptionError(f"link '{on}' has no joint at '{joint}'")
        return _xy(self.values([("reaction", joint, on)])[0])


def _xy(z: Complexes) -> Reals:
    """x + iy (v, n) as (v, n, 2)."""
    return np.stack([z.real, z.imag], axis=-1)
