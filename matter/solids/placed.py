"""A solid target in the frame of a run: turned so that the line from its centre of mass to the point of impact is +z.

In the body's own frame z is the spin axis (of an ellipsoid its third axis, of a file that of its coordinates);
latitude and longitude are those of the direction from the centre of mass (planetocentric, longitude to the east).
With north n and east e at the site, the projectile flies, seen from above, towards

    f = cos(azimuth) n + sin(azimuth) e

which is +x of the run. ``angle_from_vertical`` a is the angle from the normal N of the surface at the site:

    v = speed (sin a F - cos a N),   F = f without its part along N, of length one
"""

from __future__ import annotations

import math
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from matter.solids import solid
from matter.solids.solid import Solid

PATCH = "patch"
"""Attribute of grains that lie in a patch of a body's ground round the site, laid flat: gravity, density and depth of
it, and how far that goes (``dem.beds.patch``)."""


class Placed(NamedTuple):
    """The body about its centre of mass in the frame of the run; ``height`` [m] of the site on +z, ``normal`` (3,) of
    the surface there, ``spin_axis`` (3,), and ``turn`` (3, 3) from the body's own frame."""

    solid: Solid
    height: float
    normal: np.ndarray
    spin_axis: np.ndarray
    turn: np.ndarray

    def from_site(self, position: np.ndarray) -> np.ndarray:
        """Positions (n, 3) [m] from the site, z along its normal."""
        along = np.array([1.0, 0.0, 0.0]) - self.normal[0] * self.normal
        along /= np.linalg.norm(along)
        frame = np.stack([along, np.cross(self.normal, along), self.normal])
        return (position - [0.0, 0.0, self.height]) @ frame.T

    def spin(self, period: float | None) -> np.ndarray:
        """Angular velocity (3,) [1/s] of a rotation of this ``period`` [s] about the spin axis; none for None."""
        return 2.0 * math.pi / period * self.spin_axis if period else np.zeros(3)

    def over_equator(self, distance: float) -> np.ndarray:
        """Position (3,) [m] at a ``distance`` [m] from the centre of mass over the equator, at longitude 0."""
        return distance * self.turn @ np.array([1.0, 0.0, 0.0])

    def velocity(self, speed: float, angle: float) -> tuple[float, float, float]:
        """Velocity [m/s] of a projectile at ``angle`` [rad] from the vertical of the site."""
        along = np.array([1.0, 0.0, 0.0])
        along -= (along @ self.normal) * self.normal
        along /= np.linalg.norm(along)
        x, y, z = speed * (math.sin(angle) * along - math.cos(angle) * self.normal)
        return float(x), float(y), float(z)


def turn(latitude: float, longitude: float, azimuth: float) -> np.ndarray:
    """Rotation (3, 3) from the body's frame to that of the run; angles [rad]."""
    up = np.array(
        [math.cos(latitude) * math.cos(longitude), math.cos(latitude) * math.sin(longitude), math.sin(latitude)]
    )
    east = np.array([-math.sin(longitude), math.cos(longitude), 0.0])
    flight = math.cos(azimuth) * np.cross(up, east) + math.sin(azimuth) * east
    return np.stack([flight, np.cross(up, flight), up])


def of_file(path: str, unit: float, latitude: float, longitude: float, azimuth: float) -> Placed:
    """The body of a file, its numbers in ``unit`` [m]. Raises ``InputError``."""
    file = Path(path)
    stamp = (file.stat().st_mtime_ns, file.stat().st_size) if file.is_file() else (0, 0)
    return _placed(path, stamp, unit, (0.0, 0.0, 0.0), latitude, longitude, azimuth)


def of_axes(axes: tuple[float, float, float], latitude: float, longitude: float, azimuth: float) -> Placed:
    """An ellipsoid of these full axes [m]."""
    return _placed("", (0, 0), 1.0, axes, latitude, longitude, azimuth)


@lru_cache(maxsize=4)
def _placed(
    path: str,
    stamp: tuple[int, int],
    unit: float,
    axes: tuple[float, float, float],
    latitude: float,
    longitude: float,
    azimuth: float,
) -> Placed:
    body = solid.read(Path(path), unit) if path else solid.ellipsoid(axes)
    rotation = turn(latitude, longitude, azimuth)
    turned = body.turned(rotation)
    position, normal = turned.site(np.array([0.0, 0.0, 1.0]))
    return Placed(turned, float(position[2]), normal, rotation[:, 2].copy(), rotation)
