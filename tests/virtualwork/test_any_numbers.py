"""The formulas run on any kind of number: here on those of mpmath, with 40 digits."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

from virtualwork.formulas.closed_forms import Case
from virtualwork.formulas.positions import State, loop, run
from virtualwork.formulas.rates import Rates


class Digits:
    """The operations of mpmath's numbers."""

    sqrt, exp, join = staticmethod(mp.sqrt), staticmethod(mp.expj), staticmethod(mp.mpc)

    def regular(self, inverse: mp.mpf, c1: mp.mpc, c2: mp.mpc) -> mp.mpf:
        return inverse

    def inverse(self, length: mp.mpf, least: float) -> mp.mpf:
        return 1 / length


@pytest.mark.parametrize("kind", ["four-bar", "Watt"])
def test_positions_and_rates_in_forty_digits(kind, random_mechanism) -> None:
    m = random_mechanism(kind, np.random.default_rng(5))
    a, steps = m.assembly, m.assembly.plan.steps
    q = m.at[0] + 0.01
    a.cover(q, q)
    with mp.workdps(40):
        st = State([mp.mpf(q)], kind=Digits())
        cases = {g.name: Case(g, mp.mpmathify) for g in a.plan.groups}
        assert cases.keys() == a.plain.keys()
        run(steps, st, lambda group, st: cases[group.name].solve(st, a.signs[group.name], m.size))
        for group in a.plan.groups:
            for closure in group.closures:
                assert abs(loop(closure, st)) < mp.mpf(10) ** -37 * m.size
        rates = Rates(a.plan, st, [[1.0]])
        for order in (1, 2):
            rates.advance(steps, order)
        motion = m.motion(q, speed=1.0, acceleration=0.0)
        for name in m.links:
            link = motion.link(name)
            for k, found in enumerate((link.omega[0], link.alpha[0])):
                true = rates.angle[name][k] or 0.0
                assert abs(found - true) <= 1e-12 * max(1, abs(true))
