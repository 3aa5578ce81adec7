"""What flies over a body beside an engine: Kepler orbits about its centre, and the box that holds all that comes back
in time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dem.contact.gravity import Field
from matter.geometry.ground_region import Cone

BOX_LIMIT = 5.0
"""Half the edge of the box at most, in radii of the body."""
_TINY = 1e-300


@dataclass(frozen=True)
class OverBody:
    """The space over the ``domain`` of a body whose ``gravity`` points to its centre."""

    domain: Cone
    gravity: Field

    @property
    def gm(self) -> float:
        """G M [m^3/s^2]."""
        return float(self.gravity.strength(np.array(self.gravity.radius))) * self.gravity.radius**2

    def pull(self, x: np.ndarray) -> np.ndarray:
        """Acceleration (n, 3) [m/s^2] at ``x`` (n, 3)."""
        r = np.linalg.norm(x, axis=1)
        return x * (-self.gravity.strength(r) / r)[:, None]

    def stays_away(self, x: np.ndarray, v: np.ndarray, rest: float) -> np.ndarray:
        """Mask of what moves outwards and is not back at the radius where it is now within ``rest`` [s].

        Twice the time to the apoapsis of the Kepler orbit: (pi - M) / n with M the mean anomaly, n the mean motion.
        """
        r, gm = np.linalg.norm(x, axis=1), self.gm
        energy = 0.5 * np.einsum("ij,ij->i", v, v) - gm / r
        axis = gm / np.maximum(-2.0 * energy, 1e-12 * gm / r)
        moment2 = np.einsum("ij,ij->i", *(np.cross(x, v),) * 2)
        eccentricity = np.sqrt(np.maximum(1.0 - moment2 / (gm * axis), 1e-24))
        anomaly = np.arccos(np.clip((1.0 - r / axis) / eccentricity, -1.0, 1.0))
        back = 2.0 * (np.pi - anomaly + eccentricity * np.sin(anomaly)) * np.sqrt(axis**3 / gm)
        outward = np.einsum("ij,ij->i", x, v) > 0.0
        return outward & ((energy >= 0.0) | (back > rest))

    def reach(self, x: np.ndarray, v: np.ndarray, rest: float, largest: float) -> float:
        """Half the edge of the box [m]: as far as these bound grains can rise in ``rest`` [s], within ``BOX_LIMIT``;
        ``largest`` radius of a grain [m]."""
        r, speed = np.linalg.norm(x, axis=1), np.linalg.norm(v, axis=1)
        energy = 0.5 * speed**2 - self.gm / r
        apoapsis = np.where(energy < 0.0, self.gm / np.maximum(-energy, _TINY), np.inf)
        rise = np.minimum(apoapsis, r + speed * rest)
        widest = self.domain.top + 10.0 * largest
        return float(np.clip(1.02 * np.max(rise), 1.1 * widest, BOX_LIMIT * self.domain.datum))

    def past_side(self, x: np.ndarray, travel: np.ndarray) -> np.ndarray:
        """Mask of what can have left through the cone or beside it within ``travel`` (n,) [m]."""
        distance = np.linalg.norm(x, axis=1)
        return np.asarray((self.domain.half_angle - self.domain.polar_angle(x)) * distance < travel)
