"""`python -m benchmarks [speed|stress|fuzz] …`: run time against error, errors against their bounds, broken input."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import suppress
from importlib import import_module
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import typer

from benchmarks.speed import DOMAINS
from cli.read.options import quantity
from cli.show.commands import ShowOptions
from cli.show.output import command
from dalembert.errors import DataError, one_line
from dalembert.hints import nearest
from dalembert.results.columns import Column, Table
from dalembert.results.result import Result

if TYPE_CHECKING:
    from benchmarks.speed.measure import Measurement

app = typer.Typer(
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    add_completion=False,
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Measure the program; docs/quality/benchmarks.md holds its tables.",
)

DOCS = """docs FILE(.md)  Write tables into FILE.md, between its marks <!-- bench:DOMAIN --> (stress: <!-- bench:stress -->) and \
<!-- end -->, and pictures into the folder pictures beside it."""


@app.command()
@command(
    f"""
Arguments:
  name [NAME]...  Domains: {", ".join(DOMAINS)}.
Options:
  quick  Smaller sizes.
  peers  The same work with other packages, where they are installed.
  {DOCS}
"""
)
def speed(options: SimpleNamespace, _: ShowOptions) -> Result:
    """Measure run time against error, for each method the program offers.

    Times are CPU times per item, also as multiples of a calibration loop measured in the same run (one element of
    √(x² + y²) over 4096 doubles), so that results from different machines compare. Errors are against answers of
    extended precision.
    """
    from benchmarks import page

    chosen = _known(options.name, DOMAINS)
    if options.docs is not None:
        page.check(options.docs, chosen)
    measurements = list(_measure(chosen, options.quick, options.peers))
    if options.docs is not None:
        page.write(options.docs, measurements)
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
        "operations": [m.operations for m in measurements],
        "peer": ["yes" if m.peer else "no" for m in measurements],
    }
    return Result(
        document=lambda: {"measurements": _records(columns)},
        tables={"measurements": lambda: _table(columns, "domain", "work", "method", "size")},
        figure=lambda: import_module("benchmarks.speed.picture").draw(measurements),
    )


def _table(columns: dict[str, list[Any]], *keys: str) -> Table:
    return Table([Column(name, "", values) for name, values in columns.items()], keys)


def _records(columns: dict[str, list[Any]]) -> list[dict[str, Any]]:
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def _known(names: list[str] | None, known: Iterable[str]) -> list[str]:
    """Return the names asked for, all where there are none, once each is known."""
    known = list(known)
    for name in names or ():
        if name not in known:
            raise typer.BadParameter(f"'{name}': expected some of {', '.join(known)}{nearest(name, known)}")
    return names or known


def _measure(domains: list[str], quick: bool, peers: bool) -> Iterator[Measurement]:
    from benchmarks.speed import measure as how

    how.patience = 0.3 if quick else 1.0
    for domain in domains:
        module, line = DOMAINS[domain]
        print(f"measuring {domain}: {line}", file=sys.stderr)
        yield from import_module(module).measure(quick)
        if peers:
            from benchmarks import peers as others

            yield from others.measure(domain, quick)


@app.command()
@command(
    f"""
Arguments:
  name [NAME]...  Campaigns, by the names of the table.
Options:
  time TIME  Run them for this long, such as 10min.
  seed N(0-)=0  The seed of the first case; without --time this one case of each.
  {DOCS}
"""
)
def stress(options: SimpleNamespace, _: ShowOptions) -> Result:
    """Run random campaigns at singular places; status 1 if errors lie beyond the program's own estimate too often."""
    from benchmarks import page
    from benchmarks.stress.campaigns import Tally, campaigns, run

    chosen, docs = _known(options.name, campaigns()), options.docs
    seconds = quantity("--time", options.time, "time", positive=True)
    if docs is not None:
        page.check(docs, ["stress"])
    tallies: list[Tally] = []
    for campaign in chosen:
        with typer.progressbar(length=1000, label=campaign, file=sys.stderr) as bar:
            if seconds is None:  # one case
                tallies.append(next(run(campaign, 0.0, options.seed)))
                continue
            share, start = seconds / len(chosen), time.monotonic()
            for tally in run(campaign, share, options.seed):  # noqa: B007 the last tally is the campaign's
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
        "slack_of_1_percent": [t.slacks(0.01)[0] for t in tallies],
        "median_slack": [t.slack for t in tallies],
        "slack_of_99_percent": [t.slacks(0.99)[0] for t in tallies],
    }
    return Result(
        document=lambda: {"campaigns": _records(columns)},
        tables={"campaigns": lambda: _table(columns)},
        failed=lambda: any(t.bounded < 0.999 for t in tallies),
    )


@app.command()
@command("""
Arguments:
  inputs N  How many damaged inputs.
Options:
  seed N(0-)=0  The seed of the first: `1 --seed S` is one again.
  workers N=1  Processes.
""")
def fuzz(options: SimpleNamespace, _: ShowOptions) -> Result:
    """Run damaged inputs through the commands; status 1 if one is not handled as it should be."""
    from shlex import join

    from benchmarks.fuzz.workers import LIMITED, Tally, run

    tallies: dict[str, Tally] = {}
    # an interrupted run shows what it has done
    with (
        typer.progressbar(length=options.inputs, label="damaged inputs", file=sys.stderr) as bar,
        suppress(KeyboardInterrupt),
    ):
        for case, outcome in run(options.seed, options.inputs, options.workers):
            tallies.setdefault(outcome.command, Tally(outcome.command)).add(case, outcome)
            if outcome.fault is not None:
                line = f"seed {case}: dalembert {join(outcome.arguments)}: {outcome.fault}"
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
    return Result(
        document=lambda: {
            "first_seed": options.seed,
            "inputs": total,
            "commands": _records(columns),
            "faults": [
                {"seed": case, "arguments": outcome.arguments, "fault": outcome.fault}
                for t in found
                for case, outcome in t.faults
            ],
        },
        tables={"commands": lambda: _table(columns, "command")},
        afterword=lambda: (
            f"{total} inputs from seed {options.seed}, {sum(len(t.faults) for t in found)} faults"
        ),
        warnings=[] if LIMITED else ["this system limits no process's memory: it was not limited"],
        failed=lambda: any(t.faults for t in found),
    )


if __name__ == "__main__":
    # one thread, as the tables say
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        app(prog_name="python -m benchmarks")
    except ModuleNotFoundError as error:
        sys.exit(f"benchmarks: {error}: pip install '.[test]' brings what is needed")
    except DataError as error:
        sys.exit(f"benchmarks: {one_line(str(error))}")
