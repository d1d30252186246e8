"""Quantities from the tape beside those of each pose by the formulas on floats: worked examples, change points, ends, threads, names."""

from __future__ import annotations

import threading
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from benchmarks.stress.tapes import dimension, every_key, sizes
from benchmarks.stress.topologies import generate
from dalembert.arithmetic.engines import run
from tests.virtualwork.pose_by_pose import pose_by_pose
from virtualwork import Mechanism
from virtualwork.describe import DescriptionError, MechanismError
from virtualwork.formulas.forces import Effort, Shaking
from virtualwork.formulas.kinematics import Angle

EXAMPLES = {
    f"{path.parent.name}/{path.name}": path
    for path in sorted(Path(str(files("cli"))).glob("examples/*/*.toml"))
    if "[links" in path.read_text(encoding="utf-8")
}


def sweep(m, share=1.0, n=61):
    """Poses all around the guess, with a speed and accelerations."""
    rng = np.random.default_rng(3)
    if len(m.inputs) > 1:
        q = np.array(m.at) + share * rng.uniform(-0.3, 0.3, (n, len(m.inputs)))
        return q, rng.normal(size=q.shape), rng.normal(size=q.shape)
    width = 0.2 * m.size if m.inputs[0].is_slide else 2 * np.pi
    return m.at[0] + share * np.linspace(-width / 2, width / 2, n), 3.0, rng.normal(size=n)


def compare(m, monkeypatch, engine, share=1.0) -> None:
    """All quantities both ways, within the bounds of their rounding errors; poses that have none are the same."""
    q, speed, acceleration = sweep(m, share)
    motion = m.motion(q, speed, acceleration)
    keys = every_key(motion)
    monkeypatch.setenv("DALEMBERT_ENGINE", engine)
    found = m.motion(q, speed, acceleration).poses.values(keys)
    # asked for one by one, each begins at what those before it have left
    alone = m.motion(q, speed, acceleration).poses
    each = {key: alone.values([key])[0] for key in keys[::-1]}
    monkeypatch.delenv("DALEMBERT_ENGINE")

    rows = np.arange(0, motion.n, 6)
    truths = pose_by_pose(motion, keys, rows)
    largest = sizes(m, keys, truths)
    # a condition κ makes κ^(order + 1) of a rounding
    condition = np.where(np.isfinite(motion.condition), motion.condition, 1.0)[rows]
    for key, value, true in zip(keys, found, truths, strict=True):
        if engine == "numpy" and alone.takes(keys):
            # the same operations on the same numbers
            assert np.array_equal(each[key], value, equal_nan=True), key
        for one in (value[rows], each[key][rows]):
            assert (np.isnan(one) == np.isnan(true)).all(), key
            close = np.abs(one - true) <= 4e-15 * np.maximum(condition, 1.0) ** 3 * largest[dimension(key)]
            assert (close | np.isnan(true)).all(), key


@pytest.mark.parametrize("name", EXAMPLES)
def test_every_quantity_of_the_worked_examples_on_numpy(name, monkeypatch) -> None:
    compare(Mechanism.from_toml(EXAMPLES[name]), monkeypatch, "numpy")


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["python", "llvm"])
@pytest.mark.parametrize("name", EXAMPLES)
def test_every_quantity_of_the_worked_examples_on_the_other_engines(name, engine, monkeypatch) -> None:
    compare(Mechanism.from_toml(EXAMPLES[name]), monkeypatch, engine)


@pytest.mark.slow
def test_every_quantity_of_mechanisms_of_any_topology(monkeypatch) -> None:
    """Drawn at random at a pose: two to six links, slots, prisms and gears on moving links, one or two inputs."""
    compared = 0
    for seed in range(60):
        try:
            m = generate(seed).mechanism
            _ = m.assembly
        except MechanismError:
            continue
        compare(m, monkeypatch, "numpy", 0.02)
        compared += 1
    assert compared > 47


