"""A page that moves: data, a style and a small script in one HTML file, which needs no network.

A page shows *series* of poses: columns over one input or time, and what a scene needs to know to draw them. The first series
is drawn in full, the others as ghosts. `plane.js` draws mechanisms, `space.js` a body that turns; what both share (play,
slider, table, plots) is in `player.js`. Whoever fills a page passes plain data: nothing here knows mechanics.

Names come from users. They stand in the page as data and reach it as text only; besides, the page's own policy runs no
script but the one that is named there by its hash, and loads nothing.
"""

from __future__ import annotations

import base64
import hashlib
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from dalembert.decimals import Factor
from dalembert.units import (
    ABBREVIATIONS,
    AMPLITUDES,
    JOINED,
    LARGEST,
    PER_MINUTE,
    READ_AS,
    SIGNS,
    TAGS,
    WORDS,
    written,
)

Json = Any

MOST = 20_000
"""Poses of a page: a browser draws as many without a halt."""


@dataclass(frozen=True)
class Shown:
    """A column as the page shows it: under a header of its own where it is in a unit of its own."""

    values: ArrayLike
    header: str
    si: float = 1.0
    """The value of one of its unit in SI and radians."""


def fits(count: int) -> None:
    """Refuse more poses than a page can hold: ValueError."""
    if count > MOST:
        raise ValueError(f"a page that moves of {count} poses: expected at most {MOST}; take larger steps")


def packed(values: ArrayLike, exact: bool = True) -> Json:
    """Return a column of numbers as the page keeps it: one number where all are equal, else the numbers' bytes in base64.

    Parameters
    ----------
    values : array (n,)
        NaN where there is none.
    exact : bool
        Keep every digit: 8 bytes a number. Else 4 bytes and 7 digits, wherever the numbers' range allows.

    >>> packed([2.5, 2.5]), packed([1.0, 2.0], exact=False)
    ({'all': 2.5}, {'f4': 'AACAPwAAAEA='})
    """
    numbers = np.asarray(values, dtype=float)
    if numbers.size and (numbers == numbers[0]).all():
        return {"all": float(numbers[0])}
    short = numbers.astype("<f4") if not exact and _in_range(numbers) else None
    data, kind = (numbers.astype("<f8"), "f8") if short is None else (short, "f4")
    return {kind: base64.b64encode(data.tobytes()).decode()}


def _in_range(values: np.ndarray[Any, np.dtype[np.float64]]) -> bool:
    size = np.abs(values[np.isfinite(values) & (values != 0)])
    return bool(np.isfinite(values[~np.isnan(values)]).all() and (size < 1e38).all() and (size > 1e-37).all())


def rounded(values: ArrayLike) -> list[float]:
    """Return numbers with the seven digits that a drawing needs.

    >>> rounded([1 / 3])
    [0.3333333]
    """
    return [float(f"{x:.7g}") for x in np.asarray(values, dtype=float).ravel().tolist()]


def _unit_table() -> Json:
    """The words of units with their factors and exponents, and their other spellings, from which a page reads units."""
    marks: list[Mapping[str, Factor]] = [{tag[1:]: (1, 1)} for tag in TAGS[1:]]
    marks += [AMPLITUDES["voltage"], AMPLITUDES["digital signal"]]
    of_vibrations = {
        word: [*factor, *(0,) * (4 + k), 1] for k, mark in enumerate(marks) for word, factor in mark.items()
    }
    return {
        "words": {word: [*factor, *exponents] for word, (factor, exponents) in WORDS.items()} | of_vibrations,
        "inFull": ABBREVIATIONS,
        "signs": SIGNS,
        "joined": JOINED,
        "perMinute": PER_MINUTE,
        "readAs": {tag[1:]: words for tag, words in READ_AS.items()},
        "largest": LARGEST,
    }


