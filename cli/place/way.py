"""The worked solution of `dalembert place`: the corrections combined, and the masses on their places as vectors."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from dalembert.angles import degrees, phasor
from dalembert.results.columns import Table, names, number
from dalembert.results.way import Topic, figures, vector_text
from dalembert.units import from_si, to_si

if TYPE_CHECKING:
    from cli.place.placing import Placing


def way(p: Placing, name: str = "") -> list[Topic]:
    """The topics of one correction; `name` of its rotor and plane, where there are several."""
    head = {"of": name} if name else {}
    lead = f"{name}: " if name else ""
    given = np.array(
        [
            complex(phasor(np.array(to_si(v.mass, "mass", v.mass_unit)), np.array(v.angle), v.angle_unit))
            for v in p.of.vectors
        ]
    )
    unit = p.of.unit
    goal = sum((share.goal for share in p.shares), 0j) if len(p.shares) == 1 else p.target
    text: list[str | Table] = ["Each correction in components, x = m·cos θ, y = m·sin θ, and their sum:"]
    text.append(
        Table(
            [
                number("mass", "mass", np.abs(given), unit),
                number("angle", "angle", degrees(given)),
                number("x", "mass", given.real, unit),
                number("y", "mass", given.imag, unit),
            ],
            (),
            "vectors[]",
        )
    )
    size = float(from_si(abs(p.target), "mass", unit))
    angle = float(degrees(np.array([p.target]))[0])
    text.append(f"  together {figures(size)} {unit} at {figures(angle)}°")
    if goal != p.target:
        other = float(degrees(np.array([goal]))[0])
        text.append(
            f"  to be made on the places: {figures(float(from_si(abs(goal), 'mass', unit)))} {unit} at {figures(other)}°"
        )
    topics = [Topic("target", text, f"{lead}Target", {**head, **_vector(p.target)})]
    for share in p.shares:
        its = [m for m in p.masses if m.share is share]
        placed = np.array(
            [phasor(np.array(m.mass), np.array(m.angle), "deg") for m in its], dtype=complex
        ).reshape(-1)
        rows = Table(
            [
                names("position", [str(m.place + 1) for m in its]),
                number("mass", "mass", np.abs(placed), unit),
                number("angle", "angle", degrees(placed)),
                number("x", "mass", placed.real, unit),
                number("y", "mass", placed.imag, unit),
            ],
            ("position",),
            "masses[]",
        )
        total, missed = complex(placed.sum()), complex(share.error)
        at = "" if share.z is None else f" in the plane at z = {figures(share.z)} m"

        def shown(z: complex) -> str:
            scaled = z * float(from_si(1.0, "mass", unit))
            return f"{vector_text(scaled.real, scaled.imag)} {unit}"

        words: list[str | Table] = [
            f"Σ m·e^(iθ) of the masses{at} against what is wanted:",
            rows,
            f"  Σ = {shown(total)}, wanted {shown(share.goal)}, missed by {figures(float(from_si(abs(missed), 'mass', unit)))} {unit}",
        ]
        where = {} if share.z is None else {"z_m": share.z}
        sums = {"sum_kg": [total.real, total.imag], "wanted_kg": [share.goal.real, share.goal.imag]}
        topics.append(Topic("places", words, f"{lead}Masses on their places", {**head, **where, **sums}))
    return topics


def _vector(z: complex) -> dict[str, Any]:
    return {"x_kg": z.real + 0.0, "y_kg": z.imag + 0.0}
