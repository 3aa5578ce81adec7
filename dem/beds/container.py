"""Containers of flat ground: bowl, box and upright cylinder, below z = 0 with the datum at z = 0 and uniform gravity
towards -z.

Above the datum the headroom goes on with upright sides to ``top``, where the walls end: what is thrown over them has
left. All walls are as rough as the grains that lie on them (the seed's bowl: the same contact parameters as between
grains).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dem.contact.walls import PLANE, SPHERE_INSIDE, Wall, cylinder
from matter.errors import InputError

SHAPES = ("bowl", "box", "cylinder")
_KEYS = (
    "shape",
    "radius_m",
    "floor_m",
    "datum_m",
    "top_m",
    "damped_width_m",
    "damping_rate_1_s",
    "floor_species",
    "side_species",
)


@dataclass(frozen=True)
class Container:
    """``shape`` one of ``SHAPES``; ``radius`` of bowl or cylinder, half the width of a box [m]; heights of floor (the
    bowl's: -radius) and of the walls' top [m]; width [m] and rate [1/s] of the damped layer along the sides; species
    of floor and sides."""

    shape: str
    radius: float
    floor: float
    top: float
    damped_width: float = 0.0
    damping_rate: float = 0.0
    floor_species: int = -1
    side_species: int = -1

    def __post_init__(self) -> None:
        if self.shape not in SHAPES:
            raise InputError(f"no container {self.shape!r} (there are {', '.join(SHAPES)})")
        if not (self.radius > 0.0 and self.floor < 0.0 <= self.top):
            raise InputError(
                f"a {self.shape} of radius {self.radius:.6g} m between {self.floor:.6g} and {self.top:.6g} m holds "
                f"nothing below z = 0"
            )
        if self.shape == "bowl" and self.floor != -self.radius:
            raise InputError(
                f"a bowl is as deep as its radius: radius {self.radius:.6g} m, floor at {self.floor:.6g} m"
            )

    def volume(self, bottom: float, top: float) -> float:
        """Volume between two heights [m^3]."""
        if self.shape == "box":
            return 4.0 * self.radius**2 * (top - bottom)
        if self.shape == "cylinder":
            return math.pi * self.radius**2 * (top - bottom)
        low, high, above = min(bottom, 0.0), min(top, 0.0), max(top, 0.0) - max(bottom, 0.0)
        return math.pi * (self.radius**2 * (high - low) - (high**3 - low**3) / 3.0) + math.pi * self.radius**2 * above

    @property
    def datum(self) -> float:
        """Height of the undisturbed surface [m]."""
        return 0.0

    def height(self, position: np.ndarray) -> np.ndarray:
        """Height above the datum [m]."""
        return np.asarray(position[:, 2])

    def along(self, position: np.ndarray) -> np.ndarray:
        """Distance from the axis, along the datum [m]."""
        return np.hypot(position[:, 0], position[:, 1])

    def raised(self, by: float) -> Container:
        """The same with its top higher [m]."""
        return replace(self, top=self.top + by)

    def inset(self, by: float) -> Container:
        """The same shape without a layer of this width [m] along floor, sides and top."""
        return replace(self, radius=self.radius - by, floor=self.floor + by, top=max(self.top - by, 0.0))

    def area(self, height: np.ndarray) -> np.ndarray:
        """Cross-section at a height [m^2]."""
        if self.shape == "box":
            return np.full(np.shape(height), 4.0 * self.radius**2)
        if self.shape == "cylinder":
            return np.full(np.shape(height), math.pi * self.radius**2)
        return math.pi * (self.radius**2 - np.minimum(height, 0.0) ** 2)

    def side_depth(self, position: np.ndarray) -> np.ndarray:
        """Distance from the nearest side, of the bowl from its wall [m], positive inside."""
        across = np.hypot(position[:, 0], position[:, 1])
        if self.shape == "box":
            return self.radius - np.abs(position[:, :2]).max(axis=1)
        if self.shape == "cylinder":
            return self.radius - across
        return np.where(position[:, 2] < 0.0, self.radius - np.linalg.norm(position, axis=1), self.radius - across)

    def depth_inside(self, position: np.ndarray) -> np.ndarray:
        """Distance from the nearest wall or the top [m], positive inside."""
        inside = np.minimum(self.side_depth(position), self.top - position[:, 2])
        return inside if self.shape == "bowl" else np.minimum(inside, position[:, 2] - self.floor)

    def drawn_in(self, position: np.ndarray, radius: np.ndarray) -> np.ndarray:
        """Centres (n, 3) [m] of grains of these radii (n,) [m]; those within their radius of floor, sides or top are
        moved inwards until they touch."""
        x, y, z = position.T
        reach = self.radius - radius
        if self.shape == "box":
            return np.column_stack(
                [
                    np.clip(x, -reach, reach),
                    np.clip(y, -reach, reach),
                    np.clip(z, self.floor + radius, self.top - radius),
                ]
            )
        z = np.minimum(z, self.top - radius)
        if self.shape == "cylinder":
            z = np.maximum(z, self.floor + radius)
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
        """Damping rate [1/s]: rises with the square of the depth into the layer along the sides."""
        if self.damped_width <= 0.0:
            return np.zeros(len(position))
        return self.damping_rate * np.clip(1.0 - self.side_depth(position) / self.damped_width, 0.0, 1.0) ** 2

    def outside(self, position: np.ndarray) -> np.ndarray:
        """Whether a grain's centre is beyond the sides."""
        return self.side_depth(position) < 0.0

    def as_attribute(self) -> dict[str, Any]:
        """Plain values for a snapshot's attribute ``domain`` (with the snapshot's ``frame`` = ``plane``)."""
        return {
            "shape": self.shape, "radius_m": self.radius, "floor_m": self.floor, "datum_m": 0.0, "top_m": self.top,
            "damped_width_m": self.damped_width,
            "damping_rate_1_s": self.damping_rate, "floor_species": self.floor_species,
            "side_species": self.side_species,
        }  # fmt: skip

    @staticmethod
    def of_attribute(values: dict[str, Any]) -> Container:
        """The container that a snapshot records."""
        missing = [key for key in _KEYS if key not in values]
        if missing:
            raise InputError(f"the snapshot's attribute 'domain' lacks {', '.join(missing)}")
        radius, floor, top, width, rate = (
            float(values[key]) for key in ("radius_m", "floor_m", "top_m", "damped_width_m", "damping_rate_1_s")
        )
        return Container(
            str(values["shape"]),
            radius,
            floor,
            top,
            width,
            rate,
            int(values["floor_species"]),
            int(values["side_species"]),
        )
