"""What is said of a rotation in time."""

from __future__ import annotations

import numpy as np

from cli.spin.solve import Rotation

METHOD = (
    "Free rotation and tops in closed form by Jacobi's elliptic functions (Landau and Lifshitz, Mechanics, §37; Goldstein, "
    "Classical Mechanics, ch. 5), else angular momentum and a unit quaternion integrated."
)


def warnings(found: Rotation) -> list[str]:
    """Say what was done otherwise than a reader might think."""
    said = []
    if found.given.mgl is not None and found.round_moments is None:
        said.append("a top whose moments across body z differ has no closed form: it was integrated")
    steady = found.steady()
    if steady is not None and steady["slow_rad_s"] is None:
        said.append("the spin is too slow for steady precession at this tilt")
    return said


def coarse(found: Rotation) -> list[str]:
    """Say where a page that moves would show a body that jumps, and which steps show it turn."""
    if len(found.time) < 2:
        return []
    step = float(np.abs(np.diff(found.time)).max())
    fastest = float(np.linalg.norm(found.states.omega, axis=-1).max())
    if step * fastest <= np.pi / 4:
        return []
    smaller = float(f"{np.pi / 12 / fastest:.1g}")
    return [
        f"--html: the body turns up to {np.degrees(step * fastest):.0f} deg from one pose to the next: "
        f"steps of {smaller:g} s show it turn"
    ]


LONG = 24  # times: below a longer table stands what would have been carried out of sight above it


def notes(found: Rotation) -> str:
    """Say above the table what its columns are, and what is constant in the motion."""
    told = "omega in body axes, momentum in space axes, attitude [w, x, y, z] from body to space; " + (
        "closed form" if found.exact else f"integrated by {found.integrator}"
    )
    return told if len(found.time) > LONG else "\n".join([told, *_constants(found)])


def afterword(found: Rotation) -> str:
    """Say it below a long table."""
    return "\n".join(_constants(found)) if len(found.time) > LONG else ""


def _constants(found: Rotation) -> list[str]:
    lines = []
    drift = found.drift
    if drift["momentum"] is not None:
        lines.append(f"drift: momentum {drift['momentum']:.2g}, energy {drift['energy']:.2g} (relative)")
    if found.period is not None:
        lines.append(f"period of omega in body axes: {found.period:.6g} s")
    nutation = found.nutation_period
    if nutation is not None:
        lines.append(f"period of nutation: {nutation:.6g} s")
    for rates in (found.cones(), found.steady()):
        if rates is not None:
            lines.append(
                ", ".join(f"{name}: {'none' if x is None else f'{x:.6g}'}" for name, x in rates.items())
            )
    return lines
