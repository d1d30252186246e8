"""Motion under forces through change points: exactly, but for rounding, and nearly; never on a wrong branch in silence."""

from __future__ import annotations

import math

import mpmath as mp
import numpy as np
import pytest

from benchmarks.truth.bodies_in_time import Bodies
from virtualwork import Guess, Input, Link, Mechanism

G = 9.81


def parallelogram(crank: float, base: float, rocker: float, coupler: float) -> Mechanism:
    """Point masses of 1 kg where the coupler is pinned, on bars without mass."""
    return Mechanism(
        {"A": 0j, "D": complex(base)},
        {
            "crank": Link({"A": 0j, "B": complex(crank)}, mass=1, center=complex(crank)),
            "coupler": Link({"B": 0j, "C": complex(coupler)}, inertia=0.01),
            "rocker": Link({"D": 0j, "C": complex(rocker)}, mass=1, center=complex(rocker)),
        },
        inputs=Input(link="crank", value=1.0),
        guess=Guess(1.0, {"coupler": 0.0, "rocker": 1.0}),
        gravity=-1j * G,
    )


@pytest.mark.parametrize(
    "lengths",
    [(0.5, 0.75, 0.5, 0.75), (0.1 + 0.2, 0.8, 0.3, 0.7 + 0.1), (0.3, 0.4, 0.3, 0.4), (0.3, 0.3, 0.3, 0.3)],
)
@pytest.mark.parametrize("speed", [0.0, -12.0])
def test_a_parallelogram_swings_and_turns_as_a_pendulum(lengths: tuple[float, ...], speed: float) -> None:
    """φ̈ = −g cos φ / a through its flat poses, exactly a parallelogram or but for rounding (mpmath's Taylor series)."""
    run = parallelogram(*lengths).simulate([0, 0.5, 1.5], speed=speed)
    with mp.workdps(20):
        a = mp.mpf(lengths[0])
        exact = mp.odefun(lambda _, y: [y[1], -mp.mpf(G) * mp.cos(y[0]) / a], 0, [1, speed])
        error = max(abs(exact(t)[0] - run.angle[i + 1, 0]) for i, t in enumerate((0.5, 1.5)))
    assert not run.warnings
    assert error <= 1e-9
    assert np.abs(run.energy_drift).max() < 1e-8
    # the coupler never turns: it has not gone over to the other branch
    assert np.abs(run.motion.link("coupler").angle).max() < 1e-12


@pytest.mark.parametrize("off", [1e-3, -1e-3, 1e-5])
def test_nearly_a_parallelogram_goes_the_way_of_its_bodies(off: float) -> None:
    """Past the flat pose it turns over into the crossed one within a moment: all of that is followed."""
    m = parallelogram(0.3, 0.5, 0.3 + off, 0.5)
    t = np.linspace(0, 0.5, 6)
    run = m.simulate(t, accuracy=1e-7)
    assert not run.warnings
    exact = Bodies(m).angles([1.0], [0.0], t)
    for name, angle in exact.items():
        apart = np.abs(np.exp(1j * angle) - np.exp(1j * run.motion.link(name).angle)).max()
        assert apart < 2e-6, name


@pytest.mark.parametrize("off", [1e-9, 1e-12, -1e-12])
@pytest.mark.parametrize("speed", [0.0, 9.0])
def test_where_rounding_decides_it_ends_with_its_time(off: float, speed: float) -> None:
    """Before the flat pose it goes as the parallelogram does; how it goes on, no digit of its lengths can tell."""
    t = np.linspace(0, 3, 31)
    run = parallelogram(0.3, 0.5, 0.3 + off, 0.5).simulate(t, speed=speed, accuracy=1e-8)
    (said,) = run.warnings
    assert "it comes so near a change point that rounding decides how it goes on" in said
    assert f"ends at {run.t[-1]:.9g} s" in said
    assert run.t[-1] < 3
    flat = run.angle[-1, 0]
    assert abs(math.sin(flat)) < 0.2
    exact = parallelogram(0.3, 0.5, 0.3, 0.5).simulate(run.t[:-1], speed=speed)
    some = np.abs(np.sin(exact.angle[:, 0])) > 0.3
    first = int(np.argmin(some)) if not some.all() else len(some)
    assert np.abs(exact.angle[:first, 0] - run.angle[:first, 0]).max() < 1e-7


def test_rest_at_a_change_point_on_the_way_is_named() -> None:
    """Thrown up from −0.5 rad with the speed that just reaches the flat pose: v² = 2 g sin 0.5 / a."""
    m = parallelogram(0.3, 0.5, 0.3, 0.5)
    speed = math.sqrt(2 * G * math.sin(0.5) / 0.3)
    run = m.simulate(np.linspace(0, 2, 5), angle=-0.5, speed=speed, accuracy=1e-10)
    assert "s it rests at a change point, from where more than one motion leads on" in run.warnings[0]
    time = float(run.warnings[0].split()[1])
    assert 0 < time < 1
    at = m.simulate([0, time], angle=-0.5, speed=speed)
    assert at.angle[-1, 0] == pytest.approx(0.0, abs=1e-6)


def test_energy_lost_between_interpolated_poses_is_said() -> None:
    """A kite that swings through its flat pose: its rates change too fast there for the poses on both sides."""
    m = parallelogram(0.5, 0.5, 0.3, 0.3)
    run = m.simulate(np.linspace(0, 1.2, 7), speed=7.0, accuracy=1e-8)
    lost = np.abs(run.energy_drift).max()
    assert lost < 1e-4 or any("J of energy are not explained" in said for said in run.warnings)
