"""The worked solution of a body: parts and tensor, H, its rate, principal axes, the angle of H to ω, bearings; and `--find`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cli.body.moving import AXES, ORIGIN, MovingBody, Request
from cli.body.tables import axis_words, numbers_of
from cli.read import root_search
from cli.read.options import bad
from dalembert.results.columns import Column, Table, listed, names, number, vector
from dalembert.results.way import Topic, figures
from dalembert.tables.table import Table as ReadTable
from rigidbody3d.inertia import free_axes, own_axes, shift
from rigidbody3d.parts import SEVERAL, bodies_of

if TYPE_CHECKING:
    from cli.body.moving import Array


def way(bodies: Sequence[MovingBody]) -> list[Topic]:
    """The worked solution of every body."""
    if not bodies[0].parts.several:
        return _of_body(bodies[0])
    return [
        replace(
            topic,
            title=f"Body {b.parts.body}: {topic.title[:1].lower()}{topic.title[1:]}",
            head={SEVERAL: b.parts.body, **topic.head},
        )
        for b in bodies
        for topic in _of_body(b)
    ]


def _of_body(b: MovingBody) -> list[Topic]:
    """The worked solution of a body, with its motion, or as a shaft."""
    result = [_inertia(b)]
    if b.moving:
        result += [_momentum(b), _rate(b)]
    result.append(_principal(b))
    if b.moving and b.motion.omega.any():
        result.append(_angle(b))
    if b.request.shaft is not None:
        result.append(_bearings(b))
    return result


def _tensor(name: str, tensor: Array) -> Table:
    """A matrix as it is printed, a row for each axis."""
    return Table(
        [names("row", list(AXES), None), *(number(f"{name}_{a}", "inertia", tensor[:, k], place=None) for k, a in enumerate(AXES))],
        ("row",),
    )  # fmt: skip


def _inertia(b: MovingBody) -> Topic:
    """The centre of mass as a weighted mean, the tensor by Steiner's theorem."""
    each, body = b.parts.each, b.parts.whole
    mass, center, own = (
        np.atleast_1d(each.mass),
        np.atleast_2d(each.center),
        np.reshape(each.inertia, (-1, 3, 3)),
    )
    moved = own + shift(mass, center - body.center)
    columns = [
        names("part", list(b.parts.name)),
        number("mass", "mass", mass),
        *vector("center", "length", center, AXES),
        *(
            number(f"I{AXES[i]}{AXES[j]}", "inertia", moved[:, i, j] if i == j else 0.0 - moved[:, i, j], place=f"inertia_about_whole.{AXES[i]}{AXES[j]}")
            for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
        ),
    ]  # fmt: skip
    c = body.center
    text = [
        "m = Σ m_i, r_G = Σ m_i·r_i/m; each tensor is moved to G by Steiner's theorem, I + m·(r²·E − r·rᵀ), and added; "
        "I_xy = +∫xy dm, the matrix carries −I_xy (Riul, eqs. 24 to 35).",
        f"m = {figures(float(body.mass))} kg, r_G = ({', '.join(figures(float(v)) for v in c)}) m",
    ]
    return Topic(
        "inertia",
        [*text, Table(columns, ("part",), "parts[]"), _tensor("I", body.inertia)],
        "Mass, centre and tensor",
        {"inertia_kg_m2": listed(body.inertia)},
    )


def _product(row: Array, omega: Array) -> str:
    """A component of I·ω with its numbers, and an equals sign; empty where it is zero."""
    text = " + ".join(
        f"({figures(float(i))})·({figures(float(w))})" for i, w in zip(row, omega, strict=True) if i and w
    )
    return f"{text} = " if text else ""


def _momentum(b: MovingBody) -> Topic:
    w, inertia, h = b.motion.omega, b.motion.inertia, b.motion.momentum
    text = ["H = I·ω about G (Riul, eqs. 31 to 35):"]
    text += [f"  H_{a} = {_product(inertia[k], w)}{figures(float(h[k]))} kg·m²/s" for k, a in enumerate(AXES)]
    head: dict[str, Any] = {
        "omega_rad_s": listed(w),
        "inertia_kg_m2": listed(inertia),
        "momentum_kg_m2_s": listed(h),
    }
    return Topic("momentum", text, "Angular momentum", head)


