"""Following a group with no closed form along the input: tangent prediction, Newton-Raphson correction.

The continuation lays down nodes (unknowns and their rate) once; any pose starts from the cubic between two nodes and is
corrected by Newton-Raphson on all poses together, so that no error accumulates.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from virtualwork.branch.change_point import Along, put
from virtualwork.branch.sampling import chebyshev_nodes, real_roots
from virtualwork.formulas.group_loops import write_unknowns
from virtualwork.formulas.newton import newton, settle, singular
from virtualwork.formulas.numbers import SINGULAR, Number, Reals, solve, stack_rows
from virtualwork.formulas.positions import State
from virtualwork.formulas.rates import Rates
from virtualwork.formulas.winding import NODES
from virtualwork.plan.steps import Group

# of one turn: a step this short has met a limit
FINEST = 1e-7
# of one turn: nodes this near to where they are to end have reached it
SEAM = 2 * FINEST
# of the largest singular value: what is singular but for rounding
UPRIGHT = 1e-9
# the same, but for rounding of drawn coordinates
NEARLY = 1e-4
# rad or sizes of the mechanism for a turn of the input: no guess with slower unknowns stands upright
STEEP = 100.0
# rad, or sizes of the mechanism: how far beside an upright guess its neighbours are looked for
WAYS = (0.1, 0.03, 0.01)


class Continuation:
    """The nodes of one group's branch, from the guess outwards."""

    def __init__(self, track: Along, group: Group) -> None:
        self.track, self.group = track, group
        self.assembly = track.assembly
        self.size = self.assembly.mechanism.size
        self.before = self.assembly.before(group)
        self.loops = self.assembly.loops(group)
        self.ends: list[tuple[float, int]] = []
        self._crossed: list[tuple[float, float]] = []
        self._found: dict[tuple[float, float], float] = {}
        x = np.asarray(self.assembly.starts[group.name], dtype=float)
        q = track.start
        rate, det = self._rate(self._state(q), x)
        self.q, self.x, self.rate, self.det = [q], [x], [rate], [det]
        # as arrays, until more are laid down
        self._nodes: tuple[Reals, Reals, Reals] = (np.empty(0),) * 3
        self.stopped = {1: False, -1: False}
        # the last one that was taken
        self.step = {1: np.inf, -1: np.inf}
        # the input of the guess and its neighbours', where the branch stands upright over it
        self.upright: tuple[float, float, float] | None = None
        self._begin_upright()

    @property
    def nodes(self) -> tuple[Reals, Reals, Reals]:
        """The nodes in the order of their inputs: these, (n,), unknowns and rates, (n, unknowns)."""
        if len(self._nodes[0]) != len(self.q):
            self._nodes = np.array(self.q), np.array(self.x), np.array(self.rate)
        return self._nodes

    def _state(self, q: float) -> State:
        """What the group depends on at one input."""
        return self.track.pose(self.before, (q,))

    def _rate(self, st: State, x: Reals) -> tuple[Reals, float]:
        """dx/dq and the determinant (its sign is the branch) at one pose, of unknowns x (unknowns,)."""
        rates, dets = self._rates(st, x[None])
        return rates[0], float(dets[0])

    def _rates(self, st: State, x: Reals) -> tuple[Reals, Reals]:
        """The same at n poses, (n, unknowns) and (n,), of unknowns x (n, unknowns)."""
        _, jacobian, right = self._linear(st, x)
        rate = solve(jacobian, -right)
        if jacobian.shape[1] == jacobian.shape[2]:
            return rate, np.asarray(np.linalg.det(jacobian))
        det = np.full(len(x), np.nan)
        good = np.isfinite(jacobian).all(axis=(1, 2))
        det[good] = np.prod(np.linalg.svd(jacobian[good], compute_uv=False), axis=1)
        return rate, det

    def _begin_upright(self) -> None:
        """Lay a node to each side of a guess where the branch stands upright: unknowns go as the cube root of the input.

        There the Jacobian is singular, but with the input's own column it is not: along its null vector the loops are
        closed by the unknowns and the input together. Where both sides lie at one side of the input it is a limit.
        """
        q, x = self.q[0], self.x[0]
        unit = np.where(np.arange(len(x)) < len(self.group.angles), 1.0, self.size)
        if np.abs(self.rate[0] / unit).max(initial=0.0) * self.track.length < STEEP:
            return
        _, (jacobian,), (along,) = self._linear(self._state(q), x[None])
        if jacobian.shape[0] != jacobian.shape[1] or not np.isfinite(jacobian).all():
            return
        u, s, vt = np.linalg.svd(jacobian * unit / self.size)
        one = s[-1] <= NEARLY * s[0] and (len(s) == 1 or s[-2] > NEARLY * s[0])
        if not one or abs(u[:, -1] @ along) <= SINGULAR * self.size:
            return
        sides = [self._beside(q, x, way * vt[-1], unit) for way in (1.0, -1.0)]
        starts = sorted((side for side in sides if side is not None), key=lambda side: side[0])
        if len(starts) < 2 or not starts[0][0] < q < starts[1][0]:
            return
        low, high = starts
        beside = [(to, at, *self._rate(self._state(to), at)) for to, at in (low, high)]
        # of coordinates that were rounded: a fold between the two is not stepped over
        if s[-1] > UPRIGHT * s[0] and len({np.sign(det) for *_, det in beside} | {np.sign(self.det[0])}) > 1:
            return
        for place, (to, at, rate, det) in zip((0, 2), beside, strict=True):
            self.q.insert(place, to)
            self.x.insert(place, at)
            self.rate.insert(place, rate)
            self.det.insert(place, det)
        # the rate in the middle is infinite, and its determinant rounding
        self.rate[1], self.det[1] = np.zeros(len(x)), self.det[0]
        self.upright = (low[0], q, high[0])

    def _linear(self, st: State, x: Reals) -> tuple[Reals, Reals, Reals]:
        """The gaps of the loops, their Jacobian, and their change with the input, of unknowns x (n, unknowns)."""
        gap, jacobian = self.loops.over(st)(x)
        try:
            return gap, jacobian, self._moved(st, x)
        except (ZeroDivisionError, OverflowError):
            return gap, jacobian, self._moved(self.track.pose(self.before, st.inputs, singular=True), x)

    def _moved(self, st: State, x: Reals) -> Reals:
        """The change of the loops with the input, (n, 2·loops), of unknowns x (n, unknowns)."""
        write_unknowns(self.group, st, x)
        d = Rates(self.assembly.plan, st, [[1.0]], self.track)
        d.advance(self.before, 1)
        return stack_rows(d.right_side(self.group, 1), len(x))

    def _beside(self, q: float, x: Reals, null: Reals, unit: Reals) -> tuple[float, Reals] | None:
        """Go a way along a null vector, and close the loops there by the unknowns and the input (Newton-Raphson)."""
        for way in WAYS:
            to, at = q, x + way * null * unit
            for _ in range(12):
                (gap,), (jacobian,), (along,) = self._linear(self._state(to), at[None])
                bordered = np.block([[jacobian, along[:, None]], [null / unit, 0.0]])
                rest = np.append(gap, null / unit @ (at - x) - way)
                if not np.isfinite(bordered).all():
                    break
                move = np.linalg.lstsq(bordered, -rest)[0]
                at, to = at + move[:-1], to + float(move[-1])
                if np.abs(move[:-1] / unit).max() <= 1e-13 and np.abs(gap).max() <= 1e-13 * self.size:
                    return to, at
        return None

    def extend(self, a: float, b: float) -> None:
        """Go on until the nodes cover a to b."""
        h = self.track.length / NODES
        while not self.stopped[1] and b + h - self.q[-1] > SEAM * self.track.length:
            self._advance(1, min(h, b + h - self.q[-1]))
        while not self.stopped[-1] and self.q[0] - (a - h) > SEAM * self.track.length:
            self._advance(-1, min(h, self.q[0] - (a - h)))

    def _put(self, side: int, q: float, x: Reals, rate: Reals, det: float) -> None:
        """Lay down a node at one end."""
        place = len(self.q) if side > 0 else 0
        self.q.insert(place, q)
        self.x.insert(place, x)
        self.rate.insert(place, rate)
        self.det.insert(place, det)

    def _advance(self, side: int, h: float) -> None:
        """Lay down one more node, at most h away: what the group depends on is known no farther."""
        end = -1 if side > 0 else 0
        q, x, rate = self.q[end], self.x[end], self.rate[end]
        if not np.isfinite(rate).all():
            self.stopped[side] = True
            return
        step = min(h, 2 * self.step[side])
        crossed: list[tuple[float, float]] = []
        while step > FINEST * self.track.length:
            to = q + side * step
            guess = x + side * step * rate
            st = self._state(to)
            with np.errstate(all="ignore"):
                solution, closed = newton(self.loops, st, guess[None], self.size, limit=8)
            if closed[0]:
                new, det = self._rate(st, solution[0])
                ends = x, solution[0], rate, new
                if np.isfinite(new).all() and fine_steps(self.group, self.size, side * step, *ends):
                    if np.sign(det) != np.sign(self.det[end]):
                        crossed.append((min(q, to), max(q, to)))
                    self._put(side, to, solution[0], new, det)
                    self._crossed += crossed
                    # the last one before the end is short by the end alone
                    if step < h or not step < self.step[side] < np.inf:
                        self.step[side] = step
                    return
            step /= 2
        self.stopped[side] = True
        limit = self._end_before(q, q + 2 * side * step)
        self.ends.append((self._limit(side) if limit is None else limit, -side))

    def singular(self) -> bool:
        """Whether the Jacobian is singular at all nodes."""
        some = np.unique(np.linspace(0, len(self.q) - 1, 24).astype(int))
        q, x, _ = self.nodes
        st = State([q[some]])
        with np.errstate(all="ignore"):
            self.track.run(self.before, st)
        return singular(self.loops.over(st)(x[some])[1])

    @property
    def crossings(self) -> list[float]:
        """The change points met: where the determinant goes through zero and the branch goes on.

        Where it is zero in every pose its sign is noise, and there are none.
        """
        if self.group.name in self.track.folded:
            return []
        for a, b in self._crossed:
            if (a, b) not in self._found:
                centre, half = (a + b) / 2, (b - a) / 2
                nodes = chebyshev_nodes(12)
                x = self.unknowns(centre + half * nodes)
                places = zip((centre + half * nodes).tolist(), x, strict=True)
                det = [self._rate(self._state(q), row)[1] for q, row in places]
                # a pose between the two that does not close: no more is known
                if not np.isfinite(det).all():
                    self._found[a, b] = centre
                    continue
                real = real_roots(np.polynomial.Chebyshev.fit(nodes, det, 10, domain=[-1, 1]), 1.1)
                self._found[a, b] = (
                    centre + half * float(real[np.argmin(np.abs(real))]) if len(real) else centre
                )
        return [self._found[pair] for pair in self._crossed]

    def unknowns(self, q: Reals) -> Reals:
        """The group's unknowns at inputs q, (n, unknowns)."""
        st = State([q])
        with np.errstate(all="ignore"):
            self.track.run(self.before, st)
            self.close(st)
        rows = [st.angle[b] for b in self.group.angles] + [st.slide[g] for g in self.group.slides]
        return np.stack([np.broadcast_to(r, q.shape) for r in rows], axis=1)

    def bridge(self, q: float, order: int) -> Reals:
        """The unknowns' derivative across a removable singularity of the Jacobian: of the polynomial through poses
        on both sides of it (Chebyshev points, so that it holds some 12 digits of a velocity)."""
        half = 0.06 * self.track.length / (2 * np.pi)
        if self.upright is not None and abs(q - self.upright[1]) < half:
            return np.full(len(self.x[0]), np.nan)
        nodes = chebyshev_nodes(14)
        self.extend(q - half, q + half)
        x = self.unknowns(q + half * nodes)
        out = np.full(x.shape[1], np.nan)
        if np.isfinite(x).all():
            for j in range(x.shape[1]):
                fit = np.polynomial.Chebyshev.fit(nodes, x[:, j], 13, domain=[-1, 1])
                out[j] = fit.deriv(order)(0.0) / half**order
        return out

    def bridge_rates(self, q: Number, k: int, x: list[Number], singular: Any) -> None:
        """Replace the unknowns' k-th derivatives at poses where the Jacobian is singular though the branch goes on."""
        for i in np.flatnonzero(singular):
            rate = self.bridge(float(np.atleast_1d(q)[i]), k)
            # close to a limit nothing goes on: what the Jacobian gives is kept
            if np.isfinite(rate).all():
                here = np.arange(np.size(q)) == i if np.ndim(q) else None
                for j in range(len(x)):
                    put(x, j, here, rate[j])

    def _end_before(self, inside: float, beyond: float) -> float | None:
        """The limit between two inputs of what the group depends on, to the last bit; None where that goes on."""
        if self._reaches(beyond):
            return None
        while True:
            middle = (inside + beyond) / 2
            if middle in (inside, beyond):
                return inside
            inside, beyond = (middle, beyond) if self._reaches(middle) else (inside, middle)

    def _reaches(self, q: float) -> bool:
        """Whether all that the group depends on is assembled at an input."""
        return bool(self.loops.stands(self._state(q)))

    def _limit(self, side: int) -> float:
        """The limit itself: det² is smooth in the input there and goes to zero; extrapolated from the last nodes."""
        order = slice(-6, None) if side > 0 else slice(0, 6)
        q, d2 = np.array(self.q[order]), np.array(self.det[order]) ** 2
        near = q[-1] if side > 0 else q[0]
        keep = np.flatnonzero(np.diff(np.concatenate([[np.nan], d2])) != 0)
        q, d2 = q[keep], d2[keep]
        if len(q) < 2:
            return float(near)
        d2 = d2 / np.abs(d2).max()
        # inverse interpolation: q as a polynomial of det², at det² = 0
        total = 0.0
        for i in range(len(q)):
            weight = 1.0
            for j in range(len(q)):
                if j != i:
                    weight *= -d2[j] / (d2[i] - d2[j])
            total += weight * (q[i] - near)
        # where the determinant runs to a pole instead (a slide that runs away) there is nothing to extrapolate
        return float(near + total) if 0 <= side * total <= 16 * self.step[side] else float(near)

    def end(self, side: int) -> float:
        """How far the branch goes to one side, as far as is known."""
        node = self.q[-1] if side > 0 else self.q[0]
        return next((q for q, inside in self.ends if inside == -side), node)

    def in_period(self, q: Reals) -> Reals:
        """Beyond a limit the branch is remembered: a whole turn later or earlier the mechanism stands as before.

        A branch of more than a turn between its limits stands in two ways at some inputs: there it is not.
        """
        if not all(self.stopped.values()) or not self.track.whole or any(map(len, self.track.flips.values())):
            return q
        low, high = self.end(-1), self.end(1)
        if high - low > 2 * np.pi:
            return q
        outside = (q < low) | (q > high)
        turned = low + np.mod(q - low, 2 * np.pi)
        return np.where(outside & (turned <= high), turned, q)

    def close(self, st: State) -> None:
        """Close the group at a state's poses."""
        q = self.in_period(np.atleast_1d(np.asarray(st.inputs[0], dtype=float)))
        nodes, x, rate = self.nodes
        if len(nodes) == 1:
            start = x[0] + np.outer(q - nodes[0], np.nan_to_num(rate[0]))
            inside = np.ones(len(q), dtype=bool)
        else:
            i = np.clip(np.searchsorted(nodes, q) - 1, 0, len(nodes) - 2)
            h = nodes[i + 1] - nodes[i]
            t = ((q - nodes[i]) / h)[:, None]
            low, high = (0.0 if self.stopped[side] else 2 * SEAM * self.track.length for side in (-1, 1))
            inside = (q >= nodes[0] - low) & (q <= nodes[-1] + high)
            start = cubic(h[:, None], t, x[i], x[i + 1], rate[i], rate[i + 1])
        if self.upright is not None:
            low, middle, high = self.upright
            k = int(np.searchsorted(nodes, middle))
            for end, node in ((low, k - 1), (high, k + 1)):
                within = (q - middle) * (end - middle) >= 0
                within &= np.abs(q - middle) <= abs(end - middle)
                share = np.cbrt((q[within] - middle) / (end - middle))[:, None]
                start[within] = x[k] + share * (x[node] - x[k])
        for limit, side in self.ends:
            # between the last node and the limit: x = x_L − 2x′·√((q_L − q_last)(q_L − q)), the fold's own parabola
            end = -1 if side < 0 else 0
            last, left = nodes[end], limit - nodes[end]
            beyond = (np.abs(q - last) > 0) & ((q - last) * left > 0) & ((limit - q) * left >= 0)
            if beyond.any() and left != 0:
                root = np.sqrt(np.maximum((limit - q[beyond]) / left, 0.0))[:, None]
                start[beyond] = x[end] + 2 * rate[end] * left * (1 - root)
                inside |= beyond
        start[~inside] = np.nan
        with np.errstate(all="ignore"):
            solution, closed = newton(self.loops, st, start, self.size)
            if self.group.name in self.track.folded:
                solution = settle(self.loops, st, solution, self.size)
                st.folded.add(self.group.name)
        if self.upright is not None:
            at = np.abs(q - middle) <= FINEST**2 * self.track.length
            solution[at], closed = x[k], closed | at
        solution[~(closed & inside)] = np.nan
        write_unknowns(self.group, st, solution)
        st.margin[self.group.name] = (
            np.where(closed & inside, 1.0, -1.0) if st.many else (1.0 if closed[0] else -1.0)
        )


