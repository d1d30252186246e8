"""The worked solution of `dalembert balance`: components and sums, moments about a plane, forces (Riul, eqs. 6 to 21); modal sums."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cli.balance.rotors import Balancing
from dalembert.angles import degrees, in_turn
from dalembert.arithmetic.exact import EPS
from dalembert.results.columns import Column, Table, names, number
from dalembert.results.way import Topic, figures
from dalembert.units import from_si

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from matplotlib.figure import Figure

    from balancing import Correction, ModalCorrection


COMPONENTS = ("x", "y", "zx", "zy")
SHOWN = 6
"""The largest number of terms of a sum in the text."""


class Scale:
    """How the equations show an unbalance: as the document does, W·r in N·mm or lbf·in where the table has weights."""

    def __init__(self, b: Balancing) -> None:
        unit = b.rotors.unbalance_unit
        self.length = b.length_unit
        self.letter = "m"
        if b.rotors.weight_unit:
            self.letter = "W"
            length = self.length if self.length in ("mm", "m", "in") else "mm"
            self.length, self.name = length, f"{b.rotors.weight_unit}·{length}"
            self.factor = float(from_si(b.request.gravity, "force", b.rotors.weight_unit)) * float(
                from_si(1.0, "length", length)
            )
        else:
            self.name, self.factor = unit.replace("_", "·"), float(from_si(1.0, "unbalance", unit))
        self.reach = float(from_si(1.0, "length", self.length))

    def of(self, value: float) -> str:
        return figures(value * self.factor)

    def moment(self, value: float) -> str:
        return figures(value * self.factor * self.reach)


def way(b: Balancing) -> list[Topic]:
    """The worked solution of every rotor."""
    every: list[tuple[int, list[Topic]]] = []
    topics_of: Callable[..., list[Topic]] = _modal if b.modal else _of_rotor
    for group, rows, fix in b.modal or b.solved:
        for i, rotor in enumerate(group.tolist()):
            topics = topics_of(b, rotor, rows[i].tolist(), fix, i)
            topics[-1].figure = partial(_figure, b, rotor)
            every.append((rotor, topics))
    return [
        _headed(b, rotor, topic)
        for rotor, topics in sorted(every, key=lambda each: each[0])
        for topic in topics
    ]


def _headed(b: Balancing, rotor: int, topic: Topic) -> Topic:
    """The topic with the name of its rotor, where there are several."""
    if len(b.rotors.names) > 1:
        name = b.rotors.names[rotor]
        topic.head, topic.title = {"rotor": name, **topic.head}, f"Rotor {name}: {topic.heading}"
    return topic


def _of_rotor(b: Balancing, rotor: int, rows: list[int], fix: Correction, i: int) -> list[Topic]:
    scale = Scale(b)
    planes = [b.planes.name[b.plane_of_row[row]] for row in rows]
    mine = b.masses_of(rotor)
    has_z = b.rotors.z is not None and b.planes.z is not None
    z_plane = [float(b.planes.z[b.plane_of_row[row]]) for row in rows] if b.planes.z is not None else []
    about = z_plane[0] if has_z else None
    made = b.ideal[rows]
    topics = [_components(b, rotor, about, planes[0], scale)]
    masses = _masses(b, mine)
    if len(planes) == 1 or not has_z:
        static = complex(b.static[rotor])
        text = [
            f"Σ {scale.letter}·r + {scale.letter}_e·r_e = 0, each component alone (Riul, eqs. 6 to 11):",
            f"  {_sum_of(scale, masses, 'x')} + x = 0,  x = {scale.of(-static.real)} {scale.name}",
            f"  {_sum_of(scale, masses, 'y')} + y = 0,  y = {scale.of(-static.imag)} {scale.name}",
        ]
        topics.append(_plane_topic(b, rows[0], planes[0], complex(made[0]), text, scale))
    elif len(planes) == 2:
        topics += _two_planes(b, rows, planes, z_plane, made, masses, scale, fix, i)
    else:
        topics += _many_planes(b, rows, planes, z_plane, made, scale, fix, i)
    return topics


def _masses(b: Balancing, mine: Any) -> list[complex]:
    return [complex(u) for u in b.rotors.moment[mine]]


def _components(b: Balancing, rotor: int, about: float | None, plane: str, scale: Scale) -> Topic:
    mine = b.masses_of(rotor)
    rotors = b.rotors
    u = rotors.moment[mine]
    z = rotors.z[mine] if rotors.z is not None else np.full(len(mine), np.nan)
    lever = z - about if about is not None else np.full(len(mine), np.nan)
    unit, length = rotors.unbalance_unit, b.length_unit
    angle = degrees(u)
    # no −0 of a lever below zero
    values = {"x": u.real, "y": u.imag, "zx": lever * u.real + 0.0, "zy": lever * u.imag + 0.0}

    def component(name: str, amount: Any) -> Column:
        if len(name) == 1:
            return number(name, "unbalance", amount, unit)
        return number(name, "inertia", amount, b.couple_unit)

    shown = [c for c in COMPONENTS if about is not None or len(c) == 1]
    columns = [
        names("name", b.mass_names(rotor)),
        number("unbalance", "unbalance", rotors.size[mine], unit),
        number("angle", "angle", angle),
        *([number("z", "length", z, length)] if rotors.z is not None else []),
        *(component(name, values[name]) for name in shown),
    ]
    hidden = [] if rotors.z is not None else [number("z", "length", z, length)]
    hidden += [component(name, values[name]) for name in COMPONENTS if name not in shown]
    totals = {name: (np.sum(of), 4 * EPS * np.abs(of).sum()) for name, of in values.items()}
    sums = {name: np.array([0.0 if abs(of) <= noise else of]) for name, (of, noise) in totals.items()}
    total = Table(
        [names("name", ["sum"], None), *(component(name, sums[name]) for name in shown)],
        ("name",),
        "sum",
        documented=[component(name, sums[name]) for name in COMPONENTS if name not in shown],
    )
    text = ["Components of each unbalance, x = m·r·cos θ, y = m·r·sin θ:"]
    if about is not None:
        at = figures(about * scale.reach)
        text = [
            f"Components of each unbalance, and their moments about plane {plane} (z = {at} {scale.length.replace('_', '·')}), "
            f"zx = (z − z_{plane})·x, zy = (z − z_{plane})·y:"
        ]
    rows = Table(columns, ("name",), "rows[]", documented=hidden)
    return Topic("components", [*text, rows, total], "Components and sums", head={"about_z_m": about})


def _sum_of(scale: Scale, vectors: list[complex], axis: str, levers: list[float] | None = None) -> str:
    """A sum with its numbers: `(20·1 350 + 65·(−2 598.08))`; of many its first terms."""
    terms = []
    for k, v in enumerate(vectors[:SHOWN]):
        value = bracketed(scale.of(v.real if axis == "x" else v.imag))
        terms.append(value if levers is None else f"{bracketed(figures(levers[k] * scale.reach))}·{value}")
    return f"({' + '.join(terms)}{' + …' if len(vectors) > SHOWN else ''})"


def bracketed(number: str) -> str:
    """A number as a term or factor of a formula: a negative one in brackets."""
    return f"({number})" if number.startswith("−") else number


def _two_planes(
    b: Balancing, rows: list[int], planes: list[str], z: list[float], made: Any, masses: list[complex],
    scale: Scale, fix: Correction, i: int,
) -> list[Topic]:  # fmt: skip
    first, second = planes
    mine = b.masses_of(int(b.rotor_of_row[rows[0]]))
    assert b.rotors.z is not None
    levers = [float(v) - z[0] for v in b.rotors.z[mine]]
    apart = figures((z[1] - z[0]) * scale.reach)
    couple = complex(np.ravel(fix.couple(fix.planes[..., 0]))[i])
    c = complex(made[1])
    couple = couple if c else 0j
    w = scale.letter
    text = [
        f"ΣM = 0 about plane {first}: Σ a·{w}·r + a_{second}·{w}_{second}·r_{second} = 0 (Riul, eqs. 13 to 19):"
    ]
    for axis, mark, total, value in (
        ("x", "C1", couple.real, c.real),
        ("y", "C2", couple.imag, c.imag),
    ):
        text.append(
            f"  {mark} = −{_sum_of(scale, masses, axis, levers)}/{apart} = −({scale.moment(total)})/{apart} = {scale.of(value)} {scale.name}"
        )
    topics = [
        _plane_topic(b, rows[1], second, c, text, scale, f"Plane {second}: moments about plane {first}")
    ]
    d = complex(made[0])
    text = [f"ΣF = 0: Σ {w}·r + {w}_{second}·r_{second} + {w}_{first}·r_{first} = 0 (Riul, eqs. 12, 20, 21):"]
    for axis, mark, other, value in (("x", "d1", c.real, d.real), ("y", "d2", c.imag, d.imag)):
        text.append(
            f"  {mark} = −({scale.of(other)} + {_sum_of(scale, masses, axis)}) = {scale.of(value)} {scale.name}"
        )
    return [*topics, _plane_topic(b, rows[0], first, d, text, scale, f"Plane {first}: forces")]


def _many_planes(
    b: Balancing, rows: list[int], planes: list[str], z: list[float], made: Any, scale: Scale, fix: Correction, i: int
) -> list[Topic]:  # fmt: skip
    """Corrections of least norm, in three planes or more."""
    square = sum((p - q) ** 2 for k, p in enumerate(z) for q in z[k + 1 :])
    moments = [complex(np.ravel(fix.couple(fix.planes[..., k]))[i]) for k in range(len(z))]
    topics = []
    for k, (name, value) in enumerate(zip(planes, made, strict=True)):
        text = [
            "Least norm: W_p = −Σ_q (z_p − z_q)·M_q / Σ_(q<r) (z_q − z_r)², M_q the moment about plane q:"
        ]
        for mark, part in (("x", "real"), ("y", "imag")):
            terms = " + ".join(
                f"{figures((z[k] - q) * scale.reach)}·({scale.moment(getattr(m, part))})"
                for q, m in zip(z, moments, strict=True)
                if q != z[k]
            )
            text.append(
                f"  {mark} = −({terms})/{figures(square * scale.reach**2)} = {scale.of(getattr(complex(value), part))} {scale.name}"
            )
        topics.append(_plane_topic(b, rows[k], name, complex(value), text, scale))
    return topics


def quadrant(x: float, y: float) -> int | None:
    """Return the quadrant of a vector, an axis with the quadrant that it begins; None of nothing.

    >>> [quadrant(*v) for v in ((1, 0), (0, 1), (-1, 0), (0, -1), (-328.3, -1402.0))], quadrant(0, 0)
    ([1, 2, 3, 4, 3], None)
    """
    if x == 0 and y == 0:
        return None
    if y >= 0:
        return 1 if x > 0 else 2 if y > 0 else 3
    return 4 if x >= 0 else 3


def _plane_topic(
    b: Balancing, row: int, name: str, made: complex, text: Sequence[str], scale: Scale, heading: str = ""
) -> Topic:
    """The topic of a correction: its equations, its size, its mass and the quadrant of its angle."""
    radius = float(b.radius[row])
    mass = abs(made) / radius if radius else 0.0
    x, y = (value + 0.0 for value in (made.real, made.imag))
    q = quadrant(x, y)
    angle = degrees(made)
    amount = (
        f"W = {figures(float(from_si(mass * b.request.gravity, 'force', b.rotors.weight_unit)))} {b.rotors.weight_unit}"
        if b.rotors.weight_unit
        else f"m = {figures(float(from_si(mass, 'mass', b.rotors.mass_unit)))} {b.rotors.mass_unit}"
    )
    length = b.length_unit
    lines = [
        *text,
        f"  √(x² + y²) = {scale.of(abs(made))} {scale.name}; at r = {figures(float(from_si(radius, 'length', length)))} {length}: {amount}",
    ]
    if q is not None:
        signs = (
            f"x {'<' if x < 0 else '>' if x > 0 else '='} 0, y {'<' if y < 0 else '>' if y > 0 else '='} 0"
        )
        # an angle on an axis is in no quadrant
        along = f"{'−' if x + y < 0 else ''}{'x' if x else 'y'}"
        place = f"tan θ = y/x; {signs}: quadrant {q}" if x and y else f"{signs}: along {along}"
        lines.append(f"  {place}, θ = {figures(angle)}°")
    if b.request.remove:
        lines.append(f"  to remove instead: on the other side, at {figures(in_turn(angle + 180.0))}°")
    unit = b.rotors.unbalance_unit
    table = Table(
        [],
        (),
        "",
        documented=[
            number("x", "unbalance", [x], unit),
            number("y", "unbalance", [y], unit),
            names("quadrant", [q]),
            number("unbalance", "unbalance", [abs(made)], unit),
            number("mass", "mass", [mass], b.rotors.mass_unit),
            number("angle", "angle", [angle]),
        ],
    )
    return Topic(f"plane {name}", [*lines, table], heading)


def _modal(b: Balancing, rotor: int, rows: list[int], fix: ModalCorrection, i: int) -> list[Topic]:
    """The worked solution of a rotor with modes."""
    scale = Scale(b)
    shapes = b.request.modes
    assert shapes is not None
    mine = b.masses_of(rotor)
    u, phi = b.rotors.moment[mine], b.conditions_at_masses(rotor)
    made, at_planes = b.ideal[rows], fix.at_planes[i]
    planes = [b.planes.name[b.plane_of_row[row]] for row in rows]
    conditions, unit = shapes.conditions, b.rotors.unbalance_unit
    signs = [_sign(name) for name in conditions]
    sums = fix.modal[i]
    columns = [names("name", b.mass_names(rotor)), number("unbalance_x", "unbalance", u.real, unit)]
    columns.append(number("unbalance_y", "unbalance", u.imag, unit))
    columns += [
        number(f"phi {name}", "number", row, place=f"phi.{name}")
        for name, row in zip(conditions, phi, strict=True)
    ]
    total = Table(
        [
            names("condition", conditions),
            number("x", "unbalance", sums.real, unit),
            number("y", "unbalance", sums.imag, unit),
        ],
        ("condition",),
        "sums[]",
    )
    text = [
        "What the unbalances do to each mode, s_k = Σ U_i·φ_k(z_i), φ by cubic splines through the stations (Bishop and Gladwell):"
    ]
    if shapes.rigid:
        text.append(
            "force: φ = 1; couple: φ = (z − middle)/length of the shaft (N + 2 planes, Kellenberger)."
        )
    for sign, row, s in zip(signs, phi, sums, strict=True):
        for axis, component in (("x", u.real), ("y", u.imag)):
            value = float(s.real if axis == "x" else s.imag)
            text.append(
                f"  {sign}_{axis} = {_products(scale, component, row)} = {scale.of(value)} {scale.name}"
            )
    topics = [
        Topic(
            "modal sums", [*text, Table(columns, ("name",), "rows[]"), total], "Modal sums of the unbalances"
        )
    ]
    topics.append(_system(conditions, signs, planes, at_planes, sums, scale))
    for row, name, value in zip(rows, planes, made, strict=True):
        lines = [
            f"  {axis} = {scale.of(part)} {scale.name}"
            for axis, part in (("x", value.real), ("y", value.imag))
        ]
        topics.append(_plane_topic(b, row, name, complex(value), ["From the system:", *lines], scale))
    return topics


def _system(
    conditions: list[str], signs: list[str], planes: list[str], at_planes: Any, sums: Any, scale: Scale,
) -> Topic:  # fmt: skip
    """The system Σ_p φ_k(z_p)·w_p = −s_k."""
    text = ["The corrections w_p leave no mode excited: Σ_p φ_k(z_p)·w_p = −s_k for x and for y:"]
    for sign, row, s in zip(signs, at_planes, sums, strict=True):
        left = " + ".join(f"({figures(float(f))})·{name}" for f, name in zip(row, planes, strict=True))
        text.append(
            f"  {sign}: {left} = {scale.of(-float(s.real))} (x), {scale.of(-float(s.imag))} (y) {scale.name}"
        )
    if len(planes) > len(conditions):
        text.append(
            f"{len(planes)} planes for {len(conditions)} conditions: of all solutions that of least Σ|w_p|² (singular values)."
        )
    shown = [names("condition", conditions)]
    shown += [
        number(f"phi at {name}", "number", at_planes[:, p], place=f"at_planes.{p}")
        for p, name in enumerate(planes)
    ]
    return Topic("system", [*text, Table(shown, ("condition",), "rows[]")], "The system")


def _products(scale: Scale, values: Any, row: Any) -> str:
    terms = [
        f"({scale.of(float(value))})·({figures(float(f))})"
        for value, f in list(zip(values, row, strict=True))[:SHOWN]
    ]
    return " + ".join(terms) + (" + …" if len(values) > SHOWN else "")


def _sign(condition: str) -> str:
    """The letter of a condition's sum: s_1 of mode 1."""
    return {"force": "F", "couple": "M"}.get(condition, f"s_{condition.removeprefix('mode ')}")


def _figure(b: Balancing, rotor: int) -> Figure:
    from cli.balance.page import polygons
    from dalembert.drawing.sheet import blank

    figure = blank()
    polygons(b, rotor, figure)
    return figure
