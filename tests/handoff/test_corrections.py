"""The regional correction and the kernel mapping by themselves; on a bed: ``test_transfer_fields.py``."""

import numpy as np
from scipy.spatial import cKDTree

from handoff.transfer import correction, interpolation


def test_splines_are_a_partition_of_unity_and_blend_constants():
    rng = np.random.default_rng(2)
    place = rng.uniform(-3.0, 5.0, (4000, 3))
    mass = rng.uniform(0.5, 1.5, 4000)
    push = np.array([1.0, -2.0, 0.5])
    change = correction.regional_field(place, mass, mass[:, None] * push, place[:200], 2.0)
    np.testing.assert_allclose(change, np.tile(push, (200, 1)), rtol=1e-9)


def test_a_regional_lack_is_closed_where_it_is():
    rng = np.random.default_rng(3)
    place = rng.uniform(0.0, 20.0, (30_000, 3))
    mass = np.ones(30_000)
    lacking = np.where(place[:, :1] < 10.0, 1.0, -1.0) * np.array([[0.0, 0.3, 0.0]])
    change = correction.regional_field(place, mass, lacking, place, 4.0)
    left = lacking - mass[:, None] * change
    for here in (place[:, 0] < 8.0, place[:, 0] > 12.0):
        assert np.abs(left[here].sum(axis=0)).max() < 0.03 * np.abs(lacking[here].sum(axis=0)).max()
    assert np.abs(change).max() < 0.4  # no region pays for another


def test_kernel_mean_is_exact_for_constants_only():
    rng = np.random.default_rng(1)
    points, volume = rng.random((500, 3)), rng.uniform(0.5, 2.0, 500)
    query = rng.uniform(0.2, 0.8, (40, 3))
    tree = cKDTree(points)
    constant = interpolation.kernel_mean(tree, np.tile([1.0, 2.0, 3.0], (500, 1)), volume, query, 30)
    np.testing.assert_allclose(constant, np.tile([1.0, 2.0, 3.0], (40, 1)), rtol=1e-12)
    linear = interpolation.kernel_mean(tree, points, volume, query, 30)
    assert 1e-3 < np.abs(linear - query).max() < 0.1
