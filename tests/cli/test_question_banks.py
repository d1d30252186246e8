"""The questions of an exercise as Moodle, PrairieLearn and Numbas read them."""

from __future__ import annotations

import json
import re
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import pytest

from tests.cli.exercises import EXERCISE, rotor_exercise, rows
from tests.conftest import Dalembert


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with an exercise."""
    return rotor_exercise(tmp_path)


def moodle_takes(question: ET.Element, value: float) -> tuple[float, str]:
    """Moodle's rule: the first answer that is at most its tolerance away gives fraction and feedback (nominal tolerance)."""
    for answer in question.findall("answer"):
        nominal, tolerance = float(answer.findtext("text", "")), abs(float(answer.findtext("tolerance", "")))
        slack = 1e-14 * max(1.0, abs(nominal))
        if nominal - tolerance - slack <= value <= nominal + tolerance + slack:
            return float(answer.get("fraction", "")), answer.findtext("feedback/text") or ""
    return 0.0, ""


def test_a_slash_of_a_title_parts_no_category_of_moodle(dalembert: Dalembert, folder: Path) -> None:
    """Of the bank's path each part is a category, and two slashes are one of its name; an empty title is the file's name."""
    for title, name in (("Balance 1/2", "Balance 1//2"), ("", "e")):
        (folder / "e.toml").write_text(EXERCISE.replace('title = "A rotor"', f'title = "{title}"'))
        assert dalembert("exercise", "e.toml", "-o", "out").returncode == 0
        quiz = ET.parse(folder / "out" / "moodle.xml").getroot()
        path = quiz.findtext("question[@type='category']/category/text")
        assert path == f"$course$/top/{name}/1 mass (plane B)"


def test_moodles_questions(dalembert: Dalembert, folder: Path) -> None:
    """Elements and their meaning as question/format/xml of Moodle reads them."""
    dalembert("exercise", "e.toml", "--students", 3, "-o", "out")
    quiz = ET.parse(folder / "out" / "moodle.xml").getroot()
    assert quiz.tag == "quiz"
    kinds = [question.get("type") for question in quiz]
    assert kinds.count("category") == 3
    assert kinds.count("numerical") == 9
    key = {(row["student"], row["plane"], row["quantity"]): row for row in rows(folder / "out" / "key.csv")}
    for question in quiz.findall("question[@type='numerical']"):
        for name in (
            "name/text",
            "questiontext/text",
            "defaultgrade",
            "penalty",
            "hidden",
            "unitgradingtype",
            "unitpenalty",
            "showunits",
            "unitsleft",
        ):
            assert question.find(name) is not None, name
        assert question.find("questiontext").get("format") == "html"  # type: ignore[union-attr]
        # 3: no unit is typed, the number alone is graded
        assert question.findtext("showunits") == "3"
        name = question.findtext("name/text", "")
        student = re.search(r"\((\d+)\)$", name)[1]  # type: ignore[index]
        plane = re.search(r"plane ([AB])", name)[1]  # type: ignore[index]
        row = key[student, plane, "angle_deg" if "angle" in name else "mass_kg"]
        right = float(row["answer"])
        assert question.findtext("defaultgrade") == row["points"]
        half = 0.5 * 10.0 ** -len(row["answer"].partition(".")[2])
        assert moodle_takes(question, right)[0] == 100
        assert moodle_takes(question, float(row["value"]))[0] == 100
        for side in (-1, 1):
            assert moodle_takes(question, right + side * 0.999 * half)[0] == 100
            assert moodle_takes(question, right + side * 2 * half)[0] == 0
        if "angle" in name:
            assert moodle_takes(question, right - 360)[0] == 100
        feedbacks = [
            answer.findtext("feedback/text") or "" for answer in question.findall("answer[@fraction='0']")
        ]
        assert len(feedbacks) > 3
        assert all(text.startswith("Likely mistake: ") for text in feedbacks)
        for answer in question.findall("answer[@fraction='0']"):
            assert moodle_takes(question, float(answer.findtext("text", "")))[1] == answer.findtext(
                "feedback/text"
            )


