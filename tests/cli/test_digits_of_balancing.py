"""--digits of balance, field and place: every digit that is printed holds, and the others are not printed."""

from __future__ import annotations

import subprocess
import sys
from fractions import Fraction
from pathlib import Path
from typing import Any

import mpmath as mp
import numpy as np
import pytest

from dalembert.results.columns import Column, Table
from dalembert.results.digits import digits_that_hold
from dalembert.results.text import table_text
from tests.cli.printed import table as rows
from tests.conftest import Dalembert

HEAD = "run,sensor,amplitude_um,phase_deg,trial_plane,trial_mass_g,trial_angle_deg"


def vector(size: str, degrees: str) -> Any:
    """A vector of decimals as written, its angle reduced exactly."""
    turn = Fraction(degrees) % 360
    return mp.mpf(size) * mp.expj(mp.mpf(turn.numerator) / turn.denominator * mp.pi / 180)


def holds(printed: str, true: Any, fewest: int, modulo: float = 0.0) -> None:
    """Check a printed number to one unit of its last digit, and that it has digits enough to tell the true one."""
    text = printed.lower().split("e")[0].lstrip("-")
    digits = max(len(text.replace(".", "").strip("0")), 1)  # zeros at the end need not be digits
    value = mp.mpf(printed)
    unit = mp.mpf(10) ** (mp.floor(mp.log10(abs(true))) - digits + 1)
    off = abs(value - true)
    if modulo:
        off = min(off, abs(off - modulo))
    assert off <= unit, f"{printed}: {mp.nstr(true, 20)}"
    assert off <= mp.mpf(10) ** (1 - fewest) * abs(true), f"{printed}: {mp.nstr(true, 20)}"


def check(row: dict[str, str], w: Any, fewest: int) -> None:
    """Check mass and angle of a correction."""
    with mp.workdps(60):
        holds(row["mass_g"], abs(w), fewest)
        holds(row["angle_deg"], mp.degrees(mp.arg(w)) % 360, fewest, 360)


@pytest.mark.parametrize(
    ("v1", "fewest"),
    [(("1.8", "42"), 13), (("3.4000001", "116"), 5), (("3.40000000001", "116"), 1)],
)
def test_trial_runs_that_hardly_differ(v1: tuple[str, str], fewest: int, dalembert: Dalembert) -> None:
    text = f"{HEAD}\n0,1,3.4,116,,,\n1,1,{v1[0]},{v1[1]},A,2,0\n"
    (row,) = rows(dalembert("field", "-", "--digits", stdin=text))
    with mp.workdps(60):
        a, b = vector("3.4", "116"), vector(*v1)
        check(row, -a / (b - a) * 2, fewest)
    (full,) = rows(dalembert("field", "-", stdin=text))
    if fewest < 13:
        assert len(row["mass_g"]) < len(full["mass_g"])


def written(z: complex) -> tuple[str, str]:
    return f"{float(abs(z))!r}", f"{float(np.degrees(np.angle(z)))!r}"


