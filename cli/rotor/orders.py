"""Results of an engine: orders, rotating part, counterweights, shafts, residuals; the picture, the worked solution."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from balancing.cylinders import Engine, Shaft
from balancing.engine import Forces, piston_orders
from cli.read import options
from dalembert.angles import degrees
from dalembert.arithmetic.shapes import is_doubled
from dalembert.drawing.amounts import prefixed
from dalembert.drawing.polar import head
from dalembert.drawing.sheet import blank, plain, sheet
from dalembert.errors import quote
from dalembert.results.columns import Column, Table, computed, names, number
from dalembert.results.way import Topic, figures

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from balancing.cylinders import Complex, Real


METHOD = (
    "Each piston's inertia force m·r·ω²·Σ A_k cos kφ with the exact orders A_k of the slider-crank; forces of an order are parts "
    "that turn with and against the crank. Counterweights are opposite to the rotating masses and a share of the reciprocating "
    "ones; shafts are opposite to the part that turns as they do. Couples are Σ z·F about z = 0 (after R. L. Norton, Design of "
    "Machinery, ch. 14; exact orders by the binomial series of the rod's inclination)."
)


KINDS = (("force", "force", False), ("couple", "torque", True))
"""Forces and couples: their name, their dimension, and whether they are couples."""


def read_shafts(texts: Sequence[str], highest: int) -> list[Shaft]:
    """Read `ORDER:Z:with` or `ORDER:Z:against`."""
    shafts: list[Shaft] = []
    for text in texts:
        parts = [part.strip() for part in text.split(":")]
        if len(parts) != 3 or parts[2] not in ("with", "against") or options.whole(parts[0]) < 1:
            raise options.bad(
                "--shaft", f"'{text}': expected ORDER:Z:with or ORDER:Z:against, such as 2:150mm:against"
            )
        shaft = Shaft(
            options.whole(parts[0]), options.needed("--shaft", parts[1], "length"), parts[2] == "against"
        )
        if shaft.order > highest:
            raise options.bad(
                "--shaft", f"'{text}': order {parts[0]} is above the highest: expected --order {parts[0]} too"
            )
        if any((s.order, s.z, s.against) == (shaft.order, shaft.z, shaft.against) for s in shafts):
            raise options.bad("--shaft", f"'{text}': two shafts of one order and sense at one place")
        shafts.append(shaft)
    return shafts


def tables(e: Engine) -> dict[str, Callable[[], Table]]:
    """The tables of a result, the CSV's first."""
    result: dict[str, Callable[[], Table]] = {"orders": lambda: orders(e), "rotating": lambda: rotating(e)}
    result |= {"counterweights": lambda: counterweights(e), "shafts": lambda: shafts(e)}
    result["residual_orders"] = lambda: residual(e)
    if e.counterweights is not None and e.cylinders.horizontal:
        result["locomotive"] = lambda: locomotive(e)
    return result


Of = Callable[[Engine], Any]
"""Numbers of an engine, of floats or in 32 digits."""


def polar(e: Engine, name: str, dimension: str, of: Of, unit: str = "", angle: str = "angle") -> list[Column]:
    """Sizes and angles of vectors."""
    return [
        computed(e, name, dimension, lambda e: np.abs(of(e)), unit),
        number(angle, "angle", degrees(of(e)), exact=lambda: of(e.second).degrees),
    ]


def by_order(e: Engine, forces: str, further: Sequence[Column] = ()) -> list[Column]:
    """The largest force and couple of each order over a turn, and their coefficients of cos kθ and sin kθ."""
    columns = [names("order", list(range(1, e.highest + 1))), *largest(e, forces), *further]
    for name, dimension, couple in KINDS:
        for i, axis in enumerate("xy"):
            for j, part in enumerate(("cos", "sin")):

                def of(e: Engine, couple: bool = couple, i: int = i, j: int = j) -> Any:
                    return getattr(e, forces).coefficients(couple)[:, i, j]

                column = computed(e, f"{name}_{axis}_{part}", dimension, of)
                column.place = f"{name}_{column.unit}.{axis}.{j}"
                columns.append(column)
    return columns


def largest(e: Engine, forces: str, prefix: str = "", place: str | None = "") -> list[Column]:
    def column(name: str, dimension: str, couple: bool) -> Column:
        return computed(
            e, f"{prefix}{name}_max", dimension, lambda e: getattr(e, forces).largest(couple), place=place
        )

    return [column(*kind) for kind in KINDS]


