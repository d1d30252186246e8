"""The worked solutions of all variants, as one page: the problem, the answers, the way of the command."""

from __future__ import annotations

import html
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from cli.exercise.answers import unit_text
from cli.exercise.description import Exercise
from cli.exercise.sheets import Student, label, page, problem_html
from cli.exercise.variants import Variant
from cli.show.commands import ShowOptions
from cli.show.report import html_part, report
from dalembert.figures import written

STYLE = """
dl { display: grid; grid-template-columns: fit-content(40%) 1fr; gap: 0 4mm } td.n { white-space: nowrap }
.good { color: #06632f; font-weight: 600 } .bad { color: #b00020; font-weight: 700 }
"""


def solutions(
    exercise: Exercise, students: Sequence[Student], variants: Sequence[Variant], drawings: Mapping[int, str]
) -> bytes:
    """Return the page; students with the same numbers share a solution."""
    parts = [f"<h1>{html.escape(exercise.title)}: solutions</h1>\n"]
    shared: dict[int, list[str]] = {}
    for student, variant in zip(students, variants, strict=True):
        shared.setdefault(id(variant), []).append(student.name)
    by_id = {id(variant): variant for variant in variants}
    for key, names in shared.items():
        parts += ["<section>\n", *_solution(by_id[key], names, drawings[key]), "</section>\n"]
    return page(f"{exercise.title}: solutions", "".join(parts), STYLE)


def _solution(variant: Variant, names: Sequence[str], drawing: str) -> Iterator[str]:
    several = f"students {', '.join(names)}" if len(names) > 1 else f"student {names[0]}"
    yield f"<h2>{html.escape(several[0].upper() + several[1:])}</h2>\n"
    yield problem_html(variant, drawing)
    rows = "".join(
        f"<tr><td>{html.escape(label(answer.ask))}</td>"
        f'<td class="n">{written(answer.value, answer.ask.figures).replace("-", "−")}</td>'
        f"<td>{html.escape(unit_text(answer.unit))}</td>"
        f'<td class="n">{f"{answer.value:.8g}".replace("-", "−")}</td></tr>\n'
        for answer in variant.answers
    )
    yield (
        '<h3>Answers</h3><div class="wide"><table><thead><tr><th>quantity</th><th>answer</th><th>unit</th>'
        f"<th>unrounded</th></tr></thead><tbody>{rows}</tbody></table></div>\n"
    )
    result = variant.worked.result
    with result.within():
        # the way, where there is one, has what the tables have
        shown = (
            replace(result, shows_input=True, sheets=list)
            if result.shows_way
            else replace(result, shows_input=True)
        )
        for each in report(shown, ShowOptions(), {}, None).pages:
            for name, parts in each.sections:
                yield f"<h3>{html.escape(name)}</h3>\n"
                yield from map(html_part, parts)
    if result.method:
        yield f'<p class="small">{html.escape(result.method)}</p>\n'
