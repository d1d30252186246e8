"""From measured runs to corrections, and what is to be said of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from balancing import (
    AmplitudeFit,
    Balance,
    DependentPlanes,
    DependentTrials,
    Infeasible,
    Readings,
    condition_number,
    influence_coefficients,
    influence_from_amplitudes,
    initial_unbalance,
    least_squares,
    minimax,
    place,
    plane_significance,
    spread,
    trial_effect,
    unseen,
)
from cli.errors import DataError
from cli.field_files import Stored
from cli.field_runs import Group, Runs
from cli.read.options import bad
from cli.read.units import degrees, from_si

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

NEARLY = 0.1  # a plane whose effect others bring about but for this share is said to be nearly dependent
SINGULAR = 1e12  # a condition number beyond which the planes count as dependent
MANY = 200  # rotors whose uncertainties are worked out unasked
SHOWN = 5  # of so many rotors the same is said, of the others together
UNKNOWN_ANGLE = 60.0  # an angle that is uncertain by more (degrees) is not known


@dataclass(frozen=True)
class Wanted:
    """What the options ask for."""

    objective: str = "least-squares"
    max_mass: dict[str, float] = field(default_factory=dict)
    """Limit of each plane, SI; the key "" is for all."""
    max_residual: float | None = None
    """In the table's amplitude unit."""
    from_here: bool = False
    runout: dict[str, complex] = field(default_factory=dict)
    reading_error: tuple[float, float] | None = None
    """Relative, rad."""
    monte_carlo: int = 0
    four_run: bool = False
    ridge: float = 0.0
    tolerance: tuple[str | None, float] | None = None
    radius: float | None = None
    conventions: str = ""
    places: list[float] | None = None
    """Where masses can go, degrees: the corrections are split onto them."""


@dataclass
class Solved:
    """A group's result."""

    group: Group
    planes: list[str]
    alpha: Complex
    initial: Complex
    """(g, s), run-out off."""
    corrections: Complex
    """(g, p), as given out (from here, where that was asked for)."""
    standing: Complex
    """(g, p): what of the trial masses is on the rotor where the corrections start from."""
    residual: Complex
    condition: Real
    bound: Real | None
    covariance: Real | None = None
    residual_95: Real | None = None
    fits: list[AmplitudeFit] = field(default_factory=list)
    unbalance: Complex | None = None
    """(g, p): the rotor's own in its initial state; NaN where the readings do not determine it."""

    @property
    def total(self) -> Complex:
        """What is added to the rotor in its initial state, (g, p)."""
        return self.corrections + self.standing


