"""The elliptic functions against mpmath, down to complementary parameters that 1 - m has lost."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

from rigidbody3d.elliptic import argument, jacobi, parameter, third, third_complete

mp.mp.dps = 40
COMPLEMENTS = [1.0, 0.999999, 0.5, 1e-3, 1e-8, 1e-14, 1e-30, 1e-100]


@pytest.mark.parametrize("m1", COMPLEMENTS)
def test_quarter_period(m1: float) -> None:
    p = parameter(np.array(1 - m1), np.array(m1))
    with mp.workdps(150):
        assert float(abs(mp.ellipk(1 - mp.mpf(m1)) / mp.mpf(float(p.quarter)) - 1)) < 4e-16


@pytest.mark.parametrize("m1", COMPLEMENTS[:6])
def test_functions_to_full_relative_precision(m1: float) -> None:
    p = parameter(np.array(1 - m1), np.array(m1))
    u = np.linspace(-0.98, 0.98, 15) * float(p.quarter)
    at = jacobi(u, p)
    m = 1 - mp.mpf(m1)
    for name, found in (("sn", at.sn), ("cn", at.cn), ("dn", at.dn)):
        wanted = [mp.ellipfun(name, mp.mpf(float(x)), m=m) for x in u]
        # an argument is known to ε u, and near K cn falls to zero as K - u
        scale = 1e-15 * (1 + np.abs(u)) * 5 / (1 - np.abs(u) / float(p.quarter) if name == "cn" else 1)
        error = np.array(
            [abs(float(mp.mpf(float(a)) / b - 1)) if b else 0.0 for a, b in zip(found, wanted, strict=True)]
        )
        assert (error < scale).all(), (name, error)


@pytest.mark.parametrize("m1", [1.0, 0.5, 1e-6, 1e-14, 0.0])
def test_argument_inverts_the_functions(m1: float) -> None:
    p = parameter(np.array(1 - m1), np.array(m1))
    reach = 1.9 * float(p.quarter) if m1 else 15.0
    u = np.linspace(-reach, reach, 31)
    at = jacobi(u, p)
    sign = np.where(at.turns % 2 != 0, -1.0, 1.0)
    np.testing.assert_allclose(
        argument(sign * at.sn, sign * at.cn, p), u, rtol=0, atol=2e-15 * (1 + reach) if m1 else 1e-2
    )


@pytest.mark.parametrize("m1", [0.7, 1e-5, 1e-14])
@pytest.mark.parametrize("n", [0.0, 1e-9, 0.4, 50.0, 1e12])
def test_third_integral_against_quadrature(m1: float, n: float) -> None:
    p = parameter(np.array(1 - m1), np.array(m1))
    m = 1 - mp.mpf(m1)
    u = 0.83 * float(p.quarter)
    # ∫ sn²/(1 + n sn²) du = (F - Π(-n))/n, or in the amplitude
    phi = mp.asin(mp.ellipfun("sn", mp.mpf(u), m=m))
    wanted = (mp.mpf(u) - mp.ellippi(-mp.mpf(n), phi, m)) / n if n else (mp.mpf(u) - mp.ellipe(phi, m)) / m
    found = third(jacobi(np.array(u), p), p, np.array(n))
    assert float(abs(mp.mpf(float(found)) / wanted - 1)) < 5e-15 * (1 + u)
    whole = third_complete(p, np.array(n))
    K = mp.ellipk(m)
    wanted = (K - mp.ellippi(-mp.mpf(n), m)) / n if n else (K - mp.ellipe(m)) / m
    assert float(abs(mp.mpf(float(whole)) / wanted - 1)) < 5e-15


def test_on_the_separatrix_itself_the_functions_are_hyperbolic() -> None:
    p = parameter(np.array(1.0), np.array(0.0))
    u = np.array([-800.0, -2.0, 0.0, 0.3, 40.0])
    at = jacobi(u, p)
    np.testing.assert_allclose(at.sn, np.tanh(u), rtol=1e-15)
    assert (at.dn == at.cn).all()
    np.testing.assert_allclose(third(at, p, np.array(0.0)), u - np.tanh(u), rtol=1e-12, atol=1e-16)