def _rate(b: MovingBody) -> Topic:
    m = b.motion
    frame = m.omega if m.frame_omega is None else m.frame_omega
    h, cross, relative, rate = m.momentum, m.transport, m.relative, m.rate
    text = [
        "Ḣ = (Ḣ)rel + Ω × H, Ω the rate of the axes"
        + (", here the body's own ω" if m.frame_omega is None else "")
        + " (Riul, eqs. 36 to 44):"
    ]
    for k, a in enumerate(AXES):
        i, j = (k + 1) % 3, (k + 2) % 3
        numbers = f"({figures(float(frame[i]))})·({figures(float(h[j]))}) − ({figures(float(frame[j]))})·({figures(float(h[i]))})"
        text.append(
            f"  (Ω × H)_{a} = Ω_{AXES[i]}·H_{AXES[j]} − Ω_{AXES[j]}·H_{AXES[i]} = {numbers} = {figures(float(cross[k]))} N·m"
        )
    text += [
        f"  Ḣ_{a} = {figures(float(relative[k]))} + ({figures(float(cross[k]))}) = {figures(float(rate[k]))} N·m"
        for k, a in enumerate(AXES)
    ]
    force, moment = listed(m.inertia_force), listed(m.inertia_wrench.moment)
    text.append(
        f"ΣM_G = Ḣ, ΣF = m·a_G; d'Alembert's inertia force −m·a_G = ({', '.join(map(figures, force))}) N, "
        f"moment −Ḣ = ({', '.join(map(figures, moment))}) N·m (Riul, eqs. 22, 23)"
    )
    head: dict[str, Any] = {
        "frame_omega_rad_s": listed(frame),
        "momentum_kg_m2_s": listed(h),
        "relative_N_m": listed(relative),
        "transport_N_m": listed(cross),
        "rate_N_m": listed(rate),
    }
    return Topic("rate of momentum", text, "Rate of the angular momentum", head)


def _principal(b: MovingBody) -> Topic:
    principal = b.parts.whole.principal
    free = bool(free_axes(principal.moments))
    axes = own_axes(principal)
    moments = listed(principal.moments)
    head: dict[str, Any] = {
        "principal_kg_m2": moments,
        "principal_axes": listed(axes),
        "free": free,
    }
    text = ["det(I − λ·E) = 0: the principal moments and, for each, the axis with (I − λ·E)·n = 0."]
    if free:
        text.append(
            "Two moments are equal: any axes across the third will do; those shown lie along the body's own where they can."
            if moments[2] - moments[0] > 1e-9 * moments[2]
            else "All three moments are equal: any axes will do; those shown are the body's own."
        )
    columns: list[Column] = [names("axis", ["1", "2", "3"], None)]
    columns.append(number("moment", "inertia", principal.moments, place=None))
    columns += [number(f"n_{a}", "number", axes[:, k], place=None) for k, a in enumerate(AXES)]
    if b.moving:
        w, h = axes @ b.motion.omega, axes @ b.motion.momentum
        head |= {"omega_rad_s": listed(w), "momentum_kg_m2_s": listed(h)}
        columns += [
            number("omega", "speed", w, place=None),
            number("momentum", "angular momentum", h, place=None),
        ]
        text.append("In principal axes H′ = (I1·ω1, I2·ω2, I3·ω3) (Riul, eqs. 45, 46).")
    return Topic("principal axes", [*text, Table(columns, ("axis",))], "Principal axes", head)


def _angle(b: MovingBody) -> Topic:
    w, h = b.motion.omega, b.motion.momentum
    size, speed = float(np.linalg.norm(h)), float(np.linalg.norm(w))
    angle = float(np.degrees(np.arctan2(np.linalg.norm(np.cross(w, h)), w @ h)))
    text = [
        f"|H| = √({' + '.join(f'({figures(float(v))})²' for v in h)}) = {figures(size)} kg·m²/s",
        f"cos φ = ω·H/(|ω|·|H|), |ω| = {figures(speed)} rad/s: φ = {figures(angle)}°",
    ]
    head = {"momentum_kg_m2_s": size, "omega_rad_s": speed, "angle_deg": angle}
    return Topic("angle", text, "Size of H, and its angle to ω", head)


