"""A header of a table: the quantity and its unit, as `mass_kg`, `mass [kg]`, `mass (kg)` or `Mass, kg`; foreign names."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from functools import cache

from dalembert.dataclass import dataclass, replace
from dalembert.errors import DataError, toml_text
from dalembert.tables.files import read_toml
from dalembert.units import AMPLITUDES, TAGS, UNITS, dimensions, find_unit, nearest_unit, parted, unit_name

# compiled where a header is so written
_BRACKETS = r"(?s)(.*?)\s*(?:\[([^\[\]]*)\]|\(([^()]*)\))\Z"
_PARTED = r"(?s)(.*\S)\s*(?:,|\s/\s|\sin\s)\s*(\S.*)\Z"
NO_UNIT = ("", "-", "1")


@dataclass(frozen=True, eq=False, repr=False)
class Heading:
    """A column's header."""

    written: str
    base: str
    """Without the unit that stands in brackets, behind a comma or in the row below."""
    unit: str = ""
    """Its unit as a suffix; empty if it has none."""

    @property
    def name(self) -> str:
        """Quantity and unit: `mass_kg`."""
        if not self.unit or self.base.lower().endswith(f"_{self.unit.lower()}"):
            return self.base
        return f"{self.base}_{self.unit}"

    def of(self, quantity: str) -> str | None:
        """Return the suffix behind a quantity's name, if the column is called by it, in any case."""
        name, quantity = self.name.lower(), plain(quantity).lower()
        if name == quantity:
            return ""
        return self.name[len(quantity) + 1 :] if name.startswith(f"{quantity}_") else None

    def with_unit(self, cell: str, dimensions: Mapping[str, str]) -> Heading:
        """Return the heading with the unit of the row below; ValueError with the unit that the header itself has."""
        unit = _unit_name(cell)
        if not unit:
            return self
        for quantity, dimension in dimensions.items():
            suffix = self.of(quantity)
            own = find_unit(dimension, suffix) if suffix else None
            if own:
                if find_unit(dimension, unit) == own:
                    return self
                raise ValueError(own)
        if self.unit and self.unit.lower() != unit.lower():
            raise ValueError(self.unit)
        return replace(self, unit=unit)


def heading(written: str) -> Heading:
    """Read a header; a column that is renamed has its new name."""
    written = written.strip()
    base, unit = _parted(written)
    for header, foreign in _renamed.items():
        if foreign.lower() in (written.lower(), base.lower()):
            _met.add(header)
            return Heading(written, *_merged(header, unit, written))
    return Heading(written, base, unit)


def _parted(written: str) -> tuple[str, str]:
    """Split a header into name and unit, both as the suffixes spell them."""
    base, unit = written, ""
    if written.endswith(("]", ")")) and (match := re.match(_BRACKETS, written)):
        base, unit = match.group(1), match.group(2) or match.group(3) or ""
    elif re.search(r"[,\s]", written) and (match := re.match(_PARTED, written)) and is_unit(match.group(2)):
        base, unit = match.groups()
    return plain(base), _unit_name(unit)


def _unit_name(written: str) -> str:
    """A unit in a header or in the row below, in brackets or not; degrees are `Grad` in German.

    >>> _unit_name("[Grad]"), _unit_name("mm/s"), _unit_name(" - ")
    ('deg', 'mm_s', '')
    """
    bare = written.strip().strip("[]()")
    return "" if bare.strip() in NO_UNIT else "deg" if bare == "Grad" else unit_name(bare)


@cache
def plain(name: str) -> str:
    """A name as headers are compared: names of links and points may have blanks, ° and µ too.

    >>> plain("µ arm_x")
    'u_arm_x'
    """
    return re.sub(r"\s+", "_", name.strip().replace("°", "deg")).translate(str.maketrans("µμ", "uu"))


def is_unit(text: str) -> bool:
    """Whether a text is the name of a unit, in brackets or not."""
    return bool(dimensions(_unit_name(text)))


