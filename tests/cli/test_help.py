"""Help in panels, choices as choices, an example that runs; colour and progress on a terminal alone."""

from __future__ import annotations

import io
import os
import pty
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from cli import COMMANDS
from cli.show.commands import SHARED, help_lines
from dalembert.terminal import progress, progress_in_time
from tests.conftest import Dalembert

COMMAND = Path(sys.executable).with_name("dalembert")
SOLVING = ("balance", "field", "place", "mechanism", "work", "body", "spin")


def on_a_terminal(folder: Path, *words: str, **environment: str) -> str:
    """What a command shows on a terminal of 120 columns, standard error too."""
    here, there = pty.openpty()
    env = {k: v for k, v in os.environ.items() if k not in ("NO_COLOR", "COLUMNS")}
    process = subprocess.Popen(
        [str(COMMAND), *words],
        stdin=subprocess.DEVNULL,
        stdout=there,
        stderr=there,
        cwd=folder,
        env={**env, "TERM": "xterm", "COLUMNS": "120", **environment},
    )
    os.close(there)
    shown = b""
    while True:
        try:
            part = os.read(here, 65536)
        except OSError:
            break
        if not part:
            break
        shown += part
    process.wait(timeout=60)
    os.close(here)
    return shown.decode().replace("\r\n", "\n")


@pytest.mark.parametrize("command", SOLVING)
def test_options_stand_in_panels_of_at_most_ten(command: str, dalembert: Dalembert) -> None:
    page = dalembert(command, "--help").stdout
    panels = re.split(r"^(?=\S.*:$)", page, flags=re.MULTILINE)[1:]
    titles = [panel.splitlines()[0] for panel in panels]
    assert titles[0] == "Arguments:"
    # in front of what is computed stand, of a mechanism, the poses that it is computed of
    assert titles[1] == ("Which poses, which mechanism:" if command == "mechanism" else "What:")
    assert "Tables:" in titles
    assert "Output:" in titles
    # every option has a panel, those that the help names only have the last one
    assert "Options:" not in titles
    further = next(panel for panel in panels if panel.startswith("Further options"))
    assert further is panels[-2]
    for panel in panels:
        assert len(re.findall(r"^  -", panel, re.MULTILINE)) <= 10, panel
    for name in help_lines(SHARED):
        assert f"--{name.replace('_', '-')}" in page


@pytest.mark.parametrize("command", COMMANDS)
def test_help_is_at_most_60_lines_with_26_options(command: str, tmp_path: Path) -> None:
    """On a terminal of 80 columns, and so in a pipe."""
    page = on_a_terminal(tmp_path, command, "--help", COLUMNS="80")
    assert len(page.splitlines()) <= 60
    assert len(re.findall(r"^ +(?:-., )?--", page, re.MULTILINE)) <= 26


def test_help_is_as_wide_as_the_terminal(tmp_path: Path) -> None:
    for columns in (80, 150):
        page = on_a_terminal(tmp_path, "field", "--help", COLUMNS=str(columns))
        widest = max(map(len, page.splitlines()))
        assert columns - 22 < widest <= columns


def test_choices_are_shown_as_choices(dalembert: Dalembert) -> None:
    page = dalembert("field", "--help").stdout
    for choices in ("<least-squares|minimax>", "<influence|four-run>", "<ccw|cw>"):
        assert choices in page
    assert "<position|velocity|acceleration|jerk>" in dalembert("mechanism", "--help").stdout
    done = dalembert("field", "x.csv", "--objective", "minmax")
    assert done.returncode == 2
    assert "'least-squares', 'minimax'" in done.stderr


@pytest.mark.parametrize("command", SOLVING)
def test_the_example_of_the_help_runs(command: str, dalembert: Dalembert) -> None:
    page = dalembert(command, "--help").stdout
    title, line = page.rstrip().splitlines()[-2:]
    found = re.match(r"Example \(dalembert (examples \S+) writes its files here\):$", title)
    assert found is not None
    assert dalembert(*shlex.split(found[1])).returncode == 0
    program, *words = shlex.split(line)
    assert program == "dalembert"
    assert words[0] == command
    done = dalembert(*words)
    assert done.returncode == 0, done.stderr


def test_every_command_has_help(dalembert: Dalembert) -> None:
    for command in COMMANDS:
        done = dalembert(command, "-h")
        assert done.returncode == 0
        assert done.stdout.startswith(f"Usage: dalembert {command} ")


