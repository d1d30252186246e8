"""`dalembert work` as a user runs it: good tables, and each bad one answered in one line."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path

import mpmath as mp
import pytest

from tests.conftest import Dalembert


def solve(dalembert: Dalembert, table: str, *options: str) -> dict[str, object]:
    done = dalembert("work", "-", "--json", *options, stdin=table)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)  # type: ignore[no-any-return]


def test_units_of_the_columns(dalembert: Dalembert) -> None:
    table = "link,omega_rpm,torque_N_mm,vx_mm_s,fx_kN\na,30,?,,\nb,,,500,2\n"
    (step,) = solve(dalembert, table)["steps"]  # type: ignore[misc]
    assert step["unknowns"][0]["value"] == pytest.approx(-1000 / 3.141592653589793, rel=1e-15)
    done = dalembert("work", "-", stdin=table)
    assert done.stdout.splitlines()[0] == "step,link,torque_N_mm"
    assert float(done.stdout.splitlines()[1].split(",")[2]) == pytest.approx(
        -1e6 / 3.141592653589793, rel=1e-15
    )


def test_the_force_acts_where_its_velocity_is_given(dalembert: Dalembert) -> None:
    table = "link,vx_m_s,fvx_m_s,fx_N,omega_rad_s,torque_N_m\na,2,5,10,,\nb,2,,10,,\nc,,,,1,?\n"
    (step,) = solve(dalembert, table)["steps"]  # type: ignore[misc]
    assert step["unknowns"][0]["value"] == -70.0


def test_half_a_point_velocity_is_said(dalembert: Dalembert) -> None:
    table = (
        "link,vx_m_s,vy_m_s,fvx_m_s,fvy_m_s,fx_N,fy_N,omega_rad_s,torque_N_m\na,2,3,5,,1,1,,\nc,,,,,,,1,?\n"
    )
    found = solve(dalembert, table)
    assert found["steps"][0]["unknowns"][0]["value"] == -8.0  # type: ignore[index]
    assert "fvx is given and fvy is empty" in str(found["warnings"])


def test_a_second_force_on_a_link_has_its_own_row(dalembert: Dalembert) -> None:
    table = "link,mass_kg,fvx_m_s,fx_N,omega_rad_s,torque_N_m\na,1,1,2,,\na,,3,4,,\nb,,,,1,?\n"
    (step,) = solve(dalembert, table)["steps"]  # type: ignore[misc]
    assert step["unknowns"][0]["value"] == -14.0


def test_digits_of_a_step_without_an_answer_are_silent(dalembert: Dalembert) -> None:
    table = "step,link,vx_m_s,fx_N\na,1,2,?\na,2,2,4\nc,1,0,?\n"
    done = dalembert("work", "-", "--ledger", "--digits", stdin=table)
    assert done.returncode == 0
    (said,) = done.stderr.splitlines()
    assert said.startswith("warning: standard input: row 3 (line 4), column fx_N: found '?'")
    assert done.stdout.splitlines()[1:] == ["a,2,applied force,8.0", "a,1,unknown,-8.0"]


def test_steps_keep_their_names_and_order(dalembert: Dalembert) -> None:
    table = "step,link,omega_rad_s,torque_N_m\n07,b,2,3\n7,b,1,3\n07,a,1,?\n7,a,1,?\n"
    steps = solve(dalembert, table)["steps"]
    assert [(s["step"], s["unknowns"][0]["value"]) for s in steps] == [("07", -6.0), ("7", -3.0)]  # type: ignore[union-attr]


FIELDS = """step,link,field,omega_rad_s,torque_N_m,vx_m_s,fx_N
1,a,p,1,?T,0,
1,b,p,0,,1,?F
1,c,p,2,5,1,
1,a,q,0,?T,0,
1,b,q,0,,1,?F
1,c,q,1,5,1,
"""


def test_several_unknowns(dalembert: Dalembert) -> None:
    (step,) = solve(dalembert, FIELDS)["steps"]  # type: ignore[misc]
    assert [(u["name"], u["link"], u["quantity"], u["value"]) for u in step["unknowns"]] == [
        ("T", "a", "torque_N_m", pytest.approx(-5.0)),
        ("F", "b", "fx_N", pytest.approx(-5.0)),
    ]
    assert step["sums_W"] == {"p": 0.0, "q": 0.0}


def test_an_unknown_force_in_a_given_direction(dalembert: Dalembert) -> None:
    table = "link,vx_m_s,vy_m_s,fx_N,fy_N,omega_rad_s,torque_N_m\na,3,4,?F*0.6,?F*0.8,,\nb,,,,,1,10\n"
    (step,) = solve(dalembert, table)["steps"]  # type: ignore[misc]
    assert [u["value"] for u in step["unknowns"]] == pytest.approx([-1.2, -1.6], rel=1e-15)


def test_a_dead_step_spoils_no_other(dalembert: Dalembert) -> None:
    found = solve(dalembert, "step,link,omega_rad_s,torque_N_m\n1,a,1,?\n1,b,1,2\n2,a,0,?\n2,b,1,2\n")
    assert [s["unknowns"][0]["value"] for s in found["steps"]] == [-2.0, None]  # type: ignore[union-attr,attr-defined]
    assert "omega of link a is zero in step 2" in str(found["warnings"])


def test_large_tables_read_alike(dalembert: Dalembert, tmp_path: Path) -> None:
    def rows(n: int) -> str:
        return "".join(f"{s},a,{s % 7 + 1},?\n{s},b,1,{s}\n" for s in range(n))

    header = "step,link,omega_rad_s,torque_N_m\n"
    small = dalembert("work", "-", stdin=header + rows(100)).stdout.splitlines()
    large = dalembert("work", "-", stdin=header + rows(5_500)).stdout.splitlines()
    assert len(large) == 5_501
    assert large[:101] == small


BAD = {
    "no unknown": ("link,omega_rad_s,torque_N_m\n1,2,3\n", "no unknown"),
    "two unknowns": ("link,omega_rad_s,torque_N_m\n1,2,?\n2,2,?\n", "row 2 (line 3), column torque_N_m: found '?'"),
    "no unknown in a step": ("step,link,omega_rad_s,torque_N_m\n1,a,2,?\n2,a,2,1\n", "step '2': no unknown"),
    "named, no field": ("link,omega_rad_s,torque_N_m\n1,2,?A\n2,2,?B\n", "2 unknowns (?A (torque_N_m of link 1)"),
    "workless": ("link,omega_rad_s,torque_N_m\n1,0,?\n2,2,1\n", "omega of link 1 is zero"),
    "workless force": ("link,vx_m_s,vy_m_s,fx_N,fy_N\n1,0,1,?,2\n2,2,0,0,0\n", "velocity along fx of link 1 is zero"),
    "mass unknown": ("link,mass_kg,omega_rad_s,torque_N_m\n1,?,2,?\n", "only a force or torque may be unknown"),
    "unit": ("link,omega_rad_s,torque_foo\n1,0,?\n", "unknown unit 'foo'"),
    "no unit": ("link,omega,torque_N_m\n1,0,?\n", "the column omega has no unit"),
    "not a number": ("link,omega_rad_s,torque_N_m\n1,abc,?\n", "row 1 (line 2), column omega_rad_s: found 'abc'"),
    "negative mass": ("link,mass_kg,omega_rad_s,torque_N_m\na,-1,1,?\n", "a mass that is not negative"),
    "no mass": ("link,mass_kg,inertia_kg_m2,ax_m_s2,omega_rad_s,torque_N_m\na,,0.1,5,1,?\n", "has an inertia and its centre accelerates"),
    "no link": ("omega_rad_s,torque_N_m\n1,?\n", "no column link"),
    "link twice": ("link,mass_kg,omega_rad_s,torque_N_m\na,1,1,?\na,1,1,2\n", "each link once"),
    "dependent fields": (FIELDS.replace("1,a,q,0", "1,a,q,2").replace("1,b,q,0,,1", "1,b,q,0,,2"), "independent velocity fields"),
    "bad mark": ("link,omega_rad_s,torque_N_m\na,1,?T*x\n", "?NAME*FACTOR"),
    "empty": ("", "empty"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_bad_data_is_one_line(dalembert: Dalembert, case: str) -> None:
    table, expected = BAD[case]
    done = dalembert("work", "-", stdin=table)
    assert done.returncode == 1
    assert done.stdout == ""
    assert len(done.stderr.splitlines()) == 1, done.stderr
    assert expected in done.stderr


def test_bad_usage(dalembert: Dalembert) -> None:
    done = dalembert("work", "-", "--gravity", "3", stdin="link\n")
    assert done.returncode == 2
    assert dalembert("work", "no such file.csv").returncode == 1


def test_pictures_and_files(dalembert: Dalembert, tmp_path: Path) -> None:
    dalembert("examples", "riul-slider-crank")
    assert dalembert("work", "states.csv", "--plot", "ledger.svg", "-o", "out.json").returncode == 0
    assert (tmp_path / "ledger.svg").read_bytes().startswith(b"<?xml")
    assert json.loads((tmp_path / "out.json").read_text())["steps"][0]["unknowns"]
    ledger = dalembert("work", "states.csv", "--ledger", "--gravity", "0,-10").stdout.splitlines()
    assert ledger[0] == "step,link,kind,power_W"
    assert "1,2,unknown,2060000.0" in ledger


def test_terms_that_do_work_are_of_the_document_alone(dalembert: Dalembert, tmp_path: Path) -> None:
    """A table without columns was an empty section of every other file."""
    (tmp_path / "fields.csv").write_text(FIELDS)
    for form in ("md", "html"):
        option = "--report" if form == "html" else "-o"
        assert dalembert("work", "fields.csv", option, f"out.{form}").returncode == 0
        text = (tmp_path / f"out.{form}").read_text()
        assert "edger" in text
        assert "erms</h" not in text
        assert "## terms" not in text
    (step,) = json.loads(dalembert("work", "fields.csv", "--json").stdout)["steps"]
    first = step["terms"][0]
    assert (first["field"], first["link"], first["power_W"]) == ("p", "c", 10.0)
    assert step["condition"] > 1


def test_the_ledger_can_be_checked_beside_the_unknowns(dalembert: Dalembert, tmp_path: Path) -> None:
    (tmp_path / "expected.csv").write_text("step,field,link,kind,power_W\n1,p,c,applied torque,10\n")
    (tmp_path / "fields.csv").write_text(FIELDS)
    assert dalembert("work", "fields.csv", "--expect", "expected.csv").returncode == 0


def test_digits_of_two_unknowns_in_any_units(dalembert: Dalembert) -> None:
    """Two velocity fields that hardly differ, decimals that no float has, a share of an unknown."""
    table = (
        "step,field,link,mass_g,vx_mm_s,vy_mm_s,ax_m_s2,omega_rpm,torque_N_m,fx_lbf\n"
        "1,p,a,300.1,0.1,0.7,0.3,30.1,?T,?F*0.7\n1,p,b,,0.3,,,20.3,0.9,1.1\n"
        "1,q,a,300.1,0.1001,0.7,0.3,30.2,?T,?F*0.7\n1,q,b,,0.3,,,20.3,0.9,1.1\n"
    )
    done = dalembert("work", "-", "--gravity", "0.1,-9.81", "--digits", stdin=table)
    assert done.returncode == 0, done.stderr
    with mp.workdps(40):
        rpm, pound = mp.pi / 30, mp.mpf("4.4482216152605")
        mass, b = mp.mpf("0.3001"), mp.mpf("0.3") / 1000
        rows, right = mp.matrix(2, 2), mp.matrix(2, 1)
        for i, (vx, omega) in enumerate((("0.1", "30.1"), ("0.1001", "30.2"))):
            v, w = mp.mpf(vx) / 1000, mp.mpf(omega) * rpm
            rows[i, 0], rows[i, 1] = w, v * mp.mpf("0.7")
            of_a = mass * ((mp.mpf("0.1") - mp.mpf("0.3")) * v - mp.mpf("9.81") * mp.mpf("0.7") / 1000)
            right[i] = -(of_a + mp.mpf("0.9") * mp.mpf("20.3") * rpm + mp.mpf("1.1") * pound * b)
        torque, force = mp.lu_solve(rows, right)
        printed = list(csv.DictReader(io.StringIO(done.stdout)))
        for text, true in (
            (next(row["torque_N_m"] for row in printed if row["torque_N_m"]), torque),
            (next(row["fx_lbf"] for row in printed if row["fx_lbf"]), force * mp.mpf("0.7") / pound),
        ):
            places = len(text.lower().split("e")[0].lstrip("-").replace(".", "").strip("0"))
            assert places >= 10
            assert abs(mp.mpf(text) - true) <= mp.mpf(10) ** (
                mp.floor(mp.log10(abs(true))) - places + 1
            ) / 2 * mp.mpf("1.000001")


def test_gravity_without_masses_is_said(dalembert: Dalembert) -> None:
    table = "link,omega_rad_s,torque_N_m\na,2,?\nb,1,3\n"
    done = dalembert("work", "-", "--gravity", "0,-9.81", stdin=table)
    assert done.stdout.splitlines()[1] == "1,a,-1.5"
    assert "--gravity: there is no column mass_*" in done.stderr
    assert not dalembert("work", "-", stdin=table).stderr


def test_an_unknown_that_comes_out_as_zero_still_does_work(dalembert: Dalembert) -> None:
    for table in ("link,fx_N,vx_m_s,vy_m_s\na,?,1,2\n", "link,torque_N_m,omega_rad_s\na,?,1\n"):
        done = dalembert("work", "-", "--steps", "--json", stdin=table)
        ((term,),) = (step["terms"] for step in json.loads(done.stdout)["way"][0]["steps"])
        assert term["power_W"] == 0
        assert term["workless"] is None
    # a force across its way does none
    table = "link,fx_N,fy_N,vx_m_s,torque_N_m,omega_rad_s\na,3,4,0,?,1\nb,,5,2,,\n"
    ledger = json.loads(dalembert("work", "-", "--steps", "--json", stdin=table).stdout)["way"][0]["steps"][0]
    whys = [term["workless"] for term in ledger["terms"]]
    assert whys == ["at rest", "perpendicular to the displacement", None]
