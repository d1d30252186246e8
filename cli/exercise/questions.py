"""The questions of an exercise as Moodle, PrairieLearn and Numbas read them, with likely mistakes as feedback."""

from __future__ import annotations

import html
import json
import re
from collections.abc import Iterator, Mapping, Sequence
from decimal import Decimal
from math import lcm
from uuid import NAMESPACE_URL, uuid5

from cli.exercise.description import Exercise, unit_text
from cli.exercise.sheets import Student, label, problem_html, question_text
from cli.exercise.slips import Candidates
from cli.exercise.variants import Variant
from dalembert.figures import rounded

FEEDBACKS = 30
"""The largest number of likely mistakes of a question with a feedback."""
PRAIRIELEARN, NUMBAS = "prairielearn", "numbas.exam"
"""The folder and the file of further systems."""
TAG = "dalembert"
"""The tag of their questions."""


def moodle(
    exercise: Exercise, students: Sequence[Student], variants: Sequence[Variant], drawings: Mapping[Variant, str],
    slips: Mapping[Variant, list[Candidates]],
) -> bytes:  # fmt: skip
    """Return the file: for each question a category with one numerical question for each variant."""
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', "<quiz>"]
    # a variant is named after the first student who has it
    first: dict[Variant, Student] = {}
    for student, variant in zip(students, variants, strict=True):
        first.setdefault(variant, student)
    for k, ask in enumerate(exercise.asks):
        lines += _category(f"{k + 1} {label(ask)}", exercise)
        for variant, student in first.items():
            name = f"{exercise.title}: {label(ask)}" + (f" ({student.name})" if exercise.draws else "")
            lines += _moodle_question(name, variant, slips[variant][k], drawings[variant])
    return "\n".join([*lines, "</quiz>", ""]).encode()


def _category(name: str, exercise: Exercise) -> list[str]:
    # a slash parts categories, two are one
    safe = "/".join(part.replace("/", "//") for part in (exercise.title, name))
    return [
        '<question type="category">',
        f"  <category><text>{_text(f'$course$/top/{safe}')}</text></category>",
        f'  <info format="html"><text>{_cdata(html.escape(exercise.source))}</text></info>',
        "</question>",
    ]


def _text(text: str) -> str:
    return html.escape(text, quote=False)


def _cdata(text: str) -> str:
    return "<![CDATA[" + text.replace("]]>", "]]]]><![CDATA[>") + "]]>"


def plain(number: Decimal) -> str:
    """Write a number without an exponent that stands for zeros only.

    >>> plain(Decimal("1.03E+5")), plain(Decimal("0.0500"))
    ('103000', '0.0500')
    """
    return f"{number:f}" if -20 < number.adjusted() < 20 else f"{number:e}"


def _answer(fraction: int, value: Decimal, tolerance: Decimal, feedback: str) -> list[str]:
    return [
        f'  <answer fraction="{fraction}" format="moodle_auto_format">',
        f"    <text>{plain(value)}</text>",
        f'    <feedback format="html"><text>{_cdata(html.escape(feedback))}</text></feedback>',
        f"    <tolerance>{plain(tolerance)}</tolerance>",
        "  </answer>",
    ]


def question_html(variant: Variant, candidates: Candidates, drawing: str) -> str:
    """Return the text of a question: the problem, and what is asked."""
    question = question_text(candidates.answer)
    return f"{problem_html(variant, drawing)}<p><b>Find: {html.escape(question)}.</b></p>"


def accepted(candidates: Candidates) -> list[tuple[Decimal, Decimal]]:
    """Return the right answer with its tolerance, half a unit of the last figure; an angle a turn more and less too."""
    right = candidates.right
    half = right.unit / 2
    values = [right.answer]
    if candidates.answer.is_angle:
        turn = Decimal(360) if candidates.answer.turn == 360.0 else rounded(candidates.answer.turn, 15)
        values += [right.answer - turn, right.answer + turn]
    return [(value, half) for value in values]


