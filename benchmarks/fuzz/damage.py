"""Damage to one file: its text, its cells, its tables, its encoding, its size."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable
from typing import Any

import numpy as np

Rng = np.random.Generator

# what people, spreadsheets and bad luck put into cells
TOKENS = [
    "", " ", "0", "-0", "-1", "1", "1e9", "-1e-9", "1e60", "1e-60", "1e61", "1e308", "1e-320", "nan", "inf", "-inf", "NaN",
    "x", "?", "?A", "yes", "NA", "None", "true", "1,5", "1.5.2", "0x1", "1_0", "½", "ü", "\u2212" + "1", "A", "B", "ground",
    "360", "-90", "1e5deg", "30 deg", "12 furlong", "3000 rpm", "[", "]", "{}", "[[", "= ", "\"", "'", "\\", "#", "\t",
    ";", ",", ",,", "\r", "\n", "\n\n", "\0", "\ufeff", "point = \"A\"", "[0, 0]", "[1e60, 0]", "\u2028", "\x85", "\x1b[31m", "\ud800",
    "9" * 400, "1" + "0" * 5000, "1e-400", "1979-05-27T07:32:00Z", "12:00:00", "-", "*", "$", "%s", "{0}", "../x", "a b", "٣",
]  # fmt: skip


def damage(rng: Rng, data: bytes, name: str) -> bytes:
    """Return a file with one to four faults of one kind, now and then in another encoding or with bad bytes."""
    text = data.decode("utf-8")
    kind = rng.random()
    if kind < 0.01:
        return _bulk(rng, text)
    if kind < 0.02:
        return rng.bytes(int(rng.integers(0, 300)))
    one: Callable[[Rng, str], str] = _text_fault
    if kind < 0.55:
        one = _toml_fault if name.endswith(".toml") else _csv_fault
    for _ in range(min(int(rng.geometric(0.6)), 4)):  # one fault reaches deeper than four
        text = one(rng, text)
    return _encoded(rng, text)


def _encoded(rng: Rng, text: str) -> bytes:
    encoded = text.encode("utf-8", "surrogatepass")
    kind = rng.random()
    if kind < 0.05:
        codec = str(rng.choice(["utf-16", "utf-16-le", "utf-8-sig", "cp1252", "utf-32"]))
        encoded = text.encode(codec, "replace")
    elif kind < 0.08 and encoded:
        place = int(rng.integers(len(encoded)))
        encoded = encoded[:place] + bytes([int(rng.integers(256))]) + encoded[place + 1 :]
    elif kind < 0.1:
        encoded = encoded.replace(b"\n", b"\r\n" if rng.random() < 0.5 else b"\r")
    return encoded


def _bulk(rng: Rng, text: str) -> bytes:
    """Too much of something: rows, columns, one cell, one line, nesting, zeros."""
    lines = text.splitlines(keepends=True) or [""]
    n = int(rng.choice([3_000, 30_000, 100_000]))
    nested = int(rng.choice([500, 3_000, 30_000]))
    match int(rng.integers(11)):
        case 0 | 1:
            text = "".join([lines[0], *(lines[1:] or [""]) * (n // max(1, len(lines) - 1))])
        case 2:
            text = "".join(line.rstrip("\n") + ",7" * (n // 30) + "\n" for line in lines[:20])
        case 3:
            text = _replace_word(rng, lines, int(rng.integers(len(lines))), "9" * n)
        case 4:
            text = _replace_word(rng, lines, int(rng.integers(len(lines))), "x" * 10 * n)
        case 5:
            text += f"\nname = {'[' * nested}{']' * nested}\n"
        case 6:
            text += f"\nname = {'{a=' * nested}1{'}' * nested}\n"
        case 7:
            text += f"\n[{'.'.join('a' * nested)}]\nx = 1\n"
        case 8:
            links = (
                f"[links.l{i}]\npoints = {{ P{i} = [0, 0], P{i + 1} = [1, 0] }}\n" for i in range(n // 60)
            )
            text += "\n" + "".join(links)
        case 9:
            text = "\0" * n
        case _:
            rows = (f"r{i},{line}" for i in range(n // 10) for line in lines[1:2])
            text = "rotor," + lines[0] + "".join(rows)
    return text.encode("utf-8")


# --- text --------------------------------------------------------------------------------------------------


def _token(rng: Rng) -> str:
    return TOKENS[int(rng.integers(len(TOKENS)))]


def _near(rng: Rng) -> str:
    return f"{rng.normal() * 10.0 ** rng.integers(-4, 5):.4g}"


def _text_fault(rng: Rng, text: str) -> str:
    """A fault that knows nothing of the format."""
    lines = text.splitlines(keepends=True) or [""]
    i = int(rng.integers(len(lines)))
    match int(rng.integers(9)):
        case 0 | 1:
            return _replace_word(rng, lines, i, _token(rng))
        case 2:
            return _replace_word(rng, lines, i, _near(rng))
        case 3:
            return "".join(lines[:i] + lines[i + 1 :])
        case 4:
            return "".join([*lines[: i + 1], *lines[i:]])
        case 5:
            return "".join([*lines[:i], _token(rng), *lines[i:]])
        case 6:
            return text[: int(rng.integers(len(text) + 1))]
        case 7:
            place = int(rng.integers(len(text) + 1))
            return text[:place] + _token(rng) + text[place:]
        case _:
            return "".join(lines[k] for k in rng.permutation(len(lines)))


def _replace_word(rng: Rng, lines: list[str], i: int, token: str) -> str:
    """Put a token in the place of one cell, number or word of a line."""
    words = list(re.finditer(r"[^\s,;=\[\]{}]+|(?<=,)(?=[,\n])", lines[i]))
    if not words:
        return "".join(lines)
    word = words[int(rng.integers(len(words)))]
    line = lines[i][: word.start()] + token + lines[i][word.end() :]
    return "".join([*lines[:i], line, *lines[i + 1 :]])


# --- tables ------------------------------------------------------------------------------------------------

SUFFIXES = [
    "kg",
    "g",
    "mm",
    "m",
    "in",
    "deg",
    "rad",
    "N",
    "um",
    "um_pp",
    "mm_s",
    "g_mm",
    "kg_m",
    "rpm",
    "rad_s",
    "",
    "furlong",
    "KG",
]


def _csv_fault(rng: Rng, text: str) -> str:
    """A fault of columns and rows in a table that stays a table."""
    rows = [line.split(",") for line in text.splitlines()] or [[""]]
    width = len(rows[0])
    j, k = (int(rng.integers(max(1, width))) for _ in range(2))
    body = rows[1:]
    value = _near(rng) if rng.random() < 0.5 else _token(rng)
    match int(rng.integers(13)):
        case 0:  # a column twice
            rows = [[*row, *row[j : j + 1]] for row in rows]
        case 1:
            rows = [row[:j] + row[j + 1 :] for row in rows]
        case 2:  # cells under the wrong header
            rows[0] = [
                rows[0][k] if i == j else rows[0][j] if i == k else name for i, name in enumerate(rows[0])
            ]
        case 3:
            stem, _, _ = rows[0][j].partition("_")
            rows[0] = [f"{stem}_{rng.choice(SUFFIXES)}" if i == j else name for i, name in enumerate(rows[0])]
        case 4:  # one value everywhere: equal angles, no mass, one plane
            rows = [rows[0], *([value if i == j else cell for i, cell in enumerate(row)] for row in body)]
        case 5:
            factor = 10.0 ** int(rng.integers(-40, 41))
            rows = [
                rows[0],
                *([_times(cell, factor) if i == j else cell for i, cell in enumerate(row)] for row in body),
            ]
        case 6 if body:
            rows += [list(body[int(rng.integers(len(body)))]) for _ in range(int(rng.integers(1, 5)))]
        case 7 if body:
            rows = [rows[0], body[int(rng.integers(len(body)))]]
        case 8:
            rows = [rows[0], *(body[i] for i in rng.permutation(len(body)))]
        case 9:
            rows = [[f'"{cell}"' if rng.random() < 0.3 else f" {cell} " for cell in row] for row in rows]
        case 10:
            mark = str(rng.choice([";", "\t", "|", ", "]))
            return "".join(mark.join(row) + "\n" for row in rows)
        case 11:
            return "".join(";".join(cell.replace(".", ",") for cell in row) + "\n" for row in rows)
        case _ if body:
            row = body[int(rng.integers(len(body)))]
            if row:
                row[int(rng.integers(len(row)))] = value
    return "".join(",".join(row) + "\n" for row in rows)


def _times(cell: str, factor: float) -> str:
    try:
        return repr(float(cell) * factor)
    except ValueError:
        return cell


# --- TOML: edits of the tree, with no grammar of mechanisms --------------------------------------------------

NEW: list[tuple[str, Any]] = [
    ("gears", {"links": ["crank", "rod"], "ratio": -2}),
    ("gears", {"links": ["rod", "crank"], "ratio": 1, "arm": "rocker"}),
    ("belts", {"links": ["crank", "rod"], "radii": [20, 30], "crossed": True}),
    ("belts", {"links": ["rod", "crank"], "radii": [1, 0], "arm": "rocker"}),
    ("racks", {"gear": "crank", "slider": "B", "radius": -30}),
    ("slots", {"point": "B", "link": "crank", "on": "rod", "through": "A", "angle": 30}),
    ("sliders", {"point": "B", "through": [1, 0]}),
    ("forces", {"link": "crank", "point": "B", "force": [1, 2]}),
    ("springs", {"between": ["crank.B", "ground.A"], "stiffness": 10, "free_length": 0}),
    ("torsion_springs", {"links": ["ground", "crank"], "stiffness": 1}),
    ("motors", {"carrier": "ground", "drives": "crank", "mass": 1, "center": [0, 0]}),
    ("friction", {"joint": "B", "coefficient": 0.3, "radius": 5}),
    ("input", {"link": "rod", "on": "crank", "angle": 10, "speed": 1}),
    ("torques", {"link": "crank", "torque": 1}),
]
ODD: list[Any] = [
    0, 1, -1, 1e60, -1e300, 1e-300, 10**400, True, "", "ground", "crank", "30 deg", "1e400 mm", "nan mm", float("nan"),
    float("inf"), [], {}, [0, 0], [[0, 0]], [1e60, 1e60], {"from": "A", "length": 1, "angle": 0}, "\x1b[31m\n", [[], {}], "9" * 5000,
]  # fmt: skip


def _toml_fault(rng: Rng, text: str) -> str:
    """Edit the tree of a TOML file at random; one that is none any more is damaged as text."""
    try:
        tree = tomllib.loads(text)
    except (ValueError, RecursionError):
        return _text_fault(rng, text)
    spots = list(_spots(tree))
    holder, key = spots[int(rng.integers(len(spots)))] if spots else (tree, "name")
    other, far = spots[int(rng.integers(len(spots)))] if spots else (tree, "name")
    value = holder.get(key) if isinstance(holder, dict) else holder[key]
    match int(rng.integers(9)):
        case 0:
            del holder[key]
        case 1:
            holder[key] = ODD[int(rng.integers(len(ODD)))]
        case 2 if (
            isinstance(value, (int, float)) and abs(value) < 1e300
        ):  # numbers: equal, opposite, tiny, huge, near
            factor = 10.0 ** int(rng.integers(-30, 31))
            holder[key] = [0, -value, value * (1 + 1e-15), value * factor, float(_near(rng))][
                int(rng.integers(5))
            ]
        case 3:  # the same value in two places: coincident points, links pinned to themselves, doubled tables
            holder[key] = other[far]
        case 4 if isinstance(holder, dict):  # doubled under another name
            holder[f"{key}_2"] = value
        case 5 if isinstance(holder, dict):  # pinned elsewhere, or nowhere: mobility 0, 2, -1
            holder[_name(rng, tree)] = holder.pop(key)
        case 6:
            table, entry = NEW[int(rng.integers(len(NEW)))]
            entry = {k: _renamed(rng, v, tree) for k, v in entry.items()}
            there = tree.get(table, [])
            tree[table] = [*(there if isinstance(there, list) else [there]), entry]
        case 7 if isinstance(tree.get("links"), dict):  # a link between points that are there
            a, b = _name(rng, tree), _name(rng, tree)
            tree["links"][f"bar{rng.integers(5)}"] = {"points": {a: [0, 0], b: [float(_near(rng)), 0]}}
        case _:
            holder[key] = [value, value] if rng.random() < 0.5 else {"a": value}
    try:
        return "".join(f"{_key(k)} = {_toml(v)}\n" for k, v in tree.items())
    except RecursionError:  # a table put into itself
        return text


def _spots(node: Any) -> list[tuple[Any, Any]]:
    """Every place in the tree: its holder and key."""
    found: list[tuple[Any, Any]] = []
    for key, value in node.items() if isinstance(node, dict) else enumerate(node):
        found.append((node, key))
        if isinstance(value, (dict, list)):
            found += _spots(value)
    return found


def _names(tree: dict[str, Any]) -> list[str]:
    ground, links = tree.get("ground", {}), tree.get("links", {})
    found = ["ground", "", "a.b", "ü \n"] + (list(ground) if isinstance(ground, dict) else [])
    for name, link in links.items() if isinstance(links, dict) else ():
        points = link.get("points") if isinstance(link, dict) else None
        found += [name, *(points if isinstance(points, dict) else [])] * 3
    return found


def _name(rng: Rng, tree: dict[str, Any]) -> str:
    known = _names(tree)
    return known[int(rng.integers(len(known)))]


def _renamed(rng: Rng, value: Any, tree: dict[str, Any]) -> Any:
    """Names of the file in the place of a new entry's."""
    if isinstance(value, str) and rng.random() < 0.8:
        return ".".join(_name(rng, tree) for _ in value.split("."))
    return [_renamed(rng, v, tree) for v in value] if isinstance(value, list) else value


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else _quoted(name)


def _quoted(text: str) -> str:
    body = "".join(c if c.isprintable() and c not in '"\\' else f"\\U{ord(c):08x}" for c in text)
    return f'"{body}"'


def _toml(value: Any) -> str:
    match value:
        case bool():
            return str(value).lower()
        case str():
            return _quoted(value)
        case dict():
            return "{ " + ", ".join(f"{_key(k)} = {_toml(v)}" for k, v in value.items()) + " }"
        case list():
            return "[" + ", ".join(map(_toml, value)) + "]"
        case float():
            return repr(value)
        case _:
            return str(value)
