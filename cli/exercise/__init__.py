"""The commands for teaching: `exercise` makes a class's variants with sheets, key, solutions and question banks, `grade` marks.

Which variants: `variants.py`, with numbers that `solving.py` has the command work out; the files: `sheets.py`,
`questions.py`; the marks: `marks.py`.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING

from cli.read.options import bad
from cli.show.commands import with_options
from cli.show.output import show
from dalembert.errors import DataError
from dalembert.quantities import is_number
from dalembert.tables.files import is_input

if TYPE_CHECKING:
    from cli.exercise.description import Exercise
    from cli.exercise.sheets import Student
    from cli.show.commands import ShowOptions
    from dalembert.results.result import Result


MOST = 2000


def _show(result: Result, show_options: ShowOptions, call: object) -> None:
    """Say what was written; with --json the document with the key, with --expect its check."""
    import typer

    if show_options.json or show_options.expect is not None:
        show(result, show_options, {})
        return
    for line in result.warnings:
        typer.echo(f"warning: {line}", err=True)
    typer.echo(result.notes(), nl=False)


@with_options(
    """
Arguments:
  file FILE.toml  The exercise.
What:
  students NUMBER|ROSTER.csv=1  Number of students, or their table with a column student.
  seed N(0-)=1  Random seed of the drawn values.
  folder -o --output FOLDER  Folder to write: sheets, answers.csv, key.csv, solutions.html, moodle.xml.
  page  Put a page that computes on each sheet. It is for practice: it shows the answers.
  system --for prairielearn|numbas...  Write the questions for this system too; repeatable.
