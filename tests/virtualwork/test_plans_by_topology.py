"""The order of solution is kept by topology: with other numbers it is the one that would be made anew."""

from __future__ import annotations

from dataclasses import fields, replace
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from benchmarks.stress import random_linkages
from benchmarks.stress.topologies import generate
from virtualwork import Guess, Guide, Input, Link, Mechanism
from virtualwork.describe import MobilityError
from virtualwork.plan import order, topology
from virtualwork.plan.steps import Group, Place

EXAMPLES = [
    path
    for path in sorted(Path(str(files("cli"))).glob("examples/*/*.toml"))
    if "[links" in path.read_text(encoding="utf-8")
]


def scaled(m, factor):
    """The same mechanism with every length times a factor."""
    links = {
        name: Link({p: z * factor for p, z in link.points.items()}, link.mass, link.center)
        for name, link in m.links.items()
    }
    guides = [g if isinstance(g.through, str) else replace(g, through=g.through * factor) for g in m.guides]
    ground = {p: z * factor for p, z in m.ground.items()}
    racks = [replace(rack, radius=rack.radius * factor) for rack in m.racks]
    cams = [
        replace(
            cam,
            base_radius=cam.base_radius * factor,
            roller_radius=cam.roller_radius and cam.roller_radius * factor,
            law=tuple(replace(part, rise=part.rise and part.rise * factor) for part in cam.law),
        )
        for cam in m.cams
    ]
    guess = Guess(m.at, m.guess.angles, {p: z * factor for p, z in m.guess.points.items()})
    return Mechanism(ground, links, guides, m.gears, m.inputs, guess, belts=m.belts, racks=racks, cams=cams)


def made_anew(m):
    """The plan of a mechanism, nothing known of its topology."""
    return topology.Topology.of(m, False, {}).filled(lambda asked: order.planned(asked))


def terms(plan):
    """Every term of a plan, in order."""
    for step in plan.steps:
        if isinstance(step, Place):
            yield from step.terms
        elif isinstance(step, Group):
            for loop in step.closures:
                yield from loop.terms
    for _, own in plan.anchors.values():
        yield from own


@pytest.mark.parametrize("of", [*EXAMPLES, *range(40)], ids=lambda of: getattr(of, "stem", str(of)))
def test_a_kept_plan_with_other_numbers_is_the_one_made_anew(of) -> None:
    """The worked examples, and mechanisms of any topology, by their seeds."""
    m = Mechanism.from_toml(of) if isinstance(of, Path) else generate(of).mechanism
    other = scaled(m, 2.0)
    try:
        first = order.plan(m)
    except MobilityError:
        # nothing is kept of what is refused
        with pytest.raises(MobilityError):
            order.plan(other)
        return
    kept = order.plan(other)
    assert kept == made_anew(other)
    # twice as long, every vector is; only the ways of guides have no length
    for one, two in zip(terms(first), terms(kept), strict=True):
        assert (one.body, one.slide) == (two.body, two.slide)
        assert two.z == one.z * (1 if one.slide is not None else 2)


def test_one_topology_is_planned_once(monkeypatch) -> None:
    rng = np.random.default_rng(4)
    first, second = (random_linkages.four_bar(rng, 1.0, 1.0)[0] for _ in range(2))
    order.plan(first)
    monkeypatch.setattr(order.Vector, "of", lambda slot: pytest.fail("planned again"))
    order.plan(second)


def offset_slider(through, wrist):
    """A slider-crank; its wrist pin and its guide may stand at their body's origins, or beside them."""
    return Mechanism(
        ground={"O": 0j},
        links={
            "crank": Link({"O": 0j, "A": 1}),
            "rod": Link({"A": 0j, "B": 3}),
            "piston": Link({"B": wrist}),
        },
        guides=[Guide("B", "piston", through=through, angle=0.0, turned=0.0)],
        inputs=Input("crank"),
        guess=Guess(at=0.5, points={"B": 3.5}),
    )


def test_points_at_one_place_are_another_topology() -> None:
    """What vanishes where two points meet, or one stands at its origin, is in the loops of all others."""
    for through, wrist in ((0j, 0j), (0.2j, 0j), (0j, 0.1 + 0j), (0.2j, 0.1 + 0.3j)):
        m = offset_slider(through, wrist)
        assert order.plan(m) == made_anew(m)
        loop = next(step for step in order.plan(m).steps if isinstance(step, Group)).closures[0]
        assert all(t.z != 0 for t in loop.terms)
        x = m.motion(0.5).point("B").position[0]
        lift = through.imag
        assert x[0] == pytest.approx(np.cos(0.5) + np.sqrt(9 - (np.sin(0.5) - lift) ** 2), rel=1e-14)
        assert x[1] == pytest.approx(lift, abs=1e-14)


def test_the_angle_of_a_slider_is_told_apart() -> None:
    upright = Mechanism(
        ground={"O": 0j},
        links={"crank": Link({"O": 0j, "A": 1}), "rod": Link({"A": 0j, "B": 3}), "piston": Link({"B": 0j})},
        guides=[Guide("B", "piston", angle=np.pi / 2, turned=0.0)],
        inputs=Input("crank"),
        guess=Guess(at=0.5, points={"B": 3.5j}),
    )
    assert upright.motion(0.5).point("B").position[0] == pytest.approx(
        [0.0, np.sin(0.5) + np.sqrt(9 - np.cos(0.5) ** 2)], abs=1e-14
    )
    flat = order.plan(offset_slider(0j, 0j))
    assert order.plan(upright).angles["piston"].const == np.pi / 2 != flat.angles["piston"].const
    assert {f.name for f in fields(topology.Topology) if f.compare} == {
        "bodies",
        "guides",
        "inputs",
        "merged",
    }
