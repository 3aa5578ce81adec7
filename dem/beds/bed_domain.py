"""The piece of the body that the grains fill: above the core, inside a cone with its apex at the centre, up to a
headroom.

Gravity and the cone are both radial, so the cone carries no weight; beyond its upper end (``top_radius``) the domain
is open, and what crosses its side there, or the cone itself, has left. The outermost grains are damped so that waves
do not come back from the cone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from dem.contact.walls import CONE, SPHERE_INSIDE, SPHERE_OUTSIDE, Wall
from matter.errors import InputError

_KEYS = (
    "core_radius_m",
    "datum_radius_m",
    "top_radius_m",
    "cone_half_angle_rad",
    "damped_width_m",
    "damping_rate_1_s",
    "core_species",
)


@dataclass(frozen=True)
class Domain:
    """Radii from the centre [m], half angle of the cone [rad], arc radius along the datum [m], damped width [m] and
    its rate [1/s]."""

    core_radius: float
    datum_radius: float
    top_radius: float
    half_angle: float
    damped_width: float
    damping_rate: float
    core_species: int

    @property
    def solid_angle(self) -> float:
        """Solid angle of the cone [sr]."""
        return 2.0 * math.pi * (1.0 - math.cos(self.half_angle))

    @property
    def floor(self) -> float:
        """``core_radius``: heights in a body are distances from its centre."""
        return self.core_radius

    @property
    def datum(self) -> float:
        """``datum_radius``."""
        return self.datum_radius

    @property
    def top(self) -> float:
        """``top_radius``."""
        return self.top_radius

    def height(self, position: np.ndarray) -> np.ndarray:
        """Distance from the centre [m]."""
        return np.linalg.norm(position, axis=1)

    def along(self, position: np.ndarray) -> np.ndarray:
        """Distance from the axis, along the datum [m]."""
        return self.datum_radius * self.polar_angle(position)

    def raised(self, by: float) -> Domain:
        """The same with its top farther out [m]."""
        return replace(self, top_radius=self.top_radius + by)

    def inset(self, by: float) -> Domain:
        """The same without a layer of this width [m] along core, cone and top; the cone is narrower by the same angle
        all along."""
        return replace(
            self,
            core_radius=self.core_radius + by,
            top_radius=self.top_radius - by,
            half_angle=self.half_angle - by / self.datum_radius,
        )

    def volume(self, inner: float, outer: float) -> float:
        """Volume of the domain between two radii [m^3]."""
        return self.solid_angle * (outer**3 - inner**3) / 3.0

    def walls(self) -> tuple[Wall, ...]:
        """Wall 0: the core's surface, rough as its species is; wall 1: the frictionless cone."""
        return (
            Wall(SPHERE_OUTSIDE, radius=self.core_radius, species=self.core_species),
            Wall(CONE, half_angle=self.half_angle, top=self.top_radius),
        )

    def lid(self) -> Wall:
        """The closing sphere while a random packing is made."""
        return Wall(SPHERE_INSIDE, radius=self.top_radius)

    def polar_angle(self, position: np.ndarray) -> np.ndarray:
        """Angle from the axis [rad]."""
        return np.arctan2(np.hypot(position[:, 0], position[:, 1]), position[:, 2])

    def drag(self, position: np.ndarray) -> np.ndarray:
        """Damping rate [1/s]: rises with the square of the depth into the damped layer."""
        if self.damped_width <= 0.0:
            return np.zeros(len(position))
        inside = (self.half_angle - self.polar_angle(position)) * self.datum_radius
        return self.damping_rate * np.clip(1.0 - inside / self.damped_width, 0.0, 1.0) ** 2

    def side_depth(self, position: np.ndarray) -> np.ndarray:
        """Distance from the side of the cone or its extension [m], positive inside."""
        return np.linalg.norm(position, axis=1) * np.sin(self.half_angle - self.polar_angle(position))

    def outside(self, position: np.ndarray) -> np.ndarray:
        """Whether a grain's centre is beyond the side of the cone or its extension."""
        return self.polar_angle(position) > self.half_angle

    def as_attribute(self) -> dict[str, float]:
        """Plain numbers for a snapshot's attribute ``domain``."""
        return {
            "core_radius_m": self.core_radius,
            "datum_radius_m": self.datum_radius,
            "top_radius_m": self.top_radius,
            "cone_half_angle_rad": self.half_angle,
            "arc_radius_m": self.half_angle * self.datum_radius,
            "damped_width_m": self.damped_width,
            "damping_rate_1_s": self.damping_rate,
            "core_species": self.core_species,
        }

    @staticmethod
    def of_attribute(values: dict[str, float]) -> Domain:
        """The domain that a snapshot records."""
        missing = [key for key in _KEYS if key not in values]
        if missing:
            raise InputError(f"the snapshot's attribute 'domain' lacks {', '.join(missing)}")
        core, datum, top, angle, width, rate, species = (values[key] for key in _KEYS)
        return Domain(float(core), float(datum), float(top), float(angle), float(width), float(rate), int(species))
