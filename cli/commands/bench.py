"""`dalembert bench`: run time against error."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cli.errors import nearest, one_line
from cli.read import options
from cli.show.output import Json, Output, Plot, Shown, Text, show

if TYPE_CHECKING:
    from cli.bench.measure import Measurement

# domain -> (module with a function `measure`, what it measures)
DOMAINS = {
    "mechanisms": ("cli.bench.mechanisms", "mechanisms in motion, their torque and joint forces"),
    "skipping": ("cli.bench.skipping", "what is saved where less is asked for"),
    "rotors": ("cli.bench.rotors", "corrections of rotors with known masses"),
    "field": ("cli.bench.field", "corrections from measured vibration"),
    "bodies": ("cli.bench.bodies", "angular momentum, its rate and inertia forces of rigid bodies"),
    "rotation": ("cli.bench.rotation", "free rotation in closed form and integrated"),
    "commands": ("cli.bench.commands", "whole commands from start to end"),
}


def run(
    name: Annotated[
        list[str] | None, typer.Argument(metavar="[NAME]...", help=f"Domains: {', '.join(DOMAINS)}.")
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Smaller sizes.")] = False,
    peers: Annotated[
        bool, typer.Option("--peers", help="The same work with other packages, where they are installed.")
    ] = False,
    docs: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.md",
            help="Write tables into FILE.md, between its marks <!-- bench:DOMAIN --> and <!-- end --> (--stress: "
            "<!-- bench:stress -->), and pictures into the folder pictures beside it.",
            dir_okay=False,
        ),
    ] = None,
    stress: Annotated[
        str | None,
        typer.Option(metavar="TIME", help="Run the random campaigns for this long instead, such as 10min."),
    ] = None,
    fuzz: Annotated[
        int | None,
        typer.Option(metavar="N", min=1, help="Run N damaged inputs through the commands instead."),
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(
            min=0,
            help="The seed of the first case of --stress and --fuzz. Alone: this one case of each campaign again; "
            "--fuzz 1 --seed N: this one input.",
        ),
    ] = None,
    workers: Annotated[int, typer.Option(min=1, help="Processes for --fuzz.")] = 1,
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
    if fuzz is not None:
        if stress is not None or name:
            raise options.bad("--fuzz", "runs alone: expected no --stress and no names")
        _fuzz(fuzz, seed or 0, workers, json=json, text=text, output=output)
        return
    if stress is not None or seed is not None:
        seconds = options.quantity("--stress", stress, "time", positive=True)
        _stress(name or [], seconds, seed or 0, docs, json=json, text=text, output=output)
        return
    for domain in name or ():
        if domain not in DOMAINS:
            raise typer.BadParameter(
                f"'{domain}': expected some of {', '.join(DOMAINS)}{nearest(domain, DOMAINS)}"
            )
    chosen = name or list(DOMAINS)
    if docs is not None:
        from cli.bench import page

        page.check(docs, chosen)
    measurements = list(_measure(chosen, quick, peers))
    if docs is not None:
        page.write(docs, measurements)
    columns: dict[str, list[Any]] = {
        "domain": [m.domain for m in measurements],
        "work": [m.work for m in measurements],
        "method": [m.method for m in measurements],
        "size": [m.size for m in measurements],
        "condition": [m.condition for m in measurements],
        "time_ns": [m.ns for m in measurements],
        "time_units": [m.units for m in measurements],
        "error": [m.error for m in measurements],
        "aim_ns": [m.aim_ns for m in measurements],
        "aim_error": [m.aim_error for m in measurements],
        "floor": [m.floor for m in measurements],
        "ratio": [m.ratio for m in measurements],
        "aim_ratio": [m.aim_ratio for m in measurements],
        "memory_bytes": [m.bytes for m in measurements],
        "kernel_calls": [m.kernels for m in measurements],
        "peer": ["yes" if m.peer else "no" for m in measurements],
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


def _measure(domains: list[str], quick: bool, peers: bool) -> Iterator[Measurement]:
    from cli.bench import measure as how

    how.patience = 0.3 if quick else 1.0
    for domain in domains:
        module, line = DOMAINS[domain]
        print(f"measuring {domain}: {line}", file=sys.stderr)
        yield from import_module(module).measure(quick)
        if peers:
            from cli.bench import peers as others

            yield from others.measure(domain, quick)


def _stress(
    names: list[str],
    seconds: float | None,
    first: int,
    docs: Path | None,
    *,
    json: bool,
    text: bool,
    output: Path | None,
) -> None:
    """Run campaigns with a progress bar; status 1 if an error lies beyond the program's own estimate too often."""
    from cli.bench.stress import Tally, campaigns, run

    known = campaigns()
    for name in names:
        if name not in known:
            raise typer.BadParameter(f"'{name}': expected some of {', '.join(known)}{nearest(name, known)}")
    if docs is not None:
        from cli.bench import page

        page.check(docs, ["stress"])
    chosen = names or list(known)
    tallies: list[Tally] = []
    for name in chosen:
        with typer.progressbar(length=1000, label=name, file=sys.stderr) as bar:
            if seconds is None:  # one case
                tallies.append(next(run(name, 0.0, first)))
                continue
            share, start = seconds / len(chosen), time.monotonic()
            for tally in run(name, share, first):  # noqa: B007 the last tally is the campaign's
                bar.update(int(1000 * min(1.0, (time.monotonic() - start) / share)) - bar.pos)
            tallies.append(tally)
    if docs is not None:
        page.write_stress(docs, tallies)
    columns: dict[str, list[Any]] = {
        "campaign": [t.name for t in tallies],
        "trials": [t.trials for t in tallies],
        "answers": [len(t.ratios) for t in tallies],
        "worst_error_over_estimate": [t.worst for t in tallies],
        "worst_seed": [t.seed for t in tallies],
        "share_bounded": [t.bounded for t in tallies],
        "median_slack": [t.slack for t in tallies],
    }
    show(
        Shown(
            lambda: {
                "campaigns": [
                    dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)
                ]
            },
            columns,
        ),
        json=json,
        text=text,
        output=output,
    )
    if any(t.bounded < 0.999 for t in tallies):
        raise typer.Exit(1)


