"""Pages of mechanisms with friction: forces and friction are exchanged as in the program, and where the joints lock there is no number."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.computed_pages import machines
from tests.node import needs_node
from tests.virtualwork.test_friction_that_does_not_settle import rocker_driven
from virtualwork import Mechanism
from virtualwork.describe.dimensions import changed
from virtualwork.motion import Motion
from virtualwork.quantities import Component, forces

pytestmark = needs_node
# a block of 60 kg pushed along the ground at 2 m/s, with and against a wind of 10 N
BLOCK = """
gravity = [0, -9.81]
[ground]
O = [0, 0]
[links.block]
points = { B = [0, 0] }
mass = 60
[[sliders]]
point = "B"
link = "block"
through = "O"
[input]
slider = "B"
speed = 2
[guess]
at = 0.5
[[friction]]
joint = "B"
coefficient = 0.2
[[forces]]
link = "block"
point = "B"
force = [10, 0]
"""


def test_the_simplest(tmp_path: Path) -> None:
    """0.2·60·9.81 − 10 N forwards, the friction with the wind backwards, and none where it stands."""
    m = Mechanism.from_toml_text(BLOCK)
    page = m.motion([0.5, 1.0], 2.0, 0.0).page(forces=True).html
    assert "const tapes" in page
    friction = 0.2 * 60 * 9.81
    changes = [{}, {"input.speed": -2.0}, {"input.speed": 0.0}, {"friction.1.coefficient": 0.5}]
    (shown,) = machines([page], tmp_path, [changes], [["B.virtual_work_force"]])
    expected = [friction - 10, -friction - 10, -10, 2.5 * friction - 10]
    assert [row[0] for row in shown] == pytest.approx(expected, rel=1e-14)


def forces_of(m: Mechanism, poses: list[float], speed: float) -> tuple[dict[str, Component], Motion]:
    """All forces by their names, and the motion."""
    motion = m.motion(poses, speed, 0.0)
    every: dict[str, Component] = {}
    for each in forces(m, motion.dynamics.reactions.pairs):
        if each.key and not each.less:
            every.setdefault(each.names[0], each)
    return every, motion


def faults(seed: int, folder: Path) -> tuple[list[str], int, int]:
    """Where a page with friction in some pins is not the program, beside the limits too; poses that move, and that lock."""
    m, speed, rng = rocker_driven(seed)
    low, high = m.check.input_limits or (-np.pi, np.pi)
    poses = np.linspace(low, high, 42)[1:-1].tolist()
    wrong, moving, locked = [], 0, 0
    every, first = forces_of(m, poses, speed)
    changes: list[dict[str, float]] = [{}, {"friction.1.coefficient": rng.uniform(0.05, 1)}]
    page = first.page(forces=True).html
    assert "const tapes" in page
    (shown,) = machines([page], folder, [changes], [list(every)], curves=True)
    for rows, change in zip(shown, changes, strict=True):
        _, motion = forces_of(changed(m, change), poses, speed)
        moves = np.isfinite(motion.effort).ravel()
        moving, locked = moving + int(moves.sum()), locked + int((motion.assembled & ~moves).sum())
        right = []
        for each in every.values():
            z = np.ravel(motion.value(each.key))
            right.append(z.imag if each.imaginary else z.real)
        page_has, program = np.array(rows, dtype=float), np.array(right, dtype=float)
        size = np.nanmax(np.abs(program), axis=0, initial=1e-30)
        for name, x, y in zip(every, page_has, program, strict=True):
            if not (np.isfinite(x) == np.isfinite(y)).all():
                wrong.append(f"{seed} {name}: {np.flatnonzero(np.isfinite(x) != np.isfinite(y))}")
            apart = np.abs(x - y) / ((1e-12 + 4e-14 * motion.condition**2) * size)
            if np.nanmax(apart, initial=0.0) > 1:
                wrong.append(f"{seed} {name}: {np.nanmax(apart)}")
    return wrong, moving, locked


@pytest.mark.slow
def test_random_mechanisms(tmp_path: Path, first_seed: int) -> None:
    """Driven by the rocker, in both assemblies: friction that settles, that does not, and that locks."""
    moving = locked = 0
    for seed in (34, *range(first_seed, first_seed + 39)):  # 34 locks
        wrong, here, stuck = faults(seed, tmp_path)
        assert wrong == []
        moving, locked = moving + here, locked + stuck
    assert moving > 1000
    assert locked > 5
