"""The report of a balancing in the field: one self-contained page of HTML."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING

from cli.field import fit_words, words
from cli.field.fit import LogFits
from cli.field.solve import FieldBalancing, Solved

if TYPE_CHECKING:
    from cli.show.columns import Cell, Values

STYLE = """
body { font: 10.5pt/1.35 system-ui, sans-serif; color: #111; max-width: 190mm; margin: 8mm auto; padding: 0 4mm; }
h1 { font-size: 15pt; margin: 0 0 1mm; } h2 { font-size: 11pt; margin: 3.5mm 0 1mm; border-bottom: 1px solid #999; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: 9.5pt; }
th, td { padding: .15mm 2mm; text-align: right; border-bottom: 1px solid #ddd; } th { background: #f0f0f0; font-weight: 600; }
td.text, th.text { text-align: left; } table.main td { font-size: 12pt; font-weight: 600; }
.beside { display: flex; gap: 8mm; } .beside > div { flex: 1 1 auto; }
p, ul { margin: 1mm 0; } .small { font-size: 9pt; color: #333; } .warning { border-left: 3px solid #b00; padding-left: 2mm; }
figure { margin: 0; } svg { width: 100%; height: auto; max-height: 64mm; } .history svg { max-height: none; } section { break-after: page; } section:last-of-type { break-after: auto; }
@page { size: A4; margin: 10mm; } @media print { body { margin: 0; max-width: none; } }
"""


def html(found: FieldBalancing, source: str, warnings: Sequence[str], fits: LogFits | None = None) -> bytes:
    """Return the report of every rotor, a page each; with `fits` the history of its runs and what to expect."""
    pages = []
    for rotor, (k, i) in enumerate(found.place):
        solved = found.solved[k]
        name = f"Rotor {escape(found.runs.rotors[rotor])}" if found.several else "Balancing in the field"
        parts = [
            f"<h1>{name}</h1>",
            f'<p class="small">{escape(source)}. {escape(words.conventions(found))}</p>',
            *([f'<p class="warning">{escape(warning)}</p>' for warning in warnings] if rotor == 0 else []),
            "<h2>Readings</h2>",
            *(_readings(found, solved, i) if fits is None else _history(fits, solved, i)),
            "<h2>Influence coefficients</h2>",
            _table(words.influence_table(found, solved, i)),
            '<div class="beside"><div><h2>Corrections</h2>',
            _table(words.correction_table(found, solved, i), "main"),
            "".join(f"<p>{escape(line)}</p>" for line in words.split_lines(found, solved, i)),
            "</div><div><h2>Predicted vibration</h2>",
            _table(words.residual_table(found, solved, i)),
            "</div></div>",
            "".join(f"<p>{escape(line)}</p>" for line in words.summary(found, solved, i)),
        ]
        if lines := words.verdict(found, solved, i):
            parts += ["<h2>Verdict</h2>", "".join(f"<p>{escape(line)}</p>" for line in lines)]
        if fits is not None and (lines := fit_words.expected(fits, solved, i)):
            parts += ["<h2>What to expect</h2>", "".join(f"<p>{escape(line)}</p>" for line in lines)]
        parts.append(_picture(found, rotor, fits))
        pages.append(f"<section>{''.join(parts)}</section>")
    document = (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        f"<title>Balancing: {escape(source)}</title><style>{STYLE}</style></head>\n<body>{''.join(pages)}</body></html>\n"
    )
    return document.encode()


def _readings(found: FieldBalancing, solved: Solved, i: int) -> list[str]:
    return [
        f'<p class="small">{escape("; ".join(words.trials_lines(found, solved, i)))}</p>',
        _table(words.runs_table(found, solved, i))
        if solved.group.trials
        else "<p>The initial run stands below, beside the predicted vibration.</p>",
    ]


def _history(fits: LogFits, solved: Solved, i: int) -> list[str]:
    summary = f'<p class="small">{escape(fit_words.summary(fits, solved, i))}</p>'
    return [summary, _table(fit_words.history(fits, solved, i))]


def _table(columns: Mapping[str, Values], kind: str = "") -> str:
    named = [any(isinstance(cell, str) for cell in column) for column in columns.values()]

    def cell(value: Cell, is_name: bool, tag: str = "td") -> str:
        shown = "" if value is None else f"{value:.5g}" if isinstance(value, float) else str(value)
        return (
            f'<{tag} class="text">{escape(shown)}</{tag}>' if is_name else f"<{tag}>{escape(shown)}</{tag}>"
        )

    head = "".join(cell(name, is_name, "th") for name, is_name in zip(columns, named, strict=True))
    rows = "".join(
        "<tr>" + "".join(cell(value, is_name) for value, is_name in zip(row, named, strict=True)) + "</tr>"
        for row in zip(*columns.values(), strict=True)
    )
    return f'<table class="{kind}"><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>'


def _picture(found: FieldBalancing, rotor: int, fits: LogFits | None) -> str:
    """Return the polar pictures as SVG, or a sentence where matplotlib is not installed."""
    try:
        import matplotlib
    except ImportError:
        return '<p class="small">(No picture: matplotlib is not installed.)</p>'
    from cli.field import fit_picture, picture

    matplotlib.use("Agg")
    matplotlib.rcParams["svg.hashsalt"] = f"dalembert-{rotor}"
    stream = io.StringIO()
    figure = picture.draw(found, [rotor]) if fits is None else fit_picture.draw(fits, [rotor])
    figure.savefig(stream, format="svg", metadata={"Date": None})
    drawing = stream.getvalue()
    kind = "" if fits is None else ' class="history"'
    return f"<figure{kind}>{drawing[drawing.index('<svg') :]}</figure>"
