"""What is wrong with the names of a picture in SVG: names on lines, on other names, beyond the edge."""

from __future__ import annotations

from itertools import pairwise
from xml.etree import ElementTree

import numpy as np

SVG = "{http://www.w3.org/2000/svg}"


def svg_names(text: str) -> list[str]:
    """Return the names of a picture."""
    return [str(t.text) for t in ElementTree.fromstring(text).iter(f"{SVG}text")]


def svg_faults(text: str) -> list[str]:
    """Return a sentence for each name that lies on a line, on another name, or beyond the edge."""
    root = ElementTree.fromstring(text)
    part = float(root.get("font-size", "")) / 12
    size = np.array([float(root.get(side, "")) for side in ("width", "height")])
    lines = [*root.iter(f"{SVG}polygon"), *root.iter(f"{SVG}polyline")]
    corners = [
        np.array([pair.split(",") for pair in str(line.get("points")).split()], dtype=float) for line in lines
    ]
    dense = np.concatenate(
        [
            a + np.linspace(0, 1, 200)[:, None] * (b - a)
            for ends in corners
            for a, b in pairwise([*ends, ends[0]])
        ]
    )
    names = [(str(t.text), np.array([t.get("x"), t.get("y")], dtype=float)) for t in root.iter(f"{SVG}text")]
    faults = []
    for k, (name, middle) in enumerate(names):
        half = part * np.array([3 * len(name), 5.0])
        if np.any(half > middle) or np.any(middle + half > size):
            faults.append(f"{name} is cut off")
        if np.any(np.all(np.abs(dense - middle) < half, axis=1)):
            faults.append(f"{name} lies on a line")
        faults += [
            f"{name} lies on {other}" for other, at in names[:k] if np.hypot(*(middle - at)) <= 8 * part
        ]
    return faults
