"""Common parts of states in time: computation in blocks, and the table of the states."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.records import components, table
from dalembert.arithmetic.shapes import is_doubled
from rigidbody3d import attitude as quaternion

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import FigureBase

    from dalembert.page import Page

Array = NDArray[np.float64]

BLOCK = 8192
"""The number of states that are computed at once: intermediate results stay in the cache."""


def in_blocks(work: Callable[[Array], Array], time: Array, lead: tuple[int, ...], width: int) -> Array:
    """Return what `work` gives of b bodies at times (n,), (b, n, width), as (..., n, width); at one time (..., width)."""
    t = np.atleast_1d(time)
    bodies = int(np.prod(lead))
    step = max(1, BLOCK // max(bodies, 1))
    blocks = [work(t[start : start + step]) for start in range(0, len(t), step)] or [
        np.zeros((bodies, 0, width))
    ]
    out = blocks[0] if len(blocks) == 1 else np.concatenate(blocks, axis=1)
    return out.reshape(lead + time.shape + (width,))


def from_start(values: Array, start: ArrayLike, time: Array) -> Array:
    """Return values (..., n, k), of which those at time zero are the start (..., k) itself, and no rounding of it."""
    if is_doubled(values) or not (time == 0).any():
        return values
    own = np.asarray(start, dtype=float)
    return np.where((time == 0)[..., None], own[..., None, :] if time.ndim else own, values)


STATE = ("attitude", "quaternion", "omega", "momentum", "energy")
"""The quantities of a state in time with an error estimate."""


def require(of: str, *names: str) -> None:
    """Raise ValueError where there is no estimate of a quantity of this name."""
    if of not in names:
        raise ValueError(f"no estimate for '{of}': expected one of {', '.join(names)}")


def difference(exact: Any, here: State, of: str) -> Array:
    """Return how far a state is from the same one in doubled numbers: an angle, components, a number."""
    if of in ("attitude", "quaternion"):
        off: Any = quaternion.apart(exact.attitude, here.attitude)
        each = np.asarray(off.off(np.zeros(off.shape)))
        # a turn by an angle moves a quaternion by half of it
        return 2 * quaternion.length(each)[..., 0] if of == "attitude" else each
    result: Array = getattr(exact, of).off(getattr(here, of))
    return result


class State(Protocol):
    """A state in time, of whatever kind."""

    @property
    def attitude(self) -> Array: ...
    @property
    def omega(self) -> Array: ...
    @property
    def momentum(self) -> Array: ...
    @property
    def energy(self) -> Array: ...


def _columns(state: StateInTime) -> dict[str, Array]:
    columns = {"t_s": state.time}
    columns |= components("omega_*_rad_s", state.omega)
    columns |= components("attitude_*", state.attitude, "wxyz")
    columns |= components("momentum_*_kg_m2_s", state.momentum)
    return columns | {"energy_J": state.energy}


class PictureData(NamedTuple):
    """The data of a body for pictures: its inertia, whether no torque acts on it, whether it stands on a point."""

    inertia: ArrayLike
    free: bool
    top: bool


class StateInTime(State, Protocol):
    """A state at given times, and the body that it is of."""

    @property
    def time(self) -> Array: ...
    @property
    def _picture_data(self) -> PictureData: ...


class AtTimes:
    """Base of states at given times: a table, a picture, a page."""

    def to_frame(self: StateInTime) -> pd.DataFrame:
        """Return a table with a row per state: t_s, ω in body axes, attitude, momentum in space axes, energy."""
        return table(_columns(self), ("body", "state") if self.time.ndim else ("body",))

    def plot(self: StateInTime, figure: FigureBase | None = None) -> NDArray[np.object_]:
        """Draw ω over time, its path in body axes (a free body's polhode), the trace of the body's axis on the sphere of space.

        Returns matplotlib's axes (3,). One body at several times, else a ValueError. Without a figure it is a new one of
        pyplot's; without matplotlib (the extra `plot`) an ImportError.
        """
        from rigidbody3d.picture.rotation import rotation

        _one_body(self)
        inertia, free, top = self._picture_data
        return rotation(self.time, self.omega, self.attitude, inertia, free=free, top=top, figure=figure)

    def animate(self: StateInTime) -> Page:
        """Return a page that moves: the body by its own clock with play, slider, curves and values.

        A notebook shows it; `.save("body.html")` writes it. One body at several times, else a ValueError.
        """
        from dalembert.page import Shown
        from rigidbody3d.animation import turning_page

        _one_body(self)
        shown = {name: Shown(values, name) for name, values in _columns(self).items()}
        return turning_page("", self._picture_data.inertia, self.omega[0], shown, self._picture_data.top)


class InClosedForm(AtTimes):
    """Base of states that a formula gives at any time: it runs in 32 digits too."""

    @property
    def in_32_digits(self) -> State:
        """This state in doubled numbers."""
        raise NotImplementedError

    def error_estimate(self, of: str = "attitude", exact: State | None = None) -> Array:
        """Return an estimate of the error of a quantity: computed twice, with 16 and with 32 digits.

        Parameters
        ----------
        of
            "attitude", as an angle (..., n), rad, or "quaternion", its components (..., n, 4); "omega" or "momentum",
            (..., n, 3); "energy", (..., n).
        exact
            The state in doubled numbers, if there are more digits than floats; default: the data count as exact.

        Examples
        --------
        >>> from rigidbody3d import FreeBody
        >>> late = FreeBody([1, 2, 3], [1.0, 0.1, 0.5]).at([1.0, 1e6])
        >>> late.error_estimate() < 1e-14
        array([ True, False])
        """
        require(of, *STATE)
        return difference(exact or self.in_32_digits, cast("State", self), of)


def _one_body(state: StateInTime) -> None:
    if np.shape(state.omega) != (np.size(state.time), 3) or np.size(state.time) < 2:
        raise ValueError(
            f"a picture shows one body at several times, found ω of the shape {np.shape(state.omega)}"
        )
