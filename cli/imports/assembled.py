"""An imported mechanism put together: does it stand where it is drawn, and where nothing is drawn, how does it stand?"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator, Sequence
from itertools import chain

import numpy as np

from cli.imports.drawn import GROUND, Drawing
from cli.imports.inputs import fit
from cli.imports.toml import text
from virtualwork import Mechanism
from virtualwork.describe import MechanismError
from virtualwork.motion import Motion

# degrees of an input that says nothing of where it begins
TRIED = tuple(range(0, 360, 15))
# how far from its drawn place a point may stand, of the drawing's size: rounding, magnified near change points
NEAR = 1e-9
# a little way of an input: rad, or of the mechanism's size
LITTLE = 1e-3


def described(d: Drawing, source: str) -> str:
    """Return the TOML text of a drawing, and note on the drawing what does not hold."""
    if d.spare:
        fit(d)
    if not d.posed:
        _seek(d, source)
    made = text(d, source)
    try:
        m = Mechanism.from_toml_text(made)
        warnings = m.assembly.warnings
        motion = _motion(m, d)
        if not motion.assembled.all():
            d.notes.append("it cannot be assembled as it is drawn")
            return made
        d.notes += warnings
        # a little way to one side of the drawn pose at least
        ways = [m.size * LITTLE if e.slide is not None else LITTLE for e in d.drives]
        if not _motion(m, d, *([side * way for way in ways] for side in (-1, 1))).assembled.any():
            d.notes.append(
                "its input moves to neither side of the drawn pose: it stands at a limit there, or where assemblies meet"
            )
        if d.posed:
            off, point = max(_gaps(d, motion), default=(0.0, ""))
            if not off <= NEAR * m.size:
                d.notes.append(
                    f"{point} stands {off:.3g} m from where it is drawn: singular there, or nearly"
                )
    except (MechanismError, np.linalg.LinAlgError) as error:
        d.notes.append(f"`dalembert mechanism` will refuse it: {error}")
    return made


def _motion(m: Mechanism, d: Drawing, *ways: Sequence[float]) -> Motion:
    """Return the motion of poses that stand so far from the drawn one; of that itself where none is given."""
    at = np.array([e.at for e in d.drives])
    inputs = at + np.array(ways) if ways else at[None]
    return m.motion(inputs if len(at) > 1 else inputs[:, 0])


def _gaps(d: Drawing, motion: Motion) -> Iterator[tuple[float, str]]:
    """Yield how far each point stands from its drawn place."""
    for name, body in d.bodies.items():
        turned = cmath.rect(1.0, body.turn)
        for point, z in body.points.items() if name != GROUND else ():
            x, y = motion.point(point).position[0]
            drawn = complex(*map(float, body.at)) + complex(*map(float, z)) * turned
            yield abs(complex(x, y) - drawn * d.metres), point


def _seek(d: Drawing, source: str) -> None:
    """Set the angles of bodies that no file places: the assembly nearest to all of them 0, at the input's own value.

    Where nothing closes there, the input is tried all around.
    """
    why = ""
    turns = chain(
        [0.0], (math.radians(t) for t in TRIED[1:]) if d.drives and d.drives[0].slide is None else ()
    )
    start = [e.at for e in d.drives]
    for turn in turns:
        for e, at in zip(d.drives, start, strict=True):
            e.at = at if turn == 0 else turn
        for e in d.drives:
            if e.link is not None and e.on == GROUND:
                d.bodies[e.link].turn = e.at
        try:
            m = Mechanism.from_toml_text(text(d, source))
            motion = _motion(m, d)
            if not motion.assembled.all() or m.assembly.warnings:
                continue
            for name, body in d.bodies.items():
                if name != GROUND:
                    angle = float(motion.link(name).angle[0])
                    body.turn = math.remainder(angle, 2 * math.pi)
        except (MechanismError, np.linalg.LinAlgError) as error:
            why = why or str(error)
            continue
        if turn:
            d.notes.append(f"no assembly at the input's own value: it begins at {math.degrees(turn):g} deg")
        d.notes.append(
            "the file does not say where its bodies stand: the assembly nearest to all angles 0 is taken"
        )
        return
    for e, at in zip(d.drives, start, strict=True):
        e.at = at
    d.notes.append(f"no assembly was found{': ' + why if why else ''}")
