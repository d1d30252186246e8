"""The functions of numpy's numbers, by which a tape is worked out on arrays operation by operation."""

from __future__ import annotations

from typing import Any

import numpy as np

# of a double's bits, those of its exponent
EXPONENT = 0x7FF << 52


class Numpy:
    """The functions of numpy's numbers, for `Tape.on`."""

    const = staticmethod(np.float64)
    sqrt = staticmethod(np.sqrt)
    sin = staticmethod(np.sin)
    cos = staticmethod(np.cos)
    atan2 = staticmethod(np.arctan2)

    @staticmethod
    def binade(x: Any) -> Any:
        """The bits of the exponent alone."""
        return np.bitwise_and(np.asarray(x, dtype=float).view(np.int64), EXPONENT).view(float)

    @staticmethod
    def select(test: Any, positive: Any, otherwise: Any) -> Any:
        return np.where(np.greater(test, 0), positive, otherwise)


NUMPY = Numpy()
