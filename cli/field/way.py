"""The worked solution of `dalembert field`: vectors of the runs, effects of the trials, coefficients, system, solution."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cli.field.rotor import Rotor, each
from dalembert.angles import degrees
from dalembert.results.columns import Column, Table, finite, names
from dalembert.results.way import Topic, figures
from dalembert.units import from_si, written

if TYPE_CHECKING:
    from cli.field.field_balancing import FieldBalancing
    from cli.read.runs.runs import Complex


def way(b: FieldBalancing) -> list[Topic]:
    """The topics of every rotor, one after the other."""
    found: list[Topic] = []
    for rotor in each(b):
        topics = _Way(rotor).topics()
        if b.runs.several:
            for topic in topics:
                topic.title = f"Rotor {rotor.name}: {topic.heading}"
                topic.head = {"rotor": rotor.name, **topic.head}
        found += topics
    return found


def _angle(z: complex) -> float | None:
    return None if z == 0 or z != z else float(degrees(np.array([z]))[0])


def _parts(z: complex) -> dict[str, Any]:
    """The components of a vector as JSON has them."""
    return {"x": finite(z.real + 0.0), "y": finite(z.imag + 0.0)}


def _vector(z: complex, phase: bool = True) -> dict[str, Any]:
    """A vibration as JSON has it."""
    size = {"amplitude": finite(abs(z))}
    return (
        {**size, "phase_deg": _angle(z), **_parts(z)}
        if phase
        else {**size, "phase_deg": None, "x": None, "y": None}
    )


def _text(z: complex) -> str:
    """A vector in both forms: `3.2 ∠ 55° = (1.83547, 2.62128)`."""
    return f"{figures(abs(z))} ∠ {figures(_angle(z) or 0.0)}° = ({_pair(z)})"


def _pair(z: complex) -> str:
    return f"{figures(z.real)}, {figures(z.imag)}"


class _Way:
    """The worked solution of a rotor."""

    def __init__(self, rotor: Rotor) -> None:
        self.rotor, self.b, self.solved, self.group, self.i = (
            rotor,
            rotor.b,
            rotor.solved,
            rotor.group,
            rotor.i,
        )
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
        runs = self.runs
        amount = float(from_si(abs(m), runs.per, runs.mass_unit))
        return f"{figures(amount)} {written(runs.mass_unit)} ∠ {figures(_angle(m) or 0.0)}°"

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
            "matrix": [[[a.real + 0.0, a.imag + 0.0] for a in row] for row in alpha.tolist()],
            "right": [[-v.real + 0.0, -v.imag + 0.0] for v in here],
            "weights": None if weights is None else [float(v) for v in weights],
        }
        begin = "as it stands" if self.b.request.from_here else "without masses"
        return Topic("system", [f"α·w = −V0, V0 the vibration {begin}: {how}.", *rows], "System", head)

    def _solution(self) -> Topic:
        solved, i = self.solved, self.i
        corrections, residual = solved.corrections[i].tolist(), solved.residual[i].tolist()
        text = [f"  w_{plane} = {self._amount(w)}" for plane, w in zip(self.planes, corrections, strict=True)]
        text.append("What is left, V0 + α·w:")
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
