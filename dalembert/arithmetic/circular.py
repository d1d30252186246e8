"""Sine and cosine of large arguments next to a multiple of π/2, reduced on whole numbers: slow, and never wrong."""

from __future__ import annotations

import math
from functools import cache

BITS = 1300  # of π/2: 1024 of the largest double, 53 of its digits, and those of the result


@cache
def half_pi() -> int:
    """π/2·2^BITS, from J. Machin's π/4 = 4·arctan(1/5) − arctan(1/239)."""

    def arctangent(n: int) -> int:
        power = total = (1 << BITS + 32) // n
        k = 1
        while power:
            power //= n * n
            total += (-power if k % 2 else power) // (2 * k + 1)
            k += 1
        return total

    return (2 * (4 * arctangent(5) - arctangent(239))) >> 32


def reduced(x: float) -> tuple[int, float]:
    """(k, r) with x = k·π/2 + r and |r| ≤ π/4.

    >>> reduced(6381956970095103.0 * 2.0**797)[1]
    4.687165924254628e-19
    """
    top, bottom = x.as_integer_ratio()
    scaled = (top << BITS) // bottom
    k = (2 * scaled + half_pi()) // (2 * half_pi())
    return k, (scaled - k * half_pi()) / (1 << BITS)


def sin(x: float) -> float:
    """The sine of a finite double."""
    k, r = reduced(x)
    return (math.sin(r), math.cos(r), -math.sin(r), -math.cos(r))[k % 4]


def cos(x: float) -> float:
    """The cosine of a finite double."""
    k, r = reduced(x)
    return (math.cos(r), -math.sin(r), -math.cos(r), math.sin(r))[k % 4]
