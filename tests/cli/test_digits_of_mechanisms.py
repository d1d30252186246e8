"""`--digits` of `dalembert mechanism` and `dalembert work`: every digit printed holds, against mpmath."""

from __future__ import annotations

import csv
import io
import math
from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import mpmath as mp
import pytest

from benchmarks.truth.four_bar import coupler_point
from benchmarks.truth.mechanism import Exact
from tests.cli.printed import table
from tests.conftest import Dalembert
from virtualwork import Mechanism

# 40 digits
PI = Fraction("3.141592653589793238462643383279502884197")

# the triple rocker of 2.1, 1.3, 0.9 and 2.7 ends where coupler and rocker are in line
LENGTHS = ("2.1", "1.3", "0.9", "2.7")
FOUR_BAR = """
[ground]
A = [0, 0]
D = [2.7, 0]
[links.crank]
points = { A = [0, 0], B = [2.1, 0] }
mass = 1.7
center = [0.9, 0.1]
inertia = 0.31
[links.coupler]
points = { B = [0, 0], C = [1.3, 0] }
mass = 0.6
center = [0.7, 0.2]
inertia = 0.11
[links.rocker]
points = { D = [0, 0], C = [0.9, 0] }
mass = 2.3
center = [0.4, -0.1]
inertia = 0.17
[input]
link = "crank"
speed = 3.3
acceleration = 1.9
[guess]
at = "40 deg"
C = [2.9, 0.85]
"""


def near(mark: float) -> str:
    """An angle so far, rad, from the limit of the input, in degrees."""
    with mp.workdps(40):
        a, b, c, d = map(mp.mpf, LENGTHS)
        limit = mp.acos((a**2 + d**2 - (b + c) ** 2) / (2 * a * d))
        return mp.nstr(mp.degrees(limit - mark), 17)


POSES = [pytest.param("40", 11, id="ordinary"), pytest.param(near(1e-7), 5, id="1e-7 from a dead point")]


def holds(text: str, true: mp.mpf) -> int:
    """Assert that every digit printed agrees with the true number; return how many there are."""
    if float(text) == 0:  # no digit holds, or it is zero
        return 0
    assert abs(mp.mpf(text) - true) <= 0.6 * unit(text), (text, mp.nstr(true, 20))
    return len(Decimal(text).normalize().as_tuple().digits)


def unit(text: str) -> mp.mpf:
    """One in the last digit that is not zero."""
    return mp.mpf(10) ** int(Decimal(text).normalize().as_tuple().exponent)


def solved(file: Path, angle: str) -> Exact:
    """The pose in 50 digits, at the very angle asked for."""
    motion = Mechanism.from_toml(str(file)).motion(math.radians(float(angle)), 3.3, 1.9)
    with mp.workdps(50):
        return Exact(motion, inputs=[mp.radians(mp.mpf(angle))])


@pytest.fixture
def four_bar(tmp_path: Path) -> Path:
    path = tmp_path / "four-bar.toml"
    path.write_text(FOUR_BAR)
    return path


@pytest.mark.parametrize("off", ["1e-5", pytest.param("1e-3", marks=pytest.mark.slow)])
@pytest.mark.parametrize("where", ["file", "--at", pytest.param("--cases", marks=pytest.mark.slow)])
def test_angles_in_radians(dalembert: Dalembert, four_bar: Path, where: str, off: str) -> None:
    """An angle that is written in radians has its decimals there, not in degrees."""
    with mp.workdps(40):
        a, b, c, d = map(mp.mpf, LENGTHS)
        limit = mp.acos((a**2 + d**2 - (b + c) ** 2) / (2 * a * d))
        angles = [mp.nstr(limit - mp.mpf(off) * (1 + mp.mpf(k) / 7), 11) for k in range(6)]
    rows = []
    if where == "--cases":
        four_bar.with_name("cases.csv").write_text("\n".join(["crank_rad", *angles]))
    for angle in angles:
        poses = {"--at": ["--at", f"{angle}rad"], "--cases": ["--cases", four_bar.with_name("cases.csv")]}
        if where == "file":
            four_bar.write_text(
                FOUR_BAR.replace('link = "crank"\nspeed', f'link = "crank"\nangle = {angle}\nspeed')
            )
        call = (
            "mechanism",
            four_bar,
            *poses.get(where, []),
            "--only",
            "C",
            "--order",
            "velocity",
            "--digits",
        )
        rows += table(dalembert(*call))
        if where == "--cases":
            break
    with mp.workdps(40):
        for angle, row in zip(angles, rows, strict=True):
            pin, v, *_ = coupler_point(a, b, c, d, mp.mpf(angle), 1, mp.mpf("3.3"))
            true = {"C_x_m": pin.real, "C_y_m": pin.imag, "C_vx_m_s": v.real, "C_vy_m_s": v.imag}
            assert all(holds(row[name], x) >= 7 for name, x in true.items())


