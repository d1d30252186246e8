"""The request, and the one fit of the measured runs: rotors that were measured in the same way side by side."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from balancing import (
    AmplitudeFit,
    JointFit,
    determined,
    fit_with_prior,
    influence_from_amplitudes,
    initial_alone,
    joint_fit,
    phase_sense,
)
from balancing.prior import runs_alone
from balancing.reading_errors import Errors
from balancing.runs.reading import Measured, read_measured
from balancing.runs.runs import SHOWN, Before, Complex, Group, Rows, Runs
from balancing.runs.stored import Stored, read_runout
from balancing.runs.stored_planes import in_stored_planes
from cli.read import options
from cli.read.rotor_options import Tolerance
from dalembert.errors import DataError, quote

if TYPE_CHECKING:
    from dalembert.arithmetic.doubled_arrays import DoubledArray

Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False, repr=False)
class Request:
    """The options of a balancing in the field."""

    reading_error: tuple[float, float] | None = None
    """Relative, rad."""
    tolerance: Tolerance | None = None
    max_mass: Mapping[str, tuple[float, str]] = field(default_factory=dict)
    """Limit of each plane, a value and its unit; the key "" is for all."""
    max_residual: tuple[float, str] | None = None
    objective: str = "least-squares"
    from_here: bool = False
    monte_carlo: int = 0
    four_run: bool = False
    ridge: float = 0.0
    radius: float | None = None
    phase_lag: bool = False
    rotation: str | None = None
    places: list[float] | None = None
    """Where masses can go, degrees: the corrections are split onto them."""
    stock: list[float] | None = None
    """The weights in stock, kg, of which the corrections are made there."""
    fit: bool = False
    """Whether all runs are fitted together; the options below are for such a fit."""
    exclude: Sequence[str] = ()
    predict: str | None = None
    suggest: bool = False
    robust: bool = False
    view: str | None = None
    """`static-couple`: the corrections of two planes as a static part and a couple."""
    zone_class: str | None = None
    """The class of machine, for zones of severity."""

    @property
    def against(self) -> bool:
        """Whether the instrument counts phases against the sense of the mass angles."""
        return self.phase_lag != (self.rotation == "cw")

    @property
    def lagging(self) -> bool | None:
        """Whether phases are counted against the mass angles; None where no option states it."""
        return self.against if self.phase_lag or self.rotation is not None else None


def measured_groups(
    path: str, request: Request, influence: Sequence[str] = (), runout: str | None = None
) -> tuple[Runs, Stored | None]:
    """Read the runs and fit them; return them, and the stored coefficients that stand for trial runs."""
    requests = {name: getattr(request, name) for name in ("fit", "exclude", "predict", "suggest", "robust")}
    if request.four_run:
        options.refuse("fits all runs: it does not go with --method four-run", **requests)
    measured = read_measured(
        path,
        influence,
        fit=any(requests.values()),
        exclude=request.exclude,
        four_run=request.four_run,
        against=request.against,
    )
    runs, stored = measured.rows.rows.of, measured.stored
    for name in request.exclude:
        if name not in measured.rows.rows.runs:
            raise options.bad("--exclude", f"no run {quote(name)} in {runs.table.file}")
    runs.groups = list(_Groups(measured, request).fitted())
    # the one fact that shows a fit: it is requested, or there are readings to spare, or no run is without masses
    runs.fitted = not request.four_run and (measured.fit or any(_spares(group) for group in runs.groups))
    runs.warnings = [*runs.table.warnings, *runs.warnings, *measured.warnings]
    if runout is not None:
        runs.runout = read_runout(runout, runs)
    return runs, stored


def _spares(group: Group) -> bool:
    """Whether a rotor has more readings than unknowns, or no run without masses."""
    return bool((group.fit.degrees_of_freedom > 0).any() or not group.bare.any(axis=1).all())


def _sense(
    runs: Runs, rotors: Rows, fit: JointFit, lagging: bool | None, again: Callable[[Complex], JointFit]
) -> tuple[JointFit, list[str | None]]:
    """Determine the sense of the phase, and fit again where the runs show another one and no option states it."""
    certain, taken, other = phase_sense(fit.alone)
    turn = -1 if lagging else 1
    against = np.flatnonzero(certain < 0)
    nu = np.maximum(fit.degrees_of_freedom, 1)
    for i in against[:SHOWN].tolist():
        sds = [float(np.sqrt(square[i] / nu[i])) for square in (taken, other)]
        word = "lags" if turn > 0 else "leads"
        message = (
            f"{runs.of(rotors[i])}the runs show that the instrument's phase {word}: residuals of {sds[1]:.4g} {runs.amplitude_unit} (standard "
            f"deviation), in the other sense {sds[0]:.4g}"
        )
        runs.warnings.append(
            f"{message}: the phases were reversed"
            if lagging is None
            else f"{message}; the option states otherwise and has priority"
        )
    if lagging is None and len(against):
        fit = again(np.where((certain < 0)[:, None, None], fit.readings.conj(), fit.readings))
        runs.lags = True
    words = {1: "lead", -1: "lag", 0: None}
    return fit, [words[int(turn * sense)] for sense in certain.tolist()]


class _Groups:
    """The rotors of a table; those of like shape and names become a group."""

    def __init__(self, measured: Measured, request: Request) -> None:
        self.sorted, self.sisters, self.stored = measured.rows, measured.sisters, measured.stored
        self.runs, self.request, self.requested = measured.rows.rows.of, request, measured.fit
        self.lost = 0

    def fitted(self) -> Iterator[Group]:
        """Yield the groups with the fits of their runs."""
        coefficients = self.sisters or self.stored
        named = None if coefficients is None else [coefficients.key(name) for name in self.runs.rotors]
        for group in self.sorted.parts(named):
            for part in self._determined(group):
                self._repeated(part)
                self._fit(part)
                yield part
        self.runs.warnings += self.sorted.warnings
        if self.lost > SHOWN:
            self.runs.warnings.append(
                f"… and {self.lost - SHOWN} further channels that the runs do not determine"
            )
        if not self.sorted.read.all():
            self.runs.warnings.append("--influence gives the coefficients: the trial runs are not used")

    def _repeated(self, group: Group) -> None:
        """Warn of sensors that were read more than once in a run."""
        for rows in group.lines.rows:
            counts = np.isfinite(group.readings[0, rows]).sum(axis=0).tolist()
            self.runs.warnings += [
                f"{self.runs.of(group.rotors[0])}sensor {channel.sensor} was read {n} times in one run: the mean is taken "
                "(as vectors)"
                for channel, n in zip(group.channels, counts, strict=True)
                if n > 1
            ]

    # -- what the runs determine ------------------------------------------------------------------------------

    def _determined(self, group: Group) -> list[Group]:
        """Part a group into those whose runs determine the same channels; what they do not determine is left out."""
        if coefficients := self.sisters or self.stored:
            return [in_stored_planes(group, self.runs, coefficients)]
        present = np.isfinite(group.readings)
        if self.request.four_run:
            keep = np.asarray(np.isfinite(group.means).all(axis=1))
        else:
            keep = determined(group.masses, present)
        if keep.all():
            return [group]
        # with nothing to spare nothing is left out
        more = (present.sum(axis=1) > 1 + len(group.planes)) & keep
        spare = self.requested | more.any(axis=1) | ~group.bare.any(axis=1)
        self._undetermined(group, keep, np.asarray(spare & keep.any(axis=1)))
        # without channels that the runs do not determine, and without runs in which no other was read
        left = (present & keep[:, None, :]).any(axis=2)
        kinds, kind = np.unique(np.concatenate([keep, left], axis=1), axis=0, return_inverse=True)
        order = np.argsort([np.argmax(kind == k) for k in range(len(kinds))]).tolist()
        split = [(k, *np.split(kinds[k], [keep.shape[1]])) for k in order]
        return [
            group.only(*(np.flatnonzero(of) for of in (kind == k, lines, channels)))
            for k, channels, lines in split
        ]

    def _undetermined(self, group: Group, keep: Flags, spare: Flags) -> None:
        """Warn of channels (g, s) that the runs do not determine; refuse a rotor without others, or with nothing to spare."""
        for i in np.flatnonzero(~keep.all(axis=1) & ~spare)[:1].tolist():
            raise DataError(f"{self.runs.table.file}: {self._refusal(group, i, int(np.argmin(keep[i])))}")
        for i, s in np.argwhere(~keep).tolist():
            self.lost += 1
            if self.lost <= SHOWN:
                self.runs.warnings.append(f"{self._lost(group, i, s)}; it takes no part in the fit")

    def _refusal(self, group: Group, i: int, s: int) -> str:
        """Write why a rotor cannot be balanced: too few trial runs, a missing reading, or runs that do not determine its coefficients."""
        of, planes = self.runs.of(group.rotors[i]), group.planes
        trials = int((~group.bare[i]).sum())
        if group.bare[i].any() and trials < len(planes):
            return (
                f"{of}{len(planes)} planes ({', '.join(planes)}) and {trials} trial run{'s' * (trials != 1)}: expected a trial "
                "run for every plane"
            )
        unread = np.isnan(group.means[i, :, s])
        if group.bare[i].any() and unread.any():
            runs = [run for run, no in zip(group.lines.runs(i), unread, strict=True) if no]
            near = "; speeds more than 5 % apart are different ones" if group.channels[s].speed else ""
            return (
                f"{of}no reading of sensor {group.channels[s]} in run{'s' * (len(runs) > 1)} {', '.join(runs)}, and with as many "
                f"readings as unknowns none may be missing{near}"
            )
        return self._lost(group, i, s)

    def _lost(self, group: Group, i: int, s: int) -> str:
        """Write why a channel of a rotor is not determined, and which run would determine it."""
        read = np.flatnonzero(np.isfinite(group.readings[i, :, s]))
        masses, lines = group.masses[i, read], group.lines.of(i)
        runs = [lines[j] for j in read]
        clause = "its vibration without masses is known, but " if not masses.any() else ""
        times = "once" if len(read) == 1 else f"{len(read)} times"
        return (
            f"{self.runs.of(group.rotors[i])}sensor {group.channels[s]} was read {times} (run{'s' * (len(runs) > 1)} {', '.join(runs)}), which "
            f"does not determine {1 + len(group.planes)} unknowns: {clause}{_missing(group.planes, masses)}"
        )

    # -- the fit ---------------------------------------------------------------------------------------------

    def _fit(self, group: Group) -> None:
        """Fit initial vibration and coefficients to the runs of a group, in the sense of the phase that its runs show."""
        if self.request.four_run:
            group.amplitude_fits = by_amplitudes(group, self.runs)
            by_rotor = [[fit.influence for fit in one] for one in group.amplitude_fits]
            # the runs with masses determine the coefficients alone
            loaded = np.asarray(group.masses.any(axis=2))[..., None]
            alone = np.where(loaded, np.nan, group.readings)
            group.fit = initial_alone(alone, np.array(by_rotor).swapaxes(1, 2))
            return
        names = [self.runs.rotors[r] for r in group.rotors.tolist()]
        if self.stored is not None:
            own = names if "rotor" in self.stored.table.texts else names[:1]
            each = [self.stored.matrix(name, group.channels, self.runs) for name in own]
            alpha = np.broadcast_to(np.stack(each), (len(names), *each[0].shape))
            group.fit = initial_alone(group.readings, alpha)
            return
        if self.sisters is not None:
            group.before = self.sisters.before(names[0], group.channels, self.runs)
        readings, masses = group.readings, group.masses
        group.fit = self._fitted(readings, masses, group.before)
        # with nothing to spare the runs fit in either sense
        if not (group.fit.degrees_of_freedom > 0).any():
            return
        if group.before is None or determined(masses, np.isfinite(readings)).all():
            group.fit, group.lines.senses = _sense(
                self.runs,
                group.rotors,
                group.fit,
                self.request.lagging,
                lambda turned: self._fitted(turned, masses, group.before),
            )
        turned = (np.nan_to_num(group.fit.readings) != np.nan_to_num(readings)).any(axis=(1, 2))
        if turned.any():
            before = group.exact
            group.exact = lambda: before().turned(turned)
        group.readings = group.fit.readings

    def _fitted(self, readings: Complex, masses: Complex, prior: Before | None) -> JointFit:
        """Fit runs, with coefficients that are stored from earlier ones."""
        if prior is None:
            return joint_fit(readings, masses)
        if self.request.reading_error is not None:
            size = np.abs(np.where(np.isfinite(readings), readings, 0.0))
            return fit_with_prior(
                readings, masses, prior.prior, float(np.hypot(*self.request.reading_error)) * size
            )
        fit = fit_with_prior(readings, masses, prior.prior)
        if prior.reading is not None and (fit.degrees_of_freedom == 0).any():
            sd = np.where(fit.degrees_of_freedom > 0, fit.residual_sd, prior.reading[0])
            fit = fit_with_prior(readings, masses, prior.prior, sd[:, None, None])
        return fit


def exact_fit(group: Group, runs: Runs, request: Request, stored: Stored | None) -> JointFit:
    """Return the fit of a group in 32 digits, of readings, masses and coefficients as they are written."""
    from dalembert.arithmetic.doubled_arrays import Vectors

    exact: Any = group.in_32_digits
    readings, masses = np.where(group.fit.present, exact.readings, np.nan), exact.masses
    if stored is not None or group.amplitude_fits:
        alpha: Any = Vectors.of(np.zeros(group.fit.influence.shape))
        for i, r in enumerate(group.rotors.tolist()):
            if stored is not None:
                alpha[i] = stored.exact_matrix(runs.rotors[r], group.channels, runs)
            else:
                alpha[i] = group.exact_of_amplitudes(i)
        return initial_alone(readings, alpha)
    plain = runs_alone(readings, masses)
    if group.before is None:
        return plain
    deviation = group.exact_scatter(plain)[..., None, None]
    if request.reading_error is not None:
        deviation = np.abs(readings) * np.hypot(*_as_stated(request.reading_error))
    return fit_with_prior(readings, masses, group.before.exact()[0], deviation)


def exact_errors(group: Group, request: Request, fit: JointFit) -> Errors:
    """Return the errors of the readings in 32 digits: stated, or as they scatter."""
    if request.reading_error is not None:
        stated: Any = _as_stated(request.reading_error)
        return fit.stated(*stated)
    return fit.known(group.exact_scatter(fit))


def _as_stated(errors: tuple[float, float]) -> tuple[DoubledArray, DoubledArray]:
    """Return the standard deviations that --reading-error states, as written: relative (amplitude), and in rad (phase)."""
    from dalembert.tables.exact import array, rates

    return array(errors[0]), rates(errors[1])


def _missing(planes: list[str], masses: Complex) -> str:
    """Write what the runs do not determine, and which run would."""
    if masses.all(axis=0).any() and len(masses):
        return (
            "every run has a trial mass, so that its effect cannot be separated from the vibration without it: add a run without "
            "it, or with another mass there"
        )
    dark = [
        plane for plane, on in zip(planes, masses.T, strict=True) if np.ptp(on.real) == np.ptp(on.imag) == 0
    ]
    if dark:
        named = f"plane{'s' * (len(dark) > 1)} {' and '.join(dark)}"
        return f"the effect of a mass in {named} is not: add a run with another mass there"
    return "the masses of these runs do not separate the planes: add a run in which the mass of one plane alone changes"


def by_amplitudes(group: Group, runs: Runs) -> list[list[AmplitudeFit]]:
    """Fit the four-run method, rotor by rotor, plane by plane: each run with masses has them in one plane.

    Several planes (Everett, J. Vib. Acoust. 109 (1987) 162-167): at each sensor the phases of all coefficients count from
    that sensor's own initial vibration, so that O + Σ α w = 0 is one linear system whatever these phases are.
    """
    file, of = runs.table.file, runs.of(group.rotors[0])
    if not group.bare.any(axis=1).all():
        raise DataError(f"{file}: {of}every run has a trial mass: expected an initial run without")
    for i, j in np.argwhere((group.on != 0).sum(axis=2) > 1)[:1].tolist():
        raise DataError(
            f"{runs.of(group.rotors[i])}run {group.lines.runs(i)[j]}: masses in several planes: without phase each trial run "
            "has a mass in one plane, the others empty: four runs for the first plane, then three for each other one"
        )
    return [
        [_of_plane(group, i, p, runs) for p in range(len(group.planes))] for i in range(len(group.rotors))
    ]


def _of_plane(group: Group, i: int, p: int, runs: Runs) -> AmplitudeFit:
    """Fit one plane's coefficients to the amplitudes of its trial runs."""
    named = f"plane {group.planes[p]}: " if len(group.planes) > 1 else ""
    of, means, on = runs.of(group.rotors[i]), group.means[i].real, group.on[i, :, p]
    first, tried = means[group.bare[i]].mean(axis=0), np.flatnonzero(on != 0)
    try:
        fit = influence_from_amplitudes(first, means[tried], on[tried])
    except ValueError as error:
        raise DataError(f"{runs.table.file}: {of}{named}{error}") from None
    unit = runs.amplitude_unit
    for channel, misfit, size in zip(group.channels, fit.misfit, first, strict=True):
        text = (
            f"{of}sensor {channel}: {named}the readings are inconsistent: no influence coefficient fits them better than "
            f"{misfit:.3g} {unit} (r.m.s.), {misfit / size:.0%} of the initial reading"
        )
        if misfit > 0.25 * size:
            raise DataError(f"{runs.table.file}: {text}: expected four readings that fit one plane's effect")
        if misfit > 0.05 * size:
            runs.warnings.append(text)
    if named and not np.isnan(fit.other).all():
        raise DataError(
            f"{runs.table.file}: {of}two coefficients of plane {group.planes[p]} fit the amplitudes: expected a third trial "
            "run in this plane, at an angle off the line of the others"
        )
    return fit