def expected_mistakes(candidates: Candidates) -> Iterator[tuple[Decimal, Decimal, str]]:
    """Yield value, tolerance and text of the likely mistakes, none of which a right answer or another mistake meets."""
    right = candidates.right
    taken = [(right.answer, right.unit / 2)]
    for slip in candidates.wrong:
        value = rounded(slip.value, max(candidates.answer.ask.figures, 3))
        if not value:
            continue
        figures = max(candidates.answer.ask.figures, 3)
        half = Decimal((0, (5,), value.adjusted() - figures))
        if any(abs(value - other) <= half + own for other, own in taken):
            continue
        if len(candidates.met(float(value), float(half))) > 1:
            continue
        taken.append((value, half))
        yield value, half, slip.text
        if len(taken) > FEEDBACKS:
            return


def _moodle_question(name: str, variant: Variant, own: Candidates, drawing: str) -> list[str]:
    answer = own.answer
    lines = [
        '<question type="numerical">',
        f"  <name><text>{_text(name)}</text></name>",
        f'  <questiontext format="html"><text>{_cdata(question_html(variant, own, drawing))}</text></questiontext>',
        '  <generalfeedback format="html"><text></text></generalfeedback>',
        f"  <defaultgrade>{float(answer.ask.points):g}</defaultgrade>",
        "  <penalty>0.3333333</penalty>",
        "  <hidden>0</hidden>",
    ]
    for value, tolerance in accepted(own):
        lines += _answer(100, value, tolerance, "Right.")
    for value, tolerance, text in expected_mistakes(own):
        lines += _answer(0, value, tolerance, f"Likely mistake: {text}.")
    return [
        *lines,
        "  <unitgradingtype>0</unitgradingtype>",
        "  <unitpenalty>0.1</unitpenalty>",
        "  <showunits>3</showunits>",
        "  <unitsleft>0</unitsleft>",
        "</question>",
    ]


SERVER = '''"""Written by dalembert exercise: takes a variant, and names likely mistakes."""

import json
import math
import random
from pathlib import Path


def generate(data):
    """Take the numbers of one variant."""
    path = Path(data["options"]["question_path"]) / "variants.json"
    variants = json.loads(path.read_text(encoding="utf-8"))
    variant = random.Random(data["variant_seed"]).choice(variants)
    data["params"]["problem"] = variant["problem"]
    for name, question in variant["questions"].items():
        data["params"][name] = question
        data["correct_answers"][name] = question["right"]


def grade(data):
    """Accept an angle that is a whole turn off; give the feedback of a likely mistake."""
    for name, question in data["params"].items():
        partial = data["partial_scores"].get(name)
        given = data["submitted_answers"].get(name)
        if not isinstance(question, dict) or not partial or partial.get("score") or given is None:
            continue
        value = float(given["_value"] if isinstance(given, dict) else given)
        turn = question["turn"]
        off = value - question["right"]
        if turn and abs(math.remainder(off, turn)) <= question["tolerance"]:
            partial["score"] = 1
            continue
        for mistake in question["mistakes"]:
            if abs(value - mistake["value"]) <= mistake["tolerance"]:
                partial["feedback"] = "Likely mistake: " + mistake["text"] + "."
                break
    weights = sum(each.get("weight", 1) for each in data["partial_scores"].values())
    if weights:
        scores = sum(each.get("weight", 1) * (each.get("score") or 0) for each in data["partial_scores"].values())
        data["score"] = scores / weights
'''


