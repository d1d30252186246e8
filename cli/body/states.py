"""What is computed of a rotation: the states, what is constant, the picture, the page, the worked solution."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection
from dataclasses import replace
from functools import partial
from math import atan2, cos, degrees, hypot, radians, sin
from typing import TYPE_CHECKING

import numpy as np

from cli.read import root_search
from cli.read.options import bad
from dalembert.drawing.sheet import blank
from dalembert.results.columns import Column, Table, listed, names, number, vector
from dalembert.results.way import Topic, figures
from rigidbody3d import check
from rigidbody3d.attitude import rotate
from rigidbody3d.picture.rotation import rotation as draw_rotation
from rigidbody3d.rotation_in_time import Rotation
from rigidbody3d.turning_body import TurningBody

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rigidbody3d.rotation_in_time import Array


METHOD = (
    "Free rotation and tops in closed form by Jacobi's elliptic functions (Landau and Lifshitz, Mechanics, §37; Goldstein, "
    "Classical Mechanics, ch. 5), else angular momentum and a unit quaternion integrated."
)


STATES = ("omega", "attitude", "momentum", "energy")
CONSTANTS = ("drift", "period", "nutation_period", "cones", "steady")
QUANTITIES = (*STATES, *CONSTANTS)
"""What --only can name; nothing else is computed then."""


def tables(r: Rotation, only: Collection[str] = QUANTITIES) -> dict[str, Callable[[], Table]]:
    """The tables of a result, the CSV's first."""
    made = {"states": lambda: states(r, only), "constants": lambda: constants(r, only)}
    return {
        name: made[name] for name, of in (("states", STATES), ("constants", CONSTANTS)) if {*of} & {*only}
    }


def states(r: Rotation, only: Collection[str] = QUANTITIES) -> Table:
    """A row for each time."""
    s = r.states

    def error(of: str) -> Callable[[], Array]:
        return partial(r.errors, "quaternion" if of == "attitude" else of)

    columns = [number("t", "time", r.time + 0.0)]
    for name, dimension, axes in (
        ("omega", "speed", "xyz"),
        ("attitude", "number", "wxyz"),
        ("momentum", "angular momentum", "xyz"),
    ):
        if name in only:
            columns += vector(name, dimension, getattr(s, name) + 0.0, axes, error(name))
    if "energy" in only:
        columns.append(number("energy", "energy", s.energy + 0.0, error=error("energy")))
    how = "closed form" if r.exact else f"integrated by {r.integrator}"
    above = f"omega in body axes, momentum in space axes, attitude [w, x, y, z] from body to space; {how}"
    return Table(columns, keys=("t_s",), place="states[]", above=above)


def constants(r: Rotation, only: Collection[str] = QUANTITIES) -> Table:
    """One row: drift, periods, the cones of a free symmetric body, the steady precession of a top."""
    columns: list[Column] = []
    absent: list[Column] = []

    def one(name: str, dimension: str, value: float | None, place: str, key: str = "") -> None:
        error = partial(r.constant_error, key, value) if key and value is not None else None
        column = number(name, dimension, [np.nan if value is None else value], error=error, place=place)
        (absent if value is None else columns).append(column)

    if "drift" in only:
        for of, value in r.drift.items():
            one(f"drift_of_{of}", "number", value, f"drift.{of}")
    for name in ("period", "nutation_period"):
        if name in only:
            one(name, "time", getattr(r, name), name, name)
    for name in ("cones", "steady"):
        if name not in only:
            continue
        rates = getattr(r, name)()
        for key, value in (rates or {}).items():
            base, dimension = (key[:-4], "angle") if key.endswith("_deg") else (key[:-6], "speed")
            one(base, dimension, value, f"{name}.{base}", key)
        if rates is None:
            absent.append(names(name, [None]))
    return Table(columns, place="", documented=absent)