@pytest.mark.parametrize("over", ["speed_rad_s", "angle_rad"])
def test_a_torque_asked_for_beside_what_its_table_is_over(over, tmp_path, monkeypatch) -> None:
    (tmp_path / "t.csv").write_text(f"{over},torque_N_m\n-9,3\n-1,-4\n0,0.5\n9,7\n")
    (tmp_path / "m.toml").write_text("""
[ground]
A = [0, 0]
D = [0.3, 0]
[links.crank]
points = { A = [0, 0], B = [0.1, 0] }
[links.coupler]
points = { B = [0, 0], C = [0.3, 0] }
mass = 2
[links.rocker]
points = { D = [0, 0], C = [0.25, 0] }
[[torques]]
link = "coupler"
torque = "t.csv"
[input]
link = "crank"
[guess]
at = 1
coupler = 0.7
rocker = 1
""")
    m = Mechanism.from_toml(tmp_path / "m.toml")
    compare(m, monkeypatch, "numpy")
    monkeypatch.setenv("DALEMBERT_ENGINE", "numpy")
    q, key = np.linspace(0, 6, 20), Angle("coupler", int(over == "speed_rad_s"))
    torque, turned = m.motion(q, 3.0).poses.values([Effort(0), key])
    assert np.isfinite(torque).all()
    assert np.array_equal(torque, m.motion(q, 3.0).effort)
    assert np.array_equal(turned, m.motion(q, 3.0).value(key))


def test_an_evaluator_gives_what_the_motion_gives() -> None:
    m = Mechanism.from_toml(EXAMPLES["klann/klann.toml"])
    at = m.evaluator("points.C", "points.C.velocity", "links.leg.alpha", "effort")
    motion = m.motion(1.0, 2.0, 0.5)
    for found in (at(1.0, 2.0, 0.5), at(1, 2, 0.5)):
        assert found["points.C"] == pytest.approx(motion.point("C").position[0], rel=1e-14)
        assert found["points.C.velocity"] == pytest.approx(motion.point("C").velocity[0], rel=1e-13)
        assert found["links.leg.alpha"] == pytest.approx(motion.link("leg").alpha[0], rel=1e-12)
        assert found["effort"] == pytest.approx(motion.effort[0], rel=1e-13)
    many = at([1.0, 2.0], 2.0, 0.5)
    assert many["points.C"].shape == (2, 2)
    assert many["points.C"][0] == pytest.approx(motion.point("C").position[0], rel=1e-14)


def test_an_evaluator_knows_where_nothing_stands_and_which_names_there_are(rocker) -> None:
    at = rocker.evaluator("links.coupler.angle", "points.B")
    found = at(np.pi)
    assert np.isnan(found["links.coupler.angle"])
    # the crank itself stands anywhere
    assert np.isfinite(found["points.B"]).all()
    with pytest.raises(DescriptionError, match=r"no point is named 'Bb'; did you mean 'B'\?"):
        rocker.evaluator("points.Bb")
    with pytest.raises(DescriptionError, match="no derivative is named 'speed'"):
        rocker.evaluator("points.B.speed")
    with pytest.raises(DescriptionError, match="no quantity is named 'torque'"):
        rocker.evaluator("torque")


