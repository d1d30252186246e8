"""A tape as LLVM's language: every row of a grid with every column, a vector of columns at a time, in registers.

`void tape(long rows, long columns, double **inputs, double **outputs)`: an input is one number (`u`), or one of each row
(`r`), of each column (`c`), of each lane of the grid (`b`), row by row. An output is a number of each lane (`l`), two in turn with
the next one's (`p`), or of each row a byte (`h`): whether it is positive in every column. What depends on no column is worked
out once for each row. There is at least a vector of columns; the last one ends with the last column. Lanes alone are one row.
A vector may be twice as long as the processor's: LLVM makes two of it, whose operations take turns.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import llvmlite.ir as ir

from dalembert.arithmetic.arrays import EXPONENT
from dalembert.arithmetic.engines.vectors import Vectors
from dalembert.arithmetic.sines import STEPS
from dalembert.arithmetic.tape import Tape


def lowered(tape: Tape, inputs: str, outputs: str, width: int) -> ir.Module:
    """The module of a tape; a letter says of each input and output what it is."""
    module = ir.Module("tape")
    v = Vectors(module, width)
    pointer, byte = v.double.as_pointer(), ir.IntType(8)
    kind = ir.FunctionType(ir.VoidType(), [v.long, v.long, *[pointer.as_pointer()] * 2])
    function = ir.Function(module, kind, "tape")
    rows, columns, given, results = function.args
    once, row, lane, after, end = (
        ir.IRBuilder(function.append_basic_block(name)) for name in ("once", "row", "lane", "after", "end")
    )

    def number(value: int) -> ir.Constant:
        return ir.Constant(v.long, value)

    def vector_at(b: ir.IRBuilder, base: ir.Value, at: ir.Value) -> ir.Value:
        return b.bitcast(b.gep(base, [at]), v.vector.as_pointer())

    r, i = row.phi(v.long), lane.phi(v.long)
    so_far = {k: lane.phi(v.bits) for k, what in enumerate(outputs) if what == "h"}
    begin = row.mul(r, columns)
    sources = [once.load(once.gep(given, [number(k)])) for k in range(len(inputs))]
    targets = [once.load(once.gep(results, [number(k)])) for k in range(len(outputs))]
    bases = [row.gep(at, [begin]) if what == "b" else at for what, at in zip(inputs, sources, strict=True)]
    last = once.sub(columns, number(width))

    def enter(name: str, _: list[ir.Value]) -> ir.Value:
        k = tape.inputs.index(name)
        if inputs[k] == "u":
            return _everywhere(once, v, once.load(sources[k]))
        if inputs[k] == "r":
            return _everywhere(row, v, row.load(row.gep(sources[k], [r])))
        return lane.load(vector_at(lane, bases[k], i), align=8)

    varies = tape.dependences(dict(zip(tape.inputs, map("urcb".index, inputs), strict=True)))
    values = body(tape, v, [(once, row, lane, lane)[on] for on in varies], enter)
    found = [values[place] for _, place in tape.outputs]

    now: dict[int, ir.Value] = {}
    for k, what in enumerate(outputs):
        if what == "h":
            now[k] = lane.and_(so_far[k], lane.fcmp_ordered(">", found[k], v.constant(0.0)))
        elif what == "p":
            twice = lane.add(i, i)
            base = row.gep(targets[k], [row.add(begin, begin)])
            for half, at in enumerate((twice, lane.add(twice, number(width)))):
                turn = [j // 2 + (width if j % 2 else 0) for j in range(half * width, (half + 1) * width)]
                mask = ir.Constant(ir.VectorType(ir.IntType(32), width), turn)
                both = lane.shuffle_vector(found[k], found[k + 1], mask)
                lane.store(both, vector_at(lane, base, at), align=8)
        elif outputs[k - 1 : k] != "p":
            lane.store(found[k], vector_at(lane, row.gep(targets[k], [begin]), i), align=8)

    following = lane.add(i, number(width))
    over = lane.icmp_signed(">", following, last)
    i.add_incoming(number(0), row.block)
    i.add_incoming(lane.select(over, last, following), lane.block)
    for k, phi in so_far.items():
        phi.add_incoming(ir.Constant(v.bits, [1] * width), row.block)
        phi.add_incoming(now[k], lane.block)
    lane.cbranch(lane.icmp_signed("<", i, last), i.parent, after.block)

    for k, held in now.items():
        packed = after.bitcast(held, ir.IntType(width))
        all_ = after.icmp_signed("==", packed, ir.Constant(ir.IntType(width), -1))
        place = after.gep(after.bitcast(targets[k], byte.as_pointer()), [r])
        after.store(after.zext(all_, byte), place)
    next_row = after.add(r, number(1))
    r.add_incoming(number(0), once.block)
    r.add_incoming(next_row, after.block)
    after.cbranch(after.icmp_signed("<", next_row, rows), r.parent, end.block)
    once.branch(r.parent)
    row.branch(i.parent)
    end.ret_void()
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
    tape: Tape,
    v: Vectors,
    builders: Sequence[ir.IRBuilder],
    enter: Callable[[str, list[ir.Value]], ir.Value],
) -> list[ir.Value]:
    """The values of all operations, each written by its own builder.

    `enter` gives an input by its name and the values of all operations before it.
    """
    values: list[ir.Value] = []
    circular: dict[int, tuple[ir.Value, ir.Value]] = {}

    # where sums and products are split without error each operation rounds by itself
    split = any(kind == "left" for kind, *_ in tape.operations)

    def contracted(number: int) -> tuple[ir.Value, ir.Value] | None:
        """The factors of a product: it goes into one rounding with the sum, whatever else needs it.

        So an answer has the same digits whatever is computed with it.
        """
        kind, *factors = tape.operations[number]
        return (values[factors[0]], values[factors[1]]) if kind == "mul" and not split else None

    for b, (kind, *arguments) in zip(builders, tape.operations, strict=True):
        if kind == "const":
            values.append(v.constant(arguments[0]))
            continue
        if kind == "input":
            values.append(enter(arguments[0], values))
            continue
        operands = [values[a] for a in arguments]
        if kind in ("add", "sub"):
            first, second = (contracted(a) for a in arguments)
            if second is not None:
                factor = second[0] if kind == "add" else b.fneg(second[0])
                value = v.intrinsic(b, "fmuladd", factor, second[1], operands[0])
            elif first is not None:
                added = operands[1] if kind == "add" else b.fneg(operands[1])
                value = v.intrinsic(b, "fmuladd", *first, added)
            else:
                value = b.fadd(*operands) if kind == "add" else b.fsub(*operands)
        elif kind == "mul":
            value = b.fmul(*operands)
        elif kind == "div":
            value = b.fdiv(*operands)
        elif kind == "neg":
            value = b.fneg(*operands)
        elif kind == "abs":
            value = v.intrinsic(b, "fabs", *operands)
        elif kind == "left":
            value = v.intrinsic(b, "fma", *operands[:2], b.fneg(operands[2]))
        elif kind == "place":
            value = b.and_(b.bitcast(operands[0], v.longs), v.integer(STEPS - 1))
        elif kind.startswith("entry"):
            value = v.entry(b, int(kind[-1]), operands[0])
        elif kind == "binade":
            value = b.bitcast(b.and_(b.bitcast(operands[0], v.longs), v.integer(EXPONENT)), v.vector)
        elif kind == "sqrt":
            value = v.intrinsic(b, "sqrt", *operands)
        elif kind == "select":
            value = b.select(b.fcmp_ordered(">", operands[0], v.constant(0.0)), operands[1], operands[2])
        elif kind == "atan2":
            value = v.atan2(b, *operands)
        else:
            if arguments[0] not in circular:
                circular[arguments[0]] = v.sincos(b, operands[0])
            value = circular[arguments[0]][kind == "cos"]
        values.append(value)
    return values
