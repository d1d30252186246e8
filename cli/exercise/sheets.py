"""The pages and tables of an exercise: a sheet for each student with its figure, solutions, answers and key."""

from __future__ import annotations

import base64
import html
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import radians
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cli.exercise.description import Answer, Ask, Exercise, Value, unit_text
from cli.exercise.solving import DataTable, Workshop, cell_of
from cli.exercise.variants import Variant
from dalembert.errors import DataError, quote
from dalembert.figures import written
from dalembert.hints import nearest
from dalembert.page import Page
from dalembert.results.columns import Column, Table, names
from dalembert.results.report import html_part, report, spelled
from dalembert.results.text import csv_text
from dalembert.units import parted

if TYPE_CHECKING:
    from virtualwork import Mechanism

STYLE = """
:root { color-scheme: light }
body { font: 11pt/1.45 "Helvetica Neue", Arial, "Liberation Sans", sans-serif; color: #111; background: #fff;
  max-width: 184mm; margin: 8mm auto; padding: 0 4mm; overflow-wrap: anywhere }
h1 { font-size: 17pt; line-height: 1.2; margin: 0 0 2mm } h2 { font-size: 13pt; margin: 6mm 0 1mm; break-after: avoid }
h3 { font-size: 11pt; margin: 4mm 0 1mm; break-after: avoid }
.student { display: flex; flex-wrap: wrap; gap: 1mm 8mm; border-bottom: .4mm solid #111; padding-bottom: 1mm; margin-bottom: 4mm }
p { margin: 2mm 0 } table { border-collapse: collapse; margin: 2mm 0; font-size: 10pt; max-width: 100% }
th, td { padding: 1mm 1.6mm; border: .2mm solid #bbb; text-align: left; vertical-align: top; overflow-wrap: normal } th { background: #eee }
.n { text-align: right; font-variant-numeric: tabular-nums } tr { break-inside: avoid } .wide { overflow-x: auto }
.dense { font-size: 9pt } .dense th, .dense td { padding: .7mm 1mm } figure { margin: 4mm 0; break-inside: avoid } figure svg, figure img { display: block; max-width: 100%; height: auto; margin: 0 auto } figure img { width: 132mm }
.blank { width: 40mm; min-width: 20mm } .small { font-size: 9pt; color: #444 } pre { font: 9pt/1.35 monospace; white-space: pre-wrap; margin: 1.5mm 0 }
details.page summary { min-height: 32px; line-height: 32px; cursor: pointer } @media print { details.page { display: none } }
section + section { break-before: page }
@media (max-width: 480px) { table { font-size: 9pt } th, td { padding: .6mm .8mm } .blank { width: auto; min-width: 13mm } }
@page { size: A4; margin: 14mm 13mm } @media print { body { margin: 0; padding: 0; max-width: none } .wide { overflow: visible } }
"""

FORMULA = re.compile(r"\$[^$]+\$|\\\(.*?\\\)|\\\[.*?\\\]", re.DOTALL)
"""A formula of TeX, whose braces are its own."""


@dataclass(frozen=True)
class Student:
    """A student: the column `student` of the roster, and the other columns."""

    name: str
    others: Mapping[str, str]

    @property
    def sheet(self) -> str:
        """The name of the sheet's file."""
        name = re.sub(r"[^\w.@+-]+", "-", self.name, flags=re.UNICODE).strip("-.") or "student"
        return f"sheet-{name}.html"


def mark(file: str) -> str:
    """Return what a page says of the command that wrote it, and under which name."""
    return f'<meta name="generator" content="dalembert exercise: {file}">'


def page(file: str, title: str, body: str, style: str = "") -> bytes:
    """Return a page of HTML that holds all it needs."""
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">{mark(file)}'
        f"<title>{html.escape(title)}</title><style>{STYLE}{style}</style></head>\n<body>\n{body}\n</body></html>\n"
    ).encode()


def spoken(value: Value) -> str:
    """Return a datum as people write it: `55 mm`, `60°`, `−5 N`."""
    number = f"{value.number:f}".replace("-", "−")
    unit = unit_text(value.unit)
    return f"{number}{unit}" if unit == "°" else f"{number} {unit}".strip()


