"""`dataclass` with the signature and the behaviour of the standard library's, for classes declared at every start.

Up to Python 3.12 the library compiles seven methods of a frozen dataclass one by one, 0.4 ms a class, and a table of a
mechanism takes a hundred of them. Here `__init__` alone is compiled; the other methods are the same functions for all
classes, and read a class's fields. Type checkers see the library's own.
"""

from __future__ import annotations

import dataclasses
import sys
from dataclasses import field as field
from dataclasses import replace as replace
from operator import attrgetter
from reprlib import recursive_repr
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass
else:

    def dataclass(kind=None, /, *, frozen=False, eq=True, repr=True):
        """Declare a class by its fields, as `dataclasses.dataclass` does.

        Raises
        ------
        dataclasses.FrozenInstanceError
            By the class: a field of a frozen one is assigned.

        Examples
        --------
        >>> @dataclass(frozen=True)
        ... class Pin:
        ...     name: str
        ...     radius: float = 0.0
        >>> Pin("A") == Pin("A", 0.0), hash(Pin("A")) == hash(Pin("A")), Pin("A").radius
        (True, True, 0.0)
        """
        if kind is None:
            return lambda kind: dataclass(kind, frozen=frozen, eq=eq, repr=repr)
        kind = dataclasses.dataclass(init=False, eq=False, repr=False)(kind)
        own = vars(kind)
        methods = {}
        if "__init__" not in own:
            methods["__init__"] = _init(kind, frozen)
        if repr:
            methods["__repr__"] = _repr
        if eq:
            methods["__eq__"], hashed = _comparison(kind)
            # a class with an `__eq__` of its own has `__hash__` None from Python
            if "__hash__" not in own or ("__eq__" in own and own["__hash__"] is None):
                kind.__hash__ = hashed if frozen else None
        if frozen:
            methods |= {"__setattr__": _refuse_set, "__delattr__": _refuse_delete}
        for name, method in methods.items():
            if name not in own:
                setattr(kind, name, method)
        return kind


def _init(kind: Any, frozen: bool) -> Any:
    """Compile the `__init__` of a class."""
    factories: dict[str, Any] = {}
    plain: list[str] = []
    by_name: list[str] = []
    body: list[str] = []
    for f in dataclasses.fields(kind):
        value, name = f.name, f"_{f.name}"
        if f.default_factory is not dataclasses.MISSING:
            factories[name] = f.default_factory
            value = f"{name}() if {f.name} is _MISSING else {f.name}" if f.init else f"{name}()"
        elif not f.init:
            # its default is that of the class
            continue
        if f.init:
            parameter = f.name
            if f.default is not dataclasses.MISSING:
                factories[name], parameter = f.default, f"{f.name}={name}"
            elif name in factories:
                parameter = f"{f.name}=_MISSING"
            (by_name if f.kw_only else plain).append(parameter)
        body.append(f"_set(self, {f.name!r}, {value})" if frozen else f"self.{f.name} = {value}")
    if hasattr(kind, "__post_init__"):
        body.append("self.__post_init__()")
    parameters = ", ".join(["self", *plain, *(["*", *by_name] if by_name else [])])
    closure = ", ".join(["_MISSING", "_set", *factories])
    lines = "\n  ".join(body or ["pass"])
    text = f"def _make({closure}):\n def __init__({parameters}):\n  {lines}\n return __init__"
    local: dict[str, Any] = {}
    exec(text, vars(sys.modules[kind.__module__]), local)
    init = local["_make"](dataclasses.MISSING, object.__setattr__, *factories.values())
    init.__qualname__ = f"{kind.__qualname__}.__init__"
    init.__annotations__ = {f.name: f.type for f in dataclasses.fields(kind) if f.init}
    init.__annotations__["return"] = None
    return init


def _comparison(kind: Any) -> tuple[Any, Any]:
    """Return `__eq__` and `__hash__` by the fields that are compared."""
    names = [f.name for f in dataclasses.fields(kind) if f.compare]
    # that of a single name returns no tuple
    values: Any = attrgetter(*names) if len(names) > 1 else lambda of: tuple([getattr(of, n) for n in names])

    def __eq__(self: Any, other: object) -> Any:
        return values(self) == values(other) if other.__class__ is self.__class__ else NotImplemented

    def __hash__(self: Any) -> int:
        return hash(values(self))

    return __eq__, __hash__


@recursive_repr()
def _repr(self: Any) -> str:
    values = (f"{f.name}={getattr(self, f.name)!r}" for f in dataclasses.fields(self) if f.repr)
    return f"{self.__class__.__qualname__}({', '.join(values)})"


def _is_field(of: Any, name: str) -> bool:
    return "__dataclass_fields__" in vars(type(of)) or name in of.__dataclass_fields__


def _refuse_set(self: Any, name: str, value: object) -> None:
    if _is_field(self, name):
        raise dataclasses.FrozenInstanceError(f"cannot assign to field {name!r}")
    object.__setattr__(self, name, value)


def _refuse_delete(self: Any, name: str) -> None:
    if _is_field(self, name):
        raise dataclasses.FrozenInstanceError(f"cannot delete field {name!r}")
    object.__delattr__(self, name)
