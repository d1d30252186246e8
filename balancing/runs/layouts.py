"""The layouts in which tables of runs and logs occur, brought to the columns of a table of runs."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace

from balancing.runs.vectors import AMPLITUDE, MASS, UNBALANCE, Layout, parted_cells, vectors_of
from dalembert.errors import DataError, quote
from dalembert.quantities import parse_number
from dalembert.tables.headers import Heading, plain_word, quantity_meant, words_of
from dalembert.tables.sources import Source, without_dashes
from dalembert.tables.table import Cells, Table, read
from dalembert.units import find_unit, parted

NAMES = {
    "mode": "state",
    "operating mode": "state",
    "doublea": "amplitude_um_pp",
    "amplitude": "amplitude_um",
    "reference": "ref",
    "useful": "use",
    "plane": "trial_plane",
    "start": "run",
    "mass": "trial_mass_kg",
    "unbalance": "trial_unbalance_kg_m",
    "mass_angle_deg": "trial_angle_deg",
}
OF_ANGLE = re.compile(r"(?:phase|(mass_|unbalance_)?angle(?:_(\w+))?)")
WITH = re.compile(
    r"without\b.*|with\s+(?P<mass>[\d.,]+)\s*(?P<unit>[a-z]+)(?:\s*(?:@|at)\s*(?P<angle>[-+\d.,]+)\s*(?:°|deg)?)?"
)


TEXTS = ("rotor", "run", "sensor", "state", "trial_plane", "trial_kept", "ref", "use", "date")


def runs_layout(path: str) -> Layout:
    """Read a table of runs, or a log in any of the layouts, and what it states besides."""
    vectors = vectors_of(path)
    if vectors is not None:
        return vectors
    of_log = False

    def headers(header: list[str]) -> list[str]:
        nonlocal of_log
        of_log = is_log(header)
        return headed(header) if of_log else _trial_names(header)

    masses = {"trial_mass": "mass", "trial_unbalance": "unbalance", "trial_angle": "angle"}
    table = read(
        path,
        numbers={"speed": "speed", "amplitude": "amplitude", "phase": "angle", "weight": "number"},
        texts=TEXTS,
        cells=masses,
        blank=["speed", "weight", "amplitude", "phase", "trial_plane", *masses],
        headers=headers,
        layout=long_form,
    )
    states = [WITH.fullmatch(state.lower()) for state in table.texts.get("state", ())]
    if states and all(states) and "trial_mass" not in table.cells:
        _states_are_masses(table, [match for match in states if match])
    return Layout(table, of_log)


def _trial_names(header: list[str]) -> list[str]:
    """Return a header in which `plane` and `kept` are those of the trial masses, where there are any.

    >>> _trial_names(["run", "plane", "kept", "trial_mass_g"])
    ['run', 'trial_plane', 'trial_kept', 'trial_mass_g']
    """
    lower = [name.lower() for name in header]
    if not any(name.startswith(("trial_mass", "trial_unbalance")) for name in lower):
        return header
    return [
        f"trial_{name}" if name in ("plane", "kept") and f"trial_{name}" not in lower else written
        for written, name in zip(header, lower, strict=True)
    ]


def is_log(header: list[str]) -> bool:
    """Whether a header is a log's, whose masses alone may distinguish its runs."""
    columns = {name.strip().lower() for name in header}
    own = any(name.startswith(("mass_", "unbalance_")) for name in columns)
    own = own and not any(name.startswith(("trial_mass", "trial_unbalance")) for name in columns)
    return not header[0].strip() or own or bool(columns & {"state", *NAMES} - {"plane", "amplitude"})


def headed(header: list[str]) -> list[str]:
    """Return the columns of a table of runs that a log's header means; `phase` is known by its place.

    >>> headed(["", "DoubleA", "phase", "mass", "phase", "ref"])
    ['state', 'amplitude_um_pp', 'phase_deg', 'trial_mass_kg', 'trial_angle_deg', 'ref']
    >>> headed(["state", "amplitude_um", "phase_rad", "mass_g", "angle_rad"])
    ['state', 'amplitude_um', 'phase_rad', 'trial_mass_g', 'trial_angle_rad']
    """
    out: list[str] = []
    of_mass = False
    for k, name in enumerate(header):
        word = name.strip().lower()
        meant = "state" if not word and k == 0 else NAMES.get(word, word)
        if word.startswith(("mass_", "unbalance_")) and word not in NAMES:
            meant = f"trial_{word}"
        if angle := OF_ANGLE.fullmatch(word):
            of, unit = angle.groups()
            meant = f"{'trial_angle' if of or of_mass else 'phase'}_{unit or 'deg'}"
        if meant.startswith(("trial_mass", "trial_unbalance", "amplitude")):
            of_mass = not meant.startswith("amplitude")
        out.append(name if meant == word else meant)
    return out


