"""`--digits` of body and spin: what is printed agrees with fractions and 50 digits, to the last digit printed."""

from __future__ import annotations

import csv
import io
from dataclasses import replace
from fractions import Fraction

import mpmath as mp
import numpy as np
import pytest

from benchmarks.truth.rotation import period_of, taylor
from cli.body.states import constants
from dalembert.tables.exact import LONG, as_written
from dalembert.tables.table import Numbers
from rigidbody3d.rotation_in_time import Rotation
from rigidbody3d.turning_body import read_body

F = Fraction


def printed(done) -> dict[str, list[str]]:
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader(io.StringIO(done.stdout)))
    return {name: [row[name] for row in rows] for name in rows[0]}


def digits(cell: str) -> int:
    return len(cell.lower().split("e")[0].replace(".", "").lstrip("-0")) if float(cell) else 0


def holds(cell: str, true: F, size: F = F(0)) -> None:
    """Assert that a cell is right to one and a half of its last digit; zero: that nothing of `size` is left to print."""
    value = F(float(cell))
    if not value:
        assert abs(true) <= size, (cell, float(true))
        return
    exponent = int(f"{float(cell):.16e}".split("e")[1])
    assert abs(value - true) <= F(3, 2) * F(10) ** (exponent - digits(cell) + 1), (cell, float(true))


def cylinder(mass: F, radius: F, length: F) -> list[F]:
    across = mass * (3 * radius**2 + length**2) / 12
    return [across, across, mass * radius**2 / 2]


def test_a_hole_that_leaves_next_to_nothing(dalembert, tmp_path) -> None:
    mass, hole, length, inner = "3.63", "-3.6299999", "30.3", "30.2999"
    (tmp_path / "p.csv").write_text(
        "part,shape,mass_kg,radius_mm,length_mm,x_mm,z_mm\n"
        f"a,cylinder,{mass},200.7,{length},406.1,7.7\nhole,cylinder,{hole},200.7,{inner},406.1,7.7\n"
    )
    found = printed(dalembert("body", "p.csv", "--digits", "--omega", "0.1,4.3,12.7", "--about", "0.3,0,0"))
    outer = cylinder(F(mass), F("0.2007"), F(length) / 1000)
    whole = [a + b for a, b in zip(outer, cylinder(F(hole), F("0.2007"), F(inner) / 1000), strict=True)]
    total = F(mass) + F(hole)
    holds(found["mass_kg"][0], total)
    assert digits(found["mass_kg"][0]) <= 10
    assert digits(found["inertia_z_kg_m2"][2]) >= 6
    for cell, true in zip(found["center_m"], (F("0.4061"), F(0), F("0.0077")), strict=True):
        holds(cell, true)
        assert digits(cell) <= 10
    omega = [F("0.1"), F("4.3"), F("12.7")]
    for i, axis in enumerate("xyz"):
        cell = found[f"inertia_{axis}_kg_m2"][i]
        holds(cell, whole[i])
        assert digits(cell) <= 11
        holds(found["momentum_kg_m2_s"][i], whole[i] * omega[i])
    energy = sum(a * w * w for a, w in zip(whole, omega, strict=True)) / 2
    holds(found["energy_J"][0], energy)
    rate = [
        (whole[(i + 2) % 3] - whole[(i + 1) % 3]) * omega[(i + 1) % 3] * omega[(i + 2) % 3] for i in range(3)
    ]
    for cell, true in zip(found["momentum_rate_N_m"], rate, strict=True):
        holds(cell, true, F(1, 10**14))
    # without the option every digit of the arithmetic is there
    plain = printed(dalembert("body", "p.csv", "--omega", "0.1,4.3,12.7"))
    assert digits(plain["momentum_kg_m2_s"][2]) > digits(found["momentum_kg_m2_s"][2])


