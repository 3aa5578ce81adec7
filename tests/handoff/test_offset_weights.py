"""Weights by which what particles lack is handed to the surface around them."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from handoff.source import offset


def test_each_point_reaches_as_far_as_its_own_width():
    """Fine points beside a coarse one: with the reach of the widest every fine point would meet every other, 3,000
    squared pairs here and 10 GB about a small impact on a body of hundreds of metres."""
    rng = np.random.default_rng(1)
    fine = rng.uniform(0.0, 1.0, (3000, 3))
    place = np.concatenate([fine, [[2.0, 0.5, 0.5]]])
    width = np.append(np.full(3000, 0.02), 5.0)
    weights = offset._weights(place, cKDTree(place), width)
    assert weights[3000].nnz == 3001 and weights.nnz < 0.01 * 3000**2
    away = np.linalg.norm(place[17] - place, axis=1)
    wanted = np.where(away <= 3.0 * 0.02, np.exp(-0.5 * (away / 0.02) ** 2), 0.0)
    assert weights[17].toarray()[0] == pytest.approx(wanted, abs=1e-12)
    assert weights.diagonal() == pytest.approx(np.ones(3001))