def filled(workshop: Workshop, drawn: Mapping[str, Value], form: Callable[[str], str] = str) -> str:
    """Return the text with the student's numbers in place of the names in braces.

    Raises
    ------
    DataError
        A name that is no datum of the exercise.
    """
    exercise = workshop.exercise
    formulas = [match.span() for match in FORMULA.finditer(exercise.text)]

    def put(match: re.Match[str]) -> str:
        name = match[1].strip()
        value = workshop.datum(name, drawn)
        if value is not None:
            return form(spoken(value))
        if any(start < match.start() < end for start, end in formulas):
            return match[0]
        raise DataError(
            f"{exercise.file}: key text: found {quote('{' + name + '}')}, expected a name of [draw], a dimension of the "
            "mechanism or a table's cell such as {rotor.csv:W1.mass_kg} that holds a number"
            + nearest(name, workshop.dimensions)
        )

    return re.sub(r"\{([^{}\n]+)\}", put, exercise.text)


def paragraphs(workshop: Workshop, drawn: Mapping[str, Value]) -> str:
    """Return the text as paragraphs of HTML."""
    text = filled(workshop, drawn).strip()
    return "".join(
        f"<p>{html.escape(part.strip())}</p>\n" for part in re.split(r"\n\s*\n", text) if part.strip()
    )


def label(ask: Ask) -> str:
    """Return what a question asks for, in words."""
    if ask.label:
        return ask.label
    name = ask.name.replace("_", " ")
    where = ", ".join(_key_text(key, text) for key, text in ask.where.items())
    return f"{name} ({where})" if where else name


def _key_text(key: str, text: str) -> str:
    """Return a key of a row in words.

    >>> _key_text("plane", "B"), _key_text("input_deg", "60"), _key_text("t_s", "0.5")
    ('plane B', 'input 60°', 't 0.5 s')
    """
    name, unit = parted(key)
    shown = unit_text(unit)
    return f"{name} {text}{'' if shown == '°' else ' '}{shown}".strip()


def question_text(answer: Answer, with_unit: bool = True) -> str:
    """Return what a question asks for, in which unit, and to how many figures, in words."""
    figures, unit = answer.ask.figures, unit_text(answer.unit) if with_unit else ""
    count = "1 significant figure" if figures == 1 else f"{figures} significant figures"
    return f"{label(answer.ask)}{f' in {unit}' if unit else ''}, {count}"


def problem_html(variant: Variant, drawing: str) -> str:
    """Return the problem of a student: text, tables, figure."""
    workshop = variant.problem.workshop
    parts = [paragraphs(workshop, variant.drawn)]
    shown = set(re.findall(r"\{([^{}\n]+)\}", workshop.exercise.text))
    parts += [table_html(table) for table in variant.problem.tables.values()]
    left = [
        (name, value) for name, value in variant.drawn.items() if name not in shown and cell_of(name) is None
    ]
    if left:
        items = "; ".join(f"{html.escape(name)} = {html.escape(spoken(value))}" for name, value in left)
        parts.append(f"<p>Given: {items}</p>\n")
    if drawing:
        parts.append(f"<figure>{drawing}</figure>\n")
    return "".join(parts)


def table_html(table: DataTable) -> str:
    """Return a table of data."""

    def cell(text: str) -> str:
        number = re.fullmatch(r"\s*[-−]?[\d.,]+(?:[eE][-+]?\d+)?\s*", text) is not None
        return (
            f'<td class="n">{html.escape(text.replace("-", "−"))}</td>'
            if number
            else f"<td>{html.escape(text)}</td>"
        )

    rows = "".join(f"<tr>{''.join(map(cell, row))}</tr>\n" for row in table.rows)
    header = "".join(f"<th>{html.escape(spelled(title.strip()))}</th>" for title in table.header)
    dense = ' class="dense"' if len(table.header) > 8 else ""
    return f'<div class="wide"><table{dense}><thead><tr>{header}</tr></thead><tbody>{rows}</tbody></table></div>\n'


