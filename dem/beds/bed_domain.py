"""What the grains of a bed fill: a cone of a sphere (``Cap``), or a bowl, a box or an upright cylinder of flat ground
(``Container``).

A cap lies above the core, inside a cone with its apex at the centre. Gravity and the cone are both radial, so the cone
carries no weight. A container lies below z = 0, under uniform gravity towards -z; its walls are as rough as the grains
that lie on them (the seed's bowl: the same contact parameters as between grains).

Above the datum the headroom goes on with the same sides to ``top``, where the walls end: what crosses the sides
there, or goes through them, has left. The outermost grains are damped so that waves do not come back from the sides.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dem.contact.walls import CONE, PLANE, SPHERE_INSIDE, SPHERE_OUTSIDE, Wall, cylinder
from matter.errors import InputError
from matter.geometry import ground_region

_CAP = (
    "core_radius_m", "datum_radius_m", "top_radius_m", "cone_half_angle_rad", "damped_width_m", "damping_rate_1_s",
    "core_species",
)  # fmt: skip
_CONTAINER = (
    "shape", "radius_m", "floor_m", "top_m", "datum_m", "damped_width_m", "damping_rate_1_s", "floor_species",
    "side_species",
)  # fmt: skip


def _damping(inside: np.ndarray, width: float, rate: float) -> np.ndarray:
    """Damping rate (n,) [1/s]: rises with the square of the depth into a layer of this ``width`` [m] along the sides;
    ``inside`` (n,): distance from them [m]."""
    return rate * np.clip(1.0 - inside / width, 0.0, 1.0) ** 2 if width > 0.0 else np.zeros(len(inside))


def _values(table: Mapping[str, Any], keys: tuple[str, ...]) -> list[Any]:
    if missing := [key for key in keys if key not in table]:
        raise InputError(f"the snapshot's attribute 'domain' lacks {', '.join(missing)}")
    return [
        str(table[key]) if key == "shape" else int(table[key]) if key.endswith("species") else float(table[key])
        for key in keys
    ]


@dataclass(frozen=True)
class Cap(ground_region.Cone):
    """The cone of a sphere, its damped width [m] and rate [1/s], and the species of the core."""

    damped_width: float = 0.0
    damping_rate: float = 0.0
    core_species: int = -1

    def raised(self, by: float) -> Cap:
        """The same with its top farther out [m]."""
        return replace(self, top=self.top + by)

    def inset(self, by: float) -> Cap:
        """The same without a layer of this width [m] along core, cone and top; the cone is narrower by the same angle
        all along."""
        return replace(self, floor=self.floor + by, top=self.top - by, half_angle=self.half_angle - by / self.datum)

    def walls(self) -> tuple[Wall, ...]:
        """Wall 0: the core's surface, rough as its species is; wall 1: the frictionless cone."""
        return (
            Wall(SPHERE_OUTSIDE, radius=self.floor, species=self.core_species),
            Wall(CONE, half_angle=self.half_angle, top=self.top),
        )

    def lid(self) -> Wall:
        """The closing sphere while a random packing is made."""
        return Wall(SPHERE_INSIDE, radius=self.top)

    def drag(self, position: np.ndarray) -> np.ndarray:
        """Damping rate (n,) [1/s]; depths are along the datum."""
        inside = (self.half_angle - self.polar_angle(position)) * self.datum
        return _damping(inside, self.damped_width, self.damping_rate)

    def as_attribute(self) -> dict[str, float]:
        """Plain numbers for a snapshot's attribute ``domain``."""
        values = (
            self.floor, self.datum, self.top, self.half_angle, self.damped_width, self.damping_rate, self.core_species
        )  # fmt: skip
        return {**dict(zip(_CAP, values)), "arc_radius_m": self.half_angle * self.datum}

    @staticmethod
    def of_attribute(table: Mapping[str, Any]) -> Cap:
        """The domain that a snapshot records."""
        return Cap(*_values(table, _CAP))


@dataclass(frozen=True)
class Container(ground_region.Upright):
    """The container of flat ground, width [m] and rate [1/s] of the damped layer along its sides, species of floor and
    sides."""

    damped_width: float = 0.0
    damping_rate: float = 0.0
    floor_species: int = -1
    side_species: int = -1

    def raised(self, by: float) -> Container:
        """The same with its top higher [m]."""
        return replace(self, top=self.top + by)

    def inset(self, by: float) -> Container:
        """The same shape without a layer of this width [m] along floor, sides and top."""
        return replace(self, radius=self.radius - by, floor=self.floor + by, top=max(self.top - by, 0.0))

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

    def walls(self) -> tuple[Wall, ...]:
        """Wall 0 is what carries the bed: the floor, or the bowl."""
        if self.shape == "bowl":
            side = cylinder(
                self.radius, 0.0, max(self.top, 1e-9 * self.radius), species=self.side_species, rims=(False, False)
            )
            return (Wall(SPHERE_INSIDE, radius=self.radius, top=0.0, species=self.floor_species), side)
        floor = Wall(PLANE, point=(0.0, 0.0, self.floor), species=self.floor_species)
        if self.shape == "cylinder":
            return (floor, cylinder(self.radius, self.floor, self.top, species=self.side_species, rims=(False, False)))
        sides = [
            Wall(PLANE, point=tuple(-self.radius * d), direction=tuple(d), top=self.top, species=self.side_species)
            for d in np.array([[1.0, 0, 0], [-1.0, 0, 0], [0, 1.0, 0], [0, -1.0, 0]])
        ]
        return (floor, *sides)

    def lid(self) -> Wall:
        """The closing plane while a random packing is made."""
        return Wall(PLANE, point=(0.0, 0.0, self.top), direction=(0.0, 0.0, -1.0))

    def drag(self, position: np.ndarray) -> np.ndarray:
        """Damping rate (n,) [1/s]."""
        return _damping(self.side_depth(position), self.damped_width, self.damping_rate)

    def as_attribute(self) -> dict[str, Any]:
        """Plain values for a snapshot's attribute ``domain`` (with the snapshot's ``frame`` = ``plane``)."""
        values = (
            self.shape, self.radius, self.floor, self.top, self.datum, self.damped_width, self.damping_rate,
            self.floor_species, self.side_species,
        )  # fmt: skip
        return dict(zip(_CONTAINER, values))

    @staticmethod
    def of_attribute(table: Mapping[str, Any]) -> Container:
        """The container that a snapshot records."""
        return Container(*_values(table, _CONTAINER))


Domain = Cap | Container
