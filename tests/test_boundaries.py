"""Which file may know which, what the front door loads, what the wheel holds."""

from __future__ import annotations

import ast
import json
import subprocess
import sys
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).parents[1]
CORE = ("balancing", "virtualwork", "rigidbody3d")
HEAVY = {
    "numpy",
    "pandas",
    "scipy",
    "matplotlib",
    "rich",
    "pydantic",
    "python_calamine",
    "openpyxl",
    "pyarrow",
    "ezdxf",
}

# From the top down. A room (a file or a folder of its package) imports rooms of the levels below its own, never above
# and never beside it; a file in a folder may import any of the same folder, but in no circle.
LEVELS: dict[str, tuple[tuple[str, ...], ...]] = {
    "balancing": (
        ("__init__",),
        ("runs",),
        ("cylinders", "log_picture", "placement_request"),
        ("doubt", "next_run", "objective", "polygons", "weights"),
        (
            "amplitudes",
            "engine",
            "known_masses",
            "log_balance",
            "mode_shapes",
            "placement",
            "prior",
            "tolerance",
            "trial",
            "unbalance",
        ),
        ("balance", "correction", "run_log"),
        ("sheet",),
        ("tapes",),
        ("optimality",),
        ("limited", "rounding"),
        ("influence", "modal", "reading_errors"),
        ("qr",),
        ("second_run",),
        (
            "checked_data",
            "cone_problem",
            "dependence",
            "flywheel",
            "indexing",
            "phase",
            "picture",
            "planes",
            "rotor",
            "rotor_svg",
            "synchronous",
        ),
        ("marks", "triangle"),
    ),
    "virtualwork": (
        ("__init__",),
        ("exchange",),
        ("mechanism",),
        ("intime",),
        ("motion",),
        ("motion_views",),
        ("computing_page",),
        ("family",),
        ("animation", "evaluator", "notebook_picture", "page_shapes", "parts_of_motion", "toml_template"),
        ("doubts", "forces", "motion_table"),
        ("picture",),
        ("study",),
        ("textbook",),
        ("branch",),
        ("digits",),
        ("drawing", "quantities"),
        ("formulas",),
        ("plan", "shapes"),
        ("describe",),
    ),
    "rigidbody3d": (
        ("__init__",),
        ("rotation_in_time",),
        ("turning_body",),
        ("parts", "robots"),
        ("freebody", "gyroscope", "integration", "momentum", "percussion", "shaft", "top"),
        ("body", "free_rotation", "states"),
        ("animation", "picture"),
        ("solids",),
        ("inertia",),
        ("attitude", "eigenvectors", "elliptic", "shapes", "splitting", "top_roots", "turning"),
    ),
    "cli": (
        ("__main__",),
        ("app",),
        ("exercise",),
        ("completion",),
        (
            "balance",
            "body",
            "examples",
            "field",
            "mechanism",
            "rotor",
        ),
        ("formats",),
        ("cases",),
        ("show",),
        ("read",),
        ("__init__",),
    ),
    "dalembert": (
        ("__init__",),
        ("documents", "results"),
        ("drawing", "page", "tables", "written"),
        ("arithmetic",),
        ("angles", "figures", "quantities"),
        ("units",),
        ("dataclass", "decimals", "errors", "hints", "memory", "on_use", "terminal"),
    ),
    "benchmarks": (
        ("__main__", "commands_page", "library_page", "page_pictures", "same_outputs", "trace_passes"),
        ("fuzz", "page", "peers"),
        ("speed", "stress"),
        ("scenes",),
        ("truth",),
        ("__init__",),
    ),
}
INSTALLED = tuple(package for package in LEVELS if package != "benchmarks")
# The same between packages. Nothing below `dalembert/__init__.py`, the front door, imports that.
PACKAGES = (
    ("benchmarks",),
    ("dalembert.__init__",),
    ("cli",),
    CORE,
    *(tuple(f"dalembert.{room}" for room in level) for level in LEVELS["dalembert"][1:]),
)


def module_of(file: Path) -> str:
    """Return a file's name as it is imported; a package's own file keeps its `__init__`."""
    return ".".join(file.relative_to(ROOT).with_suffix("").parts)


class File(NamedTuple):
    """What the rules ask of a file; its syntax tree, larger by far, is not kept."""

    text: str
    imports: list[tuple[str, str | None]]  # the module, and a name of it or None
    at_start: set[str]  # the top names that are imported outside of functions
    foreign: set[str]  # the private names of other files that it reads

    @property
    def tops(self) -> set[str]:
        """The top names of everything that it imports."""
        return {name.split(".")[0] for name, _ in self.imports}


def read(text: str) -> File:
    """Read a file's syntax."""
    tree = ast.parse(text)
    nodes = [*ast.walk(tree)]
    imported = [*imports(nodes)]
    at_start = {name.split(".")[0] for name, _ in imports(tree.body)}
    return File(text, imported, at_start, foreign_private_names(nodes, imported))


