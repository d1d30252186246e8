"""One rotor: its runs, its trim and whether that is needed, its tolerance, and the worked solution of `--steps`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from balancing import initial_unbalance
from balancing.runs.runs import Channel, Complex, Group, Real
from cli.field.field_balancing import SINGULAR, FieldBalancing, Solved
from cli.read.rotor_options import Verdict
from dalembert.angles import degrees
from dalembert.arithmetic.exact import EPS
from dalembert.results.columns import Column, Table, finite, listed, names
from dalembert.results.way import Topic, figures
from dalembert.units import written

Flags = NDArray[np.bool_]


class Trim:
    """The trims of a group of rotors."""

    def __init__(self, b: FieldBalancing, solved: Solved) -> None:
        self.b, self.solved = b, solved
        self.masses: Complex = solved.trim
        """(g, p), SI."""
        self.along, self.angle = solved.uncertainty(self.masses)
        """Standard deviations of size (SI) and angle (degrees), (g, p) each; NaN where they are not known."""

    @cached_property
    def vibration(self) -> Complex:
        """The vibration of the rotors as they stand, (g, s): as read in the last run, else by the coefficients."""
        solved = self.solved
        read = np.stack([Rotor(self.b, solved, i).last_reading for i in range(len(self.masses))])
        expected = solved.initial + np.matvec(solved.alpha, solved.standing)
        return np.where(np.isfinite(read), read, expected)

    @cached_property
    def _holds(self) -> dict[str, Flags]:
        """Why no trim is needed, and in which planes."""
        solved, size = self.solved, np.abs(self.masses)
        terms = np.abs(solved.total).max(axis=1, keepdims=True) + np.abs(solved.standing)
        condition = np.where(np.isfinite(solved.condition), solved.condition, 1.0)[:, None]
        return {
            "nothing is left to correct": size <= 16 * EPS * condition * terms,
            "below its own uncertainty": size < np.where(np.isfinite(self.along), self.along, 0.0),
            **self._limits(),
        }

    def _limits(self) -> dict[str, Flags]:
        """Where the rotor as it stands is within every limit that was requested."""
        b, solved = self.b, self.solved
        within: dict[str, Flags] = {}
        if b.ceiling is not None:
            fine = np.all(np.abs(self.vibration) <= b.ceiling * (1 + 1e-9), axis=1, keepdims=True)
            within["the vibration is within the limit"] = np.repeat(fine, len(solved.planes), axis=1)
        if b.request.tolerance is not None and solved.unbalance is not None:
            left = solved.unbalance + solved.standing
            if not b.request.four_run:
                weights = solved.group.weights
                left = initial_unbalance(solved.alpha, self.vibration, weights, singular=SINGULAR)
            share = b.request.tolerance.shares(len(solved.planes))
            within["the unbalance is within the tolerance"] = b.in_kg_m(left) <= share
        if not within:
            return {}
        return {" and ".join(within): np.logical_and.reduce(list(within.values()))}

    @property
    def reasons(self) -> list[list[str]]:
        """Why a rotor's plane needs no trim, rotor by rotor; "" where it does."""
        rotors, planes = self.masses.shape
        return [
            [next((why for why, holds in self._holds.items() if holds[i, p]), "") for p in range(planes)]
            for i in range(rotors)
        ]


class LastRun(NamedTuple):
    """A run with masses on the rotor that was made once the coefficients were known."""

    run: str
    on: Complex
    """The masses on the rotor, SI, (p,)."""
    vibration: Complex
    """The readings less the run-out, (s,); NaN where a sensor was not read."""


class Reading(NamedTuple):
    """A reading of a log, fitted."""

    run: str
    channel: Channel
    value: complex
    residual: complex
    standardized: float
    outlier: bool
    """Whether the other readings contradict it."""
    chance: float
    """How often by chance a residual is as large."""