def test_an_ordinary_body_keeps_its_digits_and_the_table_is_cut_too(dalembert, tmp_path) -> None:
    (tmp_path / "p.csv").write_text(
        "part,shape,mass_kg,width_in,height_in,depth_in\nb,box,12.7,1.7,2.9,3.1\n"
    )
    found = printed(dalembert("body", "p.csv", "--digits"))
    inch = F(127, 5000)
    a, b, c = (F(x) * inch for x in ("1.7", "2.9", "3.1"))
    for i, true in enumerate((b * b + c * c, a * a + c * c, a * a + b * b)):
        cell = found[f"inertia_{'xyz'[i]}_kg_m2"][i]
        holds(cell, F("12.7") * true / 12)
        assert digits(cell) >= 13
    (tmp_path / "q.csv").write_text(
        "part,shape,mass_kg,radius_m,x_m\na,sphere,1,1,1\nhole,sphere,-0.9999999999999,1,1\n"
    )
    table = dalembert("body", "q.csv", "--digits", "--text").stdout
    row = next(line for line in table.splitlines() if line.startswith("mass_kg"))
    assert digits(row.split()[1]) <= 3
    holds(row.split()[1], F(1, 10**13))


def test_a_part_far_away(dalembert, tmp_path) -> None:
    (tmp_path / "p.csv").write_text(
        "part,shape,mass_kg,radius_mm,x_m\na,sphere,1.1,31,12345678.9\nb,sphere,2.3,17,12345678.93\n"
    )
    found = printed(dalembert("body", "p.csv", "--digits"))
    m, n, gap = F("1.1"), F("2.3"), F("0.03")
    own = F(2, 5) * (m * F("0.031") ** 2 + n * F("0.017") ** 2)
    cell = found["inertia_y_kg_m2"][1]
    holds(cell, own + m * n / (m + n) * gap**2)
    assert 4 <= digits(cell) <= 9  # the place is read to 1e-9 m
    holds(found["inertia_x_kg_m2"][0], own, F(1))
    holds(found["center_m"][0], (m * F("12345678.9") + n * F("12345678.93")) / (m + n))


@pytest.mark.parametrize("apart", ["1e-3", "1e-9", "1e-14"])
def test_nearly_equal_principal_moments(dalembert, tmp_path, apart) -> None:
    (tmp_path / "p.csv").write_text(
        "part,shape,mass_kg,ixx_kg_m2,iyy_kg_m2,izz_kg_m2,ixy_kg_m2,ixz_kg_m2\n"
        f"a,tensor,1,1.3,1.3,2.1,{apart},-{apart}\n"
    )
    found = printed(dalembert("body", "p.csv", "--digits"))
    with mp.workdps(50):
        e = mp.mpf(apart)
        t = mp.mpf("1.3")
        values, vectors = mp.eigsy(mp.matrix([[t, -e, e], [-e, t, 0], [e, 0, mp.mpf("2.1")]]))
        order = sorted(range(3), key=lambda i: values[i])
        cells = np.array([found[f"principal_axis_{i + 1}"] for i in range(3)])
        for i, k in enumerate(order):
            holds(found["principal_kg_m2"][i], F(str(values[k])))
            true = [F(str(vectors[j, k])) for j in range(3)]
            largest = max(range(3), key=lambda j: abs(true[j]))
            if float(cells[i, largest]) * true[largest] < 0:
                true = [-x for x in true]
            for cell, x in zip(cells[i], true, strict=True):
                holds(cell, x, F(2))
    shown = max(digits(cell) for cell in cells[0])
    assert shown <= {"1e-3": 14, "1e-9": 8, "1e-14": 3}[apart]
    assert shown >= {"1e-3": 10, "1e-9": 4, "1e-14": 0}[apart]


def test_a_shaft_and_its_corrections(dalembert, tmp_path) -> None:
    (tmp_path / "p.csv").write_text(
        "part,shape,mass_kg,x_mm,y_mm,z_mm\na,point,1.7,31.3,0,100.1\nb,point,1.7,-31.2999,0.1,99.9\nc,point,9.1,0,0,55.5\n"
    )
    options = (
        "--shaft",
        "0mm:400mm",
        "--speed",
        "100rad_s",
        "--correct",
        "A:10mm:20mm",
        "--correct",
        "B:300mm:20mm",
    )
    found = printed(dalembert("body", "p.csv", *options, "--digits"))
    parts = [
        (F("1.7"), F("0.0313"), F(0), F("0.1001")),
        (F("1.7"), F("-0.0312999"), F("0.0001"), F("0.0999")),
    ]
    for name, here, other in (("bearing1", F(0), F("0.4")), ("bearing2", F("0.4"), F(0))):
        for i, cell in enumerate(found[f"{name}_dynamic_N"][:2]):
            holds(cell, sum(-m * 10000 * at[i] * (at[2] - other) for m, *at in parts) / (here - other))
        for cell in found[f"{name}_corrected_N"][:3]:
            holds(cell, F(0), F(1, 10**9))
    for row, here, other in ((3, F("0.01"), F("0.3")), (4, F("0.3"), F("0.01"))):
        x, y = (-sum(m * at[i] * (at[2] - other) for m, *at in parts) / (here - other) for i in range(2))
        with mp.workdps(40):
            X, Y = (mp.mpf(v.numerator) / v.denominator for v in (x, y))
            holds(found["correction_unbalance_kg_m"][row], F(str(mp.hypot(X, Y))))
            holds(found["correction_mass_kg"][row], F(str(mp.hypot(X, Y) / mp.mpf("0.02"))))
            holds(found["correction_angle_deg"][row], F(str(mp.degrees(mp.atan2(Y, X)) % 360)))
        assert digits(found["correction_mass_kg"][row]) >= 6


