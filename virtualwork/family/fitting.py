"""Dimensions that bring a point of a mechanism through given places: dimensional synthesis by least squares.

Starts of a low-discrepancy sequence (Sobol's, scrambled by a seed) are worked out together, as variants; the best are
refined with exact derivatives. Where the timing is free, the input at each place is an unknown too, and begins at the
poses of a coarse sweep that come nearest to the places in their order.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from virtualwork.describe.description import Description
from virtualwork.describe.dimensions import Dimension, changed, dimensions, named, value
from virtualwork.describe.errors import DescriptionError, MechanismError
from virtualwork.family.part import Part, Solver
from virtualwork.formulas.asked import Key
from virtualwork.formulas.numbers import Complexes, Reals

D = TypeVar("D", bound=Description)

# of the starts, the first by distance are put in order, and the first of those refined: roughly, then the best to the end
ORDERED, REFINED = 48, 24
ROUGH, LAST = 40, 300
# of the mechanism's size: a fit as near as this is not looked for again
MET = 1e-12
# of the mechanism's size: how far a pose that cannot be assembled counts as away
AWAY = 10.0
# poses of the coarse sweep, and of the look over the whole range
COARSE, FINE = 120, 721


@dataclass(frozen=True, eq=False)
class Fit(Generic[D]):
    """The dimensions of which a point comes nearest to its target.

    Attributes
    ----------
    mechanism : Description
        With the fitted numbers.
    dimensions : tuple of Dimension
    values : array (d,)
        SI.
    inputs : array (n,)
        Rad or m, at each place of the target.
    positions, target : array (n,)
        Where the point comes, and where it should, x + iy in m.
    starts, evaluations : int
        Tried, and mechanisms worked out over the target in all.
    remarks : tuple of str
        What the designer should know: bounds reached, defects of assembly and of order.
    """

    mechanism: D
    dimensions: tuple[Dimension, ...]
    values: Reals
    inputs: Reals
    positions: Complexes
    target: Complexes
    starts: int
    evaluations: int
    remarks: tuple[str, ...]

    @property
    def parameters(self) -> dict[str, float]:
        """The fitted numbers by path, SI."""
        return dict(zip((d.path for d in self.dimensions), self.values.tolist(), strict=True))

    @property
    def distances(self) -> Reals:
        """(n,) m."""
        return np.asarray(np.abs(self.positions - self.target))

    @property
    def rms(self) -> float:
        """Root of the mean square of the distances, m."""
        return float(np.sqrt(np.mean(self.distances**2)))

    @property
    def max(self) -> float:
        """The largest distance, m."""
        return float(self.distances.max())

    def __repr__(self) -> str:
        found = ", ".join(f"{path}={number:.6g}" for path, number in self.parameters.items())
        return f"Fit({found}; rms {self.rms:.3g} m)"


def fit(
    m: D,
    point: str,
    target: ArrayLike,
    free: Mapping[str, tuple[float, float]],
    inputs: ArrayLike | None = None,
    starts: int = 256,
    seed: int = 0,
) -> Fit[D]:
    """Find the dimensions whose point comes nearest to a target; see `Mechanism.fit`."""
    problem = _Problem(m, point, target, free, inputs)
    return problem.solved(starts, seed)


class _Problem(Generic[D]):
    """What is looked for. Unknowns are shares of the way from a lower to an upper bound, then free inputs."""

    def __init__(
        self,
        m: D,
        point: str,
        target: ArrayLike,
        free: Mapping[str, tuple[float, float]],
        inputs: ArrayLike | None,
    ) -> None:
        self.m, self.evaluations = m, 0
        self.target = _target(target)
        if len(m.inputs) != 1:
            raise DescriptionError(f"found {len(m.inputs)} inputs, expected one for a fit")
        self.key = _key(m, point)
        found = _free(m, free)
        self.dimensions = tuple(found)
        self.low, self.high = np.array(list(found.values()), dtype=float).T
        self.q = None if inputs is None else np.asarray(inputs, dtype=float)
        if self.q is not None and (self.q.shape != self.target.shape or not np.isfinite(self.q).all()):
            raise ValueError(f"inputs: expected {len(self.target)} finite numbers, one for each target point")
        self.size = float(m.size)
        self._first: Solver | None = None
        self._last: tuple[bytes, Solver] | None = None

    # --- evaluation -----------------------------------------------------------------------------------------------
    def solver(self, values: Reals, q: Reals) -> Solver:
        """Variants (v, d) at their inputs (v or 1, n)."""
        self.evaluations += len(values)
        part = Part(self.m, self.dimensions, values, q[:, :, None], [[0.0], [0.0], [0.0]])
        found = Solver(part, self._first)
        self._first = self._first or found
        return found

    def places(self, values: Reals, q: Reals) -> Complexes:
        """Where the point is, (v, n); NaN where it cannot be."""
        return self.solver(values, q).values([self.key])[0]  # type: ignore[no-any-return]

    def split(self, x: Reals) -> tuple[Reals, Reals]:
        """The dimensions (1, d) and the inputs (1, n) of the unknowns."""
        d = len(self.dimensions)
        # the product may pass the bound by a rounding
        values = np.clip(self.low + x[:d] * (self.high - self.low), self.low, self.high)
        return values[None], (x[d:] if self.q is None else self.q)[None]

    def at(self, x: Reals) -> Solver:
        """The mechanism of some unknowns: the last one is kept, for its derivatives."""
        name = x.tobytes()
        if self._last is None or self._last[0] != name:
            self._last = name, self.solver(*self.split(x))
        return self._last[1]

    def residuals(self, x: Reals) -> Reals:
        """(2n,), of the mechanism's size."""
        apart = (self.at(x).values([self.key])[0][0] - self.target) / self.size
        return _real(np.where(np.isfinite(apart), apart, AWAY))

    def jacobian(self, x: Reals) -> Reals:
        """(2n, unknowns): from one sweep backwards, or from differences where the mechanism is not on the tape."""
        d, n = len(self.dimensions), len(self.target)
        slopes = self.at(x).slopes(self.key)
        slopes = self._differences(x) if slopes is None else slopes[0]
        slopes = np.where(np.isfinite(slopes), slopes, 0.0) / self.size
        to_shares = slopes[:, :d] * (self.high - self.low)
        if self.q is not None:
            return _real(to_shares)
        return _real(np.hstack([to_shares, np.zeros((n, n)) + np.diag(slopes[:, d])]))

    def _differences(self, x: Reals) -> Complexes:
        """The derivatives (n, d + 1) from steps away from the farther bound; of all inputs from one variant."""
        d = len(self.dimensions)
        values, q = self.split(x)
        step = 1e-7 * (self.high - self.low) * np.where(values[0] - self.low > self.high - values[0], -1, 1)
        turn = 1e-7 * (self.size if self.m.inputs[0].is_slide else 1.0)
        rows = np.vstack([values, values + np.diag(step), values])
        along = np.vstack([np.repeat(q, d + 1, axis=0), q + turn])
        z = self.places(rows, along)
        return np.asarray(((z[1:] - z[0]) / np.append(step, turn)[:, None]).T)

    # --- starts -----------------------------------------------------------------------------------------------------
    def starts(self, count: int, seed: int) -> Reals:
        """Shares (count, d): the file's own numbers, as near as the bounds let them, then Sobol's."""
        from scipy.stats import qmc

        own = np.array([float(value(self.m, d.path).real) for d in self.dimensions])
        first = np.clip((own - self.low) / (self.high - self.low), 0.0, 1.0)
        drawn = qmc.Sobol(len(own), seed=seed).random_base2(max(0, int(np.ceil(np.log2(max(count, 1))))))
        return np.vstack([first, drawn])[:count]

    def begun(self, shares: Reals) -> list[Reals]:
        """The unknowns to refine, the most promising first."""
        values = self.low + shares * (self.high - self.low)
        if self.q is not None:
            cost = self._cost(np.abs(self.places(values, self.q[None]) - self.target) ** 2).sum(axis=1)
            return list(shares[np.argsort(cost, kind="stable")[:REFINED]])
        at, m = self.m.at[0], self.m
        turning = not m.inputs[0].is_slide
        span = 2 * np.pi if turning else 4 * self.size
        q = at + span * np.arange(COARSE) / COARSE - (0.0 if turning else span / 2)
        swept = self.places(values, q[None])
        nearest = np.array(
            [self._cost(np.abs(path[:, None] - self.target) ** 2).min(axis=0).sum() for path in swept]
        )
        found: list[tuple[float, Reals]] = []
        for i in np.argsort(nearest, kind="stable")[:ORDERED]:
            away = self._cost(np.abs(swept[i][:, None] - self.target) ** 2)
            for sense in (1, -1):
                cost, places = _in_order(away[::sense], turning)
                # past the end of the turn the input goes on
                turns, k = np.divmod(places, COARSE)
                inputs = q[::sense][k] + sense * turns * span
                found.append((cost, np.concatenate([shares[i], inputs])))
        found.sort(key=lambda each: each[0])
        # what cannot be assembled near every place leads nowhere, while anything else does
        there = [x for cost, x in found[:REFINED] if cost < (AWAY * self.size) ** 2]
        return there or [x for _, x in found[:1]]

    def _cost(self, squared: Reals) -> Reals:
        return np.where(np.isfinite(squared), squared, (AWAY * self.size) ** 2)

    # --- solution ---------------------------------------------------------------------------------------------------
    def solved(self, starts: int, seed: int) -> Fit[D]:
        """Refine the best starts; stop at one that meets the target."""
        best: Any = None
        for x in self.begun(self.starts(starts, seed)):
            found = self.refined(x, ROUGH)
            if best is None or found.cost < best.cost:
                best = found
            if np.abs(best.fun).max() < MET:
                break
        best = self.refined(best.x, LAST)
        values, q = (each[0] for each in self.split(best.x))
        z = self.at(best.x).values([self.key])[0][0]
        if not np.isfinite(z).all():
            k = int(np.argmin(np.isfinite(z)))
            raise MechanismError(
                f"fit: of {starts} starts within the bounds none can be assembled at all {len(z)} target points: "
                f"the best not at target point {k + 1}"
            )
        numbers = zip((d.path for d in self.dimensions), values.tolist(), strict=True)
        mechanism = changed(self.m, dict(numbers))
        remarks = tuple(self.remarks(values, q))
        return Fit(mechanism, self.dimensions, values, q, z, self.target, starts, self.evaluations, remarks)

    def refined(self, x: Reals, steps: int) -> Any:
        """One start, by a trust region within the bounds."""
        from scipy.optimize import least_squares

        d = len(self.dimensions)
        low, high = np.full(len(x), -np.inf), np.full(len(x), np.inf)
        low[:d], high[:d] = 0.0, 1.0
        return least_squares(
            self.residuals,
            np.clip(x, low, high),
            self.jacobian,
            (low, high),
            ftol=1e-15,
            xtol=1e-15,
            gtol=1e-15,
            max_nfev=steps,
        )

    def remarks(self, values: Reals, q: Reals) -> list[str]:
        """What is to be said of the solution."""
        said = []
        for d, number, low, high in zip(self.dimensions, values, self.low, self.high, strict=True):
            if min(number - low, high - number) < 1e-6 * (high - low):
                said.append(f"fit: {d.path} ends at its bound")
        order = np.diff(q) * np.sign(q[-1] - q[0])
        if self.q is None and (order < 0).any():
            k = int(np.argmin(order))
            said.append(
                f"fit: order defect: the input meets target point {k + 2} before target point {k + 1}"
            )
        whole = np.linspace(q.min(), q.max(), FINE)
        gaps = whole[~np.isfinite(self.places(values[None], whole[None])[0])]
        if len(gaps):
            low, high = (self._shown(float(each)) for each in (gaps[0], gaps[-1]))
            said.append(
                f"fit: branch defect: between the target points it cannot be assembled from {low} to {high} "
                f"({len(gaps)} of {FINE} poses): it does not pass there without being taken apart"
            )
        if self._first is not None and self._first.written is None:
            said.append("fit: derivatives are differences: this mechanism has groups without a closed form")
        return said

    def _shown(self, q: float) -> str:
        return f"{q:.6g} m" if self.m.inputs[0].is_slide else f"{np.degrees(q):.6g} deg"


