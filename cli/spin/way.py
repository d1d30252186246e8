"""The worked solution of `dalembert spin`: H and T at the start, what stays constant, cones or precession."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dalembert.results.way import Topic, figures
from rigidbody3d.attitude import rotate

if TYPE_CHECKING:
    from cli.spin.rotation import Rotation


def way(r: Rotation) -> list[Topic]:
    """The topics."""
    g = r.body
    tensor = np.asarray(g.inertia, dtype=float)
    tensor = np.diag(tensor) if tensor.ndim == 1 else tensor
    w = np.asarray(g.omega, dtype=float)
    h = tensor @ w
    space = rotate(g.attitude, h)
    energy = float(w @ h) / 2
    start = [
        f"H = I·ω = ({', '.join(figures(float(v)) for v in h)}) kg·m²/s in body axes, |H| = {figures(float(np.linalg.norm(h)))}",
        f"H = ({', '.join(figures(float(v)) for v in space)}) kg·m²/s in space axes",
        f"T = ω·H/2 = {figures(energy)} J",
    ]
    head = {
        "momentum_body_kg_m2_s": [float(v) + 0.0 for v in h],
        "momentum_kg_m2_s": [float(v) + 0.0 for v in space],
        "kinetic_energy_J": energy,
    }
    result = [Topic("start", start, "At time zero", head)]
    if g.torque is not None:
        law = ["Ḣ = M: momentum and energy change with the torque; I·ω̇ = M − ω × I·ω (Euler)."]
    elif g.mgl is not None:
        law = [
            "Weight about the fixed point: H about the vertical, H about the axis of a symmetric top, and T + mgl·cos θ stay."
        ]
    else:
        law = ["No torque: H in space and T stay; I·ω̇ = −ω × I·ω (Euler), so that ω moves on the polhode."]
    law += [f"  drift of {of}: {figures(value)}" for of, value in r.drift.items() if value is not None]
    result.append(Topic("constants", law, "What stays constant", {"drift": dict(r.drift)}))
    cones = r.cones()
    if cones is not None:
        text = [
            "A body of revolution: ω and its axis turn about H with H/I_t (precession), the body about its axis with the spin.",
            *(f"  {key.rpartition('_')[0] if key.endswith('_deg') else key[:-6]}: {figures(value)} {'°' if key.endswith('_deg') else 'rad/s'}" for key, value in cones.items() if value is not None),
        ]  # fmt: skip
        result.append(Topic("cones", text, "Cones", dict(cones)))
    steady = r.steady()
    if steady is not None:
        text = ["Steady precession at the present tilt: (I_t·cos θ)·ψ̇² − I_a·ω_z·ψ̇ + mgl = 0 has two roots."]
        text += [
            f"  {key[:-6]}: {figures(value)} rad/s" for key, value in steady.items() if value is not None
        ]
        result.append(Topic("steady precession", text, "Steady precession", dict(steady)))
    return result
