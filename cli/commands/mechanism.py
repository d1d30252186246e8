"""`dalembert mechanism`: position, velocity, acceleration and jerk of a planar mechanism."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from cli.read import options
from cli.show.output import Digits, Expect, Json, Output, Plot, Rtol, Shown, Text, show

if TYPE_CHECKING:
    from cli.mechanism.asked import Asked
    from cli.mechanism.job import Job


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
    plot: Plot = None,
    expect: Expect = None,
    rtol: Rtol = 1e-3,
    text: Text = False,
    digits: Digits = False,
) -> None:
    """Solve a planar mechanism: positions, velocities, accelerations, its limits and its assemblies.

    FILE.toml describes ground, links, slots, sliders, gears, input and guess. Without --only the table has a row
    for each pose and link (what `dalembert work` reads); with --only a row for each pose.
    """
    from cli.mechanism.job import ORDERS

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
    from cli.mechanism.asked import Asked
    from virtualwork import MechanismError

    asked = Asked(
        forces, equilibrium, flywheel, counterweights, swept=sweep is not None or inputs is not None
    )
    try:
        job = _job(file, at, sweep, inputs, names, order, branch)
        # the table of a long sweep costs as much as its solution: JSON alone does not ask for it
        table = not json or expect is not None or output is not None
        document = json or (output is not None and output.suffix.lower() == ".json")
        job.check_size(json=document, table=table, forces=forces)
        shown = _shown(
            job,
            asked,
            table=table,
            newton=newton,
            check=check,
            explain=explain,
            graph=graph,
            written=output is not None,
        )
        show(shown, json=json, output=output, plot=plot, expect=expect, rtol=rtol, text=text, digits=digits)
    except MechanismError as error:
        from cli.errors import DataError

        raise DataError(f"{error}" if str(error).startswith(file) else f"{file}: {error}") from None
    if not any(job.assembled(motion).any() for motion in job.motions):
        raise typer.Exit(1)


def _job(
    file: str,
    at: list[str] | None,
    sweep: str | None,
    inputs: str | None,
    only: list[str] | None,
    order: str | None,
    branch: str | None,
) -> Job:
    from cli.mechanism.inputs import wanted
    from cli.mechanism.job import ORDERS, Job, load

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
    table: bool,
    newton: bool,
    check: bool,
    explain: bool,
    graph: str | None,
    written: bool,
) -> Shown:
    from cli.mechanism import checking, poses, states

    columns: dict[str, list[Any]] = {}
    if table and asked.forces and not written:
        columns = asked.table(job)
    elif table:
        columns = states.table(job) if job.only is None else poses.wide_table(job)
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
    warnings = job.warnings + checking.limit_warnings(job) + asked.warnings(job)

    def document() -> dict[str, Any]:
        return {"name": job.mechanism.name, "poses": asked.with_forces(job, poses.document(job)), **extra}

    def afterword() -> str:
        told = [checking.explain_text(job)] if explain else []
        return "\n\n".join([*after, *asked.text(of_forces), *told, *(asked.explain(job) if explain else [])])

    def errors() -> dict[str, Any]:
        from cli.mechanism import digits

        if not table:
            return {}
        if asked.forces and not written:
            return digits.of_forces(job)
        return digits.of_states(job) if job.only is None else digits.of_poses(job)

    def figure() -> Any:
        if asked.forces and not graph and len(job.inputs.shown) > 2 and job.motions[0].assembled.any():
            return asked.figure(job)
        from cli.plots import mechanism as pictures

        return pictures.graphs(job, graph) if graph else pictures.draw(job)

    if graph:
        from cli.mechanism.graphs import quantities

        quantities(job, graph)  # a bad name is an error before anything is written
    return Shown(
        document=document,
        columns=columns,
        keys=[key for key in ("step", "branch", "link") if key in columns],
        notes=lambda: job.mechanism.name,
        afterword=afterword,
        figure=figure,
        errors=errors,
        warnings=warnings,
    )
