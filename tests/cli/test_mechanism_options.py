"""Options of the commands on a mechanism: an old spelling is answered by the new one, what means nothing is refused."""

from __future__ import annotations

import json
from itertools import pairwise, product

import pytest

from cli.show.help import MECHANISM, renamed
from tests.conftest import Dalembert
from tests.four_bars import four_bar


@pytest.mark.parametrize("option", ["--sweep", *MECHANISM])
def test_an_old_spelling_is_answered_by_one_line(dalembert: Dalembert, option: str) -> None:
    if option in ("--newton", "--order"):
        assert renamed("inspect", option)
        return
    done = dalembert("mechanism", "m.toml", option, "x")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == f"dalembert mechanism: {option} is now {MECHANISM[option]}\n"


@pytest.mark.parametrize(
    ("words", "refusal"),
    [
        (("forces", "--flywheel", "0.02"), "expected a cycle too"),
        (("forces", "--states", "s.csv", "--over", "links.crank.B.x=1:2:1"), "expected one mechanism"),
        (("inspect", "--at", "3deg"), "the whole range of the input"),
        (("equilibrium", "--at", "3deg"), "expected --over"),
        (("simulate", "--time", "0:1:1", "--branch", "all"), "follows one assembly"),
        (("simulate",), "expected the times"),
        (("mechanism", "--at", "3deg", "--over", "0deg:9deg:1deg"), "given twice"),
        (("mechanism", "--over", "crank=0:9:1", "--over", "0:9:1"), "given twice"),
        (("mechanism", "--over", "krank=0:9:1"), "did you mean"),
        (("mechanism", "--branch", "none"), "expected all, or the number"),
    ],
)
def test_what_means_nothing_is_refused(dalembert: Dalembert, tmp_path, words, refusal) -> None:
    (tmp_path / "m.toml").write_text(four_bar())
    done = dalembert(words[0], "m.toml", *words[1:])
    assert (done.returncode, done.stdout) == (2, "")
    assert refusal in " ".join(done.stderr.split())


@pytest.mark.parametrize(
    "words",
    [
        *(
            (command, flag, value)
            for command in ("mechanism", "forces", "simulate", "tolerance")
            for flag, value in (
                ("--only", "nix"),
                ("--only", "coupler.nix"),
                ("--at", "nix=3deg"),
                ("--over", "nix=0:1:1"),
                ("--set", "nix=1"),
            )
        ),
        *((command, "--set", "nix=1") for command in ("inspect", "equilibrium", "fit")),
        *((command, "--over", "nix=0:1:1") for command in ("inspect", "equilibrium", "fit")),
        ("inspect", "--only", "nix"),
        ("mechanism", "--only", "crank.torque"),
        ("mechanism", "--find", "nix", "--so-that", "C.x=1"),
        ("mechanism", "--find", "input.angle", "--so-that", "nix=1"),
        ("forces", "--over", "0:360:90", "--counterweights", "nix"),
        ("simulate", "--until", "nix=3deg"),
        ("fit", "--want", "nix"),
        ("fit", "--free", "nix=1:2"),
        ("fit", "--weight", "nix=1"),
        ("fit", "--keep", "nix>=1"),
        ("export", "-o", "a.dxf", "--at", "nix=3deg"),
        ("export", "-o", "a.dxf", "--profile", "nix"),
    ],
)
def test_a_name_in_an_option_that_the_file_does_not_have_is_wrong_usage(
    dalembert: Dalembert, tmp_path, words
) -> None:
    """It is a bad value of the option."""
    (tmp_path / "m.toml").write_text(four_bar(head="gravity = [0, -9.81]", rates="speed = 2"))
    (tmp_path / "t.csv").write_text("input_deg,C_x_mm,C_y_mm\n40,100,20\n50,100,20\n")
    command, *options = words
    further = {"simulate": ["--time", "0:1:1"], "fit": ["t.csv"]}.get(command, [])
    if command == "fit":
        also = {"--want": ("--want", "C"), "--free": ("--free", "links.crank.B.x=1:2")}
        further += [word for flag, pair in also.items() if flag not in options for word in pair]
    done = dalembert(command, "m.toml", *further, *options)
    assert (done.returncode, done.stdout) == (2, ""), done.stderr
    # of two options the one with the unknown name
    named = next(flag for flag, value in pairwise(options) if "nix" in value or value == "crank.torque")
    assert f"Invalid value for {named}" in done.stderr