def prairielearn(
    exercise: Exercise,
    variants: Sequence[Variant],
    drawings: Mapping[Variant, str],
    slips: Mapping[Variant, list[Candidates]],
) -> dict[str, bytes]:
    """Return the files of the question by their paths: prairielearn/NAME/…"""
    name = re.sub(r"\W+", "-", exercise.title.lower()).strip("-") or "exercise"
    folder = f"{PRAIRIELEARN}/{name}"
    every = [_variant(variant, slips[variant], drawings[variant]) for variant in dict.fromkeys(variants)]
    identity = json.dumps([exercise.title, exercise.command, exercise.text], ensure_ascii=False)
    info = {
        "uuid": str(uuid5(NAMESPACE_URL, identity)),
        "title": exercise.title,
        "topic": "Mechanics of machines",
        "tags": [TAG],
        "type": "v3",
        "singleVariant": not exercise.draws,
    }
    files = {
        "info.json": _json(info),
        "variants.json": _json(every),
        "server.py": SERVER,
        "question.html": _prairielearn_question(exercise, variants[0]),
    }
    return {f"{folder}/{file}": text.encode() for file, text in files.items()}


def _json(document: object) -> str:
    return json.dumps(document, ensure_ascii=False, indent=1) + "\n"


def _variant(variant: Variant, slips: Sequence[Candidates], drawing: str) -> dict[str, object]:
    questions = {}
    for k, own in enumerate(slips, 1):
        right = own.right
        questions[f"answer{k}"] = {
            "right": float(right.answer),
            "tolerance": float(right.unit / 2),
            "turn": own.answer.turn if own.answer.is_angle else None,
            "mistakes": [
                {"value": float(value), "tolerance": float(tolerance), "text": text}
                for value, tolerance, text in expected_mistakes(own)
            ],
        }
    return {"problem": problem_html(variant, drawing), "questions": questions}


def weights(exercise: Exercise) -> list[int]:
    """The points as whole numbers in the same proportion, as the element takes them.

    >>> from fractions import Fraction
    >>> from types import SimpleNamespace as Some
    >>> weights(Some(asks=[Some(points=Fraction(1, 2)), Some(points=Fraction(2))]))
    [1, 4]
    """
    whole = lcm(*(ask.points.denominator for ask in exercise.asks))
    return [int(ask.points * whole) for ask in exercise.asks]


def _prairielearn_question(exercise: Exercise, variant: Variant) -> str:
    parts = ["<pl-question-panel>\n  {{{params.problem}}}\n</pl-question-panel>\n"]
    for k, (answer, weight) in enumerate(zip(variant.answers, weights(exercise), strict=True), 1):
        caption = escaped(html.escape(question_text(answer, with_unit=False)))
        unit = html.escape(unit_text(answer.unit))
        suffix = f' suffix="{unit}"' if unit else ""
        parts.append(
            f"<p>{caption}:</p>\n"
            f'<pl-number-input answers-name="answer{k}" comparison="relabs" rtol="0" '
            f'atol="{{{{params.answer{k}.tolerance}}}}" weight="{weight}"{suffix} show-help-text="false"></pl-number-input>\n'
        )
    return "\n".join(parts)


def escaped(text: str) -> str:
    """Return HTML without braces and dollars, which templates take for variables and formulas.

    >>> escaped("a {b} $c$")
    'a &#123;b&#125; &#36;c&#36;'
    """
    return text.replace("{", "&#123;").replace("}", "&#125;").replace("$", "&#36;")


VERSION = "// Numbas version: finer_feedback_settings"
STYLES = ["plain", "en", "si-en", "plain-eu", "eu", "si-fr"]
"""How a number may be written: decimal points and commas."""


def numbas(
    exercise: Exercise,
    variants: Sequence[Variant],
    drawings: Mapping[Variant, str],
    slips: Mapping[Variant, list[Candidates]],
) -> dict[str, bytes]:
    """Return the file."""
    every = list(dict.fromkeys(variants))
    questions = [
        _numbas_question(f"{exercise.title} ({k})", variant, slips[variant], drawings[variant])
        for k, variant in enumerate(every, 1)
    ]
    group = {
        "name": "Variants", "pickingStrategy": "random-subset", "pickQuestions": 1, "questionNames": [""] * len(questions),
        "variable_overrides": [[] for _ in questions], "questions": questions,
    }  # fmt: skip
    exam = {
        "name": exercise.title,
        "metadata": {"description": html.escape(exercise.source), "licence": "None specified"},
        "duration": 0,
        "percentPass": 50,
        "showQuestionGroupNames": False,
        "shuffleQuestionGroups": False,
        "showstudentname": True,
        "question_groups": [group],
        "contributors": [],
        "extensions": [],
        "custom_part_types": [],
        "resources": [],
    }
    return {NUMBAS: f"{VERSION}\n{json.dumps(exam, ensure_ascii=False, indent=1)}\n".encode()}


