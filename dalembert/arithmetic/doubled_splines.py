"""Cubic splines through doubled numbers, as scipy's `CubicSpline` is one through floats."""

from __future__ import annotations

from decimal import Context, localcontext
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.doubled_arrays import DoubledArray
from dalembert.arithmetic.splines import DIGITS, periodic, rates, sums


class Spline:
    """The cubic spline through values at rising or falling places, (n,) each; of three a parabola, of two a line.

    Examples
    --------
    >>> x = DoubledArray(np.arange(5.0))
    >>> cubic = Spline(x, x * x * x)
    >>> cubic.at([2.5]).value, cubic.up_to(4.0).value
    (array([15.625]), array(64.))
    """

    def __init__(self, place: DoubledArray, values: DoubledArray, is_periodic: bool = False) -> None:
        x, y = (sums(of.high.tolist(), of.low.tolist()) for of in (place, values))
        with localcontext(Context(prec=DIGITS)):
            # its second derivatives
            if is_periodic:
                bends = periodic(x, y)
                bends.append(bends[0])
            elif len(x) > 3:
                _, bends = rates(x, y)
            else:
                first, last = ((y[k + 1] - y[k]) / (x[k + 1] - x[k]) for k in (0, len(x) - 2))
                bends = [2 * (last - first) / (x[-1] - x[0])] * len(x)
            near = [*map(float, bends)]
            rest = [
                float(bend - exact) for bend, exact in zip(bends, sums(near, [0.0] * len(near)), strict=True)
            ]
        bend, h = DoubledArray(near, rest), np.diff(place)
        slope = np.diff(values) / h - h * (bend[:-1] * 2.0 + bend[1:]) / 6.0
        self.place = place
        # of each step, over the powers of the way from its beginning
        self.powers = values[:-1], slope, bend[:-1] / 2.0, np.diff(bend) / h / 6.0
        self.wholes: Any = np.cumsum(self._integral(slice(None), h))

    def _step(self, at: DoubledArray) -> tuple[NDArray[np.intp], DoubledArray]:
        """The steps in which places lie, and the way from the beginning of each."""
        places = self.place.high
        way = -1.0 if places[-1] < places[0] else 1.0
        i = np.clip(np.searchsorted(way * places, way * at.high, "right") - 1, 0, len(places) - 2)
        return i, at - self.place[i]

    def at(self, place: Any) -> Any:
        """The values at places (...)."""
        i, t = self._step(place if isinstance(place, DoubledArray) else DoubledArray(place))
        y, slope, half, sixth = (of[i] for of in self.powers)
        return y + t * (slope + t * (half + t * sixth))

    def _integral(self, i: Any, t: Any) -> Any:
        """The integral over a way within steps."""
        y, slope, half, sixth = (of[i] for of in self.powers)
        return t * (y + t * (slope / 2.0 + t * (half / 3.0 + t * sixth / 4.0)))

    def up_to(self, at: float) -> Any:
        """The integral from the first place to another one, of which the last float is the last place."""
        if at == self.place.high[-1]:
            return self.wholes[-1]
        i, t = self._step(DoubledArray(at))
        before = self.wholes[i - 1] if i else DoubledArray(0.0)
        return before + self._integral(i, t)
