"""Measured runs as people keep them: tables, wide sheets and logs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from balancing.runs.runs import Runs


def read_runs(
    path: str | Path,
    influence: str | Path | Sequence[str | Path] = (),
    *,
    without_phase: bool = False,
    lagging: bool = False,
) -> Runs:
    """Read the runs of rotors from a table, a wide sheet or a log: readings, and the masses that were on.

    Parameters
    ----------
    path : str or Path
        CSV or workbook (docs/field-balancing.md has the layouts), or vectors in YAML or JSON.
    influence : str, Path or several
        Files of stored influence coefficients, as `dalembert field --save-influence` writes them; of sister machines too.
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
        where the file has unbalances. `rotors` has their names, `warnings` what is doubtful. With stored coefficients
        `group.before.prior` has them, as `fit_with_prior` takes them; the planes are theirs.

    Raises
    ------
    DataError
        The table cannot be read, its rows contradict each other, no coefficient is stored for a sensor or a plane, or, without
        stored coefficients, no mass was ever on a rotor.

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

    A later run of this machine, with the coefficient that is stored (µm per g):

    >>> from balancing import fit_with_prior, least_squares
    >>> with TemporaryDirectory() as folder:
    ...     today, stored = Path(folder, "today.csv"), Path(folder, "coefficients.csv")
    ...     _ = today.write_text("run,sensor,amplitude_um,phase_deg\\ntoday,1,6,0\\n")
    ...     _ = stored.write_text("sensor,plane,magnitude_per_g,phase_deg\\n1,A,0.2,-90\\n")
    ...     (group,) = read_runs(today, stored).groups
    >>> fit = fit_with_prior(group.readings, group.masses, group.before.prior)
    >>> least_squares(fit.influence, fit.initial).corrections.round(9)
    array([[0.-0.03j]])
    """
    from balancing.runs.reading import read_measured
    from balancing.runs.stored_planes import in_stored_planes

    files = [influence] if isinstance(influence, (str, Path)) else influence
    measured = read_measured(
        str(path), [*map(str, files)], fit=True, exclude=(), four_run=without_phase, against=lagging
    )
    runs, stored = measured.rows.rows.of, measured.sisters
    named = None if stored is None else [stored.key(name) for name in runs.rotors]
    for group in measured.rows.parts(named):
        if stored is not None:
            group = in_stored_planes(group, runs, stored)
            group.before = stored.before(runs.rotors[group.rotors[0]], group.channels, runs)
        runs.groups.append(group)
    runs.warnings += [*runs.table.warnings, *measured.warnings, *measured.rows.warnings]
    return runs