@pytest.mark.parametrize(("angle", "least"), POSES)
def test_motion(dalembert: Dalembert, four_bar: Path, angle: str, least: int) -> None:
    """The decimals of the file and of the angle are the data: what units and binary digits do to them counts too."""
    call = ("mechanism", four_bar, "--at", f"{angle}deg", "--only", "C,rocker", "--order", "acceleration")
    (cut,) = table(dalembert(*call, "--digits"))
    (whole,) = table(dalembert(*call))
    counts, wrong = [], 0
    with mp.workdps(50):
        q = mp.radians(mp.mpf(angle))
        exact = _motion(q)
        for name, true in exact.items():
            counts.append(holds(cut[name], true))
            wrong += abs(mp.mpf(whole[name]) - true) > 0.6 * unit(whole[name])
    assert min(counts) >= least
    assert wrong  # the uncut digits do not all hold: there is something to cut
    assert cut["input_deg"] == str(float(cut["input_deg"]))


def _motion(q: mp.mpf) -> dict[str, mp.mpf]:
    """C and the rocker, with the acceleration of the input: its part is v̇ = (dC/dq)·q̈."""
    a, b, c, d = map(mp.mpf, LENGTHS)
    speed, rate = mp.mpf("3.3"), mp.mpf("1.9")
    pin, v, steady, _ = coupler_point(a, b, c, d, q, 1, speed)
    acceleration = steady + v / speed * rate
    arm = pin - d
    turned, bent = v / arm / mp.mpc(0, 1), acceleration / arm
    return {
        "C_x_m": mp.re(pin),
        "C_y_m": mp.im(pin),
        "C_vx_m_s": mp.re(v),
        "C_vy_m_s": mp.im(v),
        "C_ax_m_s2": mp.re(acceleration),
        "C_ay_m_s2": mp.im(acceleration),
        "rocker_angle_deg": mp.degrees(mp.arg(arm)) % 360,
        "rocker_omega_rad_s": mp.re(turned),
        "rocker_alpha_rad_s2": mp.im(bent),
    }


@pytest.mark.parametrize(("angle", "least"), POSES)
def test_forces(dalembert: Dalembert, four_bar: Path, angle: str, least: int) -> None:
    (cut,) = table(dalembert("forces", four_bar, "--at", f"{angle}deg", "--digits"))
    exact = solved(four_bar, angle)
    with mp.workdps(50):
        true = exact.forces()
        counts = [
            holds(cut["input_torque_N_m"], true["input", "0", 0]),
            holds(cut["virtual_work_torque_N_m"], true["input", "0", 0]),
        ]
        assert cut["difference_torque_N_m"] == "0.0"
        for name, key, body in (
            ("A_ground_on_crank", "pin:A", "crank"),
            ("B_crank_on_coupler", "pin:B", "coupler"),
            ("C_coupler_on_rocker", "pin:C", "rocker"),
        ):
            for axis in range(2):
                counts.append(holds(cut[f"{name}_f{'xy'[axis]}_N"], true[key, body, axis]))
    assert max(counts) >= min(least, 10) - 2
    assert min(counts) >= 1


