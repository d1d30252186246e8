"""`--digits` of trial masses, mode shapes, index balancing and placements, against 50 digits."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import mpmath as mp
import pytest

from benchmarks.truth.machines import even_marks, once_per_turn, shaking, turning_moments
from tests.cli.test_digits_of_balancing import holds, rows, vector
from tests.conftest import Dalembert


def test_a_trial_mass(dalembert: Dalembert) -> None:
    """Speeds in rpm have π in them, which no float has."""
    done = dalembert(
        "trial",
        "--rotor-mass",
        "120.1kg",
        "--speed",
        "2999.3rpm",
        "--radius",
        "0.3in",
        "--planes",
        "3",
        "--digits",
    )
    (row,) = rows(done)
    with mp.workdps(40):
        speed = mp.mpf("2999.3") * mp.pi / 30
        unbalance = mp.mpf("0.1") * mp.mpf("120.1") / 3 * mp.mpf("9.80665") / speed**2
        holds(row["unbalance_g_mm"], unbalance * 10**6, 14)
        holds(row["mass_g"], unbalance / (mp.mpf("0.3") * mp.mpf("0.0254")) * 1000, 14)


@pytest.mark.parametrize(("second", "fewest"), [("40", 13), ("10.0000001", 6)])
def test_modes(second: str, fewest: int, dalembert: Dalembert, tmp_path: Path) -> None:
    """A cubic through four stations, two masses; planes close together leave fewer digits."""
    z = ["0", "10", "30", "40"]
    shapes = [["0.1", "0.7", "0.9", "0.3"], ["0.3", "0.8", "-0.7", "-0.2"]]
    table = [f"{at},{a},{b}" for at, a, b in zip(z, *shapes, strict=True)]
    (tmp_path / "modes.csv").write_text("\n".join(["z_mm,first,second", *table]) + "\n")
    masses = [("2.3", "31.7", "7"), ("1.9", "204.1", "33")]
    head = "unbalance_g_mm,angle_deg,z_mm"
    text = "\n".join([head, *(",".join(one) for one in masses)]) + "\n"
    planes = ["--plane", "A:10mm:20mm", "--plane", f"B:{second}mm:20mm"]
    both = rows(dalembert("balance", "-", *planes, "--modes", "modes.csv", "--digits", stdin=text))

    def at(k: int, place: str) -> Any:
        x = [mp.mpf(one) for one in z]
        terms = [
            mp.fprod((mp.mpf(place) - x[i]) / (x[j] - x[i]) for i in range(4) if i != j) for j in range(4)
        ]
        return mp.fsum(mp.mpf(shape) * term for shape, term in zip(shapes[k], terms, strict=True))

    with mp.workdps(50):
        a = mp.matrix([[at(k, place) for place in ("10", second)] for k in range(2)])
        b = mp.matrix([sum(vector(m[0], m[1]) * at(k, m[2]) for m in masses) for k in range(2)])
        for row, w in zip(both, mp.lu_solve(a, -b), strict=True):
            holds(row["unbalance_g_mm"], abs(w), fewest)
            holds(row["angle_deg"], mp.degrees(mp.arg(w)) % 360, fewest, 360)


@pytest.mark.parametrize(
    ("last", "lag", "fewest"), [("213.7", False, 13), ("0.0031", False, 9), ("213.7", True, 13)]
)
def test_index_balancing(last: str, lag: bool, fewest: int, dalembert: Dalembert) -> None:
    """Three positions, or nearly one; phases that lag; what the parts do not explain."""
    read = [("0", "5.3", "31.7"), ("71.3", "3.1", "204.1"), (last, "4.7", "99")]
    if fewest < 13:
        del read[1]
    text = "\n".join(["turned_deg,amplitude_um,phase_deg", *(",".join(one) for one in read)]) + "\n"
    both = rows(dalembert("index", "-", *(["--phase-lag"] if lag else []), "--digits", stdin=text))
    with mp.workdps(50):
        v = [vector(size, f"-{angle}" if lag else angle) for _, size, angle in read]
        e = [vector("1", turn) for turn, *_ in read]
        mean, middle = (mp.fsum(x) / len(read) for x in (e, v))
        size = mp.fsum(abs(x - mean) ** 2 for x in e)
        rotor = mp.fsum(mp.conj(x - mean) * y for x, y in zip(e, v, strict=True)) / size
        mandrel = middle - mean * rotor
        for row, true in zip(both, (rotor, mandrel), strict=True):
            holds(row["amplitude_um"], abs(true), fewest)
            holds(row["phase_deg"], mp.degrees(mp.arg(true)) % 360, fewest, 360)
            if len(read) == 3:
                square = mp.fsum(abs(y - mandrel - rotor * x) ** 2 for x, y in zip(e, v, strict=True))
                holds(row["uncertainty_um"], mp.sqrt(square / size / 2), fewest - 1)


@pytest.mark.parametrize(("weights", "size"), [(("4", "4.1", "2"), "6"), (("4", "4.1", "9"), "6.3")])
def test_weights_that_stand_at_any_angle(weights: tuple[str, ...], size: str, dalembert: Dalembert) -> None:
    """The angles close the polygon: weights and correction are its sides, and all its corners lie on one circle."""
    listed = ",".join(f"{w}g" for w in weights)
    placed = rows(dalembert("place", f"{size}g@30.3deg", "--weights", listed, "--digits"))
    with mp.workdps(40):
        *others, longest = sorted(mp.mpf(w) for w in (*weights, size))

        def others_half(d: Any) -> Any:
            """Of diameter d a side s has an arc of 2 asin(s/d)."""
            return mp.fsum(mp.asin(side / d) for side in others)

        # the longest side's may be the greater arc, and is then that of the others
        outside = others_half(longest) < mp.pi / 2

        def miss(d: Any) -> Any:
            own = mp.asin(longest / d)
            return others_half(d) - own if outside else others_half(d) + own - mp.pi

        bracket = (longest, 100 * longest) if outside else (longest, longest * 3)
        d = mp.findroot(miss, bracket, solver="anderson")
        arcs = {side: 2 * mp.asin(side / d) for side in (*others, longest)}
        if outside:
            arcs[longest] = 2 * mp.pi - arcs[longest]
        each = [arcs[mp.mpf(w)] for w in weights]
        turn, total = mp.mpf(0), mp.fsum(each)
        for row, arc in zip(placed, each, strict=True):
            angle = mp.degrees(turn + arc / 2 - total / 2) + mp.mpf("30.3")
            holds(row["angle_deg"], angle % 360, 13, 360)
            turn += arc


@pytest.mark.parametrize("depth", ["shallow", "deep"])
def test_holes_with_a_point(depth: str, dalembert: Dalembert) -> None:
    mass = {"shallow": "0.1", "deep": "10.3"}[depth]
    drill = "--drill", "10.1mm", "--density", "7850kg_m3", "--drill-point", "118deg"
    (row,) = rows(dalembert("place", f"{mass}g@30deg", *drill, "--digits"))
    with mp.workdps(40):
        volume, radius = mp.mpf(mass) / 1000 / 7850, mp.mpf("0.00505")
        slope = mp.tan(mp.radians(59))
        tip = radius / slope
        cone = mp.pi * radius**2 * tip / 3
        deep = (volume - cone) / (mp.pi * radius**2) + tip
        true = deep if depth == "deep" else mp.cbrt(3 * volume / (mp.pi * slope**2))
        holds(row["drill_depth_mm"], 1000 * true, 14)


def test_blades_that_are_filled(dalembert: Dalembert) -> None:
    """Two blades share what those between them, full to their limit, leave; seven blades have no angle that is a decimal."""
    options = (
        "--blades",
        "7",
        "--first",
        "0.3deg",
        "--max-mass",
        "0.7oz",
        "--at-radius",
        "0.3in",
        "--to-radius",
        "7mm",
    )
    placed = rows(dalembert("place", "1.3oz@40deg", "0.2oz@3rad", *options, "--digits"))
    with mp.workdps(40):
        goal = vector("1.3", "40") + mp.mpf("0.2") * mp.expj(3)
        goal *= mp.mpf("0.3") * mp.mpf("25.4") / 7
        arms = {
            row["position"]: mp.expj(mp.radians(mp.mpf("0.3") + 360 * mp.mpf(int(row["position"]) - 1) / 7))
            for row in placed
        }
        masses = {row["position"]: mp.mpf(row["mass_oz"]) for row in placed}
        free = [name for name, mass in masses.items() if mass < mp.mpf("0.69")]
        assert len(free) == 2
        assert len(placed) > 2
        rest = goal - mp.fsum(mp.mpf("0.7") * arm for name, arm in arms.items() if name not in free)
        a, b = (arms[name] for name in free)
        det = (mp.conj(a) * b).imag
        for name, true in zip(
            free, ((mp.conj(rest) * b).imag / det, (mp.conj(a) * rest).imag / det), strict=True
        ):
            text = next(row["mass_oz"] for row in placed if row["position"] == name)
            holds(text, true, 12)


def test_an_engine(dalembert: Dalembert) -> None:
    """Two cylinders of a V, whose forces nearly cancel along one axis: orders from the angles of the table as written."""
    table = [
        ("0.1", "60", "10.1", "45.3", "150.7", "500.3"),
        ("119.9", "-60.1", "-40.7", "45.3", "150.7", "499.9"),
    ]
    text = (
        "crank_deg,bank_deg,z_mm,throw_mm,rod_mm,reciprocating_g\n" + "\n".join(map(",".join, table)) + "\n"
    )
    printed = rows(dalembert("engine", "-", "--speed", "2999.3rpm", "--order", "4", "--digits", stdin=text))
    with mp.workdps(45):
        cylinders = [[mp.mpf(x) / (1 if i < 2 else 1000) for i, x in enumerate(row)] for row in table]
        forces, couples = shaking(cylinders, mp.mpf("2999.3") * mp.pi / 30, 4)
        for k in (0, 1, 3):
            for name, row in (("force", forces[k]), ("couple", couples[k])):
                heads = [
                    f"{name}_{axis}_{part}_N{'_m' * (name == 'couple')}"
                    for axis in "xy"
                    for part in ("cos", "sin")
                ]
                for head, true in zip(heads, row, strict=True):
                    holds(printed[k][head], true, 12)


def test_counterweights_and_shafts_of_an_engine(dalembert: Dalembert) -> None:
    text = "crank_deg,bank_deg,z_mm,throw_mm,rod_mm,reciprocating_g,rotating_g\n0.3,90,0,45.1,150,500,400.7\n"
    options = "--counterweight-share", "0.3", "--plane", "A:-0.1in:60mm", "--plane", "B:7mm:61mm"
    both = dalembert("engine", "-", "--speed", "1000rpm", *options, "--digits", "--text", stdin=text)
    json_too = dalembert("engine", "-", "--speed", "1000rpm", *options, "--json", stdin=text)
    assert both.returncode == 0
    weights = json.loads(json_too.stdout)["counterweights"]
    with mp.workdps(45):
        u = (mp.mpf("0.4007") + mp.mpf("0.15")) * mp.mpf("0.0451")
        a, b = mp.mpf("-0.00254"), mp.mpf("0.007")
        for weight, true in zip(weights, (u * b / (b - a), -u * a / (b - a)), strict=True):
            assert abs(weight["unbalance_kg_m"] - true) < 1e-15
            assert abs(weight["angle_deg"] - mp.mpf("180.3")) < 1e-12


@pytest.mark.parametrize("unit", ["deg", "rad"])
def test_a_flywheel(unit: str, dalembert: Dalembert) -> None:
    angles = {"deg": ["0", "30.1", "200.7", "360"], "rad": ["0", "0.5253", "3.5029", "6.283185307"]}[unit]
    torque = ["10.3", "700.9", "-90.1", "10.3"]
    text = f"angle_{unit},torque_lbf_ft\n" + "\n".join(map(",".join, zip(angles, torque, strict=True))) + "\n"
    (row,) = rows(
        dalembert("flywheel", "-", "--speed", "600.1rpm", "--fluctuation", "0.7%", "--digits", stdin=text)
    )
    with mp.workdps(45):
        share = [(mp.mpf(x) - mp.mpf(angles[0])) / (mp.mpf(angles[-1]) - mp.mpf(angles[0])) for x in angles]
        foot_pound = mp.mpf("0.3048") * mp.mpf("4.4482216152605")
        true = turning_moments([2 * mp.pi * x for x in share], [mp.mpf(x) * foot_pound for x in torque])
        holds(row["work_J"], true["work"], 14)
        holds(row["mean_torque_lbf_ft"], true["mean"] / foot_pound, 14)
        speed = mp.mpf("600.1") * mp.pi / 30
        holds(row["flywheel_inertia_kg_m2"], true["fluctuation"] / (mp.mpf("0.007") * speed**2), 13)


def test_a_recording(dalembert: Dalembert) -> None:
    """A vibration with a second order, in milliseconds; the mark is a ramp, or has two levels."""
    times = [mp.mpf(i) * mp.mpf("0.7") for i in range(90)]
    x = [f"{3 * math.cos(0.33 * i + 1) + math.sin(0.66 * i):.3f}" for i in range(90)]
    ramp = [f"{math.sin(0.33 * i - 0.2):.4f}" for i in range(90)]
    level = ["1" if math.sin(0.33 * i - 0.2) > 0.4 else "0" for i in range(90)]
    for mark in (ramp, level):
        text = "t_ms,mark,A_um\n" + "".join(f"{0.7 * i:.1f},{mark[i]},{x[i]}\n" for i in range(90))
        (row,) = rows(dalembert("signal", "-", "--digits", stdin=text))
        with mp.workdps(45):
            t, v, m = [at / 1000 for at in times], [mp.mpf(one) for one in x], [mp.mpf(one) for one in mark]
            half = (min(m) + max(m)) / 2
            rises = [i for i in range(89) if m[i] < half <= m[i + 1]]
            if mark is level:
                last = max(i for i in range(89) if m[i] >= half > m[i + 1])
                rises = [i for i in rises if i < last]
                marks = even_marks([t[i] for i in rises], [t[i + 1] for i in rises])
            else:
                marks = [t[i] + (half - m[i]) / (m[i + 1] - m[i]) * (t[i + 1] - t[i]) for i in rises]
            mean, deviation = once_per_turn(t, v, marks, 3)
            holds(row["amplitude_um"], abs(mean), 13)
            holds(row["phase_deg"], mp.degrees(mp.arg(mean)) % 360, 13, 360)
            holds(row["amplitude_uncertainty_um"], deviation, 10)
            holds(row["speed_rpm"], 60 * mp.mpf(len(marks) - 1) / (marks[-1] - marks[0]), 13)
