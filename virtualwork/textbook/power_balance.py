"""The loads that balance a table of link states, by the principle of virtual power."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.records import record
from dalembert.arithmetic.shapes import as_array, as_vectors, in_32_digits
from virtualwork.textbook.link_states import ROUNDING, LinkStates, Mask, Real, UnitLoad, power_of

if TYPE_CHECKING:
    from matplotlib.figure import FigureBase

STEPS = 6
"""Steps of refinement: each gains the digits that the condition number leaves of sixteen."""


class Again(NamedTuple):
    """Unknowns and their powers in 32 digits."""

    value: Any
    """(..., k)."""
    unknown_power: Any
    """(..., k, k)."""


@record
@dataclass(frozen=True, eq=False, repr=False)
class Balance:
    """The loads that balance the known ones, computed by `balance`; k is the number of unknowns and of velocity fields."""

    value: Real
    """The unknowns, (..., k), N or N·m; NaN where they are not determined."""
    determined: Mask
    """(..., k): the velocity fields determine this unknown."""
    works: Mask
    """(..., k): the unknown does work in some field; where not, no equation holds it."""
    coefficient: Real
    """(..., k, k): the power of each unknown (last axis), per unit, in each velocity field, W."""
    condition: Real
    """(...): condition number of the coefficients, rows and columns scaled; 1 for one unknown."""
    power: Real
    """(..., k): the power of the known loads in each field, W."""
    problem: tuple[LinkStates, tuple[UnitLoad, ...]] | None = field(default=None, repr=False, compare=False)
    """The states and the unknowns that were balanced."""

    def plot(self, links: Sequence[str] = (), figure: FigureBase | None = None) -> NDArray[np.object_]:
        """Draw the power of every load as a bar; of several instants, the unknowns over them. Return the axes.

        Without a figure it is a new one of pyplot's; without matplotlib (the extra `plot`) an ImportError.

        Parameters
        ----------
        links : sequence of str
            What the links are called; default 1, 2, …
        figure : matplotlib's figure or subfigure
            Where to draw.
        """
        from virtualwork.textbook.picture import UNKNOWN, ledger, over_steps

        assert self.problem is not None
        states, unknowns = self.problem
        named = links or [str(i + 1) for i in range(states.shape[-1])]
        loads = [
            (" and ".join(n for n, acts in zip(named, u.acts.tolist(), strict=True) if acts), u.unit)
            for u in unknowns
        ]
        k = len(loads)
        if self.value.ndim > 1:
            values = self.value.reshape(-1, k)
            series = {(f"{UNKNOWN} on {on}", unit): values[:, j] for j, (on, unit) in enumerate(loads)}
            return over_steps(np.arange(1, len(values) + 1), series, figure)
        result = []
        for f in range(k):
            of, at = (f" (field {f + 1})", (f,)) if k > 1 else ("", ())
            for kind, term in states.terms.items():
                powers, works = (
                    np.broadcast_to(v, states.shape)[at].tolist() for v in (term.power, term.works)
                )
                result += [(n, kind + of, p) for n, p, does in zip(named, powers, works, strict=True) if does]
            own = self.unknown_power[f].tolist()
            result += [(on, UNKNOWN + of, p) for (on, _), p in zip(loads, own, strict=True)]
        return ledger(result, figure)

    def error_estimate(self, exact: tuple[LinkStates, Sequence[UnitLoad]] | None = None) -> Real:
        """Return the rounding error (..., k) of each unknown; infinite where it is not determined.

        It is by what the unknowns in 32 digits differ: of `exact` states and patterns, or None: of the floats.

        Examples
        --------
        >>> states = LinkStates(velocity=[0, 3], omega=[0.7, 0], force=[0, 5])
        >>> result = balance(states, [UnitLoad(torque=[1, 0])])
        >>> float(result.value[0]), bool(0 < result.error_estimate()[0] < 1e-14)
        (-21.42857142857143, True)
        """
        value = np.where(self.determined, self.value, 0.0)
        return np.where(self.determined, self.second_run(exact).value.off(value), np.inf)

    def second_run(self, exact: tuple[LinkStates, Sequence[UnitLoad]] | None = None) -> Again:
        """Return the unknowns and their powers in 32 digits; where an unknown is not determined, zero.

        What the floats leave in 32 digits of C x + P, C⁺ times that, is what they are off by (iterative refinement: N. J.
        Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., §12.1).
        """
        assert self.problem is not None
        states, unknowns = (self.problem[0].in_32_digits, self.problem[1]) if exact is None else exact
        coefficient, power = _coefficients(states, unknowns), states.whole_power
        if len(unknowns) == 1:
            coefficient, power = coefficient[..., None, :], power[..., None]
        scaled, rows, columns = _scaled(self.coefficient)
        inverse = np.linalg.pinv(scaled, rcond=len(unknowns) * ROUNDING) / np.swapaxes(rows, -1, -2)
        value = in_32_digits(np.where(self.determined, self.value, 0.0))
        for _ in range(STEPS):
            rest = ((coefficient * value[..., None, :]).sum(axis=-1) + power).value
            change = (inverse @ rest[..., None])[..., 0] / columns[..., 0, :]
            value = value - np.where(self.determined, change, 0.0)
        return Again(value, coefficient * value[..., None, :])

    @cached_property
    def unknown_power(self) -> Real:
        """The power of each unknown (last axis) in each field, (..., k, k), W; zero where it is not determined."""
        value = np.where(self.determined, self.value, 0.0)
        return np.asarray(self.coefficient * value[..., None, :])

    @cached_property
    def sum(self) -> Real:
        """The whole power in each field, (..., k), W: rounding, where every unknown is determined."""
        return np.asarray(self.power + self.unknown_power.sum(axis=-1))


def balance(states: LinkStates, unknowns: Sequence[UnitLoad]) -> Balance:
    """Return the loads that balance a table of link states, by the principle of virtual power.

    Parameters
    ----------
    states : LinkStates
        For one unknown (..., n); for k > 1 unknowns (..., k, n): k independent velocity fields of the instant,
        the actual one among them or not. The loads and accelerations are those of the instant in each.
    unknowns : sequence of UnitLoad, k

    Returns
    -------
    Balance

    Raises
    ------
    ValueError
        k > 1 unknowns without k velocity fields.

    Notes
    -----
    With P_f the power of the known loads in field f and c_fj that of a unit of unknown j, Σ_j c_fj x_j = −P_f
    (J. A. Riul, Dinâmica das Máquinas, unit II, eqs. 3 and 5, solved for the unknowns). An unknown that does no
    work has no equation: it is not determined, and says so in `works`.

    Examples
    --------
    Riul's example 1 (with −I·α = +80 and its power −4 000, which he prints as −80 and +4 000):

    >>> states = LinkStates(
    ...     velocity=[0, 300 + 200j, -500], omega=[20, -50, 0], mass=[0, 3, 2], inertia=[0, 0.1, 0],
    ...     acceleration=[0, 900 - 600j, 900], alpha=[0, -800, 0], force=[0, 0, 5000], gravity=-10j)
    >>> balance(states, [UnitLoad(torque=[1, 0, 0])]).value
    array([103000.])
    """
    k = len(unknowns)
    if k > 1 and (len(states.shape) < 2 or states.shape[-2] != k):
        raise ValueError(
            f"{k} unknowns need {k} velocity fields, on the last axis but one: the states have shape {states.shape}"
        )
    fast, turning = (largest[..., 0] for largest in states.fastest)
    scales = []
    for unknown in unknowns:
        force, torque = (
            np.broadcast_to(np.abs(x), states.shape).sum(axis=-1) for x in (unknown.force, unknown.torque)
        )
        scales.append(force * fast + torque * turning)
    coefficient, scale = _coefficients(states, unknowns), np.stack(scales, axis=-1)
    coefficient = np.where(np.abs(coefficient) > ROUNDING * scale, coefficient, 0.0)
    if k == 1:
        works = coefficient != 0
        value = np.full(works.shape, np.nan)
        np.divide(-states.power[..., None], coefficient, out=value, where=works)
        # no −0
        value += 0.0
        return Balance(
            value,
            works,
            works,
            coefficient[..., None, :],
            np.where(works[..., 0], 1.0, np.inf),
            states.power[..., None],
            (states, tuple(unknowns)),
        )
    return replace(_solve(coefficient, states.power), problem=(states, tuple(unknowns)))


def _coefficients(states: LinkStates, unknowns: Sequence[UnitLoad]) -> Any:
    """Return the power of each unknown, per unit, (..., k)."""
    columns = []
    for unknown in unknowns:
        power = power_of(as_vectors(unknown.force), states.applied_velocity)
        power = power + as_array(unknown.torque) * as_array(states.omega)
        columns.append((power + np.zeros(states.shape)).sum(axis=-1))
    return np.stack(columns, axis=-1)


def _scaled(coefficient: Real) -> tuple[Real, Real, Real]:
    """Return matrices with rows and columns of like size, and by what each row and each column was divided."""
    rows = np.abs(coefficient).max(axis=-1, keepdims=True)
    rows = np.where(rows > 0, rows, 1.0)
    columns = np.abs(coefficient / rows).max(axis=-2, keepdims=True)
    columns = np.where(columns > 0, columns, 1.0)
    return np.asarray(coefficient / rows / columns), rows, columns


def _solve(coefficient: Real, power: Real) -> Balance:
    """Solve the k × k systems, rows and columns scaled; name what a singular one leaves open."""
    works = (coefficient != 0).any(axis=-2)
    scaled, rows, columns = _scaled(coefficient)
    right = -power / rows[..., 0]
    k = coefficient.shape[-1]
    u, sigma, vh = np.linalg.svd(scaled)
    seen = sigma > k * ROUNDING * sigma[..., :1]
    regular = seen.all(axis=-1)
    safe = np.where(regular[..., None, None], scaled, np.eye(k))
    value = np.linalg.solve(safe, right[..., None])[..., 0]
    # A singular system still determines the unknowns in which its null vectors have no part, if it has a solution.
    open_part = np.where(seen[..., None], 0.0, np.abs(vh)).max(axis=-2)
    along = (np.swapaxes(u, -1, -2) @ right[..., None])[..., 0]
    solvable = (
        np.where(seen, 0.0, np.abs(along)) <= k * ROUNDING * np.abs(right).max(axis=-1, keepdims=True)
    ).all(axis=-1)
    partial = (
        np.swapaxes(vh, -1, -2) @ np.divide(along, sigma, out=np.zeros_like(along), where=seen)[..., None]
    )[..., 0]
    determined = regular[..., None] | (solvable[..., None] & (open_part <= np.sqrt(k) * ROUNDING) & works)
    value = np.where(regular[..., None], value, partial) / columns[..., 0, :]
    smallest = sigma[..., -1]
    condition = np.divide(sigma[..., 0], smallest, out=np.full_like(smallest, np.inf), where=regular)
    return Balance(
        np.where(determined, value + 0.0, np.nan), determined, works, coefficient, condition, power
    )