@pytest.mark.parametrize(
    ("apart", "options", "fewest"),
    [(1.0, (), 12), (1e-8, (), 5), (1.0, ("--from-here",), 12), (1e-4, ("--ridge", "0.1"), 9)],
)
def test_two_planes(apart: float, options: tuple[str, ...], fewest: int, dalembert: Dalembert) -> None:
    """Three sensors; the second plane is nearly the first one's double, and the first trial mass may stay on."""
    rng = np.random.default_rng(5)
    alpha = rng.normal(size=(3, 2)) + 1j * rng.normal(size=(3, 2))
    alpha[:, 1] = 2 * alpha[:, 0] + apart * alpha[:, 1]
    v0 = rng.normal(size=3) + 1j * rng.normal(size=3)
    kept = "--from-here" in options
    first, second = v0 + alpha[:, 0] * 3, v0 + alpha[:, 1] * 2j + (alpha[:, 0] * 3 if kept else 0)
    readings = [[written(z) for z in run] for run in (v0, first, second)]
    cells = [",,,", f"A,3,0,{'yes' if kept else ''}", "B,2,90,"]
    table = [f"{r},{s},{v[0]},{v[1]},{cells[r]}" for r, run in enumerate(readings) for s, v in enumerate(run)]
    text = "\n".join([HEAD + ",trial_kept", *table]) + "\n"
    found = rows(dalembert("field", "-", *options, "--digits", stdin=text))
    with mp.workdps(60):
        runs = [[vector(*v) for v in run] for run in readings]
        t = [vector("3", "0"), vector("2", "90")]
        a = mp.matrix(3, 2)
        for s in range(3):
            a[s, 0] = (runs[1][s] - runs[0][s]) / t[0]
            a[s, 1] = (runs[2][s] - (runs[1][s] if kept else runs[0][s])) / t[1]
        b = mp.matrix(runs[0])
        if "--ridge" in options:
            a2, b2 = mp.zeros(5, 2), mp.zeros(5, 1)
            a2[:3, :], b2[:3, :] = a, b
            for p in range(2):
                a2[3 + p, p] = mp.mpf("0.1") * mp.norm(a[:, p])
            a, b = a2, b2
        w = mp.lu_solve(a.H * a, -(a.H * b))
        if kept:
            # every mass of the last run stands
            w[0] -= t[0]
            w[1] -= t[1]
        for row, exact in zip(found, w, strict=True):
            check(row, exact, fewest)


@pytest.mark.parametrize(("turn", "fewest"), [("60", 12), ("20.0000001", 11)])
def test_a_fit_of_all_runs(turn: str, fewest: int, dalembert: Dalembert) -> None:
    """Two states in runs of their own; masses that hardly differ leave fewer digits."""
    log = [
        ("n", "99.03", "43.97", "10", "20"),
        ("n", "75.3", "48.5", "10", turn),
        ("n", "99.1", "44", "10", "20"),
    ]
    log += [
        ("u", "60.2", "55", "10", "20"),
        ("u", "71.9", "51.25", "20", "-31.7"),
        ("u", "58.8", "52", "0", "0"),
    ]
    text = "state;amplitude_um;phase;mass_g;phase\n" + "\n".join(";".join(row) for row in log)
    (row,) = rows(dalembert("field", "-", "--digits", stdin=text))
    (full,) = rows(dalembert("field", "-", stdin=text))
    with mp.workdps(60):
        top, below = mp.mpc(0), mp.mpf(0)
        for state in "nu":
            mine = [one for one in log if one[0] == state]
            y = mp.matrix([vector(one[1], one[2]) for one in mine])
            a = mp.matrix([[1, vector(one[3], one[4])] for one in mine])
            x0, alpha = mp.lu_solve(a.H * a, a.H * y)
            top, below = top - mp.conj(alpha) * x0, below + abs(alpha) ** 2
        check(row, top / below, fewest)
        # as many digits as are right, or one fewer
        mass = 1000 * abs(top / below)
        right = -mp.log10(abs(mp.mpf(full["mass_g"]) / mass - 1))
        assert len(row["mass_g"].replace(".", "").strip("0")) >= right - 1


def test_four_runs(dalembert: Dalembert) -> None:
    head = "run,sensor,amplitude_um,trial_plane,trial_mass_g,trial_angle_deg"
    text = f"{head}\n0,1,6.1,,,\n1,1,7.7,A,12.3,0\n2,1,3.2,A,12.3,120\n3,1,10.3,A,12.3,240\n"
    (row,) = rows(dalembert("field", "-", "--method", "four-run", "--digits", stdin=text))

    with mp.workdps(40):
        read = [mp.mpf(x) for x in ("7.7", "3.2", "10.3")]
        t = [vector("12.3", x) for x in ("0", "120", "240")]

        def pull(x: Any, y: Any) -> tuple[Any, Any]:
            """The derivatives of the sum of squares."""
            effects = [mp.mpf("6.1") + mp.mpc(mp.re(x), mp.re(y)) * m for m in t]
            parts = [(abs(e) - r) * mp.conj(e) / abs(e) * m for e, r, m in zip(effects, read, t, strict=True)]
            return mp.fsum(p.real for p in parts), mp.fsum(p.imag for p in parts)

        root = mp.findroot(pull, (mp.mpf("0.001"), mp.mpf("-0.37")))
        check(row, -mp.mpf("6.1") / mp.mpc(mp.re(root[0]), mp.re(root[1])), 12)


