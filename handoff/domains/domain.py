"""The volume that a granular bed stands for: a cone of a sphere, or an upright cylinder on flat ground.

The bed's own attribute ``domain`` says which: ``core_radius_m, datum_radius_m, top_radius_m, cone_half_angle_rad``
(frame ``sphere``: between the core's surface and the headroom's top, inside a cone about +z with its apex at the
body's centre) or ``radius_m, floor_m, datum_m, top_m`` and ``shape`` (frame ``plane``: ``cylinder``, also when it is
not said, ``box`` or ``bowl``). Frame ``solid`` is the whole of a body of any shape: ``handoff.domains.whole_body``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from handoff.domains import whole_body
from handoff.domains.whole_body import WholeBody
from matter.case.body import Target
from matter.errors import InputError
from matter.geometry.frame import Plane, Sphere


class AtRest:
    """What a domain whose ground does not move says of motion."""

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
class Cone(AtRest):
    """Between two spheres about the origin [m], inside ``half_angle`` [rad] of +z; the datum is a sphere between
    them."""

    core: float
    datum: float
    top: float
    half_angle: float

    @property
    def frame(self) -> Sphere:
        return Sphere(self.datum)

    @property
    def volume(self) -> float:
        """Volume [m^3]."""
        return 2.0 * math.pi / 3.0 * (1.0 - math.cos(self.half_angle)) * (self.top**3 - self.core**3)

    @property
    def arc(self) -> float:
        """Arc length on the datum from the axis to the side wall [m]."""
        return self.datum * self.half_angle

    @property
    def span(self) -> tuple[float, float]:
        """Heights above the datum [m] of floor and top."""
        return self.core - self.datum, self.top - self.datum

    @property
    def area(self) -> float:
        """Area of the datum inside the domain [m^2]."""
        return 2.0 * math.pi * self.datum**2 * (1.0 - math.cos(self.half_angle))

    @property
    def pole(self) -> np.ndarray:
        """Point of the datum (3,) [m] where the projectile hit."""
        return np.array([0.0, 0.0, self.datum])

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

    def feet(self, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Even points on the datum (m, 3), about ``count``, their distance along it from the axis (m,), and the
        vertical there (m, 3)."""
        direction, distance = self.columns(count)
        return self.datum * direction, distance, direction

    def depth_inside(self, position: np.ndarray) -> np.ndarray:
        """(n,) distance [m] to the nearest face of the domain, positive inside."""
        radius = np.linalg.norm(position, axis=1)
        return np.minimum(np.minimum(radius - self.core, self.top - radius), self.cut_depth(position))

    def between(self, position: np.ndarray) -> np.ndarray:
        """(n,) whether each point lies between the faces that are interfaces: core and top."""
        radius = np.linalg.norm(position, axis=1)
        return (radius > self.core) & (radius < self.top)

    def cut_depth(self, position: np.ndarray) -> np.ndarray:
        """(n,) distance [m] to the nearest face that cuts through uniform matter, positive inside: here the side.

        The floor is the surface of the core, an interface that particles do not straddle.
        """
        angle = np.arctan2(np.hypot(position[:, 0], position[:, 1]), position[:, 2])
        return np.linalg.norm(position, axis=1) * np.sin(np.clip(self.half_angle - angle, -math.pi / 2, math.pi / 2))

    def wall_depth(self, position: np.ndarray) -> np.ndarray:
        """(n,) distance [m] to the nearest wall of the bed (floor and side), positive inside."""
        return np.minimum(np.linalg.norm(position, axis=1) - self.core, self.cut_depth(position))

    def even_points(self, uniform: np.ndarray, top: float | None = None) -> np.ndarray:
        """Map (n, 3) numbers in the unit cube to points of even density, up to the radius ``top``."""
        low, high = self.core**3, (top or self.top) ** 3
        radius = np.cbrt(low + uniform[:, 0] * (high - low))
        cosine = 1.0 - uniform[:, 1] * (1.0 - math.cos(self.half_angle))
        sine, azimuth = np.sqrt(1.0 - cosine**2), 2.0 * math.pi * uniform[:, 2]
        return radius[:, None] * np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine], axis=1)

    def columns(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """About ``count`` even directions: unit vectors (m, 3) and the arc length on the datum [m] (m,)."""
        number = np.arange(count) + 0.5
        cosine = 1.0 - number / count * (1.0 - math.cos(self.half_angle))
        azimuth = math.pi * (1.0 + math.sqrt(5.0)) * number
        sine = np.sqrt(1.0 - cosine**2)
        return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine], axis=1), self.datum * np.arccos(
            cosine
        )


