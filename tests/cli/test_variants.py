"""`--set`, `--over`, `--cases`: each variant says what its own file would."""

from __future__ import annotations

import json

import pytest

from tests.cli.printed import rows
from tests.four_bars import body, four_bar


def text(crank=40, turn=30, mass=0.25, ground=100):
    return four_bar(
        body(0.5),
        body(mass),
        lengths=(crank, 120, 80, ground),
        points=f', H = {{ from = "C", length = 50, angle = {turn} }}',
        head='name = "four-bar"\ngravity = [0, -9.81]',
        rates="speed = 10",
    )


@pytest.fixture
def files(tmp_path):
    """Write the four-bar with its dimensions into a file."""

    def write(name="m.toml", **dimensions):
        (tmp_path / name).write_text(text(**dimensions))
        return name

    return write


def test_set_is_the_file_with_that_number(dalembert, files):
    files("other.toml", crank=42.5, turn=-15, mass=0.75)
    options = ("--over", "0:360:90")
    changes = ("links.crank.B.x=42.5", "links.coupler.H.angle=-15", "links.coupler.mass=750 g")
    changed = dalembert("forces", files(), *options, *(o for change in changes for o in ("--set", change)))
    assert changed.returncode == 0
    assert changed.stdout == dalembert("forces", "other.toml", *options).stdout
    nominal = dalembert("forces", "m.toml", *options).stdout
    assert nominal != changed.stdout


def test_a_grid_runs_over_the_last_path_fastest_and_each_row_begins_with_its_variant(dalembert, files):
    vary = ("--over", "links.crank.B.x=38:42:2mm", "--over", "links.coupler.H.angle=0deg:30deg/2")
    found = dalembert("mechanism", files(), *vary, "--at", "40", "--at", "60", "--only", "H,coupler")
    table = rows(found.stdout)
    assert list(table[0])[:5] == [
        "variant", "links.crank.B.x_m", "links.coupler.H.angle_deg", "assembled", "step",
    ]  # fmt: skip
    assert [row["variant"] for row in table] == [str(i) for i in range(1, 10) for _ in range(2)]
    expected = [(crank, turn) for crank in (38, 40, 42) for turn in (0, 15, 30)]
    for i, (crank, turn) in enumerate(expected):
        alone = dalembert(
            "mechanism", files("alone.toml", crank=crank, turn=turn), "--at", "40", "--at", "60", "--only", "H,coupler"
        )  # fmt: skip
        here = table[2 * i : 2 * i + 2]
        for row, own in zip(here, rows(alone.stdout), strict=True):
            assert float(row.pop("links.crank.B.x_m")) == crank / 1000
            assert float(row.pop("links.coupler.H.angle_deg")) == turn
            assert row.pop("assembled") == "true"
            row.pop("variant")
            assert list(row) == list(own)
            # the formulas are run in another order: the last digits may be others
            assert [*map(float, row.values())] == pytest.approx([*map(float, own.values())], rel=1e-12)


@pytest.mark.parametrize(
    ("vary", "expected"),
    [
        ("50mm:52mm:0.1mm", [f"{50 + i / 10:.1f}" for i in range(21)]),
        ("1cm:1.1cm:0.03cm", ["10.0", "10.3", "10.6", "10.9"]),
        ("30mm:29mm:-0.25mm", ["30.0", "29.75", "29.5", "29.25", "29.0"]),
    ],
)
def test_steps_are_those_of_the_decimals_as_written(dalembert, files, vary, expected):
    found = dalembert("mechanism", files(), "--over", f"links.crank.B.x={vary}", "--at", "40", "--only", "H")
    shown = [row["links.crank.B.x_m"] for row in rows(found.stdout)]
    assert shown == [repr(float(f"{x}e-3")) for x in expected]


def test_json_holds_what_was_set_and_the_poses_of_each_variant(dalembert, files):
    vary = ("--over", "links.coupler.H.angle=0:30:15", "--set", "ground.D.x=101")
    found = json.loads(dalembert("mechanism", files(), *vary, "--at", "40", "--json").stdout)
    assert [v["variant"] for v in found["variants"]] == ["1", "2", "3"]
    assert [v["set"] for v in found["variants"]] == [{"links.coupler.H.angle_deg": a} for a in (0, 15, 30)]
    for variant, turn in zip(found["variants"], (0, 15, 30), strict=True):
        files("alone.toml", ground=101, turn=turn)
        alone = json.loads(dalembert("mechanism", "alone.toml", "--at", "40", "--json").stdout)
        assert variant["poses"] == alone["poses"]


