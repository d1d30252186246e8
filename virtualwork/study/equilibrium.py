"""Where a mechanism rests under its loads without effort, and whether it stays there.

At rest the effort is τ_j = −Q_j with the generalized force Q_j = Σ F·K_j + Σ T κ_j (Riul, unit II, eq. 3). A position
with Q = 0 is an equilibrium; it is stable where the second variation of the potential is positive (Lagrange and
Dirichlet), V″ = −∂Q/∂q. The derivative is exact: ∂Q/∂q needs the second-order coefficients L = ∂²P/∂q², and no
difference of neighbouring positions.

About a stable position the mechanism swings with M q̈ + V″ q = 0, M the generalized mass: its periods are 2π √μ with
V″ a μ = M a (Meriam & Kraige, Dynamics, §8/5; Lagrange).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from virtualwork.branch.assembly import Assembly
from virtualwork.digits.balance import Balance
from virtualwork.formulas.newton import bracketed
from virtualwork.formulas.numbers import EPS, Reals, real_array
from virtualwork.study.loads_at_rest import AROUND, Rest, goes_round, turns_of_loads, usual

SAMPLES = 1440
# of a turn: a range in which the loads' usual work cannot be seen
NARROW = 0.1
# halvings of the way from the last sample to a limit, and how far behind the limit a range ends, of a turn
NEARER, BEHIND = 30, 1e-9


@dataclass(frozen=True)
class Equilibrium:
    """A position of rest: inputs, stability, stiffness and potential.

    `inputs` are the inputs, rad or m; `stable` is None where the second variation does not decide; `stiffness` is
    V″ (the smallest eigenvalue for several inputs); `potential` is V, J, None under loads that have none.
    """

    inputs: tuple[float, ...]
    stable: bool | None
    stiffness: float
    potential: float | None
    assembly: Assembly | None = field(default=None, repr=False, compare=False)

    @cached_property
    def periods(self) -> tuple[float, ...]:
        """The periods of small oscillations about it, s, the longest first; none where it is not stable.

        Without dampers and friction. Parts that have no mass do not swing: where nothing that moves has any there is
        no period.

        Examples
        --------
        A rod of 1 m on a pin at its end, √(2 l / 3 g) · 2π:

        >>> from virtualwork import Input, Link, Mechanism
        >>> rod = Mechanism({"O": 0j}, {"rod": Link({"O": 0j}, mass=2, center=0.5, inertia=2 / 12)},
        ...                 inputs=Input(link="rod"), gravity=-9.81j)
        >>> [e.periods for e in equilibria(rod.assembly).found] == [(), (2 * np.pi * np.sqrt(2 / 3 / 9.81),)]
        True
        """
        values, _ = self._oscillations
        # what has no mass, to rounding, has no period
        swings = values > len(values) * EPS * np.abs(values).max(initial=0.0)
        return tuple((2 * np.pi * np.sqrt(values[swings])).tolist())

    @cached_property
    def _oscillations(self) -> tuple[Reals, Reals]:
        """The μ of V″ a μ = M a, the largest first, and the a in columns."""
        if not self.stable:
            return np.empty(0), np.empty((len(self.inputs), 0))
        mass, stiffness = self._rest.mass()[0], self._stiffness
        if len(mass) == 1:
            return mass[0] / stiffness[0], np.ones((1, 1))
        from scipy.linalg import eigh

        values, vectors = eigh(mass, stiffness)
        return values[::-1], vectors[:, ::-1]

    def __getstate__(self) -> dict[str, Any]:
        """What is pickled: without the poses, which have a lock."""
        return {name: value for name, value in vars(self).items() if name not in ("_rest", "_balance")}

    @cached_property
    def _rest(self) -> Rest:
        assert self.assembly is not None
        return Rest(self.assembly, np.array([self.inputs]))

    @cached_property
    def _stiffness(self) -> Reals:
        """V″, (k, k)."""
        return np.asarray(self._rest.hessian()[0])

    @property
    def period(self) -> float | None:
        """The period of small oscillations about it, s, with several inputs the longest; None where there is none."""
        return self.periods[0] if self.periods else None

    @cached_property
    def _balance(self) -> Balance:
        """The position of rest in 32 digits."""
        return Balance(self._rest.poses, self._stiffness)

    def error_estimate(self, of: str = "inputs") -> tuple[float, ...]:
        """Return an estimate of the rounding error of a quantity: how far it lies from that of the position of rest in 32 digits.

        Infinite where the second variation vanishes. A file's decimals are exact in the second run, numbers given as floats as given.

        Parameters
        ----------
        of
            "inputs", rad or m; "periods", s; "potential", J, or "stiffness": one number, none where there is no potential.

        Examples
        --------
        >>> from virtualwork import Input, Link, Mechanism
        >>> pendulum = Mechanism({"O": 0j}, {"bob": Link({"O": 0j}, mass=2, center=0.5)}, inputs=Input(link="bob"),
        ...                      gravity=-9.81j)
        >>> down = equilibria(pendulum.assembly).found[1]
        >>> abs(down.inputs[0] - 1.5 * np.pi) < down.error_estimate()[0] < 1e-14
        True
        >>> abs(down.period - 2 * np.pi * np.sqrt(0.5 / 9.81)) < 2 * down.error_estimate("periods")[0] < 1e-14
        True
        """
        if of == "inputs":
            return tuple(self._balance.input_errors.tolist())
        if of == "potential":
            return () if self.potential is None else (self._balance.potential_error(self.potential),)
        if of == "stiffness":
            return (self._balance.stiffness_error(self.stiffness, self._stiffness),)
        if of == "periods":
            errors = self._balance.period_errors(np.array(self.periods), self._oscillations[1])
            return tuple(errors.tolist())
        raise ValueError(f"{of}: expected inputs, potential, stiffness or periods")


@dataclass(frozen=True)
class Equilibria:
    """All positions of rest of a mechanism in a range of its inputs.

    `everywhere`: the loads balance in every position of the range. `region`: with several inputs, positions of rest
    fill a part of the range and are not listed. `loaded`: something acts at rest.

    Attributes
    ----------
    turns : tuple of int or None
        After how many turns of each input the loads repeat; None where they never do, and of a slide.
    ranges : tuple of (float, float)
        What was searched of each input, rad or m.
    """

    found: tuple[Equilibrium, ...]
    everywhere: bool = False
    region: bool = False
    loaded: bool = True
    turns: tuple[int | None, ...] = ()
    ranges: tuple[tuple[float, float], ...] = ()

    def __repr__(self) -> str:
        if self.everywhere or self.region:
            return f"Equilibria({'everywhere' if self.everywhere else 'a region'})"
        words = {True: "stable", False: "unstable", None: "undecided"}
        return f"Equilibria({', '.join(f'{e.inputs[0]:g} {words[e.stable]}' for e in self.found) or 'none'})"


def equilibria(assembly: Assembly, spans: ArrayLike | None = None, samples: int = SAMPLES) -> Equilibria:
    """Return every position in which a mechanism rests under its loads without effort, each stable or not.

    Parameters
    ----------
    assembly : Description
        With its gravity, constant and follower forces, torques, springs. Dampers and friction do not act at rest.
    spans : array (k, 2), optional
        The range of each input, rad or m; it may be one position. Default, also of an input whose row is NaN: from 0 on
        as many turns as the loads need to repeat. Where they never repeat (turns wind up a torsion spring), a turn either
        way of the guess; of a slide two sizes of the mechanism either way, where its loops are no farther from their
        ends. With torsion springs, and where the loads never repeat, one input with limits is searched between them.
    samples : int
        How finely a turn of one input, or a shorter range, is looked through for sign changes, more finely where a body turns
        faster; every root is then exact to rounding.

    Returns
    -------
    Equilibria

    Raises
    ------
    ValueError
        Ranges of another shape, or whose ends change places; no samples.
    AssemblyError
        The mechanism cannot be assembled anywhere in the range.

    Examples
    --------
    A pendulum hangs stably and stands unstably.

    >>> from virtualwork import Input, Link, Mechanism
    >>> pendulum = Mechanism({"O": 0j}, {"bob": Link({"O": 0j}, mass=2, center=0.5)}, inputs=Input(link="bob"),
    ...                      gravity=-9.81j)
    >>> [(round(float(np.degrees(e.inputs[0]))), e.stable) for e in equilibria(pendulum.assembly).found]
    [(90, False), (270, True)]
    """
    k = len(assembly.mechanism.inputs)
    ends = np.full((k, 2), np.nan) if spans is None else real_array("spans", spans)
    if ends.size != 2 * k or ends.ndim > 2:
        raise ValueError(f"spans: expected shape ({k}, 2), a range of each input, found {ends.shape}")
    for low, high in (ends := ends.reshape(k, 2)).tolist():
        if not (0 <= high - low < math.inf or (math.isnan(low) and math.isnan(high))):
            raise ValueError(f"spans: found {low:g} to {high:g}, expected the lower and the higher end")
    if not samples >= 1:
        raise ValueError(f"samples: found {samples}, expected one or more")
    limited = np.asarray(~np.isnan(ends).any(axis=1))
    # at a limit, and beyond it, a loop has no rates
    with np.errstate(all="ignore"):
        turns, ranges = _searched(assembly)
        ranges = np.where(limited[:, None], ends, ranges)
        if k == 1:
            result = _one(assembly, ranges[0], samples, turns[0])
        else:
            result = _many(assembly, ranges, limited, turns)
    return replace(result, turns=turns, ranges=tuple((float(low), float(high)) for low, high in ranges))


def _searched(assembly: Assembly) -> tuple[tuple[int | None, ...], Reals]:
    """After how many turns of each input the loads repeat, and the range that is searched of each, (k, 2)."""
    m, at, turn = assembly.mechanism, np.asarray(assembly.mechanism.at, dtype=float), 2 * np.pi
    one = len(at) == 1
    turns = [None if entry.is_slide else turns_of_loads(assembly, j) for j, entry in enumerate(m.inputs)]
    limits = np.array([-np.inf, np.inf])
    if one and (m.torsion_springs or not (turns[0] or m.inputs[0].is_slide)):
        # beyond them no way leads from the guess, along which turns would be counted
        # at a limit itself rounding has the sign of the force: the range ends just behind it
        limits = np.array(assembly.reach.range) + BEHIND * assembly.track.length * np.array([-1.0, 1.0])
        turns = [None] if np.isfinite(limits).any() else turns
    ranges = np.stack([at, at], axis=1)
    for j, (entry, n) in enumerate(zip(m.inputs, turns, strict=True)):
        if n:
            ranges[j] = 0.0, turn * n
        elif entry.is_slide:
            ranges[j] += np.array([-2.0, 2.0]) * (assembly.track.length if one else m.size)
        else:
            ranges[j] += np.array([-turn, turn]) / (1 if one or goes_round(assembly, j) else 2)
    return tuple(turns), np.where(np.isfinite(limits), limits, ranges)


def _one(assembly: Assembly, span: Reals, samples: int, turns: int | None) -> Equilibria:
    width, period = float(span[1] - span[0]), 2 * np.pi * (turns or np.inf)
    if not assembly.mechanism.inputs[0].is_slide:
        samples *= max(1, math.ceil(width / (2 * np.pi)))
    q = assembly.track.samples(float(span[0]), float(span[1]), samples)
    rest = Rest(assembly, q[:, None])
    force, size = (values[:, 0] for values in rest.force())
    good = np.isfinite(force)
    if not good.any():
        if not rest.poses.assembled.any():
            raise assembly.reach.nowhere(" of the range")
        return Equilibria(())
    # beside a limit the loads' work grows without bound: that is no measure of it elsewhere
    largest, scale = float(size[good].max()), usual(size[good])
    turn = assembly.track.length
    if width < NARROW * turn:
        # nor is it about a position of rest, where all terms may vanish
        beside = q.mean() + turn * np.linspace(-0.5, 0.5, AROUND + 1)
        scale = max(scale, usual(Rest(assembly, beside[:, None]).force()[1][:, 0]))
    if len(q) > 1 and _vanishes(assembly, force[good], largest, scale):
        return Equilibria((), everywhere=True, loaded=scale > 0)
    ends = _towards_limits(assembly, q, good)
    if len(ends):
        q = np.sort(np.concatenate([q, ends]))
        rest = Rest(assembly, q[:, None])
        force, size = (values[:, 0] for values in rest.force())
        good = np.isfinite(force)
    slope = rest.slope()
    # what the rounding of the terms, or of the input itself, makes of zero: the end of a range may be a root
    shift = 2 * EPS * np.abs(q * np.where(np.isfinite(slope), slope, 0.0))
    tiny = np.abs(force) <= 64 * EPS * size + shift
    sign = np.where(tiny, 0.0, np.sign(force))
    rests = tiny & good
    if assembly.mechanism.cams:
        # of a dwell, in which every position is one of rest, its ends
        rests[1:-1] &= ~(rests[:-2] & rests[2:])
    roots = list(q[rests])
    here = np.flatnonzero(good[:-1] & good[1:] & (sign[:-1] * sign[1:] < 0))
    if len(here):
        roots += list(_refine(assembly, q[here], q[here + 1], force[here], force[here + 1]))
    # a root that the force only touches: its derivative changes sign where it is small
    touch = np.flatnonzero(good[:-1] & good[1:] & (sign[:-1] * sign[1:] > 0) & (slope[:-1] * slope[1:] < 0))
    touch = touch[np.minimum(np.abs(force[touch]), np.abs(force[touch + 1])) < 1e-4 * largest]
    if len(touch):
        flat = _refine(assembly, q[touch], q[touch + 1], slope[touch], slope[touch + 1], order=1)
        value, around = (v[:, 0] for v in Rest(assembly, flat[:, None]).force())
        double = np.abs(value) <= 1e-13 * np.maximum(around, scale)
        roots += list(flat[double])
        # or that it crosses twice between two samples
        twice = ~double & (np.sign(value) == -sign[touch])
        if twice.any():
            low, middle, high = q[touch][twice], flat[twice], q[touch + 1][twice]
            roots += list(_refine(assembly, low, middle, force[touch][twice], value[twice]))
            roots += list(_refine(assembly, middle, high, value[twice], force[touch + 1][twice]))
    unit = 1.0 if not assembly.mechanism.inputs[0].is_slide else assembly.track.length
    distinct: list[float] = []
    for root in sorted(roots):
        if all(abs(math.remainder(root - other, period)) > 1e-8 * unit for other in distinct):
            distinct.append(root)
    return _judged(assembly, np.array(distinct)[:, None], scale)


def _vanishes(assembly: Assembly, force: Reals, largest: float, scale: float) -> bool:
    """Whether Q vanishes everywhere: it is analytic, and does where it does on half of the samples; but for a cam's dwells."""
    middle, size = (np.max, largest) if assembly.mechanism.cams else (np.median, scale)
    return not middle(np.abs(force)) > 1e-12 * size