def fine_steps(group: Group, size: Number, step: Number, x: Reals, to: Reals, rate: Reals, new: Reals) -> Any:
    """Whether steps are short enough, by a group's unknowns and their rates at both ends, (…, unknowns)."""
    # a slide that runs away is measured by itself
    far, moved = np.maximum(np.abs(x), size), to - x
    far[..., : len(group.angles)] = 1.0
    # the cubic's own defect: what the two rates say of the step, against what it was
    defect = np.abs((moved - step * 0.5 * (rate + new)) / far).max(axis=-1)
    change = np.abs(moved / far).max(axis=-1)
    # gears alone may turn a link many times in a step, but evenly
    even = (np.abs(moved - step * rate) <= 1e-9 * far).all(axis=-1)
    return (defect <= 0.05 * np.maximum(change, 1e-6)) & ((change < 0.5) | even)


def cubic(h: Reals, t: Reals, a: Reals, b: Reals, before: Reals, after: Reals) -> Reals:
    """Between a and b, h apart, at a share t of the way: Hermite's cubic, with the rates at both ends."""
    value = a * (1 + 2 * t) * (1 - t) ** 2 + b * t * t * (3 - 2 * t)
    return np.asarray(value + h * (before * t * (1 - t) ** 2 - after * t * t * (1 - t)))