def _in_order(away: Reals, cyclic: bool) -> tuple[float, NDArray[np.intp]]:
    """Which pose goes to which place, (n,), so that poses never go back and Σ away (poses, places) is least.

    Around a turn any pose may be the first, and poses past the last go on from the first.

    >>> _in_order(np.array([[9.0, 0.0], [0.0, 9.0], [4.0, 4.0]]), True)
    (0.0, array([1, 3]))
    """
    m, n = away.shape
    firsts = np.arange(m) if cyclic else np.zeros(1, dtype=int)
    around = (firsts[:, None] + np.arange(m)) % m
    total = away[around, 0].copy()
    if cyclic:
        total[:, 1:] = np.inf
    before = []
    for j in range(1, n):
        least = np.minimum.accumulate(total, axis=1)
        # where the least so far was
        here = np.where(total == least, np.arange(m), 0)
        before.append(np.maximum.accumulate(here, axis=1))
        total = least + away[around, j]
    first, k = np.unravel_index(np.argmin(total), total.shape)
    cost = float(total[first, k])
    places = [int(k)]
    for back in reversed(before):
        places.append(int(back[first, places[-1]]))
    return cost, firsts[first] + np.array(places[::-1])


def _real(z: Complexes) -> Reals:
    """Real parts above imaginary parts."""
    return np.concatenate([np.real(z), np.imag(z)])


