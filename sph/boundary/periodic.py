"""Periodic along one axis: what leaves at ``high`` comes in at ``low``.

x' = x + L  near ``low``,   x' = x - L  near ``high``,   L = high - low;   v' = v,  sigma' = sigma
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from matter.errors import InputError

WORDS = "what leaves comes in at the other end (block only)"
TAKES_MOMENTUM, NEEDS_BLOCK = False, True


class Periodic(NamedTuple):
    """``axis`` 0, 1 or 2; ``low`` < ``high`` [m]."""

    axis: int
    low: float
    high: float

    @property
    def image_speed(self) -> float:
        """Zero: the planes stay."""
        return 0.0

    @property
    def period(self) -> float:
        """L [m]."""
        return self.high - self.low

    def images(self, x: np.ndarray, reach: np.ndarray, most: float, time: float):
        """Indices, sign, shift [m] and drift [m/s] along the axis of what lies within 0.5 (``reach`` + ``most``) of an
        end; ``x`` (n,) along the axis.

        Raises ``InputError`` when the period is shorter than the largest support: a particle would meet its own image.
        """
        period = self.period
        if period < most:
            raise InputError(
                f"the period of {period:.4g} m along {'xyz'[self.axis]} is below the largest support, {most:.4g} m: "
                f"widen it or refine the particles"
            )
        cut = 0.5 * (reach + most)
        for end, shift in ((x - self.low < cut, period), (self.high - x < cut, -period)):
            yield np.flatnonzero(end), 1.0, shift, 0.0

    def wrap(self, x: np.ndarray) -> None:
        """Bring positions along the axis (n,) back between the ends, in place."""
        out = (x < self.low) | (x >= self.high)
        x[out] -= (self.high - self.low) * np.floor((x[out] - self.low) / (self.high - self.low))


def planes(axis: int, low: float, high: float) -> tuple[Periodic]:
    """The one plane that joins both ends."""
    return (Periodic(axis, low, high),)
