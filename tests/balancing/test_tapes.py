"""Balancing on tapes gives what `correct` and `least_squares` give, for random rotors and machines."""

from __future__ import annotations

import numpy as np
import pytest

from balancing import correct, least_squares
from balancing.known_masses import known_masses, shares
from balancing.tapes import measured, split
from dalembert.arithmetic.engines import run

RNG = np.random.default_rng(28)


def sums_of(mass: object, entries: list[dict[str, float]]) -> dict[str, float]:
    sums = {name: 0.0 for name in mass.names if name.startswith("sum ")}  # type: ignore[attr-defined]
    for entry in entries:
        found = run(mass, entry | sums)  # type: ignore[arg-type]
        sums = {name: float(found[name]) for name in sums}
    return sums


def test_riul_example_2() -> None:
    """W_B = 83.7 N at 19.7°, W_A = 72.0 N at 256.8° (J. A. Riul, unit II, example 2)."""
    tapes = known_masses(np.array([0.0, 0.09]), np.array([0.02, 0.02]), 0.0, 10.0)
    rows = [(90, 0.03, 60, 0.02), (60, 0.05, 210, 0.065)]
    entries = [
        {"amount": float(w), "radius": r, "angle": float(np.radians(a)), "z": z} for w, r, a, z in rows
    ]
    found = run(tapes["result"], sums_of(tapes["mass"], entries))
    assert [10 * found["mass 1"], 10 * found["mass 0"]] == pytest.approx([83.7, 72.0], abs=0.05)
    angles = np.degrees([found["plane 1 angle"], found["plane 0 angle"]]) % 360
    assert angles == pytest.approx([19.7, 256.8], abs=0.05)


@pytest.mark.parametrize("planes", [[0.1], [0.0, 0.3], [0.3, 0.0], [-0.1, 0.2, 0.5], [0.0, 0.1, 0.1]])
def test_any_planes(planes: list[float]) -> None:
    at, k = np.array(planes), 6
    u = RNG.normal(size=k) + 1j * RNG.normal(size=k)
    z = RNG.uniform(-1, 1, k)
    exact = correct(u, z, at)
    tapes = known_masses(at, np.full(len(at), 0.5), at[0], None, np.array([-1.0, 2.0]))
    entries = [
        {"amount": float(abs(a)), "radius": 1.0, "angle": float(np.angle(a)), "z": float(b)}
        for a, b in zip(u, z, strict=True)
    ]
    found = run(tapes["result"], sums_of(tapes["mass"], entries))
    for p, w in enumerate(exact.unbalance):
        made = found[f"plane {p} size"] * np.exp(1j * found[f"plane {p} angle"])
        assert abs(made - w) < 1e-13 * abs(u).sum() * (1 + abs(z).max())
        assert found[f"mass {p}"] == pytest.approx(abs(w) / 0.5, rel=1e-11)
    assert found["static size"] == pytest.approx(abs(exact.static))
    if len(at) > 1:
        assert found["couple size"] == pytest.approx(abs(exact.couple(at[0])))
        assert found["left static"] < 1e-13 * abs(u).sum()
    bearings = correct(u, z, np.array([-1.0, 2.0])).unbalance
    assert [found["before 0"], found["before 1"]] == pytest.approx(list(abs(bearings)))


def test_shares_of_one_plane() -> None:
    first, slope, _ = shares(np.array([0.4]))
    assert (first, slope) == (-1.0, 0.0)


@pytest.mark.parametrize(("s", "p"), [(1, 1), (2, 2), (5, 2), (4, 3)])
def test_a_sheet_is_least_squares(s: int, p: int) -> None:
    alpha = RNG.normal(size=(s, p)) + 1j * RNG.normal(size=(s, p))
    v = RNG.normal(size=s) + 1j * RNG.normal(size=s)
    weights = RNG.uniform(0.5, 2, s)
    exact = least_squares(alpha, v, weights)
    tape = measured(alpha, weights, runs=3)
    on = 0.3 * exact.corrections
    second = v + alpha @ on
    given = dict.fromkeys(tape.inputs, 0.0)
    for k, read in ((0, v), (1, second)):
        for i, x in enumerate(read):
            given |= {
                f"run {k} amplitude {i}": float(abs(x)),
                f"run {k} phase {i}": float(np.angle(x)),
                f"run {k} there {i}": 1.0,
            }
    for j, w in enumerate(on):
        given |= {f"run 1 mass {j}": float(abs(w)), f"run 1 angle {j}": float(np.angle(w))}
    found = run(tape, given)
    for j, w in enumerate(exact.corrections):
        made = found[f"plane {j} size"] * np.exp(1j * found[f"plane {j} angle"])
        assert abs(made - w) < 1e-11 * np.abs(exact.corrections).max()
        trim = found[f"trim 1 {j} size"] * np.exp(1j * found[f"trim 1 {j} angle"])
        assert abs(trim - 0.7 * w) < 1e-11 * np.abs(exact.corrections).max()
        fresh = found[f"fresh 1 {j} size"] * np.exp(1j * found[f"fresh 1 {j} angle"])
        assert abs(fresh - 0.7 * w) < 1e-11 * np.abs(exact.corrections).max()
    left = [found[f"residual {i} size"] for i in range(s)]
    assert left == pytest.approx(list(abs(exact.residual)), abs=1e-11 * np.abs(v).max())
    # both runs say the same
    assert max(found[f"off {k} {i}"] for k in (0, 1) for i in range(s)) < 1e-11 * np.abs(v).max()


def test_stated_errors_of_one_plane_are_those_of_the_reading() -> None:
    """w = −V/α: 2 % of the amplitude are 2 % of the mass, 2° of the phase 2° of its angle."""
    tape = measured(np.array([[2.0 + 1.0j]]), runs=1, errors=(0.02, np.radians(2)))
    found = run(tape, {"run 0 amplitude 0": 3.0, "run 0 phase 0": 1.0, "run 0 there 0": 1.0})
    assert found["along 0"] == pytest.approx(0.02 * found["plane 0 size"])
    assert found["across 0"] == pytest.approx(np.radians(2) * found["plane 0 size"])


def test_errors_of_coefficients_count_too() -> None:
    """With δα of 10 % in either direction and an exact reading the correction errs by 10 % in either direction."""
    alpha = np.array([[2.0 + 0.0j]])
    tape = measured(alpha, runs=1, errors=(0.0, 0.0), covariance=np.array([[[2 * 0.2**2]]]))
    found = run(tape, {"run 0 amplitude 0": 3.0, "run 0 phase 0": 1.0, "run 0 there 0": 1.0})
    assert found["along 0"] == pytest.approx(0.1 * found["plane 0 size"])
    assert found["across 0"] == pytest.approx(found["along 0"])


def test_a_vector_on_two_places() -> None:
    angles = {"first": 0.3, "second": 1.2}
    found = run(split(), {"size": 2.0, "angle": 0.8, **angles})
    total = sum(found[name] * np.exp(1j * angle) for name, angle in angles.items())
    assert total == pytest.approx(2.0 * np.exp(0.8j))
