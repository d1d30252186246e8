"""A report as a page of HTML that prints on A4 and Letter, or as Markdown with its pictures beside it."""

from __future__ import annotations

import html
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from cli.show.handed_on import markdown
from cli.show.picture import drawn
from cli.show.report import CODE, Page, Part, Report, report
from dalembert.errors import DataError
from dalembert.results.text import BAD, GOOD, Grid

if TYPE_CHECKING:
    from cli.show.commands import ShowOptions
    from cli.show.expect import Comparison
    from cli.show.result import Result

_STYLE = """
:root { color-scheme: light }
body { font: 10pt/1.4 "Helvetica Neue", Arial, "Liberation Sans", sans-serif; color: #111; background: #fff;
  max-width: 184mm; margin: 8mm auto; padding: 0 4mm; overflow-wrap: anywhere }
h1 { font-size: 16pt; line-height: 1.2; margin: 0 0 2mm }
h2 { font-size: 13pt; margin: 5mm 0 1mm } h3 { font-size: 11pt; margin: 4mm 0 1mm; border-bottom: .3mm solid #999 }
h2, h3 { break-after: avoid }
dl { display: grid; grid-template-columns: fit-content(40%) 1fr; gap: 0 4mm; margin: 0 0 3mm } dt { color: #555 } dd { margin: 0 }
p { margin: 1.5mm 0; white-space: pre-wrap } pre { font: 8pt/1.3 monospace; white-space: pre-wrap; margin: 1.5mm 0 }
table { border-collapse: collapse; margin: 1.5mm 0 2.5mm; font-size: 9pt; max-width: 100% } thead { display: table-header-group }
th, td { padding: .5mm 1.6mm; text-align: left; vertical-align: top; border-bottom: .2mm solid #ccc } tr { break-inside: avoid }
th { background: #eee; font-weight: 600; vertical-align: bottom } .n { text-align: right; font-variant-numeric: tabular-nums }
td.n { white-space: nowrap } th, td { overflow-wrap: break-word } .long { overflow-wrap: anywhere } .good { color: #06632f; font-weight: 600 } .bad { color: #b00020; font-weight: 700 }
.warning { border-left: 1mm solid #b00020; padding-left: 2mm } footer { margin-top: 4mm; font-size: 8.5pt; color: #444 }
figure { margin: 3mm 0; break-inside: avoid } svg { display: block; max-width: 100%; height: auto; max-height: 95mm; margin: 0 auto } .rows svg { max-height: 220mm }
.wide { overflow-x: auto } section + section { break-before: page }
@page { margin: 13mm 12mm } @media print { body { margin: 0; padding: 0; max-width: none } .wide { overflow: visible } }
"""
_MARKS = {**dict.fromkeys(GOOD, "good"), **dict.fromkeys(BAD, "bad")}
LONG = 40
"""A word of more characters is cut where the line ends."""
_NO_PICTURE = "(No picture: matplotlib is not installed.)"


def pages(
    result: Result, options: ShowOptions, asked: Mapping[str, str], checked: Comparison | None = None
) -> dict[Path, bytes]:
    """Return the files of a result's report: the page itself, and beside Markdown its pictures."""
    path = options.report
    assert path is not None
    made = report(result, options, asked, checked)
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
    yield f"<title>{title}</title><style>{_STYLE}</style></head>\n<body>\n<h1>{title}</h1>\n"
    if report.about:
        rows = (f"<dt>{key}</dt><dd>{html.escape(value)}</dd>" for key, value in report.about)
        yield f"<dl>{''.join(rows)}</dl>\n"
    for text in report.warnings:
        yield f'<p class="warning">{html.escape(text)}</p>\n'
    for page in report.pages:
        yield "<section>\n"
        if page.title:
            yield f"<h2>{html.escape(page.title)}</h2>\n"
        for name, parts in page.sections:
            yield f"<h3>{html.escape(name)}</h3>\n"
            yield from map(html_part, parts)
        if page.figure is not None:
            yield _figure(_picture(page))
        yield "</section>\n"
    yield f"<footer>{''.join(f'<p>{html.escape(text)}</p>' for text in report.closing)}</footer>\n</body></html>\n"


def _figure(drawing: str | None) -> str:
    """A picture; one of several rows of panels, which is wide and high, may fill the page."""
    if drawing is None:
        return f"<p>{_NO_PICTURE}</p>\n"
    sides = [float(side) for side in re.findall(r'(?:width|height)="([\d.]+)pt"', drawing[:1000])]
    kind = ' class="rows"' if min(sides, default=0.0) > 500 else ""
    return f"<figure{kind}>{drawing}</figure>\n"


def html_part(part: Part) -> str:
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
    lines += [f"> {_escaped(text)}" for text in report.warnings]
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
    lines += ["---", *map(_escaped, report.closing)]
    text = "\n\n".join(lines)
    # entries of a list stand below each other
    return {path: re.sub(r"(?m)^(- .*)\n\n(?=- )", r"\1\n", text).encode() + b"\n", **beside}


def _markdown_part(part: Part) -> str:
    if isinstance(part, Grid):
        return markdown(part).rstrip("\n")
    if part.startswith(CODE):
        return f"~~~\n{part.removeprefix(CODE)}\n~~~"
    return "  \n".join(_escaped(line.strip()) for line in part.strip("\n").splitlines())


def _escaped(text: str) -> str:
    return re.sub(r"([\\`*_<>\[\]#|])", r"\\\1", " ".join(text.split()))