def test_limited_and_minimax(dalembert: Dalembert) -> None:
    """One plane that moves two sensors alike: minimax leaves half the difference at both; a limit is what it is."""
    text = f"{HEAD}\n0,1,3,0,,,\n0,2,1.1,0,,,\n1,1,4,0,A,2,0\n1,2,2.1,0,A,2,0\n"
    (row,) = rows(dalembert("field", "-", "--objective", "minimax", "--digits", stdin=text))
    check(row, mp.mpf("-4.1"), 12)
    (row,) = rows(dalembert("field", "-", "--max-mass", "1.3g", "--digits", stdin=text))
    check(row, mp.mpf("-1.3"), 12)


def test_an_optimum_that_is_not_one_point_stays_whole_and_is_named(dalembert: Dalembert) -> None:
    text = (
        f"{HEAD}\n0,1,3,10,,,\n0,2,1,50,,,\n1,1,4,10,A,2,0\n1,2,2,50,A,2,0\n2,1,4,10,B,2,0\n2,2,2,50,B,2,0\n"
    )
    done = dalembert("field", "-", "--objective", "minimax", "--max-mass", "9g", "--digits", stdin=text)
    assert "printed in full, without an estimate of their error" in done.stderr
    assert float(rows(done)[0]["mass_g"]) + float(rows(done)[1]["mass_g"]) > 0.5


def test_uncertainties(dalembert: Dalembert) -> None:
    """One sensor, one plane: w = -V t/(V₁ - V), and its standard deviation is that of a product."""
    text = f"{HEAD}\n0,1,3.4,116,,,\n1,1,1.8,42,A,2,0\n"
    (row,) = rows(dalembert("field", "-", "--reading-error", "2%,2deg", "--digits", stdin=text))
    with mp.workdps(40):
        a, b = vector("3.4", "116"), vector("1.8", "42")
        # d ln w = (V₁ dV/V - dV₁)/(V₁ - V): of relative errors x of each reading V₁ (x₀ - x₁)/(V₁ - V)
        gain = b / (b - a)
        share, turn = mp.mpf("0.02"), mp.mpf(2) * mp.pi / 180
        along = mp.sqrt(2 * ((gain.real * share) ** 2 + (gain.imag * turn) ** 2))
        across = mp.sqrt(2 * ((gain.imag * share) ** 2 + (gain.real * turn) ** 2))
        size = abs(a / (b - a)) * 2
        holds(row["mass_uncertainty_g"], along * size, 11)
        holds(row["angle_uncertainty_deg"], mp.degrees(across), 11)


@pytest.mark.parametrize(("gap", "fewest"), [("90", 12), ("0.001", 8), ("0.00001", 5)])
def test_blades_that_nearly_close(gap: str, fewest: int, dalembert: Dalembert) -> None:
    places = f"10deg,{float(gap) + 10!r}deg"
    found = rows(dalembert("place", "5g@10.000003deg", "--positions", places, "--digits"))
    with mp.workdps(60):
        goal, (a, b) = vector("5", "10.000003"), (vector("1", x) for x in ("10", str(float(gap) + 10)))
        det = (mp.conj(a) * b).imag
        holds(found[0]["mass_g"], (mp.conj(goal) * b).imag / det, fewest)
        # the small share is a difference of angles: it has as many digits fewer as they have in common
        holds(found[1]["mass_g"], (mp.conj(a) * goal).imag / det, 1)


def test_corrections_that_nearly_cancel(dalembert: Dalembert) -> None:
    (row,) = rows(dalembert("place", "83.5g@10deg", "83.5g@190.00001deg", "--digits"))
    with mp.workdps(60):
        check(row, vector("83.5", "10") + vector("83.5", "190.00001"), 5)