@dataclass(eq=False, repr=False)
class Rotor:
    """A rotor among those of its group."""

    b: FieldBalancing
    solved: Solved
    i: int

    @property
    def group(self) -> Group:
        """Its group as measured."""
        return self.solved.group

    @property
    def number(self) -> int:
        """Its number in the table."""
        return int(self.group.rotors[self.i])

    @property
    def name(self) -> str:
        """Its name in the table."""
        return self.b.runs.rotors[self.number]

    @property
    def heading(self) -> str:
        """Its name where there are several, as pages and pictures show it."""
        return self.name if self.b.runs.several else ""

    @property
    def planes(self) -> list[str]:
        """Its correction planes."""
        return self.solved.planes

    @property
    def channels(self) -> list[Channel]:
        """The channels that were read."""
        return self.group.channels

    @property
    def standing(self) -> Complex:
        """The masses on it in its last run, (p,)."""
        return np.asarray(self.solved.standing[self.i])

    @property
    def against(self) -> bool:
        """Whether its phases were turned round."""
        return bool(self.b.against(self.group)[self.i])

    @cached_property
    def reasons(self) -> list[str]:
        """Why a plane needs no trim; "" where it does."""
        return Trim(self.b, self.solved).reasons[self.i]

    def readings(self) -> Iterator[Reading]:
        """Yield the readings of its log."""
        from balancing.doubt import LEVEL

        fit, lines = self.group.fit, self.group.lines.of(self.i)
        for j, s in np.argwhere(fit.present[self.i]).tolist():
            value, residual, far, chance = (
                of[self.i, j, s].item()
                for of in (fit.readings, fit.residuals, fit.standardized, self.group.chance)
            )
            yield Reading(lines[j], self.channels[s], value, residual, far, chance < LEVEL, chance)

    # -- its runs ------------------------------------------------------------------------------------------

    @cached_property
    def last(self) -> LastRun | None:
        """Its last run, where that shows how well it is balanced; None where it was a trial run."""
        runs = self._runs
        run = self.group.last[self.i] if self.group.last[self.i] in runs else list(runs)[-1]
        if self.b.request.four_run or not runs[run].any():
            return None
        # as many runs with masses as planes determine the coefficients
        tried = sum(on.any() for on in runs.values()) <= len(self.planes)
        if tried and not self.b.request.from_here:
            return None
        return LastRun(run, runs[run], self._read(run))

    @property
    def last_reading(self) -> Complex:
        """The vibration of its last run, run-out off, (s,); NaN where a sensor was not read."""
        return self._read(self.group.last[self.i])

    @property
    def first_reading(self) -> Complex | None:
        """The vibration of the first run without masses, run-out off, (s,); None where there is no such run."""
        bare = next((run for run, on in self._runs.items() if not on.any()), None)
        return None if bare is None else self._read(bare)

    @property
    def _runs(self) -> dict[str, Complex]:
        """Its runs, in order, and what was on the rotor in each."""
        return dict(zip(self.group.lines.runs(self.i), self.group.on[self.i], strict=True))

    def _read(self, run: str) -> Complex:
        """The mean readings of a run, run-out off; NaN where a sensor was not read, and of a run that is excluded."""
        runs = self.group.lines.runs(self.i)
        if run not in runs:
            return np.full(len(self.channels), complex(np.nan))
        mean = self.group.means[self.i, runs.index(run)]
        return np.asarray(mean - self.b.runout(self.group)[self.i])

    # -- its tolerance -------------------------------------------------------------------------------------

    def verdicts(self, *, measured: bool = False) -> list[Verdict]:
        """Return each plane's tolerance, as predicted or as its last run shows it; none where none was requested."""
        solved, i, tolerance = self.solved, self.i, self.b.request.tolerance
        if tolerance is None or solved.unbalance is None:
            return []
        own = solved.unbalance[i]
        if measured and self.last is not None:
            read, weights = np.isfinite(self.last.vibration), self.group.own_weights(i)
            left = initial_unbalance(
                solved.alpha[i][read],
                self.last.vibration[read],
                None if weights is None else weights[read],
                singular=SINGULAR,
            )
        else:
            left = own + solved.total[i]
            left = np.where(np.abs(left) <= 1e-12 * np.abs(own), 0, left)
        sizes: list[Real] = [tolerance.shares(len(self.planes)), self.b.in_kg_m(own), self.b.in_kg_m(left)]
        return [
            Verdict(plane, *size)
            for plane, size in zip(self.planes, np.transpose(sizes).tolist(), strict=True)
        ]


def each(b: FieldBalancing, most: int | None = None) -> Iterator[Rotor]:
    """Yield the rotors in the order of the table."""
    for k, i in b.place[:most]:
        yield Rotor(b, b.solved[k], i)


# -- the worked solution ------------------------------------------------------------------------------------


def way(b: FieldBalancing) -> list[Topic]:
    """The topics of every rotor, one after the other."""
    steps: list[Topic] = []
    for rotor in each(b):
        topics = _Way(rotor).topics()
        if b.runs.several:
            for topic in topics:
                topic.title = f"Rotor {rotor.name}: {topic.heading}"
                topic.head = {"rotor": rotor.name, **topic.head}
        steps += topics
    return steps