SPUN = (
    ([1.0, 2.0, 3.0], [0.01, 1.0, 0.01], 0.0, 9.0),
    ([1.0, 1.0 + 1e-9, 1.5], [0.3, 1.2, -7e-6], 0.0, 8.0),
    ([1.0, 1.0, 0.6], [0.5, 1.0, 3.0], 1.2, 2.5),
)


@pytest.mark.parametrize("method", ["exact", "integrate"])
@pytest.mark.parametrize(("inertia", "omega", "mgl", "t"), SPUN)
def test_rotations(dalembert, tmp_path, inertia, omega, mgl, t, method) -> None:
    top = f"[top]\nmgl = {mgl}\n" if mgl else ""
    (tmp_path / "b.toml").write_text(f"inertia = {inertia}\nomega = {omega}\n{top}")
    found = printed(dalembert("spin", "b.toml", "--at", t, "--method", method, "--digits"))
    inertia, omega, mgl = [F(str(x)) for x in inertia], [F(str(x)) for x in omega], F(str(mgl))
    w, q = taylor(inertia, omega, t, mgl=mgl)
    for axis, true in zip("xyz", w, strict=True):
        holds(found[f"omega_{axis}_rad_s"][0], true, F(1, 10**9))
    sign = 1 if float(found["attitude_w"][0]) * q[0] > 0 else -1
    for axis, true in zip("wxyz", q, strict=True):
        holds(found[f"attitude_{axis}"][0], sign * true, F(1, 10**9))
    energy = sum(F(a) * F(b) ** 2 for a, b in zip(inertia, omega, strict=True)) / 2 + F(mgl)
    holds(found["energy_J"][0], energy)
    assert digits(found["attitude_w"][0]) >= (11 if method == "exact" else 8)


def test_long_times_leave_fewer_digits(dalembert, tmp_path) -> None:
    # a body of revolution, whose rotation 50 digits give for any time
    (tmp_path / "b.toml").write_text("inertia = [1, 1, 1.7]\nomega = [0.3, 0.4, 2.3]\n")
    found = printed(
        dalembert("spin", "b.toml", *(x for t in ("1e2", "1e6", "1e12") for x in ("--at", t)), "--digits")
    )
    with mp.workdps(50):
        for row, t in enumerate((1e2, 1e6, 1e12)):
            # the file's 1.7 is seventeen tenths
            turn = mp.mpf("2.3") * (1 - mp.mpf("1.7")) * t
            x, y = mp.mpf("0.3"), mp.mpf("0.4")
            # in the body ω turns about its axis by -(I3 - I1)/I1 ω3 the other way round
            true = (x * mp.cos(turn) + y * mp.sin(turn), y * mp.cos(turn) - x * mp.sin(turn))
            for axis, value in zip("xy", true, strict=True):
                holds(found[f"omega_{axis}_rad_s"][row], F(str(value)), F(1, 1000))
    shown = [digits(cell) for cell in found["omega_x_rad_s"]]
    assert shown[0] >= 12 > shown[1] >= 7 > shown[2] >= 2


