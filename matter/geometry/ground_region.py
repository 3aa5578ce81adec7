"""Regions of ground: a cone of a sphere about its centre, and an upright bowl, box or cylinder of flat ground.

Beds of grains fill them, and what is handed over to a bed is counted in them. Heights are distances from the body's
centre, or z: the floor lies at ``floor``, undisturbed ground ends at ``datum``, the region at ``top``. Above the datum
the headroom goes on with the same sides: what crosses them there, or goes through them, has left. A layer along the
sides is damped, so that waves do not come back from them.

A snapshot of grains records its region in the attribute ``domain`` (``KEYS`` of each kind), and its kind in ``frame``.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np

from matter.errors import InputError
from matter.geometry.frame import Plane, Sphere

SHAPES = ("bowl", "box", "cylinder")
"""Of upright regions."""
OF_TARGET = {"half_sphere": "bowl", "half_space": "cylinder", "block": "box"}
"""The shape of a flat ``[target]``."""
_GOLDEN = math.pi * (1.0 + math.sqrt(5.0))


class Region(ABC):
    """What cones and upright regions have alike; positions are (n, 3) [m], results (n,). ``damped_width`` [m] and
    ``damping_rate`` [1/s] are those of the damped layer."""

    KEYS: ClassVar[dict[str, str]]
    """Fields by their keys in a snapshot's attribute ``domain``."""
    GEOMETRY: ClassVar[tuple[str, ...]]
    """The keys among them that bound the volume: all that a bed made elsewhere must have."""
    floor: float
    datum: float
    top: float
    damped_width: float
    damping_rate: float

    @property
    @abstractmethod
    def frame(self) -> Plane | Sphere:
        """That of heights above the datum."""

    def as_attribute(self) -> dict[str, Any]:
        """Plain values for a snapshot's attribute ``domain``."""
        return {key: getattr(self, name) for key, name in self.KEYS.items()}

    @classmethod
    def of_attribute(cls, table: Mapping[str, Any], needed: tuple[str, ...] = ()) -> Self:
        """The region that a snapshot records; of its ``KEYS`` only those ``needed`` must be there, if any are named.

        Raises ``InputError`` naming what is missing, or when the numbers do not bound a volume.
        """
        if missing := [key for key in needed or cls.KEYS if key not in table]:
            raise InputError(f"the snapshot's attribute 'domain' lacks {', '.join(missing)}")
        values: dict[str, Any] = {
            name: (str if name == "shape" else int if name.endswith("species") else float)(table[key])
            for key, name in cls.KEYS.items()
            if key in table
        }
        wide = values.get("radius", 1.0) > 0.0 and 0.0 < values.get("half_angle", 1.0) <= math.pi
        if not (values["floor"] < values["datum"] <= values["top"] and wide):
            raise InputError(f"the snapshot's attribute 'domain' bounds no volume: {dict(table)}")
        return cls(**values)

    @property
    def span(self) -> tuple[float, float]:
        """Heights above the datum [m] of floor and top."""
        return self.floor - self.datum, self.top - self.datum

    @property
    def pole(self) -> np.ndarray:
        """Point of the datum (3,) [m] where the projectile hit."""
        return np.array([0.0, 0.0, self.datum])

    def raised(self, by: float) -> Self:
        """The same with its top farther up [m]."""
        return replace(self, top=self.top + by)  # type: ignore[type-var]

    @abstractmethod
    def height(self, position: np.ndarray) -> np.ndarray:
        """Distance from the centre, or z [m]."""

    def along(self, position: np.ndarray) -> np.ndarray:
        """Distance from the axis, along the datum [m]."""
        return self.frame.distance(position)

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

    def depth_along(self, position: np.ndarray) -> np.ndarray:
        """Distance from the sides along the datum [m], positive inside; that of upright ones is ``side_depth``."""
        return self.side_depth(position)

    def drag(self, position: np.ndarray) -> np.ndarray:
        """Damping rate [1/s]: rises with the square of the depth into the damped layer."""
        if self.damped_width <= 0.0:
            return np.zeros(len(position))
        return self.damping_rate * np.clip(1.0 - self.depth_along(position) / self.damped_width, 0.0, 1.0) ** 2

    # the ground does not move (``handoff.domains.whole_body`` is one that turns)

    def flow(self, position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """Velocity (n, 3) [m/s] against the ground at rest: the ``velocity`` itself."""
        return velocity

    def inertial(self, position: np.ndarray, velocity: np.ndarray, spin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Velocities (n, 3) [m/s] and spins (n, 3) [rad/s] of what has these against the ground: the same."""
        return velocity, spin

    def pace(self, position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """Speed (n,) [m/s] that errors of momentum count against: that of the flow."""
        return np.asarray(np.linalg.norm(velocity, axis=1))


@dataclass(frozen=True)
class Cone(Region):
    """Between two spheres about the origin [m], inside ``half_angle`` [rad] of +z; the datum is a sphere between
    them. Gravity and the cone are both radial, so the cone carries no weight."""

    KEYS: ClassVar[dict[str, str]] = {
        "core_radius_m": "floor", "datum_radius_m": "datum", "top_radius_m": "top",
        "cone_half_angle_rad": "half_angle", "damped_width_m": "damped_width", "damping_rate_1_s": "damping_rate",
        "core_species": "floor_species",
    }  # fmt: skip
    GEOMETRY = ("core_radius_m", "datum_radius_m", "top_radius_m", "cone_half_angle_rad")
    floor: float
    datum: float
    top: float
    half_angle: float
    damped_width: float = 0.0
    damping_rate: float = 0.0
    floor_species: int = -1

    def as_attribute(self) -> dict[str, Any]:
        return {**super().as_attribute(), "arc_radius_m": self.arc}

    def inset(self, by: float) -> Cone:
        """The same without a layer of this width [m] along floor, cone and top; the cone is narrower by the same angle
        all along."""
        return replace(self, floor=self.floor + by, top=self.top - by, half_angle=self.half_angle - by / self.datum)

    @property
    def frame(self) -> Sphere:
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

    @property
    def volume(self) -> float:
        """Volume [m^3]."""
        return 2.0 * math.pi / 3.0 * (1.0 - math.cos(self.half_angle)) * (self.top**3 - self.floor**3)

    def volume_between(self, low: float, high: float) -> float:
        """Volume between two radii [m^3]."""
        return self.solid_angle * (high**3 - low**3) / 3.0

    def height(self, position: np.ndarray) -> np.ndarray:
        return np.linalg.norm(position, axis=1)

    def polar_angle(self, position: np.ndarray) -> np.ndarray:
        """Angle from the axis [rad]."""
        return np.arctan2(np.hypot(position[:, 0], position[:, 1]), position[:, 2])

    def side_depth(self, position: np.ndarray) -> np.ndarray:
        inwards = np.clip(self.half_angle - self.polar_angle(position), -math.pi / 2, math.pi / 2)
        return self.height(position) * np.sin(inwards)

    def depth_along(self, position: np.ndarray) -> np.ndarray:
        return (self.half_angle - self.polar_angle(position)) * self.datum

    def between(self, position: np.ndarray) -> np.ndarray:
        """(n,) whether each point lies between the faces that are interfaces: floor and top."""
        radius = self.height(position)
        return (radius > self.floor) & (radius < self.top)

    def cut_depth(self, position: np.ndarray) -> np.ndarray:
        """(n,) distance [m] to the nearest face that cuts through uniform matter, positive inside: here the side.

        The floor is the surface of the core, an interface that particles do not straddle.
        """
        return self.side_depth(position)

    def on_datum(self, point: np.ndarray) -> np.ndarray:
        """The point of the datum (3,) [m] below or above a ``point`` (3,)."""
        return np.asarray(point * (self.datum / np.linalg.norm(point)))

    def polar(self, position: np.ndarray, centre: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Distance along the datum [m] and azimuth [rad] of points (n, 3) about a ``centre`` on the datum."""
        up, east, north = _compass(self.frame, centre)
        x, y = position @ east, position @ north
        return self.datum * np.arctan2(np.hypot(x, y), position @ up), np.arctan2(y, x)

    def volume_below(self, height: np.ndarray, area: float) -> float:
        """Volume [m^3] between the datum and ``height`` (n,) [m] over columns of this ``area`` [m^2] each, positive
        below the datum."""
        return float(np.sum((self.datum**3 - (self.datum + height) ** 3) / 3.0) * area / self.datum**2)

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


def _compass(frame: Plane | Sphere, centre: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Up, east (towards +x) and north at a ``centre`` on the datum."""
    up = frame.up(centre[None])[0]
    east = np.array([1.0, 0.0, 0.0]) - up[0] * up
    east /= np.linalg.norm(east)
    return up, east, np.cross(up, east)


def _directions(cosine: np.ndarray, azimuth: np.ndarray) -> np.ndarray:
    """Unit vectors (n, 3) at these angles."""
    sine = np.sqrt(1.0 - cosine**2)
    return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine], axis=1)


@dataclass(frozen=True)
class Upright(Region):
    """``shape`` one of ``SHAPES``, about the z axis; ``radius`` of bowl or cylinder, half the width of a box [m]. A
    bowl is a half-sphere below the datum, with upright sides above it. ``side_species`` is that of the sides."""

    KEYS: ClassVar[dict[str, str]] = {
        "shape": "shape", "radius_m": "radius", "floor_m": "floor", "top_m": "top", "datum_m": "datum",
        "damped_width_m": "damped_width", "damping_rate_1_s": "damping_rate", "floor_species": "floor_species",
        "side_species": "side_species",
    }  # fmt: skip
    GEOMETRY = ("radius_m", "floor_m", "datum_m", "top_m")
    shape: str
    radius: float
    floor: float
    top: float
    datum: float = 0.0
    damped_width: float = 0.0
    damping_rate: float = 0.0
    floor_species: int = -1
    side_species: int = -1

    def __post_init__(self) -> None:
        if self.shape not in SHAPES:
            raise InputError(f"unknown shape {self.shape!r} of a region of flat ground ({', '.join(SHAPES)})")
        if not (self.radius > 0.0 and self.floor < self.datum <= self.top):
            raise InputError(
                f"a {self.shape} of radius {self.radius:.6g} m between {self.floor:.6g} and {self.top:.6g} m holds "
                f"nothing below z = {self.datum:.6g} m"
            )
        if self.shape == "bowl" and self.floor != self.datum - self.radius:
            raise InputError(
                f"a bowl is as deep as its radius: radius {self.radius:.6g} m, floor at {self.floor:.6g} m"
            )

    def inset(self, by: float) -> Upright:
        """The same shape without a layer of this width [m] along floor, sides and top."""
        return replace(self, radius=self.radius - by, floor=self.floor + by, top=max(self.top - by, 0.0))

    def part(self, radius: float) -> Upright:
        """The disc of this ``radius`` [m] about the axis."""
        return replace(self, shape="cylinder", radius=radius)

    @property
    def frame(self) -> Plane:
        return Plane(self.datum)

    @property
    def arc(self) -> float:
        """Distance along the datum from the axis to the side [m]."""
        return self.radius

    @property
    def area(self) -> float:
        """Area of the datum inside [m^2]."""
        return float(self.cross_section(np.array(self.datum)))

    @property
    def volume(self) -> float:
        """Volume [m^3]."""
        return float(self.volume_between(self.floor, self.top))

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

    def side_depth(self, position: np.ndarray) -> np.ndarray:
        if self.shape == "box":
            return self.radius - np.abs(position[:, :2]).max(axis=1)
        across = self.along(position)
        if self.shape == "cylinder":
            return self.radius - across
        low = np.linalg.norm(position - np.array([0.0, 0.0, self.datum]), axis=1)
        return self.radius - np.where(position[:, 2] < self.datum, low, across)

    def between(self, position: np.ndarray) -> np.ndarray:
        """(n,) whether each point lies between the faces that are interfaces: below the top."""
        return position[:, 2] < self.top

    def cut_depth(self, position: np.ndarray) -> np.ndarray:
        """(n,) distance [m] to the nearest face that cuts through uniform matter, positive inside: side and floor."""
        return self.wall_depth(position)

    def on_datum(self, point: np.ndarray) -> np.ndarray:
        """The point of the datum (3,) [m] below or above a ``point`` (3,)."""
        return np.array([point[0], point[1], self.datum])

    def polar(self, position: np.ndarray, centre: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Distance along the datum [m] and azimuth [rad] of points (n, 3) about a ``centre`` on the datum."""
        _, east, north = _compass(self.frame, centre)
        x, y = position @ east, position @ north
        x, y = x - centre @ east, y - centre @ north
        return np.hypot(x, y), np.arctan2(y, x)

    def volume_below(self, height: np.ndarray, area: float) -> float:
        """Volume [m^3] between the datum and ``height`` (n,) [m] over columns of this ``area`` [m^2] each, positive
        below the datum."""
        return float(np.sum(-height) * area)

    def drawn_in(self, position: np.ndarray, radius: np.ndarray) -> np.ndarray:
        """Centres (n, 3) [m] of grains of these radii (n,) [m]; those within their radius of floor, sides or top are
        moved inwards until they touch."""
        x, y, z = position.T
        reach = self.radius - radius
        z = np.minimum(z, self.top - radius)
        if self.shape != "bowl":
            z = np.maximum(z, self.floor + radius)
        if self.shape == "box":
            return np.column_stack([np.clip(x, -reach, reach), np.clip(y, -reach, reach), z])
        distance = np.hypot(np.hypot(x, y), np.minimum(z, 0.0) if self.shape == "bowl" else 0.0)
        inwards = np.minimum(reach / np.maximum(distance, 1e-300), 1.0)
        return np.column_stack(
            [x * inwards, y * inwards, np.where(z < 0.0, z * inwards, z) if self.shape == "bowl" else z]
        )

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
