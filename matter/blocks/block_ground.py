"""The ground that holds blocks: points in it, its volume, and how deep a point lies below its surface and sides."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from matter.case.body import Target
from matter.errors import InputError
from matter.geometry.ground_region import OF_TARGET
from matter.points.regions import Interior, Slab
from matter.solids.distance import measured

SAMPLES = 400_000
"""Points by which the share of the ground within a distance is counted: to 0.2 %."""


class Ground(NamedTuple):
    """``points(rng, count)`` (n, 3) [m] even in what may hold blocks; its ``volume`` [m^3]; ``depth(points)`` (n,) [m]
    below the nearest surface or side, positive inside; ``surface(x, y)`` [m] the height of the surface there."""

    points: Callable[[np.random.Generator, int], np.ndarray]
    volume: float
    depth: Callable[[np.ndarray], np.ndarray]
    surface: Callable[[float, float], float]
    extent: float


def holding_blocks(target: Target, within: float | None) -> Ground:
    """The ground of a ``target`` within a distance [m] of the impact point (None: all of it). Raises
    ``InputError``."""
    whole = _solid(target) if target.solid else _flat(target)
    if within is None:
        return whole
    site = np.array(target.impact_point)

    def near(points: np.ndarray) -> np.ndarray:
        return np.linalg.norm(points - site, axis=1) < within

    sample = whole.points(np.random.default_rng(0), SAMPLES)
    fraction = float(near(sample).mean())
    volume = whole.volume * fraction
    if target.flat and within <= min(target.radius, target.half_width):
        volume = 2.0 / 3.0 * math.pi * within**3
    elif fraction == 0.0:
        raise InputError(f"[target.blocks] within: {within:.4g} m holds no ground")

    def random_points(rng: np.random.Generator, count: int) -> np.ndarray:
        """In the cube about the ball of ``within``; what lies outside the ground is left out."""
        found = np.empty((0, 3))
        while len(found) < count:
            trial = site + within * (2.0 * rng.random((count, 3)) - 1.0)
            found = np.concatenate([found, trial[near(trial) & (whole.depth(trial) > 0.0)]])
        return found[:count]

    return Ground(random_points, volume, whole.depth, whole.surface, within)


def _flat(target: Target) -> Ground:
    bottom = -target.radius
    radius = target.radius if target.shape == "half_sphere" else target.half_width
    region = Slab(OF_TARGET[target.shape], radius, bottom, 0.0)

    def depth(points: np.ndarray) -> np.ndarray:
        x, y, z = points.T
        if target.shape == "half_sphere":
            return np.minimum(-z, target.radius - np.linalg.norm(points, axis=1))
        side = np.hypot(x, y) if target.shape == "half_space" else np.maximum(np.abs(x), np.abs(y))
        return np.minimum(np.minimum(-z, z - bottom), target.half_width - side)

    return Ground(region.random_points, region.volume, depth, lambda x, y: 0.0, max(target.radius, target.half_width))


def _solid(target: Target) -> Ground:
    placed = target.placed
    try:
        distance = measured(placed.solid, site=np.array([0.0, 0.0, placed.height]))
    except InputError as reason:
        raise InputError(f"[target] file: {reason}") from None
    inside = Interior(placed.solid, distance)

    def depth(points: np.ndarray) -> np.ndarray:
        return distance.at(points)[0]

    def surface(x: float, y: float) -> float:
        top, bottom = placed.solid.extent, -placed.solid.extent
        heights = np.linspace(top, bottom, 4001)
        within = depth(np.stack([np.full(4001, x), np.full(4001, y), heights], axis=1)) > 0.0
        if not within.any():
            raise InputError(f"[target.blocks] placed: no ground of the body lies under ({x:.4g}, {y:.4g}) m")
        return float(heights[np.argmax(within)])

    return Ground(inside.random_points, inside.volume, depth, surface, placed.solid.extent)
