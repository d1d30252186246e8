"""An answer of 50 digits, and random mechanisms, for the tests of kinematics."""

from __future__ import annotations

import cmath

import mpmath as mp
import numpy as np
import pytest

from virtualwork import GROUND, Guess, Guide, Input, Link, Mechanism

mp.mp.dps = 50


def solve(assembly, q, order=2):
    """All loops at once in 50 digits, from the double-precision pose: unknowns and their derivatives in the input.

    Returns {body: [angle, first, second]} and {guide: [slide, ...]}, as mpf.
    """
    plan, group = assembly.merged
    st = assembly.state((q,))
    exact = mp.mpf(q)
    fixed = {GROUND: [mp.mpf(0)] * 3}
    slides = {}
    nodes = {}
    for step in plan.steps:
        kind = type(step).__name__
        if kind == "Turn":
            angle = step.angle
            k = sum(f for _, f in angle.inputs)
            fixed[step.body] = [mp.mpf(angle.const) + mp.mpf(k) * exact, mp.mpf(k), mp.mpf(0)]
        elif kind == "Slide":
            slides[step.guide] = [exact, mp.mpf(1), mp.mpf(0)]
        elif kind == "Place" and step is not None:
            nodes[step.node] = (step.base, step.terms)
        else:
            break
    names = [*group.angles, *group.slides]
    na = len(group.angles)
    ties = {t.body: t.angle for t in group.ties}
    x = [mp.mpf(float(np.angle(np.ravel(st.turn[b])[0]))) for b in group.angles]
    x += [mp.mpf(float(np.ravel(st.slide[g])[0])) for g in group.slides]

    def series(values):
        """Angle and slide derivative lists of every body for unknown derivative lists."""
        angle = dict(fixed)
        slide = dict(slides)
        for i, body in enumerate(group.angles):
            angle[body] = [v[i] for v in values]
        for i, g in enumerate(group.slides):
            slide[g] = [v[na + i] for v in values]
        for body, tied in ties.items():
            total = []
            for k in range(len(values)):
                v = mp.mpf(tied.const) if k == 0 else mp.mpf(0)
                for _, f in tied.inputs:
                    v += mp.mpf(f) * (exact if k == 0 else 1 if k == 1 else 0)
                for base, r in tied.bases:
                    v += mp.mpf(r) * (angle[base][k] if k < len(angle[base]) else 0)
                total.append(v)
            angle[body] = total
        return angle, slide

    def term(t, angle, slide, k):
        th = angle[t.body]
        e0 = mp.expj(th[0])
        w = th[1] if len(th) > 1 else mp.mpf(0)
        a = th[2] if len(th) > 2 else mp.mpf(0)
        e = [e0, 1j * w * e0, (1j * a - w * w) * e0]
        z = mp.mpc(t.z)
        if t.slide is None:
            return z * e[k]
        s = [*slide[t.slide], mp.mpf(0), mp.mpf(0)]
        return z * sum(mp.binomial(k, j) * s[j] * e[k - j] for j in range(k + 1))

    def node(name, angle, slide, k):
        if name is None:
            return mp.mpc(0)
        base, terms = nodes[name]
        return node(base, angle, slide, k) + sum(term(t, angle, slide, k) for t in terms)

    def gaps(values, k):
        angle, slide = series(values)
        return [
            node(c.start, angle, slide, k)
            - node(c.end, angle, slide, k)
            + sum(term(t, angle, slide, k) for t in c.terms)
            for c in group.closures
        ]

    def stack(f):
        return mp.matrix([v for w in f for v in (mp.re(w), mp.im(w))])

    def jacobian(x):
        n = len(x)
        out = mp.matrix(2 * len(group.closures), n)
        zero = gaps([x, [mp.mpf(0)] * n], 1)
        for j in range(n):
            unit = [mp.mpf(int(i == j)) for i in range(n)]
            column = stack([a - b for a, b in zip(gaps([x, unit], 1), zero, strict=True)])
            for i in range(2 * len(group.closures)):
                out[i, j] = column[i]
        return out

    for _ in range(60):
        f = stack(gaps([x], 0))
        dx = mp.lu_solve(jacobian(x), -f)
        x = [a + b for a, b in zip(x, dx, strict=True)]
        if max(abs(v) for v in dx) < mp.mpf(10) ** -44:
            break
    values = [x]
    J = jacobian(x)
    for k in range(1, order + 1):
        zero = [mp.mpf(0)] * len(x)
        values.append(list(mp.lu_solve(J, -stack(gaps([*values, zero], k)))))
    return {name: [v[i] for v in values] for i, name in enumerate(names)}


def build(kind, rng, scale=1.0):
    """A random mechanism that stands assembled at its guess; every link's frame lies anyhow in it."""
    a, b, c, d, e, f, g = (complex(*rng.uniform(-1, 1, 2)) * scale for _ in range(7))
    guess = {}

    def link(name, points):
        origin = next(iter(points.values()))
        theta = rng.uniform(-3, 3)
        guess[name] = theta
        off = complex(*rng.normal(size=2)) * 0.3 * scale
        return Link({p: (z - origin) / cmath.exp(1j * theta) + off for p, z in points.items()})

    four = {"crank": {"A": a, "B": b}, "coupler": {"B": b, "C": c}, "rocker": {"C": c, "D": d}}
    ground = {"A": a, "D": d}
    guides = []
    if kind == "four-bar":
        bodies = four
    elif kind == "slider-crank":
        bodies = {"crank": four["crank"], "coupler": four["coupler"]}
        angle = rng.uniform(-3, 3)
        guides = [Guide("C", "coupler", "ground", c - rng.normal() * scale * cmath.exp(1j * angle), angle)]
    elif kind == "inverted slider-crank":
        bodies = {"crank": four["crank"], "rocker": {"D": d, "E": e}}
    elif kind == "Watt":
        bodies = {
            "crank": {"A": a, "B": b}, "coupler": {"B": b, "C": c, "E": e}, "rocker": {"C": c, "D": d, "F": f},
            "fifth": {"E": e, "G": g}, "sixth": {"F": f, "G": g},
        }  # fmt: skip
    elif kind == "Stephenson":
        ground["G"] = g
        bodies = {
            "crank": {"A": a, "B": b}, "coupler": {"B": b, "C": c, "E": e}, "rocker": {"C": c, "D": d},
            "fifth": {"E": e, "F": f}, "sixth": {"F": f, "G": g},
        }  # fmt: skip
    else:  # a triad: the input drives the five-bar loop
        ground["G"] = g
        bodies = {
            "crank": {"G": g, "F": f}, "rod": {"F": f, "E": e}, "coupler": {"E": e, "B": b, "C": c},
            "left": {"B": b, "A": a}, "right": {"C": c, "D": d},
        }  # fmt: skip
    links = {name: link(name, points) for name, points in bodies.items()}
    if kind == "inverted slider-crank":
        local = (b - d) / cmath.exp(1j * guess["rocker"]) + links["rocker"].points["D"]
        angle = rng.uniform(-3, 3)
        guides = [Guide("B", "crank", "rocker", local - rng.normal() * scale * cmath.exp(1j * angle), angle)]
    return Mechanism(ground, links, guides, inputs=Input(link="crank"), guess=Guess(guess["crank"], guess))


@pytest.fixture
def exact():
    """Unknowns and derivatives of a mechanism in 50 digits."""
    return solve


@pytest.fixture
def random_mechanism():
    """A maker of random mechanisms: (kind, rng, scale)."""
    return build
