"""Arrays of numbers of 32 digits in numpy's own functions, against mpmath."""

from __future__ import annotations

from typing import Any

import mpmath as mp
import numpy as np
import pytest

from dalembert.angles import phasor
from dalembert.arithmetic.doubled_arrays import DoubledArray
from dalembert.arithmetic.shapes import floats, in_32_digits


def exact(x: DoubledArray) -> list[mp.mpf]:
    return [mp.mpf(float(h)) + mp.mpf(float(r)) for h, r in zip(x.high.flat, x.low.flat, strict=True)]


A, B = (DoubledArray(np.random.default_rng(5).normal(size=(2, 8))[k] * (3 - k)) for k in (0, 1))
EACH = {
    "sum": (lambda a, b: a + b, lambda x, y: x + y),
    "product": (lambda a, b: a * b, lambda x, y: x * y),
    "quotient": (lambda a, b: a / b, lambda x, y: x / y),
    "constant": (lambda a, _: 0.3 * a * np.pi, lambda x, _: x * 3 / 10 * mp.pi),
    "degrees": (lambda a, _: a * (np.pi / 180), lambda x, _: x * mp.pi / 180),
    "powers": (lambda a, _: a ** np.array([3.0] * 8), lambda x, _: x**3),
    "rest": (lambda a, _: np.fmod(a, 0.25), lambda x, _: mp.sign(x) * (abs(x) % mp.mpf("0.25"))),
    "power": (lambda a, _: a**4, lambda x, _: x**4),
    "root": (lambda a, _: np.sqrt(np.abs(a)), lambda x, _: mp.sqrt(abs(x))),
    "hypot": (lambda a, b: np.hypot(a, b), mp.hypot),
    "sine": (lambda a, _: np.sin(a), lambda x, _: mp.sin(x)),
    "angle": (lambda a, b: np.arctan2(a, b), mp.atan2),
    "exponential": (lambda a, _: np.exp(a), lambda x, _: mp.exp(x)),
    "logarithm": (lambda a, _: np.log(np.abs(a)), lambda x, _: mp.log(abs(x))),
    "sign": (lambda a, b: np.copysign(a, b), lambda x, y: abs(x) * mp.sign(y)),
    "least": (lambda a, b: np.minimum(a, b), min),
}


@pytest.mark.parametrize("name", EACH)
def test_thirty_digits(name: str) -> None:
    work, true = EACH[name]
    third = DoubledArray(A.high, A.high * 1e-17)
    with mp.workdps(50):
        for got, x, y in zip(exact(work(third, B)), exact(third), exact(B), strict=True):
            assert abs(got - true(x, y)) <= mp.mpf(10) ** -30 * max(1, abs(true(x, y)))


def test_vectors_and_matrices_as_numpy_has_them() -> None:
    rng = np.random.default_rng(6)
    M, v = rng.normal(size=(2, 3, 3)), rng.normal(size=3)
    wide, vector = DoubledArray(M), DoubledArray(v)
    pairs = [
        (wide @ wide, M @ M),
        (wide @ vector, M @ v),
        (vector @ wide[0], v @ M[0]),
        (v @ wide[0], v @ M[0]),
        (np.cross(wide, vector), np.cross(M, v)),
        (np.swapaxes(wide, -1, -2), np.swapaxes(M, -1, -2)),
        (np.stack([vector, v, wide[0, 0]]), np.stack([v, v, M[0, 0]])),
        (np.where(M > 0, wide, 0.0), np.where(M > 0, M, 0.0)),
        (wide.sum(axis=0), M.sum(axis=0)),
        (wide.T, M.T),
    ]
    for got, true in pairs:
        assert got.shape == true.shape
        np.testing.assert_allclose(got.value, true, rtol=1e-14, atol=1e-15)


