"""The forces of a motion, as they are handed out: with bounds of their rounding errors."""

from __future__ import annotations

from functools import cached_property

from virtualwork.bounds.forces import ForceErrors
from virtualwork.formulas.dynamics import Dynamics


class Forces(Dynamics):
    """The forces of a motion, with bounds of their rounding errors."""

    @cached_property
    def _errors(self) -> ForceErrors:
        return ForceErrors(self)

    def error_estimate(self) -> ForceErrors:
        """Return bounds of the rounding errors of all forces, under the names of what they bound.

        Dimensions, loads and inputs are taken as exact. With joint friction there are none: infinite.

        Examples
        --------
        A weight of 2·9.81 N on an arm of 0.5 m at 60°:

        >>> import numpy as np
        >>> from virtualwork import Input, Link, Mechanism
        >>> arm = Mechanism({"O": 0j}, {"arm": Link({"O": 0j}, mass=2, center=0.5)}, inputs=Input(link="arm"),
        ...                 gravity=-9.81j)
        >>> found = arm.motion(np.pi / 3).dynamics
        >>> bool(abs(found.effort[0, 0] - 4.905) <= found.error_estimate().effort[0, 0] < 1e-14)
        True
        """
        return self._errors

    def __repr__(self) -> str:
        return f"Forces({self.poses.n} poses, {len(self.scene.loads)} loads)"
