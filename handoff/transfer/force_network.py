"""The network of contact forces that a bed starts with: k times overlap for every touching pair, the elastic part of
the contact law.

Contacts may carry an offset to their overlap (column 8 of ``contacts/history``: springs that were stiffened or
softened under load), which counts.

A settled bed carries its weight in chains: forces spread exponentially about their mean (99th percentile near 4.6
means for exp(-f), Radjai et al. 1996, PRL 77, 274); a few contacts far beyond that are locked-in overlaps that a carve
would let go.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from handoff.transfer.overlaps import pairs
from matter.particles import Particles

_IN_CONTACT = 0
OFFSET = 7
"""Column of the offset in ``contacts/history``; a history without one has 7 columns."""


@dataclass(frozen=True)
class Network:
    """Touching pairs ``one``, ``other`` (c,) as indices in the grains, ``force`` (c,) [N]; ``grains`` were looked
    at."""

    one: np.ndarray
    other: np.ndarray
    force: np.ndarray
    grains: int

    @property
    def mean(self) -> float:
        """Mean force [N]; zero without a contact."""
        return float(self.force.mean()) if len(self.force) else 0.0

    @property
    def spread(self) -> float:
        """99th percentile over the mean; zero without a contact."""
        return float(np.percentile(self.force, 99.0)) / self.mean if self.mean > 0.0 else 0.0

    @property
    def contacts_per_grain(self) -> float:
        """Mean coordination number."""
        return 2.0 * len(self.force) / max(self.grains, 1)


def measure(grains: Particles) -> Network:
    """Forces among the grains in contact search (``state`` 0). Raises ``InputError`` without position, radius and
    stiffness."""
    grains.need("position", "radius", "stiffness")
    active = np.flatnonzero(grains.state == _IN_CONTACT) if "state" in grains else np.arange(len(grains))
    position, radius, k = grains.position[active], grains.radius[active], grains.stiffness[active]
    one, other = pairs(position, radius)
    depth = radius[one] + radius[other] - np.linalg.norm(position[one] - position[other], axis=1)
    depth += _offsets(grains, active[one], active[other])
    hit = depth > 0.0
    one, other = one[hit], other[hit]
    return Network(active[one], active[other], np.minimum(k[one], k[other]) * depth[hit], len(active))


def _offsets(grains: Particles, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """What the history of each pair of grains (indices) adds to its overlap [m]; zero for pairs without one."""
    pair, history = grains.tables.get("contacts/pair"), grains.tables.get("contacts/history")
    if pair is None or history is None or len(pair) == 0 or history.shape[1] <= OFFSET or "identity" not in grains:
        return np.zeros(len(one))
    span = int(max(grains.identity.max(), pair.max())) + 1

    def key(first: np.ndarray, second: np.ndarray) -> np.ndarray:
        return np.minimum(first, second).astype(np.int64) * span + np.maximum(first, second)

    known, wanted = key(pair[:, 0], pair[:, 1]), key(grains.identity[one], grains.identity[other])
    order = np.argsort(known)
    index = order[np.minimum(np.searchsorted(known, wanted, sorter=order), len(order) - 1)]
    return np.where(known[index] == wanted, history[index, OFFSET], 0.0)
