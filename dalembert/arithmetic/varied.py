"""Constants of a formula that vary: decisions see a number, arithmetic writes down what is done with it."""

from __future__ import annotations

import cmath
import math
import operator
from typing import Any

from dalembert.arithmetic.recorded import RECORDED, Complex, Constant, Number, Real, bare


class Varied(Constant):
    """A constant of the mechanism that varies: decisions see a number, arithmetic writes down.

    Comparisons, `bool` and the size are those of the number it is made with; a sum or a product of it is again one, and
    with a recorded number a recorded one. It is never equal to a plain number: what is left out or taken as one where a
    constant is exactly 0 or 1 stays where that may change. `float` and the functions of `math` refuse it.

    >>> from dalembert.arithmetic.recorded import Recorder
    >>> recorder = Recorder()
    >>> length = Varied(2.0, recorder.input("length"))
    >>> half = 0.5 * length
    >>> half > 0.9, half == 1.0, recorder.tape({"half": half.recorded}).cost
    (True, False, 1)
    """

    def __new__(cls, value: complex, recorded: Number) -> Varied:
        self = super().__new__(cls, value)
        self.recorded = recorded
        return self

    def __reduce__(self) -> Any:
        raise TypeError("a recorded constant does not leave its process")

    def __repr__(self) -> str:
        return f"Varied({complex(self)!r}, {self.recorded!r})"

    @property
    def is_real(self) -> bool:
        """Whether it is a real number."""
        return isinstance(self.recorded, Real)

    # what complex itself answers, of the value or of what is recorded
    @property
    def real(self) -> Any:
        return self if self.is_real else made(complex(self).real, self.recorded.real, type(self))

    @property
    def imag(self) -> Any:
        return 0.0 if self.is_real else made(complex(self).imag, self.recorded.imag, type(self))

    def conjugate(self) -> Any:
        return made(complex(self).conjugate(), self.recorded.conjugate(), type(self))

    def is_integer(self) -> bool:
        """False: it may change."""
        return False

    def __complex__(self) -> complex:
        return complex.__pos__(self)

    def __bool__(self) -> bool:
        return True

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Varied):
            return False
        mine, its = self.recorded, other.recorded
        return all(
            type(a) is type(b)
            and (a == b if isinstance(a, float) else (a.number, a.negative) == (b.number, b.negative))
            for a, b in ((mine.real, its.real), (mine.imag, its.imag))
        )

    def __ne__(self, other: object) -> bool:
        return not self == other

    def __hash__(self) -> int:
        return complex.__hash__(self)

    def __lt__(self, other: Any) -> bool:
        return complex(self).real < complex(other).real

    def __gt__(self, other: Any) -> bool:
        return complex(self).real > complex(other).real

    def __le__(self, other: Any) -> bool:
        return complex(self).real <= complex(other).real

    def __ge__(self, other: Any) -> bool:
        return complex(self).real >= complex(other).real

    def __pos__(self) -> Any:
        return self

    def __neg__(self) -> Any:
        return made(-complex(self), -self.recorded, type(self))

    def __abs__(self) -> Any:
        return made(abs(complex(self)), abs(self.recorded), type(self))

    def __pow__(self, power: Any, modulo: Any = None) -> Any:
        return made(complex(self) ** power, self.recorded**power, type(self))


class Precise(Varied):
    """A constant that does not vary and has more digits than a float: whether it is a whole number its float says.

    >>> from dalembert.arithmetic.recorded import Recorder
    >>> ratio = Precise(-0.5, Recorder().input("ratio"))
    >>> (1 / ratio).is_integer(), ratio.is_integer()
    (True, False)
    """

    def is_integer(self) -> bool:
        """Whether its float is a whole number."""
        return complex(self).real.is_integer()


def rotation(angle: Any) -> Any:
    """e^{i·angle} of a constant, plain or varied."""
    if isinstance(angle, Varied):
        return made(cmath.rect(1.0, complex(angle).real), RECORDED.turn(angle.recorded), type(angle))
    return complex(math.cos(angle), math.sin(angle))


def direction(angle: Any) -> Any:
    """e^{i·angle}, exact at the quarter turns, so that a guide at 90° is not tilted by a rounding.

    >>> direction(math.pi / 2)
    1j
    """
    if isinstance(angle, Varied):
        return rotation(angle)
    quarter = angle / (math.pi / 2)
    if abs(quarter - round(quarter)) <= 1e-15 * max(1.0, abs(quarter)):
        return (1 + 0j, 1j, -1 + 0j, -1j)[round(quarter) % 4]
    return rotation(angle)


def made(value: complex, recorded: Number, of: type[Varied] = Varied) -> Any:
    """A varied constant of a kind, or what is recorded where that is plain."""
    return of(value, recorded) if isinstance(recorded, (Real, Complex)) else recorded


def _operator(name: str) -> Any:
    of = getattr(operator, name.strip("_").removeprefix("r"))
    turned = name.startswith("__r")

    def form(self: Varied, other: Any) -> Any:
        a, b = (other, self) if turned else (self, other)
        if isinstance(other, (Real, Complex)):
            return of(bare(a), bare(b))
        if not isinstance(other, (int, float, complex)):
            return NotImplemented
        return made(of(complex(a), complex(b)), of(bare(a), bare(b)), type(self))

    return form


for _name in ("add", "sub", "mul", "truediv"):
    for _side in ("__", "__r"):
        setattr(Varied, f"{_side}{_name}__", _operator(f"{_side}{_name}__"))


def heading(z: Any) -> Any:
    """The angle of a complex constant, plain or varied, in (−π, π]."""
    if isinstance(z, Varied):
        return made(cmath.phase(complex(z)), RECORDED.angle(z.recorded), type(z))
    return cmath.phase(z)


def root(x: Any) -> Any:
    """The square root of a real constant, plain or varied."""
    if isinstance(x, Varied):
        return made(math.sqrt(complex(x).real), RECORDED.sqrt(x.recorded), type(x))
    return math.sqrt(x)