def _fuzz(inputs: int, first: int, workers: int, *, json: bool, text: bool, output: Path | None) -> None:
    """Run damaged inputs with a progress bar; status 1 if one is not handled as it should be."""
    from shlex import join

    from cli.bench.fuzz_workers import LIMITED, Tally, run

    tallies: dict[str, Tally] = {}
    # an interrupted run shows what it has done
    with (
        typer.progressbar(length=inputs, label="damaged inputs", file=sys.stderr) as bar,
        suppress(KeyboardInterrupt),
    ):
        for seed, outcome in run(first, inputs, workers):
            tallies.setdefault(outcome.command, Tally(outcome.command)).add(seed, outcome)
            if outcome.fault is not None:
                line = f"seed {seed}: dalembert {join(outcome.arguments)}: {outcome.fault}"
                print("\n" + one_line(line), file=sys.stderr)
            bar.update(1)
    found = [tallies[command] for command in sorted(tallies)]
    columns: dict[str, list[Any]] = {
        "command": [t.command for t in found],
        "inputs": [t.inputs for t in found],
        "results": [t.handled["result"] for t in found],
        "data_errors": [t.handled["data error"] for t in found],
        "usage_errors": [t.handled["usage error"] for t in found],
        "slowest_s": [t.slowest[0] for t in found],
        "slowest_seed": [t.slowest[1] for t in found],
        "memory_bytes": [t.largest[0] for t in found],
        "memory_seed": [t.largest[1] for t in found],
        "faults": [len(t.faults) for t in found],
    }
    total = sum(t.inputs for t in found)
    show(
        Shown(
            lambda: {
                "first_seed": first,
                "inputs": total,
                "commands": [
                    dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)
                ],
                "faults": [
                    {"seed": seed, "arguments": outcome.arguments, "fault": outcome.fault}
                    for t in found
                    for seed, outcome in t.faults
                ],
            },
            columns,
            ("command",),
            afterword=lambda: f"{total} inputs from seed {first}, {sum(len(t.faults) for t in found)} faults",
            warnings=[] if LIMITED else ["this system limits no process's memory: it was not limited"],
        ),
        json=json,
        text=text,
        output=output,
    )
    if any(t.faults for t in found):
        raise typer.Exit(1)
