"""The way to a result, as a book has it: topics of equations with numbers and of tables of quantities.

Terminal, report and JSON walk the same topics; a command forms them with --steps alone.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import isfinite
from typing import TYPE_CHECKING, Any

from dalembert.dataclass import dataclass, field
from dalembert.results.columns import Table, document
from dalembert.results.text import NOISE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from dalembert.results.columns import Document


@dataclass(eq=False, repr=False)
class Topic:
    """A step of the way: what it is about, then equations and tables in the order of the book.

    Examples
    --------
    >>> from dalembert.results.columns import number
    >>> moments = Table([number("x", "unbalance", [0.5])], place="")
    >>> Topic("plane B", ["ΣM_A = 0", moments], head={"rotor": "1"}).documented()
    {'topic': 'plane B', 'rotor': '1', 'x_kg_m': 0.5}
    """

    name: str
    """Its name in JSON."""
    parts: Sequence[str | Table] = ()
    """Equations and sentences as text, and tables; a table's `place` is where it stands in this topic's JSON."""
    title: str = ""
    """Its heading, if that is more than the name."""
    head: Mapping[str, Any] = field(default_factory=dict)
    """Its further members in JSON, before the tables."""
    figure: Callable[[], Figure] | None = None
    """Its picture, for the report."""

    @property
    def heading(self) -> str:
        """Its heading."""
        text = self.title or self.name
        return text[:1].upper() + text[1:]

    def documented(self) -> Document:
        """Return its entry in the JSON list `way`."""
        tables = [part for part in self.parts if isinstance(part, Table)]
        return {"topic": self.name, **self.head, **document(tables)}


def figures(value: float) -> str:
    """Return a number as it stands in an equation: six figures, a true minus sign, thousands apart.

    >>> figures(-2500000.0), figures(0.05), figures(-1e-9)
    ('−2 500 000', '0.05', '−1e−09')
    >>> figures(float("nan"))
    '–'
    """
    if not isfinite(value):
        return "–"
    text = f"{value + 0.0:.6g}"
    if "e" in text and 1e6 <= abs(value) < 1e9:
        text = f"{float(text):.0f}"
    if "e" not in text:
        whole, point, rest = text.partition(".")
        text = f"{int(whole):,}".replace(",", "\u2009") + point + rest if whole.lstrip("-") != "0" else text
    return text.replace("-", "−").replace("\u2009", " ")


def vector_text(z: complex) -> str:
    """Return a vector of the plane as it stands in an equation: `(300, 200)`; what rounding left of 0 is 0.

    >>> vector_text(300 - 200j), vector_text(1e-13 - 200j)
    ('(300, −200)', '(0, −200)')
    """
    parts = (0.0 if abs(part) < NOISE * abs(z) else part for part in (z.real, z.imag))
    return f"({', '.join(map(figures, parts))})"
