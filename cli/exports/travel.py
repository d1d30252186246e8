"""The travel of the input, and what is met along it: curves of points, ways of slides, the greatest effort."""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from virtualwork.drawing import tracers

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from virtualwork import Mechanism
    from virtualwork.motion import Motion

    Array = NDArray[np.float64]

# poses over the travel of the input
SAMPLES = 721


class Travel:
    """One input from one end of its travel to the other, or over a whole period; nothing with several inputs."""

    def __init__(self, m: Mechanism) -> None:
        self.m = m

    @cached_property
    def limits(self) -> tuple[float, float] | None:
        """The ends of the input's travel, rad or m; None where it is not limited on both sides."""
        found = self.m.check.input_limits
        return None if found is None or not all(map(math.isfinite, found)) else found

    @cached_property
    def motion(self) -> Motion | None:
        """The motion over the travel at the file's speed."""
        m = self.m
        if len(m.inputs) != 1:
            return None
        track = m.assembly.track
        low, high = self.limits or (track.start, track.start + (m.assembly.reach.period or track.length))
        found = self.m.check.input_limits
        if self.limits is None and found is not None:
            low, high = (
                (found[0], found[0] + track.length)
                if math.isfinite(found[0])
                else (found[1] - track.length, found[1])
            )
        e = m.inputs[0]
        return m.motion(np.linspace(low, high, SAMPLES), e.speed or 0.0, e.acceleration or 0.0)

    def curve(self, point: str) -> Array:
        """The places (n, 2) of a point over the travel, m; NaN where it is not assembled."""
        assert self.motion is not None
        return self.motion.point(point).position

    @cached_property
    def traced(self) -> list[str]:
        """The points whose curves are drawn: those that no joint holds; where there are none, all that move."""
        return tracers(self.m) or self.moving

    @property
    def moving(self) -> list[str]:
        """The points that are not the ground's."""
        return [p for p in self.m.points if p not in self.m.ground]

    def way(self, guide: int) -> tuple[float, float] | None:
        """The least and the largest position along a guide, m."""
        if self.motion is None:
            return None
        from virtualwork.parts_of_motion import SlideMotion

        found = SlideMotion(self.motion, guide).position
        return (float(np.nanmin(found)), float(np.nanmax(found))) if np.isfinite(found).any() else None

    @cached_property
    def peak(self) -> float | None:
        """The greatest effort of the input over a whole period, N·m or N; None where it is limited or nothing acts."""
        if self.motion is None or self.m.check.input_limits is not None:
            return None
        effort = np.abs(self.motion.effort)
        peak = float(effort.max())
        return peak if math.isfinite(peak) and peak > 0 else None