class Solver:
    """The corrections of every rotor of a table of runs."""

    def __init__(self, runs: Runs, wanted: Wanted, stored: Stored | None = None) -> None:
        self.runs, self.wanted, self.stored = runs, wanted, stored
        self.warnings: list[str] = []
        self.several = len(runs.rotors) > 1
        self.solved = [self._solve(group) for group in runs.groups]
        self.place: list[tuple[int, int]] = [(0, 0)] * len(runs.rotors)
        for k, group in enumerate(runs.groups):
            for i, rotor in enumerate(group.rotors.tolist()):
                self.place[rotor] = (k, i)
        for solved in self.solved:
            self._remark(solved)
            for w in solved.corrections[:SHOWN].ravel():
                self.split(w)  # what cannot be reached is said at once

    # -- solving -------------------------------------------------------------------------------------------

    def of(self, group: Group, i: int = 0) -> str:
        return f"rotor {self.runs.rotors[group.rotors[i]]}: " if self.several else ""

    def _solve(self, group: Group) -> Solved:
        wanted = self.wanted
        runout = np.array([wanted.runout.get(channel.sensor, 0) for channel in group.channels], dtype=complex)
        initial = group.initial - runout
        planes, fits = group.planes, []
        if self.stored is not None:
            matrices = []
            for rotor in group.rotors:
                planes, matrix = self.stored.matrix(self.runs.rotors[rotor], group.channels, self.runs)
                matrices.append(matrix)
                if "rotor" not in self.stored.table.texts:
                    break
            alpha = np.broadcast_to(np.stack(matrices), (len(group.rotors), *matrices[0].shape))
        elif wanted.four_run:
            fits = self._amplitudes(group)
            alpha = np.stack([fit.influence for fit in fits])[..., None]
        else:
            try:
                alpha = influence_coefficients(group.initial, group.runs, group.on)
            except DependentTrials as error:
                raise DataError(self.of(group, *error.case) + self._trials_say(group, error)) from None
        standing = np.zeros((len(group.rotors), len(planes)), dtype=complex)
        if wanted.from_here and self.stored is None:
            standing = group.kept
            if not standing.any():
                self.warn(
                    "--from-here: no trial mass is kept on the rotor, so that it stands as in the initial run"
                )
        here = initial + np.matvec(alpha, standing) if standing.any() else initial
        limit = self.limits(planes)
        corrections, bounds, condition = self._corrections(group, planes, alpha, here, limit)
        residual = here + np.matvec(alpha, corrections)
        # below the rounding of its terms a residual is zero
        noise = np.abs(initial) + np.matvec(np.abs(alpha), np.abs(corrections) + np.abs(standing))
        residual = np.where(np.abs(residual) > 1e-15 * noise, residual, 0)
        solved = Solved(
            group, planes, alpha, initial, corrections, standing, residual, condition, bounds, fits=fits
        )
        if wanted.tolerance is not None:
            solved.unbalance = initial_unbalance(alpha, initial, group.weights, singular=SINGULAR)
        limited = bool(wanted.objective == "minimax" or wanted.max_mass or wanted.max_residual is not None)
        if wanted.reading_error is not None or self._repeats_tell(group, limited):
            self._confidence(solved, runout, limited)
        return solved

    def _repeats_tell(self, group: Group, limited: bool) -> bool:
        """Whether the scatter of repeats is to give uncertainties that nobody asked for."""
        if self.wanted.four_run or not group.reading_sd.any():
            return False
        if len(group.rotors) <= (SHOWN if limited else MANY):
            return True
        self.warn("uncertainties of so many rotors are worked out with --reading-error alone")
        return False

    def limits(self, planes: list[str]) -> Real | None:
        given = self.wanted.max_mass
        if not given:
            return None
        for name in given:
            if name and name not in planes:
                raise bad("--max-mass", f"no plane {name}: expected one of {', '.join(planes)}")
        limit = np.array([given.get(plane, given.get("", np.inf)) for plane in planes])
        return limit if np.isfinite(limit).any() else None

    def _corrections(
        self, group: Group, planes: list[str], alpha: Complex, here: Complex, limit: Real | None
    ) -> tuple[Complex, Real | None, Real]:
        """Return the corrections, for minimax the proven bounds, and the condition numbers."""
        wanted, weights = self.wanted, group.weights
        ceiling = wanted.max_residual
        if limit is None and not wanted.ridge:
            # the coefficients are differences of readings: what lies in their rounding is no information
            beyond = np.flatnonzero(~(condition_number(alpha, weights) < SINGULAR))
            if len(beyond):
                i = int(beyond[0])
                unseen_one = unseen(alpha[i], None if weights is None else weights[i])[0]
                raise DataError(self.of(group, i) + self._planes_say(planes, unseen_one))
        if wanted.objective == "least-squares" and limit is None and ceiling is None:
            try:
                fix = least_squares(alpha, here, weights, ridge=wanted.ridge)
            except DependentPlanes as error:
                raise DataError(
                    self.of(group, *error.case[:1]) + self._planes_say(planes, error.combination)
                ) from None
            return fix.corrections, None, fix.condition_number
        if wanted.objective == "minimax":
            proven = [
                self._one(group, planes, i, lambda i=i: self._minimax(alpha[i], here[i], limit, weights, i))  # type: ignore[misc]
                for i in range(len(here))
            ]
            return (
                np.stack([fix.corrections for fix in proven]),
                np.array([fix.bound for fix in proven], dtype=float),
                np.array([fix.condition_number for fix in proven]),
            )
        # rotors that keep the limits by themselves all at once, the others one by one
        corrections = np.zeros((len(here), len(planes)), dtype=complex)
        left = np.arange(len(here))
        try:
            free = least_squares(alpha, here, weights)
            corrections[:] = free.corrections
            beyond = np.zeros(len(here), dtype=bool)
            if limit is not None:
                beyond |= (np.abs(free.corrections) > limit).any(axis=1)
            if ceiling is not None:
                beyond |= (np.abs(free.residual) > ceiling).any(axis=1)
            left = np.flatnonzero(beyond)
        except DependentPlanes:
            pass
        for i in left.tolist():
            w = None if weights is None else weights[i]
            corrections[i] = self._one(
                group,
                planes,
                i,
                lambda i=i, w=w: least_squares(alpha[i], here[i], w, max_mass=limit, max_residual=ceiling),  # type: ignore[misc]
            ).corrections
        return corrections, None, condition_number(alpha, weights)

    def _minimax(
        self, alpha: Complex, here: Complex, limit: Real | None, weights: Real | None, i: int
    ) -> Balance:
        """Minimax corrections of one rotor; Infeasible where even they leave more than --max-residual."""
        fix = minimax(alpha, here, limit, weights=None if weights is None else weights[i])
        ceiling = self.wanted.max_residual
        if ceiling is not None and float(fix.residual_max) > ceiling * (1 + 1e-9):
            least = (
                float(minimax(alpha, here, limit).residual_max) if weights is not None else fix.residual_max
            )
            if least > ceiling * (1 + 1e-9):
                raise Infeasible(float(least))
            self.warn(
                "with these weights a residual is beyond --max-residual, which without them could be met"
            )
        return fix

    def _one(self, group: Group, planes: list[str], i: int, solve: Callable[[], Balance]) -> Balance:
        """Solve for one rotor; what cannot be done is said with its name."""
        try:
            return solve()
        except DependentPlanes as error:
            raise DataError(self.of(group, i) + self._planes_say(planes, error.combination)) from None
        except Infeasible as error:
            unit = self.runs.amplitude_unit
            with_limits = " with the limits of the masses" if self.wanted.max_mass else ""
            raise DataError(
                f"{self.of(group, i)}no corrections{with_limits} leave every residual within {self.wanted.max_residual:g} "
                f"{unit}: infeasible; the smallest limit that can be met is {error.smallest:.6g} {unit}"
            ) from None

    def _amplitudes(self, group: Group) -> list[AmplitudeFit]:
        """The four-run method, rotor by rotor."""
        if len(group.planes) != 1:
            raise DataError(
                f"{self.of(group)}the four-run method is for one plane, found {', '.join(group.planes)}: with more planes "
                "the phase must be measured"
            )
        fits = []
        for i in range(len(group.rotors)):
            try:
                fit = influence_from_amplitudes(group.initial[i].real, group.runs[i].real, group.on[i, :, 0])
            except ValueError as error:
                raise DataError(f"{self.runs.table.file}: {self.of(group, i)}{error}") from None
            fits.append(fit)
            unit = self.runs.amplitude_unit
            for channel, misfit, first in zip(group.channels, fit.misfit, group.initial[i].real, strict=True):
                text = (
                    f"{self.of(group, i)}sensor {channel}: the readings are inconsistent: no influence coefficient fits them "
                    f"better than {misfit:.3g} {unit} (r.m.s.), {misfit / first:.0%} of the initial reading"
                )
                if misfit > 0.25 * first:
                    raise DataError(
                        f"{self.runs.table.file}: {text}: expected four readings that fit one plane's effect"
                    )
                if misfit > 0.05 * first:
                    self.warn(text)
        return fits

    def _confidence(self, solved: Solved, runout: Complex, limited: bool) -> None:
        """Propagate the reading errors, rotor by rotor."""
        relative, angle = self.wanted.reading_error or (0.0, 0.0)
        group, wanted = solved.group, self.wanted
        covariances, residuals = [], []
        draws = wanted.monte_carlo or 4000
        for i in range(len(group.rotors)):
            readings = Readings(
                group.initial[i],
                relative,
                angle,
                trials=None if self.stored is not None else group.runs[i],
                trial_masses=None if self.stored is not None else group.on[i],
                influence=solved.alpha[i],
                runout=runout,
                scatter=group.mean_error[i] if group.reading_sd[i] else None,
                degrees_of_freedom=group.repeats,
            )
            w = None if group.weights is None else group.weights[i]
            total = solved.total[i]
            try:
                if limited:
                    samples = self._limited_samples(solved, readings, w)
                    covariances.append(spread(samples, solved.corrections[i]))
                elif wanted.monte_carlo:
                    samples = readings.correction_samples(w, wanted.ridge, draws) - solved.standing[i]
                    covariances.append(spread(samples, solved.corrections[i]))
                else:
                    covariances.append(
                        readings.covariance(total, w, wanted.ridge, along=solved.corrections[i])
                    )
            except ValueError:
                covariances.append(np.full((len(solved.planes), 2, 2), np.nan))
            left = np.abs(readings.residual_samples(total, draws)).max(axis=1)
            residuals.append(np.quantile(left, 0.95))
        solved.covariance, solved.residual_95 = np.stack(covariances), np.array(residuals)

    def _limited_samples(self, solved: Solved, readings: Readings, weights: Real | None) -> Complex:
        """Draw corrections under limits or of the minimax problem: no formula, each draw is solved."""
        limit, wanted = self.limits(solved.planes), self.wanted
        samples = []
        for alpha, v in readings.problem_samples(min(wanted.monte_carlo or 200, 1000)):
            standing = solved.standing[0]
            here = v + alpha @ standing
            if wanted.objective == "minimax":
                samples.append(minimax(alpha, here, limit, weights=weights).corrections)
            else:
                samples.append(least_squares(alpha, here, weights, max_mass=limit).corrections)
        return np.stack(samples)

    # -- what is to be said --------------------------------------------------------------------------------

    def warn(self, text: str) -> None:
        if text not in self.warnings:
            self.warnings.append(text)

    def _more(self, count: int, what: str) -> None:
        if count > SHOWN:
            self.warn(f"… and the same of {count - SHOWN} further rotors: {what}")

    def _combination(self, names: list[str], combination: Complex) -> str:
        terms = []
        for name, share in zip(names, combination, strict=True):
            if abs(share) > 1e-6:
                terms.append(f"{abs(share):.3g} at {float(degrees(share)):.0f}° in {name}")
        return ", ".join(terms)

    def _planes_say(self, planes: list[str], combination: Complex) -> str:
        told = [name for name, share in zip(planes, combination, strict=True) if abs(share) > 1e-6]
        if len(told) == 1:
            return (
                f"plane {told[0]} has no effect on any reading: its correction cannot be found; expected sensors that "
                "respond to it, or the plane left out"
            )
        return (
            f"the readings cannot tell the planes {' and '.join(told)} apart (singular): masses in the ratio "
            f"{self._combination(planes, combination)} leave no trace; leave one of these planes out, or damp with --ridge"
        )

    def _trials_say(self, group: Group, error: DependentTrials) -> str:
        told = [
            name for name, share in zip(group.planes, error.combination, strict=True) if abs(share) > 1e-6
        ]
        runs = len(group.trials)
        if runs < len(group.planes):
            return (
                f"{len(group.planes)} planes ({', '.join(group.planes)}) and {runs} trial run{'s' * (runs != 1)}: expected a "
                "trial run for every plane"
            )
        return (
            f"the trial runs do not tell the planes {' and '.join(told)} apart: expected each plane tried by itself, "
            "or in different proportions"
        )

    def _remark(self, solved: Solved) -> None:
        group, planes = solved.group, solved.planes
        still = np.flatnonzero(~np.abs(solved.initial).any(axis=1))
        for i in still[:SHOWN]:
            self.warn(f"{self.of(group, int(i))}no vibration in the initial run: nothing to correct")
        self._more(len(still), "no vibration in the initial run")
        doubtful = np.flatnonzero(~(solved.condition < 5)) if len(planes) > 1 else np.zeros(0, dtype=int)
        if len(doubtful):
            weights = None if group.weights is None else group.weights[doubtful]
            share = plane_significance(solved.alpha[doubtful], weights)
            weak = share < NEARLY
            rows = np.flatnonzero(weak.any(axis=1))
            for k in rows[:SHOWN]:
                named = [f"{planes[p]} ({share[k, p]:.2g})" for p in np.flatnonzero(weak[k])]
                i = int(doubtful[k])
                self.warn(
                    f"{self.of(group, i)}planes nearly dependent: others bring about what these do but for the share in "
                    f"brackets: {', '.join(named)}; condition number {solved.condition[i]:.3g}, errors grow by as much: leave "
                    "one out, or damp with --ridge"
                )
            self._more(len(rows), "planes nearly dependent")
        if not self.wanted.four_run:
            self._thirty(group)
        for i, fit in enumerate(solved.fits):
            for s, (first, rival) in enumerate(zip(group.initial[i], fit.other, strict=True)):
                if rival == rival:
                    other = -first / rival
                    self.warn(
                        f"{self.of(group, i)}sensor {group.channels[s]}: two corrections fit the amplitudes; the other one is "
                        f"{self._amount(abs(other)):.6g} {self._unit} at {float(degrees(other)):.2f}°: a further trial run at "
                        "another angle decides"
                    )
        if self.wanted.tolerance is not None and solved.unbalance is not None:
            unknown = np.isnan(solved.unbalance)
            lost = np.flatnonzero(unknown.any(axis=1))
            for i in lost[:SHOWN]:
                told = [planes[p] for p in np.flatnonzero(unknown[i])]
                self.warn(
                    f"{self.of(group, int(i))}the initial unbalance is not determined in plane{'s' * (len(told) > 1)} "
                    f"{' and '.join(told)}: {_why(group, planes, told)}; whether it is within the tolerance is not known"
                )
            self._more(len(lost), "the initial unbalance is not determined in every plane")
            # from here on means with the trial masses that were left on the rotor
            size = self._in_kg_m(solved.unbalance + solved.standing)
            good = np.flatnonzero((size <= self.wanted.tolerance[1] / len(planes)).all(axis=1))
            for i in good[:SHOWN]:
                self.warn(
                    f"{self.of(group, int(i))}already within the permissible residual unbalance in every plane: stop, no "
                    "correction is needed"
                )
            self._more(len(good), "already within the permissible residual unbalance")
        if self.wanted.max_residual is not None:
            fine = (np.abs(solved.initial) <= self.wanted.max_residual).all(axis=1)
            for i in np.flatnonzero(fine)[:SHOWN]:
                self.warn(f"{self.of(group, int(i))}the initial vibration is within --max-residual already")
            self._more(int(fine.sum()), "initial vibration within --max-residual already")

    def _thirty(self, group: Group) -> None:
        """The 30/30 rule."""
        for j, trial in enumerate(group.trials):
            if not trial.masses:
                continue
            before = group.initial if group.base[j] < 0 else group.runs[:, group.base[j]]
            effect = trial_effect(before, group.runs[:, j])
            little = ~((effect.amplitude >= 0.3) | (effect.phase >= np.radians(30))).any(axis=1)
            for i in np.flatnonzero(little)[:SHOWN]:
                most = np.max(effect.amplitude[i])
                turn = np.degrees(np.max(effect.phase[i]))
                self.warn(
                    f"{self.of(group, int(i))}run {trial.run}: the trial mass changed the vibration by {most:.0%} and {turn:.0f}° "
                    "at most: less than 30 % and 30°, its coefficients may be noise; expected a larger trial mass"
                )
            self._more(int(little.sum()), f"run {trial.run} changed the vibration by less than 30 % and 30°")

    def _verdict(self, solved: Solved, i: int) -> list[tuple[str, float, float]]:
        """For each plane: name, permissible and initial unbalance, kg·m; NaN where the readings do not determine it."""
        assert self.wanted.tolerance is not None
        assert solved.unbalance is not None
        share = self.wanted.tolerance[1] / len(solved.planes)
        size = self._in_kg_m(solved.unbalance[i])
        return [(plane, share, float(u)) for plane, u in zip(solved.planes, size, strict=True)]

    def _in_kg_m(self, corrections: Complex) -> Real:
        """Return the unbalances of masses at the trial radius, or of unbalances as they are."""
        arm = 1.0 if self.runs.per == "unbalance" else self.wanted.radius or 1.0
        return np.asarray(np.abs(corrections) * arm)

    @property
    def _unit(self) -> str:
        return self.runs.mass_unit.replace("_", "·")

    def _amount(self, value: Any) -> Any:
        return from_si(value, self.runs.per, self.runs.mass_unit)

    def split(self, w: complex) -> list[tuple[str, float, float]]:
        """Split a correction onto the places: name, angle in degrees, amount in SI of each that is used."""
        if self.wanted.places is None or w == 0:
            return []
        placed = place(complex(w), np.radians(self.wanted.places))
        if abs(placed.error) > 1e-9 * abs(w):
            self.warn(f"a correction at {degrees(w):.4g}° cannot be reached from the places given")
        return [
            (str(k + 1), self.wanted.places[k] % 360.0, float(mass))
            for k, mass in enumerate(placed.masses)
            if mass > 0
        ]


def _why(group: Group, planes: list[str], told: list[str]) -> str:
    """Why the readings do not determine the unbalance in the planes `told`."""
    if len(group.channels) < len(planes):
        return f"{len(group.channels)} readings for {len(planes)} planes"
    return "no reading responds to it" if len(told) == 1 else "the readings cannot tell them apart"
