"""The pictures of a balancing in the field; of a fitted log a circle for each sensor and state with its runs, the residuals."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from balancing import region_factor
from balancing.doubt import LEVEL
from balancing.picture import RIM_ROOM, Vibration, rim, vibration
from cli.field.field_balancing import FieldBalancing
from cli.field.fits import predicted, rows, run_to_predict, suggested
from cli.field.runs import Complex, Real
from cli.field.solution import Solved
from cli.field.tables import amplitude_unit
from cli.show.picture import blank
from dalembert.drawing.labels import Label, place
from dalembert.drawing.polar import Look, arrow, free_direction
from dalembert.drawing.sheet import plain, sheet

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure
    from matplotlib.lines import Line2D
    from matplotlib.projections.polar import PolarAxes
    from numpy.typing import ArrayLike

ACROSS = 3  # panels side by side
CIRCLES = 6  # so many sensors and states have a circle
NAMED = 14  # so many places of readings are named by their runs
MARKS = "os^Dvp*XPhd<>8"
BEFORE, AFTER, READ, FITTED, NEXT = "0.45", "tab:red", "tab:blue", "tab:orange", "tab:green"
SUGGESTED = "tab:purple"


def draw(balancing: FieldBalancing, rotors: Sequence[int]) -> Figure:
    """Draw for each rotor the vibration before and after, and the corrections; of a fit with all that it was found from."""
    if balancing.runs.fitted:
        return _fits(balancing, rotors, blank())
    return dials(balancing, rotors)


def dials(balancing: FieldBalancing, rotors: Sequence[int], *, trims: bool = False) -> Figure:
    """Draw for each rotor the vibration before and after, and the corrections, as dials; or what to add as it stands."""
    figure = blank()
    shown = [_rotor(balancing, rotor, trims=trims) for rotor in rotors]
    vibration(shown, amplitude_unit(balancing), balancing.unit, figure=figure)
    return figure


def _rotor(balancing: FieldBalancing, rotor: int, *, trims: bool = False) -> Vibration:
    k, i = balancing.place[rotor]
    solved = balancing.solved[k]
    fix, start = (solved.trim, 0 * solved.standing) if trims else (solved.corrections, solved.start)
    places = balancing.request.places or ()
    split = [_on_places(balancing, w) for w in fix[i].tolist()] if places else []
    return Vibration(
        balancing.runs.rotors[rotor] if balancing.runs.several else "",
        [str(channel) for channel in solved.group.channels],
        solved.initial[i],
        solved.residual[i],
        solved.planes,
        balancing.amount(fix[i]),
        balancing.amount(start[i]),
        places=np.radians(places).tolist(),
        split=split,
    )


def _on_places(balancing: FieldBalancing, w: complex) -> list[float]:
    """Return what of a correction goes on each of the places, in the unit of the trial masses."""
    masses = [0.0] * len(balancing.request.places or ())
    for name, _, mass in balancing.split(w):
        masses[int(name) - 1] = float(balancing.amount(mass))
    return masses


def _fits(balancing: FieldBalancing, rotors: Sequence[int], figure: Figure) -> Figure:
    """Draw the history of each rotor, its corrections with their 95 % regions, and its residuals."""
    blocks = []
    for rotor in rotors:
        k, i = balancing.place[rotor]
        blocks.append((rotor, balancing.solved[k], i))
    heights = [
        -(-(min(len(solved.group.channels), CIRCLES) + len(_dials(balancing, solved)) + 2) // ACROSS)
        for _, solved, _ in blocks
    ]
    sheet(11.4, 3.9 * sum(heights) + 0.5, figure)
    parts = figure.subfigures(len(blocks), 1, height_ratios=heights, squeeze=False)[:, 0]
    labels = []
    for part, count, (rotor, solved, i) in zip(parts, heights, blocks, strict=True):
        if balancing.runs.several:
            part.suptitle(f"rotor {balancing.runs.rotors[rotor]}")
        labels += _block(part, count, balancing, solved, i)
    figure.get_layout_engine().set(rect=(0, 0, 1, 0.985), h_pad=0.07, w_pad=0.06)  # type: ignore[union-attr, call-arg]
    figure.legend(handles=_handles(balancing), loc="outside lower center", ncols=4, fontsize=9, frameon=False)
    place(labels)
    return figure


def _block(
    part: SubFigure, height: int, balancing: FieldBalancing, solved: Solved, i: int
) -> list[tuple[Axes, list[Label]]]:
    grid = part.add_gridspec(height, ACROSS)
    cells = [grid[k // ACROSS, k % ACROSS] for k in range(height * ACROSS)]
    shown = min(len(solved.group.channels), CIRCLES)
    labels: list[tuple[Axes, list[Label]]] = []
    for s in range(shown):
        axes: PolarAxes = part.add_subplot(cells[s], projection="polar")  # type: ignore[assignment]
        labels.append((axes, _circle(axes, balancing, solved, i, s)))
    last = shown
    for planes in _dials(balancing, solved):
        dial: PolarAxes = part.add_subplot(cells[last], projection="polar")  # type: ignore[assignment]
        labels.append((dial, _corrections(dial, balancing, solved, i, planes)))
        last += 1
    _regions(part.add_subplot(cells[last]), balancing, solved, i)
    last += 1
    _residuals(part.add_subplot(grid[last // ACROSS, last % ACROSS :]), balancing, solved, i, shown)
    return labels


def _points(axes: PolarAxes, values: ArrayLike, style: str, color: str, **look: object) -> None:
    """Draw vectors as points, or a line from one to the other."""
    axes.plot(np.angle(values), np.abs(values), style, color=color, **look)  # type: ignore[arg-type]


def _region(axes: PolarAxes, outline: Complex, color: str) -> None:
    axes.fill(np.angle(outline), np.abs(outline), color=color, alpha=0.18, lw=0)
    _points(axes, outline, "-", color, lw=0.8)


def _finished(axes: PolarAxes, title: str, scale: float, vectors: Sequence[complex]) -> None:
    """Give a dial its title and its rings, with room for the largest vector."""
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


def _circle(axes: PolarAxes, balancing: FieldBalancing, solved: Solved, i: int, s: int) -> list[Label]:
    """Draw the runs of one sensor and state, what was fitted to them, and what is to be expected."""
    assert solved.balance is not None
    balance, group = solved.balance, solved.group
    fit = balance.fit
    here = np.flatnonzero(fit.present[i, :, s])
    read = fit.readings[i, here, s]
    fitted = read - fit.residuals[i, here, s]
    before, after = complex(solved.initial[i, s]), complex(solved.residual[i, s])
    regions = [(after, balance.vibration_spread(solved.total), AFTER)]
    if balancing.predict is not None:
        value, _ = predicted(balancing, solved)
        on = np.broadcast_to(run_to_predict(balancing, solved.planes), solved.corrections.shape)
        regions.append((complex(value[i, s]), balance.vibration_spread(on, reading=True), NEXT))
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
    outliers = [row.value for row in rows(group, i) if row.channel == group.channels[s] and row.outlier]
    for outlier in outliers:
        _points(axes, [outlier], "o", AFTER, mfc="none", ms=9, mew=1.2)
    _finished(axes, f"sensor {group.channels[s]}, {amplitude_unit(balancing)}", scale, vectors)
    runs = group.logs[i].rows
    names = list(_names(read, [runs[j][0] for j in here], 0.06 * scale))
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
    """Return the outline δᵀV⁻¹δ = k² about a vector, V along it and across; its own point where nothing is known."""
    if not (np.isfinite(covariance).all() and np.isfinite(k)):
        return np.array([center])
    size, axes = np.linalg.eigh(covariance)
    turn = np.linspace(0, 2 * np.pi, 91)
    along, across = (axes * (k * np.sqrt(np.maximum(size, 0.0)))) @ np.stack([np.cos(turn), np.sin(turn)])
    unit = center / abs(center) if center else 1.0
    return np.asarray(center + unit * (along + 1j * across))


def _dials(balancing: FieldBalancing, solved: Solved) -> list[list[int]]:
    """Return the planes of each dial of corrections: where masses go onto places, each has its own."""
    planes = list(range(len(solved.planes)))
    return [[p] for p in planes] if balancing.request.places else [planes]


def _corrections(
    axes: PolarAxes, balancing: FieldBalancing, solved: Solved, i: int, planes: list[int]
) -> list[Label]:
    """Draw the corrections of planes and their 95 % regions, the places with their masses, and the next run's masses."""
    every = balancing.amount(solved.corrections[i])
    spreads = _spread(balancing, solved, i)
    masses, spreads = every[planes], [spreads[p] for p in planes] if spreads else []
    spreads_of = zip(masses, spreads, strict=False)
    outlines = [_ellipse(complex(w), *region) for w, region in spreads_of]
    scale = min(_largest(masses, *outlines), 2.5 * _largest(masses))
    for outline in outlines:
        _region(axes, outline, AFTER)
    for w in masses:
        arrow(axes, w, scale, Look(AFTER, 2.2))
    run = suggested(solved, i) if balancing.request.suggest else None
    if run is not None:
        at = balancing.amount(run.masses)[planes]
        scale = max(scale, float(np.abs(at).max()))
        _points(axes, at, "s", SUGGESTED, ms=6)
    names = [solved.planes[p] for p in planes]
    places = balancing.request.places
    if not places:
        _finished(axes, f"corrections to ADD, {balancing.unit}", scale, list(masses))
        return [_label(plane, w, AFTER, 8.0) for plane, w in zip(names, masses, strict=True)]
    (plane,) = planes
    named = f"plane {names[0]}: " if len(solved.planes) > 1 else ""
    _finished(axes, f"{named}correction to ADD, {balancing.unit}", RIM_ROOM / 1.15 * scale, list(masses))
    split = _on_places(balancing, complex(solved.corrections[i, plane]))
    return rim(axes, np.radians(places), split, balancing.unit, scale)


