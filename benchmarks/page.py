"""The tables and pictures of a page of measurements: `python -m benchmarks speed --docs FILE.md` writes them, nothing by hand."""

from __future__ import annotations

import platform
import re
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from benchmarks.speed.measure import Measurement, calibration, exponent
from dalembert.errors import DataError

if TYPE_CHECKING:
    from benchmarks.stress.campaigns import Tally

Column = tuple[str, Callable[[Measurement], str]]


def block(name: str) -> re.Pattern[str]:
    """Return the pattern of a block: its opening mark, what stands in it, its end."""
    return re.compile(rf"(<!-- bench:{re.escape(name)} -->\n).*?(<!-- end -->)", re.DOTALL)


def check(path: Path, domains: Iterable[str]) -> None:
    """Refuse a page that has no place for what will be measured, before it is measured."""
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise DataError(f"{path}: {error.strerror}") from None
    for domain in domains:
        if not block(domain).search(text):
            raise DataError(
                f"{path}: expected the marks <!-- bench:{domain} --> and <!-- end -->, found none"
            )


def write(path: Path, measurements: Sequence[Measurement]) -> None:
    """Write each measured domain's block and picture; and the table of aims where all of them were measured."""
    from benchmarks.speed.picture import draw

    text = path.read_text(encoding="utf-8")
    for domain in dict.fromkeys(m.domain for m in measurements):
        mine = [m for m in measurements if m.domain == domain]
        picture = Path("pictures") / f"bench-{domain}.svg"
        (path.parent / "pictures").mkdir(exist_ok=True)
        _save(draw(mine), path.parent / picture)
        parts = [conditions(), f"![Measurements of the domain {domain}]({picture.as_posix()})", *tables(mine)]
        text = _put(text, domain, "\n\n".join(parts))
    if block("aims").search(text):
        known = {m.group(1) for m in re.finditer(r"<!-- bench:([\w-]+) -->", text)} - {"aims", "stress"}
        if known == {m.domain for m in measurements}:
            text = _put(text, "aims", f"{conditions()}\n\n{aims(measurements)}")
    path.write_text(text, encoding="utf-8")


def write_stress(path: Path, tallies: Sequence[Tally]) -> None:
    """Write the table of the random campaigns into its block."""
    rows = [
        (
            t.name,
            t.line,
            f"{len(t.ratios):,}",
            f"{100 * t.bounded:.4g} %",
            f"{t.worst:.2g}",
            str(t.seed),
            f"{t.slack:.2g}",
        )
        for t in tallies
    ]
    heads = (
        "campaign",
        "cases",
        "answers",
        "within the estimate",
        "worst error over estimate",
        "its seed",
        "median estimate over error",
    )
    table = _table(heads, "llrrrrr", rows)
    path.write_text(
        _put(path.read_text(encoding="utf-8"), "stress", f"{conditions()}\n\n{table}"), encoding="utf-8"
    )


def _put(text: str, name: str, content: str) -> str:
    return block(name).sub(lambda found: f"{found[1]}{content}\n{found[2]}", text)


def _save(figure: object, path: Path) -> None:
    import matplotlib

    with matplotlib.rc_context({"svg.hashsalt": "dalembert", "svg.fonttype": "none"}):
        figure.savefig(path, metadata={"Date": None})  # type: ignore[attr-defined]


def conditions() -> str:
    """Return one line: when, on what, with what, and the calibration loop."""
    from datetime import date
    from importlib.metadata import version

    with_what = ", ".join(f"{name} {version(name)}" for name in ("dalembert", "numpy", "scipy"))
    return (
        f"*Measured {date.today().isoformat()} on {_processor()}, Python {platform.python_version()}, {with_what}, "
        f"one thread; the unit, one element of √(x² + y²), took {calibration():.2f} ns at its best.*"
    )


def _processor() -> str:
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        text = ""
    found = re.search(r"^model name\s*: (.+)$", text, re.MULTILINE)
    return found[1].strip() if found else platform.processor() or platform.machine()


IDLE = 1.88
"""The unit, ns, on the idle machine of the kind for which the aims in ns were set."""