def test_an_evaluator_and_a_sensitivity_take_the_names_of_only() -> None:
    m = Mechanism.from_toml(EXAMPLES["engine/engine.toml"])
    motion = m.motion([0.3, 1.1], 20.0)
    wanted = ("B.x", "A.vy", "rod.alpha", "crank.torque", "A.rod.fx", "shaking.fy", "B.speed")
    expected = (
        motion.point("B").position[:, 0],
        motion.point("A").velocity[:, 1],
        motion.link("rod").alpha,
        motion.effort,
        motion.reaction("A", on="rod")[:, 0],
        motion.value(Shaking()).imag,
        motion.slide("B").speed,
    )
    found = m.evaluator(*wanted)([0.3, 1.1], speed=20.0)
    alone = m.evaluator(*wanted)(0.3, speed=20.0)
    assert list(found) == list(alone) == list(wanted)
    for name, values in zip(wanted, expected, strict=True):
        np.testing.assert_allclose(found[name], values, rtol=1e-11, atol=1e-11 * np.abs(values).max())
        assert alone[name] == pytest.approx(values[0], rel=1e-11, abs=1e-11 * np.abs(values).max())
    path = "links.rod.mass"
    np.testing.assert_allclose(
        motion.sensitivity("crank.torque", path), motion.sensitivity("effort", path), rtol=1e-11
    )
    radius = "links.crank.A.x"
    np.testing.assert_array_equal(
        motion.sensitivity("B.vx", radius), motion.point("B").sensitivity(radius, 1)[:, 0]
    )
    errors = motion.error_estimates(*wanted)
    assert all(0 <= errors[name][0] <= 1e-9 * np.abs(found[name]).max() + 1e-15 for name in wanted)
    assert list(m.evaluator("rod")(0.3)) == ["rod.angle", "rod.omega", "rod.alpha"]
    with pytest.raises(DescriptionError, match=r"expected one quantity, such as rod\.angle or rod\.omega"):
        motion.sensitivity("rod", path)


def test_angles_of_one_input_are_a_list(rocker) -> None:
    for of in (rocker, rocker.vary({"links.crank.B.x": [0.1]})):
        with pytest.raises(ValueError, match=r"shape \(n,\) for one input, found \(2, 3\)"):
            of.motion(np.zeros((2, 3)))
    assert rocker.motion(np.zeros((3, 1))).n == 3


