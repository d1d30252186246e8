"""A rotation as a page that moves: the body as a box, a wheel or a top, ω and H as arrows, the trace of an axis.

The columns are the caller's, under the names of the CSV with SI units: `t_s`, `omega_x_rad_s`, `attitude_w`, …
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.page import Page, Shown, fits, packed, page, rounded
from rigidbody3d.inertia import principal
from rigidbody3d.solids import pole as pole_of
from rigidbody3d.solids import traced_axis

Array = NDArray[np.float64]

SIDES = 24
THIN = 0.04
"""No side of a drawn body is thinner, of its largest."""


def turning_page(
    title: str, inertia: ArrayLike, omega: ArrayLike, columns: Mapping[str, Shown], top: bool = False
) -> Page:
    """Return the page of a rotation.

    Parameters
    ----------
    inertia : array (3,) or (3, 3)
        kg·m², in body axes.
    omega : array (3,)
        At the beginning, rad/s, in body axes: which axis is traced.
    columns : mapping
        Of numbers, under their SI names; (n,) each.
    top : bool
        Whether the body stands on a point: then its axis is body z.

    Raises
    ------
    ValueError
        More states than a page can hold.
    """
    names = list(columns)
    count = len(np.asarray(columns["t_s"].values))
    fits(count)
    series = {
        "name": "",
        "n": count,
        "over": [names.index("t_s")],
        "columns": [
            {"header": c.header, "owner": name.split("_")[0], "si": c.si, **packed(c.values)}
            for name, c in columns.items()
        ],
    }
    corners, faces = _top() if top else _body(inertia)
    axis, called = traced_axis(inertia, omega, top)
    return page(
        title,
        "space",
        [series],
        x=0,
        clock=0,
        wraps=True,
        omega=[names.index(f"omega_{a}_rad_s") for a in "xyz"],
        attitude=[names.index(f"attitude_{a}") for a in "wxyz"],
        momentum=[names.index(f"momentum_{a}_kg_m2_s") for a in "xyz"],
        energy=names.index("energy_J"),
        plots=[names.index(f"omega_{a}_rad_s") for a in "xyz"],
        solid={"corners": [rounded(p) for p in corners], "faces": faces},
        axis=rounded(axis),
        traced=called,
    )


Solid = tuple[Array, list[dict[str, Any]]]


def _body(inertia: ArrayLike) -> Solid:
    """A box, or a round bar or disc, with these principal moments; its largest half length is 1.

    Of a box with the sides a, b, c: I_x ∝ b² + c², so a² ∝ I_y + I_z − I_x; of a bar I = m r²/2 and m (3r² + h²)/12.
    """
    moments, axes = principal(inertia)
    pole = pole_of(moments)
    if pole is None:
        squares = moments.sum() - 2 * moments
        half = np.sqrt(np.maximum(squares, 0.0))
        half = np.maximum(half / half.max(), THIN)
        signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        faces = [
            {"corners": ring, "color": color}
            for color, ring in (
                (0, [0, 1, 3, 2]),
                (0, [4, 6, 7, 5]),
                (1, [0, 4, 5, 1]),
                (1, [2, 3, 7, 6]),
                (2, [0, 2, 6, 4]),
                (2, [1, 5, 7, 3]),
            )
        ]
        return (signs * half) @ axes, faces
    along, across = moments[pole], moments[(pole + 1) % 3]
    radius2 = 2 * along
    height2 = max(12 * across - 3 * radius2, 0.0)
    size = np.sqrt([radius2, height2 / 4])
    radius, half_height = np.maximum(size / size.max(), THIN)
    turn = 2 * np.pi * np.arange(SIDES) / SIDES
    # right-handed about the axis
    frame = np.stack([axes[(pole + 1) % 3], axes[(pole + 2) % 3], axes[pole]])
    ring = np.stack([radius * np.cos(turn), radius * np.sin(turn), 0 * turn], axis=-1)
    corners = np.concatenate([ring - [0, 0, half_height], ring + [0, 0, half_height]]) @ frame
    faces = [{"corners": list(range(SIDES))[::-1], "color": 2}]
    faces.append({"corners": list(range(SIDES, 2 * SIDES)), "color": 2})
    faces += [_strip(i, [i, (i + 1) % SIDES, (i + 1) % SIDES + SIDES, i + SIDES]) for i in range(SIDES)]
    return corners, faces


def _strip(i: int, corners: list[int]) -> dict[str, Any]:
    """A face of the mantle; two stripes show how the body turns."""
    return {"corners": corners, "color": 1 if i % (SIDES // 2) < 2 else 0}


def _top() -> Solid:
    """A cone on its tip, its axis body z."""
    turn = 2 * np.pi * np.arange(SIDES) / SIDES
    rim = np.stack([0.5 * np.cos(turn), 0.5 * np.sin(turn), 0.85 + 0 * turn], axis=-1)
    corners = np.concatenate([rim, [[0.0, 0.0, 0.0]]])
    faces: list[dict[str, Any]] = [{"corners": list(range(SIDES)), "color": 2}]
    return corners, faces + [_strip(i, [SIDES, (i + 1) % SIDES, i]) for i in range(SIDES)]
