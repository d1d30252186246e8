"""`dalembert.dataclass` behaves as the standard library's."""

from __future__ import annotations

import copy
import dataclasses
import inspect
import math
import pickle
from dataclasses import field
from itertools import product
from typing import Any, ClassVar

import pytest

from dalembert.dataclass import dataclass as ours


def declare(dataclass: Any, **options: bool) -> tuple[type, type]:
    @dataclass(**options)
    class Base:
        """A base."""

        kind: ClassVar[str] = "base"
        a: float
        b: list[int] = field(default_factory=list)
        c: int = field(default=3, compare=False, repr=False)
        d: tuple[int, ...] = field(default=(), kw_only=True)
        e: str = field(default="", init=False)

    @dataclass(**options)
    class Child(Base):
        """A child, with a default for what its base needs."""

        a: float = 1.0
        f: int = 0

        def __post_init__(self) -> None:
            object.__setattr__(self, "e", f"{self.a}/{self.f}")

    return Base, Child


def test_like_the_standard_library() -> None:
    for frozen, eq, repr_ in product((False, True), repeat=3):
        compare(frozen, eq, repr_)


def compared(x: Any) -> tuple[Any, ...]:
    return tuple(getattr(x, f.name) for f in dataclasses.fields(x) if f.compare)


def compare(frozen: bool, eq: bool, repr_: bool) -> None:
    options = {"frozen": frozen, "eq": eq, "repr": repr_}
    for mine, theirs in zip(declare(ours, **options), declare(dataclasses.dataclass, **options), strict=True):
        assert inspect.signature(mine).parameters.keys() == inspect.signature(theirs).parameters.keys()
        for arguments in ((2.0,), (2.0, [1]), (math.nan, [], 4)):
            x, y = mine(*arguments, d=(5,)), theirs(*arguments, d=(5,))
            assert vars(x).keys() == vars(y).keys()
            assert repr(dataclasses.astuple(x)) == repr(dataclasses.astuple(y))
            assert (repr(x) == repr(y)) is repr_
            for change in ({"c": 9}, {"b": [7]}, {"d": ()}, {"a": arguments[0]}):
                same = [
                    # a NaN is the same as itself, as in tuples; to the library's own classes up to Python 3.12 only
                    one == y or (eq and compared(one) == compared(y))
                    for one in (theirs(*arguments, d=(5,)), dataclasses.replace(y, **change))
                ]
                assert [mine(*arguments, d=(5,)) == x, dataclasses.replace(x, **change) == x] == same
            assert x != y
            assert (mine.__hash__ is None) == (theirs.__hash__ is None)
            if frozen:
                for refused in (
                    lambda x=x: setattr(x, "a", 0),
                    lambda x=x: delattr(x, "a"),
                    lambda x=x: setattr(x, "new", 0),
                ):
                    with pytest.raises(dataclasses.FrozenInstanceError):
                        refused()
            else:
                x.a = 7.0
                assert x.a == 7.0
        with pytest.raises(TypeError):
            mine(1.0, wrong=2)
        assert mine().b is not mine().b if mine.__name__ == "Child" else True


@ours(frozen=True)
class Place:
    """A place."""

    name: str
    at: complex = 0j


def test_equal_ones_have_one_hash_and_are_copied_whole() -> None:
    place = Place("A", 1j)
    assert {place: 1}[Place("A", 1j)] == 1
    assert place != Place("A", 2j)
    assert hash(place) == hash(("A", 1j))
    assert pickle.loads(pickle.dumps(place)) == copy.deepcopy(place) == place
    assert repr(place) == "Place(name='A', at=1j)"


def test_an_own_method_stays() -> None:
    @ours(frozen=True)
    class Own:
        """With methods of its own."""

        a: int

        def __init__(self) -> None:
            object.__setattr__(self, "a", 4)

        def __repr__(self) -> str:
            return "own"

        def __eq__(self, other: object) -> bool:
            return True

    assert repr(Own()) == "own"
    assert Own() == 3
    assert hash(Own()) == hash((4,))
