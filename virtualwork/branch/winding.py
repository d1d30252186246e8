"""Angles with their whole turns, counted from the guess: a gear of fractional ratio needs them of what a closed form turns.

The closed form knows the direction e^{iθ} alone. Its turns are counted along the way of the inputs from the guess.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from virtualwork.branch.choice import Along
from virtualwork.describe.description import Description
from virtualwork.formulas.numbers import Number, Reals
from virtualwork.formulas.positions import FAR, NONE, SHORTEST, Samples, State, follow, principal, whole
from virtualwork.plan.steps import Group

# of one turn
NODES = 120


class Winding:
    """The angles of some bodies along the one input."""

    def __init__(self, track: Along) -> None:
        self.track = track
        self._samples: dict[str, Samples] = {}

    def angle(self, body: str, q: Number, angle: Number) -> Number:
        """An angle at inputs q with its whole turns, as far as they are known."""
        found = whole(self._samples.get(body, NONE), q, angle)
        return found if np.ndim(q) else float(found)

    def follow(self, body: str, q: Reals) -> None:
        """Count a body's turns over more inputs."""
        steps = self.track.assembly.needed((f"angle:{body}",))

        def angle(q: Reals) -> Reals:
            st = State([q], many=True)
            self.track.run(steps, st)
            return np.broadcast_to(np.angle(st.turn[body]), q.shape)

        known = self._samples.get(body, NONE)
        self._samples[body] = follow(angle, q, self.track.start, self.track.length, known)


def straight_lines(m: Description, st: State) -> tuple[Reals, Reals, Reals]:
    """From the guess to each pose of a state: the guess's inputs, the ways (n, k), the longest steps as shares of them."""
    n = max(np.size(v) for v in st.inputs)
    at = np.array(m.at)
    way = np.array([np.broadcast_to(np.asarray(v, dtype=float), n) for v in st.inputs]).T - at
    unit = np.array([m.size if e.is_slide else 2 * np.pi for e in m.inputs])
    return at, way, 1 / np.maximum(1.0, np.abs(way / unit).max(axis=1) * NODES)


def wind_along_lines(track: Along, group: Group, st: State, bodies: Collection[str]) -> None:
    """With several inputs: the angles of some bodies of a closed form, every pose on its own line from the guess.

    A pose that is not reached on its line has no number of turns, and is not assembled.
    """
    if not bodies:
        return
    assembly = track.assembly
    case, sign, size = assembly.cases[group.name], assembly.signs[group.name], assembly.mechanism.size
    before = assembly.before(group)
    at, way, longest = straight_lines(assembly.mechanism, st)
    n = len(way)
    start = State(list(assembly.mechanism.at))
    track.run(before, start)
    case.solve(start, sign, size)
    last = {body: np.full(n, start.turn[body], dtype=complex) for body in bodies}
    total = {body: principal(np.angle(last[body])) for body in bodies}
    # of each pose: the share of its way that is gone, and the next step
    gone, step = np.zeros(n), longest.copy()
    reached = np.asarray(np.isfinite(way).all(axis=1))
    with np.errstate(all="ignore"):
        while (left := np.flatnonzero(reached & (gone < 1))).size:
            to = np.minimum(gone[left] + step[left], 1.0)
            trial = State(list((at + to[:, None] * way[left]).T), many=True)
            track.run(before, trial)
            case.solve(trial, sign, size)
            closed = np.broadcast_to(np.asarray(trial.margin[group.name]) >= 0, to.shape)
            turned = {body: np.angle(trial.turn[body] / last[body][left]) for body in bodies}
            divide = np.max([np.broadcast_to(np.abs(v), to.shape) for v in turned.values()], axis=0) > FAR
            divide &= closed & (step[left] > SHORTEST * longest[left])
            reached[left[~closed]] = False
            step[left[divide]] /= 2
            some = closed & ~divide
            on = left[some]
            for body in bodies:
                total[body][on] += np.broadcast_to(turned[body], to.shape)[some]
                last[body][on] = np.broadcast_to(trial.turn[body], to.shape)[some]
            gone[on], step[on] = to[some], np.minimum(2 * step[on], longest[on])
    for body in bodies:
        angle = np.angle(st.turn[body])
        # what no input moves is one number for all poses
        wound = np.broadcast_to(angle + 2 * np.pi * np.round((total[body] - angle) / (2 * np.pi)), n)
        turn, margin = (
            np.where(reached, st.turn[body], np.nan),
            np.where(reached, st.margin[group.name], -1.0),
        )
        st.angle[body] = np.where(reached, wound, np.nan) if st.many else float(wound[0])
        st.turn[body] = turn if st.many else complex(turn[0])
        st.margin[group.name] = margin if st.many else float(margin[0])