def test_a_variant_that_cannot_be_assembled_is_a_row_that_says_so(dalembert, files):
    # at 40 deg a ground of 300 mm is out of reach
    vary = ("--over", "ground.D.x=100mm:300mm:200mm", "--at", "40", "--only", "H")
    found = dalembert("mechanism", files(), *vary)
    assert found.returncode == 0
    good, bad = rows(found.stdout)
    assert (good["assembled"], bad["assembled"]) == ("true", "false")
    assert good["H_x_m"]
    assert not bad["H_x_m"]
    assert "variant 2: " in found.stderr
    document = json.loads(dalembert("mechanism", "m.toml", *vary, "--json").stdout)
    assert [[pose["assembled"] for pose in v["poses"]] for v in document["variants"]] == [[True], [False]]
    assert document["variants"][1]["poses"][0]["points"]["H"]["x_m"] is None
    none = dalembert("mechanism", "m.toml", "--over", "ground.D.x=300mm:400mm:100mm", "--at", "40")
    assert none.returncode == 1
    assert len(rows(none.stdout)) == 2


@pytest.mark.slow
def test_a_variant_that_newton_cannot_put_together_is_a_row_too(dalembert, tmp_path):
    dalembert("examples", "stephenson-six-bar")
    # the five-bar of 75 + 80 + 70 mm spans a ground of 100 mm, not one of 1000 mm
    vary = ("--over", "ground.D.x=1000:100:-900", "--at", "10", "--at", "20")
    found = dalembert("mechanism", "stephenson.toml", *vary, "--only", "E")
    table = rows(found.stdout)
    assert [(row["variant"], row["step"], row["assembled"]) for row in table] == [
        ("1", "1", "false"), ("1", "2", "false"), ("2", "1", "true"), ("2", "2", "true"),
    ]  # fmt: skip
    assert not table[0]["E_x_m"]
    assert "variant 1: " in found.stderr
    assert "cannot be assembled" in found.stderr
    poses = json.loads(dalembert("mechanism", "stephenson.toml", *vary, "--json").stdout)["variants"]
    assert [pose["assembled"] for pose in poses[0]["poses"]] == [False, False]
    assert poses[0]["poses"][0].keys() == poses[1]["poses"][0].keys()
    assert poses[0]["poses"][1]["input_deg"] == 20
    assert poses[0]["poses"][1]["points"]["E"] == dict.fromkeys(poses[1]["poses"][1]["points"]["E"])


def test_variants_come_from_a_table_in_any_unit(dalembert, files, tmp_path):
    (tmp_path / "v.csv").write_text(
        "variant,note,links.crank.B.x_mm,links.coupler.mass_g\nfirst,a,40,250\nsecond,b,41.5,300\n"
    )
    found = dalembert("forces", files(), "--cases", "v.csv", "--at", "40")
    table = rows(found.stdout)
    assert [row["variant"] for row in table] == ["1", "2"]
    assert [float(row["links.coupler.mass_kg"]) for row in table] == [0.25, 0.3]
    alone = dalembert("forces", files("alone.toml", crank=41.5, mass=0.3), "--at", "40")
    assert table[1]["virtual_work_torque_N_m"] == rows(alone.stdout)[0]["virtual_work_torque_N_m"]
    assert "ignored the column 'note'" in found.stderr


def test_a_study_is_made_of_every_variant(dalembert, files):
    vary = ("--over", "links.crank.B.x=40:100:60", "--json")
    found = json.loads(dalembert("inspect", files(), *vary).stdout)
    classes = [v["check"]["four_bars"][0]["grashof"] for v in found["variants"]]
    assert classes[0] == "crank-rocker"
    assert classes[1] != classes[0]