def orders(e: Engine) -> Table:
    """A row for each order."""
    further = largest(e, "residual", "residual_", None) if e.balanced or e.rotating.any() else []
    above = "forces on the frame and couples about z = 0 of the reciprocating masses, coefficients of cos kθ and sin kθ:"
    return Table(by_order(e, "reciprocating", further), ("order",), "orders[]", above)


def residual(e: Engine) -> Table:
    """The orders after counterweights and shafts, the rotating masses included."""
    kept = "reciprocating and rotating masses" + ", counterweights" * (e.counterweights is not None)
    above = f"{kept} and shafts together:" if e.shafts else f"{kept} together:"
    return Table(by_order(e, "residual"), ("order",), "residual_orders[]", above)


def rotating(e: Engine) -> Table:
    """The unbalance of the rotating masses at θ = 0."""
    c = e.cylinders

    def total(e: Engine, z: Any) -> Any:
        vectors = e.rotating * z
        limit = 8e-16 * len(c.names) * np.abs(e.rotating * z).sum()
        return (
            vectors.sum()[None]
            if is_doubled(vectors)
            else np.where(np.abs(vectors.sum()) > limit, vectors.sum(), 0)[None]
        )

    return Table(
        [
            *polar(e, "unbalance", "unbalance", lambda e: total(e, 1.0), c.unbalance_unit),
            *polar(e, "couple", "inertia", lambda e: total(e, e.cylinders.z), angle="couple_angle"),
        ],
        place="rotating",
    )


def counterweights(e: Engine) -> Table:
    """A row for each; none where none are wanted."""
    weights = e.counterweights
    if weights is None:
        return Table([], place="counterweights[]", documented=[names("counterweight", [])])

    def of_weights(e: Engine) -> Any:
        return e.counterweights.unbalance  # type: ignore[union-attr]

    columns = [
        names("counterweight", weights.names),
        number("z", "length", weights.z, e.cylinders.length_unit),
        *polar(e, "unbalance", "unbalance", of_weights, e.cylinders.unbalance_unit),
    ]
    if weights.radius is not None:
        mass = e.cylinders.table.numbers["reciprocating"].unit

        def masses(e: Engine) -> Any:
            return np.abs(of_weights(e)) / e.planes.radius  # type: ignore[union-attr]

        columns.append(computed(e, "mass", "mass", masses, mass))
    return Table(columns, ("counterweight",), "counterweights[]", "at θ = 0")


def shafts(e: Engine) -> Table:
    """A row for each."""
    columns = [
        names("order", [s.order for s in e.shafts]),
        number("z", "length", [s.z for s in e.shafts], e.cylinders.length_unit),
        names("direction", ["against" if s.against else "with" for s in e.shafts]),
        *polar(e, "unbalance", "unbalance", lambda e: e.shaft_unbalances, e.cylinders.unbalance_unit),
    ]
    if not e.shafts:
        return Table([], place="shafts[]", documented=columns)
    return Table(columns, ("order", "z", "direction"), "shafts[]", "at θ = 0")


def locomotive(e: Engine) -> Table:
    """The first order as the driver of a locomotive and the track feel it."""

    def along(couple: bool) -> Of:
        return lambda e: np.hypot(*e.residual.coefficients(couple)[0, 0])

    def blow(e: Engine) -> Any:
        each = np.abs(e.counterweights.for_reciprocating)  # type: ignore[union-attr]
        return each[[each.argmax()]] * e.speed**2

    return Table(
        [
            computed(e, "tractive_effort", "force", along(False)),
            computed(e, "swaying_couple", "torque", along(True)),
            computed(e, "hammer_blow", "force", blow),
        ],
        place="locomotive",
        above="variation of the tractive effort and swaying couple about z = 0 (±, first order), hammer blow of one wheel (±)",
    )


def warnings(e: Engine) -> list[str]:
    """Warnings about shafts and masses."""
    lines = [
        text
        for shaft, unbalance in zip(e.shafts, e.shaft_unbalances, strict=True)
        if (text := idle(e, shaft, unbalance))
    ]
    if not e.cylinders.reciprocating.any():
        lines.append("every reciprocating mass is zero: all orders are zero")
    weights = e.counterweights
    if weights is not None and not weights.unbalance.any():
        lines.append(
            "the counterweights are zero: there is no rotating mass, and no --counterweight-share above 0"
        )
    if e.share and not e.cylinders.rotating.any() and "rotating" not in e.cylinders.table.numbers:
        lines.append("no column rotating_*: the counterweights are for the reciprocating masses alone")
    return lines