@pytest.mark.parametrize(("angle", "least"), POSES)
def test_states_and_their_balance(
    dalembert: Dalembert, four_bar: Path, tmp_path: Path, angle: str, least: int
) -> None:
    """The long table, cut, and the effort that `work` finds from the whole one."""
    states = tmp_path / "states.csv"
    call = ("forces", four_bar, "--at", f"{angle}deg", "--states", states)
    assert dalembert(*call, "--digits").returncode == 0
    cut = list(csv.DictReader(io.StringIO(states.read_text())))
    assert [row["torque_N_m"] for row in cut] == ["?", "0.0", "0.0"]
    assert cut[0]["mass_kg"] == "1.7"
    exact = solved(four_bar, angle)
    with mp.workdps(50):
        for row in cut:
            center = complex(exact.m.links[row["link"]].center)
            for names, order in ((("x_m", "y_m"), 0), (("vx_m_s", "vy_m_s"), 1), (("ax_m_s2", "ay_m_s2"), 2)):
                at = exact.point(row["link"], center, order)
                assert holds(row[names[0]], mp.re(at)) + holds(row[names[1]], mp.im(at)) > least // 2
    assert dalembert(*call).returncode == 0
    (found,) = table(dalembert("work", states, "--digits"))
    power = mp.mpf(0)
    with mp.workdps(50):
        rows = list(csv.DictReader(io.StringIO(states.read_text())))
        omega = None
        for row in rows:
            v = {key: mp.mpf(row[key] or 0) for key in row if key not in ("step", "link", "torque_N_m")}
            for x in "xy":
                power -= v["mass_kg"] * v[f"a{x}_m_s2"] * v[f"v{x}_m_s"]
            power -= v["inertia_kg_m2"] * v["alpha_rad_s2"] * v["omega_rad_s"]
            if row["torque_N_m"] == "?":
                omega = v["omega_rad_s"]
        assert omega is not None
        assert holds(found["torque_N_m"], -power / omega) >= 12


def test_work_with_a_cancelling_balance(dalembert: Dalembert, tmp_path: Path) -> None:
    """Powers that cancel leave fewer digits; the ledger keeps its own."""
    path = tmp_path / "states.csv"
    path.write_text(
        "link,vx_m_s,omega_rad_s,fx_N,torque_N_m\n1,0,0.3,0,?\n2,1.1,0,1000000.1,0\n3,-1.3,0,846153.93,0\n"
    )
    (found,) = table(dalembert("work", path, "--digits"))
    with mp.workdps(50):
        power = mp.mpf("1.1") * mp.mpf("1000000.1") - mp.mpf("1.3") * mp.mpf("846153.93")
        digits = holds(found["torque_N_m"], -power / mp.mpf("0.3"))
    assert 5 <= digits <= 11
    ledger = table(dalembert("work", path, "--digits", "--ledger"))
    assert [row["power_W"] for row in ledger][:2] == ["1100000.11", "-1100000.109"]


def test_json_keeps_every_digit(dalembert: Dalembert, four_bar: Path) -> None:
    call = ("mechanism", four_bar, "--at", "40deg", "--json")
    assert dalembert(*call).stdout == dalembert(*call, "--digits").stdout


@pytest.mark.parametrize(
    "name", ["boom/boom", "five-bar/five-bar", "crank-press/press", "scissors-lift/lift", "klann/klann"]
)
@pytest.mark.slow
def test_tables_of_every_kind(dalembert: Dalembert, name: str) -> None:
    """The cut table has the rows, names and marks of the whole one, and numbers that agree with it."""
    from importlib.resources import files

    file = str(files("cli") / "examples" / f"{name}.toml")
    only = ("mechanism", "--only", next(iter(Mechanism.from_toml(file).links)))
    for command, *extra in (("mechanism",), ("forces",), only):
        whole = table(dalembert(command, file, *extra))
        cut = table(dalembert(command, file, *extra, "--digits"))
        assert [row.keys() for row in whole] == [row.keys() for row in cut]
        for a, b in zip(whole, cut, strict=True):
            for key in a:
                try:
                    value, other = float(a[key]), float(b[key])
                except ValueError:
                    assert a[key] == b[key]
                else:
                    assert other == pytest.approx(value, rel=1e-9, abs=1e-9)