def _bearings(b: MovingBody) -> Topic:
    shaft, request = b.shaft, b.request.shaft
    assert request is not None
    z1, z2 = request.bearings
    w, rate = request.speed, request.speed_rate
    v1, v2 = complex(shaft.moment_unbalance(z1)), complex(shaft.moment_unbalance(z2))
    x, y, z = list(b.letters)
    text = [] if b.letters == "xyz" else [f"Places and angles on the shaft: {axis_words(b)}."]
    text += [
        f"U = ∫({x} + i{y}) dm; about each bearing V = ∫({x} + i{y})·({z} − {z}_bearing) dm = I_{x}{z} + i·I_{y}{z}; a moment about "
        "the one over the span is the force at the other: "
        f"R2 = (−ω² + i·ω̇)·V1/({z}2 − {z}1), R1 = (−ω² + i·ω̇)·V2/({z}1 − {z}2) (Riul, example 4).",
        f"  V1 = {_complex(v1)}, V2 = {_complex(v2)} kg·m²; −ω² + i·ω̇ = {_complex(complex(-w * w, rate))} 1/s²",
    ]
    for k, (v, span) in enumerate(((v2, z1 - z2), (v1, z2 - z1))):
        force = shaft.dynamic[k]
        text.append(
            f"  R{k + 1} = ({_complex(complex(-w * w, rate))})·({_complex(v)})/({figures(span)}) = "
            f"{_complex(complex(*force))} N"
        )
    if any(request.gravity):
        text += [f"  static: R{k + 1} = {_complex(complex(*shaft.static[k]))} N" for k in (0, 1)]
    rows = [number("z", "length", np.array([z1, z2]))]
    about = np.array([v1, v2])
    rows += vector("moment_unbalance", "inertia", np.stack([about.real, about.imag], axis=-1), x + y)
    rows += vector("static", "force", shaft.static, x + y)
    rows += vector("dynamic", "force", shaft.dynamic, x + y)
    return Topic("bearings", [*text, Table(rows, (), "bearings[]")], "Forces of the bearings on the shaft")


def _complex(z: complex) -> str:
    return f"{figures(z.real)} + i·({figures(z.imag)})"


Change = Callable[[float], tuple[ReadTable, Request]]


def find(
    table: ReadTable, path: str, request: Request, name: str, wanted: str
) -> tuple[MovingBody, root_search.Found]:
    """Return the body with the number with which the quantity has the value."""

    def body(change: tuple[ReadTable, Request]) -> MovingBody:
        changed, moved = change
        bodies = bodies_of(changed, path)
        if len(bodies) > 1:
            raise bad("--find", f"expected a table of one body, found {len(bodies)}")
        return MovingBody(bodies[0], moved)

    choices = {**_motions(table, request), **_cells(table, request)}
    vectors = ", with .x, .y, .z or .size behind a vector, and .1, .2 or .3 behind principal"
    change, solution = root_search.solve(
        choices, name, wanted, "bearing1_dynamic.x=20N", lambda change: numbers_of(body(change)), vectors
    )
    return body(change), solution


def _motions(table: ReadTable, request: Request) -> dict[str, tuple[root_search.Sought, Change]]:
    """The numbers of the motion: of a shaft its speed and rate, else components of ω, of its rate, of Ω."""
    choices: dict[str, tuple[root_search.Sought, Change]] = {}
    shaft = request.shaft
    if shaft is not None:
        for name, unit in (("speed", "rad_s"), ("speed_rate", "rad_s2")):

            def turned(x: float, name: str) -> tuple[ReadTable, Request]:
                assert shaft is not None
                return table, replace(request, shaft=replace(shaft, **{name: x}))  # type: ignore[arg-type]

            number = root_search.Sought(f"{name}_{unit}", unit, getattr(shaft, name))
            choices[name] = number, partial(turned, name=name)
        return choices
    for name, unit in (("omega", "rad_s"), ("alpha", "rad_s2"), ("frame_omega", "rad_s")):
        vector = getattr(request, name)
        # axes that turn with the body and axes at rest are two motions
        if vector is None and name == "frame_omega":
            continue
        for i, axis in enumerate(AXES):

            def moved(x: float, name: str, i: int) -> tuple[ReadTable, Request]:
                components = list(getattr(request, name) or ORIGIN)
                components[i] = x
                return table, replace(request, **{name: tuple(components)})  # type: ignore[arg-type]

            number = root_search.Sought(f"{name}.{axis}_{unit}", unit, (vector or ORIGIN)[i])
            choices[f"{name}.{axis}"] = number, partial(moved, name=name, i=i)
    return choices


def _cells(table: ReadTable, request: Request) -> dict[str, tuple[root_search.Sought, Change]]:
    """The numbers of the parts, in the file's units."""
    choices: dict[str, tuple[root_search.Sought, Change]] = {}
    for row, part in enumerate(table.texts.get("part", [str(k + 1) for k in range(table.rows)])):
        for key, column in table.numbers.items():
            if np.isnan(column.values[row]):
                continue

            def changed(x: float, key: str, row: int) -> tuple[ReadTable, Request]:
                own = table.numbers[key]
                values = own.values.copy()
                values[row] = x
                return replace(table, numbers={**table.numbers, key: replace(own, values=values)}), request

            header = f"{part}.{key}_{column.unit}".rstrip("_")
            number = root_search.Sought(header, column.unit, float(column.values[row]))
            choices[f"{part}.{key}"] = number, partial(changed, key=key, row=row)
    return choices