# name here -> header in the file (the option --column), and which were met
_renamed: dict[str, str] = {}
_met: set[str] = set()


def rename(names: Mapping[str, str]) -> None:
    """Take columns under other names from now on: name here -> header in the file."""
    _renamed.clear()
    _met.clear()
    _renamed.update(names)


def rename_from(path: str) -> None:
    """Take the headers of `--columns FILE.toml` for this call; where `--column` has the same name or header, that one holds."""
    own = {header.strip().lower() for header in _renamed.values()}
    for name, header in read_toml(path)[1].items():
        if not isinstance(header, str):
            raise DataError(
                f'{path}: {name}: found {toml_text(header)}, expected a header in quotes, such as mass_g = "Masse"'
            )
        if header.strip().lower() not in own:
            _renamed.setdefault(name, header.strip())


def check_renamed() -> None:
    """Refuse a renaming whose header no table has had."""
    for header, foreign in _renamed.items():
        if header not in _met:
            raise DataError(f"--column {header}={foreign}: no table has a column '{foreign}'")


def _merged(header: str, unit: str, written: str) -> tuple[str, str]:
    """Return name and unit of a renamed column: the unit stands in the name given, or in the file, or alike in both."""
    base, own = _parted(header)
    suffix = own or parted(base)[1]
    # the name may add how an amplitude is read: mm_s_rms of a column in mm/s
    tagged = any(suffix.lower() == f"{unit}{tag}".lower() for tag in TAGS)
    # what stands in brackets may be no unit: `Masse (Probe)`
    if suffix and unit and not tagged and dimensions(unit):
        raise DataError(
            f"--column {header}={written}: found the unit '{unit}' in the file, expected '{suffix}'"
        )
    return base, own or ("" if suffix else unit)


def spellings(quantity: str, dimension: str) -> str:
    """List the names a quantity's column may have: `mass_kg, mass_g or mass_lb`."""
    # of amplitudes the first unit of everything that instruments measure
    units = (
        [next(iter(of)) for of in AMPLITUDES.values()]
        if dimension == "amplitude"
        else [*UNITS[dimension]][:4]
    )
    names = [f"{quantity}_{unit}" if unit else quantity for unit in units]
    return " or ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def find_columns(
    file: str, headings: Sequence[Heading], dimensions: Mapping[str, str], texts: Sequence[str]
) -> dict[str, tuple[int, str]]:
    """Find each quantity's column: its place in the row and its unit."""
    result: dict[str, tuple[int, str]] = {}
    lower = [each.name.lower() for each in headings]
    for name in texts:
        places = [index for index, header in enumerate(lower) if header == plain(name).lower()]
        if len(places) > 1:
            raise DataError(f"{file}: the column {name} stands twice: expected it once")
        if places:
            result[name] = (places[0], "")
    alike: dict[str, list[str]] = {}
    for name in dimensions:
        alike.setdefault(plain(name).lower(), []).append(name)
    for name, dimension in dimensions.items():
        good: list[tuple[int, str]] = []
        bad: list[tuple[int, str]] = []
        for index, each in enumerate(headings):
            suffix = each.of(name)
            if suffix is None or not _is_of(file, each, name, alike[plain(name).lower()]):
                continue
            unit = find_unit(dimension, suffix)
            (bad if unit is None else good).append((index, unit or suffix))
        if len(good) > 1:
            both = " and ".join(headings[index].written for index, _ in good)
            raise DataError(
                f"{file}: {name} is given more than once, by the columns {both}: expected one of them"
            )
        if good:
            result[name] = good[0]
        elif bad:
            # a column that another quantity claims (`z_rotation` beside `z`) is not an unknown unit
            others = [
                o
                for o in (plain(other).lower() for other in (*dimensions, *texts))
                if o.startswith(f"{plain(name)}_".lower())
            ]
            strays = [
                (i, suffix)
                for i, suffix in bad
                if not any(lower[i] == o or lower[i].startswith(o + "_") for o in others)
            ]
            if strays:
                index, suffix = strays[0]
                problem = f"the unknown unit '{suffix}'" if suffix else "no unit"
                hint = nearest_unit(suffix, dimension) if suffix else ""
                raise DataError(
                    f"{file}: the column {headings[index].written} has {problem}: "
                    f"expected {spellings(name, dimension)}{hint}"
                )
    return result