def sheet_page(
    exercise: Exercise, student: Student, variant: Variant, drawing: str, frame: str = ""
) -> bytes:
    """Return the sheet of a student, perhaps with the page that computes in a frame."""
    others = "".join(
        f"<span>{html.escape(k)}: {html.escape(v)}</span>" for k, v in student.others.items() if v
    )
    rows = "".join(
        f"<tr><td>{html.escape(label(answer.ask))}</td><td>{html.escape(unit_text(answer.unit) or 'number')}</td>"
        f'<td class="n">{answer.ask.figures}</td><td class="n">{float(answer.ask.points):g}</td><td class="blank"></td></tr>\n'
        for answer in variant.answers
    )
    angles = ""
    if any(answer.is_angle for answer in variant.answers):
        # in measured vibration they count as the instrument's phases do
        sense = "" if exercise.command[0] in ("field", "index") else " Angles count counter-clockwise from x."
        angles = f"{sense} A whole turn more or less is the same angle."
    body = (
        f"<h1>{html.escape(exercise.title)}</h1>\n"
        f'<div class="student"><span>student: <b>{html.escape(student.name)}</b></span>{others}</div>\n'
        f"{problem_html(variant, drawing)}{frame}<h2>Find</h2>\n"
        '<div class="wide"><table><thead><tr><th>quantity</th><th>unit</th><th>figures</th><th>points</th><th>answer</th></tr></thead>'
        f"<tbody>{rows}</tbody></table></div>\n"
        f'<p class="small">“Figures” says how many significant figures the answer has. The numbers of this sheet count as exact.{angles}</p>'
        + (f'<p class="small">After {html.escape(exercise.source)}</p>' if exercise.source else "")
    )
    return page(student.sheet, f"{exercise.title}: {student.name}", body)


def key_table(exercise: Exercise, students: Sequence[Student], variants: Sequence[Variant]) -> Table:
    """The key: a row for each question and student, the answer rounded and whole, the student's numbers; `key.csv` has all of it."""
    rows = [
        (student, variant, answer)
        for student, variant in zip(students, variants, strict=True)
        for answer in variant.answers
    ]
    answers, keys = [answer for _, _, answer in rows], exercise.keys
    points = [float(answer.ask.points) for answer in answers]
    columns = [
        names("student", [student.name for student, _, _ in rows]),
        *(
            Column(other, "", [student.others[other] for student, _, _ in rows])
            for other in students[0].others
        ),
        *(names(header, [answer.ask.where.get(key) for answer in answers]) for key, header in keys.items()),
        names("quantity", [answer.ask.quantity for answer in answers]),
        names("unit", [answer.unit for answer in answers]),
        names("answer", [written(answer.value, answer.ask.figures) for answer in answers]),
        names("value", [answer.value for answer in answers]),
        names("figures", [answer.ask.figures for answer in answers]),
        Column(
            "points", "", [int(x) if x.is_integer() else x for x in points], place="points", stored=points
        ),
        *(
            Column(draw.name, "", [str(variant.drawn[draw.name]) for _, variant, _ in rows])
            for draw in exercise.draws
        ),
    ]
    return Table(columns, ["student", *keys.values(), "quantity"], "key[]")


def answers_csv(key: Table) -> bytes:
    """Return the table of answers to be filled in: the key as far as the answers, which are blank."""
    columns = list(key.cells.items())
    asked = dict(columns[: [header for header, _ in columns].index("answer")])
    return csv_text({**asked, "answer": [""] * key.length}).encode()


SOLUTION_STYLE = """
dl { display: grid; grid-template-columns: fit-content(40%) 1fr; gap: 0 4mm } td.n { white-space: nowrap }
.good { color: #06632f; font-weight: 600 } .bad { color: #b00020; font-weight: 700 }
"""


def solutions(
    exercise: Exercise,
    students: Sequence[Student],
    variants: Sequence[Variant],
    drawings: Mapping[Variant, str],
) -> bytes:
    """Return the page; students with the same numbers share a solution."""
    parts = [f"<h1>{html.escape(exercise.title)}: solutions</h1>\n"]
    shared: dict[Variant, list[str]] = {}
    for student, variant in zip(students, variants, strict=True):
        shared.setdefault(variant, []).append(student.name)
    for variant, who in shared.items():
        parts += ["<section>\n", *_solution(variant, who, drawings[variant]), "</section>\n"]
    return page("solutions.html", f"{exercise.title}: solutions", "".join(parts), SOLUTION_STYLE)


