"""The part of a region on the positive side of planes through the axis, which mirror it
(``matter.points.regions``)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from matter.points.regions import Mirrored, Region

OFF = 0.25
"""Points keep at least this fraction of a spacing off a mirror: half of it lets them meet it as a layer."""


@dataclass(frozen=True)
class Cut:
    """The part of ``whole`` (its own mirror image in each plane) where the coordinates of ``axes`` are positive."""

    whole: Region
    axes: tuple[int, ...]

    @property
    def volume(self) -> float:
        """Volume [m^3]."""
        return self.whole.volume / 2 ** len(self.axes)

    def random_points(self, rng: np.random.Generator, count: int) -> np.ndarray:
        """``count`` random points (n, 3)."""
        points = self.whole.random_points(rng, count)
        for axis in self.axes:
            np.abs(points[:, axis], out=points[:, axis])
        return points

    def inside(self, points: np.ndarray) -> np.ndarray:
        """(n,) bool."""
        here = self.whole.inside(points)  # type: ignore[union-attr]
        for axis in self.axes:
            here = here & (points[:, axis] > 0.0)
        return here

    def mirrored(self, points: np.ndarray, spacing: np.ndarray) -> Mirrored:
        """Points and their images within two spacings of the walls and of the mirrors."""
        position, owner = self.whole.mirrored(points, spacing)
        for axis in self.axes:
            near = np.flatnonzero(np.abs(position[:, axis]) < 2.0 * spacing[owner])
            image = position[near].copy()
            image[:, axis] *= -1.0
            position, owner = np.concatenate([position, image]), np.concatenate([owner, owner[near]])
        return position, owner

    def off_walls(self, points: np.ndarray, spacing: np.ndarray) -> np.ndarray:
        """Points off the walls, and ``OFF`` spacings off the mirrors."""
        points = self.whole.off_walls(points, spacing)
        for axis in self.axes:
            points[:, axis] = np.maximum(points[:, axis], OFF * spacing)
        return points
