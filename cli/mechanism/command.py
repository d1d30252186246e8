"""`dalembert mechanism`: position, velocity, acceleration and jerk of a planar mechanism."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from cli.read import options
from cli.show.commands import ShowOptions, suffix_among
from cli.show.output import command

if TYPE_CHECKING:
    from cli.mechanism.solve import Analysis
    from cli.show.columns import Result
    from dalembert.page import Page


def _print_schema(asked: bool) -> None:
    if asked:
        import json

        from virtualwork.describe.schema import schema

        typer.echo(json.dumps(schema(), indent=2, ensure_ascii=False))
        raise typer.Exit


EXAMPLE = "klann"
OPTIONS = """
Arguments:
  file FILE.toml  The mechanism; - is standard input.
What:
  at INPUT  A pose, such as 60deg, 20mm or crank=60deg,arm=30deg; repeatable.
  sweep START:STOP:STEP  Such as 0deg:360deg:1deg or 0deg:360deg/3600.
  inputs FILE.csv  The inputs as a table: crank_deg, ..., perhaps time_s.
  only NAME,...  These links and points; nothing else is computed.
  branch all|NUMBER  Every assembly, or one of them.
Variants:
  change --set PATH=VALUE  Another number in place of the file's, such as links.crank.B.x=62mm; repeatable.
  vary PATH=FROM:TO:STEP  Variants over a range, such as links.crank.B.x=50mm:60mm:1mm; repeatable: the grid of all.
  variants FILE.csv  Variants as a table: a column for each path, links.crank.B.x_mm, a row for each variant.
  tolerance  What [tolerances] of the file do to every number shown.
  draws N  Draw so many mechanisms within the tolerances, and solve each.
  seed  Of what is drawn, and of --fit.
  distribution  Of what is drawn: a limit is three standard deviations, or the end.
  workers N  Processes that solve variants, draws, or the starts of a fit.
Fitting:
  fit TARGET.csv  Dimensions that come nearest to these places; repeatable.
  point NAME  Of --fit: x and y of a point; repeatable.
  link NAME  Of --fit: the angle of a link; repeatable.
  slide NAME  Of --fit: the travel along the guide at a point; repeatable.
  free PATH=LOW:HIGH  With --fit: a dimension and its bounds; repeatable.
  weight NAME=NUMBER  Of --fit: a row counts so often; repeatable.
  starts N  Of --fit: where it begins (default 256).
  best N  Of --fit: the best distinct solutions.
