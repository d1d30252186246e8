"""Modal balancing against closed forms of a uniform shaft, and against a rotor of finite elements at its criticals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from balancing import UnreachedMode, modal_corrections, shapes_at
from benchmarks.truth.rotor import Bearing, Rotor, turbine


def sines(count: int, z: Any) -> Any:
    """Modes of a uniform shaft of length 1 in rigid bearings."""
    return np.sin(np.pi * np.arange(1, count + 1)[:, None] * np.asarray(z))


def test_the_finite_elements_have_the_frequencies_of_a_uniform_shaft() -> None:
    shaft = Rotor(np.linspace(0, 2, 41), 0.02, (), (Bearing(0, 1e12, 0), Bearing(40, 1e12, 0)))
    found, shapes = shaft.modes(3)
    area, inertia = np.pi / 4 * 0.02**2, np.pi / 64 * 0.02**4
    beam = (np.arange(1, 4) * np.pi / 2) ** 2 * np.sqrt(2.1e11 * inertia / (7850 * area))
    assert found == pytest.approx(beam, rel=1e-3)
    assert np.abs(np.abs(shapes) - np.abs(sines(3, shaft.z / 2))).max() < 1e-3


@pytest.mark.parametrize("count", [1, 2, 3, 7])
def test_planes_at_equal_distances_by_the_orthogonality_of_sines(count: int) -> None:
    """With N planes at p/(N+1) the discrete sines are orthogonal: w_p = −2/(N+1) Σ_k φ_k(z_p) Σ U φ_k."""
    rng = np.random.default_rng(count)
    u, z = rng.normal(size=4) + 1j * rng.normal(size=4), rng.uniform(0, 1, 4)
    planes = np.arange(1, count + 1) / (count + 1)
    fix = modal_corrections(u, sines(count, z), sines(count, planes))
    expected = -2 / (count + 1) * sines(count, planes).T @ (sines(count, z) @ u)
    assert np.abs(fix.unbalance - expected).max() < 1e-13 * np.abs(u).sum()
    assert np.abs(fix.residual_of(fix.unbalance)).max() < 1e-14 * np.abs(u).sum()
    # the scale of each shape does not matter, nor its sign
    scale = np.array([-3.0, 1e-6, 1e6, 5.0, -1.0, 2.0, 9.0])[:count, None]
    again = modal_corrections(u, scale * sines(count, z), scale * sines(count, planes))
    assert np.abs(again.unbalance - fix.unbalance).max() < 1e-12 * np.abs(u).sum()


def test_nothing_and_many_rotors() -> None:
    none = modal_corrections([0.0], [[1.0]], [[0.5, 0.5]])
    assert none.unbalance.tolist() == [0, 0]
    rng = np.random.default_rng(1)
    u, phi, at = rng.normal(size=(5, 3)) + 0j, rng.normal(size=(5, 2, 3)), rng.normal(size=(5, 2, 4))
    every = modal_corrections(u, phi, at)
    for i in range(5):
        one = modal_corrections(u[i], phi[i], at[i])
        assert np.abs(every.unbalance[i] - one.unbalance).max() < 1e-14
        # of least norm: as the pseudo-inverse has it
        least = -np.linalg.pinv(at[i]) @ (phi[i] @ u[i])
        assert np.abs(one.unbalance - least).max() < 1e-13


def test_planes_at_the_nodes_are_refused() -> None:
    with pytest.raises(UnreachedMode) as seen:
        modal_corrections([1.0], sines(2, [0.3]), sines(2, [0.5, 1.0]))
    assert np.abs(seen.value.combination).round(9).tolist() == [0, 1]
    with pytest.raises(ValueError, match="at least as many planes"):
        modal_corrections([1.0], sines(2, [0.3]), sines(2, [0.4]))


def test_splines_are_exact_at_the_stations_and_for_cubics() -> None:
    z = np.array([0, 0.2, 0.5, 0.9, 1.0])
    assert shapes_at(z, [z**3 - z, 2 * z], [0.2, 0.7]) == pytest.approx(
        np.array([[0.008 - 0.2, 0.343 - 0.7], [0.4, 1.4]]), rel=1e-13
    )
    with pytest.raises(ValueError, match="beyond the stations"):
        shapes_at(z, [z], [1.01])


@pytest.mark.parametrize("rigid", [False, True])
def test_a_rotor_passes_its_criticals_quietly(rigid: bool) -> None:
    """Unbalances on three discs; planes elsewhere. Without corrections the criticals stand out by a factor of 100 and more."""
    rotor = turbine()
    speeds, shapes = rotor.modes(2)
    unbalance = {8: 60e-6 * np.exp(0.5j), 12: 90e-6 * np.exp(2.1j), 17: 70e-6 * np.exp(-1.9j)}
    planes = [3, 6, 15, 21] if rigid else [6, 18]
    rows = np.vstack([np.ones_like(rotor.z), rotor.z, shapes]) if rigid else shapes
    fix = modal_corrections(list(unbalance.values()), rows[:, list(unbalance)], rows[:, planes])
    balanced = dict(unbalance)
    for node, w in zip(planes, fix.unbalance, strict=True):
        balanced[node] = balanced.get(node, 0) + w
    # without gyroscopic effects and damping, as modal theory has it
    for name in ("g", "c"):
        rotor.matrices[name][:] = 0
    for k, speed in enumerate(speeds):
        before, after = (np.abs(rotor.response(0.9999 * speed, u)).max() for u in (unbalance, balanced))
        assert after < 1e-3 * before, k
    if rigid:
        assert abs(sum(balanced.values())) < 1e-15
        assert abs(sum(u * rotor.z[node] for node, u in balanced.items())) < 1e-15
    # with them the first two criticals are still far quieter
    real = turbine()
    for speed in (2700, 10500):
        before, after = (np.abs(real.response(speed * np.pi / 30, u)).max() for u in (unbalance, balanced))
        assert after < 0.1 * before