def test_a_name_in_a_table_and_an_assembly_that_is_not_there_are_wrong_data(
    dalembert: Dalembert, tmp_path
) -> None:
    """The table is a file; which assemblies there are is computed, of each variant."""
    (tmp_path / "m.toml").write_text(four_bar())
    (tmp_path / "cases.csv").write_text("nix_deg\n3\n")
    for options in (("--cases", "cases.csv"), ("--branch", "99")):
        done = dalembert("mechanism", "m.toml", *options)
        assert (done.returncode, done.stdout, done.stderr.count("\n")) == (1, "", 1)


def test_names_choose_single_quantities(dalembert: Dalembert, tmp_path) -> None:
    (tmp_path / "m.toml").write_text(four_bar(head="gravity = [0, -9.81]", rates="speed = 2"))
    only = "C.x,coupler.omega,crank.torque,B.coupler.fx,B.crank.fx,shaking.fx"
    header, row = (
        line.split(",") for line in dalembert("forces", "m.toml", "--only", only).stdout.splitlines()
    )
    assert header == [
        "step", "input_deg", "C_x_m", "coupler_omega_rad_s", "input_torque_N_m", "B_crank_on_coupler_fx_N",
        "B_coupler_on_crank_fx_N", "shaking_fx_N",
    ]  # fmt: skip
    assert float(row[5]) == -float(row[6])


@pytest.mark.parametrize("place", [0, 1, 2])
def test_rows_are_the_grid_of_variants_with_the_poses_of_each_together(dalembert, tmp_path, place) -> None:
    """Wherever the range of the input stands: JSON groups the poses by variant, and the table has their order."""
    (tmp_path / "m.toml").write_text(four_bar())
    ranges = ["links.crank.B.x=40:42:2", "links.coupler.C.x=120:124:2"]
    ranges.insert(place, "40:60:10")
    words = ("mechanism", "m.toml", *(word for each in ranges for word in ("--over", each)), "--only", "C.x")
    header, *rows = (line.split(",") for line in dalembert(*words).stdout.splitlines())
    names = ["variant", "links.crank.B.x_m", "links.coupler.C.x_m", "input_deg"]
    shown = [[float(row[header.index(name)]) for name in names] for row in rows]
    variants = enumerate(product((0.04, 0.042), (0.12, 0.122, 0.124)), 1)
    assert shown == [[v, *lengths, q] for v, lengths in variants for q in (40, 50, 60)]
    document = json.loads(dalembert(*words, "--json").stdout)
    in_json = [
        [float(each["variant"]), *each["set"].values(), pose["input_deg"]]
        for each in document["variants"]
        for pose in each["poses"]
    ]
    assert in_json == shown


SLIDER_CRANK = """ground = { O = [0, 0] }
links.crank.points = { O = [0, 0], A = [0.06, 0] }
links.rod.points = { A = [0, 0], B = [0.1, 0] }
slots = [{ point = "B", link = "rod", on = "ground", through = "O", angle = 0 }]
input = { link = "crank", angle = "30 deg" }
guess = { at = "90 deg", rod = "-30 deg" }
"""


