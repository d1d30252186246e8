"""From measured runs to corrections, with their trim and uncertainty."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from balancing import (
    Balance,
    DependentPlanes,
    Infeasible,
    LogBalance,
    NotConverged,
    Placement,
    condition_number,
    fewest_from_stock,
    initial_unbalance,
    least_squares,
    place,
    unseen,
)
from balancing.dependence import directions
from balancing.objective import Objective
from balancing.runs.runs import SHOWN, Complex, Group, Real, Runs
from balancing.runs.stored import Stored
from cli.field.fit import Request
from cli.read.options import bad, mass_at
from dalembert.angles import degrees, in_turn, phasor
from dalembert.arithmetic.exact import EPS
from dalembert.arithmetic.parts import in_parts
from dalembert.decimals import Scaled
from dalembert.errors import DataError
from dalembert.units import UNITS, amplitude_kind, from_si, to_si, written

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from balancing.reading_errors import Errors

SINGULAR = 1e12  # a condition number beyond which the planes count as dependent
MANY = 200  # of more rotors the uncertainties are of first order, unless errors of the readings are stated
UNKNOWN_ANGLE = 60.0  # an angle with a larger uncertainty (degrees) counts as unknown


@dataclass(eq=False, repr=False)
class Solved:
    """A group and its corrections."""

    group: Group
    initial: Complex
    """(g, s), run-out off."""
    start: Complex
    """(g, p): what is on the rotor where the corrections start from: that, or nothing."""
    objective: Objective
    corrections: Complex
    """(g, p), as given: with --from-here what to add to the rotor as it stands."""
    bound: Real | None = None
    """The smallest possible largest residual, (g,), as the dual problem proves it."""
    condition: Real = field(init=False)
    """(g,)."""
    unbalance: Complex | None = None
    """(g, p): the rotor's own in its initial state; NaN where the readings do not determine it."""
    covariance: Real | None = None
    residual_95: Real | None = None
    drawn: int = 0
    """How many sets of readings the covariance is drawn from; 0: it is of first order."""
    balance: LogBalance | None = None
    """Where the errors of the readings are known: what the corrections leave, and how sure it is."""

    @property
    def planes(self) -> list[str]:
        """The correction planes."""
        return self.group.planes

    @property
    def standing(self) -> Complex:
        """The masses on the rotor in its last run, (g, p)."""
        return self.group.standing

    @property
    def alpha(self) -> Complex:
        """The influence coefficients, (g, s, p)."""
        return self.group.fit.influence

    @cached_property
    def here(self) -> Complex:
        """The vibration where the corrections start from, (g, s)."""
        return self.initial + np.matvec(self.alpha, self.start) if self.start.any() else self.initial

    @cached_property
    def residual(self) -> Complex:
        """The vibration with the corrections on, (g, s); zero where it is below the rounding of its terms."""
        left = self.here + np.matvec(self.alpha, self.corrections)
        put = np.abs(self.corrections) + np.abs(self.start)
        noise = np.abs(self.initial) + np.matvec(np.abs(self.alpha), put)
        return np.where(np.abs(left) > 1e-15 * noise, left, 0)

    @property
    def fitted(self) -> LogBalance:
        """The balance of a group that has one."""
        assert self.balance is not None
        return self.balance

    @property
    def total(self) -> Complex:
        """The masses to add to the rotor in its initial state, (g, p)."""
        return self.corrections + self.start

    @cached_property
    def trim(self) -> Complex:
        """The masses to add to the rotor as it stands in its last run, (g, p)."""
        trim = self.corrections + (self.start - self.standing)
        terms = np.abs(self.total) + np.abs(self.standing)
        return np.where(np.abs(trim) > 4 * EPS * terms, trim, 0)

    def uncertainty(self, masses: Complex) -> tuple[Real, Real]:
        """Return the standard deviations of size (SI) and angle (degrees), (g, p) each; NaN where they are not known.

        The masses differ from the corrections by masses that are known.
        """
        size = np.abs(masses)
        if self.covariance is None:
            return np.full(size.shape, np.nan), np.full(size.shape, np.nan)
        turn = directions(self.corrections) * directions(masses).conj()
        axes = np.moveaxis(np.array([[turn.real, -turn.imag], [turn.imag, turn.real]]), (0, 1), (-2, -1))
        covariance = axes @ self.covariance @ np.swapaxes(axes, -1, -2)
        along, across = (np.sqrt(covariance[..., k, k]) for k in (0, 1))
        angle = np.where(size > 0, np.degrees(across / np.where(size > 0, size, 1.0)), np.nan)
        return along, np.where(angle <= UNKNOWN_ANGLE, angle, np.nan)


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
        if request.stock is not None and runs.per != "mass":
            raise bad("--stock", "the table has unbalances: expected trial masses")
        self._placed: dict[complex, Placement] = {}
        self.max_mass = _limits_in(request.max_mass, runs) or runs.max_mass
        """Limit of each plane, SI; the key "" is for all."""
        self.ceiling = _ceiling_in(request.max_residual, runs)
        """The limit of the residuals, in the table's amplitude unit."""
        self.predict = _masses_at(request.predict, runs)
        """Plane -> mass of a run to be predicted, SI; the key "" is the only plane."""
        self.limited = bool(request.objective == "minimax" or self.max_mass or self.ceiling is not None)
        """Whether the corrections are others than those by plain least squares."""
        self.warnings: list[str] = []
        self.solved = [self._solve(group) for group in runs.groups]
        self.place: list[tuple[int, int]] = [(0, 0)] * len(runs.rotors)
        for k, group in enumerate(runs.groups):
            for i, rotor in enumerate(group.rotors.tolist()):
                self.place[rotor] = (k, i)
        for solved in self.solved:
            self.run_to_predict(solved.planes)
        if request.suggest and not self.max_mass:
            raise bad("--suggest", "needs --max-mass, the largest mass of the next run")

    # -- solving -------------------------------------------------------------------------------------------

    def of(self, group: Group, i: int = 0) -> str:
        """Return what a sentence about a rotor begins with, where there are several."""
        return self.runs.of(group.rotors[i])

    def runout(self, group: Group) -> Complex:
        """Return the run-out of each channel in the sense of the mass angles, (g, s)."""
        read = np.array(
            [self.runs.runout.get(channel.sensor, 0) for channel in group.channels], dtype=complex
        )
        return np.where(self.against(group)[:, None], read.conj(), read)

    def _solve(self, group: Group) -> Solved:
        request = self.request
        planes, standing = group.planes, group.standing
        start = standing if request.from_here else np.zeros_like(standing)
        if request.from_here and not standing.any():
            self.warnings.append(
                "--from-here: the last run has no mass on the rotor: the trim equals the correction"
            )
        initial = group.fit.initial - self.runout(group)
        limits = self._limits(planes), self.ceiling, request.ridge
        objective = Objective(request.objective == "minimax", *limits)
        solved = Solved(group, initial, start, objective, 0 * standing)
        self._correct(solved)
        if request.view is not None and len(planes) != 2:
            raise bad(
                "--view", f"static and couple parts need two planes, found {len(planes)}: {', '.join(planes)}"
            )
        if request.tolerance is not None:
            solved.unbalance = initial_unbalance(solved.alpha, initial, group.weights, singular=SINGULAR)
        if self.runs.fitted or request.reading_error is not None:
            self._doubt(solved)
        return solved

    def _limits(self, planes: list[str]) -> Real | None:
        bound = self.max_mass
        for name in bound:
            if name and name not in planes:
                raise bad("--max-mass", f"no plane {name}: expected one of {', '.join(planes)}")
        limit = np.array([bound.get(plane, bound.get("", np.inf)) for plane in planes])
        return limit if np.isfinite(limit).any() else None

    def run_to_predict(self, planes: list[str]) -> Complex:
        """Return the masses of the run to be predicted, (p,)."""
        masses = dict(self.predict or {})
        if "" in masses and len(planes) == 1 and planes[0] not in masses:
            masses[planes[0]] = masses.pop("")
        for name in masses:
            if name not in planes:
                wrong = f"no plane {name}" if name else "several planes"
                raise bad("--predict", f"{wrong}: expected PLANE=MASS@ANGLE with one of {', '.join(planes)}")
        return np.array([masses.get(plane, 0) for plane in planes], dtype=complex)

    def _correct(self, solved: Solved) -> None:
        """Find the corrections, the condition numbers, and for minimax the proven bounds."""
        objective, weights = solved.objective, solved.group.weights
        alpha, here, rotors = solved.alpha, solved.here, range(len(solved.here))
        plain = None
        if not objective.limited:
            with self.named(solved):
                plain = least_squares(alpha, here, weights, ridge=objective.ridge)
        solved.condition = condition_number(alpha, weights) if plain is None else plain.condition_number
        if objective.max_mass is None and not objective.ridge:
            # the coefficients are differences of readings: what lies in their rounding is no information
            beyond = np.flatnonzero(~(solved.condition < SINGULAR))
            if len(beyond):
                i = int(beyond[0])
                hidden = unseen(alpha[i], solved.group.own_weights(i))[0]
                raise DataError(self.of(solved.group, i) + _dependent(solved.planes, hidden))
        if plain is not None:
            solved.corrections = plain.corrections
        elif objective.minimax:
            proven = self._one_by_one(solved, rotors)
            solved.corrections = np.stack([fix.corrections for fix in proven])
            solved.bound = np.array([fix.bound for fix in proven], dtype=float)
            solved.condition = np.array([fix.condition_number for fix in proven])
        else:
            # rotors that keep the limits by themselves all at once, the others one by one
            met = np.zeros(len(here), dtype=bool)
            try:
                free = least_squares(alpha, here, weights)
                met, solved.corrections = objective.met(free), free.corrections.astype(complex)
            except DependentPlanes:
                pass
            rest = np.flatnonzero(~met).tolist()
            for i, one in zip(rest, self._one_by_one(solved, rest), strict=True):
                solved.corrections[i] = one.corrections

    def _one_by_one(self, solved: Solved, rotors: Sequence[int]) -> list[Balance]:
        """Solve for rotors under limits, each by itself."""
        group = solved.group
        parts = ((solved.alpha[i], solved.here[i], group.own_weights(i)) for i in rotors)
        results, answers = in_parts(solved.objective.solve, parts, self.executor), []
        for i in rotors:
            with self.named(solved, i):
                fix, beyond = next(results)
            if beyond:
                self.warnings.append(
                    "with these weights a residual is beyond --max-residual, which without them could be met"
                )
            if fix.of_largest > solved.objective.minimax:
                self.warnings.append(f"{self.of(group, i)}the limits leave the minimax corrections alone")
            answers.append(fix)
        return answers

    @contextmanager
    def named(self, solved: Solved, i: int | None = None) -> Iterator[None]:
        """Name the rotor in errors: this one, or of all the one that the error is about."""
        try:
            yield
        except DependentPlanes as error:
            of = self.of(solved.group, *(error.case[:1] if i is None else [i]))
            raise DataError(of + _dependent(solved.planes, error.combination)) from None
        except Infeasible as error:
            unit = self.runs.amplitude_unit
            with_limits = " with the limits of the masses" if self.max_mass else ""
            raise DataError(
                f"{self.of(solved.group, i or 0)}no corrections{with_limits} leave every residual within "
                f"{self.ceiling:g} {unit}: infeasible; the smallest limit that can be met is {error.rounded_up} {unit}"
            ) from None
        except NotConverged as error:
            raise DataError(f"{self.of(solved.group, i or 0)}{error}") from None

    def _errors(self, solved: Solved) -> Errors:
        """Return the errors of the readings: stated, or as residuals scatter, or as those of sisters did."""
        group, stated = solved.group, self.request.reading_error
        fit = group.fit
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
        still, errors = group.fit.without(self.runout(group)), self._errors(solved)
        balance = LogBalance(still, solved.total, errors, group.weights, solved.corrections, request.ridge)
        solved.balance = balance
        if not np.isfinite(errors.along).any():
            return
        if request.reading_error is None and len(solved.corrections) > MANY:
            if self.limited:
                self.warnings.append(
                    "under limits or with minimax the uncertainties of so many rotors are computed with --reading-error alone"
                )
            else:
                solved.covariance = balance.covariance
            return
        rotors, draws = range(len(solved.corrections)), request.monte_carlo
        tasks = ((balance.machine(i), solved.corrections[i], solved.start[i], draws) for i in rotors)
        doubts = list(in_parts(solved.objective.confidence, tasks, self.executor))
        solved.covariance = np.stack([covariance for covariance, _ in doubts])
        solved.residual_95 = np.array([left for _, left in doubts])
        solved.drawn = solved.objective.drawn(draws)
        self._unknown(solved)

    def _unknown(self, solved: Solved) -> None:
        """Warn where the uncertainties of the corrections cannot be determined."""
        assert solved.covariance is not None
        for i in np.flatnonzero(np.isnan(solved.covariance).any(axis=(1, 2, 3)))[:SHOWN]:
            self.warnings.append(
                f"{self.of(solved.group, int(i))}the uncertainties of the corrections cannot be determined: from some of the "
                "drawn readings no corrections can be computed"
            )

    # -- in the units and by the names of the table ------------------------------------------------------

    def against(self, group: Group) -> NDArray[np.bool_]:
        """Return whose phases were turned round, (g,), for the instrument counts them against the sense of the mass angles."""
        by_its_runs = [self.request.lagging is None and sense == "lag" for sense in group.lines.senses]
        return np.array(by_its_runs) | self.request.against

    def in_kg_m(self, corrections: Complex) -> Real:
        """Return the unbalances of masses at the trial radius, or of unbalances as they are."""
        arm = 1.0 if self.runs.per == "unbalance" else self.request.radius or 1.0
        return np.asarray(np.abs(corrections) * arm)

    @property
    def unit(self) -> str:
        """The unit of a correction as people write it."""
        return written(self.runs.mass_unit)

    def amount(self, value: Scaled) -> Scaled:
        """Return a correction in the unit of the trial masses."""
        return from_si(value, self.runs.per, self.runs.mass_unit)

    def split(self, w: complex) -> list[tuple[str, float, float]]:
        """Split a correction onto the places: name, angle in degrees, amount in SI of each that is used."""
        if self.request.places is None or w == 0:
            return []
        return [
            (str(k + 1), in_turn(self.request.places[k]), mass)
            for k, mass in enumerate(self.placed(complex(w)).masses.tolist())
            if mass > 0
        ]

    def placed(self, w: complex) -> Placement:
        """Return a correction on the places, made of the weights in stock if there are any."""
        if w not in self._placed:
            angles = np.radians(self.request.places or ())
            stock = self.request.stock
            try:
                self._placed[w] = (
                    place(w, angles) if stock is None else fewest_from_stock(w, angles, stock).placed
                )
            except ValueError as error:
                raise DataError(f"--stock: {error}") from None
        return self._placed[w]

    @property
    def uncertain(self) -> bool:
        """Whether reading errors are known, stated or from the scatter of the fit."""
        return any(solved.covariance is not None for solved in self.solved)


