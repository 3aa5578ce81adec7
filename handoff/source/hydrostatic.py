"""The undisturbed target against height: gravity, pressure, density, escape; what excess pressure and ballistic flight
refer to."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from matter.errors import InputError
from matter.files import archive


@dataclass(frozen=True)
class Column:
    """Profiles of the undisturbed body against ``height`` [m] above the datum, ascending.

    ``pressure`` [Pa], ``gravity`` [m/s^2] (positive downwards); ``body_radius`` [m] is infinite for flat ground, where
    gravity is uniform.
    """

    height: np.ndarray
    pressure: np.ndarray
    gravity: np.ndarray
    body_radius: float = math.inf
    surface_gravity: float = 0.0

    @property
    def flat(self) -> bool:
        return math.isinf(self.body_radius)

    def pressure_at(self, height: np.ndarray) -> np.ndarray:
        """Hydrostatic pressure [Pa]; zero above the datum."""
        return np.interp(height, self.height, self.pressure, right=0.0)

    def gravity_at(self, height: np.ndarray) -> np.ndarray:
        """Gravity [m/s^2]; falls as 1/r^2 above the datum of a sphere."""
        inside = np.interp(height, self.height, self.gravity)
        if self.flat:
            return inside
        above = (
            self.surface_gravity
            * (self.body_radius / np.maximum(self.body_radius + height, 1e-3 * self.body_radius)) ** 2
        )
        return np.where(height > 0.0, above, inside)

    def escape_speed(self, height: np.ndarray) -> np.ndarray:
        """sqrt(2 G M / r) [m/s]; infinite over flat ground."""
        if self.flat:
            return np.full(np.shape(height), math.inf)
        r = np.maximum(self.body_radius + np.asarray(height), 1e-3 * self.body_radius)
        return np.sqrt(2.0 * self.surface_gravity * self.body_radius**2 / r)

    def apex(self, height: np.ndarray, upward: np.ndarray, speed: np.ndarray) -> np.ndarray:
        """Greatest height [m] that free flight reaches from ``height`` with the upward and the total speed [m/s].

        Sphere: the larger root of the radial energy equation e r^2 + mu r - l^2/2 = 0, with e = v^2/2 - mu/r and l = r
        v_t; infinite at and beyond escape. What moves downwards has its apex where it is.
        """
        g = self.surface_gravity
        rising = upward > 0.0
        if self.flat:
            return np.where(rising, height + upward**2 / (2.0 * g), height)
        mu = g * self.body_radius**2
        r = np.maximum(self.body_radius + height, 1e-3 * self.body_radius)
        energy = 0.5 * speed**2 - mu / r
        momentum = r**2 * np.maximum(speed**2 - upward**2, 0.0)
        bound = energy < 0.0
        e = np.where(bound, energy, -1.0)
        far = (-mu - np.sqrt(np.maximum(mu**2 + 2.0 * e * momentum, 0.0))) / (2.0 * e)
        return np.where(rising, np.where(bound, far - self.body_radius, math.inf), height)


def uniform(gravity: float, density: float, depth: float) -> Column:
    """Flat ground of one density [kg/m^3] under uniform gravity [m/s^2], down to ``depth`` [m]."""
    height = np.array([-abs(depth), 0.0])
    return Column(height, np.array([density * gravity * abs(depth), 0.0]), np.full(2, gravity), math.inf, gravity)


def from_target(target: Mapping[str, Any], datum: float) -> Column:
    """The column of ``2_sph/target.json`` about the datum radius [m] (flat ground: ``height_m`` above z = 0). Raises
    ``InputError`` naming what is missing."""
    if target.get("frame") == "solid":
        return _of_solid(target, datum)
    flat = target.get("frame") == "plane"
    upwards = "height_m" if flat else "radius_m"
    try:
        table = target["profile"]
        distance, pressure, gravity = (
            np.asarray(table[name], dtype=float) for name in (upwards, "pressure_Pa", "gravity_m_s2")
        )
        surface = float(target["surface_gravity_m_s2"])
    except KeyError as missing:
        raise InputError(f"target.json lacks {missing}") from None
    if len(distance) < 2 or np.any(np.diff(distance) <= 0.0) or not surface > 0.0:
        raise InputError(f"target.json: profile.{upwards} must ascend and surface_gravity_m_s2 be positive")
    if flat:
        return Column(distance, pressure, gravity, math.inf, surface)
    inside = distance <= float(target.get("radius_m", distance[-1])) * (1.0 + 1e-9)
    return Column(distance[inside] - datum, pressure[inside], gravity[inside], datum, surface)


def _of_solid(target: Mapping[str, Any], radius: float) -> Column:
    """The column of a body of any shape: that of the ball of its mass and volume, of one density.

    g(r) = g r / R, P(r) = rho g (R^2 - r^2) / 2 R with g = G M / R^2 and rho = M / V.
    """
    try:
        surface = float(target["surface_gravity_m_s2"])
        density = float(target["mass_kg"]) / float(target["volume_m3"])
    except KeyError as missing:
        raise InputError(f"target.json lacks {missing}") from None
    distance = np.linspace(0.0, radius, 101)
    pressure = 0.5 * density * surface / radius * (radius**2 - distance**2)
    return Column(distance - radius, pressure, surface / radius * distance, radius, surface)


def read(path: Path, datum: float) -> Column:
    """``from_target`` of a file. Raises ``InputError`` when it is missing or unreadable."""
    if not path.is_file():
        raise InputError(f"no target profile at {path}")
    return from_target(archive.read_json(path), datum)
