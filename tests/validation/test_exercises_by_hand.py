"""Exercises of a kind that Norton, Shigley and Meriam set: places in closed form, rates and the torque by differentiation in mpmath.

The torque is that of virtual work, Σ m (a_G − g)·∂G/∂q + Σ I α ∂θ/∂q − Σ F·∂P/∂q − Σ T ∂θ/∂q. The mirror image of an exercise,
y to −y, has the same answers mirrored.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import mpmath as mp
import pytest

from tests.conftest import Dalembert
from virtualwork import Mechanism

SPEED, ACCELERATION = 12, 35
Places = dict[str, tuple[Any, Any]]


def n(text: str) -> Any:
    return mp.mpf(text)


class Exercise(NamedTuple):
    """A mechanism, and where the origin and the axis of every link stand at an input, worked out by hand."""

    text: str
    places: Callable[[Any], Places]
    point: tuple[str, str, str]
    turning: str


def slider_crank(q: Any) -> Places:
    pin = n("0.04") * mp.expj(q)
    rod = -mp.asin((pin.imag - n("0.02")) / n("0.12"))
    return {"crank": (0, q), "rod": (pin, rod), "piston": (pin + n("0.12") * mp.expj(rod), n("0"))}


def inverted(q: Any) -> Places:
    pivot = mp.mpc(n("0.14"), n("-0.03"))
    return {"crank": (0, q), "rocker": (pivot, mp.arg(n("0.05") * mp.expj(q) - pivot))}


def quick_return(q: Any) -> Places:
    pivot = mp.mpc(0, n("-0.2"))
    rocker = mp.arg(n("0.08") * mp.expj(q) - pivot)
    ram = pivot + n("0.35") / mp.sin(rocker) * mp.expj(rocker)
    return {"crank": (0, q), "rocker": (pivot, rocker), "ram": (ram, n("0"))}


def geneva(q: Any) -> Places:
    return {"crank": (0, q), "wheel": (n("0.1"), mp.arg(n("0.07") * mp.expj(q) - n("0.1")))}


def planetary(q: Any) -> Places:
    """Sun of 24 teeth, planets of 18, a ring of 60 that stands."""
    arm = q * 24 / (24 + 60)
    return {"sun": (0, q), "arm": (0, arm), "planet": (n("0.042") * mp.expj(arm), arm * (1 - n("60") / 18))}


def belt(q: Any) -> Places:
    return {"motor": (0, q), "fan": (n("0.6"), q / 3)}


EXERCISES = {
    "offset slider-crank": Exercise(
        """
        ground = { A = [0, 0] }
        gravity = [0, -9.81]
        links.crank = { points = { A = [0, 0], B = [0.04, 0] }, mass = 1.2, center = [0.01, 0.002], inertia = 0.003 }
        links.rod = { points = { B = [0, 0], C = [0.12, 0] }, mass = 0.7, center = [0.05, -0.004], inertia = 0.0011 }
        links.piston = { points = { C = [0, 0] }, mass = 0.5 }
        sliders = [{ point = "C", link = "piston", through = [0, 0.02], angle = 0, turned = 0 }]
        forces = [{ link = "piston", point = "C", force = [-150, 20] }]
        input = { link = "crank" }
        guess = { at = 0.4, rod = 0.1 }
        """,
        slider_crank,
        ("C", "piston", "0"),
        "rod",
    ),
    "inverted slider-crank": Exercise(
        """
        ground = { A = [0, 0], D = [0.14, -0.03] }
        links.crank = { points = { A = [0, 0], B = [0.05, 0] }, mass = 0.9, center = [0.02, 0.01], inertia = 0.002 }
        links.rocker = { points = { D = [0, 0], E = [0.3, 0] }, mass = 2.1, center = [0.15, 0.01], inertia = 0.02 }
        slots = [{ point = "B", link = "crank", on = "rocker", through = "D", angle = 0 }]
        torques = [{ link = "rocker", torque = -3 }]
        input = { link = "crank" }
        guess = { at = 0.4, rocker = 2.6 }
        """,
        inverted,
        ("E", "rocker", "0.3"),
        "rocker",
    ),
    "quick return": Exercise(
        """
        ground = { A = [0, 0], O = [0, -0.2] }
        gravity = [0, -9.81]
        links.crank = { points = { A = [0, 0], B = [0.08, 0] }, inertia = 0.004 }
        links.rocker = { points = { O = [0, 0] }, mass = 3, center = [0.2, 0], inertia = 0.05 }
        links.ram = { points = { C = [0, 0], R = [0, 0] }, mass = 4 }
        slots = [{ point = "B", link = "crank", on = "rocker", through = "O", angle = 0 },
                 { point = "C", link = "ram", on = "rocker", through = "O", angle = 0 }]
        sliders = [{ point = "R", link = "ram", through = [0, 0.15], angle = 0, turned = 0 }]
        forces = [{ link = "ram", point = "C", force = [300, 0] }]
        input = { link = "crank" }
        guess = { at = 0.4, rocker = 1.3 }
        """,
        quick_return,
        ("C", "ram", "0"),
        "rocker",
    ),
    "Geneva wheel": Exercise(
        """
        ground = { A = [0, 0], D = [0.1, 0] }
        links.crank = { points = { A = [0, 0], B = [0.07, 0] }, inertia = 0.004 }
        links.wheel = { points = { D = [0, 0], E = [0.06, 0] }, inertia = 0.03 }
        slots = [{ point = "B", link = "crank", on = "wheel", through = "D", angle = 0 }]
        input = { link = "crank" }
        guess = { at = 0.4, wheel = 2.6 }
        """,
        geneva,
        ("E", "wheel", "0.06"),
        "wheel",
    ),
    "planetary gear train": Exercise(
        """
        ground = { A = [0, 0] }
        gravity = [0, -9.81]
        links.sun = { points = { A = [0, 0] }, inertia = 0.002 }
        links.arm = { points = { A = [0, 0], P = [0.042, 0] }, mass = 0.4, center = [0.02, 0], inertia = 0.0004 }
        links.planet = { points = { P = [0, 0], Q = [0.018, 0] }, mass = 0.3, inertia = 0.00005 }
        gears = [{ links = ["sun", "planet"], ratio = -1.3333333333333333, arm = "arm" },
                 { links = ["ground", "planet"], ratio = 3.3333333333333335, arm = "arm" }]
        torques = [{ link = "arm", torque = -8 }]
        input = { link = "sun" }
        guess = { at = 0, arm = 0, planet = 0 }
        """,
        planetary,
        ("Q", "planet", "0.018"),
        "arm",
    ),
    "belt drive": Exercise(
        """
        ground = { A = [0, 0], B = [0.6, 0] }
        gravity = [0, -9.81]
        links.motor = { points = { A = [0, 0] }, inertia = 0.002 }
        links.fan = { points = { B = [0, 0], E = [0.2, 0] }, inertia = 0.4, mass = 3, center = [0.01, 0] }
        belts = [{ links = ["motor", "fan"], radii = [0.05, 0.15] }]
        torques = [{ link = "fan", torque = -6 }]
        input = { link = "motor" }
        guess = { at = 0, fan = 0 }
        """,
        belt,
        ("E", "fan", "0.2"),
        "fan",
    ),
}


def in_time(value: Callable[[Any], Any], q: Any, k: int) -> Any:
    """A quantity over the input, or its first or second rate in time."""
    if k == 0:
        return value(q)
    first = mp.diff(value, q)
    return first * SPEED if k == 1 else first * ACCELERATION + mp.diff(value, q, 2) * SPEED**2


def dot(a: Any, b: Any) -> Any:
    return mp.re(mp.conj(a) * b)


def answers(of: Exercise, q: Any) -> tuple[list[Any], list[Any], Any]:
    """Point, link and torque: place and both rates of the one, angle and both rates of the other."""

    def at(link: str, z: Any) -> Callable[[Any], Any]:
        def place(x: Any) -> Any:
            origin, angle = of.places(x)[link]
            return origin + z * mp.expj(angle)

        return place

    def angle(link: str) -> Callable[[Any], Any]:
        return lambda x: of.places(x)[link][1]

    def vector(pair: list[float]) -> Any:
        return mp.mpc(*(n(str(x)) for x in pair))

    told = tomllib.loads(of.text)
    gravity, torque = vector(told.get("gravity", [0, 0])), n("0")
    for name, link in told["links"].items():
        center = at(name, vector(link.get("center", [0, 0])))
        weight = in_time(center, q, 2) - gravity
        torque += n(str(link.get("mass", 0))) * dot(weight, mp.diff(center, q))
        torque += n(str(link.get("inertia", 0))) * in_time(angle(name), q, 2) * mp.diff(angle(name), q)
    for force in told.get("forces", []):
        torque -= dot(vector(force["force"]), mp.diff(at(force["link"], 0), q))
    for load in told.get("torques", []):
        torque -= load["torque"] * mp.diff(angle(load["link"]), q)
    _, link, along = of.point
    point = [in_time(at(link, n(along)), q, k) for k in range(3)]
    return point, [in_time(angle(of.turning), q, k) for k in range(3)], torque


def mirrored(text: str) -> str:
    """The exercise in a mirror: y to −y, and angles the other way round."""
    told = tomllib.loads(text)

    def turned(pair: list[float]) -> list[float]:
        return [pair[0], -pair[1]]

    told["ground"] = {name: turned(pair) for name, pair in told["ground"].items()}
    told["gravity"] = turned(told.get("gravity", [0, 0]))
    for link in told["links"].values():
        link["points"] = {name: turned(pair) for name, pair in link["points"].items()}
        link["center"] = turned(link.get("center", [0, 0]))
    for guide in told.get("sliders", []):
        guide["through"] = turned(guide["through"])
    for force in told.get("forces", []):
        force["force"] = turned(force["force"])
    for load in told.get("torques", []):
        load["torque"] = -load["torque"]
    told["guess"] = {name: -angle for name, angle in told["guess"].items()}
    # of JSON and TOML each writes pairs and texts alike
    lines = [f"{name} = {_inline(value)}" for name, value in told.items()]
    return "\n".join(lines)


def _inline(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{name} = {_inline(of)}" for name, of in value.items()) + " }"
    return f"[{', '.join(map(_inline, value))}]" if isinstance(value, list) else json.dumps(value)


@pytest.mark.parametrize("q", ["0.4", pytest.param("2.2", marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", EXERCISES)
def test_an_exercise_and_its_mirror_image(name: str, q: str) -> None:
    of = EXERCISES[name]
    with mp.workdps(30):
        point, turning, torque = answers(of, n(q))
    for text, sign in ((of.text, 1), (mirrored(of.text), -1)):
        motion = Mechanism.from_toml_text(text).motion(sign * float(q), sign * SPEED, sign * ACCELERATION)
        for k in range(3):
            place = complex(point[k]) if sign > 0 else complex(point[k]).conjugate()
            assert motion.point(of.point[0]).complex(k)[0] == pytest.approx(place, rel=1e-12)
        link = motion.link(of.turning)
        for value, true in zip((link.omega, link.alpha), turning[1:], strict=True):
            assert value[0] == pytest.approx(sign * float(true), rel=1e-12)
        assert mp.expj(link.angle[0] - sign * turning[0]).real == pytest.approx(1, rel=1e-12)
        assert motion.effort[0] == pytest.approx(sign * float(torque), rel=1e-12)
        assert motion.dynamics.newton_euler[0, 0] == pytest.approx(sign * float(torque), rel=1e-12)


@pytest.mark.parametrize(
    "name",
    [name if i == 0 else pytest.param(name, marks=pytest.mark.slow) for i, name in enumerate(EXERCISES)],
)
def test_an_exercise_by_the_command(name: str, dalembert: Dalembert, tmp_path: Path) -> None:
    of, path = EXERCISES[name], tmp_path / "exercise.toml"
    told = tomllib.loads(of.text)
    rates = f"speed = {SPEED}, acceleration = {ACCELERATION} }}"
    path.write_text(
        of.text.replace(
            f'"{told["input"]["link"]}" }}\n        guess',
            f'"{told["input"]["link"]}", {rates}\n        guess',
        )
    )
    wanted = f"{told['input']['link']},{of.point[0]},{of.turning}"
    done = dalembert("forces", path, "--at", "0.4rad", "--only", wanted, "--json")
    assert done.returncode == 0, done.stderr
    (pose,) = json.loads(done.stdout)["poses"]
    with mp.workdps(30):
        point, turning, torque = answers(of, n("0.4"))
    shown = pose["points"][of.point[0]]
    for x, y, true in zip(("x_m", "vx_m_s", "ax_m_s2"), ("y_m", "vy_m_s", "ay_m_s2"), point, strict=True):
        assert complex(shown[x], shown[y]) == pytest.approx(complex(true), rel=1e-12)
    link = pose["links"][of.turning]
    assert [link["omega_rad_s"], link["alpha_rad_s2"]] == pytest.approx([*map(float, turning[1:])], rel=1e-12)
    assert pose["effort"]["input_torque_N_m"] == pytest.approx(float(torque), rel=1e-12)
    assert pose["effort"]["virtual_work_torque_N_m"] == pytest.approx(float(torque), rel=1e-12)