def _dependent(planes: list[str], combination: Complex) -> str:
    """Write which planes the readings cannot tell apart."""
    shares = {name: share for name, share in zip(planes, combination, strict=True) if abs(share) > 1e-6}
    ratio = ", ".join(f"{abs(w):.3g} at {float(degrees(w)):.0f}° in {name}" for name, w in shares.items())
    unseen = list(shares)
    if len(unseen) == 1:
        return (
            f"plane {unseen[0]} has no effect on any reading: its correction cannot be computed; expected sensors that "
            "respond to it, or the plane left out"
        )
    return (
        f"the readings cannot distinguish the planes {' and '.join(unseen)} (singular): masses in the ratio "
        f"{ratio} have no effect on any reading; leave one of these planes out, or damp with --ridge"
    )


# -- the limits of the request, in the table's units --------------------------------------------------------------------


def _limits_in(limits: Mapping[str, tuple[float, str]], runs: Runs) -> dict[str, float]:
    """Return limits in SI, in the dimension of the trials."""
    for value, unit in limits.values():
        if unit not in UNITS[runs.per]:
            raise bad(
                "--max-mass", f"'{value:g}{unit}': expected a limit in units of {runs.per}, as the trials are"
            )
    return {plane: float(to_si(value, runs.per, unit)) for plane, (value, unit) in limits.items()}


def _ceiling_in(limit: tuple[float, str] | None, runs: Runs) -> float | None:
    """Return the residual limit in the table's unit; without a tag it is meant as the table's amplitudes are."""
    if limit is None:
        return None
    value, unit = limit
    if not amplitude_kind(unit)[1]:
        unit += amplitude_kind(runs.amplitude_unit)[1]
    return runs.in_unit(value, unit, "--max-residual")


def _masses_at(text: str | None, runs: Runs) -> dict[str, complex] | None:
    """Read `10kg@-90deg`, or `A=10kg@-90deg,B=5kg@20deg`, SI; the key "" is the only plane."""
    if text is None:
        return None
    out: dict[str, complex] = {}
    for part in text.split(","):
        plane, _, value = part.strip().rpartition("=")
        expected = f"'{part}': expected MASS@ANGLE, such as 10kg@-90deg"
        size, unit, angle, of_angle = mass_at("--predict", part, value, runs.per, expected)
        if plane.strip() in out:
            raise bad("--predict", f"'{part}': this plane is given twice")
        on = float(to_si(size, runs.per, unit))
        out[plane.strip()] = complex(phasor(np.array(on), np.array(angle), of_angle))
    return out