def _is_of(file: str, each: Heading, name: str, alike: Sequence[str]) -> bool:
    """Return whether a column is that of this name, of names that differ in case, or in blanks and _, alone."""
    spelt = [other for other in alike if each.written.startswith(other)]
    spelt = spelt or [other for other in alike if each.name.startswith(plain(other))]
    if len(alike) > 1 and len(spelt) != 1:
        raise DataError(
            f"{file}: column {each.written}: expected {' or '.join(alike)}, in upper and lower case as here"
        )
    return len(alike) == 1 or name in spelt


def likeness(headings: Iterable[Heading], dimensions: Mapping[str, str], texts: Sequence[str]) -> int:
    """Count the columns that a command knows, or may be meant to know: this distinguishes a header from a title."""
    names = {plain(name).lower() for name in texts}
    return sum(
        each.name.lower() in names
        or any(each.of(quantity) is not None for quantity in dimensions)
        or bool(quantity_meant(each.base, (*dimensions, *texts)))
        for each in headings
        if each.written
    )


def offers(headings: Iterable[Heading], dimensions: Mapping[str, str], texts: Sequence[str]) -> list[str]:
    """Return for columns that are not known but may be meant the option that takes them: `--column mass_g=Masse`."""
    from shlex import quote

    out = []
    for each in headings:
        base, unit = _stem(each)
        quantity, fit = _meant(base, unit, dimensions, texts)
        if not quantity and not unit:
            quantity = quantity_meant(base, dimensions)
            fit = next(iter(UNITS[dimensions[quantity]])) if quantity else ""
        if quantity:
            out.append(f"--column {quantity}{'_' * bool(fit)}{fit}={quote(each.written)}")
    return out


def translated(headings: Sequence[Heading], dimensions: Mapping[str, str], texts: Sequence[str]) -> list[str]:
    """Return the names that foreign words in headers mean; a column whose word or unit is not known keeps its own."""
    names = [each.name for each in headings]
    for place, each in enumerate(headings):
        base, unit = _stem(each)
        quantity, unit = _meant(base, unit, dimensions, texts)
        if quantity and plain_word(base) != quantity:
            names[place] = f"{quantity}{'_' * bool(unit)}{unit}"
    return names


def _stem(each: Heading) -> tuple[str, str]:
    """Return the words of a header, and the unit behind them."""
    return (each.base, each.unit) if each.unit else parted(each.base)


def _meant(base: str, unit: str, dimensions: Mapping[str, str], texts: Sequence[str]) -> tuple[str, str]:
    """Return the quantity that a word means, of those with this unit, and the unit's name: `Gewicht` in N is a weight, in g a mass."""
    units = {name: find_unit(dimension, unit) for name, dimension in dimensions.items()}
    fits: dict[str, str] = {name: of for name, of in units.items() if of is not None}
    quantity = quantity_meant(base, (*fits, *texts))
    return quantity, fits.get(quantity, "")


# -- what quantities are called in English, German, Portuguese, Spanish and French -----------------------

