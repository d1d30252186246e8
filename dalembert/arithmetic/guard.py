"""One thread at a time in results that work out a quantity on the first request.

While a quantity is worked out, what a result keeps is in pieces. `guarded` puts a lock around all that a class offers:
its `lock`, which parts of one whole share (poses, their loads and forces have that of their assembly), so that no two
threads wait for each other. Of what is kept already a thread waits for nobody longer than it takes to read it.

functools' own cached property holds one lock for all instances of a class (Python 3.11) or none (3.12): in a guarded
class it becomes a `Once`, under the lock of the instance.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import cached_property, wraps
from threading import RLock
from types import FunctionType
from typing import Any, Concatenate, ParamSpec, Protocol, TypeVar

Lock = AbstractContextManager[Any]
Kind = TypeVar("Kind", bound=type)
P = ParamSpec("P")
R = TypeVar("R")


class Locked(Protocol):
    """What has a lock."""

    @property
    def lock(self) -> Lock:
        """Held by the one thread that works in it."""


S = TypeVar("S", bound=Locked)


def own_lock(of: object) -> Lock:
    """The lock of an object that shares it with nobody, made on the first request; it is in no pickle of a record."""
    # one step of the interpreter: two threads get the same
    lock: Lock = vars(of).get("_lock") or vars(of).setdefault("_lock", RLock())
    return lock


def alone(method: Callable[Concatenate[S, P], R]) -> Callable[Concatenate[S, P], R]:
    """Let one thread at a time into a method.

    >>> class Counter:
    ...     lock, count = property(own_lock), 0
    ...     @alone
    ...     def up(self):
    ...         self.count = self.count + 1
    ...         return self.count
    >>> Counter().up()
    1
    """

    @wraps(method)
    def held(self: S, /, *args: P.args, **keywords: P.kwargs) -> R:
        with self.lock:
            return method(self, *args, **keywords)

    return held


def unlocked(method: Callable[P, R]) -> Callable[P, R]:
    """Let any thread into a method of a guarded class at any time: it changes nothing but what takes the lock itself."""
    method.unlocked = True  # type: ignore[attr-defined]
    return method


class Once(cached_property[Any]):
    """A property that is worked out once, by one thread, and kept."""

    def __get__(self, instance: Any, owner: Any = None) -> Any:
        if instance is None:
            return self
        name, cache = self.attrname, vars(instance)
        # what is there is whole: it is put there when it is worked out
        if name in cache:
            return cache[name]
        with instance.lock:
            if name not in cache:
                cache[name] = self.func(instance)
            return cache[name]


def guarded(kind: Kind) -> Kind:
    """Let one thread at a time into all methods and properties of a class, but `unlocked` ones and those that begin with `_`.

    The class has a property or an attribute `lock`. What it inherits is guarded where its base is.
    """
    for name, member in list(vars(kind).items()):
        if isinstance(member, cached_property):
            once = Once(member.func)
            once.__set_name__(kind, name)
            setattr(kind, name, once)
        elif name.startswith("_") or name == "lock" or hasattr(getattr(member, "fget", member), "unlocked"):
            continue
        elif isinstance(member, FunctionType):
            setattr(kind, name, alone(member))
        elif isinstance(member, property) and member.fget is not None:
            setter = None if member.fset is None else alone(member.fset)
            setattr(kind, name, property(alone(member.fget), setter))
    return kind
