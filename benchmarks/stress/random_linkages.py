"""Random mechanisms for the campaigns, anywhere or at a distance from where they are singular."""

from __future__ import annotations

import math

import numpy as np

from virtualwork import Gear, Guess, Guide, Input, Link, Mechanism

Generator = np.random.Generator


def four_bar(rng: Generator, at: float, scale: float, *, limit: bool = False) -> tuple[Mechanism, float]:
    """A four-bar at an input angle; with `limit`, where its input ends: the coupler and the rocker in line."""
    a, b, c, d = (float(x) for x in scale * 10.0 ** rng.uniform(-0.4, 0.4, 4))
    if limit:
        reach = b + c if rng.random() < 0.5 else abs(b - c)
        cosine = (a * a + d * d - reach * reach) / (2 * a * d)
        if abs(cosine) >= 1:
            return four_bar(rng, at, scale, limit=True)
        at = math.acos(cosine) + (-at if reach == b + c else at)
    base = d - a * complex(math.cos(at), math.sin(at))
    s = abs(base)
    if not abs(b - c) < s < b + c:
        return four_bar(rng, at, scale)
    along = (s * s + b * b - c * c) / (2 * s)
    pin = base / s * complex(along, rng.choice([-1, 1]) * math.sqrt(max(b * b - along * along, 0.0)))
    angles = {"coupler": float(np.angle(pin)), "rocker": float(np.angle(pin - base))}

    def link(name: str, other: str, length: float) -> Link:
        mass = float(rng.uniform(0.5, 2))
        center = length * complex(rng.uniform(0, 1), rng.uniform(-0.3, 0.3))
        return Link({name: 0j, other: length}, mass, center, mass * length**2 * float(rng.uniform(0.05, 0.3)))

    return (
        Mechanism(
            ground={"A": 0j, "D": d},
            links={"crank": link("A", "B", a), "coupler": link("B", "C", b), "rocker": link("D", "C", c)},
            inputs=Input(link="crank"),
            guess=Guess(at=at, angles=angles),
            gravity=complex(rng.normal(), rng.normal()) * scale,
        ),
        at,
    )


def slider_crank(rng: Generator, near: float, scale: float) -> tuple[Mechanism, float]:
    """A slider-crank whose rod is nearly square to the guide, or driven at its piston nearly at a dead centre."""
    rod = float(rng.uniform(0.5, 0.8))
    lift, side = float(rng.uniform(-0.2, 0.15)), float(rng.choice([-1, 1]))
    end = math.asin(lift + rod)  # the crank of length 1: sin(at) − lift = rod
    slide = rng.random() < 0.5
    if slide:
        long = rod + 1
        reach = math.sqrt(long**2 - lift**2)
        at, crank = reach * (1 - near), math.atan2(lift, reach)
        tilt = math.sqrt(2 * near) * side
        angles = {"crank": crank + tilt, "rod": crank - tilt / rod}
        given = Input(slider="C")
    else:
        at = end - near
        angles = {"rod": math.asin(max(-1.0, (lift - math.sin(at)) / rod))}
        if side < 0:
            angles["rod"] = math.pi - angles["rod"]
        given = Input(link="crank")
    scaled = Mechanism(
        ground={"A": 0j},
        links={
            "crank": Link({"A": 0j, "B": scale}),
            "rod": Link({"B": 0j, "C": rod * scale}),
            "piston": Link({"C": 0j}),
        },
        guides=[Guide("C", "piston", through=1j * lift * scale, turned=0.0)],
        inputs=given,
        guess=Guess(at=at * scale if slide else at, angles=angles),
    )
    return scaled, at * scale if slide else at