def _content(text: str) -> str:
    """Return HTML in which Numbas looks for no variable and no formula: braces and dollars are not its own."""
    return f'<div nosubvars="nosubvars" class="mathjax_ignore tex2jax_ignore">{escaped(text)}</div>'


def _number(least: Decimal, most: Decimal, marks: float) -> dict[str, object]:
    return {
        "type": "numberentry", "useCustomName": False, "customName": "", "marks": marks, "scripts": {},
        "customMarkingAlgorithm": "", "extendBaseMarkingAlgorithm": True, "unitTests": [], "showCorrectAnswer": True,
        "showFeedbackIcon": True, "variableReplacements": [], "variableReplacementStrategy": "originalfirst",
        "minValue": _limit(least, most - least), "maxValue": _limit(most, most - least), "correctAnswerFraction": False, "allowFractions": False,
        "mustBeReduced": False, "mustBeReducedPC": 0, "precisionType": "none", "precision": "0", "precisionPartialCredit": 0,
        "notationStyles": STYLES, "correctAnswerStyle": "plain",
    }  # fmt: skip


def _limit(number: Decimal, room: Decimal) -> str:
    """Write a limit; Numbas gives those of floats room of 1e-12, those of decimals none.

    >>> _limit(Decimal("1.225"), Decimal("0.01")), _limit(Decimal("-1.225e-9"), Decimal("1e-11"))
    ('1.225', 'dec("-1.225E-9")')
    """
    return plain(number) if room > Decimal("1e-9") else f'dec("{number}")'


def _part(own: Candidates) -> dict[str, object]:
    answer = own.answer
    marks = float(answer.ask.points)
    (value, half), *others = accepted(own)
    alternatives = [
        {
            **_number(at - room, at + room, marks),
            "alternativeFeedbackMessage": "",
            "useAlternativeFeedback": False,
        }
        for at, room in others
    ]
    alternatives += [
        {
            **_number(at - room, at + room, 0.0),
            "alternativeFeedbackMessage": _content(f"<p>Likely mistake: {html.escape(text)}.</p>"),
            "useAlternativeFeedback": True,
        }
        for at, room, text in expected_mistakes(own)
    ]
    return {
        **_number(value - half, value + half, marks),
        "prompt": _content(f"<p>{html.escape(question_text(answer))}</p>"),
        "alternatives": alternatives,
    }


def _numbas_question(
    name: str, variant: Variant, slips: Sequence[Candidates], drawing: str
) -> dict[str, object]:
    return {
        "name": name, "tags": [TAG], "metadata": {"description": "", "licence": "None specified"},
        "statement": _content(problem_html(variant, drawing)), "advice": "", "rulesets": {}, "extensions": [],
        "builtin_constants": {"e": True, "pi,π": True, "i": True, "j": False}, "constants": [], "variables": {},
        "variablesTest": {"condition": "", "maxRuns": 100}, "ungrouped_variables": [], "variable_groups": [], "functions": {},
        "preamble": {"js": "", "css": ""}, "parts": [_part(own) for own in slips], "partsMode": "all", "maxMarks": 0,
        "objectives": [], "penalties": [], "objectiveVisibility": "always", "penaltyVisibility": "always",
    }  # fmt: skip


SYSTEMS = {"prairielearn": prairielearn, "numbas": numbas}
"""What --for can name."""
