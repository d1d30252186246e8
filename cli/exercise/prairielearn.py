"""The exercise as a question of PrairieLearn: its folder with info.json, question.html, server.py and the variants."""

from __future__ import annotations

import html
import json
import re
from collections.abc import Mapping, Sequence
from math import lcm
from uuid import NAMESPACE_URL, uuid5

from cli.exercise.answers import unit_text
from cli.exercise.description import Exercise
from cli.exercise.moodle import expected_mistakes
from cli.exercise.sheets import figures_text, label, problem_html
from cli.exercise.slips import Candidates
from cli.exercise.variants import Variant

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
    drawings: Mapping[int, str],
    slips: Mapping[int, list[Candidates]],
) -> dict[str, bytes]:
    """Return the files of the question by their paths: prairielearn/NAME/…"""
    name = re.sub(r"\W+", "-", exercise.title.lower()).strip("-") or "exercise"
    folder = f"prairielearn/{name}"
    every = [
        _variant(variant, slips[id(variant)], drawings[id(variant)]) for variant in dict.fromkeys(variants)
    ]
    identity = json.dumps([exercise.title, exercise.command, exercise.text], ensure_ascii=False)
    info = {
        "uuid": str(uuid5(NAMESPACE_URL, identity)),
        "title": exercise.title,
        "topic": "Mechanics of machines",
        "tags": ["dalembert"],
        "type": "v3",
        "singleVariant": not exercise.draws,
    }
    files = {
        "info.json": _json(info),
        "variants.json": _json(every),
        "server.py": SERVER,
        "question.html": _question(exercise),
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
            "turn": own.turn if own.answer.is_angle else None,
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


def _question(exercise: Exercise) -> str:
    parts = ["<pl-question-panel>\n  {{{params.problem}}}\n</pl-question-panel>\n"]
    for k, (ask, weight) in enumerate(zip(exercise.asks, weights(exercise), strict=True), 1):
        caption = html.escape(f"{label(ask)}, {figures_text(ask.figures)}")
        unit = html.escape(unit_text(ask.unit or _unit(exercise, k - 1)))
        suffix = f' suffix="{unit}"' if unit else ""
        parts.append(
            f"<p>{caption}:</p>\n"
            f'<pl-number-input answers-name="answer{k}" comparison="relabs" rtol="0" '
            f'atol="{{{{params.answer{k}.tolerance}}}}" weight="{weight}"{suffix} show-help-text="false"></pl-number-input>\n'
        )
    return "\n".join(parts)


def _unit(exercise: Exercise, k: int) -> str:
    from dalembert.units import parted

    return parted(exercise.asks[k].quantity, further=("kg_m2_s", "J", "W", "rad_s3", "m_s3"))[1]
