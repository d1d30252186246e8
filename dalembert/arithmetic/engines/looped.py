"""A loop as LLVM's language: the state of a vector of lanes stays in registers from round to round.

`void rounds(long groups, double *given, double *state, double *fed, double *nodes, long *counts, long capacity)`: groups
of as many lanes as a vector has, each with its own rows of `given` and `state`, one vector a row; `fed` has the rows of
each of its `capacity` rounds, of what is kept `nodes` has room for as many, and `counts` says how many were done. The tape that is called stands once, as
a function of its own.
"""

from __future__ import annotations

import llvmlite.ir as ir

from dalembert.arithmetic.engines.lowered import body
from dalembert.arithmetic.engines.vectors import Vectors
from dalembert.arithmetic.loop import Loop, called


def looped(loop: Loop, width: int) -> ir.Module:
    """The module of a loop."""
    module = ir.Module("loop")
    v = Vectors(module, width)
    inner = _inner(loop, v)
    pointer = v.double.as_pointer()
    kind = ir.FunctionType(ir.VoidType(), [v.long, *[pointer] * 4, v.long.as_pointer(), v.long])
    function = ir.Function(module, kind, "rounds")
    groups, inputs, state, fed, nodes, counts, capacity = function.args

    def number(value: int) -> ir.Constant:
        return ir.Constant(v.long, value)

    entry, group, again, last, end = (
        function.append_basic_block(name) for name in ("entry", "group", "again", "last", "end")
    )
    b = ir.IRBuilder(entry)
    b.cbranch(b.icmp_signed(">", groups, number(0)), group, end)

    def place(base: ir.Value, first: ir.Value, row: int) -> ir.Value:
        """Of a vector, `row` of the rows that begin at vector number `first`."""
        offset = b.mul(b.add(first, number(row)), number(width))
        return b.bitcast(b.gep(base, [offset]), v.vector.as_pointer())

    b.position_at_end(group)
    g = b.phi(v.long)
    g.add_incoming(number(0), entry)
    own = b.mul(g, number(len(loop.constants)))
    constants = {name: b.load(place(inputs, own, i), align=8) for i, name in enumerate(loop.constants)}
    mine = b.mul(g, number(len(loop.states)))
    begin = [b.load(place(state, mine, i), align=8) for i in range(len(loop.states))]
    b.branch(again)

    b.position_at_end(again)
    i = b.phi(v.long)
    i.add_incoming(number(0), group)
    now = [b.phi(v.vector) for _ in loop.states]
    for phi, value in zip(now, begin, strict=True):
        phi.add_incoming(value, group)
    turn = b.add(b.mul(g, capacity), i)
    food = b.mul(turn, number(len(loop.fed)))
    own_round = {name: b.load(place(fed, food, k), align=8) for k, name in enumerate(loop.fed)}
    values = _round(loop, v, b, inner, constants | own_round | dict(zip(loop.states, now, strict=True)))
    places = dict(loop.body.outputs)
    following = {name: values[places[name]] for name in loop.states}
    row = b.mul(turn, number(len(loop.kept)))
    for k, name in enumerate(loop.kept):
        b.store(following[name], place(nodes, row, k), align=8)
    done = b.add(i, number(1))
    going = b.fcmp_ordered(">", following["left"], v.constant(0.0))
    some = b.icmp_unsigned("!=", b.bitcast(going, ir.IntType(width)), ir.Constant(ir.IntType(width), 0))
    i.add_incoming(done, b.block)
    for phi, name in zip(now, loop.states, strict=True):
        phi.add_incoming(following[name], b.block)
    b.cbranch(b.and_(some, b.icmp_signed("<", done, capacity)), again, last)

    b.position_at_end(last)
    for k, name in enumerate(loop.states):
        b.store(following[name], place(state, mine, k), align=8)
    b.store(done, b.gep(counts, [g]))
    next_group = b.add(g, number(1))
    g.add_incoming(next_group, b.block)
    b.cbranch(b.icmp_signed("<", next_group, groups), group, end)

    b.position_at_end(end)
    b.ret_void()
    return module


def _inner(loop: Loop, v: Vectors) -> ir.Function:
    """The tape that is called, as a function of vectors."""
    tape = loop.inner
    result = ir.LiteralStructType([v.vector] * len(tape.outputs))
    function = ir.Function(v.module, ir.FunctionType(result, [v.vector] * len(tape.inputs)), "inner")
    function.linkage = "internal"
    function.attributes.add("noinline")
    b = ir.IRBuilder(function.append_basic_block())
    inputs = dict(zip(tape.inputs, function.args, strict=True))
    values = body(tape, v, [b] * len(tape.operations), lambda name, _: inputs[name])
    whole: ir.Value = ir.Constant(result, ir.Undefined)
    for i, (_, number) in enumerate(tape.outputs):
        whole = b.insert_value(whole, values[number], i)
    b.ret(whole)
    return function


def _round(
    loop: Loop, v: Vectors, b: ir.IRBuilder, inner: ir.Function, inputs: dict[str, ir.Value]
) -> list[ir.Value]:
    """The values of all operations of the body."""
    places = dict(loop.body.outputs)
    results: dict[int, ir.Value] = {}

    def enter(name: str, values: list[ir.Value]) -> ir.Value:
        of = called(name)
        if of is None:
            return inputs[name]
        number, what = of
        if number not in results:
            arguments = [
                values[places[f"call {number} {x}"]] if x in loop.passed else inputs[x]
                for x in loop.inner.inputs
            ]
            results[number] = b.call(inner, arguments)
        return b.extract_value(results[number], loop.inner.rows[what])

    return body(loop.body, v, [b] * len(loop.body.operations), enter)
