"""The functions of numpy's numbers, by which a tape is worked out on arrays operation by operation."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from dalembert.arithmetic import sines
from dalembert.arithmetic.exact import upper

# of a double's bits, those of its exponent
EXPONENT = 0x7FF << 52


class Numpy:
    """The functions of numpy's numbers, for `Tape.on`."""

    const = staticmethod(np.float64)
    sqrt = staticmethod(np.sqrt)
    sin = staticmethod(np.sin)
    cos = staticmethod(np.cos)
    atan2 = staticmethod(np.arctan2)

    upper = staticmethod(upper)
    place = staticmethod(sines.place)
    # a partial in a class is bound as a method from Python 3.14 on
    entry0, entry1, entry2, entry3 = (staticmethod(partial(sines.entry, row)) for row in range(4))

    @staticmethod
    def binade(x: Any) -> Any:
        """The bits of the exponent alone."""
        return np.bitwise_and(np.asarray(x, dtype=float).view(np.int64), EXPONENT).view(float)

    @staticmethod
    def select(test: Any, positive: Any, otherwise: Any) -> Any:
        return np.where(np.greater(test, 0), positive, otherwise)


NUMPY = Numpy()
