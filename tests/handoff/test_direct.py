"""The overlaps of a direct transition: how they are measured. What it keeps, and its place in the ledger, the record
and the report: ``test_stage.py``."""

import math

import numpy as np
import pytest

from handoff.domains.domain import Upright
from handoff.transfer import overlaps
from matter.particles import Particles


def grains(position, radius, mass=1.0, stiffness=100.0) -> Particles:
    n = len(position)
    return Particles({"position": position, "radius": np.full(n, radius) if np.isscalar(radius) else radius,
    "mass": np.full(n, mass),
                      "stiffness": np.full(n, stiffness)})  # fmt: skip


def test_two_spheres():
    found = overlaps.measure(grains([[0, 0, 0], [1.9, 0, 0], [50, 0, 0]], 1.0, mass=4.0))
    np.testing.assert_allclose(found.depth, [0.1])
    assert found.largest == pytest.approx(0.1) and found.energy == pytest.approx(0.5 * 100.0 * 0.01)
    assert found.release_speed[0] == pytest.approx(0.1 * math.sqrt(100.0 / 4.0))
    # an overlap of 0.05 at pressure 5 Pa (r^2 P / k) is what the undisturbed body carries
    assert found.beyond(lambda place: np.full(len(place), 5.0)).depth == pytest.approx([0.05])
    assert len(found.beyond(lambda place: np.full(len(place), 11.0)).depth) == 0
    # k = m (v / (x r))^2 keeps a grain of that speed below x radii: dt = pi sqrt(m / 2 k) / n
    speed, x, n = float(found.release_speed[0]), 0.15, 30
    assert found.step(x, n) == pytest.approx(math.pi * math.sqrt(0.5 * 4.0 / (4.0 * (speed / x) ** 2)) / n)
    assert overlaps.measure(grains([[0, 0, 0], [3, 0, 0]], 1.0)).step(x, n) == math.inf


def test_pairs_of_very_different_sizes_are_all_found():
    rng = np.random.default_rng(1)
    position, radius = rng.random((400, 3)), 0.004 * 2.0 ** rng.uniform(0, 6, 400)
    found = overlaps.measure(grains(position, radius))
    gap = radius[:, None] + radius[None] - np.linalg.norm(position[:, None] - position[None], axis=2)
    every = np.triu(gap > 0.0, 1)
    np.testing.assert_allclose(np.sort(found.depth), np.sort(gap[every]))
    assert 100 < len(found.depth)


def test_walls_count_as_contacts():
    box = Upright("cylinder", 10.0, -5.0, 5.0)
    found = overlaps.measure(grains([[0, 0, -4.5], [9.2, 0, 0], [0, 0, 4.9]], 1.0), box)
    np.testing.assert_allclose(np.sort(found.depth), [0.2, 0.5])  # the side and the floor, never the top
