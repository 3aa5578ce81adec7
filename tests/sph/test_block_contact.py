"""What crosses the surface of a block: compression and no tension, momentum and energy kept."""

from __future__ import annotations

import numpy as np
import pytest

from sph.pairs import block_contact, rates, scheme
from sph.pairs.row import ENERGY, MATERIAL, SLOPE
from tests.sph.test_rates import _Cloud, rows_of

WITH_BLOCKS = scheme.Scheme(reconstructed=True, with_blocks=True)


def test_only_pairs_across_a_block_s_surface_are_parted():
    """Ground and projectile, 0 and 1, hold together as ever; a block, -1, holds to neither and not to another."""
    cut = block_contact.cut
    assert [cut(0, -1, 1.0), cut(-1, 0, 1.0), cut(-1, -2, 1.0)] == [1.0, 1.0, 1.0]
    assert [cut(0, -1, -1.0), cut(0, 1, 1.0), cut(-1, -1, 1.0), cut(0, 0, 1.0)] == [0.0, 0.0, 0.0, 0.0]
    assert block_contact.bodies(np.array([0, 2, 2]), np.array([-1, 0, 3])).tolist() == [0, -1, -4]


def _rates(cloud, kinds, slopes=0.1) -> rates.Rates:
    n = len(cloud.mass)
    second = np.zeros((n, 8))
    second[:, SLOPE : SLOPE + 6] = np.random.default_rng(5).normal(size=(n, 6)) * slopes
    second[:, MATERIAL], second[:, ENERGY] = kinds, np.random.default_rng(6).uniform(0.0, 1e6, n)
    out = rates.Rates(n, strain_rate=True)
    rows = rows_of(cloud.rows(), second, cloud.density)
    cloud.summed(WITH_BLOCKS, rows, out, rates.Damping(3.0, 10.0, conductivity=8.0))
    return out


def test_momentum_and_energy_are_kept_across_the_surfaces_of_blocks():
    cloud = _Cloud(1000)
    kinds = np.random.default_rng(3).integers(-3, 2, 1000)
    out, whole = _rates(cloud, kinds), _rates(cloud, np.zeros(1000))
    force = cloud.mass[:, None] * out.acceleration
    assert np.abs(force.sum(axis=0)).max() < 1e-11 * np.abs(force).sum()
    work, heat = np.einsum("ij,ij->i", cloud.velocity, force), cloud.mass * out.energy
    assert abs(work.sum() + heat.sum()) < 1e-11 * np.abs(heat).sum()
    assert np.abs(out.acceleration - whole.acceleration).max() > 0.1 * np.abs(whole.acceleration).max()


@pytest.mark.parametrize("pressure, felt", [(1e9, True), (-1e9, False)])
def test_a_block_in_tension_is_let_go_and_in_compression_held(pressure, felt):
    """All in one pressure: in tension no force is left across the surface, in compression all of it."""
    cloud = _Cloud(1000)
    cloud.stress[:], cloud.velocity[:], cloud.pressure[:] = 0.0, 0.0, pressure
    block = cloud.position[:, 0] > np.median(cloud.position[:, 0])
    out, whole = _rates(cloud, np.where(block, -1.0, 0.0), 0.0), _rates(cloud, np.zeros(1000), 0.0)
    pull = (cloud.mass[:, None] * out.acceleration)[block].sum(axis=0)[0]
    before = (cloud.mass[:, None] * whole.acceleration)[block].sum(axis=0)[0]
    assert abs(before) > 0.0
    assert pull == pytest.approx(before, rel=1e-9) if felt else abs(pull) < 1e-9 * abs(before)


def test_a_gap_that_opens_at_a_block_is_no_expansion_of_it():
    """Two halves in tension that part as rigid bodies: neither density changes; pressed together both grow denser."""
    cloud = _Cloud(1000)
    block = cloud.position[:, 0] > np.median(cloud.position[:, 0])
    kinds = np.where(block, -1.0, 0.0)
    cloud.stress[:], cloud.velocity[:] = 0.0, 0.0
    found = {}
    for pressure, speed in ((-1e6, 1.0), (-1e6, -1.0), (1e6, 1.0)):
        cloud.pressure[:] = pressure
        cloud.velocity[:, 0] = np.where(block, speed, 0.0)
        found[pressure, speed] = np.abs(_rates(cloud, kinds, 0.0).density).max()
    assert found[-1e6, 1.0] < 1e-9 * found[-1e6, -1.0]
    assert found[1e6, 1.0] == pytest.approx(found[-1e6, -1.0], rel=1e-6)
