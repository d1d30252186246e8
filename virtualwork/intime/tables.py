"""Loads given by tables, at a state: what they are over, what they give, where they have kinks and where they end."""

from __future__ import annotations

import math
from bisect import bisect_right

from virtualwork.formulas.loads import Tabled
from virtualwork.intime.watch import Floats, Rate, Value, Watch
from virtualwork.plan.steps import Plan

# of a table's span: how far beyond its ends it is read, for a step may reach there by its rounding
EDGE = 1e-12


def place(load: Tabled, plan: Plan) -> tuple[Value, Rate] | None:
    """What a table is over and its derivative, where it is the time, or a sum of inputs or of their speeds; else None."""
    if load.axis == "time":
        return lambda t, q, v: t, lambda t, q, v, a: 1.0
    if load.axis == "input":
        return lambda t, q, v: q[0], lambda t, q, v, a: v[0]
    angle = plan.angles[load.body]
    if not angle.by_inputs:
        return None
    const, terms = angle.const, angle.inputs
    if load.axis == "angle":
        return (
            lambda t, q, v: const + sum(c * q[j] for j, c in terms),
            lambda t, q, v, a: sum(c * v[j] for j, c in terms),
        )
    return (
        lambda t, q, v: sum(c * v[j] for j, c in terms),
        lambda t, q, v, a: sum(c * a[j] for j, c in terms),
    )


def reader(load: Tabled, at: Value, *, imaginary: bool) -> Value:
    """One component of what a table gives, of what it is over; NaN outside."""
    places = [x for x, _ in load.table]
    values = [y.imag if imaginary else y.real for _, y in load.table]
    rows = zip(values[:-1], values[1:], places[:-1], places[1:], strict=True)
    slopes = [(b - a) / (y - x) for a, b, x, y in rows]
    first, span = places[0], places[-1] - places[0]

    def value(t: float, q: Floats, v: Floats) -> float:
        x = at(t, q, v)
        if load.periodic:
            x = first + (x - first) % span
        i = bisect_right(places, x) - 1
        if not 0 <= i < len(slopes):
            if not -EDGE * span <= x - first <= (1 + EDGE) * span:
                return math.nan
            i = min(max(i, 0), len(slopes) - 1)
        return values[i] + slopes[i] * (x - places[i])

    return value


def kinks(load: Tabled, plan: Plan, name: str) -> Watch | None:
    """The rows of a table, that no step may pass; None of a table over the time, or over what depends on more."""
    of = place(load, plan)
    if of is None or load.axis == "time":
        return None
    rows = [x for x, _ in load.table]
    period = rows[-1] - rows[0] if load.periodic else None
    return Watch(name, *of, rows[:-1] if period else rows, period, linear=True)


def ends(load: Tabled, plan: Plan, t: float, q: Floats, v: Floats) -> str:
    """A sentence where a table ends at a state; else empty."""
    of, (first, last) = place(load, plan), (load.table[0][0], load.table[-1][0])
    if of is None or load.periodic:
        return ""
    at, near = of[0](t, q, v), 1e-6 * (last - first)
    if first + near < at < last - near:
        return ""
    end = last if at > first + near else first
    unit = {"time": "s", "speed": "rad/s"}.get(load.axis, "rad")
    return f"the table of the {load.kind} on {load.body} ends at {end:.6g} {unit}"