def _towards_limits(assembly: Assembly, q: Reals, good: NDArray[np.bool_]) -> Reals:
    """Inputs ever nearer to where the mechanism ends: the force grows there like 1/√distance, and may change its sign."""
    gap = np.flatnonzero(good[:-1] != good[1:])
    result: list[Reals] = []
    if len(gap):
        inside, outside = np.where(good[gap], q[gap], q[gap + 1]), np.where(good[gap], q[gap + 1], q[gap])
        for _ in range(NEARER):
            middle = (inside + outside) / 2
            ok = np.isfinite(Rest(assembly, middle[:, None]).force()[0][:, 0])
            result.append(middle[ok])
            inside, outside = np.where(ok, middle, inside), np.where(ok, outside, middle)
    return np.concatenate(result) if result else np.empty(0)


def _refine(
    assembly: Assembly, low: Reals, high: Reals, at_low: Reals, at_high: Reals, order: int = 0
) -> Reals:
    """Roots of Q (order 0) or of ∂Q/∂q (order 1) in brackets, all at once, from the chord on."""

    def at(x: Reals) -> tuple[Reals, Reals | None]:
        rest = Rest(assembly, x[:, None])
        return (rest.slope(), None) if order else (rest.force()[0][:, 0], rest.slope())

    chord = low + (high - low) * (at_low / (at_low - at_high))
    return bracketed(at, low, high, np.sign(at_low), chord)


