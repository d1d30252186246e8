"""The worked solution of `dalembert field`: vectors of the runs, effects of the trials, coefficients, system, solution."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from dalembert.angles import degrees
from dalembert.results.columns import Column, Table, finite, names
from dalembert.results.way import Topic, figures
from dalembert.units import from_si, written

if TYPE_CHECKING:
    from cli.field.field_balancing import FieldBalancing
    from cli.field.runs import Channel, Complex, Group
    from cli.field.solution import Solved


def way(b: FieldBalancing) -> list[Topic]:
    """The topics of every rotor, one after the other."""
    found: list[Topic] = []
    for rotor, name in enumerate(b.runs.rotors):
        k, i = b.place[rotor]
        group, solved = b.runs.groups[k], b.solved[k]
        topics = [_vectors(b, group, i)]
        if group.trials and not b.request.four_run and group.fit is not None:
            topics.append(_effects(b, group, i))
        topics += [
            _coefficients(b, group, solved, i),
            _system(b, group, solved, i),
            _solution(b, group, solved, i),
        ]
        for topic in topics:
            if b.runs.several:
                topic.title = f"Rotor {name}: {topic.heading}"
                topic.head = {"rotor": name, **topic.head}
        found += topics
    return found


def _angle(z: complex) -> float | None:
    return None if z == 0 or z != z else float(degrees(np.array([z]))[0])


def _vector(z: complex, phase: bool = True) -> dict[str, Any]:
    """A vibration as JSON has it."""
    z = complex(z)
    if not phase:
        return {"amplitude": finite(abs(z)), "phase_deg": None, "x": None, "y": None}
    return {
        "amplitude": finite(abs(z)),
        "phase_deg": _angle(z),
        "x": finite(z.real + 0.0),
        "y": finite(z.imag + 0.0),
    }


def _text(z: complex) -> str:
    """A vector in both forms: `3.2 ∠ 55° = (1.83547, 2.62128)`."""
    z = complex(z)
    return f"{figures(abs(z))} ∠ {figures(_angle(z) or 0.0)}° = ({figures(z.real)}, {figures(z.imag)})"


def _rows(b: FieldBalancing, group: Group, i: int) -> list[tuple[str, Complex, Complex]]:
    """Every run: its name, its readings (s,), what was on the rotor (p,)."""
    if group.trials:
        return [(t.run, group.means[i, j], group.on[i, j]) for j, t in enumerate(group.trials)]
    log = group.logs[i if len(group.logs) > 1 else 0]
    return [(run, group.readings[i, r], group.masses[i, r]) for r, (run, _) in enumerate(log.rows)]


def _masses(b: FieldBalancing, planes: list[str], on: Complex) -> list[dict[str, Any]]:
    key = f"{b.runs.per}_{b.runs.per_si}"
    return [
        {"plane": plane, key: float(abs(m)), "angle_deg": _angle(complex(m))}
        for plane, m in zip(planes, on, strict=True)
        if m
    ]


def _mass_text(b: FieldBalancing, m: complex) -> str:
    runs = b.runs
    amount = float(from_si(abs(m), runs.per, runs.mass_unit))
    return f"{figures(amount)} {written(runs.mass_unit)} ∠ {figures(_angle(m) or 0.0)}°"


def _speed(channel: Channel) -> dict[str, Any]:
    return dict(channel.key)


def _vectors(b: FieldBalancing, group: Group, i: int) -> Topic:
    phase = not b.request.four_run
    entries: list[dict[str, Any]] = []
    cells: list[tuple[str, str, str, complex]] = []
    for run, read, on in _rows(b, group, i):
        entries.append(
            {
                "run": run,
                "masses": _masses(b, group.planes, on),
                "readings": [
                    {**_speed(channel), **_vector(v, phase)}
                    for channel, v in zip(group.channels, read, strict=True)
                ],
            }
        )
        put = ", ".join(
            f"{plane}: {_mass_text(b, complex(m))}" for plane, m in zip(group.planes, on, strict=True) if m
        )
        cells += [
            (run, str(channel), put or "none", complex(v))
            for channel, v in zip(group.channels, read, strict=True)
        ]
    unit = b.runs.amplitude_unit
    columns = [
        names("run", [run for run, *_ in cells]),
        names("sensor", [channel for _, channel, *_ in cells]),
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
    if b.runs.lags:
        text.append("The runs show that the phase lags: it is counted the other way here.")
    return Topic(
        "vectors", [*text, Table(columns, ("run", "sensor"))], "Vectors of the runs", {"runs": entries}
    )


def _reference(group: Group, i: int, j: int) -> int:
    """The run that trial run j is compared with: the one before it whose masses differ in one plane; else the initial one."""
    on = group.on[i]
    for r in range(j):
        if np.count_nonzero(on[j] - on[r]) == 1:
            return r
    return 0


def _effects(b: FieldBalancing, group: Group, i: int) -> Topic:
    entries, text = [], ["What a trial mass does is the difference of two runs, T = V_run − V_before:"]
    for j in range(1, len(group.trials)):
        r = _reference(group, i, j)
        put = group.on[i, j] - group.on[i, r]
        run, before = group.trials[j].run, group.trials[r].run
        named = ", ".join(
            f"{p}: {_mass_text(b, complex(m))}" for p, m in zip(group.planes, put, strict=True) if m
        )
        text.append(f"Run {run} against run {before}, {named or 'no mass'}:")
        for channel, v, w in zip(group.channels, group.means[i, j], group.means[i, r], strict=True):
            t = complex(v - w)
            text.append(
                f"  {channel}: ({figures(v.real)}, {figures(v.imag)}) − ({figures(w.real)}, {figures(w.imag)}) = {_text(t)}"
            )
            entries.append(
                {
                    "run": run,
                    "against": before,
                    **_speed(channel),
                    "masses": _masses(b, group.planes, put),
                    **_vector(t),
                }
            )
    return Topic("effects", text, "Effects of the trial masses", {"effects": entries})


def _coefficients(b: FieldBalancing, group: Group, solved: Solved, i: int) -> Topic:
    key = f"magnitude_per_{b.runs.per_si}"
    unit = f"{written(b.runs.amplitude_unit)}/{written(b.runs.per_si)}"
    alpha, entries, rows = solved.alpha[i], [], []
    for s, channel in enumerate(group.channels):
        for p, plane in enumerate(solved.planes):
            a = complex(alpha[s, p])
            rows.append((str(channel), plane, a))
            entries.append(
                {
                    **_speed(channel), "plane": plane, key: abs(a), "phase_deg": _angle(a),
                    "x": a.real + 0.0, "y": a.imag + 0.0,
                }
            )  # fmt: skip
    if b.request.four_run:
        text = "From amplitudes alone (four runs): the coefficient whose circles fit the readings best."
    elif group.fit is None:
        text = "Stored coefficients:"
    elif group.trials:
        text = (
            f"α = T/m of each trial mass ({unit}); with trial masses left on, the runs' equations together:"
        )
    else:
        text = (
            f"Initial vibration and coefficients by least squares on all runs, V_run = V0 + Σ α·m ({unit}):"
        )
    table = Table(
        [
            names("sensor", [channel for channel, *_ in rows]),
            names("plane", [plane for _, plane, _ in rows]),
            Column("magnitude", "", [abs(a) for *_, a in rows]),
            Column("phase", "deg", [_angle(a) for *_, a in rows]),
        ],
        ("sensor", "plane"),
    )
    return Topic("coefficients", [text, table], "Influence coefficients", {"coefficients": entries})


def _system(b: FieldBalancing, group: Group, solved: Solved, i: int) -> Topic:
    alpha, here = solved.alpha[i], solved.here[i]
    weights = group.own_weights(i)
    rows = []
    for s, channel in enumerate(group.channels):
        left = " + ".join(
            f"({figures(a.real)} + i·({figures(a.imag)}))·w_{plane}"
            for a, plane in zip(alpha[s].tolist(), solved.planes, strict=True)
        )
        v = complex(here[s])
        rows.append(f"  {channel}: {left} = −({figures(v.real)} + i·({figures(v.imag)}))")
    n, p = alpha.shape
    how = "as many equations as unknowns" if n == p else "Σ|α·w + V0|² least" if n > p else "least norm"
    if b.limited:
        how = "the corrections within the limits that leave the least"
    head: dict[str, Any] = {
        "planes": list(solved.planes),
        "matrix": [[[a.real + 0.0, a.imag + 0.0] for a in row] for row in alpha.tolist()],
        "right": [[-v.real + 0.0, -v.imag + 0.0] for v in here.tolist()],
        "weights": None if weights is None else [float(v) for v in weights],
    }
    begin = "as it stands" if b.request.from_here else "without masses"
    title = f"α·w = −V0, V0 the vibration {begin}: {how}."
    return Topic("system", [title, *rows], "System", head)


def _solution(b: FieldBalancing, group: Group, solved: Solved, i: int) -> Topic:
    key = f"{b.runs.per}_{b.runs.per_si}"
    corrections, residual = solved.corrections[i].tolist(), solved.residual[i].tolist()
    text = [f"  w_{plane} = {_mass_text(b, w)}" for plane, w in zip(solved.planes, corrections, strict=True)]
    text.append("What is left, V0 + α·w:")
    text += [
        f"  {channel}: {_text(v)} {written(b.runs.amplitude_unit)}"
        for channel, v in zip(group.channels, residual, strict=True)
    ]
    head: dict[str, Any] = {
        "corrections": [
            {"plane": plane, key: abs(w), "angle_deg": _angle(w), "x": w.real + 0.0, "y": w.imag + 0.0}
            for plane, w in zip(solved.planes, corrections, strict=True)
        ],
        "residual": [
            {**_speed(channel), **_vector(v)} for channel, v in zip(group.channels, residual, strict=True)
        ],
    }
    return Topic("solution", text, "Solution", head)