def spelled(unit: str) -> str:
    """A unit of a header as people write it; degrees in letters, as they are typed.

    >>> spelled("m_s2"), spelled("N_m"), spelled("N_s_per_m"), spelled("kg_m3"), spelled("mm_s_rms"), spelled("deg")
    ('m/s²', 'N·m', 'N·s/m', 'kg/m³', 'mm/s r.m.s.', 'deg')
    """
    return written(unit).replace("°", "deg")


@dataclass(frozen=True)
class Page:
    """A page that moves, as one text of HTML; a notebook shows it in a frame of its own."""

    html: str
    height: int = 640
    """The height of the frame in a notebook, pixels."""

    def save(self, path: str | Path) -> None:
        """Write the page to a file; a browser opens it from the disk."""
        Path(path).write_text(self.html, encoding="utf-8")

    def __repr__(self) -> str:
        return f"Page({len(self.html) / 1e3:.0f} kB of HTML; .save(FILE) writes it)"

    def frame(self, allow: str = "allow-scripts") -> str:
        """The page in a frame of another one, out of whose reach it is; `allow` as HTML's `sandbox` has it."""
        return (
            f'<iframe srcdoc="{escape(self.html)}" sandbox="{allow}" style="width:100%;'
            f'height:{self.height}px;border:0" title="a moving picture"></iframe>'
        )

    def _repr_html_(self) -> str:
        return self.frame()


def page(
    title: str,
    scene: Literal["plane", "space"],
    series: Sequence[Mapping[str, Json]],
    script: str = "",
    **rest: Json,
) -> Page:
    """Return the page of some series of poses.

    Parameters
    ----------
    title : str
    scene : "plane" or "space"
        Which script draws it.
    series : sequence of mappings
        Each holds `columns`, a list of {header, owner, and what `packed` gives}, `n`, the number of poses, and what its
        scene reads.
    script : str
        What computes the columns anew (tapes and engine); without it the page replays them.
    rest
        What else the script reads.
    """
    own = ["player.js", f"{scene}.js"]
    own = (
        ["solving.js", "way.js", "model.js", "common.js", "entry.js", *own, "loose.js", "editor.js"]
        if script
        else ["common.js", *own]
    )
    typed = {"unitTable": _unit_table()} if script else {}
    return _filled(title, "page.html", script, ["texts.js", *own], {"series": series, **typed, **rest})


def sheet(title: str, kind: Literal["balance", "field"], script: str, sheet: Json) -> Page:
    """Return a sheet whose numbers are typed, and which computes what follows.

    Parameters
    ----------
    title : str
    kind : "balance" or "field"
        Which script fills it.
    script : str
        Engine and tapes.
    sheet
        What the script reads.
    """
    own = ["texts.js", "common.js", "entry.js", "sheet.js", f"{kind}.js"]
    return _filled(title, "sheet.html", script, own, {"unitTable": _unit_table(), "sheet": sheet})


def _filled(title: str, html: str, script: str, names: Sequence[str], data: Mapping[str, Json]) -> Page:
    """Return the page of some scripts, in one text that the page's policy names by its hash, and of their data."""
    text = json.dumps(data, separators=(",", ":"), ensure_ascii=False)
    # a name in the data cannot end the element that holds it
    text = text.replace("<", "\\u003c")
    script = "\n".join(['"use strict";', script, *map(_part, names), ""])
    hashed = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    places = {
        "{{title}}": escape(title or "dalembert"),
        "{{hash}}": hashed,
        "{{style}}": _part("page.css"),
        "{{script}}": script,
        "{{data}}": text,
    }
    head, *rest = _part(html).split("{{")
    parts = [head]
    for part in rest:
        name, after = part.split("}}", 1)
        parts += [places["{{" + name + "}}"], after]
    return Page("".join(parts))


@cache
def _part(name: str) -> str:
    text = (files("dalembert.page") / name).read_text(encoding="utf-8")
    # remarks of whole lines but the first are for who reads the file
    return re.sub(r"(?m)(?<=\n)\s*//.*\n", "", text) if name.endswith(".js") else text
