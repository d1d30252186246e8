"""The kinds of numbers that the formulas run on: Python's, arrays over poses, recorded ones."""

from __future__ import annotations

import cmath
import math

import numpy as np

from dalembert.arithmetic.recorded import RECORDED, bare
from dalembert.arithmetic.systems import solved
from virtualwork.formulas.linear import solve_columns, solve_transposed
from virtualwork.formulas.numbers import PARALLEL, Kind, Number


class One:
    """Python numbers: a single pose."""

    def sqrt(self, x: float) -> float:
        """The root."""
        return math.sqrt(x) if x >= 0 else math.nan

    def exp(self, angle: float) -> complex:
        """e^{i·angle}."""
        return complex(math.cos(angle), math.sin(angle))

    def regular(self, inverse: float, c1: complex, c2: complex) -> float:
        """1/(c1 × c2), or NaN."""
        return inverse if abs(inverse) * (abs(c1) * abs(c2)) < 1 / PARALLEL else math.nan

    def inverse(self, length: float, least: float) -> float:
        """1/length, or NaN."""
        return 1 / length if length > least else math.nan

    join, angle = complex, staticmethod(cmath.phase)
    solve, transposed = staticmethod(solve_columns), staticmethod(solve_transposed)


class Many:
    """Arrays over poses; what is the same in all of them may be a Python number."""

    sqrt, angle = staticmethod(np.sqrt), staticmethod(np.angle)
    solve, transposed = staticmethod(solve_columns), staticmethod(solve_transposed)

    def exp(self, angle: Number) -> Number:
        """e^{i·angle}."""
        if not np.ndim(angle):
            return ONE.exp(angle)
        z = np.empty(np.shape(angle), complex)
        np.cos(angle, out=z.real)
        np.sin(angle, out=z.imag)
        return z

    def join(self, re: Number, im: Number) -> Number:
        """re + i·im."""
        z = np.empty(np.broadcast_shapes(np.shape(re), np.shape(im)), complex)
        z.real = re
        z.imag = im
        return z

    def regular(self, inverse: Number, c1: Number, c2: Number) -> Number:
        """1/(c1 × c2), or NaN."""
        # the norms over the block are above the largest entry: in most blocks they say that no pose is near
        bound = np.vdot(inverse, inverse).real * np.vdot(c1, c1).real * np.vdot(c2, c2).real
        if bound < 1 / PARALLEL**2:
            return inverse
        return np.where(np.abs(inverse) * (np.abs(c1) * np.abs(c2)) < 1 / PARALLEL, inverse, np.nan)

    def inverse(self, length: Number, least: float) -> Number:
        """1/length, or NaN."""
        return 1 / np.where(length > least, length, np.nan)


class Folded:
    """A kind for two assemblies that meet in every pose: the root is zero, and its noise is left out."""

    def __init__(self, kind: Kind) -> None:
        self.exp, self.join, self.regular = kind.exp, kind.join, kind.regular
        self.angle, self.inverse = kind.angle, kind.inverse
        self.solve, self.transposed = kind.solve, kind.transposed

    def sqrt(self, x: Number) -> Number:
        """Zero."""
        return 0.0 * x


def real_part(z: Number) -> Number:
    """The real part of any number."""
    return bare(z).real


def imaginary_part(z: Number) -> Number:
    """The imaginary part."""
    return bare(z).imag


PARTS = real_part, imaginary_part


class Written:
    """Recorded numbers, and constants of the mechanism that vary: what is done with them is written down."""

    def sqrt(self, x: Number) -> Number:
        """The root."""
        return RECORDED.sqrt(bare(x))

    def exp(self, angle: Number) -> Number:
        """e^{i·angle}."""
        return RECORDED.turn(bare(angle))

    def join(self, re: Number, im: Number) -> Number:
        """re + i·im."""
        return RECORDED.join(bare(re), bare(im))

    def angle(self, z: Number) -> Number:
        """The angle."""
        return RECORDED.angle(bare(z))

    def regular(self, inverse: Number, c1: Number, c2: Number) -> Number:
        """1/(c1 × c2), or NaN."""
        size = (c1.conjugate() * c1).real * (c2.conjugate() * c2).real * (inverse * inverse)
        return RECORDED.select(1 / PARALLEL**2 - bare(size), bare(inverse), math.nan)

    def inverse(self, length: Number, least: Number) -> Number:
        """1/length, or NaN."""
        length = bare(length)
        return 1 / RECORDED.select(length - bare(least), length, math.nan)

    def solve(self, cols: list[list[Number]], right: list[Number]) -> list[Number]:
        """Solve Σ column·x + right = 0."""
        rows = [[part(c) for c in row] for row in cols for part in PARTS]
        return solved(rows, [-part(w) for w in right for part in PARTS])

    def transposed(self, cols: list[list[Number]], loads: list[Number]) -> list[Number]:
        """Solve Σ_c λ_c·column_c + load = 0."""
        rows = [[part(row[j]) for row in cols for part in PARTS] for j in range(len(loads))]
        x = solved(rows, [0.0 if load is None else -bare(load) for load in loads], least=PARALLEL)
        return [self.join(x[2 * c], x[2 * c + 1]) for c in range(len(cols))]


ONE, MANY, WRITTEN = One(), Many(), Written()