def _states_are_masses(table: Table, states: list[re.Match[str]]) -> None:
    """Read `without` and `with 0.06 g`: the state names the mass that was on."""
    units = {match["unit"] for match in states if match["unit"]}
    if len(units) != 1:
        raise DataError(
            f"{table.file}: the states name masses in {', '.join(sorted(units)) or 'no unit'}: expected one unit"
        )
    header, unit = "state", units.pop()
    if unit not in ("kg", "g", "mg", "lb", "oz"):
        raise DataError(f"{table.file}: the states name masses in '{unit}': expected kg, g, mg, lb or oz")
    table.cells["trial_mass"] = Cells(header, unit, [match["mass"] or "" for match in states])
    table.cells["trial_angle"] = Cells(header, "deg", [match["angle"] or "0" for match in states])
    if not any(match["angle"] for match in states):
        table.warnings.append(
            f"{table.file}: the states name no angle of the mass: the angle of the correction counts from that of the mass"
        )
    del table.texts["state"]


# -- sheets with a row a run and a column pair for each sensor, in English or German -----------------------------

PHASE, TRIAL_ANGLE, ANGLE = words_of("phase"), words_of("trial_angle"), words_of("angle", "trial_angle")
PLACE = ("sensor", "lager", "messstelle", "messpunkt", "messebene", "aufnehmer", "bearing", "at", "am", "an")
DIRECTION = ("direction", "axis", "richtung", "messrichtung", "achse")
PLANE = ("plane", "ebene", "in", "der", "trial", "test", "probe", "ausgleichsebene")
KEPT = ("bleibt", "kept", "trial_kept", "bleibt_drauf")
WHOLE = ("rotor", "run", "state", "speed", "weight", "ref", "use", "date", "trial_plane", "trial_kept")
MEANT = (
    *WHOLE,
    "sensor",
    "amplitude",
    "phase",
    "mass",
    "trial_mass",
    "angle",
    "trial_angle",
    "plane",
    "unbalance",
)
"""What a foreign word may mean in a table of runs."""
OWN = {
    **{
        name: name
        for name in (*WHOLE, "sensor", "amplitude", "phase", "trial_mass", "trial_unbalance", "trial_angle")
    },
    "mass": "trial_mass",
    "unbalance": "trial_unbalance",
    "angle": "trial_angle",
    "plane": "trial_plane",
    "doublea": "amplitude",
    "mode": "state",
    "operating_mode": "state",
    "reference": "ref",
    "useful": "use",
    "start": "run",
}
"""The words of a table of runs, and of a log, and what they are in such a table."""


@dataclass(frozen=True)
class _Column:
    """A column, and what it was taken for."""

    place: int
    heading: Heading
    kind: str
    """`amplitude`, `phase`, `trial_mass`, `trial_unbalance`, `trial_angle`, or a column of every row."""
    of: str
    """The sensor, or the plane; empty where the header names none."""
    unit: str = ""


def long_form(source: Source) -> Source:
    """Return a table of runs with a row for each reading; of one that is such a table already only foreign names change."""
    source = _one_sensor(parted_cells(source))
    if not is_wide(source):
        return _translated(source)
    columns = list(_columns(source.headings))
    source.check_cells(column.place for column in columns)
    for column in columns:
        twin = next(c for c in columns if (c.kind, c.of) == (column.kind, column.of))
        if twin is not column:
            both = f"{twin.heading.written} and {column.heading.written}"
            raise DataError(
                f"{source.file}: the columns {both} are both {_taken(column)}: expected one of them"
            )
    unit = _one_unit(source.file, [c for c in columns if c.kind == "amplitude"])
    for column in columns:
        partner = {"amplitude": "phase", "phase": "amplitude"}.get(column.kind)
        if partner and not any((c.kind, c.of) == (partner, column.of) for c in columns):
            raise DataError(
                f"{source.file}: the column {column.heading.written} is {_taken(column)}, and no column is the {partner} there: "
                "expected a pair of columns for each sensor"
            )
    taken = "; ".join(
        f"{quote(c.heading.written)} is {_taken(c)}" for c in columns if c.of or c.kind not in WHOLE
    )
    source.warnings.append(f"{source.file}: read with a row a run: {taken}")
    used = {column.place for column in columns}
    left = [each.written for k, each in enumerate(source.headings) if k not in used and each.written]
    if left:
        source.warnings.append(
            f"{source.file}: ignored the column{'s' * (len(left) > 1)} {', '.join(map(quote, left))}"
        )
    return _Long(source, columns, unit).source()


