"""A report of a result: what it holds, as a page of HTML that prints on A4 and Letter, or as Markdown with files of its pictures."""

from __future__ import annotations

import html
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from dalembert.drawing.sheet import drawn
from dalembert.errors import DataError
from dalembert.quantities import is_number, parse_quantity
from dalembert.results.bars import BARS_STYLE, Bars
from dalembert.results.chosen_units import finished
from dalembert.results.columns import Column, Table
from dalembert.results.files import markdown
from dalembert.results.result import Section, Sheet, way_sheets, with_sentences
from dalembert.results.text import BAD, GOOD, Grid, has_names, heading, in_blocks, printed, without_noise
from dalembert.tables.files import load, name_of, named
from dalembert.tables.sources import open_source
from dalembert.units import LISTED, parted, written

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from dalembert.results.columns import Cell
    from dalembert.results.expect import Comparison
    from dalembert.results.result import Result


ROWS = 36  # rows of a result that are shown
READ = 24  # rows of an input that are shown
LINES = 100  # lines of a file that are shown
WIDE = 88  # characters beside each other that fit A4 and Letter
VERDICT = "Verdict"  # of a report that begins with it
TINY = 1e-9  # a number smaller than this may be the rounding of zero
_THINNED = ("step", "t_s")  # of tables that begin so every k-th row is shown: they are sweeps


Part = str | Grid | Bars


@dataclass(frozen=True)
class Page:
    """A sheet whose tables are text."""

    title: str
    sections: list[tuple[str, list[Part]]]
    figure: Callable[[], Figure] | None
    dense: bool


@dataclass(frozen=True)
class Report:
    """All that a report says."""

    title: str
    about: list[tuple[str, str]]
    pages: list[Page]
    closing: list[str]
    """Method, sources and version; warnings stand on the first page."""
    warnings: list[str]


def report(
    result: Result,
    about: Mapping[str, str] = MappingProxyType({}),
    *,
    units: Mapping[str, str] | None = None,
    digits: bool = False,
    options: Mapping[str, str] = MappingProxyType({}),
    words: Sequence[str] = (),
    checked: Comparison | None = None,
) -> Report:
    """Put a report together.

    Parameters
    ----------
    about
        The head: its title, and the lines below it.
    units, digits
        The units of columns that were chosen, and whether only digits that hold are shown.
    options
        The command's own options in the call, and their values.
    words
        The call itself, behind the name of the program.
    checked
        How the result compares with what was expected.
    """
    from importlib.metadata import version

    def finish(table: Table) -> Table:
        return finished(table, units, digits)[0]

    sheets = list(result.sheets() if result.sheets is not None else [_plain_sheet(result)])
    if result.shows_way:
        sheets += way_sheets(result)
    inputs = list(_inputs(options, () if result.shows_input else named()))
    if sheets:
        sections = list(sheets[0].sections)
        if inputs and sections[0].title != VERDICT:
            sections.insert(0, Section("Given", inputs))
        if checked is not None:
            sections.append(Section("Compared with what was expected", [checked.table, checked.summary]))
        sheets[0] = replace(sheets[0], sections=sections)
        if inputs and sections[0].title == VERDICT:
            # what is wanted comes first
            last = sheets[-1]
            sheets[-1] = replace(last, sections=[*last.sections, Section("Given", inputs)])
    pages = [
        Page(
            sheet.title,
            [(s.title, list(_printed(s.parts, finish)) or ["none"]) for s in sheet.sections],
            sheet.figure,
            sheet.dense,
        )
        for sheet in sheets
    ]
    call = " ".join(["dalembert", *map(_quoted, words)])
    closing = [*([result.method] if result.method else []), f"dalembert {version('dalembert')}: {call}"]
    shown = [(key, value) for key, value in about.items() if key != "title"]
    return Report(about.get("title", "Report"), shown, pages, closing, result.warnings)


def _quoted(word: str) -> str:
    from shlex import quote

    return word if re.fullmatch(r"[\w@%+=:,./°µ-]+", word) else quote(word)


def _plain_sheet(result: Result) -> Sheet:
    """The notes, every table, the afterword."""
    (name, first), *others = result.tables.items()
    sections = [
        Section(
            heading(name),
            [
                result.notes(),
                *with_sentences([first()] if result.screen is None else result.screen()),
                result.afterword(),
            ],
        ),
        *(
            Section(heading(name), with_sentences([table]))
            for name, of in others
            # a table without columns is of the JSON document alone
            if (table := of()).columns
        ),
    ]
    return Sheet("", sections, result.figure)


