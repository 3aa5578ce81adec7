"""Bounded regions of space that points fill: a shell, slabs (between two heights) of flat ground, what mirrors leave
of these, and the inside of a solid.

Each has ``volume`` [m^3], draws ``random_points`` (count, 3) evenly, tells which points are ``inside`` (n,), mirrors
points at its walls (so that a relaxing set of points meets them in smooth layers), and keeps points off its walls by a
margin.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from matter.solids.distance import Distance
from matter.solids.solid import Solid

Mirrored = tuple[np.ndarray, np.ndarray]
"""Points with their images behind them, (m, 3) [m], and the index of the original of each, (m,)."""
OFF = 0.25
"""Points keep at least this fraction of a spacing off a mirror: half of it lets them meet it as a layer."""


def _drawn_inside(draw: Callable[[], np.ndarray], region: Slab | Interior, count: int) -> np.ndarray:
    """The first ``count`` (n, 3) of those that ``draw`` gives which lie inside the ``region``."""
    points = np.empty((0, 3))
    while len(points) < count:
        trial = draw()
        points = np.concatenate([points, trial[region.inside(trial)]])
    return points[:count]


@dataclass(frozen=True)
class Shell:
    """Between the radii ``inner`` and ``outer`` about the origin [m]."""

    inner: float
    outer: float

    @property
    def volume(self) -> float:
        return 4.0 / 3.0 * math.pi * (self.outer**3 - self.inner**3)

    def random_points(self, rng: np.random.Generator, count: int) -> np.ndarray:
        direction = rng.normal(size=(count, 3))
        direction /= np.linalg.norm(direction, axis=1)[:, None]
        return (
            direction * ((self.inner**3 + (self.outer**3 - self.inner**3) * rng.random(count)) ** (1.0 / 3.0))[:, None]
        )

    def inside(self, points: np.ndarray) -> np.ndarray:
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


@dataclass(frozen=True)
class Slab:
    """A layer of an upright ``shape`` about the z axis (``matter.geometry.ground_region.SHAPES``) between the heights
    ``bottom`` and ``top`` [m]: ``radius`` of a cylinder, half the width of a box, or of the ball about the origin that
    a bowl is a part of, ``top`` <= 0 [m]."""

    shape: str
    radius: float
    bottom: float
    top: float

    @property
    def volume(self) -> float:
        if self.shape == "bowl":

            def below(z: float) -> float:
                return math.pi * (self.radius**2 * z - z**3 / 3.0)

            return below(self.top) - below(self.bottom)
        return (4.0 if self.shape == "box" else math.pi) * self.radius**2 * (self.top - self.bottom)

    def random_points(self, rng: np.random.Generator, count: int) -> np.ndarray:
        if self.shape == "box":
            low = np.array([-self.radius, -self.radius, self.bottom])
            return low + (np.array([self.radius, self.radius, self.top]) - low) * rng.random((count, 3))
        if self.shape == "cylinder":
            r, azimuth = self.radius * np.sqrt(rng.random(count)), 2.0 * math.pi * rng.random(count)
            height = self.bottom + (self.top - self.bottom) * rng.random(count)
            return np.stack([r * np.cos(azimuth), r * np.sin(azimuth), height], axis=1)
        around = Slab("cylinder", math.sqrt(self.radius**2 - self.top**2), self.bottom, self.top)
        return _drawn_inside(lambda: around.random_points(rng, count), self, count)

    def inside(self, points: np.ndarray) -> np.ndarray:
        if self.shape == "box":
            within = (np.abs(points[:, :2]) < self.radius).all(axis=1)
        elif self.shape == "cylinder":
            within = np.hypot(points[:, 0], points[:, 1]) < self.radius
        else:
            within = np.einsum("ij,ij->i", points, points) < self.radius**2
        return within & (points[:, 2] >= self.bottom) & (points[:, 2] < self.top)

    def mirrored(self, points: np.ndarray, spacing: np.ndarray) -> Mirrored:
        """Points and their images within two spacings of the walls."""
        bottom, top = _plane(2, self.bottom), _plane(2, self.top)
        if self.shape == "box":
            sides = [_plane(axis, side * self.radius) for axis in (0, 1) for side in (-1, 1)]
            return _beyond_walls(points, spacing, (bottom, top, *sides))
        if self.shape == "cylinder":
            return _beyond_walls(points, spacing, (bottom, top, self._round(2)))
        planes = (top, bottom) if self.bottom > -self.radius else (top,)
        return _beyond_walls(points, spacing, (*planes, self._round(3)))

    def _round(self, axes: int):
        """The wall at ``radius`` from the axis (2 ``axes``) or from the origin (3)."""

        def wall(position: np.ndarray) -> Mirrored:
            r = np.hypot(position[:, 0], position[:, 1]) if axes == 2 else np.linalg.norm(position, axis=1)
            image = position.copy()
            image[:, :axes] *= ((2.0 * self.radius - r) / np.maximum(r, 1e-300))[:, None]
            return np.abs(self.radius - r), image

        return wall

    def off_walls(self, points: np.ndarray, spacing: np.ndarray) -> np.ndarray:
        """Points at least a tenth of a spacing off the walls."""
        margin = np.minimum(0.1 * spacing, 0.25 * (self.top - self.bottom))
        points[:, 2] = np.clip(points[:, 2], self.bottom + margin, self.top - margin)
        widest = self.radius - margin
        if self.shape == "box":
            points[:, :2] = np.clip(points[:, :2], -widest[:, None], widest[:, None])
            return points
        if self.shape == "bowl":
            widest = np.sqrt(np.maximum(widest**2 - points[:, 2] ** 2, 0.0))
        points[:, :2] *= np.minimum(1.0, widest / np.maximum(np.hypot(points[:, 0], points[:, 1]), 1e-300))[:, None]
        return points


@dataclass(frozen=True)
class Cut:
    """The part of ``whole`` on the positive side of planes through the axis, which mirror it: where the coordinates of
    ``axes`` are positive."""

    whole: Shell | Slab
    axes: tuple[int, ...]

    @property
    def volume(self) -> float:
        return self.whole.volume / 2 ** len(self.axes)

    def random_points(self, rng: np.random.Generator, count: int) -> np.ndarray:
        points = self.whole.random_points(rng, count)
        for axis in self.axes:
            np.abs(points[:, axis], out=points[:, axis])
        return points

    def inside(self, points: np.ndarray) -> np.ndarray:
        here = self.whole.inside(points)
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


@dataclass(frozen=True, eq=False)
class Interior:
    """The inside of ``solid``; ``distance`` is measured from its surface, behind which images stand."""

    solid: Solid
    distance: Distance

    @property
    def volume(self) -> float:
        return self.solid.volume

    @cached_property
    def _box(self) -> tuple[np.ndarray, np.ndarray]:
        return self.solid.vertices.min(axis=0), self.solid.vertices.max(axis=0)

    def random_points(self, rng: np.random.Generator, count: int) -> np.ndarray:
        low, high = self._box
        return _drawn_inside(lambda: low + (high - low) * rng.random((count, 3)), self, count)

    def inside(self, points: np.ndarray) -> np.ndarray:
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


Region = Shell | Slab | Cut | Interior
