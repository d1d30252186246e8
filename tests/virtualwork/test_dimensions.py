"""A description with another number at a path is the description that its file gives with that number written in."""

from __future__ import annotations

import pickle
from copy import deepcopy

import numpy as np
import pytest

from virtualwork import Force, Guess, Guide, Input, Link, Mechanism, Spring
from virtualwork.describe import DescriptionError
from virtualwork.describe import dimensions as dimensions_module
from virtualwork.describe.dimensions import changed, dimensions, named, value
from virtualwork.describe.parts import Polar

FILE = {
    "gravity": [0.5, -9.81],
    "ground": {"A": [0.0, 0.1], "D": [0.35, 0.0], "S": [0.1, -0.2]},
    "links": {
        "crank": {"points": {"A": [0.0, 0.0], "B": [0.12, 0.01]}, "mass": 0.4, "center": [0.06, 0.002]},
        "coupler": {
            "points": {
                "B": [0.0, 0.0],
                "C": [0.35, 0.0],
                "G": {"from": "C", "length": 0.36, "angle": 0.17},
                "H": {"from": "G", "length": 0.2, "angle": -0.4},
                "mass": [0.1, 0.1],
            },
            "mass": 0.8,
            "inertia": 0.01,
            "center": [0.2, 0.03],
        },
        "rocker": {"points": {"D": [0.0, 0.0], "C": [0.24, 0.0]}, "mass": 0.3},
        "rod": {"points": {"G": [0.0, 0.0], "P": [0.5, 0.0]}},
    },
    "slots": [{"point": "P", "link": "rod", "through": [0.1, 0.2], "angle": 0.3}],
    "input": [{"link": "crank", "angle": 1.0, "speed": 3.0, "acceleration": 2.0, "jerk": 1.0}],
    "guess": {"at": 1.0, "coupler": -0.2, "rocker": 1.2, "rod": -0.4},
    "forces": [
        {"link": "coupler", "point": "H", "force": [3.0, -4.0]},
        {"link": "rod", "point": [0.25, 0.1], "force": [1.0, 2.0], "frame": "link"},
        {"link": "coupler", "force": [1.0, 0.0]},
    ],
    "torques": [{"link": "rocker", "torque": 0.7}],
    "springs": [{"between": ["coupler.H", "ground.S"], "stiffness": 400.0, "free_length": 0.1, "damping": 3.0}],
    "torsion_springs": [{"links": ["crank", "rocker"], "stiffness": 2.0, "free_angle": 0.3, "damping": 0.1}],
    "motors": [{"carrier": "coupler", "drives": "rod", "mass": 0.2, "center": [0.1, 0.05]}],
    "friction": [{"joint": "C", "coefficient": 0.1, "radius": 0.01}],
}  # fmt: skip


