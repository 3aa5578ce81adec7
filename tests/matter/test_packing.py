"""Lattice and graded glass."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from matter.points import packing
from matter.points.regions import Shell


def test_hexagonal_packing_has_its_density_and_twelve_neighbours():
    points = packing.hexagonal(0.1, 1.0)
    assert len(points) * 0.1**3 == pytest.approx(4 / 3 * np.pi, rel=0.02)
    inner = np.linalg.norm(points, axis=1) < 0.8
    edge = 0.1 * 2 ** (1 / 6)
    counts = cKDTree(points).query_ball_point(points[inner], 1.01 * edge, return_length=True) - 1
    assert (counts == 12).all()


def test_graded_shell_follows_its_spacing_and_fills_its_volume():
    def spacing(x):
        return 0.08 + 0.06 * np.linalg.norm(x - [0, 0, 1.0], axis=1)

    points, volume = packing.graded(spacing, Shell(0.6, 1.0), np.random.default_rng(1))
    r = np.linalg.norm(points, axis=1)
    assert r.min() > 0.6 and r.max() < 1.0
    assert volume.sum() == pytest.approx(4 / 3 * np.pi * (1 - 0.6**3), rel=1e-12)
    nearest = cKDTree(points).query(points, k=2)[0][:, 1] / spacing(points)
    assert nearest.min() > 0.6  # random points would come as close as 0.05
    assert nearest.std() < 0.15
    top = points[:, 2] > 0.7
    assert len(points) == pytest.approx((spacing(points) ** -3 * volume).sum(), rel=0.05)
    assert (volume[top] / spacing(points[top]) ** 3).mean() == pytest.approx(1.0, abs=0.1)


def test_same_seed_same_points():
    def spacing(x):
        return np.full(len(x), 0.15)

    a, b = (packing.graded(spacing, Shell(0.0, 1.0), np.random.default_rng(7), sweeps=5)[0] for _ in range(2))
    assert np.array_equal(a, b)
