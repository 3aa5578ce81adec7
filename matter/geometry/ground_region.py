"""Regions of ground: a cone of a sphere about its centre, and an upright bowl, box or cylinder of flat ground.

Beds of grains fill them, and what is handed over to a bed is counted in them. Heights are distances from the body's
centre, or z: the floor lies at ``floor``, undisturbed ground ends at ``datum``, the region at ``top``.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np

from matter.errors import InputError
from matter.geometry.frame import Plane, Sphere

SHAPES = ("bowl", "box", "cylinder")
"""Of upright regions."""
OF_TARGET = {"half_sphere": "bowl", "half_space": "cylinder", "block": "box"}
"""The shape of a flat ``[target]``."""
_GOLDEN = math.pi * (1.0 + math.sqrt(5.0))


class Region(ABC):
    """What cones and upright regions have alike; positions are (n, 3) [m], results (n,)."""

    floor: float
    top: float

    @abstractmethod
    def height(self, position: np.ndarray) -> np.ndarray:
        """Distance from the centre, or z [m]."""

    @abstractmethod
    def side_depth(self, position: np.ndarray) -> np.ndarray:
        """Distance from the sides or what they go on as, of a bowl from its wall [m], positive inside."""

    def outside(self, position: np.ndarray) -> np.ndarray:
        """Whether a position is beyond the sides."""
        return self.side_depth(position) < 0.0

    def wall_depth(self, position: np.ndarray) -> np.ndarray:
        """Distance from the nearer of floor and sides [m], positive inside."""
        return np.minimum(self.height(position) - self.floor, self.side_depth(position))

    def depth_inside(self, position: np.ndarray) -> np.ndarray:
        """Distance from the nearest of floor, sides and top [m], positive inside."""
        return np.minimum(self.wall_depth(position), self.top - self.height(position))


@dataclass(frozen=True)
class Cone(Region):
    """Between two spheres about the origin [m], inside ``half_angle`` [rad] of +z; the datum is a sphere between
    them."""

    floor: float
    datum: float
    top: float
    half_angle: float

    @property
    def frame(self) -> Sphere:
        """That of heights above the datum."""
        return Sphere(self.datum)

    @property
    def arc(self) -> float:
        """Arc length on the datum from the axis to the side [m]."""
        return self.datum * self.half_angle

    @property
    def area(self) -> float:
        """Area of the datum inside [m^2]."""
        return 2.0 * math.pi * self.datum**2 * (1.0 - math.cos(self.half_angle))

    @property
    def solid_angle(self) -> float:
        """Solid angle [sr]."""
        return 2.0 * math.pi * (1.0 - math.cos(self.half_angle))

    def volume_between(self, low: float, high: float) -> float:
        """Volume between two radii [m^3]."""
        return self.solid_angle * (high**3 - low**3) / 3.0

    def height(self, position: np.ndarray) -> np.ndarray:
        return np.linalg.norm(position, axis=1)

    def polar_angle(self, position: np.ndarray) -> np.ndarray:
        """Angle from the axis [rad]."""
        return np.arctan2(np.hypot(position[:, 0], position[:, 1]), position[:, 2])

    def along(self, position: np.ndarray) -> np.ndarray:
        """Distance from the axis, along the datum [m]."""
        return self.datum * self.polar_angle(position)

    def side_depth(self, position: np.ndarray) -> np.ndarray:
        inwards = np.clip(self.half_angle - self.polar_angle(position), -math.pi / 2, math.pi / 2)
        return self.height(position) * np.sin(inwards)

    def even_points(self, uniform: np.ndarray) -> np.ndarray:
        """Map (n, 3) numbers in the unit cube to points of even density."""
        low, high = self.floor**3, self.top**3
        radius = np.cbrt(low + uniform[:, 0] * (high - low))
        cosine = 1.0 - uniform[:, 1] * (1.0 - math.cos(self.half_angle))
        return radius[:, None] * _directions(cosine, 2.0 * math.pi * uniform[:, 2])

    def feet(self, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Even points on the datum (m, 3), about ``count``, their distance along it from the axis (m,), and the
        vertical there (m, 3)."""
        number = np.arange(count) + 0.5
        cosine = 1.0 - number / count * (1.0 - math.cos(self.half_angle))
        direction = _directions(cosine, _GOLDEN * number)
        return self.datum * direction, self.datum * np.arccos(cosine), direction


def _directions(cosine: np.ndarray, azimuth: np.ndarray) -> np.ndarray:
    """Unit vectors (n, 3) at these angles."""
    sine = np.sqrt(1.0 - cosine**2)
    return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine], axis=1)


