"""The drawing as DXF (AutoCAD 2010), by ezdxf."""

from __future__ import annotations

import io

from cli.errors import DataError
from cli.exports.drawing import LAYERS, Circle, Drawing, Line

# $INSUNITS
UNITS = {"in": 1, "ft": 2, "mm": 4, "cm": 5, "m": 6, "km": 7, "nm": 11, "um": 13, "µm": 13}


def dxf(drawing: Drawing, said: str) -> bytes:
    """Return the file."""
    try:
        from ezdxf.filemanagement import new
    except ImportError:
        raise DataError("DXF is written by ezdxf: pip install 'dalembert[cad]'") from None
    made = new("R2010")
    made.header["$INSUNITS"] = UNITS[drawing.unit]
    made.header["$MEASUREMENT"] = 0 if drawing.unit in ("in", "ft") else 1
    for name, (colour, _, _) in LAYERS.items():
        made.layers.add(name, color=colour)
    space = made.modelspace()
    for s in drawing.shapes:
        at = {"layer": s.layer}
        if isinstance(s, Line):
            space.add_lwpolyline([(z.real, z.imag) for z in s.places], close=s.closed, dxfattribs=at)
        elif isinstance(s, Circle):
            space.add_circle((s.center.real, s.center.imag), s.radius, dxfattribs=at)
        else:
            space.add_text(s.text, height=s.height, dxfattribs=at | {"insert": (s.at.real, s.at.imag)})
    low, high = drawing.extent()
    made.header["$EXTMIN"], made.header["$EXTMAX"] = (low.real, low.imag, 0), (high.real, high.imag, 0)
    text = io.StringIO()
    made.write(text)
    # 999: a comment, which every reader skips
    return f"999\n{said}\n{text.getvalue()}".encode()
