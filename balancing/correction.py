"""Known unbalances -> the corrections in one, two or more planes that balance them.

With U the unbalances at z and W the corrections in the planes at z_p, balance asks that

    Σ U + Σ W = 0           (force; Riul eq. 9, 12)
    Σ U z + Σ W z_p = 0     (moment; Riul eq. 13)

In one plane only the force can vanish. In two planes W_B = -M_A/(z_B - z_A), the moment about plane A over
the distance (eqs. 15-18). In more planes the corrections of least Σ|W|² are, with M_q = Σ U (z - z_q) the
moment about plane q,

    W_p = -Σ_q (z_p - z_q) M_q / Σ_{q<r} (z_q - z_r)²,

which for two planes is the line above. Only differences of given positions stand in it.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from math import isfinite
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from balancing.phase import angle_of
from balancing.rotor import BLOCK
from dalembert.arithmetic.exact import exact_sum, two_product, two_sum
from dalembert.arithmetic.parts import in_parts
from dalembert.arithmetic.records import numbers, record, table
from dalembert.arithmetic.shapes import as_numbers, common_shape, spread_to
from dalembert.dataclass import dataclass

if TYPE_CHECKING:
    from concurrent.futures import Executor

    import pandas as pd
    from matplotlib.figure import FigureBase

    from balancing.second_run import ExactMasses

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

# rotors of a part that goes to another process
PART = 1 << 14
LARGEST = 1e290  # products beyond it overflow where they are split into parts


class CoincidentPlanes(ValueError):
    """All correction planes of a rotor lie at one place, so they cannot correct a couple."""

    def __init__(self, rotors: NDArray[np.bool_]) -> None:
        self.rotors = rotors
        super().__init__(
            "the correction planes lie at the same place, so that they cannot correct a couple: "
            "expected planes apart, or a single plane for static balancing"
        )


@record
class Unbalances(NamedTuple):
    """The static unbalance (kg·m) and the couple unbalance (kg·m²), complex."""

    static: Complex
    couple: Complex


@record
@dataclass(frozen=True, eq=False, repr=False)
class Correction:
    """The corrections of rotors with known unbalances, computed by `correct`."""

    moment: Complex
    """The unbalances m·r·e^{iθ}, (..., k), kg·m."""
    z: Real
    """Their axial positions, (..., k), m."""
    planes: Real
    """The axial positions of the correction planes, (..., p), m."""

    @cached_property
    def _static(self) -> tuple[Real, Real]:
        """Σ U as a pair (rounded, rest), each (..., 2): real and imaginary part."""
        return exact_sum(_parts(self.moment), axis=-2)

    @cached_property
    def _moment(self) -> tuple[Real, Real]:
        """Σ U z as a pair."""
        product, error = two_product(_parts(self.moment), self.z[..., None])
        total, rest = exact_sum(product, axis=-2)
        return two_sum(total, rest + error.sum(axis=-2))

    def _about(self, z: Real) -> tuple[Real, Real]:
        """Σ U (z_i - z) for positions z (..., q), as a pair, each (..., q, 2)."""
        (s, s_rest), (m, m_rest) = self._static, self._moment
        at = z[..., None]
        product, error = two_product(at, s[..., None, :])
        total, rest = two_sum(m[..., None, :], -product)
        return two_sum(total, rest + (m_rest[..., None, :] - error - at * s_rest[..., None, :]))

    @property
    def static(self) -> Complex:
        """The static unbalance Σ U before correction, (...), kg·m."""
        return _complex(self._static[0])

    def couple(self, about: ArrayLike) -> Complex:
        """Return the couple unbalance Σ U (z - about) before correction, (...), kg·m²."""
        at = spread_to("about", about, self.static.shape)
        return _complex(self._about(at[..., None])[0])[..., 0]

    @cached_property
    def unbalance(self) -> Complex:
        """The unbalance to ADD in each plane, (..., p), kg·m."""
        rotors = len(self.moment) if self.moment.ndim > 1 else 1
        # in parts whose temporaries stay in the cache
        if rotors > 1 and self.moment.size > 2 * BLOCK:
            step = max(1, BLOCK * rotors // self.moment.size)
            parts = [slice(i, i + step) for i in range(0, rotors, step)]
            return np.concatenate(
                [Correction(self.moment[i], self.z[i], self.planes[i]).unbalance for i in parts]
            )
        if self.planes.shape[-1] == 1:
            return -self.static[..., None]
        apart, square = self._distances
        moments = _complex(self._about(self.planes)[0])
        return np.asarray(-np.einsum("...pq,...q->...p", apart, moments) / square[..., None])

    @cached_property
    def _distances(self) -> tuple[Real, Real]:
        """z_p - z_q, and Σ_{q<r} (z_q - z_r)²; once where all rotors share their planes."""
        planes = self.planes
        if planes.size and not any(planes.strides[:-1]):
            planes = planes[(0,) * (planes.ndim - 1)]
        apart = planes[..., :, None] - planes[..., None, :]
        return apart, np.asarray(np.square(apart).sum(axis=(-1, -2)) / 2)

    @cached_property
    def amplification(self) -> Real:
        """The factor by which an error in an unbalance can grow in the corrections, (...); 1 between two planes.

        The largest Σ_p |∂W_p/∂U| over the given unbalances: it grows as the planes approach each other.
        """
        if self.planes.shape[-1] == 1:
            return np.ones(self.static.shape)
        apart, square = self._distances
        # Σ_p |w_p(z)| is convex in z: its largest value lies at the first or the last mass
        loaded = self.moment != 0
        ends = [
            self.z.min(axis=-1, initial=np.inf, where=loaded),
            self.z.max(axis=-1, initial=-np.inf, where=loaded),
        ]
        z = np.stack(ends, axis=-1)
        z = np.where(np.isfinite(z), z, self.planes[..., :1])
        weights = np.einsum("...pq,...kq->...kp", apart, z[..., :, None] - self.planes[..., None, :])
        return np.asarray((np.abs(weights) / square[..., None, None]).sum(axis=-1).max(axis=-1))

    def plot(
        self, names: Sequence[str] = (), planes: Sequence[str] = (), figure: FigureBase | None = None
    ) -> NDArray[np.object_]:
        """Draw the unbalances' shares in each plane, their resultant and the correction to add.

        Parameters
        ----------
        names, planes
            Of the unbalances (k,) and of the planes (p,).
        figure
            Where to draw; None: a new figure of pyplot's.

        Returns
        -------
        array of matplotlib's polar axes, (planes,); of several rotors the first four, (rotors, planes)

        Raises
        ------
        ImportError
            matplotlib (the extra `plot`) is missing.
        """
        from balancing.picture import MOST, KnownMasses, known_masses

        alone = Correction(self.moment[..., None], self.z[..., None], self.planes[..., None, :])
        shares, made = -alone.unbalance, self.unbalance
        (k, p), many = shares.shape[-2:], made.ndim > 1
        flat = zip(shares.reshape(-1, k, p)[:MOST], made.reshape(-1, p)[:MOST], strict=True)
        rotors = [
            KnownMasses(
                str(i + 1) if many else "",
                names or [str(j + 1) for j in range(k)],
                planes or [f"{j + 1}" for j in range(p)],
                1e6 * mine,
                1e6 * w,
            )
            for i, (mine, w) in enumerate(flat)
        ]
        dials = known_masses(rotors, "g·mm", figure=figure)
        return dials if many else dials[0]

    @cached_property
    def residual(self) -> Unbalances:
        """The residual of exact corrections: rounding, and in one plane the couple about it."""
        return self.residual_of(self.unbalance)

    def residual_of(self, unbalance: ArrayLike, about: ArrayLike | None = None) -> Unbalances:
        """Return what corrections as really made (..., p) leave: static, and couple about a plane (default: the first)."""
        made = as_numbers("unbalance", unbalance, complex)
        common_shape(unbalance=made.shape[-1:], planes=self.planes.shape[-1:])
        lead = common_shape(unbalance=made.shape[:-1], rotors=self.static.shape)
        made = np.broadcast_to(made, lead + made.shape[-1:])
        at = np.broadcast_to(self.planes[..., 0] if about is None else np.asarray(about, dtype=float), lead)
        parts = _parts(made)
        lever, lever_error = (term[..., None] for term in two_sum(self.planes, -at[..., None]))
        product, error = two_product(np.broadcast_to(lever, parts.shape), parts)
        static = [term[..., None, :] for term in self._static]
        couple = self._about(at[..., None])
        return Unbalances(
            _complex(exact_sum(_joined([*static, parts]), axis=-2)[0]),
            _complex(exact_sum(_joined([*couple, product, error + lever_error * parts]), axis=-2)[0]),
        )

    def error_estimate(
        self, quantity: str = "unbalance", *, at: ArrayLike | None = None, exact: ExactMasses | None = None
    ) -> Real:
        """Return the rounding error of a result: what it and the same formula in 32 digits differ by.

        Parameters
        ----------
        quantity
            `unbalance` (..., p), `static` (...), `couple` (...) about `at` (default: the first plane), `mass` at the
            radius `at` (..., p), `angle` (..., p; π where it is not known), `residual_static`, `residual_couple` (...).
        at
            The plane of a couple, m, or the radius of masses, m.
        exact
            The unbalances, positions and planes in 32 digits; None: they are the floats.

        Examples
        --------
        >>> fix = correct([0.3, -0.1], z=[0.1, 0.7], planes=[0.0, 0.9])
        >>> bool((fix.error_estimate() < 1e-16).all())
        True
        """
        from balancing.second_run import HIDDEN
        from dalembert.arithmetic.doubled import PI, Doubled
        from dalembert.arithmetic.doubled_arrays import Vectors
        from dalembert.arithmetic.doubled_operations import off

        second = self.exact if exact is None else exact
        if quantity in ("static", "couple"):
            if quantity == "static":
                return np.asarray(second.static.off(self.static) + self._hidden(np.ones(self.z.shape)))
            about = np.broadcast_to(self.planes[..., 0] if at is None else at, self.static.shape)
            true = second.about(Doubled(about[..., None]))[..., 0]
            return np.asarray(true.off(self.couple(about)) + self._hidden(np.abs(self.z - about[..., None])))
        if quantity in ("residual_static", "residual_couple"):
            about = self.planes[..., 0]
            static, couple = second.residual(Vectors.of(self.unbalance), Doubled(about))
            left = HIDDEN * self.amplification * np.abs(self.moment).sum(axis=-1)
            if quantity == "residual_static":
                return np.asarray(static.off(self.residual.static) + left)
            lever = np.abs(self.planes - about[..., None]).max(axis=-1, initial=0.0)
            lever = np.maximum(lever, np.abs(self.z - about[..., None]).max(axis=-1, initial=0.0))
            return np.asarray(couple.off(self.residual.couple) + left * lever)
        true = second.corrections
        bound = true.off(self.unbalance) + HIDDEN * self._terms
        if quantity == "unbalance":
            return bound
        if quantity == "mass":
            if at is None:
                raise ValueError("mass: expected at, the radius")
            radius = np.asarray(at, dtype=float)
            return np.asarray(off(self.mass(radius), true.size / radius) + HIDDEN * self._terms / radius)
        if quantity == "angle":
            turn = off(self.angle, true.angle, PI * 2.0)
            return np.where(bound < np.abs(self.unbalance), turn, np.where(bound > 0, np.pi, 0.0))
        raise ValueError(
            f"'{quantity}': expected unbalance, static, couple, mass, angle, residual_static or residual_couple"
        )

    @property
    def exact(self) -> ExactMasses:
        """The floats as the second run takes them."""
        from balancing.second_run import ExactMasses
        from dalembert.arithmetic.doubled import Doubled
        from dalembert.arithmetic.doubled_arrays import Vectors

        return ExactMasses(Vectors.of(self.moment), Doubled(self.z), Doubled(self.planes))

    def _hidden(self, arms: Real) -> Real:
        """Return the possible error of sums in 32 digits of unbalances times arms (..., k), (...)."""
        from balancing.second_run import HIDDEN

        return np.asarray(HIDDEN * (arms * np.abs(self.moment)).sum(axis=-1))

    @property
    def _terms(self) -> Real:
        """The sizes of what corrections are sums of, (..., p)."""
        if self.planes.shape[-1] == 1:
            return np.asarray(np.abs(self.moment).sum(axis=-1, keepdims=True))
        apart, square = self._distances
        arms = np.abs(self.z[..., None, :] - self.planes[..., None])
        moments = (arms * np.abs(self.moment)[..., None, :]).sum(axis=-1)
        return np.asarray(np.einsum("...pq,...q->...p", np.abs(apart), moments) / square[..., None])

    def mass(self, radius: ArrayLike) -> Real:
        """Return the masses to add at the radius (m) of each plane, (..., p), kg; ValueError where it is not positive."""
        at = spread_to("radius", radius, self.unbalance.shape)
        if not (at > 0).all():
            raise ValueError("the radius must be positive")
        return np.asarray(np.abs(self.unbalance) / at)

    @property
    def angle(self) -> Real:
        """The angles of the corrections to add, (..., p), rad in [0, 2π)."""
        return angle_of(self.unbalance)

    def to_frame(self) -> pd.DataFrame:
        """Return a table with a row per rotor and plane: z_m, unbalance_kg_m, angle_deg."""
        columns = {
            "z_m": self.planes,
            "unbalance_kg_m": np.abs(self.unbalance),
            "angle_deg": np.degrees(self.angle),
        }
        return table(columns, ("rotor", "plane"))

    def __repr__(self) -> str:
        rotors = self.static.size
        many = f"{rotors} rotor{'s' * (rotors != 1)} in {self.planes.shape[-1]} plane(s)"
        return f"<Correction of {many}: unbalance {numbers(self.unbalance)} kg·m>"


def correct(
    moment: ArrayLike,
    z: ArrayLike = 0.0,
    planes: ArrayLike = (0.0,),
    executor: Executor | None = None,
) -> Correction:
    """Find the corrections of rotors with known unbalances.

    Parameters
    ----------
    moment
        Unbalances m·r·e^{iθ}, complex, (..., k), kg·m; leading axes are rotors.
    z
        Their axial positions, (..., k) or broadcastable, m.
    planes
        Axial positions of the correction planes, (p,) or (..., p), m: one plane for static balancing, two for
        dynamic balancing; with more, the corrections of least Σ|W|².
    executor
        Computes parts of the rotors, `PART` each, with the same numbers.

    Returns
    -------
    Correction
        `.unbalance` (..., p) complex, to ADD, kg·m; `.residual`; `.mass(radius)`, `.angle`; `.static`, `.couple(about)`.

    Raises
    ------
    CoincidentPlanes
        All planes of a rotor at one place.
    ValueError
        Not finite, products beyond 1e290, or shapes that do not fit.

    Notes
    -----
    J. A. Riul, Dinâmica das Máquinas II, eqs. (6)-(21); the sums are compensated (`dalembert.arithmetic.exact`).

    Examples
    --------
    Riul's example 2: 9 kg at 30 mm, 60° and 6 kg at 50 mm, 210°, corrected at 20 mm in planes 90 mm apart.

    >>> import numpy as np
    >>> moment = np.array([9 * 0.030, 6 * 0.050]) * np.exp(1j * np.radians([60, 210]))
    >>> fix = correct(moment, z=[0.020, 0.065], planes=[0, 0.090])
    >>> fix.mass(radius=0.020).round(4)
    array([7.1996, 8.3708])
    >>> np.degrees(fix.angle).round(2)
    array([256.82,  19.68])
    """
    u = np.atleast_1d(as_numbers("moment", moment, complex))
    at = as_numbers("z", z)
    p = np.atleast_1d(as_numbers("planes", planes))
    size, far, wide = (float(np.abs(part).max(initial=0.0)) for part in (u.real, at, p))
    size = max(size, float(np.abs(u.imag).max(initial=0.0)))
    if not (isfinite(size) and isfinite(far) and isfinite(wide)):
        raise ValueError("moment, z and planes must be finite")
    if size * max(far, wide, 1.0) > LARGEST or wide * max(far, wide) > LARGEST:
        raise ValueError(f"moment, z and planes are too large: expected products up to {LARGEST:g}")
    shape = common_shape(moment=u.shape, z=at.shape)
    lead = common_shape(rotors=shape[:-1], planes=p.shape[:-1])
    fix = Correction(
        np.broadcast_to(u, lead + shape[-1:]),
        np.broadcast_to(at, lead + shape[-1:]),
        np.broadcast_to(p, lead + p.shape[-1:]),
    )
    if p.shape[-1] > 1:
        together = fix._distances[1] == 0
        if together.any():
            raise CoincidentPlanes(np.broadcast_to(together, lead))
    if executor is not None and fix.moment.ndim == 2:
        rows = (slice(i, i + PART) for i in range(0, len(fix.moment), PART))
        parts = ((fix.moment[i], fix.z[i], fix.planes[i]) for i in rows)
        # what is computed on the first request
        unbalance = np.concatenate(list(in_parts(_unbalance, parts, executor)))
        object.__setattr__(fix, "unbalance", unbalance)
    return fix


def _unbalance(moment: Complex, z: Real, planes: Real) -> Complex:
    return Correction(moment, z, planes).unbalance


def _parts(z: Complex) -> Real:
    return np.stack([z.real, z.imag], axis=-1)


def _complex(parts: Real) -> Complex:
    return np.ascontiguousarray(parts).view(complex)[..., 0]


def _joined(terms: list[Real]) -> Real:
    """Join terms (..., j, 2) along the axis of the sum."""
    lead = np.broadcast_shapes(*(term.shape[:-2] for term in terms))
    return np.concatenate([np.broadcast_to(term, lead + term.shape[-2:]) for term in terms], axis=-2)
