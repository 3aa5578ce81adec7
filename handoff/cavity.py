"""Size of the cavity below the datum from the heights of even columns: radius, depth, volume, rim."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from handoff.domain import Cone, Domain

_SECTORS = 12
# the radius is taken where the wall is this fraction of the depth below the datum, then carried to the datum along a parabola
_LEVEL = 0.1


@dataclass(frozen=True)
class Cavity:
    """Lengths in m along the datum or the vertical, ``volume`` in m^3 below the datum; all zero when there is no cavity."""

    radius: float
    depth: float
    volume: float
    rim_height: float


def measure(foot: np.ndarray, distance: np.ndarray, height: np.ndarray, domain: Domain, noise: float) -> Cavity:
    """The cavity around the axis.

    ``foot`` (m, 3) even points on the datum, ``distance`` (m,) from the axis, ``height`` (m,) of the surface [m] (NaN: not known); a
    depression shallower than ``noise`` [m] is none. Depth: 3rd percentile of the height inside half the radius. Radius: mean over azimuth
    of the distance at which the wall crosses a tenth of the depth, carried to the datum along a parabola. Volume: inside that distance, of each
    sector's own wall, net of what stands above the datum, so that the roughness of a level surface adds nothing.
    """
    known = np.isfinite(height)
    foot, distance, height = foot[known], distance[known], height[known]
    azimuth = np.arctan2(foot[:, 1], foot[:, 0])
    if len(height) == 0:
        return Cavity(0.0, 0.0, 0.0, 0.0)
    radius, depth = 0.3 * domain.arc, 0.0
    for _ in range(4):
        inner = height[distance < max(0.5 * radius, np.sort(distance)[min(3, len(distance) - 1)])]
        depth = -float(np.percentile(inner, 3))
        if depth < noise:
            return Cavity(0.0, 0.0, 0.0, float(max(0.0, np.percentile(height, 99))))
        walls = _walls(distance, azimuth, height, depth)
        radius = float(walls.mean())
        if radius <= 0.0:
            return Cavity(0.0, 0.0, 0.0, float(max(0.0, np.percentile(height, 99))))
    area = _area(domain) / max(known.size, 1)
    inside = height[distance < walls[_sector(azimuth)]]
    if isinstance(domain, Cone):
        volume = float(np.sum((domain.datum**3 - (domain.datum + inside) ** 3) / 3.0) * area / domain.datum**2)
    else:
        volume = float(np.sum(-inside) * area)
    crest = height[(distance > 0.8 * radius) & (distance < 1.6 * radius)]
    return Cavity(radius, depth, volume, float(np.percentile(crest, 60)) if len(crest) else 0.0)


def _sector(azimuth: np.ndarray) -> np.ndarray:
    return np.minimum((_SECTORS * (azimuth + math.pi) / (2.0 * math.pi)).astype(int), _SECTORS - 1)


def _walls(distance: np.ndarray, azimuth: np.ndarray, height: np.ndarray, depth: float) -> np.ndarray:
    """Radius at the datum of each sector, 0 where it has no cavity; by the area of the columns that lie deep, without a gap from the axis outwards."""
    sector = _sector(azimuth)
    walls = np.zeros(_SECTORS)
    for k in range(_SECTORS):
        mine = np.flatnonzero(sector == k)
        mine = mine[np.argsort(distance[mine])]
        deep = height[mine] < -_LEVEL * depth
        # the wall: the step that best separates deep columns inside from shallow ones outside
        edge = int(np.argmax(np.r_[0, np.cumsum(np.where(deep, 1, -1))]))
        if edge > 0:
            outer = distance[mine[edge]] if edge < len(mine) else distance[mine[-1]]
            walls[k] = 0.5 * (distance[mine[edge - 1]] + outer)
    return walls / math.sqrt(1.0 - _LEVEL)


def _area(domain: Domain) -> float:
    """Area of the datum inside the domain [m^2]."""
    if isinstance(domain, Cone):
        return 2.0 * math.pi * domain.datum**2 * (1.0 - math.cos(domain.half_angle))
    return math.pi * domain.radius**2
