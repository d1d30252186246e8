"""The drawing as SVG, in its true size."""

from __future__ import annotations

from xml.etree.ElementTree import Element

from cli.exports.drawing import LAYERS, Circle, Drawing, Line
from cli.exports.markup import add, digits, document

# of the drawing's extent: margin, width of a stroke
MARGIN, STROKE = 0.06, 0.003


def svg(drawing: Drawing, said: str, millimetres: float) -> bytes:
    """Return the file; `millimetres` are one of the drawing's unit."""
    low, high = drawing.extent()
    extent = max(high.real - low.real, high.imag - low.imag) or 1.0
    edge = MARGIN * extent
    width, height = high.real - low.real + 2 * edge, high.imag - low.imag + 2 * edge
    root = Element("svg", xmlns="http://www.w3.org/2000/svg")
    root.set("width", f"{width * millimetres:.6g}mm")
    root.set("height", f"{height * millimetres:.6g}mm")
    # y points down
    root.set("viewBox", digits(low.real - edge, -high.imag - edge, width, height))
    groups = {}
    for name, (_, colour, _) in LAYERS.items():
        groups[name] = add(root, "g", id=name, fill="none", stroke=colour)
        groups[name].set("stroke-width", digits(STROKE * extent))
        groups[name].set("stroke-linejoin", "round")
    groups["NAMES"].attrib |= {"fill": LAYERS["NAMES"][1], "stroke": "none", "font-family": "sans-serif"}
    for s in drawing.shapes:
        into = groups[s.layer]
        if isinstance(s, Line):
            points = " ".join(f"{z.real!r},{-z.imag + 0.0!r}" for z in s.places)
            add(into, "polygon" if s.closed else "polyline", points=points)
        elif isinstance(s, Circle):
            add(into, "circle", cx=s.center.real, cy=-s.center.imag, r=s.radius, fill="white")
        else:
            text = add(into, "text", s.text, x=s.at.real, y=-s.at.imag)
            text.set("font-size", digits(s.height))
    return document(root, said)