def _angle(z: complex) -> float | None:
    return None if z == 0 or z != z else degrees(z)


def _parts(z: complex) -> dict[str, Any]:
    """The components of a vector as JSON has them."""
    return {"x": finite(z.real + 0.0), "y": finite(z.imag + 0.0)}


def _vector(z: complex, phase: bool = True) -> dict[str, Any]:
    """A vibration as JSON has it."""
    parts = {"phase_deg": _angle(z), **_parts(z)} if phase else {"phase_deg": None, "x": None, "y": None}
    return {"amplitude": finite(abs(z)), **parts}


def _text(z: complex) -> str:
    """A vector in both forms: `3.2 ∠ 55° = (1.83547, 2.62128)`."""
    return f"{figures(abs(z))} ∠ {figures(_angle(z) or 0.0)}° = ({_pair(z)})"


def _pair(z: complex) -> str:
    return f"{figures(z.real)}, {figures(z.imag)}"


class _Way:
    """The worked solution of a rotor."""

    def __init__(self, rotor: Rotor) -> None:
        self.b, self.solved, self.group, self.i = rotor.b, rotor.solved, rotor.group, rotor.i
        self.channels, self.planes, self.runs = rotor.channels, rotor.planes, rotor.b.runs
        self.mass = f"{self.runs.per}_{self.runs.per_si}"
        self.unit = written(self.runs.amplitude_unit)

    def topics(self) -> list[Topic]:
        """Return the steps."""
        effects = not (self.b.runs.fitted or self.b.request.four_run or self.b.stored)
        return [
            self._vectors(),
            *([self._effects()] if effects else []),
            self._coefficients(),
            self._system(),
            self._solution(),
        ]

    def _rows(self) -> list[tuple[str, list[complex], list[complex]]]:
        """Every run: its name, its mean readings (s,), what was on the rotor (p,)."""
        group, i = self.group, self.i
        return list(zip(group.lines.runs(i), group.means[i].tolist(), group.on[i].tolist(), strict=True))

    def _masses(self, on: list[complex]) -> list[dict[str, Any]]:
        return [
            {"plane": plane, self.mass: float(abs(m)), "angle_deg": _angle(m)}
            for plane, m in zip(self.group.planes, on, strict=True)
            if m
        ]

    def _amount(self, m: complex) -> str:
        return f"{figures(float(self.b.amount(abs(m))))} {self.b.unit} ∠ {figures(_angle(m) or 0.0)}°"

    def _amounts(self, on: list[complex]) -> str:
        pairs = zip(self.group.planes, on, strict=True)
        return ", ".join(f"{plane}: {self._amount(m)}" for plane, m in pairs if m)

    def _read(self, vectors: Complex | list[complex], phase: bool = True) -> list[dict[str, Any]]:
        """Vibrations of all sensors as JSON has them."""
        return [
            {**channel.key, **_vector(complex(v), phase)}
            for channel, v in zip(self.channels, vectors, strict=True)
        ]

    def _vectors(self) -> Topic:
        phase, unit = not self.b.request.four_run, self.runs.amplitude_unit
        entries: list[dict[str, Any]] = []
        cells: list[tuple[str, str, str, complex]] = []
        for run, read, on in self._rows():
            entries.append({"run": run, "masses": self._masses(on), "readings": self._read(read, phase)})
            put = self._amounts(on) or "none"
            cells += [(run, str(channel), put, v) for channel, v in zip(self.channels, read, strict=True)]
        columns = [
            names("run", [run for run, *_ in cells]),
            names("sensor", [sensor for _, sensor, *_ in cells]),
            names("masses", [put for _, _, put, _ in cells]),
            Column("amplitude", unit, [abs(v) for *_, v in cells]),
        ]
        if phase:
            columns += [
                Column("phase", "deg", [_angle(v) for *_, v in cells]),
                Column("x", unit, [v.real for *_, v in cells]),
                Column("y", unit, [v.imag for *_, v in cells]),
            ]
        text = ["V = amplitude ∠ phase = (amplitude·cos, amplitude·sin), repeats of a run by their mean:"]
        if self.runs.lags:
            text.append("The runs show that the phase lags: it is counted the other way here.")
        table = Table(columns, ("run", "sensor"))
        return Topic("vectors", [*text, table], "Vectors of the runs", {"runs": entries})

    def _effects(self) -> Topic:
        entries, text = [], ["What a trial mass does is the difference of two runs, T = V_run − V_before:"]
        rows = self._rows()
        for j, (run, read, on) in enumerate(rows):
            at = int(self.group.before_run(j)[self.i])
            if at < 0:
                continue
            before, other, under = rows[at]
            put = [m - n for m, n in zip(on, under, strict=True)]
            text.append(f"Run {run} against run {before}, {self._amounts(put) or 'no mass'}:")
            effects = [v - w for v, w in zip(read, other, strict=True)]
            text += [
                f"  {channel}: ({_pair(v)}) − ({_pair(w)}) = {_text(t)}"
                for channel, v, w, t in zip(self.channels, read, other, effects, strict=True)
            ]
            masses = self._masses(put)
            entries += [
                {"run": run, "against": before, **channel.key, "masses": masses, **_vector(t)}
                for channel, t in zip(self.channels, effects, strict=True)
            ]
        return Topic("effects", text, "Effects of the trial masses", {"effects": entries})

    def _coefficients(self) -> Topic:
        unit = f"{self.unit}/{written(self.runs.per_si)}"
        rows = [
            (channel, plane, a)
            for channel, of in zip(self.channels, self.solved.alpha[self.i].tolist(), strict=True)
            for plane, a in zip(self.planes, of, strict=True)
        ]
        entries = [
            {
                **channel.key,
                "plane": plane,
                f"magnitude_per_{self.runs.per_si}": abs(a),
                "phase_deg": _angle(a),
                **_parts(a),
            }
            for channel, plane, a in rows
        ]
        if self.b.request.four_run:
            text = "From amplitudes alone (four runs): the coefficient whose circles fit the readings best."
        elif self.b.stored:
            text = "Stored coefficients:"
        elif not self.b.runs.fitted:
            text = f"α = T/m of each trial mass ({unit}); with trial masses left on, the runs' equations together:"
        else:
            text = f"Initial vibration and coefficients by least squares on all runs, V_run = V0 + Σ α·m ({unit}):"
        columns = [
            names("sensor", [str(channel) for channel, *_ in rows]),
            names("plane", [plane for _, plane, _ in rows]),
            Column("magnitude", "", [abs(a) for *_, a in rows]),
            Column("phase", "deg", [_angle(a) for *_, a in rows]),
        ]
        table = Table(columns, ("sensor", "plane"))
        return Topic("coefficients", [text, table], "Influence coefficients", {"coefficients": entries})

    def _system(self) -> Topic:
        alpha, here = self.solved.alpha[self.i], self.solved.here[self.i].tolist()
        weights = self.group.own_weights(self.i)
        rows = []
        for channel, of, v in zip(self.channels, alpha.tolist(), here, strict=True):
            left = " + ".join(
                f"({figures(a.real)} + i·({figures(a.imag)}))·w_{plane}"
                for a, plane in zip(of, self.planes, strict=True)
            )
            rows.append(f"  {channel}: {left} = −({figures(v.real)} + i·({figures(v.imag)}))")
        n, p = alpha.shape
        how = "as many equations as unknowns" if n == p else "Σ|α·w + V0|² least" if n > p else "least norm"
        if self.b.limited:
            how = "the corrections within the limits that leave the least"
        head: dict[str, Any] = {
            "planes": list(self.planes),
            "matrix": listed(alpha),
            "right": listed([-v for v in here]),
            "weights": None if weights is None else [float(v) for v in weights],
        }
        begin = "as it stands" if self.b.request.from_here else "without masses"
        return Topic("system", [f"α·w = −V0, V0 the vibration {begin}: {how}.", *rows], "System", head)

    def _solution(self) -> Topic:
        solved, i = self.solved, self.i
        corrections, residual = solved.corrections[i].tolist(), solved.residual[i].tolist()
        text = [f"  w_{plane} = {self._amount(w)}" for plane, w in zip(self.planes, corrections, strict=True)]
        text.append("Residual vibration, V0 + α·w:")
        text += [
            f"  {channel}: {_text(v)} {self.unit}" for channel, v in zip(self.channels, residual, strict=True)
        ]
        head: dict[str, Any] = {
            "corrections": [
                {"plane": plane, self.mass: abs(w), "angle_deg": _angle(w), **_parts(w)}
                for plane, w in zip(self.planes, corrections, strict=True)
            ],
            "residual": self._read(residual),
        }
        return Topic("solution", text, "Solution", head)
