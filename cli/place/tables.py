"""Results of a placement: masses on their places, corrections and errors, planes; the picture, the worked solution."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from balancing.picture import Places, places
from cli.place.placing import Placing
from cli.show.picture import blank
from dalembert.angles import degrees, phasor
from dalembert.results.columns import Column, Table, names, number
from dalembert.results.way import Topic, figures, vector_text
from dalembert.units import from_si, to_si

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cli.place.digits import Made, SecondRun
    from cli.place.placing import Placing
    from dalembert.arithmetic.doubled import Doubled
    from dalembert.arithmetic.doubled_vectors import Vectors


METHOD = (
    "Without limits the two places next to the correction share it by the sine rule; with limits the places nearest to it are "
    "filled first (least total mass, by linear programming duality); weights from stock by the choice of least error, all "
    "choices compared; weights of fixed mass as the sides of a polygon on a circle, which the correction closes."
)


def tables(placings: Sequence[Placing]) -> dict[str, Callable[[], Table]]:
    """The tables of a result, the CSV's first."""
    parts = {"masses": lambda: masses(placings), "corrections": lambda: corrections(placings)}
    if placings[0].request.planes is not None:
        parts["planes"] = lambda: planes(placings)
    return parts


def _named(placings: Sequence[Placing], numbers: Iterable[int]) -> tuple[list[Column], list[Column]]:
    """Rotor and plane of each row, where there are several corrections; behind them which correction it is.

    A file may have two corrections for one plane of one rotor.
    """
    rows = list(numbers)
    if len(placings) == 1:
        return [], []
    shown = [
        names("rotor", [placings[k].of.rotor for k in rows]),
        names("plane", [placings[k].of.plane for k in rows]),
    ]
    return shown, [names("correction", rows, place=None)]


def _vector(
    mass: str,
    angle: str,
    vectors: Sequence[complex],
    unit: str,
    at: tuple[str, str] = ("", ""),
    exact: Callable[[], Vectors] | None = None,
) -> list[Column]:
    """Masses and their angles."""
    size = None if exact is None else lambda: exact().size
    turn = None if exact is None else lambda: exact().turned(vectors)
    return [
        number(mass, "mass", [abs(vector) for vector in vectors], unit, place=at[0], exact=size),
        number(angle, "angle", [degrees(vector) for vector in vectors], error=turn, place=at[1]),
    ]


def second_runs(placings: Sequence[Placing]) -> Callable[[], list[SecondRun]]:
    """The second runs of placements, worked out on the first request."""

    @cache
    def runs() -> list[SecondRun]:
        from cli.place.digits import SecondRun

        return [SecondRun(placing) for placing in placings]

    return runs


def masses(placings: Sequence[Placing]) -> Table:
    """A row for each mass of each correction; of one alone without rotor and plane."""
    unit, request = placings[0].of.unit, placings[0].request
    every = [(k, mass) for k, placing in enumerate(placings) for mass in placing.masses]
    named, hidden = _named(placings, [k for k, _ in every])

    runs = second_runs(placings)

    def exact(of: Callable[[Made], Doubled]) -> Callable[[], Doubled]:
        def again() -> Doubled:
            from cli.place.digits import column

            return column(runs(), of)

        return again

    columns = [
        *named,
        names("position", [str(m.place + 1) for _, m in every]),
        number("angle", "angle", [m.angle for _, m in every], exact=exact(lambda m: m.angle)),
        number("mass", "mass", [m.mass for _, m in every], unit, exact=exact(lambda m: m.mass)),
    ]
    if request.planes is not None:
        z = number("z", "length", [m.share.z or 0.0 for _, m in every], "mm")
        columns.insert(len(named), z)
    depths = [m.depth or np.nan for _, m in every]
    depth = number("drill_depth", "length", depths, "mm", exact=exact(lambda m: m.depth))
    holes = [depth, names("holes", [m.holes for _, m in every])]
    keys = [column.name for column in (*named, *hidden)]
    if request.planes is None or named:
        keys.append("position")
    return Table(
        columns if request.drill is None else [*columns, *holes],
        keys,
        f"{'placements[].' if named else ''}masses[]",
        above=f"material to {placings[0].action}, angles counter-clockwise:",
        documented=[*hidden, *(holes if request.drill is None else [])],
    )


def corrections(placings: Sequence[Placing]) -> Table:
    """A row for each correction: what is to be placed, and what the masses miss of it."""
    unit, request = placings[0].of.unit, placings[0].request
    named, hidden = _named(placings, range(len(placings)))
    target, error = [each.target for each in placings], [each.error for each in placings]
    whole = [max(abs(share.goal) for share in placing.shares) for placing in placings]
    missed = [abs(left) / size if size else 0.0 for left, size in zip(error, whole, strict=True)]

    def targets() -> Vectors:
        from cli.place.digits import goals

        return goals(second_runs(placings)(), lambda run: [run.target])

    columns = [
        *named,
        *_vector(
            "correction_mass", "correction_angle", target, unit, ("target.mass", "target.angle"), targets
        ),
        *_vector("error", "error_angle", error, unit),
        number("error_share", "number", missed, place=None),
        names("action", [placing.action for placing in placings]),
    ]
    if request.ratio != 1:
        there = [abs(of) * request.ratio for of in target]
        columns.insert(len(named) + 2, number("mass_at_radius", "mass", there, unit, place=None))
    keys = [column.name for column in (*named, *hidden)]
    return Table(columns, keys, "placements[]" if named else "", documented=hidden)


