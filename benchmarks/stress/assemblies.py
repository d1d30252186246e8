"""Stress of the limits of the input and of the list of assemblies, by scanning all constraints at once.

A mechanism of any topology is followed in small steps from its guess until it can go no further, and put together from
starts that are drawn at random.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from benchmarks.stress.pairs import Pairs
from benchmarks.stress.topologies import Topology, evaluate, generate, regularity
from benchmarks.stress.topology_followed import END, follow
from virtualwork import Guess
from virtualwork.branch.assembly import Assembly
from virtualwork.formulas.numbers import Reals
from virtualwork.motion import Motion

SCANNED = 1.5  # rad or m, to both sides of the guess
FINEST = 1e-6
STARTS = 60
GRID = 360


def one_input(seed: int) -> Topology | None:
    """A regular mechanism with one input; None where the seed gives another."""
    t = generate(seed)
    return t if len(t.inputs) == 1 and regularity(t) > 1e-3 else None


def wrong_limits(t: Topology) -> list[str]:
    """Limits that the scan meets and the program does not, or the other way round."""
    ends = t.mechanism.check.input_limits or (-math.inf, math.inf)
    start, wrong = t.inputs[0], []
    for side, end in zip((-1.0, 1.0), ends, strict=True):
        way = follow(t, (side,), (SCANNED,), FINEST)
        near = side * (end - start)
        if way.end == "limit" and abs(near - way.reached) > 1e-3:
            wrong.append(
                f"a limit at {side * way.reached:+.6g} from the guess, said to be at {side * near:+.6g}"
            )
        if way.end != "limit" and near < way.reached - 1e-3:
            wrong.append(
                f"no limit at {side * near:+.6g} from the guess: it goes on to {side * way.reached:+.6g}"
            )
    return wrong


def wrong_dead_points(t: Topology) -> list[str]:
    """Dead points that the scan meets and the program does not name, or the other way round, on every range of the branch.

    A pose in the middle of each range that the program puts together is followed to its ends by itself.
    """
    m = t.mechanism
    dead = np.array(m.check.dead_points)
    period = None if m.inputs[0].is_slide else m.assembly.reach.period
    track = m.assembly.track
    # of a slide, as far as the program has looked for them
    q = np.linspace(max(t.inputs[0] - SCANNED, track.low), min(t.inputs[0] + SCANNED, track.high), GRID)
    low, end = -math.inf, math.inf
    if period is not None:
        # ends of other ranges are named in the turns in which the guess's own lies
        low = max((m.check.input_limits or (-math.inf,))[0], t.inputs[0] - period)
        q, end = low + period * (np.arange(GRID) + 0.5) / GRID, low + period
        dead = low + (dead - low + 1e-6) % period - 1e-6
    motion, wrong = m.motion(q), []
    there = np.append(motion.assembled, False)
    first = np.flatnonzero(there & ~np.roll(there, 1))
    last = np.flatnonzero(there & ~np.roll(there, -1))
    for middle in (first + last) // 2:
        pose = placed(t, motion, int(middle))
        start = pose.inputs[0]
        for side in (-1.0, 1.0):
            way = follow(pose, (side,), (SCANNED,), FINEST)
            ahead = side * (dead - start)
            near = float(ahead[ahead > 0].min(initial=math.inf))
            if way.reached > (end - start if side > 0 else start - low) + 1e-3:
                continue
            if way.end == "limit" and abs(near - way.reached) > 1e-3:
                wrong.append(
                    f"a dead point {side * way.reached:+.6g} from {start:.6g}, said to be at {side * near:+.6g}"
                )
            if way.end != "limit" and near < way.reached - 1e-3:
                wrong.append(
                    f"no dead point {side * near:+.6g} from {start:.6g}: it goes on to {side * way.reached:+.6g}"
                )
    return wrong


def placed(t: Topology, motion: Motion, i: int) -> Topology:
    """The mechanism as it stands in pose i of a motion."""
    links = t.mechanism.links
    angles = {body: float(motion.link(body).angle[i]) for body in links}
    origins = {body: complex(motion.at(body, 0j).complex(0)[i]) for body in links}
    guess = Guess(at=float(motion.inputs[i, 0]), angles=angles)
    return Topology(t.seed, replace(t.mechanism, guess=guess), origins, angles)


def settled(t: Topology, x: Reals) -> Reals | None:
    """A pose that closes, by Newton's steps of bounded length from x; None where there is none, or a singular one."""
    for _ in range(40):
        value, jacobian = evaluate(t, x, t.inputs)
        try:
            step = np.linalg.solve(jacobian, value)
        except np.linalg.LinAlgError:
            return None
        longest = float(np.abs(step).max())
        if not math.isfinite(longest):
            return None
        x = x - step * min(1.0, 0.7 / max(longest, 1e-300))
        if longest < 1e-12:
            s = np.linalg.svd(jacobian, compute_uv=False)
            return x if s[-1] > END * s[0] and np.abs(x).max() < 3 else None
    return None