def test_drilling_and_other_planes(dalembert: Dalembert) -> None:
    drill = ("--drill", "10mm", "--density", "7850kg_m3", "--drill-point", "118deg")
    (row,) = rows(dalembert("place", "10g@30deg", *drill, "--digits"))
    with mp.workdps(40):
        slope, area = mp.tan(mp.radians(59)), mp.pi * 25
        depth = (mp.mpf(10) / mp.mpf("7.85e-3") - area * 5 / slope / 3) / area + 5 / slope
        holds(row["drill_depth_mm"], depth, 12)
        holds(row["angle_deg"], mp.mpf(210), 2)
    found = rows(dalembert("place", "12g@40deg", "--at-z", "30mm", "--to-z", "0mm:90mm", "--digits"))
    assert [row["mass_g"] for row in found] == ["8.0", "4.0"]
    near = rows(
        dalembert("place", "12g@40deg", "--at-z", "300.1mm", "--to-z", "300mm:300.0001mm", "--digits")
    )
    with mp.workdps(40):
        holds(near[0]["mass_g"], mp.mpf(12) * mp.mpf("0.0999") / mp.mpf("0.0001"), 5)
        holds(near[1]["mass_g"], mp.mpf(12) * mp.mpf("0.1") / mp.mpf("0.0001"), 5)


def test_suggested_trial(dalembert: Dalembert) -> None:
    given = ("--rotor-mass", "100kg", "--speed", "1500rpm", "--radius", "200mm")
    (row,) = rows(dalembert("trial", *given, "--digits"))
    with mp.workdps(40):
        unbalance = mp.mpf("0.1") * 100 * mp.mpf("9.80665") / (1500 * mp.pi / 30) ** 2
        holds(row["unbalance_g_mm"], unbalance * 10**6, 12)
        holds(row["mass_g"], unbalance / mp.mpf("0.2") * 1000, 12)


@pytest.mark.parametrize("angle", ["359.9999999999999deg", "-1e-13deg", "359.99999999999997deg", "3600deg"])
def test_no_angle_is_a_full_turn(angle: str, dalembert: Dalembert) -> None:
    for options in ((), ("--digits",)):
        (row,) = rows(dalembert("place", f"1g@{angle}", *options))
        assert 0 <= float(row["angle_deg"]) < 360
    assert "360°" not in dalembert("place", f"1g@{angle}", "--text").stdout


def test_balance_covers_its_whole_table(dalembert: Dalembert) -> None:
    """Planes 1e-6 of the lengths apart, one of them off the masses: places as written are rounded too."""
    text = "weight_N,radius_mm,angle_deg,z_mm\n90,30,60,400.3\n60,50,210,401.1\n"
    planes = ("--plane", "A:400.2mm:20mm", "--plane", "B:400.2007mm:20mm")
    found = rows(dalembert("balance", "-", *planes, "--gravity", "10", "--digits", stdin=text))
    with mp.workdps(60):
        u = [vector("270", "60"), vector("300", "210")]  # kg mm
        z, (a, b) = [mp.mpf("400.3"), mp.mpf("401.1")], (mp.mpf("400.2"), mp.mpf("400.2007"))
        in_b = -(u[0] * (z[0] - a) + u[1] * (z[1] - a)) / (b - a)
        in_a = -(u[0] * (z[0] - b) + u[1] * (z[1] - b)) / (a - b)
        for row, w in zip(found, (in_a, in_b), strict=True):
            holds(row["unbalance_g_mm"], abs(w) * 1000, 6)
            holds(row["mass_kg"], abs(w) / 20, 6)
            holds(row["weight_N"], abs(w) / 2, 6)
            holds(row["angle_deg"], mp.degrees(mp.arg(w)) % 360, 6, 360)
    full = rows(dalembert("balance", "-", *planes, "--gravity", "10", stdin=text))
    assert all(len(row["mass_kg"]) < len(whole["mass_kg"]) for row, whole in zip(found, full, strict=True))


