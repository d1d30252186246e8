"""The picture of a log that was fitted: a circle for each sensor and state with its runs, the corrections, the residuals."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from balancing.doubt import LEVEL
from balancing.log_balance import Spread, region_factor
from balancing.picture import RIM_ROOM, rim
from balancing.run_log import JointFit
from dalembert.drawing.labels import Label, place
from dalembert.drawing.polar import Look, arrow, free_direction
from dalembert.drawing.sheet import plain, sheet

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure
    from matplotlib.lines import Line2D
    from matplotlib.projections.polar import PolarAxes

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

ACROSS = 3  # panels side by side
CIRCLES = 6  # number of sensors and states with a circle
NAMED = 14  # readings with the name of their run
MARKS = "os^Dvp*XPhd<>8"
BEFORE, AFTER, READ, FITTED, NEXT = "0.45", "tab:red", "tab:blue", "tab:orange", "tab:green"
SUGGESTED = "tab:purple"


class History(NamedTuple):
    """A machine's log, one of i in its fit, and the corrections from it; masses in the unit of the picture."""

    name: str
    i: int
    sensors: Sequence[str]
    runs: Sequence[str]
    """The run of each row of readings."""
    fit: JointFit
    """Without run-out."""
    chance: Real
    """The probability by chance of a residual as large as each one, (r, s)."""
    initial: Complex
    residual: Complex
    """(s,) each."""
    after: Spread
    """The spread of the vibration with the corrections, of all machines."""
    planes: Sequence[str]
    corrections: Complex
    spreads: Sequence[tuple[Real, float]]
    """For each plane the covariance of the correction, and the factor of its 95 % region; none if it is undetermined."""
    predicted: tuple[complex | Complex, Spread] | None = None
    """The run to be predicted, (s,), and its spread, of all machines."""
    suggested: Complex | None = None
    """The masses of the next run, (p,)."""
    places: Sequence[float] = ()
    """The angles at which masses can be placed, degrees."""
    split: Sequence[Sequence[float]] = ()
    """The masses on these places, of each plane."""

    @property
    def dials(self) -> list[list[int]]:
        """The planes of each dial of corrections: where masses go onto places, each has its own."""
        planes = list(range(len(self.planes)))
        return [[p] for p in planes] if self.places else [planes]


