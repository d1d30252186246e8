"""Four-bars as TOML: A and D on the ground, B on the crank, C on the rocker, with what a test adds to them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence


def body(mass: float, center: Sequence[float] = (), inertia: float | str | None = None) -> str:
    """Return the lines of a link's mass, centre of mass and inertia, as far as they are given."""
    lines = [f"mass = {mass}"]
    lines += [f"center = {list(center)}"] if center else []
    if inertia is not None:
        lines.append(f'inertia = "{inertia}"' if isinstance(inertia, str) else f"inertia = {inertia}")
    return "\n".join(lines)


def four_bar(
    crank: str = "",
    coupler: str = "",
    rocker: str = "",
    *,
    lengths: Sequence[float] = (40, 120, 80, 100),
    points: str = "",
    called: str = "coupler",
    head: str = "",
    length: str = "mm",
    driven: str = "crank",
    at: float = 40,
    rates: str = "",
    guess: Mapping[str, float] | None = None,
    more: str = "",
) -> str:
    """Return the text: Norton's example 4-1 where nothing else is said (crank 40, coupler 120, rocker 80, ground 100).

    `crank`, `coupler`, `rocker` are further lines of the links, `head` and `more` stand before and behind all tables;
    `points` are further points of the coupler, and `called` is its name as a key of TOML. `rates` are further lines of
    the input, `guess` the angles at it, degrees.
    """
    a, b, c, d = lengths
    angles = {called: 20, "rocker": 57} if guess is None else guess
    guessed = "\n".join(f"{name} = {angle}" for name, angle in angles.items())
    return f"""
{head}
[units]
length = "{length}"
angle = "deg"
[ground]
A = [0, 0]
D = [{d}, 0]
[links.crank]
points = {{ A = [0, 0], B = [{a}, 0] }}
{crank}
[links.{called}]
points = {{ B = [0, 0], C = [{b}, 0]{points} }}
{coupler}
[links.rocker]
points = {{ D = [0, 0], C = [{c}, 0] }}
{rocker}
[input]
link = "{driven}"
angle = {at}
{rates}
[guess]
at = {at}
{guessed}
{more}
"""
