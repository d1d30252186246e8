"""The questions as Moodle XML: numerical questions, a category for each question of the exercise.

Moodle takes the first answer whose value is at most its tolerance away; so the right one stands first.
"""

from __future__ import annotations

import html
from collections.abc import Iterator, Mapping, Sequence
from decimal import Decimal

from cli.exercise.answers import unit_text
from cli.exercise.description import Exercise
from cli.exercise.sheets import Student, figures_text, label, problem_html
from cli.exercise.slips import Candidates
from cli.exercise.variants import Variant
from dalembert.figures import rounded

FEEDBACKS = 30
"""So many likely mistakes of a question have their feedback."""


def moodle(
    exercise: Exercise, students: Sequence[Student], variants: Sequence[Variant], drawings: Mapping[int, str],
    slips: Mapping[int, list[Candidates]],
) -> bytes:  # fmt: skip
    """Return the file: for each question a category with one numerical question for each variant."""
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', "<quiz>"]
    for k, ask in enumerate(exercise.asks):
        lines += _category(f"{exercise.title}/{k + 1} {label(ask)}", exercise)
        done: set[int] = set()
        for student, variant in zip(students, variants, strict=True):
            if id(variant) in done:
                continue
            done.add(id(variant))
            name = f"{exercise.title}: {label(ask)}" + (f" ({student.name})" if exercise.draws else "")
            lines += _question(name, variant, slips[id(variant)][k], drawings[id(variant)])
    return "\n".join([*lines, "</quiz>", ""]).encode()


def _category(path: str, exercise: Exercise) -> list[str]:
    # a slash parts categories, two are one
    parts = path.split("/", 1)
    safe = "/".join(part.replace("/", "//") for part in parts)
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
    answer = candidates.answer
    unit = unit_text(answer.unit)
    question = f"{label(answer.ask)}{f' in {unit}' if unit else ''}, {figures_text(answer.ask.figures)}"
    return f"{problem_html(variant, drawing)}<p><b>Find: {html.escape(question)}.</b></p>"


def accepted(candidates: Candidates) -> list[tuple[Decimal, Decimal]]:
    """Return the right answer with its tolerance, half a unit of the last figure; an angle a turn more and less too."""
    right = candidates.right
    half = right.unit / 2
    values = [right.answer]
    if candidates.answer.is_angle:
        turn = Decimal(360) if candidates.turn == 360.0 else rounded(candidates.turn, 15)
        values += [right.answer - turn, right.answer + turn]
    return [(value, half) for value in values]


def expected_mistakes(candidates: Candidates) -> Iterator[tuple[Decimal, Decimal, str]]:
    """Yield value, tolerance and text of the likely mistakes, none of which a right answer meets."""
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
        taken.append((value, half))
        yield value, half, slip.text
        if len(taken) > FEEDBACKS:
            return


def _question(name: str, variant: Variant, own: Candidates, drawing: str) -> list[str]:
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