def test_prairielearns_question(dalembert: Dalembert, folder: Path) -> None:
    """The element grades by |a − right| ≤ atol; server.py names mistakes and takes an angle a turn off."""
    done = dalembert("exercise", "e.toml", "--students", 3, "-o", "out", "--for", "prairielearn")
    assert done.returncode == 0, done.stderr
    question = folder / "out" / "prairielearn" / "a-rotor"
    info = json.loads((question / "info.json").read_text())
    assert info["type"] == "v3"
    assert {"uuid", "title", "topic"} <= info.keys()
    page = (question / "question.html").read_text()
    assert re.findall(r'answers-name="(\w+)"', page) == ["answer1", "answer2", "answer3"]
    assert re.findall(r' weight="(\d+)"', page) == ["2", "1", "1"]
    assert page.count('comparison="relabs" rtol="0"') == 3
    server: dict[str, Any] = {}
    exec((question / "server.py").read_text(), server)
    data: dict[str, Any] = {
        "params": {}, "correct_answers": {}, "variant_seed": 17, "options": {"question_path": str(question)},
        "submitted_answers": {}, "partial_scores": {},
    }  # fmt: skip
    server["generate"](data)
    assert "<svg" in data["params"]["problem"]
    right = data["correct_answers"]
    mistake = data["params"]["answer1"]["mistakes"][0]
    data["submitted_answers"] = {
        "answer1": mistake["value"],
        "answer2": right["answer2"] - 360,
        "answer3": right["answer3"],
    }
    for name, weight in (("answer1", 2), ("answer2", 1), ("answer3", 1)):
        off = abs(data["submitted_answers"][name] - right[name])
        data["partial_scores"][name] = {
            "score": float(off <= data["params"][name]["tolerance"]),
            "weight": weight,
        }
    assert [each["score"] for each in data["partial_scores"].values()] == [0, 0, 1]
    server["grade"](data)
    assert [each["score"] for each in data["partial_scores"].values()] == [0, 1, 1]
    assert data["partial_scores"]["answer1"]["feedback"] == f"Likely mistake: {mistake['text']}."
    assert data["score"] == 0.5


def test_numbas_exam(dalembert: Dalembert, folder: Path) -> None:
    done = dalembert("exercise", "e.toml", "--students", 3, "-o", "out", "--for", "numbas")
    assert done.returncode == 0, done.stderr
    head, _, body = (folder / "out" / "numbas.exam").read_text().partition("\n")
    assert head.startswith("// Numbas version: ")
    exam = json.loads(body)
    (group,) = exam["question_groups"]
    assert (group["pickingStrategy"], group["pickQuestions"], len(group["questions"])) == (
        "random-subset",
        1,
        3,
    )
    key = rows(folder / "out" / "key.csv")
    for k, question in enumerate(group["questions"]):
        # braces would be variables, dollars formulas; within nosubvars it looks for neither, after HTML is read either
        assert not set("{}$") & set(question["statement"])
        for text in (question["statement"], *(part["prompt"] for part in question["parts"])):
            assert text.startswith('<div nosubvars="nosubvars" class="mathjax_ignore ')
        for part, row in zip(question["parts"], key[3 * k : 3 * k + 3], strict=True):
            assert part["type"] == "numberentry"
            assert part["marks"] == float(row["points"])
            assert float(part["minValue"]) < float(row["answer"]) < float(part["maxValue"])
            assert float(part["minValue"]) <= float(row["value"]) <= float(part["maxValue"])
            named = [each for each in part["alternatives"] if each["marks"] == 0]
            assert all(each["alternativeFeedbackMessage"] for each in named)
            assert len(named) > 3


def test_an_unknown_system_is_status_2(dalembert: Dalembert, folder: Path) -> None:
    done = dalembert("exercise", "e.toml", "-o", "out", "--for", "canvas")
    assert done.returncode == 2
    assert "prairielearn or numbas" in done.stderr