def test_a_body_of_parts_hands_its_error_on(dalembert, tmp_path) -> None:
    (tmp_path / "p.csv").write_text(
        "part,shape,mass_kg,width_m,height_m,depth_m\na,box,1,1,2,3\nhole,box,-0.99999999,1,2,2.99999999\n"
    )
    (tmp_path / "b.toml").write_text('parts = "p.csv"\nomega = [1, 2, 3]\n')
    found = printed(dalembert("spin", "b.toml", "--at", "1", "--digits"))
    m, n, d, e = F(1), F("0.99999999"), F(3), F("2.99999999")
    moments = [(m * (a + d * d) - n * (a + e * e)) / 12 for a in (F(4), F(1))] + [(m - n) * 5 / 12]
    w, _ = taylor(moments, [1, 2, 3], 1)
    for axis, true in zip("xyz", w, strict=True):
        holds(found[f"omega_{axis}_rad_s"][0], true)
        assert 3 <= digits(found[f"omega_{axis}_rad_s"][0]) <= 9


def test_what_is_constant_in_a_rotation_has_its_error_too(tmp_path) -> None:
    (tmp_path / "b.toml").write_text("inertia = [1.1, 2.3, 3.1]\nomega = [0.3, 0.4, 2.3]\n")
    (tmp_path / "t.toml").write_text(
        "inertia = [0.002, 0.002, 0.0008]\nomega = [0, 0, 60.1]\nattitude = [3, 4, 0, 0]\ntop.mgl = 0.1962\n"
    )

    def of(name: str) -> dict[str, tuple[float, float]]:
        rotation = Rotation(read_body(str(tmp_path / name)), np.array([1.0]), None, "DOP853")
        columns = [column for column in constants(rotation).columns if column.error is not None]
        return {column.name: (column.values[0], float(column.error()[0])) for column in columns}

    value, error = of("b.toml")["period"]
    true = period_of([F("1.1"), F("2.3"), F("3.1")], [F("0.3"), F("0.4"), F("2.3")])
    assert abs(F(value) - true) <= F(error) <= F("1.02") * abs(F(value) - true)
    # upright less 2·arctan(4/3): its cosine is -7/25
    I1, I3, a, w, c = F("0.002"), F("0.0008"), F("0.1962"), F("60.1"), F(-7, 25)
    with mp.workdps(50):
        B = mp.mpf((I3 * w).numerator) / (I3 * w).denominator
        D = (I3 * w) ** 2 - 4 * I1 * a * c
        root = mp.sqrt(mp.mpf(D.numerator) / D.denominator)
        double = 2 * I1 * c
        rates = {
            "fast": (B + root) * double.denominator / double.numerator,
            "slow": 2 * mp.mpf(a.numerator) / a.denominator / (B + root),
        }
        found = of("t.toml")
        for name, exact in rates.items():
            value, error = found[name]
            off = abs(mp.mpf(value) - exact)
            assert off <= error <= 1.02 * off
        assert found["nutation_period"][1] < 1e-15


def test_the_third_axis_of_a_ring_that_lies_aslant(dalembert, tmp_path) -> None:
    (tmp_path / "p.csv").write_text(
        "part,shape,radius_mm,mass_kg,axis_x,axis_y\nrim,ring,187.6,4.31,-1,0.3\n"
    )
    shown = printed(dalembert("body", "p.csv", "--digits"))
    size = F(mp.nstr(1 / mp.sqrt(F(109, 100)), 30))
    sign = 1 if float(shown["principal_axis_3"][1]) > 0 else -1
    for cell, true in zip(shown["principal_axis_3"], (-size, F(3, 10) * size, F(0)), strict=True):
        holds(cell, sign * true)
    assert min(map(digits, shown["principal_axis_3"][:2])) >= 14


@pytest.mark.parametrize("unit", ["mm", "in", "deg", "rpm", "Hz", "lbf_ft", "kg_m2", "oz_in", "1e9"])
def test_a_long_column_is_as_exact_as_a_short_one(unit: str) -> None:
    dimension = {
        "deg": "angle",
        "rpm": "speed",
        "Hz": "speed",
        "lbf_ft": "torque",
        "kg_m2": "inertia",
        "oz_in": "unbalance",
    }
    values = np.random.default_rng(1).integers(-10000, 10000, LONG) / 1000.0
    if unit == "1e9":
        # too many figures at once for whole numbers
        values, unit = values * 10.0 ** np.arange(LONG), "mm"
    many = Numbers("x", unit, values, dimension.get(unit, "length"))
    exact = as_written(many)
    for i in range(LONG):
        one = as_written(replace(many, values=values[i : i + 1]))
        off = (F(exact.high[i]) - F(one.high[0])) + (F(exact.low[i]) - F(one.low[0]))
        assert abs(off) <= abs(F(one.high[0])) * F(1, 2**103)
