"""Targets of a fit and their results: positions of points, angles of links, travels of slides, an effort."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from virtualwork.branch.assembly import Assembly
from virtualwork.describe.description import Description
from virtualwork.family.design import ROOMS, numbers_of_each
from virtualwork.formulas.dynamics import Dynamics
from virtualwork.formulas.kinematics import Coordinate
from virtualwork.formulas.lanes import Lanes
from virtualwork.formulas.numbers import PARTS, Reals
from virtualwork.formulas.quantity import Quantity

# of the mechanism's size, rad or of the largest effort: how far a pose that cannot be assembled counts as away, at least
AWAY = 10.0


@dataclass(frozen=True, eq=False)
class Target:
    """Target values of points, links and slides at common inputs.

    Attributes
    ----------
    places : mapping of name to array
        `points.H` or `H`: (n, 2) or complex (n,), m; `points.H.y` or `H.y`: one coordinate, (n,), m. `links.rocker`:
        angles (n,), rad, compared modulo 2π. `slides.B`: travels (n,), m. `effort.crank`: the input's torque (n,), N·m,
        or force, N, at the description's own speed and acceleration.
    inputs : array (n,), optional
        Rad or m; without it the input at each row is free, in the order of the rows.
    weights : mapping of name to number, or array (n,)
        A row of weight w counts as if it stood w times; 1 where not given. Lengths are counted in sizes of the
        mechanism, angles in radians, efforts in shares of the largest that is wanted or that there is.

    Examples
    --------
    >>> Target({"links.rocker": [0.1, 0.4]}, inputs=[0.0, 1.0], weights={"links.rocker": 2.0}).places["links.rocker"]
    [0.1, 0.4]
    """

    places: Mapping[str, ArrayLike]
    inputs: ArrayLike | None = None
    weights: Mapping[str, ArrayLike] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Reached:
    """One quantity of a target, and what the fitted mechanism does there.

    Attributes
    ----------
    name : str
    kind : "point", "coordinate", "angle", "slide" or "effort"
    dimension : "length", "angle", or "" of an effort
    inputs : array (n,)
        Rad or m.
    values, target : array (n,)
        x + iy in m of a point, m of a coordinate or a slide, rad of a link's angle, N·m or N of an effort.
    """

    name: str
    kind: str
    dimension: str
    inputs: Reals
    values: NDArray[Any]
    target: NDArray[Any]

    @property
    def label(self) -> str:
        """Its name without the word `points`, `links`, `slides` or `effort`."""
        room, _, of = self.name.partition(".")
        return of if room in ROOMS and of else self.name

    @property
    def distances(self) -> Reals:
        """(n,) m, rad, N·m or N."""
        apart = self.values - self.target
        return np.abs(_round_turn(apart) if self.dimension == "angle" else apart)

    @property
    def rms(self) -> float:
        """Root of the mean square of the distances, m or rad."""
        return float(np.sqrt(np.mean(self.distances**2)))

    @property
    def max(self) -> float:
        """The largest distance, m or rad."""
        return float(self.distances.max())


@dataclass(frozen=True, eq=False)
class Aim:
    """A target read: the request to a design, and how far its answer is from what is wanted.

    Attributes
    ----------
    keys : tuple
        The numbers of all quantities, one a row: x and y of a point are two.
    counts : dict of name to int
        The number of rows of each quantity.
    wanted : array (rows, n)
    scale : array (rows, n)
        Roots of the weights, over the size for lengths.
    angle : array (rows, 1) of bool
    inputs : array (n,) or None
    away : array (rows, n)
        The weighted distance that a pose that cannot be assembled counts as.
    """

    keys: tuple[Quantity, ...]
    counts: Mapping[str, int]
    wanted: Reals
    scale: Reals
    angle: NDArray[np.bool_]
    inputs: Reals | None
    away: Reals

    @classmethod
    def read(cls, m: Description, target: Target) -> Aim:
        """A target, checked.

        Raises
        ------
        DescriptionError
            A name that is not there.
        ValueError
            Fewer than two rows, rows that do not go together, numbers that are not finite, a weight below 0.
        """
        keys = numbers_of_each(m, target.places)
        every = [key for of in keys.values() for key in of]
        if not keys:
            raise ValueError("target: expected a point, a link or a slide")
        wanted, scale, away = [], [], []
        n = None
        for name, of in keys.items():
            rows, key = _rows(name, len(of) == 2, target.places[name], n), of[0]
            n = rows.shape[1]
            weight = np.asarray(target.weights.get(name, 1.0), dtype=float)
            if weight.shape not in ((), (n,)) or not (np.isfinite(weight) & (weight >= 0)).all():
                raise ValueError(f"weights of {name}: expected one number, or {n}, 0 or more")
            wanted.append(rows)
            unit = 1.0 if key.is_angle else 1.0 / m.size
            if key.is_force:
                unit = 1.0 / _largest(m, rows, target.inputs)
            scale.append(np.broadcast_to(np.sqrt(weight) * unit, rows.shape))
            # farther than any pose that can be: a target may lie far from the mechanism
            far = AWAY if key.dimension != "length" else max(AWAY, 2 * unit * _distance(m, of, rows))
            away.append(np.broadcast_to(far * np.sqrt(np.where(weight > 0, weight, 1.0)), rows.shape))
        strange = [name for name in target.weights if name not in keys]
        if strange:
            raise ValueError(f"weights: '{strange[0]}' is not in the target")
        q = None if target.inputs is None else np.asarray(target.inputs, dtype=float)
        if q is not None and (q.shape != (n,) or not np.isfinite(q).all()):
            raise ValueError(f"inputs: expected {n} finite numbers, one for each row of the target")
        flags = np.array([key.is_angle for key in every])[:, None]
        whole, scales, lost = (np.vstack(each) for each in (wanted, scale, away))
        counts = {name: len(of) for name, of in keys.items()}
        return cls(tuple(every), counts, whole, scales, flags, q, lost)

    def __len__(self) -> int:
        return int(self.wanted.shape[1])

    def apart(self, reached: Reals) -> Reals:
        """Return the weighted distance, (rows, ..., n): lengths in sizes of the mechanism, angles in rad."""
        return self._off(reached, self.wanted, self.scale)

    def counted(self, reached: Reals) -> Reals:
        """Return the same of (rows, n), with what counts for poses that cannot be assembled."""
        off = self.apart(reached)
        return np.where(np.isfinite(off), off, self.away)

    def cost(self, reached: Reals) -> Reals:
        """Σ (weighted distance)² of each pose of (rows, ..., n), (..., n)."""
        return self._cost(self.apart(reached))

    def from_each(self, reached: Reals) -> Reals:
        """Σ (weighted distance)² of every pose of (rows, ..., poses) from every row of the target, (..., poses, n)."""
        return self._cost(self._off(reached[..., None], self.wanted[:, None, :], self.scale[:, None, :]))

    @property
    def lost(self) -> Reals:
        """What each row costs whose pose cannot be assembled, (n,)."""
        return np.asarray((self.away**2).max(axis=0))

    def _cost(self, off: Reals) -> Reals:
        squared = (off**2).sum(axis=0)
        return np.where(np.isfinite(squared), squared, self.lost)

    def _off(self, values: Reals, wanted: Reals, scale: Reals) -> Reals:
        def beside(each: NDArray[Any]) -> NDArray[Any]:
            return each.reshape(len(each), *(1,) * (values.ndim - each.ndim), *each.shape[1:])

        apart = values - beside(wanted)
        if self.angle.any():
            apart = np.where(beside(self.angle), _round_turn(apart), apart)
        return np.asarray(apart * beside(scale))

    def reached(self, rows: Reals, inputs: Reals) -> tuple[Reached, ...]:
        """Return the quantities of a design, (rows, n)."""
        out, row = [], 0
        for name, count in self.counts.items():
            key, kind = self.keys[row], "point" if count == 2 else self.keys[row].kind
            values, target = (
                each[row] + 1j * each[row + 1] if count == 2 else each[row] for each in (rows, self.wanted)
            )
            out.append(Reached(name, kind, key.dimension, inputs, values, target))
            row += count
        return tuple(out)


def _distance(m: Description, keys: Sequence[Quantity], wanted: Reals) -> float:
    """How far a target of lengths goes from the middle of the ground's points, or from the beginning of a guide, m."""
    middle = np.array(list(m.ground.values()) or [0j]).mean()
    begins = [PARTS[key.axis](middle) if isinstance(key, Coordinate) else 0.0 for key in keys]
    return float(np.abs(wanted - np.array(begins)[:, None]).max())


