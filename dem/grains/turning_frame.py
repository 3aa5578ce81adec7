"""The frame that turns with a body, omega constant about an axis through the centre of mass.

The grains of a run move in the inertial frame. In the turning frame, which agrees with it at the time 0, a body at
rest stays where it is; there a bed settles:

    x' = R(-omega t) x,   v' = R(-omega t) (v - omega x x),   spin' = R(-omega t) (spin - omega)
    a' = g - omega x (omega x x') - 2 omega x v'

The force of Coriolis is zero at rest and left out while a bed settles: nothing that lasts depends on it. What rests
in the turning frame is in balance in the inertial one, with v = omega x x and the spin omega of every grain
(``inertial``); its contacts turn with it (``dem.contact.turned``).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dem.grains import cached_gravity
from dem.grains.grain_list import GrainList
from matter.geometry.rotation import rotation


@dataclass(frozen=True)
class Centrifugal:
    """-omega x (omega x (x - x_c)) [m/s^2] about an axis through the centre of mass x_c; ``omega`` (3,) [1/s]."""

    omega: np.ndarray

    def add(self, bed: GrainList, pull: np.ndarray) -> None:
        """Add it to ``pull`` (moving grains, 3)."""
        away = self._away(bed)
        pull += float(self.omega @ self.omega) * away - np.outer(away @ self.omega, self.omega)

    def energy(self, bed: GrainList, part: np.ndarray | slice) -> float:
        """-1/2 sum m |omega x (x - x_c)|^2 [J]."""
        m, x = bed.mass, bed.position
        centre = m[: bed.moving] @ x[: bed.moving] / m[: bed.moving].sum()
        fast = np.cross(self.omega, x[part] - centre)
        return float(-0.5 * m[part] @ np.einsum("ij,ij->i", fast, fast))

    def _away(self, bed: GrainList) -> np.ndarray:
        m, x = bed.mass[: bed.moving], bed.position[: bed.moving]
        return np.asarray(x - (m @ x) / m.sum())


class Held:
    """Net force and torque of all that acts are taken out: a body that settles neither falls nor tumbles in the
    turning frame (a packing of grains turns about an axis that is not quite its own)."""

    def add(self, bed: GrainList, pull: np.ndarray) -> None:
        """Take them out of ``pull`` (moving grains, 3); stands last."""
        cached_gravity.without_net(bed, pull)

    def energy(self, bed: GrainList, part: np.ndarray | slice) -> float:
        """None of its own."""
        return 0.0


def inertial(
    position: np.ndarray, velocity: np.ndarray, spin: np.ndarray, omega: np.ndarray, time: float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places, velocities and spins (n, 3) in the inertial frame of what has these in the turning one."""
    turn = rotation(omega * time)
    turned = position @ turn.T
    return turned, velocity @ turn.T + np.cross(omega, turned), spin @ turn.T + omega


def turning(
    position: np.ndarray, velocity: np.ndarray, spin: np.ndarray, omega: np.ndarray, time: float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The inverse of ``inertial``."""
    back = rotation(-omega * time)
    return position @ back.T, (velocity - np.cross(omega, position)) @ back.T, (spin - omega) @ back.T
