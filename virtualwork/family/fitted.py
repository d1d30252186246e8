"""The result of a fit: the dimensions, what they reach, and what is drawn of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Generic, TypeVar

import numpy as np

from virtualwork.describe.description import Description
from virtualwork.describe.dimensions import Dimension, by_path, number_of
from virtualwork.family.design import Design, numbers_of
from virtualwork.family.keep import Kept
from virtualwork.family.target import Reached
from virtualwork.formulas.numbers import Complexes, Reals

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import FigureBase

D = TypeVar("D", bound=Description)

# poses of a look over the whole range
FINE = 721


@dataclass(frozen=True, eq=False)
class Fit(Generic[D]):
    """The dimensions with the least distance from a target.

    Attributes
    ----------
    mechanism : Description
        With the fitted numbers.
    before : Description
        Without them.
    dimensions : tuple of Dimension
    values : array (d,)
        SI.
    reached : tuple of Reached
        What each point, link and slide of the target does.
    starts, evaluations : int
        Tried, and mechanisms computed over a target in all.
    remarks : tuple of str
        What the designer should know: bounds reached, defects of assembly and of order.
    others : tuple of Fit
        Further solutions, where more than one was requested: the next best first.
    kept : tuple of Kept
        Of each bound the extreme over the sweep.
    """

    mechanism: D
    before: D
    dimensions: tuple[Dimension, ...]
    values: Reals
    reached: tuple[Reached, ...]
    starts: int
    evaluations: int
    remarks: tuple[str, ...]
    others: tuple[Fit[D], ...] = ()
    kept: tuple[Kept, ...] = ()

    @property
    def parameters(self) -> dict[str, float]:
        """The fitted numbers by path, SI."""
        return by_path(self.dimensions, self.values.tolist())

    @property
    def inputs(self) -> Reals:
        """The input at each row of the (first) target, (n,), rad or m."""
        return self.reached[0].inputs

    @property
    def positions(self) -> Complexes:
        """The values of the (first) quantity, (n,): x + iy of a point, m."""
        return self.reached[0].values

    @property
    def target(self) -> Complexes:
        """Its target, (n,)."""
        return self.reached[0].target

    @property
    def distances(self) -> Reals:
        """Its distance at each row, (n,), m; rad for the angle of a link."""
        return self.reached[0].distances

    @property
    def rms(self) -> float:
        """Root of the mean square of all distances, m; of angles (rad) or else of efforts, where there is nothing else."""
        return float(np.sqrt(np.mean(self._all**2)))

    @property
    def max(self) -> float:
        """The largest distance, m; of angles (rad) or else of efforts, where there is nothing else."""
        return float(self._all.max())

    @property
    def _all(self) -> Reals:
        return np.concatenate([each.distances for each in self.reached if each.dimension == self._dimension])

    @property
    def _dimension(self) -> str:
        """Lengths count before angles, angles before efforts."""
        return next(
            of for of in ("length", "angle", "") if any(each.dimension == of for each in self.reached)
        )

    def plot(self, figure: FigureBase | None = None) -> list[Axes]:
        """Draw the targets and the motion of the mechanism over their range: a panel for each point, link and slide.

        Parameters
        ----------
        figure : matplotlib figure
            A new one of pyplot's where not given.
        """
        from virtualwork.picture.fitted import Fitted, fitted

        own = np.array([float(number_of(self.before, d)) for d in self.dimensions])
        turning = not self.before.inputs[0].is_slide
        panels = []
        for each in self.reached:
            design = Design(self.before, self.dimensions, numbers_of(self.before, each.name))
            q = np.linspace(each.inputs.min(), each.inputs.max(), FINE)
            lines = [design(numbers, q) for numbers in (self.values, own)]
            after, before = (t[0] + 1j * t[1] if each.kind == "point" else t[0] for t in lines)
            panels.append(Fitted(each.label, each.kind, turning, q, after, before, each.inputs, each.target))
        return fitted(panels, figure)

    def __repr__(self) -> str:
        result = ", ".join(f"{path}={number:.6g}" for path, number in self.parameters.items())
        effort = "N" if self.before.inputs[0].is_slide else "N·m"
        unit = {"length": "m", "angle": "rad"}.get(self._dimension, effort)
        return f"Fit({result}; rms {self.rms:.3g} {unit})"
