"""The exercise as an exam of Numbas: one question, taken at random from its variants."""

from __future__ import annotations

import html
import json
from collections.abc import Mapping, Sequence
from decimal import Decimal

from cli.exercise.answers import unit_text
from cli.exercise.description import Exercise
from cli.exercise.moodle import accepted, expected_mistakes, plain
from cli.exercise.sheets import figures_text, label, problem_html
from cli.exercise.slips import Candidates
from cli.exercise.variants import Variant

VERSION = "// Numbas version: finer_feedback_settings"
STYLES = ["plain", "en", "si-en", "plain-eu", "eu", "si-fr"]
"""How a number may be written: decimal points and commas."""


def numbas(
    exercise: Exercise,
    variants: Sequence[Variant],
    drawings: Mapping[int, str],
    slips: Mapping[int, list[Candidates]],
) -> dict[str, bytes]:
    """Return the file."""
    every = list(dict.fromkeys(variants))
    questions = [
        _question(f"{exercise.title} ({k})", variant, slips[id(variant)], drawings[id(variant)])
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
    return {"numbas.exam": f"{VERSION}\n{json.dumps(exam, ensure_ascii=False, indent=1)}\n".encode()}


def content(text: str) -> str:
    """Return HTML in which Numbas finds no variable and no formula.

    >>> content("a {b} $c$")
    'a &#123;b&#125; &#36;c&#36;'
    """
    return text.replace("{", "&#123;").replace("}", "&#125;").replace("$", "&#36;")


def _number(least: Decimal, most: Decimal, marks: float) -> dict[str, object]:
    return {
        "type": "numberentry", "useCustomName": False, "customName": "", "marks": marks, "scripts": {},
        "customMarkingAlgorithm": "", "extendBaseMarkingAlgorithm": True, "unitTests": [], "showCorrectAnswer": True,
        "showFeedbackIcon": True, "variableReplacements": [], "variableReplacementStrategy": "originalfirst",
        "minValue": plain(least), "maxValue": plain(most), "correctAnswerFraction": False, "allowFractions": False,
        "mustBeReduced": False, "mustBeReducedPC": 0, "precisionType": "none", "precision": "0", "precisionPartialCredit": 0,
        "notationStyles": STYLES, "correctAnswerStyle": "plain",
    }  # fmt: skip


def _part(own: Candidates) -> dict[str, object]:
    answer = own.answer
    marks = float(answer.ask.points)
    (value, half), *others = accepted(own)
    unit = unit_text(answer.unit)
    question = f"{label(answer.ask)}{f' in {unit}' if unit else ''}, {figures_text(answer.ask.figures)}"
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
            "alternativeFeedbackMessage": content(f"<p>Likely mistake: {html.escape(text)}.</p>"),
            "useAlternativeFeedback": True,
        }
        for at, room, text in expected_mistakes(own)
    ]
    return {
        **_number(value - half, value + half, marks),
        "prompt": content(f"<p>{html.escape(question)}</p>"),
        "alternatives": alternatives,
    }


def _question(name: str, variant: Variant, slips: Sequence[Candidates], drawing: str) -> dict[str, object]:
    return {
        "name": name, "tags": [], "metadata": {"description": "", "licence": "None specified"},
        "statement": content(problem_html(variant, drawing)), "advice": "", "rulesets": {}, "extensions": [],
        "builtin_constants": {"e": True, "pi,π": True, "i": True, "j": False}, "constants": [], "variables": {},
        "variablesTest": {"condition": "", "maxRuns": 100}, "ungrouped_variables": [], "variable_groups": [], "functions": {},
        "preamble": {"js": "", "css": ""}, "parts": [_part(own) for own in slips], "partsMode": "all", "maxMarks": 0,
        "objectives": [], "penalties": [], "objectiveVisibility": "always", "penaltyVisibility": "always",
    }  # fmt: skip
