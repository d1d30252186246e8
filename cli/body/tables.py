"""What is computed of a body and its motion: one list of quantities, of which table, terminal and JSON are made; the picture."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from cli.body.moving import AXES, CorrectionMass, MovingBody
from dalembert.angles import degrees
from dalembert.drawing.sheet import blank
from dalembert.results.columns import Column, Table, document_unit, names, number, stacked
from dalembert.units import G0
from rigidbody3d.parts import SEVERAL
from rigidbody3d.picture import views

if TYPE_CHECKING:
    from matplotlib.figure import Figure, FigureBase

METHOD = (
    "Tensors of the parts moved by Steiner's theorem, turned and added; principal moments by the eigenvalues; angular momentum "
    "H = I·ω and its true rate in any axes; d'Alembert's inertia wrench (J. A. Riul, Dinâmica das Máquinas, unit II, eqs. "
    "22–47; F. P. Beer, E. R. Johnston, Vector Mechanics for Engineers: Dynamics, ch. 18)."
)


Bodies: TypeAlias = Sequence[MovingBody]
DRAWN = 4
"""The largest number of bodies in a picture."""


class Entry(NamedTuple):
    """A scalar or a vector, the errors of its components, its place in JSON (None: nowhere), what it is a part of."""

    name: str
    dimension: str
    of: Callable[[], ArrayLike]
    error: Callable[[], ArrayLike]
    place: str | None = ""
    owner: str = ""

    @property
    def value(self) -> ArrayLike:
        """Its numbers, worked out now."""
        return self.of()

    def column(self, lay: Callable[[list[float]], list[float | None]]) -> Column:
        """Return it as a column in which its numbers, and their errors, are laid so."""

        def error() -> list[float]:
            return [bound or 0.0 for bound in lay(_numbers(self.error()))]

        return Column(self.name, document_unit(self.dimension), lay(_numbers(self.value)), error)

    @property
    def documented(self) -> Column | None:
        """Its place in the document, as a column of one row."""
        if self.place is None:
            return None
        head, dot, index = (self.place or self.name).partition(".")
        unit = document_unit(self.dimension)
        value = (np.asarray(self.value, dtype=float) + 0.0).tolist()
        return Column(
            self.name, unit, [None], place=f"{head}_{unit}".rstrip("_") + dot + index, stored=[value]
        )


def _entry(
    b: MovingBody,
    name: str,
    dimension: str,
    of: Callable[[MovingBody], Any],
    place: str | None = "",
    owner: str = "",
) -> Entry:
    """A quantity: its error is what it differs by from the second run, in 32 digits."""
    return Entry(name, dimension, partial(of, b), lambda: of(b.second).off(of(b)), place, owner)


def _of_body(b: MovingBody) -> Iterator[Entry]:
    yield _entry(b, "mass", "mass", lambda b: b.body.mass)
    yield _entry(b, "center", "length", lambda b: b.body.center)
    tensors: dict[str, Part] = {"inertia": lambda b, i: b.body.inertia[i]}
    if b.request.about is not None:
        tensors["inertia_about"] = lambda b, i: b.body.about(b.point)[i]
    for name, row in tensors.items():
        for i, letter in enumerate("xyz"):
            yield _entry(b, f"{name}_{letter}", "inertia", _numbered(row, i), f"{name}.{i}", name)
    yield Entry("principal", "inertia", lambda: b.body.principal.moments, lambda: b.principal_errors[0])
    for i in range(3):
        axis = partial(_numbered(lambda b, k: b.body.principal.axes[k], i), b)
        error = partial(_numbered(lambda b, k: b.principal_errors[1][k], i), b)
        yield Entry(f"principal_axis_{i + 1}", "number", axis, error, f"principal_axes.{i}", "principal_axes")


Part: TypeAlias = Callable[[MovingBody, int], Any]
"""A row of a matrix of a body, or what one of its bearings bears, by its number."""


def _numbered(part: Part, i: int) -> Callable[[MovingBody], Any]:
    return lambda b: part(b, i)


def _of_motion(b: MovingBody) -> Iterator[Entry]:
    yield _entry(b, "momentum", "angular momentum", lambda b: b.motion.momentum)
    yield _entry(b, "momentum_about", "angular momentum", lambda b: b.motion.momentum_about(b.point))
    yield _entry(b, "momentum_rate", "torque", lambda b: b.motion.rate)
    yield _entry(b, "rate_relative", "torque", lambda b: b.motion.relative, "rate_terms.relative")
    yield _entry(b, "rate_transport", "torque", lambda b: b.motion.transport, "rate_terms.transport")
    yield _entry(b, "momentum_rate_about", "torque", lambda b: b.motion.rate_about(b.point))
    yield _entry(b, "inertia_force", "force", lambda b: b.motion.inertia_force)
    yield _entry(b, "inertia_moment", "torque", lambda b: b.motion.inertia_wrench.moment)
    yield _entry(b, "energy", "energy", lambda b: b.motion.energy)


def _of_shaft(b: MovingBody) -> Iterator[Entry]:
    """Forces of the bearings across the axis; the first takes the axial force."""
    forces: dict[str, Part] = {
        "static": lambda b, i: b.static_force(i),
        "dynamic": lambda b, i: b.drawn(b.shaft.dynamic[i]),
    }
    if b.correction is not None:
        forces["corrected"] = lambda b, i: b.drawn(b.corrected[i])
    for i in range(2):
        for kind, of in forces.items():
            yield _entry(b, f"bearing{i + 1}_{kind}", "force", _numbered(of, i), None, f"bearing{i + 1}")
    yield _entry(b, "drive_torque", "torque", lambda b: b.shaft.drive_torque, None)


CORRECTIONS = "corrections"
"""The name of the masses of correction planes, which have a row each."""
Only: TypeAlias = Collection[str] | None
"""The names of quantities, or of what they are parts of, that --only has; None: all. Nothing else is worked out."""


def _entries(b: MovingBody, only: Only = None) -> list[Entry]:
    """Return what is shown, in the order in which it is shown."""
    every = [
        *_of_body(b),
        *(_of_motion(b) if b.moving else ()),
        *(_of_shaft(b) if b.request.shaft is not None else ()),
    ]
    return [entry for entry in every if only is None or entry.name in only or entry.owner in only]


def _masses(b: MovingBody, only: Only) -> Sequence[CorrectionMass]:
    return b.corrections if only is None or CORRECTIONS in only else ()


def names_of(b: MovingBody) -> list[str]:
    """What --only can name: the quantities, and what several of them are parts of."""
    words = [word for entry in _entries(b) for word in (entry.owner, entry.name) if word]
    return list(dict.fromkeys([*words, *([CORRECTIONS] if b.correction is not None else [])]))


def tables(bodies: Bodies, only: Only = None) -> dict[str, Callable[[], Table]]:
    """The tables of a result, the CSV's first."""
    made: dict[str, Callable[[MovingBody], Table]] = {"body": partial(axes, only=only)}
    made["document"] = of_document if only is None else partial(of_few, only=only)
    if bodies[0].request.shaft is not None:
        if only is None or any(entry.owner.startswith("bearing") for entry in _entries(bodies[0], only)):
            made["bearings"] = bearings
        if only is None or CORRECTIONS in only:
            made["corrections"] = corrections
    return {name: partial(every, bodies, table) for name, table in made.items()}


