"""The angle of an unbalance or a mass, as it is given out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def angle_of(z: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Return the angles of complex numbers, (...), rad in [0, 2π); 0 for 0.

    >>> angle_of(np.array([1j, -1e-20j + 1, -0.0])).round(3)
    array([1.571, 0.   , 0.   ])
    """
    # + 0.0: the angle of -0 is 0
    angle = np.angle(z + 0.0) % (2 * np.pi)
    return np.where(angle >= 2 * np.pi, 0.0, angle)