def _stands(t: Topology, x: Reals) -> Reals:
    """A pose as numbers that do not tell whole turns apart."""
    p = x.reshape(-1, 3)
    return np.concatenate([p[:, 0], p[:, 1], np.cos(p[:, 2]), np.sin(p[:, 2])])


def wrong_assemblies(t: Topology, rng: np.random.Generator) -> list[str]:
    """Assemblies at the guess's input that the program lists and are none, or that it does not list."""
    m = t.mechanism
    told = [_pose(t, assembly) for assembly in m.assemblies()]
    wrong = [
        f"assembly {i + 1} leaves {gap:.2g}" for i, x in enumerate(told) if not (gap := _gap(t, x)) < 1e-7
    ]
    known = [_stands(t, x) for x in told]
    for _ in range(STARTS):
        start = rng.uniform(-1, 1, len(t.unknowns()))
        start[2::3] *= math.pi
        x = settled(t, start)
        if x is not None and min(np.abs(_stands(t, x) - k).max() for k in known) > 1e-5:
            wrong.append(f"not listed: {np.round(x[2::3], 4).tolist()}")
            known.append(_stands(t, x))
    return wrong


def _gap(t: Topology, x: Reals) -> float:
    """What the constraints leave; a whole turn of an angle is nothing."""
    gaps = zip(t.kinds, evaluate(t, x, t.inputs)[0], strict=True)
    return float(max(abs(math.remainder(v, 2 * math.pi) if kind == "turn" else v) for kind, v in gaps))


def _pose(t: Topology, assembly: Assembly) -> Reals:
    """x, y, θ of every link in one assembly at the guess's input."""
    motion = Motion(assembly, np.array(t.inputs))
    out = []
    for body in t.mechanism.links:
        origin = complex(motion.at(body, 0j).complex(0)[0])
        out += [origin.real, origin.imag, float(motion.link(body).angle[0])]
    return np.array(out)


def _limits(rng: np.random.Generator) -> Pairs:
    t = one_input(int(rng.integers(1 << 31)))
    return [] if t is None else [(math.inf if wrong_limits(t) else 0.0, 1.0)]


def _assemblies(rng: np.random.Generator) -> Pairs:
    t = one_input(int(rng.integers(1 << 31)))
    # a gear of another tooth is another mechanism, not another assembly
    if t is None or t.mechanism.gears or len(t.mechanism.links) > 4:
        return []
    return [(math.inf if wrong_assemblies(t, rng) else 0.0, 1.0)]


def _dead_points(rng: np.random.Generator) -> Pairs:
    t = one_input(int(rng.integers(1 << 31)))
    return [] if t is None else [(math.inf if wrong_dead_points(t) else 0.0, 1.0)]


CAMPAIGNS = {
    "limits of any topology": ("how far the input goes, against a scan of all constraints", _limits),
    "dead points of any topology": (
        "the ends of every range of a branch, against the same scan",
        _dead_points,
    ),
    "assemblies of any topology": ("every one listed, against Newton from random starts", _assemblies),
}
