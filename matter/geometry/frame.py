"""Frames: which way is up, how high, how far along the surface.

Two frames serve every stage: ``Plane`` (a flat target, +z up, datum at z = 0) and ``Sphere`` (a body of radius R about
a centre, with a pole that marks the impact). Heights are along the local normal, distances along the arc of the datum.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Plane:
    """Flat datum z = ``level`` [m]; distance is measured in the plane from the axis through ``origin`` (x, y)."""

    level: float = 0.0
    origin: tuple[float, float] = (0.0, 0.0)

    def up(self, position: np.ndarray) -> np.ndarray:
        """Unit vectors of the local vertical, shape (n, 3)."""
        return np.broadcast_to(np.array([0.0, 0.0, 1.0]), np.shape(position)).copy()

    def height(self, position: np.ndarray) -> np.ndarray:
        """Height above the datum [m], shape (n,)."""
        return np.asarray(position)[:, 2] - self.level

    def distance(self, position: np.ndarray) -> np.ndarray:
        """Distance from the axis along the datum [m], shape (n,)."""
        return np.hypot(position[:, 0] - self.origin[0], position[:, 1] - self.origin[1])

    def azimuth(self, position: np.ndarray) -> np.ndarray:
        """Azimuth about the axis [rad] in (-pi, pi], 0 along +x (downrange of an oblique impact)."""
        return np.arctan2(position[:, 1] - self.origin[1], position[:, 0] - self.origin[0])


@dataclass(frozen=True)
class Sphere:
    """Spherical datum of ``radius`` [m] about ``centre``; the pole (impact point) is on +z as seen from the centre."""

    radius: float
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def _relative(self, position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        relative = np.asarray(position) - np.asarray(self.centre)
        return relative, np.linalg.norm(relative, axis=1)

    def up(self, position: np.ndarray) -> np.ndarray:
        """Unit vectors of the local vertical, shape (n, 3)."""
        relative, r = self._relative(position)
        return relative / np.maximum(r, 1e-300)[:, None]

    def height(self, position: np.ndarray) -> np.ndarray:
        """Height above the datum [m], shape (n,)."""
        return self._relative(position)[1] - self.radius

    def distance(self, position: np.ndarray) -> np.ndarray:
        """Arc length on the datum from the pole [m], shape (n,)."""
        relative, _ = self._relative(position)
        return self.radius * np.arctan2(np.hypot(relative[:, 0], relative[:, 1]), relative[:, 2])

    def azimuth(self, position: np.ndarray) -> np.ndarray:
        """Azimuth about the pole [rad] in (-pi, pi], 0 along +x (downrange of an oblique impact)."""
        relative, _ = self._relative(position)
        return np.arctan2(relative[:, 1], relative[:, 0])
