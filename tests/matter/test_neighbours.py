"""Neighbour lists against scipy's k-d tree."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from matter.geometry import neighbours


@pytest.mark.parametrize("reach", [1.0, 1.1])
@pytest.mark.parametrize("kind", ["uniform", "graded", "projectile and a flyer"])
def test_every_neighbour_is_listed_once(kind, reach):
    rng = np.random.default_rng(4)
    n = 3000
    x = rng.uniform(-1, 1, (n, 3)) * 1e6
    h = np.full(n, 2.0e5)
    if kind != "uniform":
        h = np.where(x[:, 2] > 0, 1.2e5, 3.1e5) * rng.uniform(0.8, 1.2, n)
    if kind == "projectile and a flyer":
        h[:60], x[:60] = 4e4, [0, 0, 1e6] + rng.uniform(-1, 1, (60, 3)) * 5e4
        x[70] = (5e8, -3e7, 1e7)
    order, grid = neighbours.sort(x, h, 1.5e6)
    assert np.array_equal(np.sort(order), np.arange(n))
    x, h = x[order], h[order]
    found = neighbours.build(x, h, grid, reach)
    candidates = cKDTree(x).query_ball_point(x, reach * 0.5 * (h + h.max()))
    for i in range(n):
        near = np.array(candidates[i])
        wanted = near[(np.linalg.norm(x[near] - x[i], axis=1) < reach * 0.5 * (h[near] + h[i])) & (near != i)]
        got = found.index[found.entry[i] : found.entry[i] + found.count[i]]
        assert np.array_equal(np.sort(got), np.sort(wanted))


def test_rows_grow_instead_of_dropping():
    x = np.random.default_rng(1).uniform(0, 1, (400, 3))
    order, grid = neighbours.sort(x, np.full(400, 3.0))
    found = neighbours.build(x[order], np.full(400, 3.0), grid)
    assert (found.count == 399).all()


def test_sorting_again_changes_nothing():
    """A resumed run rebuilds the very list that it had."""
    rng = np.random.default_rng(2)
    x, h = rng.uniform(0, 1, (500, 3)), rng.uniform(0.1, 0.4, 500)
    order, _ = neighbours.sort(x, h)
    again, _ = neighbours.sort(x[order], h[order])
    assert np.array_equal(again, np.arange(500))
