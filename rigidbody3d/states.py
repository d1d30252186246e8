"""What states in time have in common: they are worked out in blocks, and laid out as a table."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.records import components, table
from rigidbody3d.rounding_in_time import State

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import FigureBase

    from dalembert.page import Page

Array = NDArray[np.float64]

BLOCK = 8192
"""So many states are worked out at once: what is intermediate stays in the cache."""


def in_blocks(work: Callable[[Array], Array], time: Array, lead: tuple[int, ...], width: int) -> Array:
    """Return what `work` gives of b bodies at times (n,), (b, n, width), as (..., n, width); at one time (..., width)."""
    t = np.atleast_1d(time)
    bodies = int(np.prod(lead))
    out = np.empty((bodies, len(t), width))
    step = max(1, BLOCK // max(bodies, 1))
    for start in range(0, len(t), step):
        out[:, start : start + step] = work(t[start : start + step])
    return out.reshape(lead + time.shape + (width,))


def _columns(state: State, time: Array) -> dict[str, Array]:
    columns = {"t_s": time}
    columns |= components("omega_*_rad_s", state.omega)
    columns |= components("attitude_*", state.attitude, "wxyz")
    columns |= components("momentum_*_kg_m2_s", state.momentum)
    return columns | {"energy_J": state.energy}


def frame_of(state: State, time: Array) -> pd.DataFrame:
    """Return a table of states: t_s, ω in body axes, attitude, momentum in space axes, energy."""
    return table(_columns(state, time), ("body", "state") if time.ndim else ("body",))


def _one_body(state: State, time: Array) -> None:
    if np.shape(state.omega) != (np.size(time), 3) or np.size(time) < 2:
        raise ValueError(
            f"a picture shows one body at several times, found ω of the shape {np.shape(state.omega)}"
        )


def page_of(state: State, time: Array, inertia: ArrayLike, *, top: bool) -> Page:
    """Return the page of one body's states, its columns those of the table."""
    from dalembert.page import Shown
    from rigidbody3d.animation import turning_page

    _one_body(state, time)
    shown = {name: Shown(values, name) for name, values in _columns(state, time).items()}
    return turning_page("", inertia, state.omega[0], shown, top)


def plot_of(
    state: State, time: Array, inertia: ArrayLike, *, free: bool, top: bool, figure: FigureBase | None
) -> NDArray[np.object_]:
    """Draw one body's states over time: ω, its path in body axes (the polhode), the trace of an axis in space."""
    from rigidbody3d.picture.rotation import rotation

    _one_body(state, time)
    return rotation(time, state.omega, state.attitude, inertia, free=free, top=top, figure=figure)
