"""A page that moves in a real browser, asked as a reader would, and the four-bar that is shown on it."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from tests.four_bars import body, four_bar

EVIL = "<script>window.broken=1</script>"
WORSE = "</script><img src=x onerror=window.broken=1>"
FOUR_BAR = four_bar(
    body(0.5, (20, 0)),
    body(1.2, (60, 10), 0.001),
    body(0.9, (40, 0)),
    called=f'"{EVIL}"',
    points=f', "{WORSE}" = [60, 50]',
    head=f'name = "a {EVIL} & four-bar"',
    rates='speed = "300 rpm"\nacceleration = 0',
    guess={f'"{EVIL}"': 20, "rocker": 60},
)
POINTS = ("A", "D", "B", "C", WORSE)


class Opened:
    """A page in the browser, asked as a reader would."""

    def __init__(self, browser: Any, path: Path) -> None:
        self.browser = browser
        browser.get_log("browser")  # what an earlier page said
        browser.get(path.as_uri())

    def __call__(self, script: str, *arguments: object) -> Any:
        return self.browser.execute_script(script, *arguments)

    def set(self, i: int) -> None:
        """Move the slider to a pose."""
        self(
            "const s = document.getElementById('slider'); s.value = arguments[0]; s.dispatchEvent(new Event('input'))",
            i,
        )

    def press(self, key: str, shift: bool = False) -> None:
        self(
            "document.body.dispatchEvent(new KeyboardEvent('keydown', {key: arguments[0], shiftKey: arguments[1], bubbles: true}))",
            key,
            shift,
        )

    def text(self, element: str) -> str:
        return str(self("return document.getElementById(arguments[0]).textContent", element))

    def pose(self) -> int:
        """The number of the pose shown, counted from 0."""
        return int(self("return Number(document.getElementById('slider').value)"))

    def table(self, caption: str) -> dict[str, list[str]]:
        """Return a table's cells by the names of its rows."""
        return dict(
            self(
                "const t = [...document.querySelectorAll('table')].find((t) => t.caption.textContent === arguments[0]);"
                "return [...t.tBodies[0].rows].map((r) => [r.cells[0].textContent,"
                " [...r.cells].slice(1).map((c) => c.textContent)])",
                caption,
            )
        )

    def paths(self, selector: str) -> list[np.ndarray[Any, Any]]:
        """Return the corners, in pixels, of paths."""
        found = self(
            "return [...document.querySelectorAll(arguments[0])].map((p) => p.getAttribute('d'))", selector
        )
        return [np.array(re.findall(r"(-?[\d.]+) (-?[\d.]+)", d), dtype=float) for d in found if d]

    def names_in_one_place(self) -> list[str]:
        """Return the words of pictures that lie over one another."""
        return list(
            self(
                "const t = [...document.querySelectorAll('#view text:not(.missing), #extra text, #loose text, svg.polygon text')]"
                ".map((e) => [e.textContent, e.getBoundingClientRect()]).filter(([, r]) => r.width);"
                "return t.flatMap(([a, p], i) => t.slice(0, i).filter(([, q]) =>"
                " Math.min(p.right, q.right) - Math.max(p.left, q.left) > 2 &&"
                " Math.min(p.bottom, q.bottom) - Math.max(p.top, q.top) > 3).map(([b]) => `${a} over ${b}`))"
            )
        )

    def faults(self) -> list[str]:
        """Return what the console says, and whatever was fetched."""
        said = [entry["message"] for entry in self.browser.get_log("browser")]
        return said + list(self("return performance.getEntriesByType('resource').map((e) => e.name)"))