ROTOR = "mass_g,radius_mm,angle_deg\n5,20,30\n"
JUDGED = ("balance", "r.csv", "--plane", "A:20mm", "--permissible", "50g_mm", "--round-mass", "5g")


def test_colour_is_for_verdicts_warnings_and_marks_on_a_terminal(
    dalembert: Dalembert, tmp_path: Path
) -> None:
    (tmp_path / "r.csv").write_text(ROTOR.replace("\n5,", ",x\n5,").replace("30\n", "30,1\n"))
    shown = on_a_terminal(tmp_path, *JUDGED)
    assert "\033[32mwithin\033[0m" in shown
    assert shown.count("\033[33mwarning:\033[0m") == 1
    assert shown.count("\033[") == 4
    # a warning is not carried out of sight by the table
    assert shown.index("warning:") > shown.index("residual")
    plain = re.sub(r"\033\[[\d;]*m", "", shown)
    for quiet in (
        on_a_terminal(tmp_path, *JUDGED, "--no-color"),
        on_a_terminal(tmp_path, *JUDGED, NO_COLOR="1"),
        on_a_terminal(tmp_path, *JUDGED, TERM="dumb"),
    ):
        assert quiet == plain
    assert "\033" not in dalembert(*JUDGED, "--text").stdout


def test_an_expectation_that_fails_is_red(tmp_path: Path) -> None:
    (tmp_path / "r.csv").write_text(ROTOR)
    (tmp_path / "e.csv").write_text("mass_g,angle_deg\n5,30\n")
    shown = on_a_terminal(tmp_path, "balance", "r.csv", "--plane", "A:20mm", "--expect", "e.csv")
    assert "\033[32mok\033[0m" in shown
    assert "\033[1;31mWRONG\033[0m" in shown