def test_many_variants_are_written_part_by_part(dalembert, files, tmp_path):
    vary = ("--over", "links.crank.B.x=38mm:42mm/199", "--only", "H", "-o", "out.csv")
    assert dalembert("mechanism", files(), *vary).returncode == 0
    table = rows((tmp_path / "out.csv").read_text())
    assert [row["variant"] for row in table] == [str(i) for i in range(1, 201)]
    assert float(table[-1]["links.crank.B.x_m"]) == 0.042


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--over", "links.crnak.B.x=1:2:1"), "did you mean 'links.crank.B.x'"),
        (("--set", "links.coupler.H.x=1"), "expected links.coupler.H.length or links.coupler.H.angle"),
        (("--over", "links.crank.B=1:2:1"), "expected links.crank.B.x or links.crank.B.y"),
        (("--over", "links.crank.B.x=40:30:1"), "never gets from 40 to 30"),
        (("--over", "links.crank.B.x=40:nan:1"), "nan"),
        (("--over", "links.crank.B.x"), "expected START:STOP:STEP"),
        (("--set", "links.crank.B.x=3kg"), "unit of mass"),
        (("--set", "links.coupler.mass=-1"), "must not be negative"),
        (("--set", "gravity=1", "--set", "gravity.x=1"), "two values X,Y"),
        (("--set", "gravity=1,2", "--set", "gravity.x=1"), "given twice"),
        (("--over", "links.crank.B.x=1:2:1", "--cases", "v.csv"), "given twice, by --cases and --over"),
        (("--over", "links.crank.B.x=40:41:1", "--states", "s.csv"), "expected one mechanism"),
    ],
)
def test_a_bad_option_is_one_line_and_nothing_is_written(dalembert, files, tmp_path, options, message):
    (tmp_path / "v.csv").write_text("links.crank.B.x_mm\n40\n41\n")
    found = dalembert("forces" if "--states" in options else "mechanism", files(), *options, "-o", "out.csv")
    assert found.returncode == 2
    assert message in found.stderr
    assert not found.stdout
    assert not (tmp_path / "out.csv").exists()


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("links.crank.B.x_mm\n40\nNaN\n", "row 2 (line 3), column links.crank.B.x_mm: found 'NaN'"),
        ("links.crnak.B.x_mm\n40\n", "unknown dimension 'links.crnak.B.x_mm'"),
        ("links.crank.B_mm\n40\n", "links.crank.B"),
        ("links.crank.B.x_kg\n40\n", "'kg' is a unit of mass"),
        ("crank_mm\n40\n", "'mm' is a unit of length"),
        ("links.crank.B.x_mm\n", "no rows"),
    ],
)
def test_a_bad_table_of_variants_is_one_line_and_nothing_is_written(dalembert, files, tmp_path, table, said):
    (tmp_path / "v.csv").write_text(table)
    found = dalembert("mechanism", files(), "--cases", "v.csv", "-o", "out.csv")
    assert found.returncode == 1
    assert said in found.stderr
    assert found.stderr.count("\n") == 1
    assert not (tmp_path / "out.csv").exists()


def test_more_than_memory_holds_is_refused_where_it_has_to_be_held(dalembert, files):
    vary = ("--over", "links.crank.B.x=38mm:42mm/999999", "--over", "0:360/99999", "--text")
    found = dalembert("mechanism", files(), *vary)
    assert found.returncode == 1
    assert "1000000 variants" in found.stderr


def test_columns_of_points_that_differ_in_case_alone(dalembert, tmp_path):
    (tmp_path / "arm.toml").write_text(
        "[ground]\nO = [0, 0]\n[links.arm]\npoints = { O = [0, 0], B = [1, 0], b = [2, 0] }\n"
        '[input]\nlink = "arm"\nangle = 0\n'
    )

    def places(header, *numbers):
        (tmp_path / "c.csv").write_text(f"{header}\n{','.join(numbers)}\n")
        found = dalembert("mechanism", "arm.toml", "--cases", "c.csv", "--only", "B,b")
        return [(row["B_x_m"], row["b_x_m"]) for row in rows(found.stdout)] or found.stderr

    assert places("links.arm.B.x_m", "3") == [("3.0", "2.0")]
    assert places("links.arm.b.x_m", "3") == [("1.0", "3.0")]
    assert places("links.arm.b.x_m,links.arm.B.x_m", "3", "4") == [("4.0", "3.0")]
    # a name that has no twin is read in any case
    assert places("LINKS.ARM.O.X_m", "0") == [("1.0", "2.0")]
    assert places("LINKS.ARM.B.X_m", "3") == (
        "dalembert: c.csv: column LINKS.ARM.B.X_m: expected links.arm.B.x or links.arm.b.x, in upper and lower case as here\n"
    )


def test_variants_without_a_loop_for_newton_say_so(dalembert, tmp_path):
    (tmp_path / "arm.toml").write_text(
        '[ground]\nO = [0, 0]\n[links.arm]\npoints = { O = [0, 0], B = [1, 0] }\n[input]\nlink = "arm"\nangle = 0\n'
    )
    found = dalembert("mechanism", "arm.toml", "--newton", "--over", "links.arm.B.x=1m:2m:1m", "--json")
    assert found.returncode == 1
    assert [each["set"]["links.arm.B.x_m"] for each in json.loads(found.stdout)["variants"]] == [1, 2]
    assert "variants 1, 2: newton: the mechanism has no loop to close" in found.stderr
