"""Budget of the momentum and energy that boundaries and gravity give to the matter; the conservation check of flat
ground needs it.

    weight        m g of what may move; its work is in m g z
    fixed rim     what pairs gave the rim's particles and the rim kept: -m a, -m du/dt
    quiet layer   m v and m (v^2 / 2 + u) after it has faded, less before
    wall          the sum of m a over all particles, along its axis

Kicks are booked as ``sph.stepping.leapfrog`` gives them, half a step with the rates before and half with those after,
angular momentum about the origin at the positions of each: what is left of p - p_0 once this is taken away is what
pairs do not conserve. Along the axis of a wall that is not to be told apart from what the wall gives.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from matter.compilation.jit import inner_kernel, kernel
from sph.boundary.edge import Edge
from sph.boundary.wall import Wall

COLUMNS = (
    "outside_momentum_x outside_momentum_y outside_momentum_z outside_angular_momentum_x outside_angular_momentum_y "
    "outside_angular_momentum_z outside_energy_J"
).split()
LX, LY, LZ, ENERGY = range(3, 7)
"""Of them: angular momentum and energy; momentum stands before."""
_KEPT = ("given", "rate")


@inner_kernel
def _book(total, weight, x, p):
    """Add the momentum ``weight p`` at the position ``x`` to ``total`` (7,)."""
    for c in range(3):
        total[c] += weight * p[c]
    total[LX] += weight * (x[1] * p[2] - x[2] * p[1])
    total[LY] += weight * (x[2] * p[0] - x[0] * p[2])
    total[LZ] += weight * (x[0] * p[1] - x[1] * p[0])


@kernel
def _rim(identity, fixed, mass, position, acceleration, energy, rate):
    """Subtract from ``rate`` (7,) the momentum and energy that pairs give to the rim."""
    for i in range(len(mass)):
        if fixed[identity[i]]:
            _book(rate, -mass[i], position[i], acceleration[i])
            rate[ENERGY] -= mass[i] * energy[i]


@kernel
def _weight(identity, fixed, mass, position, pull, rate):
    """Add the weight of what may move (``fixed`` empty: all) to ``rate``."""
    for i in range(len(mass)):
        if len(fixed) == 0 or not fixed[identity[i]]:
            _book(rate, mass[i], position[i], pull)


@kernel
def _layer_sums(identity, kappa, mass, position, velocity, energy, total):
    """Add momentum, angular momentum and energy of the layer to ``total``."""
    for i in range(len(mass)):
        if kappa[identity[i]] > 0.0:
            v = velocity[i]
            _book(total, mass[i], position[i], v)
            total[ENERGY] += mass[i] * (0.5 * (v[0] ** 2 + v[1] ** 2 + v[2] ** 2) + energy[i])


def _all_layers(cloud, edge: Edge) -> np.ndarray:
    total = np.zeros(7)
    for kappa in edge.layers.values():
        _layer_sums(cloud.identity, kappa, cloud.mass, cloud.position, cloud.velocity, cloud.specific_energy, total)
    return total


class ExternalBudget:
    """``given`` (7,): momentum [kg m/s], angular momentum [kg m^2/s] and energy [J] given so far; ``rate`` (7,), per
    second, of the last evaluation."""

    def __init__(self, environment):
        self.given, self.rate = np.zeros(7), np.zeros(7)
        self.pull = np.array([0.0, 0.0, -environment.down])
        planes = () if environment.images is None else environment.images.planes
        self.walls = sorted({plane.axis for plane in planes if isinstance(plane, Wall)})

    def evaluate(self, cloud, rates, edge: Edge | None) -> None:
        """The present rates, before those of the rim of ``edge`` are set to zero."""
        self.rate[:] = 0.0
        for axis in self.walls:
            self.rate[axis] = float(cloud.mass @ rates.acceleration[:, axis])
        fixed = np.zeros(0, dtype=bool) if edge is None else edge.fixed
        if self.pull[2] != 0.0:
            _weight(cloud.identity, fixed, cloud.mass, cloud.position, self.pull, self.rate)
        if len(fixed):
            _rim(cloud.identity, fixed, cloud.mass, cloud.position, rates.acceleration, rates.energy, self.rate)

    def kick(self, dt: float) -> None:
        """Book ``dt`` [s] of the rates of the last evaluation."""
        self.given += dt * self.rate

    def fade(self, cloud, edge: Edge, wave: np.ndarray, dt: float) -> None:
        """One step of the layers of ``edge``, booked."""
        self.given -= _all_layers(cloud, edge)
        edge.fade(cloud, wave, dt)
        self.given += _all_layers(cloud, edge)

    def state(self) -> dict[str, Any]:
        """Arrays for a checkpoint, by name."""
        return {f"outside_{name}": getattr(self, name) for name in _KEPT}

    def restore(self, numbers: Mapping[str, Any]) -> None:
        """Restore a ``state``; NaN for runs whose checkpoint lacks the budget."""
        for name in _KEPT:
            getattr(self, name)[:] = numbers.get(f"outside_{name}", np.nan)
