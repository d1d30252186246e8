"""Measured runs as people keep them: tables, wide sheets and logs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from balancing.runs.runs import Runs


def read_runs(path: str | Path, *, without_phase: bool = False, lagging: bool = False) -> Runs:
    """Read the runs of rotors from a table, a wide sheet or a log: readings, and the masses that were on.

    Parameters
    ----------
    path : str or Path
        CSV or workbook (docs/field-balancing.md has the layouts), or vectors in YAML or JSON.
    without_phase : bool
        Whether amplitudes alone are read; the readings are then real.
    lagging : bool
        Whether the instrument counts phases against the sense of the mass angles.

    Returns
    -------
    Runs
        `groups` has the rotors that were measured in the same way side by side: g rotors, r rows of readings of the
        s `channels` (sensors, speeds, states), masses in the p `planes`. `readings` (g, r, s) are in the file's
        `amplitude_unit`, NaN where a row lacks a channel; `masses` (g, r, p) are those on the rotor, in kg, or kg·m
        where the file has unbalances. `rotors` has their names, `warnings` what is doubtful.

    Raises
    ------
    DataError
        The table cannot be read, its rows contradict each other, or no mass was ever on a rotor.

    Examples
    --------
    A trial mass of 10 g at 90° takes 8 µm at 0° to 10 µm at 0°:

    >>> from balancing import joint_fit
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     log = Path(folder, "runs.csv")
    ...     head = "run,sensor,amplitude_um,phase_deg,trial_plane,trial_mass_g,trial_angle_deg"
    ...     _ = log.write_text(f"{head}\\ninitial,1,8,0,,,\\ntrial,1,10,0,A,10,90\\n")
    ...     runs = read_runs(log)
    >>> (group,) = runs.groups
    >>> runs.amplitude_unit, group.planes, group.readings.shape, float(abs(group.masses[0, 1, 0]))
    ('um', ['A'], (1, 2, 1), 0.01)
    >>> alpha = joint_fit(group.readings, group.masses).influence[0, 0, 0]
    >>> bool(abs(alpha - 2 / 0.01j) < 1e-12)
    True
    """
    from balancing.runs.reading import read_measured

    measured = read_measured(str(path), (), fit=True, exclude=(), four_run=without_phase, against=lagging)
    runs = measured.rows.rows.of
    runs.groups = list(measured.rows.parts(None))
    runs.warnings += [*runs.table.warnings, *measured.rows.warnings]
    return runs
