"""Variants of mechanisms whose loops are closed by iteration: begun from the nominal one's way, they stand as alone."""

from __future__ import annotations

import numpy as np
import pytest

from virtualwork.branch.continuation import Continuation
from virtualwork.describe import MechanismError
from virtualwork.describe.dimensions import dimensions, value

Q = np.linspace(-1.0, 7.0, 13)


def drawn(m, rng, v, spread):
    """Numbers for every coordinate of the links' points."""
    paths = [p for p, d in dimensions(m).items() if d.kind == "length" and p.startswith("links")]
    return {p: float(value(m, p).real) + spread * rng.normal(size=v) for p in paths}


def compared(m, numbers, q):
    """Hold every variant against what it does alone, which no other has led; how many pairs of poses were assembled."""
    family = m.vary(numbers)
    motion = family.motion(q, 1.5, -0.7)
    places = {name: motion.point(name) for name in m.points}
    rates = {name: motion.link(name) for name in m.links}
    assembled = 0
    for i in range(len(family)):
        try:
            alone = family[i].motion(q, 1.5, -0.7)
            there = alone.assembled
        except MechanismError as refused:
            reason = str(refused)
        else:
            reason = None
        if reason is not None:
            assert motion.reason(i) == reason
            assert not motion.assembled[i].any()
            continue
        np.testing.assert_array_equal(motion.assembled[i], there)
        assembled += int(there.sum())
        for k in range(3):
            # what a pose rounds is in all its quantities, by chance more or less
            rounded = np.max([alone.point(name).error_estimate(k) for name in places], axis=0)[there]
            for name, point in places.items():
                own = alone.point(name).complex(k)
                apart = np.abs(point.complex(k)[i] - own)[there]
                # to first order each order of derivatives takes the condition once more
                known = 4 * np.finfo(float).eps * alone.condition[there] ** (k + 1) * alone.mechanism.size
                assert (apart <= 20 * rounded + 4e-15 * np.abs(own)[there] + known).all(), (i, name, k)
        for name, link in rates.items():
            turned = np.exp(1j * (link.angle[i] - alone.link(name).angle))[there]
            np.testing.assert_allclose(turned, 1.0, atol=1e-9)
    return assembled


@pytest.mark.parametrize("spread", [1e-4, 0.2])
def test_a_triad_stands_as_alone(spread, random_mechanism):
    rng = np.random.default_rng(3)
    m = random_mechanism("triad", rng)
    assert compared(m, drawn(m, rng, 2, spread), Q[::3])


def test_a_variant_goes_along_the_nominal_way_at_once(random_mechanism, monkeypatch):
    m = random_mechanism("triad", np.random.default_rng(0))
    steps = []
    advance = Continuation._advance
    monkeypatch.setattr(Continuation, "_advance", lambda *given: steps.append(given) or advance(*given))
    path = next(p for p in dimensions(m) if p.startswith("links"))
    own = float(value(m, path).real)
    motion = m.vary({path: own * (1 + np.linspace(0.0, 1e-3, 3))}).motion(Q)
    assert motion.assembled.all()
    # the way of the nominal mechanism, gone step by step once; not once more for each
    nominal = len(steps)
    steps.clear()
    for i in range(3):
        m.vary({path: own * (1 + np.linspace(0.0, 1e-3, 3))})[i].motion(Q).assembled.all()
    assert 3 * nominal < 1.2 * len(steps)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("spread", [1e-3, 0.05, 0.4])
def test_random_triads_stand_as_alone(seed, spread, random_mechanism):
    rng = np.random.default_rng(seed)
    m = random_mechanism("triad", rng)
    compared(m, drawn(m, rng, 12, spread), Q)
