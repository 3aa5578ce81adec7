"""A rigid, smooth wall square to an axis, at rest or driven as a piston: the matter meets its mirror image.

    x' = 2 w - x,   v_n' = 2 V - v_n,   w = at + V t;   the other components stay, sigma_nt' = -sigma_nt

A particle and its image have the same state, so that the wall feels their pressure and nothing passes through it: no
force along the wall, none of it lost. With V = 0 energy is kept to rounding (the mirrored whole conserves it, and both
halves are alike); a piston does work.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

WORDS = "a smooth mirror (sides of a block only)"
TAKES_MOMENTUM = FLOOR = NEEDS_BLOCK = True


class Wall(NamedTuple):
    """``axis`` 0, 1 or 2, position ``at`` [m] at time 0 and ``speed`` V [m/s] along the axis."""

    axis: int
    at: float
    speed: float = 0.0

    @property
    def period(self) -> float:
        """Infinite: a wall makes one image of a particle."""
        return math.inf

    @property
    def image_speed(self) -> float:
        """Largest speed of an image of matter at rest [m/s]."""
        return 2.0 * abs(self.speed)

    def images(self, x: np.ndarray, reach: np.ndarray, most: float, time: float):
        """Indices, sign, shift at time 0 [m] and drift [m/s] along the axis of what lies within 0.5 (``reach`` +
        ``most``) of the wall; ``x`` (n,)."""
        near = np.abs(x - self.at - self.speed * time) < 0.5 * (reach + most)
        yield np.flatnonzero(near), -1.0, 2.0 * self.at, 2.0 * self.speed

    def wrap(self, x: np.ndarray) -> None:
        """Nothing passes a wall."""


def planes(axis: int, *ends: float) -> tuple[Wall, ...]:
    """A wall at rest at each end [m]."""
    return tuple(Wall(axis, end) for end in ends)
