"""What is said of placed masses."""

from __future__ import annotations

from collections.abc import Sequence

from cli.place.corrections import Correction
from cli.place.solve import Placing
from cli.read.units import degrees, from_si
from cli.show.text import angle_text

METHOD = (
    "Without limits the two places beside the correction share it by the sine rule; with limits the places nearest to it are "
    "filled first (least total mass, by linear programming duality); weights from stock by the choice of least error, all "
    "choices compared."
)


def notes(found: Placing) -> str:
    """Say what is to be reached."""
    lines = [f"correction: {_vector(found, found.target)} (angles counter-clockwise)"]
    if found.request.ratio != 1:
        lines.append(f"at the other radius: {found.text(abs(found.target) * found.request.ratio)}")
    for share in found.shares:
        if share.z is not None:
            z = from_si(share.z, "length", "mm")
            lines.append(f"in the plane z = {z:g} mm: {_vector(found, share.goal)}")
    return "\n".join([*lines, f"material to {'REMOVE' if found.request.removes else 'ADD'}:"])


def several(found: Sequence[tuple[Correction, Placing]]) -> str:
    """Say what is to be reached of each correction."""
    if len(found) == 1:
        return notes(found[0][1])
    lines = [f"{of.name}: {_vector(placing, placing.target)}" for of, placing in found]
    action = "REMOVE" if found[0][1].request.removes else "ADD"
    return "\n".join([*lines, f"angles counter-clockwise; material to {action}:"])


def error(found: Placing) -> str:
    """Say what is missed."""
    whole = max(abs(share.goal) for share in found.shares)
    part = f" ({abs(found.error) / whole:.3%} of the correction)" if whole else ""
    return f"error: {_vector(found, found.error)}{part}"


def errors(found: Sequence[tuple[Correction, Placing]]) -> str:
    """Say what is missed of each correction."""
    if len(found) == 1:
        return error(found[0][1])
    return "\n".join(f"{of.name}: {error(placing)}" for of, placing in found)


def _vector(found: Placing, vector: complex) -> str:
    return f"{found.text(abs(vector))} at {angle_text(degrees(vector), '.4g')}°"
