"""Regions: volumes against drawn points, walls mirrored, points kept inside; graded glass in each."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from matter.points import packing
from matter.points.regions import Slab

SLABS = [
    Slab("cylinder", 1.0, -0.7, -0.2),
    Slab("bowl", 1.0, -1.0, -0.4),
    Slab("bowl", 1.0, -0.4, 0.0),
    Slab("box", 0.5, -1.0, 0.0),
]


@pytest.mark.parametrize("region", SLABS, ids=lambda r: f"{r.shape}{r.bottom}")
def test_drawn_points_fill_the_region_evenly(region):
    rng = np.random.default_rng(1)
    points = region.random_points(rng, 40_000)
    assert len(points) == 40_000 and region.inside(points).all()
    box = rng.uniform(-1.0, 1.0, size=(400_000, 3))
    assert 8.0 * region.inside(box).mean() == pytest.approx(region.volume, rel=0.02)
    some = Slab("box", 0.2, max(region.bottom, -0.6), region.top)  # inside each of them
    assert some.inside(points).mean() == pytest.approx(some.volume / region.volume, rel=0.05)


@pytest.mark.parametrize("region", SLABS, ids=lambda r: f"{r.shape}{r.bottom}")
def test_images_lie_outside_and_kept_points_inside(region):
    rng = np.random.default_rng(2)
    points = region.random_points(rng, 3000)
    everyone, owner = region.mirrored(points, np.full(3000, 0.1))
    assert np.array_equal(everyone[:3000], points) and len(everyone) > 4000
    assert not region.inside(everyone[3000:]).any()
    away = np.linalg.norm(everyone - points[owner], axis=1)
    assert away.max() < 3 * 0.4  # at a corner
    pushed = region.off_walls(points + rng.normal(size=points.shape) * 0.2, np.full(3000, 0.1))
    assert region.inside(pushed).all()


def test_graded_glass_in_a_bowl():
    def spacing(x):
        return 0.06 + 0.1 * np.linalg.norm(x, axis=1)

    region = Slab("bowl", 1.0, -1.0, 0.0)
    points, volume = packing.graded(spacing, region, np.random.default_rng(1), finest=0.06)
    assert region.inside(points).all() and volume.sum() == pytest.approx(region.volume, rel=1e-12)
    nearest = cKDTree(points).query(points, k=2)[0][:, 1] / spacing(points)
    assert nearest.min() > 0.55 and nearest.std() < 0.15
    share = volume / spacing(points) ** 3
    inner = (points[:, 2] < -0.15) & (np.linalg.norm(points, axis=1) < 0.8)
    assert share[inner].mean() == pytest.approx(1.0, abs=0.12) and share[inner].std() < 0.1
    # neighbours' masses differ by no more than a bounded ratio
    pairs = cKDTree(points).query(points, k=7)[1][:, 1:]
    ratio = volume[pairs] / volume[:, None]
    assert np.quantile(ratio, 0.999) < 2.0