def test_nothing_is_worked_out_without_the_option(tmp_path: Path) -> None:
    """The modules that know the bounds are not even loaded."""
    (tmp_path / "runs.csv").write_text(f"{HEAD}\n0,1,3.4,116,,,\n1,1,1.8,42,A,2,0\n")
    code = (
        "import sys\nfrom cli.app import main\nsys.argv = ['dalembert', 'field', 'runs.csv']\n"
        "try:\n    main()\nexcept SystemExit:\n    pass\n"
        "print([m for m in ('balancing.rounding', 'balancing.optimality') if m in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path, check=True
    )
    assert done.stdout.splitlines()[-1] == "[]"


def test_a_table_does_not_round_an_angle_to_a_full_turn() -> None:
    table = table_text({"angle_deg": [359.99999999, 359.99, 360.0]})
    assert table.split() == ["angle_deg", "0", "359.99", "360"]  # a given 360 stays
    cut, unknown = digits_that_hold(
        Table([Column("angle", "deg", [359.99999999, 12.3456], lambda: [1e-3, 1e-3])])
    )
    assert cut.cells == {"angle_deg": [0.0, 12.3]}
    assert not unknown


def phased(size: str, degrees: str, lag: bool) -> Any:
    """A reading; of an instrument whose phase lags its angle counts the other way."""
    v = vector(size, degrees)
    return mp.conj(v) if lag else v


@pytest.mark.parametrize("lag", [False, True])
def test_stored_coefficients_and_run_out(lag: bool, dalembert: Dalembert, tmp_path: Path) -> None:
    """Coefficients per gram in mil, run-out in mil, readings in µm, two of them of one sensor."""
    stored = [
        ("1", "A", "0.31", "31.7"),
        ("1", "B", "0.17", "201.3"),
        ("2", "A", "0.11", "3"),
        ("2", "B", "0.29", "77.7"),
    ]
    lines = [f"{sensor},{plane},{size},{turn},mil" for sensor, plane, size, turn in stored]
    head = "sensor,plane,magnitude_per_g,phase_deg,amplitude_unit"
    (tmp_path / "c.csv").write_text("\n".join([head, *lines]) + "\n")
    (tmp_path / "r.csv").write_text("sensor,amplitude_mil,phase_deg\n1,0.3,12.3\n2,0.1,100.1\n")
    text = "run,sensor,amplitude_um,phase_deg\n0,1,80.1,31.3\n0,1,80.3,31.1\n0,2,33.3,211.7\n"
    options = ["--influence", "c.csv", "--runout", "r.csv", *(["--phase-lag"] if lag else [])]
    both = rows(dalembert("field", "-", *options, "--digits", stdin=text))
    with mp.workdps(50):
        mil = mp.mpf("25.4")
        a = mp.matrix(2, 2)
        for sensor, plane, size, turn in stored:
            a[int(sensor) - 1, "AB".index(plane)] = vector(size, turn) * mil
        first = (phased("80.1", "31.3", lag) + phased("80.3", "31.1", lag)) / 2 - phased(
            "0.3", "12.3", lag
        ) * mil
        second = phased("33.3", "211.7", lag) - phased("0.1", "100.1", lag) * mil
        for row, w in zip(both, mp.lu_solve(a, -mp.matrix([first, second])), strict=True):
            check(row, w, 13)


