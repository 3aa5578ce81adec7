"""Grains that grow outwards from the impact in flat ground: fine where matter flows, coarse where the ground only
carries the blanket and the waves, as the shock stage's particles are.

    r(d) = r0                                        within the fine radius: 1.3 expected settled crater radii
    r(d) = r0 + growth (d - fine), at most 2 r0      outside; d: distance from the impact point

r is the mean radius of the grains there, r0 follows from their number. Neighbours are 2 r apart, so that with a growth
of 0.04 each is on average at most 8 % larger than the one before it: less than the spread of radii at one distance.
Springs (k_n ~ r) keep relative overlaps, pressures and the speed of waves even across the sizes.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq

from dem.beds import extent
from matter.case.body import Impact
from matter.geometry.ground_region import Upright

FINE = 1.3
"""Radius of the fine zone over that of the settled crater: rim and walls slump from within it."""
COARSEST = 2.0
"""Largest mean radius over that at the impact: headroom and floor still hold several grains."""
_CELLS = 40


@dataclass(frozen=True)
class Grading:
    """Mean ``radius`` [m] of grains within the distance ``fine`` [m] of the impact, and its ``growth`` per distance
    beyond."""

    radius: float
    fine: float
    growth: float

    def local(self, position: np.ndarray) -> np.ndarray:
        """Mean radius (n,) [m] of the grains at these positions (n, 3) [m]."""
        return self.at(np.linalg.norm(position, axis=1))

    def at(self, distance: np.ndarray) -> np.ndarray:
        """Mean radius (n,) [m] at these distances (n,) [m] from the impact point."""
        grown = self.radius + self.growth * np.maximum(distance - self.fine, 0.0)
        return np.minimum(grown, COARSEST * self.radius)

    def as_attribute(self) -> dict[str, Any]:
        """Plain values for the attribute ``grading`` of bed, start and grains."""
        return {f"{name}_m" if name != "growth" else name: value for name, value in asdict(self).items()}


def solved(
    count: int, spread: float, filled: float, container: Upright, impact: Impact, growth: float
) -> tuple[Grading, float]:
    """The grading at which ``count`` grains, uniform within +-``spread`` about their mean, take the fraction
    ``filled`` of the container; and how many of them lie below the datum.

    count = filled integral dV / (4/3 pi (1 + spread^2) r^3), solved for r0.
    """
    distance, volume, below = _cells(container)
    fine = FINE * extent.settled_radius(impact)
    sphere = 4.0 / 3.0 * np.pi * (1.0 + spread**2)
    alike = float((filled * volume.sum() / (sphere * count)) ** (1.0 / 3.0))

    def numbers(radius: float) -> np.ndarray:
        return filled * volume / (sphere * Grading(radius, fine, growth).at(distance) ** 3)

    def excess(radius: float) -> float:
        return float(numbers(radius).sum()) / count - 1.0

    radius = alike
    if growth > 0.0:
        radius = float(brentq(excess, 0.99 * alike / COARSEST, 1.01 * alike, rtol=1e-12))
    return Grading(radius, fine, growth), float(numbers(radius)[below].sum())


def _cells(container: Upright) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Distance [m] from the impact point, volume [m^3] and whether it lies below the datum, of cells that fill a
    quarter of the container and stand for the whole."""
    across = (np.arange(_CELLS) + 0.5) * container.radius / _CELLS
    parts = []
    for low, high in ((container.floor, 0.0), (0.0, container.top)):
        if high <= low:
            continue
        up = low + (np.arange(_CELLS) + 0.5) * (high - low) / _CELLS
        position = np.stack(np.meshgrid(across, across, up, indexing="ij"), axis=-1).reshape(-1, 3)
        position = position[container.depth_inside(position) > 0.0]
        even = np.full(len(position), container.volume_between(low, high) / len(position))
        parts.append((np.linalg.norm(position, axis=1), even, np.full(len(position), low < 0.0)))
    distance, volume, below = (np.concatenate(column) for column in zip(*parts))
    return distance, volume, below
