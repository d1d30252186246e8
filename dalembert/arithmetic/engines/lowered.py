"""A tape as LLVM's language: one loop over vectors of lanes, every value in a register.

`void tape(long n, double **inputs, double *outputs, long stride)`: inputs are columns of n doubles, or single ones where
uniform; output k begins at outputs + k·stride, and one of `pairs` has the next in turn with its own. n is at least one
vector; the last vector ends with the last lane.
"""

from __future__ import annotations

from collections.abc import Callable

import llvmlite.ir as ir

from dalembert.arithmetic.engines.vectors import Vectors
from dalembert.arithmetic.tape import Tape


def lowered(tape: Tape, uniform: frozenset[str], pairs: frozenset[int], width: int) -> ir.Module:
    """The module of a tape."""
    module = ir.Module("tape")
    v = Vectors(module, width)
    pointer = v.double.as_pointer()
    kind = ir.FunctionType(ir.VoidType(), [v.long, pointer.as_pointer(), pointer, v.long])
    function = ir.Function(module, kind, "tape")
    n, inputs, outputs, stride = function.args
    outputs.add_attribute("noalias")

    entry, loop, end = (function.append_basic_block(name) for name in ("entry", "loop", "end"))
    b = ir.IRBuilder(entry)
    columns = [b.load(b.gep(inputs, [ir.Constant(v.long, k)])) for k in range(len(tape.inputs))]
    rows = [b.gep(outputs, [b.mul(stride, ir.Constant(v.long, k))]) for k in range(len(tape.outputs))]
    once: dict[str, ir.Value] = {}
    for name, column in zip(tape.inputs, columns, strict=True):
        if name in uniform:
            once[name] = _everywhere(b, v, b.load(column))
    last = b.sub(n, ir.Constant(v.long, width))
    b.branch(loop)

    b.position_at_end(loop)
    i = b.phi(v.long)
    i.add_incoming(ir.Constant(v.long, 0), entry)
    place = dict(zip(tape.inputs, columns, strict=True))

    def enter(name: str, _: list[ir.Value]) -> ir.Value:
        if name in once:
            return once[name]
        return b.load(b.bitcast(b.gep(place[name], [i]), v.vector.as_pointer()), align=8)

    values = body(tape, v, b, enter)
    found = [values[number] for _, number in tape.outputs]

    def store(value: ir.Value, row: ir.Value, at: ir.Value) -> None:
        b.store(value, b.bitcast(b.gep(row, [at]), v.vector.as_pointer()), align=8)

    for k, row in enumerate(rows):
        if k in pairs:
            twice = b.add(i, i)
            for half, at in enumerate((twice, b.add(twice, ir.Constant(v.long, width)))):
                turn = [j // 2 + (width if j % 2 else 0) for j in range(half * width, (half + 1) * width)]
                mask = ir.Constant(ir.VectorType(ir.IntType(32), width), turn)
                store(b.shuffle_vector(found[k], found[k + 1], mask), row, at)
        elif k - 1 not in pairs:
            store(found[k], row, i)
    following = b.add(i, ir.Constant(v.long, width))
    over = b.icmp_signed(">", following, last)
    clipped = b.select(over, last, following)
    i.add_incoming(clipped, b.block)
    b.cbranch(b.icmp_signed("<", i, last), loop, end)

    b.position_at_end(end)
    b.ret_void()
    return module


def _everywhere(b: ir.IRBuilder, v: Vectors, value: ir.Value) -> ir.Value:
    first = ir.Constant(ir.IntType(32), 0)
    single = b.insert_element(ir.Constant(v.vector, ir.Undefined), value, first)
    return b.shuffle_vector(
        single,
        ir.Constant(v.vector, ir.Undefined),
        ir.Constant(ir.VectorType(ir.IntType(32), v.width), [0] * v.width),
    )


def body(
    tape: Tape, v: Vectors, b: ir.IRBuilder, enter: Callable[[str, list[ir.Value]], ir.Value]
) -> list[ir.Value]:
    """The values of all operations; `enter` gives an input by its name and the values of all operations before it."""
    uses = [0] * len(tape.operations)
    for kind, *arguments in tape.operations:
        if kind not in ("const", "input"):
            for a in arguments:
                uses[a] += 1
    for _, number in tape.outputs:
        uses[number] += 2
    values: list[ir.Value] = []
    circular: dict[int, tuple[ir.Value, ir.Value]] = {}

    def contracted(number: int) -> tuple[ir.Value, ir.Value] | None:
        """The factors of a product that is wanted here alone: it goes into one rounding with the sum."""
        kind, *factors = tape.operations[number]
        return (values[factors[0]], values[factors[1]]) if kind == "mul" and uses[number] == 1 else None

    for kind, *arguments in tape.operations:
        if kind == "const":
            values.append(v.constant(arguments[0]))
            continue
        if kind == "input":
            values.append(enter(arguments[0], values))
            continue
        given = [values[a] for a in arguments]
        if kind in ("add", "sub"):
            first, second = (contracted(a) for a in arguments)
            if second is not None:
                factor = second[0] if kind == "add" else b.fneg(second[0])
                value = v.intrinsic(b, "fmuladd", factor, second[1], given[0])
            elif first is not None:
                added = given[1] if kind == "add" else b.fneg(given[1])
                value = v.intrinsic(b, "fmuladd", *first, added)
            else:
                value = b.fadd(*given) if kind == "add" else b.fsub(*given)
        elif kind == "mul":
            value = b.fmul(*given)
        elif kind == "div":
            value = b.fdiv(*given)
        elif kind == "neg":
            value = b.fneg(*given)
        elif kind == "abs":
            value = v.intrinsic(b, "fabs", *given)
        elif kind == "sqrt":
            value = v.intrinsic(b, "sqrt", *given)
        elif kind == "select":
            value = b.select(b.fcmp_ordered(">", given[0], v.constant(0.0)), given[1], given[2])
        elif kind == "atan2":
            value = v.atan2(b, *given)
        else:
            if arguments[0] not in circular:
                circular[arguments[0]] = v.sincos(b, given[0])
            value = circular[arguments[0]][kind == "cos"]
        values.append(value)
    return values
