"""Pages that compute against the program: worked examples and random mechanisms at random dimensions and inputs, by node."""

from __future__ import annotations

import math
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from benchmarks.stress.topologies import generate
from tests.computed_pages import machines
from tests.node import needs_node
from virtualwork import Mechanism
from virtualwork.branch.assembly import Assembly
from virtualwork.computing_page import ORDERS
from virtualwork.describe import MechanismError
from virtualwork.describe.dimensions import changed, dimensions, value
from virtualwork.motion import Motion
from virtualwork.quantities import Component, forces, places

pytestmark = needs_node
EXAMPLES = (
    "andrews/andrews", "belt-drive/belt-drive", "block-on-bar/bar", "cam-valve/cam-valve",
    "doubling-rack/doubling-rack", "rack-lift/rack-lift", "boom/boom", "crank-press/press", "desk-lamp/lamp", "door-closer/door", "engine-start/engine-start", "engine/engine", "falling-four-bar/falling", "grindstone/stone", "sledge/sledge", "five-bar/five-bar",
    "inclined-slider-crank/piston", "jansen/jansen", "klann/klann", "moving-ramp/ramp", "parallelogram/parallelogram",
    "peaucellier/peaucellier", "planetary-gear/planetary", "quick-return/quick-return", "robot-arm/arm",
    "scissors-lift/lift", "scotch-yoke/yoke", "stephenson-six-bar/stephenson", "toggle-clamp/clamp",
    "two-disc-four-bar/four-bar", "watt-six-bar/watt",
)  # fmt: skip


class Tried(NamedTuple):
    """A mechanism's page, what is set on it, and what the program makes of that."""

    name: str
    page: str
    changes: list[dict[str, float]]
    names: list[str]
    kinds: list[tuple[Any, ...]]
    true: list[list[float]]
    conditions: list[float]
    rate: float


def tried(
    name: str, m: Mechanism, rng: np.random.Generator, times: int, width: float, turns: float = 0.0
) -> Tried | None:
    """Some changes of a mechanism, its input up to so many turns away; None where its page replays, or it cannot be put together."""
    try:
        first = Motion(m.assembly, None, 3.0, 1.5)
    except MechanismError:
        return None
    page, of = "", None
    for with_forces in (True, False):
        try:
            page = Motion(m.assembly, m.at if len(m.inputs) == 1 else [m.at], 3.0, 1.5).page(with_forces).html
        except MechanismError:
            continue
        of = with_forces
        if "const tapes" in page:
            break
    if "const tapes" not in page:
        return None
    every = places(m, ORDERS)
    if of:
        every += forces(m, first.dynamics.reactions.pairs)
    named: dict[str, Component] = {}
    for each in every:
        if each.key and not each.less:
            for word in each.names:
                named.setdefault(word, each)
    numbers = [d for d in dimensions(m).values() if d.where[0] != "inputs"]
    changes, true, conditions = [], [], []
    for k in range(times):
        change = {}
        for i in rng.choice(len(numbers), size=min(3, len(numbers)), replace=False) if k else ():
            own = float(np.real(value(m, numbers[i].path)))
            step = own or (0.1 * m.size if numbers[i].kind == "length" else 0.1)
            change[numbers[i].path] = own + width * step * rng.uniform(0 if own == 0 else -1, 1)
        at = [
            float(
                q
                + rng.uniform(-1, 1) * (width * m.size if e.is_slide else 20.0 * width + 2 * math.pi * turns)
            )
            for q, e in zip(m.at, m.inputs, strict=True)
        ]
        changes.append(change | dict(zip([e.name for e in m.inputs], at, strict=True)))
        row, condition = [math.nan] * len(named), 1.0
        try:
            assembly = Assembly.from_guess(changed(m, change))
            motion = Motion(assembly, [at] if len(at) > 1 else at, 3.0, 1.5)
            if multiplied(assembly) > MULTIPLIED:
                # its angle has lost as many digits, which the condition does not count
                changes.pop()
                continue
            if motion.assembled[0]:
                row = [number(motion, each) for each in named.values()]
                condition = float(motion.condition[0])
        except MechanismError:
            pass
        true.append(row)
        conditions.append(condition)
    # a moment is a sum of forces at arms of about a metre: rounding is of their size
    alike = dict.fromkeys(("force", "effort", "newton-euler", "shaking", "moment", "shaking moment"), "load")
    alike |= {"point": "place", "slide": "place"}
    kinds = [(alike.get(each.key.kind, each.key.kind), each.order) for each in named.values()]
    rate = max(3.0 / (m.size if e.is_slide else 1.0) for e in m.inputs)
    return Tried(name, page, changes, list(named), kinds, true, conditions, rate)


