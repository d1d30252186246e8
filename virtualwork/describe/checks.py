"""What a description must not say: unknown names, links of zero length, gears that are none."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from virtualwork.describe.errors import DescriptionError, hint
from virtualwork.describe.loads import Force, Spring, Torque
from virtualwork.describe.parts import GROUND, Gear, Guess, Guide, Input, Link

Bodies = Mapping[str, Mapping[str, complex]]


def known(name: str, names: Collection[str], where: str, what: str) -> None:
    """Refuse a name that is none of those known."""
    if name not in names:
        raise DescriptionError(f"{where}: unknown {what} '{name}'{hint(name, names)}")


def refuse(
    links: Mapping[str, Link],
    bodies: Bodies,
    pins: Mapping[str, tuple[str, ...]],
    guides: Sequence[Guide],
    gears: Sequence[Gear],
    inputs: Sequence[Input],
    guess: Guess,
    loads: Mapping[str, Sequence[Force | Torque]],
    springs: Sequence[Spring],
) -> None:
    """Refuse unknown names and impossible sizes, each with its place.

    Raises
    ------
    DescriptionError
    """
    if GROUND in links:
        raise DescriptionError("[links.ground]: 'ground' is the fixed body; give this link another name")
    if not links:
        raise DescriptionError("[links]: the mechanism has no links")
    for name, link in links.items():
        _link(name, link, pins, {g.point for g in guides if g.link == name})
    for i, guide in enumerate(guides, 1):
        _guide(f"[[{'sliders' if guide.is_slider else 'slots'}]] {i} ({guide.point})", guide, bodies)
    for i, gear in enumerate(gears, 1):
        for body in (*gear.links, gear.arm):
            known(body, bodies, f"[[gears]] {i}", "link")
        if gear.ratio == 0 or len({*gear.links, gear.arm}) < 3:
            raise DescriptionError(
                f"[[gears]] {i}: expected two links, an arm that is neither, and a ratio other than 0"
            )
    for i, entry in enumerate(inputs, 1):
        _input("[input]" if len(inputs) == 1 else f"[[input]] {i}", entry, links, bodies, guides)
    if guess.at is not None and len(guess.at) != len(inputs):
        raise DescriptionError(
            f"[guess] at: found {len(guess.at)} values, expected one for each of {len(inputs)} inputs"
        )
    for name in guess.angles:
        known(name, links, f"[guess] {name}", "link or point")
    for table, entries in loads.items():
        for i, load in enumerate(entries, 1):
            known(load.link, links, f"[[{table}]] {i} link", "link")
            if isinstance(load, Force) and isinstance(load.point, str):
                what = f"point of link {load.link}"
                known(load.point, bodies[load.link], f"[[{table}]] {i} point", what)
    for i, spring in enumerate(springs, 1):
        for body, point in spring.between:
            known(body, bodies, f"[[springs]] {i} between", "link")
            if isinstance(point, str):
                known(point, bodies[body], f"[[springs]] {i} between", f"point of {body}")


def _link(name: str, link: Link, pins: Collection[str], guided: Collection[str]) -> None:
    seen: dict[complex, str] = {}
    for point, z in link.points.items():
        if not (abs(z) < float("inf")):
            raise DescriptionError(f"[links.{name}] points.{point}: found {z}, expected finite coordinates")
        shared = point in pins or point in guided
        if z in seen and shared and seen[z] in pins:
            raise DescriptionError(
                f"[links.{name}] points: {seen[z]} and {point} are both joints at the same place: "
                "a link of zero length; pin the links at one point name instead"
            )
        if shared:
            seen[z] = point
    if link.mass < 0 or link.inertia < 0:
        raise DescriptionError(f"[links.{name}]: mass and inertia must not be negative")


def _guide(where: str, guide: Guide, bodies: Bodies) -> None:
    known(guide.link, bodies, where + " link", "link")
    known(guide.on, bodies, where + " on", "link")
    owner = GROUND if guide.link == GROUND else f"link {guide.link}"
    known(guide.point, bodies[guide.link], where + " point", f"point of {owner}")
    if isinstance(guide.through, str):
        known(guide.through, bodies[guide.on], where + " through", f"point of {guide.on}")
    if guide.link == guide.on:
        raise DescriptionError(f"{where}: link '{guide.link}' cannot be guided by itself")


def _input(where: str, entry: Input, links: Collection[str], bodies: Bodies, guides: Sequence[Guide]) -> None:
    names = [guide.point for guide in guides]
    if (entry.link is None) == (entry.slider is None):
        raise DescriptionError(f"{where}: expected either a link or a slider")
    if entry.slider is None:
        known(str(entry.link), links, where + " link", "link")
        known(entry.on, bodies, where + " on", "link")
        return
    known(entry.slider, names, where + " slider", "slot or slider")
    if names.count(entry.slider) > 1:
        raise DescriptionError(f"{where} slider: '{entry.slider}' runs in more than one guide")