@cache
def files() -> dict[str, File]:
    """Return every file of every package, by module."""
    paths = [path for package in LEVELS for path in sorted((ROOT / package).rglob("*.py"))]
    return {module_of(path): read(path.read_text(encoding="utf-8")) for path in paths}


def module_named(name: str) -> str | None:
    """Return the file that an imported name stands for, of the packages here."""
    return next((m for m in (name, f"{name}.__init__") if m in files()), None)


def imports(nodes: Iterable[ast.AST]) -> Iterator[tuple[str, str | None]]:
    """Yield (module, name or None) of each import among nodes: of a whole file in functions and under TYPE_CHECKING too."""
    for node in nodes:
        if isinstance(node, ast.Import):
            yield from ((alias.name, None) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "relative import"
            yield from ((node.module or "", alias.name) for alias in node.names)
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name | ast.Attribute):
            called = node.func.id if isinstance(node.func, ast.Name) else node.func.attr
            if called == "import_module" and node.args and isinstance(node.args[0], ast.Constant):
                yield str(node.args[0].value), None


@cache
def graph() -> dict[str, set[str]]:
    """Return the files that each file imports."""
    found = {}
    for module, file in files().items():
        to = ((part and module_named(f"{name}.{part}")) or module_named(name) for name, part in file.imports)
        found[module] = {other for other in to if other}
    return found


def reached(module: str) -> set[str]:
    """Return all that a file imports, and what that imports, and so on."""
    seen: set[str] = set()
    ahead = [module]
    while ahead:
        new = graph()[ahead.pop()] - seen
        seen |= new
        ahead += new
    return seen


def level_of(module: str) -> tuple[str, int] | None:
    """Return a file's room in its package and the room's level, 0 on top; None where the table has no place for it."""
    package, room = module.split(".")[:2]
    return next(((room, i) for i, rooms in enumerate(LEVELS[package]) if room in rooms), None)


def level_of_package(module: str) -> tuple[str, int]:
    """Return the same among the packages."""
    for i, names in enumerate(PACKAGES):
        for name in names:
            if module == name or module.startswith(f"{name}."):
                return name, i
    raise AssertionError(f"{module}: no level among the packages")


def upwards(module: str, other: str) -> bool:
    """Say whether an import leads to a room above or beside."""
    here, there = level_of_package(module), level_of_package(other)
    if here[0] != there[0]:
        return there[1] <= here[1]
    mine, its = level_of(module), level_of(other)
    return mine is not None and its is not None and mine[0] != its[0] and its[1] <= mine[1]


def is_private(name: str) -> bool:
    """Say whether a name is for its own file alone."""
    return name == "__dict__" or (name.startswith("_") and not name.endswith("__"))


# public names of the standard library that begin with an underscore all the same
PUBLIC = {"_asdict", "_fields", "_make", "_replace"}


def own_names(nodes: Iterable[ast.AST]) -> set[str]:
    """Return the private names that a file defines: functions, classes, fields, and attributes of its own objects."""
    found = set()
    for node in nodes:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            found.add(node.name)
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            found.add(node.id)
        elif isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store) and of_self(node.value):
            found.add(node.attr)
    return found


def of_self(node: ast.expr) -> bool:
    """Say whether an expression is `self`, `cls` or `super()`."""
    if isinstance(node, ast.Call):
        node = node.func
        return isinstance(node, ast.Name) and node.id == "super"
    return isinstance(node, ast.Name) and node.id in ("self", "cls")


def foreign_private_names(nodes: list[ast.AST], imported: list[tuple[str, str | None]]) -> set[str]:
    """Return the private names of other files that a file reads."""
    mine = own_names(nodes)
    found = set()
    for name, part in imported:
        found |= {word for word in (*name.split("."), part or "") if is_private(word)}
    for node in nodes:
        if isinstance(node, ast.Attribute):
            value, name = node.value, node.attr
        elif (
            isinstance(node, ast.Call)
            and isinstance(node.func, ast.Name)
            and node.func.id in ("getattr", "setattr", "hasattr", "delattr")
            and isinstance(node.args[1], ast.Constant)
        ):
            value, name = node.args[0], str(node.args[1].value)
        else:
            continue
        if is_private(name) and name not in PUBLIC | mine and not of_self(value):
            found.add(name)
    return found


def offences(module: str, file: File) -> set[str]:
    """Return what a file does against the rules."""
    found = {f"reads {name}" for name in file.foreign}
    found |= {f"imports {other}, upwards" for other in graph()[module] if upwards(module, other)}
    found |= {"circle"} if module in reached(module) else set()
    return found | ({"no level"} if level_of(module) is None else set())


def test_imports_point_down_in_no_circle_and_private_names_stay_at_home() -> None:
    found = {module: offences(module, file) for module, file in files().items()}
    assert {module: wrong for module, wrong in found.items() if wrong} == {}