def _solution(variant: Variant, who: Sequence[str], drawing: str) -> Iterator[str]:
    several = f"students {', '.join(who)}" if len(who) > 1 else f"student {who[0]}"
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
        for each in report(shown).pages:
            for name, parts in each.sections:
                yield f"<h3>{html.escape(name)}</h3>\n"
                yield from map(html_part, parts)
    if result.method:
        yield f'<p class="small">{html.escape(result.method)}</p>\n'


# --- the figure of a sheet, with nothing of the answers -----------------------------------------------------------------
MOST, LETTERS = (500.0, 440.0), 15.0
"""Width and height of a mechanism's figure, and the size of its letters, pixels."""


def figure(variant: Variant) -> str:
    """Return the figure of a sheet as HTML; empty where there is none."""
    exercise = variant.problem.exercise
    if exercise.figure is not None:
        return _given(exercise.folder / exercise.figure)
    if variant.problem.workshop.mechanism is not None:
        return _mechanism(variant)
    if exercise.command[0] == "balance":
        return _rotor(variant)
    return ""


def moving(variant: Variant) -> str:
    """Return the page that computes with this student's numbers, in a frame that opens on the sheet and is not printed."""
    place = Path("page.html")
    solved = variant.problem.result("--page", str(place))
    with solved.result.within():
        html_of = solved.result.beside[place]()
    frame = Page(bytes(html_of).decode(), height=720).frame("allow-scripts allow-downloads allow-modals")
    return f'<details class="page"><summary>The page that computes</summary>{frame}</details>\n'


def _given(path: Any) -> str:
    """The picture that the exercise names, within the page."""
    data = path.read_bytes()
    if path.suffix.lower() == ".svg":
        text = data.decode("utf-8-sig", "replace")
        if "<svg" not in text:
            raise DataError(f"{path}: this is no SVG: expected an element svg")
        kind = "image/svg+xml"
    else:
        kind = "image/png"
    return f'<img alt="figure" src="data:{kind};base64,{base64.b64encode(data).decode()}">'


def _mechanism(variant: Variant) -> str:
    """Draw the mechanism of a variant in the pose asked for, to scale, as a notebook shows it."""
    import numpy as np

    from virtualwork.notebook_picture import svg

    m = _varied(variant)
    motion = m.motion(np.array([_pose(variant, m)]))
    return svg(motion.poses, motion.drawing, most=MOST, letters=LETTERS) or ""


def _varied(variant: Variant) -> Mechanism:
    """The mechanism with the variant's dimensions."""
    from cli.cases.axes import assigned

    described = variant.problem.workshop.described
    texts = variant.problem.parameters["set"]
    m: Mechanism = assigned(described.mechanism, described.bare, texts) if texts else described.mechanism
    return m


def _pose(variant: Variant, m: Mechanism) -> Any:
    """The inputs of the first pose or instant that is solved, SI; the guess's where there is none."""
    document = variant.solved.document
    listed: Any = document.get("poses") or document.get("time") or [{}]
    first = listed[0] if isinstance(listed, list) else {}
    each = first.get("inputs") or {"": first}
    places = [
        radians(entry[key]) if key.endswith("_deg") else entry[key]
        for entry in each.values()
        for key in ("input_deg", "angle_deg", "input_m", "position_m")
        if key in entry
    ]
    if len(places) != len(m.inputs):
        places = list(m.at)
    return places[0] if len(places) == 1 else places


def _rotor(variant: Variant) -> str:
    """Draw a rotor's masses seen along its axis, and from the side where they have axial positions."""
    import numpy as np

    from balancing.rotor_svg import svg

    read, chosen = variant.problem.known_masses()
    table = read.table
    if len(read.names) > 1:
        return ""
    names = table.texts.get("name") or [str(k) for k in range(1, table.rows + 1)]
    radius = table.numbers["radius"].si if "radius" in table.numbers else np.ones(table.rows)
    angle = np.angle(np.where(read.moment == 0, 1, read.moment))
    if not chosen.several:
        return svg(names, radius, angle)
    at = np.zeros(len(chosen.name)) if chosen.z is None else chosen.z
    return svg(names, radius, angle, read.z, chosen.name, at)