How:
  order  How far to differentiate (default: as the file's input gives it).
  newton  All loops at once by Newton-Raphson from the guess, with its iterates.
  time START:STOP:STEP  Let go of the inputs: the motion under the loads, such as 0:10:0.01 (seconds).
  accuracy NUMBER  With --time: the wanted error of the inputs (default 1e-9).
  until INPUT=VALUE  With --time: end where an input has a value, crank=90deg.
Output: of the mechanism:
  check  Mobility, Grashof classes, limits, dead and change points, groups.
  explain  The order of solution, and what was skipped.
  forces  The input's effort, every joint reaction, the shaking force.
  equilibrium  Where the loads balance without effort, and whether stably.
  flywheel COEFFICIENT  Inertia for this speed fluctuation, such as 0.02.
  counterweights LINK,...  Counterweights on these links that leave the least shaking force.
  graph NAME.QUANTITY,...  --plot draws these against the input, such as H.x,coupler.omega.
  states FILE.csv  Write a row for each pose and link to FILE: what `dalembert work` reads.
  html FILE.html  Write a page that moves to FILE: play, slider, curves, values; with --forces their arrows.
  schema  Print the JSON Schema of FILE.toml, for editors; needs no FILE.
"""


@command(OPTIONS)
def run(
    file: str,
    at: list[str] | None = None,
    sweep: str | None = None,
    inputs: str | None = None,
    only: str | None = None,
    order: Literal["position", "velocity", "acceleration", "jerk"] | None = None,
    branch: str | None = None,
    newton: bool = False,
    check: bool = False,
    explain: bool = False,
    forces: bool = False,
    equilibrium: bool = False,
    flywheel: float | None = None,
    counterweights: str | None = None,
    graph: str | None = None,
    time: str | None = None,
    accuracy: str | None = None,
    until: str | None = None,
    states: Annotated[Path | None, typer.Option(callback=suffix_among(".csv"))] = None,
    html: Annotated[Path | None, typer.Option(callback=suffix_among(".html"))] = None,
    change: list[str] | None = None,
    vary: list[str] | None = None,
    variants: str | None = None,
    tolerance: bool = False,
    draws: int | None = None,
    seed: Annotated[int, typer.Option(min=0)] = 0,
    distribution: Literal["normal", "uniform"] = "normal",
    workers: Annotated[int | None, typer.Option(min=1)] = None,
    fit: list[str] | None = None,
    point: list[str] | None = None,
    link: list[str] | None = None,
    slide: list[str] | None = None,
    free: list[str] | None = None,
    weight: list[str] | None = None,
    starts: Annotated[int | None, typer.Option(min=1)] = None,
    best: Annotated[int | None, typer.Option(min=1)] = None,
    schema: Annotated[bool, typer.Option(is_eager=True, callback=_print_schema)] = False,
    *,
    show: ShowOptions,
) -> Result:
    """Solve a planar mechanism: positions, velocities, accelerations, its limits and its assemblies.

    FILE.toml describes ground, links, slots, sliders, gears, input and guess. The table has a row for each pose: its
    input, every point and link, or those of --only; with --forces the forces. In a pipe --check, --equilibrium,
    --flywheel, --counterweights and --newton give their own table in place of the poses.
    """
    from cli.mechanism.read import wanted
    from cli.mechanism.result import result_of, told
    from cli.mechanism.solve import ORDERS, Analysis, load
    from cli.mechanism.studies import Request
    from cli.mechanism.words import METHOD

    if branch is not None and branch != "all" and options.whole(branch) < 1:
        raise options.bad("--branch", f"'{branch}': expected all, or the number of an assembly")
    names = None if only is None else [name.strip() for name in only.split(",") if name.strip()]
    if names == []:
        raise options.bad("--only", "expected names of links or points")
    if counterweights is not None and not any(name.strip() for name in counterweights.split(",")):
        raise options.bad("--counterweights", "expected names of links")
    if flywheel is not None and not 0 < flywheel < float("inf"):
        raise options.bad("--flywheel", "expected a positive speed fluctuation, such as 0.02")
    cycle = sweep is not None or inputs is not None
    if (flywheel is not None or counterweights is not None) and not cycle:
        flag = "--flywheel" if flywheel is not None else "--counterweights"
        raise options.bad(flag, "expected a cycle too: --sweep, such as --sweep 0deg:360deg:1deg")
    if graph is not None and show.plot is None:
        raise options.bad("--graph", "expected --plot FILE too: the picture that the curves are drawn into")
    if vary or variants is not None:
        of_one = {"states": states, "explain": explain, "graph": graph, "plot": show.plot}
        options.refuse("expected one mechanism, and no --vary or --variants beside it", **of_one)
    request = Request(newton, check, forces, equilibrium, flywheel, counterweights, swept=cycle)
    own = request.tables
    if show.holds_one and len(own) > 1:
        raise options.bad(
            own[1],
            f"{' and '.join(own)} are tables of their own, and CSV holds one: ask for --json or --text",
        )
    spreads = tolerance or draws is not None
    if workers is not None and not (draws or vary or variants or fit):
        told_of = "expected --draws, --vary, --variants or --fit: one mechanism is one process's"
        raise options.bad("--workers", told_of)
    if spreads:
        from cli.mechanism.tolerance import Tolerances
        from cli.mechanism.tolerated import checked, with_tolerances

        others = options.given(
            vary=vary, variants=variants, branch=branch, states=states, graph=graph, html=html
        )
        checked(draws, tolerance, [*others, *(flag for flag in own if flag != "--forces")])
    if any((fit, point, link, slide, free, weight, starts, best)):
        from cli.mechanism.fitted import FitOptions, fitted

        unfit = options.given(
            at=at, sweep=sweep, inputs=inputs, vary=vary, variants=variants, time=time, only=only, order=order,
            html=html, states=states, tolerance=spreads, branch=branch, explain=explain, graph=graph,
        )  # fmt: skip
        with told(file):
            fits = FitOptions(fit, point, link, slide, free, weight, starts, best)
            result = fitted(file, fits, change, seed, workers or 1, [*own, *unfit])
            return replace(result, within=lambda: told(file))
    if time is not None:
        clash = options.given(
            at=at, sweep=sweep, inputs=inputs, order=order, graph=graph, states=states, explain=explain
        )
        clash += [
            *(flag for flag in own if flag != "--forces"),
            *(["--branch all"] if branch == "all" else []),
        ]
        clash += options.given(tolerance=spreads)
        if clash:
            raise options.bad("--time", f"expected without {clash[0]}: the loads decide the poses")
        if html is not None and until is not None and (vary or variants is not None):
            told_of = (
                "expected no --until beside variants: a page has one clock for all; --set shows one of them"
            )
            raise options.bad("--html", told_of)
    elif accuracy is not None or until is not None:
        raise options.bad("--accuracy" if accuracy is not None else "--until", "expected --time too")
    if html is not None:
        from cli.mechanism import animation
        from cli.show.page import refuse_long
    with told(file):
        mechanism, bare, said, about = load(file)
        several = None
        if change or vary or variants is not None:
            from cli.mechanism.variants import asked, assigned

            mechanism = assigned(mechanism, bare, change) if change else mechanism
            several = asked(mechanism, bare, vary, variants, said)
        if time is not None:
            from cli.mechanism.in_time import InTime, times_and_accuracy

            home = Analysis.of(file, mechanism, wanted(mechanism, None, None, None, bare), 2, names, branch)
            home.warnings += said
            home.check_names()
            motion = InTime(home, *times_and_accuracy(time, accuracy), until, bare, forces)
            if html is not None:
                refuse_long(len(motion.times) * (1 if several is None else several.count))
            if several is not None:
                from cli.mechanism.variants_in_time import AskedInTime, VariantsInTime

                every = AskedInTime(
                    file, mechanism, several.dimensions, motion.times, motion.accuracy, until, bare, forces, names,
                    branch, show.digits,
                )  # fmt: skip
                let_go = VariantsInTime(every, several, workers or 1, home.warnings)
                result = let_go.result(show.streams, about)
            else:
                result = motion.result(about)

            def page() -> Page:
                them = [("", motion)] if several is None else let_go.runs()
                return animation.page_in_time(them, show.units)

            return replace(_with_page(result, html, page), within=lambda: told(file))
        q = wanted(mechanism, at, sweep, inputs, bare)
        rates = None if order is None else ORDERS.index(order)
        analysis = Analysis.of(file, mechanism, q, rates, names, branch)
        analysis.warnings += said
        analysis.check_names()
        if html is not None:
            refuse_long(q.n * (1 if several is None else several.count))
        alone = several is None and html is None and not spreads and own in ([], ["--forces"])
        if alone and show.streams and analysis.is_long:
            return _long(analysis, forces, states, show.digits)
        # the table of a long sweep costs as much as its solution: JSON alone does not ask for it
        table = not show.json or show.expect is not None or show.output is not None
        streams = show.streams or show.streams_json
        times = 1 if several is None or streams else several.count
        analysis.check_size(
            json=show.as_json, table=table, states=states is not None, forces=forces, times=times
        )
        if several is None:
            result = result_of(analysis, request, states, explain, graph, about, show.digits)
            if spreads:
                its = Tolerances(analysis, forces, draws or 0, seed, distribution, workers or 1)
                return with_tolerances(result, its)
            return _with_page(result, html, lambda: animation.page([("", analysis)], forces, show.units))

        from cli.mechanism.asked import Asked
        from cli.mechanism.many import Many

        own_pose = at is None and sweep is None and inputs is None and several.moves_inputs
        question = Asked(
            file, mechanism, several.dimensions, None if own_pose else q.part(0, q.n), bare, rates, names,
            branch, request, about, show.digits,
        )  # fmt: skip
        found = Many(question, several, workers or 1)
        result = _with_page(
            found.result(streams, show.as_json, table),
            html,
            lambda: animation.page(found.analyses(), forces, show.units),
        )
        return replace(
            result,
            warnings=[*said, *result.warnings],
            within=lambda: told(file),
            method=METHOD,
            about={"title": mechanism.name or "Mechanism"} | about,
        )


def _long(analysis: Analysis, forces: bool, states: Path | None, digits: bool) -> Result:
    """The table of a long sweep, a block of poses at a time."""
    from cli.mechanism import columns
    from cli.mechanism.result import csv_parts, told
    from cli.mechanism.states import table as link_states
    from cli.mechanism.stream import Stream
    from cli.show.columns import Result

    form = columns.forces if forces else columns.poses
    stream = Stream(analysis, form, forces)
    every = Stream(replace(analysis, only=None), link_states)
    return Result(
        blocks=lambda form: (form(table, i) for i, table in enumerate(stream.tables())),
        beside={} if states is None else {states: lambda: csv_parts(every.tables(), digits)},
        late_warnings=stream.warnings,
        failed=lambda: not stream.any_assembled,
        within=lambda: told(analysis.file),
    )


def _with_page(result: Result, html: Path | None, page: Callable[[], Page]) -> Result:
    """Add the page that moves to what a result writes beside, where it is asked for."""
    if html is None:
        return result
    return replace(result, beside={**result.beside, html: lambda: page().html.encode()})
