"""Who may import whom, what the front door loads, what the wheel holds."""

from __future__ import annotations

import ast
import json
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
GROUND = "dalembert"
CORE = ("balancing", "virtualwork", "rigidbody3d")
HEAVY = {"numpy", "pandas", "scipy", "matplotlib", "rich", "pydantic"}


def imported(file: Path) -> set[str]:
    """Return the top names of everything a file imports, wherever in it."""
    names = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file}: relative import"
            names.add((node.module or "").split(".")[0])
    return names


@pytest.mark.parametrize("package", CORE)
def test_core_packages_stand_alone(package: str) -> None:
    files = sorted((ROOT / package).rglob("*.py"))
    assert files
    # pandas only for to_frame, never its reader; trimesh is the extra `mesh`
    allowed = set(sys.stdlib_module_names) | {package, GROUND, "numpy", "scipy", "pandas", "trimesh"}
    for file in files:
        assert imported(file) <= allowed, f"{file}: {imported(file) - allowed}"
        assert "read_csv" not in file.read_text(encoding="utf-8"), file


def test_the_ground_stands_on_numpy_alone() -> None:
    for file in sorted((ROOT / GROUND / "arithmetic").rglob("*.py")):
        assert imported(file) <= set(sys.stdlib_module_names) | {GROUND, "numpy", "llvmlite"}, file


def test_nothing_imports_the_tests_or_an_undeclared_package() -> None:
    allowed = set(sys.stdlib_module_names) | {
        *CORE,
        GROUND,
        "cli",
        "numpy",
        "scipy",
        "pandas",
        "typer",
        "matplotlib",
    }
    for file in sorted((ROOT / "cli").rglob("*.py")):
        # the stress campaigns compare with mpmath, which the extra `test` brings
        here = allowed | {"mpmath"} if file.parent.name == "bench" else allowed
        assert imported(file) <= here, f"{file}: {imported(file) - here}"


def modules_after(*arguments: str) -> set[str]:
    """Return the top-level modules loaded once `dalembert ARGUMENTS` has run."""
    script = (
        "import sys, json, cli.app\n"
        f"sys.argv = ['dalembert', *{list(arguments)!r}]\n"
        "try:\n    cli.app.main()\nexcept SystemExit:\n    pass\n"
        "print(json.dumps(sorted({name.split('.')[0] for name in sys.modules})), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    return set(json.loads(done.stderr.splitlines()[-1]))


@pytest.mark.parametrize(
    "arguments", [("--help",), ("--version",), ("examples",), ("balance", "--help"), ("bench", "--help")]
)
def test_help_loads_nothing_heavy(arguments: tuple[str, ...]) -> None:
    loaded = modules_after(*arguments)
    assert "typer" in loaded
    assert not loaded & HEAVY


def test_a_small_table_needs_numpy_only(tmp_path: Path) -> None:
    table = tmp_path / "rotor.csv"
    table.write_text("mass_kg,radius_mm,angle_deg\n1,20,30\n")
    loaded = modules_after("balance", str(table), "--plane", "A:20mm")
    assert "numpy" in loaded
    assert not loaded & (HEAVY - {"numpy"})


def test_the_wheel_holds_the_packages_and_the_examples(tmp_path: Path) -> None:
    subprocess.run(
        [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", tmp_path, ROOT],
        check=True,
        capture_output=True,
    )
    (wheel,) = tmp_path.glob("*.whl")
    held = {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}
    tracked = {
        str(file.relative_to(ROOT))
        for package in (GROUND, *CORE, "cli")
        for file in (ROOT / package).rglob("*")
        if file.is_file() and "__pycache__" not in file.parts
    }
    assert held == tracked
    assert "cli/examples/riul-rotor/rotor.csv" in held
    assert {f"{package}/py.typed" for package in (GROUND, *CORE, "cli")} <= held
