"""`dalembert mechanism`: position, velocity, acceleration and jerk of a planar mechanism."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cli.errors import one_line
from cli.read import options
from cli.read.files import refuse_inputs
from cli.show.columns import Column, Table
from cli.show.digits import digits_that_hold
from cli.show.files import write
from cli.show.output import suffix_among
from cli.show.shown import Digits, Expect, Json, Output, Plot, Rtol, Shown, Text, show
from cli.show.text import csv_text

if TYPE_CHECKING:
    from cli.mechanism.asked import Asked
    from cli.mechanism.solve import Job


def run(
    file: Annotated[str, typer.Argument(metavar="FILE.toml", help="The mechanism; - is standard input.")],
    at: Annotated[
        list[str] | None,
        typer.Option(
            metavar="INPUT", help="A pose, such as 60deg, 20mm or crank=60deg,arm=30deg; repeatable."
        ),
    ] = None,
    sweep: Annotated[
        str | None,
        typer.Option(metavar="START:STOP:STEP", help="Such as 0deg:360deg:1deg or 0deg:360deg/3600."),
    ] = None,
    inputs: Annotated[
        str | None,
        typer.Option(metavar="FILE.csv", help="The inputs as a table: crank_deg, ..., perhaps time_s."),
    ] = None,
    only: Annotated[
        str | None, typer.Option(metavar="NAME,...", help="These links and points; nothing else is computed.")
    ] = None,
    order: Annotated[
        str | None,
        typer.Option(help="position, velocity, acceleration or jerk (default: what the file's input gives)."),
    ] = None,
    branch: Annotated[
        str | None, typer.Option(metavar="all|NUMBER", help="Every assembly, or one of them.")
    ] = None,
    newton: Annotated[
        bool,
        typer.Option(
            "--newton", help="All loops at once by Newton-Raphson from the guess, with its iterates."
        ),
    ] = False,
    check: Annotated[
        bool,
        typer.Option("--check", help="Mobility, Grashof classes, limits, dead and change points, groups."),
    ] = False,
    explain: Annotated[
        bool, typer.Option("--explain", help="The order of solution, and what was skipped.")
    ] = False,
    forces: Annotated[
        bool, typer.Option("--forces", help="The input's effort, every joint reaction, the shaking force.")
    ] = False,
    equilibrium: Annotated[
        bool,
        typer.Option("--equilibrium", help="Where the loads balance without effort, and whether stably."),
    ] = False,
    flywheel: Annotated[
        float | None,
        typer.Option(metavar="COEFFICIENT", help="Inertia for this speed fluctuation, such as 0.02."),
    ] = None,
    counterweights: Annotated[
        str | None,
        typer.Option(
            metavar="LINK,...", help="Counterweights on these links that leave the least shaking force."
        ),
    ] = None,
    graph: Annotated[
        str | None,
        typer.Option(
            metavar="NAME.QUANTITY,...",
            help="--plot draws these against the input, such as H.x,coupler.omega.",
        ),
    ] = None,
    json: Json = False,
    output: Output = None,
    states: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.csv",
            help="Write a row for each pose and link to FILE: what `dalembert work` reads.",
            callback=suffix_among(".csv"),
        ),
    ] = None,
    plot: Plot = None,
    expect: Expect = None,
    rtol: Rtol = 1e-3,
    text: Text = False,
    digits: Digits = False,
) -> None:
    """Solve a planar mechanism: positions, velocities, accelerations, its limits and its assemblies.

    FILE.toml describes ground, links, slots, sliders, gears, input and guess. Without --only the table has a row
    for each pose and link (what `dalembert work` reads); with --only or --forces a row for each pose. In a pipe
    --check, --equilibrium, --flywheel, --counterweights and --newton give their own table in place of the poses.
    """
    from cli.mechanism.solve import ORDERS

    if order is not None and order not in ORDERS:
        raise options.bad("--order", f"'{order}': expected {', '.join(ORDERS)}")
    if branch is not None and branch != "all" and options.whole(branch) < 1:
        raise options.bad("--branch", f"'{branch}': expected all, or the number of an assembly")
    names = None if only is None else [name.strip() for name in only.split(",") if name.strip()]
    if names == []:
        raise options.bad("--only", "expected names of links or points")
    if counterweights is not None and not any(name.strip() for name in counterweights.split(",")):
        raise options.bad("--counterweights", "expected names of links")
    if flywheel is not None and not 0 < flywheel < float("inf"):
        raise options.bad("--flywheel", "expected a positive speed fluctuation, such as 0.02")
    if (flywheel is not None or counterweights is not None) and sweep is None and inputs is None:
        flag = "--flywheel" if flywheel is not None else "--counterweights"
        raise options.bad(flag, "expected a cycle too: --sweep, such as --sweep 0deg:360deg:1deg")
    if graph is not None and plot is None:
        raise options.bad("--graph", "expected --plot FILE too: the picture that the curves are drawn into")
    tables = [
        flag
        for flag, given in (
            ("--forces", forces),
            ("--newton", newton),
            ("--check", check),
            ("--equilibrium", equilibrium),
            ("--flywheel", flywheel is not None),
            ("--counterweights", counterweights is not None),
        )
        if given
    ]
    as_csv = _as_csv(json=json, text=text, output=output, expect=expect)
    if as_csv and len(tables) > 1:
        raise options.bad(
            tables[1],
            f"{' and '.join(tables)} are tables of their own, and CSV holds one: ask for --json or --text",
        )
    from cli.mechanism.asked import Asked
    from virtualwork import MechanismError

    asked = Asked(
        forces, equilibrium, flywheel, counterweights, swept=sweep is not None or inputs is not None
    )
    try:
        job = _job(file, at, sweep, inputs, names, order, branch)
        if (
            as_csv
            and not (json or text or tables[:1] not in ([], ["--forces"]) or plot or expect)
            and job.is_long
        ):
            if not _stream(job, forces=forces, digits=digits, output=output, states=states):
                raise typer.Exit(1)
            return
        # the table of a long sweep costs as much as its solution: JSON alone does not ask for it
        table = not json or expect is not None or output is not None
        document = json or (output is not None and output.suffix.lower() == ".json")
        job.check_size(json=document, table=table or states is not None, forces=forces)
        shown = _shown(
            job,
            asked,
            own=tables[0] if len(tables) == 1 and tables != ["--forces"] else None,
            table=table,
            newton=newton,
            check=check,
            explain=explain,
            graph=graph,
        )
        beside = {} if states is None else {states: _link_states(job)}
        show(
            shown,
            json=json,
            output=output,
            plot=plot,
            expect=expect,
            rtol=rtol,
            text=text,
            digits=digits,
            beside=beside,
        )
    except MechanismError as error:
        from cli.errors import DataError

        raise DataError(f"{error}" if str(error).startswith(file) else f"{file}: {error}") from None
    if not any(job.assembled(motion).any() for motion in job.motions):
        raise typer.Exit(1)


def _stream(job: Job, *, forces: bool, digits: bool, output: Path | None, states: Path | None) -> bool:
    """Write the table of a long sweep a block of poses at a time; return whether some pose is assembled."""
    from cli.mechanism import forces as of_forces
    from cli.mechanism import poses
    from cli.mechanism import rounding as bounds
    from cli.mechanism import states as of_states
    from cli.mechanism.stream import Stream

    form, errors = of_states.table, bounds.of_states
    if forces:
        form, errors = of_forces.table, bounds.of_forces
    elif job.only is not None:
        form, errors = poses.wide_table, bounds.of_poses
    stream = Stream(job, forces)
    unknown = 0

    def parts(stream: Stream, form: Any, cut: bool) -> Iterator[str]:
        nonlocal unknown
        for i, (block, columns) in enumerate(stream.tables(form)):
            if cut:
                columns, without = _cut(columns, errors(block))
                unknown += without
            yield csv_text(columns, header=i == 0)

    refuse_inputs([path for path in (output, states) if path is not None])
    if states is not None:
        every = Stream(replace(job, only=None))
        write(states, (part.encode() for part in parts(every, of_states.table, False)))
    if output is not None:
        write(output, (part.encode() for part in parts(stream, form, digits)))
    else:
        for part in parts(stream, form, digits):
            sys.stdout.write(part)
        sys.stdout.flush()
    said = stream.warnings()
    if unknown:
        said.append(f"--digits: of {unknown} numbers no digit is known to hold; their cells are empty")
    for warning in said:
        print(f"warning: {one_line(warning)}", file=sys.stderr)
    return stream.any_assembled


def _cut(columns: dict[str, Any], errors: Mapping[str, Any]) -> tuple[dict[str, Any], int]:
    """Cut columns to the digits that hold; return also of how many numbers no digit is known."""
    listed = []
    for name, values in columns.items():
        bounds = errors.get(name)
        unit = "deg" * name.endswith("_deg")
        listed.append(Column(name, unit, values, None if bounds is None else partial(list, bounds)))
    table, unknown = digits_that_hold(Table(listed))
    return {column.name: column.values for column in table.columns}, unknown


def _as_csv(*, json: bool, text: bool, output: Path | None, expect: Path | None) -> bool:
    """Whether the answer is written as CSV: to a file, or to a pipe."""
    if output is not None:
        return output.suffix.lower() == ".csv"
    return not (json or text or expect is not None or sys.stdout.isatty())


def _link_states(job: Job) -> bytes:
    """The table of `--states`: every link, whatever `--only` names."""
    from cli.mechanism import states

    every = replace(job, only=None)
    every.motions = job.motions
    return csv_text(states.table(every)).encode()


def _job(
    file: str,
    at: list[str] | None,
    sweep: str | None,
    inputs: str | None,
    only: list[str] | None,
    order: str | None,
    branch: str | None,
) -> Job:
    from cli.mechanism.read import wanted
    from cli.mechanism.solve import ORDERS, Job, load

    m = load(file)
    q = wanted(m, at, sweep, inputs)
    given = 0
    for k, name in enumerate(("speed", "acceleration", "jerk"), 1):
        if any(getattr(e, name) is not None for e in m.inputs) or getattr(q, name, None) is not None:
            given = k
    job = Job(file, m, q, ORDERS.index(order) if order is not None else given, only, branch)
    job.check_names()
    return job


def _shown(
    job: Job,
    asked: Asked,
    *,
    own: str | None,
    table: bool,
    newton: bool,
    check: bool,
    explain: bool,
    graph: str | None,
) -> Shown:
    """What was asked for; `own`: the option whose table a pipe shows in place of the poses."""
    from cli.mechanism import checking, poses, states, tables

    columns: dict[str, list[Any]] = {}

    @cache
    def of_poses() -> dict[str, list[Any]]:
        if asked.forces:
            return asked.table(job)
        return states.table(job) if job.only is None else poses.wide_table(job)

    if own is None and table:
        columns = of_poses()
    extra: dict[str, Any] = {}
    after: list[str] = []
    if newton:
        _, part = checking.newton_tables(job)
        extra |= part
        after.append(checking.newton_text(part))
    if check:
        extra["check"] = checking.check_document(job)
        after.append(checking.check_text(extra["check"]))
    of_forces = asked.document(job)
    extra |= of_forces
    if own is not None:
        columns = {
            "--newton": lambda: tables.of_iterates(extra),
            "--check": lambda: tables.of_check(extra["check"]),
            "--equilibrium": lambda: tables.of_equilibria(extra["equilibria"], job.input_names),
            "--flywheel": lambda: tables.of_cycle(extra["cycle"]),
            "--counterweights": lambda: tables.of_counterweights(extra["counterweights"]),
        }[own]()
    warnings = job.warnings + checking.limit_warnings(job) + asked.warnings(job)

    def document() -> dict[str, Any]:
        return {"name": job.mechanism.name, "poses": asked.with_forces(job, poses.document(job)), **extra}

    def afterword() -> str:
        told = [checking.explain_text(job)] if explain else []
        return "\n\n".join([*after, *asked.text(of_forces), *told, *(asked.explain(job) if explain else [])])

    def errors() -> dict[str, Any]:
        from cli.mechanism import rounding as digits

        if not table:
            return {}
        if asked.forces:
            return digits.of_forces(job)
        return digits.of_states(job) if job.only is None else digits.of_poses(job)

    def figure() -> Any:
        if asked.forces and not graph and len(job.inputs.shown) > 2 and job.motions[0].assembled.any():
            return asked.figure(job)
        from cli.mechanism import picture as pictures

        return pictures.graphs(job, graph) if graph else pictures.draw(job)

    if graph:
        from cli.mechanism.graphs import quantities

        quantities(job, graph)  # a bad name is an error before anything is written
    of_each_pose = ("step", "branch", "link", *job.input_columns)
    return Shown(
        document=document,
        columns=columns,
        keys=of_each_pose if own is None else [*of_each_pose[:3], *tables.KEYS],
        table=None if own is None else of_poses,
        notes=lambda: job.mechanism.name,
        afterword=afterword,
        figure=figure,
        errors=errors if own is None else dict,
        table_errors=None if own is None else errors,
        warnings=warnings,
    )