def test_two_threads_that_ask_one_motion_get_the_right_numbers(monkeypatch) -> None:
    monkeypatch.setenv("DALEMBERT_ENGINE", "numpy")
    m = Mechanism.from_toml(EXAMPLES["klann/klann.toml"])
    q = np.linspace(0, 6, 5000)
    alone = m.motion(q, 2.0)
    expected = {name: (alone.link(name).angle, alone.link(name).omega) for name in m.links}
    fresh = Mechanism.from_toml(EXAMPLES["klann/klann.toml"]).motion(q, 2.0)
    wrong: list[str] = []

    def ask(names) -> None:
        for name in names:
            angle, omega = expected[name]
            if not (
                np.array_equal(fresh.link(name).angle, angle)
                and np.array_equal(fresh.link(name).omega, omega)
            ):
                wrong.append(name)

    threads = [threading.Thread(target=ask, args=(list(m.links)[:: 1 - 2 * (i % 2)],)) for i in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong


def test_a_later_request_begins_at_what_earlier_ones_have_left(monkeypatch) -> None:
    """The count of operations is the measure; the state of a pose is kept, no more arrays than are asked for."""
    monkeypatch.setenv("DALEMBERT_ENGINE", "numpy")
    klann = Mechanism.from_toml(EXAMPLES["klann/klann.toml"])
    keys = [Angle(link, k) for k in (1, 2) for link in ("coupler", "rocker", "arm", "leg")]
    motion = klann.motion(np.linspace(0, 6, 40), 2.0)
    ran: list = []

    def counted(tape, *given, **options):
        ran.append(tape)
        return run(tape, *given, **options)

    monkeypatch.setattr("virtualwork.formulas.lanes.run", counted)
    for key in keys:
        motion.value(key)
    alone = [
        klann.evaluator(f"links.{link}.{'omega' if k == 1 else 'alpha'}").operations() for _, link, k in keys
    ]
    # the first request leaves sine and cosine of the input
    assert [tape.cost for tape in ran[:2]] == [alone[0], alone[1] - 2]
    assert sum(tape.cost for tape in ran) < 0.65 * sum(alone)
    assert sum(len(tape.outputs) for tape in ran) <= 2.5 * len(keys)
    # the same requests of another motion run the same tapes
    before, again = list(ran), klann.motion(np.linspace(1, 2, 50), 3.0)
    for key in keys:
        again.value(key)
    assert ran[len(keys) :] == before


def test_estimates_one_by_one_take_two_second_runs(monkeypatch) -> None:
    """The second request brings those of all that was requested of the motion; each is as if requested alone."""
    monkeypatch.setenv("DALEMBERT_ENGINE", "numpy")
    from virtualwork.digits import second_run

    m = Mechanism.from_toml(EXAMPLES["klann/klann.toml"])
    at, names = np.linspace(0.0, 6.0, 10_000), ("points.H", "links.leg.omega", "links.arm.angle")
    alone = [m.motion(at, 2.0).error_estimates(name)[name] for name in names]
    runs: list = []

    def counted(tape, *given):
        runs.append(tape)
        return compared(tape, *given)

    compared = second_run.compared
    monkeypatch.setattr(second_run, "compared", counted)
    motion = m.motion(at, 2.0)
    _ = motion.point("H").position, motion.link("leg").omega, motion.link("arm").angle
    for name, estimate in zip(names, alone, strict=True):
        assert np.array_equal(motion.error_estimates(name)[name], estimate)
    assert len(runs) == 2


def test_an_evaluator_reads_the_caller_s_array_and_gives_arrays_that_share_nothing():
    """No array is copied for it: neither is one of the caller's changed, nor do two names get the same one."""
    m = Mechanism.from_toml(EXAMPLES["klann/klann.toml"])
    at = np.linspace(0.0, 6.0, 40)
    before, names = at.copy(), ("points.H", "H.x", "links.leg.omega", "leg.omega", "links.crank.angle")
    result = m.evaluator(*names)(at, 2.0)
    for name, value in result.items():
        assert np.array_equal(value, m.evaluator(name)(at, 2.0)[name])
        assert not np.shares_memory(value, at)
    assert not np.shares_memory(result["points.H"], result["H.x"])
    assert not np.shares_memory(result["links.leg.omega"], result["leg.omega"])
    for value in result.values():
        value[...] = 7.0
    assert np.array_equal(at, before)


@pytest.fixture
def rocker():
    """A double rocker: its input goes no further than some 100°."""
    from virtualwork import Guess, Input, Link

    return Mechanism(
        {"A": (0, 0), "D": (4, 0)},
        {
            "crank": Link({"A": (0, 0), "B": (3, 0)}),
            "coupler": Link({"B": (0, 0), "C": (2, 0)}),
            "rocker": Link({"D": (0, 0), "C": (2.5, 0)}),
        },
        inputs=Input(link="crank"),
        guess=Guess(0.5, {"coupler": 0.3, "rocker": 1.0}),
    )


def test_a_pose_that_does_not_stand_has_neither_component(rocker, monkeypatch) -> None:
    """Of complex numbers NaN alone is NaN + 0i: x without a value beside y = 0."""
    motion = rocker.motion([0.5, np.pi], 1.0)
    evaluator = rocker.evaluator("points.C", "reactions.C.coupler")
    for engine in (None, "python", "numpy"):
        if engine:
            monkeypatch.setenv("DALEMBERT_ENGINE", engine)
        found = evaluator([0.5, np.pi], 1.0)
        for value in (found["points.C"], found["reactions.C.coupler"], motion.reaction("C", "coupler")):
            assert np.isfinite(value[0]).all()
            assert np.isnan(value[1]).all()


def test_an_evaluator_adds_pin_and_guide_at_one_point() -> None:
    """Of the press, the ram is pinned at B, which runs in a guide: all that others do to it there."""
    m = Mechanism.from_toml(EXAMPLES["crank-press/press.toml"])
    q = np.array([0.3, 1.7])
    found = m.evaluator("reactions.B.ram")(q, 2.0)["reactions.B.ram"]
    true = m.motion(q, 2.0).reaction("B", "ram")
    assert np.abs(found - true).max() <= 4e-15 * np.abs(true).max()
    (pin, guide) = (j for j in m.motion(q, 2.0).dynamics.reactions.joints if "ram" in j.bodies)
    forces = m.motion(q, 2.0).dynamics
    both = forces.joint_force(pin, "ram") + forces.joint_force(guide, "ram")
    assert np.abs(found @ [1, 1j] - both).max() <= 4e-15 * np.abs(true).max()
