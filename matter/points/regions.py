"""Bounded regions of space that points fill: a shell, and slabs (between two heights) of a cylinder, a bowl or a
block.

Each has ``volume`` [m^3], draws points evenly, tells which points are ``inside``, mirrors points at its walls (so that
a relaxing set of points meets them in smooth layers), and keeps points off its walls by a margin.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

Mirrored = tuple[np.ndarray, np.ndarray]
"""Points with their images behind them, (m, 3) [m], and the index of the original of each, (m,)."""


@dataclass(frozen=True)
class Shell:
    """Between the radii ``inner`` and ``outer`` about the origin [m]."""

    inner: float
    outer: float

    @property
    def volume(self) -> float:
        return 4.0 / 3.0 * math.pi * (self.outer**3 - self.inner**3)

    def random_points(self, rng: np.random.Generator, count: int) -> np.ndarray:
        """``count`` random points (n, 3)."""
        direction = rng.normal(size=(count, 3))
        direction /= np.linalg.norm(direction, axis=1)[:, None]
        return (
            direction * ((self.inner**3 + (self.outer**3 - self.inner**3) * rng.random(count)) ** (1.0 / 3.0))[:, None]
        )

    def inside(self, points: np.ndarray) -> np.ndarray:
        """(n,) bool."""
        r = np.linalg.norm(points, axis=1)
        return (r > self.inner) & (r < self.outer)

    def mirrored(self, points: np.ndarray, spacing: np.ndarray) -> Mirrored:
        """Points and their images within two spacings of the walls."""
        r = np.linalg.norm(points, axis=1)
        images, owners = [], []
        for wall in (self.inner, self.outer):
            near = np.flatnonzero((np.abs(r - wall) < 2.0 * spacing) & (wall > 0.0) & (2.0 * wall - r > 0.05 * r))
            images.append(points[near] * ((2.0 * wall - r[near]) / r[near])[:, None])
            owners.append(near)
        return np.concatenate([points, *images]), np.concatenate([np.arange(len(points)), *owners])  # type: ignore[return-value]

    def off_walls(self, points: np.ndarray, spacing: np.ndarray) -> np.ndarray:
        """Points at least a tenth of a spacing off the walls."""
        r = np.linalg.norm(points, axis=1)
        margin = np.minimum(0.1 * spacing, 0.25 * (self.outer - self.inner))
        points *= (np.clip(r, self.inner + margin, self.outer - margin) / r)[:, None]
        return points


def _beyond_walls(points: np.ndarray, spacing: np.ndarray, walls) -> Mirrored:
    """Points and images wall after wall, so that edges and corners have theirs; a wall gives (distance inside, image)
    of points."""
    position, owner = points, np.arange(len(points))
    for wall in walls:
        distance, image = wall(position)
        near = np.flatnonzero(np.abs(distance) < 2.0 * spacing[owner])
        position, owner = np.concatenate([position, image[near]]), np.concatenate([owner, owner[near]])
    return position, owner


def _plane(axis: int, at: float):
    def wall(points: np.ndarray) -> Mirrored:
        image = points.copy()
        image[:, axis] = 2.0 * at - points[:, axis]
        return np.abs(points[:, axis] - at), image

    return wall


def _margin(spacing: np.ndarray, thickness: float) -> np.ndarray:
    return np.minimum(0.1 * spacing, 0.25 * thickness)


@dataclass(frozen=True)
class Cylinder:
    """Upright cylinder of ``radius`` about the z axis between the heights ``bottom`` and ``top`` [m]."""

    radius: float
    bottom: float
    top: float

    @property
    def volume(self) -> float:
        return math.pi * self.radius**2 * (self.top - self.bottom)

    def random_points(self, rng: np.random.Generator, count: int) -> np.ndarray:
        """``count`` random points (n, 3)."""
        r, azimuth = self.radius * np.sqrt(rng.random(count)), 2.0 * math.pi * rng.random(count)
        return np.stack(
            [r * np.cos(azimuth), r * np.sin(azimuth), self.bottom + (self.top - self.bottom) * rng.random(count)],
            axis=1,
        )

    def inside(self, points: np.ndarray) -> np.ndarray:
        """(n,) bool."""
        return (
            (np.hypot(points[:, 0], points[:, 1]) < self.radius)
            & (points[:, 2] >= self.bottom)
            & (points[:, 2] < self.top)
        )

    def mirrored(self, points: np.ndarray, spacing: np.ndarray) -> Mirrored:
        """Points and their images within two spacings of the walls."""

        def side(position: np.ndarray) -> Mirrored:
            r = np.hypot(position[:, 0], position[:, 1])
            return np.abs(self.radius - r), position * np.stack(
                [*[(2.0 * self.radius - r) / np.maximum(r, 1e-300)] * 2, np.ones(len(r))], axis=1
            )

        return _beyond_walls(points, spacing, (_plane(2, self.bottom), _plane(2, self.top), side))

    def off_walls(self, points: np.ndarray, spacing: np.ndarray) -> np.ndarray:
        """Points at least a tenth of a spacing off the walls."""
        margin = _margin(spacing, self.top - self.bottom)
        points[:, 2] = np.clip(points[:, 2], self.bottom + margin, self.top - margin)
        r = np.hypot(points[:, 0], points[:, 1])
        points[:, :2] *= np.minimum(1.0, (self.radius - margin) / np.maximum(r, 1e-300))[:, None]
        return points


@dataclass(frozen=True)
class Bowl:
    """The part of a ball of ``radius`` about the origin between the heights ``bottom`` and ``top`` <= 0 [m]."""

    radius: float
    bottom: float
    top: float

    @property
    def volume(self) -> float:
        def below(z: float) -> float:
            return math.pi * (self.radius**2 * z - z**3 / 3.0)

        return below(self.top) - below(self.bottom)

    def random_points(self, rng: np.random.Generator, count: int) -> np.ndarray:
        """``count`` random points (n, 3)."""
        box = Cylinder(math.sqrt(self.radius**2 - self.top**2), self.bottom, self.top)
        points = np.empty((0, 3))
        while len(points) < count:
            trial = box.random_points(rng, count)
            points = np.concatenate([points, trial[self.inside(trial)]])
        return points[:count]

    def inside(self, points: np.ndarray) -> np.ndarray:
        """(n,) bool."""
        return (
            (np.einsum("ij,ij->i", points, points) < self.radius**2)
            & (points[:, 2] >= self.bottom)
            & (points[:, 2] < self.top)
        )

    def mirrored(self, points: np.ndarray, spacing: np.ndarray) -> Mirrored:
        """Points and their images within two spacings of the walls."""

        def bowl(position: np.ndarray) -> Mirrored:
            r = np.linalg.norm(position, axis=1)
            return np.abs(self.radius - r), position * ((2.0 * self.radius - r) / np.maximum(r, 1e-300))[:, None]

        planes = [_plane(2, self.top)] + ([_plane(2, self.bottom)] if self.bottom > -self.radius else [])
        return _beyond_walls(points, spacing, (*planes, bowl))

    def off_walls(self, points: np.ndarray, spacing: np.ndarray) -> np.ndarray:
        """Points at least a tenth of a spacing off the walls."""
        margin = _margin(spacing, self.top - self.bottom)
        points[:, 2] = np.clip(points[:, 2], self.bottom + margin, self.top - margin)
        widest = np.sqrt(np.maximum((self.radius - margin) ** 2 - points[:, 2] ** 2, 0.0))
        points[:, :2] *= np.minimum(1.0, widest / np.maximum(np.hypot(points[:, 0], points[:, 1]), 1e-300))[:, None]
        return points


@dataclass(frozen=True)
class Block:
    """Upright square block about the z axis, its edge twice ``half_width``, between the heights ``bottom`` and ``top``
    [m]."""

    half_width: float
    bottom: float
    top: float

    @property
    def volume(self) -> float:
        return 4.0 * self.half_width**2 * (self.top - self.bottom)

    def random_points(self, rng: np.random.Generator, count: int) -> np.ndarray:
        """``count`` random points (n, 3)."""
        low, high = (
            np.array([-self.half_width, -self.half_width, self.bottom]),
            np.array([self.half_width, self.half_width, self.top]),
        )
        return low + (high - low) * rng.random((count, 3))

    def inside(self, points: np.ndarray) -> np.ndarray:
        """(n,) bool."""
        return (
            (np.abs(points[:, :2]) < self.half_width).all(axis=1)
            & (points[:, 2] >= self.bottom)
            & (points[:, 2] < self.top)
        )

    def mirrored(self, points: np.ndarray, spacing: np.ndarray) -> Mirrored:
        """Points and their images within two spacings of the walls."""
        sides = [_plane(axis, side * self.half_width) for axis in (0, 1) for side in (-1, 1)]
        return _beyond_walls(points, spacing, (_plane(2, self.bottom), _plane(2, self.top), *sides))

    def off_walls(self, points: np.ndarray, spacing: np.ndarray) -> np.ndarray:
        """Points at least a tenth of a spacing off the walls."""
        margin = _margin(spacing, self.top - self.bottom)
        points[:, 2] = np.clip(points[:, 2], self.bottom + margin, self.top - margin)
        points[:, :2] = np.clip(points[:, :2], -self.half_width + margin[:, None], self.half_width - margin[:, None])
        return points


Region = Shell | Cylinder | Bowl | Block
Slab = Cylinder | Bowl | Block
