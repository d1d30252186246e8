"""The corrections that are placed, and results: masses on their places, corrections and errors, planes; their digits, picture, worked solution."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from balancing import drill_depth
from balancing.picture import Places, places
from balancing.placement_request import Correction, Drill, Placed, Placing, Share, Vector, read_corrections
from balancing.weights import angles_again
from cli.read import options
from dalembert.angles import degrees, phasor
from dalembert.drawing.sheet import blank
from dalembert.results.columns import Column, Table, names, number
from dalembert.results.way import Topic, figures, vector_text
from dalembert.tables.files import SUFFIXES, split_sheet
from dalembert.units import from_si

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from dalembert.arithmetic.doubled import Doubled
    from dalembert.arithmetic.doubled_arrays import Vectors


METHOD = (
    "Without limits the two places next to the correction share it by the sine rule; with limits the places nearest to it are "
    "filled first (least total mass, by linear programming duality); weights from stock by the choice of least error, all "
    "choices compared; weights of fixed mass as the sides of a polygon on a circle, which the correction closes."
)


def corrections_of(words: list[str], rotor: str | None, plane: str | None) -> list[Correction]:
    """Read MASS@ANGLE ..., or one file, with the rotor and the plane to choose from it."""
    if _is_file(words[0]):
        if len(words) > 1:
            raise options.bad("MASS@ANGLE", f"'{words[1]}': expected nothing in addition to a file")
        return read_corrections(words[0], rotor, plane)
    options.refuse("chooses among the corrections of a file: expected a file", rotor=rotor, plane=plane)
    return [Correction("1", "1", [_vector_of(word) for word in words])]


def _is_file(text: str) -> bool:
    """Whether an argument is a file, not a MASS@ANGLE."""
    path, _ = split_sheet(text)
    suffix = Path(path).suffix.lower() in (".csv", ".txt", ".json", *SUFFIXES)
    return text == "-" or suffix or ("@" not in text and Path(path).is_file())


def _vector_of(spec: str) -> Vector:
    """Read `83.5g@308.87deg`."""
    expected = f"'{spec}': expected a mass and an angle, such as 83.5g@308.87deg"
    return Vector(*options.mass_at("MASS@ANGLE", spec, spec, "mass", expected))


def tables(placings: Sequence[Placing]) -> dict[str, Callable[[], Table]]:
    """The tables of a result, the CSV's first."""
    parts = {"masses": lambda: masses(placings), "corrections": lambda: corrections(placings)}
    if placings[0].request.planes is not None:
        parts["planes"] = lambda: planes(placings)
    return parts


