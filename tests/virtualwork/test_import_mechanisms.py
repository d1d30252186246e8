"""`import_mechanisms` and `export_mechanism`: a notebook reads and writes what `dalembert import` and `export` do, in words of its own."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dalembert.errors import DataError
from rigidbody3d import read_robot
from tests.cli.exported import FOUR_BAR
from tests.cli.imported import FORMATS
from tests.cli.robots import LOOPS, MJCF, SDF, URDF
from tests.conftest import Dalembert
from virtualwork import Mechanism, MechanismError, export_mechanism, import_mechanisms

FIVE_BAR = "ground a R 0 0 0 ffft|a b R 0 1|b c R 1 1|c d R 2 1|d ground R 3 0"
ROBOTS = {"a.urdf": URDF.format(loop=LOOPS["gazebo"]), "a.sdf": SDF, "a.xml": MJCF}


def notes(lines: str) -> list[str]:
    return [line.removeprefix("note: ") for line in lines.splitlines()]


@pytest.mark.parametrize(
    "file", sorted(p.relative_to(FORMATS) for p in FORMATS.glob("*/*") if p.is_file()), ids=str
)
def test_the_library_reads_what_the_command_writes(file: Path, dalembert: Dalembert, tmp_path: Path) -> None:
    mechanisms = import_mechanisms(FORMATS / file)
    done = dalembert("import", str(FORMATS / file), "-o", str(tmp_path / "a.toml"))
    written = sorted(tmp_path.glob("a*.toml"), key=lambda p: (len(p.name), p.name))
    assert [m.toml for m in mechanisms] == [p.read_text(encoding="utf-8") for p in written]
    if len(mechanisms) == 1:
        assert list(mechanisms[0].notes) == notes(done.stderr)
    for m in mechanisms:
        assert m.mechanism == Mechanism.from_toml_text(m.toml)
        assert m.mechanism.name == m.name


@pytest.mark.parametrize("name", ROBOTS)
def test_a_robot_in_a_plane_is_what_the_command_imports(
    name: str, dalembert: Dalembert, tmp_path: Path
) -> None:
    file = tmp_path / name
    file.write_text(ROBOTS[name])
    robot = read_robot(file)
    (m,) = import_mechanisms(robot)
    done = dalembert("import", str(file))
    assert m.toml == done.stdout
    assert list(m.notes) == notes(done.stderr)
    # the robot stays as it was read
    assert import_mechanisms(robot) == [m]


def test_a_robot_without_a_plane_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "arm.urdf"
    file.write_text(
        URDF.format(loop="").replace(
            'child link="rocker"/><axis xyz="0 1', 'child link="rocker"/><axis xyz="1 1'
        )
    )
    with pytest.raises(DataError, match="no planar mechanism: joint 'D': its axis stands 45 deg off"):
        import_mechanisms(read_robot(file))


def test_mechanisms_that_share_the_ground_alone_are_several(tmp_path: Path) -> None:
    one, file = "ground a R 0 0 0 ffft\na R 0 1\n", tmp_path / "cranks.txt"
    file.write_text(one)
    assert [m.name for m in import_mechanisms(file)] == ["cranks"]
    links = "".join(f"http://pmks.example/?mech={one.strip().replace(chr(10), '|')}\n" for _ in range(3))
    file.write_text(links)
    several = import_mechanisms(file)
    assert [m.name for m in several] == ["cranks"] * 3
    assert {tuple(m.mechanism.links) for m in several} == {("a",)}
    file.write_text(one.replace("ground a R 0 0 0 ffft", "ground a R 0 0"))
    assert len(import_mechanisms(file)) == 1
    file.write_text("ground a R 0 0\nground a R 1 0\n")
    with pytest.raises(DataError, match="no mechanism: nothing in it is driven by an input"):
        import_mechanisms(file)


def test_what_no_mechanism_can_be_made_of_says_why(dalembert: Dalembert) -> None:
    (m,) = import_mechanisms(f"http://pmks.example/?mech={FIVE_BAR}")
    assert m.refused.startswith("a free degree of freedom")
    assert not any("dalembert" in note for note in m.notes)
    with pytest.raises(MechanismError, match="a free degree of freedom"):
        _ = m.mechanism.motion(0.0).point("J3").position
    done = dalembert("import", "-", stdin=FIVE_BAR)
    assert done.stderr.endswith(f"note: `dalembert mechanism` will refuse it: {m.refused}\n")


def test_messages_of_the_library_name_no_option_of_the_command(dalembert: Dalembert, tmp_path: Path) -> None:
    file = tmp_path / "a.txt"
    file.write_text("no mechanism")
    with pytest.raises(
        DataError, match=r"a\.txt: unknown format: expected pmks-text .*; name it with `program`$"
    ):
        import_mechanisms(file)
    done = dalembert("import", str(file))
    assert "mjcf (MuJoCo's MJCF); name it with --from" in done.stderr
    with pytest.raises(ValueError, match="program 'pmks': expected one of pmks-text, pmks-web"):
        import_mechanisms(file, "pmks")
    broken = tmp_path / "a.urdf"
    inertia = '<inertial><mass value="1"/><inertia ixx="1" iyy="-2" izz="1"/></inertial>'
    broken.write_text(
        URDF.format(loop="").replace('<link name="crank"/>', f'<link name="crank">{inertia}</link>')
    )
    with pytest.raises(DataError, match=r"found -2, expected zero or more$"):
        import_mechanisms(read_robot(broken))
    done = dalembert("import", str(broken))
    assert done.stderr.endswith("found -2, expected zero or more: see `dalembert body --check-inertias`\n")


@pytest.mark.parametrize("suffix", [".svg", ".csv", ".urdf", ".sdf", ".xml"])
def test_the_library_writes_what_the_command_writes(
    suffix: str, dalembert: Dalembert, tmp_path: Path
) -> None:
    (tmp_path / "four-bar.toml").write_text(FOUR_BAR)
    ours, theirs = (tmp_path / f"{name}{suffix}" for name in ("ours", "theirs"))
    done = dalembert("export", str(tmp_path / "four-bar.toml"), "-o", str(theirs))
    lost = export_mechanism(Mechanism.from_toml_text(FOUR_BAR), ours, length="mm", angle="deg")
    assert lost == notes(done.stderr)
    written = theirs.read_text(encoding="utf-8").replace("from four-bar.toml by", "by")
    assert ours.read_text(encoding="utf-8") == written


def test_the_pose_of_a_robot_is_the_one_at_the_given_inputs(tmp_path: Path) -> None:
    m = Mechanism.from_toml_text(FOUR_BAR)
    for at in (1.2, np.float64(1.2), [1.2]):
        export_mechanism(m, tmp_path / "a.xml", at=at)
        (back,) = import_mechanisms(read_robot(tmp_path / "a.xml"))
        assert back.mechanism.at[0] == pytest.approx(1.2, rel=1e-15)


def test_what_cannot_be_written_leaves_no_file(tmp_path: Path, dalembert: Dalembert) -> None:
    arm = Path(__file__).parents[2] / "cli" / "examples" / "five-bar" / "five-bar.toml"
    file = tmp_path / "a.csv"
    with pytest.raises(DataError, match=r"^curves need one input, and it has several$"):
        export_mechanism(Mechanism.from_toml(arm), file)
    assert dalembert("export", str(arm), "-o", str(file)).stderr.endswith(
        "curves need one input, and it has several: use `dalembert mechanism --cases`\n"
    )
    with pytest.raises(ValueError, match=r"'a\.step': expected a name that ends in \.dxf"):
        export_mechanism(Mechanism.from_toml(arm), "a.step")
    with pytest.raises(DataError, match="cannot write: No such file or directory"):
        export_mechanism(Mechanism.from_toml_text(FOUR_BAR), tmp_path / "none" / "a.svg")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"at": [1.0, 2.0]}, "at: found 2 values, expected one for each input: crank"),
        ({"at": []}, "at: found 0 values, expected one for each input: crank"),
        ({"length": "mmm"}, "length: 'mmm' is no unit of length; did you mean 'mm'"),
        ({"angle": "mm"}, "angle: 'mm' is no unit of angle"),
    ],
)
def test_arguments_that_fit_no_mechanism_are_refused(
    wrong: dict[str, Any], message: str, tmp_path: Path
) -> None:
    m = Mechanism.from_toml_text(FOUR_BAR)
    for suffix in (".csv", ".svg", ".xml"):
        with pytest.raises(ValueError, match=message):
            export_mechanism(m, tmp_path / f"a{suffix}", **wrong)
    assert not list(tmp_path.iterdir())