def turning_block(rng: Generator, near: float, scale: float) -> tuple[Mechanism, float]:
    """An inverted slider-crank: a block on the crank pin runs along a bar, off its pivot; near where it cannot reach."""
    off = float(rng.uniform(0.2, 0.9))
    d = float(rng.uniform(1.1, 1.8))
    low = d - 1.0
    if not low < off < d + 1:
        off = 0.5 * (low + d + 1)
    cosine = (1 + d * d - off * off) / (2 * d)
    end = math.acos(max(-1.0, min(1.0, cosine)))  # the pin's distance from the pivot is the offset
    at = end + near
    pin = complex(math.cos(at), math.sin(at)) - d
    run = math.sqrt(max(abs(pin) ** 2 - off**2, 0.0)) * float(rng.choice([-1, 1]))
    bar = float(np.angle(pin / complex(run, off)))
    return (
        Mechanism(
            ground={"A": 0j, "D": d * scale},
            links={"crank": Link({"A": 0j, "B": scale}), "bar": Link({"D": 0j})},
            guides=[Guide("B", "crank", on="bar", through=1j * off * scale)],
            inputs=Input(link="crank"),
            guess=Guess(at=at, angles={"bar": bar}),
        ),
        at,
    )


def triad(rng: Generator, near: float, scale: float) -> tuple[Mechanism, float]:
    """A Stephenson six-bar, its triad's three legs nearly through one point: no closed form, nearly singular."""
    corners = rng.normal(size=3) + 1j * rng.normal(size=3)
    meet = complex(rng.normal(), rng.normal())
    lengths = rng.uniform(0.5, 2, 3) * rng.choice([-1, 1], 3)
    feet = corners + lengths * (meet - corners) / np.abs(meet - corners)
    at = float(rng.uniform(-3, 3))
    crank = float(rng.uniform(0.3, 1))
    foot = feet[0] - crank * complex(math.cos(at), math.sin(at))

    def line(p: complex, q: complex) -> float:
        return float(np.angle(q - p))

    legs = {f"leg{i + 1}": line(feet[i], corners[i]) for i in range(3)}
    own = (corners - corners[0]) * np.exp(-1j * line(corners[0], corners[1]))
    at += near
    return (
        Mechanism(
            ground={"A": scale * foot, "F2": scale * feet[1], "F3": scale * feet[2]},
            links={
                "crank": Link({"A": 0j, "F1": scale * crank}),
                **{
                    f"leg{i + 1}": Link({f"F{i + 1}": 0j, f"C{i + 1}": scale * abs(corners[i] - feet[i])})
                    for i in range(3)
                },
                "plate": Link({f"C{i + 1}": scale * own[i] for i in range(3)}),
            },
            inputs=Input(link="crank"),
            guess=Guess(at=at, angles=legs | {"plate": line(corners[0], corners[1])}),
        ),
        at,
    )


def geared_five_bar(rng: Generator, at: float, scale: float) -> Mechanism | None:
    """A five-bar whose second crank is geared to the first, −1/3 or ±1 or 2."""
    ratio = float(rng.choice([-1 / 3, -1.0, 1.0, 2.0]))
    a, b, c, e, d = (
        scale * rng.uniform(*span) for span in [(0.2, 0.5), (1, 2), (1, 2), (0.2, 0.5), (0.6, 1.4)]
    )
    start = float(rng.uniform(-3, 3))
    first = a * complex(math.cos(at), math.sin(at))
    second = d + e * complex(math.cos(start), math.sin(start))
    base = second - first
    s = abs(base)
    if not 1.05 * abs(b - c) < s < 0.95 * (b + c):
        return None
    along = (s * s + b * b - c * c) / (2 * s)
    pin = base / s * complex(along, math.sqrt(b * b - along * along))
    angles = {"second": start, "left": float(np.angle(pin)), "right": float(np.angle(pin - base))}
    return Mechanism(
        ground={"A": 0j, "E": d},
        links={
            "first": Link({"A": 0j, "B": a}),
            "second": Link({"E": 0j, "D": e}),
            "left": Link({"B": 0j, "C": b}),
            "right": Link({"D": 0j, "C": c}),
        },
        gears=[Gear(("first", "second"), ratio)],
        inputs=Input(link="first"),
        guess=Guess(at=at, angles=angles),
    )
