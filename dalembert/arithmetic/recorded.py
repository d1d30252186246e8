"""Recorded numbers: handed to a formula in place of floats, they write down the operations that it performs.

A `Real` is a sign and the number of an operation; a `Complex` is a pair of them. Python's own floats and complexes
stay what they are as long as they meet only their like. What is written down is short: equal operations are one,
signs are carried along instead of computed, and zeros and ones vanish (0·x is 0 even where x could be infinite).
All of this is exact, but for the sign of a zero: the same operations on floats give the same bits.
"""

from __future__ import annotations

import cmath
import math
import sys
from collections.abc import Mapping
from typing import Any

from dalembert.arithmetic.structures import Structures
from dalembert.arithmetic.tape import Operation, Tape, shortened

Number = Any
"""A float, a complex, a `Real` or a `Complex`."""


class Recorder:
    """Writes down what is done with its inputs.

    Examples
    --------
    The law of cosines; the sign of the cosine costs nothing, and what no output needs is not on the tape:

    >>> recorder = Recorder()
    >>> a, b, q = (recorder.input(name) for name in "abq")
    >>> waste = a / b
    >>> c = (a * a + b * b + 2 * (-a) * b * RECORDED.cos(q)).sqrt()
    >>> recorder.tape({"c": c}).cost
    9
    """

    def __init__(self) -> None:
        self.operations: list[Operation] = []
        self._known: dict[Operation, int] = {}
        self.structures = Structures(self.operations)

    def input(self, name: str) -> Real:
        """An input; the same name is the same number."""
        return Real(self, self.node("input", name))

    def node(self, *operation: Any) -> int:
        """The number of an operation (kind, arguments …), which is written down if it is new."""
        number = self._known.get(operation)
        if number is None:
            number = self._known[operation] = len(self.operations)
            self.operations.append(operation)
        return number

    def pair(self, kind: str, a: int, b: int) -> int:
        """The node of a sum or product, whose arguments may change places."""
        turn = self.structures.turns(a, b) if kind == "add" and self.structures.are_products(a, b) else a > b
        return self.node(kind, *((b, a) if turn else (a, b)))

    def difference(self, a: int, b: int) -> Real:
        """a − b; or b − a with the other sign: of two products the one or the other, else if that is recorded."""
        if self.structures.are_products(a, b):
            turn = self.structures.turns(a, b)
            return Real(self, self.node("sub", *((b, a) if turn else (a, b))), turn)
        turned = self._known.get(("sub", b, a))
        return Real(self, self.node("sub", a, b)) if turned is None else Real(self, turned, True)

    def opposite(self, number: int) -> int | None:
        """The operation with the same value but for the sign, where it is a difference or has a constant factor; None if there is none.

        >>> recorder = Recorder()
        >>> x = recorder.input("x")
        >>> recorder.opposite((x * 2.0).number), recorder.opposite((-x * 2.0).settled) == (x * 2.0).number
        (None, True)
        """
        kind, *of = self.operations[number]
        if kind == "sub":
            return self._known.get(("sub", of[1], of[0]))
        for factor, other in (of, of[::-1]) if kind == "mul" else ():
            which, *value = self.operations[factor]
            const = self._known.get(("const", -value[0])) if which == "const" else None
            if const is not None:
                return self._known.get(("mul", min(const, other), max(const, other)))
        return None

    def tape(self, outputs: Mapping[str, Number]) -> Tape:
        """The tape of named results; a plain float is a constant.

        Raises
        ------
        TypeError
            Where an output is complex: its parts are two outputs.
        """
        return shortened(self.operations, self.numbers(outputs))

    def numbers(self, outputs: Mapping[str, Number]) -> list[tuple[str, int]]:
        """The operations that have the values of named results; see `tape`."""
        nodes = []
        for name, value in outputs.items():
            if isinstance(value, (Complex, complex)):
                raise TypeError(f"output {name} is complex: record its parts")
            nodes.append((name, lifted(self, value).settled))
        return nodes