def idle(e: Engine, shaft: Shaft, unbalance: complex) -> str:
    """Say why a shaft has nothing to balance; empty where it has."""
    if unbalance:
        return ""
    couple = e.on_the_crank.turning(shaft.order, shaft.against, couple=True)
    named = quote(f"{shaft.order}:{shaft.z:g}m:{'against' if shaft.against else 'with'}")
    if couple:
        return (
            f"--shaft {named}: order {shaft.order} has a couple but no force in this sense: one shaft cannot balance it; "
            "add a second one at another place"
        )
    return (
        f"--shaft {named}: order {shaft.order} has no force in this sense: the shaft has nothing to balance"
    )


ROWS = 3
"""The largest number of orders in the picture: the lowest with forces."""
NAMED = 12
"""The largest number of cylinders with their names in the picture."""


def draw(e: Engine) -> Figure:
    """Draw the vectors of the cylinders one behind the other, and what they add up to."""
    f = e.reciprocating
    sizes = np.abs(f.with_crank).sum(axis=0)
    # an order far below the first is no polygon that anybody needs
    shown = np.flatnonzero(sizes > 1e-4 * sizes.max())[:ROWS]
    parallel = bool((e.cylinders.bank == e.cylinders.bank[0]).all())
    figure = blank()
    columns = 2 if parallel else 4
    sheet(3.6 * columns, 3.5 * max(len(shown), 1) + 0.7, figure)
    figure.suptitle(
        "order polygons of the reciprocating masses: vectors "
        + ("from the cylinders' axis" if parallel else "from +x")
        + " at θ = 0; red: their sum",
        fontsize=10,
    )
    panels = figure.subplots(max(len(shown), 1), columns, squeeze=False)
    z = e.cylinders.z
    for row, k in zip(panels, shown, strict=False):
        if parallel:
            # of a force along one axis the two halves are mirror images
            vectors = 2 * f.with_crank[:, k] * np.exp(-1j * np.radians(e.cylinders.bank))
            parts = [("", vectors)]
        else:
            parts = [(" with the crank", f.with_crank[:, k]), (" against it", f.against[:, k])]
        for j, (sense, of) in enumerate(parts):
            for axes, name, values, unit, couple in (
                (row[j], "force", of, "N", False),
                (row[len(parts) + j], "couple", of * z, "N·m", True),
            ):
                _polygon(
                    axes,
                    f"order {k + 1}: {name}{sense}",
                    values,
                    e.cylinders.names,
                    unit,
                    f.negligible(couple),
                    k,
                )
    return figure


def _polygon(
    axes: Axes, title: str, vectors: Complex, names: list[str], unit: str, negligible: Real, k: int
) -> None:
    """Draw vectors one behind the other."""
    factor, unit = prefixed(float(max(np.abs(vectors).max(initial=0.0), abs(vectors.sum()))), unit)
    ends = np.concatenate([[0.0], np.cumsum(vectors)]) * factor
    total = complex(ends[-1]) if abs(vectors.sum()) > negligible[k] else 0.0
    axes.set_title(f"{title}, {unit}", fontsize=9)
    middle = ends.mean()
    size = float(np.abs(ends[:, None] - ends[None, :]).max()) or 1.0
    placed: list[complex] = []
    for start, stop, name in zip(ends[:-1], ends[1:], names, strict=True):
        if abs(stop - start) < 1e-9 * size:
            continue
        axes.annotate("", (stop.real, stop.imag), (start.real, start.imag), arrowprops=head("0.25", 1.4))
        if len(names) > NAMED:
            continue
        along = (stop - start) / abs(stop - start)
        out = (
            1j * along
            if (((start + stop) / 2 - middle) * (1j * along).conjugate()).real >= 0
            else -1j * along
        )
        at = (start + stop) / 2 + 0.075 * size * out
        # vectors that lie on each other have their names side by side
        while any(abs(at - other) < 0.1 * size for other in placed):
            at += 0.11 * size * out
        placed.append(at)
        axes.annotate(
            name,
            (at.real, at.imag),
            ha="center",
            va="center",
            fontsize=8,
            bbox={"fc": "white", "ec": "none", "pad": 0.6},
            zorder=5,
        )
    if total:
        axes.annotate("", (total.real, total.imag), (0.0, 0.0), arrowprops=head("tab:red", 2.2))
    caption = (
        f"sum {abs(total):.4g} {unit}" if total else "sum 0: closed" if np.abs(vectors).any() else "none"
    )
    axes.set_xlabel(caption, fontsize=9, color="tab:red" if total else "black")
    points = np.array([*ends, *placed])
    center = complex(points.real.max() + points.real.min(), points.imag.max() + points.imag.min()) / 2
    reach = 0.62 * max(float(np.ptp(points.real)), float(np.ptp(points.imag)), 0.3 * size)
    axes.set_xlim(center.real - reach, center.real + reach)
    axes.set_ylim(center.imag - reach, center.imag + reach)
    axes.set_aspect("equal")
    plain(axes)
    axes.tick_params(labelsize=7)
    axes.locator_params(nbins=5)


