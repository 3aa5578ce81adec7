"""The volume that a granular bed stands for: a cone of a sphere, or an upright region of flat ground.

The bed's own attribute ``domain`` says which: ``core_radius_m, datum_radius_m, top_radius_m, cone_half_angle_rad``
(frame ``sphere``: between the core's surface and the headroom's top, inside a cone about +z with its apex at the
body's centre) or ``radius_m, floor_m, datum_m, top_m`` and ``shape`` (frame ``plane``: ``cylinder``, also when it is
not said, ``box`` or ``bowl``). Frame ``solid`` is the whole of a body of any shape: ``handoff.domains.whole_body``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from handoff.domains import whole_body
from handoff.domains.whole_body import WholeBody
from matter.case.body import Target
from matter.errors import InputError
from matter.geometry import ground_region
from matter.geometry.frame import Plane, Sphere


class _AtRest:
    """Ground that does not move; ``floor``, ``datum`` and ``top`` as in ``matter.geometry.ground_region``."""

    floor: float
    datum: float
    top: float

    @property
    def span(self) -> tuple[float, float]:
        """Heights above the datum [m] of floor and top."""
        return self.floor - self.datum, self.top - self.datum

    @property
    def pole(self) -> np.ndarray:
        """Point of the datum (3,) [m] where the projectile hit."""
        return np.array([0.0, 0.0, self.datum])

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
class Cone(_AtRest, ground_region.Cone):
    """The domain of a bed on a sphere."""

    @property
    def volume(self) -> float:
        """Volume [m^3]."""
        return 2.0 * math.pi / 3.0 * (1.0 - math.cos(self.half_angle)) * (self.top**3 - self.floor**3)

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

    def between(self, position: np.ndarray) -> np.ndarray:
        """(n,) whether each point lies between the faces that are interfaces: core and top."""
        radius = self.height(position)
        return (radius > self.floor) & (radius < self.top)

    def cut_depth(self, position: np.ndarray) -> np.ndarray:
        """(n,) distance [m] to the nearest face that cuts through uniform matter, positive inside: here the side.

        The floor is the surface of the core, an interface that particles do not straddle.
        """
        return self.side_depth(position)


@dataclass(frozen=True)
class Upright(_AtRest, ground_region.Upright):
    """The domain of a bed of flat ground."""

    @property
    def volume(self) -> float:
        """Volume [m^3]."""
        return float(self.volume_between(self.floor, self.top))

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

    def part(self, radius: float) -> Upright:
        """The disc of this ``radius`` [m] about the axis."""
        return replace(self, shape="cylinder", radius=radius)

    def between(self, position: np.ndarray) -> np.ndarray:
        """(n,) whether each point lies between the faces that are interfaces: below the top."""
        return position[:, 2] < self.top

    def cut_depth(self, position: np.ndarray) -> np.ndarray:
        """(n,) distance [m] to the nearest face that cuts through uniform matter, positive inside: side and floor."""
        return self.wall_depth(position)


Domain = Cone | Upright | WholeBody


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
    last, *levels = values if flat else [values[-1], *values[:-1]]
    if not (levels[0] < levels[1] <= levels[2]) or not last > 0.0 or (not flat and last > math.pi):
        raise InputError(f"the bed's attribute 'domain' bounds no volume: {dict(table)}")
    if not flat:
        return Cone(*values)
    shape = str(table.get("shape", "cylinder"))
    if shape not in ground_region.SHAPES:
        raise InputError(f"the bed's attribute 'domain' has an unknown shape {shape!r} (bowl, box or cylinder)")
    radius, floor, datum, top = values
    return Upright(shape, radius, floor, top, datum)
