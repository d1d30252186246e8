"""Runs in the planes whose influence coefficients are stored."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from balancing.runs.runs import Group, Runs
from balancing.runs.stored import Sisters, Stored
from dalembert.errors import DataError


def in_stored_planes(group: Group, runs: Runs, coefficients: Stored | Sisters) -> Group:
    """Return rotors with the planes whose coefficients are stored; a table that names none has the only one."""
    of = runs.of(group.rotors[0])
    covered = coefficients.planes(runs.rotors[group.rotors[0]])
    planes = group.planes
    if len(covered) == 1 and "trial_plane" not in runs.table.texts:
        planes = covered[: len(planes)]
    at = [covered.index(plane) if plane in covered else -1 for plane in planes]
    for own, plane in enumerate(planes):
        if at[own] < 0 and group.masses[..., own].any():
            raise DataError(
                f"{runs.table.file}: {of}a mass in plane {plane}, which has no stored coefficient: expected "
                f"{', '.join(covered)}"
            )
        if at[own] < 0 and group.standing[:, own].any():
            runs.warnings.append(
                f"{of}the last run has a mass in plane {plane}, which has no stored coefficient: the trim leaves it out"
            )
    if runs.other_masses:
        at = [-1] * len(at)
        runs.warnings.append(
            f"{of}the stored coefficients are per {runs.per}, and the runs have other masses: what is on the rotor in "
            "its last run is not known, and the trim leaves it out"
        )
    kept, there = [k for k, p in enumerate(at) if p >= 0], [p for p in at if p >= 0]
    masses, standing = (
        np.zeros((*of.shape[:-1], len(covered)), dtype=complex) for of in (group.masses, group.standing)
    )
    masses[..., there], standing[..., there] = group.masses[..., kept], group.standing[..., kept]
    return replace(
        group,
        planes=covered,
        masses=masses,
        standing=standing,
        exact=lambda: group.exact().in_planes(kept, there, len(covered)),
    )
