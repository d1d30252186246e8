"""The keys of the worked exercises against formulas of the source documents, written out here on complex numbers."""

from __future__ import annotations

import csv
import shlex
from cmath import exp, phase
from collections.abc import Callable, Iterator
from math import degrees, radians, sin, sqrt
from pathlib import Path

import pytest

from cli.examples import describe, names
from tests.conftest import Dalembert

Key = Callable[..., list[float]]
KEYS: dict[str, Key] = {}
EXERCISES = [name for name in names() if name.startswith("exercise-")]


def key(of: Key) -> Key:
    KEYS["exercise-" + of.__name__.replace("_", "-")] = of
    return of


def turn(angle: float) -> complex:
    return exp(1j * radians(angle))


def direction(z: complex) -> float:
    return degrees(phase(z)) % 360


def crossing(a: complex, ra: float, b: complex, rb: float, side: int) -> complex:
    """The point at ra from a and rb from b, left (1) or right (−1) of a → b."""
    d = abs(b - a)
    along = (ra * ra - rb * rb + d * d) / (2 * d)
    return a + (b - a) / d * (along + 1j * side * sqrt(ra * ra - along * along))


@key
def coriolis(angle: float, speed: float, position: float) -> list[float]:
    """Ibrahim 1.10.7: V_A + V_rel + ω × R; A_A + A_rel + α × R − ω²R + 2ω × V_rel."""
    u, s = turn(angle), position / 1000
    v = 0.5 + (0.15 + 1j * speed * s) * u
    a = -0.2 + (-0.5 - speed**2 * s + 1j * (4 * s + 2 * speed * 0.15)) * u
    return [v.real, v.imag, a.real, a.imag]


@key
def disk(arm: float, spin: float, radius: float) -> list[float]:
    """Riul, unit II, eq. 44: I = m·r²/4, m·r²/4, m·r²/2; Ω × H with Ω along y."""
    size = 3.63 * (radius / 1000) ** 2
    return [size / 4 * arm, size / 2 * spin, size / 2 * spin * arm]


@key
def klann(alpha: float, crank: float) -> list[float]:
    """Nicoletti, lecture 7: two crossings of circles."""
    b, d, e = 90j + crank * turn(alpha), 350, 290 + 230j
    c = crossing(b, 350, d, 140, 1)
    g = c + 360 * (c - b) / 350 * turn(10)
    f = crossing(e, 270, g, 360, 1)
    h = g + 430 * (g - f) / 360 * turn(-40)
    return [direction(c - d), direction(c - b), h.real, h.imag]


@key
def piston(angle: float, crank: float, rod: float) -> list[float]:
    """Ibrahim 1.11: A + rod on the line; with the speeds across it both rates."""
    r, b, u = crank / 1000 * turn(angle), rod / 1000, turn(30)
    start = 0.02 - 0.01j

    def across(z: complex) -> float:
        return (z * u.conjugate()).imag

    over = across(start) - across(r)
    arm = u * (sqrt(b * b - over * over) + 1j * over)
    va, aa = 20j * r, (5j - 400) * r
    omega = -across(va) / across(1j * arm)
    vb = va + 1j * omega * arm
    alpha = -across(aa - omega**2 * arm) / across(1j * arm)
    return [omega, vb.real, alpha]


@key
def robot_arm(upper: float, fore: float, mass: float) -> list[float]:
    """Ibrahim 2.3: the moments of the weights about elbow and shoulder."""
    g, arm, second = 9.81, turn(upper), turn(upper + fore)
    elbow = mass * g * 0.2 * second.real
    return [elbow, elbow + g * (4 * 0.25 + 1.8 * 0.56 + mass * 0.6) * arm.real]


@key
def rod(speed: float, mass: float, tilt: float) -> list[float]:
    """Riul, unit II, example 4: M = m·(2b)²·ω²·sin 2β/24, over the bearings' distance of 1 m."""
    moment = mass * speed**2 * sin(radians(2 * tilt)) / 24
    return [-moment, moment]


@key
def rotor(w1: float, w2: float, angle: float) -> list[float]:
    """Riul, unit II, example 2: moments about A, then forces; g = 10 m/s²."""
    u = [w1 / 10 * 0.030 * turn(60), w2 / 10 * 0.050 * turn(angle)]
    b = -(u[0] * 20 + u[1] * 65) / 90
    a = -(u[0] + u[1] + b)
    return [abs(b) / 0.02, direction(b), abs(a) / 0.02, direction(a)]


@key
def slider_crank(force: float, mass: float, alpha: float) -> list[float]:
    """Riul, unit II, example 1: forces, weights, inertia forces and torques times velocities, over ω2."""
    rod = mass * -(900 * 300 - 600 * 200) + mass * -10 * 200 - 0.1 * alpha * -50
    slider = force * -500 + 2 * -900 * -500
    return [-(rod + slider) / 20]


@key
def static(mass: float, angle: float, radius: float) -> list[float]:
    """Riul, unit II, eqs. 6 to 11."""
    u = 10 * 50 * turn(60) + mass * 40 + 18 * 60 * turn(angle) + 15 * radius * turn(270)
    return [abs(u) / 100, direction(-u)]


@key
def two_disc(first: float, second: float, crank: float, disc: float) -> list[float]:
    """Nicoletti, the task of lecture 7, by geometry."""
    result = []
    for angle in (first, second):
        b = crank * turn(angle)
        c = crossing(b, 500, 500, disc, 1)
        result += [direction(c - b), direction(c - 500)]
    return result


def numbers(row: dict[str, str]) -> list[float]:
    """The drawn numbers of a row of key.csv, behind the column points."""
    drawn = list(row)[list(row).index("points") + 1 :]
    return [float(row[name].split()[0]) for name in drawn]


def check(rows: Iterator[dict[str, str]], of: Key, column: str = "value", rel: float = 1e-11) -> int:
    by_student: dict[str, list[dict[str, str]]] = {}
    for row in rows:
        by_student.setdefault(row["student"], []).append(row)
    for mine in by_student.values():
        expected = of(*numbers(mine[0]))
        assert [float(row[column]) for row in mine] == pytest.approx(expected, rel=rel)
    return len(by_student)


def test_every_exercise_has_its_formulas() -> None:
    assert sorted(KEYS) == sorted(EXERCISES)


FAST = ("exercise-slider-crank",)


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name in FAST else pytest.mark.slow) for name in EXERCISES]
)
def test_the_key_is_what_the_book_gives(name: str, dalembert: Dalembert, tmp_path: Path) -> None:
    """The key of the example's own command, by --expect, and that of ten students of another seed, by formulas."""
    assert dalembert("examples", name).returncode == 0
    words = shlex.split(describe(name)["command"])[1:]
    checked = dalembert(*words, "--expect", "expected.csv", "--rtol", "1e-9")
    assert checked.returncode == 0, checked.stdout + checked.stderr
    with (tmp_path / name / "key.csv").open() as stream:
        assert check(csv.DictReader(stream), KEYS[name]) == 3
    done = dalembert("exercise", f"{name}.toml", "--students", "10", "--seed", "7", "-o", "ten")
    assert done.returncode == 0, done.stderr
    with (tmp_path / "ten" / "key.csv").open() as stream:
        assert check(csv.DictReader(stream), KEYS[name]) == 10