SHOWN = 1e-12
"""An order whose coefficient is below this share of the first is not listed."""


def way(e: Engine) -> list[Topic]:
    """The worked solution."""
    c, names_of = e.cylinders, e.cylinders.names
    ratios = (c.throw / c.rod).tolist()
    orders = np.array([piston_orders(ratio, e.highest) for ratio in ratios])
    used = [k for k in range(e.highest) if np.abs(orders[:, k]).max() > SHOWN]
    text: list[str | Table] = [
        "Piston: F = m·r·ω²·Σ A_k·cos k(θ + crank − bank) along its axis, A_1 = 1, A_2 = λ + λ³/4 + …, λ = r/l:"
    ]
    size = c.reciprocating * c.throw * e.speed**2
    text.append(
        Table(
            [
                names("cylinder", names_of),
                number("ratio", "number", np.array(ratios)),
                number("m_r_omega2", "force", size, place="size"),
                *(number(f"A{k + 1}", "number", orders[:, k]) for k in used),
            ],
            ("cylinder",),
            "cylinders[]",
        )
    )
    result = [Topic("orders", text, "Orders of each piston")]
    shares: list[list[float]] = []
    f = e.reciprocating
    for i in range(len(names_of)):
        one = Forces(f.z[[i]], f.with_crank[[i]], f.against[[i]])
        shares += one.coefficients()[used].reshape(-1, 4).tolist()
    shares += f.coefficients()[used].reshape(-1, 4).tolist()
    every = [name for name in (*names_of, "sum") for _ in used]
    orders_of = [k + 1 for k in used]
    keys = [names("cylinder", every), _order(orders_of * (len(names_of) + 1))]
    table = Table([*keys, *_parts("", "N", shares)], ("cylinder", "order"), "shares[]")
    result.append(
        Topic("forces", ["Coefficients of cos kθ and sin kθ of each cylinder's force, and their sums:", table], "Shares and sums")
    )  # fmt: skip
    if e.rotating.any():
        u = complex(e.rotating.sum())
        result.append(
            Topic(
                "rotating",
                [f"Rotating masses: Σ m·r·e^(i·crank) = ({figures(u.real)}, {figures(u.imag)}) kg·m"],
                "Rotating masses",
                {"x_kg_m": u.real, "y_kg_m": u.imag},
            )
        )
    weights = e.counterweights
    if weights is not None:
        at = [
            names("counterweight", weights.names),
            *_unbalances(weights.unbalance),
            number("z", "length", weights.z),
        ]
        opposite = Table(at, ("counterweight",), "counterweights[]")
        text = ["Against the rotating masses and the share of the reciprocating ones:", opposite]
        result.append(Topic("counterweights", text))
    if e.shafts:
        at = [
            _order([s.order for s in e.shafts]),
            names("direction", ["against" if s.against else "with" for s in e.shafts]),
            *_unbalances(e.shaft_unbalances),
            number("z", "length", [s.z for s in e.shafts]),
        ]
        turning = Table(at, ("order", "direction", "z_m"), "shafts[]")
        text = [
            "Each turns against the part of its order that turns as it does, F/(order·ω)²; at θ = 0:",
            turning,
        ]
        result.append(Topic("shafts", text, "Balance shafts"))
    if e.balanced:
        forces, couples = (
            e.residual.coefficients(couple)[used].reshape(-1, 4).tolist() for couple in (False, True)
        )
        columns = [_order(orders_of), *_parts("", "N", forces), *_parts("couple_", "N_m", couples)]
        text = [
            "Residual forces and couples with counterweights and balance shafts:",
            Table(columns, ("order",), "orders[]"),
        ]
        result.append(Topic("residual", text, "Residual"))
    return result


def _order(orders: list[int]) -> Column:
    return Column("order", "", list(orders), place="order")


def _parts(prefix: str, unit: str, rows: list[list[float]]) -> list[Column]:
    """The coefficients of cos kθ and sin kθ along x and y, a row for each order."""
    heads = (f"{prefix}{axis}_{part}" for axis in "xy" for part in ("cos", "sin"))
    return [
        Column(head, unit, [row[j] for row in rows], place=f"{head}_{unit}") for j, head in enumerate(heads)
    ]


def _unbalances(vectors: Complex) -> list[Column]:
    return [number("x", "unbalance", vectors.real + 0.0), number("y", "unbalance", vectors.imag + 0.0)]
