"""The shapes of a mechanism (`virtualwork.drawing`) as poses need them: guides as long as they are used."""

from __future__ import annotations

import numpy as np

from virtualwork.drawing import Drawing, draw
from virtualwork.formulas.poses import Poses


def shapes_of(*motions: Poses) -> Drawing:
    """Return what a mechanism is drawn as, its guides as long as they are used in the poses of all of its motions."""
    m = motions[0].mechanism
    spans = []
    for i in range(len(m.guides)):
        slide = np.concatenate([poses.values([("slide", i, 0)])[0] for poses in motions])
        used = slide[np.isfinite(slide)]
        spans.append((float(used.min()), float(used.max())) if len(used) else (-np.inf, np.inf))
    return draw(m, spans)
