"""Balance tolerances: the quality grades of ISO 21940-11 and the permissible residual unbalance."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

GRADES = (4000.0, 1600.0, 630.0, 250.0, 100.0, 40.0, 16.0, 6.3, 2.5, 1.0, 0.4)
"""The balance quality grades G of ISO 21940-11:2016, table 1: e_per·Ω in mm/s."""


def grade_value(name: str) -> float:
    """Return e_per·Ω in m/s of a grade such as `G2.5` (or `G 2,5`); any positive value is taken.

    Raises ValueError for what is no grade.

    >>> grade_value("G6.3")
    0.0063
    """
    text = name.strip()
    try:
        value = float(text[1:].strip().replace(",", ".")) if text[:1] in ("G", "g") else -1.0
    except ValueError:
        value = -1.0
    if not (0 < value < float("inf")):
        grades = ", ".join(f"G{grade:g}" for grade in GRADES)
        raise ValueError(
            f"'{name}' is no balance quality grade: expected one of {grades}, or G with a value in mm/s"
        )
    return value / 1000


def permissible_unbalance(grade: ArrayLike, speed: ArrayLike, mass: ArrayLike) -> NDArray[np.float64]:
    """Return the permissible residual unbalance U_per = (e_per·Ω)·m/Ω, kg·m.

    Parameters are e_per·Ω in m/s (`grade_value`), the highest service speed Ω in rad/s and the rotor's mass
    in kg; they broadcast. ISO 21940-11:2016, permissible residual unbalance from the quality grade.

    >>> round(float(permissible_unbalance(0.0025, 3000 * np.pi / 30, 10.0)) * 1e6, 2)  # g·mm
    79.58
    """
    grade, speed, mass = (np.asarray(value, dtype=float) for value in (grade, speed, mass))
    if not ((grade > 0).all() and (speed > 0).all() and (mass > 0).all()):
        raise ValueError("grade, speed and mass must be positive")
    return np.asarray(grade * mass / speed)


def allocate(permissible: ArrayLike, center: float, plane_a: float, plane_b: float) -> NDArray[np.float64]:
    """Return the shares (..., 2) of a permissible residual unbalance in two tolerance planes.

    Each plane's share goes with the distance of the centre of mass from the other plane, within limits: 0.3 to
    0.7 of the whole where the centre lies between the planes, 0.3 to 1.3 where it lies outside them
    (ISO 21940-11:2016, allocation to the tolerance planes, with its limitations for inboard and outboard rotors).

    >>> (allocate(28648.0, center=1.5, plane_a=0.0, plane_b=2.4)).round(0)
    array([10743., 17905.])
    """
    if plane_a == plane_b:
        raise ValueError("the two tolerance planes lie at the same place")
    share_a = (plane_b - center) / (plane_b - plane_a)
    share_b = (center - plane_a) / (plane_b - plane_a)
    largest = 0.7 if share_a >= 0 and share_b >= 0 else 1.3
    shares = np.clip(np.abs([share_a, share_b]), 0.3, largest)
    return np.asarray(np.asarray(permissible, dtype=float)[..., None] * shares)
