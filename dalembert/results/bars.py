"""Bars of one scale, in HTML and as text."""

from __future__ import annotations

from collections.abc import Sequence

from dalembert.dataclass import dataclass

BLOCKS = 24
BARS_STYLE = """
.bars { display: grid; grid-template-columns: fit-content(42%) 1fr max-content; gap: .8mm 2mm; align-items: center; margin: 2mm 0; font-size: 9pt }
.bars span:nth-child(3n) { font-variant-numeric: tabular-nums; text-align: right } .track { position: relative; display: block; height: 3.4mm; background: #f2f2f2 }
.track i, .track u { position: absolute; top: 0; bottom: 0; print-color-adjust: exact; -webkit-print-color-adjust: exact } .track i { left: 0; background: #8a8a8a }
.track i.after { background: #06632f } .track i.over { background: #b00020 } .track u { width: .4mm; background: #b00020; top: -.6mm; bottom: -.6mm }
"""


@dataclass(frozen=True, eq=False, repr=False)
class Bar:
    """A bar: its label, how long it is, and the number beside it."""

    label: str
    value: float
    text: str
    after: bool
    """Whether it shows what was made of the first one."""


@dataclass(frozen=True, eq=False, repr=False)
class Bars:
    """Bars of one scale, with the limit that they are held against."""

    rows: Sequence[Bar]
    limit: float | None = None
    limit_text: str = ""

    @property
    def _whole(self) -> float:
        return max([row.value for row in self.rows] + [1.1 * (self.limit or 0.0)]) or 1.0

    def html(self) -> str:
        """Return them as HTML."""
        import html

        cells = []
        for row in self.rows:
            over = self.limit is not None and row.value > self.limit * (1 + 1e-9)
            kind = f' class="{"over" if over else "after"}"' if row.after else ""
            line = "" if self.limit is None else f'<u style="left:{100 * self.limit / self._whole:.2f}%"></u>'
            cells.append(
                f'<span>{html.escape(row.label)}</span><span class="track"><i{kind} style="width:{100 * row.value / self._whole:.2f}%">'
                f"</i>{line}</span><span>{html.escape(row.text)}</span>"
            )
        note = f"<p>{html.escape(self.limit_text)}</p>\n" if self.limit_text else ""
        return f'<div class="bars">{"".join(cells)}</div>\n{note}'

    def text(self) -> str:
        """Return them as lines of blocks, in a fixed width."""
        wide = max(len(row.label) for row in self.rows)
        lines = [
            f"{row.label:<{wide}}  {'█' * round(BLOCKS * row.value / self._whole) or '▏'} {row.text}"
            for row in self.rows
        ]
        return "\n".join([*lines, *([self.limit_text] if self.limit_text else [])])
