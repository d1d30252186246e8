"""Motion under forces through change points: exactly, but for rounding, and nearly; never on a wrong branch in silence."""

from __future__ import annotations

import cmath
import math
from dataclasses import replace

import mpmath as mp
import numpy as np
import pytest

from benchmarks.truth.bodies_in_time import Bodies
from virtualwork import Friction, Guess, Guide, Input, Link, Mechanism, MechanismError

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
    assert "it is so close to a change point that rounding would decide its further motion" in said
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
    assert "s it rests at a change point, where two motions are possible" in run.warnings[0]
    time = float(run.warnings[0].split()[1])
    assert 0 < time < 1
    at = m.simulate([0, time], angle=-0.5, speed=speed)
    assert at.angle[-1, 0] == pytest.approx(0.0, abs=1e-6)


def loop(crank: float, base: float, rocker: float, coupler: float, q: float, side: int) -> Mechanism:
    """The four-bar at a crank's angle, its coupler pin on one side of the line from the crank's pin to the base's."""
    pin = complex(crank * math.cos(q), crank * math.sin(q))
    c = complex(closed([mp.mpf(x) for x in (crank, base, rocker, coupler)], mp.mpf(q), side))
    m = parallelogram(crank, base, rocker, coupler)
    angles = {"coupler": cmath.phase(c - pin), "rocker": cmath.phase(c - base)}
    return replace(m, inputs=(Input(link="crank", value=q),), guess=Guess(q, angles))


def closed(lengths: list[mp.mpf], q: mp.mpf, side: int) -> mp.mpc:
    """Where coupler and rocker meet: two circles."""
    crank, base, rocker, coupler = lengths
    pin = crank * mp.expj(q)
    line = abs(base - pin)
    along = (coupler**2 - rocker**2 + line**2) / (2 * line)
    return pin + (base - pin) / line * mp.mpc(along, side * mp.sqrt(coupler**2 - along**2))


def time_by_energy(lengths: list[float], side: int, way: list[float], speed: float) -> float:
    """When the crank reaches the end of its way, from its energy alone: a quadrature, turned over at the middle of the way."""
    exact = [mp.mpf(x) for x in lengths]
    crank, base = exact[:2]

    def inertia_and_height(q: mp.mpf, side: int) -> tuple[mp.mpf, mp.mpf]:
        pin, c = crank * mp.expj(q), closed(exact, q, side)
        rod, bar, rate = c - pin, c - base, 1j * pin
        # 1j·pin + 1j·rod·(rate of the coupler) = 1j·bar·(rate of the rocker)
        cross = mp.im(mp.conj(rod) * bar)
        turning, swing = mp.re(mp.conj(bar) * rate) / cross, mp.re(mp.conj(rod) * rate) / cross
        inertia = crank**2 + abs(bar) ** 2 * swing**2 + mp.mpf(0.01) * turning**2
        return inertia, mp.im(pin) + mp.im(c)

    with mp.workdps(30):
        start = mp.mpf(way[0])
        inertia, height = inertia_and_height(start, side)
        whole = inertia * mp.mpf(speed) ** 2 / 2 + mp.mpf(G) * height

        def slowness(q: mp.mpf, side: int) -> mp.mpf:
            inertia, height = inertia_and_height(q, side)
            return mp.sqrt(inertia / (2 * (whole - mp.mpf(G) * height)))

        flat = mp.mpf(0) if way[1] == 0 else mp.pi
        parts = [(start, flat, side), (flat, mp.mpf(way[2]), -side)]
        return float(
            sum(
                abs(mp.quad(lambda q, s=s: slowness(q, s), [a, b], method="gauss-legendre"))
                for a, b, s in parts
            )
        )


