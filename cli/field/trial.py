"""A trial mass for the first run."""

from __future__ import annotations

from balancing import trial_unbalance
from cli.read import options
from cli.read.units import from_si
from cli.show.columns import Column, Result, Table

RULE = "centrifugal force a tenth of the static load of each plane: m r ω² = 0.1 (M/planes) g"


def suggestion(rotor_mass: str | None, speed: str | None, radius: float | None, planes: int) -> Result:
    """Suggest a trial mass."""
    mass = options.quantity("--rotor-mass", rotor_mass, "mass", positive=True)
    omega = options.quantity("--speed", speed, "speed", positive=True)
    if mass is None or omega is None or radius is None:
        flag = "--rotor-mass" if mass is None else "--speed" if omega is None else "--radius"
        raise options.bad(flag, "--suggest-trial needs --rotor-mass, --speed and --radius")
    unbalance = float(trial_unbalance(mass, omega, planes))
    grams, gram_mm = from_si(unbalance / radius, "mass", "g"), from_si(unbalance, "unbalance", "g_mm")
    columns = [
        Column("mass", "g", [grams], lambda: [1e-14 * grams]),
        Column("radius", "mm", [from_si(radius, "length", "mm")]),
        Column("unbalance", "g_mm", [gram_mm], lambda: [1e-14 * gram_mm]),
    ]
    return Result(
        document=lambda: {
            "trial": {
                "unbalance_kg_m": unbalance,
                "mass_kg": unbalance / radius,
                "radius_m": radius,
                "planes": planes,
                "rule": RULE,
            }
        },
        tables={"trial": lambda: Table(columns)},
        notes=lambda: "trial mass for each plane\nrule: " + RULE,
    )