def every(bodies: Bodies, table: Callable[[MovingBody], Table]) -> Table:
    """Return the table of one body, or those of several below each other."""
    if not bodies[0].parts.several:
        return table(bodies[0])
    return stacked([table(b) for b in bodies], SEVERAL, [b.parts.body for b in bodies], "bodies[]")


def axes(b: MovingBody, only: Only = None) -> Table:
    """A row for each axis, then one for each correction plane; scalars stand in the first row."""
    masses = _masses(b, only)
    below = len(masses)

    def in_rows(numbers: list[float]) -> list[float | None]:
        return [*numbers, *[None] * (3 - len(numbers) + below)]

    def of_correction(name: str) -> list[float]:
        return [0.0, 0.0, 0.0, *(getattr(bound, name) for bound in b.correction_errors)]

    columns = [Column("axis", "", [*"xyz", *(c.plane for c in masses)])]
    columns += [entry.column(in_rows) for entry in _entries(b, only)]
    units = {"z": "m", "radius": "m", "unbalance": "kg_m", "mass": "kg", "angle": "deg"}
    for name, unit in units.items() if masses else ():
        values = [None, None, None, *(getattr(c, name) for c in masses)]
        error = None if unit == "m" else partial(of_correction, name)
        columns.append(Column(f"correction_{name}", unit, values, error))
    return Table(columns, keys=("axis",))


def quantities(b: MovingBody, only: Only = None) -> Table:
    """The terminal's table: a row for each quantity, then mass and angle of each correction."""

    def in_cells(numbers: list[float]) -> list[float | None]:
        return [*numbers, None, None, None] if len(numbers) == 1 else [None, *numbers]

    def of_correction(i: int, name: str) -> float:
        return float(getattr(b.correction_errors[i], name))

    entries = _entries(b, only)
    for i, c in enumerate(_masses(b, only)):
        for name in ("mass", "angle"):
            value = partial(getattr, c, name)
            entries.append(Entry(f"plane {c.plane}: {name}", name, value, partial(of_correction, i, name)))
    rows = [entry.column(in_cells) for entry in entries]

    def bounds(k: int) -> list[float]:
        return [in_cells(_numbers(entry.error()))[k] or 0.0 for entry in entries]

    columns = [Column("quantity", "", [row.header for row in rows])]
    columns += [
        Column(name, "", [row.values[k] for row in rows], partial(bounds, k))
        for k, name in enumerate(("value", "x", "y", "z"))
    ]
    return Table(columns, above=conventions(b))


