"""The shapes that a mechanism is drawn of: lines, circles and springs, in the axes of bodies."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Line:
    """A line through points (m) in the axes of its body; a closed one is an outline that may be filled."""

    role: str
    body: str
    points: tuple[complex, ...]
    closed: bool = False

    @property
    def reach(self) -> tuple[complex, ...]:
        """Places that hold it between them."""
        return self.points


@dataclass(frozen=True)
class Row:
    """One line again and again at equal steps: hatching, or the teeth of a rack, which hang together.

    >>> Row("rack", "rack", (0j, 1 + 1j), 2 + 0j, 2, joined=True).lines()
    [Line(role='rack', body='rack', points=(0j, (1+1j), (2+0j), (3+1j)), closed=False)]
    """

    role: str
    body: str
    points: tuple[complex, ...]
    """The first one, m, in the axes of its body."""
    step: complex
    count: int
    joined: bool = False

    def lines(self) -> list[Line]:
        """Return its lines: one of all where they are joined."""
        each = [tuple(z + k * self.step for z in self.points) for k in range(self.count)]
        return [Line(self.role, self.body, points) for points in ([sum(each, ())] if self.joined else each)]


@dataclass(frozen=True)
class Circle:
    """A circle, m, in the axes of its body."""

    role: str
    body: str
    centre: complex
    radius: float

    @property
    def reach(self) -> tuple[complex, ...]:
        """Corners that hold it between them."""
        return self.centre - self.radius * (1 + 1j), self.centre + self.radius * (1 + 1j)


@dataclass(frozen=True)
class Coil:
    """A spring between points of two bodies, each (body, point in its axes); `along` draws it."""

    ends: tuple[tuple[str, complex], tuple[str, complex]]
    width: float
    """From its middle line to the turns, m."""
    role: str = "spring"

    @property
    def body(self) -> str:
        """The body of its first end."""
        return self.ends[0][0]

    def along(self, start: complex, end: complex) -> tuple[complex, ...]:
        """Return the line of the spring between where its ends stand."""
        way = end - start
        across = 1j * self.width * (way / abs(way) if way else 1)
        turns = [(0.2 + 0.06 * i, (-1) ** i) for i in range(11)]
        return (
            start,
            start + 0.17 * way,
            *(start + share * way + side * across for share, side in turns),
            start + 0.83 * way,
            end,
        )


Shape = Line | Circle | Coil