# times that a link turns as far as those it is geared to
MULTIPLIED = 1000.0


def multiplied(assembly: Assembly) -> float:
    """How many times as far as the unknowns of its group a link turns at most, by gears whose ratio on an arm is close to 1."""
    shares = (abs(f) for g in assembly.plan.groups for of in g.shares.values() for f in of.values())
    return max(shares, default=1.0)


def regular(m: Mechanism) -> bool:
    """Whether it can be put together, and stands far from a limit in its own pose."""
    try:
        return float(Motion(m.assembly).condition[0]) < 20
    except MechanismError:
        return False


def number(motion: Motion, each: Component) -> float:
    """One quantity of one pose, SI and radians."""
    z = np.ravel(motion.value(each.key))[0]
    x = float(z.imag if each.imaginary else z.real)
    return x % (2 * math.pi) if each.link else x


def faults(every: list[Tried], folder: Path, allowed: float) -> list[str]:
    """Where pages are farther from the program than rounding makes it: 1e-12 of the largest value, or κ times a rounding."""
    answers = machines([t.page for t in every], folder, [t.changes for t in every], [t.names for t in every])
    found = []
    for t, rows in zip(every, answers, strict=True):
        largest: dict[Any, float] = {}
        for row in t.true:
            for kind, x in zip(t.kinds, row, strict=True):
                if math.isfinite(x):
                    largest[kind] = max(largest.get(kind, 0.0), abs(x))
        # where accelerations cancel, the inertia forces round as what they are made of: I ω²/r and m ω² r, of 3 rad/s and 0.1 m
        made_of = {"inertia": 90, "mass": 0.9}
        inertia = max(
            (abs(v) * made_of.get(path.split(".")[-1], 0) for of in t.changes for path, v in of.items()),
            default=0.0,
        )
        # of a link that only rounding turns, what cancels is of the size of the input's own rates
        for kind in (kind for kind in largest if kind[0] == "angle" and kind[1]):
            largest[kind] = max(largest[kind], t.rate ** kind[1])
        for kind in (kind for kind in largest if kind[0] == "load"):
            largest[kind] = max(largest[kind], inertia)
        for change, row, true, condition in zip(t.changes, rows, t.true, t.conditions, strict=True):
            for name, kind, x, y in zip(t.names, t.kinds, map(float, row), true, strict=True):
                if math.isfinite(x) != math.isfinite(y):
                    found.append(f"{t.name} {name} at {change}: page {x}, program {y}")
                    break
                apart = abs(x - y)
                if kind == ("angle", 0):
                    apart = min(apart, 2 * math.pi - apart)
                if apart > (allowed + 4e-14 * condition**2) * largest.get(kind, 0.0) + 1e-30:
                    found.append(f"{t.name} {name} at {change}: page {x}, program {y}, κ {condition:.3g}")
                    break
    return found


def example(name: str) -> Mechanism:
    return Mechanism.from_toml(str(files("cli") / "examples" / f"{name}.toml"))


def test_the_simplest(tmp_path: Path) -> None:
    """A crank alone, and a four-bar in both assemblies: its page stands where the program does."""
    rng = np.random.default_rng(1)
    bar = example("two-disc-four-bar/four-bar")
    every = [tried("four-bar", bar, rng, 3, 0.05), tried("door", example("door-closer/door"), rng, 3, 0.05)]
    assert faults([t for t in every if t is not None], tmp_path, 1e-12) == []


@pytest.mark.slow
def test_worked_examples(tmp_path: Path, first_seed: int) -> None:
    rng = np.random.default_rng(first_seed)
    every = [tried(name, example(name), rng, 4, 0.04) for name in EXAMPLES]
    assert None not in every
    assert faults([t for t in every if t is not None], tmp_path, 1e-12) == []


@pytest.mark.slow
def test_random_mechanisms(tmp_path: Path, first_seed: int) -> None:
    """Away from limits: there a small change takes the guess beyond one, and the program searches anew from many starts."""
    rng, every = np.random.default_rng(first_seed), []
    for seed in range(first_seed, first_seed + 50):
        m = generate(seed).mechanism
        if regular(m):
            every.append(tried(f"topology {seed}", m, rng, 3, 0.003))
    known = [t for t in every if t is not None]
    assert len(known) > 12
    assert faults(known, tmp_path, 1e-12) == []
