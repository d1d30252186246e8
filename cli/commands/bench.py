"""`dalembert bench`: run time against error."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from importlib import import_module
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cli.errors import nearest
from cli.render import Json, Output, Plot, Shown, Text, show

if TYPE_CHECKING:
    from cli.bench.measure import Measurement

# domain -> (module with a function `measure`, what it measures)
DOMAINS = {
    "rotors": ("cli.bench.rotors", "corrections of rotors with known masses"),
}


def run(
    name: Annotated[
        list[str] | None, typer.Argument(metavar="[NAME]...", help=f"Domains: {', '.join(DOMAINS)}.")
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Smaller sizes.")] = False,
    json: Json = False,
    output: Output = None,
    plot: Plot = None,
    text: Text = False,
) -> None:
    """Measure run time against error, for each method the program offers.

    Times are CPU times per item, also as multiples of a calibration loop measured in the same run (one element of
    √(x² + y²) over 4096 doubles), so that results from different machines compare. Errors are against answers of
    extended precision.
    """
    for domain in name or ():
        if domain not in DOMAINS:
            raise typer.BadParameter(
                f"'{domain}': expected some of {', '.join(DOMAINS)}{nearest(domain, DOMAINS)}"
            )
    measurements = list(_measure(name or list(DOMAINS), quick))
    columns: dict[str, list[Any]] = {
        "domain": [m.domain for m in measurements],
        "work": [m.work for m in measurements],
        "method": [m.method for m in measurements],
        "size": [m.size for m in measurements],
        "time_ns": [m.ns for m in measurements],
        "time_units": [m.units for m in measurements],
        "error": [m.error for m in measurements],
        "aim_ns": [m.aim_ns for m in measurements],
        "aim_error": [m.aim_error for m in measurements],
    }
    show(
        Shown(
            document=lambda: {
                "measurements": [
                    dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)
                ]
            },
            columns=columns,
            keys=("domain", "work", "method", "size"),
            figure=lambda: import_module("cli.plots.bench").draw(measurements),
        ),
        json=json,
        output=output,
        plot=plot,
        text=text,
    )


def _measure(domains: list[str], quick: bool) -> Iterator[Measurement]:
    for domain in domains:
        module, line = DOMAINS[domain]
        print(f"measuring {domain}: {line}", file=sys.stderr)
        yield from import_module(module).measure(quick)