@pytest.mark.parametrize(
    ("lengths", "way"),
    [
        # kites; the crossed parallelogram and the open one; crank + base = rocker + coupler; base − crank = rocker − coupler
        pytest.param([0.5, 0.5, 0.3, 0.3], [0.6, 0, -1.1], id="kite whose crank is its base"),
        pytest.param([0.3, 0.5, 0.5, 0.3], [2.5, math.pi, 4.2], id="kite whose crank is its coupler"),
        pytest.param([0.3, 0.5, 0.3, 0.5], [0.6, 0, -1.1], id="parallelogram"),
        pytest.param([0.3, 0.5, 0.3, 0.5], [2.5, math.pi, 4.2], id="parallelogram folded"),
        pytest.param([0.3, 0.6, 0.5, 0.4], [2.5, math.pi, 4.2], id="crank and base as long as the others"),
        pytest.param([0.3, 0.6, 0.5, 0.2], [0.6, 0, -1.1], id="crank and rocker as long as the others"),
    ],
)
@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("accuracy", [1e-8, 1e-6])
def test_through_flat_poses_as_the_energy_alone_has_it(
    lengths: list[float], way: list[float], side: int, accuracy: float
) -> None:
    """Kites, antiparallelograms and others that lie flat: error, its estimate, and energy."""
    speed = math.copysign(7.0, way[2] - way[0])
    m = loop(*lengths, way[0], side)
    run = m.simulate([0, 1], speed=speed, accuracy=accuracy, until={"crank": way[2]})
    exact = time_by_energy(lengths, side, way, speed)
    assert not run.warnings
    error = abs((run.t[-1] - exact) * run.speed[-1, 0])
    assert error <= run.error_estimate[-1, 0] <= accuracy
    assert np.abs(run.energy_drift).max() < 10 * accuracy
    # to and fro, through other coordinates, and round
    longer = m.simulate(np.linspace(0, 1.2, 7), speed=speed, accuracy=accuracy)
    assert not longer.warnings
    assert np.abs(longer.energy_drift).max() < 10 * accuracy


