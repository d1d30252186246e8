"""A double pendulum by its Taylor series with many digits: what `tests/virtualwork/test_in_time.py` quotes.

Two points of 1 kg on massless bars of 1 m, angles a, b from the horizontal. Lagrange's equations, c = cos(a − b),
s = sin(a − b):  2 a″ + c b″ + s b′² + 2 g cos a = 0,  c a″ + b″ − s a′² + g cos b = 0. The coefficients of every product
and quotient follow by recurrence. `python -m benchmarks.truth.double_pendulum` prints the state after 1, 2, 5 and 10 s.
"""

from __future__ import annotations

from typing import Any

from mpmath import mp, mpf

DIGITS, ORDER, STEPS = 42, 44, 40
Series = list[Any]


def state(seconds: int, a: str = "0", b: str = "-0.5", g: str = "9.81", steps: int = STEPS) -> Series:
    """Angles and their rates a number of seconds after rest, to some 35 digits; quick motions need more steps a second."""
    with mp.workdps(DIGITS):
        y = [mpf(a), mpf(b), mpf(0), mpf(0)]
        powers = [mpf(steps) ** -n for n in range(ORDER + 1)]
        for _ in range(seconds * steps):
            y = [mp.fdot(x, powers[: len(x)]) for x in _series(y, mpf(g))]
        return y


def _series(y: Series, g: Any) -> list[Series]:
    """The Taylor coefficients of the angles and their rates."""
    a, b, u, w = ([x] for x in y)
    between = [y[0] - y[1]]
    turns = {name: ([mp.cos(x[0])], [mp.sin(x[0])]) for name, x in (("a", a), ("b", b), ("between", between))}
    of = {"a": a, "b": b, "between": between}
    uu: Series = []
    ww: Series = []
    first: Series = []
    second: Series = []
    determinant: Series = []
    du: Series = []
    dw: Series = []
    for n in range(ORDER):
        for name, (cos, sin) in turns.items() if n else ():
            rate = [k * of[name][k] for k in range(1, n + 1)]
            after = -_product(rate, sin[:n]) / n, _product(rate, cos[:n]) / n
            cos.append(after[0])
            sin.append(after[1])
        cos, sin = turns["between"]
        uu.append(_product(u, u))
        ww.append(_product(w, w))
        first.append(-_product(sin, ww) - 2 * g * turns["a"][0][n])
        second.append(_product(sin, uu) - g * turns["b"][0][n])
        determinant.append((0 if n else 2) - _product(cos, cos))
        for rate, top in (
            (du, first[n] - _product(cos, second)),
            (dw, 2 * second[n] - _product(cos, first)),
        ):
            rate.append((top - mp.fdot(rate, determinant[n:0:-1])) / determinant[0])
        for x, rate in ((a, u), (b, w), (u, du), (w, dw)):
            x.append(rate[n] / (n + 1))
        between.append(a[-1] - b[-1])
    return [a, b, u, w]


def _product(x: Series, y: Series) -> Any:
    """The last coefficient of a product that both series give."""
    return mp.fdot(x, y[::-1])


if __name__ == "__main__":
    for seconds in (1, 2, 5, 10):
        print(seconds, [mp.nstr(x, 25) for x in state(seconds)])
