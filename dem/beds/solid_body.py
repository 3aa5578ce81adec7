"""A solid body without projectile (frame ``solid``): what ``2_sph/target.json`` says of it, and its surface.

Everything is in the frame of the run at the moment of the impact, when the turning frame and the inertial one agree
(``dem.grains.turning_frame``): the centre of mass at the origin, the site on +z.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from dem.contact.gravity import Field
from dem.grains import tide
from dem.grains.tide import Tide
from matter.case import at_rest
from matter.case.at_rest import AtRest
from matter.case.body import Target
from matter.constants import G
from matter.errors import InputError
from matter.files import archive
from matter.solids.distance import Distance, measured
from matter.solids.placed import Placed
from matter.solids.solid import Solid

_KEYS = ("volume_m3", "mass_kg", "material", "angular_velocity_1_s", "companion")
SAME = 1e-6
"""Largest relative difference of the volumes of one body in ``target.json`` and in the settings."""


def is_solid(path: Path) -> bool:
    """Whether a ``target.json`` describes a solid of any shape (False when it cannot be read: its reader says why)."""
    try:
        return bool(json.loads(path.read_text()).get("frame") == "solid")
    except (OSError, ValueError, AttributeError):
        return False


@lru_cache(maxsize=2)
def _distance(solid: Solid) -> Distance:
    return measured(solid)


@dataclass(frozen=True, eq=False)
class SolidBody:
    """``placed`` surface; ``mass`` [kg]; ``material``; ``omega`` (3,) [1/s] of its rotation; ``companion``: the
    companion's mass [kg], position (3,) [m] and axis (3,) of its circle, or None."""

    placed: Placed
    mass: float
    material: str
    omega: np.ndarray
    companion: tuple[float, np.ndarray, np.ndarray] | None

    @staticmethod
    def read(path: Path, target: Target | None) -> SolidBody:
        """The body of a ``target.json`` with the surface of the settings' ``target``; ``InputError`` says what is
        missing, or that they are two bodies."""
        content: dict[str, Any] = archive.read_json(path)
        if missing := [key for key in _KEYS if key not in content]:
            raise InputError(f"{path} lacks {', '.join(missing)}")
        if target is None or not target.solid:
            raise InputError(f'{path} describes a solid: [target] shape = "ellipsoid" or "mesh" must say which')
        placed = target.placed
        volume = float(content["volume_m3"])
        if abs(volume / placed.solid.volume - 1.0) > SAME:
            raise InputError(
                f"{path}: a body of {volume:.7g} m^3, that of [target] has {placed.solid.volume:.7g} m^3: they are two"
            )
        companion = content["companion"] and (
            float(content["companion"]["mass_kg"]),
            np.array(content["companion"]["place_m"], dtype=float),
            np.array(content["companion"]["axis"], dtype=float),
        )
        omega = np.array(content["angular_velocity_1_s"], dtype=float)
        return SolidBody(placed, float(content["mass_kg"]), str(content["material"]), omega, companion or None)

    @staticmethod
    def expected(target: Target, densities: Mapping[str, AtRest]) -> SolidBody:
        """The body of a ``target`` before there is a ``target.json``, as dense as its material is at rest."""
        placed, one, name = target.placed, target.companion, target.layers[0].material
        mass = at_rest.densities_at_rest(name, densities).bulk * placed.solid.volume
        companion = None
        if one is not None:
            companion = one.mass, placed.over_equator(one.distance), placed.spin_axis
        return SolidBody(placed, mass, name, placed.spin(target.spin_period), companion)

    @property
    def solid(self) -> Solid:
        """The surface."""
        return self.placed.solid

    @property
    def distance(self) -> Distance:
        """Depths below the surface. Raises ``InputError`` where it cuts itself."""
        try:
            return _distance(self.solid)
        except InputError as reason:
            raise InputError(f"[target] file: {reason}") from None

    @property
    def density(self) -> float:
        """Bulk density [kg/m^3]."""
        return self.mass / self.solid.volume

    def gravity(self) -> Field:
        """None but the grains' own."""
        return Field.constant((0.0, 0.0, 0.0))

    @property
    def surface_gravity(self) -> float:
        """g [m/s^2] of the ball of the same mass and volume at its surface."""
        return G * self.mass / self.solid.radius**2

    def felt(self, position: np.ndarray, attraction: np.ndarray) -> np.ndarray:
        """Acceleration (n, 3) [m/s^2] of what rests on the turning body at ``position`` (n, 3) [m], under an
        ``attraction`` (n, 3) of it: with the centrifugal part and the companion's tide,

            a = g - omega x (omega x x) + G M ((d - x) / |d - x|^3 - d / |d|^3)
        """
        a = attraction + np.linalg.norm(self.omega) ** 2 * position
        a -= np.outer(position @ self.omega, self.omega)
        if self.companion is not None:
            mass, d, _ = self.companion
            way = d - position
            a += G * mass * (way / np.linalg.norm(way, axis=1)[:, None] ** 3 - d / np.linalg.norm(d) ** 3)
        return np.asarray(a)

    @property
    def central_pressure(self) -> float:
        """2/3 pi G rho^2 R^2 [Pa] of that ball."""
        return 2.0 / 3.0 * math.pi * G * (self.density * self.solid.radius) ** 2

    @property
    def spin_over_shedding(self) -> float:
        """omega over that at which the equator of that ball would weigh nothing, sqrt(4 pi G rho / 3)."""
        return float(np.linalg.norm(self.omega)) / math.sqrt(4.0 / 3.0 * math.pi * G * self.density)

    def tide(self, turning: bool) -> Tide | None:
        """The companion's tide, in the frame that turns with the body (where it is taken to stay where it is at the
        moment of the impact) or in the inertial one."""
        if self.companion is None:
            return None
        mass, position, axis = self.companion
        n = tide.rate(mass, self.mass, float(np.linalg.norm(position)))
        return Tide(mass, position, np.zeros(3) if turning else n * axis)

    @property
    def hill_radius(self) -> float:
        """d (m / 3 M)^(1/3) [m]: beyond it the companion pulls more than the body holds; inf without one.

        Source: Murray & Dermott 1999, Solar System Dynamics, eq. 3.75."""
        if self.companion is None:
            return math.inf
        return float(np.linalg.norm(self.companion[1])) * math.cbrt(self.mass / (3.0 * self.companion[0]))

    def latitude_longitude(self, position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Planetocentric latitude and longitude [deg] of positions (n, 3), in the body's own frame."""
        own = position @ self.placed.turn
        r = np.maximum(np.linalg.norm(own, axis=1), 1e-300)
        return np.degrees(np.arcsin(own[:, 2] / r)), np.degrees(np.arctan2(own[:, 1], own[:, 0]))
