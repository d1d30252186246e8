"""The keys of a part: a dataclass declares each beside the field that it fills, once.

The reader, the JSON Schema, the paths of dimensions, the checks and the TOML text walk these declarations.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, field, fields, replace
from typing import Any, ClassVar

from dalembert.dataclass import dataclass
from dalembert.hints import nearest
from virtualwork.describe import DescriptionError
from virtualwork.describe.file import Entry, missing, require_keys
from virtualwork.describe.forms import Form, Free, Names, Nested
from virtualwork.describe.units import wrong


@dataclass(frozen=True)
class Key:
    """A key of a table.

    Attributes
    ----------
    form : Form
        The form of its value.
    meaning : str
    name : str
        In the file; empty: that of the field.
    needed : bool
        Whether it must be there.
    default : object
        The value of the field where the key is missing; None: none. A function finds it from the entry.
    beside : str
        The key that must stand in the same table.
    unless : str
        The field that may stand in its place; exactly one of the two is expected.
    table : str
        The only table of the part that has it; empty: all of them.
    field : str
        The field of the dataclass.
    """

    form: Form
    meaning: str
    name: str = ""
    needed: bool = False
    default: Any = None
    beside: str = ""
    unless: str = ""
    table: str = ""
    field: str = ""

    @property
    def shown(self) -> Any:
        """The default as a file would have it in SI; None where there is none."""
        plain = self.default is not None and not callable(self.default) and not (self.needed or self.unless)
        return self.form.text(self.default) if plain else None

    def applies(self, part: Any) -> bool:
        """Whether a part has this key: one of its table, not replaced by another, beside the key that it needs."""
        return (
            (not self.table or self.table == part.table)
            and (not self.beside or getattr(part, self.beside) is not None)
            and (not self.unless or getattr(part, self.unless) is None)
        )


Keys = Mapping[str, Key]


def declared(
    form: Form,
    meaning: str,
    *,
    default: Any = MISSING,
    needed: bool | None = None,
    absent: Any = None,
    also: tuple[Key, ...] = (),
    **more: str,
) -> Any:
    """A field of a part with its key.

    Parameters
    ----------
    form, meaning
        Those of the key.
    default : object
        The default of the field in Python, and of the key in the file unless `absent` says another.
    needed : bool, optional
        Whether the file must have the key. Default: where the field has no default.
    absent : object, optional
        The value where the file has no such key, or a function that finds it from the entry.
    also : tuple of Key
        Further keys that fill the same field.
    more : str
        `name`, `beside`, `unless`, `table` of the key.
    """
    bare = default is MISSING
    key = Key(
        form,
        meaning,
        needed=(bare and absent is None) if needed is None else needed,
        default=absent if absent is not None or bare else default,
        **more,
    )
    return field(default=default, metadata={"keys": (key, *also)})


# the keys of each class, read from its fields once
_KEYS: dict[type, tuple[Key, ...]] = {}
# the fields of each class whose values from Python are converted, with their defaults
_CONVERTED: dict[type, list[tuple[str, Any, Any]]] = {}
# those whose values a mechanism may refuse
_CHECKED: dict[type, list[Key]] = {}


def keys_of(kind: type) -> tuple[Key, ...]:
    """The keys that a dataclass declares, in the order of its fields.

    >>> from virtualwork.describe.parts import Friction
    >>> [key.name for key in keys_of(Friction)]
    ['joint', 'coefficient', 'radius']
    """
    if kind not in _KEYS:
        _KEYS[kind] = tuple(
            replace(key, field=f.name, name=key.name or f.name)
            for f in fields(kind)
            for key in f.metadata.get("keys", ())
        )
    return _KEYS[kind]


def table_keys(kind: type, table: str = "") -> Keys:
    """The keys of one table of a part, by their names."""
    return {key.name: key for key in keys_of(kind) if key.table in ("", table)}


def convert(part: Any) -> None:
    """Convert the values of a frozen part that come from Python: real numbers to floats, pairs to x + iy.

    Raises
    ------
    DescriptionError
        A value that is no number, or not finite; None in a field that has no such default.
    """
    kind = type(part)
    if kind not in _CONVERTED:
        forms = {key.field: key.form for key in reversed(keys_of(kind)) if key.form.converts}
        _CONVERTED[kind] = [
            (f.name, f.default, forms[f.name].converted) for f in fields(kind) if f.name in forms
        ]
    for name, default, converted in _CONVERTED[kind]:
        value = getattr(part, name)
        if value is not default:
            object.__setattr__(part, name, converted(value, f"{kind.__name__} {name}"))


class Part:
    """Base of the parts that stand in the lists of a description.

    A part declares the tables of the file in which it may stand, the list of `Description` that holds it, and its fields.
    """

    tables: ClassVar[tuple[str, ...]]
    collection: ClassVar[str]

    def __post_init__(self) -> None:
        convert(self)

    @property
    def table(self) -> str:
        """The table of the file in which it stands."""
        return self.tables[0]

    @property
    def slides(self) -> bool:
        """Whether its quantities are those of a slide."""
        return False

    @property
    def label(self) -> str:
        """The name that a message adds to its place in the file."""
        return ""

    def check(self, where: str) -> None:
        """Refuse a part that contradicts itself.

        Raises
        ------
        DescriptionError
        """


def place_of(table: str, number: int, count: int) -> str:
    """The place of an entry as a message names it: `[[springs]] 2`; a single input is `[input]`."""
    return f"[{table}]" if table == "input" and count == 1 else f"[[{table}]] {number}"


def check(part: Any, where: str, names: Names) -> None:
    """Refuse names that the mechanism does not have, numbers beyond their bounds, and parts that contradict themselves.

    Raises
    ------
    DescriptionError
    """
    if isinstance(part, Part):
        part.check(where)
    kind = type(part)
    if kind not in _CHECKED:
        _CHECKED[kind] = [key for key in keys_of(kind) if key.form.restricts]
    for key in _CHECKED[kind]:
        value = getattr(part, key.field)
        if value is not None:
            key.form.check(value, f"{where} {key.name}", part, names)


def read_fields(entry: Entry, keys: Keys) -> dict[str, Any]:
    """The fields of a part, read from its table.

    Raises
    ------
    DescriptionError
        An unknown key, a missing one, two of which one is expected, or a value of another form.
    """
    where, table = entry.where, entry.keys
    for name, value in table.items() if isinstance(table, Mapping) and "points" in keys else ():
        if name not in keys and isinstance(value, (list, Mapping)) and not nearest(name, keys):
            raise DescriptionError(
                f"{where}: unknown key '{name}': expected points = {{ {name} = [x, y], … }}"
            )
    require_keys(table, keys, where, "key")
    for name, key in keys.items():
        if key.needed and name not in table:
            raise missing(where, name)
        if name in table and key.beside and key.beside not in table:
            raise DescriptionError(f"{where}: '{name}' needs '{key.beside}', which is missing")
        for other in (each.name for each in keys.values() if each.field == key.unless):
            if (name in table) == (other in table):
                either = "both" if name in table else "none"
                raise DescriptionError(f"{where}: found {either} of {name} and {other}, expected one of them")
    for name, key in keys.items():
        if isinstance(key.form, Free):
            # the reader itself takes it
            continue
        if name in table and isinstance(key.form, Nested):
            entry.fields[key.field] = _rows(entry, key.form, table[name], f"{where} {name}")
        elif name in table:
            entry.fields.update(key.form.fields(key.field, table[name], f"{where} {name}", entry))
        elif callable(key.default):
            entry.fields[key.field] = key.default(entry)
        elif key.default is not None and key.field not in entry.fields:
            entry.fields[key.field] = key.default
    return entry.fields


def _rows(entry: Entry, form: Nested, value: Any, where: str) -> tuple[Any, ...]:
    """The tables of a list, each read by the keys of its class."""
    if not isinstance(value, list) or not all(isinstance(row, dict) for row in value):
        raise wrong(where, value, "a list of tables")
    keys = table_keys(form.of)
    return tuple(
        form.of(**read_fields(Entry(entry.file, f"{where} {i}", row, above=entry), keys))
        for i, row in enumerate(value, 1)
    )
