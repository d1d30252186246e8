"""What is found of a mechanism beside its poses, as JSON and tables: check, iterates, cycle, equilibria."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cli.errors import DataError
from cli.mechanism.columns import column
from cli.mechanism.options import Options, names
from cli.mechanism.quantities import effort_name
from cli.mechanism.solve import Analysis
from cli.show.columns import Table

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cli.show.columns import Cell

STUDY_KEYS = ("quantity", "of", "k", "link")
"""The columns that name a row of a study's table."""
# read again by the words and tables made of it: of its shape INTERFACE speaks
Document = dict[str, Any]


@dataclass(frozen=True)
class Studies:
    """The studies of an analysis, each worked out once."""

    analysis: Analysis
    asked: Options

    @cached_property
    def document(self) -> Document:
        """What the JSON holds beside the poses."""
        return self._found[0]

    @property
    def said(self) -> list[str]:
        """What is to be said of the equilibria."""
        return self._found[1]

    @cached_property
    def _found(self) -> tuple[Document, list[str]]:
        analysis, asked = self.analysis, self.asked
        found: Document = {}
        said: list[str] = []
        if asked.newton:
            found |= newton_document(analysis)
        if asked.check:
            found["check"] = check_document(analysis)
        of_one = asked.forces and len(analysis.mechanism.inputs) == 1
        if (of_one or asked.flywheel is not None) and asked.swept:
            found["cycle"] = cycle(analysis, asked.flywheel)
        if asked.equilibrium:
            found["equilibria"], said = equilibria(analysis, asked.swept)
        if asked.counterweights:
            found["counterweights"] = counterweights(analysis, names(asked.counterweights))
        return found, said


def check_document(analysis: Analysis) -> Document:
    """The character of the mechanism."""
    from virtualwork.study.check import Check

    check = Check(analysis.mechanism.assembly)
    unit = analysis.unit

    def shown(values: Sequence[float] | None) -> list[float | None] | None:
        if values is None:
            return None
        return [None if not math.isfinite(v) else (v if unit == "m" else math.degrees(v)) for v in values]

    return {
        "mobility": check.mobility,
        "mobility_by_rank": check.mobility_by_rank,
        "redundant": list(check.redundant),
        "groups": list(check.groups),
        "four_bars": [
            {
                "links": list(f.links),
                "grashof": f.grashof,
                "transmission_deg": [math.degrees(v) if math.isfinite(v) else None for v in f.transmission],
            }
            for f in check.four_bars
        ],
        f"input_limits_{unit}": shown(check.printed_limits),
        f"dead_points_{unit}": shown(check.dead_points),
        f"change_points_{unit}": shown(check.change_points),
        **({"singular": list(check.singular)} if check.singular else {}),
    }


def newton_document(analysis: Analysis) -> Document:
    """Newton-Raphson from the guess at every pose; the table of the first, the largest difference of all."""
    from virtualwork.study.newton_table import all_at_once

    assembly = analysis.assemblies[0]
    done = [all_at_once(assembly, tuple(row)) for row in analysis.inputs.values.tolist()]
    first = done[0]
    names = [
        *(f"{n}_deg" for n in first.unknowns[: first.angles]),
        *(f"{n}_m" for n in first.unknowns[first.angles :]),
    ]
    iterates = []
    for it in first.iterates:
        values = [*np.degrees(it.unknowns[: first.angles]).tolist(), *it.unknowns[first.angles :].tolist()]
        iterates.append({"k": it.k, **dict(zip(names, values, strict=True)), "residual_m": it.residual})
    away = [i for i, d in enumerate(done) if not d.closed or not d.difference < 1e-6]
    for i in away[:3]:
        why = "did not converge" if not done[i].closed else "found another assembly"
        analysis.warnings.append(f"newton from the guess {why} at step {analysis.inputs.steps[i]}")
    if len(away) > 3:
        analysis.warnings.append(
            f"newton from the guess missed the assembly at {len(away)} of {len(done)} poses"
        )
    differences = [d.difference for d in done if math.isfinite(d.difference)]
    return {
        "iterates": iterates,
        "newton_difference_rad": max(differences) if differences else None,
        "jacobian": {"unknowns": list(first.unknowns), "at": "the guess", "rows": first.jacobian.tolist()},
    }


def cycle(analysis: Analysis, coefficient: float | None) -> Document:
    """Mean, peak and RMS effort over the sweep, work, energy error, flywheel."""
    from virtualwork.study.cycle import Cycle

    motion = analysis.motions[0]
    m = analysis.mechanism
    if len(m.inputs) != 1:
        raise DataError(f"{analysis.file}: a cycle has one input, found {len(m.inputs)}")
    name = effort_name(m.inputs[0].is_slide)
    keys = *(f"{key}_{name}" for key in ("mean", "peak", "rms")), "work_J", "energy_closure_J"
    found: Document = dict.fromkeys((*keys, "flywheel_inertia_kg_m2"))
    if motion.n < 2 or not np.isfinite(motion.effort).all():
        analysis.warnings.append(
            "cycle: the effort is not finite at every pose of the sweep: no mean, work or flywheel"
        )
        return found
    c = Cycle(motion)
    found |= zip(keys, (c.mean, c.peak, c.rms, c.work, c.closure), strict=True)
    if coefficient is not None:
        if m.inputs[0].is_slide:
            raise DataError(f"{analysis.file}: --flywheel: the input is a slide: a flywheel turns")
        try:
            found["flywheel_inertia_kg_m2"] = c.flywheel(coefficient)
        except ValueError as error:
            raise DataError(f"{analysis.file}: --flywheel: {error}") from None
        found["energy_fluctuation_J"] = c.fluctuation
    return found


