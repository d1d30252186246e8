"""Shells complete commands and options."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from cli.examples import EXAMPLES
from tests.conftest import Dalembert

COMMAND = Path(sys.executable).with_name("dalembert")


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_each_shell_has_its_script(shell: str, dalembert: Dalembert) -> None:
    done = dalembert("completion", shell)
    assert done.returncode == 0, done.stderr
    assert f"complete_{shell}" in done.stdout


def test_another_shell_is_refused(dalembert: Dalembert) -> None:
    done = dalembert("completion", "tcsh")
    assert done.returncode == 2
    assert "'bash', 'zsh', 'fish'" in done.stderr


def completed(folder: Path, *line: str) -> list[str]:
    """What bash offers for the last word of a line."""
    quoted = " ".join(f"'{word}'" for word in line)
    script = (
        f"source <(dalembert completion bash); COMP_WORDS=({quoted}); COMP_CWORD={len(line) - 1}; "
        '_dalembert_completion dalembert; printf "%s\\n" "${COMPREPLY[@]}"'
    )
    path = f"{COMMAND.parent}{os.pathsep}{os.environ['PATH']}"
    env = {**os.environ, "PATH": path}
    done = subprocess.run(
        ["bash", "-c", script], cwd=folder, capture_output=True, text=True, env=env, check=True
    )
    assert not done.stderr
    return done.stdout.split()


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash")
@pytest.mark.parametrize(
    ("line", "wanted"),
    [
        (["dalembert", "b"], ["balance", "body"]),
        (["dalembert", "balance", "--pl"], ["--plane", "--planes", "--plot"]),
        (["dalembert", "forces", "four-bar.toml", "--fly"], ["--flywheel"]),
    ],
)
def test_bash_completes(line: list[str], wanted: list[str], tmp_path: Path) -> None:
    assert completed(tmp_path, *line) == wanted


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash")
@pytest.mark.parametrize(
    ("line", "offered", "missing"),
    [
        (("examples", "klan"), {"klann"}, {"blades"}),
        (("mechanism", "klann.toml", "--only", "crank.o"), {"crank.omega"}, {"crank.alpha"}),
        (("mechanism", "klann.toml", "--only", "A,crank.al"), {"A,crank.alpha"}, {"crank.alpha"}),
        (("forces", "klann.toml", "--only", "crank.t"), {"crank.torque"}, set()),
        (("inspect", "klann.toml", "--only", "crank.t"), {"crank.torque"}, set()),
        (("fit", "klann.toml", "t.csv", "--want", "H"), {"H", "H.x"}, {"H.vx"}),
        (("fit", "klann.toml", "t.csv", "--want", "c"), {"coupler.angle", "crank.torque"}, {"crank.omega"}),
        (("mechanism", "klann.toml", "--set", "links.crank."), {"links.crank.B.x="}, {"ground.A.x="}),
        (("mechanism", "klann.toml", "--set", "cra"), set(), {"crank="}),
        (("mechanism", "klann.toml", "--over", "cra"), {"crank="}, set()),
        (("fit", "klann.toml", "t.csv", "--free", "ground.A"), {"ground.A.x="}, {"ground.B.x="}),
        (("balance", "rotor.csv", "--column", "mass_kg=M"), {"mass_kg=Masse"}, {"mass_kg=Radius_mm"}),
        (("mechanism", "absent.toml", "--only", "cr"), set(), {"crank"}),
    ],
)
def test_bash_completes_names_of_the_file(
    line: tuple[str, ...], offered: set[str], missing: set[str], tmp_path: Path
) -> None:
    shutil.copy(EXAMPLES / "klann" / "klann.toml", tmp_path)
    (tmp_path / "t.csv").write_text("A_x_mm,A_y_mm\n1,2\n")
    (tmp_path / "rotor.csv").write_text("Masse,Radius_mm,angle_deg\n1,2,3\n")
    found = set(completed(tmp_path, "dalembert", *line))
    assert offered <= found
    assert not missing & found
