"""`dalembert balance`: rotors whose eccentric masses are known."""

from __future__ import annotations

from functools import partial
from types import SimpleNamespace
from typing import TYPE_CHECKING

from cli.read.options import (
    bad,
    in_degrees,
    needed,
    number_or_quantity,
    processes,
    quantity,
    refuse,
    two_bearings,
    with_unit,
)
from cli.show.output import command

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from balancing.planes import Planes
    from cli.show.commands import ShowOptions
    from dalembert.results.result import Result
    from dalembert.results.way import Topic


OPTIONS = """
Arguments:
  table TABLE  CSV of eccentric masses; - is standard input.
What:
  plane NAME[:Z]:RADIUS...  Correction plane, such as A:0mm:20mm; repeatable. One plane: static balancing.
  planes FILE.csv  Table of planes: plane, z_*, radius_*, rotor.
  mass NAME:MASS...  Mass of a plane's correction, such as A:7kg. With --plane A:0mm:? the command computes the radius.
  gravity G=9.80665  Acceleration of gravity, m/s².
How:
  remove  Give the material to remove (default: to add).
  round_mass MASS  Round the corrections to this step, such as 0.1g.
  round_angle ANGLE  Round the angles to this step, such as 1deg.
  modes FILE.csv  Flexible rotor: table of mode shapes, z_* and columns.
Tolerance:
  center_z Z  Axial position of the centre of mass: reference of the couple, and of the shares of the tolerance.
  grade GRADE  Balance quality grade, such as G2.5 (ISO 21940-11), API (4W/N) or MIL (MIL-STD-167-1).
  speed SPEED  Highest service speed, such as 3000rpm.
  rotor_mass MASS  Mass of the rotor, such as 12kg.
  permissible UNBALANCE  Permissible residual unbalance, such as 30g_mm.
  bearings Z1:Z2  Bearing planes, where the tolerance holds (default: the correction planes). With --speed: show the bearing forces.
Output:
  page FILE(.html)  Write a page that computes, with a table of masses to edit.
Further options (docs/commands.md describes them):
  mode_count N  With --modes: use the first N modes (default: all).
  rigid  With --modes: balance force and couple too, which takes two planes more.
  workers N=1  Number of processes for many rotors.
"""


@command(OPTIONS, example="riul-rotor")
def run(options: SimpleNamespace, show: ShowOptions) -> Result:
    """Balance rotors from a table of known eccentric masses, in one, two or more planes.

    TABLE has the columns mass_* and radius_* (or weight_* and radius_*, or unbalance_*), angle_* and z_*, and
    optionally rotor and name. The star is a unit: mass_kg, radius_mm, angle_deg, z_mm. One plane needs no z_*.
    Angles are counter-clockwise as seen against +z.
    """
    # numpy and all that needs it are loaded only once the command line itself is in order
    from balancing.planes import read_planes
    from cli.balance.rotors import Balancing, Carried, Request, read_rotors
    from cli.balance.tables import METHOD, MODAL, tables, warnings
    from cli.read.rotor_options import from_options, tolerance_of
    from dalembert.results.result import Result

    if (options.plane is None) == (options.planes is None):
        raise bad("--plane", "expected --plane (once or more) or --planes FILE.csv")
    g = number_or_quantity("--gravity", options.gravity, "acceleration")
    if not 1e-9 < g < 1e9:
        raise bad("--gravity", f"'{options.gravity}': expected a positive number of m/s²")
    if options.modes is None:
        refuse("needs --modes", mode_count=options.mode_count, rigid=options.rigid)
    else:
        refuse("shows rigid balancing: it does not go with --modes", mass=options.mass)
    shapes = None
    if options.modes is not None:
        from balancing.mode_shapes import read_modes

        try:
            shapes = read_modes(options.modes, options.mode_count, options.rigid)
        except ValueError as error:
            raise bad("--mode-count", error) from None
    chosen = (
        read_planes(options.planes)
        if options.planes is not None
        else from_options(options.plane or [], sought=True)
    )
    carried = None
    if options.bearings is not None and options.speed is not None and shapes is None:
        carried = Carried(
            two_bearings("--bearings", options.bearings),
            needed("--speed", options.speed, "speed", positive=True),
            quantity("--rotor-mass", options.rotor_mass, "mass", positive=True),
        )
    only_forces = carried is not None and options.grade is None and options.permissible is None
    request = Request(
        gravity=g,
        remove=options.remove,
        mass_step=with_unit("--round-mass", options.round_mass, "mass", positive=True),
        angle_step=None
        if options.round_angle is None
        else in_degrees("--round-angle", options.round_angle, positive=True),
        center=quantity("--center-z", options.center_z, "length"),
        tolerance=None
        if only_forces
        else tolerance_of(
            options.grade, options.speed, options.rotor_mass, options.permissible, options.bearings
        ),
        masses=_masses(options.mass or [], chosen),
        carried=carried,
        modes=shapes,
    )
    needs_z = chosen.several or carried is not None or shapes is not None
    rotors = read_rotors(options.table, g, needs_z=needs_z)
    if carried is not None and chosen.z is None:
        raise bad("--bearings", "the forces need the place of the plane: --plane NAME:Z:RADIUS")
    with processes(options.workers) as executor:
        balancing = Balancing(rotors, chosen, request, executor)

    def figure(*, polygons: bool = False) -> Figure:
        from cli.balance.page import draw

        return draw(balancing, polygons=polygons)

    def way() -> list[Topic]:
        from cli.balance.way import way

        return way(balancing)

    def sheet() -> bytes:
        from cli.balance.page import sheet

        return sheet(balancing).html.encode()

    return Result(
        tables=tables(balancing),
        requested=("bearings",) if request.tolerance is None else ("tolerance",),
        beside={} if options.page is None else {options.page: sheet},
        head={"correction": "remove" if options.remove else "add"},
        figure=figure,
        # the worked solution of a report has the polygons itself
        plotted=partial(figure, polygons=show.steps),
        way=way,
        method=METHOD if shapes is None else MODAL,
        about={"title": "Balancing of known masses"},
        warnings=[*rotors.table.warnings, *(shapes.warnings if shapes else []), *warnings(balancing)],
    )


def _masses(texts: list[str], planes: Planes) -> dict[str, float]:
    """Read `NAME:MASS`, and refuse a radius that is sought without a mass."""
    masses: dict[str, float] = {}
    for text in texts:
        name, colon, amount = text.rpartition(":")
        if not colon or name.strip() not in planes.name:
            names = ", ".join(dict.fromkeys(planes.name))
            raise bad("--mass", f"'{text}': expected NAME:MASS with one of the planes {names}, such as A:7kg")
        if name.strip() in masses:
            raise bad("--mass", f"the mass of plane {name.strip()} is given twice")
        masses[name.strip()] = needed("--mass", amount, "mass", positive=True)
    for name, radius in zip(planes.name, planes.radius.tolist(), strict=True):
        if radius != radius and name not in masses:
            raise bad("--plane", f"the radius of plane {name} is ?: expected --mass {name}:MASS too")
    return masses
