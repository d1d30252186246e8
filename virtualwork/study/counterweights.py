"""Counterweights that balance the shaking force of a mechanism best in the mean square.

On a link that turns about a fixed pivot a counterweight of mass times radius u (complex, in the link's axes) adds the
shaking force −u·d²(e^{iθ})/dt². The shaking force is linear in u.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from virtualwork.describe import AssemblyError, DescriptionError
from virtualwork.describe.description import Description
from virtualwork.describe.parts import GROUND
from virtualwork.formulas.dynamics import Moving
from virtualwork.formulas.forces import Force
from virtualwork.formulas.numbers import Complexes, Number, plus
from virtualwork.formulas.pose_forces import PoseForces


class Shaken(Force, kind="shaken"):
    """The shaking force of inertia, N."""

    is_rubbed = False
    is_vector = True

    def form(self, forces: PoseForces) -> Number:
        total: Number = None
        for load in forces.case.loads:
            if load.kind == "inertia force":
                total = plus(total, forces.pose.formed(load))
        return total


def pivot(mechanism: Description, link: str) -> complex:
    """The point of a link that is pinned to the ground.

    Raises
    ------
    DescriptionError
        Where the link has none: a counterweight on it would shake with its own mass.
    """
    if link not in mechanism.links:
        raise DescriptionError(f"counterweights: unknown link '{link}'")
    for name, bodies in mechanism.pins.items():
        if GROUND in bodies and link in bodies:
            return mechanism.links[link].points[name]
    raise DescriptionError(
        f"counterweights: link '{link}' does not turn about a pin of the ground: expected one that does"
    )


def least_squares(motion: Moving, links: Sequence[str]) -> tuple[dict[str, complex], Complexes, Complexes]:
    """Return the counterweights on links with a fixed pivot that leave the least RMS shaking force of inertia.

    Parameters
    ----------
    motion : Motion
        The cycle to be balanced, at a speed other than zero.
    links : sequence of str
        Which links carry a counterweight.

    Returns
    -------
    weights : dict of link to mass times radius, complex kg·m in the link's axes, from its pivot
    before, after : complex (n,)
        The shaking force of inertia, N, without and with them.

    Notes
    -----
    Solved by orthogonal factors, never by normal equations. Where two links turn alike (a parallelogram's cranks)
    only the sum of their counterweights counts: that is an error and names them.
    """
    if isinstance(links, str) or not links:
        raise DescriptionError(f"counterweights: found {links!r}, expected a list of links")
    dynamics, poses = motion.dynamics, motion.dynamics.poses
    if not dynamics.moves:
        raise DescriptionError("counterweights: the speed is zero: expected a motion that shakes")
    before = dynamics.value(Shaken())
    columns = []
    for link in links:
        z = pivot(poses.mechanism, link)
        # of two points a metre apart on the link, about a fixed pivot: −d²(e^{iθ})/dt²
        columns.append(-poses.point(link, z + 1.0, 2))
    matrix = np.stack(columns, axis=1)
    rows = np.isfinite(before) & np.isfinite(matrix).all(axis=1) & poses.assembled
    if not rows.any():
        raise AssemblyError("counterweights: assembled at no pose of the motion")
    size = np.linalg.norm(matrix[rows], axis=0)
    if not size.all():
        still = ", ".join(link for link, own in zip(links, size, strict=True) if not own)
        raise DescriptionError(
            f"counterweights: {still} does not turn in this motion: expected links that do"
        )
    u, s, vh = np.linalg.svd(matrix[rows] / size, full_matrices=False)
    if not s[-1] > 1e-10 * s[0]:
        part = np.abs(vh[-1]) > 1e-6
        alike = ", ".join(link for link, own in zip(links, part, strict=True) if own)
        raise DescriptionError(
            f"counterweights: {alike} turn alike: only a combination of theirs counts; leave one out"
        )
    weights = (vh.conj().T @ ((u.conj().T @ -before[rows]) / s)) / size
    after = before + matrix @ weights
    return dict(zip(links, (complex(w) for w in weights), strict=True)), before, after
