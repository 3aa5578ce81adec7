"""The inside of a solid as a region that points fill (``matter.points.regions``): images stand behind its surface."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from matter.points.regions import Mirrored
from matter.solids.distance import Distance
from matter.solids.solid import Solid


@dataclass(frozen=True, eq=False)
class Interior:
    """The inside of ``solid``; ``distance`` is measured from its surface."""

    solid: Solid
    distance: Distance

    @property
    def volume(self) -> float:
        """Volume [m^3]."""
        return self.solid.volume

    @cached_property
    def _box(self) -> tuple[np.ndarray, np.ndarray]:
        return self.solid.vertices.min(axis=0), self.solid.vertices.max(axis=0)

    def random_points(self, rng: np.random.Generator, count: int) -> np.ndarray:
        """``count`` random points (n, 3)."""
        low, high = self._box
        points = np.empty((0, 3))
        while len(points) < count:
            trial = low + (high - low) * rng.random((count, 3))
            points = np.concatenate([points, trial[self.inside(trial)]])
        return points[:count]

    def inside(self, points: np.ndarray) -> np.ndarray:
        """(n,) bool."""
        return self.distance.at(points)[0] > 0.0

    def mirrored(self, points: np.ndarray, spacing: np.ndarray) -> Mirrored:
        """Points and their images within two spacings of the surface."""
        depth, inwards = self.distance.at(points)
        near = np.flatnonzero(np.abs(depth) < 2.0 * spacing)
        images = points[near] - 2.0 * depth[near, None] * inwards[near]
        # behind an edge or a neck an image may come to lie inside again: it would push where nothing is
        behind = self.distance.at(images)[0] < 0.0
        return np.concatenate([points, images[behind]]), np.concatenate([np.arange(len(points)), near[behind]])

    def off_walls(self, points: np.ndarray, spacing: np.ndarray) -> np.ndarray:
        """Points at least a tenth of a spacing inside the surface."""
        for _ in range(4):  # beyond an edge the nearest way in leads to the next face
            depth, inwards = self.distance.at(points)
            short = np.maximum(0.1 * spacing - depth, 0.0)
            points = points + short[:, None] * inwards
        return points