def lifted(recorder: Recorder, value: Number) -> Real:
    """A number as a recorded one; a constant by its size, so that both signs are one."""
    if isinstance(value, Real):
        return value
    value = float(value)
    return Real(recorder, recorder.node("const", abs(value)), math.copysign(1.0, value) < 0)


def _plain(value: Number) -> bool:
    # most are floats. numpy's scalars are instances of float or offer __float__ without being recorded numbers
    return (
        type(value) is float
        or isinstance(value, (int, float))
        or (not isinstance(value, (Real, Complex, complex)) and hasattr(value, "__float__"))
    )


class Real:
    """A recorded real number."""

    # numpy's scalars hand the operation on to us
    __array_ufunc__ = None
    __slots__ = ("negative", "number", "recorder")

    def __init__(self, recorder: Recorder, number: int, negative: bool = False) -> None:
        self.recorder, self.number, self.negative = recorder, number, negative

    def __repr__(self) -> str:
        return f"Real({'-' if self.negative else ''}v{self.number})"

    @property
    def settled(self) -> int:
        """The number of the operation that has the value itself, sign and all."""
        if not self.negative:
            return self.number
        # −(a − b) = b − a, and a constant factor has its sign for nothing
        kind, *of = self.recorder.operations[self.number]
        if kind == "sub":
            if self.recorder.structures.are_products(*of):  # no −0 where they are equal
                of = [self.number, self.recorder.node("const", 0.0)]
            return self.recorder.node("sub", of[1], of[0])
        if kind == "mul":
            for factor, other in (of, of[::-1]):
                which, *value = self.recorder.operations[factor]
                if which == "const":
                    return self.recorder.pair("mul", self.recorder.node("const", -value[0]), other)
        return self.recorder.node("neg", self.number)

    @property
    def real(self) -> Real:
        return self

    @property
    def imag(self) -> float:
        return 0.0

    def conjugate(self) -> Real:
        return self

    def __neg__(self) -> Real:
        return Real(self.recorder, self.number, not self.negative)

    def __pos__(self) -> Real:
        return self

    def __abs__(self) -> Real:
        kind, *of = self.recorder.operations[self.number]
        if kind in ("abs", "binade", "sqrt", "const") or (kind == "mul" and of[0] == of[1]):
            return Real(self.recorder, self.number)
        return Real(self.recorder, self.recorder.node("abs", self.number))

    def sqrt(self) -> Real:
        """The root; NaN where the number is negative. That of a square is its factor's size, with the root's own rounding."""
        kind, *of = self.recorder.operations[self.number]
        if kind == "mul" and of[0] == of[1] and not self.negative:
            return abs(Real(self.recorder, of[0]))
        return Real(self.recorder, self.recorder.node("sqrt", self.settled))

    @property
    def left(self) -> Real:
        """Of a product, what its rounding left out; it is exact."""
        kind, *of = self.recorder.operations[self.number]
        if kind != "mul":
            raise TypeError(f"{kind}: only a product leaves a rest")
        return Real(self.recorder, self.recorder.node("left", *of, self.number), self.negative)

    def sin(self) -> Real:
        return Real(self.recorder, self.recorder.node("sin", self.number), self.negative)

    def cos(self) -> Real:
        return Real(self.recorder, self.recorder.node("cos", self.number))

    def __add__(self, other: Number) -> Number:
        if type(other) is Real:
            o = other
        elif isinstance(other, (Complex, complex)):
            if isinstance(other, Constant):
                return self + other.recorded
            return Complex(self + other.real, other.imag)
        elif _plain(other) and other == 0:
            return self
        else:
            o = lifted(self.recorder, other)
        if self.negative == o.negative:
            return Real(self.recorder, self.recorder.pair("add", self.number, o.number), self.negative)
        if self.number == o.number:
            return 0.0
        first, second = (o, self) if self.negative else (self, o)
        return self.recorder.difference(first.number, second.number)

    __radd__ = __add__

    def __sub__(self, other: Number) -> Number:
        return self + -other

    def __rsub__(self, other: Number) -> Number:
        return -self + other

    def __mul__(self, other: Number) -> Number:
        if type(other) is not Real:
            if isinstance(other, (Complex, complex)):
                if isinstance(other, Constant):
                    return self * other.recorded
                return Complex(self * other.real, self * other.imag)
            if _plain(other):
                if other == 0:
                    return 0.0
                if abs(other) == 1:
                    return self if other > 0 else -self
            other = lifted(self.recorder, other)
        number = self.recorder.pair("mul", self.number, other.number)
        return Real(self.recorder, number, self.negative != other.negative)

    __rmul__ = __mul__

    def __truediv__(self, other: Number) -> Number:
        if isinstance(other, (Complex, complex)):
            if isinstance(other, Constant):
                return self / other.recorded
            return Complex(self, 0.0) / other
        # by a power of two: the product is exact too
        if _plain(other) and abs(math.frexp(other)[0]) == 0.5 and 1e-300 < abs(other) < 1e300:
            return self * (1.0 / other)
        o = lifted(self.recorder, other)
        return Real(
            self.recorder, self.recorder.node("div", self.number, o.number), self.negative != o.negative
        )

    def __rtruediv__(self, other: Number) -> Number:
        if isinstance(other, complex):
            if isinstance(other, Constant):
                return other.recorded / self
            return Complex(quotient(other.real, self), quotient(other.imag, self))
        return quotient(other, self)

    def __pow__(self, power: int) -> Number:
        """A whole power, by repeated squaring."""
        if power < 0:
            return 1.0 / self**-power
        result: Number = 1.0
        square: Number = self
        while power:
            if power & 1:
                result = square * result
            square, power = (square * square if power > 1 else square), power >> 1
        return result


