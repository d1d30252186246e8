"""The ledger of virtual power as a topic of the way: force, velocity, torque, omega and power of every load."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dalembert.results.columns import Column, Table, listed, names
from dalembert.results.way import Topic, figures, vector_text

if TYPE_CHECKING:
    from virtualwork.motion import Motion
    from virtualwork.study.ledger import Item

PERPENDICULAR, REST, PAIR = "perpendicular to the displacement", "at rest", "pair"
"""Why a force does no work (Riul, unit II, eq. 2 and what follows it)."""
TINY = 1e-13
"""A power below this share of load times largest velocity is rounding."""
SYMBOLS = {"weight": "W", "inertia force": "Fi", "inertia torque": "Ti"}


def of_link(letter: str, link: str) -> str:
    """Return a letter with the link that it belongs to.

    >>> of_link("ω", "3"), of_link("ω", "coupler")
    ('ω3', 'ω(coupler)')
    """
    return f"{letter}{link}" if len(link) < 3 else f"{letter}({link})"


class Entry(NamedTuple):
    """A load at an instant: a force on a point that moves, or a torque on a link that turns."""

    link: str
    kind: str
    force: complex | None = None
    velocity: complex | None = None
    torque: float | None = None
    omega: float | None = None
    power: float = 0.0
    workless: str | None = None
    field: str = ""
    point: str = ""

    @property
    def symbol(self) -> str:
        """The symbol of the load in an equation: `W3`, `Fi4`, `T2`."""
        return of_link(SYMBOLS.get(self.kind, "F" if self.force is not None else "T"), self.link)

    @property
    def rate(self) -> str:
        """The symbol of the velocity in an equation."""
        return of_link("ω" if self.force is None else "V", self.link)

    def equation(self) -> str:
        """Return the product with its numbers: `W3·V3 = (0, −30)·(300, 200) = −6 000 W`."""
        if self.force is not None and self.velocity is not None:
            f, v = self.force, self.velocity
            product = f"{vector_text(f)}·{vector_text(v)}"
        else:
            omega = figures(self.omega or 0.0)
            product = f"{figures(self.torque or 0.0)}·{f'({omega})' if omega.startswith('−') else omega}"
        return f"{self.symbol}·{self.rate} = {product} = {figures(self.power)} W"


def why_not(rate: complex | float, works: bool, fastest: float) -> str | None:
    """Return why a load does no work; None where it does.

    >>> why_not(5 + 0j, False, 5.0), why_not(0j, False, 5.0), why_not(3.0, True, 3.0)
    ('perpendicular to the displacement', 'at rest', None)
    """
    if works:
        return None
    return REST if abs(rate) <= 1e-13 * fastest or isinstance(rate, float) else PERPENDICULAR


def entries_of(motion: Motion, unit: int | None = None) -> list[list[Entry]]:
    """Return the loads of a mechanism at every pose, none where it is not assembled; `unit`: for a unit speed of that input."""
    from virtualwork.study.ledger import items

    every = items(motion.dynamics, unit)
    with np.errstate(invalid="ignore"):
        speeds = [np.abs(item.rate) for item in every if not item.turns]
        fast = np.max(speeds, axis=0) if speeds else np.zeros(motion.n)
        turns = [np.abs(item.rate) for item in every if item.turns]
        turning = np.max(turns, axis=0) if turns else np.zeros(motion.n)
    several = unit is not None and len(motion.mechanism.inputs) > 1
    field = motion.mechanism.inputs[unit].name if several and unit is not None else ""
    whole = motion.assembled
    return [
        [_entry(item, i, float(turning[i] if item.turns else fast[i]), field) for item in every] if whole[i] else []
        for i in range(motion.n)
    ]  # fmt: skip


def _entry(item: Item, i: int, fastest: float, field: str) -> Entry:
    # no −0
    load, rate, power = item.load[i] + 0.0, item.rate[i] + 0.0, float(item.power[i]) + 0.0
    at_rest = abs(rate) <= TINY * fastest
    if item.workless:
        why: str | None = REST if at_rest and item.workless == PERPENDICULAR else item.workless
    elif at_rest:
        why = REST
    else:
        idle = load != 0 and not item.turns and abs(power) <= TINY * abs(load) * fastest
        why = PERPENDICULAR if idle else None
    if why is not None:
        power = 0.0
    if item.turns:
        return Entry(
            item.link, item.kind, torque=float(load), omega=float(rate), power=power, workless=why, field=field
        )  # fmt: skip
    return Entry(
        item.link, item.kind, complex(load), complex(rate), power=power, workless=why, field=field, point=item.joint
    )  # fmt: skip


def ledger(
    place: str, instants: Sequence[tuple[Sequence[Column], Sequence[Entry]]], before: Sequence[str | Table]
) -> Topic:
    """Make the topic: a list in JSON, below `place`, with the terms of every instant.

    `instants`: the columns (one row) that name an instant, and its loads; `before`: equations above the table.
    """
    heads = [columns for columns, _ in instants]
    every = [(i, entry) for i, (_, entries) in enumerate(instants) for entry in entries]
    pose = Column("instant", "", [str(i) for i in range(len(instants))])
    joined = [
        Column(
            each.name,
            each.unit,
            [columns[k].values[0] for columns in heads],
            place=each.place,
            stored=None if each.stored is None else [columns[k].documented[0] for columns in heads],
        )
        for k, each in enumerate(heads[0] if heads else ())
    ]
    index = Column("instant", "", [str(i) for i, _ in every])
    named = [Column(c.name, c.unit, [heads[i][k].values[0] for i, _ in every]) for k, c in enumerate(joined)]
    pose_headers = [c.header for c in named] if len(instants) > 1 else []
    keys = ("instant", *pose_headers, "link", "kind", "point")
    several = any(entry.field for _, entry in every)
    points = any(entry.point for _, entry in every)
    shown = [
        *(named if len(instants) > 1 else []),
        *([names("field", [e.field or None for _, e in every], None)] if several else []),
        names("link", [e.link for _, e in every], None),
        names("kind", [e.kind for _, e in every], None),
        *([names("point", [e.point or None for _, e in every], None)] if points else []),
        *components("F", "N", [e.force for _, e in every]),
        *components("V", "m_s", [e.velocity for _, e in every]),
        Column("torque", "N_m", [e.torque for _, e in every]),
        Column("omega", "rad_s", [e.omega for _, e in every]),
        Column("power", "W", [e.power for _, e in every]),
        names("workless", [e.workless for _, e in every], None),
    ]
    documented = [
        *([names("field", [e.field for _, e in every])] if several else []),
        names("link", [e.link for _, e in every]),
        names("kind", [e.kind for _, e in every]),
        *([names("point", [e.point or None for _, e in every])] if points else []),
        _vectors("force_N", [e.force for _, e in every]),
        _vectors("velocity_m_s", [e.velocity for _, e in every]),
        names("torque_N_m", [e.torque for _, e in every]),
        names("omega_rad_s", [e.omega for _, e in every]),
        names("power_W", [e.power for _, e in every]),
        names("workless", [e.workless for _, e in every]),
    ]
    return Topic(
        "ledger",
        [
            *before,
            Table([], ["instant"], place, documented=[pose, *joined]),
            Table(shown, keys, f"{place}.terms[]", documented=[index, *documented]),
        ],
        "Ledger of virtual power (Riul, unit II, eqs. 3 to 5)",
    )


def components(letter: str, unit: str, values: Sequence[complex | None]) -> list[Column]:
    """Return the two components of vectors, as they are shown."""
    return [
        Column(f"{letter}{axis}", unit, [None if v is None else getattr(v, part) + 0.0 for v in values])
        for axis, part in (("x", "real"), ("y", "imag"))
    ]


def _vectors(place: str, values: Sequence[complex | None]) -> Column:
    """Return vectors for JSON; null where there is none."""
    stored = [None if v is None else listed(complex(v)) for v in values]
    return Column(place, "", [None] * len(stored), place=place, stored=stored)