@pytest.mark.parametrize(
    ("text", "foreign"),
    [
        ("from balancing.rotor import _one", {"_one"}),
        ("import balancing._rotor", {"_rotor"}),
        ("import numpy as np\nnp._x", {"_x"}),
        ("def f(other):\n    return other._x", {"_x"}),
        ("def f(other):\n    return getattr(other, '_x'), other.__dict__", {"_x", "__dict__"}),
        (
            "class A:\n    def f(self, other):\n        self._x = super()._y\n        return other._x, self._z",
            set(),
        ),
        ("def _x(): ...\ndef f(pair):\n    return pair._replace(a=_x()), pair.__class__", set()),
    ],
)
def test_a_foreign_private_name_is_seen(text: str, foreign: set[str]) -> None:
    assert read(text).foreign == foreign


@pytest.mark.parametrize("package", CORE)
def test_core_packages_stand_alone(package: str) -> None:
    # pandas only for to_frame, never its reader; trimesh is the extra `mesh`, matplotlib `plot`, ezdxf `cad`
    allowed = set(sys.stdlib_module_names) | {package, "dalembert", "numpy", "scipy", "pandas", "trimesh"}
    allowed |= {"matplotlib", "mpl_toolkits", "ezdxf"}
    for module, file in files().items():
        if module.startswith(f"{package}."):
            assert file.tops <= allowed, f"{module}: {file.tops - allowed}"
            assert "read_csv" not in file.text, module


def test_the_ground_stands_on_numpy_alone() -> None:
    for module, file in files().items():
        if module.startswith("dalembert.arithmetic."):
            # pandas only for tables of results
            allowed = set(sys.stdlib_module_names) | {"dalembert", "numpy", "pandas", "llvmlite"}
            assert file.tops <= allowed, f"{module}: {file.tops - allowed}"


def test_the_readers_of_tables_know_no_command_line_and_load_pandas_for_long_tables_alone() -> None:
    """Library and command line read tables with the same files."""
    for module, file in files().items():
        if module.startswith("dalembert.tables."):
            allowed = set(sys.stdlib_module_names) | {"dalembert", "numpy", "pandas", "python_calamine"}
            assert file.tops <= allowed, f"{module}: {file.tops - allowed}"
            assert not file.at_start & {"pandas", "python_calamine"}, module


def test_matplotlib_is_imported_by_functions_alone() -> None:
    """Elsewhere for type hints only."""
    for module, file in files().items():
        assert not file.at_start & {"matplotlib", "mpl_toolkits"}, module


def test_nothing_imports_the_tests_or_an_undeclared_package() -> None:
    declared = {"numpy", "scipy", "pandas", "typer", "matplotlib", "mpl_toolkits", "trimesh", "llvmlite"}
    declared |= {"python_calamine", "openpyxl", "pyarrow", "defusedxml", "ezdxf", "tomlkit"}
    for module, file in files().items():
        allowed = set(sys.stdlib_module_names) | set(INSTALLED) | declared
        if module.startswith("benchmarks.peers."):
            continue
        if module.startswith("benchmarks."):  # the extra `test` brings mpmath and selenium
            allowed |= {"benchmarks", "mpmath", "selenium"}
        assert file.tops <= allowed, f"{module}: {file.tops - allowed}"


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
    "arguments",
    [
        *[("--help",), ("--version",), ("examples",)],
        *((name, "--help") for name in ("balance", "index", "work", "spin", "grade")),
    ],
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


def test_a_check_of_inertias_loads_no_mechanism(tmp_path: Path) -> None:
    """Files that read a robot also write one of a mechanism; a reader alone does without."""
    robot = tmp_path / "robot.urdf"
    robot.write_text(
        '<robot name="r"><link name="a"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>'
        "</link></robot>"
    )
    loaded = modules_after("body", str(robot), "--check-inertias")
    assert "rigidbody3d" in loaded
    assert "virtualwork" not in loaded


def test_no_file_has_the_name_of_something_in_its_packages_own_file() -> None:
    """Importing `cli.rotor.index` would put the file in the place of the function `index`."""
    for module, file in files().items():
        if module.endswith(".__init__") and module.startswith("cli."):
            beside = {name.split(".")[-1] for name in files() if name.rpartition(".")[0] == module[:-9]}
            body = ast.parse(file.text).body
            named = {part for node in body if isinstance(node, ast.ImportFrom) for part in node.names}
            here = {part.asname or part.name for part in named}
            here |= {node.name for node in body if isinstance(node, ast.FunctionDef)}
            assert not beside & here, module


# Within a command's folder, from the top down; the other files of a folder stand between these as they need.
ROLES = (("command",), ("columns", "picture", "remarks", "report", "words"), ("solve",), ("read",))


def test_a_commands_files_stand_in_one_order() -> None:
    """The options, then columns, words and pictures, then the solution, then what is read."""
    level = {role: i for i, roles in enumerate(ROLES) for role in roles}
    for module, others in graph().items():
        package, *rest = module.split(".")
        if package != "cli" or len(rest) != 2 or rest[1] not in level:
            continue
        for other in others:
            *room, role = other.split(".")
            if room == [package, rest[0]] and role in level:
                assert level[rest[1]] <= level[role], f"{module} imports {other}"