def warnings(r: Rotation, only: Collection[str] = ()) -> list[str]:
    """Warnings about the method, the precession, and what --only names and this rotation does not have."""
    absent = {
        "drift": (r.body.forced, "a torque changes momentum and energy"),
        "period": (r.period is None, "the angular velocity is constant, or not periodic"),
        "nutation_period": (r.nutation_period is None, "only a top that nutates has it"),
        "cones": (r.cones() is None, "only a free body of revolution has them"),
        "steady": (r.steady() is None, "only a symmetric top has it"),
    } if only else {}  # fmt: skip
    lines = [
        f"--only {name}: none here: {why}" for name, (none, why) in absent.items() if none and name in only
    ]
    if r.body.mgl and r.round_moments is None:
        lines.append("a top whose moments across body z differ has no closed form: it was integrated")
    steady = r.steady()
    if steady is not None and steady["slow_rad_s"] is None:
        lines.append("the spin is too slow for steady precession at this tilt")
    return lines


def coarse(r: Rotation) -> list[str]:
    """Warn of a page on which the body jumps, and name steps that show it turn."""
    if len(r.time) < 2:
        return []
    step = float(np.abs(np.diff(r.time)).max())
    fastest = float(np.linalg.norm(r.states.omega, axis=-1).max())
    if step * fastest <= np.pi / 4:
        return []
    smaller = float(f"{np.pi / 12 / fastest:.1g}")
    return [
        f"--page: the body turns up to {np.degrees(step * fastest):.0f} deg from one pose to the next: "
        f"with steps of {smaller:g} s it turns smoothly"
    ]


def draw(r: Rotation) -> Figure:
    """Draw ω(t), the polhode and the trace of the body's axis; for a single time, from zero to there."""
    figure, body = blank(), r.body
    time = _fine(r)
    at = r.at(time)
    draw_rotation(
        time,
        at.omega,
        at.attitude,
        body.inertia,
        free=not body.forced and body.mgl is None,
        top=body.mgl is not None,
        name=body.name,
        figure=figure,
    )
    return figure


def _fine(r: Rotation) -> Array:
    ends = [min(0.0, float(r.time.min())), float(r.time.max())]
    if len(r.time) > 1:
        ends[0] = float(r.time.min())
    size = float(np.linalg.norm(r.body.omega))
    if ends[0] == ends[1]:
        ends[1] = ends[0] + (r.period or (2 * np.pi / size if size else 1.0))
    turns = (ends[1] - ends[0]) * size / (2 * np.pi)
    return np.linspace(ends[0], ends[1], int(np.clip(60 * turns, 600, 6000 if r.exact else 2000)))


def way(r: Rotation) -> list[Topic]:
    """The worked solution."""
    g = r.body
    tensor = np.asarray(g.inertia, dtype=float)
    tensor = np.diag(tensor) if tensor.ndim == 1 else tensor
    w = np.asarray(g.omega, dtype=float)
    h = tensor @ w
    space = rotate(g.attitude, h)
    energy = float(w @ h) / 2
    start = [
        f"H = I·ω = ({', '.join(figures(float(v)) for v in h)}) kg·m²/s in body axes, |H| = {figures(float(np.linalg.norm(h)))}",
        f"H = ({', '.join(figures(float(v)) for v in space)}) kg·m²/s in space axes",
        f"T = ω·H/2 = {figures(energy)} J",
    ]
    head = {
        "momentum_body_kg_m2_s": listed(h),
        "momentum_kg_m2_s": listed(space),
        "kinetic_energy_J": energy,
    }
    result = [Topic("start", start, "At time zero", head)]
    if g.forced:
        law = ["Ḣ = M: momentum and energy change with the torque; I·ω̇ = M − ω × I·ω (Euler)."]
    elif g.mgl is not None:
        law = [
            "Weight about the fixed point: H about the vertical, H about the axis of a symmetric top, and T + mgl·cos θ stay."
        ]
    else:
        law = ["No torque: H in space and T stay; I·ω̇ = −ω × I·ω (Euler), so that ω moves on the polhode."]
    law += [f"  drift of {of}: {figures(value)}" for of, value in r.drift.items() if value is not None]
    result.append(Topic("constants", law, "What stays constant", {"drift": dict(r.drift)}))
    cones = r.cones()
    if cones is not None:
        text = [
            "A body of revolution: ω and its axis turn about H with H/I_t (precession), the body about its axis with the spin.",
            *(f"  {_spoken(key)}: {figures(value)} {'°' if key.endswith('_deg') else 'rad/s'}" for key, value in cones.items() if value is not None),
        ]  # fmt: skip
        result.append(Topic("cones", text, "Cones", dict(cones)))
    steady = r.steady()
    if steady is not None:
        text = ["Steady precession at the present tilt: (I_t·cos θ)·ψ̇² − I_a·ω_z·ψ̇ + mgl = 0 has two roots."]
        text += [
            f"  {_spoken(key)}: {figures(value)} rad/s" for key, value in steady.items() if value is not None
        ]
        result.append(Topic("steady precession", text, "Steady precession", dict(steady)))
    return result


