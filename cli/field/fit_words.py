"""What the terminal and the report say of a fit of all runs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from balancing.doubt import LEVEL
from cli.field.fit import drifts, predicted, robust, rows, run_to_predict, suggested
from cli.field.runs import Complex
from cli.field.solve import FieldBalancing, Solved
from cli.field.words import FEW, amplitude_unit, masses_said
from cli.read.units import degrees
from cli.show.text import angle_text, table_text, transposed

if TYPE_CHECKING:
    from cli.show.columns import Cell

    Columns = dict[str, list[Cell]]


def history(found: FieldBalancing, solved: Solved, i: int) -> Columns:
    """The readings of a rotor, a row each, beside how far they lie from the fitted vibration."""
    unit = amplitude_unit(found)
    return transposed(
        [
            {
                "run": row.run,
                "sensor": str(row.channel),
                f"read {unit}": abs(row.value),
                "phase°": round(degrees(row.value), 2),
                f"off {unit}": abs(row.residual),
                "standardised": row.standardized if np.isfinite(row.standardized) else "",
                "": "outlier" if row.outlier else "",
            }
            for row in rows(solved.group, i)
        ]
    )


def summary(found: FieldBalancing, solved: Solved, i: int) -> str:
    """How many runs and readings were fitted, and how well."""
    fit, log = solved.group.fit, solved.group.logs[i]
    assert fit is not None
    nu = int(fit.degrees_of_freedom[i])
    spread = (
        f"they lie {fit.residual_sd[i]:.4g} {amplitude_unit(found)} from it (standard deviation of a reading as a vector)"
        if nu
        else "nothing is left over to show their scatter"
    )
    sense = (
        "the runs cannot tell the sense of the phase: a further run with a mass off the line of the others would"
        if log.sense is None
        else f"the runs say that the phase {log.sense}s"
    )
    of_time = drifts(solved.group)
    if of_time is not None and np.isfinite(chance := of_time.probability[i]):
        told = "the vibration drifts with time" if chance < LEVEL else "no drift with time is told"
        sense += f"; {told} (F test at {LEVEL:.0%}: by chance in {chance:.2g} of logs)"
    before = solved.group.before
    if before is not None:
        scatter = "" if before.scatter is None else f", which differ from one another by {before.scatter:.1%}"
        many = f"{before.machines} machines" if before.machines > 1 else "one machine"
        sense += f"; coefficients of {many}{scatter} are known before"
    return (
        f"{len(log.runs)} run{'s' * (len(log.runs) != 1)}, {int(fit.present[i].sum())} readings fitted together, {nu} complex degree{'s' * (nu != 1)} of "
        f"freedom: {spread}; {sense}"
    )


def notes(found: FieldBalancing) -> str:
    """Above the terminal's table."""
    parts = (
        f"{found.of(solved.group, i)}{summary(found, solved, i)}\n{table_text(history(found, solved, i))}"
        for _, solved, i in found.each(FEW)
    )
    return "\n".join(parts) + "\n"


def afterword(found: FieldBalancing) -> str:
    """Below the terminal's table: what the next run should read, which run to make."""
    return "\n" + "\n".join(
        f"{found.of(solved.group, i)}{line}"
        for _, solved, i in found.each(FEW)
        for line in expected(found, solved, i)
    )


def expected(found: FieldBalancing, solved: Solved, i: int) -> list[str]:
    """What the next run should read, which run would tell most, and what a robust fit says."""
    lines, asked, planes, unit = [], found.request, solved.planes, amplitude_unit(found)

    def said(masses: Complex) -> str:
        return ", ".join(masses_said(found, planes, masses, ".2f"))

    if found.predict is not None:
        value, sd = (part[i] for part in predicted(found, solved))
        lines.append(f"a run with {said(run_to_predict(found, planes))} should read")
        lines += [
            f"  at sensor {channel}: {abs(v):.4g}{f' ± {u:.2g}' * bool(np.isfinite(u))} {unit} at {angle_text(degrees(v), '.2f')}°"
            for channel, v, u in zip(solved.group.channels, value, sd, strict=True)
        ]
    if asked.suggest:
        run = suggested(solved, i)
        if run is None:
            lines.append("no run is suggested: nothing tells how sure the corrections are")
        else:
            lines.append(
                f"the next run that tells most (A-optimal): {said(run.masses)}; the corrections' uncertainty falls "
                f"from {found.amount(run.before):.4g} to {found.amount(run.after):.4g} {found.unit}"
            )
    if asked.robust:
        lines.append(f"a robust fit (Huber) corrects with {said(robust(found, solved)[1][i])}")
    return lines
