"""What flies over flat ground beside an engine: parabolas, and the box that holds all that comes down in the container
in time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dem.contact.gravity import Field
from matter.geometry.ground_region import Upright

BOX_LIMIT = 20.0
"""Half the edge of the box at most, in radii of the container."""


@dataclass(frozen=True)
class OverGround:
    """The space over a container (``domain``) under uniform ``gravity`` towards -z."""

    domain: Upright
    gravity: Field

    @property
    def g(self) -> float:
        """Gravity [m/s^2]."""
        return -float(self.gravity.uniform[2])

    def pull(self, x: np.ndarray) -> np.ndarray:
        """Acceleration (n, 3) [m/s^2] at ``x`` (n, 3)."""
        return np.broadcast_to(self.gravity.uniform, x.shape)

    def fall(self, x: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Time [s] until free flight comes down to the top of the container; 0 for what is below it and does not reach
        it."""
        height = x[:, 2] - self.domain.top
        root = v[:, 2] ** 2 + 2.0 * self.g * height
        return np.where(root >= 0.0, np.maximum(v[:, 2] + np.sqrt(np.maximum(root, 0.0)), 0.0) / self.g, 0.0)

    def stays_away(self, x: np.ndarray, v: np.ndarray, rest: float) -> np.ndarray:
        """Mask of what is not down at the container's top within ``rest`` [s], or comes down beside it."""
        time = self.fall(x, v)
        return (time > rest) | self.domain.outside(
            np.column_stack([x[:, :2] + v[:, :2] * time[:, None], np.full(len(x), self.domain.top)])
        )

    def reach(self, x: np.ndarray, v: np.ndarray, rest: float, largest: float) -> float:
        """Half the edge of the box [m]: what rises higher than v^2 / 2 g = g ``rest``^2 / 8 is not down again within
        ``rest`` [s]."""
        del x, v
        widest = max(self.domain.radius, -self.domain.floor, self.domain.top) + 10.0 * largest
        return float(np.clip(self.domain.top + self.g * rest**2 / 8.0, 1.1 * widest, BOX_LIMIT * self.domain.radius))

    def past_side(self, x: np.ndarray, travel: np.ndarray) -> np.ndarray:
        """Mask of what can have left over the sides or through them within ``travel`` (n,) [m]."""
        return np.asarray(self.domain.side_depth(x) < travel)
