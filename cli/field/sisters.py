"""Stored coefficients, of sister machines too, as what is known before the runs of a log are fitted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from balancing import pooled_prior, stored_prior
from cli.field.runs import Before, Channel, Complex, Runs
from cli.field.stored import Stored
from dalembert.errors import DataError


class Sisters:
    """The files of `--influence` as prior knowledge of a fit: of the rotor they name, or of all machines in them."""

    def __init__(self, files: Sequence[Stored]) -> None:
        self.files = files
        self.unit = files[0].unit
        for one in files[1:]:
            if one.unit != self.unit:
                raise DataError(
                    f"{one.table.file}: coefficients per {one.unit}, in {files[0].table.file} per {self.unit}: expected one unit"
                )
        self._known: dict[tuple[object, ...], Before] = {}

    def _machines(self, rotor: str) -> list[tuple[Stored, str]]:
        """Return the machines that count for a rotor: itself, where the files name it, or all of them."""
        if self.key(rotor) is not None:
            return [(one, rotor) for one in self.files if rotor in one.rotors]
        return [(one, name) for one in self.files for name in (one.rotors or ("",))]

    def key(self, rotor: str) -> str | None:
        """Return what is the same for rotors of which the same is known."""
        return rotor if any(rotor in one.rotors for one in self.files) else None

    def planes(self, rotor: str) -> list[str]:
        """Return the planes of the coefficients."""
        machines = self._machines(rotor)
        first, *others = (one.planes(name) for one, name in machines)
        for planes, (one, _) in zip(others, machines[1:], strict=True):
            if set(planes) != set(first):
                raise DataError(
                    f"{one.table.file}: coefficients of the planes {', '.join(planes)}: expected {', '.join(first)}, as in "
                    f"{machines[0][0].table.file}"
                )
        return first

    def known(self, rotor: str, channels: Sequence[Channel], runs: Runs) -> Before:
        """Return what is known of a rotor in these channels."""
        key = (self.key(rotor), *channels)
        if key not in self._known:
            self._known[key] = self._pooled(rotor, channels, runs)
        return self._known[key]

    def _pooled(self, rotor: str, channels: Sequence[Channel], runs: Runs) -> Before:
        machines, planes = self._machines(rotor), self.planes(rotor)
        each = [one.coefficients(name, channels, planes, runs) for one, name in machines]
        alpha = np.stack([one.alpha for one in each])
        stated = [one.covariance for one in each if one.covariance is not None]
        if stated and len(stated) < len(each):
            runs.warnings.append(
                "--influence: where a file states no uncertainty its coefficients count as exact"
            )
        covariance: Complex = np.stack(
            [
                np.zeros((*one.alpha.shape, len(planes))) if one.covariance is None else one.covariance
                for one in each
            ]
        )
        if len(each) > 1:
            prior = pooled_prior(alpha, covariance)
        else:
            prior = stored_prior(alpha[0], covariance[0], each[0].degrees_of_freedom)
            if self.key(rotor) is None and stated:
                runs.warnings.append(
                    "--influence: one machine's coefficients do not tell how machines differ: they count with the errors of their "
                    "own runs alone; expected the files of several machines, --influence once for each"
                )
            elif not stated:
                runs.warnings.append("--influence: the coefficients state no uncertainty and count as exact")
        told = [(one.reading_sd, one.degrees_of_freedom) for one in each if one.reading_sd > 0]
        scatter = None
        if told:
            sds, nus = (np.array(part) for part in zip(*told, strict=True))
            known = np.isinf(nus).any()
            weight = np.isinf(nus).astype(float) if known else nus
            sd = float(np.sqrt((weight * np.square(sds)).sum() / weight.sum()))
            scatter = (sd, np.inf if known else float(nus.sum()))
        between = float(prior.scatter)
        return Before(prior, len(each), between if between == between else None, scatter)
