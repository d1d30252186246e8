"""Sine, cosine and arctangent as LLVM code on vectors of lanes: at most two units in the last place off.

The polynomials and the reduction stand in `polynomials`. A lane that this does not serve (an argument beyond 2²⁰·π/2, or so
near to a multiple of π/2 that the reduction cancels; for the arctangent infinities, zeros, or sizes near the ends of the range)
goes through the system's own functions; and where even those cancel (large arguments next to a multiple of π/2: some lose eight
units there) through `circular`, on whole numbers. No lane's digits depend on its neighbours'.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import llvmlite.ir as ir

from dalembert.arithmetic.engines.polynomials import (
    ARCTANGENT_EVEN,
    ARCTANGENT_ODD,
    CANCELLED,
    COSINE,
    FARTHEST,
    HALF_PI,
    LARGEST,
    NEAREST,
    QUARTER,
    SINE,
    SMALLEST,
    STEEP,
    TWO_OVER_PI,
)
from dalembert.arithmetic.sines import STEPS, WHOLE, table


class Vectors:
    """Writes functions of vectors of doubles into a module.

    Parameters
    ----------
    module : ir.Module
    width : int
        Lanes of a vector.
    """

    def __init__(self, module: ir.Module, width: int) -> None:
        self.module, self.width = module, width
        self.double, self.long = ir.DoubleType(), ir.IntType(64)
        self.vector = ir.VectorType(self.double, width)
        self.longs = ir.VectorType(self.long, width)
        self.bits = ir.VectorType(ir.IntType(1), width)
        self._made: dict[str, Any] = {}

    def constant(self, value: float) -> ir.Constant:
        """One double in every lane."""
        return ir.Constant(self.vector, [value] * self.width)

    def integer(self, value: int) -> ir.Constant:
        """One whole number in every lane."""
        return ir.Constant(self.longs, [value] * self.width)

    def intrinsic(self, b: ir.IRBuilder, name: str, *arguments: ir.Value) -> ir.Value:
        """One of LLVM's own functions on vectors: `sqrt`, `fabs`, `fmuladd`, `copysign`."""
        full = f"llvm.{name}.v{self.width}f64"
        if full not in self._made:
            kind = ir.FunctionType(self.vector, [self.vector] * len(arguments))
            self._made[full] = ir.Function(self.module, kind, full)
        return b.call(self._made[full], arguments)

    def polynomial(self, b: ir.IRBuilder, z: ir.Value, coefficients: Sequence[float]) -> ir.Value:
        """c0 + c1·z + …, by Horner's rule."""
        value = self.constant(coefficients[-1])
        for c in coefficients[-2::-1]:
            value = self.intrinsic(b, "fmuladd", value, z, self.constant(c))
        return value

    def entry(self, b: ir.IRBuilder, row: int, at: ir.Value) -> ir.Value:
        """The entries of a row of the table of sines (`arithmetic.sines`) at places."""
        name = f"sines{row}"
        if name not in self._made:
            numbers = ir.ArrayType(self.double, STEPS)
            self._made[name] = ir.GlobalVariable(self.module, numbers, name)
            self._made[name].initializer = ir.Constant(numbers, table()[row].tolist())
            self._made[name].global_constant, self._made[name].linkage = True, "internal"
        value: ir.Value = ir.Constant(self.vector, ir.Undefined)
        for lane in range(self.width):
            place = ir.Constant(ir.IntType(32), lane)
            index = [ir.Constant(self.long, 0), b.extract_element(at, place)]
            value = b.insert_element(value, b.load(b.gep(self._made[name], index)), place)
        return value

    def _all(self, b: ir.IRBuilder, test: ir.Value) -> ir.Value:
        """Is a test true in all lanes?"""
        packed = b.bitcast(test, ir.IntType(self.width))
        return b.icmp_unsigned("==", packed, ir.Constant(ir.IntType(self.width), (1 << self.width) - 1))

    def sincos(self, b: ir.IRBuilder, x: ir.Value) -> tuple[ir.Value, ir.Value]:
        """(sin x, cos x)."""
        magic = self.constant(WHOLE)
        shifted = b.fadd(b.fmul(x, self.constant(TWO_OVER_PI)), magic)
        quadrant, k = b.bitcast(shifted, self.longs), b.fsub(shifted, magic)
        first, second, third = map(self.constant, HALF_PI)
        # exact with two roundings as with one: the product has no more than 53 bits
        a = self.intrinsic(b, "fmuladd", b.fneg(k), first, x)
        w = b.fmul(k, second)
        r = b.fsub(a, w)
        w = b.fsub(b.fmul(k, third), b.fsub(b.fsub(a, r), w))
        y = b.fsub(r, w)
        rest = b.fsub(b.fsub(r, y), w)
        z = b.fmul(y, y)
        sine = b.fadd(y, self.intrinsic(b, "fmuladd", b.fmul(y, z), self.polynomial(b, z, SINE), rest))
        high = b.fmul(z, self.polynomial(b, z, COSINE))
        half, one = b.fmul(self.constant(0.5), z), self.constant(1.0)
        w = b.fsub(one, half)
        cosine = b.fadd(w, b.fadd(b.fsub(b.fsub(one, w), half), b.fsub(b.fmul(z, high), b.fmul(y, rest))))
        odd = b.icmp_signed("!=", b.and_(quadrant, self.integer(1)), self.integer(0))

        def signed(value: ir.Value, quarter: ir.Value) -> ir.Value:
            turned = b.shl(b.and_(quarter, self.integer(2)), self.integer(62))
            return b.bitcast(b.xor(b.bitcast(value, self.longs), turned), self.vector)

        near = b.fcmp_ordered("<=", self.intrinsic(b, "fabs", x), self.constant(FARTHEST))
        gap = b.fmul(self.intrinsic(b, "fabs", k), self.constant(NEAREST))
        served = b.and_(near, b.fcmp_ordered(">=", self.intrinsic(b, "fabs", y), gap))
        # of a zero the sine is that zero, sign and all
        sine = b.select(b.fcmp_ordered("==", x, self.constant(0.0)), x, sine)
        fast = (
            signed(b.select(odd, cosine, sine), quadrant),
            signed(b.select(odd, sine, cosine), b.add(quadrant, self.integer(1))),
        )
        pair = self._or_else(b, served, fast, "sincos", [x], ["sin", "cos"])
        return pair[0], pair[1]

    def atan2(self, b: ir.IRBuilder, y: ir.Value, x: ir.Value) -> ir.Value:
        """The angle of x + iy."""
        up, along = self.intrinsic(b, "fabs", y), self.intrinsic(b, "fabs", x)
        steep = b.fcmp_ordered(">", up, along)
        most, least = b.select(steep, up, along), b.select(steep, along, up)
        far = b.fcmp_ordered(">", least, b.fmul(self.constant(STEEP), most))
        above, below = b.select(far, b.fsub(least, most), least), b.select(far, b.fadd(least, most), most)
        inverse = b.fdiv(self.constant(1.0), below)
        t = b.fmul(above, inverse)
        # what the quotient and the sum below it were rounded by
        rounded = b.select(far, b.fsub(least, b.fsub(below, most)), self.constant(0.0))
        left = self.intrinsic(b, "fmuladd", b.fneg(t), below, above)
        t_rest = b.fmul(self.intrinsic(b, "fmuladd", b.fneg(t), rounded, left), inverse)
        z = b.fmul(t, t)
        w = b.fmul(z, z)
        odd = b.fmul(z, self.polynomial(b, w, ARCTANGENT_ODD))
        even = b.fmul(w, self.polynomial(b, w, ARCTANGENT_EVEN))
        small = b.fmul(t, b.fadd(odd, even))
        zero = self.constant(0.0)

        def among(test: ir.Value, value: float, otherwise: ir.Value) -> ir.Value:
            return b.select(test, self.constant(value), otherwise)

        back = b.fcmp_ordered("<", x, zero)
        quarter, quarter_rest = (
            among(far, QUARTER[0], zero),
            among(far, QUARTER[1], zero),
        )
        base = among(steep, 1.5707963267948966, among(back, 3.141592653589793, zero))
        base_rest = among(steep, 6.12323399573676603587e-17, among(back, 1.22464679914735317722e-16, zero))
        sense = b.fmul(among(back, -1.0, self.constant(1.0)), among(steep, -1.0, self.constant(1.0)))
        # exact with two roundings as with one: the sense is a sign
        rest = self.intrinsic(b, "fmuladd", sense, quarter_rest, base_rest)
        rest = self.intrinsic(b, "fmuladd", sense, b.fsub(t, b.fsub(small, t_rest)), rest)
        angle = b.fadd(self.intrinsic(b, "fmuladd", sense, quarter, base), rest)
        served = b.and_(
            b.fcmp_ordered(">", most, self.constant(SMALLEST)),
            b.fcmp_ordered("<", most, self.constant(LARGEST)),
        )
        # the other coordinate may be a zero, but not NaN
        served = b.and_(served, b.fcmp_ordered("<", least, self.constant(LARGEST)))
        fast = self.intrinsic(b, "copysign", angle, y)
        return self._or_else(b, served, (fast,), "atan2", [y, x], ["atan2"])[0]

    def _or_else(
        self,
        b: ir.IRBuilder,
        served: ir.Value,
        fast: tuple[ir.Value, ...],
        name: str,
        arguments: list[ir.Value],
        functions: list[str],
    ) -> list[ir.Value]:
        """The fast values; in lanes that they do not serve, those of the system's functions."""
        good = self._all(b, served)
        before = b.block
        with b.if_then(b.not_(good), likely=False):
            slow = b.call(self._slow(name, len(arguments), functions), arguments)
            slowly = [b.select(served, value, b.extract_value(slow, i)) for i, value in enumerate(fast)]
            there = b.block
        results = []
        for value, other in zip(fast, slowly, strict=True):
            phi = b.phi(self.vector)
            phi.add_incoming(value, before)
            phi.add_incoming(other, there)
            results.append(phi)
        return results

    def _slow(self, name: str, count: int, functions: list[str]) -> ir.Function:
        """A function that goes through the lanes one by one."""
        if name not in self._made:
            result = ir.LiteralStructType([self.vector] * len(functions))
            slow = ir.Function(self.module, ir.FunctionType(result, [self.vector] * count), f"slow_{name}")
            slow.linkage = "internal"
            slow.attributes.add("noinline")
            b = ir.IRBuilder(slow.append_basic_block())
            whole: ir.Value = ir.Constant(result, ir.Undefined)
            for i, function in enumerate(functions):
                own = self._system(function, count)
                vector: ir.Value = ir.Constant(self.vector, ir.Undefined)
                for lane in range(self.width):
                    place = ir.Constant(ir.IntType(32), lane)
                    elements = [b.extract_element(argument, place) for argument in slow.args]
                    value = b.call(own, elements)
                    if name == "sincos":
                        value = self._large(b, function, elements[0], value)
                    vector = b.insert_element(vector, value, place)
                whole = b.insert_value(whole, vector, i)
            b.ret(whole)
            self._made[name] = slow
        return self._made[name]

    def _large(self, b: ir.IRBuilder, function: str, x: ir.Value, value: ir.Value) -> ir.Value:
        """A sine or cosine, worked out anew where the reduction of a large argument cancels."""

        def size(number: ir.Value) -> ir.Value:
            return b.select(
                b.fcmp_ordered("<", number, ir.Constant(self.double, 0.0)), b.fneg(number), number
            )

        cancelled = b.fcmp_ordered("<", size(value), ir.Constant(self.double, CANCELLED))
        large = b.fcmp_ordered(">", size(x), ir.Constant(self.double, FARTHEST))
        before = b.block
        with b.if_then(b.and_(cancelled, large), likely=False):
            exact = b.call(self._system(f"exact_{function}", 1), [x])
            there = b.block
        phi = b.phi(self.double)
        phi.add_incoming(value, before)
        phi.add_incoming(exact, there)
        return phi

    def _system(self, name: str, count: int) -> ir.Function:
        full = f"dalembert_{name}"
        if full not in self._made:
            self._made[full] = ir.Function(
                self.module, ir.FunctionType(self.double, [self.double] * count), full
            )
        return self._made[full]
