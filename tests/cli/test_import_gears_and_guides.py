"""Linkage files as its users draw them: planets on planets, motors at held gears, pins in two guides, ids used twice, many links."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import pytest

from tests.cli.imported import only, taken
from virtualwork.branch.track import Track

MM = 25.4e-3 / 96
MOTOR = 'anchor="true" input="true" rpm="10"'
ANCHOR = 'anchor="true"'


def pin(number: int, x: float, y: float, more: str = "", inside: str = "") -> str:
    return f'<connector id="{number}" x="{x}" y="{y}" {more}>{inside}</connector>'


def slider(number: int, x: float, y: float, a: int, b: int, more: str = "") -> str:
    return pin(number, x, y, f'slider="true" {more}', f'<slidelimit id="{a}"/><slidelimit id="{b}"/>')


def link(number: int, *pins: int, more: str = "") -> str:
    return f'<Link id="{number}" {more}>' + "".join(f'<connector id="{k}"/>' for k in pins) + "</Link>"


def mesh(a: int, b: int, sizes: tuple[float, float], kind: str = "gears") -> str:
    return (
        f'<ratio type="{kind}"><link id="{a}" size="{sizes[0]}"/><link id="{b}" size="{sizes[1]}"/></ratio>'
    )


def drawing(parts: Iterable[str], meshes: Iterable[str] = ()) -> str:
    inside = "\n".join([*parts, "<ratios>", *meshes, "</ratios>"])
    return f'<linkage2><program units="Millimeters"/>\n{inside}</linkage2>'


GEAR = 'gear="true"'
# a driven arm with a planet on it, its sun held by a second anchor
PLANET = [
    pin(0, 0, 0, MOTOR),
    pin(1, 100, 0),
    pin(2, 150, 0),
    pin(9, 300, 0, ANCHOR),
    link(0, 0, 1),
    link(1, 0, 9, more=GEAR),
]


@pytest.mark.parametrize("ratio", [0.5, 2.0, 8.0])
def test_a_planet_on_a_planet(ratio: float) -> None:
    """Its sun is the first arm; Willis twice: ω₂ = 1 + r, ω₃ = ω₂ + s (ω₂ − 1)."""
    parts = [*PLANET, link(2, 1, 2, more=GEAR), link(3, 2, more=GEAR)]
    motion = only(drawing(parts, [mesh(1, 2, (ratio, 1)), mesh(0, 3, (3, 1))])).motion(0.2, speed=1.0)
    assert motion.link("L2").omega[0] == pytest.approx(1 + ratio, rel=1e-14)
    assert motion.link("L3").omega[0] == pytest.approx(1 + ratio + 3 * ratio, rel=1e-14)


@pytest.mark.parametrize("turned", [False, True])
def test_a_gear_carried_by_the_gear_that_it_meshes_with_turns_with_it(turned: bool) -> None:
    """(ω₃ − ω₂) = ratio (ω₂ − ω₂) = 0, in whichever order the file names them."""
    parts = [*PLANET, link(2, 1, 2, more=GEAR), pin(3, 180, 40), link(3, 2, 3, more=GEAR)]
    pair = mesh(3, 2, (1, 2)) if turned else mesh(2, 3, (2, 1))
    (m,), notes = taken(drawing(parts, [mesh(1, 2, (2, 1)), pair]))
    assert any("L2 carries the centre of L3" in note for note in notes)
    assert "L3" not in m.links
    z = m.motion(m.at[0] + 0.3).point("C3").position[0] @ [1, 1j] / MM
    arm, planet = np.exp(0.3j), np.exp(0.9j)
    assert z == pytest.approx(100 * arm + (80 + 40j) * planet, rel=1e-12)


@pytest.mark.parametrize("fasten", ['fastenconnector="5"', 'fastenlink="7"'])
def test_a_gear_that_is_fastened_to_the_ground_stands_still_at_a_motor(fasten: str) -> None:
    """A chain of 1:1 from a held wheel keeps a wheel on the arm parallel; a planet of 8:1 meshes with that."""
    parts = [
        pin(0, 0, 0, MOTOR),
        pin(1, 100, 0),
        pin(2, 160, 0),
        pin(3, 190, 20),
        pin(5, -40, 0, ANCHOR),
        pin(6, -40, 60, ANCHOR),
        link(0, 0, 1, 2),
        link(1, 0, more=f"{GEAR} {fasten}"),
        link(2, 1, more=GEAR),
        link(3, 2, 3, more=GEAR),
        link(7, 5, 6),
    ]
    m = only(drawing(parts, [mesh(1, 2, (1, 1), "chain"), mesh(2, 3, (8, 1))]))
    motion = m.motion(0.1, speed=1.0)
    assert m.inputs[0].link == "L0"
    assert motion.link("L2").omega[0] == pytest.approx(0, abs=1e-15)
    assert motion.link("L3").omega[0] == pytest.approx(9, rel=1e-14)


def test_an_actuator_at_a_pin_in_a_guide() -> None:
    """The pin of a rod runs in a slot of the ground, and an actuator at an anchor drives it: the pin has a shoe there."""
    parts = [
        pin(0, 0, 69, ANCHOR),
        slider(1, 110, 0, 3, 4),
        pin(2, 220, 65),
        pin(3, 40, 0, ANCHOR),
        pin(4, 180, 0, ANCHOR),
        pin(5, 230, 100, ANCHOR),
        link(0, 0, 1, more='actuator="true" throw="20"'),
        link(1, 2, 1),
        link(3, 5, 2),
    ]
    (m,), notes = taken(drawing(parts))
    assert not any("refuse" in note or "internal" in note for note in notes)
    long = math.hypot(110, 69)
    # 15 cycles a minute where the file names none
    assert m.inputs[0].speed == pytest.approx(2 * 20 * 15 / 60 * MM, rel=1e-14)
    for way in (-6.0, 0.0, 6.0):
        z = m.motion(way * MM).point("C1").position[0] / MM
        assert z == pytest.approx([math.sqrt((long + way) ** 2 - 69**2), 0], abs=1e-10)


def test_links_of_one_id_are_links_each() -> None:
    parts = [
        pin(0, 0, 0, MOTOR),
        pin(1, 0, 90),
        pin(2, 200, 160),
        pin(3, 250, 0, ANCHOR),
        pin(3, 900, 0, ANCHOR),
        link(0, 0, 1),
        link(0, 1, 2),
        link(0, 2, 3),
    ]
    (m,), notes = taken(drawing(parts))
    assert len(m.links) == 3
    assert any("second connector 3" in note for note in notes)
    a, b = (m.motion(0.4).point(p).position[0] for p in ("C1", "C2"))
    assert math.dist(a, b) == pytest.approx(math.hypot(200, 70) * MM, rel=1e-12)


def test_what_a_motor_or_an_actuator_does_not_keep_is_named() -> None:
    parts = [
        pin(0, 0, 0, f'{MOTOR} limitangle="30"'),
        pin(1, 0, 90),
        pin(2, 200, 160),
        pin(3, 250, 0, ANCHOR),
        pin(4, 220, 80),
        link(0, 0, 1),
        link(1, 1, 2),
        link(2, 2, 4, 3, more='actuator="true" throw="9"'),
    ]
    (m,), notes = taken(drawing(parts))
    assert len(m.links) == 3
    assert any("the limit of input C0" in note for note in notes)
    assert any("actuator L2" in note and "keeps its length" in note for note in notes)


def scissors(cells: int) -> str:
    """Cells of a scissors lift, the first of them in a slot, driven by a crank."""
    parts = [pin(0, 0, 0, ANCHOR), slider(1, 0, 100, 4, 5)]
    parts += [pin(2, -200, 100, MOTOR), pin(3, -180, 120), pin(4, 0, -300, ANCHOR), pin(5, 0, 400, ANCHOR)]
    parts += [link(0, 2, 3), link(1, 3, 1)]
    a, b, n = 0, 1, 6
    for k in range(cells):
        parts += [
            pin(n, (k + 0.5) * 120, 50),
            pin(n + 1, (k + 1) * 120, 0),
            pin(n + 2, (k + 1) * 120, 100),
        ]
        parts += [link(2 * k + 2, a, n, n + 2), link(2 * k + 3, b, n, n + 1)]
        a, b, n = n + 1, n + 2, n + 3
    return drawing(parts)


def test_loops_are_closed_as_often_for_each_of_many_links(monkeypatch: pytest.MonkeyPatch) -> None:
    """Not again for every group that stands behind them: twice the links are twice the work, not four times."""
    calls = 0
    close = Track.close

    def counted(*args: object) -> None:
        nonlocal calls
        calls += 1
        close(*args)  # type: ignore[arg-type]

    monkeypatch.setattr(Track, "close", counted)
    counts = []
    for cells in (6, 12):
        calls = 0
        m = only(scissors(cells))
        counts.append(calls)
        ends = m.motion(0.05).point(f"C{4 + 3 * cells}").position[0]
        # all cells are one parallelogram: the row goes on evenly
        first = m.motion(0.05).point("C7").position[0]
        assert ends == pytest.approx(cells * first, rel=1e-9)
    assert counts[1] < 2.5 * counts[0]


@pytest.mark.parametrize(("y", "sense"), [(-20, 1), (20, -1)])
def test_a_rack_of_pmks_moves_with_its_wheel(y: int, sense: int) -> None:
    text = f"ground wheel R 0 0 tfff\nground rack P 30 {y} 0\nwheel rack G 0 {y}\nrack tip R 40 {y}\n"
    m = only(text)
    (rack,) = m.racks
    assert (rack.gear, rack.radius) == ("wheel", sense * 20)
    motion = m.motion(0.3, speed=2.0)
    assert motion.slide(rack.slider).speed == pytest.approx(sense * 40)
    # it stands where it is drawn
    assert m.motion(0.0).point(rack.slider).position[0] == pytest.approx([30, y])