def test_words_that_are_no_verdicts_stay_plain(tmp_path: Path) -> None:
    (tmp_path / "r.csv").write_text("rotor,mass_g,radius_mm,angle_deg\nwithin,5,20,30\nbeyond,5,20,30\n")
    assert "\033" not in on_a_terminal(tmp_path, "balance", "r.csv", "--plane", "within:20mm")


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize(("seconds", "shown"), [(0.1, False), (0.7, True)])
def test_progress_is_for_work_of_more_than_two_seconds(
    seconds: float, shown: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = iter(k * seconds for k in range(100))
    monkeypatch.setattr("time.monotonic", lambda: next(clock))
    for stream, speaks in ((Terminal(), shown), (io.StringIO(), False)):
        monkeypatch.setattr(sys, "stderr", stream)
        assert list(progress(range(8), 8, "rotors")) == list(range(8))
        assert ("of 8 rotors" in stream.getvalue()) == speaks
        # nothing of it stays on the line
        assert stream.getvalue().rpartition("\r")[2] == ""


def test_progress_of_work_whose_first_part_takes_long(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter([0.0, 3.0, 6.0, 9.0])
    monkeypatch.setattr("time.monotonic", lambda: next(clock))
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    assert len(list(progress(range(3), 250, "rotors", each=100))) == 3
    said = [line.strip() for line in terminal.getvalue().split("\r") if line.strip()]
    assert said == [
        "100 of 250 rotors, 4 s to go",
        "200 of 250 rotors, 2 s to go",
        "250 of 250 rotors, 0 s to go",
    ]


def test_an_error_wipes_the_progress_away(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter([0.0, 3.0])
    monkeypatch.setattr("time.monotonic", lambda: next(clock))
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    with pytest.raises(ZeroDivisionError):
        list(progress((1 / x for x in (1, 0)), 2, "rotors"))
    assert "1 of 2 rotors" in terminal.getvalue()
    assert terminal.getvalue().rpartition("\r")[2] == ""


def test_progress_of_one_simulation(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a terminal the time reached in each of its solutions, wiped at the end; in a pipe nothing."""
    from tests.virtualwork.released import double_pendulum
    from virtualwork.intime.run import simulate

    monkeypatch.setattr("dalembert.terminal.AFTER", -1.0)
    monkeypatch.setattr("dalembert.terminal.EVERY", -1.0)
    assembly = double_pendulum().assembly
    plain = simulate(assembly, [0.0, 0.5])
    for stream in (Terminal(), io.StringIO()):
        monkeypatch.setattr(sys, "stderr", stream)
        with progress_in_time() as progress:
            run = simulate(assembly, [0.0, 0.5], progress=progress)
        assert (run.angle == plain.angle).all()
        lines = [line.strip() for line in stream.getvalue().split("\r") if line.strip()]
        if isinstance(stream, Terminal):
            assert lines[-1] == "simulated 0.5 of 0.5 s, solution 2"
            assert any(line.endswith("of 0.5 s, solution 1") for line in lines)
            assert stream.getvalue().endswith("\r")
        else:
            assert not lines


GRAMMAR = """
Arguments:
  source FILE.csv  A table.
  other [FILE]  Another.
What:
  count N  A number of parts.
  share NUMBER(0-1)=0.5  A share.
  seed N(0-)=0  A seed.
  order one|other  A word.
  page FILE(.html)  A page.
  set NAME=VALUE...  Values.
  tol -t --tol TEXT=3mm  A text with a default.
  plain  A flag.
"""
# a word of the command line, its parameter, and what it becomes
TAKEN = [
    ([], "count", None),
    (["--count", "3"], "count", 3),
    ([], "share", 0.5),
    (["--share", "1"], "share", 1.0),
    ([], "seed", 0),
    (["--order", "one"], "order", "one"),
    (["--page", "a.html"], "page", Path("a.html")),
    (["--set", "a=1", "--set", "b=2"], "set", ["a=1", "b=2"]),
    ([], "tol", "3mm"),
    (["-t", "4mm"], "tol", "4mm"),
    ([], "plain", False),
    (["--plain"], "plain", True),
    ([], "source", "a.csv"),
    ([], "other", None),
    (["c.toml"], "other", "c.toml"),
]
REFUSED = [
    (["--count", "0"], "0: expected a number, at least 1"),
    (["--count", "x"], "'x': expected a whole number"),
    (["--share", "1.5"], "1.5: expected a number from 0 to 1"),
    (["--seed", "-1"], "-1: expected a number, at least 0"),
    (["--order", "third"], "'one', 'other'"),
    (["--page", "a.pdf"], "'a.pdf' has no known suffix: expected .html"),
]


def parsed(words: list[str]) -> dict[str, object]:
    """What a command of the options of GRAMMAR takes of some words."""
    import typer

    from cli.show.commands import with_options
    from cli.show.help import with_help
    from dalembert.results.result import Result

    taken: list[dict[str, object]] = []

    def run(options: object, show: object) -> Result:
        taken.append(vars(options))
        return Result(tables={}, document=dict)

    app = typer.Typer(add_completion=False)
    command = with_options(GRAMMAR, (), lambda *_: None)(run)
    app.command(cls=with_help(command, str))(command)
    typer.main.get_command(app).main(["a.csv", *words], standalone_mode=False)
    return taken[0]


@pytest.mark.parametrize(("words", "name", "value"), TAKEN)
def test_a_placeholder_declares_the_values_of_an_option(words: list[str], name: str, value: object) -> None:
    assert parsed(words)[name] == value


@pytest.mark.parametrize(("words", "message"), REFUSED)
def test_a_value_that_its_placeholder_excludes(words: list[str], message: str) -> None:
    import typer

    with pytest.raises(typer.BadParameter) as error:
        parsed(words)
    assert message in error.value.format_message()


def test_suffixes_of_the_output_are_those_that_the_command_writes(dalembert: Dalembert) -> None:
    for command, words in (("mechanism", ("klann.toml",)), ("balance", ("r.csv", "--plane", "A:20mm"))):
        done = dalembert(command, *words, "-o", "x.toml")
        assert done.returncode == 2
        assert "expected .csv, .json, .xlsx, .parquet, .md, .tex\n" in done.stderr
    assert dalembert("fit", "x.toml", "t.csv", "-o", "x.html").returncode == 2
    assert ".tex, .toml; --report" in dalembert("fit", "x.toml", "t.csv", "-o", "x.html").stderr


@pytest.mark.parametrize("command", ["inspect", "equilibrium", "fit"])
def test_an_option_that_the_command_refuses_is_not_in_its_help(command: str, dalembert: Dalembert) -> None:
    assert "--at" not in dalembert(command, "--help").stdout.split()