def product(a: Number, b: Number) -> Number:
    """a·b, nothing where one is exactly nothing."""
    if type(a) is Real:
        return a * b
    if type(a) is float and type(b) is Real:
        return b * a
    return 0.0 if (_plain(a) and a == 0) or (_plain(b) and b == 0) else a * b


def quotient(a: Number, b: Real) -> Number:
    """a/b of a float and a recorded number."""
    if a == 0:
        return 0.0
    o = lifted(b.recorder, a)
    return Real(b.recorder, b.recorder.node("div", o.number, b.number), o.negative != b.negative)


class Complex:
    """A recorded complex number: its parts are floats or recorded."""

    __array_ufunc__ = None
    __slots__ = ("imag", "real")

    def __init__(self, real: Number, imag: Number) -> None:
        self.real, self.imag = real, imag

    def __repr__(self) -> str:
        return f"Complex({self.real!r}, {self.imag!r})"

    def conjugate(self) -> Complex:
        return Complex(self.real, -self.imag)

    def __neg__(self) -> Complex:
        return Complex(-self.real, -self.imag)

    def __add__(self, other: Number) -> Complex:
        if type(other) is not Complex:
            other = bare(other)
        return Complex(self.real + other.real, self.imag + other.imag)

    __radd__ = __add__

    def __sub__(self, other: Number) -> Complex:
        if type(other) is not Complex:
            other = bare(other)
        return Complex(self.real - other.real, self.imag - other.imag)

    def __rsub__(self, other: Number) -> Complex:
        other = bare(other)
        return Complex(other.real - self.real, other.imag - self.imag)

    def __mul__(self, other: Number) -> Complex:
        if type(other) is not Complex:
            other = bare(other)
            if isinstance(other, Real) or _plain(other):
                return Complex(product(self.real, other), product(self.imag, other))
        a, b, c, d = self.real, self.imag, other.real, other.imag
        return Complex(product(a, c) - product(b, d), product(a, d) + product(b, c))

    __rmul__ = __mul__

    def __truediv__(self, other: Number) -> Complex:
        other = bare(other)
        if not isinstance(other, Real) and _plain(other.imag) and other.imag == 0:
            other = other.real
        if isinstance(other, Real) or _plain(other):
            return Complex(
                0.0 if _plain(self.real) and self.real == 0 else self.real / other,
                0.0 if _plain(self.imag) and self.imag == 0 else self.imag / other,
            )
        turned = self * other.conjugate()
        size = squared(other)
        return Complex(turned.real / size, turned.imag / size)

    def __rtruediv__(self, other: Number) -> Complex:
        other = bare(other)
        return Complex(other.real, other.imag) / self

    def __abs__(self) -> Number:
        return RECORDED.sqrt(squared(self))


