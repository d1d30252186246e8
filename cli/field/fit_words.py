"""What the terminal and the report say of a fit of all runs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from balancing.doubt import LEVEL
from cli.field.fit import Fitted, LogFits, drifts
from cli.field.solve import Solved
from cli.field.words import FEW, amplitude_unit
from cli.read.units import degrees
from cli.show.text import angle_text, table_text

if TYPE_CHECKING:
    from cli.show.columns import Cell

    Columns = dict[str, list[Cell]]


def history(fits: LogFits, solved: Solved, i: int) -> Columns:
    """The readings of a rotor, a row each, beside how far they lie from the fitted vibration."""
    unit = amplitude_unit(fits.found)
    rows = list(Fitted(solved.group).rows(i))
    return {
        "run": [row.run for row in rows],
        "sensor": [str(row.channel) for row in rows],
        f"read {unit}": [abs(row.value) for row in rows],
        "phase°": [round(float(degrees(row.value)), 2) for row in rows],
        f"off {unit}": [abs(row.residual) for row in rows],
        "standardised": [row.standardized if np.isfinite(row.standardized) else "" for row in rows],
        "": ["outlier" if row.outlier else "" for row in rows],
    }


def summary(fits: LogFits, solved: Solved, i: int) -> str:
    """How many runs and readings were fitted, and how well."""
    fit, log = solved.group.fit, solved.group.logs[i]
    assert fit is not None
    nu = int(fit.degrees_of_freedom[i])
    spread = (
        f"they lie {fit.residual_sd[i]:.4g} {amplitude_unit(fits.found)} from it (standard deviation of a reading as a vector)"
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


def notes(fits: LogFits) -> str:
    """Above the terminal's table."""
    parts = []
    for rotor, solved, i in fits.found.each(FEW):
        name = f"rotor {rotor}: " if fits.found.several else ""
        parts.append(f"{name}{summary(fits, solved, i)}\n{table_text(history(fits, solved, i))}")
    return "\n".join(parts) + "\n"


def afterword(fits: LogFits) -> str:
    """Below the terminal's table: what the next run should read, which run to make."""
    found, lines = fits.found, []
    for rotor, solved, i in found.each(FEW):
        name = f"rotor {rotor}: " if found.several else ""
        lines += [f"{name}{line}" for line in expected(fits, solved, i)]
    return "\n" + "\n".join(lines)


def expected(fits: LogFits, solved: Solved, i: int) -> list[str]:
    """What the next run should read, which run would tell most, and what a robust fit says."""
    found, lines = fits.found, []
    unit = amplitude_unit(found)
    if fits.asked.predict is not None:
        value, sd = (part[i] for part in fits.predicted(solved))
        lines.append(f"a run with {_masses(fits, solved, fits.masses(solved.planes))} should read")
        lines += [
            f"  at sensor {channel}: {abs(v):.4g}{_plus_minus(u)} {unit} at {angle_text(degrees(v), '.2f')}°"
            for channel, v, u in zip(solved.group.channels, value, sd, strict=True)
        ]
    if fits.asked.suggest:
        run = fits.suggested(solved, i)
        if run is None:
            lines.append("no run is suggested: nothing tells how sure the corrections are")
        else:
            lines.append(
                f"the next run that tells most (A-optimal): {_masses(fits, solved, run.masses)}; the corrections' uncertainty falls "
                f"from {found.amount(run.before):.4g} to {found.amount(run.after):.4g} {found.unit}"
            )
    if fits.asked.robust:
        lines.append(f"a robust fit (Huber) corrects with {_masses(fits, solved, fits.robust(solved)[1][i])}")
    return lines


def _plus_minus(sd: float) -> str:
    return f" ± {sd:.2g}" if np.isfinite(sd) else ""


def _masses(
    fits: LogFits, solved: Solved, masses: np.ndarray[tuple[int, ...], np.dtype[np.complex128]]
) -> str:
    return ", ".join(
        f"{fits.found.amount(abs(w)):.6g} {fits.found.unit} at {angle_text(degrees(complex(w)), '.2f')}° in {plane}"
        for plane, w in zip(solved.planes, masses, strict=True)
    )