@dataclass(frozen=True)
class Upright(Region):
    """``shape`` one of ``SHAPES``, about the z axis; ``radius`` of bowl or cylinder, half the width of a box [m]. A
    bowl is a half-sphere below the datum, with upright sides above it."""

    shape: str
    radius: float
    floor: float
    top: float
    datum: float = 0.0

    def __post_init__(self) -> None:
        if self.shape not in SHAPES:
            raise InputError(f"no region {self.shape!r} of flat ground (there are {', '.join(SHAPES)})")
        if not (self.radius > 0.0 and self.floor < self.datum <= self.top):
            raise InputError(
                f"a {self.shape} of radius {self.radius:.6g} m between {self.floor:.6g} and {self.top:.6g} m holds "
                f"nothing below z = {self.datum:.6g} m"
            )
        if self.shape == "bowl" and self.floor != self.datum - self.radius:
            raise InputError(
                f"a bowl is as deep as its radius: radius {self.radius:.6g} m, floor at {self.floor:.6g} m"
            )

    @property
    def frame(self) -> Plane:
        """That of heights above the datum."""
        return Plane(self.datum)

    @property
    def arc(self) -> float:
        """Distance along the datum from the axis to the side [m]."""
        return self.radius

    @property
    def area(self) -> float:
        """Area of the datum inside [m^2]."""
        return float(self.cross_section(np.array(self.datum)))

    def cross_section(self, height: np.ndarray) -> np.ndarray:
        """Area at a height [m^2]."""
        if self.shape == "box":
            return np.full(np.shape(height), 4.0 * self.radius**2)
        if self.shape == "cylinder":
            return np.full(np.shape(height), math.pi * self.radius**2)
        return math.pi * (self.radius**2 - np.minimum(height - self.datum, 0.0) ** 2)

    def volume_between(self, low: float, high: Any) -> Any:
        """Volume between two heights [m^3], of which the upper may be an array."""
        if self.shape == "box":
            return 4.0 * self.radius**2 * (high - low)
        if self.shape == "cylinder":
            return math.pi * self.radius**2 * (high - low)
        bottom, upper = low - self.datum, high - self.datum
        a, b = np.minimum(bottom, 0.0), np.minimum(upper, 0.0)
        above = np.maximum(upper, 0.0) - np.maximum(bottom, 0.0)
        return math.pi * (self.radius**2 * (b - a) - (b**3 - a**3) / 3.0) + math.pi * self.radius**2 * above

    def height(self, position: np.ndarray) -> np.ndarray:
        return np.asarray(position[:, 2])

    def along(self, position: np.ndarray) -> np.ndarray:
        """Distance from the axis, along the datum [m]."""
        return np.hypot(position[:, 0], position[:, 1])

    def side_depth(self, position: np.ndarray) -> np.ndarray:
        if self.shape == "box":
            return self.radius - np.abs(position[:, :2]).max(axis=1)
        across = self.along(position)
        if self.shape == "cylinder":
            return self.radius - across
        low = np.linalg.norm(position - np.array([0.0, 0.0, self.datum]), axis=1)
        return self.radius - np.where(position[:, 2] < self.datum, low, across)

    def even_points(self, uniform: np.ndarray) -> np.ndarray:
        """Map (n, 3) numbers in the unit cube to points of even density."""
        height = self.floor + uniform[:, 0] * (self.top - self.floor)
        if self.shape == "box":
            return np.column_stack([self.radius * (2.0 * uniform[:, 1:] - 1.0), height])
        across = self.radius * np.sqrt(uniform[:, 1])
        if self.shape == "bowl":
            heights = np.linspace(self.floor, self.top, 4001)
            below = self.volume_between(self.floor, heights)
            height = np.interp(uniform[:, 0] * below[-1], below, heights)
            wide = np.maximum(self.radius**2 - np.minimum(height - self.datum, 0.0) ** 2, 0.0)
            across = np.sqrt(wide * uniform[:, 1])
        azimuth = 2.0 * math.pi * uniform[:, 2]
        return np.stack([across * np.cos(azimuth), across * np.sin(azimuth), height], axis=1)

    def feet(self, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Even points on the datum (m, 3), their distance along it from the axis (m,), and the vertical there
        (m, 3)."""
        number = np.arange(count) + 0.5
        distance, azimuth = self.radius * np.sqrt(number / count), _GOLDEN * number
        foot = np.stack([distance * np.cos(azimuth), distance * np.sin(azimuth), np.full(count, self.datum)], axis=1)
        return foot, distance, self.frame.up(foot)
