"""From measured runs to corrections, with their uncertainty."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from balancing import (
    AmplitudeFit,
    Balance,
    DependentPlanes,
    Infeasible,
    JointFit,
    LogBalance,
    NotConverged,
    condition_number,
    influence_from_amplitudes,
    initial_alone,
    initial_unbalance,
    least_squares,
    place,
    unseen,
)
from cli.field.request import Request, ceiling_in, limits_in, masses_at
from cli.field.runs import SHOWN, Complex, Group, Real, Runs
from cli.field.solution import (
    Problem,
    Solved,
    Sought,
    confidence,
    errors_of_means,
    least_maximum,
    within_limits,
)
from cli.field.stored import Stored
from cli.read.options import bad
from dalembert.angles import degrees
from dalembert.arithmetic.parts import in_parts
from dalembert.errors import DataError
from dalembert.units import Scaled, amplitude_kind, from_si

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from balancing.reading_errors import Errors

Result = TypeVar("Result")

SINGULAR = 1e12  # a condition number beyond which the planes count as dependent
MANY = 200  # rotors whose uncertainties are worked out unasked


class FieldBalancing:
    """The corrections of every rotor of a table of runs."""

    def __init__(
        self, runs: Runs, request: Request, stored: Stored | None = None, executor: Executor | None = None
    ) -> None:
        self.runs, self.request, self.stored, self.executor = runs, request, stored, executor
        if request.tolerance is not None and runs.per == "mass" and request.radius is None:
            raise bad("--radius", "the tolerance is of unbalances: expected the radius of the trial masses")
        if request.zone_class is not None and amplitude_kind(runs.amplitude_unit)[0] != "velocity":
            raise bad(
                "--zone-class",
                f"zones are of velocities, the readings are in {runs.amplitude_unit}: expected mm_s",
            )
        self.max_mass = limits_in(request.max_mass, runs) or runs.max_mass
        """Limit of each plane, SI; the key "" is for all."""
        self.ceiling = ceiling_in(request.max_residual, runs)
        """Of the residuals, in the table's amplitude unit."""
        self.predict = masses_at(request.predict, runs)
        """Plane -> mass of a run to be predicted, SI; the key "" is the only plane."""
        self.limited = bool(request.objective == "minimax" or self.max_mass or self.ceiling is not None)
        """Whether the corrections are others than those by plain least squares."""
        self.warnings: list[str] = []
        self.solved = [self._solve(group) for group in runs.groups]
        self.place: list[tuple[int, int]] = [(0, 0)] * len(runs.rotors)
        for k, group in enumerate(runs.groups):
            for i, rotor in enumerate(group.rotors.tolist()):
                self.place[rotor] = (k, i)

    # -- solving -------------------------------------------------------------------------------------------

    def of(self, group: Group, i: int = 0) -> str:
        """Return what a sentence about a rotor begins with, where there are several."""
        return self.runs.of(group.rotors[i])

    def runout(self, group: Group) -> Complex:
        """Return the run-out of each channel, (s,)."""
        return np.array(
            [self.runs.runout.get(channel.sensor, 0) for channel in group.channels], dtype=complex
        )

    def _solve(self, group: Group) -> Solved:
        request = self.request
        planes, fit, fits = self._fit(group)
        alpha = fit.influence
        standing = self._standing(group, planes)
        start = standing if request.from_here else np.zeros_like(standing)
        if request.from_here and not standing.any():
            self.warnings.append(
                "--from-here: the last run has no mass on the rotor, so that it stands as in the initial run"
            )
        initial = group.initial - self.runout(group)
        problem = Problem(group, planes, fit, fits, initial, standing, start, self._limits(planes))
        corrections, bound, condition = self._corrections(problem)
        if request.view is not None and len(planes) != 2:
            raise bad(
                "--view", f"static and couple parts need two planes, found {len(planes)}: {', '.join(planes)}"
            )
        residual = problem.here + np.matvec(alpha, corrections)
        # below the rounding of its terms a residual is zero
        noise = np.abs(initial) + np.matvec(np.abs(alpha), np.abs(corrections) + np.abs(start))
        residual = np.where(np.abs(residual) > 1e-15 * noise, residual, 0)
        unbalance = None
        if request.tolerance is not None:
            unbalance = initial_unbalance(alpha, initial, group.weights, singular=SINGULAR)
        arguments = (group, planes, fit, fits, initial, standing, start, problem.limit)
        solved = Solved(*arguments, corrections, residual, condition, bound, unbalance)
        if self.runs.fitted or request.reading_error is not None or self._repeats_tell(group):
            self._doubt(solved)
        return solved

    def _standing(self, group: Group, planes: list[str]) -> Complex:
        """Return what is on the rotors in their last run in these planes, (g, p)."""
        named = group.planes
        if named == planes:
            return group.standing
        if len(planes) == 1 and "trial_plane" not in self.runs.table.texts:
            named = planes[: len(named)]
        standing = np.zeros((len(group.rotors), len(planes)), dtype=complex)
        for p, plane in enumerate(named):
            if plane in planes:
                standing[:, planes.index(plane)] = group.standing[:, p]
            elif group.standing[:, p].any():
                self.warnings.append(
                    f"{self.of(group)}the last run has a mass in plane {plane}, of which no coefficient is stored: the trim "
                    "leaves it out"
                )
        return standing

    def _fit(self, group: Group) -> tuple[list[str], JointFit, list[list[AmplitudeFit]]]:
        """Return the planes, and the fit of initial vibration and coefficients: these stored, or from amplitudes alone."""
        if group.fit is not None:
            return group.planes, group.fit, []
        if self.request.four_run:
            fits = self._amplitudes(group)
            alpha = np.array([[fit.influence for fit in one] for one in fits]).swapaxes(1, 2)
            first = group.readings[:, group.trials[0].lines]
            return group.planes, initial_alone(first, alpha), fits
        assert self.stored is not None
        planes, matrices = group.planes, []
        for rotor in group.rotors:
            planes, matrix = self.stored.matrix(self.runs.rotors[rotor], group.channels, self.runs)
            matrices.append(matrix)
            if "rotor" not in self.stored.table.texts:
                break
        alpha = np.broadcast_to(np.stack(matrices), (len(group.rotors), *matrices[0].shape))
        return planes, initial_alone(group.readings, alpha), []

    def _repeats_tell(self, group: Group) -> bool:
        """Whether the scatter of repeats is to give uncertainties that nobody asked for."""
        if self.request.four_run or not group.reading_sd.any():
            return False
        if len(group.rotors) <= (SHOWN if self.limited else MANY):
            return True
        self.warnings.append("uncertainties of so many rotors are worked out with --reading-error alone")
        return False

    def _limits(self, planes: list[str]) -> Real | None:
        bound = self.max_mass
        for name in bound:
            if name and name not in planes:
                raise bad("--max-mass", f"no plane {name}: expected one of {', '.join(planes)}")
        limit = np.array([bound.get(plane, bound.get("", np.inf)) for plane in planes])
        return limit if np.isfinite(limit).any() else None

    def _corrections(self, problem: Problem) -> tuple[Complex, Real | None, Real]:
        """Return the corrections, for minimax the proven bounds, and the condition numbers."""
        request, weights = self.request, problem.group.weights
        alpha, here, limit, ceiling = problem.alpha, problem.here, problem.limit, self.ceiling
        minimax = request.objective == "minimax"
        fix = None
        if not minimax and limit is None and ceiling is None:
            fix = self._one(
                problem,
                lambda: least_squares(alpha, here, weights, ridge=request.ridge),
            )
        condition = condition_number(alpha, weights) if fix is None else fix.condition_number
        if limit is None and not request.ridge:
            # the coefficients are differences of readings: what lies in their rounding is no information
            beyond = np.flatnonzero(~(condition < SINGULAR))
            if len(beyond):
                i = int(beyond[0])
                hidden = unseen(alpha[i], problem.group.own_weights(i))[0]
                raise DataError(self.of(problem.group, i) + planes_say(problem.planes, hidden))
        if fix is not None:
            return fix.corrections, None, condition
        if minimax:
            proven = self._one_by_one(least_maximum, problem, range(len(here)))
            return (
                np.stack([fix.corrections for fix in proven]),
                np.array([fix.bound for fix in proven], dtype=float),
                np.array([fix.condition_number for fix in proven]),
            )
        # rotors that keep the limits by themselves all at once, the others one by one
        corrections = np.zeros((len(here), len(problem.planes)), dtype=complex)
        beyond = np.ones(len(here), dtype=bool)
        try:
            free = least_squares(alpha, here, weights)
            corrections[:] = free.corrections
            beyond[:] = False
            if limit is not None:
                beyond |= (np.abs(free.corrections) > limit).any(axis=1)
            if ceiling is not None:
                beyond |= (np.abs(free.residual) > ceiling).any(axis=1)
        except DependentPlanes:
            pass
        rest = np.flatnonzero(beyond).tolist()
        for i, one in zip(rest, self._one_by_one(within_limits, problem, rest), strict=True):
            corrections[i] = one.corrections
        return corrections, None, condition

    def _one_by_one(
        self, solve: Callable[..., tuple[Balance, bool]], problem: Problem, rotors: Sequence[int]
    ) -> list[Balance]:
        """Solve for rotors, each by itself."""
        ceiling, group = self.ceiling, problem.group
        parts = (
            (problem.alpha[i], problem.here[i], problem.limit, ceiling, group.own_weights(i)) for i in rotors
        )
        results, answers = in_parts(solve, parts, self.executor), []
        for i in rotors:
            fix, beyond = self._one(problem, lambda: next(results), i)
            if beyond:
                self.warnings.append(
                    "with these weights a residual is beyond --max-residual, which without them could be met"
                )
            if fix.status != "optimal":
                self.warnings.append(f"{self.of(group, i)}{fix.status}")
            answers.append(fix)
        return answers

    def _one(self, problem: Problem, solve: Callable[[], Result], i: int | None = None) -> Result:
        """Solve for one rotor, or for all; an error names the rotor."""
        try:
            return solve()
        except DependentPlanes as error:
            of = self.of(problem.group, *(error.case[:1] if i is None else [i]))
            raise DataError(of + planes_say(problem.planes, error.combination)) from None
        except Infeasible as error:
            unit = self.runs.amplitude_unit
            with_limits = " with the limits of the masses" if self.max_mass else ""
            raise DataError(
                f"{self.of(problem.group, i or 0)}no corrections{with_limits} leave every residual within "
                f"{self.ceiling:g} {unit}: infeasible; the smallest limit that can be met is {error.rounded_up} {unit}"
            ) from None
        except NotConverged as error:
            raise DataError(f"{self.of(problem.group, i or 0)}{error}") from None

    def _amplitudes(self, group: Group) -> list[list[AmplitudeFit]]:
        """The four-run method, rotor by rotor, plane by plane: each run with masses has them in one plane.

        Several planes (Everett, J. Vib. Acoust. 109 (1987) 162-167): at each sensor the phases of all coefficients count from
        that sensor's own initial vibration, so that O + Σ α w = 0 is one linear system whatever these phases are.
        """
        several = np.flatnonzero((group.on[:, 1:] != 0).sum(axis=2).max(axis=0, initial=0) > 1)
        if len(several):
            raise DataError(
                f"{self.of(group)}run {group.trials[1 + several[0]].run}: masses in several planes: without phase each trial run "
                "has a mass in one plane, the others empty: four runs for the first plane, then three for each other one"
            )
        return [
            [self._amplitudes_of(group, i, p) for p in range(len(group.planes))]
            for i in range(len(group.rotors))
        ]

    def _amplitudes_of(self, group: Group, i: int, p: int) -> AmplitudeFit:
        """Fit one plane's coefficients to the amplitudes of its trial runs."""
        named = f" plane {group.planes[p]}:" if len(group.planes) > 1 else ""
        first, *runs = group.means[i].real
        tried = np.flatnonzero(group.on[i, 1:, p] != 0)
        try:
            fit = influence_from_amplitudes(first, np.array(runs)[tried], group.on[i, 1 + tried, p])
        except ValueError as error:
            raise DataError(
                f"{self.runs.table.file}: {self.of(group, i)}{named.lstrip()}{' ' * bool(named)}{error}"
            ) from None
        unit = self.runs.amplitude_unit
        for channel, misfit, size in zip(group.channels, fit.misfit, first, strict=True):
            text = (
                f"{self.of(group, i)}sensor {channel}:{named} the readings are inconsistent: no influence coefficient fits them "
                f"better than {misfit:.3g} {unit} (r.m.s.), {misfit / size:.0%} of the initial reading"
            )
            if misfit > 0.25 * size:
                raise DataError(
                    f"{self.runs.table.file}: {text}: expected four readings that fit one plane's effect"
                )
            if misfit > 0.05 * size:
                self.warnings.append(text)
        if named and not np.isnan(fit.other).all():
            raise DataError(
                f"{self.runs.table.file}: {self.of(group, i)}two coefficients of plane {group.planes[p]} fit the amplitudes: expected "
                "a third trial run in this plane, at an angle off the line of the others"
            )
        return fit

    def _sought(self, solved: Solved) -> Sought:
        request = self.request
        return Sought(request.objective, solved.limit, self.ceiling, request.ridge, request.monte_carlo)

    def _errors(self, solved: Solved) -> Errors:
        """Return the errors of the readings: stated, as repeats or residuals scatter, or as those of sisters did."""
        fit, group, stated = solved.fit, solved.group, self.request.reading_error
        if group.trials:
            return errors_of_means(fit, group, *(stated or (0.0, 0.0)))
        if stated is not None:
            return fit.stated(*stated)
        before = group.before
        if before is None or before.reading is None:
            return fit.scatter()
        # where the runs leave nothing over, the readings scatter as those of the sisters did
        estimated = fit.degrees_of_freedom > 0
        return fit.known(
            np.where(estimated, fit.residual_sd, before.reading[0]),
            np.where(estimated, fit.degrees_of_freedom, before.reading[1]),
        )

    def _doubt(self, solved: Solved) -> None:
        """Carry the errors of the readings to the corrections, and to what they leave."""
        request, group = self.request, solved.group
        still, errors = solved.fit.without(self.runout(group)), self._errors(solved)
        balance = LogBalance(still, solved.total, errors, group.weights, solved.corrections, request.ridge)
        solved.balance = balance
        if not np.isfinite(errors.along).any():
            return
        if self.runs.fitted and len(solved.corrections) > MANY:
            if self.limited:
                self.warnings.append(
                    "uncertainties of so many rotors are not worked out under limits or with minimax"
                )
            else:
                solved.covariance = balance.covariance
            return
        sought, rotors = self._sought(solved), range(len(solved.corrections))
        tasks = (
            (balance.machine(i), solved.corrections[i], solved.start[i], sought, self.limited) for i in rotors
        )
        doubts = list(in_parts(confidence, tasks, self.executor))
        solved.covariance = np.stack([covariance for covariance, _ in doubts])
        solved.residual_95 = np.array([left for _, left in doubts])
        self._unknown(solved)

    def _unknown(self, solved: Solved) -> None:
        """Warn where the uncertainties of the corrections cannot be determined."""
        assert solved.covariance is not None
        for i in np.flatnonzero(np.isnan(solved.covariance).any(axis=(1, 2, 3)))[:SHOWN]:
            self.warnings.append(
                f"{self.of(solved.group, int(i))}the uncertainties of the corrections cannot be determined: from some of the "
                "drawn readings no corrections can be found"
            )

    # -- in the units and by the names of the table ------------------------------------------------------

    @property
    def against(self) -> bool:
        """Whether phases were turned round, for the instrument counts them against the sense of the mass angles."""
        return self.request.against or self.runs.lags

    def in_kg_m(self, corrections: Complex) -> Real:
        """Return the unbalances of masses at the trial radius, or of unbalances as they are."""
        arm = 1.0 if self.runs.per == "unbalance" else self.request.radius or 1.0
        return np.asarray(np.abs(corrections) * arm)

    @property
    def unit(self) -> str:
        """The unit of a correction as people write it."""
        return self.runs.mass_unit.replace("_", "·")

    def amount(self, value: Scaled) -> Scaled:
        """Return a correction in the unit of the trial masses."""
        return from_si(value, self.runs.per, self.runs.mass_unit)

    def split(self, w: complex) -> list[tuple[str, float, float]]:
        """Split a correction onto the places: name, angle in degrees, amount in SI of each that is used."""
        if self.request.places is None or w == 0:
            return []
        masses = place(complex(w), np.radians(self.request.places)).masses.tolist()
        return [
            (str(k + 1), self.request.places[k] % 360.0, mass) for k, mass in enumerate(masses) if mass > 0
        ]

    # -- rotor by rotor --------------------------------------------------------------------------------------

    def each(self, most: int | None = None) -> Iterator[tuple[str, Solved, int]]:
        """Yield of each rotor its name as it is shown, its group's result, and its place in that."""
        for rotor, (k, i) in zip(self.runs.rotors[:most], self.place, strict=False):
            yield rotor if self.runs.several else "", self.solved[k], i

    @property
    def uncertain(self) -> bool:
        """Whether reading errors are known, stated or from repeats."""
        return any(solved.covariance is not None for solved in self.solved)


def _combination(names: list[str], combination: Complex) -> str:
    terms = []
    for name, share in zip(names, combination, strict=True):
        if abs(share) > 1e-6:
            terms.append(f"{abs(share):.3g} at {float(degrees(share)):.0f}° in {name}")
    return ", ".join(terms)


def planes_say(planes: list[str], combination: Complex) -> str:
    """Say which planes the readings cannot tell apart."""
    unseen = [name for name, share in zip(planes, combination, strict=True) if abs(share) > 1e-6]
    if len(unseen) == 1:
        return (
            f"plane {unseen[0]} has no effect on any reading: its correction cannot be found; expected sensors that "
            "respond to it, or the plane left out"
        )
    return (
        f"the readings cannot tell the planes {' and '.join(unseen)} apart (singular): masses in the ratio "
        f"{_combination(planes, combination)} leave no trace; leave one of these planes out, or damp with --ridge"
    )
