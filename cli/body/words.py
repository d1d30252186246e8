"""What is said of a body and its motion."""

from __future__ import annotations

import numpy as np

from cli.body.solve import MovingBody

METHOD = (
    "Tensors of the parts moved by Steiner's theorem, turned and added; principal moments by the eigenvalues; angular momentum "
    "H = I·ω and its true rate in any axes; d'Alembert's inertia wrench (J. A. Riul, Dinâmica das Máquinas, unit II, eqs. "
    "22–47; F. P. Beer, E. R. Johnston, Vector Mechanics for Engineers: Dynamics, ch. 18)."
)


def warnings(found: MovingBody) -> list[str]:
    """Say where eq. 44 with a constant tensor would go wrong, and what is not balanced in one plane."""
    said = []
    motion = found.motion
    if motion.frame_omega is not None:
        size = np.abs(motion.momentum).max() * max(
            np.abs(motion.omega).max(), np.abs(motion.frame_omega).max()
        )
        if np.abs(motion.tensor_rate).max() > 1e-12 * size:
            wrong = motion.rate - motion.tensor_rate
            said.append(
                "the inertia tensor is not constant in the axes of --frame-omega: the relative rate holds its change too; "
                f"eq. 44 with a constant tensor would give {', '.join(f'{x:.6g}' for x in wrong)} N·m"
            )
    if len(found.corrections) == 1:
        said.append("one correction plane balances the static unbalance only: the couple stays")
    return said


def notes(found: MovingBody) -> str:
    """Say which conventions hold."""
    lines = [
        f"{len(found.parts.name)} parts; inertia at the centre of mass, products as +∫xy dm (the matrix carries -I_xy)"
    ]
    if found.moving:
        about = ", ".join(f"{x:g}" for x in found.point)
        lines.append(f"momentum at the centre of mass, and about {about} m; rates are true ones")
    if found.request.shaft is not None:
        lines.append("bearing forces act on the shaft; dynamic ones leave the static part out")
    return "\n".join(lines)