def _named(placings: Sequence[Placing], numbers: Iterable[int]) -> tuple[list[Column], list[Column]]:
    """Columns of rotor and plane, where there are several corrections; and the number of the correction, which is not shown.

    A file may have two corrections for one plane of one rotor.
    """
    rows = list(numbers)
    if len(placings) == 1:
        return [], []
    shown = [
        names("rotor", [placings[k].correction.rotor for k in rows]),
        names("plane", [placings[k].correction.plane for k in rows]),
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
    """Columns of masses and their angles."""
    size = None if exact is None else lambda: exact().size
    turn = None if exact is None else lambda: exact().turned(vectors)
    return [
        number(mass, "mass", [abs(vector) for vector in vectors], unit, place=at[0], exact=size),
        number(angle, "angle", [degrees(vector) for vector in vectors], error=turn, place=at[1]),
    ]


def masses(placings: Sequence[Placing]) -> Table:
    """A row for each mass of each correction."""
    unit, request = placings[0].correction.unit, placings[0].request
    every = [(k, mass) for k, placing in enumerate(placings) for mass in placing.masses]
    named, hidden = _named(placings, [k for k, _ in every])
    runs = [SecondRun(placing) for placing in placings]

    def exact(of: Callable[[Made], Doubled]) -> Callable[[], Doubled]:
        return lambda: _joined(of(made) for run in runs for made in run.made)

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
    """A row for each correction: its mass and angle, and the error of the placed masses."""
    unit, request = placings[0].correction.unit, placings[0].request
    named, hidden = _named(placings, range(len(placings)))
    target, error = [each.target for each in placings], [each.error for each in placings]
    whole = [max(abs(share.goal) for share in placing.shares) for placing in placings]
    missed = [abs(left) / size if size else 0.0 for left, size in zip(error, whole, strict=True)]

    def targets() -> Vectors:
        return _one_after_another(SecondRun(placing).target for placing in placings)

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
    """A row for each new plane of each correction: the correction there, and the error of the placed masses."""
    unit = placings[0].correction.unit
    every = [(k, share) for k, placing in enumerate(placings) for share in placing.shares]
    named, _ = _named(placings, [k for k, _ in every])

    def goals() -> Vectors:
        return _one_after_another(goal for placing in placings for goal in SecondRun(placing).goals)

    columns = [
        *named,
        number("z", "length", [share.z or 0.0 for _, share in every], "mm"),
        *_vector(
            "correction_mass", "correction_angle", [share.goal for _, share in every], unit, exact=goals
        ),
        *_vector("error", "error_angle", [share.error for _, share in every], unit),
    ]
    return Table(columns, [column.name for column in named])


class Made(NamedTuple):
    """A mass, its angle in degrees and the depth of its hole, in 32 digits."""

    mass: Doubled
    angle: Doubled
    depth: Doubled


class SecondRun:
    """A placement in 32 digits, with the decimals of the input exact."""

    def __init__(self, placing: Placing) -> None:
        self.placing, self.request = placing, placing.request

    @cached_property
    def target(self) -> Vectors:
        """The sum of the corrections."""
        from dalembert.arithmetic.doubled_arrays import Vectors
        from dalembert.tables.exact import vectors
        from dalembert.tables.table import Numbers

        total = Vectors.of(np.zeros(()))
        for v in self.placing.correction.vectors:
            (size,), angle = (
                Numbers("", v.mass_unit, np.array([v.mass]), "mass").exact,
                Numbers("", v.angle_unit, np.array([v.angle]), "angle"),
            )
            total = total + vectors([size], angle)[0]
        return total

    @cached_property
    def goals(self) -> list[Vectors]:
        """The correction of each plane."""
        from balancing.second_run import ExactMasses
        from dalembert.arithmetic.doubled import Doubled
        from dalembert.tables.exact import written, writtens

        request = self.request
        goal = self.target
        if request.radii is not None:
            of_corrections, of_places = (Doubled.of(written(radius)) for radius in request.radii)
            goal = goal * (of_corrections / of_places)
        goal = -goal if self.placing.opposite else goal
        if request.planes is None:
            return [goal]
        at, planes = request.planes
        shares = -ExactMasses(goal[None], writtens([at]), writtens(planes)).corrections
        return [shares[k] for k in range(len(planes))]

    @cached_property
    def made(self) -> list[Made]:
        """The placed masses."""
        of_share = {
            id(share): self._placed(share, goal)
            for share, goal in zip(self.placing.shares, self.goals, strict=True)
        }
        return [self._made(of_share[id(placed.share)], placed) for placed in self.placing.masses]

    def _made(self, of_share: tuple[Doubled, Doubled], placed: Placed) -> Made:
        from dalembert.arithmetic.doubled import Doubled
        from dalembert.arithmetic.doubled_operations import part

        masses, angles = of_share
        mass, depth, drill = part(masses, placed.place), Doubled(0.0), self.request.drill
        if drill is not None and placed.holes:
            depth = _depth(mass / float(placed.holes), drill)
        return Made(mass, part(angles, placed.place), depth)

    def _placed(self, share: Share, goal: Vectors) -> tuple[Doubled, Doubled]:
        """Return the masses of a plane and their angles in degrees, (n,) each."""
        from dalembert.arithmetic.doubled import PI
        from dalembert.arithmetic.doubled_arrays import DoubledArray
        from dalembert.arithmetic.doubled_operations import doubled_array
        from dalembert.tables.exact import writtens

        request = self.request
        if request.weights is not None:
            masses = writtens(request.weights)
            return masses, angles_again(share.placed, goal, DoubledArray.of(masses)).doubled * 180.0 / PI
        if request.places is None:
            return goal.size * np.ones(1), goal[None].degrees
        places = request.exact_places()
        angles = doubled_array([place % 360 for place in places], (len(places),))
        around: Any = DoubledArray.of(angles)
        arms: Any = phasor(np.ones(len(places)), around, "deg")
        masses = writtens(share.placed.masses)
        if request.stock is None:
            masses = share.placed.second_run(goal, arms, masses)
        return masses, angles


def _depth(mass: Doubled, drill: Drill) -> Doubled:
    """The depth of a hole in 32 digits."""
    from dalembert.arithmetic.doubled import PI, Doubled
    from dalembert.arithmetic.doubled_arrays import DoubledArray
    from dalembert.tables.exact import written

    def stated(x: float) -> Any:
        return DoubledArray.of(Doubled.of(written(x)))

    point = DoubledArray.of(Doubled.of(drill.exact_point) * PI / 180.0) if drill.exact_point != 180 else np.pi
    depth: Any = drill_depth(DoubledArray.of(mass), stated(drill.diameter), stated(drill.density), point)
    exact: Doubled = depth.doubled
    return exact


def _joined(numbers: Iterable[Doubled]) -> Doubled:
    """Numbers as one row."""
    from dalembert.arithmetic.doubled import Doubled

    pairs = [(float(x.high), float(x.low)) for x in numbers]
    return Doubled(*(np.array([pair[k] for pair in pairs]) for k in (0, 1)))


def _one_after_another(vectors: Iterable[Vectors]) -> Vectors:
    """Vectors as one row."""
    from dalembert.arithmetic.doubled_arrays import Vectors

    return Vectors.joined([vector[None] for vector in vectors])


def draw(placing: Placing) -> Figure:
    """Draw for each plane its places with their masses on the rim, target and total as vectors."""
    unit = placing.correction.unit
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
    """The worked solution of one correction; `name` tells it apart from others."""
    head = {"of": name} if name else {}
    lead = f"{name}: " if name else ""
    vectors = np.array(p.vectors)
    unit = p.correction.unit
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
    angle = degrees(p.target)
    text.append(f"  together {figures(size)} {unit} at {figures(angle)}°")
    if goal != p.target:
        other = degrees(goal)
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
                number("mass", "mass", [m.mass for m in its], unit),
                number("angle", "angle", [m.angle for m in its]),
                number("x", "mass", placed.real, unit),
                number("y", "mass", placed.imag, unit),
            ],
            ("position",),
            "masses[]",
        )
        total = complex(placed.sum())
        at = "" if share.z is None else f" in the plane at z = {figures(share.z)} m"

        def shown(z: complex) -> str:
            scaled = z * float(from_si(1.0, "mass", unit))
            return f"{vector_text(scaled)} {unit}"

        words: list[str | Table] = [
            f"Σ m·e^(iθ) of the masses{at} and the correction:",
            rows,
            f"  Σ = {shown(total)}, correction {shown(share.goal)}, error {figures(float(from_si(abs(share.error), 'mass', unit)))} {unit}",
        ]
        where = {} if share.z is None else {"z_m": share.z}
        sums = {"sum_kg": [total.real, total.imag], "wanted_kg": [share.goal.real, share.goal.imag]}
        topics.append(Topic("places", words, f"{lead}Masses on their places", {**head, **where, **sums}))
    return topics


def _vector_text(z: complex) -> dict[str, Any]:
    return {"x_kg": z.real + 0.0, "y_kg": z.imag + 0.0}
