"""Index balancing: the rotor's own unbalance apart from that of the mandrel which carries it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.angles import phasor
from dalembert.arithmetic.exact import EPS
from dalembert.arithmetic.records import record
from dalembert.arithmetic.shapes import as_array, as_vectors, floats

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


@record
class Indexed(NamedTuple):
    """The unbalance of the rotor and that of its mounting, in the unit of the readings."""

    rotor: Complex
    mounting: Complex
    residuals: Complex
    """Each reading less its fitted value, (..., k); 0 within rounding, as the parts are."""
    residual_sd: Real
    """√(Σ|residual|²/(k − 2)); NaN for two readings."""
    uncertainty: Real
    """One standard deviation of either unbalance along any direction; NaN for two readings."""
    amplification: Real
    """The growth of the errors of the readings relative to evenly spread positions: 1 for 0° and 180°."""


def index_balancing(readings: ArrayLike, turned: ArrayLike = (0.0, np.pi)) -> Indexed:
    """Separate a rotor's unbalance from its mandrel's by readings in several positions on the mandrel.

    Parameters
    ----------
    readings
        The unbalances, or vibrations, as read in the mandrel's axes, complex (..., k).
    turned
        The angle by which the rotor was turned on the mandrel for each, (k,), rad; default 0 and 180°.

    Returns
    -------
    Indexed
        The rotor's part as it stands at turned = 0, the mounting's part, and the scatter of the readings.

    Raises
    ------
    ValueError
        Fewer than two readings, all at one position, or numbers that are not finite.

    Notes
    -----
    Reading k is v_k = mounting + rotor·e_k with e_k = e^{iφ_k} (ISO 21940-14:2012, index balancing). Least squares over
    all positions: with the means ē and v̄ and D = Σ|e_k − ē|²,

        rotor = Σ (e_k − ē)* v_k / D,        mounting = v̄ − ē rotor.

    For 0 and 180° that is half the difference and half the sum. Both have the variance σ²/D, where σ² is that of a
    complex reading; each component has half of it.

    Examples
    --------
    >>> both = index_balancing([5 + 1j, 1 - 1j])
    >>> complex(both.rotor), complex(both.mounting)
    ((2+1j), (3+0j))
    """
    read, phi = as_vectors(readings), as_array(turned)
    if phi.ndim != 1 or read.shape[-1:] != phi.shape:
        raise ValueError("expected as many readings as angles")
    if len(phi) < 2:
        raise ValueError("one position: expected two at least, half a turn apart")
    if not (np.isfinite(read).all() and np.isfinite(phi).all()):
        raise ValueError("readings and angles must be finite")
    # in degrees half a turn is exact
    turn = phasor(np.ones(len(phi)), np.degrees(phi), "deg")
    mean = turn.sum(axis=-1) / len(phi)
    apart = turn - mean
    if np.abs(floats(apart)).max() < 1e-6:
        raise ValueError("the rotor was not turned: expected different angles")
    size = np.square(np.abs(apart)).sum(axis=-1)
    rotor = (read @ apart.conj()) / size
    mounting = read.sum(axis=-1) / len(phi) - mean * rotor
    residuals = read - (mounting[..., None] + rotor[..., None] * turn)
    # what the readings and the factor by which their errors grow leave of rounding
    sizes = np.abs(floats(read)).sum(axis=-1) + len(phi) * np.abs(floats(rotor))
    noise = 24 * EPS * len(phi) / floats(size) * sizes
    rotor, mounting = (
        np.where(np.abs(floats(part)) > noise / len(phi), part, 0.0) for part in (rotor, mounting)
    )
    residuals = np.where(np.abs(floats(residuals)) > noise[..., None], residuals, 0.0)
    spare = len(phi) - 2
    square = np.square(np.abs(residuals)).sum(axis=-1)
    variance = square / spare if spare else square * np.nan
    return Indexed(
        rotor,
        mounting,
        residuals,
        np.sqrt(variance),
        np.sqrt(variance / size / 2),
        as_array(np.sqrt(len(phi) / size)),
    )