@dataclass(frozen=True)
class Cylinder(AtRest):
    """Upright cylinder about the z axis on flat ground [m]: heights ``floor`` < ``datum`` <= ``top``."""

    radius: float
    floor: float
    datum: float
    top: float

    @property
    def frame(self) -> Plane:
        return Plane(self.datum)

    @property
    def volume(self) -> float:
        """Volume [m^3]."""
        return math.pi * self.radius**2 * (self.top - self.floor)

    @property
    def arc(self) -> float:
        """Distance along the datum from the axis to the side wall [m]."""
        return self.radius

    @property
    def span(self) -> tuple[float, float]:
        """Heights above the datum [m] of floor and top."""
        return self.floor - self.datum, self.top - self.datum

    @property
    def area(self) -> float:
        """Area of the datum inside the domain [m^2]."""
        return math.pi * self.radius**2

    @property
    def pole(self) -> np.ndarray:
        """Point of the datum (3,) [m] where the projectile hit."""
        return np.array([0.0, 0.0, self.datum])

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

    def feet(self, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Even points on the datum (m, 3), their distance along it from the axis (m,), and the vertical there
        (m, 3)."""
        number = np.arange(count) + 0.5
        distance, azimuth = self.radius * np.sqrt(number / count), np.pi * (1.0 + np.sqrt(5.0)) * number
        foot = np.stack([distance * np.cos(azimuth), distance * np.sin(azimuth), np.full(count, self.datum)], axis=1)
        return foot, distance, self.frame.up(foot)

    def part(self, radius: float) -> Cylinder:
        """The disc of this ``radius`` [m] about the axis."""
        return Cylinder(radius, self.floor, self.datum, self.top)

    def depth_inside(self, position: np.ndarray) -> np.ndarray:
        """(n,) distance [m] to the nearest face of the domain, positive inside."""
        return np.minimum(self.top - position[:, 2], self.cut_depth(position))

    def between(self, position: np.ndarray) -> np.ndarray:
        """(n,) whether each point lies between the faces that are interfaces: below the top."""
        return position[:, 2] < self.top

    def cut_depth(self, position: np.ndarray) -> np.ndarray:
        """(n,) distance [m] to the nearest face that cuts through uniform matter, positive inside: side and floor."""
        return np.minimum(position[:, 2] - self.floor, self.radius - np.hypot(position[:, 0], position[:, 1]))

    def wall_depth(self, position: np.ndarray) -> np.ndarray:
        """(n,) distance [m] to the nearest wall of the bed (floor and side), positive inside."""
        return self.cut_depth(position)

    def even_points(self, uniform: np.ndarray, top: float | None = None) -> np.ndarray:
        """Map (n, 3) numbers in the unit cube to points of even density, up to the height ``top``."""
        height = self.floor + uniform[:, 0] * ((self.top if top is None else top) - self.floor)
        radius, azimuth = self.radius * np.sqrt(uniform[:, 1]), 2.0 * math.pi * uniform[:, 2]
        return np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), height], axis=1)


@dataclass(frozen=True)
class Box(Cylinder):
    """Upright square box, ``radius`` half its width."""

    @property
    def volume(self) -> float:
        """Volume [m^3]."""
        return 4.0 * self.radius**2 * (self.top - self.floor)

    @property
    def area(self) -> float:
        """Area of the datum inside the domain [m^2]."""
        return 4.0 * self.radius**2

    def cut_depth(self, position: np.ndarray) -> np.ndarray:
        """(n,) distance [m] to the nearest side or the floor, positive inside."""
        return np.minimum(position[:, 2] - self.floor, self.radius - np.abs(position[:, :2]).max(axis=1))

    def even_points(self, uniform: np.ndarray, top: float | None = None) -> np.ndarray:
        """Map (n, 3) numbers in the unit cube to points of even density, up to the height ``top``."""
        height = self.floor + uniform[:, 0] * ((self.top if top is None else top) - self.floor)
        return np.column_stack([self.radius * (2.0 * uniform[:, 1:] - 1.0), height])


@dataclass(frozen=True)
class Bowl(Cylinder):
    """Half-sphere of ``radius`` below the datum, upright cylinder above it; ``floor`` = ``datum`` - ``radius``."""

    def _below(self, height: np.ndarray) -> np.ndarray:
        """Volume [m^3] below a height."""
        z = np.minimum(np.asarray(height) - self.datum, 0.0)
        sphere = math.pi * (self.radius**2 * (z + self.radius) - (z**3 + self.radius**3) / 3.0)
        return sphere + math.pi * self.radius**2 * np.maximum(np.asarray(height) - self.datum, 0.0)

    @property
    def volume(self) -> float:
        """Volume [m^3]."""
        return float(self._below(np.array(self.top)))

    def cut_depth(self, position: np.ndarray) -> np.ndarray:
        """(n,) distance [m] to the bowl, above the datum to the side, positive inside."""
        z, across = position[:, 2] - self.datum, np.hypot(position[:, 0], position[:, 1])
        return self.radius - np.where(z < 0.0, np.hypot(across, z), across)

    def even_points(self, uniform: np.ndarray, top: float | None = None) -> np.ndarray:
        """Map (n, 3) numbers in the unit cube to points of even density, up to the height ``top``."""
        heights = np.linspace(self.floor, self.top if top is None else top, 4001)
        below = self._below(heights)
        height = np.interp(uniform[:, 0] * below[-1], below, heights)
        across = np.sqrt(np.maximum(self.radius**2 - np.minimum(height - self.datum, 0.0) ** 2, 0.0) * uniform[:, 1])
        azimuth = 2.0 * math.pi * uniform[:, 2]
        return np.stack([across * np.cos(azimuth), across * np.sin(azimuth), height], axis=1)


Domain = Cone | Cylinder | WholeBody


def _compass(frame: Plane | Sphere, centre: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Up, east (towards +x) and north at a ``centre`` on the datum."""
    up = frame.up(centre[None])[0]
    east = np.array([1.0, 0.0, 0.0]) - up[0] * up
    east /= np.linalg.norm(east)
    return up, east, np.cross(up, east)


def read(attributes: Mapping[str, Any], target: Target | None = None) -> Domain:
    """The domain of a bed from its snapshot attributes; that of a whole body has the surface of the ``target``.

    Raises ``InputError`` naming what is missing, or when the numbers do not bound a volume.
    """
    if attributes.get("frame") == "solid":
        return whole_body.read(attributes, target)
    table = attributes.get("domain")
    if not isinstance(table, Mapping):
        raise InputError(
            "the bed carries no attribute 'domain': core_radius_m, datum_radius_m, top_radius_m, cone_half_angle_rad"
        )
    flat = attributes.get("frame", "sphere") == "plane"
    names = (
        ("radius_m", "floor_m", "datum_m", "top_m")
        if flat
        else ("core_radius_m", "datum_radius_m", "top_radius_m", "cone_half_angle_rad")
    )
    missing = [name for name in names if name not in table]
    if missing:
        raise InputError(f"the bed's attribute 'domain' lacks {', '.join(missing)}")
    values = [float(table[name]) for name in names]
    levels = values[1:] if flat else values[:3]
    last = values[0] if flat else values[3]
    if not (levels[0] < levels[1] <= levels[2]) or not last > 0.0 or (not flat and last > math.pi):
        raise InputError(f"the bed's attribute 'domain' bounds no volume: {dict(table)}")
    if not flat:
        return Cone(*values)
    shape = str(table.get("shape", "cylinder"))
    if shape not in ("bowl", "box", "cylinder"):
        raise InputError(f"the bed's attribute 'domain' has an unknown shape {shape!r} (bowl, box or cylinder)")
    return {"bowl": Bowl, "box": Box, "cylinder": Cylinder}[shape](*values)