def log_history(histories: Sequence[History], amplitude: str, mass: str, figure: Figure) -> Figure:
    """Draw the history of each machine, its corrections with their 95 % regions, and its residuals; units as written."""
    heights = [-(-(min(len(h.sensors), CIRCLES) + len(h.dials) + 2) // ACROSS) for h in histories]
    sheet(11.4, 3.9 * sum(heights) + 0.5, figure)
    parts = figure.subfigures(len(histories), 1, height_ratios=heights, squeeze=False)[:, 0]
    labels = []
    for part, height, history in zip(parts, heights, histories, strict=True):
        if history.name:
            part.suptitle(f"rotor {history.name}")
        labels += _block(part, height, history, amplitude, mass)
    figure.get_layout_engine().set(rect=(0, 0, 1, 0.985), h_pad=0.07, w_pad=0.06)  # type: ignore[union-attr, call-arg]
    figure.legend(handles=_handles(histories), loc="outside lower center", ncols=4, fontsize=9, frameon=False)
    place(labels)
    return figure


def _block(
    part: SubFigure, height: int, history: History, amplitude: str, mass: str
) -> list[tuple[Axes, list[Label]]]:
    grid = part.add_gridspec(height, ACROSS)
    cells = iter([grid[k // ACROSS, k % ACROSS] for k in range(height * ACROSS)])
    shown = min(len(history.sensors), CIRCLES)
    labels: list[tuple[Axes, list[Label]]] = []
    for s in range(shown):
        axes: PolarAxes = part.add_subplot(next(cells), projection="polar")  # type: ignore[assignment]
        labels.append((axes, _circle(axes, history, s, amplitude)))
    for planes in history.dials:
        dial: PolarAxes = part.add_subplot(next(cells), projection="polar")  # type: ignore[assignment]
        labels.append((dial, _corrections(dial, history, planes, mass)))
    _regions(part.add_subplot(next(cells)), history, mass)
    last = shown + len(history.dials) + 1
    _residuals(part.add_subplot(grid[last // ACROSS, last % ACROSS :]), history, shown)
    return labels


def _points(axes: PolarAxes, values: ArrayLike, style: str, color: str, **look: object) -> None:
    """Draw vectors as points, or a line from one to the other."""
    axes.plot(np.angle(values), np.abs(values), style, color=color, **look)  # type: ignore[arg-type]


def _region(axes: PolarAxes, outline: Complex, color: str) -> None:
    axes.fill(np.angle(outline), np.abs(outline), color=color, alpha=0.18, lw=0)
    _points(axes, outline, "-", color, lw=0.8)


def _finished(axes: PolarAxes, title: str, scale: float, vectors: Sequence[complex]) -> None:
    """Add title and rings to a dial, with room for the largest vector."""
    from matplotlib.ticker import MaxNLocator

    axes.set_title(title, pad=12, fontsize=10)
    axes.set_rlim(0, 1.15 * scale)
    axes.set_rlabel_position(free_direction(vectors))
    axes.yaxis.set_major_locator(MaxNLocator(4))
    axes.tick_params(labelsize=7.5, colors="0.35", pad=-1)
    axes.grid(color="0.87")


def _largest(*values: ArrayLike) -> float:
    """Return the largest size among vectors, 1 where all are nothing."""
    return max((float(np.abs(each).max(initial=0)) for each in values), default=0.0) or 1.0


def _label(text: str, at: complex, color: str, size: float) -> Label:
    angle = float(np.angle(at))
    return Label(text, (angle, float(abs(at))), color, size, float(np.degrees(angle)))


def _circle(axes: PolarAxes, history: History, s: int, unit: str) -> list[Label]:
    """Draw the runs of one sensor and state, what was fitted to them, and what is to be expected."""
    fit, i = history.fit, history.i
    here = np.flatnonzero(fit.present[i, :, s])
    read = fit.readings[i, here, s]
    fitted = read - fit.residuals[i, here, s]
    before, after = complex(history.initial[s]), complex(history.residual[s])
    regions = [(after, history.after, AFTER)]
    if history.predicted is not None:
        value, spread = history.predicted
        regions.append((complex(np.asarray(value)[s]), spread, NEXT))
    outlines = [
        _ellipse(value, spread.covariance[i, s], float(region_factor(0.95, spread.degrees_of_freedom[i, s])))
        for value, spread, _ in regions
    ]
    vectors = [*read, before, after]
    scale = min(_largest(vectors, fitted, *outlines), 1.6 * _largest(vectors))
    for outline, (_, _, color) in zip(outlines, regions, strict=True):
        _region(axes, outline, color)
    arrow(axes, before, scale, Look(BEFORE, 1.3, "--"))
    arrow(axes, after, scale, Look(AFTER, 1.8))
    if abs(after) < 0.03 * scale:  # too short for an arrow
        _points(axes, [after], "o", AFTER, ms=5)
    for pair in zip(fitted, read, strict=True):
        _points(axes, pair, "-", FITTED, lw=1.1)
    _points(axes, fitted, "o", FITTED, mfc="none", ms=4.5, mew=1.0)
    _points(axes, read, "o", READ, ms=3.5)
    for at, _, color in regions[1:]:
        _points(axes, [at], "D", color, ms=5)
    for outlier in read[history.chance[here, s] < LEVEL]:
        _points(axes, [outlier], "o", AFTER, mfc="none", ms=9, mew=1.2)
    _finished(axes, f"sensor {history.sensors[s]}, {unit}", scale, vectors)
    names = list(_names(read, [history.runs[j] for j in here.tolist()], 0.06 * scale))
    return [_label(name, near, READ, 7.5) for near, name in (names if len(names) <= NAMED else ())]


def _names(values: Complex, runs: list[str], near: float) -> Iterator[tuple[complex, str]]:
    """Yield where readings lie, and which runs they are of: those near one another under one name."""
    left = list(zip(values.tolist(), runs, strict=True))
    while left:
        first = left[0][0]
        close = [pair for pair in left if abs(pair[0] - first) <= near]
        left = [pair for pair in left if abs(pair[0] - first) > near]
        yield (
            complex(np.mean([value for value, _ in close])),
            ", ".join(dict.fromkeys(run for _, run in close)),
        )


def _ellipse(center: complex, covariance: Real, k: float) -> Complex:
    """Return the outline δᵀV⁻¹δ = k² about a vector, V along it and across; its own point without a covariance."""
    if not (np.isfinite(covariance).all() and np.isfinite(k)):
        return np.array([center])
    size, axes = np.linalg.eigh(covariance)
    turn = np.linspace(0, 2 * np.pi, 91)
    along, across = (axes * (k * np.sqrt(np.maximum(size, 0.0)))) @ np.stack([np.cos(turn), np.sin(turn)])
    unit = center / abs(center) if center else 1.0
    return np.asarray(center + unit * (along + 1j * across))


def _corrections(axes: PolarAxes, history: History, planes: list[int], unit: str) -> list[Label]:
    """Draw the corrections of planes and their 95 % regions, the places with their masses, and the next run's masses."""
    masses, spreads = history.corrections[planes], [history.spreads[p] for p in planes if history.spreads]
    outlines = [_ellipse(complex(w), *region) for w, region in zip(masses, spreads, strict=False)]
    scale = min(_largest(masses, *outlines), 2.5 * _largest(masses))
    for outline in outlines:
        _region(axes, outline, AFTER)
    for w in masses:
        arrow(axes, w, scale, Look(AFTER, 2.2))
    if history.suggested is not None:
        at = history.suggested[planes]
        scale = max(scale, float(np.abs(at).max()))
        _points(axes, at, "s", SUGGESTED, ms=6)
    names = [history.planes[p] for p in planes]
    if not history.places:
        _finished(axes, f"corrections to ADD, {unit}", scale, list(masses))
        return [_label(plane, w, AFTER, 8.0) for plane, w in zip(names, masses, strict=True)]
    named = f"plane {names[0]}: " if len(history.planes) > 1 else ""
    _finished(axes, f"{named}correction to ADD, {unit}", RIM_ROOM / 1.15 * scale, list(masses))
    return rim(axes, np.radians(history.places), history.split[planes[0]], unit, scale)


def _regions(axes: Axes, history: History, unit: str) -> None:
    """Draw the 95 % regions of the corrections enlarged, each about its own correction."""
    spreads, several = history.spreads, len(history.planes) > 1
    for k, (plane, region) in enumerate(zip(history.planes, spreads, strict=False)):
        outline, color = _ellipse(0j, *region), f"C{k}" if several else AFTER
        axes.fill(outline.real, outline.imag, color=color, alpha=0.12, lw=0)
        axes.plot(outline.real, outline.imag, color=color, lw=1.2, label=plane)
    if spreads and several:
        axes.legend(fontsize=7.5, frameon=False, loc="upper left", title="plane", title_fontsize=8)
    axes.plot([0], [0], "+", color="0.2", ms=8)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel(f"along the correction, {unit}", fontsize=9)
    axes.set_ylabel(f"across, {unit}", fontsize=9)
    axes.tick_params(labelsize=8, colors="0.3")
    plain(axes)
    bounded = bool(spreads) and bool(np.isfinite([np.sum(covariance) * k for covariance, k in spreads]).all())
    title = (
        "95 % region of each correction, enlarged"
        if bounded
        else "the uncertainty of the corrections is not known"
    )
    axes.set_title(title, pad=8, fontsize=10)


def _residuals(axes: Axes, history: History, shown: int) -> None:
    """Draw the standardised residuals, run by run, and from where on one is an outlier."""
    fit, i, runs = history.fit, history.i, list(dict.fromkeys(history.runs))
    far = fit.standardized[i]
    for s, sensor in enumerate(history.sensors):
        rows = np.flatnonzero(fit.present[i, :, s]).tolist()
        shift = 0.5 * ((s + 1) / (len(history.sensors) + 1) - 0.5)
        at = [runs.index(history.runs[j]) + shift for j in rows]
        style = MARKS[s % len(MARKS)] if s < shown else "."
        axes.plot(at, far[rows, s], style, ms=4.5, label=sensor)
    nu, finite = int(fit.degrees_of_freedom[i]), far[fit.present[i] & np.isfinite(far)]
    if nu >= 2 and len(finite):
        limit = float(np.sqrt(nu * (1 - (LEVEL / len(finite)) ** (1 / (nu - 1)))))
        axes.axhline(limit, color=AFTER, lw=1.0, ls="--")
        axes.annotate(
            f"outliers lie above ({LEVEL:.0%})",
            (1, limit),
            (0, 3),
            xycoords=("axes fraction", "data"),
            textcoords="offset points",
            ha="right",
            fontsize=8,
            color=AFTER,
        )
        axes.set_ylim(0, 1.25 * max(limit, float(finite.max())))
    else:
        axes.set_ylim(0, None)
    few = range(0, len(runs), 1 + len(runs) // 16)
    axes.set_xticks(list(few), [runs[k] for k in few], fontsize=8)
    axes.set_xlabel("run", fontsize=9)
    axes.tick_params(labelsize=8, colors="0.3")
    axes.grid(axis="y", color="0.88")
    axes.set_title("standardised residuals" if nu else "no readings remain for residuals", pad=8, fontsize=10)
    if 1 < len(history.sensors) <= CIRCLES:
        axes.legend(fontsize=7.5, frameon=False, loc="upper left", ncols=2)


def _handles(histories: Sequence[History]) -> list[Line2D]:
    from matplotlib.lines import Line2D

    outlier = any((h.chance < LEVEL).any() for h in histories)
    suggested = any(h.suggested is not None for h in histories)
    shown: list[tuple[bool, str, str, dict[str, object]]] = [
        (True, "reading, named by its run", READ, {"marker": "o", "ls": "", "ms": 4}),
        (True, "vibration fitted to it", FITTED, {"marker": "o", "mfc": "none", "lw": 1.1, "ms": 5}),
        (True, "fitted without masses", BEFORE, {"lw": 1.3, "ls": "--"}),
        (True, "with the corrections; with its 95 % region", AFTER, {"lw": 1.8}),
        (outlier, "outlier", AFTER, {"marker": "o", "mfc": "none", "ls": "", "ms": 8}),
        (
            any(h.predicted is not None for h in histories),
            "predicted run, 95 % region of a reading",
            NEXT,
            {"marker": "D", "ls": "", "ms": 5},
        ),
        (suggested, "masses of the next run", SUGGESTED, {"marker": "s", "ls": "", "ms": 6}),
    ]
    return [
        Line2D([], [], color=color, label=label, **look)  # type: ignore[arg-type]
        for there, label, color, look in shown
        if there
    ]