def test_an_input_of_a_whole_turn_is_shown_as_it_was_asked(dalembert: Dalembert, tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text(FOUR_BAR)
    done = dalembert("mechanism", "m.toml", "--at", "0deg", "--at", "360deg", "--digits", "--only", "C")
    assert [row["input_deg"] for row in csv.DictReader(io.StringIO(done.stdout))] == ["0.0", "360.0"]


def test_positions_of_rest(dalembert: Dalembert, tmp_path: Path) -> None:
    """A bar with a torque of 3 N m: m g r cos q = 3, stable below."""
    file = tmp_path / "bar.toml"
    file.write_text(
        "gravity = [0, -9.81]\nground.O = [0, 0]\n"
        "links.bar = { points = { O = [0, 0] }, mass = 2, center = [0.5, 0] }\n"
        'input.link = "bar"\ntorques = [{ link = "bar", torque = 3 }]\n'
    )
    above, below = table(dalembert("equilibrium", str(file), "--digits"))
    with mp.workdps(30):
        true = mp.degrees(mp.acos(3 / mp.mpf("9.81")))
        assert holds(above["input_deg"], true) >= 13
        assert holds(below["input_deg"], 360 - true) >= 13


def test_potential_and_period_of_a_pendulum(dalembert: Dalembert, tmp_path: Path) -> None:
    """The decimals of the file are the data: m g l and 2π √(I / (m g l)); 49.05, where 16 digits have 49.050000000000004."""
    file = tmp_path / "bar.toml"
    file.write_text(
        "gravity = [0, -9.81]\nground.O = [0, 0]\n"
        "links.bar = { points = { O = [0, 0] }, mass = 10, center = [0.5, 0], inertia = 0.7 }\n"
        'input.link = "bar"\n'
    )
    above, below = table(dalembert("equilibrium", file, "--digits"))
    with mp.workdps(30):
        assert (above["potential_J"], below["potential_J"]) == ("49.05", "-49.05")
        assert above["period_s"] == ""
        period = 2 * mp.pi * mp.sqrt(mp.mpf("3.2") / mp.mpf("49.05"))
        assert holds(below["period_s"], period) >= 14
    call = ("equilibrium", file, "--json")
    assert dalembert(*call).stdout == dalembert(*call, "--digits").stdout


@pytest.mark.parametrize("sign", [1, -1, 0])
@pytest.mark.parametrize("way", ["--cases", "law"])
def test_rates_of_a_table_over_time_have_all_digits(
    dalembert: Dalembert, tmp_path: Path, way: str, sign: int
) -> None:
    """A cubic is its own spline: of θ = 1000 t³ degrees every 0.01 s speed and acceleration are right to the last digit."""
    table = "".join(f"{k / 100},{sign * k**3 / 1000}\n" for k in range(60))
    (tmp_path / "law.csv").write_text(f"time_s,{'crank' if way == '--cases' else 'angle'}_deg\n{table}")
    law = 'law = "law.csv"\n' if way == "law" else ""
    text = (
        '[ground]\nO = [0, 0]\n[links.crank]\npoints = { O = [0, 0], P = [1, 0] }\n[input]\nlink = "crank"\n'
    )
    (tmp_path / "crank.toml").write_text(text + law)
    call = ["mechanism", str(tmp_path / "crank.toml"), "--only", "crank.omega,crank.alpha"]
    done = dalembert(*call, *(["--cases", str(tmp_path / "law.csv")] if way == "--cases" else []))
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader(io.StringIO(done.stdout)))
    assert len(rows) == 60
    for k, row in enumerate(rows):
        for name, exact in (
            ("omega_rad_s", Fraction(3 * k**2, 10)),
            ("alpha_rad_s2", Fraction(6 * k * 10)),
        ):
            right = float(sign * exact * PI / 180)
            assert float(row[f"crank_{name}"]) == pytest.approx(right, rel=4e-16, abs=1e-25)
