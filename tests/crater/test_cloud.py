"""Which particles carry a surface, where sizes differ."""

from __future__ import annotations

import numpy as np

from crater import cloud
from matter.particles import Particles


def _grains(position: np.ndarray, radius: np.ndarray) -> Particles:
    return Particles({"position": position, "radius": radius}, {"packing_fraction": 0.6})


def _ground(rng: np.random.Generator) -> np.ndarray:
    """A slab of 12 x 12 x 5 grains of radius 0.5, three of whose upper layers lack a block in the middle."""
    places = np.stack(np.meshgrid(np.arange(12.0), np.arange(12.0), np.arange(5.0), indexing="ij"), axis=-1)
    places = places.reshape(-1, 3)
    hollow = (np.abs(places[:, 0] - 5.5) < 2.0) & (np.abs(places[:, 1] - 5.5) < 2.0) & (places[:, 2] > 3.0)
    return places[~hollow] + rng.uniform(-0.02, 0.02, (np.count_nonzero(~hollow), 3))


def test_small_grains_in_the_pores_take_no_large_one_from_the_ground() -> None:
    rng = np.random.default_rng(3)
    large = _ground(rng)
    floor = large[(np.abs(large[:, :2] - 5.5) < 2.0).all(axis=1) & (large[:, 2] > 2.5)]
    # thirty small ones about each grain of the floor: more than the dozen neighbours that are asked for
    way = rng.normal(size=(len(floor), 30, 3))
    fines = (floor[:, None] + 0.58 * way / np.linalg.norm(way, axis=2)[:, :, None]).reshape(-1, 3)
    alone = cloud.supported(cloud.of(_grains(large, np.full(len(large), 0.5))))
    radius = np.concatenate([np.full(len(large), 0.5), np.full(len(fines), 0.06)])
    among = cloud.supported(cloud.of(_grains(np.vstack([large, fines]), radius)))
    assert alone.all()
    assert np.array_equal(among[: len(large)], alone)


def test_a_large_grain_above_the_ground_is_not_held_by_small_ones() -> None:
    rng = np.random.default_rng(4)
    large = np.vstack([_ground(rng), [[5.5, 5.5, 9.0]]])
    fines = np.array([5.5, 5.5, 9.0]) + 0.3 * rng.normal(size=(200, 3))
    radius = np.concatenate([np.full(len(large), 0.5), np.full(len(fines), 0.06)])
    held = cloud.supported(cloud.of(_grains(np.vstack([large, fines]), radius)))
    assert held[: len(large) - 1].all()
    assert not held[len(large) - 1 :].any()