def _inputs(options: Mapping[str, str], files: Sequence[str]) -> Iterator[str | Table]:
    """Yield the options of the call, and what the files hold."""
    if options:
        yield "; ".join(
            name if value == "yes" else f"{name} {_spaced(value)}" for name, value in options.items()
        )
    for path in files:
        shown = name_of(path)
        if path.lower().endswith(".toml") or (path == "-" and _is_toml()):
            yield f"{shown}:"
            yield text_of_file(load(path))
            continue
        source = open_source(path, {}, None)
        rows = source.rows()
        read = [cells for _, cells in islice(rows, READ)]
        left = sum(1 for _ in rows)
        yield f"{shown}{source.of_sheet}:"
        width = len(source.header)
        cells = [[*row[:width], *[""] * (width - len(row))] for row in read]
        yield Table([Column(spelled(h), "", [row[k] for row in cells]) for k, h in enumerate(source.header)])
        if left:
            yield f"… and {left} further rows"


CODE = "\0"
"""What a paragraph begins with that is the text of a file."""


def text_of_file(data: bytes) -> str:
    """Return the paragraph that shows a file, of a long one the first lines."""
    lines = data.decode("utf-8-sig").splitlines()
    more = f"\n… and {len(lines) - LINES} further lines" if len(lines) > LINES else ""
    return CODE + "\n".join(lines[:LINES]) + more


def _is_toml() -> bool:
    import tomllib

    try:
        tomllib.loads(load("-").decode("utf-8-sig"))
    except ValueError:
        return False
    return True


def _spaced(text: str) -> str:
    """Write quantities as people do: `12kg` as 12 kg, `1480rpm` as 1480 rpm."""

    def spoken(part: str) -> str:
        for dimension in LISTED:
            try:
                _, unit = parse_quantity(part, dimension)
            except ValueError:
                continue
            number = re.match(r"\s*[-+.\deE]*\d\.?", part)
            if unit and number:
                return f"{number[0].strip()}{'' if unit == 'deg' else ' '}{written(unit)}"
        return part

    return re.sub(r"[^,:@=\s]+(?: [^,:@=\s\d]+)?", lambda match: spoken(match[0]), text).replace(",", ", ")


def _printed(parts: Iterable[str | Table | Bars], finish: Callable[[Table], Table]) -> Iterator[Part]:
    for part in parts:
        if isinstance(part, Bars):
            yield part
        elif isinstance(part, str):
            if part.strip():
                yield part
        elif part.columns and len(part.columns[0].values):
            yield from _grids(finish(part))


