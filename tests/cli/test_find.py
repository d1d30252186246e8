"""`--find NAME --so-that QUANTITY=VALUE`: the ω, the length or the angle with which a quantity has a value.

Of mechanisms, of bodies and their shafts, of tops.
"""

from __future__ import annotations

import json
from math import asin, cos, degrees, radians, sin
from pathlib import Path
from typing import Any

import pytest

CRANK = (
    'gravity = [0, -10]\n[ground]\nO = [0, 0]\n[links.crank]\npoints = {{ O = [0, 0], P = [2, 0] }}\nmass = 3\ncenter = [1, 0]\n'
    '[input]\nlink = "crank"\nangle = "{angle} deg"\nspeed = {speed}\n'
)  # fmt: skip


def found(run: Any, command: str, *words: str) -> Any:
    done = run(command, "c.toml", *words, "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_the_speed_of_a_crank(dalembert: Any, tmp_path: Path) -> None:
    """v = ω·r: 5 m/s at r = 2 m needs 2.5 rad/s; its mirror image −2.5."""
    (tmp_path / "c.toml").write_text(CRANK.format(angle=0, speed=1))
    for v in (5, -5):
        document = found(dalembert, "mechanism", "--find", "input.speed", f"--so-that=P.vy={v}")
        assert document["found"] == {"input.speed_rad_s": pytest.approx(v / 2, rel=1e-14)}
        assert document["poses"][0]["points"]["P"]["vy_m_s"] == pytest.approx(v)
    assert found(dalembert, "mechanism", "--find", "input.speed", "--so-that", "P.vy=0")["found"] == {
        "input.speed_rad_s": pytest.approx(0, abs=1e-14)
    }


def test_the_angle_at_which_a_torque_holds(dalembert: Any, tmp_path: Path) -> None:
    """T = m·g·cos θ = 30·cos θ: 15 N·m at 60°; 31 at none."""
    (tmp_path / "c.toml").write_text(CRANK.format(angle=50, speed=0))
    document = found(dalembert, "forces", "--find", "input.angle", "--so-that", "crank.torque=15N_m")
    assert document["found"]["input.angle_deg"] == pytest.approx(60, rel=1e-12)
    done = dalembert("forces", "c.toml", "--find", "input.angle", "--so-that", "crank.torque=31")
    assert done.returncode == 1
    assert "no value in reach" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def test_a_length_in_the_unit_of_the_file(dalembert: Any, tmp_path: Path) -> None:
    (tmp_path / "c.toml").write_text(
        '[units]\nlength = "mm"\nangle = "deg"\n[ground]\nO = [0, 0]\n[links.crank]\n'
        'points = { O = [0, 0], P = [200, 0] }\n[input]\nlink = "crank"\nangle = 30\n'
    )
    document = found(dalembert, "mechanism", "--find", "links.crank.P.x", "--so-that", "P.y=150")
    assert document["found"] == {"links.crank.P.x_m": pytest.approx(0.3, rel=1e-13)}
    text = dalembert(
        "mechanism", "c.toml", "--find", "links.crank.P.x", "--so-that", "P.y=150", "--text"
    ).stdout
    assert "found: links.crank.P.x = 300 mm gives P.y = 0.15 m" in text
    document = found(dalembert, "mechanism", "--find", "input.angle", "--so-that", "P.y=150mm")
    assert document["found"]["input.angle_deg"] == pytest.approx(degrees(asin(0.75)), rel=1e-12)


def test_wrong_words(dalembert: Any, tmp_path: Path) -> None:
    (tmp_path / "c.toml").write_text(CRANK.format(angle=0, speed=1))
    for words, text in (
        (("--find", "input.speed"), "--so-that QUANTITY=VALUE"),
        (("--find", "input.speed", "--so-that", "P=3"), "expected one number"),
        (("--find", "input.speed", "--so-that", "P.vy"), "QUANTITY=VALUE"),
        (("--find", "input.sped", "--so-that", "P.vy=3"), "input.speed"),
        (("--find", "input.speed", "--so-that", "P.vy=3kg"), "expected a number"),
        (
            ("--find", "crank", "--so-that", "P.vy=3"),
            "'crank' is an input: expected its place in the file, input.angle",
        ),
        (("--set", "crank=3"), "'crank' is an input: expected its place in the file, input.angle"),
        (("--find", "input.speed", "--so-that", "P.vy=3", "--over", "0deg:90deg:30deg"), "one pose"),
        (("--find", "input.speed", "--so-that", "Q.vy=3"), "no link or point is named 'Q'"),
    ):
        done = dalembert("mechanism", "c.toml", *words)
        assert done.returncode == 2
        assert text in " ".join(done.stderr.split())


ROD = "part,shape,mass_kg,length_m,ry_deg\nrod,rod,4,1,{tilt}\n"
SHAFT = ("--shaft=-500mm:500mm", "--speed", "10rad_s")


def sought(run: Any, *words: str) -> Any:
    done = run(*words, "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_the_speed_of_a_shaft_with_an_oblique_rod(dalembert: Any, tmp_path: Path) -> None:
    """Riul's example 4: M = m·l²·ω²·sin 2β/24, R = M over the span; 20 N need ω² = 24·20/(m·l²·sin 2β)."""
    (tmp_path / "rod.csv").write_text(ROD.format(tilt=60))
    for sign in (1, -1):
        words = ("--find", "speed", f"--so-that=bearing1_dynamic.x={sign * 20}N")
        if sign < 0:
            assert "no value in reach" in dalembert("body", "rod.csv", *SHAFT, *words).stderr
            continue
        document = sought(dalembert, "body", "rod.csv", *SHAFT, *words)
        omega = (24 * 20 / (4 * sin(radians(120)))) ** 0.5
        assert document["found"] == {"speed_rad_s": pytest.approx(omega, rel=1e-13)}
        assert document["shaft"]["bearings"][0]["dynamic_N"][0] == pytest.approx(20, rel=1e-13)


def test_the_angle_of_the_rod(dalembert: Any, tmp_path: Path) -> None:
    """β with sin 2β = 24·12/(m·l²·ω²) = 0.72: of 23.0° and 67.0° the one nearest to 60°; in the file's unit."""
    (tmp_path / "rod.csv").write_text(ROD.format(tilt=60))
    words = ("--find", "rod.ry", "--so-that", "bearing1_dynamic.size=12")
    document = sought(dalembert, "body", "rod.csv", *SHAFT, *words)
    assert document["found"] == {"rod.ry_deg": pytest.approx(90 - degrees(asin(0.72)) / 2, rel=1e-12)}
    text = dalembert("body", "rod.csv", *SHAFT, *words, "--text").stdout
    assert text.startswith("found: rod.ry = 66.97")


def test_omega_of_a_body_without_one(dalembert: Any, tmp_path: Path) -> None:
    """H = I·ω: 2 kg·m²/s about y need 6 rad/s of a rod of 4 kg and 1 m; none where nothing is in the way."""
    (tmp_path / "rod.csv").write_text(ROD.format(tilt=0))
    document = sought(dalembert, "body", "rod.csv", "--find", "omega.y", "--so-that", "momentum.y=2")
    assert document["found"] == {"omega.y_rad_s": pytest.approx(6, rel=1e-14)}
    document = sought(dalembert, "body", "rod.csv", "--find", "rod.length", "--so-that", "principal.3=3")
    assert document["found"] == {"rod.length_m": pytest.approx(3, rel=1e-14)}


TOP = "inertia = [0.02, 0.02, 0.01]\nomega = [0, 0, 200]\nattitude = [{w}, {x}, 0, 0]\n[top]\nmgl = 2\n"


@pytest.mark.parametrize("tilt", [30.0, 75.0, 120.0])
def test_the_spin_of_a_top_that_precesses_at_a_rate(dalembert: Any, tmp_path: Path, tilt: float) -> None:
    """(I_t·cos θ)·ψ̇² − I_a·ω_z·ψ̇ + mgl = 0, solved for ω_z, and for θ."""
    w, x = cos(radians(tilt / 2)), sin(radians(tilt / 2))
    (tmp_path / "top.toml").write_text(TOP.format(w=w, x=x))
    rate = 0.5
    document = sought(dalembert, "spin", "top.toml", "--find", "omega.z", "--so-that", f"slow={rate}rad_s")
    omega = (2 + 0.02 * cos(radians(tilt)) * rate**2) / (0.01 * rate)
    assert document["found"] == {"omega.z_rad_s": pytest.approx(omega, rel=1e-13)}
    assert document["steady"]["slow_rad_s"] == pytest.approx(rate, rel=1e-13)
    rate = 1.002
    document = sought(dalembert, "spin", "top.toml", "--find", "tilt", "--so-that", f"slow={rate}")
    lean = (0.01 * 200 * rate - 2) / (0.02 * rate**2)
    assert cos(radians(document["found"]["tilt_deg"])) == pytest.approx(lean, rel=1e-9)


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("body", "rod.csv", "--find", "rod.ry"), "--so-that QUANTITY=VALUE"),
        (("body", "rod.csv", "--find", "rod.rx", "--so-that", "energy=3"), "rod.ry"),
        (("body", "rod.csv", "--find", "rod.ry", "--so-that", "momentum=3"), "momentum"),
        (("body", "rod.csv", "--find", "omega.x", "--so-that", "energy=3kg"), "in J"),
        (("body", "two.csv", "--find", "p.mass", "--so-that", "mass=3"), "one body"),
        (("spin", "top.toml", "--find", "top.mg", "--so-that", "slow=3"), "top.mgl"),
        (
            ("spin", "top.toml", "--find", "top.mgl", "--so-that", "slow=3", "--time", "0:1:0.1"),
            "one instant",
        ),
    ],
)
def test_what_a_body_cannot_be_asked_for(
    dalembert: Any, tmp_path: Path, words: tuple[str, ...], expected: str
) -> None:
    (tmp_path / "rod.csv").write_text(ROD.format(tilt=60))
    (tmp_path / "two.csv").write_text("body,part,shape,mass_kg\nA,p,point,1\nB,q,point,1\n")
    (tmp_path / "top.toml").write_text(TOP.format(w=1, x=0))
    done = dalembert(*words)
    assert done.returncode == 2
    assert done.stdout == ""
    assert expected in " ".join(done.stderr.split())


def test_a_table_alone_has_the_number_beside_it(dalembert: Any, tmp_path: Path) -> None:
    """CSV has the quantity, which is as it was to be; what was found stands on standard error, once."""
    (tmp_path / "c.toml").write_text(CRANK.format(angle=0, speed=1))
    words = ("c.toml", "--find", "input.speed", "--so-that", "P.vy=5")
    said = "note: found: input.speed = 2.5 rad/s gives P.vy = 5 m/s\n"
    for form in ((), ("-o", "out.csv"), ("-o", "out.md")):
        done = dalembert("mechanism", *words, *form)
        assert (done.returncode, done.stderr) == (0, said)
    for form in (("--text",), ("--json",), ("-o", "out.json")):
        assert dalembert("mechanism", *words, *form).stderr == ""
    expected = dalembert("mechanism", *words, "--expect", "out.csv")
    assert (expected.returncode, expected.stderr.splitlines()[-1]) == (0, said.strip())