def _spread(balancing: FieldBalancing, solved: Solved, i: int) -> list[tuple[Real, float]]:
    """Return for each plane the covariance of the correction, in its unit, and the factor of its 95 % region."""
    if solved.covariance is None or solved.balance is None:
        return []
    factors = region_factor(0.95, solved.balance.degrees_of_freedom[i])
    unit = balancing.amount(1.0) ** 2
    return [
        (covariance * unit, float(k)) for covariance, k in zip(solved.covariance[i], factors, strict=True)
    ]


def _regions(axes: Axes, balancing: FieldBalancing, solved: Solved, i: int) -> None:
    """Draw the 95 % regions of the corrections enlarged, each about its own correction."""
    spreads = _spread(balancing, solved, i)
    for k, (plane, region) in enumerate(zip(solved.planes, spreads, strict=False)):
        outline = _ellipse(0j, *region)
        color = AFTER if len(solved.planes) == 1 else f"C{k}"
        axes.fill(outline.real, outline.imag, color=color, alpha=0.12, lw=0)
        axes.plot(outline.real, outline.imag, color=color, lw=1.2, label=plane)
    if spreads and len(solved.planes) > 1:
        axes.legend(fontsize=7.5, frameon=False, loc="upper left", title="plane", title_fontsize=8)
    axes.plot([0], [0], "+", color="0.2", ms=8)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel(f"along the correction, {balancing.unit}", fontsize=9)
    axes.set_ylabel(f"across, {balancing.unit}", fontsize=9)
    axes.tick_params(labelsize=8, colors="0.3")
    plain(axes)
    bounded = bool(spreads) and bool(np.isfinite([np.sum(covariance) * k for covariance, k in spreads]).all())
    title = (
        "95 % region of each correction, enlarged"
        if bounded
        else "nothing tells how sure the corrections are"
    )
    axes.set_title(title, pad=8, fontsize=10)


