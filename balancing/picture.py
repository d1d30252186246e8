"""Polar pictures of balancing: known masses and their correction, vibration before and after, masses on their places.

Angles are counter-clockwise as seen against +z. All functions take plain arrays in the named unit; they choose its prefix.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.drawing.amounts import prefixed
from dalembert.drawing.labels import Label, place
from dalembert.drawing.polar import FOUND, GIVEN, ROOM, SHARE, SUM, Look, Vector, dial, handle
from dalembert.drawing.sheet import sheet

if TYPE_CHECKING:
    from matplotlib.figure import FigureBase
    from matplotlib.lines import Line2D
    from matplotlib.projections.polar import PolarAxes

Complex = NDArray[np.complex128]
Dials = NDArray[np.object_]
"""The polar axes of a picture: a row for each rotor."""

MOST = 4
"""The largest number of rotors that are drawn."""
NAMED = 16
"""The largest number of vectors of a dial that are named."""
RIM_ROOM = 2.3
"""The reach of a dial with places, with room for the marks on the rim."""
SENSE = "angles counter-clockwise as seen against +z"
WHOLE = Look("0.55", 4.0)
TOGETHER = Look("tab:red", 1.8)


NONE = np.zeros(0, dtype=complex)


class KnownMasses(NamedTuple):
    """A rotor with known unbalances."""

    name: str
    masses: Sequence[str]
    planes: Sequence[str]
    shares: Complex
    """The share of each mass in each plane, (k, p)."""
    made: Complex
    """The printed correction in each plane, (p,)."""


class Vibration(NamedTuple):
    """A rotor with measured vibration."""

    name: str
    sensors: Sequence[str]
    before: Complex
    after: Complex
    """(s,) each."""
    planes: Sequence[str]
    corrections: Complex
    standing: Complex
    """The trial masses that stay on the rotor, (p,)."""
    places: Sequence[float] = ()
    """The angles at which masses can be placed, rad."""
    split: Sequence[Sequence[float]] = ()
    """The masses on these places, of each plane."""
    read: Complex = NONE
    fitted: Complex = NONE
    """Readings of runs and their fitted values, (n,)."""


class Places(NamedTuple):
    """Places on a rotor, the masses on them, their required sum and their sum."""

    title: str
    angles: Sequence[float]
    masses: Sequence[float]
    target: complex
    total: complex


def known_masses(
    rotors: Sequence[KnownMasses], unit: str, *, remove: bool = False, figure: FigureBase | None = None
) -> Dials:
    """Draw of each rotor its planes side by side: shares of the masses, resultant, correction; (rotors, planes)."""
    rotors = rotors[:MOST]
    every = [np.abs([*rotor.shares.ravel(), *rotor.made]).max(initial=0.0) for rotor in rotors]
    factor, unit = prefixed(float(max(every, default=0.0)), unit)
    columns = max((len(rotor.planes) for rotor in rotors), default=1)
    figure = sheet(max(4.3 * columns, 5.2), 4.5 * len(rotors) + 0.8, figure)
    dials = _dials(figure, len(rotors), columns)
    labels = []
    for row, (name, masses, planes, shares, made) in zip(dials, rotors, strict=True):
        for k, axes in enumerate(row):
            if k >= len(planes):
                axes.set_visible(False)
                continue
            named = masses if len(masses) <= NAMED else [""] * len(masses)
            mine = shares[:, k] * factor
            vectors = [Vector(v, SHARE, text) for v, text in zip(mine, named, strict=True)]
            vectors += [Vector(mine.sum(), SUM), Vector((-1 if remove else 1) * made[k] * factor, FOUND)]
            title = f"rotor {name}, plane {planes[k]}" if name else f"plane {planes[k]}"
            labels.append((axes, dial(axes, title, vectors)))
    handles = [
        handle(SHARE, "masses, their share in the plane"),
        handle(SUM, "resultant"),
        handle(FOUND, f"correction to {'remove' if remove else 'add'}"),
    ]
    _key(figure, handles, f"unbalance, {unit}; {SENSE}", min(3, 2 * columns - 1))
    place(labels)
    return dials


def before_and_after(
    before: Complex,
    after: Complex,
    corrections: Complex,
    amplitude: str,
    sensors: Sequence[str] = (),
    planes: Sequence[str] = (),
    history: tuple[Complex, Complex] | None = None,
    figure: FigureBase | None = None,
) -> Dials:
    """Draw the result of a balance, in SI: vibrations (..., s) and corrections (..., p); of a batch the first four.

    `history` has the readings of one rotor's runs and their fitted values.
    """
    s, p = before.shape[-1], corrections.shape[-1]
    many = corrections.ndim > 1
    rows = [part.reshape(-1, part.shape[-1])[:MOST] for part in np.broadcast_arrays(before, after)]
    read, fitted = history or (NONE, NONE)
    masses = np.broadcast_to(
        corrections, (*np.broadcast_shapes(before.shape[:-1], corrections.shape[:-1]), p)
    )
    vibrations = [
        Vibration(
            str(i + 1) if many else "",
            sensors or [str(k + 1) for k in range(s)],
            v,
            r,
            planes or [str(k + 1) for k in range(p)],
            w * 1e3,
            np.zeros(p, dtype=complex),
            read=read,
            fitted=fitted,
        )
        for i, (v, r, w) in enumerate(zip(*rows, masses.reshape(-1, p)[:MOST], strict=True))
    ]
    dials = vibration(vibrations, amplitude, "g", figure=figure)
    return dials if many else dials[0]


def vibration(
    rotors: Sequence[Vibration], amplitude: str, amount: str, *, figure: FigureBase | None = None
) -> Dials:
    """Draw of each rotor the vibration before and after, and the corrections; (rotors, dials).

    Where masses go onto places, each plane has a dial of its own, with the places and their masses.
    """
    apart = any(len(rotor.places) for rotor in rotors)
    columns = 1 + (max(len(rotor.planes) for rotor in rotors) if apart else 1)
    scale, amplitude = prefixed(
        _largest(*(part for r in rotors for part in (r.before, r.after, r.read))), amplitude
    )
    factor, amount = prefixed(
        _largest(*(part for r in rotors for part in (r.corrections, r.standing))), amount
    )
    figure = sheet(5.2 * columns, 5.0 * len(rotors) + 0.7, figure)
    dials = _dials(figure, len(rotors), columns)
    labels = []
    for row, rotor in zip(dials, rotors, strict=True):
        begin = f"rotor {rotor.name}: " if rotor.name else ""
        labels.append(
            (
                row[0],
                _measured(row[0], ", ".join(filter(None, (f"{begin}vibration", amplitude))), rotor, scale),
            )
        )
        title = f"{begin}correction to ADD, {amount}"
        pairs = list(zip(rotor.planes, rotor.standing * factor, rotor.corrections * factor, strict=True))
        for k, axes in enumerate(row[1:]):
            if apart and k >= len(pairs):
                axes.set_visible(False)
                continue
            mine = pairs[k : k + 1] if apart else pairs
            vectors = [Vector(on, GIVEN) for _, on, _ in mine if on]
            vectors += [Vector(w, FOUND, "" if apart else plane) for plane, _, w in mine]
            if not apart:
                labels.append((axes, dial(axes, title, vectors)))
                continue
            named = f"plane {mine[0][0]}: " if len(pairs) > 1 else ""
            masses = [mass * factor for mass in rotor.split[k]]
            drawn = dial(axes, f"{named}{title}", vectors, RIM_ROOM)
            labels.append((axes, drawn + rim(axes, rotor.places, masses, amount, abs(mine[0][2]))))
    handles = [
        handle(
            GIVEN,
            "vibration before" + ("; trial masses left on" if any(r.standing.any() for r in rotors) else ""),
        ),
        handle(FOUND, "predicted vibration (dot: almost zero); correction, named by its plane"),
    ]
    if any(len(rotor.read) for rotor in rotors):
        handles.append(_reading())
    _key(figure, handles, SENSE, len(handles))
    place(labels)
    return dials


def readings(
    sensors: Sequence[str],
    initial: Complex,
    read: Complex,
    fitted: Complex,
    amplitude: str,
    *,
    figure: FigureBase | None = None,
) -> PolarAxes:
    """Draw the readings of runs (n,), each joined to its fitted value, and the fitted vibration without masses (s,)."""
    scale, amplitude = prefixed(_largest(initial, read), amplitude)
    figure = sheet(5.6, 5.6, figure)
    axes: PolarAxes = _dials(figure, 1, 1)[0, 0]
    vectors = [Vector(v, GIVEN, name) for v, name in zip(initial * scale, sensors, strict=True)]
    title = ", ".join(filter(None, ("readings and fitted values", amplitude)))
    labels = dial(axes, title, vectors)
    _history(axes, read * scale, fitted * scale)
    axes.set_rlim(0, ROOM * (_largest(initial * scale, read * scale, fitted * scale) or 1.0))
    _key(figure, [handle(GIVEN, "vibration without masses, fitted"), _reading()], SENSE, 2)
    place([(axes, labels)])
    return axes


def indexed(
    readings: Complex,
    residuals: Complex,
    rotor: complex,
    mandrel: complex,
    quantity: str,
    unit: str,
    *,
    figure: FigureBase | None = None,
) -> PolarAxes:
    """Draw index balancing: the readings (n,) on the circle that the rotor's part makes about the tip of the mandrel's."""
    factor, unit = prefixed(_largest(readings, rotor, mandrel), unit)
    figure = sheet(5.6, 6.2, figure)
    axes: PolarAxes = _dials(figure, 1, 1)[0, 0]
    circle = (mandrel + abs(rotor) * np.exp(1j * np.linspace(0, 2 * np.pi, 241))) * factor
    axes.plot(np.angle(circle), np.abs(circle), color="0.6", lw=0.9)
    vectors = [Vector(mandrel * factor, GIVEN, "mandrel"), Vector(rotor * factor, FOUND, "rotor")]
    labels = dial(axes, f"{quantity}, {unit}", vectors)
    read = readings * factor
    _history(axes, read, read - residuals * factor)
    labels += [Label(str(k + 1), (float(np.angle(v)), abs(v)), "tab:blue", 8.0) for k, v in enumerate(read)]
    axes.set_rlim(0, ROOM * (_largest(read, circle, rotor * factor) or 1.0))
    handles = [
        handle(FOUND, "the rotor alone, in its position turned = 0"),
        handle(GIVEN, "the mandrel"),
        _reading("readings in their order, joined to the fitted ones"),
    ]
    _key(figure, handles, SENSE, 1)
    place([(axes, labels)])
    return axes


def places(
    panels: Sequence[Places], unit: str, *, remove: bool = False, figure: FigureBase | None = None
) -> NDArray[np.object_]:
    """Draw for each plane its places with their masses on the rim, target and total as vectors; (planes,)."""
    from matplotlib.lines import Line2D

    factor, unit = prefixed(_largest(*((p.target, p.total, *p.masses) for p in panels)), unit)
    figure = sheet(5.6 * len(panels), 6.2, figure)
    dials: Dials = _dials(figure, 1, len(panels))[0]
    labels = []
    for axes, (title, angles, masses, target, total) in zip(dials, panels, strict=True):
        vectors = [Vector(target * factor, WHOLE), Vector(total * factor, TOGETHER)]
        scale = _largest(target * factor, total * factor)
        title = f"{title}material to {'remove' if remove else 'add'}, {unit}"
        drawn = dial(axes, title, vectors, RIM_ROOM)
        labels.append(
            (axes, drawn + rim(axes, angles, [m * factor for m in masses], unit, scale, remove=remove))
        )
    filled = "white" if remove else "tab:red"
    what = "drilled or taken off" if remove else "mass"
    handles = [
        handle(WHOLE, "correction"),
        handle(TOGETHER, "sum of the masses"),
        Line2D([], [], color="tab:red", marker="o", ls="", mfc=filled, label=what),
        Line2D([], [], color="0.6", marker="o", ls="", mfc="white", label="empty place"),
    ]
    _key(figure, handles, SENSE, 2)
    place(labels)
    return dials


def _largest(*parts: ArrayLike) -> float:
    values = np.concatenate([np.abs(np.asarray(part, dtype=complex)).ravel() for part in parts])
    return float(values[np.isfinite(values)].max(initial=0.0))


def _dials(figure: FigureBase, rows: int, columns: int) -> Dials:
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    engine = figure.get_figure(root=True).get_layout_engine()
    if isinstance(engine, ConstrainedLayoutEngine):
        # a dial's title stands above its degrees, which the layout learns too late
        engine.set(h_pad=0.14)
    dials: Dials = figure.subplots(rows, columns, subplot_kw={"projection": "polar"}, squeeze=False)
    return dials


def _key(figure: FigureBase, handles: Sequence[object], title: str, columns: int) -> None:
    key = figure.legend(
        handles=handles, loc="outside lower center", ncols=columns, fontsize=9, frameon=False, title=title
    )
    key.get_title().set_fontsize(9)


def _measured(axes: PolarAxes, title: str, rotor: Vibration, scale: float) -> list[Label]:
    few = len(rotor.before) <= NAMED
    names = [str(sensor) if few else "" for sensor in rotor.sensors]
    before, after = rotor.before * scale, rotor.after * scale
    size = _largest(before, after)
    # a name at the tip of what is left too, if there are several and there is room for it
    left = [
        name if len(names) > 1 and abs(r) > 0.15 * size else "" for name, r in zip(names, after, strict=True)
    ]
    vectors = [Vector(v, GIVEN, name) for v, name in zip(before, names, strict=True)]
    vectors += [Vector(r, FOUND, name) for r, name in zip(after, left, strict=True)]
    _history(axes, rotor.read * scale, rotor.fitted * scale)
    drawn = dial(axes, title, vectors)
    axes.set_rlim(0, ROOM * (_largest(before, after, rotor.read * scale, rotor.fitted * scale) or 1.0))
    return drawn


DOT: dict[str, Any] = {
    "color": "tab:orange",
    "lw": 1.0,
    "marker": "o",
    "ms": 3.5,
    "mfc": "tab:blue",
    "mec": "tab:blue",
}


def _history(axes: PolarAxes, read: Complex, fitted: Complex) -> None:
    for v, w in zip(read, fitted, strict=True):
        axes.plot(np.angle([v, w]), np.abs([v, w]), **DOT, markevery=[0])


def _reading(label: str = "reading of a run, joined to its fitted value") -> Line2D:
    from matplotlib.lines import Line2D

    return Line2D([], [], **DOT, label=label)


def rim(
    axes: PolarAxes,
    angles: ArrayLike,
    masses: Sequence[float],
    unit: str,
    scale: float,
    *,
    remove: bool = False,
) -> list[Label]:
    """Draw the places as spokes about the vectors, and the masses on them; return the labels of the masses."""
    scale = scale or 1.0
    edge = 1.35 * scale
    largest = max(masses, default=0.0) or 1.0
    labels = []
    for k, (angle, mass) in enumerate(zip(np.asarray(angles, dtype=float).tolist(), masses, strict=True)):
        used = mass > 0
        axes.plot([angle, angle], [1.12 * scale, edge], color="0.6", lw=3.0 if used else 2.0, zorder=2)
        axes.plot(
            [angle],
            [edge],
            "o",
            ms=4 + 12 * np.sqrt(mass / largest) if used else 5,
            mfc="tab:red" if used and not remove else "white",
            mec="tab:red" if used else "0.6",
            mew=1.5,
            zorder=3,
        )
        if used:
            labels.append(
                Label(f"{k + 1}: {mass:.4g} {unit}", (angle, 1.05 * edge), toward=float(np.degrees(angle)))
            )
        elif len(masses) <= 36:
            labels.append(Label(f"{k + 1}", (angle, 1.04 * edge), "0.4", 7.0, float(np.degrees(angle))))
    return labels
