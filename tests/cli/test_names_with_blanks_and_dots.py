"""Links and points whose names have blanks, dots, commas, ° or µ: the headers that are written can be read again."""

from __future__ import annotations

import csv
import io
import json

import pytest

NAMES = ["crank", "my crank", "crank 1.5", "µ-Kurbel", "crank 30°", "my_crank", "crank, left", "7"]


def arm(name, more=""):
    return (
        f'[ground]\nO = [0, 0]\nD = [0, 3]\n[links."{name}"]\n'
        'points = { O = [0, 0], B = [1, 0], "P.x" = [2, 0] }\nmass = 1\n'
        f'[input]\nlink = "{name}"\nangle = 0\nspeed = 2\n{more}'
    )


@pytest.mark.parametrize("name", NAMES)
def test_the_columns_of_a_link_by_its_name(dalembert, tmp_path, name):
    (tmp_path / "arm.toml").write_text(arm(name))
    (tmp_path / "c.csv").write_text(f'"links.{name}.B.x_m","{name}_deg"\n3,90\n')
    quoted = f'B,"{name}"'
    found = dalembert("mechanism", "arm.toml", "--cases", "c.csv", "--only", quoted, "-o", "o.csv")
    assert (found.returncode, found.stderr) == (0, "")
    (row,) = csv.DictReader(io.StringIO((tmp_path / "o.csv").read_text()))
    assert float(row["B_y_m"]) == 3
    assert float(row[f"links.{name}.B.x_m"]) == 3
    # its own table is what it expects
    again = dalembert(
        "mechanism", "arm.toml", "--cases", "c.csv", "--only", quoted, "--expect", "o.csv", "--json"
    )
    assert again.returncode == 0
    assert {cell["column"] for cell in json.loads(again.stdout)["check"]} >= {f"{name}_omega_rad_s"}
    one = dalembert("mechanism", "arm.toml", "--only", f'"{name}".omega')
    assert next(csv.reader([one.stdout.splitlines()[0]]))[2:] == [f"{name}_omega_rad_s"]


def test_names_that_are_alike_but_for_a_blank(dalembert, tmp_path):
    (tmp_path / "two.toml").write_text(
        '[ground]\nO = [0, 0]\n[links.arm]\npoints = { O = [0, 0], "a b" = [1, 0], a_b = [2, 0] }\n'
        '[input]\nlink = "arm"\nangle = 0\n'
    )

    def places(header, *numbers):
        (tmp_path / "c.csv").write_text(f"{header}\n{','.join(numbers)}\n")
        found = dalembert("mechanism", "two.toml", "--cases", "c.csv", "--only", "a b,a_b")
        return [
            (row["a b_x_m"], row["a_b_x_m"]) for row in csv.DictReader(io.StringIO(found.stdout))
        ] or found.stderr

    assert places("links.arm.a b.x_m", "3") == [("3.0", "2.0")]
    assert places("links.arm.a_b.x_m", "3") == [("1.0", "3.0")]
    assert places("links.arm.a_b.x_m,links.arm.a b.x_m", "3", "4") == [("4.0", "3.0")]
    assert "expected links.arm.a b.x or links.arm.a_b.x" in places("links.arm.a  b.x_m", "3")


@pytest.mark.parametrize("end", ["my.crank.P.x", "P.x", "my.crank.B"])
def test_the_ends_of_a_spring_where_names_have_dots(dalembert, tmp_path, end):
    spring = f'[[springs]]\nbetween = ["{end}", "ground.D"]\nstiffness = 5\n'
    (tmp_path / "arm.toml").write_text(arm("my.crank", spring))
    found = dalembert("forces", "arm.toml", "--at", "0deg", "--only", "my.crank.torque", "--json")
    effort = json.loads(found.stdout)["poses"][0]["effort"]["input_torque_N_m"]
    # the force of the spring is 5·(D − end): its moment about O is 5·3 times the end's x
    assert effort == pytest.approx(-5 * 3 * (1 if end.endswith("B") else 2))


def test_an_end_that_is_not_there_is_named(dalembert, tmp_path):
    for end in ("arm.P.y", "my.crank.Q", "Q"):
        spring = f'[[springs]]\nbetween = ["{end}", "ground.D"]\nstiffness = 5\n'
        (tmp_path / "arm.toml").write_text(arm("my.crank", spring))
        found = dalembert("forces", "arm.toml")
        assert (found.returncode, found.stdout) == (1, "")
        assert "[[springs]] 1 between" in found.stderr


def test_a_target_at_a_point_whose_name_has_a_comma(dalembert, tmp_path):
    (tmp_path / "arm.toml").write_text(arm("crank").replace('"P.x"', '"P, left"'))
    (tmp_path / "t.csv").write_text('input_deg,"P, left_x_m","P, left_y_m"\n0,3,0\n90,0,3\n')
    free = ("--free", "links.crank.P, left.x=1m:4m")
    found = dalembert("fit", "arm.toml", "t.csv", "--want", '"P, left"', *free, "--json")
    assert found.returncode == 0, found.stderr
    assert json.loads(found.stdout)["fit"]["parameters"] == {"links.crank.P, left.x_m": pytest.approx(3)}
    assert dalembert("fit", "arm.toml", "t.csv", "--want", "P, left", *free).returncode == 2
