"""Which way a file of runs is read: as an initial run and trial runs, or as a log whose runs are all fitted together."""

from __future__ import annotations

from collections.abc import Sequence

from cli.field.layouts import alpha_of, is_log
from cli.field.request import Request
from cli.field.runs import Runs, more_than_unknowns
from cli.field.stored import Stored, read_runout, read_stored, stored_alpha
from cli.field.trial_runs import NotOneInitialRun, read_runs, runs_table
from cli.read import options
from dalembert.tables.table import Table


def read_measured(
    path: str, request: Request, influence: Sequence[str], runout: str | None
) -> tuple[Runs, Stored | None]:
    """Read the runs, and the stored coefficients that stand for trial runs."""
    files = [read_stored(file) for file in influence]
    asked = {name: getattr(request, name) for name in ("fit", "exclude", "predict", "suggest", "robust")}
    if request.four_run:
        options.refuse("fits all runs: it does not go with --method four-run", **asked)
        fit = False
    else:
        fit = any(asked.values()) or len(files) > 1 or any(one.along is not None for one in files)
        fit = fit or is_log(path)
    if fit and not files and (own := alpha_of(path)) is not None and not own.trials:
        files = [stored_alpha(own)]
    if fit:
        runs, stored = _fitted(path, request, files=files), None
    else:
        runs, stored = _of_table(path, request, files)
    for one in files:
        runs.warnings += one.table.warnings
    lags = request.against or runs.lags
    if runout is not None:
        runs.runout = read_runout(runout, runs, lagging=lags)
    elif lags:
        runs.runout = {sensor: vector.conjugate() for sensor, vector in runs.runout.items()}
    return runs, stored


def _of_table(path: str, request: Request, files: Sequence[Stored]) -> tuple[Runs, Stored | None]:
    """Read a table of runs; where it has runs to spare, or none that is the initial one, all are fitted."""
    table, stored = runs_table(path), next(iter(files), None)
    can_fit = stored is None and not request.four_run
    if not (can_fit and more_than_unknowns(table)):
        try:
            unit = None if stored is None else stored.unit
            return read_runs(table, request, unit), stored
        except NotOneInitialRun:
            if not can_fit:
                raise
    return _fitted(path, request, table), None


def _fitted(path: str, request: Request, table: Table | None = None, files: Sequence[Stored] = ()) -> Runs:
    from cli.field.log import read_log
    from cli.field.sisters import Sisters

    return read_log(path, request, table, Sisters(files) if files else None)