def _judged(assembly: Assembly, inputs: Reals, scale: float) -> Equilibria:
    """Stability and potential of positions; those that are none (a pole between two signs) are dropped."""
    if not len(inputs):
        return Equilibria(())
    rest = Rest(assembly, inputs)
    force, size = rest.force()
    hessian, potential = rest.hessian(), rest.potential()
    # what the input's own last digits make of zero, far from where it is measured from
    shift = np.einsum("nij,nj->ni", np.abs(np.nan_to_num(hessian)), 4 * EPS * np.abs(inputs))
    small = np.maximum(1e-8 * np.maximum(size, 1e-3 * scale), np.minimum(shift, 1e-3 * scale))
    true = (np.abs(force) <= small).all(axis=1)
    result = []
    for i in np.flatnonzero(true):
        low = float(np.linalg.eigvalsh(hessian[i])[0])
        least = 1e-9 * max(float(np.abs(hessian[i]).max()), scale)
        result.append(
            Equilibrium(
                tuple(float(v) for v in inputs[i]),
                None if abs(low) <= least else low > 0,
                low,
                float(potential[i]) if np.isfinite(potential[i]) else None,
                assembly,
            )
        )
    return Equilibria(tuple(result))


def _many(
    assembly: Assembly, ranges: Reals, limited: NDArray[np.bool_], turns: tuple[int | None, ...]
) -> Equilibria:
    """Several inputs: Newton on Q from a grid of starts, all at once; of a `limited` input only what lies in its range."""
    k = len(ranges)
    per = max(4, round(4000 ** (1 / k)))
    per = min(per, 40)
    axes = [
        np.linspace(low, high, per, endpoint=False) + (high - low) / (2 * per) if low < high else [low]
        for low, high in ranges
    ]
    x = np.array(list(product(*axes)))
    rest = Rest(assembly, x)
    force, size = rest.force()
    good = np.isfinite(force).all(axis=1)
    if not good.any():
        if not rest.poses.assembled.any():
            raise assembly.reach.nowhere(" of the range")
        return Equilibria(())
    x = x[good]
    largest, scale = float(size[good].max()), usual(size[good])
    if _vanishes(assembly, force[good], largest, scale):
        return Equilibria((), everywhere=True, loaded=scale > 0)
    # the most promising starts: where no neighbour is nearer to balance would do; a few hundred suffice
    x = x[np.argsort(np.abs(force[good]).max(axis=1))[:400]]
    turning = np.array([not e.is_slide for e in assembly.mechanism.inputs])
    unit = np.where(turning, 1.0, assembly.mechanism.size)
    width = ranges[:, 1] - ranges[:, 0]
    reach = np.where(width > 0, width / per, 0.1 * unit)
    for _ in range(60):
        rest = Rest(assembly, x)
        force, _ = rest.force()
        stiff = rest.hessian()
        keep = np.isfinite(force).all(axis=1) & np.isfinite(stiff).all(axis=(1, 2))
        x, force, stiff = x[keep], force[keep], stiff[keep]
        if not len(x):
            return Equilibria(())
        step = np.stack([np.linalg.lstsq(h, f, rcond=1e-12)[0] for h, f in zip(stiff, force, strict=True)])
        step *= np.minimum(1.0, 1.0 / np.maximum(np.abs(step / reach).max(axis=1), 1e-300))[:, None]
        x = x + step
        if (np.abs(step) <= 4 * EPS * np.maximum(np.abs(x), reach)).all():
            break
    force, size = Rest(assembly, x).force()
    settled = (np.abs(force) <= 1e-10 * np.maximum(size, 1e-3 * scale)).all(axis=1)
    x = x[settled]
    again = np.array([bool(n) for n in turns])
    period = np.array([2 * np.pi * (n or 1) for n in turns])
    x = np.where(again, np.mod(x, period), x)
    x = np.where(again & (period - x < 1e-9), 0.0, x)
    # Newton's steps lead out of the range too; an angle lies in it up to whole periods
    slack = 1e-9 * unit
    off = x - ranges[:, 0] + slack
    off = np.where(again, np.mod(off, period), off)
    within = (off >= 0) & (off <= width + 2 * slack)
    x = x[(within | ~(limited | (turning & ~again))).all(axis=1)]
    distinct: list[Any] = []
    for row in x[np.lexsort(np.round(x / unit, 7).T[::-1])] if len(x) else []:
        gaps = [(row - other) / unit for other in distinct]
        gaps = [np.abs(np.where(again, gap - period * np.round(gap / period), gap)) for gap in gaps]
        if not any((gap < 1e-6).all() for gap in gaps):
            distinct.append(row)
    judged = _judged(assembly, np.array(distinct).reshape(-1, k), scale)
    undecided = sum(e.stable is None for e in judged.found)
    # isolated equilibria are few; dozens that no second variation tells apart are points of a continuum
    return Equilibria((), region=True) if undecided > 32 else judged
