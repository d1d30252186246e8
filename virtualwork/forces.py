"""The forces of a motion, as they are handed out: with estimates of their rounding errors."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.guard import guarded
from virtualwork.formulas.dynamics import Dynamics

if TYPE_CHECKING:
    from matplotlib.figure import FigureBase

    from virtualwork.digits.forces import ForceErrors


@guarded
class Forces(Dynamics):
    """The forces of a motion, with estimates of their rounding errors."""

    @cached_property
    def _errors(self) -> ForceErrors:
        # not loaded for forces alone
        from virtualwork.digits.forces import ForceErrors

        return ForceErrors(self)

    def error_estimate(self) -> ForceErrors:
        """Return estimates of the rounding errors of all forces, under the names of these.

        Each is the difference to a second run in 32 digits.

        Examples
        --------
        A weight of 2·9.81 N on an arm of 0.5 m at 60°:

        >>> import numpy as np
        >>> from virtualwork import Input, Link, Mechanism
        >>> arm = Mechanism({"O": 0j}, {"arm": Link({"O": 0j}, mass=2, center=0.5)}, inputs=Input(link="arm"),
        ...                 gravity=-9.81j)
        >>> found = arm.motion(np.pi / 3).dynamics
        >>> bool(0 < found.error_estimate().effort[0, 0] < 1e-14)
        True
        """
        return self._errors

    def plot(self, figure: FigureBase | None = None) -> NDArray[np.object_]:
        """Draw effort and joint forces against the input, and the shaking force; return matplotlib's axes.

        They are those of effort, joint forces and, where something moves, shaking force and moment. Without a figure
        it is a new one of pyplot's; without matplotlib (the extra `plot`) an ImportError.
        """
        from virtualwork.picture.over_input import forces

        return forces(self, figure=figure)

    def __repr__(self) -> str:
        return f"Forces({self.poses.n} poses, {len(self.case.loads)} loads)"