def _grids(table: Table) -> Iterator[Part]:
    """Yield a table in blocks that fit the page, and what is omitted."""
    length = len(table.columns[0].values)
    thinned = table.columns[0].header in _THINNED
    every = -(-length // ROWS) if thinned else 1
    kept = range(0, length, every) if thinned else range(min(length, ROWS))
    headers: list[str] = []
    texts: list[list[str]] = []
    certain = [replace(column, values=_known(column, kept)) for column in table.columns]
    for column, values in zip(table.columns, without_noise(certain), strict=True):
        cells = [
            "yes" if v is True else "no" if v is False else t
            for v, t in zip(values, printed(column.header, values), strict=True)
        ]
        if column.name in ("quantity", "column"):
            cells = [spelled(cell) for cell in cells]
        texts.append(cells)
        headers.append(_headed(column))
    numbers = [
        not has_names(column.values) or all(not cell or is_number(cell.replace(",", ".")) for cell in cells)
        for column, cells in zip(table.columns, texts, strict=True)
    ]
    widths = {
        str(k): max(map(len, [*cells, *header.split()]))
        for k, (cells, header) in enumerate(zip(texts, headers, strict=True))
    }
    keys = [str(k) for k, column in enumerate(table.columns) if column.header in table.keys]
    for block in in_blocks(widths, keys, WIDE):
        here = [int(k) for k in block]
        rows = [list(row) for row in zip(*(texts[k] for k in here), strict=True)]
        yield Grid([headers[k] for k in here], rows, [numbers[k] for k in here])
    if every > 1:
        yield f"one row in {every} of {length}"
    elif length > len(kept):
        yield f"… and {length - len(kept)} further rows"


def _known(column: Column, kept: Sequence[int]) -> list[Cell]:
    """The values of rows; what is within its own rounding error of zero is nothing."""
    values = [column.values[i] for i in kept]
    if column.error is None or not any(isinstance(v, float) and 0 < abs(v) < TINY for v in values):
        return values
    bounds = column.error()
    return [
        0.0 if isinstance(v, float) and abs(v) <= bounds[i] else v for i, v in zip(kept, values, strict=True)
    ]


def _words(name: str) -> str:
    return name.replace("_", " ")


def _headed(column: Column) -> str:
    """A column's name as a head: `mass [g]`; a magnitude per g is not in g."""
    words, unit = _words(column.name), written(column.unit)
    return words if not unit else f"{words} {unit}" if words.endswith(" per") else f"{words} [{unit}]"


# units of results that no input has
_RESULTS = ("kg_m2_s", "J", "W", "rad_s3", "m_s3")


def spelled(header: str) -> str:
    """Return a header that stands in a cell as people write it: `inertia_x_kg_m2` is inertia x [kg·m²]."""
    of, colon, rest = header.rpartition(": ")
    if colon:
        return f"{of}: {spelled(rest)}"
    if " " in header or "_" not in header:
        return header
    name, unit = parted(header, further=_RESULTS)
    return f"{_words(name)} [{written(unit)}]" if unit else _words(name)


_STYLE = """
:root { color-scheme: light }
body { font: 10pt/1.4 "Helvetica Neue", Arial, "Liberation Sans", sans-serif; color: #111; background: #fff;
  max-width: 184mm; margin: 8mm auto; padding: 0 4mm; overflow-wrap: anywhere }
h1 { font-size: 16pt; line-height: 1.2; margin: 0 0 2mm }
h2 { font-size: 13pt; margin: 5mm 0 1mm } h3 { font-size: 11pt; margin: 4mm 0 1mm; border-bottom: .3mm solid #999 }
h2, h3, p:has(+ .wide) { break-after: avoid } footer { break-inside: avoid }
dl { display: grid; grid-template-columns: fit-content(40%) 1fr; gap: 0 4mm; margin: 0 0 3mm } dt { color: #555 } dd { margin: 0 }
p { margin: 1.5mm 0; white-space: pre-wrap } pre { font: 8pt/1.3 monospace; white-space: pre-wrap; margin: 1.5mm 0 }
table { border-collapse: collapse; margin: 1.5mm 0 2.5mm; font-size: 9pt; max-width: 100% } thead { display: table-header-group }
th, td { padding: .5mm 1.6mm; text-align: left; vertical-align: top; border-bottom: .2mm solid #ccc } tr { break-inside: avoid }
th { background: #eee; font-weight: 600; vertical-align: bottom } .n { text-align: right; font-variant-numeric: tabular-nums }
td.n { white-space: nowrap } th, td { overflow-wrap: break-word } .long { overflow-wrap: anywhere } .good { color: #06632f; font-weight: 600 } .bad { color: #b00020; font-weight: 700 }
.warning { border-left: 1mm solid #b00020; padding-left: 2mm } .warning { margin: 1mm 0; font-size: 9pt } footer { margin-top: 2mm; font-size: 8pt; color: #444 }
figure { margin: 3mm 0; break-inside: avoid } svg { display: block; max-width: 100%; height: auto; margin: 0 auto }
@media print { svg { max-height: 95mm } .rows svg { max-height: 220mm } }
.dense { font-size: 8.5pt } .dense table { font-size: 7.5pt; line-height: 1.25; margin: 1mm 0 } .dense td, .dense th { padding-top: .2mm; padding-bottom: .2mm }
.dense p { margin: .8mm 0 } .dense h3 { font-size: 10pt; margin: 2.5mm 0 .5mm } @media print { .dense svg { max-height: 52mm } .verdict svg { max-height: 56mm } } .dense figure { margin: 1.5mm 0 }
.wide, figure { overflow-x: auto } @media screen and (max-width: 40em) { figure svg { min-width: 540px } } section + section { break-before: page }
@page { size: A4; margin: 12mm 12mm } @media print { body { margin: 0; padding: 0; max-width: none } .wide, figure { overflow: visible } }
"""
_MARKS = {**dict.fromkeys(GOOD, "good"), **dict.fromkeys(BAD, "bad")}
LONG = 40
"""A word of more characters is cut where the line ends."""
_NO_PICTURE = "(No picture: matplotlib is not installed.)"


def pages(path: Path, made: Report) -> dict[Path, bytes]:
    """Return the files of a report: the page itself, and with Markdown its pictures."""
    if path.suffix.lower() == ".md":
        return _markdown(path, made)
    return {path: "".join(_html(made)).encode()}


def _picture(page: Page) -> str | None:
    """The picture as SVG; None where there is none, or nothing to draw it with."""
    if page.figure is None:
        return None
    try:
        drawing = drawn(page.figure, "svg").decode()
    except DataError:
        return None
    return drawing[drawing.index("<svg") :]


def _html(report: Report) -> Iterator[str]:
    title = html.escape(report.title)
    yield '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
    yield '<meta name="viewport" content="width=device-width, initial-scale=1">'
    yield f"<title>{title}</title><style>{_STYLE}{BARS_STYLE}</style></head>\n<body>\n<h1>{title}</h1>\n"
    if report.about:
        rows = (f"<dt>{key}</dt><dd>{html.escape(value)}</dd>" for key, value in report.about)
        yield f"<dl>{''.join(rows)}</dl>\n"
    for page in report.pages:
        first = bool(page.sections) and page.sections[0][0] == VERDICT
        kind = "verdict" if first else "dense" if page.dense else ""
        yield f'<section class="{kind}">\n' if kind else "<section>\n"
        if page.title:
            yield f"<h2>{html.escape(page.title)}</h2>\n"
        for name, parts in page.sections:
            yield f"<h3>{html.escape(name)}</h3>\n"
            yield from map(html_part, parts)
        if page.figure is not None:
            yield _figure(_picture(page))
        yield "</section>\n"
    if report.warnings:
        yield "<h3>Warnings</h3>\n"
    for text in report.warnings:
        yield f'<p class="warning">{html.escape(text)}</p>\n'
    yield f"<footer>{''.join(f'<p>{html.escape(text)}</p>' for text in report.closing)}</footer>\n</body></html>\n"


def _figure(drawing: str | None) -> str:
    """A picture; one of several rows of panels, which is wide and high, may fill the page."""
    if drawing is None:
        return f"<p>{_NO_PICTURE}</p>\n"
    sides = [float(side) for side in re.findall(r'(?:width|height)="([\d.]+)pt"', drawing[:1000])]
    kind = ' class="rows"' if min(sides, default=0.0) > 500 else ""
    return f"<figure{kind}>{drawing}</figure>\n"


def html_part(part: Part) -> str:
    if isinstance(part, Bars):
        return part.html()
    if isinstance(part, str):
        tag, text = ("pre", part.removeprefix(CODE)) if part.startswith(CODE) else ("p", part.strip("\n"))
        return f"<{tag}>{html.escape(text)}</{tag}>\n"

    def line(row: list[str], tag: str) -> str:
        cells = []
        for cell, number in zip(row, part.numbers, strict=True):
            kinds = [*(["n"] if number else []), *([_MARKS[cell]] if cell in _MARKS else [])]
            kinds += ["long"] if max(map(len, cell.split()), default=0) > LONG else []
            of = f' class="{" ".join(kinds)}"' if kinds else ""
            cells.append(f"<{tag}{of}>{html.escape(cell)}</{tag}>")
        return f"<tr>{''.join(cells)}</tr>\n"

    body = "".join(line(row, "td") for row in part.rows)
    table = f"<table><thead>{line(part.header, 'th')}</thead><tbody>\n{body}</tbody></table>"
    return f'<div class="wide">{table}</div>\n'


def _markdown(path: Path, report: Report) -> dict[Path, bytes]:
    beside: dict[Path, bytes] = {}
    lines = [f"# {_escaped(report.title)}", *(f"- {key}: {_escaped(value)}" for key, value in report.about)]
    for page in report.pages:
        if page.title:
            lines.append(f"## {_escaped(page.title)}")
        for name, parts in page.sections:
            lines += [f"### {_escaped(name)}", *map(_markdown_part, parts)]
        if page.figure is not None:
            drawing = _picture(page)
            number = f"-{len(beside) + 1}" if beside else ""
            file = path.with_name(f"{path.stem}{number}.svg")
            lines.append(_NO_PICTURE if drawing is None else f"![{_escaped(report.title)}](<{file.name}>)")
            if drawing is not None:
                beside[file] = drawing.encode()
    if report.warnings:
        lines += ["### Warnings", *(f"> {_escaped(text)}" for text in report.warnings)]
    lines += ["---", *map(_escaped, report.closing)]
    text = "\n\n".join(lines)
    # entries of a list stand below each other
    return {path: re.sub(r"(?m)^(- .*)\n\n(?=- )", r"\1\n", text).encode() + b"\n", **beside}


def _markdown_part(part: Part) -> str:
    if isinstance(part, Bars):
        return f"~~~\n{part.text()}\n~~~"
    if isinstance(part, Grid):
        return markdown(part).rstrip("\n")
    if part.startswith(CODE):
        return f"~~~\n{part.removeprefix(CODE)}\n~~~"
    return "  \n".join(_escaped(line.strip()) for line in part.strip("\n").splitlines())


def _escaped(text: str) -> str:
    return re.sub(r"([\\`*_<>\[\]#|])", r"\\\1", " ".join(text.split()))