def binade(x: float) -> float:
    """The largest power of two that is no larger than |x|; 0 below the least normal number.

    >>> binade(-3.0), binade(0.5), binade(0.0)
    (2.0, 0.5, 0.0)
    """
    return 0.0 if abs(x) < sys.float_info.min else math.ulp(x) * 2.0**52


def squared(z: Number) -> Number:
    """|z|²."""
    return product(z.real, z.real) + product(z.imag, z.imag)


class Constant(complex):
    """A constant that varies: a number for decisions, and what is `recorded` of it (`varied.Varied`)."""

    recorded: Number


def bare(value: Number) -> Number:
    """What is recorded of a constant that varies; any other number as it is."""
    return value.recorded if isinstance(value, Constant) else value


class Recorded:
    """The functions of recorded numbers; of plain ones they are Python's own."""

    @staticmethod
    def const(value: float) -> float:
        return value

    @staticmethod
    def binade(x: Number) -> Number:
        return Real(x.recorder, x.recorder.node("binade", x.number)) if isinstance(x, Real) else binade(x)

    @staticmethod
    def sqrt(x: Number) -> Number:
        if isinstance(x, Real):
            return x.sqrt()
        return math.sqrt(x) if x >= 0 else math.nan

    @staticmethod
    def sin(x: Number) -> Number:
        return x.sin() if isinstance(x, Real) else math.sin(x)

    @staticmethod
    def cos(x: Number) -> Number:
        return x.cos() if isinstance(x, Real) else math.cos(x)

    @staticmethod
    def atan2(y: Number, x: Number) -> Number:
        recorder = y.recorder if isinstance(y, Real) else x.recorder if isinstance(x, Real) else None
        if recorder is None:
            return math.atan2(y, x)
        y, x = lifted(recorder, y), lifted(recorder, x)
        return Real(recorder, recorder.node("atan2", y.number, x.settled), y.negative)

    @staticmethod
    def select(test: Number, positive: Number, otherwise: Number) -> Number:
        if not isinstance(test, Real):
            return positive if test > 0 else otherwise
        recorder = test.recorder
        a, b = lifted(recorder, positive), lifted(recorder, otherwise)
        if a.number == b.number and a.negative == b.negative:
            return positive
        return Real(recorder, recorder.node("select", test.settled, a.settled, b.settled))

    @staticmethod
    def unsigned(x: Number) -> Number:
        """The number itself, its zero without a sign: what is recorded has the sign of a zero anyhow."""
        if not isinstance(x, Real):
            return x + 0.0
        return Real(x.recorder, x.recorder.pair("add", x.settled, lifted(x.recorder, 0.0).number))

    @staticmethod
    def join(real: Number, imag: Number) -> Number:
        """real + i·imag."""
        return complex(real, imag) if _plain(real) and _plain(imag) else Complex(real, imag)

    @classmethod
    def turn(cls, angle: Number) -> Number:
        """e^{i·angle}."""
        if isinstance(angle, Real):
            return Complex(cls.cos(angle), cls.sin(angle))
        return cmath.rect(1.0, angle)

    @classmethod
    def angle(cls, z: Number) -> Number:
        """The angle of a complex number, in (−π, π]."""
        return cls.atan2(z.imag, z.real)


RECORDED = Recorded()
