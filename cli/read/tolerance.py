"""The options of a balance tolerance: --grade with --speed and --rotor-mass, or --permissible; --bearings."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

from cli.read import options


class Verdict(NamedTuple):
    """A plane's permissible, initial and remaining unbalance, kg·m; NaN where the readings do not determine it."""

    plane: str
    permissible: float
    initial: float
    residual: float

    def of(self, unbalance: float) -> str:
        """Say of an unbalance in this plane whether it is within what is permissible."""
        if unbalance != unbalance:
            return "not determined"
        return "within" if unbalance <= self.permissible else "beyond"


@dataclass(frozen=True, eq=False, repr=False)
class Tolerance:
    """A permissible residual unbalance."""

    grade: str | None
    permissible: float
    """U_per, kg·m."""
    bearings: tuple[float, float] | None = None
    """Where along the shaft it holds, m; None: in the correction planes."""

    def document(
        self, verdicts: Iterable[Verdict]
    ) -> dict[str, str | float | list[dict[str, str | float | None]] | None]:
        """Return what the JSON says of it and of a rotor's planes."""
        return {
            "grade": self.grade,
            "permissible_kg_m": self.permissible,
            "planes": [
                {
                    "plane": plane,
                    "permissible_kg_m": share,
                    "initial_kg_m": before if before == before else None,
                    "within": before <= share if before == before else None,
                    "residual_kg_m": after if after == after else None,
                    "residual_within": after <= share if after == after else None,
                }
                for plane, share, before, after in verdicts
            ],
        }


def tolerance_of(
    grade: str | None,
    speed: str | None,
    rotor_mass: str | None,
    permissible: str | None,
    bearings: str | None,
) -> Tolerance | None:
    """Read the tolerance; None where none is asked for."""
    from balancing import grade_value, permissible_unbalance

    planes = None if bearings is None else options.two_bearings("--bearings", bearings)
    omega = options.quantity("--speed", speed, "speed", positive=True)
    mass = options.quantity("--rotor-mass", rotor_mass, "mass", positive=True)
    if permissible is not None:
        if grade is not None:
            raise options.bad("--permissible", "expected --grade or --permissible, not both")
        whole = options.needed("--permissible", permissible, "unbalance", positive=True)
        return Tolerance(None, whole, planes)
    if grade is None:
        if planes is not None:
            raise options.bad(
                "--bearings", "the bearings are for a tolerance: expected --grade or --permissible too"
            )
        return None
    try:
        value = grade_value(grade)
    except ValueError as error:
        raise options.bad("--grade", error) from None
    if omega is None:
        raise options.bad("--speed", "--grade needs --speed and --rotor-mass")
    if mass is None:
        raise options.bad("--rotor-mass", "--grade needs --speed and --rotor-mass")
    return Tolerance(f"G{value * 1000:g}", float(permissible_unbalance(value, omega, mass)), planes)
