"""What the pass over all pairs leaves (``sph.pairs.rates``): the time derivatives of the particles, and what it learns
on the way."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from matter.files import checkpoint


class Sums(NamedTuple):
    """The arrays of ``Rates``, as the loop fills them."""

    acceleration: np.ndarray
    density: np.ndarray
    energy: np.ndarray
    stress: np.ndarray
    divergence: np.ndarray
    approach: np.ndarray
    approaching: np.ndarray
    number: np.ndarray
    strain_rate: np.ndarray
    mean_pressure: np.ndarray


class Rates:
    """Time derivatives and by-products of one evaluation, kept from step to step.

    ``acceleration`` (n, 3), ``density`` [kg/(m^3 s)], ``energy`` [W/kg], ``stress`` (n, 5) [Pa/s], ``divergence`` of
    velocity [1/s], ``approach`` the largest -mu [m/s] of the viscosity, ``approaching`` the fraction of the neighbours
    that it brakes (``sph.stepping.timestep``), ``count`` neighbours inside the support, ``mean_pressure`` [Pa] of the
    neighbours (``sph.pairs.bearing_pressure``).
    """

    def __init__(self, n: int, strain_rate: bool = False):
        self.acceleration, self.stress = np.zeros((n, 3)), np.zeros((n, 5))
        self.density, self.energy, self.divergence, self.approach = (np.zeros(n) for _ in range(4))
        self.approaching = np.zeros(n)
        self.strain_rate = np.zeros((n if strain_rate else 0, 6))
        self.mean_pressure = np.zeros(n)
        self.count = np.zeros(n, dtype=np.int32)

    @property
    def sums(self) -> Sums:
        """The arrays as the compiled loop takes them."""
        return Sums(
            self.acceleration,
            self.density,
            self.energy,
            self.stress,
            self.divergence,
            self.approach,
            self.approaching,
            self.count,
            self.strain_rate,
            self.mean_pressure,
        )

    def state(self) -> dict[str, np.ndarray]:
        """Every array, for a checkpoint, but for the rates of strain and the mean pressures, which are the cloud's."""
        return {name: array for name, array in vars(self).items() if name not in ("strain_rate", "mean_pressure")}

    def restore(self, saved: checkpoint.State) -> None:
        """Take up a ``state``."""
        for name, array in self.state().items():
            array[:] = saved[name]