def test_what_floats_cannot_see_decides() -> None:
    one, more = DoubledArray(1.0), DoubledArray(1.0, 1e-25)
    assert more > one
    assert not more <= one
    assert one != more
    assert np.rint(DoubledArray(2.5, 1e-20)).value == 3
    assert np.arctan2(DoubledArray(0.0), DoubledArray(-1.0)).low == 1.2246467991473532e-16
    with pytest.raises(TypeError, match="no floats"):
        np.asarray(one)
    with pytest.raises(TypeError):
        np.tan(one)


def test_entries_are_set_without_touching_another_array() -> None:
    x = DoubledArray(np.zeros(3)) + 0.0
    x[1] = DoubledArray(1.0) / 3
    x[2] += 2.0
    assert x.off([0, 1 / 3, 2]).max() < 2e-17
    assert x.low[1] == 1.850371707708594e-17


def test_running_sums_and_products() -> None:
    x = DoubledArray(A.high, A.high * 1e-17)
    with mp.workdps(50):
        total, product = mp.mpf(0), mp.mpf(1)
        for i, one in enumerate(exact(x)):
            total, product = total + one, product * one
            assert abs(exact(np.cumsum(x))[i] - total) < 1e-30
            assert abs(exact(np.cumprod(x))[i] - product) < 1e-30 * max(1, abs(product))


def test_complex_numbers() -> None:
    z = phasor(A, 100.0 * B, "deg")
    w = (1j * z + np.conj(z) * 2.0) / (z - 3.0)
    with mp.workdps(50):
        for i, (size, angle) in enumerate(zip(exact(A), exact(B), strict=True)):
            true = size * mp.expj(mp.radians(100 * angle))
            true = (1j * true + mp.conj(true) * 2) / (true - 3)
            got = mp.mpc(exact(w.real[[i]])[0], exact(w.imag[[i]])[0])
            assert abs(got - true) < 1e-29 * max(1, abs(true))
            assert abs(exact(np.abs(w))[i] - abs(true)) < 1e-29 * max(1, abs(true))
    quarter = phasor(DoubledArray([2.0]), DoubledArray([450.0]), "deg")
    assert quarter.real.value == 0
    assert quarter.imag.value == 2


def test_formulas_of_complex_arrays_run_as_on_floats() -> None:
    rng = np.random.default_rng(5)
    a, b = (rng.normal(size=(2, 3, n)) + 1j * rng.normal(size=(2, 3, n)) for n in (4, 5))
    x, left = rng.normal(size=(2, 4)) + 0j, rng.random((2, 3)) > 0.5
    weight = rng.random((2, 3))

    def formulas(a: Any, b: Any, x: Any, weight: Any) -> list[Any]:
        rows = np.concatenate([np.ones((2, 3, 1), dtype=complex), weight[..., None] * a], axis=-1)
        return [
            rows,
            np.swapaxes(a, -1, -2).conj() @ b,
            np.matvec(a, x) - 1j * weight,
            np.einsum("...ij,...ik->...jk", a, b),
            np.where(left, b[..., 0], 0.0),
            np.abs(b.sum(axis=-1) / (2.0 + a[..., 0])),
            np.linalg.norm(b, axis=-2),
            np.stack([b.real, b.imag]).sum(axis=(-2, -1)),
            np.isfinite(a) + 0.0,
        ]

    exact = formulas(*map(in_32_digits, (a, b, x, weight)))
    for own, other in zip(formulas(a, b, x, weight), exact, strict=True):
        assert np.shape(own) == np.shape(other)
        assert np.abs(floats(other) - own).max() <= 1e-14 * np.abs(own).max()


@pytest.mark.parametrize("n", [0, 1, 2, 5, 8])
def test_sums_along_any_axis(n: int) -> None:
    x = np.random.default_rng(n).normal(size=(3, n, 2))
    for axis in (-1, -2, 0, (-2, -1)):
        assert np.abs(DoubledArray(x, 1e-17 * x).sum(axis).value - x.sum(axis=axis)).max(initial=0.0) <= 1e-14