def _spoken(key: str) -> str:
    """A name in JSON as a sentence has it: without its unit, its words apart."""
    return key.removesuffix("_deg").removesuffix("_rad_s").replace("_", " ")


Change = Callable[[float], TurningBody]


def find(rotation: Rotation, name: str, wanted: str) -> tuple[Rotation, root_search.Found]:
    """Return the rotation with the number with which the quantity has the value."""
    if len(rotation.time) > 1:
        raise bad("--find", "expected one instant, such as --at 2")

    def quantities(body: TurningBody) -> dict[str, tuple[float, str]]:
        # a body of printed parts may miss it by its last digit
        if name.startswith("inertia") and not check(body.inertia).valid:
            raise ValueError
        return _quantities(replace(rotation, body=body))

    body, solution = root_search.solve(_choices(rotation.body), name, wanted, "slow=0.5rad_s", quantities)
    return replace(rotation, body=body), solution


def _quantities(r: Rotation) -> dict[str, tuple[float, str]]:
    """Every number of the result by its name, such as omega.x, and its unit."""
    kept = [column for column in constants(r).columns if not column.name.startswith("drift")]
    columns = [*states(r).columns[1:], *kept]
    return {re.sub(r"_([wxyz])$", r".\1", c.name): (float(c.values[0]), c.unit) for c in columns}  # type: ignore[arg-type]


def _choices(body: TurningBody) -> dict[str, tuple[root_search.Sought, Change]]:
    """The numbers of the file."""
    choices: dict[str, tuple[root_search.Sought, Change]] = {}

    def entry(x: float, key: str, i: int) -> TurningBody:
        vector = np.array(getattr(body, key))
        vector[i] = x
        return replace(body, **{key: vector})  # type: ignore[arg-type]

    vectors = [("omega", "rad_s", "xyz")]
    if body.inertia.ndim == 1:
        vectors.append(("inertia", "kg_m2", "123"))
    if body.torque is not None:
        vectors.append(("torque", "N_m", "xyz"))
    for key, unit, letters in vectors:
        for i, letter in enumerate(letters):
            number = root_search.Sought(f"{key}.{letter}_{unit}", unit, float(getattr(body, key)[i]))
            choices[f"{key}.{letter}"] = number, partial(entry, key=key, i=i)
    if body.mgl is not None:
        choices["top.mgl"] = (
            root_search.Sought("top.mgl_N_m", "N_m", body.mgl),
            lambda x: replace(body, mgl=x),
        )
        w, x, y, z = body.attitude.tolist()
        if z == 0:
            # the axis leans by a turn about a horizontal line
            lean = degrees(2 * atan2(hypot(x, y), w))
            across = (x / hypot(x, y), y / hypot(x, y)) if x or y else (1.0, 0.0)

            def leaning(tilt: float) -> TurningBody:
                half = radians(tilt) / 2
                return replace(body, attitude=np.array([cos(half), *(sin(half) * a for a in across), 0.0]))

            choices["tilt"] = root_search.Sought("tilt_deg", "deg", lean), leaning
    return choices