def _one_sensor(source: Source) -> Source:
    """Join the columns that name a sensor together, such as Lager and Richtung, or bearing and probe; of one named sensor nothing changes."""
    every = source.headings
    places = [
        k for k, each in enumerate(every) if _is_foreign_sensor(each) or plain_word(each.base) in DIRECTION
    ]
    own = any(plain_word(each.base) == "sensor" for each in every)
    if own or len(places) < 2 or not any(_is_foreign_sensor(every[k]) for k in places):
        return source
    source.check_cells(places)
    first = places[0]
    named = " and ".join(quote(every[k].written) for k in places)
    source.warnings.append(f"{source.file}: read {named} together as sensor")
    rows = []
    for line, cells in source.full_rows():
        joined = " ".join(cell for k in places if (cell := cells[k].strip()))
        kept = [joined if k == first else cell for k, cell in enumerate(cells) if k not in places[1:]]
        rows.append((line, kept))
    headings = [each for k, each in enumerate(every) if k not in places[1:]]
    headings[first] = Heading(every[first].written, "sensor")
    return source.laid_out(headings, rows)


def _translated(source: Source) -> Source:
    """Return a table with a row for each reading under the names of its columns that the command knows.

    A foreign word for the sensor makes it one, and then every column is translated; else those under a foreign word alone. A
    name that is known already, or that two columns would share, stays.
    """
    names, before = [each.name for each in source.headings], ""
    own = [OWN.get(_stem(each), "") for each in source.headings]
    whole = any(_is_foreign_sensor(each) for each in source.headings)
    foreign = [_stem(each) for each in source.headings if _stem(each) not in OWN]
    if not whole and not any(
        quantity_meant(stem, MEANT) or AMPLITUDE.intersection(stem.split("_")) for stem in foreign
    ):
        return source
    for place, each in enumerate(source.headings):
        column = _known(place, each, before)
        before = own[place] if column is None else column.kind
        if own[place] and not whole:
            continue
        unit = find_unit("amplitude", each.unit or parted(each.name)[1])
        words = _stem(each).split("_")
        if _is_foreign_sensor(each):
            names[place] = "sensor"
        elif unit and any(word in AMPLITUDE for word in words):
            names[place] = f"amplitude_{unit}"
        elif quantity_meant(each.base, ["trial_plane", "plane"]):
            names[place] = "trial_plane"
        elif column is not None and (whole or (column.kind not in own and _is_word(words))):
            names[place] = f"{column.kind}_{column.unit}" if column.unit else column.kind
    return source.named(names)


def _stem(each: Heading) -> str:
    """The plain words of a header without its unit."""
    return plain_word(each.base if each.unit else parted(each.name)[0])


def _is_word(words: Sequence[str]) -> bool:
    """Whether a header has a word of the trade, and not a unit alone."""
    every = (*AMPLITUDE, *PHASE, *ANGLE, *MASS, *UNBALANCE, *KEPT)
    return any(word in every for word in words) or bool(quantity_meant("_".join(words), WHOLE))


def _is_foreign_sensor(each: Heading) -> bool:
    return plain_word(each.base) != "sensor" and bool(quantity_meant(each.base, ["sensor"]))


def is_wide(source: Source) -> bool:
    """Tell by its header whether a sheet has a column pair for each sensor."""
    columns = list(_columns(source.headings))
    pairs = {c.of for c in columns if c.kind == "amplitude"} & {c.of for c in columns if c.kind == "phase"}
    return bool(pairs) and not any(quantity_meant(each.base, ["sensor"]) for each in source.headings)


def _columns(headings: Sequence[Heading]) -> Iterator[_Column]:
    """Yield the columns that are known, with what they are taken for; under a header over two columns both are of one place."""
    before: _Column | None = None
    for place, each in enumerate(headings):
        column = _known(place, each, before.kind if before else "")
        if before and column and not each.written:
            column = replace(column, heading=before.heading, of=before.of)
        before = column
        if column is not None:
            yield column


def _known(place: int, each: Heading, before: str) -> _Column | None:
    stem, unit = (each.base, each.unit) if each.unit else parted(each.name)
    words = [plain_word(word) for word in stem.split("_")]
    meant = plain_word(stem)
    named = [
        word for word, plain in zip(stem.split("_"), words, strict=True) if plain not in (*PLACE, *PLANE)
    ]

    def name(*kinds: Collection[str]) -> str:
        drop = [word for kind in kinds for word in kind]
        return "_".join(word for word in named if plain_word(word) not in drop)

    def has(*kinds: Collection[str]) -> bool:
        return any(word in kind for word in words for kind in kinds)

    angle, amplitude = find_unit("angle", unit), find_unit("amplitude", unit)
    if meant in KEPT:
        return _Column(place, each, "trial_kept", "")
    if has(MASS) and find_unit("mass", unit):
        return _Column(place, each, "trial_mass", name(MASS), find_unit("mass", unit) or "")
    if has(UNBALANCE) and find_unit("unbalance", unit):
        return _Column(place, each, "trial_unbalance", name(UNBALANCE), find_unit("unbalance", unit) or "")
    if angle or (has(PHASE, ANGLE) and not unit):
        of_mass = (
            before in ("trial_mass", "trial_unbalance")
            or (has(ANGLE) and "trial" in words)
            or has(TRIAL_ANGLE)
        )
        kind = "trial_angle" if of_mass and not has(PHASE) else "phase"
        return _Column(place, each, kind, name(PHASE, ANGLE), angle or "deg")
    if amplitude and name(AMPLITUDE):
        return _Column(place, each, "amplitude", name(AMPLITUDE), amplitude)
    quantity = quantity_meant(stem, WHOLE) or (meant if meant in WHOLE else "")
    if quantity == "speed":
        speed = find_unit("speed", unit or meant)
        return _Column(place, each, "speed", "", speed) if speed else None
    return _Column(place, each, quantity, "") if quantity else None