def numbers_of(b: MovingBody) -> dict[str, tuple[float, str]]:
    """Every number by its name, such as momentum.x, momentum.size, A.mass, and its unit."""
    numbers = {}
    for entry in _entries(b):
        if entry.name.startswith("principal_axis"):
            continue
        unit = document_unit(entry.dimension)
        values = _numbers(entry.value)
        letters = "123" if entry.name == "principal" else AXES
        if len(values) == 1:
            numbers[entry.name] = values[0], unit
            continue
        for letter, value in zip(letters, values, strict=True):
            numbers[f"{entry.name}.{letter}"] = value, unit
        if letters == AXES and not entry.name.startswith("inertia_"):
            numbers[f"{entry.name}.size"] = float(np.linalg.norm(values)), unit
    for c in b.corrections:
        numbers |= {f"{c.plane}.mass": (c.mass, "kg"), f"{c.plane}.angle": (c.angle, "deg")}
    return numbers


def of_document(b: MovingBody) -> Table:
    """The document without the lists of the shaft: every quantity, of a motion that is none too."""
    entries = [*_of_body(b), *_of_motion(b)]
    columns = [each for entry in entries if (each := entry.documented) is not None]
    after = next(k for k, column in enumerate(columns) if column.name == "momentum")
    columns.insert(after, _one("about", "length", b.point))
    columns.append(names("products", ["+∫xy dm; the matrix carries -I_xy"]))
    if b.request.shaft is not None:
        shaft = b.shaft
        columns += [
            _one("axial", "force", float(shaft.axial), "shaft.axial"),
            _one("drive_torque", "torque", float(shaft.drive_torque), "shaft.drive_torque"),
            _one("static", "unbalance", float(np.abs(shaft.static_unbalance)), "shaft.static_unbalance"),
            _one("static_angle", "angle", float(degrees(shaft.static_unbalance)), "shaft.static_angle"),
        ]
        if b.letters != "xyz":
            columns.append(_one("axes", "number", b.shaft_axes, "shaft.axes"))
    return Table([], place="", documented=columns)


def of_few(b: MovingBody, only: Only) -> Table:
    """The document of those that --only names, without the lists of the shaft."""
    entries = _entries(b, only)
    columns = [each for entry in entries if (each := entry.documented) is not None]
    if any(entry.name == "drive_torque" for entry in entries):
        columns.append(_one("drive_torque", "torque", float(b.shaft.drive_torque), "shaft.drive_torque"))
    return Table([], place="", documented=columns)


def _one(name: str, dimension: str, value: ArrayLike, place: str = "") -> Column:
    """A quantity of the document alone."""
    unit = document_unit(dimension)
    return Column(
        name,
        unit,
        [None],
        place=f"{place or name}_{unit}".rstrip("_"),
        stored=[np.asarray(value, float).tolist()],
    )


def bearings(b: MovingBody) -> Table:
    """The bearings' forces, of the document alone: across a shaft along z, along the axes drawn for another."""
    shaft, request = b.shaft, b.request.shaft
    assert request is not None
    forces = {"static": shaft.static, "dynamic": shaft.dynamic}
    if b.correction is not None:
        forces["corrected_dynamic"] = b.corrected
    columns = [number("z", "length", request.bearings)]
    for name, of in forces.items():
        shown = of if b.letters == "xyz" else np.array([b.drawn(force) for force in of])
        values = (np.asarray(shown) + 0.0).tolist()
        columns.append(Column(name, "N", values, place=f"{name}_N", stored=values))
    return Table([], place="shaft.bearings[]", documented=columns)


def corrections(b: MovingBody) -> Table:
    """A row for each correction plane of the shaft, of the document alone."""
    masses = b.corrections
    columns = [
        names("plane", [c.plane for c in masses]),
        number("z", "length", [c.z for c in masses]),
        number("radius", "length", [c.radius for c in masses]),
        number("unbalance", "unbalance", [c.unbalance for c in masses]),
        number("mass", "mass", [c.mass for c in masses]),
        number("weight", "force", [c.mass * G0 for c in masses]),
        number("angle", "angle", [c.angle for c in masses]),
    ]
    return Table([], place="shaft.corrections[]", documented=columns)