def toml(value):
    """A value as TOML, tables inline."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f'"{k}" = {toml(v)}' for k, v in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    return f'"{value}"' if isinstance(value, str) else repr(value)


def read(data):
    return Mechanism.from_toml_text("\n".join(f"{key} = {toml(v)}" for key, v in data.items()))


def written(path, number):
    """The file with another number at a path."""
    data = deepcopy(FILE)
    *keys, last = path.split(".")
    if keys and keys[0] == "input":
        keys = ["input", "1"]
    elif len(keys) > 2 and keys[0] == "links" and keys[2] != "center" and keys[2] != "points":
        keys.insert(2, "points")
    node = data
    for key in keys:
        node = node[int(key) - 1] if isinstance(node, list) else node.setdefault(key, [0.0, 0.0])
    if isinstance(node, list):
        node["xy".index(last)] = number
    else:
        node[last] = number
    return read(data)


M = read(FILE)


@pytest.mark.parametrize("path", dimensions(M))
def test_a_changed_number_is_that_number_written_into_the_file(path):
    number = value(M, path) * 1.25 + 0.01
    found, expected = changed(M, {path: number}), written(path, number)
    assert found == expected
    assert found != M
    assert value(found, path) == number
    assert type(found) is Mechanism
    assert pickle.loads(pickle.dumps(found)) == expected
    # what hangs on the point of that name follows: loads, and points in polar form
    mine, its = (m.motion([1.0, 1.1], 3.0, 2.0).dynamics.newton_euler for m in (found, expected))
    np.testing.assert_array_equal(mine, its)


def test_every_number_of_the_file_has_a_path():
    def count(part):
        if isinstance(part, dict):
            return sum(map(count, part.values()))
        return sum(map(count, part)) if isinstance(part, list) else isinstance(part, float)

    # the guess is no dimension; the centre of the rocker and rod, their masses and inertias stand in the file as 0
    in_file = count({k: v for k, v in FILE.items() if k != "guess"})
    left_out = ("rocker.center.x", "rocker.center.y", "rod.center.x", "rod.center.y")
    zeros = [*left_out, "crank.inertia", "rocker.inertia", "rod.mass", "rod.inertia"]
    assert set(map("links.{}".format, zeros)) < set(dimensions(M))
    assert len(dimensions(M)) == in_file + len(zeros)


def test_a_point_that_hangs_on_another_and_a_load_at_its_name_follow_it():
    moved = changed(M, {"links.coupler.C": (0.36, 0.02)})
    coupler = moved.links["coupler"]
    shift = coupler.points["C"] - M.links["coupler"].points["C"]
    for point in "CGH":
        assert abs(coupler.points[point] - M.links["coupler"].points[point] - shift) < 1e-15
    assert moved.place("coupler", moved.forces[0].point) == coupler.points["H"]
    centred = changed(M, {"links.coupler.center": 0.3 + 0.1j})
    assert centred.place("coupler", centred.forces[2].point) == 0.3 + 0.1j


def test_headers_carry_the_unit():
    headers = {each.path: each.header for each in dimensions(M).values()}
    assert headers["links.crank.B.x"] == "links.crank.B.x_m"
    assert headers["links.coupler.H.angle"] == "links.coupler.H.angle_deg"
    assert headers["springs.1.stiffness"] == "springs.1.stiffness_N_per_m"
    assert headers["input.speed"] == "input.speed_rad_s"
    assert headers["gravity.y"] == "gravity.y_m_s2"


@pytest.mark.parametrize(
    ("path", "said"),
    [
        ("links.crnak.B.x", "did you mean 'links.crank.B.x'"),
        ("links.coupler.H.x", "expected links.coupler.H.length or links.coupler.H.angle"),
        ("links.coupler.H", "expected links.coupler.H.length or links.coupler.H.angle"),
        ("links.crank.B.length", "expected links.crank.B.x or links.crank.B.y"),
        ("links.crank", "no single number"),
        ("springs.2.stiffness", "did you mean"),
        ("forces.1.point.x", "unknown dimension"),
    ],
)
def test_a_path_that_names_no_number_is_refused_with_what_there_is(path, said):
    with pytest.raises(DescriptionError, match="'") as error:
        named(M, path)
    assert said in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("path", "number", "point"),
    [
        *(("links.crank.mass", number, False) for number in (float("nan"), float("inf"), "3 kg", None, 1j, (1, 2))),
        *(("ground.A", number, True) for number in ((1, 2, 3), (1,), "xy", (1, float("nan")), 1j * float("inf"))),
    ],
)  # fmt: skip
def test_what_is_no_number_is_refused_at_its_path(path, number, point):
    with pytest.raises(DescriptionError) as error:
        M.changed({path: number})
    expected = "a point (x, y) or x + iy of finite numbers" if point else "a finite number"
    assert str(error.value) == f"'{path}': found {number!r}, expected {expected}"


def test_a_point_takes_two_numbers_a_complex_one_or_x_alone():
    for number in ((0.3, 0), [0.3, 0.0], np.array([0.3, 0]), 0.3 + 0j, 0.3, np.float64(0.3)):
        assert M.changed({"ground.A": number}).ground["A"] == 0.3


def test_several_inputs_and_slides_have_paths_and_units_of_their_own():
    m = Mechanism(
        {"O": 0j},
        {"arm": Link({"O": 0j, "P": 1}), "block": Link({"Q": 0j})},
        [Guide("Q", "block", "arm", "P", 0.0, 0.0)],
        inputs=[Input("arm", speed=2.0), Input(slider="Q", value=0.5)],
        guess=Guess((0.1, 0.5)),
    )
    found = dimensions(m)
    assert found["input.1.angle"].header == "input.1.angle_deg"
    assert found["input.2.speed"].header == "input.2.speed_m_s"
    assert "sliders.1.through.x" not in found
    assert value(m, "input.1.angle") == 0.1
    assert changed(m, {"sliders.1.turned": 0.2}).guides[0].turned == 0.2


def test_points_in_polar_form_are_given_by_hand_too():
    arm = Link({"O": 0j, "Q": Polar("P", 1.0, np.pi / 2), "P": (1, 0)})
    assert list(arm.points) == ["O", "Q", "P"]
    assert abs(arm.points["Q"] - (1 + 1j)) < 1e-15
    with pytest.raises(DescriptionError, match=r"points\.Q from: unknown point 'R'"):
        Link({"Q": Polar("R", 1, 0)})
    with pytest.raises(DescriptionError, match="itself is placed from"):
        Link({"Q": Polar("R", 1, 0), "R": Polar("Q", 1, 0)})


def test_loads_at_names_that_are_not_there_are_refused():
    crank = {"crank": Link({"O": 0j, "P": 1})}
    with pytest.raises(DescriptionError, match="unknown point of link crank 'S'"):
        Mechanism({"O": 0j}, crank, inputs=Input("crank"), forces=[Force("crank", "S", 1j)])
    with pytest.raises(DescriptionError, match="unknown point of ground 'P'"):
        Mechanism(
            {"O": 0j}, crank, inputs=Input("crank"), springs=[Spring((("crank", "P"), ("ground", "P")))]
        )


def test_numbers_are_listed_once_however_many_are_read(monkeypatch):
    links = {
        f"l{i}": Link({"O": 0j, f"P{i}": 1 + 2j, "tip.end": 3j, "Q": Polar("O", 2.0, 0.5)}) for i in range(50)
    }
    m = Mechanism({"O": 0j, "A.b": 1j}, links, inputs=[Input(f"l{i}") for i in range(50)])
    made = []
    declared = dimensions_module.Dimension
    monkeypatch.setattr(dimensions_module, "Dimension", lambda *given: made.append(given) or declared(*given))
    paths = {
        "links.l1.P1.x": 1.0, "links.l1.P1": 1 + 2j, "links.l1.tip.end.y": 3.0, "links.l1.Q.angle": 0.5,
        "ground.A.b.y": 1.0, "gravity.y": 0.0, "input.2.speed": 0.0,
    }  # fmt: skip
    for path, number in paths.items():
        assert m.value(path) == number
    assert len(made) == len(m.dimensions)


def test_paths_that_two_names_share_are_read_as_they_are_listed() -> None:
    m = Mechanism(
        {"O": 0j},
        {"a": Link({"O": 0j, "b.c": 1 + 0j}), "a.b": Link({"O": 0j, "c": 2 + 0j})},
        inputs=[Input("a"), Input("a.b")],
    )
    every = dimensions(m)
    assert all(named(m, path) == (each,) for path, each in every.items())
    for path in ("links.a", "links.a.b.c.z", "ground.O.z", ""):
        with pytest.raises(DescriptionError):
            named(m, path)
    # of both coordinates of a point that two names share, and of one listed
    assert named(m, "links.a.b.c") == (every["links.a.b.c.x"], every["links.a.b.c.y"])


def test_what_is_listed_once_is_nobody_elses() -> None:
    arm = Mechanism({"O": 0j}, {"arm": Link({"O": 0j, "P": 1 + 0j})}, inputs=Input("arm"))
    listed = arm.dimensions
    listed.clear()
    other = arm.changed({"links.arm.P.x": 2.0})
    assert list(arm.dimensions) == list(other.dimensions) != []
    assert (arm.value("links.arm.P"), other.value("links.arm.P")) == (1 + 0j, 2 + 0j)
    again = pickle.loads(pickle.dumps(arm))
    assert again == arm
    assert list(again.dimensions) == list(arm.dimensions)