def test_several_masses_in_a_run_and_the_trim(dalembert: Dalembert) -> None:
    """Masses joined by ';', two of them in one plane, and one that stays on: correction and trim."""
    read = {"0": [("80.1", "31.3"), ("41.7", "200.1")], "1": [("60.3", "71.1"), ("33.3", "150.7")]}
    read["2"] = [("71.9", "11.7"), ("55.1", "222.2")]
    cells = {"0": ",,,", "1": "A;A,3.1;0.7,11.3;71.9,yes", "2": "B;A,2.3;0.9,101.3;3.3,"}
    lines = [f"{run},{s + 1},{v[0]},{v[1]},{cells[run]}" for run in read for s, v in enumerate(read[run])]
    text = "\n".join([HEAD + ",trial_kept", *lines]) + "\n"
    both = rows(dalembert("field", "-", "--digits", stdin=text))
    with mp.workdps(50):
        kept = vector("3.1", "11.3") + vector("0.7", "71.9")
        on = mp.matrix([[kept, 0], [kept + vector("0.9", "3.3"), vector("2.3", "101.3")]])
        v = {run: mp.matrix([vector(*one) for one in read[run]]) for run in read}
        a = mp.matrix(2, 2)
        for s in range(2):
            x = mp.lu_solve(on, mp.matrix([v["1"][s] - v["0"][s], v["2"][s] - v["0"][s]]))
            a[s, 0], a[s, 1] = x[0], x[1]
        w = mp.lu_solve(a, -v["0"])
        for p, row in enumerate(both):
            check(row, w[p], 12)
            trim = w[p] - on[1, p]
            holds(row["trim_mass_g"], abs(trim), 12)
            holds(row["trim_angle_deg"], mp.degrees(mp.arg(trim)) % 360, 12, 360)


def test_masses_on_top_of_earlier_ones(dalembert: Dalembert) -> None:
    """A log whose column ref puts a mass on top of an earlier run's, its angle counted from there."""
    log = [
        ("80.1", "31.3", "", "", "-1"),
        ("60.3", "71.1", "3.1", "11.3", "-1"),
        ("71.9", "11.7", "2.3", "101.9", "2"),
    ]
    head = "sensor,amplitude_um,phase_deg,mass_g,angle_deg,ref"
    text = "\n".join([head, *(",".join(["1", *one]) for one in log)]) + "\n"
    (row,) = rows(dalembert("field", "-", "--digits", stdin=text))
    with mp.workdps(50):
        first = vector("3.1", "11.3")
        on = [mp.mpf(0), first, first + vector("2.3", "101.9") * vector("1", "11.3")]
        a = mp.matrix([[1, w] for w in on])
        x = mp.lu_solve(a.H * a, a.H * mp.matrix([vector(one[0], one[1]) for one in log]))
        check(row, -x[0] / x[1], 12)


def test_the_angle_of_material_to_remove(dalembert: Dalembert) -> None:
    """Its rounding is its own: 206° was exact, and 26° was printed as 25.999999999999993."""
    table = "unbalance_kg_m,angle_deg,z_mm\n12,386,189\n"
    planes = [word for z in (-46, 92, 390, 395) for word in ("--plane", f"P{z}:{z}mm:50cm")]
    for row in rows(dalembert("balance", "-", *planes, "--remove", "--digits", stdin=table)):
        assert float(row["angle_deg"]) == 26


def test_digits_that_hold(dalembert: Dalembert) -> None:
    """Two masses that nearly cancel, and planes 1e-6 apart: few digits are left, and only they are printed."""
    table = "mass_g,radius_mm,angle_deg,z_mm\n5,20,30,90\n5,20,210.0000001,90\n"
    near = ("--plane", "A:0mm:20mm", "--plane", "B:0.001mm:20mm")
    full = rows(dalembert("balance", "-", *near, stdin=table))[0]
    held = rows(dalembert("balance", "-", *near, "--digits", stdin=table))[0]
    assert 2 <= len(held["mass_g"].lstrip("0.").replace(".", "")) <= 9
    # both vectors have the direction of 120°; the difference in length is 5·(1e-7 in radians), the arm that to plane B
    true = 5 * np.radians(1e-7) * (90 - 0.001) / 0.001
    last = 10.0 ** -len(held["mass_g"].split(".")[1])
    assert abs(float(held["mass_g"]) - true) <= last
    assert len(full["mass_g"]) > len(held["mass_g"]) + 5
    assert held["mass_g"] == "0.0007853894"
    apart = (*near[:2], "--plane", "B:90mm:20mm", "--digits")
    rotor = "mass_kg,radius_mm,angle_deg,z_mm\n9,30,60,20\n6,50,210,65\n"
    plain = rows(dalembert("balance", "-", *apart, stdin=rotor))[0]
    assert 13 <= len(plain["mass_kg"].replace(".", "")) <= 16
