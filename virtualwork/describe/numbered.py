"""A description whose every number has a path: it can be read and changed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Self

from virtualwork.describe.description import Description

if TYPE_CHECKING:
    from virtualwork.describe.dimensions import Dimension


class Numbered(Description):
    """A description with its numbers by their paths in the file."""

    @property
    def dimensions(self) -> dict[str, Dimension]:
        """Every number of the description by its path in the file, `links.crank.B.x`, with its kind and unit."""
        from virtualwork.describe.dimensions import dimensions

        return dict(dimensions(self))

    @property
    def own_inputs(self) -> tuple[float, ...]:
        """The inputs as the description has them, rad or m; of those that it does not give, where its guess is meant."""
        return tuple(at if e.value is None else e.value for e, at in zip(self.inputs, self.at, strict=True))

    def value(self, path: str) -> float | complex:
        """Return the number at a path, SI; x + iy of a point; 0 for a rate of an input that the file does not give.

        Raises
        ------
        DescriptionError
            Where the path names no number.

        Examples
        --------
        >>> from virtualwork import Input, Link, Mechanism
        >>> arm = Mechanism({"O": 0j}, {"arm": Link({"O": 0j, "P": (3, 4)}, mass=2)}, inputs=Input("arm"))
        >>> arm.value("links.arm.mass"), arm.value("links.arm.P")
        (2.0, (3+4j))
        """
        from virtualwork.describe.dimensions import value

        return value(self, path)

    def changed(self, numbers: Mapping[str, complex | tuple[float, float]]) -> Self:
        """Return this mechanism with other numbers at some paths.

        Parameters
        ----------
        numbers : mapping of path to number
            SI; a point's own path takes x + iy or (x, y).

        Raises
        ------
        DescriptionError
            Where a path names no number, or the mechanism cannot be so.

        Examples
        --------
        >>> from virtualwork import Input, Link, Mechanism
        >>> arm = Mechanism({"O": 0j}, {"arm": Link({"O": 0j, "P": (3, 4)}, mass=2)}, inputs=Input("arm"))
        >>> arm.changed({"links.arm.mass": 5.0, "links.arm.P.x": 1.0}).value("links.arm.P")
        (1+4j)
        """
        from virtualwork.describe.dimensions import changed

        return changed(self, numbers)