@pytest.mark.slow
def test_energy_lost_between_interpolated_poses_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """A kite through its flat pose, its rates from poses too far off, the same in both ways: no numbers, a time."""
    monkeypatch.setattr("virtualwork.intime.crossing.NARROWINGS", 1)
    monkeypatch.setattr("virtualwork.intime.crossing.NODES", 4)
    monkeypatch.setattr("virtualwork.intime.equations.OTHER", 1.0)
    run = loop(0.5, 0.5, 0.3, 0.3, 0.6, 1).simulate([0, 1.2], speed=7.0, accuracy=1e-8)
    # what interpolation misses is seen, and stands in the estimate
    assert run.warnings[0].startswith("accuracy 1e-08 is beyond rounding here")
    monkeypatch.setattr("virtualwork.intime.equations.SEEN", 0.0)
    with pytest.raises(
        MechanismError,
        match=r"^at 0\.\d+ s the rates change too fast near a change point: more energy is lost",
    ):
        loop(0.5, 0.5, 0.3, 0.3, 0.6, 1).simulate([0, 1.2], speed=7.0, accuracy=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("lengths", [(0.5, 0.5, 0.3, 0.3), (0.3, 0.5, 0.3, 0.5), (0.3, 0.6, 0.5, 0.4)])
def test_with_friction_it_ends_close_to_the_flat_pose_with_its_time(lengths: tuple[float, ...]) -> None:
    """The joint forces there, and with them friction, grow beyond any bound."""
    m = replace(loop(*lengths, 0.6, -1), friction=[Friction("A", 0.2, 0.02)])
    run = m.simulate(np.linspace(0, 0.6, 7), speed=7.0, accuracy=1e-8)
    assert run.warnings[0].startswith(f"ends at {run.t[-1]:.9g} s: it cannot move further")
    assert abs(math.sin(run.angle[-1, 0])) < 0.01
    assert np.abs(run.energy_drift).max() < 1e-7


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["numpy", "llvm"])
def test_too_far_from_the_guess_it_ends_with_its_time(engine: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A block on a rail draws a slotted arm without mass: steadily to 20 000 sizes of the mechanism, and no farther."""
    if engine == "llvm":
        pytest.importorskip("llvmlite")
    monkeypatch.setenv("DALEMBERT_ENGINE", engine)
    m = Mechanism(
        {"O": 0j, "D": 1j},
        {"block": Link({"P": 0j, "Q": 0.1j}, mass=1), "arm": Link({"D": 0j})},
        guides=[Guide("P", "block", turned=0.0), Guide("Q", "block", "arm")],
        inputs=Input(slider="P", value=0.5),
        guess=Guess(0.5, {"arm": -1.0}),
    )
    run = m.simulate([0, 1.0], angle=19990.0, speed=-10.0)
    assert not run.warnings
    assert run.angle[-1, 0] == pytest.approx(19980.0, rel=1e-15)
    # an input's surroundings are looked at as far as a size away
    run = m.simulate([0, 0.5, 2.0], angle=19990.0, speed=10.0)
    assert "turns away from the guess" in run.ended
    assert run.warnings == (f"ends at {run.t[-1]:.9g} s: {run.ended}",)
    assert 19998.5 < run.angle[-1, 0] < 20000.5
    assert run.angle[:, 0] == pytest.approx(19990.0 + 10.0 * run.t, rel=1e-14)


def lift(driver: str, angle: float) -> Mechanism:
    """A scissors lift of bars without mass, `left` at an angle; its platform goes straight up and down."""
    shoe = Guide("B", "shoe", "ground", "A", 0.0, 0.0)
    places = {"B": 1.2 * math.cos(angle), "left": angle, "right": math.pi - angle, "platform": 0.0}
    entry = Input(slider="B") if driver == "B" else Input(link=driver)
    others = {name: place for name, place in places.items() if name not in ("B", driver)}
    return Mechanism(
        {"A": 0j},
        {
            "left": Link({"A": 0j, "M": 0.6, "C": 1.2}),
            "right": Link({"B": 0j, "M": 0.6, "D": 1.2}),
            "platform": Link({"D": 0j, "E": 1.2}, mass=400, center=0.6 + 0.1j),
            "shoe": Link({"B": 0j}),
        },
        guides=[shoe, Guide("C", "left", "platform", "D", 0.0)],
        inputs=entry,
        guess=Guess(places[driver], others),
        gravity=-1j * G,
    )


@pytest.mark.whole
@pytest.mark.parametrize("driver", ["B", "left", "right"])
def test_a_scissors_lift_falls_freely_through_its_flat_pose(driver: str) -> None:
    """Only the platform has mass: it falls as a stone does, until the bars stand on end below."""
    begin = math.radians(24)
    high = 1.2 * math.sin(begin)
    run = lift(driver, begin).simulate([0, 0.2, 0.3, 0.4, 0.5, 0.7])
    heights = run.motion.point("D").position[:, 1]
    assert heights[3] < 0 < heights[2]
    assert heights == pytest.approx(high - G / 2 * run.t**2, abs=1e-11)
    assert run.warnings == (f"ends at {run.t[-1]:.9g} s: {run.ended}",)
    assert run.ended.startswith("it cannot move further")
    assert -1.2 <= heights[-1] < -1.199


def test_a_scissors_lift_released_flat() -> None:
    """Its bars' angles lead on from there; the shoe's place stands at its limit."""
    run = lift("left", 0.0).simulate([0, 0.2, 0.4])
    assert run.motion.point("D").position[:, 1] == pytest.approx(-G / 2 * run.t**2, abs=1e-11)
    with pytest.raises(MechanismError, match="stands at a limit of its input"):
        lift("B", 0.0).simulate([0, 0.2, 0.4])


def pantograph(**loop: Link) -> Mechanism:
    """Two bars of 1 m, and the two of 0.5 m that make a parallelogram with them; without these a double pendulum."""
    heavy = 0.0 if loop else 1.0
    return Mechanism(
        {"O": 0j},
        {
            "upper": Link({"O": 0j, "A": 1, "D": 0.5}, mass=1, center=1, inertia=0.2 * heavy),
            "lower": Link({"A": 0j, "P": 1, "C": 0.5}, mass=1 + heavy, center=1, inertia=0.1 * heavy),
            **loop,
        },
        inputs=[Input(link="upper", value=0.3), Input(link="lower", value=-0.8)],
        guess=Guess((0.3, -0.8), {"third": -0.8, "fourth": 0.3 + math.pi} if loop else {}),
    )


def test_a_pantograph_moves_to_where_it_lies_flat_and_no_farther() -> None:
    """4 kg where its parallelogram closes, halfway to the end, are 1 kg there: without gravity a double pendulum."""
    third = Link({"D": 0j, "E": 0.5}, mass=4, center=0.5, inertia=0.1)
    m = pantograph(third=third, fourth=Link({"C": 0j, "E": 0.5}, inertia=0.2))
    run = m.simulate([0, 0.25, 0.5, 1.5], speed=[0.0, 1.0])
    assert run.warnings == (f"ends at {run.t[-1]:.9g} s: {run.ended}",)
    assert "close to a change point" in run.ended
    assert 0.7 < run.t[-1] < 0.8
    alike = pantograph().simulate(run.t, speed=[0.0, 1.0])
    assert run.angle == pytest.approx(alike.angle, abs=1e-9)
    assert abs(alike.angle[-1, 0] - alike.angle[-1, 1]) < 1e-3
    for moving in (0.0, 1.0):
        with pytest.raises(MechanismError, match="cannot be assembled at the start, or stands at a limit"):
            m.simulate([0, 0.2], angle=[0.0, 0.0], speed=[0.0, moving])
