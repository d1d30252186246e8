"""A quantity of a mechanism: what it depends on, how it is written on a tape, what its outputs are called there.

Each quantity is a class: `kinematics` has those of positions and rates, `loops` those of the loops, `forces` those of loads
and joints. A new one is a new class, of which its fields are declared and its formula is a method:

>>> class Height(Quantity, kind="height"):
...     body: str
...     order: int
>>> Height("crank", 1), Height("crank", 1).body, Height("crank", 1).names
(Height('crank', 1), 'crank', ('height crank 1',))
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import lru_cache
from inspect import get_annotations
from operator import itemgetter
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, Self, dataclass_transform

import numpy as np

from dalembert.arithmetic.recorded import Recorder
from virtualwork.describe.description import Description
from virtualwork.formulas.closed_forms import Case
from virtualwork.formulas.numbers import Number, Written
from virtualwork.formulas.positions import State
from virtualwork.formulas.rates import Rates
from virtualwork.plan.steps import Group, Plan, Step

if TYPE_CHECKING:
    from dalembert.arithmetic.engines import Outputs


class Planned(Protocol):
    """What poses and recordings have in common: a mechanism and the order of its solution."""

    @property
    def mechanism(self) -> Description: ...
    @property
    def plan(self) -> Plan: ...


class Recording(Planned, Protocol):
    """What is written down, as quantities and the recorded pose need it; see `recording.Recording`."""

    @property
    def kind(self) -> Written: ...
    @property
    def recorder(self) -> Recorder: ...
    @property
    def moves(self) -> tuple[bool, ...]: ...
    @property
    def turn(self) -> Number: ...
    @property
    def st(self) -> State: ...
    @property
    def rates(self) -> list[list[Number]]: ...
    @property
    def along(self) -> Rates: ...
    @property
    def by(self) -> list[Rates]: ...
    @property
    def together(self) -> Rates | None: ...
    @property
    def cases(self) -> Mapping[str, Case]: ...
    @property
    def loops(self) -> Group | None: ...
    @property
    def forces(self) -> Any: ...
    @property
    def tables(self) -> list[Any]: ...
    def value(self, quantity: Quantity) -> Number: ...
    def enters(self, group: Group) -> bool: ...
    def rates_of(self, way: int, rates: list[list[Number]]) -> Rates: ...
    def solve(self, targets: Iterable[str], order: int) -> None: ...
    def solved(self, group: str) -> Group: ...
    def in_time(self, order: int, get: Callable[[int], Number]) -> Number: ...
    def unwrapped(self, near: str, turn: Number) -> Number: ...


new = tuple.__new__
MAKERS: tuple[Callable[..., Any], ...] = (
    lambda cls: new(cls, (cls.kind,)),
    lambda cls, a: new(cls, (cls.kind, a)),
    lambda cls, a, b: new(cls, (cls.kind, a, b)),
    lambda cls, a, b, c: new(cls, (cls.kind, a, b, c)),
    lambda cls, a, b, c, d: new(cls, (cls.kind, a, b, c, d)),
    lambda cls, a, b, c, d, e: new(cls, (cls.kind, a, b, c, d, e)),
)
"""What makes a quantity, by the number of its fields."""


@dataclass_transform(frozen_default=True)
class Quantity(tuple[Any, ...]):
    """A quantity, and at once the key under which its values are kept: a tuple of its kind and its fields."""

    kind: ClassVar[str] = ""
    """What it is called on tapes."""
    fields: ClassVar[tuple[str, ...]] = ()
    is_vector: ClassVar[bool] = False
    """Whether it is complex, of two components."""
    is_force: ClassVar[bool] = False
    """Whether the loads have a part in it; a pose that is not assembled has none of it."""
    is_joint_force: ClassVar[bool] = False
    """Whether the joints carry it."""
    dimension: ClassVar[str] = ""
    """`length` or `angle` of what is in m or rad, before it is differentiated."""

    def __init_subclass__(cls, kind: str = "") -> None:
        own = [name for name, of in get_annotations(cls).items() if "ClassVar" not in of]
        for place, name in enumerate(own, 1 + len(cls.fields)):
            setattr(cls, name, property(itemgetter(place)))
        cls.kind, cls.fields = kind, (*cls.fields, *own)
        # a function of so many fields is faster than one of any number, and refuses others
        cls.__new__ = staticmethod(MAKERS[len(cls.fields)])  # type: ignore[method-assign]

    def __new__(cls, *of: Any) -> Self:
        """Make one from its fields."""
        return tuple.__new__(cls, (cls.kind, *of))

    def __getnewargs__(self) -> tuple[Any, ...]:
        return self[1:]

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(map(repr, self[1:]))})"

    def __bool__(self) -> bool:
        """Whether it is one at all: `NOTHING` is not."""
        return bool(self.kind)

    @property
    def order(self) -> int:
        """How often it is differentiated."""
        return 0

    @property
    def is_angle(self) -> bool:
        """Whether it is an angle, rad, without its whole turns."""
        return self.dimension == "angle" and not self.order

    @property
    def names(self) -> tuple[str, ...]:
        """What its outputs are called on a tape: one, or two of a vector.

        >>> from virtualwork.formulas.forces import JointForce
        >>> JointForce("pin:B", "coupler").names
        ('force pin:B coupler x', 'force pin:B coupler y')
        """
        return _names(self)

    def of_order(self, order: int) -> Self:
        """This quantity differentiated `order` times; the order is its last field."""
        return type(self)(*self[1:-1], order)

    @property
    def family(self) -> tuple[type[Quantity], int]:
        """Quantities with one key of a request: kind and order."""
        return type(self), self.order

    @classmethod
    def every(cls, m: Description, order: int) -> Iterator[Quantity]:
        """All of this kind and order that are often requested of a mechanism's motions."""
        return iter(())

    # --- what it depends on ---------------------------------------------------------------------------------------
    def targets(self, of: Planned) -> Iterable[str]:
        """What has to be solved for it: all loops, but where a class says less."""
        return {key for group in of.plan.groups for key in of.plan.writes(group)}

    def steps(self, recording: Recording) -> tuple[tuple[Step, ...], int]:
        """The steps that it depends on, and how often they are differentiated."""
        return recording.plan.needed(self.targets(recording)), self.order

    def groups(self, recording: Recording) -> tuple[str, ...]:
        """The groups that it depends on, by name: where one of them is not assembled, it has no value.

        What cancels is not on the tape: a platform that stays level has the angle 0 there, whatever carries it.
        """
        return tuple(step.name for step in self.steps(recording)[0] if isinstance(step, Group))

    # --- its values -----------------------------------------------------------------------------------------------
    def write(self, recording: Any) -> Number:
        """Its formula on the numbers of a recording; None is zero."""
        raise NotImplementedError

    def of_rows(self, rows: Outputs, n: int, to: str | None = None) -> Any:
        """Its values in n lanes from the rows of a run, or its derivative `to` an input: (n,), real or complex.

        What does not depend on the input has no row. A row of the run's own table is not copied.
        """
        of = [name if to is None else f"d({name})/d({to})" for name in self.names]
        value = rows.complex(*of) if self.is_vector else rows.get(of[0], 0.0)
        return value if isinstance(value, np.ndarray) and value.ndim else np.full(n, value)


@lru_cache(maxsize=4096)
def _names(of: Quantity) -> tuple[str, ...]:
    text = " ".join(repr(part) if isinstance(part, complex) else str(part) for part in of)
    return (f"{text} x", f"{text} y") if of.is_vector else (text,)


NOTHING = Quantity()
"""No quantity: what has no value, or is zero throughout."""