def _largest(m: Description, wanted: Reals, inputs: ArrayLike | None) -> float:
    """The largest effort that is wanted; where none is, the largest that the description has, over a turn or at the inputs."""
    largest = float(np.abs(wanted).max())
    if largest:
        return largest
    span = 2 * np.pi if m.inputs[0].link is not None else m.size
    q = m.at[0] + span * np.arange(24) / 24 if inputs is None else np.asarray(inputs, dtype=float)
    own = Dynamics(Lanes(Assembly.from_guess(m), q, None, None)).effort
    there = np.abs(own[np.isfinite(own)])
    if not there.size or not there.max():
        raise ValueError(
            "target: no effort is wanted, and there is none: expected a load, or an effort other than 0"
        )
    return float(there.max())


def _rows(name: str, is_point: bool, table: ArrayLike, n: int | None) -> Reals:
    """The numbers of one quantity, (1 or 2, n)."""
    result = np.asarray(table)
    if is_point:
        if np.iscomplexobj(result):
            result = np.stack([result.real, result.imag], axis=-1)
        result = np.asarray(result, dtype=float)
        if result.ndim != 2 or result.shape[1] != 2:
            raise ValueError(f"target of {name}: expected shape (n, 2), found {result.shape}")
        result = result.T
    else:
        result = np.asarray(result, dtype=float)
        if result.ndim != 1:
            raise ValueError(f"target of {name}: expected shape (n,), found {result.shape}")
        result = result[None]
    count = result.shape[1]
    if count < 2:
        raise ValueError(f"target of {name}: found {count} point, expected two or more")
    if n is not None and count != n:
        raise ValueError(f"target of {name}: found {count} rows, and {n} of the one before it")
    if not np.isfinite(result).all():
        raise ValueError(f"target of {name}: expected finite numbers")
    return result


def _round_turn(angle: Reals) -> Reals:
    """Within half a turn of 0."""
    return angle - 2 * np.pi * np.round(angle / (2 * np.pi))