def _taken(column: _Column) -> str:
    """Say what a column was taken for."""
    words = {
        "trial_mass": "trial mass",
        "trial_unbalance": "trial unbalance",
        "trial_angle": "angle of the trial mass",
    }
    where = "plane" if column.kind in words else "sensor"
    return f"the {words.get(column.kind, column.kind)}{f' at {where} {column.of}' if column.of else ''}"


def _one_unit(file: str, columns: Sequence[_Column]) -> str:
    units = list(dict.fromkeys(column.unit for column in columns))
    if len(units) > 1:
        raise DataError(f"{file}: the sensors are in {' and '.join(units)}: expected one unit of vibration")
    return units[0]


class _Long:
    """The rows of a wide sheet, one for each reading."""

    def __init__(self, wide: Source, columns: Sequence[_Column], unit: str) -> None:
        self.wide, self.unit = wide, unit
        self.at = {(c.kind, c.of): c for c in columns}
        self.sensors = [c.of for c in columns if c.kind == "amplitude"]
        self.size = next((c for c in columns if c.kind in ("trial_mass", "trial_unbalance")), None)
        self.planes = [c.of for c in columns if self.size and c.kind == self.size.kind and c.of]
        self.whole = [c for c in columns if c.kind in WHOLE]
        if not any(c.kind == "run" for c in self.whole):
            wide.warnings.append(f"{wide.file}: no column run: each row is a run, numbered from 1")

    def source(self) -> Source:
        """Return the table of readings."""
        names = ["sensor", f"amplitude_{self.unit}", "phase_deg"]
        turns = {c.unit for (kind, _), c in self.at.items() if kind == "phase"}
        if turns == {"rad"}:
            names[-1] = "phase_rad"
        elif "rad" in turns:
            raise DataError(f"{self.wide.file}: phases in deg and rad: expected one unit")
        names += [c.kind if not c.unit else f"{c.kind}_{c.unit}" for c in self.whole]
        if not any(c.kind == "run" for c in self.whole):
            names.append("run")
        if self.size is not None:
            names += [f"{self.size.kind}_{self.size.unit}", f"trial_angle_{self._angle_unit()}"]
            names += ["trial_plane"] if self.planes else []
        return self.wide.laid_out([Heading(name, name) for name in names], self._records())

    def _angle_unit(self) -> str:
        return next((c.unit for (kind, _), c in self.at.items() if kind == "trial_angle"), "deg")

    def _records(self) -> Iterator[tuple[int, list[str]]]:
        for number, (line, cells) in enumerate(self.wide.rows(), 1):
            cells = without_dashes([*cells, *[""] * (len(self.wide.headings) - len(cells))])
            rest = [cells[c.place].strip() for c in self.whole]
            if not any(c.kind == "run" for c in self.whole):
                rest.append(str(number))
            rest += self._masses(cells)
            for sensor in self.sensors:
                read = [cells[self.at[kind, sensor].place].strip() for kind in ("amplitude", "phase")]
                if any(read):
                    yield line, [sensor, *read, *rest]

    def _masses(self, cells: Sequence[str]) -> list[str]:
        """Return size, angle and plane of a row's trial masses, several joined by ';'; blank where there is none."""
        if self.size is None:
            return []
        entries = []
        for plane in self.planes or [""]:
            size = cells[self.at[self.size.kind, plane].place].strip()
            turn = self.at.get(("trial_angle", plane)) or self.at.get(("trial_angle", ""))
            if size and not _is_zero(size):
                entries.append((size, cells[turn.place].strip() if turn else "", plane))
        joined = [";".join(part) for part in zip(*entries, strict=True)] if entries else ["", "", ""]
        return joined if self.planes else joined[:2]


def _is_zero(text: str) -> bool:
    try:
        return parse_number(text.replace(",", ".")) == 0
    except ValueError:
        return False