def _target(given: ArrayLike) -> Complexes:
    found = np.asarray(given)
    if not np.iscomplexobj(found):
        found = np.asarray(found, dtype=float)
        if found.ndim != 2 or found.shape[1] != 2:
            raise ValueError(f"target: expected shape (n, 2), found {found.shape}")
        found = found[:, 0] + 1j * found[:, 1]
    if found.ndim != 1 or len(found) < 2:
        raise ValueError(f"target: found {found.size} point, expected two or more")
    if not np.isfinite(found).all():
        raise ValueError("target: expected finite numbers")
    return found


def _key(m: Description, point: str) -> Key:
    for body, points in m.bodies.items():
        if point in points:
            return ("point", body, 0j, point, 0)
    raise DescriptionError(f"no point is named '{point}'")


def _free(m: Description, free: Mapping[str, tuple[float, float]]) -> dict[Dimension, tuple[float, float]]:
    known = dimensions(m)
    found: dict[Dimension, tuple[float, float]] = {}
    for path, (low, high) in free.items():
        (dimension, *both) = named(m, path, known)
        if both:
            raise DescriptionError(f"'{path}' names two numbers: expected {dimension.path} or {both[0].path}")
        of, last = dimension.where[0], dimension.where[-1]
        weight = of == "links" and (last in ("mass", "inertia") or dimension.where[2] == "center")
        if of not in ("ground", "links", "guides", "gears") or weight:
            raise DescriptionError(f"{dimension.path} moves no point: expected a dimension of the geometry")
        if not (np.isfinite(low) and np.isfinite(high) and low < high):
            raise DescriptionError(f"{dimension.path}: found bounds {low:g} to {high:g}, expected low < high")
        found[dimension] = (float(low), float(high))
    if not found:
        raise DescriptionError("no dimension is free: expected one or more")
    return found
