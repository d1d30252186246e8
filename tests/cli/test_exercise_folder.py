"""The folder that `dalembert exercise` writes: the same for a seed, whole, and with nothing of an earlier class."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.cli.exercises import EXERCISE, rotor_exercise
from tests.conftest import Dalembert


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with an exercise."""
    return rotor_exercise(tmp_path)


def contents(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()
    }


def test_the_same_seed_is_the_same_folder_and_another_is_not(dalembert: Dalembert, folder: Path) -> None:
    for name, seed in (("one", 5), ("two", 5), ("three", 6)):
        assert dalembert("exercise", "e.toml", "--students", 3, "--seed", seed, "-o", name).returncode == 0
    one, two, three = (contents(folder / name) for name in ("one", "two", "three"))
    assert one == two
    assert one["key.csv"] != three["key.csv"]


def test_wrong_usage_is_status_2(dalembert: Dalembert, folder: Path) -> None:
    assert dalembert("exercise", "e.toml").returncode == 2
    assert dalembert("exercise", "e.toml", "--students", "0", "-o", "out").returncode == 2
    assert dalembert("exercise", "e.toml", "--students", "2.5", "-o", "out").returncode == 2
    assert dalembert("exercise", "e.toml", "-o", "").returncode == 2
    assert not (folder / "out").exists()


def test_answers_that_are_filled_in_are_never_lost(dalembert: Dalembert, folder: Path) -> None:
    assert dalembert("exercise", "e.toml", "-o", "out").returncode == 0
    assert dalembert("exercise", "e.toml", "-o", "out").returncode == 0
    answers = folder / "out" / "answers.csv"
    answers.write_text(answers.read_text().replace("kg,\n", "kg,8.55\n", 1))
    before = contents(folder / "out")
    done = dalembert("exercise", "e.toml", "--seed", 9, "-o", "out")
    assert done.returncode == 1
    assert "answers.csv" in done.stderr
    assert before == contents(folder / "out")


def test_a_smaller_class_leaves_no_sheets_of_the_larger(dalembert: Dalembert, folder: Path) -> None:
    """Sheets 3 and 4 would have the numbers of an older key."""
    assert dalembert("exercise", "e.toml", "--students", 4, "-o", "out").returncode == 0
    done = dalembert("exercise", "e.toml", "--students", 2, "--seed", 2, "-o", "out")
    assert done.stdout.splitlines()[1] == "removed 2 files of an earlier run"
    assert dalembert("exercise", "e.toml", "--students", 2, "--seed", 2, "-o", "new").returncode == 0
    assert contents(folder / "out") == contents(folder / "new")


def test_a_roster_takes_the_place_of_numbers_and_questions_go_with_their_system(
    dalembert: Dalembert, folder: Path
) -> None:
    first = dalembert(
        "exercise", "e.toml", "--students", 2, "-o", "out", "--for", "prairielearn", "--for", "numbas"
    )
    assert first.returncode == 0, first.stderr
    (folder / "class.csv").write_text('student\nAna Sá\n<b> & "c"\n')
    (folder / "e.toml").write_text(EXERCISE.replace("A rotor", "Another"))
    words = ("exercise", "e.toml", "--students", "class.csv", "--for", "prairielearn")
    done = dalembert(*words, "-o", "out", "--json")
    question = [
        f"prairielearn/a-rotor/{name}"
        for name in ("info.json", "question.html", "server.py", "variants.json")
    ]
    assert json.loads(done.stdout)["removed"] == ["sheet-1.html", "sheet-2.html", "numbas.exam", *question]
    assert dalembert(*words, "-o", "new").returncode == 0
    assert contents(folder / "out") == contents(folder / "new")


def test_files_of_others_stay(dalembert: Dalembert, folder: Path) -> None:
    """Of a teacher: a sheet of his own, a copy of one under another name, an exam, a file beside a question."""
    words = ("exercise", "e.toml", "--students", 3, "-o", "out", "--for", "prairielearn")
    assert dalembert(*words).returncode == 0
    out = folder / "out"
    own = {
        "sheet-9.html": b"<p>mine</p>",
        "sheet-late.html": (out / "sheet-3.html").read_bytes(),
        "numbas.exam": b"// Numbas version: exam\n{}",
        "marks.csv": b"student\n",
        "prairielearn/a-rotor/notes.txt": b"",
        "prairielearn/own/server.py": b"def generate(data): pass\n",
    }
    (out / "prairielearn" / "own").mkdir()
    (out / "sheet-of-all.html").mkdir()
    for name, data in own.items():
        (out / name).write_bytes(data)
    assert dalembert("exercise", "e.toml", "--students", 2, "-o", "new").returncode == 0
    assert dalembert("exercise", "e.toml", "--students", 2, "-o", "out").returncode == 0
    assert contents(out) == contents(folder / "new") | own