def warnings(bodies: Bodies) -> list[str]:
    """Warnings about parts and motion."""
    lines = []
    for b in bodies:
        of = f"body {b.parts.body}: " if b.parts.several else ""
        lines += [*b.parts.warnings, *(f"{of}{line}" for line in _warnings(b))]
    return lines


def _warnings(b: MovingBody) -> list[str]:
    """Warn of options that mean nothing, where eq. 44 with a constant tensor would go wrong, and of a couple that stays."""
    lines = []
    motion, shaft = b.motion, b.request.shaft
    if not b.moving:
        idle = {"--fixed": b.request.fixed, "--frame-omega": b.request.frame_omega}
        lines += [
            f"{option}: the body is at rest: expected --omega or --alpha too"
            for option, value in idle.items()
            if value is not None
        ]
    if shaft is not None and not (shaft.speed or shaft.speed_rate or any(shaft.gravity)):
        lines.append(
            "the shaft is at rest and has no weight: no force on the bearings without --speed, --speed-rate or --gravity"
        )
    if motion.frame_omega is not None:
        size = np.abs(motion.momentum).max() * max(
            np.abs(motion.omega).max(), np.abs(motion.frame_omega).max()
        )
        if np.abs(motion.tensor_rate).max() > 1e-12 * size:
            wrong = motion.rate - motion.tensor_rate
            lines.append(
                "the inertia tensor is not constant in the axes that --frame-omega turns: the relative rate contains its change too; "
                f"eq. 44 with a constant tensor would give {', '.join(f'{x:.6g}' for x in wrong)} N·m"
            )
    if len(b.corrections) == 1:
        lines.append("one correction plane balances the static unbalance only: the couple stays")
    return lines


def conventions(b: MovingBody) -> str:
    """Say which conventions hold."""
    count = len(b.parts.name)
    lines = [
        f"{count} part{'s' * (count != 1)}; inertia at the centre of mass, products as +∫xy dm (the matrix carries -I_xy)"
    ]
    about = ", ".join(f"{x:g}" for x in b.point)
    if b.moving:
        lines.append(f"momentum at the centre of mass, and about {about} m; rates are true ones")
    if b.request.about is not None:
        lines.append(f"inertia_about: the tensor about {about} m")
    if b.request.shaft is not None:
        lines.append("bearing forces act on the shaft; dynamic ones leave the static part out")
        if b.letters != "xyz":
            lines.append(f"places and angles on the shaft: {axis_words(b)}")
    return "\n".join(lines)


def axis_words(b: MovingBody) -> str:
    """Say where places along a shaft and angles about it begin."""
    letters = b.letters
    if letters != "ξηζ":
        return f"along {letters[2]} from the origin; angles from {letters[0]} towards {letters[1]}"
    first, second, along = (
        f"({', '.join(f'{x:.6g}' for x in axis)})" for axis in (b.shaft_axes + 0.0).tolist()
    )
    return f"along ζ = {along} from the origin; angles from ξ = {first} towards η = {second}"


def draw(bodies: Bodies) -> Figure:
    """Draw the body, or the first ones of several below each other."""
    figure = blank()
    if not bodies[0].parts.several:
        _draw(bodies[0], figure)
        return figure
    shown = bodies[:DRAWN]
    height = 5.6 if bodies[0].request.shaft is None else 7.4
    figure.set_size_inches(11.5, height * len(shown))
    figure.set_layout_engine("constrained")
    for b, part in zip(shown, figure.subfigures(len(shown), 1, squeeze=False)[:, 0], strict=True):
        part.suptitle(f"body {b.parts.body}", fontsize=11)
        _draw(b, part)
    return figure


def _draw(b: MovingBody, figure: FigureBase) -> None:
    """Draw a body in two views; below them, for a shaft, the forces of the bearings."""
    parts, motion = b.parts, b.motion
    vectors = {"angular velocity": motion.omega, "angular momentum": motion.momentum, "its rate": motion.rate}
    if b.request.shaft is None:
        views.body(parts.each.solids(), parts.name, parts.whole.whole(), vectors, figure)
        return
    solids, whole = b.upright(parts.each).solids(), b.shaft.body.whole()
    vectors = {name: b.shaft_axes @ vector for name, vector in vectors.items()}
    forces = {"static": b.shaft.static} if any(b.request.shaft.gravity) else {}
    forces["dynamic"] = b.shaft.dynamic
    if b.correction is not None:
        forces["dynamic, after correction"] = b.corrected
    views.shaft(solids, parts.name, whole, b.shaft.bearings, forces, vectors, figure, b.letters)


def _numbers(value: ArrayLike) -> list[float]:
    numbers: list[float] = np.atleast_1d(np.asarray(value, dtype=float) + 0.0).tolist()
    return numbers
