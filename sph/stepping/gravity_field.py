"""Gravity of the particles: their own by the tree, uniform gravity besides.

The field is kept until a bound particle has moved by ``gravity_shift`` of its h. A field younger than ``REFRESH_AGE``
of the free-fall time sqrt(R^3 / G M) is kept in any case. In that time even the projectile crosses 2 % of the body, so
that its g of some 1 m/s^2, beside shock accelerations of 1000 m/s^2, is off by 5 %; without the exception it alone
would call for a new field at almost every step of the impact.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from matter.geometry import tree
from sph.bodies import symmetry
from sph.bodies.particle_cloud import PARTS, Cloud, moved_further
from sph.stepping import state
from sph.stepping.environment import Environment

REFRESH_AGE = 0.002  # of sqrt(R^3 / G M)
THETA = 0.5
"""Opening angle of the tree: 2e-4 off in the mean."""


def softening(cloud: Cloud) -> np.ndarray:
    """Plummer length of every particle: a quarter of its first support, half its spacing [m]; it stays, or the field
    would not be that of an energy."""
    return 0.25 * cloud.start_support


class GravityField:
    """The gravity of a cloud, written to ``cloud.gravity``.

    ``time`` [s] of the last evaluation by the tree, number of ``evaluations``, and ``correction``, the largest net
    force that was taken out, relative. ``shift`` : ``gravity_shift`` of the numerics.
    """

    def __init__(self, cloud: Cloud, radius: float, shift: float, environment: Environment):
        self.environment, self.shift = environment, shift
        self.time, self.evaluations, self.correction = 0.0, 0, 0.0
        self._moved = np.zeros(PARTS, dtype=np.bool_)
        self._min_age = REFRESH_AGE * float(
            np.sqrt(radius**3 / (tree.G * cloud.mass.sum() * symmetry.copies(environment.symmetry)))
        )

    def evaluate(self, cloud: Cloud, time: float) -> None:
        """Fill ``cloud.gravity`` for the present positions at ``time`` [s]."""
        environment = self.environment
        if not environment.self_gravity:
            cloud.gravity[:] = (0.0, 0.0, -environment.down)
            cloud.gravity_position[:] = cloud.position
            return
        position, mass, length = cloud.position, cloud.mass, softening(cloud)
        if environment.symmetry != "none":
            parts = symmetry.copies(environment.symmetry)
            position = symmetry.unfolded(position, environment.symmetry)
            mass, length = np.tile(mass, parts), np.tile(length, parts)
        raw = tree.gravity(position, mass, length, THETA)
        field, size = tree.remove_net_force(raw, position, mass)
        cloud.gravity[:] = field[: len(cloud)]
        if environment.down > 0.0:
            cloud.gravity[:, 2] -= environment.down
        cloud.gravity_position[:] = cloud.position
        self.time = time
        self.evaluations += 1
        self.correction = max(self.correction, size)

    def update(self, cloud: Cloud, time: float) -> None:
        """Evaluate the field where it is stale."""
        if self._is_stale(cloud, time):
            self.evaluate(cloud, time)

    def _is_stale(self, cloud: Cloud, time: float) -> bool:
        if not self.environment.self_gravity:
            return False
        if self.shift > 0.0 and time - self.time < self._min_age:
            return False
        moved_further(
            cloud.position,
            cloud.gravity_position,
            self.shift * cloud.support_radius,
            cloud.neighbours,
            state.BOUND,
            self._moved,
        )
        return bool(self._moved.any())

    def state(self) -> dict[str, Any]:
        """Numbers for a checkpoint."""
        return {
            "gravity_time": self.time,
            "gravity_evaluations": self.evaluations,
            "gravity_correction": self.correction,
        }

    def restore(self, numbers: Mapping[str, Any]) -> None:
        """Take up a ``state``."""
        self.time, self.correction = float(numbers["gravity_time"]), float(numbers["gravity_correction"])
        self.evaluations = int(numbers["gravity_evaluations"])
