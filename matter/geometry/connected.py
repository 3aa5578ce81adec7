"""Which particles hang together: groups of whole ones, as fragments of a broken body are counted.

Two particles belong to one fragment when neither is broken (D < 1/2) and they are closer than the mean of their
supports times ``LINK``.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from matter.geometry import neighbours
from matter.particles import Particles

LINK = 0.75
"""Of the support: 1.5 spacings, the first neighbours of a lattice."""
BROKEN = 0.5
NONE = -1


def groups(particles: Particles, among: np.ndarray) -> np.ndarray:
    """Number of the fragment (n,) of each particle of the mask ``among`` that is whole; ``NONE`` of all others. Needs
    position, damage, support_radius."""
    particles.need("position", "damage", "support_radius")
    number = np.full(len(particles), NONE)
    whole = among & (particles.damage < BROKEN)
    if not whole.any():
        return number
    x, h = particles.position[whole], particles.support_radius[whole]
    # by levels of the support: one particle of debris whose support has grown must not widen the search of all others
    order, grid = neighbours.sort(x, h)
    near = neighbours.build(x[order], h[order], grid, LINK)
    index = np.arange(near.count.sum()) + np.repeat(near.entry - np.cumsum(near.count) + near.count, near.count)
    links = coo_matrix(
        (np.ones(len(index), dtype=np.int8), (np.repeat(order, near.count), order[near.index[index]])),
        shape=(len(x), len(x)),
    )
    number[whole] = connected_components(links, directed=False)[1]
    return number