def aims(measurements: Iterable[Measurement]) -> str:
    """Return the table of what has an aim: the aim beside what was measured; times are judged by their units."""
    rows = []
    for m in measurements:
        name = (f"{m.work}: {m.method}", f"{m.size:,}")
        if m.aim_ns is not None:
            aim = m.aim_ns / IDLE
            shown = (time(m.ns), f"{m.units:.3g}", f"≤ {aim:.3g} units ({time(m.aim_ns)})")
            rows.append((*name, "time", *shown, _met(m.units, aim)))
        for what, found, most, show in (
            ("error", m.error, m.aim_error, "{:.1e}".format),
            (f"time over {m.floor}", m.ratio, m.aim_ratio, "{:.2f}".format),
        ):
            if most is not None and found is not None:
                rows.append((*name, what, show(found), "", f"≤ {show(most)}", _met(found, most)))
    heads = ("work", "items a call", "what", "measured", "units", "aim", "met")
    return _table(heads, "lrlrrrl", rows)


def _met(measured: float, aim: float) -> str:
    return "yes" if measured <= aim else f"**no**, {measured / aim:.3g} ×"


def tables(measurements: Sequence[Measurement]) -> list[str]:
    """Return a table for each piece of work, with the columns that hold anything."""
    out = []
    for work in dict.fromkeys(m.work for m in measurements):
        mine = [m for m in measurements if m.work == work]
        floors = {m.floor for m in mine if m.floor}
        over = f"over {floors.pop()}" if len(floors) == 1 else "over its floor"
        columns: list[Column] = [
            ("items a call", lambda m: f"{m.size:,}" if m.size > 1 else ""),
            ("condition", lambda m: f"{m.condition:.1e}" if m.condition else ""),
            ("time an item", lambda m: time(m.ns)),
            ("units", lambda m: f"{m.units:.3g}"),
            ("error", lambda m: "" if m.error is None else f"{m.error:.1e}"),
            (over, lambda m: f"{m.ratio:.2f}" if m.ratio else ""),
            ("memory an item", lambda m: f"{m.bytes / m.size:,.3g} B" if m.bytes else ""),
            ("operations a pose", lambda m: str(m.operations) if m.operations else ""),
        ]
        filled = [(head, show) for head, show in columns if any(show(m) for m in mine)]
        rows = [(f"*{m.method}*" if m.peer else m.method, *(show(m) for _, show in filled)) for m in mine]
        heads = ("method", *(head for head, _ in filled))
        out.append(f"**{work}**\n\n{_table(heads, 'l' + 'r' * len(filled), rows)}{_growth(mine)}")
    return out


def _growth(measurements: Sequence[Measurement]) -> str:
    """Return a sentence on how time and memory of a call grow with its size, where it was measured at three and more."""
    found = []
    for method in dict.fromkeys(m.method for m in measurements):
        mine = [m for m in measurements if m.method == method]
        for what, grown in (
            ("time", [(m.size, m.ns * m.size) for m in mine]),
            ("memory", [(m.size, m.bytes) for m in mine if m.bytes]),
        ):
            if len({size for size, _ in grown}) > 2:
                sizes, values = zip(*grown, strict=True)
                found.append(f"{method}: {what} ~ size^{exponent(sizes, values):.2f}")
    return f"\n\nOf a call, over the last three sizes: {'; '.join(found)}." if found else ""


def time(ns: float) -> str:
    """Write a time given in ns with its unit.

    >>> time(23.456), time(58_753.0), time(2.6e9)
    ('23.5 ns', '58.8 µs', '2.6 s')
    """
    for unit, size in (("s", 1e9), ("ms", 1e6), ("µs", 1e3), ("ns", 1.0)):
        if ns >= size or unit == "ns":
            return f"{float(f'{ns / size:.3g}'):g} {unit}"
    raise AssertionError


def _table(heads: Sequence[str], sides: str, rows: Iterable[Sequence[str]]) -> str:
    rule = ["---" if side == "l" else "---:" for side in sides]
    lines = [heads, rule, *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
