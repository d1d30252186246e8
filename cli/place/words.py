"""What is said of placed masses."""

from __future__ import annotations

from collections.abc import Sequence

from cli.place.solve import Placing
from cli.read.units import degrees, from_si
from cli.show.text import angle_text

METHOD = (
    "Without limits the two places beside the correction share it by the sine rule; with limits the places nearest to it are "
    "filled first (least total mass, by linear programming duality); weights from stock by the choice of least error, all "
    "choices compared."
)


def _action(found: Sequence[Placing]) -> str:
    return "REMOVE" if found[0].request.removes else "ADD"


def notes(found: Sequence[Placing]) -> str:
    """Say what is to be reached."""
    if len(found) > 1:
        lines = [f"{placing.of.name}: {_vector(placing, placing.target)}" for placing in found]
        return "\n".join([*lines, f"angles counter-clockwise; material to {_action(found)}:"])
    (alone,) = found
    lines = [f"correction: {_vector(alone, alone.target)} (angles counter-clockwise)"]
    if alone.request.ratio != 1:
        lines.append(f"at the other radius: {alone.text(abs(alone.target) * alone.request.ratio)}")
    for share in alone.shares:
        if share.z is not None:
            z = from_si(share.z, "length", "mm")
            lines.append(f"in the plane z = {z:g} mm: {_vector(alone, share.goal)}")
    return "\n".join([*lines, f"material to {_action(found)}:"])


def errors(found: Sequence[Placing]) -> str:
    """Say what is missed."""
    lines = []
    for placing in found:
        whole = max(abs(share.goal) for share in placing.shares)
        part = f" ({abs(placing.error) / whole:.3%} of the correction)" if whole else ""
        name = f"{placing.of.name}: " if len(found) > 1 else ""
        lines.append(f"{name}error: {_vector(placing, placing.error)}{part}")
    return "\n".join(lines)


def _vector(found: Placing, vector: complex) -> str:
    return f"{found.text(abs(vector))} at {angle_text(degrees(vector), '.4g')}°"