def equilibria(analysis: Analysis, swept: bool) -> tuple[list[Document], list[str]]:
    """The positions where the loads balance without effort, and what to say of them."""
    from virtualwork import equilibria as search

    m = analysis.mechanism
    spans = None
    if swept:
        spans = np.stack([analysis.inputs.values.min(axis=0), analysis.inputs.values.max(axis=0)], axis=1)
        held = spans[:, 0] == spans[:, 1]
        if held.any():
            spans = None
    found = search(m, spans)
    rows = []
    for e in found.found:
        values = {}
        for entry, value in zip(m.inputs, e.inputs, strict=True):
            shown = value if entry.is_slide else math.degrees(value) % 360.0
            values[entry.name] = {analysis.input_names[entry.name]: shown}
        place = next(iter(values.values())) if len(m.inputs) == 1 else {"inputs": values}
        rows.append({**place, "stable": e.stable, "potential_J": e.potential})
    said = []
    if not found.loaded:
        said.append("nothing acts at rest: every position is one of equilibrium")
    elif found.region:
        said.append("positions of rest fill a part of the range: they are not isolated, and not listed")
    elif found.everywhere:
        said.append(
            "the loads balance in every position: equilibrium everywhere, neither stable nor unstable"
        )
    elif not rows:
        said.append("no equilibrium: the loads balance at no position of the range")
    if any(row["stable"] is None for row in rows):
        said.append("stable null: the second variation of the potential vanishes there and does not decide")
    return rows, said


def counterweights(analysis: Analysis, links: list[str]) -> Document:
    """Counterweights on links that leave the least RMS shaking force over the sweep."""
    from virtualwork.study.counterweights import least_squares

    weights, before, after = least_squares(analysis.motions[0], links)

    def rms(force: NDArray[np.complex128]) -> float:
        return float(np.sqrt(np.nanmean(np.abs(force) ** 2)))

    return {
        "weights": [
            {
                "link": link,
                "mass_radius_kg_m": abs(w),
                "angle_deg": math.degrees(math.atan2(w.imag, w.real)) % 360.0,
            }
            for link, w in weights.items()
        ],
        "shaking_rms_before_N": rms(before),
        "shaking_rms_after_N": rms(after),
    }


# --- as tables --------------------------------------------------------------------------------------------------------
def tables(found: Studies) -> dict[str, Callable[[], Table]]:
    """Return the tables of the studies, by their options' names."""
    document = found.document
    known: dict[str, Callable[[], Table]] = {
        "--newton": lambda: of_iterates(document),
        "--check": lambda: of_check(document["check"]),
        "--equilibrium": lambda: of_equilibria(document["equilibria"], found.analysis.input_names),
        "--flywheel": lambda: of_cycle(document["cycle"]),
        "--counterweights": lambda: of_counterweights(document["counterweights"]),
    }
    return {flag: known[flag] for flag in found.asked.tables if flag != "--forces"}


def of_check(document: Document) -> Table:
    """What the mechanism is: a row for each statement, named as in the JSON."""
    rows: list[tuple[str, str, Cell]] = [
        ("mobility", "", document["mobility"]),
        ("mobility_by_rank", "", document["mobility_by_rank"]),
        *(("redundant", name, True) for name in document["redundant"]),
        *(("group", " + ".join(g["links"]), f"{g['kind']}, {g['method']}") for g in document["groups"]),
    ]
    for f in document["four_bars"]:
        links = ", ".join(f["links"])
        rows.append(("grashof", links, f["grashof"]))
        for word, value in zip(("least", "largest"), f["transmission_deg"], strict=True):
            rows.append((f"{word}_transmission_deg", links, value))
    for key in document:
        if key.startswith(("input_limits", "dead_points", "change_points")):
            values = ["none"] if not document[key] else ["open" if v is None else v for v in document[key]]
            rows += [(key, str(i) if len(values) > 1 else "", v) for i, v in enumerate(values, 1)]
    return _columns(("quantity", "of", "value"), rows)


def of_equilibria(found: list[Document], inputs: dict[str, str]) -> Table:
    """The positions of rest; `inputs`: the name of each input and of its quantity, `input_deg` or `input_m`."""
    if len(inputs) == 1:
        places = [[row[key] for key in inputs.values()] for row in found]
        names = list(inputs.values())
    else:
        places = [[row["inputs"][name][key] for name, key in inputs.items()] for row in found]
        names = [f"{name}_{key}" for name, key in inputs.items()]
    rows = [(*place, row["stable"], row["potential_J"]) for place, row in zip(places, found, strict=True)]
    return _columns((*names, "stable", "potential_J"), rows)


def of_cycle(part: Document) -> Table:
    """Mean, peak and RMS effort, work, flywheel: one row."""
    return _records([part])


def of_counterweights(part: Document) -> Table:
    """A counterweight a row, with the shaking force before and after all of them."""
    rms = {key: value for key, value in part.items() if key != "weights"}
    return _records([w | rms for w in part["weights"]])


def of_iterates(part: Document) -> Table:
    """The iterates of Newton and Raphson."""
    return _records(part["iterates"])


def _records(rows: list[Document]) -> Table:
    return _columns(list(rows[0]), [list(row.values()) for row in rows])


def _columns(names: Sequence[str], rows: Sequence[Sequence[Cell]]) -> Table:
    columns = [column(name, [row[i] for row in rows]) for i, name in enumerate(names)]
    return Table(columns, keys=("step", "branch", *STUDY_KEYS))