_WORDS = {
    "mass": "mass masse wuchtmasse massa masa gewicht",
    "weight": "weight gewichtskraft gewicht peso poids force_poids",
    "radius": "radius radii halbmesser wuchtradius raio radio rayon r",
    "diameter": "diameter durchmesser diametro diametre",
    "angle": "angle winkel winkellage drehwinkel kurbelwinkel angulo ang theta position_angulaire winkelposition",
    "turned": "turned drehwinkel gedreht umschlagwinkel verdrehung verdrehwinkel",
    "z": "z axial axial_position abstand lage posicao_axial posicion_axial position_axiale cote distance ebenenlage",
    "unbalance": "unbalance imbalance unwucht testunwucht probeunwucht setzunwucht desbalanceamento desbalanco desequilibrio balourd",
    "plane": "plane ebene ausgleichsebene plano plano_de_correcao plano_de_correccion plan plan_de_correction",
    "rotor": "rotor machine maschine laeufer maquina",
    "name": "name bezeichnung benennung nome nombre nom teil",
    "run": "run lauf messlauf messung corrida rodada medicao marcha medicion ensayo essai mesure lancement",
    "sensor": "sensor bearing probe transducer pickup lager lagerstelle aufnehmer messstelle messpunkt messebene messkanal transdutor captador sonda capteur point_de_mesure",
    "speed": "speed drehzahl velocidade rotacao velocidad velocidad_de_giro vitesse vitesse_de_rotation n rpm",
    "amplitude": "amplitude amp schwingung schwingungen schwingweg schwinggeschwindigkeit schwingbeschleunigung vibration vibracao "
    "vibracion amplitud displacement velocity acceleration valor wert",
    "phase": "phase phasenlage phasenwinkel fase fase_angular angle_de_phase",
    "date": "date datum data fecha",
    "trial_mass": "trial_mass trial_weight testmasse probemasse probegewicht testgewicht setzmasse setzgewicht ausgleichsmasse ausgleichsgewicht korrekturmasse "
    "korrekturgewicht massa_de_teste massa_de_prova "
    "massa_tentativa masa_de_prueba peso_de_prueba masse_d_essai masse_test",
    "trial_angle": "trial_angle testwinkel probewinkel setzwinkel ausgleichswinkel korrekturwinkel angulo_de_teste angulo_da_massa angulo_de_prueba angle_d_essai",
    "trial_plane": "trial_plane correction_plane testebene probeebene ausgleichsebene wuchtebene plano_de_teste plano_de_prueba plan_d_essai plane ebene plano plan",
    "part": "part teil bauteil peca pieza piece",
    "shape": "shape form koerper forma forme",
    "link": "link glied elo barra eslabon membre biela",
    "step": "step schritt passo paso pas",
    "inertia": "inertia traegheitsmoment massentraegheitsmoment inercia momento_de_inercia inertie moment_d_inertie",
    "torque": "torque moment drehmoment torque momento par couple",
    "length": "length laenge comprimento longitud longueur",
    "width": "width breite largura ancho anchura largeur",
    "height": "height hoehe altura hauteur",
    "density": "density dichte densidade densidad densite",
    "time": "time zeit tempo tiempo temps t",
}
"""Quantity -> its names, without accents; among several quantities the first that a command knows is meant."""


def words_of(*quantities: str) -> frozenset[str]:
    """Return the words that mean one of these quantities.

    >>> "testmasse" in words_of("mass", "trial_mass")
    True
    """
    return frozenset(word for quantity in quantities for word in _WORDS[quantity].split())


def plain_word(word: str) -> str:
    """Return a word in small letters, without accents, one `_` between its parts."""
    word = word.casefold().replace("ä", "ae").replace("ö", "oe").replace("ü", "ue")
    if not word.isascii():
        import unicodedata

        word = "".join(c for c in unicodedata.normalize("NFKD", word) if not unicodedata.combining(c))
    return re.sub(r"[^a-z0-9]+", "_", word).strip("_")


def quantity_meant(word: str, dimensions: Iterable[str]) -> str:
    """Return the known quantity that a foreign word may mean; nothing for one that is none.

    Examples
    --------
    >>> quantity_meant("Masse", ["mass", "radius"]), quantity_meant("ângulo", ["angle"])
    ('mass', 'angle')
    >>> quantity_meant("Bemerkung", ["mass", "radius"])
    ''
    """
    plain = plain_word(word)
    return next((quantity for quantity in dimensions if plain in _WORDS.get(quantity, "").split()), "")
