"""The tables that are asked for in place of the poses: of `--check`, `--equilibrium`, `--flywheel` and their kin."""

from __future__ import annotations

from typing import Any

Columns = dict[str, list[Any]]
KEYS = ("quantity", "of", "k", "link")
"""The columns that name a row."""


def of_check(document: dict[str, Any]) -> Columns:
    """What the mechanism is: a row for each statement, named as in the JSON."""
    rows: list[tuple[str, str, Any]] = [
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


def of_equilibria(found: list[dict[str, Any]], inputs: dict[str, str]) -> Columns:
    """The positions of rest; `inputs`: the name of each input and of its quantity, `input_deg` or `input_m`."""
    if len(inputs) == 1:
        places = [[row[key] for key in inputs.values()] for row in found]
        names = list(inputs.values())
    else:
        places = [[row["inputs"][name][key] for name, key in inputs.items()] for row in found]
        names = [f"{name}_{key}" for name, key in inputs.items()]
    rows = [(*place, row["stable"], row["potential_J"]) for place, row in zip(places, found, strict=True)]
    return _columns((*names, "stable", "potential_J"), rows)


def of_cycle(part: dict[str, Any]) -> Columns:
    """Mean, peak and RMS effort, work, flywheel: one row."""
    return {key: [value] for key, value in part.items()}


def of_counterweights(part: dict[str, Any]) -> Columns:
    """A counterweight a row, with the shaking force before and after all of them."""
    rms = {key: value for key, value in part.items() if key != "weights"}
    return _records([w | rms for w in part["weights"]])


def of_iterates(part: dict[str, Any]) -> Columns:
    """The iterates of Newton and Raphson."""
    return _records(part["iterates"])


def _records(rows: list[dict[str, Any]]) -> Columns:
    return {key: [row[key] for row in rows] for key in rows[0]}


def _columns(names: tuple[str, ...], rows: list[Any]) -> Columns:
    return {name: [row[i] for row in rows] for i, name in enumerate(names)}