def planes(placings: Sequence[Placing]) -> Table:
    """A row for each plane that a correction is carried over to: what belongs there, and what is missed."""
    unit = placings[0].of.unit
    every = [(k, share) for k, placing in enumerate(placings) for share in placing.shares]
    named, _ = _named(placings, [k for k, _ in every])

    def goals_again() -> Vectors:
        from cli.place.digits import goals

        return goals(second_runs(placings)(), lambda run: run.goals)

    columns = [
        *named,
        number("z", "length", [share.z or 0.0 for _, share in every], "mm"),
        *_vector(
            "correction_mass", "correction_angle", [share.goal for _, share in every], unit, exact=goals_again
        ),
        *_vector("error", "error_angle", [share.error for _, share in every], unit),
    ]
    return Table(columns, [column.name for column in named])


def draw(placing: Placing) -> Figure:
    """Draw for each plane its places with their masses on the rim, target and total as vectors."""
    unit = placing.of.unit
    panels = [
        Places(
            "" if share.z is None else f"z = {from_si(share.z, 'length', 'mm'):g} mm: ",
            np.radians(share.places).tolist(),
            from_si(share.placed.masses, "mass", unit).tolist(),
            from_si(share.goal, "mass", unit),
            complex(from_si(share.placed.total, "mass", unit)),
        )
        for share in placing.shares
    ]
    figure = blank()
    places(panels, unit, remove=placing.request.removes, figure=figure)
    return figure


def way(p: Placing, name: str = "") -> list[Topic]:
    """The topics of one correction; `name` of its rotor and plane, where there are several."""
    head = {"of": name} if name else {}
    lead = f"{name}: " if name else ""
    vectors = np.array(
        [
            complex(phasor(np.array(to_si(v.mass, "mass", v.mass_unit)), np.array(v.angle), v.angle_unit))
            for v in p.of.vectors
        ]
    )
    unit = p.of.unit
    goal = sum((share.goal for share in p.shares), 0j) if len(p.shares) == 1 else p.target
    text: list[str | Table] = ["Each correction in components, x = m·cos θ, y = m·sin θ, and their sum:"]
    text.append(
        Table(
            [
                number("mass", "mass", np.abs(vectors), unit),
                number("angle", "angle", degrees(vectors)),
                number("x", "mass", vectors.real, unit),
                number("y", "mass", vectors.imag, unit),
            ],
            (),
            "vectors[]",
        )
    )
    size = float(from_si(abs(p.target), "mass", unit))
    angle = float(degrees(np.array([p.target]))[0])
    text.append(f"  together {figures(size)} {unit} at {figures(angle)}°")
    if goal != p.target:
        other = float(degrees(np.array([goal]))[0])
        text.append(
            f"  to be made on the places: {figures(float(from_si(abs(goal), 'mass', unit)))} {unit} at {figures(other)}°"
        )
    topics = [Topic("target", text, f"{lead}Target", {**head, **_vector_text(p.target)})]
    for share in p.shares:
        its = [m for m in p.masses if m.share is share]
        placed = np.array(
            [phasor(np.array(m.mass), np.array(m.angle), "deg") for m in its], dtype=complex
        ).reshape(-1)
        rows = Table(
            [
                names("position", [str(m.place + 1) for m in its]),
                number("mass", "mass", np.abs(placed), unit),
                number("angle", "angle", degrees(placed)),
                number("x", "mass", placed.real, unit),
                number("y", "mass", placed.imag, unit),
            ],
            ("position",),
            "masses[]",
        )
        total, missed = complex(placed.sum()), complex(share.error)
        at = "" if share.z is None else f" in the plane at z = {figures(share.z)} m"

        def shown(z: complex) -> str:
            scaled = z * float(from_si(1.0, "mass", unit))
            return f"{vector_text(scaled.real, scaled.imag)} {unit}"

        words: list[str | Table] = [
            f"Σ m·e^(iθ) of the masses{at} against what is wanted:",
            rows,
            f"  Σ = {shown(total)}, wanted {shown(share.goal)}, missed by {figures(float(from_si(abs(missed), 'mass', unit)))} {unit}",
        ]
        where = {} if share.z is None else {"z_m": share.z}
        sums = {"sum_kg": [total.real, total.imag], "wanted_kg": [share.goal.real, share.goal.imag]}
        topics.append(Topic("places", words, f"{lead}Masses on their places", {**head, **where, **sums}))
    return topics


def _vector_text(z: complex) -> dict[str, Any]:
    return {"x_kg": z.real + 0.0, "y_kg": z.imag + 0.0}