def test_every_branch_of_every_variant_has_its_number(dalembert, tmp_path) -> None:
    """At the guess, 90°, a rod of 40 mm does not reach the guide from 60 mm above: it has one assembly, longer ones have two."""
    (tmp_path / "m.toml").write_text(SLIDER_CRANK)
    words = (
        "mechanism",
        "m.toml",
        "--over",
        "links.rod.B.x=0.04:0.1:0.03",
        "--branch",
        "all",
        "--only",
        "B.x",
    )
    header, *rows = (line.split(",") for line in dalembert(*words).stdout.splitlines())
    shown = [(row[header.index("variant")], row[header.index("branch")]) for row in rows]
    assert shown == [("1", "1"), ("2", "1"), ("2", "2"), ("3", "1"), ("3", "2")]


def test_a_row_of_cases_sets_inputs_and_dimensions(dalembert: Dalembert, tmp_path) -> None:
    (tmp_path / "m.toml").write_text(four_bar())
    (tmp_path / "cases.csv").write_text("crank_deg,links.crank.B.x_mm\n40,40\n50,42\n")
    lines = dalembert("mechanism", "m.toml", "--cases", "cases.csv", "--only", "C.x").stdout.splitlines()
    assert lines[0] == "variant,links.crank.B.x_m,assembled,step,input_deg,C_x_m"
    for line, (angle, x) in zip(lines[1:], ((40, 40), (50, 42)), strict=True):
        alone = dalembert(
            "mechanism", "m.toml", "--set", f"links.crank.B.x={x}mm", "--at", f"{angle}deg", "--only", "C.x"
        ).stdout.splitlines()[1]
        assert float(line.split(",")[-1]) == pytest.approx(float(alone.split(",")[-1]), rel=1e-13)
        assert float(line.split(",")[-2]) == angle


def test_an_option_that_lacks_its_value_is_no_old_spelling(dalembert) -> None:
    done = dalembert("tolerance", "m.toml", "--draws", "20", "--seed")
    assert (done.returncode, done.stdout) == (2, "")
    assert "requires an argument" in done.stderr


def test_a_file_of_headers_that_is_not_there_is_one_line(dalembert, tmp_path) -> None:
    (tmp_path / "r.csv").write_text("run,sensor,amplitude_um,phase_deg\n")
    done = dalembert("field", "r.csv", "--columns", "nope.toml")
    assert (done.returncode, done.stdout, done.stderr) == (
        1,
        "",
        "dalembert: nope.toml: No such file or directory\n",
    )


TWO_BARS = """
gravity = [0, -9.81]
ground = { O = [0, 0] }
input = [{ link = "a" }, { link = "b", on = "a" }]
[links]
a = { points = { O = [0, 0], A = [1, 0] }, mass = 1, center = [0.5, 0] }
b = { points = { A = [0, 0] }, mass = 1, center = [0.25, 0] }
"""


@pytest.mark.parametrize(
    ("ranges", "rests"),
    [
        ((), {(90, 0), (90, 180), (270, 0), (270, 180)}),
        (("a=0deg:100deg:10deg",), {(90, 0), (90, 180)}),
        (("b=-10deg:100deg:10deg",), {(90, 0), (270, 0)}),
        (("a=0deg:100deg:10deg", "b=-10deg:100deg:10deg"), {(90, 0)}),
        (("a=260deg:450deg:10deg", "b=170deg:190deg:1deg"), {(90, 180), (270, 180)}),
        (("a=90deg:90deg:1deg",), {(90, 0), (90, 180)}),
        (("a=0deg:0deg:1deg",), set()),
    ],
)
def test_rest_lies_in_the_range_of_every_input(dalembert: Dalembert, tmp_path, ranges, rests) -> None:
    """Two hanging bars rest upright or hanging, each: a range of one input, or of both, leaves the others out."""
    (tmp_path / "m.toml").write_text(TWO_BARS)
    words = [word for each in ranges for word in ("--over", each)]
    lines = dalembert("equilibrium", "m.toml", *words).stdout.splitlines()[1:]
    found = {tuple(round(float(cell)) % 360 for cell in line.split(",")[:2]) for line in lines}
    assert found == rests
