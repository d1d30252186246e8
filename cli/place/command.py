"""`dalembert place`: a correction put where masses can go."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from cli.place.read import Request, read_drill, read_planes, read_ratio, read_stock, read_vector
from cli.read import options
from cli.show.output import command

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cli.show.columns import Result


EXAMPLE = "blades"
PANELS = {
    "What": "positions blades first stock pieces max_pieces max_mass",
    "How: elsewhere": "at_radius to_radius at_z to_z",
    "How: drilling": "drill density drill_point max_depth remove",
}


@command
def run(
    corrections: Annotated[
        list[str],
        typer.Argument(metavar="MASS@ANGLE ...", help="Corrections to ADD, such as 83.5g@308.87deg."),
    ],
    positions: Annotated[
        str | None, typer.Option(metavar="ANGLES", help="Where masses can go, such as 292.5deg,315deg.")
    ] = None,
    blades: Annotated[
        int | None,
        typer.Option(
            metavar="N", min=1, max=options.PLACES, help="So many places, evenly spaced, numbered from 1."
        ),
    ] = None,
    first: Annotated[str, typer.Option(metavar="ANGLE", help="Angle of the first blade.")] = "0deg",
    max_mass: Annotated[
        str | None, typer.Option(metavar="MASS", help="Limit of each place, such as 5g.")
    ] = None,
    stock: Annotated[
        str | None, typer.Option(metavar="MASSES", help="Weights in stock, such as 1g,2g,5g; one a place.")
    ] = None,
    pieces: Annotated[
        int, typer.Option(metavar="N", min=1, help="How many weights from stock go on one place.")
    ] = 1,
    max_pieces: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="How many weights from stock altogether.")
    ] = None,
    at_radius: Annotated[
        str | None, typer.Option(metavar="R", help="Radius the corrections were found for.")
    ] = None,
    to_radius: Annotated[str | None, typer.Option(metavar="R", help="Radius the masses go to.")] = None,
    at_z: Annotated[
        str | None, typer.Option(metavar="Z", help="Where along the shaft the corrections were found for.")
    ] = None,
    to_z: Annotated[
        str | None,
        typer.Option(
            metavar="Z1:Z2", help="Carry them over to these planes, with the same force and moment."
        ),
    ] = None,
    drill: Annotated[
        str | None, typer.Option(metavar="DIAMETER", help="Remove material instead, by drilling opposite.")
    ] = None,
    density: Annotated[
        str | None,
        typer.Option(metavar="DENSITY", help="Density of the material drilled, such as 7850kg_m3."),
    ] = None,
    drill_point: Annotated[
        str, typer.Option(metavar="ANGLE", help="Point angle of the drill, such as 118deg; 180deg is flat.")
    ] = "180deg",
    max_depth: Annotated[
        str | None, typer.Option(metavar="DEPTH", help="Deepest hole; more are drilled at a place if needed.")
    ] = None,
    remove: Annotated[
        bool,
        typer.Option(
            "--remove", help="The vectors are material to REMOVE already: drill there, not opposite."
        ),
    ] = False,
) -> Result:
    """Put a correction where masses can go: holes, blades, weights in stock, another radius, drilling.

    Several corrections are combined first. Without --positions or --blades the result is the one mass.
    """
    vectors = [read_vector(spec) for spec in corrections]
    ratio = read_ratio(at_radius, to_radius)
    drilled = read_drill(drill, density, drill_point, max_depth)
    weights = read_stock(stock)
    if weights is not None and drilled is not None:
        raise options.bad("--stock", "weights from stock are not drilled: expected --stock or --drill")
    moved = read_planes(at_z, to_z)
    chosen = options.places(positions, blades, first)
    if weights is not None and chosen is None:
        raise options.bad("--stock", "expected --positions or --blades for the weights to go to")
    limit = options.quantity("--max-mass", max_mass, "mass", positive=True)
    from cli.place import columns, words
    from cli.place.solve import Placing
    from cli.show.columns import Result

    found = Placing(
        Request(vectors, chosen, limit, weights, pieces, max_pieces, ratio, drilled, moved, remove)
    )

    def figure() -> Figure:
        from cli.place.picture import draw

        return draw(found)

    return Result(
        document=lambda: columns.document(found),
        tables={"masses": lambda: columns.masses(found)},
        notes=lambda: words.notes(found),
        afterword=lambda: words.error(found),
        figure=figure,
        method=words.METHOD,
        about={"title": "Placement of a correction"},
        warnings=found.warnings,
    )