""",
    ("json", "expect", "rtol"),
    _show,
    example="exercise-rotor",
)
def exercise(options: SimpleNamespace, _: ShowOptions) -> Result:
    """Make the variants of an exercise for a class: a sheet for each student, a table for the answers, key and solutions.

    FILE.toml has the command that solves the exercise, a title, and a text with drawn values, {links.crank.B.x} or
    {rotor.csv:W1.mass_kg}. Its table [draw] has the values to draw from, such as "50mm:80mm:5mm" or a list. Each [[ask]] is
    a question: quantity (a column of the command's CSV), where (its row), figures, points, unit. Every variant can be
    assembled and lies away from limits.
    """
    from cli.exercise import questions
    from cli.exercise.description import read_exercise
    from cli.exercise.recomputed import candidates
    from cli.exercise.sheets import answers_csv, figure, filled, key_table, moving, sheet_page, solutions
    from cli.exercise.variants import several, variants, workshop
    from cli.show.output import options_of
    from dalembert.results.result import Result
    from dalembert.results.text import csv_text

    if not options.folder:
        raise bad("-o", "expected -o FOLDER, where the sheets go")
    for name in options.system or ():
        if name not in questions.SYSTEMS:
            expected = " or ".join(questions.SYSTEMS)
            raise bad("--for", f"'{name}': expected {expected}; moodle.xml is always written")
    exercise = read_exercise(options.file)
    if options.page and "--page" not in options_of(exercise.command[0]):
        raise bad("--page", f"found an exercise on {exercise.command[0]}, which has no page")
    warnings: list[str] = []
    people = _students(options.students, exercise)
    with workshop(exercise) as shop:
        exercise = shop.exercise
        drawn = variants(shop, len(people), options.seed, warnings)
        filled(shop, drawn[0].drawn)
        # students may share a variant
        each = dict.fromkeys(drawn)
        drawings = {variant: figure(variant) for variant in each}
        frames = {variant: moving(variant) for variant in each} if options.page else {}
        files = {
            student.sheet: sheet_page(exercise, student, variant, drawings[variant], frames.get(variant, ""))
            for student, variant in zip(people, drawn, strict=True)
        }
        key = key_table(exercise, people, drawn)
        files["answers.csv"] = answers_csv(key)
        files["key.csv"] = csv_text(key.cells).encode()
        files["solutions.html"] = solutions(exercise, people, drawn, drawings)
        slips = {variant: candidates(variant) for variant in each}
        files["moodle.xml"] = questions.moodle(exercise, people, drawn, drawings, slips)
        for name in options.system or ():
            files |= questions.SYSTEMS[name](exercise, drawn, drawings, slips)
        removed = put(Path(options.folder), files)
    return Result(
        tables={"key": lambda: key},
        head={
            "title": exercise.title,
            "folder": options.folder,
            "variants": len(each),
            "files": sorted(files),
            "removed": removed,
        },
        notes=lambda: (
            f"wrote {len(files)} files to {options.folder}: {several(len(each), 'variant')} for {several(len(people), 'student')}\n"
            + (f"removed {several(len(removed), 'file')} of an earlier run\n" if removed else "")
        ),
        warnings=warnings,
    )


def _students(text: str, exercise: Exercise) -> list[Student]:
    """Read a number of students, or the roster with their names.

    Raises
    ------
    DataError
        A roster without the column, with a name twice, or with a column that the tables of answers have.
    """
    from cli.exercise.description import MARKED
    from cli.exercise.sheets import Student
    from dalembert.tables.table import read

    if is_number(text):
        if not text.strip().isdecimal() or not 1 <= int(text) <= MOST:
            raise bad("--students", f"'{text}': expected a whole number from 1 to {MOST}, or a file")
        return [Student(str(k), {}) for k in range(1, int(text) + 1)]
    table = read(text, texts=None)
    columns = table.as_written
    named = {name.lower(): name for name in columns}
    if "student" not in named:
        raise DataError(f"{text}: no column student: expected one, found {', '.join(columns)}")
    column = columns[named["student"]]
    seen: dict[str, int] = {}
    for row, name in enumerate(column):
        if not name:
            raise table.error(row, named["student"], name, "a name or number")
        if name in seen:
            raise table.error(
                row, named["student"], name, f"each student once (row {seen[name] + 1} has it too)"
            )
        seen[name] = row
    others = [name for name in columns if name != named["student"]]
    own = {*MARKED, *exercise.keys.values(), *(draw.name for draw in exercise.draws)}
    for name in others:
        if name.lower() in map(str.lower, own):
            raise DataError(
                f"{text}: column {name}: the tables of answers have one of that name: expected another, such as {name} 2"
            )
    people = [Student(name, {each: columns[each][row] for each in others}) for row, name in enumerate(column)]
    files: dict[str, str] = {}
    for person in people:
        twin = files.setdefault(person.sheet.lower(), person.name)
        if twin != person.name:
            raise DataError(
                f"{text}: column student: found '{twin}' and '{person.name}', expected names that make two file names"
            )
    return people


# --- the folder: written whole or not at all ------------------------------------------------------------------------
def put(folder: Path, files: Mapping[str, bytes]) -> list[str]:
    """Write all files of a folder, or none: a new folder appears at once, in one that is there files are replaced.

    Returns
    -------
    list of str
        The files of an earlier run that were removed: sheets of students who are not in the class, questions for systems
        that are not requested. They have the numbers of an older key.

    Raises
    ------
    DataError
        Where the folder cannot be written, or would lose answers that were filled in, or one of the inputs.
    """
    import shutil
    import tempfile

    _refuse(folder, files)
    parent = folder.parent
    if not parent.is_dir():
        raise DataError(f"{folder}: cannot write: no folder {parent}")
    removed: list[str] = []
    try:
        made = Path(tempfile.mkdtemp(prefix=f".{folder.name}.", suffix=".part", dir=parent))
        try:
            for name, data in files.items():
                path = made / name
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(data)
            if folder.is_dir():
                removed = [name for name in _earlier(folder) if name not in files]
                for name in removed:
                    folder.joinpath(name).unlink()
                _remove_empty_folders(folder, removed)
                for name in files:
                    folder.joinpath(name).parent.mkdir(parents=True, exist_ok=True)
                    os.replace(made / name, folder / name)
            else:
                made.chmod(0o777 & ~_mask())
                os.replace(made, folder)
        finally:
            shutil.rmtree(made, ignore_errors=True)
    except OSError as error:
        raise DataError(f"{folder}: cannot write: {error.strerror or error}") from None
    return removed


def _earlier(folder: Path) -> Iterator[str]:
    """Yield sheets and questions in a folder that this command wrote: they say so themselves, a sheet with its name."""
    from cli.exercise.questions import NUMBAS, PRAIRIELEARN, SERVER, TAG
    from cli.exercise.sheets import mark

    for path in sorted(folder.glob("sheet-*.html")):
        if path.is_file() and mark(path.name).encode() in path.read_bytes():
            yield path.name
    exam = folder / NUMBAS
    if exam.is_file() and f'"{TAG}"'.encode() in exam.read_bytes():
        yield NUMBAS
    for server in sorted(folder.glob(f"{PRAIRIELEARN}/*/server.py")):
        if server.read_bytes() == SERVER.encode():
            question = server.parent
            files = (question / name for name in ("info.json", "question.html", "server.py", "variants.json"))
            yield from (path.relative_to(folder).as_posix() for path in files if path.is_file())


def _remove_empty_folders(folder: Path, removed: Iterable[str]) -> None:
    """Remove the folders within a folder that the removal of files has emptied."""
    within = {parent for name in removed for parent in Path(name).parents} - {Path()}
    for parent in sorted(within, reverse=True):
        # one that has other files stays
        with suppress(OSError):
            folder.joinpath(parent).rmdir()


def _mask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def _refuse(folder: Path, files: Mapping[str, bytes]) -> None:
    from dalembert.tables.table import read

    if folder.exists() and not folder.is_dir():
        raise DataError(f"{folder}: cannot write: found a file, expected a folder or a new name")
    for name in files:
        path = folder / name
        if is_input(path):
            raise DataError(f"{path}: is an input: expected another folder; nothing was written")
    answers = folder / "answers.csv"
    if answers.is_file():
        try:
            filled = any(cell.strip() for cell in read(str(answers), texts=None).texts.get("answer", []))
        except DataError:
            filled = True
        if filled:
            raise DataError(
                f"{answers}: its answers would be lost: expected another folder; nothing was written"
            )


@with_options(
    """
Arguments:
  file FILE.toml  The exercise.
  answers ANSWERS  Table of the answers; - is standard input.
What:
  key KEY.csv  Right answers of each student (default: key.csv in the folder of the answers).
""",
    ("json", "output", "text", "report", "about", "no_color"),
    show,
    example="exercise-slider-crank",
)
def grade(options: SimpleNamespace, _: ShowOptions) -> Result:
    """Mark the answers to an exercise: right, rounding, figures, carried, wrong or blank, with the likely mistake.

    ANSWERS is the answers.csv of dalembert exercise, with the column answer filled in. It has the columns student,
    quantity, answer, unit and those that name the row; further columns are kept. An answer may have a decimal comma,
    a power of ten and its own unit: 1,23 or 1.23e0 or 18.1 kJ. An angle may differ by whole turns. The status is 0
    however wrong the answers are.
    """
    from cli.exercise.description import read_exercise
    from cli.exercise.marks import METHOD, mark_all, read_students, tables
    from cli.exercise.variants import several, workshop
    from dalembert.results.result import Result

    with workshop(read_exercise(options.file)) as shop:
        exercise = shop.exercise
        students = read_students(exercise, options.answers, options.key)
        marks = mark_all(exercise, shop, students)
    points = sum(mark.points for mark in marks)
    of = float(exercise.points) * len(students)
    return Result(
        tables=tables(exercise, students, marks),
        companions=["totals"],
        notes=lambda: f"{exercise.title}: {several(len(students), 'student')}, {points:g} of {of:g} points",
        method=METHOD,
        # the marks hold the answers; the tables of each student's numbers are gone with the workshop
        shows_input=True,
        about={"title": f"Marks: {exercise.title}"},
    )
