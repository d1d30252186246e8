"""The flywheel of a mechanism's cycle and that of a table of torque are the same calculation.

`virtualwork.study.cycle` integrates the effort of a motion, `balancing.flywheel` the torque of a table. A crank with its
centre of mass off its pivot needs the torque m g r cos θ: both have to find ΔE = 2 m g r, and the same moment of inertia.
"""

from __future__ import annotations

import numpy as np
import pytest

from balancing import torque_cycle
from cli.examples import EXAMPLES
from virtualwork import Mechanism
from virtualwork.study.cycle import Cycle

CRANK = """
gravity = [0, -9.81]
[ground]
A = [0, 0]
[links.crank]
points = { A = [0, 0], B = [0.2, 0] }
mass = 3.0
center = [0.1, 0]
[input]
link = "crank"
angle = "0 deg"
speed = "20 rad/s"
"""


def both(m: Mechanism) -> tuple[Cycle, float, float]:
    """The cycle of a whole turn, and work and fluctuation of energy of a table of its effort."""
    angles = np.linspace(0.0, 2 * np.pi, 14401)
    motion = m.motion(angles)
    table = torque_cycle(angles, motion.effort[:, 0] if motion.effort.ndim == 2 else motion.effort)
    return Cycle(motion).refined(), table.fluctuation, table.inertia(float(m.inputs[0].speed or 0.0), 0.02)


def test_an_eccentric_crank() -> None:
    cycle, fluctuation, inertia = both(Mechanism.from_toml_text(CRANK))
    assert cycle.fluctuation == pytest.approx(2 * 3.0 * 9.81 * 0.1, rel=1e-9)
    assert fluctuation == pytest.approx(cycle.fluctuation, rel=1e-6)
    assert inertia == pytest.approx(cycle.flywheel(0.02), rel=1e-6)


def test_a_press() -> None:
    cycle, fluctuation, inertia = both(Mechanism.from_toml(EXAMPLES / "crank-press" / "press.toml"))
    assert fluctuation == pytest.approx(cycle.fluctuation, rel=1e-4)
    assert inertia == pytest.approx(cycle.flywheel(0.02), rel=1e-4)
