"""Blocks as bodies: the mass, place, velocity, spin and damage of each, from the particles in it.

    M = sum m,   x = sum m x_i / M,   v = sum m v_i / M,   D = sum m D_i / M
    L = sum m (x_i - x) x (v_i - v)

A block is whole where D is below ``WHOLE``.
"""

from __future__ import annotations

import numpy as np

WHOLE = 0.5
"""Mean damage below which a block counts as whole."""


def means(block: np.ndarray, count: int, mass: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Means (count, k) over the particles of each block of ``values`` (n, k), weighted by ``mass`` (n,); NaN where a
    block has none. ``block`` (n,) is the block of each particle, -1 for none."""
    mine = block >= 0
    total = masses(block, count, mass)
    sums = [np.bincount(block[mine], weights=mass[mine] * column[mine], minlength=count) for column in values.T]
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.stack(sums, axis=1) / total[:, None]


def masses(block: np.ndarray, count: int, mass: np.ndarray) -> np.ndarray:
    """M (count,) [kg]."""
    mine = block >= 0
    return np.bincount(block[mine], weights=mass[mine], minlength=count)


def spins(
    block: np.ndarray, count: int, mass: np.ndarray, position: np.ndarray, velocity: np.ndarray, centre: np.ndarray,
    drift: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """L (count, 3) [kg m^2/s] of each block about its ``centre`` (count, 3) [m], against its ``drift`` (count, 3)
    [m/s]."""
    mine = np.flatnonzero(block >= 0)
    own = block[mine]
    turning = mass[mine, None] * np.cross(position[mine] - centre[own], velocity[mine] - drift[own])
    return np.stack([np.bincount(own, weights=column, minlength=count) for column in turning.T], axis=1)