def _residuals(axes: Axes, balancing: FieldBalancing, solved: Solved, i: int, shown: int) -> None:
    """Draw the standardised residuals, run by run, and from where on one is an outlier."""
    group = solved.group
    read = list(rows(group, i))
    runs = group.logs[i].runs
    place = {run: k for k, run in enumerate(runs)}
    for s, channel in enumerate(group.channels):
        mine = [row for row in read if row.channel == channel]
        style = MARKS[s % len(MARKS)] if s < shown else "."
        at = [place[row.run] + 0.5 * ((s + 1) / (len(group.channels) + 1) - 0.5) for row in mine]
        axes.plot(at, [row.standardized for row in mine], style, ms=4.5, label=str(channel))
    assert group.fit is not None
    nu = int(group.fit.degrees_of_freedom[i])
    judged = int(np.isfinite([row.standardized for row in read]).sum())
    if nu >= 2 and judged:
        limit = float(np.sqrt(nu * (1 - (LEVEL / judged) ** (1 / (nu - 1)))))
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
        axes.set_ylim(0, 1.25 * max(limit, *(row.standardized for row in read if row.standardized < np.inf)))
    else:
        axes.set_ylim(0, None)
    few = range(0, len(runs), 1 + len(runs) // 16)
    axes.set_xticks(list(few), [runs[k] for k in few], fontsize=8)
    axes.set_xlabel("run", fontsize=9)
    axes.tick_params(labelsize=8, colors="0.3")
    axes.grid(axis="y", color="0.88")
    axes.set_title("standardised residuals" if nu else "no readings remain for residuals", pad=8, fontsize=10)
    if 1 < len(group.channels) <= CIRCLES:
        axes.legend(fontsize=7.5, frameon=False, loc="upper left", ncols=2)


def _handles(balancing: FieldBalancing) -> list[Line2D]:
    from matplotlib.lines import Line2D

    outlier = any((solved.group.chance < LEVEL).any() for solved in balancing.solved)
    shown: list[tuple[bool, str, str, dict[str, object]]] = [
        (True, "reading, named by its run", READ, {"marker": "o", "ls": "", "ms": 4}),
        (True, "vibration fitted to it", FITTED, {"marker": "o", "mfc": "none", "lw": 1.1, "ms": 5}),
        (True, "fitted without masses", BEFORE, {"lw": 1.3, "ls": "--"}),
        (True, "with the corrections; with its 95 % region", AFTER, {"lw": 1.8}),
        (outlier, "outlier", AFTER, {"marker": "o", "mfc": "none", "ls": "", "ms": 8}),
        (
            balancing.predict is not None,
            "predicted run, 95 % region of a reading",
            NEXT,
            {"marker": "D", "ls": "", "ms": 5},
        ),
        (balancing.request.suggest, "masses of the next run", SUGGESTED, {"marker": "s", "ls": "", "ms": 6}),
    ]
    return [
        Line2D([], [], color=color, label=label, **look)  # type: ignore[arg-type]
        for there, label, color, look in shown
        if there
    ]
