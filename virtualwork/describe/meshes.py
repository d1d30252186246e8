"""Parts that tie turns and slides to each other without slip: gears, belts and chains, racks.

Each is one linear relation Σ c·x = const between angles of bodies and slides of guides; the constant is that of the guess.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Literal

from dalembert.dataclass import dataclass
from virtualwork.describe import DescriptionError
from virtualwork.describe.file import GROUND
from virtualwork.describe.forms import Body, Flag, Lengths, RackPoint, Scalar, TwoBodies
from virtualwork.describe.keys import Part, declared

# the angle of a body by its name, the slide of a guide by its number
Coordinate = str | int


@dataclass(frozen=True)
class Mesh:
    """A linear relation Σ c·x = const of a gear, a belt or a rack.

    Attributes
    ----------
    kind : str
    label : str
        How messages call it.
    shares : dict of coordinate to c
        The angle of a body by its name, a slide by the number of its guide.
    rack : Rack or None
    guide : int or None
        The guide along which a rack moves.
    """

    kind: Literal["gear", "belt", "rack"]
    label: str
    shares: Mapping[Coordinate, float]
    rack: Rack | None = None
    guide: int | None = None

    @property
    def wheel(self) -> str:
        """The toothed wheel of a rack; empty of others."""
        return "" if self.rack is None else self.rack.gear

    @property
    def torques(self) -> dict[str, float]:
        """The shares of bodies alone: how a rack's tooth force, or a gear's torque, turns each of them."""
        return {body: c for body, c in self.shares.items() if isinstance(body, str)}


def shares_of(first: str, second: str, arm: str, ratio: Any) -> dict[Coordinate, Any]:
    """The share c of each body in Σ c·θ = const; the arm has none where the two links turn alike.

    >>> shares_of("sun", "planet", "arm", -0.5)
    {'planet': 1.0, 'sun': 0.5, 'arm': -1.5}
    """
    shares: dict[Coordinate, Any] = {second: 1.0, first: -ratio, arm: ratio - 1.0}
    return {body: c for body, c in shares.items() if c != 0}


def _refuse_few(where: str, links: tuple[str, str], arm: str) -> None:
    """Refuse a gear or a belt on fewer than three bodies."""
    if len({*links, arm}) < 3:
        raise DescriptionError(
            f"{where}: found the links {' and '.join(links)} and the arm {arm}, expected two links and an arm that is neither"
        )


@dataclass(frozen=True)
class Gear(Part):
    """Two toothed links: (ω_b − ω_arm) = ratio·(ω_a − ω_arm); an external mesh has a negative ratio."""

    tables: ClassVar = ("gears",)
    collection: ClassVar = "gears"

    links: tuple[str, str] = declared(TwoBodies(), "the two toothed links")
    ratio: float = declared(Scalar("number"), "speed of the second over that of the first, against the arm")
    arm: str = declared(Body(), "the link that carries both", default=GROUND)

    def check(self, where: str) -> None:
        _refuse_few(where, self.links, self.arm)
        if self.ratio == 0:
            raise DescriptionError(f"{where} ratio: found 0, expected a ratio other than 0")

    @property
    def mesh(self) -> Mesh:
        """Its relation."""
        return Mesh("gear", f"gear {'-'.join(self.links)}", shares_of(*self.links, self.arm, self.ratio))


@dataclass(frozen=True)
class Belt(Part):
    """A belt or a chain around two links: r_a (ω_a − ω_arm) = ± r_b (ω_b − ω_arm), minus if it is crossed."""

    tables: ClassVar = ("belts",)
    collection: ClassVar = "belts"

    links: tuple[str, str] = declared(TwoBodies(), "the two links that it runs around")
    radii: tuple[float, float] = declared(Lengths(2), "their pitch radii")
    crossed: bool = declared(
        Flag(), "whether it crosses between them: they turn in opposite senses", default=False
    )
    arm: str = declared(Body(), "the link that carries both", default=GROUND)

    def check(self, where: str) -> None:
        _refuse_few(where, self.links, self.arm)
        for radius in self.radii:
            if not radius > 0:
                raise DescriptionError(f"{where} radii: found {radius:g} m, expected a radius above zero")

    @property
    def ratio(self) -> float:
        """Speed of the second over that of the first, against the arm."""
        first, second = self.radii
        ratio = first / second
        return -ratio if self.crossed else ratio

    @property
    def mesh(self) -> Mesh:
        """Its relation."""
        return Mesh("belt", f"belt {'-'.join(self.links)}", shares_of(*self.links, self.arm, self.ratio))


@dataclass(frozen=True)
class Rack(Part):
    """A toothed wheel and a rack: the slide of `slider` grows by radius·(θ_gear − θ_on), `on` the body of its guide.

    Seen along the slide the wheel stands on the left of a rack of positive radius: its lowest tooth moves with the rack.
    Where `gear` itself is the link of the slot, the wheel rolls along a rack of the body `on`.
    """

    tables: ClassVar = ("racks",)
    collection: ClassVar = "racks"

    gear: str = declared(Body(ground=False), "the toothed wheel")
    slider: str = declared(RackPoint(), "the point of the slider or slot that moves with it")
    radius: float = declared(
        Scalar("length"), "its pitch radius: the slide moves by radius times the turn of the wheel"
    )

    def check(self, where: str) -> None:
        if self.radius == 0:
            raise DescriptionError(f"{where} radius: found 0, expected a radius other than zero")

    def mesh_on(self, guide: int, on: str) -> Mesh:
        """Its relation, with the guide along which it moves."""
        shares: dict[Coordinate, Any] = {self.gear: -self.radius, on: self.radius, guide: 1.0}
        return Mesh("rack", f"rack {self.gear}-{self.slider}", shares, self, guide)
