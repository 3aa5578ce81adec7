"""Yield and damage laws against their definitions."""

import numpy as np
import pytest

from sph.bodies import seeding
from sph.bodies.particle_cloud import Cloud
from sph.bodies.target import Body
from sph.damage import grady_kipp
from sph.materials.rows import collect
from sph.materials.settings import Choice
from sph.strength import von_mises


def test_return_ends_on_the_yield_surface_and_is_idempotent():
    Y = 3.5e9
    for J2 in (1e16, 1e18, 4.1e18, 1e20):
        f = von_mises.return_factor(J2, Y)
        after = f * f * J2
        assert np.sqrt(3 * after) <= Y * (1 + 1e-12)
        assert von_mises.return_factor(after, Y) == pytest.approx(1.0, abs=1e-12)
        if np.sqrt(3 * J2) > Y:
            assert np.sqrt(3 * after) == pytest.approx(Y, rel=1e-12)


def test_molten_material_has_no_strength():
    p = von_mises.Parameters(1e9, 7e5)
    assert von_mises.yield_stress(1e9, 7e5, 0.0, p) == 0.0
    assert von_mises.yield_stress(0.0, 3.5e5, 1.0, p) == pytest.approx(0.5e9)
    assert von_mises.return_factor(1e18, 0.0) == 0.0


def test_largest_principal_stress_is_the_eigenvalue():
    rng = np.random.default_rng(3)
    for _ in range(200):
        a = rng.normal(size=(3, 3)) * 10.0 ** rng.uniform(0, 10)
        S = a + a.T
        S -= np.eye(3) * np.trace(S) / 3
        P = rng.normal() * np.abs(S).max()
        found = grady_kipp.largest_principal(S[0, 0], S[0, 1], S[0, 2], S[1, 1], S[1, 2], P)
        assert found == pytest.approx(
            np.linalg.eigvalsh(S - P * np.eye(3)).max(), rel=1e-7, abs=1e-7 * np.abs(S).max()
        )


def test_flaws_follow_the_weibull_law():
    """Benz & Asphaug 1995 for 9000 equal particles in a unit sphere, k = 4e35, m = 9: N ln N flaws, a few 1e-4 at
    most."""
    n, p = 9000, grady_kipp.Parameters(4e35, 9.0)
    volume = 4 / 3 * np.pi
    start, strain = grady_kipp.flaws(np.full(n, volume / n), p, np.random.default_rng(1))
    assert 8 * n < len(strain) < 11 * n
    assert np.diff(start).min() >= 1
    assert strain.max() == pytest.approx(3e-4, rel=0.2)
    for eps in np.quantile(strain, [0.1, 0.5, 0.9]):
        assert np.count_nonzero(strain <= eps) == pytest.approx(p.k * volume * float(eps) ** p.m, rel=0.01)
    for i in range(0, n, 501):
        assert (np.diff(strain[start[i] : start[i + 1]]) >= 0).all()


def test_flaws_go_to_volume_and_do_not_depend_on_anything_else():
    p = grady_kipp.Parameters(1.4e38, 9.6)
    volumes = np.concatenate([np.full(300, 1.0), np.full(300, 8.0)]) * 1e14
    start, strain = grady_kipp.flaws(volumes, p, np.random.default_rng(2))
    again = grady_kipp.flaws(volumes, p, np.random.default_rng(2))
    assert np.array_equal(strain, again[1]) and np.array_equal(start, again[0])
    counts = np.diff(start)
    assert counts[300:].mean() / counts[:300].mean() == pytest.approx(8.0, rel=0.1)


def test_broken_material_has_no_flaws_and_a_strongly_graded_body_keeps_the_weakest():
    """The flaws that the smallest particle waits for go to the largest ones, and are counted there."""
    place, volume = np.random.default_rng(1).normal(size=(200, 3)), np.geomspace(1e-9, 1.0, 200)
    body = Body(
        place,
        2700.0 * volume,
        np.full(200, 2700.0),
        np.full(200, 1.0),
        np.zeros(200, np.int32),
        np.zeros(200, np.int32),
        np.ones(200),
    )
    broken, whole = Cloud.from_bodies(body), Cloud.from_bodies(body)
    seeding.seed_flaws(broken, collect(("basalt",), {"basalt": Choice(strength="drucker_prager", predamaged=True)}), 1)
    assert len(broken.flaw_strain) == 0 and (broken.root_damage == 1.0).all()
    assert grady_kipp.expected(volume) > seeding.MOST
    seeding.seed_flaws(whole, collect(("basalt",)), 1)
    held = whole.flaw_last - whole.flaw_first
    assert held.min() >= 1 and held.max() == grady_kipp.KEPT and len(whole.flaw_strain) == held.sum()
    large, small = whole.flaw_total[volume > 0.1].mean(), whole.flaw_total[volume < 1e-8].mean()
    assert large / small > 1e6
    n = 3000
    start, _ = grady_kipp.flaws(np.full(n, 1.0), grady_kipp.Parameters(4e35, 9.0), np.random.default_rng(1))
    assert start[-1] == pytest.approx(grady_kipp.expected(np.full(n, 1.0)), rel=0.3)
