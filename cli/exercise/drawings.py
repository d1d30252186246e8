"""The figure of a sheet as SVG: the mechanism in its pose, or the rotor with its masses; nothing of the answers."""

from __future__ import annotations

import base64
import html
from collections.abc import Iterator, Sequence
from math import radians
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cli.exercise.variants import Variant
from dalembert.drawing.beside import along, around, beside
from dalembert.errors import DataError
from dalembert.page import Page

if TYPE_CHECKING:
    from virtualwork import Mechanism

MOST = 500.0, 440.0
"""Width and height of a mechanism's figure, pixels."""
WIDTH, LETTERS = 430.0, 15.0
"""Width of a rotor's figure, and the size of letters, pixels."""


def figure(variant: Variant) -> str:
    """Return the figure of a sheet as HTML; empty where there is none."""
    exercise = variant.problem.exercise
    if exercise.figure is not None:
        return _given(exercise.folder / exercise.figure)
    if variant.problem.workshop.mechanism is not None:
        return mechanism(variant)
    if exercise.command[0] == "balance":
        return rotor(variant)
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


def _svg(height: float, parts: Sequence[str], label: str) -> str:
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH:.0f} {height:.0f}" width="{WIDTH:.0f}" height="{height:.0f}" '
        f'role="img" aria-label="{html.escape(label)}" font-family="Arial, Liberation Sans, sans-serif" font-size="{LETTERS:g}" fill="none" '
        f'stroke-linejoin="round" stroke-linecap="round">{"".join(parts)}</svg>'
    )


def _text(x: float, y: float, text: str, more: str = "") -> str:
    # a white rim keeps a name readable upon lines
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="middle" fill="#111" stroke="#fff" stroke-width="4" '
        f'paint-order="stroke" {more}>{html.escape(text)}</text>'
    )


# --- mechanisms ---------------------------------------------------------------------------------------------------
def mechanism(variant: Variant) -> str:
    """Draw the mechanism of a variant in the pose asked for, to scale, as a notebook shows it."""
    import numpy as np

    from virtualwork.notebook_picture import svg

    m = _varied(variant)
    motion = m.motion(np.array([_inputs(variant, m)]))
    return svg(motion.poses, motion.drawing, most=MOST, letters=LETTERS) or ""


def _varied(variant: Variant) -> Mechanism:
    """The mechanism with the variant's dimensions."""
    from cli.cases.axes import assigned

    described = variant.problem.workshop.described
    texts = variant.problem.parameters["set"]
    m: Mechanism = assigned(described.mechanism, described.bare, texts) if texts else described.mechanism
    return m


def _inputs(variant: Variant, m: Mechanism) -> Any:
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


# --- rotors -------------------------------------------------------------------------------------------------------
def rotor(variant: Variant) -> str:
    """Draw a rotor's masses seen along its axis, and from the side where they have axial positions."""
    import numpy as np

    read, chosen = variant.problem.known_masses()
    table = read.table
    if len(read.names) > 1:
        return ""
    names = table.texts.get("name") or [str(k) for k in range(1, table.rows + 1)]
    radius = table.numbers["radius"].si if "radius" in table.numbers else np.ones(table.rows)
    angle = np.angle(np.where(read.moment == 0, 1, read.moment))
    z = read.z if chosen.several else None
    size = 330.0
    big = 88.0 if z is not None else 110.0
    cx, cy, r = (128.0 if z is not None else WIDTH / 2), 178.0, big
    parts = [
        f'<circle cx="{cx}" cy="{cy}" r="{r * 1.12:.1f}" stroke="#999" fill="#fafafa"/>',
        f'<circle cx="{cx}" cy="{cy}" r="7" stroke="#444" fill="#ddd"/>',
        f'<path d="M{cx - r * 1.2} {cy}H{cx + r * 1.2}M{cx} {cy + r * 1.2}V{cy - r * 1.2}" stroke="#bbb" stroke-dasharray="7 3 1 3"/>',
        _text(cx + r * 1.2 + 6, cy + 5, "x"),
        _text(cx + 12, cy - r * 1.2 + 5, "y"),
        _text(cx, 20, "seen against +z", more='font-size="13"'),
    ]
    far = float(radius.max()) or 1.0
    sizes = radius / far * r
    lines = [[(cx - r * 1.2, cy), (cx + r * 1.2 + 12, cy)], [(cx, cy - r * 1.2), (cx, cy + r * 1.2)]]
    drawn = [*map(along, lines), around((cx, cy), r * 1.12), around((cx + 12, cy - r * 1.2), 5)]
    x, y = cx + sizes * np.cos(angle), cy - sizes * np.sin(angle)
    parts += _masses(names, x, y, cx + 0 * sizes, cy, drawn, size)
    if z is not None:
        parts += _side(names, z, sizes * np.sin(angle), chosen, size)
    return _svg(size, parts, "rotor with its masses")


def _masses(
    names: Sequence[str], x: Any, y: Any, x0: Any, y0: float, drawn: Sequence[Any], height: float
) -> Iterator[str]:
    """Masses at (x, y) on their arms from (x0, y0), and their names, which keep clear of what is drawn."""
    import numpy as np

    places = list(zip(names, x.tolist(), y.tolist(), x0.tolist(), strict=True))
    for _, a, b, a0 in places:
        yield f'<path d="M{a0:.1f} {y0}L{a:.1f} {b:.1f}" stroke="#1d4f91" stroke-width="1.4"/>'
        yield f'<circle cx="{a:.1f}" cy="{b:.1f}" r="7" fill="#1d4f91" stroke="#fff"/>'
    marks = [part for _, a, b, a0 in places for part in (along([(a0, y0), (a, b)]), around((a, b), 7))]
    taken = np.concatenate([*drawn, *marks])
    for name, a, b, _ in places:
        middle, own = beside(name, (a, b), taken, (WIDTH, height), LETTERS)
        taken = np.concatenate([taken, own])
        yield _text(middle[0], middle[1] + LETTERS / 3, name)


def _side(names: Sequence[str], z: Any, up: Any, planes: Any, height: float) -> Iterator[str]:
    """The rotor from the side: masses and correction planes at their axial positions."""
    import numpy as np

    at = planes.z if planes.z is not None else np.zeros(len(planes.name))
    low, high = float(min(z.min(), at.min())), float(max(z.max(), at.max()))
    left, right, cy, r = 285.0, WIDTH - 24, 178.0, 88.0
    scale = (right - left) / ((high - low) or 1.0)
    yield f'<rect x="{left - 14}" y="{cy - 7}" width="{right - left + 28}" height="14" fill="#ddd" stroke="#888"/>'
    drawn = [along([(left - 14, cy + side), (right + 14, cy + side)]) for side in (-7, 7)]
    for k, (name, place) in enumerate(zip(planes.name, at.tolist(), strict=True)):
        x = left + (place - low) * scale
        yield f'<path d="M{x:.1f} {cy - 1.22 * r:.1f}V{cy + 1.22 * r:.1f}" stroke="#b35900" stroke-dasharray="6 4" stroke-width="1.5"/>'
        drawn.append(along([(x, cy - 1.5 * r), (x, cy + 1.22 * r)]))
        yield _text(
            x, cy - 1.3 * r - (17 if k % 2 and len(planes.name) > 3 else 0), name, more='font-weight="bold"'
        )
    x = left + (z - low) * scale
    yield from _masses(names, x, cy - up, x, cy, drawn, height)
    yield _text((left + right) / 2, cy + 1.22 * r + 24, "z →", more='font-size="13"')
    yield _text((left + right) / 2, 20, "from the side", more='font-size="13"')
